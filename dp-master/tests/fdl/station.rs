//! One active station, driven by hand: the transitions of its table, what it answers, and what the token allows.

use dp_master::address::Address;
use dp_master::fdl::{
    Access, Action, ActiveStation, BusParams, Confirmation, FdlState, LeaveCause, Membership, Outcome, Repeat,
    RingEvent, TokenUser,
};
use dp_master::station::{LineError, MAX_TELEGRAM};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram};
use proptest::prelude::*;

const BAUD: Baud = Baud::B1500000;
const TS: u8 = 5;
/// Tsl, Tid1 and min Tsdr of the standard parameters at 1.5 Mbit/s.
const TSL: u64 = 300;
const TID1: u64 = 37;
const TSDR: u64 = 11;

fn at(value: u8) -> Address {
    Address::new(value).unwrap()
}

fn bits(count: u64) -> Duration {
    BAUD.duration(BitTimes(u32::try_from(count).unwrap()))
}

/// Requests to be sent, in their order; one is done when it is confirmed.
#[derive(Default)]
struct User {
    /// Nothing is to be done before this moment.
    wait_until: Option<Instant>,
    /// A request each time so long after the one before, and nothing but waiting in between: the next moment and the pause.
    cycle: Option<(Instant, Duration)>,
    /// How much later than its moment the latest of them began.
    latest: Duration,
    /// One answer that waits until no later than now.
    waits_for: Option<fn(Instant) -> Instant>,
    /// Instead of two octets.
    data: Option<&'static [u8]>,
    /// Every second answer is that its cycle is complete, so that each request is a cycle.
    passes_between: bool,
    passed: bool,
    requests: Vec<RequestFunction>,
    repeat: Option<Repeat>,
    outcomes: Vec<String>,
    events: Vec<RingEvent>,
    asked: Vec<Access>,
    asked_at: Vec<Instant>,
}

impl TokenUser for User {
    fn next_action(&mut self, now: Instant, access: Access) -> Action<'_> {
        self.asked.push(access);
        self.asked_at.push(now);
        if let Some(until) = self.waits_for.take() {
            return Action::WaitUntil(until(now));
        }
        if let Some(until) = self.wait_until.filter(|until| now < *until) {
            return Action::WaitUntil(until);
        }
        if let Some((due, pause)) = self.cycle {
            if now < due {
                return Action::WaitUntil(due);
            }
            self.latest = self.latest.max(now - due);
            self.cycle = Some((due + pause, pause));
        }
        self.passed = self.passes_between && !self.passed;
        let Some(&function) = self.requests.first().filter(|_| !self.passed) else {
            return Action::PassToken;
        };
        let counted = !matches!(function, RequestFunction::SdnHigh | RequestFunction::SdnLow);
        let fcb = if counted { Fcb::First } else { Fcb::Inactive };
        Action::Send {
            header: Header::new(at(40), at(TS), FunctionCode::request(fcb, function)),
            data: self.data.unwrap_or(&[1, 2]),
            repeat: self.repeat.unwrap_or(Repeat::Never),
        }
    }
    fn confirm(&mut self, _: Instant, confirmation: Confirmation<'_>) {
        self.requests.remove(0);
        self.outcomes.push(match confirmation.outcome {
            Outcome::Response { .. } => "Response".to_owned(),
            other => format!("{other:?}"),
        });
    }
    fn handle_ring(&mut self, _: Instant, event: RingEvent) {
        self.events.push(event);
    }
}

/// A telegram of the station: when its first bit was sent, and its octets.
type Sent = (Instant, Vec<u8>);

struct Bench {
    station: ActiveStation,
    user: User,
    now: Instant,
    counted: Counted,
}

/// What the station sent, counted by the octets.
#[derive(Debug, Default, PartialEq, Eq)]
struct Counted {
    sent: u64,
    tokens: u64,
    gap_requests: u64,
}

impl Bench {
    fn with_params(params: BusParams) -> Self {
        let mut bench = Self {
            station: ActiveStation::new(at(TS), params),
            user: User::default(),
            now: Instant::ZERO,
            counted: Counted::default(),
        };
        assert_eq!(bench.quiet(bits(1)), []);
        assert_eq!(bench.station.state(), FdlState::ListenToken);
        bench
    }

    fn new() -> Self {
        Self::with_params(BusParams {
            hsa: at(10),
            ..BusParams::standard(BAUD)
        })
    }

    /// A member of the ring of 1 and 5, without the token.
    fn member() -> Self {
        Self::member_behind(Duration::ZERO)
    }

    /// The same behind an operating system.
    fn member_behind(latency: Duration) -> Self {
        let params = BusParams {
            hsa: at(10),
            ..BusParams::standard(BAUD)
        };
        let mut bench = Self::with_params(params.with_latency_allowance(latency));
        bench.hear_rotations(2);
        assert_eq!(station_type(&bench.status_of(1)), StationType::MasterReady);
        assert_eq!(bench.token(1, TS), [token(TS, 1)]);
        assert_eq!(bench.station.state(), FdlState::CheckTokenPass);
        bench.token(1, 1);
        assert_eq!(bench.station.state(), FdlState::ActiveIdle);
        bench.user.events.clear();
        bench.user.asked.clear();
        bench.user.asked_at.clear();
        bench
    }

    /// Time passes; what the station sends meanwhile. A telegram that has begun is sent to its end.
    fn quiet(&mut self, span: Duration) -> Vec<Sent> {
        let end = self.now + span;
        let mut sent = Vec::new();
        let mut buf = [0; MAX_TELEGRAM];
        loop {
            if let Some(length) = self.station.poll_transmit(self.now, &mut buf, &mut self.user) {
                sent.push((self.now, buf[..length].to_vec()));
                self.counted.sent += 1;
                self.counted.tokens += u64::from(buf[0] == 0xDC);
                // SD1 with function 49h: Request FDL Status.
                self.counted.gap_requests += u64::from((buf[0], buf[3]) == (0x10, 0x49));
                self.now += BAUD.characters(length);
                self.station.handle_sent(self.now, &mut self.user);
                continue;
            }
            match self.station.poll_timeout().filter(|due| *due <= end) {
                Some(due) => {
                    self.now = self.now.max(due);
                    self.station.handle_timeout(self.now, &mut self.user);
                }
                None => break,
            }
        }
        self.now = self.now.max(end);
        let statistics = self.station.statistics();
        let counted = Counted {
            sent: statistics.sent,
            tokens: statistics.tokens,
            gap_requests: statistics.gap_requests,
        };
        assert_eq!(counted, self.counted);
        sent
    }

