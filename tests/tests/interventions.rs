//! Hands on the machine in mid feed: stop, reset, jog, terminal 28, mains, faults.

use drivecom::State;
use film_feed::machine::{MarkConfig, Marks};
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

/// Film moved from `before` until JOB_FIN and a rest of 0.3 s.
fn moved_until_finished(rig: &mut Rig, before: f64) -> f64 {
    assert!(
        rig.run_until(5 * SECOND, |rig| rig.outputs().job_finished),
        "JOB_FIN did not come: {:?}",
        rig.outputs()
    );
    run_for(rig, 300 * MILLISECOND);
    rig.film().position_mm() - before
}

#[test]
fn error_reset_in_mid_feed_without_an_error_changes_nothing() {
    // Film-feed specification, section 8, step 7: bit 7 = (fault ∨ ¬RUNNING) ∧ Error_RESET.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    run_for(&mut rig, 600 * MILLISECOND);
    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 300 * MILLISECOND);
    assert!(rig.outputs().running);
    rig.inputs_mut().error_reset = false;
    assert!((moved_until_finished(&mut rig, before) - 1200.0).abs() <= 0.01);
}

#[test]
fn error_reset_after_a_stopped_feed_puts_the_program_back_to_its_start() {
    // Step 7 again: with RUNNING low bit 7 comes, and bit 11 with it.
    let mut rig = in_mid_feed(&RigConfig::default(), 0.5);
    rig.inputs_mut().pos_stop = true;
    run_for(&mut rig, SECOND);
    rig.inputs_mut().pos_stop = false;
    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 100 * MILLISECOND);
    assert_eq!(rig.module().control_word().0 & 0x0880, 0x0880);
    rig.inputs_mut().error_reset = false;
    run_for(&mut rig, 100 * MILLISECOND);
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    assert!((moved_until_finished(&mut rig, before) - 1200.0).abs() <= 0.01);
}

#[test]
fn a_trip_in_mid_feed_ends_the_program_with_its_reset_and_the_next_feed_is_whole() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.5);
    rig.drive_mut().inject(Fault::Oc2, true);
    run_for(&mut rig, 20 * MILLISECOND);
    assert_eq!(rig.drive().axis().sample().torque, 0.0);
    run_for(&mut rig, 2 * SECOND);
    rig.drive_mut().inject(Fault::Oc2, false);
    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 100 * MILLISECOND);
    rig.inputs_mut().error_reset = false;
    assert!(rig.run_until(SECOND, |rig| rig.outputs().drive_ready && !rig.outputs().running));
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    assert!((moved_until_finished(&mut rig, before) - 1200.0).abs() <= 0.01);
}

#[test]
fn a_feed_interrupted_by_terminal_28_is_finished_by_the_next_start() {
    // Fact sheet, sections 2.5 and 4.3: the program is interrupted, a start without RESET continues the record.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    run_for(&mut rig, 600 * MILLISECOND);
    rig.drive_mut().set_terminal_28(false);
    run_for(&mut rig, 2 * SECOND);
    let so_far = rig.film().position_mm() - before;
    assert!((300.0..1100.0).contains(&so_far), "{so_far}");
    assert!(rig.outputs().running && !rig.outputs().job_finished);
    rig.drive_mut().set_terminal_28(true);
    run_for(&mut rig, SECOND);
    start_feed(&mut rig);
    assert!((moved_until_finished(&mut rig, before) - 1200.0).abs() <= 0.01);
}

#[test]
fn freigabe_taken_away_in_mid_feed_is_inhibit_operation_and_given_again_it_moves_nothing() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.5);
    rig.inputs_mut().enable = false;
    assert!(rig.run_until(50 * MILLISECOND, |rig| rig.module().state() == State::SwitchedOn));
    run_for(&mut rig, 2 * MILLISECOND);
    assert_eq!(rig.drive().axis().sample().torque, 0.0);
    run_for(&mut rig, 2 * SECOND);
    rig.inputs_mut().enable = true;
    assert!(rig.run_until(SECOND, |rig| rig.outputs().drive_ready));
    assert!(travel_in_a_second(&mut rig).abs() < 0.01);
    assert!(!rig.outputs().job_finished);
}

#[test]
fn manual_mode_asked_for_in_mid_feed_waits_until_the_program_stands() {
    // Fact sheet, section 4.3: jog while the program stands.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    run_for(&mut rig, 300 * MILLISECOND);
    rig.inputs_mut().manual = true;
    rig.inputs_mut().manual_neg = true;
    assert!(rig.run_until(3 * SECOND, |rig| !rig.outputs().running));
    // The feed was done; only then the film went backwards, seen after the 3 ms to the bus and two PLC cycles.
    let moved = rig.film().position_mm() - before;
    assert!((1190.0..1200.01).contains(&moved), "{moved}");
    assert!(travel_in_a_second(&mut rig) < -50.0);
}

#[test]
fn a_new_length_in_mid_feed_is_for_the_next_feed() {
    // 9300 fact sheet, section 4.3: codes are read when a record begins.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    rig.inputs_mut().distance = 5_000;
    rig.inputs_mut().velocity = 5_000;
    let first = moved_until_finished(&mut rig, before);
    assert!((first - 1200.0).abs() <= 0.01, "{first}");
    run_for(&mut rig, SECOND);
    let before = rig.film().position_mm();
    start_feed(&mut rig);
    let second = moved_until_finished(&mut rig, before);
    assert!((second - 500.0).abs() <= 0.01, "{second}");
}

#[test]
fn a_stop_during_the_search_ends_it_and_the_next_search_finds_the_next_mark() {
    let mut rig = ready(&RigConfig::default());
    rig.inputs_mut().read_mark = true;
    run_for(&mut rig, 50 * MILLISECOND);
    start_feed(&mut rig);
    assert!(rig.run_until(3 * SECOND, |rig| rig.drive().traverse_status().record == 4));
    rig.inputs_mut().pos_stop = true;
    run_for(&mut rig, SECOND);
    assert!(!rig.outputs().running && !rig.outputs().job_finished);
    rig.inputs_mut().pos_stop = false;
    run_for(&mut rig, 50 * MILLISECOND);
    start_feed(&mut rig);
    assert!(rig.run_until(10 * SECOND, |rig| rig.outputs().job_finished));
    run_for(&mut rig, 300 * MILLISECOND);
    assert!(!rig.drive().traverse_status().no_mark_found);
    let behind_mm = behind_last_mark(&rig);
    assert!((behind_mm - 50.0).abs() <= 0.01, "{behind_mm} mm behind the mark");
}

/// How far the film stands behind its last mark, mm; the marks are those of the default film, threaded at power-up.
fn behind_last_mark(rig: &Rig) -> f64 {
    let mut marks = Marks::new(MarkConfig::default(), -50.0);
    rig.film().position_mm() - marks.leading_mm(rig.film().marks_passed())
}
