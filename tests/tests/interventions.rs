//! Hands on the machine in mid feed: stop, reset, jog, terminal 28, mains, faults.

use drivecom::State;
use film_feed::rig::{Rig, RigConfig};
use lenze9300_model::device::Fault;
use lenze9300_model::plant::Mains;
use system_tests::{MILLISECOND, SECOND, in_mid_feed, ready, run_for, start_feed};

/// Film travel of one second, mm.
fn travel_in_a_second(rig: &mut Rig) -> f64 {
    let before = rig.film().position_mm();
    run_for(rig, SECOND);
    rig.film().position_mm() - before
}

#[test]
fn stop_in_mid_feed_brakes_along_the_ramp_and_gives_no_job_finished() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.5);
    let before = rig.film().position_mm();
    rig.inputs_mut().pos_stop = true;
    assert!(rig.run_until(SECOND, |rig| !rig.outputs().running));
    run_for(&mut rig, SECOND);
    // 1200 mm/s at 2400 mm/s²: 300 mm (fact sheet, section 11), and the way of the delays of PLC, bus and module.
    let braking_mm = rig.film().position_mm() - before;
    assert!((300.0..330.0).contains(&braking_mm), "{braking_mm}");
    assert!(!rig.outputs().job_finished);
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
}

#[test]
fn after_a_stop_the_next_feed_is_whole_again() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.3);
    rig.inputs_mut().pos_stop = true;
    run_for(&mut rig, SECOND);
    rig.inputs_mut().pos_stop = false;
    run_for(&mut rig, 50 * MILLISECOND);
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    assert!(rig.run_until(3 * SECOND, |rig| rig.outputs().job_finished));
    run_for(&mut rig, 300 * MILLISECOND);
    assert!((rig.film().position_mm() - before - 1200.0).abs() <= 0.01);
}

#[test]
fn a_start_while_stop_is_held_is_not_taken() {
    let mut rig = ready(&RigConfig::default());
    rig.inputs_mut().pos_stop = true;
    run_for(&mut rig, 50 * MILLISECOND);
    rig.inputs_mut().pos_start = true;
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
    assert!(!rig.outputs().running);
}

#[test]
fn jog_moves_in_the_direction_asked_and_both_directions_stand_still() {
    let mut rig = ready(&RigConfig::default());
    rig.inputs_mut().manual = true;
    run_for(&mut rig, 50 * MILLISECOND);
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
    rig.inputs_mut().manual_pos = true;
    let forwards = travel_in_a_second(&mut rig);
    assert!(forwards > 50.0, "{forwards}");
    assert!(rig.outputs().speed_percent > 1.0, "{:?}", rig.outputs());
    rig.inputs_mut().manual_neg = true;
    run_for(&mut rig, SECOND);
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
    rig.inputs_mut().manual_pos = false;
    let backwards = travel_in_a_second(&mut rig);
    assert!((backwards + forwards).abs() < 1.0, "{backwards} against {forwards}");
}

#[test]
fn a_start_in_manual_mode_is_ignored() {
    let mut rig = ready(&RigConfig::default());
    rig.inputs_mut().manual = true;
    run_for(&mut rig, 50 * MILLISECOND);
    rig.inputs_mut().pos_start = true;
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
    assert!(!rig.outputs().running);
}

#[test]
fn loss_of_terminal_28_takes_the_torque_at_once_and_the_state_falls_to_switched_on() {
    // Fact sheet, section 2.5: high-resistance at once, the motor coasts; DRIVECOM falls to switched on.
    let mut rig = in_mid_feed(&RigConfig::default(), 0.5);
    rig.drive_mut().set_terminal_28(false);
    run_for(&mut rig, 20 * MILLISECOND);
    assert_eq!(rig.module().state(), State::SwitchedOn);
    assert_eq!(rig.drive().axis().sample().torque, 0.0);
    assert!(rig.run_until(200 * MILLISECOND, |rig| !rig.outputs().drive_ready
        && rig.outputs().switched_on));
    run_for(&mut rig, SECOND);
    assert!(
        travel_in_a_second(&mut rig).abs() < 0.01,
        "friction stops the coasting axis"
    );
}

#[test]
fn terminal_28_coming_back_enables_by_the_standing_control_word_and_nothing_moves_unasked() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.5);
    rig.drive_mut().set_terminal_28(false);
    run_for(&mut rig, 2 * SECOND);
    rig.drive_mut().set_terminal_28(true);
    assert!(rig.run_until(200 * MILLISECOND, |rig| rig.outputs().drive_ready));
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
}

#[test]
fn a_trip_shows_as_error_is_diagnosed_and_goes_with_error_reset() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.4);
    rig.drive_mut().inject(Fault::Sd2, true);
    assert!(rig.run_until(100 * MILLISECOND, |rig| rig.outputs().error));
    assert_eq!(rig.module().state(), State::Fault);
    run_for(&mut rig, SECOND);
    // Octets 7…9 of the diagnosis: header 03, object 603Fh = 0x7303 for the resolver (fact sheet, section 1.4).
    let ext = rig.extended_diagnosis().expect("the slave announced diagnosis");
    assert_eq!(ext, [0x03, 0x73, 0x03]);

    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 100 * MILLISECOND);
    assert!(rig.outputs().error, "the cause is still there");
    rig.inputs_mut().error_reset = false;
    rig.drive_mut().inject(Fault::Sd2, false);
    run_for(&mut rig, 100 * MILLISECOND);
    rig.inputs_mut().error_reset = true;
    assert!(rig.run_until(200 * MILLISECOND, |rig| !rig.outputs().error));
    rig.inputs_mut().error_reset = false;
    assert!(rig.run_until(SECOND, |rig| rig.outputs().drive_ready));
}

#[test]
fn mains_off_is_a_message_on_the_bus_and_comes_back_by_itself() {
    // Fact sheet, section 2.5: LU is a message (status bit 8); the module answers on, fed from 24 V.
    let mut rig = ready(&RigConfig::default());
    rig.drive_mut().set_mains(Mains::Off);
    assert!(
        rig.run_until(60 * SECOND, |rig| rig.outputs().error),
        "the DC link never ran empty"
    );
    assert_eq!(rig.module().state(), State::SwitchOnDisabled);
    rig.drive_mut().set_mains(Mains::On);
    assert!(rig.run_until(2 * SECOND, |rig| rig.outputs().drive_ready && !rig.outputs().error));
}
