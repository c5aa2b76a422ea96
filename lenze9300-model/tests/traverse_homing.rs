//! Homing, the reference, and the position limits that count from it.

mod traverse_rig;

use lenze9300_model::code::table::number::*;
use lenze9300_model::traverse::*;
use traverse_rig::{PER_MM, Rig, number, reference_first};

const SWITCH: u8 = 2;

fn input() -> ProgramInput {
    ProgramInput::new(SWITCH).expect("1 to 32")
}

/// A homing record at 100 mm/s towards negative positions; VTPOS 7 is the value of the reference point.
fn homing(reference: HomingReference) -> Record {
    let rule = HomingRule {
        direction: Direction::Negative,
        reference,
    };
    Record {
        velocity: Velocity::Variable(3),
        ..Record::new(Mode::Homing(rule), Target::Variable(7))
    }
}

fn machine(record: Record) -> Rig {
    with_parameters(record, TraverseParameters::default())
}

fn with_parameters(record: Record, parameters: TraverseParameters) -> Rig {
    let mut rig = Rig::new();
    let program = Program::new([(1, record)]).expect("a sound program");
    rig.traverse = Traverse::with_parameters(program, parameters);
    // 8.33 % of 1200 mm/s are 100 mm/s.
    rig.set(C1302, 3, 8_3300);
    rig.tick();
    rig
}

/// Runs until the program has ended; the switch is high below `edge`, and the resolver reads `offset` more than the film.
fn home(rig: &mut Rig, edge: i64, offset: i64) {
    rig.inputs.start = false;
    for tick in 0..200_000 {
        rig.inputs.program_inputs = u32::from(rig.film < edge) << (SWITCH - 1);
        rig.inputs.resolver = rig.film + offset;
        rig.tick();
        rig.inputs.start = true;
        if tick > 2 && !rig.traverse.status().running {
            return;
        }
    }
    panic!("homing never ended");
}

fn film_of(rig: &Rig, position: i64) -> i64 {
    position + rig.reference
}

/// At 10 mm/s, the speed at which the switch is left, the axis moves this far in the millisecond of a sample.
const SAMPLE: i64 = (10.0 * PER_MM / 1000.0) as i64 + 2;

#[test]
fn the_falling_switch_is_the_reference_point_and_gets_the_target_value() {
    let edge = (-40.0 * PER_MM) as i64;
    let mut rig = machine(homing(HomingReference::Switch(input())));
    rig.set(C1301, 7, 12_5000);
    assert!(!rig.traverse.status().referenced);
    home(&mut rig, edge, 0);
    let status = rig.traverse.status();
    assert!(status.referenced && status.ended && status.in_target, "{status:?}");
    // 12.5 mm at the place where the switch fell: 12.5 · 2561.847 = 32 023.09 inc, truncated.
    let found = film_of(&rig, 32_023);
    assert!((edge..=edge + SAMPLE).contains(&found), "{}", found - edge);
    assert_eq!(rig.film, found, "the axis stands on it");
    assert_eq!(rig.last.position, 32_023);
}

#[test]
fn an_axis_that_begins_on_the_switch_leaves_it_first() {
    let edge = (30.0 * PER_MM) as i64;
    let mut rig = machine(homing(HomingReference::Switch(input())));
    home(&mut rig, edge, 0);
    let found = film_of(&rig, 0);
    assert!((edge..=edge + SAMPLE).contains(&found), "{}", found - edge);
}

#[test]
fn with_the_zero_pulse_the_reference_does_not_depend_on_where_the_switch_falls_within_a_revolution() {
    // Zero pulses at film positions 65 536·k − 20 000.
    let offset = 20_000;
    let mut found = Vec::new();
    for shift in [0, 10_000, 30_000] {
        let edge = -200_000 + shift;
        let mut rig = machine(homing(HomingReference::SwitchAndZeroPulse(input())));
        home(&mut rig, edge, offset);
        found.push(film_of(&rig, 0));
    }
    // The first pulse above −200 000 … −170 000 going up: −151 072.
    assert_eq!(found, [-151_072; 3]);
}

#[test]
fn without_a_switch_the_next_zero_pulse_is_taken() {
    let mut rig = machine(homing(HomingReference::ZeroPulse));
    home(&mut rig, i64::MIN, 20_000);
    // Downwards from 0: the pulse at −20 000.
    assert_eq!(film_of(&rig, 0), -20_000);
}

