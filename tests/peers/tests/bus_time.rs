//! A DP cycle wastes next to none of the bus's time. Virtual time: the same on every machine.

use peers::bus_time;

#[test]
fn a_cycle_of_thirty_slaves_takes_at_most_two_per_cent_more_than_the_least_it_could() {
    let ours = bus_time::ours(30);
    assert!((1.0..=1.02).contains(&ours.ratio()), "{ours:?}");
}
