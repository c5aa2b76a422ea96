//! Several masters form one ring: from any order and time of power-on, newcomers, leaving on command.

use dp_master::dp::MasterEvent;
use dp_master::fdl::{FdlState, LeaveCause, Membership, RingEvent};
use dp_master::time::Duration;
use proptest::prelude::*;

use crate::ring_bench::{Bench, Bounds, CYCLE, Half, at, bits, params};

#[test]
fn masters_switched_on_together_form_a_ring_with_the_first_scan() {
    for addresses in [&[1, 3][..], &[5, 2, 9], &[0, 1, 2, 3], &[10, 9, 3, 1]] {
        let params = params(10);
        let bounds = Bounds::of(&params);
        let mut bench = Bench::with_slaves(addresses, params);
        (0..addresses.len()).for_each(|master| bench.power_on(master));
        // The lowest address claims the token; its scan finds the next one, whose GAP begins where that of the first ended.
        let lowest = *addresses.iter().min().unwrap();
        let masters = addresses.len() as u64;
        let bound = bounds.timeout(lowest)
            + bounds.initialisation()
            + masters * (bounds.gap_factor + bounds.hsa + 2) * bounds.rotation(masters, CYCLE);
        bench.run_until(bits(bound), |bench| bench.is_one_ring() && bench.all_exchange());
        let claimed = |bench: &Bench, master| bench.ring_events(master).contains(&RingEvent::Claimed);
        for (master, address) in addresses.iter().enumerate() {
            assert_eq!(claimed(&bench, master), *address == lowest);
        }
        bench.run_for(Duration::from_millis(200));
        assert!(bench.is_one_ring() && bench.all_exchange());
        assert_eq!(bench.last_double, None);
        bench.assert_no_violations();
    }
}

#[test]
fn the_token_visits_every_master_in_ascending_order() {
    let mut bench = Bench::with_masters(&[4, 1, 7], params(10));
    (0..3).for_each(|master| bench.power_on(master));
    bench.run_until(bits(4_000_000), Bench::is_one_ring);
    let mut visits: Vec<u8> = Vec::new();
    while visits.len() < 30 {
        bench.step_to(bench.now + Duration::from_millis(10));
        if let [holder] = bench.holders(Half::Near)[..]
            && visits.last() != Some(&holder.value())
        {
            visits.push(holder.value());
        }
    }
    let first = visits.iter().position(|&visit| visit == 1).unwrap();
    assert!(
        visits[first..]
            .iter()
            .eq([1, 4, 7].iter().cycle().take(visits.len() - first))
    );
}

#[test]
fn a_newcomer_is_accepted_after_gap_factor_rotations_and_one_scan() {
    for (hsa, gap_factor) in [(10, 1), (10, 10), (30, 3)] {
        let params = dp_master::fdl::BusParams {
            gap_factor,
            ..params(hsa)
        };
        let bounds = Bounds::of(&params);
        let mut bench = Bench::with_slaves(&[1, 3, 6], params);
        bench.power_on(0);
        bench.power_on(1);
        bench.run_until(bits(20_000_000), |bench| bench.is_one_ring() && bench.all_exchange());
        bench.power_on(2);
        // Two rotations to listen, then at most gap_factor rotations and one for each address of the GAP of 3: 4…HSA and 0.
        let rotations = 3 + bounds.gap_factor + bounds.hsa - 1;
        let bound = rotations * bounds.rotation(2, CYCLE);
        let took = bench.run_until(bits(bound), Bench::is_one_ring);
        assert!(took > bits(2 * 2 * bounds.token()), "it has listened to two rotations");
        assert!(bench.ring_events(2).contains(&RingEvent::Entered));
        assert!(bench.ring_events(1).contains(&RingEvent::StationJoined(at(6))));
        bench.run_until(bits(bound), Bench::all_exchange);
        bench.assert_no_violations();
    }
}

#[test]
fn a_newcomer_joins_a_busy_master_alone_within_the_bound_of_its_rare_questions() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    let mut bench = Bench::with_slaves(&[3, 6], params);
    bench.power_on(0);
    bench.run_until(bits(1_000_000), |bench| bench.is_one_ring() && bench.all_exchange());
    bench.run_for(Duration::from_millis(50));
    bench.power_on(1);
    bench.run_until(bits(bounds.lone_scan(CYCLE)), Bench::is_one_ring);
    bench.run_until(bits(100_000), Bench::all_exchange);
    bench.assert_no_violations();
}

