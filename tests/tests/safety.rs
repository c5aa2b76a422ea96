//! What must hold at every tick of the drive, whatever is done to the machine.

use std::f64::consts::PI;

use dp_master::dp::Mode;
use dp_master::time::Baud;
use film_feed::rig::{Rig, RigConfig, TickObserver, TickView};
use lenze9300_model::bus::dp::{Emf2133, Emf2133Config};
use lenze9300_model::device::Fault;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use system_tests::safety_monitor::{REACTION_TICKS, SafetyMonitor, SafetyRule};
use system_tests::{MILLISECOND, SECOND, powered_up, ready, start_feed};

#[test]
fn from_power_up_to_the_first_start_nothing_moves_and_torque_comes_only_with_operation_enabled() {
    let mut rig = powered_up(&RigConfig::default());
    let mut guard = SafetyMonitor::default();
    guard.watch(&mut rig, SECOND);
    assert_eq!(guard.torque_ticks(), 0, "without Freigabe there is no torque");
    rig.inputs_mut().enable = true;
    rig.inputs_mut().distance = 12_000;
    guard.watch(&mut rig, 5 * SECOND);
    assert!(rig.outputs().drive_ready && guard.torque_ticks() > 0);
    assert_eq!(guard.violation(), None);
    assert!(!guard.asked);
}

#[test]
fn a_feed_stopped_by_terminal_28_has_no_torque_within_a_millisecond() {
    let mut rig = ready(&RigConfig::default());
    let mut guard = SafetyMonitor::of_a_moving_axis();
    rig.inputs_mut().pos_start = true;
    guard.watch(&mut rig, 500 * MILLISECOND);
    let torque_ticks = guard.torque_ticks();
    rig.drive_mut().set_terminal_28(false);
    guard.watch(&mut rig, SECOND);
    assert_eq!(guard.violation(), None);
    assert!(guard.torque_ticks() <= torque_ticks + REACTION_TICKS);
}

#[test]
fn the_guard_rejects_a_film_that_moves_unasked() {
    // An oracle that accepts everything proves nothing. This one did not see the start.
    let mut rig = ready(&RigConfig::default());
    let mut guard = SafetyMonitor::default();
    start_feed(&mut rig);
    while rig.drive_mut().poll_traverse_event().is_some() {}
    guard.watch(&mut rig, 100 * MILLISECOND);
    assert!(
        guard
            .violation()
            .is_some_and(|broken| broken.rule == SafetyRule::StandsUntilAsked)
    );
}

#[test]
fn the_guard_rejects_torque_in_a_state_without_it() {
    // The enabled drive, shown with a module that has just been switched on.
    let mut rig = ready(&RigConfig::default());
    let stranger = Emf2133::new(Emf2133Config::default(), Baud::B12000000).unwrap();
    let mut guard = SafetyMonitor::default();
    rig.cycle(&mut |view: &mut TickView<'_>| {
        guard.tick(&mut TickView {
            now_ns: view.now_ns,
            ends_millisecond: view.ends_millisecond,
            drive: view.drive,
            film: view.film,
            module: &stranger,
        });
    });
    assert!(
        guard
            .violation()
            .is_some_and(|broken| broken.rule == SafetyRule::TorqueOnlyWhenEnabled
                && broken.values.contains("in NotReadyToSwitchOn"))
    );
}

/// Something done to the machine.
#[derive(Debug, Clone, Copy)]
enum Hand {
    Enable(bool),
    Start(bool),
    Stop(bool),
    Reset(bool),
    ReadMark(bool),
    Manual(bool),
    ManualPos(bool),
    ManualNeg(bool),
    Terminal28(bool),
    Fault(Fault, bool),
    Clear(bool),
    Cable(bool),
    Load(f64),
}

