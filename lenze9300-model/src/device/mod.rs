//! The drive as a device: terminals, monitoring, the 1 ms task over the control loops, and what it shows outside.

mod drive;
mod fault;
mod memory;
mod monitor;
mod nonvolatile;
mod parameter_sets;
mod reference;
mod state_file;
mod utilisation;

pub use drive::{Drive, DriveConfig, DriveStatus, PositioningSignals, Terminals};
pub use fault::{Detection, Fault, Reaction};
pub use memory::{FaultEntry, FaultMemory};
pub use monitor::{FaultSet, Monitor, Restart};
pub use nonvolatile::{NonVolatile, SetNumber, SetNumberError};
pub use reference::FaultReference;
pub use state_file::{read_state_file, write_state_file};
