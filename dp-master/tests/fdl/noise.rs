//! A ring of 4 masters and 28 slaves on a noisy line never accepts what nobody has sent.
//!
//! # Residual errors
//!
//! Data telegrams have a Hamming distance of 4: parity finds an odd number of flipped bits in a character, the check sum
//! and the delimiters the rest, up to three in a telegram (`error_detection` tries them all). An undetected error needs
//! at least four: two of the nine bits under parity in each of two characters, and then only those whose sums cancel. In a
//! telegram of 25 characters there are C(25, 2)·C(9, 2)² = 3.9·10⁵ such fours, so at a bit error rate of p = 10⁻⁴ less than
//! 3.9·10⁵·p⁴ = 4·10⁻¹¹ of the telegrams and 4·10⁻⁵ in 10⁶ of them: one would be a fault of the code, not of the standard.
//!
//! A token has neither check sum nor end delimiter; two flipped bits in one address make another token. With p = 10⁻⁴ that
//! happens to 2·C(9, 2)·10⁻⁸ = 7·10⁻⁷ of them. That is why a station takes the token only from its predecessor, or on
//! repetition, and why the ring must survive it; such tokens are counted here and no error.
//!
//! Source: EN 50170-2 part 4, 4.3 (error control) and 4.6 (frame formats, HD = 4).

use std::cell::RefCell;
use std::rc::Rc;

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, LossCause, MasterConfig, MasterEvent, Mode, SlaveConfig, SlaveIdentity,
    SlaveIndex, SlaveState, Watchdog,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{Disturbance, PortId, VirtualBus, pump};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Decoded, Decoder, Telegram, decode_one};

const BAUD: Baud = Baud::B1500000;
const MASTERS: u8 = 4;
const SLAVES_EACH: u8 = 7;
const IMAGE: usize = 16;

fn at(value: u8) -> Address {
    Address::new(value).unwrap()
}

/// Which way an image goes.
#[derive(Clone, Copy)]
enum Way {
    Out = 1,
    In = 2,
}

/// The image number `count` of a slave in one direction: the number, and twelve octets that follow from it (SplitMix64).
fn image(way: Way, slave: u8, count: u32) -> [u8; IMAGE] {
    let mut octets = [0; IMAGE];
    octets[..4].copy_from_slice(&count.to_be_bytes());
    let mut state = u64::from(count) << 16 | u64::from(slave) << 8 | way as u64;
    for chunk in octets[4..].chunks_mut(6) {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        chunk.copy_from_slice(&(z ^ (z >> 31)).to_be_bytes()[..chunk.len()]);
    }
    octets
}

/// The number of an image that is right in every octet and was sent already; zeros are what a slave has before and after
/// exchange.
fn number(way: Way, slave: u8, octets: &[u8], sent: u32) -> Option<u32> {
    if octets.iter().all(|octet| *octet == 0) {
        return None;
    }
    let count = u32::from_be_bytes(octets[..4].try_into().unwrap());
    assert!(count <= sent, "slave {slave}: image {count}, only {sent} sent");
    assert_eq!(
        octets,
        image(way, slave, count),
        "slave {slave}: an image that nobody has sent"
    );
    Some(count)
}

/// What everybody has sent.
struct Truth {
    /// Numbers of the outputs last written, by slave address.
    outputs: [u32; 128],
    /// The last telegrams, the newest first.
    telegrams: [Vec<u8>; 3],
}

impl Truth {
    fn sent(&mut self, octets: &[u8]) {
        self.telegrams.rotate_right(1);
        self.telegrams[0].clear();
        self.telegrams[0].extend_from_slice(octets);
    }
}

type Shared = Rc<RefCell<Truth>>;

/// A slave whose inputs echo its outputs.
struct EchoSlave {
    slave: DpSlave,
    address: u8,
    truth: Shared,
    last: u32,
    images: u64,
}

