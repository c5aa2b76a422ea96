//! The program executor: start, stop, reset, enable, records without marks.

mod traverse_rig;

use lenze9300_model::code::table::number::*;
use lenze9300_model::traverse::*;
use proptest::prelude::*;
use traverse_rig::{Rig, number, reference_first};

// ---- a feed without mark -------------------------------------------------------------------------------------------

/// Film-feed specification, section 9: 1200.0 mm, cycle time 1.5 s.
#[test]
fn a_feed_takes_1500_ticks_from_the_start_edge_and_ends_at_its_increment() {
    let mut rig = Rig::new();
    assert!(rig.traverse.status().ready_to_start);
    let ticks = rig.feed();
    assert_eq!(ticks, 1500);
    assert_eq!(rig.last.position, 3_074_216);
    assert_eq!(rig.last.velocity, 0.0);
    let status = rig.traverse.status();
    assert!(status.ended && status.in_target && !status.running && status.ready_to_start);
    assert_eq!(
        rig.events,
        [
            TraverseEvent::ProgramStarted,
            TraverseEvent::RecordStarted(number(1)),
            TraverseEvent::SetReference { shift: 0 },
            TraverseEvent::RecordStarted(number(2)),
            TraverseEvent::ProgramEnded,
        ]
    );
}

/// Film-feed specification, section 9; 9300 facts 11: 3074.216 inc/ms, 2400 mm/s².
#[test]
fn every_set_value_of_a_feed_keeps_speed_and_acceleration() {
    let mut rig = Rig::new();
    rig.start();
    let (v_max, acc) = (3074.217, 6.148_44);
    let mut before = rig.last;
    let mut at_full_speed = 0;
    for _ in 0..1500 {
        let now = rig.tick();
        assert!(now.velocity <= v_max && now.velocity >= 0.0);
        assert!((now.velocity - before.velocity).abs() <= acc);
        assert!(now.position >= before.position);
        at_full_speed += u32::from(now.velocity > v_max - 0.01);
        before = now;
    }
    assert!((499..=501).contains(&at_full_speed), "{at_full_speed}");
}

#[test]
fn each_feed_sets_the_reference_anew_and_the_target_chain_goes_on() {
    let mut rig = Rig::new();
    for feeds in 1..=5 {
        assert_eq!(rig.feed(), 1500);
        assert_eq!(rig.last.position, 3_074_216);
        assert_eq!(rig.film, feeds * 3_074_216);
    }
    let shift = TraverseEvent::SetReference { shift: -3_074_216 };
    assert_eq!(rig.events.iter().filter(|&&event| event == shift).count(), 4);
}

/// 9300 facts 4.2: set-value and actual value shift together, the following error stays.
#[test]
fn setting_the_reference_keeps_the_following_error() {
    let mut rig = Rig::new();
    rig.feed();
    rig.inputs.start = false;
    rig.tick();
    rig.film -= 10;
    rig.inputs.start = true;
    rig.tick();
    // Actual position 0, set-value 10 ahead of it, target one feed after the old one.
    assert_eq!(rig.last.reference_shift, -3_074_206);
    assert_eq!(rig.last.position, 10);
    assert_eq!(rig.traverse.status().target, 3_074_226);
    rig.until_ended();
    assert_eq!(rig.film, 2 * 3_074_216, "the following error did not add up");
}

/// Film-feed specification, section 5: 0.455 inc per feed, adding up.
#[test]
fn rounding_adds_up_over_feeds_unless_it_is_carried() {
    let exact = 100.0 * 1200.0 * traverse_rig::PER_MM;
    let mut rig = Rig::new();
    let mut carrying = Rig::with_parameters(TraverseParameters {
        rounding: Rounding::CarryResidue,
        ..TraverseParameters::default()
    });
    for _ in 0..100 {
        assert_eq!(rig.feed(), 1500);
        assert_eq!(carrying.feed(), 1500);
    }
    let short = exact - rig.film as f64;
    assert!((45.0..46.0).contains(&short), "{short}");
    let short = exact - carrying.film as f64;
    assert!((0.0..1.0).contains(&short), "{short}");
}

