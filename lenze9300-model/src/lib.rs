//! A Lenze 9300 servo position controller with its PROFIBUS module, as a model.
//!
//! From the shaft upwards:
//!
//! | module | what it holds |
//! |---|---|
//! | [`units`] | types at the borders of the crate |
//! | [`plant`] | physics: mains, DC link, inverter, motor, shaft, resolver |
//! | [`control`] | sampled loops: position, speed, current, and their tuning |
//! | [`Axis`] | plant and loops together, tick by tick |
//! | [`response`] | step responses and open loops of the axis |
//! | [`code`] | the codes, their ranges and the negative answers |
//! | [`traverse`] | the positioning program with its profile generator |
//! | [`device`] | the drive: terminals, monitoring, the 1 ms task |
//! | [`signal`], [`scope`] | the signals by name, and the oscilloscope |
//! | [`bus`] | EMF2133IB, the PROFIBUS module |
//! | [`noise`] | counter-based noise |
//! | [`toml_file`] | the reader of all files that people write |
//!
//! Everything is sans-I/O: levels and values in, set-values and events out, time as ticks of the fastest task.
//!
//! ```
//! use lenze9300_model::{Axis, AxisCommand, AxisParams, units::Rpm};
//!
//! let mut axis = Axis::new(&AxisParams::default());
//! for _ in 0..8000 {
//!     axis.tick(AxisCommand::Speed { omega_ref: Rpm(1000.0).to_rad_s(), torque_ff: 0.0 });
//! }
//! assert!((Rpm::from_rad_s(axis.sample().omega_meas).0 - 1000.0).abs() < 2.0);
//! ```

pub mod access;
mod axis;
pub mod bus;
pub mod code;
pub mod control;
pub mod device;
pub mod noise;
pub mod picture;
pub mod plant;
pub mod response;
pub mod scope;
pub mod signal;
pub mod table;
pub mod toml_file;
pub mod traverse;
pub mod units;

pub use axis::{
    Axis, AxisBatch, AxisCommand, AxisParams, AxisSample, BatchError, ControllerCodes, GainScaling, Pulses, TICK_NS,
    TICKS_PER_MS, TICKS_PER_SPEED_PERIOD,
};
pub use toml_file::{FileError, FileMistake};