#[test]
fn a_switch_that_never_comes_ends_the_search_after_its_longest_way() {
    let parameters = TraverseParameters {
        homing_way_e4: 300_0000,
        ..TraverseParameters::default()
    };
    let mut rig = with_parameters(homing(HomingReference::Switch(input())), parameters);
    home(&mut rig, i64::MIN, 0);
    assert!(rig.saw(TraverseEvent::HomingFailed { record: number(1) }));
    assert!(!rig.traverse.status().referenced);
    // 300 mm: 768 554.1 inc.
    assert_eq!(rig.film, -768_554);
}

#[test]
fn a_homing_that_was_stopped_begins_anew() {
    let edge = (-40.0 * PER_MM) as i64;
    let mut rig = machine(homing(HomingReference::Switch(input())));
    rig.start();
    rig.run(300);
    rig.inputs.stop = true;
    rig.run(300);
    rig.inputs.stop = false;
    assert_eq!(rig.last.velocity, 0.0);
    home(&mut rig, edge, 0);
    let found = film_of(&rig, 0);
    assert!((edge..=edge + SAMPLE).contains(&found), "{}", found - edge);
}

#[test]
fn a_homing_record_ends_at_standstill() {
    let record = Record {
        final_velocity: FinalVelocity::Variable(1),
        ..homing(HomingReference::ZeroPulse)
    };
    assert_eq!(
        Program::new([(1, record)]),
        Err(ProgramError::HomingOnTheFly { record: 1 })
    );
}

// ---- the reference

#[test]
fn an_absolute_target_needs_a_reference_and_is_refused_without() {
    let absolute = Record::new(Mode::Absolute, Target::Variable(1));
    let mut rig = Rig::new();
    rig.traverse = Traverse::new(Program::new([reference_first(), (1, absolute)]).expect("a sound program"));
    rig.tick();
    rig.start();
    assert_eq!(rig.traverse.status().fault, Some(RecordFault::NoReference));
    assert!(rig.saw(TraverseEvent::RecordRefused {
        record: number(1),
        fault: RecordFault::NoReference
    }));
    rig.run(500);
    assert_eq!((rig.film, rig.traverse.status().fault), (0, None));
    // With it the record is worked off, until a long message loses it again.
    rig.inputs.reset = true;
    rig.tick();
    rig.inputs.reset = false;
    rig.set(C1211, 0, 32_0000);
    rig.feed();
    assert_eq!(rig.last.position, 3_074_216);
    rig.inputs.reference_lost = true;
    rig.tick();
    rig.inputs.reference_lost = false;
    assert!(!rig.traverse.status().referenced);
}

// ---- position limits

fn limited(record: Record) -> Rig {
    let parameters = TraverseParameters {
        position_limits: Some([-100_0000, 1000_0000]),
        ..TraverseParameters::default()
    };
    let mut rig = Rig::new();
    let program = Program::new([reference_first(), (1, record)]).expect("a sound program");
    rig.traverse = Traverse::with_parameters(program, parameters);
    rig.set(C1211, 0, 32_0000);
    rig.tick();
    rig
}

#[test]
fn a_target_outside_the_limits_is_refused_before_anything_moves() {
    for (position, fault) in [
        (1000_0001, Some(RecordFault::AboveLimit)),
        (1000_0000, None),
        (-100_0000, None),
        (-100_1000, Some(RecordFault::BelowLimit)),
    ] {
        for mode in [Mode::Absolute, Mode::Relative] {
            let mut rig = limited(Record::new(mode, Target::Variable(1)));
            rig.set(C1301, 1, position);
            rig.start();
            // One ten-thousandth of a millimetre is less than an increment.
            let seen = rig.traverse.status().fault;
            let expected = if position == 1000_0001 { None } else { fault };
            assert_eq!(seen, expected, "{mode:?} {position}");
            rig.run(3000);
            assert_eq!(rig.film == 0, expected.is_some(), "{mode:?} {position}");
        }
    }
    let mut rig = limited(Record::new(Mode::Absolute, Target::Variable(1)));
    rig.set(C1301, 1, 1000_1000);
    rig.start();
    assert_eq!(rig.traverse.status().fault, Some(RecordFault::AboveLimit));
}

#[test]
fn manual_traversing_comes_to_rest_on_the_limit() {
    let mut rig = limited(Record::new(Mode::Relative, Target::Zero));
    rig.feed();
    rig.inputs.manual = true;
    rig.inputs.manual_neg = true;
    rig.run(3000);
    // −100 mm: −256 184.7 inc, truncated toward zero.
    assert_eq!((rig.last.position, rig.last.velocity), (-256_184, 0.0));
    // And can be led away from it.
    rig.inputs.manual_neg = false;
    rig.tick();
    rig.inputs.manual_pos = true;
    rig.run(20_000);
    assert_eq!(rig.last.position, 2_561_847);
}
