//! What the thesis' block does to a true drive without meaning to (9300 fact sheet, section 9.1).
//!
//! The block is mirrored with its traps. These tests show them, so that nobody takes them for faults of the model, and
//! that the drive's own rules (stop dominates, a trip refuses a start) hold where the block's do not.

use dp_master::dp::{Mode, SlaveState};
use drivecom::State;
use film_feed::rig::{Rig, RigConfig};
use lenze9300_model::device::Fault;
use lenze9300_model::plant::Mains;
use lenze9300_model::traverse::{StartRefusal, TraverseEvent};
use system_tests::{MILLISECOND, SECOND, in_mid_feed, ready, run_for, start_feed, traverse_events};

fn has(events: &[(u64, TraverseEvent)], wanted: TraverseEvent) -> bool {
    events.iter().any(|(_, event)| *event == wanted)
}

#[test]
fn a_warning_while_start_is_low_starts_a_feed_nobody_asked_for() {
    // Bit 5 = ¬POS_START ∧ ¬ERROR: it falls when ERROR rises, and that is a start edge.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    rig.drive_mut().inject(Fault::Oh4, true);
    let events = traverse_events(&mut rig, 3 * SECOND);
    assert!(!rig.inputs_mut().pos_start);
    assert!(has(&events, TraverseEvent::ProgramStarted), "{events:?}");
    assert!((rig.film().position_mm() - before - 1200.0).abs() <= 0.01);
    // The warning stands, the bit stays low: no second feed.
    let events = traverse_events(&mut rig, 3 * SECOND);
    assert!(!has(&events, TraverseEvent::ProgramStarted), "{events:?}");
    // Its end makes the other edge; the next warning makes the next feed.
    rig.drive_mut().inject(Fault::Oh4, false);
    assert_eq!(traverse_events(&mut rig, SECOND), []);
    rig.drive_mut().inject(Fault::Oh4, true);
    assert!(has(&traverse_events(&mut rig, SECOND), TraverseEvent::ProgramStarted));
}

#[test]
fn a_warning_while_start_is_held_makes_no_edge() {
    let mut rig = ready(&RigConfig::default());
    rig.inputs_mut().pos_start = true;
    assert!(rig.run_until(3 * SECOND, |rig| rig.outputs().job_finished));
    rig.drive_mut().inject(Fault::Oh4, true);
    assert_eq!(traverse_events(&mut rig, 3 * SECOND), []);
}

#[test]
fn a_message_shorter_than_the_way_to_the_plc_and_back_starts_a_feed_too() {
    // OU keeps the output stage off for 5 ms only; the edge it causes comes when the drive is enabled again.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    rig.drive_mut().inject(Fault::Ou, true);
    run_for(&mut rig, 5 * MILLISECOND);
    rig.drive_mut().inject(Fault::Ou, false);
    let events = traverse_events(&mut rig, 3 * SECOND);
    assert!(has(&events, TraverseEvent::ProgramStarted), "{events:?}");
    assert!((rig.film().position_mm() - before - 1200.0).abs() <= 0.01);
}

#[test]
fn a_message_that_stands_refuses_the_start_it_causes() {
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    rig.drive_mut().inject(Fault::Ou, true);
    let events = traverse_events(&mut rig, SECOND);
    assert!(
        has(&events, TraverseEvent::StartRefused(StartRefusal::NotReady)),
        "{events:?}"
    );
    rig.drive_mut().inject(Fault::Ou, false);
    assert_eq!(traverse_events(&mut rig, 3 * SECOND), []);
    assert!((rig.film().position_mm() - before).abs() < 0.01);
    assert!(rig.outputs().drive_ready);
}

#[test]
fn a_trip_refuses_the_start_it_causes_and_its_reset_starts_nothing() {
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    rig.drive_mut().inject(Fault::Oc2, true);
    let events = traverse_events(&mut rig, SECOND);
    assert!(
        has(&events, TraverseEvent::StartRefused(StartRefusal::NotReady)),
        "{events:?}"
    );
    assert!(!has(&events, TraverseEvent::ProgramStarted), "{events:?}");
    assert_eq!(rig.module().state(), State::Fault);
    rig.drive_mut().inject(Fault::Oc2, false);
    rig.inputs_mut().error_reset = true;
    run_for(&mut rig, 100 * MILLISECOND);
    rig.inputs_mut().error_reset = false;
    let events = traverse_events(&mut rig, 3 * SECOND);
    assert!(rig.outputs().drive_ready && !rig.outputs().error);
    assert!(!has(&events, TraverseEvent::ProgramStarted), "{events:?}");
    assert!((rig.film().position_mm() - before).abs() < 0.01);
}

