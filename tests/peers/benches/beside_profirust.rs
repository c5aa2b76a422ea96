//! This stack beside `profirust` 0.6.0, in one run.
//!
//! `cargo bench -p peers --bench beside_profirust`; the ratios of the medians are what counts, see `BENCHMARKS.md`.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use dp_master::address::Address;
use dp_master::station::MAX_TELEGRAM;
use dp_master::wire::{
    Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram, decode_one,
};
use peers::{Calls, OurCycles, PeerCycles};
use profirust::fdl::{
    DataTelegramHeader, FrameCountBit, FunctionCode as PeerFc, RequestType, ResponseState, ResponseStatus,
    Telegram as PeerTelegram, TelegramTx,
};

const DATA: [u8; 16] = *b"0123456789abcdef";

/// Request and response of one SRD, 16 octets each: both written and both read, as a master and a slave do together.
fn srd(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("SRD 16 + 16, encode + decode");
    let station = |value| Address::new(value).expect("a station address");
    let (master, slave) = (station(2), station(3));
    let request = Header::new(
        slave,
        master,
        FunctionCode::request(Fcb::High, RequestFunction::SrdHigh),
    );
    let response = Header::new(
        master,
        slave,
        FunctionCode::response(StationType::Slave, ResponseFunction::DataLow),
    );
    let ours = |header: &Header, buf: &mut [u8; MAX_TELEGRAM]| {
        let telegram = Telegram::Data {
            header: *header,
            data: black_box(&DATA),
        };
        telegram.encode(buf).expect("it fits")
    };
    let peer_request = DataTelegramHeader {
        da: 3,
        sa: 2,
        dsap: None,
        ssap: None,
        fc: PeerFc::Request {
            fcb: FrameCountBit::High,
            req: RequestType::SrdHigh,
        },
    };
    let peer_response = DataTelegramHeader {
        da: 2,
        sa: 3,
        dsap: None,
        ssap: None,
        fc: PeerFc::Response {
            state: ResponseState::Slave,
            status: ResponseStatus::DataLow,
        },
    };
    let peers = |header: &DataTelegramHeader, buf: &mut [u8; MAX_TELEGRAM]| {
        TelegramTx::new(buf)
            .send_data_telegram(header.clone(), DATA.len(), |pdu| pdu.copy_from_slice(black_box(&DATA)))
            .bytes_sent()
    };

    let (mut first, mut second) = ([0; MAX_TELEGRAM], [0; MAX_TELEGRAM]);
    for (header, peer_header) in [(&request, &peer_request), (&response, &peer_response)] {
        let (length, peer_length) = (ours(header, &mut first), peers(peer_header, &mut second));
        assert_eq!(first[..length], second[..peer_length], "the same octets");
    }

    let mut buf = [0; MAX_TELEGRAM];
    group.bench_function("ours", |bench| {
        bench.iter(|| {
            for header in [&request, &response] {
                let length = ours(black_box(header), &mut buf);
                let read = decode_one(black_box(&buf[..length]));
                black_box(&read);
            }
        });
    });
    group.bench_function("profirust", |bench| {
        bench.iter(|| {
            for header in [&peer_request, &peer_response] {
                let length = peers(black_box(header), &mut buf);
                let read = PeerTelegram::deserialize(black_box(&buf[..length]));
                black_box(&read);
            }
        });
    });
    group.finish();
}

/// Processor time of a master per DP cycle; the slaves' answers lie ready.
fn cycles(criterion: &mut Criterion) {
    for slaves in [1, 30] {
        let mut group = criterion.benchmark_group(format!("DP cycle, {slaves} slave(s) with 16 + 16 octets"));
        let mut ours = OurCycles::new(slaves);
        group.bench_function("ours", |bench| bench.iter(|| black_box(ours.cycle())));
        for (name, calls) in [
            ("profirust", Calls::EveryCharacter),
            ("profirust, never called in vain", Calls::Chosen),
        ] {
            let mut peers = PeerCycles::new(slaves, calls);
            group.bench_function(name, |bench| bench.iter(|| black_box(peers.cycle())));
        }
        group.finish();
    }
}

criterion_group!(benches, srd, cycles);
criterion_main!(benches);
