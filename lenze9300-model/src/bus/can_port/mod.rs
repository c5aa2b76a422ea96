//! Ports to a CAN bus with a far end outside this program.
//!
//! | name | port |
//! |---|---|
//! | `can0`, `vcan0` | an interface of the Linux kernel (SocketCAN) |
//! | `slcan:/dev/ttyACM0@500` | an adapter that speaks the LAWICEL protocol, and the bit rate in kbit/s |
//! | `slcan:tcp://host:4001@500` | the same behind a serial-device server |
//!
//! The bit rate of an interface is set where the interface is set up, not here: `ip link set can0 up type can bitrate 500000`.
//!
//! The drive's system bus has 11-bit identifiers. Frames with 29 bits are foreign to it; a port passes them over.

mod error;
mod events;
mod name;
mod reopening;
mod serial;
pub mod slcan;
mod slcan_port;
#[cfg(target_os = "linux")]
mod socket;

use std::time::Duration;

pub use error::{CanPortError, CanPortErrorKind};
pub use name::{AnyCanPort, CanPortName, ParseCanPortNameError, open};
pub use reopening::ReopeningCanPort;
pub use serial::AdapterSerial;
pub use slcan_port::{Line, SlcanPort};
#[cfg(target_os = "linux")]
pub use socket::SocketCanPort;

use super::can::CanFrame;

/// A port to a CAN bus.
pub trait CanPort {
    /// Waits for a frame, at most `max_wait`; `None` when none came in time.
    ///
    /// It may return `None` early, when what came was no frame for a program: an error frame, a frame with a 29-bit identifier.
    ///
    /// # Errors
    ///
    /// [`CanPortError`]; after one of the kinds `Gone` and `Down` the port must be opened again.
    fn receive(&mut self, max_wait: Duration) -> Result<Option<CanFrame>, CanPortError>;

    /// Hands a frame to the bus. Returns before it has been sent.
    ///
    /// # Errors
    ///
    /// As [`receive`](Self::receive), and [`CanPortError::Full`] when the bus does not take the frames as fast as they come.
    fn send(&mut self, frame: &CanFrame) -> Result<(), CanPortError>;

    /// What happened to the bus since the last call, oldest first.
    fn poll_event(&mut self) -> Option<CanBusEvent>;
}

impl<P: CanPort + ?Sized> CanPort for Box<P> {
    fn receive(&mut self, max_wait: Duration) -> Result<Option<CanFrame>, CanPortError> {
        (**self).receive(max_wait)
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), CanPortError> {
        (**self).send(frame)
    }

    fn poll_event(&mut self) -> Option<CanBusEvent> {
        (**self).poll_event()
    }
}

/// The error state of a CAN controller.
///
/// Source: ISO 11898-1, fault confinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BusState {
    /// Both error counters are below 96.
    Active,
    /// One of them is 96 or more.
    Warning,
    /// One of them is 128 or more: the controller no longer destroys frames of others.
    Passive,
    /// The transmit counter went over 255: the controller neither sends nor receives.
    Off,
}

/// Something about the bus that its user should know.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CanBusEvent {
    /// The controller went into another error state.
    #[error("{}", state_text(.0))]
    State(BusState),
    /// Frames were lost because nobody took them in time.
    #[error("frames were lost: they came faster than they were read")]
    Overrun,
    /// The port cannot be used at present; it is opened again as soon as it can be.
    #[error("{0}; waiting for it")]
    Lost(CanPortError),
    /// It works again.
    #[error("{name} is back")]
    Back {
        /// The name of the port.
        name: String,
    },
}

const fn state_text(state: &BusState) -> &'static str {
    match state {
        BusState::Active => "the bus works",
        BusState::Warning => "the bus has errors (warning limit)",
        BusState::Passive => {
            "the bus has many errors (error passive): check bit rate, termination and whether another node is on"
        }
        BusState::Off => "bus off: check bit rate and wiring, then ip link set the interface down and up",
    }
}
