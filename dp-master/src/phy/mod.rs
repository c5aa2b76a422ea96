//! Lines: what carries characters between stations.
//!
//! - [`VirtualBus`] carries them in virtual time, to the nanosecond and repeatably; [`pump`] runs stations on it.
//! - [`Disturbance`] and [`Script`] spoil characters on it, by chance or on purpose.
//! - [`Tap`] and [`TracedPort`] record what goes over a line, [`CaptureWriter`] and [`CaptureReader`] keep it in a file.
//! - [`SerialLine`] is a real adapter, [`TcpLine`] one behind a serial-device server, `PseudoTerminal` (Unix) one that exists on this machine
//!   only; each is a [`Port`]. [`open`] opens any of them by its [`PortName`], [`ReopeningPort`] opens it again when it was gone.
//! - [`request_real_time`] lets a station answer in time on a busy machine.

mod fault;
#[cfg_attr(
    not(all(
        target_os = "linux",
        any(
            target_arch = "x86",
            target_arch = "x86_64",
            target_arch = "arm",
            target_arch = "aarch64",
            target_arch = "riscv64"
        )
    )),
    path = "no_linux.rs"
)]
mod linux;
mod pcap;
mod police;
mod port;
mod port_name;
#[cfg(unix)]
mod pseudo_terminal;
mod real_time;
mod reopening;
mod rts_switch;
mod segment;
mod serial;
mod tcp;
mod tracer;
mod virtual_bus;

pub use fault::{Disturbance, DisturbanceError, Script};
pub use pcap::{CaptureError, CaptureReader, CaptureWriter, Packet};
pub use port::{Port, PortError, PortErrorKind, PortNote};
pub use port_name::{AnyPort, OpenPort, ParsePortNameError, PortName, open};
#[cfg(unix)]
pub use pseudo_terminal::PseudoTerminal;
pub use real_time::{RealTimeRefused, request_real_time};
pub use reopening::{PortEvent, ReopeningPort};
pub use segment::{next_wakeup, pump};
pub use serial::{
    Access, Echo, Gathering, ParseTransmitterError, Rts, RtsLevel, SerialLine, SerialOptions, Transmitter,
};
pub use tcp::TcpLine;
pub use tracer::{Content, Direction, Tap, Trace, TracedPort, Tracer};
pub use virtual_bus::{BusEvent, PortId, Rule, Statistics, Violation, VirtualBus};