    /// The station hears this, as a line delivers it.
    fn hear(&mut self, octets: &[u8]) {
        let start = self.now;
        self.station
            .handle_octets(start + BAUD.characters(1), &octets[..1], &mut self.user);
        self.now = start + BAUD.characters(octets.len());
        if octets.len() > 1 {
            self.station.handle_octets(self.now, &octets[1..], &mut self.user);
        }
    }

    fn hear_telegram(&mut self, telegram: Telegram<'_>) {
        let mut buf = [0; MAX_TELEGRAM];
        let length = telegram.encode(&mut buf).unwrap();
        let octets = buf[..length].to_vec();
        self.hear(&octets);
    }

    /// Hears a token after Tid1, and what the station sends until a slot time is nearly over.
    fn token(&mut self, sa: u8, da: u8) -> Vec<Vec<u8>> {
        let before = self.quiet(bits(TID1));
        assert_eq!(before, []);
        self.hear(&token(sa, da));
        self.quiet(bits(TSL - 20))
            .into_iter()
            .map(|(_, octets)| octets)
            .collect()
    }

    /// The token goes round between 1 and itself.
    fn hear_rotations(&mut self, rotations: usize) {
        (0..rotations).for_each(|_| assert_eq!(self.token(1, 1), [[0; 0]; 0]));
    }

    /// Asked for its FDL status by a master, within Tsdr of 11 bits to a slot time.
    fn status_of(&mut self, master: u8) -> Vec<u8> {
        self.quiet(bits(TID1));
        let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
        self.hear_telegram(Telegram::no_data(at(TS), at(master), fc));
        let asked = self.now;
        let sent = self.quiet(bits(TSL - 20));
        assert_eq!(sent.len(), 1, "one answer");
        assert!(sent[0].0 - asked >= bits(TSDR), "not before min Tsdr");
        sent[0].1.clone()
    }

    fn request(&mut self, sa: u8, da: u8, function: RequestFunction) -> Vec<Sent> {
        self.quiet(bits(TID1));
        let fc = FunctionCode::request(Fcb::First, function);
        self.hear_telegram(Telegram::no_data(at(da), at(sa), fc));
        self.quiet(bits(TSL - 20))
    }
}

fn token(sa: u8, da: u8) -> Vec<u8> {
    vec![0xDC, da, sa]
}

/// Station type of an answer: SD1, DA, SA, FC with the type in bits 5 and 4 (IEC 61158-4-3).
fn station_type(answer: &[u8]) -> StationType {
    assert_eq!((answer[0], answer[2]), (0x10, TS));
    match FunctionCode::from_octet(answer[3]) {
        FunctionCode::Response {
            station,
            function: ResponseFunction::Ok,
        } => station,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_listener_is_not_ready_before_it_has_heard_two_identical_rotations() {
    let mut bench = Bench::new();
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterNotReady);
    bench.hear_rotations(1);
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterNotReady);
    assert_eq!(bench.station.state(), FdlState::ListenToken);
    bench.hear_rotations(1);
    // Asked by somebody who is not its predecessor it is ready, but this is no invitation.
    assert_eq!(station_type(&bench.status_of(7)), StationType::MasterReady);
    assert_eq!(bench.station.state(), FdlState::ListenToken);
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterReady);
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
    // The answer may have been lost: until the token has come it stays ready.
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterReady);
}

#[test]
fn a_repeated_token_is_no_new_turn_of_the_ring() {
    let mut bench = Bench::new();
    for (sa, da) in [(1, 7), (7, 1), (1, 7), (1, 7), (7, 1)] {
        bench.token(sa, da);
    }
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterReady);
}

#[test]
fn the_own_address_heard_before_listening_again_is_not_forgotten() {
    let mut bench = Bench::member();
    bench.token(TS, 1);
    // The second rotation that passes over it.
    bench.token(1, 1);
    assert_eq!(bench.station.state(), FdlState::ListenToken);
    bench.token(TS, 1);
    assert_eq!(bench.station.state(), FdlState::Offline);
}

#[test]
fn a_member_answers_that_it_is_in_the_ring() {
    let mut bench = Bench::member();
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterInRing);
}

#[test]
fn an_answer_is_withdrawn_when_somebody_speaks_before_it() {
    let mut bench = Bench::member();
    bench.quiet(bits(TID1));
    let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
    bench.hear_telegram(Telegram::no_data(at(TS), at(1), fc));
    bench.quiet(bits(5));
    bench.hear(&[0xE5]);
    assert_eq!(bench.quiet(bits(TSL)), []);
}

#[test]
fn a_listener_answers_nothing_else_and_a_member_refuses_what_it_does_not_serve() {
    let mut bench = Bench::new();
    bench.hear_rotations(2);
    assert_eq!(bench.request(1, TS, RequestFunction::SrdLow), []);
    assert_eq!(bench.token(1, TS), [[0; 0]; 0], "nor does it take the token");
    let mut bench = Bench::member();
    for function in [
        RequestFunction::SrdLow,
        RequestFunction::SrdHigh,
        RequestFunction::SdaLow,
    ] {
        let sent = bench.request(1, TS, function);
        // RS = 3, station type "in the ring" = 3.
        assert_eq!(sent[0].1[..4], [0x10, 1, TS, 0x33]);
    }
    assert_eq!(bench.request(1, TS, RequestFunction::SdnHigh), []);
    assert_eq!(bench.request(1, 9, RequestFunction::SrdLow), [], "to somebody else");
}

