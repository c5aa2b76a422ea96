//! Traversing programs as files.
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use lenze9300_model::code::{CodeStore, WIRED_POSITIONS};
use lenze9300_model::traverse::*;
use proptest::prelude::*;

const FILM_FEED: &str = include_str!("../programs/film-feed.toml");

fn told(text: &str) -> Vec<String> {
    let error = ProgramFile::read(text, &CodeStore::thesis()).unwrap_err();
    error.mistakes.iter().map(ToString::to_string).collect()
}

#[test]
fn the_file_of_the_film_feed_is_the_built_in_program() {
    let file = ProgramFile::read(FILM_FEED, &CodeStore::thesis()).unwrap();
    assert_eq!(file.program, film_feed_program());
    assert_eq!(file.computed, WIRED_POSITIONS);
    assert_eq!(file.codes.differences(&CodeStore::thesis()).count(), 0);
}

#[test]
fn every_field_of_the_dialog_has_its_key() {
    // 9300 facts 4.1: the 17 fields of a record.
    let text = r#"
[[record]]
number = 7
wait = { input = 3, level = "low" }
switch_before = { output = 2, level = "high" }
mode = "absolute"
target = "VTPOS 012"
velocity = "VTVEL 34"
acceleration = "VTACC 2"
deceleration = "VTACC 3"
final_velocity = "standstill"
touch_probe = { window = ["VTPOS 3", "VTPOS 4"], residual = "VTPOS 5" }
without_touch = 7
switch_after = { output = 16, level = "low" }
dwell = "VTTIME 6"
branch_1 = { input = 1, level = "high", to = "end" }
branch_2 = { input = 32, level = "low", to = 7 }
pieces = { count = "VTPCS 8", to = 7 }
jump = "end"

[codes]
C1211 = 7
"C1304/6" = 250
"#;
    let file = ProgramFile::read(text, &CodeStore::thesis()).unwrap();
    let seven = RecordNumber::new(7).unwrap();
    let on = |input, level| InputLevel {
        input: ProgramInput::new(input).unwrap(),
        level,
    };
    let expected = Record {
        wait: Some(on(3, Level::Low)),
        switch_before: Some(OutputLevel {
            output: 2,
            level: Level::High,
        }),
        velocity: Velocity::Variable(34),
        acceleration: Acceleration::Variable(2),
        deceleration: Acceleration::Variable(3),
        without_touch: Successor::Record(seven),
        switch_after: Some(OutputLevel {
            output: 16,
            level: Level::Low,
        }),
        dwell: Some(6),
        branch_1: Some(Branch {
            when: on(1, Level::High),
            to: Successor::End,
        }),
        branch_2: Some(Branch {
            when: on(32, Level::Low),
            to: Successor::Record(seven),
        }),
        pieces: Some(Pieces {
            count: 8,
            to: Successor::Record(seven),
        }),
        ..Record::new(
            Mode::AbsoluteWithTouchProbe(TouchRule {
                window: TouchWindow::Between { first: 3, second: 4 },
                residual: ResidualPath::Variable(5),
            }),
            Target::Variable(12),
        )
    };
    assert_eq!(file.program.record(seven), Some(&expected));
    assert_eq!(file.codes.number(1211, 0), 7.0);
    assert_eq!(file.codes.number(1304, 6), 250.0);
    // No function block is left from the film feed.
    assert_eq!(file.codes.read(1301, 61), Ok(0));
}

#[test]
fn a_mistake_in_every_line_is_told_in_every_line() {
    let text = r#"
[[record]]
number = 33
mode = "sideways"
target = "VTPOS 111"
velocity = "fast"
acceleration = "VTACC 0"
final_velocity = "VTVEL"
touch_probe = { window = "always" }
wait = { input = 33, level = "up" }
switch_before = { output = 17 }
branch_1 = 3
pieces = { count = "VTPCS 1" }
jump = "begin"
speed = 5

[[record]]
mode = "relative"
dwell = "VTTIME 1"
final_velocity = "VTVEL 2"

[[computed]]
variable = 60
base = 61
offset = 1.00001

[codes]
C1211 = 33
"#;
    assert_eq!(
        told(text),
        [
            "line 3: number: expected 1 to 32, got 33",
            "line 4: mode: expected absolute, relative, set reference or homing, got sideways",
            "line 5: target: expected VTPOS 1 to 110, got VTPOS 111",
            "line 6: velocity: expected \"v-max\" or \"VTVEL n\", got fast",
            "line 7: acceleration: expected VTACC 1 to 34, got VTACC 0",
            "line 8: final_velocity: expected VTVEL 1 to 34, got VTVEL",
            "line 9: window: expected \"travel range\" or two positions such as [\"VTPOS 3\", \"VTPOS 4\"]",
            "line 10: input: expected 1 to 32, got 33",
            "line 10: level: expected low or high, got up",
            "line 11: output: expected 1 to 16, got 17",
            "line 11: switch_before: `level` is missing",
            "line 12: branch_1: expected a table, got integer",
            "line 13: pieces: `to` is missing",
            "line 14: jump: expected a record number or \"end\"",
            "line 15: `speed` is unknown here; allowed are number, touch_probe, homing, mode, wait, switch_before, target, velocity, \
             acceleration, deceleration, final_velocity, without_touch, switch_after, dwell, branch_1, branch_2, pieces, jump",
            "line 17: the record has no `number`; expected 1 to 32",
            "line 19: dwell: a record that dwells must end at standstill, without `final_velocity`",
            "line 23: variable: expected 61 to 110, got 60",
            "line 24: base: expected 1 to 60, got 61",
            "line 25: offset: expected a number with at most 4 decimals, got 1.00001",
            "line 28: C1211: 33 is above 32",
        ]
    );
}

#[test]
fn jumps_that_lead_nowhere_and_doubled_records_are_told_at_their_record() {
    let text = r#"
[[record]]
number = 1
mode = "relative"
jump = 2
[[record]]
number = 1
mode = "relative"
without_touch = 9
"#;
    assert_eq!(
        told(text),
        [
            "line 3: record 1 goes on at record 2, which is not programmed",
            "line 7: record 1 goes on at record 9, which is not programmed",
            "line 7: record 1 is given twice",
        ]
    );
    assert_eq!(told(""), ["line 1: there is no [[record]]; a program has at least one"]);
    assert_eq!(
        told("record = 1"),
        ["line 1: record: expected tables headed [[record]], got integer"]
    );
}

#[test]
fn a_touch_probe_needs_a_motion() {
    let text = "[[record]]\nnumber = 1\nmode = \"set reference\"\ntouch_probe = {}\n";
    assert_eq!(
        told(text),
        ["line 3: mode: a record that sets the reference does not move and has no touch probe"]
    );
}

proptest! {
    /// Whatever is done to a good file: a program or mistakes with lines, never a panic.
    #[test]
    fn no_file_makes_the_reader_panic(place in 0_usize..1800, removed in 0_usize..40, inserted in "\\PC{0,12}") {
        let mut text: Vec<char> = FILM_FEED.chars().collect();
        let place = place.min(text.len());
        let end = (place + removed).min(text.len());
        text.splice(place..end, inserted.chars());
        let text: String = text.into_iter().collect();
        if let Err(error) = ProgramFile::read(&text, &CodeStore::thesis()) {
            let lines = text.lines().count() + 1;
            prop_assert!(!error.mistakes.is_empty());
            prop_assert!(error.mistakes.iter().all(|mistake| (1..=lines).contains(&mistake.line)), "{error}");
        }
    }
}
