//! The virtual line: timing, order of events, rules, disturbances.

use dp_master::phy::{BusEvent, Disturbance, PortId, Rule, Script, VirtualBus, next_wakeup, pump};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use proptest::prelude::*;

/// FDL status request of station 2 to station 3, and the answer of a slave. Source: IEC 61158-4-3.
const REQUEST: [u8; 6] = [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16];
const REPLY: [u8; 6] = [0x10, 0x02, 0x03, 0x00, 0x05, 0x16];
const TOKEN: [u8; 3] = [0xDC, 0x02, 0x02];

/// An event that owns its octets.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Seen {
    Sent(usize),
    Octets(usize, Vec<u8>),
    Error(usize, LineError),
}

fn drain(bus: &mut VirtualBus, until: Instant) -> Vec<(u64, Seen)> {
    let mut seen = Vec::new();
    while let Some(event) = bus.poll(until) {
        let port = event.port().index();
        let what = match event {
            BusEvent::Sent { .. } => Seen::Sent(port),
            BusEvent::Octets { octets, .. } => Seen::Octets(port, octets.to_vec()),
            BusEvent::LineError { error, .. } => Seen::Error(port, error),
        };
        seen.push((event.at().as_nanos(), what));
    }
    seen
}

fn line(ports: usize) -> (VirtualBus, Vec<PortId>) {
    let mut bus = VirtualBus::new(Baud::B12000000);
    let ports = (0..ports).map(|_| bus.attach()).collect();
    (bus, ports)
}

fn at(nanos: u64) -> Instant {
    Instant::from_nanos(nanos)
}

fn rules(bus: &VirtualBus) -> Vec<(Rule, u64)> {
    bus.violations()
        .iter()
        .map(|violation| (violation.rule, violation.measured_bits))
        .collect()
}

// --- timing -------------------------------------------------------------------------------------------------------------------------------

#[test]
fn twenty_five_characters_end_after_275_bit_times_at_all_ten_baud_rates() {
    // 275 bits / baud rate, rounded up to a nanosecond, by hand.
    let expected = [
        (Baud::B9600, 28_645_834_u64),
        (Baud::B19200, 14_322_917),
        (Baud::B45450, 6_050_606),
        (Baud::B93750, 2_933_334),
        (Baud::B187500, 1_466_667),
        (Baud::B500000, 550_000),
        (Baud::B1500000, 183_334),
        (Baud::B3000000, 91_667),
        (Baud::B6000000, 45_834),
        (Baud::B12000000, 22_917),
    ];
    assert_eq!(expected.map(|(baud, _)| baud), Baud::ALL);
    for (baud, nanos) in expected {
        let mut bus = VirtualBus::new(baud);
        let (sender, _) = (bus.attach(), bus.attach());
        let start = at(1_000);
        assert_eq!(bus.transmit(start, sender, &[0x55; 25]), at(1_000 + nanos));
        let first = bus.poll_timeout();
        assert_eq!(first, Some(start + baud.characters(1)), "first character at {baud}");
        let seen = drain(&mut bus, Instant::MAX);
        assert_eq!(
            seen.last().map(|(at, _)| *at),
            Some(1_000 + nanos),
            "last character at {baud}"
        );
    }
}

#[test]
fn receivers_get_the_first_character_and_then_the_rest_and_the_sender_is_told_before_them() {
    let (mut bus, ports) = line(3);
    bus.transmit(Instant::ZERO, ports[1], &REQUEST);
    // 11 and 66 bits at 12 Mbit/s: 916.7 and 5500 ns.
    assert_eq!(
        drain(&mut bus, Instant::MAX),
        [
            (917, Seen::Octets(0, vec![0x10])),
            (917, Seen::Octets(2, vec![0x10])),
            (5_500, Seen::Sent(1)),
            (5_500, Seen::Octets(0, REQUEST[1..].to_vec())),
            (5_500, Seen::Octets(2, REQUEST[1..].to_vec())),
        ]
    );
    assert_eq!(bus.poll_timeout(), None);
}