#[test]
fn the_token_is_taken_from_the_predecessor_at_once_and_from_a_stranger_when_repeated() {
    let mut bench = Bench::member();
    assert_eq!(bench.token(1, TS), [token(TS, 1)]);
    bench.token(1, 1);
    let none: [Vec<u8>; 0] = [];
    assert_eq!(bench.token(3, TS), none);
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
    // Between 3 and 5 there is nobody; 1 stays the successor.
    assert_eq!(bench.token(3, TS), [token(TS, 1)]);
    assert!(bench.station.las().contains(at(3)));
}

#[test]
fn a_spoiled_token_is_none() {
    let mut bench = Bench::member();
    bench.quiet(bits(TID1));
    let one = BAUD.characters(1);
    bench.now += one;
    bench.station.handle_octets(bench.now, &[0xDC], &mut bench.user);
    bench.now += one;
    bench
        .station
        .handle_line_error(bench.now, LineError::Parity, &mut bench.user);
    bench.now += one;
    bench.station.handle_octets(bench.now, &[1], &mut bench.user);
    assert_eq!(bench.quiet(bits(TSL)), []);
    // The repetition is taken.
    bench.hear(&token(1, TS));
    assert_eq!(bench.quiet(bits(TSL))[0].1, token(TS, 1));
}

#[test]
fn a_token_is_repeated_twice_after_a_slot_time_each_and_then_the_successor_is_gone() {
    let mut bench = Bench::member();
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    let sent = bench.quiet(bits(2_000));
    let tokens: Vec<_> = sent.iter().map(|(_, octets)| octets.clone()).collect();
    assert_eq!(tokens[..4], [token(TS, 1), token(TS, 1), token(TS, 1), token(TS, TS)]);
    for pair in sent[..3].windows(2) {
        let pause = pair[1].0 - pair[0].0 - BAUD.characters(3);
        assert!(
            pause >= bits(TSL) && pause <= bits(TSL) + Duration::from_nanos(2),
            "{pause}"
        );
    }
    assert_eq!(bench.user.events, [RingEvent::StationLeft(at(1))]);
    let statistics = bench.station.statistics();
    assert_eq!(statistics.token_retries, 2);
    assert!(statistics.timeouts >= 3, "{statistics:?}");
}

#[test]
fn any_character_within_the_slot_time_says_that_the_token_is_taken() {
    let mut bench = Bench::member();
    bench.token(1, TS);
    assert_eq!(bench.station.state(), FdlState::CheckTokenPass);
    bench.now += BAUD.characters(1);
    bench
        .station
        .handle_line_error(bench.now, LineError::Framing, &mut bench.user);
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
    assert_eq!(bench.quiet(bits(3 * TSL)), []);
}

#[test]
fn a_member_that_hears_nothing_for_ttimeout_claims_the_token_and_knows_the_ring() {
    let mut bench = Bench::member();
    let silent = bench.now;
    // The last telegram ended a slot time less 20 bits ago; (6 + 2·5)·Tsl in all (EN 50170-2 part 4).
    let sent = bench.quiet(bits((6 + 2 * u64::from(TS)) * TSL));
    assert_eq!(bench.user.events[..2], [RingEvent::TokenLost, RingEvent::Claimed]);
    assert_eq!(sent[0].1, token(TS, 1), "no initialisation: the list is still valid");
    assert!(sent[0].0 + bits(TSL) - silent >= bits(16 * TSL));
}

#[test]
fn passed_over_in_two_rotations_a_member_leaves_and_listens() {
    let mut bench = Bench::member();
    // 1 → 1 in `member` was the first.
    bench.token(1, 1);
    assert_eq!(bench.station.state(), FdlState::ListenToken);
    assert_eq!(bench.user.events, [RingEvent::Left(LeaveCause::Excluded)]);
    assert_eq!(station_type(&bench.status_of(1)), StationType::MasterNotReady);
}

#[test]
fn the_own_address_heard_twice_sends_a_station_offline_and_later_back_to_listen() {
    for member in [false, true] {
        let mut bench = if member { Bench::member() } else { Bench::new() };
        let before = bench.station.statistics();
        bench.token(TS, 1);
        assert_ne!(bench.station.state(), FdlState::Offline, "once may be an error");
        assert_eq!(bench.station.statistics().discarded, before.discarded + 1);
        bench.token(TS, 1);
        assert_eq!(bench.station.state(), FdlState::Offline);
        assert_eq!(bench.user.events[0], RingEvent::DuplicateAddress);
        let left = bench
            .user
            .events
            .contains(&RingEvent::Left(LeaveCause::DuplicateAddress));
        assert_eq!(left, member);
        let none: [Vec<u8>; 0] = [];
        assert_eq!(bench.token(1, TS), none, "it neither hears nor speaks");
        bench.quiet(Duration::from_millis(1_000));
        assert_eq!(bench.station.state(), FdlState::ListenToken);
        bench.token(TS, 1);
        assert_eq!(
            bench.station.state(),
            FdlState::ListenToken,
            "once may be an error again"
        );
    }
}

#[test]
fn a_member_tells_who_joins_elsewhere() {
    let mut bench = Bench::member();
    bench.token(1, TS);
    // Its successor passes the token to somebody new.
    bench.token(1, 3);
    bench.token(3, TS);
    assert_eq!(bench.user.events, [RingEvent::StationJoined(at(3))]);
}

#[test]
fn a_request_that_fits_into_no_telegram_is_no_answer_and_costs_a_slot_time() {
    let mut bench = Bench::member();
    bench.user.requests = vec![RequestFunction::SrdLow; 2];
    bench.user.data = Some(&[0; 250]);
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    bench.quiet(bits(3 * TSL));
    assert_eq!(bench.user.outcomes, ["NoAnswer", "NoAnswer"]);
    let pause = bench.user.asked_at[1] - bench.user.asked_at[0];
    assert_eq!(pause, bits(TSL));
}

