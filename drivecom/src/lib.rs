//! DRIVECOM profile 20, both sides: how a master and a drive talk about switching on, and about parameters.
//!
//! The profile puts two things on a cyclic bus: a control word that is answered by a status word, and a parameter
//! channel of eight octets each way. This crate holds both, for the drive and for the master, as plain structs
//! without I/O, clock or allocation. It knows neither the bus below nor the application above.
//!
//! # Map
//!
//! | layer | drive side | master side | both |
//! |---|---|---|---|
//! | words | | | [`ControlWord`], [`StatusWord`], [`ProcessData`], [`scaling`] |
//! | switching on | [`Machine`], [`AifControl`] | [`Sequencer`] | [`State`], [`Command`], [`TRANSITIONS`], [`StateDiagram`] |
//! | parameters | [`param::Server`] | [`param::Client`] | [`param::Frame`], [`param::Job`], [`CodeNumber`], [`FixedPoint`] |
//! | parameters, as a PLC does it | | [`petri::PARAMETER_NET`] | [`petri::Net`], [`petri::Marking`] |
//!
//! # Example
//!
//! A master walks a drive to *operation enabled*; the two exchange their words once per bus cycle.
//!
//! ```
//! use drivecom::{Conditions, ControlWord, Machine, Progress, Sequencer, State, StatusInputs, StatusWord, Target};
//!
//! let mut drive = Machine::new();
//! let mut master = Sequencer::new();
//! let inputs = StatusInputs { remote: true, ..StatusInputs::default() };
//!
//! let mut status = StatusWord(0);
//! let mut cycles = 0;
//! while master.progress() != Progress::Reached {
//!     let control = master.step(Target::OperationEnabled, status);
//!     drive.step(control, Conditions::HEALTHY);
//!     status = drive.status_word(inputs);
//!     cycles += 1;
//! }
//! assert_eq!((drive.state(), status), (State::OperationEnabled, StatusWord(0x0237)));
//! assert_eq!(cycles, 5);
//! ```
//!
//! # What is left out
//!
//! The profile's velocity mode (ramp generator, set-value processing) and the codes of any particular drive. The bits
//! above bit 7 are named as the 9300 position controller uses them; other drives can ignore the names.
#![cfg_attr(not(feature = "std"), no_std)]

mod aif;
mod bits;
mod code;
mod command;
mod control_word;
mod diagram;
mod fixed_point;
mod machine;
pub mod param;
pub mod petri;
mod process_data;
pub mod scaling;
mod sequencer;
mod state;
mod status_word;
mod transition;

pub use aif::AifControl;
pub use code::{CodeNumber, Subcode};
pub use command::{Command, CommandSet, ResetEdge};
pub use control_word::ControlWord;
pub use diagram::StateDiagram;
pub use fixed_point::{FixedPoint, ParseFixedPointError};
pub use machine::{Conditions, Machine, StatusInputs, Step};
pub use process_data::ProcessData;
pub use sequencer::{Progress, Sequencer, Target};
pub use state::{Pattern, State, StateSet};
pub use status_word::StatusWord;
pub use transition::{DRIVE_MOVES, DriveMove, Event, Hold, TRANSITIONS, Transition, TransitionId, Trigger};
