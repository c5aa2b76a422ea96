//! A DP cycle wastes next to none of the bus's time. Virtual time: the same on every machine.

use peers::bus_time;

#[test]
fn a_cycle_takes_at_most_two_per_cent_more_than_the_least_it_could() {
    for slaves in [1, 2, 8, 30] {
        let ours = bus_time::ours(slaves);
        assert!((1.0..=1.02).contains(&ours.ratio()), "{ours:?}");
    }
}
