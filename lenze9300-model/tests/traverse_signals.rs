//! POS-PS-CANCEL, velocity override, further program inputs, touch probe in an absolute record.

mod traverse_rig;

use lenze9300_model::code::table::number::*;
use lenze9300_model::traverse::*;
use traverse_rig::{Rig, number, reference_first};

/// 1200 mm in increments (9300 facts 11).
const FEED: i64 = 3_074_216;
/// 600 mm: 1537108.2 inc, truncated.
const HALF: i64 = 1_537_108;

fn with_program(records: impl IntoIterator<Item = (u8, Record)>) -> Rig {
    let mut rig = Rig::new();
    rig.traverse = Traverse::new(Program::new(records).expect("a sound program"));
    rig.tick();
    rig
}

fn relative() -> Record {
    Record::new(Mode::Relative, Target::Variable(1))
}

// ---- POS-PS-CANCEL

#[test]
fn cancel_goes_on_at_field_11_and_the_next_record_counts_from_where_it_was() {
    // 9300 facts 4.3: ends the current PS, goes on at field 11.
    let first = Record {
        without_touch: Successor::Record(number(2)),
        ..relative()
    };
    let mut rig = with_program([(1, first), (2, Record::new(Mode::Relative, Target::Variable(2)))]);
    rig.set(C1301, 2, 600_0000);
    rig.start();
    rig.run(700);
    let cut = rig.last.position;
    rig.inputs.cancel = true;
    rig.tick();
    assert_eq!(rig.traverse.status().record, 2);
    assert!(rig.saw(TraverseEvent::RecordCancelled { record: number(1) }));
    rig.until_ended();
    // Within the millisecond in which the cancel was seen the axis moved on by 3074 inc at full speed.
    assert!(
        (cut + HALF..=cut + HALF + 3075).contains(&rig.last.position),
        "{}",
        rig.last.position - cut
    );
    assert_eq!(rig.last.velocity, 0.0);
}

#[test]
fn cancel_without_a_successor_brakes_with_the_ramp_of_the_record_and_ends_the_program() {
    let mut rig = with_program([(1, relative())]);
    rig.start();
    rig.run(700);
    let (start, speed) = (rig.last.position, rig.last.velocity);
    rig.inputs.cancel = true;
    rig.run(501);
    let status = rig.traverse.status();
    assert!(!status.running && status.ended && !status.moving, "{status:?}");
    // v²/2a with 3074.216 inc/ms and 6.148 432 inc/ms²: 768 554 inc, 300 mm.
    let braking = rig.last.position - start;
    assert!(
        (braking as f64 - speed * speed / (2.0 * 6.148_432)).abs() < 3100.0,
        "{braking}"
    );
}

#[test]
fn only_a_rising_edge_cancels() {
    let again = Record {
        jump: Successor::Record(number(1)),
        without_touch: Successor::Record(number(1)),
        ..relative()
    };
    let mut rig = with_program([(1, again)]);
    rig.inputs.cancel = true;
    rig.tick();
    rig.start();
    rig.run(1400);
    assert!(!rig.saw(TraverseEvent::RecordCancelled { record: number(1) }));
}

// ---- override

#[test]
fn half_the_override_is_half_the_speed_and_arrives_at_the_same_increment() {
    let mut rig = Rig::new();
    rig.inputs.velocity_override = Override::from_percent_e4(50_0000);
    // 1200 mm at 600 mm/s and 2400 mm/s²: 0.25 s + 1.75 s + 0.25 s.
    assert_eq!(rig.feed(), 2250);
    assert_eq!(rig.last.position, FEED);
}

#[test]
fn an_override_of_zero_stops_on_the_way_and_the_way_goes_on_with_it() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(600);
    rig.inputs.velocity_override = Override::from_percent_e4(0);
    rig.run(501);
    assert_eq!(rig.last.velocity, 0.0);
    let stands = rig.last.position;
    rig.run(1000);
    assert_eq!(rig.last.position, stands);
    assert!(rig.traverse.status().running);
    rig.inputs.velocity_override = Override::FULL;
    rig.until_ended();
    assert_eq!(rig.last.position, FEED);
}

#[test]
fn a_change_of_the_override_jerks_no_set_value() {
    let mut rig = Rig::new();
    rig.start();
    let mut before = rig.last;
    for tick in 0..3000 {
        // Up and down all the time.
        rig.inputs.velocity_override = Override::from_percent_e4((tick / 100 % 5 + 1) * 20_0000);
        let now = rig.tick();
        // a_max = 2400 mm/s² = 6.148 433 inc/ms² (9300 facts 11).
        assert!((now.velocity - before.velocity).abs() <= 6.148_44, "{tick}");
        before = now;
    }
    assert_eq!(rig.last.position, FEED);
}

#[test]
fn the_override_is_cut_to_0_to_100_percent() {
    assert_eq!(Override::from_percent_e4(-1), Override::from_percent_e4(0));
    assert_eq!(Override::from_percent_e4(i32::MAX), Override::FULL);
}

#[test]
fn the_override_holds_for_manual_traversing_too() {
    let mut rig = Rig::new();
    rig.inputs.manual = true;
    rig.inputs.manual_pos = true;
    rig.inputs.velocity_override = Override::from_percent_e4(50_0000);
    rig.run(500);
    // Jog at 10 % of 3074.216 inc/ms, half of it.
    assert!((rig.last.velocity - 153.710_8).abs() < 1e-3, "{}", rig.last.velocity);
    rig.inputs.velocity_override = Override::FULL;
    rig.run(500);
    assert!((rig.last.velocity - 307.421_6).abs() < 1e-3, "{}", rig.last.velocity);
}

// ---- program inputs

#[test]
fn every_program_input_can_be_waited_for() {
    for input in 1..=ProgramInput::MAX {
        let wait = InputLevel {
            input: ProgramInput::new(input).expect("1 to 32"),
            level: Level::High,
        };
        let mut rig = with_program([(
            1,
            Record {
                wait: Some(wait),
                ..relative()
            },
        )]);
        rig.inputs.program_inputs = !(1 << (input - 1));
        rig.start();
        rig.run(10);
        assert!(!rig.traverse.status().moving, "PFI {input}");
        rig.inputs.program_inputs = 1 << (input - 1);
        rig.run(2);
        assert!(rig.traverse.status().moving, "PFI {input}");
    }
    assert_eq!(ProgramInput::new(0), None);
    assert_eq!(ProgramInput::new(33), None);
}

// ---- absolute with touch probe

#[test]
fn an_absolute_record_with_touch_probe_stops_behind_the_mark() {
    let rule = TouchRule {
        window: TouchWindow::TravelRange,
        residual: ResidualPath::Fixed(50_0000),
    };
    let search = Record {
        velocity: Velocity::Variable(2),
        ..Record::new(Mode::AbsoluteWithTouchProbe(rule), Target::Variable(1))
    };
    let mut rig = with_program([reference_first(), (1, search)]);
    rig.set(C1211, 0, 32_0000);
    rig.mark_ahead(300.0);
    let mark = rig.marks[0];
    rig.feed();
    // 50 mm = 128 092 inc (9300 facts 11).
    assert_eq!(rig.last.position, mark + 128_092);
    // Without a mark it ends at the target, counted from the reference, not from here.
    rig.set(C1211, 0, 1_0000);
    rig.marks.clear();
    rig.feed();
    assert_eq!(rig.last.position, FEED);
    assert!(rig.traverse.status().no_mark_found);
}