#[test]
fn another_masters_request_ends_the_own_one() {
    let mut bench = Bench::member();
    bench.user.requests = vec![RequestFunction::SrdHigh];
    let sent = bench.token(1, TS);
    assert_eq!(sent[0][0], 0x68);
    assert_eq!(bench.station.state(), FdlState::AwaitDataResponse);
    let fc = FunctionCode::request(Fcb::First, RequestFunction::SrdHigh);
    bench.hear_telegram(Telegram::no_data(at(41), at(1), fc));
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
    assert_eq!(bench.user.outcomes, ["Aborted"]);
    assert_eq!(bench.user.events, [RingEvent::SecondToken(at(1))]);
    assert_eq!(bench.quiet(bits(3 * TSL)), []);
}

#[test]
fn a_master_unknown_so_far_is_looked_for_with_the_next_token() {
    for (master, looked_for) in [(7, true), (1, false)] {
        let mut bench = Bench::member();
        bench.user.requests = vec![RequestFunction::SrdHigh];
        bench.token(1, TS);
        let fc = FunctionCode::request(Fcb::First, RequestFunction::SrdHigh);
        bench.hear_telegram(Telegram::no_data(at(41), at(master), fc));
        assert_eq!(bench.user.events, [RingEvent::SecondToken(at(master))]);
        let sent = bench.token(1, TS);
        assert_eq!(sent[0] != token(TS, 1), looked_for, "{sent:02X?}");
    }
}

#[test]
fn a_late_token_puts_a_question_to_the_gap_off_once() {
    // Tokens until an address of the GAP is asked.
    let tokens = |late: bool| {
        let mut bench = Bench::member();
        let t_tr = u64::from(bench.station.params().t_tr.0);
        for count in 1..100 {
            let mut passed = 0;
            while late && passed <= t_tr {
                bench.request(1, 41, RequestFunction::SrdHigh);
                passed += 66 + TSL - 20 + TID1;
            }
            if bench.token(1, TS)[0][0] == 0x10 {
                return count;
            }
        }
        panic!("no GAP request");
    };
    assert_eq!(tokens(true), tokens(false) + 1);
}

#[test]
fn a_request_is_repeated_up_to_the_retry_limit_0_to_8() {
    for retry_limit in 0..=8 {
        let params = BusParams {
            retry_limit,
            hsa: at(0),
            ..BusParams::standard(BAUD)
        };
        let mut bench = Bench::with_params(params);
        bench.user.requests = vec![RequestFunction::SdaLow];
        bench.user.repeat = Some(Repeat::UpToLimit);
        let sent = bench.quiet(bits(16 * TSL + 12 * 500));
        let requests = sent.iter().filter(|(_, octets)| octets[0] == 0x68).count();
        assert_eq!(requests, usize::from(retry_limit) + 1);
        let statistics = bench.station.statistics();
        assert_eq!(statistics.retries, u64::from(retry_limit));
        assert_eq!(statistics.timeouts, u64::from(retry_limit) + 1);
        assert_eq!(bench.user.outcomes, ["NoAnswer"]);
    }
}

#[test]
fn sda_srd_and_sdn_end_with_their_own_confirmation() {
    let mut bench = Bench::member();
    bench.user.requests = vec![
        RequestFunction::SdnLow,
        RequestFunction::SdaHigh,
        RequestFunction::SrdLow,
    ];
    // SDN, then after Tid2 = max Tsdr = 150 the next.
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    let sent = bench.quiet(bits(550));
    assert_eq!(sent.len(), 2, "{sent:?}");
    bench.hear(&[0xE5]);
    assert_eq!(bench.quiet(bits(TID1 + 11 * 11 + TSDR)).len(), 1);
    let fc = FunctionCode::response(StationType::Slave, ResponseFunction::DataLow);
    bench.hear_telegram(Telegram::Data {
        header: Header::new(at(TS), at(40), fc),
        data: &[9],
    });
    assert_eq!(bench.user.outcomes, ["Sent", "Acknowledged", "Response"]);
}

#[test]
fn an_answer_is_that_of_the_station_asked_and_everything_else_is_counted() {
    let answer = |sa, da| Telegram::Data {
        header: Header::new(
            at(da),
            at(sa),
            FunctionCode::response(StationType::Slave, ResponseFunction::DataLow),
        ),
        data: &[9],
    };
    let asked = || {
        let mut bench = Bench::member();
        bench.user.requests = vec![RequestFunction::SrdLow];
        bench.user.repeat = Some(Repeat::UpToLimit);
        assert_eq!(bench.token(1, TS)[0][0], 0x68);
        bench
    };
    for (sa, da) in [(41, TS), (40, 6)] {
        let mut bench = asked();
        let before = bench.station.statistics();
        bench.hear_telegram(answer(sa, da));
        assert_eq!(bench.user.outcomes, [""; 0], "from {sa} to {da}");
        assert_eq!(bench.station.statistics().discarded, before.discarded + 1);
        // The request is repeated as after an answer with errors.
        let sent = bench.quiet(bits(TSL));
        assert_eq!(sent[0].1[0], 0x68);
        bench.hear_telegram(answer(40, TS));
        assert_eq!(bench.user.outcomes, ["Response"]);
    }
    // Nobody asked for an acknowledgement while an address of the GAP is asked.
    let (mut bench, _) = asking_the_gap();
    let before = bench.station.statistics();
    bench.hear(&[0xE5]);
    assert_eq!(bench.station.statistics().discarded, before.discarded + 1);
    assert_eq!(bench.user.outcomes, [""; 0]);
}

/// A member that has just asked an address of its GAP, and that address.
fn asking_the_gap() -> (Bench, u8) {
    let mut bench = Bench::member();
    for _ in 0..100 {
        bench.quiet(bits(TID1));
        bench.hear(&token(1, TS));
        let status = bench.quiet(bits(TID1 + 70)).pop();
        if let Some((_, octets)) = status.filter(|(_, octets)| octets[0] == 0x10) {
            assert_eq!(bench.station.state(), FdlState::AwaitStatusResponse);
            return (bench, octets[1]);
        }
        bench.quiet(bits(TSL));
        bench.token(1, 1);
    }
    panic!("no GAP request");
}