impl EchoSlave {
    fn check(&mut self) {
        let sent = self.truth.borrow().outputs[usize::from(self.address)];
        let Some(count) = number(Way::Out, self.address, self.slave.outputs(), sent) else {
            return;
        };
        assert!(count >= self.last, "slave {}: outputs went back", self.address);
        if count > self.last {
            self.last = count;
            self.images += 1;
            self.slave.set_inputs(&image(Way::In, self.address, count));
        }
        while self.slave.poll_event().is_some() {}
    }
}

/// A master that writes numbered outputs and checks every image of inputs.
struct CheckedMaster {
    master: DpMaster<7>,
    slaves: Vec<(SlaveIndex, u8, u64)>,
    truth: Shared,
    images: u64,
    losses: u64,
}

impl CheckedMaster {
    fn check(&mut self) {
        for (index, address, exchanges) in &mut self.slaves {
            let now = self.master.exchanges(*index);
            if now == *exchanges {
                continue;
            }
            *exchanges = now;
            let mut truth = self.truth.borrow_mut();
            let sent = &mut truth.outputs[usize::from(*address)];
            number(Way::In, *address, self.master.inputs(*index), *sent);
            self.images += 1;
            *sent += 1;
            self.master
                .set_outputs(*index, &image(Way::Out, *address, *sent))
                .unwrap();
        }
        while let Some(event) = self.master.poll_event() {
            match event {
                MasterEvent::SlaveLost {
                    cause: LossCause::NoAnswer | LossCause::Rejected(_),
                    ..
                } => self.losses += 1,
                MasterEvent::Ring(_) | MasterEvent::DataExchange { .. } => {}
                // Refusals, faults, wrong lengths, diagnosis: nobody has said that.
                other => panic!("{other:?}"),
            }
        }
    }
}

/// Hears everything and compares it with what was sent.
struct Witness {
    decoder: Decoder,
    last_end: Instant,
    truth: Shared,
    telegrams: u64,
    false_tokens: u64,
}

impl Witness {
    fn gap(&mut self, now: Instant, characters: usize) {
        let begin = now - BAUD.characters(characters);
        if begin > self.last_end + BAUD.characters(1) - Duration::from_nanos(2) {
            self.decoder.idle();
        }
        self.last_end = now;
    }
}

impl Station for Witness {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.gap(now, octets.len());
        let sure = self.decoder.is_synchronised();
        let (truth, mut bad) = (self.truth.borrow(), !sure);
        let (telegrams, false_tokens) = (&mut self.telegrams, &mut self.false_tokens);
        self.decoder.push(octets, |found| match found {
            Decoded::Discarded { .. } => bad = true,
            Decoded::Telegram(telegram) if !bad => {
                *telegrams += 1;
                let sent = truth
                    .telegrams
                    .iter()
                    .any(|sent| decode_one(sent).is_ok_and(|(sent, _)| sent == telegram));
                match telegram {
                    Telegram::Token { .. } => *false_tokens += u64::from(!sent),
                    _ => assert!(sent, "accepted, but not sent: {telegram:?}"),
                }
            }
            Decoded::Telegram(_) => {}
        });
    }
    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.gap(now, 1);
        self.decoder.push_line_error(error, |_| {});
    }
    fn handle_sent(&mut self, _: Instant) {}
    fn handle_timeout(&mut self, _: Instant) {}
    fn poll_transmit(&mut self, _: Instant, _: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

macro_rules! checked_station {
    ($type:ty, $inner:ident) => {
        impl Station for $type {
            fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
                self.$inner.handle_octets(now, octets);
                self.check();
            }
            fn handle_line_error(&mut self, now: Instant, error: LineError) {
                self.$inner.handle_line_error(now, error);
            }
            fn handle_sent(&mut self, now: Instant) {
                self.$inner.handle_sent(now);
            }
            fn handle_timeout(&mut self, now: Instant) {
                self.$inner.handle_timeout(now);
            }
            fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
                let length = self.$inner.poll_transmit(now, buf)?;
                self.truth.borrow_mut().sent(&buf[..length]);
                Some(length)
            }
            fn poll_timeout(&self) -> Option<Instant> {
                self.$inner.poll_timeout()
            }
        }
    };
}

