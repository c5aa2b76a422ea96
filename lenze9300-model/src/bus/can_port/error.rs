//! How a port to a CAN bus fails.

use std::io;

use dp_master::phy::{PortError, PortErrorKind};

/// Why a CAN port cannot be used: what is wrong, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CanPortError {
    /// Nothing has this name.
    #[error("{name}: no such interface; ip link lists those there are")]
    NoSuchInterface {
        /// The name given.
        name: String,
    },
    /// The interface is there but switched off.
    #[error("{name} is down: ip link set {name} up")]
    Down {
        /// The name given.
        name: String,
    },
    /// The interface was there and is no more.
    #[error("{name} was removed")]
    Removed {
        /// The name given.
        name: String,
    },
    /// The send queue is full: nobody acknowledges the frames, or they come faster than the bus carries them.
    #[error("{name} takes no more frames: is another node on, at the same bit rate?")]
    Full {
        /// The name given.
        name: String,
    },
    /// The adapter does not know this bit rate.
    #[error("the adapter at {name} refuses {kbit_s} kbit/s")]
    BitRateRefused {
        /// The name given.
        name: String,
        /// What was asked for.
        kbit_s: u32,
    },
    /// The adapter answered the command to open the bus with an error.
    #[error("the adapter at {name} does not open the bus; pull it and plug it in again")]
    NotOpened {
        /// The name given.
        name: String,
    },
    /// Interfaces are a matter of Linux.
    #[error("{name} needs Linux; elsewhere use slcan:PORT@KBIT")]
    NoSocketCan {
        /// The name given.
        name: String,
    },
    /// The line to the adapter.
    #[error(transparent)]
    Line(#[from] PortError),
    /// Anything else.
    #[error("{name}: {source}")]
    Io {
        /// The name given.
        name: String,
        /// The reason of the operating system.
        source: io::Error,
    },
}

/// What a program can do about a [`CanPortError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CanPortErrorKind {
    /// Wrong name.
    NotFound,
    /// Wait until somebody switches the interface on, and open it again.
    Down,
    /// Wait until it is there again, and open it again.
    Gone,
    /// Send later.
    Full,
    /// None of these.
    Other,
}

impl CanPortError {
    /// What can be done about it.
    #[must_use]
    pub const fn kind(&self) -> CanPortErrorKind {
        match self {
            Self::NoSuchInterface { .. } => CanPortErrorKind::NotFound,
            Self::Down { .. } => CanPortErrorKind::Down,
            Self::Removed { .. } => CanPortErrorKind::Gone,
            Self::Full { .. } => CanPortErrorKind::Full,
            Self::Line(error) => match error.kind() {
                PortErrorKind::Unplugged => CanPortErrorKind::Gone,
                PortErrorKind::NotFound => CanPortErrorKind::NotFound,
                _ => CanPortErrorKind::Other,
            },
            _ => CanPortErrorKind::Other,
        }
    }
}