#[test]
fn the_position_window_is_a_tenth_of_a_millimetre() {
    let mut rig = Rig::new();
    rig.feed();
    let at = rig.film;
    for (error, inside) in [(256, true), (-256, true), (257, false), (-257, false)] {
        rig.inputs.pos_act = at - rig.reference + error;
        rig.traverse.tick_1ms(&rig.inputs, &rig.codes);
        assert_eq!(rig.traverse.status().in_target, inside, "{error}");
    }
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let trace = || {
        let mut rig = Rig::new();
        rig.set(C1302, 1, 73_1100);
        rig.set(C1303, 1, 41_2300);
        rig.start();
        (0..2500)
            .map(|_| rig.tick())
            .map(|s| (s.position, s.velocity.to_bits()))
            .collect::<Vec<_>>()
    };
    assert_eq!(trace(), trace());
}

// ---- start ---------------------------------------------------------------------------------------------------------

/// 9300 facts 4.3.
#[test]
fn a_level_that_was_high_all_along_starts_nothing() {
    let mut rig = Rig::new();
    rig.inputs.enabled = false;
    rig.inputs.start = true;
    rig.tick();
    rig.inputs.enabled = true;
    rig.run(100);
    assert!(!rig.traverse.status().running);
}

/// 9300 facts 4.3 and 9.1: low for at least 1 ms in "ready to start".
#[test]
fn a_start_right_after_the_end_is_lost_and_one_a_tick_later_is_not() {
    let mut rig = Rig::new();
    rig.start();
    rig.inputs.start = false;
    rig.until_ended();
    rig.inputs.start = true;
    rig.tick();
    assert!(!rig.traverse.status().running);
    assert!(rig.saw(TraverseEvent::StartRefused(StartRefusal::NotArmed)));

    let mut rig = Rig::new();
    rig.start();
    rig.inputs.start = false;
    rig.until_ended();
    rig.tick();
    rig.inputs.start = true;
    rig.tick();
    assert!(rig.traverse.status().running);
}

#[test]
fn a_start_edge_under_manual_is_lost() {
    let mut rig = Rig::new();
    rig.inputs.manual = true;
    rig.tick();
    rig.inputs.start = true;
    rig.tick();
    assert!(rig.saw(TraverseEvent::StartRefused(StartRefusal::NotReady)));
    rig.inputs.manual = false;
    rig.run(10);
    assert!(!rig.traverse.status().running, "the edge was lost for good");
    rig.start();
    assert!(rig.traverse.status().running);
}

/// 9300 facts 9.1: an all-zero output image is a start edge and a stop at once.
#[test]
fn stop_dominates_start() {
    let mut rig = Rig::new();
    rig.tick();
    (rig.inputs.start, rig.inputs.stop) = (true, true);
    rig.tick();
    assert!(rig.saw(TraverseEvent::StartRefused(StartRefusal::Dominated)));
    rig.inputs.stop = false;
    rig.run(10);
    assert!(!rig.traverse.status().running);
}

#[test]
fn a_start_while_running_changes_nothing() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(500);
    rig.start();
    assert_eq!(rig.until_ended(), 1500 - 502);
    assert_eq!(rig.last.position, 3_074_216);
}

#[test]
fn a_first_record_that_is_not_programmed_is_reported() {
    let mut rig = Rig::new();
    rig.set(C1211, 0, 9_0000);
    rig.start();
    assert!(rig.saw(TraverseEvent::NoSuchRecord(number(9))));
    let status = rig.traverse.status();
    assert!(!status.running && !status.ended);
}

#[test]
fn the_program_starts_at_the_record_of_c1211() {
    let mut rig = Rig::new();
    rig.set(C1211, 0, 2_0000);
    assert_eq!(rig.feed(), 1500);
    rig.feed();
    assert_eq!(rig.last.position, 2 * 3_074_216, "record 01 did not set the reference");
}

// ---- stop and reset ------------------------------------------------------------------------------------------------

/// 9300 facts 4.3: deceleration with the record's ramp; 1200 mm/s at 2400 mm/s² take 0.5 s and 300 mm.
#[test]
fn stop_brakes_with_the_ramp_of_the_record_and_start_continues_it() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(750);
    let at = rig.film_mm();
    rig.inputs.stop = true;
    rig.tick();
    assert!(rig.saw(TraverseEvent::Stopped));
    rig.run(499);
    assert!(rig.traverse.status().moving);
    rig.run(2);
    let status = rig.traverse.status();
    assert!(!status.moving && status.running && status.interrupted && !status.ended && !status.in_target);
    assert!((rig.film_mm() - at - 300.0).abs() < 1.3, "{}", rig.film_mm() - at);
    rig.inputs.stop = false;
    rig.feed();
    assert_eq!(rig.last.position, 3_074_216);
    let status = rig.traverse.status();
    assert!(status.ended && status.in_target);
    assert!(rig.saw(TraverseEvent::ProgramContinued));
    assert!(!rig.events[5..].contains(&TraverseEvent::RecordStarted(number(1))));
}

