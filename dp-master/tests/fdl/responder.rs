//! A passive station by itself: whom it answers, what it counts, and when it trusts what it hears again.

use dp_master::address::Address;
use dp_master::fdl::{Responder, ResponderStatistics, ResponderUser, Response};
use dp_master::station::{LineError, MAX_TELEGRAM};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, Telegram};

const BAUD: Baud = Baud::B1500000;
const TS: u8 = 3;
/// Tsyn of IEC 61158-4-3.
const TSYN: u32 = 33;
const TSDR: u32 = 11;

fn at(value: u8) -> Address {
    Address::from_wire(value).unwrap()
}

fn bits(count: u32) -> Duration {
    BAUD.duration(BitTimes(count))
}

#[derive(Default)]
struct User {
    requests: usize,
    repetitions: usize,
    unacknowledged: usize,
    /// Octets of an answer; without, the short acknowledgement.
    answer: Option<&'static [u8]>,
}

impl ResponderUser for User {
    fn handle_request(&mut self, _: Instant, _: &Header, _: &[u8]) -> Response<'_> {
        self.requests += 1;
        self.answer.map_or(Response::ShortAck, Response::Low)
    }
    fn handle_repetition(&mut self, _: Instant, _: &Header) {
        self.repetitions += 1;
    }
    fn handle_unacknowledged(&mut self, _: Instant, _: &Header, _: &[u8]) {
        self.unacknowledged += 1;
    }
    fn t_sdr(&self) -> BitTimes {
        BitTimes(TSDR)
    }
}

struct Bench {
    responder: Responder,
    user: User,
    now: Instant,
}

impl Bench {
    fn with_latency(latency: Duration) -> Self {
        Self {
            responder: Responder::new(at(TS), BAUD, latency),
            user: User::default(),
            now: Instant::ZERO,
        }
    }

    fn new() -> Self {
        Self::with_latency(Duration::ZERO)
    }

    /// After a pause of so many bits these octets, given when the last of them has ended.
    fn hear(&mut self, pause: u32, octets: &[u8]) {
        self.now += bits(pause) + BAUD.characters(octets.len());
        self.responder.handle_octets(self.now, octets, &mut self.user);
    }

    /// The reply, if one is due within Tsdr.
    fn reply(&mut self) -> Option<Vec<u8>> {
        let due = self.responder.poll_timeout()?;
        assert_eq!(due - self.now, bits(TSDR), "min Tsdr after the request");
        self.now = due;
        self.responder.handle_timeout(due);
        let reply = self.responder.take_reply().map(<[u8]>::to_vec);
        assert_eq!(self.responder.take_reply(), None, "it is due once");
        self.now += BAUD.characters(reply.as_ref().map_or(0, Vec::len));
        reply
    }

    /// A request after Tsyn and what is answered.
    fn ask(&mut self, da: u8, fcb: Fcb, function: RequestFunction) -> Option<Vec<u8>> {
        self.hear(TSYN, &request(da, fcb, function));
        self.reply()
    }
}

fn request(da: u8, fcb: Fcb, function: RequestFunction) -> Vec<u8> {
    let mut buf = [0; MAX_TELEGRAM];
    let header = Header::new(at(da), at(2), FunctionCode::request(fcb, function));
    let length = Telegram::Data { header, data: &[1, 2] }.encode(&mut buf).unwrap();
    buf[..length].to_vec()
}

const ACKNOWLEDGED: Option<&[u8]> = Some(&[0xE5]);

#[test]
fn each_thing_that_happens_is_counted_once_and_by_itself() {
    let mut bench = Bench::new();
    assert_eq!(
        bench.ask(TS, Fcb::First, RequestFunction::SrdHigh).as_deref(),
        ACKNOWLEDGED
    );
    assert_eq!(
        bench.ask(TS, Fcb::Low, RequestFunction::SrdHigh).as_deref(),
        ACKNOWLEDGED
    );
    for _ in 0..3 {
        assert_eq!(
            bench.ask(TS, Fcb::Low, RequestFunction::SrdHigh).as_deref(),
            ACKNOWLEDGED
        );
    }
    assert_eq!((bench.user.requests, bench.user.repetitions), (2, 3));
    // Source 3, destination 2, a passive station, OK; and without the service asked for, RS = 3.
    assert_eq!(
        bench.ask(TS, Fcb::Inactive, RequestFunction::FdlStatus).unwrap()[..4],
        [0x10, 2, TS, 0x00]
    );
    for function in [RequestFunction::Ident, RequestFunction::LsapStatus] {
        assert_eq!(
            bench.ask(TS, Fcb::Inactive, function).unwrap()[..4],
            [0x10, 2, TS, 0x03]
        );
    }
    assert_eq!(bench.ask(TS, Fcb::Inactive, RequestFunction::SdnHigh), None);
    assert_eq!(bench.ask(127, Fcb::Inactive, RequestFunction::SdnLow), None);
    assert_eq!(bench.user.unacknowledged, 2);
    for function in [RequestFunction::FdlStatus, RequestFunction::SrdHigh] {
        assert_eq!(bench.ask(127, Fcb::Inactive, function), None, "nobody answers for all");
    }
    assert_eq!(
        bench.ask(4, Fcb::First, RequestFunction::SrdHigh),
        None,
        "to somebody else"
    );
    bench.hear(TSYN, &[0x55, 0x55]);
    bench.hear(TSYN, &[0x55]);
    bench.now += bits(TSYN + 11);
    bench
        .responder
        .handle_line_error(bench.now, LineError::Parity, &mut bench.user);
    assert_eq!(
        bench.responder.statistics(),
        ResponderStatistics {
            requests: 5,
            repetitions: 3,
            replies: 8,
            // The spoiled character is a run of its own.
            discarded: 3,
            line_errors: 1,
        }
    );
}

