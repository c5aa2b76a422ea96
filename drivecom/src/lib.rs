//! DRIVECOM profile 20, both sides.
#![cfg_attr(not(feature = "std"), no_std)]

mod aif;
mod bits;
mod command;
mod control_word;
mod diagram;
mod machine;
pub mod petri;
mod sequencer;
mod state;
mod status_word;
mod transition;

pub use aif::AifControl;
pub use command::{Command, CommandSet, ResetEdge};
pub use control_word::ControlWord;
pub use diagram::StateDiagram;
pub use machine::{Conditions, Machine, StatusInputs, Step};
pub use sequencer::{Progress, Sequencer, Target};
pub use state::{Pattern, State, StateSet};
pub use status_word::StatusWord;
pub use transition::{
    DRIVE_MOVES, DriveMove, Event, Hold, TRANSITIONS, Transition, TransitionId, Trigger,
};
