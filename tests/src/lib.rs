//! What the system tests share: the rig brought into the states that tests start from, programs that run beside a test, and oracles.

pub mod campaign;
pub mod interpolator_oracle;
pub mod model_check;
pub mod running;
pub mod safety_monitor;

use film_feed::operator::FeedPlan;
use film_feed::report::{FeedMode, RunReport};
use film_feed::rig::{Rig, RigConfig, TickView};
use film_feed::run::{Observation, simulated};
use lenze9300_model::traverse::TraverseEvent;

/// One second in the rig's nanoseconds.
pub const SECOND: u64 = 1_000_000_000;
/// One millisecond in the rig's nanoseconds.
pub const MILLISECOND: u64 = 1_000_000;

/// Feed constant as stored in C1204, gear, increments per revolution (9300 fact sheet, section 11): increments per mm.
pub const INC_PER_MM: f64 = 65_536.0 * 7.0 / 179.0708;

/// The rig at power-up.
///
/// # Panics
/// When the configuration is impossible.
pub fn powered_up(config: &RigConfig) -> Rig {
    Rig::new(config).unwrap_or_else(|error| panic!("{error}"))
}

/// The rig with operation enabled and the thesis' values delivered to the drive.
///
/// # Panics
/// When the drive does not become ready within 5 s of machine time.
pub fn ready(config: &RigConfig) -> Rig {
    let mut rig = powered_up(config);
    let inputs = rig.inputs_mut();
    inputs.enable = true;
    inputs.velocity = 10_000;
    inputs.mark_velocity = 2_000;
    inputs.acceleration = 10_000;
    inputs.distance = 12_000;
    assert!(
        rig.run_until(5 * SECOND, |rig| rig.outputs().drive_ready
            && rig.parameter_watch().rounds() >= 2),
        "the drive did not become ready: {:?}",
        rig.outputs()
    );
    rig
}

/// The rig in the middle of a feed by length, about `share` of its 1.5 s done.
///
/// # Panics
/// When the feed does not start.
pub fn in_mid_feed(config: &RigConfig, share: f64) -> Rig {
    let mut rig = ready(config);
    start_feed(&mut rig);
    run_for(&mut rig, (1.5 * share * SECOND as f64) as u64);
    assert!(rig.outputs().running, "the feed is not under way");
    rig
}

/// Raises POS_START and waits for RUNNING.
///
/// # Panics
/// When RUNNING does not come within 100 ms.
pub fn start_feed(rig: &mut Rig) {
    rig.inputs_mut().pos_start = true;
    assert!(
        rig.run_until(100 * MILLISECOND, |rig| rig.outputs().running),
        "the start was not taken"
    );
    rig.inputs_mut().pos_start = false;
}

/// Runs PLC cycles for so long.
pub fn run_for(rig: &mut Rig, ns: u64) {
    rig.run_until(ns, |_| false);
}

/// Runs a plan in virtual time.
///
/// # Panics
/// When the configuration is impossible.
pub fn run(config: &RigConfig, plan: FeedPlan) -> RunReport {
    simulated(config, plan, Observation::FeedsOnly, || {})
        .unwrap_or_else(|error| panic!("{error}"))
        .0
}

/// Runs PLC cycles for so long and collects what happens in the traversing program meanwhile, with the machine time in
/// ns.
pub fn traverse_events(rig: &mut Rig, ns: u64) -> Vec<(u64, TraverseEvent)> {
    while rig.drive_mut().poll_traverse_event().is_some() {}
    let mut told = Vec::new();
    let end = rig.now_ns() + ns;
    while rig.now_ns() < end {
        rig.cycle(&mut |view: &mut TickView<'_>| {
            while let Some(event) = view.drive.poll_traverse_event() {
                told.push((view.now_ns, event));
            }
        });
    }
    told
}

/// A plan of one series.
pub fn series(mode: FeedMode, feeds: usize) -> FeedPlan {
    FeedPlan {
        series: vec![(mode, feeds)],
        ..FeedPlan::default()
    }
}