#[test]
fn the_status_of_another_than_the_station_asked_is_no_answer() {
    let ready = FunctionCode::response(StationType::MasterReady, ResponseFunction::Ok);
    let (mut bench, gap) = asking_the_gap();
    bench.hear_telegram(Telegram::no_data(at(TS), at(gap), ready));
    assert!(bench.station.las().contains(at(gap)), "it joins");
    let answered = bench.now;
    let sent = bench.quiet(bits(TID1 + 70));
    assert_eq!(sent[0].1, token(TS, gap));
    assert!(sent[0].0 >= answered + bits(TID1));
    for (sa, da) in [(41, TS), (gap, 1)] {
        let (mut bench, gap) = asking_the_gap();
        let before = bench.station.statistics();
        bench.hear_telegram(Telegram::no_data(at(da), at(sa), ready));
        assert_eq!(bench.station.statistics().discarded, before.discarded + 1);
        assert!(!bench.station.las().contains(at(gap)), "{sa} to {da}");
    }
}

/// A station alone whose initialisation and first scan are over; it has just got its token back from itself.
fn alone() -> Bench {
    let mut bench = Bench::with_params(BusParams {
        hsa: at(0),
        ..BusParams::standard(BAUD)
    });
    // Ttimeout, then long enough for the one address of its GAP.
    bench.quiet(bits(16 * TSL) + Duration::from_millis(110));
    assert_eq!(bench.station.las().len(), 1);
    bench.user.asked_at.clear();
    bench.user.asked.clear();
    bench
}

#[test]
fn who_waits_in_a_ring_lets_the_others_work() {
    let mut bench = Bench::member();
    bench.user.wait_until = Some(bench.now + Duration::from_millis(50));
    assert_eq!(bench.token(1, TS), [token(TS, 1)]);
    assert_eq!(bench.user.asked.len(), 1);
    // A moment that has passed, or is now, is none to wait for: asked again with the same token.
    for until in [(|_| Instant::ZERO) as fn(Instant) -> Instant, |now| now] {
        let mut bench = Bench::member();
        bench.user.waits_for = Some(until);
        bench.user.requests = vec![RequestFunction::SrdLow];
        assert_eq!(bench.token(1, TS)[0][0], 0x68);
        assert_eq!(bench.user.asked.len(), 2);
        let pause = bench.user.asked_at[1] - bench.user.asked_at[0];
        assert_eq!(pause, Duration::from_nanos(1), "never a deadline that has passed");
    }
}

#[test]
fn who_waits_alone_is_asked_at_that_moment_and_the_line_is_never_silent_for_long() {
    for micros in [20, 200, 700, 900, 1_200, 5_000] {
        let mut bench = alone();
        let sent = bench.quiet(Duration::from_micros(300));
        assert!(!sent.is_empty(), "it works on");
        let asked = bench.user.asked_at.len();
        let until = bench.now + Duration::from_micros(micros);
        bench.user.wait_until = Some(until);
        let sent = bench.quiet(Duration::from_micros(micros) + bits(66));
        let questions = &bench.user.asked_at[asked..];
        let late = *questions.iter().find(|at| **at >= until).unwrap() - until;
        // A token of its own may be on the line and Tid1 behind it.
        assert!(late <= bits(TID1 + 33), "{late} after the moment");
        // Ttimeout of station 0 is six slot times; without anything else on the line four of them are the longest silence.
        let mut free = until - Duration::from_micros(micros);
        for (at, octets) in &sent {
            assert_eq!(octets, &token(TS, TS));
            assert!(*at - free <= bits(4 * TSL), "silent for {}", *at - free);
            free = *at + BAUD.characters(3);
        }
        assert!(until - free <= bits(4 * TSL), "silent for {} at the end", until - free);
        // And it does not spin: two questions a token, and a token before, behind and every four slots less its share of one between.
        let most = 2 * (micros / 600 + 2);
        assert!(
            questions.len() as u64 <= most,
            "asked {} times in {micros} µs",
            questions.len()
        );
    }
}

#[test]
fn a_moment_that_has_passed_is_asked_for_again_at_once_alone_too() {
    let mut bench = alone();
    bench.user.waits_for = Some(|_| Instant::ZERO);
    bench.quiet(Duration::from_micros(300));
    let pauses: Vec<_> = bench.user.asked_at.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(pauses.contains(&Duration::from_nanos(1)), "{pauses:?}");
}

#[test]
fn a_question_to_the_gap_does_not_delay_who_waits() {
    // Addresses 0…10 are in the GAP; a question costs a slot time and more.
    let mut bench = Bench::new();
    bench.quiet(bits(16 * TSL) + Duration::from_millis(200));
    // A request has 121 tBIT of 1.5 Mbit/s. Four slot times less 5/128 of one later the station breaks the silence; a question that nobody
    // answers, 66 + 300 + 37, and the token, 70, fit behind that when 1309 + 473 tBIT = 1188 µs lie between the requests.
    for (micros, fits) in [(400, false), (896, false), (1_170, false), (1_200, true), (2_000, true)] {
        let pause = Duration::from_micros(micros);
        bench.user.requests = vec![RequestFunction::SdnLow; 500];
        bench.user.cycle = Some((bench.now + pause, pause));
        bench.user.latest = Duration::ZERO;
        let before = bench.counted.gap_requests;
        bench.quiet(Duration::from_micros(micros * 490));
        let asked = bench.counted.gap_requests - before;
        assert_eq!(asked > 3, fits, "{asked} questions between requests {micros} µs apart");
        // The last token before is back by then.
        assert!(bench.user.latest <= bits(1), "{} late", bench.user.latest);
    }
}