#[test]
fn nothing_is_delivered_before_its_time() {
    let (mut bus, ports) = line(2);
    bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    assert_eq!(bus.poll(at(916)), None);
    assert_eq!(drain(&mut bus, at(917)).len(), 1);
    assert!(bus.is_sending(ports[0]));
    assert_eq!(bus.poll_timeout(), Some(at(2_750)));
    assert_eq!(bus.poll(at(2_749)), None);
    assert_eq!(drain(&mut bus, at(2_750)).len(), 2);
    assert!(!bus.is_sending(ports[0]));
}

#[test]
fn a_single_character_is_first_and_last_at_once() {
    let (mut bus, ports) = line(2);
    bus.transmit(Instant::ZERO, ports[0], &[0xE5]);
    assert_eq!(
        drain(&mut bus, Instant::MAX),
        [(917, Seen::Sent(0)), (917, Seen::Octets(1, vec![0xE5]))]
    );
}

#[test]
fn no_octets_and_a_port_of_another_line_are_no_transmission() {
    let (mut bus, ports) = line(2);
    let (_, others) = line(3);
    assert_eq!(bus.transmit(at(5), ports[0], &[]), at(5));
    assert_eq!(bus.transmit(at(5), others[2], &TOKEN), at(5));
    assert_eq!((bus.bursts(), bus.poll_timeout()), (0, None));
    bus.transmit(at(5), ports[0], &TOKEN);
    let statistics = bus.statistics();
    assert_eq!((bus.bursts(), statistics.bursts, statistics.characters), (1, 1, 3));
}

// --- rules --------------------------------------------------------------------------------------------------------------------------------

#[test]
fn a_reply_may_come_11_bits_after_its_request_and_not_one_nanosecond_sooner() {
    for baud in Baud::ALL {
        for (early, expected) in [(0_u64, vec![]), (1, vec![(Rule::MinTsdr, 10_u64)])] {
            let mut bus = VirtualBus::new(baud);
            let (master, slave) = (bus.attach(), bus.attach());
            let end = bus.transmit(Instant::ZERO, master, &REQUEST);
            drain(&mut bus, end);
            bus.transmit(
                end + baud.duration(BitTimes(11)) - Duration::from_nanos(early),
                slave,
                &REPLY,
            );
            assert_eq!(rules(&bus), expected, "{baud}");
        }
    }
}

#[test]
fn a_request_or_a_token_needs_33_idle_bits_before_it() {
    for telegram in [&REQUEST[..], &TOKEN[..]] {
        for (early, expected) in [(0_u64, vec![]), (1, vec![(Rule::Tsyn, 32_u64)])] {
            let (mut bus, ports) = line(2);
            let end = bus.transmit(at(5), ports[0], &TOKEN);
            drain(&mut bus, end);
            bus.transmit(
                end + bus.baud().duration(BitTimes(33)) - Duration::from_nanos(early),
                ports[0],
                telegram,
            );
            assert_eq!(rules(&bus), expected);
        }
    }
}

#[test]
fn the_first_telegram_on_a_line_needs_no_pause() {
    let (mut bus, ports) = line(2);
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    assert!(bus.violations().is_empty());
}

#[test]
fn nobody_answers_unasked() {
    let (mut bus, ports) = line(2);
    let end = bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    drain(&mut bus, end);
    bus.transmit(end + bus.baud().duration(BitTimes(40)), ports[1], &[0xE5]);
    assert_eq!(rules(&bus), [(Rule::Unasked, 40)]);
}

#[test]
fn a_station_does_not_answer_itself() {
    let (mut bus, ports) = line(2);
    let end = bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    drain(&mut bus, end);
    bus.transmit(end + bus.baud().duration(BitTimes(11)), ports[0], &REPLY);
    assert_eq!(rules(&bus), [(Rule::Unasked, 11)]);
}

#[test]
fn a_transmission_that_is_not_one_telegram_is_reported() {
    let (mut bus, ports) = line(2);
    bus.transmit(Instant::ZERO, ports[0], &REQUEST[..5]);
    assert_eq!(rules(&bus), [(Rule::Malformed, 5)]);
}