#[test]
fn stop_with_reset_ends_the_program_and_the_next_start_begins_anew() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(400);
    (rig.inputs.stop, rig.inputs.reset) = (true, true);
    rig.tick();
    let status = rig.traverse.status();
    assert!(
        !status.running && !status.ended && !status.ready_to_start,
        "still braking"
    );
    assert!(rig.saw(TraverseEvent::Reset));
    (rig.inputs.stop, rig.inputs.reset) = (false, false);
    rig.run(500);
    assert!(rig.traverse.status().ready_to_start);
    let rest = rig.film;
    assert!(rest > 0 && rest < 3_074_216);
    assert_eq!(rig.feed(), 1500);
    assert_eq!(
        rig.film,
        rest + 3_074_216,
        "a whole feed from where the film came to rest"
    );
}

/// 9300 facts 4.3: cleared by the next start, by RESET and by STOP.
#[test]
fn ended_is_cleared_by_start_reset_and_stop() {
    for signal in 0..3 {
        let mut rig = Rig::new();
        rig.feed();
        rig.inputs.start = false;
        rig.run(5);
        assert!(rig.traverse.status().ended);
        match signal {
            0 => rig.inputs.start = true,
            1 => rig.inputs.reset = true,
            _ => rig.inputs.stop = true,
        }
        rig.tick();
        assert!(!rig.traverse.status().ended, "{signal}");
    }
}

#[test]
fn ready_again_only_when_the_brake_is_over() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(700);
    rig.inputs.reset = true;
    rig.tick();
    rig.inputs.reset = false;
    rig.run(100);
    rig.start();
    assert!(!rig.traverse.status().running);
    assert!(rig.saw(TraverseEvent::StartRefused(StartRefusal::NotReady)));
}

// ---- enable --------------------------------------------------------------------------------------------------------

/// 9300 facts 2.5: the program is interrupted; the profile starts from the actual speed.
#[test]
fn the_loss_of_the_enable_interrupts_and_the_profile_starts_from_the_actual_speed() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(750);
    rig.inputs.enabled = false;
    rig.tick();
    assert!(rig.saw(TraverseEvent::EnableLost));
    let status = rig.traverse.status();
    assert!(status.running && status.interrupted && !status.ready_to_start);
    // The film coasts 10 mm at 600 mm/s, then the enable returns.
    rig.film += 25_618;
    rig.inputs.omega_act_inc_per_ms = 1537.108;
    rig.inputs.enabled = true;
    let first = rig.tick();
    assert_eq!(first.position, rig.inputs.pos_act);
    assert_eq!(first.velocity, 1537.108);
    let second = rig.tick();
    assert!((second.velocity - (1537.108 - 6.148_43)).abs() < 1e-3);
    rig.run(300);
    assert!(!rig.traverse.status().moving, "no start, no motion");
    rig.feed();
    assert_eq!(rig.last.position, 3_074_216);
    assert!(rig.traverse.status().ended);
}

#[test]
fn without_enable_the_set_value_follows_the_film() {
    let mut rig = Rig::new();
    rig.feed();
    rig.inputs.enabled = false;
    rig.tick();
    assert!(rig.traverse.status().in_target, "nobody has moved the film");
    rig.film += 1000;
    assert_eq!(rig.tick().position, 3_074_216 + 1000);
    assert!(!rig.traverse.status().in_target);
    rig.inputs.enabled = true;
    let setpoint = rig.tick();
    assert_eq!((setpoint.position, setpoint.velocity), (3_074_216 + 1000, 0.0));
}

#[test]
fn reset_works_without_enable() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(300);
    rig.inputs.enabled = false;
    rig.tick();
    rig.inputs.reset = true;
    rig.tick();
    rig.inputs.reset = false;
    assert!(!rig.traverse.status().running);
    rig.inputs.enabled = true;
    rig.tick();
    let rest = rig.film;
    assert_eq!(rig.feed(), 1500);
    assert_eq!(rig.film, rest + 3_074_216);
}

// ---- fields of a record --------------------------------------------------------------------------------------------