#[test]
fn whoever_sends_hears_nothing() {
    let mut bench = Bench::member();
    bench.user.requests = vec![RequestFunction::SdaHigh];
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    let begin = bench.station.poll_timeout().unwrap();
    bench.now = begin;
    bench.station.handle_timeout(begin, &mut bench.user);
    let mut buf = [0; MAX_TELEGRAM];
    let length = bench.station.poll_transmit(begin, &mut buf, &mut bench.user).unwrap();
    assert_eq!(buf[0], 0x68);
    let before = bench.station.statistics();
    bench.hear(&[0xE5]);
    bench
        .station
        .handle_line_error(bench.now, LineError::Parity, &mut bench.user);
    assert_eq!(bench.user.outcomes, [""; 0], "no answer before the request has ended");
    assert_eq!(bench.station.statistics(), before);
    bench.now = begin + BAUD.characters(length);
    bench.station.handle_sent(bench.now, &mut bench.user);
    bench.counted.sent += 1;
    bench.hear(&[0xE5]);
    assert_eq!(bench.user.outcomes, ["Acknowledged"]);
    assert_eq!(bench.station.statistics().received, before.received + 1);
    assert_eq!(bench.quiet(bits(TSL))[0].1, token(TS, 1));
}

#[test]
fn an_answer_that_breaks_off_is_waited_for_as_long_as_it_said() {
    // SD2 with LE 9 has 15 characters; one character alone may be the longest telegram.
    for (beginning, characters) in [(&[0x68, 9, 9, 0x68][..], 15), (&[0x68], 255)] {
        let mut bench = Bench::member();
        bench.user.requests = vec![RequestFunction::SrdLow];
        bench.user.repeat = Some(Repeat::UpToLimit);
        assert_eq!(bench.token(1, TS)[0][0], 0x68);
        let before = bench.station.statistics();
        let start = bench.now;
        bench.hear(beginning);
        let sent = bench.quiet(bits(3_500));
        // A slot time after the announced end it is given up, and repeated.
        let due = start + BAUD.characters(characters) + bits(TSL);
        let late = sent[0].0 - due;
        assert!(sent[0].0 >= due, "{} too early", due - sent[0].0);
        // A lone character is taken for the first of 255 that has just ended: one more; then Tid1.
        assert!(late <= bits(TID1 + 12), "{late} too late after {characters}");
        assert_eq!(sent[0].1[0], 0x68);
        assert!(bench.station.statistics().timeouts > before.timeouts);
    }
}

#[test]
fn the_rest_of_a_telegram_is_waited_for_before_the_token_is_lost_or_anything_is_sent() {
    // After a whole telegram, the beginning of one that never ends: 9 + 6 characters were announced.
    let announced = BAUD.characters(15);
    let mut bench = Bench::member();
    bench.quiet(bits(TID1));
    let fc = FunctionCode::request(Fcb::First, RequestFunction::SrdHigh);
    bench.hear_telegram(Telegram::no_data(at(41), at(1), fc));
    bench.quiet(bits(5));
    let start = bench.now;
    bench.hear(&[0x68, 9]);
    let sent = bench.quiet(bits(20 * TSL));
    // Ttimeout = (6 + 2·5)·Tsl.
    let claimed = sent[0].0 - (start + announced);
    assert!(claimed >= bits(16 * TSL), "claimed after {claimed}");
    assert!(claimed <= bits(16 * TSL + 2), "claimed after {claimed}");

    // The same while the token is there: the next request goes out Tid1 after the announced end, and behind an operating system what it may
    // keep octets back later.
    for latency in [Duration::ZERO, Duration::from_micros(100)] {
        let mut bench = Bench::member_behind(latency);
        bench.quiet(bits(TID1));
        bench.hear(&token(1, TS));
        bench.user.requests = vec![RequestFunction::SrdLow];
        let start = bench.now;
        for octets in [&[0x68, 9][..], &[9]] {
            bench.now += BAUD.characters(octets.len());
            bench.station.handle_octets(bench.now, octets, &mut bench.user);
        }
        let sent = bench.quiet(bits(2 * TSL));
        let least = announced + latency + bits(TID1);
        assert!(sent[0].0 >= start + least, "{} too early", start + least - sent[0].0);
        assert!(sent[0].0 - (start + least) <= bits(2), "too late");
    }
}

#[test]
fn rubbish_deafens_until_tsyn_or_behind_an_operating_system_until_a_telegram_with_check_sequence() {
    let status = |bench: &mut Bench| {
        let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
        bench.hear_telegram(Telegram::no_data(at(TS), at(1), fc));
    };
    for (latency, heard) in [(Duration::ZERO, false), (Duration::from_millis(2), true)] {
        let params = BusParams {
            hsa: at(10),
            ..BusParams::standard(BAUD)
        };
        let mut bench = Bench::with_params(params.with_latency_allowance(latency));
        bench.quiet(bits(66) + latency);
        bench.hear(&[0x55, 0x55]);
        let before = bench.station.statistics();
        assert!(before.discarded > 0);
        // A token has no check sequence, so it proves nothing.
        bench.hear(&token(1, 1));
        status(&mut bench);
        assert_eq!(
            bench.station.statistics().discarded,
            before.discarded + 2,
            "not acted on"
        );
        status(&mut bench);
        let discarded = before.discarded + if heard { 2 } else { 3 };
        assert_eq!(bench.station.statistics().discarded, discarded);
        assert_eq!(bench.quiet(bits(TSL) + latency).len(), usize::from(heard));
    }
    // An answer that was disturbed is not there, whatever follows it.
    let latency = Duration::from_millis(2);
    let params = BusParams {
        hsa: at(0),
        ..BusParams::standard(BAUD)
    };
    let mut bench = Bench::with_params(params.with_latency_allowance(latency));
    bench.user.requests = vec![RequestFunction::SrdLow];
    while bench.station.state() != FdlState::AwaitDataResponse {
        bench.quiet(bits(100));
    }
    bench.quiet(bits(100));
    let fc = FunctionCode::response(StationType::Slave, ResponseFunction::DataLow);
    let mut octets = [0; MAX_TELEGRAM];
    let answer = Telegram::Data {
        header: Header::new(at(TS), at(40), fc),
        data: &[9],
    };
    let length = answer.encode(&mut octets).unwrap();
    let octets = [&[0x55], &octets[..length], &octets[..length]].concat();
    bench.now += BAUD.characters(octets.len());
    bench.station.handle_octets(bench.now, &octets, &mut bench.user);
    assert_eq!(bench.user.outcomes, [""; 0]);
}

