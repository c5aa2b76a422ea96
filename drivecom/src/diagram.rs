//! The state diagram, drawn from the tables.

use core::fmt;

use crate::state::State;
use crate::transition::{DRIVE_MOVES, TRANSITIONS, Transition, TransitionId};

/// Prints the machine as a Mermaid state diagram: one arrow per origin of every row.
///
/// `docs/states.mmd` is this print-out; a test compares the two, so the picture cannot drift from the table.
#[derive(Debug, Clone, Copy, Default)]
pub struct StateDiagram;

impl fmt::Display for StateDiagram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "stateDiagram-v2")?;
        for state in State::ALL {
            writeln!(f, "    {state:?} : {state}")?;
        }
        for transition in &TRANSITIONS {
            arrows(f, transition)?;
        }
        for transition in &DRIVE_MOVES {
            arrows(f, transition)?;
        }
        Ok(())
    }
}

fn arrows(f: &mut fmt::Formatter<'_>, transition: &Transition) -> fmt::Result {
    if transition.from.iter().next().is_none() {
        writeln!(f, "    [*] --> {:?} : {}", transition.to, Label(transition))?;
    }
    for from in transition.from.iter() {
        writeln!(f, "    {from:?} --> {:?} : {}", transition.to, Label(transition))?;
    }
    Ok(())
}

// `7 quick stop | disable voltage`; the drive's own moves are named after their trigger already.
struct Label<'a>(&'a Transition);

impl fmt::Display for Label<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0.id {
            TransitionId::Profile(number) => write!(f, "{number} {}", self.0.trigger),
            TransitionId::Drive(drive_move) => write!(f, "({})", drive_move.name()),
        }
    }
}
