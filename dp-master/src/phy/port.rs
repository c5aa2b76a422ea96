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

impl<P: Port + ?Sized> Port for Box<P> {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        (**self).receive(buf, max_wait)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        (**self).send(octets)
    }

    fn baud(&self) -> Baud {
        (**self).baud()
    }
}

/// Something about an open port that its user should know; one sentence. The port works.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PortNote {
    /// The adapter keeps octets back.
    #[error("the adapter keeps octets for up to {millis} ms, write 1 to {} to make it quick", .setting.display())]
    LatencyTimer {
        /// The file with the setting.
        setting: PathBuf,
        /// Its value in milliseconds.
        millis: u32,
    },
    /// The driver did not say that it set even parity. Some never do, though the characters are right.
    #[error("the driver of {} does not confirm even parity; if nobody answers, try another adapter", .path.display())]
    ParityNotConfirmed {
        /// The path given.
        path: PathBuf,
    },
}

impl PortNote {
    /// A note if this file of an FTDI adapter names more than 1 ms.
    pub(super) fn latency_timer(setting: &Path) -> Option<Self> {
        let millis = std::fs::read_to_string(setting).ok()?.trim().parse().ok()?;
        (millis > 1).then(|| Self::LatencyTimer {
            setting: setting.to_path_buf(),
            millis,
        })
    }
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
    /// The driver cannot switch the transmitter.
    #[error("the driver of port {} has no RS485 mode ({source}); let the adapter or the program switch the transmitter", .path.display())]
    NoRs485 {
        /// The path given.
        path: PathBuf,
        /// The reason of the operating system.
        source: io::Error,
    },
    /// Nobody answers at this address of the network.
    #[error("{} cannot be reached: {source}", .path.display())]
    Unreachable {
        /// The address given, as `tcp://host:port`.
        path: PathBuf,
        /// The reason of the operating system.
        source: io::Error,
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
    /// Look for the server of the serial device, or for a firewall.
    Unreachable,
    /// None of these.
    Other,
}

impl PortError {
    /// What can be done about it.
    #[must_use]
    pub const fn kind(&self) -> PortErrorKind {
        match self {
            Self::NoSuchPort { .. } | Self::NotASerialPort { .. } | Self::LinkTaken { .. } => PortErrorKind::NotFound,
            Self::Busy { .. } => PortErrorKind::Busy,
            Self::Permission { .. } => PortErrorKind::Permission,
            Self::BaudRefused { .. } => PortErrorKind::Baud,
            Self::Unplugged { .. } => PortErrorKind::Unplugged,
            Self::Unreachable { .. } => PortErrorKind::Unreachable,
            Self::Stuck { .. } | Self::NoRs485 { .. } | Self::Io { .. } => PortErrorKind::Other,
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
            | io::ErrorKind::UnexpectedEof
            // Nothing more is taken.
            | io::ErrorKind::WriteZero
            // What a closed connection to a serial-device server gives.
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionAborted
            | io::ErrorKind::NotConnected => Self::Unplugged { path },
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latency_timer_above_a_millisecond_is_told_with_the_file_that_sets_it() {
        let setting = std::env::temp_dir().join(format!("dp-master-latency-timer-{}", std::process::id()));
        std::fs::write(&setting, "16\n").unwrap();
        let note = PortNote::latency_timer(&setting).unwrap();
        assert_eq!(
            note.to_string(),
            format!(
                "the adapter keeps octets for up to 16 ms, write 1 to {} to make it quick",
                setting.display()
            )
        );
        std::fs::write(&setting, "1\n").unwrap();
        assert_eq!(PortNote::latency_timer(&setting), None);
        std::fs::remove_file(&setting).unwrap();
        assert_eq!(
            PortNote::latency_timer(&setting),
            None,
            "an adapter without such a timer"
        );
    }

    #[test]
    fn each_error_says_what_can_be_done() {
        let path = || PathBuf::from("/dev/x");
        let source = || io::Error::other("why");
        let cases = [
            (PortError::NoSuchPort { path: path() }, PortErrorKind::NotFound),
            (PortError::NotASerialPort { path: path() }, PortErrorKind::NotFound),
            (PortError::LinkTaken { path: path() }, PortErrorKind::NotFound),
            (PortError::Busy { path: path() }, PortErrorKind::Busy),
            (PortError::Permission { path: path() }, PortErrorKind::Permission),
            (
                PortError::BaudRefused {
                    path: path(),
                    wanted: Baud::B45450,
                    offered: 38_400,
                },
                PortErrorKind::Baud,
            ),
            (PortError::Unplugged { path: path() }, PortErrorKind::Unplugged),
            (
                PortError::Unreachable {
                    path: path(),
                    source: source(),
                },
                PortErrorKind::Unreachable,
            ),
            (PortError::Stuck { path: path() }, PortErrorKind::Other),
            (
                PortError::NoRs485 {
                    path: path(),
                    source: source(),
                },
                PortErrorKind::Other,
            ),
            (
                PortError::Io {
                    path: path(),
                    source: source(),
                },
                PortErrorKind::Other,
            ),
        ];
        for (error, kind) in cases {
            assert_eq!(error.kind(), kind, "{error}");
            assert!(error.to_string().contains("/dev/x"), "{error}");
        }
    }

    /// A pulled USB adapter gives EIO, ENXIO or ENODEV, a closed pseudo-terminal a broken pipe, a closed connection its own kinds.
    #[test]
    fn what_a_read_or_write_says_is_gone_stuck_or_something_else() {
        use io::ErrorKind::{
            BrokenPipe, ConnectionAborted, ConnectionReset, InvalidInput, NotConnected, NotFound, Other, TimedOut,
            UnexpectedEof, WriteZero,
        };
        let kind_of = |kind| PortError::in_use(Path::new("/dev/x"), io::Error::from(kind));
        for kind in [
            BrokenPipe,
            Other,
            NotFound,
            UnexpectedEof,
            WriteZero,
            ConnectionReset,
            ConnectionAborted,
            NotConnected,
        ] {
            assert!(matches!(kind_of(kind), PortError::Unplugged { .. }), "{kind}");
        }
        assert!(matches!(kind_of(TimedOut), PortError::Stuck { .. }));
        assert!(matches!(kind_of(InvalidInput), PortError::Io { .. }));
    }

    #[test]
    fn a_read_that_was_only_early_is_tried_again() {
        use io::ErrorKind::{BrokenPipe, Interrupted, TimedOut, WouldBlock};
        for (kind, again) in [
            (TimedOut, true),
            (WouldBlock, true),
            (Interrupted, true),
            (BrokenPipe, false),
        ] {
            assert_eq!(is_transient(&io::Error::from(kind)), again, "{kind}");
        }
    }
}