#[test]
fn line_errors_are_counted() {
    let mut bench = Bench::member();
    for count in 1..=3 {
        bench.quiet(bits(TID1 + 11));
        bench
            .station
            .handle_line_error(bench.now, LineError::Parity, &mut bench.user);
        assert_eq!(bench.station.statistics().line_errors, count);
    }
}

#[test]
fn an_answer_nobody_asked_for_is_not_answered() {
    let mut bench = Bench::member();
    bench.quiet(bits(TID1));
    let fc = FunctionCode::response(StationType::Slave, ResponseFunction::DataLow);
    bench.hear_telegram(Telegram::no_data(at(TS), at(40), fc));
    assert_eq!(bench.quiet(bits(TSL)), []);
    // Nor does it make the own address suspicious.
    for _ in 0..3 {
        bench.hear_telegram(Telegram::no_data(at(1), at(TS), fc));
        bench.quiet(bits(TID1));
    }
    assert_eq!(bench.user.events, []);
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
}

#[test]
fn a_listener_tells_nothing_of_a_ring_it_is_not_in() {
    let mut bench = Bench::new();
    bench.hear_rotations(2);
    assert!(!bench.station.is_in_ring());
    // 7 joins and leaves.
    for (sa, da) in [(1, 7), (7, 1), (1, 7), (7, 1), (1, 1), (1, 1)] {
        bench.token(sa, da);
    }
    assert_eq!(bench.user.events, []);
    assert!(Bench::member().station.is_in_ring());
    // Nor does one that is ready and has not had the token yet.
    let mut bench = Bench::new();
    bench.hear_rotations(2);
    bench.status_of(1);
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
    bench.token(1, 7);
    assert_eq!(bench.user.events, []);
}

#[test]
fn membership_is_what_was_commanded_last() {
    let mut bench = Bench::member();
    assert_eq!(bench.station.membership(), Membership::Ring);
    bench.station.set_membership(Membership::Ring);
    assert_eq!(bench.station.state(), FdlState::ActiveIdle);
    bench.station.set_membership(Membership::Passive);
    assert_eq!(bench.station.membership(), Membership::Passive);
    bench.quiet(bits(1));
    assert_eq!(bench.station.state(), FdlState::PassiveIdle);
    assert_eq!(bench.user.events, [RingEvent::Left(LeaveCause::Commanded)]);
    // While an answer leaves, the command waits for its end.
    let mut bench = Bench::member();
    bench.quiet(bits(TID1));
    let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
    bench.hear_telegram(Telegram::no_data(at(TS), at(1), fc));
    bench.now = bench.station.poll_timeout().unwrap();
    bench.station.handle_timeout(bench.now, &mut bench.user);
    let mut buf = [0; MAX_TELEGRAM];
    assert_eq!(
        bench.station.poll_transmit(bench.now, &mut buf, &mut bench.user),
        Some(6)
    );
    bench.station.set_membership(Membership::Offline);
    assert_ne!(bench.station.poll_timeout(), Some(Instant::ZERO));
    assert_eq!(bench.user.events, []);
}

#[test]
fn a_station_alone_works_on_without_a_token_between_its_cycles() {
    let mut bench = alone();
    bench.user.passes_between = true;
    bench.user.requests = vec![RequestFunction::SdnLow; 2_000];
    let before = bench.counted.tokens;
    let sent = bench.quiet(Duration::from_millis(150));
    // Only a station without work adds a little, so that two of them do not stay in step.
    for pair in sent.windows(2).filter(|pair| pair[0].1 == token(TS, TS)) {
        let pause = pair[1].0 - pair[0].0 - BAUD.characters(3);
        assert!(pause >= bits(TID1) && pause < bits(TID1 + 1), "{pause} behind a token");
    }
    let (tokens, requests) = (bench.counted.tokens - before, bench.user.outcomes.len());
    // SD2 of 11 characters and Tid2 are 271 tBIT, so there were 800 of them.
    assert!(requests > 780, "{requests} requests");
    // A token and Tid1 are 70 tBIT: 512 of them between two, about 130 requests.
    assert!((4..=9).contains(&tokens), "{tokens} tokens");
    // Commanded to leave, it does not wait for them.
    bench.station.set_membership(Membership::Passive);
    bench.quiet(Duration::from_millis(2));
    assert_eq!(bench.station.state(), FdlState::PassiveIdle);
}

#[test]
fn a_ring_is_claimed_with_two_tokens_tid1_apart() {
    let mut bench = Bench::new();
    let sent = bench.quiet(bits(16 * TSL + 2_000));
    assert_eq!((&sent[0].1, &sent[1].1), (&token(TS, TS), &token(TS, TS)));
    for pair in sent.windows(2) {
        let pause = pair[1].0 - pair[0].0 - BAUD.characters(pair[0].1.len());
        assert!(pause >= bits(TID1), "{pause} between {pair:02X?}");
    }
    // Then it looks for others before its user may do anything.
    for question in &sent[2..6] {
        assert_eq!((question.1[0], question.1[3]), (0x10, 0x49));
    }
}

#[test]
fn whoever_makes_a_ring_beside_another_listens_to_that_first() {
    // Until the second of its two tokens, and while it looks for others.
    for span in [16 * TSL + 10, 16 * TSL + 600] {
        let mut bench = Bench::new();
        bench.quiet(bits(span));
        let state = bench.station.state();
        assert!(
            matches!(state, FdlState::ClaimToken | FdlState::AwaitStatusResponse),
            "{state:?}"
        );
        bench.hear(&token(7, 1));
        assert_eq!(bench.user.events.last(), Some(&RingEvent::SecondToken(at(7))));
        assert_eq!(bench.station.state(), FdlState::ListenToken);
    }
}

/// A member whose last token came so long ago that nothing of Ttr is left.
fn late() -> Bench {
    let mut bench = Bench::member();
    let t_tr = u64::from(bench.station.params().t_tr.0);
    let mut passed = 0;
    while passed <= t_tr {
        // Others are busy.
        bench.request(1, 41, RequestFunction::SrdHigh);
        passed += 66 + TSL - 20 + TID1;
    }
    bench
}