#[test]
fn a_master_that_is_told_to_leaves_after_passing_the_token_and_comes_back() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    for (membership, state) in [
        (Membership::Passive, FdlState::PassiveIdle),
        (Membership::Offline, FdlState::Offline),
    ] {
        let mut bench = Bench::with_masters(&[1, 3, 6], params);
        (0..3).for_each(|master| bench.power_on(master));
        bench.run_until(bits(4_000_000), Bench::is_one_ring);
        // In every state in which it may be told.
        for wanted in [FdlState::ActiveIdle, FdlState::UseToken, FdlState::CheckTokenPass] {
            bench.run_until(bits(100_000), |bench| bench.state(1) == wanted);
            bench.masters[1].station.as_mut().unwrap().set_membership(membership);
            // A token in flight to it is lost for three slots; nobody waits for Ttimeout.
            let rest = [at(1), at(6)].into_iter().collect();
            let bound = 2 * bounds.rotation(3, CYCLE);
            bench.run_until(bits(bound), |bench| bench.is_ring_of(rest) && bench.state(1) == state);
            assert_eq!(
                bench.ring_events(1).last(),
                Some(&RingEvent::Left(LeaveCause::Commanded))
            );
            bench.run_for(Duration::from_millis(5));
            assert_eq!(bench.state(1), state);
            bench.masters[1]
                .station
                .as_mut()
                .unwrap()
                .set_membership(Membership::Ring);
            bench.run_until(bits(bounds.ring_scan(2, CYCLE)), Bench::is_one_ring);
        }
        assert!(!bench.ring_events(0).contains(&RingEvent::TokenLost));
        assert_eq!(bench.last_double, None);
        bench.assert_no_violations();
    }
}

#[test]
fn a_master_alone_that_is_told_to_leaves_at_once() {
    let mut bench = Bench::with_slaves(&[3], params(10));
    bench.power_on(0);
    bench.run_until(bits(1_000_000), Bench::all_exchange);
    bench.masters[0]
        .station
        .as_mut()
        .unwrap()
        .set_membership(Membership::Passive);
    bench.run_until(bits(CYCLE), |bench| bench.state(0) == FdlState::PassiveIdle);
    let sent = bench.halves[0].bursts();
    bench.run_for(Duration::from_millis(20));
    assert_eq!(bench.halves[0].bursts(), sent, "it is silent");
}

#[test]
fn rotation_times_are_measured() {
    let params = params(10);
    let bounds = Bounds::of(&params);
    let mut bench = Bench::with_masters(&[1, 3], params);
    (0..2).for_each(|master| bench.power_on(master));
    bench.run_until(bits(4_000_000), Bench::is_one_ring);
    bench.run_for(Duration::from_millis(20));
    // Two masters with nothing to do: two tokens, at most one question of each.
    let statistics = bench.station(0).statistics();
    let least = bits(2 * bounds.token());
    let most = bits(2 * (bounds.token() + bounds.gap_request()));
    for rotation in [statistics.last_rotation, statistics.longest_rotation] {
        // The idle times are rounded up to a nanosecond each.
        assert!(rotation >= least, "{rotation}");
    }
    assert!(statistics.last_rotation <= most + Duration::from_nanos(20));
}

#[test]
fn masters_that_claim_in_the_same_instant_drift_apart_and_form_one_ring() {
    // 1 claims 8·Tsl after its power-on, 4 claims 14·Tsl after its own: six slots earlier on, both begin to speak at once, and neither
    // hears the other while it speaks itself.
    let params = params(10);
    let bounds = Bounds::of(&params);
    for offset in [0, 1, 5] {
        let mut bench = Bench::with_slaves(&[1, 4], params);
        bench.power_on(1);
        bench.run_for(bits(6 * bounds.slot + offset));
        bench.power_on(0);
        bench.run_for(bits(bounds.timeout(1) + 100));
        assert!(bench.last_double.is_some(), "both have claimed");
        bench.run_until(bits(bounds.formation(&[1, 4])), Bench::is_one_ring);
        bench.run_until(bits(4_000_000), Bench::all_exchange);
    }
}

#[test]
fn a_ring_is_reported_to_the_user() {
    let mut bench = Bench::with_masters(&[1, 3], params(10));
    (0..2).for_each(|master| bench.power_on(master));
    bench.run_until(bits(4_000_000), Bench::is_one_ring);
    let first = bench.ring_events(0);
    assert_eq!(first, [RingEvent::Claimed, RingEvent::StationJoined(at(3))]);
    assert_eq!(bench.ring_events(1), [RingEvent::Entered]);
    let is_ring = |event: &MasterEvent| matches!(event, MasterEvent::Ring(_));
    assert!(bench.masters[0].events.iter().all(|(_, event)| is_ring(event)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Two to four masters, switched on in any order at any times, form one ring within the bound after the last one.
    #[test]
    fn masters_switched_on_at_any_times_form_one_ring(
        mut addresses in prop::sample::subsequence((0..=10u8).collect::<Vec<_>>(), 2..=4).prop_shuffle(),
        pauses in prop::collection::vec(0u64..12_000_000, 4),
    ) {
        let params = params(10);
        let bounds = Bounds::of(&params);
        let mut bench = Bench::with_slaves(&addresses, params);
        for (master, pause) in pauses.iter().enumerate().take(addresses.len()) {
            bench.power_on(master);
            bench.run_for(Duration::from_nanos(*pause));
        }
        bench.run_until(bits(bounds.formation(&addresses)), |bench| bench.is_one_ring() && bench.all_exchange());
        let ring = bench.now;
        bench.run_for(Duration::from_millis(100));
        prop_assert!(bench.is_one_ring() && bench.all_exchange());
        prop_assert!(bench.last_double.is_none_or(|at| at <= ring));
        addresses.sort_unstable();
        let las: Vec<_> = bench.station(0).las().iter().map(|address| address.value()).collect();
        prop_assert_eq!(las, addresses);
    }
}
