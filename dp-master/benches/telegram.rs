//! What has a budget: encode, decode, one exchange through the virtual line.
//!
//! Run with `cargo bench -p dp-master --bench telegram`. Budgets: encode and decode of an SRD with 16 octets below 30 ns each; an exchange
//! of 25 + 25 characters below 400 ns.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dp_master::address::Address;
use dp_master::phy::{Disturbance, PortId, VirtualBus, pump};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Instant};
use dp_master::wire::{
    Decoder, Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram,
    decode_one,
};

const DATA: [u8; 16] = [0x5A; 16];

fn request() -> Telegram<'static> {
    let (da, sa) = (Address::MAX_STATION, Address::MAX_STATION);
    Telegram::Data {
        header: Header::new(
            da,
            sa,
            FunctionCode::request(Fcb::High, RequestFunction::SrdHigh),
        ),
        data: &DATA,
    }
}

fn response() -> Telegram<'static> {
    let (da, sa) = (Address::MAX_STATION, Address::MAX_STATION);
    Telegram::Data {
        header: Header::new(
            da,
            sa,
            FunctionCode::response(StationType::Slave, ResponseFunction::DataLow),
        ),
        data: &DATA,
    }
}

fn octets(telegram: &Telegram<'_>) -> Vec<u8> {
    let mut buf = [0; MAX_TELEGRAM];
    let length = telegram.encode(&mut buf).expect("a valid telegram");
    buf[..length].to_vec()
}

fn wire(c: &mut Criterion) {
    let mut group = c.benchmark_group("wire");
    let mut buf = [0; MAX_TELEGRAM];
    let telegram = request();
    group.bench_function("encode SRD with 16 octets", |b| {
        b.iter(|| black_box(&telegram).encode(black_box(&mut buf)))
    });
    let encoded = octets(&telegram);
    group.bench_function("decode SRD with 16 octets", |b| {
        b.iter(|| decode_one(black_box(&encoded)).map(|(_, length)| length))
    });
    let mut decoder = Decoder::new();
    group.bench_function("push SRD whole", |b| {
        b.iter(|| {
            decoder.push(black_box(&encoded), |decoded| {
                black_box(decoded);
            })
        })
    });
    group.bench_function("push SRD first character, then rest", |b| {
        b.iter(|| {
            let (first, rest) = black_box(&encoded[..]).split_at(1);
            decoder.push(first, |decoded| {
                black_box(decoded);
            });
            decoder.push(rest, |decoded| {
                black_box(decoded);
            });
        });
    });
    group.finish();
}

/// Sends the same telegram again after a pause.
struct Trivial {
    telegram: Vec<u8>,
    pause: BitTimes,
    next: Option<Instant>,
    wants: bool,
    missing: usize,
}

impl Trivial {
    fn new(telegram: &Telegram<'_>, pause: u32, next: Option<Instant>) -> Self {
        Self {
            telegram: octets(telegram),
            pause: BitTimes(pause),
            next,
            wants: false,
            missing: 25,
        }
    }
}

impl Station for Trivial {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.missing -= octets.len();
        if self.missing == 0 {
            self.missing = 25;
            self.next = Some(now + Baud::B12000000.duration(self.pause));
        }
    }
    fn handle_line_error(&mut self, _: Instant, _: LineError) {}
    fn handle_sent(&mut self, _: Instant) {}
    fn handle_timeout(&mut self, _: Instant) {
        self.wants = true;
        self.next = None;
    }
    fn poll_transmit(&mut self, _: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        if !std::mem::take(&mut self.wants) {
            return None;
        }
        buf[..self.telegram.len()].copy_from_slice(&self.telegram);
        Some(self.telegram.len())
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

fn exchange(c: &mut Criterion) {
    let mut group = c.benchmark_group("virtual line");
    group.throughput(Throughput::Elements(1));
    for (name, rate) in [
        ("25 + 25 characters", 0.0),
        ("25 + 25 characters, bit error rate 1e-12", 1e-12),
    ] {
        let mut bus = VirtualBus::new(Baud::B12000000);
        if rate > 0.0 {
            bus.set_disturbance(Some(Disturbance::new(1, rate).expect("a probability")));
        }
        let ports = [bus.attach(), bus.attach()];
        let mut master = Trivial::new(&request(), 33, Some(Instant::ZERO));
        let mut slave = Trivial::new(&response(), 11, None);
        let mut stations: [(PortId, &mut dyn Station); 2] =
            [(ports[0], &mut master), (ports[1], &mut slave)];
        let mut now = Instant::ZERO;
        group.bench_function(name, |b| {
            b.iter(|| {
                let end = bus.bursts() + 2;
                while bus.bursts() < end {
                    now = pump(&mut bus, now, &mut stations).expect("the exchange goes on");
                }
            });
        });
        assert!(
            bus.violations().is_empty(),
            "{:?}",
            bus.violations().first()
        );
    }
    group.finish();
}

criterion_group!(benches, wire, exchange);
criterion_main!(benches);