fn with_program(records: impl IntoIterator<Item = (u8, Record)>) -> Rig {
    let mut rig = Rig::new();
    rig.traverse = Traverse::new(Program::new(records).expect("a sound program"));
    rig.tick();
    rig
}

#[test]
fn a_record_waits_switches_dwells_and_jumps() {
    let high = InputLevel {
        input: ProgramInput::PFI01,
        level: Level::High,
    };
    let first = Record {
        wait: Some(high),
        switch_before: Some(OutputLevel {
            output: 1,
            level: Level::High,
        }),
        switch_after: Some(OutputLevel {
            output: 16,
            level: Level::High,
        }),
        dwell: Some(3),
        jump: Successor::Record(number(7)),
        ..Record::new(Mode::Relative, Target::Variable(1))
    };
    let second = Record {
        switch_before: Some(OutputLevel {
            output: 1,
            level: Level::Low,
        }),
        ..Record::new(Mode::Absolute, Target::Variable(2))
    };
    let mut rig = with_program([reference_first(), (1, first), (7, second)]);
    rig.set(C1211, 0, 32_0000);
    rig.set(C1304, 3, 250_0000);
    rig.set(C1301, 2, 600_0000);
    rig.start();
    rig.run(100);
    assert!(!rig.traverse.status().moving, "it waits for PFI 01");
    rig.inputs.program_inputs = 1;
    rig.tick();
    assert_eq!(rig.traverse.status().outputs, 0x0001);
    rig.run(1500);
    let status = rig.traverse.status();
    assert_eq!((status.outputs, status.record, status.moving), (0x8001, 1, false));
    rig.run(249);
    assert_eq!(rig.traverse.status().record, 1);
    rig.tick();
    assert_eq!(rig.traverse.status().record, 7);
    assert_eq!(rig.traverse.status().outputs, 0x8000);
    // 600 mm back: 0.5 s up and 0.5 s down.
    assert_eq!(rig.until_ended(), 1000);
    assert_eq!(rig.last.position, 1_537_108);
}

#[test]
fn the_first_branch_wins_and_pieces_count_passes() {
    let high = InputLevel {
        input: ProgramInput::PFI01,
        level: Level::High,
    };
    let count = Record {
        branch_1: Some(Branch {
            when: high,
            to: Successor::End,
        }),
        branch_2: Some(Branch {
            when: high,
            to: Successor::Record(number(1)),
        }),
        pieces: Some(Pieces {
            count: 4,
            to: Successor::End,
        }),
        jump: Successor::Record(number(1)),
        ..Record::new(Mode::Relative, Target::Variable(1))
    };
    let mut rig = with_program([(1, count)]);
    rig.set(C1305, 4, 3_0000);
    rig.feed();
    assert_eq!(rig.film, 3 * 3_074_216);
    rig.inputs.program_inputs = 1;
    rig.feed();
    assert_eq!(rig.film, 4 * 3_074_216);
}

#[test]
fn a_program_without_motion_does_not_hang_the_tick() {
    let endless = Record {
        jump: Successor::Record(number(1)),
        ..Record::new(Mode::SetReference, Target::Zero)
    };
    let mut rig = with_program([(1, endless)]);
    rig.start();
    rig.run(10);
    assert!(rig.traverse.status().running);
    rig.inputs.reset = true;
    rig.tick();
    assert!(!rig.traverse.status().running);
}

#[test]
fn a_program_end_on_the_fly_brakes() {
    let record = Record {
        final_velocity: FinalVelocity::Variable(2),
        ..Record::new(Mode::Relative, Target::Variable(1))
    };
    let mut rig = with_program([(1, record)]);
    rig.feed();
    assert!(rig.traverse.status().ended && rig.traverse.status().moving);
    rig.run(101);
    assert!(!rig.traverse.status().moving);
    // 240 mm/s at 2400 mm/s² need 12 mm (9300 facts 11).
    assert!((rig.film_mm() - 1212.0).abs() < 0.3, "{}", rig.film_mm());
}

