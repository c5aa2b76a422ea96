//! Lines: what carries characters between stations.
//!
//! - [`VirtualBus`] carries them in virtual time, to the nanosecond and repeatably; [`pump`] runs stations on it.
//! - [`Disturbance`] and [`Script`] spoil characters on it, by chance or on purpose.

mod fault;
mod police;
mod segment;
mod virtual_bus;

pub use fault::{Disturbance, DisturbanceError, Script};
pub use segment::{next_wakeup, pump};
pub use virtual_bus::{BusEvent, PortId, Rule, Statistics, Violation, VirtualBus};