checked_station!(EchoSlave, slave);
checked_station!(CheckedMaster, master);

struct Ring {
    bus: VirtualBus,
    now: Instant,
    masters: Vec<CheckedMaster>,
    slaves: Vec<EchoSlave>,
    witness: Witness,
    ports: Vec<PortId>,
}

impl Ring {
    fn new() -> Self {
        Self::with_t_tr(BusParams::standard(BAUD).t_tr)
    }

    fn with_t_tr(t_tr: BitTimes) -> Self {
        let truth = Rc::new(RefCell::new(Truth {
            outputs: [0; 128],
            telegrams: Default::default(),
        }));
        let params = BusParams {
            hsa: at(10),
            // The noise spoils one telegram in forty; five failures in a row are rare.
            retry_limit: 4,
            t_tr,
            ..BusParams::standard(BAUD)
        };
        let (mut masters, mut slaves) = (Vec::new(), Vec::new());
        for place in 0..MASTERS {
            let mut master = DpMaster::new(MasterConfig::new(at(place + 1), params)).unwrap();
            let mut indices = Vec::new();
            for address in (20 + place * SLAVES_EACH..).take(usize::from(SLAVES_EACH)) {
                let mut config = SlaveConfig::new(at(address), 0x00DA, &[0xF3, 0xF3]).unwrap();
                config.watchdog = Some(Watchdog::at_least(Duration::from_millis(500)).unwrap());
                let index = master.add_slave(config).unwrap();
                truth.borrow_mut().outputs[usize::from(address)] = 1;
                master.set_outputs(index, &image(Way::Out, address, 1)).unwrap();
                indices.push((index, address, 0));
                let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
                slaves.push(EchoSlave {
                    slave: DpSlave::new(SlaveIdentity::new(at(address), 0x00DA, BAUD, accepted)).unwrap(),
                    address,
                    truth: truth.clone(),
                    last: 0,
                    images: 0,
                });
            }
            master.set_mode(Mode::Operate);
            masters.push(CheckedMaster {
                master,
                slaves: indices,
                truth: truth.clone(),
                images: 0,
                losses: 0,
            });
        }
        let mut bus = VirtualBus::new(BAUD);
        let ports = (0..masters.len() + slaves.len() + 1).map(|_| bus.attach()).collect();
        let witness = Witness {
            decoder: Decoder::new(),
            last_end: Instant::ZERO,
            truth,
            telegrams: 0,
            false_tokens: 0,
        };
        Self {
            bus,
            now: Instant::ZERO,
            masters,
            slaves,
            witness,
            ports,
        }
    }

    fn run_for(&mut self, span: Duration) {
        self.now += span;
        let masters = self.masters.iter_mut().map(|master| master as &mut dyn Station);
        let slaves = self.slaves.iter_mut().map(|slave| slave as &mut dyn Station);
        let stations = masters.chain(slaves).chain([&mut self.witness as &mut dyn Station]);
        let mut stations: Vec<_> = self.ports.iter().copied().zip(stations).collect();
        pump(&mut self.bus, self.now, &mut stations);
    }

    fn is_whole(&self) -> bool {
        self.masters.iter().all(|checked| {
            let master = &checked.master;
            master.is_in_ring()
                && master.las().len() == usize::from(MASTERS)
                && (checked.slaves.iter()).all(|(index, ..)| master.state(*index) == SlaveState::DataExchange)
        })
    }

    fn run_until_whole(&mut self) {
        let end = self.now + Duration::from_millis(3_000);
        while !self.is_whole() {
            assert!(self.now < end, "the ring is not whole");
            self.run_for(Duration::from_millis(10));
        }
    }
}

