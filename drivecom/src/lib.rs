//! DRIVECOM profile 20, both sides.
#![cfg_attr(not(feature = "std"), no_std)]

mod bits;
mod control_word;
pub mod petri;
mod state;
mod status_word;

pub use control_word::ControlWord;
pub use state::{Pattern, State, StateSet};
pub use status_word::StatusWord;