#[test]
fn programs_that_cannot_be_worked_off_are_refused() {
    let record = Record::new(Mode::Relative, Target::Variable(1));
    let refused = |records: &[(u8, Record)]| Program::new(records.iter().copied()).unwrap_err();
    assert_eq!(refused(&[(0, record)]), ProgramError::Number { got: 0 });
    assert_eq!(refused(&[(33, record)]), ProgramError::Number { got: 33 });
    assert_eq!(
        refused(&[(1, record), (1, record)]),
        ProgramError::Doubled { record: 1 }
    );
    let jump = Record {
        jump: Successor::Record(number(2)),
        ..record
    };
    assert_eq!(refused(&[(1, jump)]), ProgramError::NoSuccessor { record: 1, to: 2 });
    let fly = Record {
        dwell: Some(1),
        final_velocity: FinalVelocity::Variable(1),
        ..record
    };
    assert_eq!(refused(&[(1, fly)]), ProgramError::DwellOnTheFly { record: 1 });
    let output = Record {
        switch_after: Some(OutputLevel {
            output: 17,
            level: Level::High,
        }),
        ..record
    };
    assert_eq!(refused(&[(1, output)]), ProgramError::Output { record: 1, got: 17 });
    let variable = Record {
        velocity: Velocity::Variable(35),
        ..record
    };
    assert_eq!(
        refused(&[(1, variable)]),
        ProgramError::Variable {
            record: 1,
            got: 35,
            last: 34
        }
    );
    let position = Record::new(Mode::Relative, Target::Variable(111));
    assert_eq!(
        refused(&[(1, position)]),
        ProgramError::Variable {
            record: 1,
            got: 111,
            last: 110
        }
    );
}

/// Film-feed specification, section 6.
#[test]
fn the_built_in_program_has_the_four_records_of_the_film_feed() {
    let program = film_feed_program();
    assert_eq!((1..=32).filter(|&n| program.record(number(n)).is_some()).count(), 4);
    let record = |n| program.record(number(n)).unwrap();
    assert_eq!(record(1).mode, Mode::SetReference);
    assert_eq!(record(1).jump, Successor::Record(number(2)));
    assert_eq!(
        record(1).branch_1.map(|branch| branch.to),
        Some(Successor::Record(number(3)))
    );
    assert_eq!(record(2).jump, Successor::End);
    assert_eq!(record(3).target, Target::Variable(61));
    assert_eq!(record(3).final_velocity, FinalVelocity::Variable(2));
    assert_eq!(record(3).jump, Successor::Record(number(4)));
    let touch = TouchRule {
        window: TouchWindow::TravelRange,
        residual: ResidualPath::Fixed(50_0000),
    };
    assert_eq!(record(4).mode, Mode::RelativeWithTouchProbe(touch));
    assert_eq!(record(4).velocity, Velocity::Variable(2));
    assert_eq!(
        (record(4).without_touch, record(4).jump),
        (Successor::End, Successor::End)
    );
}

// ---- any sequence --------------------------------------------------------------------------------------------------

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever is pressed: speed and acceleration stay within C1240 and C1250, the position never jumps, and after a
    /// reset a feed is a whole feed again.
    #[test]
    fn any_sequence_of_signals_keeps_the_limits_and_leaves_a_working_axis(
        presses in prop::collection::vec((0_u8..7, 1_u64..900), 1..20),
    ) {
        let mut rig = Rig::new();
        for (signal, ticks) in presses {
            let inputs = &mut rig.inputs;
            match signal {
                0 => inputs.start = !inputs.start,
                1 => inputs.stop = !inputs.stop,
                2 => inputs.reset = !inputs.reset,
                3 => inputs.manual = !inputs.manual,
                4 => inputs.manual_pos = !inputs.manual_pos,
                5 => inputs.manual_neg = !inputs.manual_neg,
                _ => inputs.program_inputs ^= 1,
            }
            for _ in 0..ticks {
                let before = rig.last;
                let now = rig.tick();
                prop_assert!(now.velocity.abs() <= 3074.217);
                prop_assert!((now.velocity - before.velocity).abs() <= 6.148_44, "{before:?} {now:?}");
                let way = (now.position - now.reference_shift - before.position) as f64;
                let mean = 0.5 * (now.velocity + before.velocity);
                prop_assert!((way - mean).abs() <= 4.1, "{before:?} {now:?}");
            }
        }
        rig.inputs = TraverseInputs { enabled: true, reset: true, ..TraverseInputs::default() };
        rig.run(2000);
        rig.inputs.reset = false;
        let rest = rig.film;
        prop_assert!(rig.traverse.status().ready_to_start);
        prop_assert_eq!(rig.feed(), 1500);
        prop_assert_eq!(rig.film, rest + 3_074_216);
    }
}
