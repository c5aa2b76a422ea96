//! A ring that fails: dead masters in every state, a cut line, duplicate addresses, lost tokens, noise.
//!
//! All bounds follow from Ttimeout, the slot time and the GAP (`ring_bench::Bounds`).

use dp_master::fdl::{BusParams, FdlState, LeaveCause, RingEvent};
use dp_master::phy::{Disturbance, Script};
use dp_master::time::Duration;

use crate::ring_bench::{BAUD, Bench, Bounds, CYCLE, at, bits, params};

fn ring(addresses: &[u8], params: BusParams) -> Bench {
    let mut bench = Bench::with_slaves(addresses, params);
    (0..addresses.len()).for_each(|master| bench.power_on(master));
    bench.run_until(bits(8_000_000), |bench| bench.is_one_ring() && bench.all_exchange());
    // Also the first scans are over.
    bench.run_for(Duration::from_millis(50));
    assert!(bench.is_one_ring());
    bench
}

/// Each has a GAP.
const MEMBERS: [u8; 4] = [1, 3, 5, 8];

#[test]
fn a_master_that_dies_in_any_state_is_outlived_within_the_bound() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    let states = [
        FdlState::UseToken,
        FdlState::AwaitDataResponse,
        FdlState::CheckAccessTime,
        FdlState::AwaitStatusResponse,
        FdlState::CheckTokenPass,
        FdlState::ActiveIdle,
    ];
    for victim in 0..MEMBERS.len() {
        for state in states {
            let mut bench = ring(&MEMBERS, params);
            bench.run_until(bits(bounds.ring_scan(4, CYCLE)), |bench| bench.state(victim) == state);
            if state == FdlState::AwaitDataResponse {
                // The first character of its request is heard.
                bench.run_for(bits(12));
            }
            let held = bench.station(victim).holds_token();
            bench.power_off(victim);
            let live: Vec<u8> = bench.live().iter().map(|address| address.value()).collect();
            let bound = bounds.recovery(live[0], 4);
            let took = bench.run_until(bits(bound), Bench::is_one_ring);
            bench.run_until(bits(2 * bounds.rotation(4, CYCLE)), Bench::all_exchange);
            assert_eq!(bench.last_double, None, "{state:?}");
            // Who claimed: the lowest of the living, and only when the token was lost. When the token was on its way (CheckTokenPass)
            // it depends on whether the successor heard it.
            let claims: Vec<u8> = (0..4)
                .filter(|&master| bench.masters[master].station.is_some())
                .filter(|&master| bench.ring_events(master).contains(&RingEvent::TokenLost))
                .map(|master| MEMBERS[master])
                .collect();
            match (held, state) {
                // It has not spoken yet: its predecessor misses it and passes the token on.
                (_, FdlState::UseToken) => assert_eq!(claims, [0; 0]),
                (true, _) => {
                    assert_eq!(claims, [live[0]], "{state:?}");
                    assert!(took >= bits(bounds.timeout(live[0])), "not before Ttimeout");
                }
                (false, FdlState::ActiveIdle) => assert_eq!(claims, [0; 0]),
                _ => assert!(claims.is_empty() || claims == [live[0]]),
            }
        }
    }
}

#[test]
fn a_master_killed_in_the_middle_of_any_telegram_leaves_a_ring() {
    // Every 7 bits over a whole rotation and more: inside tokens, requests, replies of others, pauses.
    let params = params(10);
    let bounds = Bounds::of(&params);
    let start = ring(&[1, 4, 6], params);
    for step in 0..360 {
        let mut bench = Bench::with_slaves(&[1, 4, 6], params);
        (0..3).for_each(|master| bench.power_on(master));
        bench.run_for(start.now - dp_master::time::Instant::ZERO + bits(7 * step));
        bench.power_off(1);
        let bound = bounds.recovery(1, 3);
        bench.run_until(bits(bound), Bench::is_one_ring);
        assert_eq!(bench.last_double, None, "step {step}");
    }
}

#[test]
fn two_masters_that_die_together_are_outlived() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    for victims in [[0, 1], [1, 2], [0, 2], [2, 3]] {
        let mut bench = ring(&MEMBERS, params);
        victims.iter().for_each(|&victim| bench.power_off(victim));
        let lowest = bench.live().iter().next().unwrap().value();
        bench.run_until(bits(bounds.recovery(lowest, 4)), Bench::is_one_ring);
        bench.run_until(bits(4 * bounds.rotation(4, CYCLE)), Bench::all_exchange);
        assert_eq!(bench.last_double, None);
    }
}

#[test]
fn the_last_master_goes_on_alone() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    let mut bench = ring(&[1, 4], params);
    bench.power_off(0);
    bench.run_until(bits(bounds.recovery(4, 2)), Bench::is_one_ring);
    let exchanges = bench.station(1).exchanges(bench.masters[1].indices[0]);
    bench.run_for(Duration::from_millis(20));
    assert!(bench.station(1).exchanges(bench.masters[1].indices[0]) > exchanges + 20);
    bench.assert_no_violations();
}