#[test]
fn all_zero_outputs_at_rest_move_nothing_and_neither_does_their_end() {
    // Control word 0: bit 5 looks like a start edge, but bit 6 = 0 is stop and bit 1 = 0 disables the voltage.
    let mut rig = ready(&RigConfig::default());
    let before = rig.film().position_mm();
    rig.master_mut().set_mode(Mode::Clear);
    let events = traverse_events(&mut rig, SECOND);
    assert_eq!(rig.slave_state(), SlaveState::DataExchange);
    assert_eq!(rig.module().control_word().0, 0);
    assert_eq!(rig.module().state(), State::SwitchOnDisabled);
    assert_eq!(
        events.iter().map(|(_, event)| *event).collect::<Vec<_>>(),
        [TraverseEvent::StartRefused(StartRefusal::Dominated)]
    );
    rig.master_mut().set_mode(Mode::Operate);
    assert_eq!(traverse_events(&mut rig, 3 * SECOND), []);
    assert!(rig.outputs().drive_ready, "the standing control word enables again");
    assert!((rig.film().position_mm() - before).abs() < 0.01);
}

#[test]
fn all_zero_outputs_in_mid_feed_take_the_torque_and_nothing_goes_on_by_itself() {
    let mut rig = in_mid_feed(&RigConfig::default(), 0.4);
    rig.master_mut().set_mode(Mode::Clear);
    run_for(&mut rig, 20 * MILLISECOND);
    assert_eq!(rig.drive().axis().sample().torque, 0.0);
    run_for(&mut rig, 2 * SECOND);
    let rest = rig.film().position_mm();
    rig.master_mut().set_mode(Mode::Operate);
    let events = traverse_events(&mut rig, 3 * SECOND);
    assert!(rig.outputs().drive_ready);
    assert!(
        !has(&events, TraverseEvent::ProgramStarted) && !has(&events, TraverseEvent::ProgramContinued),
        "{events:?}"
    );
    assert!((rig.film().position_mm() - rest).abs() < 0.01);
    assert!(!rig.outputs().job_finished);
}

#[test]
fn a_module_that_heard_no_telegram_yet_keeps_everything_still() {
    // Its process data are all zero: start and stop at once.
    let mut rig = system_tests::powered_up(&RigConfig::default());
    rig.disconnect_module();
    let events = traverse_events(&mut rig, 2 * SECOND);
    assert!(
        events
            .iter()
            .all(|(_, event)| matches!(event, TraverseEvent::StartRefused(_))),
        "{events:?}"
    );
    assert_eq!(rig.film().position_mm(), 0.0);
}

/// What becomes of a start raised `early_cycles` PLC cycles of 1 ms before the one in which RUNNING drops: the drive's
/// answer to that edge, and how far the film is moved by it.
fn start_around_the_end(early_cycles: i64) -> (TraverseEvent, f64) {
    let config = RigConfig {
        plc_cycle_ns: MILLISECOND,
        ..RigConfig::default()
    };
    let mut rig = ready(&config);
    rig.inputs_mut().distance = 2_000;
    run_for(&mut rig, 2 * SECOND);
    start_feed(&mut rig);
    // One feed tells when RUNNING drops; the next takes as long.
    let started = rig.now_ns();
    assert!(rig.run_until(3 * SECOND, |rig| !rig.outputs().running));
    let cycles = (rig.now_ns() - started) / MILLISECOND;
    run_for(&mut rig, 500 * MILLISECOND);

    start_feed(&mut rig);
    let raise_at = cycles as i64 - early_cycles;
    traverse_events(&mut rig, raise_at as u64 * MILLISECOND);
    let before = rig.film().position_mm();
    rig.inputs_mut().pos_start = true;
    let events = traverse_events(&mut rig, 3 * SECOND);
    let answer = events
        .iter()
        .map(|(_, event)| *event)
        .find(|event| matches!(event, TraverseEvent::ProgramStarted | TraverseEvent::StartRefused(_)))
        .expect("the edge reached the drive");
    (answer, rig.film().position_mm() - before)
}