#[test]
fn a_telegram_of_eight_octets_of_data_is_a_request_or_an_answer_by_its_function_code() {
    // SD3: 14 octets. 4C is a request Send and Request Data low that expects an answer, 08 an answer. Source: IEC 61158-4-3.
    let telegram = |fc| [0xA2, 0x03, 0x02, fc, 1, 2, 3, 4, 5, 6, 7, 8, 0, 0x16];
    let (mut bus, ports) = line(2);
    let end = bus.transmit(Instant::ZERO, ports[0], &telegram(0x4C));
    drain(&mut bus, end);
    let answer = end + bus.baud().duration(BitTimes(11));
    let end = bus.transmit(answer, ports[1], &telegram(0x08));
    assert_eq!(rules(&bus), []);
    drain(&mut bus, end);
    // Without the pause of a request, and one octet short.
    bus.transmit(end, ports[0], &telegram(0x4C));
    drain(&mut bus, Instant::MAX);
    bus.transmit(end + Duration::from_millis(1), ports[0], &telegram(0x4C)[..13]);
    assert_eq!(rules(&bus), [(Rule::Tsyn, 0), (Rule::Malformed, 13)]);
}

#[test]
fn the_first_1024_violations_are_kept_and_all_are_counted_until_they_are_cleared() {
    let (mut bus, ports) = line(1);
    let mut now = Instant::ZERO;
    // Nobody asked for any of these answers.
    for _ in 0..1_030 {
        now = bus.transmit(now, ports[0], &[0xE5]) + bus.baud().duration(BitTimes(50));
        drain(&mut bus, now);
    }
    assert_eq!(bus.violations().len(), 1_024);
    assert_eq!(bus.statistics().violations, 1_030);
    bus.clear_violations();
    assert_eq!((bus.violations(), bus.statistics().violations), (&[][..], 0));
}

// --- collisions ---------------------------------------------------------------------------------------------------------------------------

#[test]
fn overlapping_characters_are_useless_for_everyone_and_the_collision_is_recorded() {
    let (mut bus, ports) = line(3);
    // Six characters from 0 to 5500 ns, three from 3000 to 5750 ns: the fourth character (2750…3667) is hit first.
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    let before = drain(&mut bus, at(3_000));
    assert_eq!(
        before,
        [(917, Seen::Octets(1, vec![0x10])), (917, Seen::Octets(2, vec![0x10]))]
    );
    bus.transmit(at(3_000), ports[1], &TOKEN);
    let third: Vec<_> = drain(&mut bus, Instant::MAX)
        .into_iter()
        .filter(|(_, seen)| matches!(seen, Seen::Octets(2, _) | Seen::Error(2, _)))
        .collect();
    let framing = Seen::Error(2, LineError::Framing);
    assert_eq!(
        third,
        [
            // What had arrived when the collision began comes at that moment.
            (3_000, Seen::Octets(2, vec![0x03, 0x02])),
            (3_667, framing.clone()),
            (3_917, framing.clone()),
            (4_584, framing.clone()),
            (4_834, framing.clone()),
            (5_500, framing.clone()),
            (5_750, framing),
        ]
    );
    assert_eq!(rules(&bus), [(Rule::Collision, 0)]);
}

#[test]
fn both_senders_of_a_collision_are_told_when_their_own_last_bit_left() {
    let (mut bus, ports) = line(2);
    bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    bus.transmit(Instant::ZERO, ports[1], &REQUEST);
    let seen = drain(&mut bus, Instant::MAX);
    assert!(seen.contains(&(2_750, Seen::Sent(0))));
    assert!(seen.contains(&(5_500, Seen::Sent(1))));
    // Port 0 has finished and hears the second half, which nothing disturbs any more; port 1 was sending all the time.
    assert!(seen.contains(&(5_500, Seen::Octets(0, REQUEST[3..].to_vec()))));
    assert!(
        !seen
            .iter()
            .any(|(_, seen)| matches!(seen, Seen::Octets(1, _) | Seen::Error(..)))
    );
}

#[test]
fn of_two_that_end_together_the_one_that_began_first_is_told_first() {
    let (mut bus, ports) = line(3);
    bus.transmit(Instant::ZERO, ports[1], &TOKEN);
    bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    let framing = Seen::Error(2, LineError::Framing);
    let of_one = [
        (917, framing.clone()),
        (917, framing.clone()),
        (1_834, framing.clone()),
        (1_834, framing.clone()),
        (2_750, Seen::Sent(1)),
        (2_750, framing.clone()),
        (2_750, Seen::Sent(0)),
        (2_750, framing),
    ];
    assert_eq!(drain(&mut bus, Instant::MAX), of_one);
}

