//! Lines: what carries characters between stations.
//!
//! - [`VirtualBus`] carries them in virtual time, to the nanosecond and repeatably; [`pump`] runs stations on it.
//! - [`Disturbance`] and [`Script`] spoil characters on it, by chance or on purpose.
//! - [`Tap`] and [`TracedPort`] record what goes over a line, [`CaptureWriter`] and [`CaptureReader`] keep it in a file.
//! - [`SerialLine`] is a real adapter, `PseudoTerminal` (Unix) one that exists on this machine only; both are a [`Port`].

mod fault;
mod pcap;
mod police;
mod port;
#[cfg(unix)]
mod pseudo_terminal;
mod segment;
mod serial;
mod tracer;
mod virtual_bus;

pub use fault::{Disturbance, DisturbanceError, Script};
pub use pcap::{CaptureError, CaptureReader, CaptureWriter, Packet};
pub use port::{Port, PortError, PortErrorKind};
#[cfg(unix)]
pub use pseudo_terminal::PseudoTerminal;
pub use segment::{next_wakeup, pump};
pub use serial::{Access, Echo, Rts, SerialLine, SerialOptions};
pub use tracer::{Content, Direction, Tap, Trace, TracedPort, Tracer};
pub use virtual_bus::{BusEvent, PortId, Rule, Statistics, Violation, VirtualBus};