#[test]
fn an_answer_of_the_station_itself_makes_the_stored_reply_unrepeatable() {
    let mut bench = Bench::new();
    bench.ask(TS, Fcb::First, RequestFunction::SrdHigh);
    bench.ask(TS, Fcb::Low, RequestFunction::SrdHigh);
    bench.ask(TS, Fcb::Inactive, RequestFunction::FdlStatus);
    // The same bit again would otherwise be answered with the status.
    assert_eq!(
        bench.ask(TS, Fcb::Low, RequestFunction::SrdHigh).as_deref(),
        ACKNOWLEDGED
    );
    assert_eq!((bench.user.requests, bench.user.repetitions), (3, 0));
}

#[test]
fn an_answer_that_fits_into_no_telegram_is_none() {
    let mut bench = Bench::new();
    bench.user.answer = Some(&[0; 250]);
    bench.hear(TSYN, &request(TS, Fcb::First, RequestFunction::SrdHigh));
    assert_eq!(bench.responder.poll_timeout(), None);
    assert_eq!(bench.user.requests, 1);
}

#[test]
fn another_address_holds_from_the_next_request_on() {
    let mut bench = Bench::new();
    bench.responder.set_address(at(40));
    assert_eq!(bench.responder.address(), at(40));
    assert_eq!(bench.ask(TS, Fcb::First, RequestFunction::SrdHigh), None);
    assert_eq!(
        bench.ask(40, Fcb::First, RequestFunction::SrdHigh).as_deref(),
        ACKNOWLEDGED
    );
}

#[test]
fn after_rubbish_a_request_counts_only_behind_tsyn() {
    let asked = request(TS, Fcb::First, RequestFunction::SrdHigh);
    for (pause, answered) in [(0, false), (TSYN - 2, false), (TSYN, true)] {
        let mut bench = Bench::new();
        bench.hear(TSYN, &[0x55]);
        bench.hear(pause, &asked);
        assert_eq!(bench.reply().is_some(), answered, "{pause} tBIT");
        // Without the pause not the next one either.
        bench.hear(0, &asked);
        assert_eq!(bench.reply().is_some(), answered, "{pause} tBIT, next");
    }
    let mut bench = Bench::new();
    bench.now += BAUD.characters(1);
    bench
        .responder
        .handle_line_error(bench.now, LineError::Framing, &mut bench.user);
    bench.hear(0, &asked);
    assert_eq!(bench.reply(), None, "what follows a spoiled character is no start");
}

#[test]
fn behind_an_operating_system_a_right_telegram_ends_the_waiting() {
    let asked = request(TS, Fcb::First, RequestFunction::SrdHigh);
    let mut bench = Bench::with_latency(Duration::from_millis(5));
    bench.hear(TSYN, &[0x55]);
    bench.hear(0, &asked);
    assert_eq!(bench.reply(), None, "it is not acted on itself");
    bench.hear(0, &asked);
    assert_eq!(bench.reply().as_deref(), ACKNOWLEDGED);
    // So does a pause of Tsyn, though it is shorter than the gaps forgiven.
    let mut bench = Bench::with_latency(Duration::from_millis(5));
    bench.hear(TSYN, &[0x55]);
    bench.hear(TSYN, &asked);
    assert_eq!(bench.reply().as_deref(), ACKNOWLEDGED);
    // And a gap inside a telegram is none.
    let mut bench = Bench::with_latency(Duration::from_millis(5));
    bench.hear(TSYN, &asked[..4]);
    bench.hear(20 * TSYN, &asked[4..]);
    assert_eq!(bench.reply().as_deref(), ACKNOWLEDGED);
}

#[test]
fn a_telegram_that_begins_in_the_piece_that_ends_another_has_all_its_time() {
    // An adapter gives the octets in pieces that do not end with telegrams; gaps of 4 ms are forgiven one after the other.
    let (other, asked) = (
        request(4, Fcb::First, RequestFunction::SrdHigh),
        request(TS, Fcb::First, RequestFunction::SrdHigh),
    );
    let gap = 6_000;
    assert!(bits(gap) >= Duration::from_millis(4));
    for (first, second) in [(4, 4), (2, 7), (7, 2)] {
        let mut bench = Bench::with_latency(Duration::from_millis(5));
        bench.hear(TSYN, &other[..first]);
        bench.hear(gap, &[&other[first..], &asked[..second]].concat());
        bench.hear(gap, &asked[second..]);
        assert_eq!(bench.reply().as_deref(), ACKNOWLEDGED, "cut after {first} and {second}");
    }
}

#[test]
fn a_start_of_a_telegram_that_never_ends_swallows_nothing_for_ever() {
    let asked = request(TS, Fcb::First, RequestFunction::SrdHigh);
    // SD2 with LE 249, then a busy line: requests to somebody else without a pause longer than the gaps forgiven.
    let latency = Duration::from_micros(100);
    let mut bench = Bench::with_latency(latency);
    bench.hear(TSYN, &[0x68, 249, 249, 0x68]);
    let begun = bench.now;
    // 255 characters and the latency, then one telegram that ends the waiting, and the next is answered.
    let bound =
        BAUD.characters(255) + latency + BAUD.duration(BitTimes(3 * (30 + 11 * u32::try_from(asked.len()).unwrap())));
    loop {
        bench.hear(30, &asked);
        let heard = bench.now - begun;
        assert!(heard <= bound, "deaf for {heard}");
        if bench.reply().is_some() {
            assert!(heard >= BAUD.characters(255) + latency, "after {heard}");
            break;
        }
    }
    assert!(bench.responder.statistics().discarded >= 1);
}