#[test]
fn a_telegram_after_a_collision_arrives_whole() {
    let (mut bus, ports) = line(3);
    bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    bus.transmit(at(100), ports[1], &TOKEN);
    drain(&mut bus, at(100_000));
    bus.transmit(at(100_000), ports[0], &REQUEST);
    let octets: Vec<u8> = drain(&mut bus, Instant::MAX)
        .into_iter()
        .filter_map(|(_, seen)| {
            if let Seen::Octets(2, octets) = seen {
                Some(octets)
            } else {
                None
            }
        })
        .flatten()
        .collect();
    assert_eq!(octets, REQUEST);
}

#[test]
fn a_short_collision_spoils_the_characters_it_touches_and_no_others() {
    // The fourth of six characters, 2750…3667 ns; the one before ends and the one behind begins where the other transmission does.
    let (mut bus, ports) = line(3);
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    drain(&mut bus, at(1_000));
    bus.transmit(at(2_750), ports[1], &[0xE5]);
    let third: Vec<_> = drain(&mut bus, Instant::MAX)
        .into_iter()
        .filter(|(_, seen)| matches!(seen, Seen::Octets(2, _) | Seen::Error(2, _)))
        .collect();
    assert_eq!(
        third,
        [
            (2_750, Seen::Octets(2, vec![0x03, 0x02])),
            (3_667, Seen::Error(2, LineError::Framing)),
            (3_667, Seen::Error(2, LineError::Framing)),
            (5_500, Seen::Octets(2, vec![0x4E, 0x16])),
        ]
    );
}

#[test]
fn who_begins_when_the_other_ends_does_not_collide() {
    let (mut bus, ports) = line(2);
    let end = bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    bus.transmit(end, ports[1], &TOKEN);
    assert_eq!(rules(&bus), [(Rule::Tsyn, 0)]);
}

#[test]
fn a_transmission_that_is_not_on_the_line_collides_with_nothing() {
    let (mut bus, ports) = line(3);
    bus.disconnect(ports[0]);
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    bus.transmit(at(1_000), ports[1], &TOKEN);
    assert_eq!(rules(&bus), []);
    let octets = drain(&mut bus, Instant::MAX);
    assert!(
        octets.contains(&(3_750, Seen::Octets(2, TOKEN[1..].to_vec()))),
        "{octets:?}"
    );
}

#[test]
fn a_collision_on_a_cut_line_is_heard_by_nobody() {
    let (mut bus, ports) = line(3);
    let (from, to) = (Instant::ZERO, at(10_000));
    bus.script(Script::Cut { from, to });
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    bus.transmit(at(3_000), ports[1], &TOKEN);
    assert_eq!(
        drain(&mut bus, Instant::MAX),
        [(5_500, Seen::Sent(0)), (5_750, Seen::Sent(1))]
    );
}

// --- disturbances -------------------------------------------------------------------------------------------------------------------------

#[test]
fn a_spoiled_character_stands_in_its_place_and_divides_the_rest() {
    let (mut bus, ports) = line(2);
    bus.script(Script::Spoil {
        burst: 0,
        character: 3,
        error: LineError::Parity,
    });
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    assert_eq!(
        drain(&mut bus, Instant::MAX),
        [
            (917, Seen::Octets(1, vec![0x10])),
            (2_750, Seen::Octets(1, vec![0x03, 0x02])),
            (3_667, Seen::Error(1, LineError::Parity)),
            (5_500, Seen::Sent(0)),
            (5_500, Seen::Octets(1, vec![0x4E, 0x16])),
        ]
    );
    assert_eq!(bus.statistics().spoiled, 1);
}

#[test]
fn a_script_hits_the_burst_it_names_and_no_other() {
    let (mut bus, ports) = line(2);
    bus.script(Script::Drop { burst: 1 });
    for number in 0..3 {
        assert_eq!(bus.bursts(), number);
        let start = at(number * 1_000_000);
        bus.transmit(start, ports[0], &TOKEN);
        let heard = drain(&mut bus, start + Duration::from_micros(100))
            .iter()
            .filter(|(_, seen)| matches!(seen, Seen::Octets(..)))
            .count();
        assert_eq!(heard, if number == 1 { 0 } else { 2 }, "burst {number}");
    }
    assert_eq!(bus.statistics().lost, 3);
    assert!(bus.violations().is_empty());
}