fn hand() -> impl Strategy<Value = Hand> {
    let level = any::<bool>();
    prop_oneof![
        4 => level.prop_map(Hand::Enable),
        6 => level.prop_map(Hand::Start),
        2 => level.prop_map(Hand::Stop),
        2 => level.prop_map(Hand::Reset),
        1 => level.prop_map(Hand::ReadMark),
        1 => level.prop_map(Hand::Manual),
        1 => level.prop_map(Hand::ManualPos),
        1 => level.prop_map(Hand::ManualNeg),
        2 => level.prop_map(Hand::Terminal28),
        1 => (prop::sample::select(Fault::ALL.to_vec()), level).prop_map(|(fault, present)| Hand::Fault(fault, present)),
        1 => level.prop_map(Hand::Clear),
        1 => level.prop_map(Hand::Cable),
        1 => (-0.5..0.5_f64).prop_map(Hand::Load),
    ]
}

fn lay_on(rig: &mut Rig, hand: Hand) {
    match hand {
        Hand::Enable(level) => rig.inputs_mut().enable = level,
        Hand::Start(level) => rig.inputs_mut().pos_start = level,
        Hand::Stop(level) => rig.inputs_mut().pos_stop = level,
        Hand::Reset(level) => rig.inputs_mut().error_reset = level,
        Hand::ReadMark(level) => rig.inputs_mut().read_mark = level,
        Hand::Manual(level) => rig.inputs_mut().manual = level,
        Hand::ManualPos(level) => rig.inputs_mut().manual_pos = level,
        Hand::ManualNeg(level) => rig.inputs_mut().manual_neg = level,
        Hand::Terminal28(level) => rig.drive_mut().set_terminal_28(level),
        Hand::Fault(fault, present) => rig.drive_mut().inject(fault, present),
        Hand::Clear(true) => rig.master_mut().set_mode(Mode::Clear),
        Hand::Clear(false) => rig.master_mut().set_mode(Mode::Operate),
        Hand::Cable(true) => rig.reconnect_module(),
        Hand::Cable(false) => rig.disconnect_module(),
        Hand::Load(torque_nm) => rig.drive_mut().set_load_torque(torque_nm),
    }
}

#[test]
fn no_sequence_of_hands_breaks_a_rule_and_the_line_keeps_its_own() {
    // The same sequences in every run: what fails here fails everywhere.
    let config = Config {
        cases: 48,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let sequence = prop::collection::vec((hand(), 1_u64..400), 1..40);
    let outcome = runner.run(&sequence, |hands| {
        let mut rig = ready(&RigConfig::default());
        // A load pushes a standing axis: movement is judged only without one.
        let pushed = hands.iter().any(|(hand, _)| matches!(hand, Hand::Load(_)));
        let mut guard = SafetyMonitor::default();
        (guard.asked, guard.pushed) = (pushed, pushed);
        for (hand, ms) in hands {
            lay_on(&mut rig, hand);
            guard.watch(&mut rig, ms * MILLISECOND);
        }
        prop_assert_eq!(guard.violation(), None);
        prop_assert!(rig.line().violations().is_empty(), "{:?}", rig.line().violations());
        Ok(())
    });
    assert!(outcome.is_ok(), "{}", outcome.unwrap_err());
}

#[test]
fn speed_never_exceeds_what_was_asked_for_by_more_than_the_loops_overshoot() {
    // Thesis ch. 9: the motor swings about 2 % around the interpolator.
    let mut rig = ready(&RigConfig::default());
    rig.inputs_mut().velocity = 5_000;
    let rounds = rig.parameter_watch().rounds();
    assert!(rig.run_until(5 * SECOND, |rig| rig.parameter_watch().rounds() >= rounds + 2));
    start_feed(&mut rig);
    let mut fastest = 0.0_f64;
    while rig.outputs().running {
        rig.cycle(&mut |view: &mut TickView<'_>| fastest = fastest.max(view.drive.axis().sample().omega_true));
    }
    // 600 mm/s at the film: · 7 / (π · 57 mm) revolutions per second.
    let asked = 600.0 * 7.0 / (PI * 57.0) * 2.0 * PI;
    assert!((asked..asked * 1.03).contains(&fastest), "{fastest} rad/s of {asked}");
}
