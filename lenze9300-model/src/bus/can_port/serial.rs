//! A serial adapter: 115.2 kbit/s, eight data bits, no parity. Those on USB take any setting.

use std::io::{ErrorKind, Read, Write};
use std::path::PathBuf;
use std::time::Duration;

use dp_master::phy::PortError;
use serialport::{DataBits, Parity, SerialPort, StopBits};

use super::Line;

/// The serial port of an slcan adapter, or the far end of a pseudo-terminal.
pub struct AdapterSerial {
    port: Box<dyn SerialPort>,
    path: PathBuf,
}

impl std::fmt::Debug for AdapterSerial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AdapterSerial")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

impl AdapterSerial {
    /// Opens it.
    ///
    /// # Errors
    ///
    /// [`PortError::NoSuchPort`], [`PortError::Busy`], [`PortError::Permission`], or [`PortError::Io`] for anything else.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, PortError> {
        let path = path.into();
        let opened = serialport::new(path.to_string_lossy(), BITS_PER_SECOND)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .open();
        match opened {
            Ok(port) => Ok(Self { port, path }),
            Err(error) => Err(match error.kind() {
                _ if !path.exists() => PortError::NoSuchPort { path },
                serialport::ErrorKind::NoDevice => PortError::Busy { path },
                serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => PortError::Permission { path },
                _ => PortError::Io {
                    path,
                    source: error.into(),
                },
            }),
        }
    }

    fn failed(&self, source: std::io::Error) -> PortError {
        let path = self.path.clone();
        match source.kind() {
            ErrorKind::TimedOut | ErrorKind::WouldBlock => PortError::Stuck { path },
            // A pulled adapter hangs up, or gives EIO, ENXIO or ENODEV, which arrive as `Other`.
            ErrorKind::BrokenPipe | ErrorKind::Other | ErrorKind::NotFound | ErrorKind::UnexpectedEof => {
                PortError::Unplugged { path }
            }
            _ => PortError::Io { path, source },
        }
    }
}

impl Line for AdapterSerial {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        drop(self.port.set_timeout(max_wait));
        match self.port.read(buf) {
            Ok(0) if !buf.is_empty() => Err(PortError::Unplugged {
                path: self.path.clone(),
            }),
            Ok(received) => Ok(received),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            Err(error) => Err(self.failed(error)),
        }
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        drop(self.port.set_timeout(SEND_TIMEOUT));
        self.port.write_all(octets).map_err(|error| self.failed(error))
    }
}

const BITS_PER_SECOND: u32 = 115_200;
const SEND_TIMEOUT: Duration = Duration::from_secs(1);
