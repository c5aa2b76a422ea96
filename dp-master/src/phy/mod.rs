//! Lines: what carries characters between stations.
//!
//! - [`VirtualBus`] carries them in virtual time, to the nanosecond and repeatably; [`pump`] runs stations on it.
//! - [`Disturbance`] and [`Script`] spoil characters on it, by chance or on purpose.
//! - [`SerialLine`] is a real adapter, `PseudoTerminal` (Unix) one that exists on this machine only; both are a [`Port`].

mod fault;
mod police;
mod port;
#[cfg(unix)]
mod pseudo_terminal;
mod segment;
mod serial;
mod virtual_bus;

pub use fault::{Disturbance, DisturbanceError, Script};
pub use port::{Port, PortError, PortErrorKind};
#[cfg(unix)]
pub use pseudo_terminal::PseudoTerminal;
pub use segment::{next_wakeup, pump};
pub use serial::{Access, Echo, Rts, SerialLine, SerialOptions};
pub use virtual_bus::{BusEvent, PortId, Rule, Statistics, Violation, VirtualBus};