#[test]
fn a_ring_of_4_masters_and_28_slaves_accepts_no_corrupted_telegram_in_10_to_the_6() {
    let mut ring = Ring::new();
    ring.run_until_whole();
    ring.bus.set_disturbance(Some(Disturbance::new(2, 1e-4).unwrap()));
    let begin = ring.bus.bursts();
    while ring.bus.bursts() < begin + 1_000_000 {
        ring.run_for(Duration::from_millis(100));
    }
    ring.bus.set_disturbance(None);
    ring.run_until_whole();
    let images: u64 = ring.masters.iter().map(|master| master.images).sum();
    let losses: u64 = ring.masters.iter().map(|master| master.losses).sum();
    let outputs: u64 = ring.slaves.iter().map(|slave| slave.images).sum();
    println!(
        "{} telegrams in {}: {} characters spoiled, {} heard right by a listener, {} tokens altered, {images} images \
         of inputs and {outputs} of outputs checked, slaves lost {losses} times",
        ring.bus.bursts() - begin,
        ring.now,
        ring.bus.statistics().spoiled,
        ring.witness.telegrams,
        ring.witness.false_tokens,
    );
    // The noise was there: 10⁶ telegrams have more than 10⁷ characters of 11 bits.
    assert!(ring.bus.statistics().spoiled > 10_000);
    // And the exchange went on. Three telegrams in four are requests and replies of Data_Exchange or their repetitions.
    assert!(images > 300_000 && outputs > 300_000);
    for (master, images) in ring.masters.iter().map(|master| master.images).enumerate() {
        assert!(images > 60_000, "master {master} had its share: {images}");
    }
    // Every altered token needs two flipped bits of 18: 7·10⁻⁷ of 10⁵ tokens.
    assert!(ring.witness.false_tokens < 10);
}

#[test]
fn the_token_rotates_within_ttr_and_one_message_cycle_of_each_master() {
    // All DP cycles together take 28 · 598 = 16 744 tBIT, so a Ttr of 6000 is never enough.
    const T_TR: u32 = 6_000;
    let mut ring = Ring::with_t_tr(BitTimes(T_TR));
    ring.run_until_whole();
    ring.run_for(Duration::from_millis(200));
    // EN 50170-2 part 4, 4.1.1.4: whoever has time left may begin one message cycle more, whoever has none has one of high priority.
    // A question for newcomers, two idle times and the token itself come on top. Nothing is repeated on this quiet line.
    let visit = 598 + (66 + 300 + 37) + (33 + 37);
    let bound = BAUD.duration(BitTimes(T_TR + u32::from(MASTERS) * visit));
    let exchanges: Vec<u64> = ring.masters.iter().map(|master| master.images).collect();
    for (place, checked) in ring.masters.iter().enumerate() {
        let statistics = checked.master.statistics();
        assert!(
            statistics.last_rotation <= bound,
            "{place}: {}",
            statistics.last_rotation
        );
        // The first one has also made the ring: two tokens and eleven questions.
        let making = BAUD.duration(BitTimes(3 * 70 + 11 * 403));
        assert!(
            statistics.longest_rotation <= bound + making,
            "{place}: {}",
            statistics.longest_rotation
        );
        // It is used, too: four DP cycles of one slave each are all that is guaranteed.
        assert!(statistics.last_rotation >= BAUD.duration(BitTimes(4 * 598)));
    }
    ring.run_for(Duration::from_millis(200));
    for (checked, before) in ring.masters.iter().zip(exchanges) {
        // 200 ms are 300 000 tBIT: 30 rotations or more, each with one exchange for everybody.
        assert!(checked.images >= before + 30, "{} {before}", checked.images);
    }
    assert_eq!(ring.bus.violations(), []);
}

#[test]
fn an_image_that_nobody_has_sent_would_be_noticed() {
    // The check itself: one octet differs; a number from the future.
    let mut octets = image(Way::Out, 20, 7);
    assert_eq!(number(Way::Out, 20, &octets, 7), Some(7));
    octets[9] ^= 1;
    assert!(std::panic::catch_unwind(|| number(Way::Out, 20, &octets, 7)).is_err());
    assert!(std::panic::catch_unwind(|| number(Way::Out, 20, &image(Way::Out, 20, 8), 7)).is_err());
    assert!(std::panic::catch_unwind(|| number(Way::In, 20, &image(Way::Out, 20, 7), 7)).is_err());
}
