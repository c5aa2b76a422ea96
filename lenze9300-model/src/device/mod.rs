//! The drive as a device: terminals, monitoring, the 1 ms task over the control loops, and what it shows outside.

mod drive;
mod fault;
mod monitor;

pub use drive::{Drive, DriveConfig, DriveStatus, Terminals};
pub use fault::{Fault, Reaction};
pub use monitor::{FaultSet, Monitor, Restart};
