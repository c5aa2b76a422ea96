//! A disturbed token: what its format lets through, the protocol of the ring has to catch.
//!
//! The token has no frame check sequence, so two flips inside one address pass as another token (`error_detection.rs` counts them). Every
//! one of them is tried here on every token of a ring of three:
//!
//! - no station that should not have the token takes it, and never are there two;
//! - the station that passed it hears nobody and repeats it, so it is not lost either;
//! - the other stations believe a disturbed token as far as their lists go: it may take a member out of them that it seems to pass over.
//!   The next tokens and the GAP set that right, within the bound for a newcomer.
//!
//! Addresses 2, 4 and 7 are chosen so that two flips lead from one member to another.
//!
//! Source: IEC 61158-4-3: a token is taken from the previous station, from another one only when it comes twice; the token is repeated when
//! nothing is heard within the slot time.

use dp_master::fdl::{FdlState, RingEvent};
use dp_master::phy::Script;
use dp_master::time::{Duration, Instant};

use crate::ring_bench::{Bench, Bounds, Half, bits, params};

const MEMBERS: [u8; 3] = [2, 4, 7];
/// The addresses in the token: characters 1 and 2.
const DA: usize = 1;
const SA: usize = 2;

/// Two flips among the nine data and parity bits of a character, as `Script::Flip` wants them.
fn double_errors() -> impl Iterator<Item = u16> {
    (1..=9).flat_map(|first| (first + 1..=9).map(move |second| 1 << first | 1 << second))
}

fn ring() -> Bench {
    let mut bench = Bench::with_masters(&MEMBERS, params(10));
    (0..MEMBERS.len()).for_each(|master| bench.power_on(master));
    bench.run_until(bits(8_000_000), Bench::is_one_ring);
    bench
}

/// Runs until `master` passes its token on, with the flips in that token; returns the number of that transmission.
fn disturb_token_of(bench: &mut Bench, master: usize, character: usize, bits: u16) -> u64 {
    loop {
        // The next transmission is the one of this master: it holds the token, and in this ring nobody else speaks then.
        bench.run_until(Duration::from_millis(20), |bench| {
            bench.station(master).holds_token() && bench.state(master) != FdlState::CheckTokenPass
        });
        let burst = bench.halves[0].bursts();
        bench.halves[0].script(Script::Flip { burst, character, bits });
        while bench.halves[0].bursts() == burst {
            bench.step_to(Instant::MAX);
        }
        // A look for newcomers is no token.
        if bench.state(master) == FdlState::CheckTokenPass {
            return burst;
        }
        bench.run_until(Duration::from_millis(20), |bench| !bench.station(master).holds_token());
    }
}

#[test]
fn no_double_error_in_a_token_gives_it_to_a_station_that_should_not_have_it_or_loses_it() {
    let mut bench = ring();
    let members = bench.live();
    let bounds = Bounds::of(&params(10));
    let before = bench
        .masters
        .iter()
        .map(|master| master.events.len())
        .collect::<Vec<_>>();
    bench.last_double = None;
    let mut tried = 0;
    for master in 0..MEMBERS.len() {
        for character in [DA, SA] {
            for flipped in double_errors() {
                let burst = disturb_token_of(&mut bench, master, character, flipped);
                // Nobody takes it; after the slot time it comes again.
                while bench.halves[0].bursts() == burst + 1 {
                    assert_eq!(bench.holders(Half::Near), [], "{flipped:03X} {}", bench.describe());
                    assert_eq!(bench.state(master), FdlState::CheckTokenPass);
                    bench.step_to(Instant::MAX);
                }
                // Time enough for wrong lists to be acted on, then that of a member that has to be admitted again.
                bench.run_for(bits(2 * bounds.rotation(3, 0)));
                bench.run_until(bits(bounds.ring_scan(3, 0)), |bench| bench.is_ring_of(members));
                assert_eq!(bench.last_double, None, "two tokens: {}", bench.describe());
                tried += 1;
            }
        }
    }
    // C(9, 2) in each of two addresses of each of three tokens.
    assert_eq!(tried, 36 * 2 * 3);
    for (master, before) in before.into_iter().enumerate() {
        for event in bench.ring_events(master).split_off(before) {
            assert!(
                !matches!(
                    event,
                    RingEvent::Claimed | RingEvent::TokenLost | RingEvent::SecondToken(_) | RingEvent::DuplicateAddress
                ),
                "{event:?}"
            );
        }
    }
    bench.assert_no_violations();
}
