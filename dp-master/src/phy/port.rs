//! What a driver needs of a real line, and how such a line fails.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::time::Baud;

/// A line with a far end outside this program.
pub trait Port {
    /// Waits until octets arrive, at most `max_wait`, and returns how many were put to the front of `buf`; 0 when none came in time.
    ///
    /// # Errors
    ///
    /// [`PortError`]; the port is of no further use when its kind is [`PortErrorKind::Unplugged`].
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError>;

    /// Hands all octets to the line. Returns before the last bit has left.
    ///
    /// # Errors
    ///
    /// As [`receive`](Self::receive).
    fn send(&mut self, octets: &[u8]) -> Result<(), PortError>;

    /// The baud rate, from which the end of a transmission is computed.
    fn baud(&self) -> Baud;
}

/// Why a line cannot be used; one sentence with the path and the reason.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PortError {
    /// Nothing has this path.
    #[error("there is no port {}", .path.display())]
    NoSuchPort {
        /// The path given.
        path: PathBuf,
    },
    /// Something has this path, but it is no serial port.
    #[error("{} is no serial port", .path.display())]
    NotASerialPort {
        /// The path given.
        path: PathBuf,
    },
    /// Another program holds it.
    #[error("port {} is in use by another program", .path.display())]
    Busy {
        /// The path given.
        path: PathBuf,
    },
    /// This user may not open it.
    #[error("no permission to open port {}", .path.display())]
    Permission {
        /// The path given.
        path: PathBuf,
    },
    /// The adapter cannot run at this rate.
    #[error("port {} does not run at {wanted}, it offers {offered} bit/s", .path.display())]
    BaudRefused {
        /// The path given.
        path: PathBuf,
        /// What was asked for.
        wanted: Baud,
        /// What the adapter set instead, bits per second; 0 when it only refused.
        offered: u32,
    },
    /// The adapter was pulled, or the other end of a pseudo-terminal is gone.
    #[error("port {} is gone", .path.display())]
    Unplugged {
        /// Where it was.
        path: PathBuf,
    },
    /// The far end takes no octets.
    #[error("port {} takes no octets", .path.display())]
    Stuck {
        /// Where it is.
        path: PathBuf,
    },
    /// The name for a pseudo-terminal is taken by something else.
    #[error("{} exists and is no symbolic link, it is not overwritten", .path.display())]
    LinkTaken {
        /// The name given.
        path: PathBuf,
    },
    /// Anything else.
    #[error("port {}: {source}", .path.display())]
    Io {
        /// Where.
        path: PathBuf,
        /// The reason of the operating system.
        source: io::Error,
    },
}

/// What a program can do about a [`PortError`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum PortErrorKind {
    /// Wrong path or name.
    NotFound,
    /// Wait, or stop the other program.
    Busy,
    /// Ask for the right to use it.
    Permission,
    /// Choose another baud rate or adapter.
    Baud,
    /// Plug it in and open it again.
    Unplugged,
    /// None of these.
    Other,
}

impl PortError {
    /// What can be done about it.
    #[must_use]
    pub const fn kind(&self) -> PortErrorKind {
        match self {
            Self::NoSuchPort { .. } | Self::NotASerialPort { .. } | Self::LinkTaken { .. } => {
                PortErrorKind::NotFound
            }
            Self::Busy { .. } => PortErrorKind::Busy,
            Self::Permission { .. } => PortErrorKind::Permission,
            Self::BaudRefused { .. } => PortErrorKind::Baud,
            Self::Unplugged { .. } => PortErrorKind::Unplugged,
            Self::Stuck { .. } | Self::Io { .. } => PortErrorKind::Other,
        }
    }

    /// A failed read or write on an open port.
    pub(super) fn in_use(path: &Path, source: io::Error) -> Self {
        let path = path.to_path_buf();
        match source.kind() {
            // A pulled adapter hangs up (broken pipe) or gives EIO, ENXIO or ENODEV, which have no kind of their own and arrive as `Other`.
            io::ErrorKind::BrokenPipe
            | io::ErrorKind::Other
            | io::ErrorKind::NotFound
            | io::ErrorKind::UnexpectedEof => Self::Unplugged { path },
            io::ErrorKind::TimedOut => Self::Stuck { path },
            _ => Self::Io { path, source },
        }
    }
}

/// Whether a read or write should simply be tried again later.
pub(super) fn is_transient(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
    )
}
