//! Property: whatever happens to masters and their plugs, once it stops there is one ring of all living masters, and never
//! two tokens for longer than a bound.

use dp_master::time::Duration;
use proptest::prelude::*;

use crate::ring_bench::{Bench, Bounds, CYCLE, bits, params};

#[derive(Debug, Clone, Copy)]
enum Disturbance {
    On(usize),
    Off(usize),
    /// Off and on again, faster than anybody notices.
    Restart(usize),
    Unplug(usize),
    Plug(usize),
    Cut([bool; 4]),
    Rejoin,
}

const ADDRESSES: [u8; 4] = [0, 3, 4, 9];

fn disturbance() -> impl Strategy<Value = Disturbance> {
    prop_oneof![
        3 => (0..4usize).prop_map(Disturbance::On),
        2 => (0..4usize).prop_map(Disturbance::Off),
        1 => (0..4usize).prop_map(Disturbance::Restart),
        2 => (0..4usize).prop_map(Disturbance::Unplug),
        2 => (0..4usize).prop_map(Disturbance::Plug),
        1 => any::<[bool; 4]>().prop_map(Disturbance::Cut),
        1 => Just(Disturbance::Rejoin),
    ]
}

fn apply(bench: &mut Bench, disturbance: Disturbance) {
    match disturbance {
        Disturbance::On(master) => bench.power_on(master),
        Disturbance::Off(master) => bench.power_off(master),
        Disturbance::Restart(master) => {
            bench.power_off(master);
            bench.power_on(master);
        }
        Disturbance::Unplug(master) => {
            let port = bench.masters[master].port;
            bench.halves.iter_mut().for_each(|half| half.disconnect(port));
        }
        Disturbance::Plug(master) => {
            let port = bench.masters[master].port;
            if bench.masters[master].station.is_some() {
                bench.halves.iter_mut().for_each(|half| half.reconnect(port));
            }
        }
        Disturbance::Cut(far) => {
            let far: Vec<usize> = (0..4).filter(|&master| far[master]).collect();
            bench.cut(&far);
        }
        Disturbance::Rejoin => bench.rejoin(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn after_any_disturbances_all_living_masters_form_one_ring_with_one_token(
        schedule in prop::collection::vec((disturbance(), 0u64..9_000_000), 1..24),
        survivors in any::<[bool; 4]>(),
    ) {
        let params = params(10);
        let bounds = Bounds::of(&params);
        let mut bench = Bench::with_slaves(&ADDRESSES, params);
        for (disturbance, pause) in schedule {
            apply(&mut bench, disturbance);
            bench.run_for(Duration::from_nanos(pause));
        }
        // The line is whole, every living master is plugged in.
        bench.rejoin();
        for (master, survives) in survivors.into_iter().enumerate() {
            if !survives {
                bench.power_off(master);
            }
            apply(&mut bench, Disturbance::Plug(master));
        }
        if bench.live().is_empty() {
            bench.power_on(2);
        }
        let calm = bench.now;
        bench.last_double = None;
        let bound = bits(bounds.formation(&ADDRESSES) + bounds.ring_scan(4, CYCLE));
        bench.run_until_lasting(bound, Duration::from_millis(60), |bench| bench.is_one_ring() && bench.all_exchange());
        // The lists may be right before the second token is gone.
        let bound = bits(bounds.doubled(ADDRESSES.len() as u64));
        if let Some(double) = bench.last_double {
            prop_assert!(double - calm <= bound, "two tokens {} after the last disturbance: {}", double - calm, bench.describe());
        }
    }
}