#[test]
fn a_dead_successor_is_offered_the_token_three_times_and_passed_over() {
    let mut bench = ring(&[1, 4, 6], params(10));
    bench.run_until(bits(100_000), |bench| bench.state(2) == FdlState::CheckAccessTime);
    bench.power_off(1);
    let before = bench.station(0).statistics();
    bench.run_until(bits(100_000), |bench| bench.is_one_ring());
    assert!(bench.ring_events(0).contains(&RingEvent::StationLeft(at(4))));
    let after = bench.station(0).statistics();
    // Once and two repetitions; and the next one accepts a token from a stranger only when it is repeated.
    assert_eq!(after.token_retries - before.token_retries, 2 + 1);
    assert!(!bench.ring_events(2).contains(&RingEvent::TokenLost));
    bench.assert_no_violations();
}

/// The next burst on the line is a token to this successor.
fn before_token(bench: &mut Bench, sender: usize) {
    bench.run_until(bits(200_000), |bench| bench.state(sender) == FdlState::CheckAccessTime);
    bench.run_until(bits(10_000), |bench| bench.state(sender) == FdlState::CheckTokenPass);
}

#[test]
fn one_lost_token_is_repeated_and_nobody_notices() {
    let mut bench = ring(&[1, 4, 6], params(10));
    // One token ahead, because the one just sent is on the line already: master 4's token to 6 follows its cycle.
    before_token(&mut bench, 0);
    bench.run_until(bits(10_000), |bench| bench.state(1) == FdlState::AwaitDataResponse);
    // Request (already out), reply, token.
    let token = bench.halves[0].bursts() + 1;
    bench.halves[0].script(Script::Drop { burst: token });
    bench.run_for(Duration::from_millis(10));
    assert!(bench.is_one_ring());
    for master in 0..3 {
        let events = bench.ring_events(master);
        assert!(!events.iter().any(|event| matches!(
            event,
            RingEvent::TokenLost | RingEvent::Left(_) | RingEvent::StationLeft(_)
        )));
    }
    bench.assert_no_violations();
}

#[test]
fn a_master_that_misses_three_tokens_is_passed_over_and_admitted_again() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    let mut bench = ring(&[1, 4, 6], params);
    // Deaf for three rotations: it hears nothing and is heard by nobody.
    bench.run_until(bits(100_000), |bench| bench.state(2) == FdlState::AwaitDataResponse);
    let port = bench.masters[1].port;
    bench.halves[0].disconnect(port);
    let rest = [at(1), at(6)].into_iter().collect();
    bench.run_until(bits(3 * bounds.rotation(3, CYCLE)), |bench| bench.is_ring_of(rest));
    bench.halves[0].reconnect(port);
    // It hears that it is passed over, leaves, listens, and is found by the next scan. (If it was deaf for Ttimeout it has claimed the
    // token of a ring of its own; then a second token is given up first.)
    bench.run_until(bits(bounds.formation(&[1, 4, 6])), Bench::is_one_ring);
    let events = bench.ring_events(1);
    assert!(events.contains(&RingEvent::Left(LeaveCause::Excluded)), "{events:?}");
    assert_eq!(events.last(), Some(&RingEvent::Entered));
    bench.run_until(bits(200_000), Bench::all_exchange);
}

#[test]
fn a_line_cut_in_two_becomes_two_rings_and_one_again() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    for far in [&[0][..], &[3], &[1, 3], &[0, 1], &[2, 3], &[0, 1, 2]] {
        let mut bench = ring(&MEMBERS, params);
        bench.cut(far);
        let las = |inside: bool| {
            let members = (0..4).filter(|master| far.contains(master) == inside);
            members.map(|master| at(MEMBERS[master])).collect()
        };
        let highest = 8;
        bench.run_until(
            bits(bounds.recovery(highest, 4) + bounds.recovery(highest, 4)),
            |bench| bench.is_ring_of(las(true)) && bench.is_ring_of(las(false)),
        );
        bench.run_until(bits(200_000), Bench::all_exchange);
        bench.run_for(bits(12_345));
        bench.rejoin();
        bench.run_until(bits(bounds.formation(&MEMBERS)), |bench| {
            bench.is_one_ring() && bench.all_exchange()
        });
        let joined = bench.now;
        bench.run_for(Duration::from_millis(100));
        assert!(bench.is_one_ring() && bench.all_exchange(), "{}", bench.describe());
        assert!(bench.last_double.is_none_or(|double| double < joined));
    }
}