#[test]
fn a_start_that_reaches_the_drive_with_the_end_of_the_program_is_lost() {
    // Fact sheet, section 4.3: the signal must have been low for a drive cycle while the drive is ready to start. An edge
    // that comes while the program runs, or in the first millisecond after it, is swallowed, although POS_START stays high.
    let answers: Vec<(TraverseEvent, f64)> = (0..=16).rev().map(start_around_the_end).collect();
    let kinds: Vec<u8> = answers
        .iter()
        .map(|(answer, _)| match answer {
            TraverseEvent::StartRefused(StartRefusal::NotReady) => 0,
            TraverseEvent::StartRefused(StartRefusal::NotArmed) => 1,
            TraverseEvent::ProgramStarted => 2,
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(kinds.is_sorted(), "{kinds:?}");
    assert_eq!(kinds.iter().filter(|kind| **kind == 1).count(), 1, "{kinds:?}");
    assert!(kinds.contains(&0) && kinds.contains(&2), "{kinds:?}");
    // 16 ms before its end the feed under way has 2400 mm/s² · (16 ms)² / 2 = 0.31 mm to go.
    for (answer, moved_mm) in answers {
        let rest_mm = 0.32;
        if answer == TraverseEvent::ProgramStarted {
            assert!((200.0 - 0.01..200.0 + rest_mm).contains(&moved_mm), "{moved_mm}");
        } else {
            assert!(
                (-0.01..rest_mm).contains(&moved_mm),
                "a lost start stays lost: {moved_mm}"
            );
        }
    }
}

#[test]
fn a_start_raised_when_the_plc_sees_running_drop_is_taken() {
    // By then the drive has been ready for the way of the process data: 3 ms at least (fact sheet, section 1.6).
    assert_eq!(start_around_the_end(0).0, TraverseEvent::ProgramStarted);
}

/// Mains off until LU, `lu_ms` of LU, mains on again.
fn mains_dip(rig: &mut Rig, lu_ms: u64) {
    rig.drive_mut().set_mains(Mains::Off);
    assert!(
        rig.run_until(60 * SECOND, |rig| rig.drive().status().undervoltage),
        "the DC link never ran empty"
    );
    run_for(rig, lu_ms * MILLISECOND);
    rig.drive_mut().set_mains(Mains::On);
}

#[test]
fn after_a_long_message_the_drive_enables_itself_and_the_program_waits_for_a_start() {
    // C0142 = 1 as delivered: the control word still says enable, and nobody is asked.
    let mut rig = in_mid_feed(&RigConfig::default(), 0.4);
    // In mid feed the DC link would last to its end: the monitoring is told that it has not.
    rig.drive_mut().inject(Fault::Lu, true);
    run_for(&mut rig, 600 * MILLISECOND);
    assert!(!rig.outputs().drive_ready && rig.outputs().error);
    assert_eq!(rig.drive().axis().sample().torque, 0.0);
    rig.drive_mut().inject(Fault::Lu, false);
    assert!(rig.run_until(2 * SECOND, |rig| rig.outputs().drive_ready && !rig.outputs().error));
    let rest = rig.film().position_mm();
    let events = traverse_events(&mut rig, 3 * SECOND);
    assert!(
        !has(&events, TraverseEvent::ProgramStarted) && !has(&events, TraverseEvent::ProgramContinued),
        "{events:?}"
    );
    assert!((rig.film().position_mm() - rest).abs() < 0.01);
    assert!(
        !rig.outputs().job_finished && rig.outputs().running,
        "the program is only interrupted"
    );
}

#[test]
fn with_c0142_at_0_a_long_message_needs_a_new_enable() {
    let mut rig = ready(&RigConfig::default());
    rig.drive_mut().write_code(142, 0, 0).unwrap();
    mains_dip(&mut rig, 600);
    run_for(&mut rig, 3 * SECOND);
    assert!(!rig.outputs().error, "the message is over");
    assert!(rig.drive().inhibited());
    // C0183 = 141: restart protection (fact sheet, section 4.4).
    assert_eq!(rig.drive_mut().read_code(183, 0), Ok(141_0000));
    let before = rig.film().position_mm();
    rig.inputs_mut().pos_start = true;
    run_for(&mut rig, SECOND);
    assert!((rig.film().position_mm() - before).abs() < 0.01);
    rig.inputs_mut().pos_start = false;
    rig.inputs_mut().enable = false;
    run_for(&mut rig, 100 * MILLISECOND);
    rig.inputs_mut().enable = true;
    run_for(&mut rig, 100 * MILLISECOND);
    assert!(!rig.drive().inhibited());
    start_feed(&mut rig);
}

#[test]
fn a_short_message_needs_no_new_enable_even_with_c0142_at_0() {
    let mut rig = ready(&RigConfig::default());
    rig.drive_mut().write_code(142, 0, 0).unwrap();
    mains_dip(&mut rig, 100);
    assert!(rig.run_until(2 * SECOND, |rig| rig.outputs().drive_ready && !rig.outputs().error));
    assert!(!rig.drive().inhibited());
}