#[test]
fn flipped_bits_are_seen_as_a_uart_sees_them() {
    let (mut bus, ports) = line(2);
    // Data bits 0 and 1 of the second character: an unnoticed other octet. Stop bit of the third: framing.
    bus.script(Script::Flip {
        burst: 0,
        character: 1,
        bits: 0b110,
    });
    bus.script(Script::Flip {
        burst: 0,
        character: 2,
        bits: 1 << 10,
    });
    bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    let seen: Vec<_> = drain(&mut bus, Instant::MAX)
        .into_iter()
        .map(|(_, seen)| seen)
        .collect();
    assert_eq!(
        seen,
        [
            Seen::Octets(1, vec![0xDC]),
            Seen::Octets(1, vec![0x02 ^ 0b11]),
            Seen::Sent(0),
            Seen::Error(1, LineError::Framing)
        ]
    );
}

#[test]
fn a_cut_line_carries_only_the_characters_outside_the_cut() {
    let (mut bus, ports) = line(2);
    // Characters end at 917, 1834, 2750, 3667, 4584, 5500 ns.
    bus.script(Script::Cut {
        from: at(1_000),
        to: at(4_584),
    });
    bus.transmit(Instant::ZERO, ports[0], &REQUEST);
    let octets: Vec<_> = drain(&mut bus, Instant::MAX)
        .into_iter()
        .filter(|(_, seen)| matches!(seen, Seen::Octets(..)))
        .collect();
    assert_eq!(
        octets,
        [
            (917, Seen::Octets(1, vec![0x10])),
            (5_500, Seen::Octets(1, vec![0x4E, 0x16]))
        ]
    );
}

#[test]
fn a_cut_takes_every_telegram_until_it_ends() {
    let (mut bus, ports) = line(2);
    let (from, to) = (at(1_000), at(50_000));
    bus.script(Script::Cut { from, to });
    let mut heard = Vec::new();
    for start in [10_000, 20_000, 60_000] {
        bus.transmit(at(start), ports[0], &TOKEN);
        let seen = drain(&mut bus, at(start + 5_000));
        heard.push(seen.iter().filter(|(_, seen)| matches!(seen, Seen::Octets(..))).count());
    }
    assert_eq!(heard, [0, 0, 2]);
    assert_eq!(bus.statistics().lost, 6);
}

#[test]
fn what_a_script_does_to_characters_is_counted_when_there_is_such_a_character() {
    for (character, spoiled) in [(5, 1), (6, 0), (7, 0)] {
        let error = LineError::Parity;
        for script in [
            Script::Spoil {
                burst: 0,
                character,
                error,
            },
            Script::Flip {
                burst: 0,
                character,
                bits: 0b10,
            },
        ] {
            let (mut bus, ports) = line(2);
            bus.script(script);
            bus.transmit(Instant::ZERO, ports[0], &REQUEST);
            assert_eq!(bus.statistics().spoiled, spoiled, "{script:?}");
            let errors = drain(&mut bus, Instant::MAX);
            let errors = errors.iter().filter(|(_, seen)| matches!(seen, Seen::Error(..)));
            assert_eq!(errors.count() as u64, spoiled, "{script:?}");
        }
    }
}

#[test]
fn a_disconnected_port_neither_hears_nor_is_heard_until_it_is_back() {
    let (mut bus, ports) = line(3);
    bus.disconnect(ports[1]);
    bus.transmit(Instant::ZERO, ports[0], &TOKEN);
    let seen = drain(&mut bus, at(10_000));
    assert!(!seen.iter().any(|(_, seen)| matches!(seen, Seen::Octets(1, _))));
    assert!(seen.iter().any(|(_, seen)| matches!(seen, Seen::Octets(2, _))));
    bus.transmit(at(10_000), ports[1], &TOKEN);
    assert_eq!(drain(&mut bus, at(20_000)), [(12_750, Seen::Sent(1))]);
    bus.reconnect(ports[1]);
    bus.transmit(at(20_000), ports[1], &TOKEN);
    assert_eq!(drain(&mut bus, Instant::MAX).len(), 5);
}

