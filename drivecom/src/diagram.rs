//! The state diagram, drawn from the tables.

use core::fmt;

use crate::state::State;
use crate::transition::{DRIVE_MOVES, TRANSITIONS, Transition};

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
        writeln!(
            f,
            "    [*] --> {:?} : {} {}",
            transition.to, transition.id, transition.trigger
        )?;
    }
    for from in transition.from.iter() {
        writeln!(
            f,
            "    {from:?} --> {:?} : {} {}",
            transition.to, transition.id, transition.trigger
        )?;
    }
    Ok(())
}