#[test]
fn a_token_in_time_is_for_both_priorities() {
    let mut bench = Bench::member();
    bench.user.requests = vec![
        RequestFunction::SdnLow,
        RequestFunction::SdnHigh,
        RequestFunction::SdnLow,
    ];
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    bench.quiet(bits(3 * (11 * 11 + 150) + 200));
    assert_eq!(bench.user.outcomes, ["Sent"; 3]);
    assert!(bench.user.asked.iter().all(|access| *access == Access::Any));
}

#[test]
fn a_late_token_is_for_one_request_of_high_priority() {
    let mut bench = late();
    bench.user.requests = vec![RequestFunction::SdnHigh; 3];
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    // Tid1, SD2 of eleven characters, and after Tid2 = 150 the token.
    let sent = bench.quiet(bits(550));
    assert_eq!(sent.len(), 2);
    assert_eq!((sent[0].1[0], &sent[1].1), (0x68, &token(TS, 1)));
    assert_eq!(bench.user.asked, [Access::High]);
    assert_eq!(bench.user.requests.len(), 2, "they wait for the next token");
    // The rotation behind that one was short: both go out.
    bench.token(1, TS);
    bench.quiet(bits(500));
    assert_eq!(bench.user.requests, []);
}

#[test]
fn a_late_token_is_not_for_low_priority_and_is_passed_at_once() {
    let mut bench = late();
    bench.user.requests = vec![RequestFunction::SrdLow];
    assert_eq!(bench.token(1, TS), [token(TS, 1)]);
    assert_eq!(bench.user.outcomes, [""; 0]);
    let rotation = bench.station.statistics().longest_rotation;
    assert!(rotation > bits(78_000), "Trr {rotation}");
    // With the next one there is time.
    let sent = bench.token(1, TS);
    assert_eq!(sent[0][0], 0x68);
}

#[test]
fn hold_time_used_up_by_high_priority_leaves_none_for_low() {
    // Ttr 700: one SDN of 121 bits with Tid2 = 150 and the pause before it leave room for two more at most.
    let params = BusParams {
        t_tr: BitTimes(700),
        hsa: at(10),
        ..BusParams::standard(BAUD)
    };
    let mut bench = Bench::with_params(params);
    bench.hear_rotations(2);
    bench.status_of(1);
    bench.user.requests = vec![
        RequestFunction::SdnHigh,
        RequestFunction::SdnHigh,
        RequestFunction::SdnHigh,
        RequestFunction::SdnLow,
    ];
    bench.quiet(bits(TID1));
    bench.hear(&token(1, TS));
    let received = bench.now;
    let sent = bench.quiet(bits(1_200));
    // 37, 308, 579 are before 700; the fourth would begin at 850.
    let starts: Vec<_> = sent.iter().map(|(at, _)| BAUD.bits(*at - received)).collect();
    assert_eq!(starts[..3], [37, 308, 579]);
    assert_eq!(sent[3].1, token(TS, 1));
    assert_eq!(bench.user.requests, [RequestFunction::SdnLow]);
}

/// Something on the line.
#[derive(Debug, Clone)]
enum Heard {
    Token(u8, u8),
    Status(u8, u8),
    Request(u8, u8),
    Octets(Vec<u8>),
    Error,
}

fn heard() -> impl Strategy<Value = Heard> {
    let address = || prop::sample::select(vec![0u8, 1, 4, TS, 7, 40, 126]);
    prop_oneof![
        4 => (address(), address()).prop_map(|(sa, da)| Heard::Token(sa, da)),
        2 => (address(), address()).prop_map(|(sa, da)| Heard::Status(sa, da)),
        2 => (address(), address()).prop_map(|(sa, da)| Heard::Request(sa, da)),
        1 => prop::collection::vec(any::<u8>(), 1..20).prop_map(Heard::Octets),
        1 => Just(Heard::Error),
    ]
}

proptest! {
    /// Whatever is heard: deadlines move on, nothing is sent within Tsyn behind a character that was heard, and when the line falls
    /// silent the station works alone.
    #[test]
    fn whatever_it_hears_a_station_keeps_its_times_and_works_when_the_others_are_gone(
        sequence in prop::collection::vec((heard(), prop_oneof![Just(TID1), 12u64..400, 1_000u64..9_000]), 0..60),
    ) {
        let mut bench = Bench::new();
        for (heard, pause) in sequence {
            let silent = bench.now;
            for (at, octets) in bench.quiet(bits(pause)) {
                // An answer has min Tsdr, everything else Tid1, which holds Tsyn = 33.
                let least = if octets[0] == 0x10 && octets[2] == TS && octets[3] & 0x40 == 0 { TSDR } else { 33 };
                prop_assert!(at - silent >= bits(least));
            }
            prop_assert!(bench.station.poll_timeout().is_none_or(|due| due > bench.now));
            match heard {
                Heard::Token(sa, da) => bench.hear(&token(sa, da)),
                Heard::Status(sa, da) => {
                    let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
                    bench.hear_telegram(Telegram::no_data(at(da), at(sa), fc));
                }
                Heard::Request(sa, da) => {
                    let fc = FunctionCode::request(Fcb::First, RequestFunction::SrdHigh);
                    bench.hear_telegram(Telegram::no_data(at(da), at(sa), fc));
                }
                Heard::Octets(octets) => bench.hear(&octets),
                Heard::Error => {
                    bench.now += BAUD.characters(1);
                    bench.station.handle_line_error(bench.now, LineError::Framing, &mut bench.user);
                }
            }
        }
        // The pause after a duplicate address, Ttimeout, and every address that was heard offered the token three times.
        bench.quiet(Duration::from_millis(1_000));
        bench.quiet(bits((6 + 2 * u64::from(TS)) * TSL + 255 * 11 + 8 * 3 * (TSL + 33) + 10_000));
        prop_assert_eq!(bench.station.las().iter().collect::<Vec<_>>(), [at(TS)]);
        prop_assert!(bench.station.is_in_ring());
    }
}
