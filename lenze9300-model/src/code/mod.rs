//! The drive's codes: what the parameter channel, the keypad and the system bus read and write.
//!
//! [`table`] declares every code once; ranges, messages and factory values derive from it. [`CodeStore`] holds the
//! values, [`CodeError`] is the negative answer. A code that is not in the table does not exist (error 6/7/0000), so
//! that nobody relies on an invented number.
//!
//! Values are signed 32-bit fixed point with four decimals (×10000), as the bus carries them, unless the table says
//! [`Form::Plain`]. Source: 9300 facts 3.2, 3.3, 3.4, 4.4.

mod error;
mod motor_list;
mod parameter_file;
mod reference;
mod store;
pub mod table;

pub use error::{CodeError, ErrorReply};
pub use motor_list::{MOTOR_LIST, MotorEntry};
pub(crate) use parameter_file::write_codes;
pub use parameter_file::{read_code_table, read_parameter_file, read_parameter_settings, write_parameter_file};
pub use reference::CodeReference;
pub(crate) use store::FIRST_WIRED;
pub use store::{CodeStore, Difference, Inhibit, WIRED_POSITIONS, WiredPosition, WriteEffect};
pub use table::{CODE_TABLE, CodeEntry, Concern, DataLength, Domain, Effect, Form, Kind, Writable, entry};
