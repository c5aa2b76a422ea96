//! CAN ports by name, so that every command takes the same `--can`.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use dp_master::phy::{ParsePortNameError, PortName, TcpLine};
use dp_master::time::Baud;

use super::slcan::BitRate;
use super::{AdapterSerial, CanPort, CanPortError, SlcanPort};

/// Which CAN port.
///
/// # Example
///
/// ```
/// use lenze9300_model::bus::can_port::CanPortName;
///
/// let name: CanPortName = "slcan:/dev/ttyACM0@500".parse().unwrap();
/// assert_eq!(name.to_string(), "slcan:/dev/ttyACM0@500");
/// assert!("slcan:/dev/ttyACM0@501".parse::<CanPortName>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum CanPortName {
    /// An interface of the Linux kernel.
    Interface(String),
    /// An adapter behind a line.
    Slcan {
        /// The line; not a pseudo-terminal to be made.
        line: PortName,
        /// The bit rate of the bus; 500 kbit/s, the drive's factory setting, when none is given.
        rate: BitRate,
    },
}

impl FromStr for CanPortName {
    type Err = ParseCanPortNameError;

    /// # Errors
    ///
    /// [`ParseCanPortNameError`].
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let Some(line) = text.strip_prefix("slcan:") else {
            // Names of interfaces have at most 15 characters and neither slash nor colon (linux/if.h, `dev_valid_name`).
            let valid =
                (1..=15).contains(&text.len()) && !text.contains(['/', ':']) && !text.contains(char::is_whitespace);
            return match valid {
                true => Ok(Self::Interface(text.to_owned())),
                false => Err(ParseCanPortNameError::NoInterface { got: text.to_owned() }),
            };
        };
        let (line, rate) = line.rsplit_once('@').unwrap_or((line, "500"));
        let rate = rate
            .parse()
            .ok()
            .and_then(BitRate::from_kbit_s)
            .ok_or_else(|| ParseCanPortNameError::BitRate { got: rate.to_owned() })?;
        match line.parse()? {
            PortName::PseudoTerminal(_) => Err(ParseCanPortNameError::NoInterface { got: text.to_owned() }),
            line => Ok(Self::Slcan { line, rate }),
        }
    }
}

impl fmt::Display for CanPortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Interface(name) => f.write_str(name),
            Self::Slcan { line, rate } => write!(f, "slcan:{line}@{}", rate.kbit_s()),
        }
    }
}

/// Why a text names no CAN port.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseCanPortNameError {
    /// Neither an interface nor an adapter.
    #[error(
        "{got} is no CAN port, allowed are an interface such as can0, slcan:/dev/ttyACM0@500 and slcan:tcp://host:4001@500"
    )]
    NoInterface {
        /// The text given.
        got: String,
    },
    /// A bit rate the protocol has no command for.
    #[error("{got} is no bit rate, allowed are 10, 20, 50, 100, 125, 250, 500, 800 and 1000 kbit/s")]
    BitRate {
        /// The text given.
        got: String,
    },
    /// The line of an adapter.
    #[error(transparent)]
    Line(#[from] ParsePortNameError),
}

/// A CAN port of any kind.
pub type AnyCanPort = Box<dyn CanPort + Send>;

/// Opens a CAN port of any kind.
///
/// # Errors
///
/// [`CanPortError`].
pub fn open(name: &CanPortName) -> Result<AnyCanPort, CanPortError> {
    match name {
        #[cfg(target_os = "linux")]
        CanPortName::Interface(interface) => Ok(Box::new(super::SocketCanPort::open(interface)?)),
        #[cfg(not(target_os = "linux"))]
        CanPortName::Interface(interface) => Err(CanPortError::NoSocketCan {
            name: interface.clone(),
        }),
        CanPortName::Slcan { line, rate } => match line {
            PortName::Tcp(address) => {
                // The rate is that of the server's serial side and computes nothing here.
                let line = TcpLine::connect(address, Baud::B500000, CONNECT_TIMEOUT)?;
                Ok(Box::new(SlcanPort::open(line, name.to_string(), *rate)?))
            }
            PortName::Serial(path) | PortName::PseudoTerminal(path) => {
                let line = AdapterSerial::open(path)?;
                Ok(Box::new(SlcanPort::open(line, name.to_string(), *rate)?))
            }
        },
    }
}

/// How long a server may take to accept a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