#[test]
fn a_newcomer_with_an_address_in_use_goes_offline_and_disturbs_nobody() {
    let params = params(10);
    let mut bench = ring(&[1, 4], params);
    let twin = bench.add_master(4, params, &[]);
    bench.power_on(twin);
    bench.run_for(Duration::from_millis(300));
    assert_eq!(bench.state(twin), FdlState::Offline);
    assert_eq!(bench.ring_events(twin), [RingEvent::DuplicateAddress]);
    assert!(bench.is_ring_of([at(1), at(4)].into_iter().collect()) || bench.station(0).las().len() == 2);
    for master in 0..2 {
        let events = bench.ring_events(master);
        assert!(!events.contains(&RingEvent::TokenLost) && !events.contains(&RingEvent::DuplicateAddress));
    }
    bench.assert_no_violations();
    // It tries again after its pause, is told once, and takes the place when that becomes free.
    bench.run_for(Duration::from_millis(2_500));
    assert_eq!(bench.ring_events(twin), [RingEvent::DuplicateAddress]);
    bench.power_off(1);
    let bounds = Bounds::of(&params);
    let bound = Duration::from_millis(1_000) + bits(bounds.formation(&[1, 4]));
    bench.run_until(bound, |bench| bench.station(twin).is_in_ring() && bench.is_one_ring());
}

#[test]
fn a_newcomer_with_the_address_of_a_master_alone_goes_offline() {
    let params = params(10);
    let mut bench = ring(&[4], params);
    let twin = bench.add_master(4, params, &[]);
    bench.power_on(twin);
    bench.run_for(Duration::from_millis(100));
    assert_eq!(bench.state(twin), FdlState::Offline);
    assert_eq!(bench.ring_events(twin), [RingEvent::DuplicateAddress]);
    assert!(bench.station(0).is_in_ring() && bench.all_exchange());
    bench.assert_no_violations();
}

#[test]
fn two_rings_with_the_same_address_joined_end_with_it_at_most_once() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    let mut bench = Bench::with_slaves(&[1, 4, 2], params);
    let twin = bench.add_master(4, params, &[]);
    bench.cut(&[2, twin]);
    (0..4).for_each(|master| bench.power_on(master));
    bench.run_until(bits(8_000_000), |bench| {
        bench.is_ring_of([at(1), at(4)].into_iter().collect())
            || (bench.station(0).las().len() == 2 && bench.station(2).las().len() == 2)
    });
    bench.rejoin();
    bench.run_for(bits(2 * bounds.formation(&[1, 2, 4])) + Duration::from_millis(2_500));
    let events = [bench.ring_events(1), bench.ring_events(twin)];
    assert!(
        events
            .iter()
            .any(|events| events.contains(&RingEvent::DuplicateAddress)),
        "{events:?}"
    );
    assert!(
        !(bench.station(1).is_in_ring() && bench.station(twin).is_in_ring()),
        "{}",
        bench.describe()
    );
    assert!(bench.station(0).is_in_ring() && bench.station(2).is_in_ring());
    // With one of them gone, the other finds its place.
    bench.power_off(twin);
    let bound = Duration::from_millis(1_000) + bits(bounds.formation(&[1, 2, 4]));
    bench.run_until(bound, |bench| bench.is_one_ring() && bench.all_exchange());
}

#[test]
fn under_noise_every_master_keeps_working_and_the_ring_is_whole_when_it_ends() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    for seed in 1..=8 {
        let mut bench = ring(&MEMBERS, params);
        let exchanges = |bench: &Bench| -> Vec<u64> {
            let masters = (0..4).map(|master| (master, bench.masters[master].indices[0]));
            masters
                .map(|(master, slave)| bench.station(master).exchanges(slave))
                .collect()
        };
        let before = exchanges(&bench);
        // One telegram in forty is hit.
        bench.halves[0].set_disturbance(Some(Disturbance::new(seed, 1e-4).unwrap()));
        bench.run_for(Duration::from_millis(500));
        let after = exchanges(&bench);
        for (before, after) in before.iter().zip(&after) {
            assert!(after - before > 100, "seed {seed}: {before} {after}");
        }
        bench.halves[0].set_disturbance(None);
        bench.run_until(bits(bounds.formation(&MEMBERS)), |bench| {
            bench.is_one_ring() && bench.all_exchange()
        });
        let quiet = bench.now;
        bench.run_for(Duration::from_millis(50));
        assert!(bench.is_one_ring());
        assert!(bench.last_double.is_none_or(|double| double < quiet));
    }
}

#[test]
fn the_same_failures_give_the_same_ring_at_the_same_time() {
    let run = || {
        let mut bench = ring(&MEMBERS, params(10));
        bench.halves[0].set_disturbance(Some(Disturbance::new(3, 3e-4).unwrap()));
        bench.run_for(Duration::from_millis(20));
        bench.power_off(1);
        bench.run_for(Duration::from_millis(20));
        let events: Vec<_> = bench.masters.iter().map(|master| master.events.clone()).collect();
        (bench.now, bench.halves[0].statistics(), events)
    };
    assert_eq!(run(), run());
    assert_eq!(BAUD.bits_per_second(), 1_500_000);
}
