//! Ports by name, so that every program takes the same `--port`.
//!
//! | name | port |
//! |---|---|
//! | `/dev/ttyUSB0`, `COM3` | a serial adapter, or the far end of a pseudo-terminal |
//! | `tcp://192.168.0.7:4001` | a serial-device server |
//! | `pty:/tmp/line` | a new pseudo-terminal whose far end is linked there (Unix) |

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use super::port::{Port, PortError, PortNote};
#[cfg(unix)]
use super::pseudo_terminal::PseudoTerminal;
use super::serial::{SerialLine, SerialOptions};
use super::tcp::TcpLine;
use crate::time::Baud;

/// Which port.
///
/// # Example
///
/// ```
/// use dp_master::phy::PortName;
///
/// let name: PortName = "tcp://192.168.0.7:4001".parse().unwrap();
/// assert_eq!(name, PortName::Tcp("192.168.0.7:4001".to_owned()));
/// assert!("tcp://192.168.0.7".parse::<PortName>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum PortName {
    /// A serial device by its path.
    Serial(PathBuf),
    /// A serial-device server, `host:port`.
    Tcp(String),
    /// A pseudo-terminal to be made, and the name for its far end.
    PseudoTerminal(PathBuf),
}

impl FromStr for PortName {
    type Err = ParsePortNameError;

    /// # Errors
    ///
    /// [`ParsePortNameError`] for an empty name, a server without a port number and a scheme that is none of the three.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if let Some(address) = text.strip_prefix("tcp://") {
            let port = address.rsplit_once(':').filter(|(host, _)| !host.is_empty());
            return match port.map(|(_, port)| port.parse::<u16>()) {
                Some(Ok(1..)) => Ok(Self::Tcp(address.to_owned())),
                _ => Err(ParsePortNameError::NoTcpPort { got: text.to_owned() }),
            };
        }
        if let Some(link) = text.strip_prefix("pty:") {
            return match link {
                "" => Err(ParsePortNameError::Empty),
                link => Ok(Self::PseudoTerminal(link.into())),
            };
        }
        match text {
            "" => Err(ParsePortNameError::Empty),
            text if text.contains("://") => Err(ParsePortNameError::Scheme { got: text.to_owned() }),
            path => Ok(Self::Serial(path.into())),
        }
    }
}

impl fmt::Display for PortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path) => write!(f, "{}", path.display()),
            Self::Tcp(address) => write!(f, "tcp://{address}"),
            Self::PseudoTerminal(link) => write!(f, "pty:{}", link.display()),
        }
    }
}

/// Why a text names no port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParsePortNameError {
    /// Nothing was named.
    #[error("a port is needed, such as /dev/ttyUSB0, tcp://host:4001 or pty:/tmp/line")]
    Empty,
    /// A server without a port number.
    #[error("{got} is no server, tcp://host:port with a port of 1…65535 is needed")]
    NoTcpPort {
        /// The text given.
        got: String,
    },
    /// A scheme that is unknown.
    #[error("{got} is no port, allowed are a path such as /dev/ttyUSB0, tcp://host:port and pty:LINK")]
    Scheme {
        /// The text given.
        got: String,
    },
}

/// A port of any kind.
pub type AnyPort = Box<dyn Port + Send>;

/// An open port and what its user should know about it.
pub struct OpenPort<P = AnyPort> {
    /// The port.
    pub port: P,
    /// What should be told.
    pub notes: Vec<PortNote>,
    /// Where the far end of a new pseudo-terminal is.
    pub far_end: Option<PathBuf>,
}

impl<P> fmt::Debug for OpenPort<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OpenPort")
            .field("notes", &self.notes)
            .field("far_end", &self.far_end)
            .finish_non_exhaustive()
    }
}

/// Opens a port of any kind. `serial` is for serial devices only.
///
/// # Errors
///
/// [`PortError`], as [`SerialLine::open`], [`TcpLine::connect`] and `PseudoTerminal::open` say.
pub fn open(name: &PortName, baud: Baud, serial: SerialOptions) -> Result<OpenPort, PortError> {
    match name {
        PortName::Serial(path) => {
            let line = SerialLine::open(path, baud, serial)?;
            Ok(OpenPort {
                notes: line.notes().to_vec(),
                port: Box::new(line),
                far_end: None,
            })
        }
        PortName::Tcp(address) => Ok(OpenPort {
            port: Box::new(TcpLine::connect(address, baud, CONNECT_TIMEOUT)?),
            notes: Vec::new(),
            far_end: None,
        }),
        #[cfg(unix)]
        PortName::PseudoTerminal(link) => {
            let (mut port, far_end) = PseudoTerminal::open(baud)?;
            port.link(link)?;
            Ok(OpenPort {
                port: Box::new(port),
                notes: Vec::new(),
                far_end: Some(far_end),
            })
        }
        #[cfg(not(unix))]
        PortName::PseudoTerminal(link) => Err(PortError::NoSuchPort { path: link.clone() }),
    }
}

/// How long a server may take to accept a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_what_it_was_written_as() {
        for (text, name) in [
            ("/dev/ttyUSB0", PortName::Serial("/dev/ttyUSB0".into())),
            ("COM3", PortName::Serial("COM3".into())),
            ("tcp://moxa:4001", PortName::Tcp("moxa:4001".into())),
            ("tcp://[::1]:4001", PortName::Tcp("[::1]:4001".into())),
            ("pty:/tmp/line", PortName::PseudoTerminal("/tmp/line".into())),
        ] {
            assert_eq!(text.parse(), Ok(name.clone()), "{text}");
            assert_eq!(name.to_string(), text);
        }
    }

    #[test]
    fn what_names_no_port_says_what_is_allowed() {
        for (text, message) in [
            (
                "",
                "a port is needed, such as /dev/ttyUSB0, tcp://host:4001 or pty:/tmp/line",
            ),
            (
                "pty:",
                "a port is needed, such as /dev/ttyUSB0, tcp://host:4001 or pty:/tmp/line",
            ),
            (
                "tcp://moxa",
                "tcp://moxa is no server, tcp://host:port with a port of 1…65535 is needed",
            ),
            (
                "tcp://moxa:0",
                "tcp://moxa:0 is no server, tcp://host:port with a port of 1…65535 is needed",
            ),
            (
                "tcp://:4001",
                "tcp://:4001 is no server, tcp://host:port with a port of 1…65535 is needed",
            ),
            (
                "udp://moxa:4001",
                "udp://moxa:4001 is no port, allowed are a path such as /dev/ttyUSB0, tcp://host:port and pty:LINK",
            ),
        ] {
            assert_eq!(text.parse::<PortName>().unwrap_err().to_string(), message, "{text}");
        }
    }

    #[test]
    fn an_open_port_is_shown_with_what_is_known_about_it() {
        let open = OpenPort {
            port: (),
            notes: vec![PortNote::ParityNotConfirmed { path: "COM3".into() }],
            far_end: None,
        };
        assert_eq!(
            format!("{open:?}"),
            r#"OpenPort { notes: [ParityNotConfirmed { path: "COM3" }], far_end: None, .. }"#
        );
    }
}