#[test]
fn a_disturbed_line_repeats_itself_bit_for_bit_with_the_same_seed() {
    let run = |seed| {
        let (mut bus, ports) = line(2);
        bus.set_disturbance(Some(Disturbance::new(seed, 2e-3).unwrap()));
        let mut all = Vec::new();
        for number in 0..500 {
            let start = at(number * 1_000_000);
            bus.transmit(start, ports[0], &[0x5A; 25]);
            all.extend(drain(&mut bus, start + Duration::from_micros(900)));
        }
        (all, bus.statistics())
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
}

#[test]
fn the_share_of_spoiled_characters_is_that_of_the_bit_error_rate() {
    let (mut bus, ports) = line(2);
    bus.set_disturbance(Some(Disturbance::new(11, 1e-3).unwrap()));
    for number in 0..20_000_u64 {
        let start = at(number * 1_000_000);
        bus.transmit(start, ports[0], &[0x5A; 25]);
        while bus.poll(start + Duration::from_micros(900)).is_some() {}
    }
    // A character survives with (1 - 10⁻³)¹¹: 1.0945 % of 500 000 are spoiled, 5472 with a standard deviation of 74.
    let spoiled = bus.statistics().spoiled;
    assert!((5_100..5_850).contains(&spoiled), "{spoiled}");
    assert_eq!(bus.statistics().characters, 500_000);
}

#[test]
fn a_disturbance_tells_its_rate() {
    assert_eq!(Disturbance::new(1, 2.5e-3).unwrap().bit_error_rate(), 2.5e-3);
}

#[test]
fn all_receivers_see_the_same_disturbance() {
    let (mut bus, ports) = line(3);
    bus.set_disturbance(Some(Disturbance::new(5, 2e-2).unwrap()));
    bus.transmit(Instant::ZERO, ports[0], &[0x5A; 200]);
    let seen = drain(&mut bus, Instant::MAX);
    let of = |wanted: usize| -> Vec<(u64, Result<Vec<u8>, LineError>)> {
        seen.iter()
            .filter_map(|(at, seen)| match seen {
                Seen::Octets(port, octets) if *port == wanted => Some((*at, Ok(octets.clone()))),
                Seen::Error(port, error) if *port == wanted => Some((*at, Err(*error))),
                _ => None,
            })
            .collect()
    };
    assert_eq!(of(1), of(2));
    assert!(of(1).iter().any(|(_, seen)| seen.is_err()));
}

// --- stations -----------------------------------------------------------------------------------------------------------------------------

/// Asks every millisecond, or answers everything after 11 bits.
struct Simple {
    role: Role,
    next: Option<Instant>,
    wants: bool,
    heard: Vec<(u64, Vec<u8>)>,
    sent: Vec<u64>,
}

#[derive(PartialEq)]
enum Role {
    Asks,
    Answers,
}

impl Simple {
    fn new(role: Role) -> Self {
        let next = (role == Role::Asks).then_some(Instant::ZERO);
        Self {
            role,
            next,
            wants: false,
            heard: Vec::new(),
            sent: Vec::new(),
        }
    }
}

impl Station for Simple {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.heard.push((now.as_nanos(), octets.to_vec()));
        if self.role == Role::Answers && octets.len() > 1 {
            self.next = Some(now + Baud::B12000000.duration(BitTimes(11)));
        }
    }
    fn handle_line_error(&mut self, _: Instant, _: LineError) {}
    fn handle_sent(&mut self, now: Instant) {
        self.sent.push(now.as_nanos());
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.wants = true;
        self.next = (self.role == Role::Asks).then_some(now + Duration::from_millis(1));
    }
    fn poll_transmit(&mut self, _: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        if !std::mem::take(&mut self.wants) {
            return None;
        }
        let telegram = if self.role == Role::Asks { REQUEST } else { REPLY };
        buf[..6].copy_from_slice(&telegram);
        Some(6)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

fn run(steps: impl Fn(&VirtualBus, &[(PortId, &mut dyn Station)], Instant) -> Instant) -> (Simple, Simple) {
    let (mut bus, ports) = line(2);
    let (mut master, mut slave) = (Simple::new(Role::Asks), Simple::new(Role::Answers));
    {
        let mut stations: [(PortId, &mut dyn Station); 2] = [(ports[0], &mut master), (ports[1], &mut slave)];
        let mut now = Instant::ZERO;
        while now < at(3_500_000) {
            pump(&mut bus, now, &mut stations);
            now = steps(&bus, &stations, now);
        }
        pump(&mut bus, at(3_500_000), &mut stations);
    }
    assert!(bus.violations().is_empty(), "{:?}", bus.violations());
    (master, slave)
}

#[test]
fn the_pump_runs_an_exchange_with_every_call_at_its_time() {
    let (master, slave) = run(|bus, stations, _| next_wakeup(bus, stations).unwrap());
    // Request 0…5500 ns, pause 917 ns, reply 6417…11 917 ns, its first character until 7334 ns.
    assert_eq!(slave.heard[..2], [(917, vec![0x10]), (5_500, REQUEST[1..].to_vec())]);
    assert_eq!(master.heard[..2], [(7_334, vec![0x10]), (11_917, REPLY[1..].to_vec())]);
    assert_eq!(master.sent, [5_500, 1_005_500, 2_005_500, 3_005_500]);
    assert_eq!(slave.sent, [11_917, 1_011_917, 2_011_917, 3_011_917]);
}

#[test]
fn the_pump_gives_the_same_calls_in_small_and_in_large_steps() {
    let exact = run(|bus, stations, _| next_wakeup(bus, stations).unwrap());
    for step in [777, 10_000, 3_499_999] {
        let coarse = run(|_, _, now| now + Duration::from_nanos(step));
        assert_eq!(exact.0.heard, coarse.0.heard);
        assert_eq!(exact.1.heard, coarse.1.heard);
        assert_eq!(exact.0.sent, coarse.0.sent);
    }
}

#[test]
fn the_pump_finds_every_station_whatever_their_order_and_passes_over_ports_without_one() {
    let (mut bus, ports) = line(3);
    let (mut master, mut slave) = (Simple::new(Role::Asks), Simple::new(Role::Answers));
    let mut stations: [(PortId, &mut dyn Station); 2] = [(ports[2], &mut slave), (ports[1], &mut master)];
    pump(&mut bus, at(999_999), &mut stations);
    // As in an exchange of stations in the order of their ports.
    assert_eq!(slave.heard, [(917, vec![0x10]), (5_500, REQUEST[1..].to_vec())]);
    assert_eq!(master.heard, [(7_334, vec![0x10]), (11_917, REPLY[1..].to_vec())]);
    assert_eq!((master.sent, slave.sent), (vec![5_500], vec![11_917]));
    assert!(bus.violations().is_empty());
}

// --- properties ---------------------------------------------------------------------------------------------------------------------------

proptest! {
    /// Whatever is sent when and disturbed how: events come in the order of time, every sender is told once per burst, and nobody gets more
    /// characters than were sent by the others.
    #[test]
    fn events_come_in_the_order_of_time_and_nothing_is_lost_or_doubled(
        bursts in prop::collection::vec((0_u64..8_000, 0_usize..3, 1_usize..12), 1..12),
        seed in any::<u64>(),
        rate in prop_oneof![Just(0.0), Just(1e-2), Just(0.2)],
    ) {
        let (mut bus, ports) = line(3);
        bus.set_disturbance(Some(Disturbance::new(seed, rate).unwrap()));
        let mut now = Instant::ZERO;
        let mut seen = Vec::new();
        for (pause, port, length) in &bursts {
            now += Duration::from_nanos(*pause);
            seen.extend(drain(&mut bus, now));
            bus.transmit(now, ports[*port], &[0x68; 12][..*length]);
        }
        seen.extend(drain(&mut bus, Instant::MAX));
        prop_assert!(seen.windows(2).all(|pair| pair[0].0 <= pair[1].0), "{seen:?}");
        for port in 0..3 {
            let own = bursts.iter().filter(|burst| burst.1 == port).count();
            prop_assert_eq!(seen.iter().filter(|(_, seen)| *seen == Seen::Sent(port)).count(), own);
            let others: usize = bursts.iter().filter(|burst| burst.1 != port).map(|burst| burst.2).sum();
            let heard: usize = seen.iter().map(|(_, seen)| match seen {
                Seen::Octets(at, octets) if *at == port => octets.len(),
                Seen::Error(at, _) if *at == port => 1,
                _ => 0,
            }).sum();
            prop_assert!(heard <= others);
        }
        prop_assert_eq!(bus.poll_timeout(), None);
    }
}
