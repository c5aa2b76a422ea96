//! The positioning program: records, profile generator, touch probe, jog.
//!
//! [`Traverse::tick_1ms`] is the whole task: levels, actual position and codes in; set-values, status and events out.
//! Below it, [`Plan`] turns a target into a motion in closed form and [`Resolution`] turns lengths into increments with
//! integers only. [`film_feed_program`] is the built-in program.
//!
//! Not modelled: skip record and record selection (9300 facts 4.2: details not found).

mod active_plan;
mod film_feed;
mod homing;
mod interpolator;
mod jog;
mod program_file;
mod record;
mod resolution;
mod s_curve;
mod sequencer;
mod signals;
mod start_gate;
mod touch_probe;
mod variables;

pub use film_feed::film_feed_program;
pub use homing::{Direction, HomingReference, HomingRule};
pub use interpolator::{Limits, Motion, PathState, Plan, Profile};
pub use jog::{JogDirection, JogParameters};
pub use program_file::ProgramFile;
pub use record::{
    Acceleration, Branch, FinalVelocity, InputLevel, Level, Mode, OutputLevel, Pieces, Program, ProgramError,
    ProgramInput, Record, RecordNumber, ResidualPath, Successor, Target, TouchRule, TouchWindow, Velocity,
};
pub use resolution::{INCREMENTS_PER_REVOLUTION, Residue, Resolution, Rounding};
pub use sequencer::{Traverse, TraverseParameters};
pub use signals::{Override, RecordFault, Setpoint, StartRefusal, TraverseEvent, TraverseInputs, TraverseStatus};
pub use touch_probe::{ActiveEdge, LatchMode, TouchEvent, TouchProbe};
