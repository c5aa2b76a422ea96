//! The traversing program of the film feed.

use super::record::{
    Acceleration, Branch, FinalVelocity, InputLevel, Level, Mode, Program, ProgramInput, Record, RecordNumber,
    ResidualPath, Successor, Target, TouchRule, TouchWindow, Velocity,
};

/// The records 01 to 04 of the film feed.
///
/// | record | mode | target | velocity | final velocity | then |
/// |---|---|---|---|---|---|
/// | 01 | set reference | zero | v-max | standstill | PFI 01 high → 03, else 02 |
/// | 02 | relative | VTPOS 001 | VTVEL 01 | standstill | end |
/// | 03 | relative | VTPOS 061 = VTPOS 001 − 100 mm | VTVEL 01 | VTVEL 02 | 04 |
/// | 04 | relative, touch probe, rest 50 mm | VTPOS 062 = VTPOS 001 + 100 mm | VTVEL 02 | standstill | end |
///
/// Interpretation: record 03 aims at the computed variable 061 of thesis fig. 68, not at C1301/2 of its text, which
/// nobody writes. Interpretation: "tolerance + one whole feed length" of record 04 is the whole tolerance band, 100 mm,
/// plus VTPOS 001; with 1200 mm the search ends 2400 mm after the start, so that a mark missed at 1100 mm is followed
/// by one at 2300 mm at the latest. Source: film-feed specification, section 6; thesis fig. 66–69.
#[doc(alias = "Folienvorzug")]
pub fn film_feed_program() -> Program {
    let [choose, plain, travel, search] = [1, 2, 3, 4];
    let successor = |number| RecordNumber::new(number).map_or(Successor::End, Successor::Record);
    let moving = |mode, target, velocity| Record {
        velocity: Velocity::Variable(velocity),
        acceleration: Acceleration::Variable(1),
        deceleration: Acceleration::Variable(1),
        ..Record::new(mode, Target::Variable(target))
    };
    let touch = TouchRule {
        window: TouchWindow::TravelRange,
        residual: ResidualPath::Fixed(RESIDUAL_E4),
    };
    let printed = InputLevel {
        input: ProgramInput::PFI01,
        level: Level::High,
    };
    let records = [
        (
            choose,
            Record {
                branch_1: Some(Branch {
                    when: printed,
                    to: successor(travel),
                }),
                jump: successor(plain),
                ..Record::new(Mode::SetReference, Target::Zero)
            },
        ),
        (plain, moving(Mode::Relative, 1, 1)),
        (
            travel,
            Record {
                final_velocity: FinalVelocity::Variable(2),
                jump: successor(search),
                ..moving(Mode::Relative, 61, 1)
            },
        ),
        (search, moving(Mode::RelativeWithTouchProbe(touch), 62, 2)),
    ];
    Program::new(records).expect("the built-in program is checked by a test")
}

/// 50 mm after the mark, so that the film never has to run backwards.
const RESIDUAL_E4: i32 = 50_0000;
