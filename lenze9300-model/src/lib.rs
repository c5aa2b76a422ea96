//! A Lenze 9300 servo position controller as a model.
//!
//! - [`code`]: the codes, their ranges and the negative answers;
//! - [`traverse`]: the positioning program with its profile generator.
//!
//! Everything is sans-I/O: levels and values in, set-values and events out, time as ticks of the fastest task.

pub mod code;
pub mod traverse;
