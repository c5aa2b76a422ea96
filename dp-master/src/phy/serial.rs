//! A real line: an RS485 adapter on a serial port.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{ClearBuffer, DataBits, ErrorKind, FlowControl, Parity, SerialPort, StopBits};

use super::port::{Port, PortError, is_transient};
use crate::time::Baud;

/// Who else may open the port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Nobody, except on a pseudo-terminal.
    ///
    /// There the lock would outlive a program that is killed, because the other end keeps the terminal open.
    Exclusive,
    /// Anybody.
    Shared,
}

/// Whether the adapter hears itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Echo {
    /// The receiver is off while sending.
    None,
    /// Every octet sent comes back; it is taken away again. What comes back otherwise is passed on: it is a collision or a disturbance.
    Own,
}

/// What to do with the line RTS when opening. Some adapters switch their transmitter with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rts {
    /// Leave it as it is.
    Leave,
    /// Switch it on.
    On,
    /// Switch it off.
    Off,
}

/// How to open a [`SerialLine`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SerialOptions {
    /// Who else may open the port; [`Access::Exclusive`] by default.
    pub access: Access,
    /// Whether the adapter hears itself; [`Echo::None`] by default.
    pub echo: Echo,
    /// RTS when opening; [`Rts::Leave`] by default. An adapter without RTS is no error.
    pub rts: Rts,
}

impl Default for SerialOptions {
    fn default() -> Self {
        Self {
            access: Access::Exclusive,
            echo: Echo::None,
            rts: Rts::Leave,
        }
    }
}

/// A serial port as a line: 8 data bits, even parity, one stop bit.
///
/// A pseudo-terminal serves as well: that it has neither parity nor RTS nor a baud rate is no error.
///
/// The operating system passes a character with wrong parity on as `00` and does not say so; the frame check sequence finds it.
///
/// | adapter | octets wait in it for | then |
/// |---|---|---|
/// | FTDI, as delivered | up to 16 ms | set its latency timer to 1 ms |
/// | FTDI with latency timer 1, CP210x, CH34x | 1…2 ms | slot time accordingly |
/// | UART on the processor's own bus | 1…4 characters | |
///
/// Source: usual values of the vendors' data sheets, not measured here. A slot time in bits must be longer than these.
pub struct SerialLine {
    port: Box<dyn SerialPort>,
    path: PathBuf,
    baud: Baud,
    echo: Echo,
    /// What was sent and has not come back yet.
    expected_echo: Vec<u8>,
}

impl SerialLine {
    /// Opens a port and throws away what it had received before.
    ///
    /// # Errors
    ///
    /// [`PortError::NoSuchPort`], [`PortError::NotASerialPort`], [`PortError::Busy`], [`PortError::Permission`],
    /// [`PortError::BaudRefused`] when the adapter is more than 2 % off, and [`PortError::Io`] for anything else.
    pub fn open(
        path: impl AsRef<Path>,
        baud: Baud,
        options: SerialOptions,
    ) -> Result<Self, PortError> {
        let path = path.as_ref();
        check_path(path)?;
        let pseudo = is_pseudo_terminal(path);
        let builder = serialport::new(path.to_string_lossy(), baud.bits_per_second())
            .data_bits(DataBits::Eight)
            .parity(Parity::Even)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(SEND_TIMEOUT);
        let builder = if pseudo || options.access == Access::Shared {
            builder.exclusive(false)
        } else {
            builder
        };
        let opened = match builder.clone().open() {
            // Some systems refuse parity on a pseudo-terminal instead of ignoring it.
            Err(_) if pseudo => builder.parity(Parity::None).open(),
            other => other,
        };
        let mut port = opened.map_err(|error| not_opened(path, baud, error))?;
        if !pseudo && let Ok(offered) = port.baud_rate() {
            let wanted = baud.bits_per_second();
            // A UART takes the middle of the last bit: 5 % for both ends together, so 2 % for one.
            if offered.abs_diff(wanted) > wanted / 50 {
                return Err(PortError::BaudRefused {
                    path: path.to_path_buf(),
                    wanted: baud,
                    offered,
                });
            }
        }
        match options.rts {
            Rts::Leave => {}
            // Not fatal: a pseudo-terminal has no such line, and an adapter that needs none may have none.
            Rts::On => drop(port.write_request_to_send(true)),
            Rts::Off => drop(port.write_request_to_send(false)),
        }
        // Not fatal either: octets from before are sorted out by the decoder.
        drop(port.clear(ClearBuffer::Input));
        Ok(Self {
            port,
            path: path.to_path_buf(),
            baud,
            echo: options.echo,
            expected_echo: Vec::new(),
        })
    }

    /// The path it was opened with.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Port for SerialLine {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        let received = read_within(&mut *self.port, &self.path, buf, max_wait)?;
        if self.expected_echo.is_empty() {
            return Ok(received);
        }
        let own = self
            .expected_echo
            .iter()
            .zip(&buf[..received])
            .take_while(|(sent, heard)| sent == heard)
            .count();
        buf.copy_within(own..received, 0);
        self.expected_echo.drain(..own);
        if own < received {
            // Something else came back, so no more of it will.
            self.expected_echo.clear();
        }
        Ok(received - own)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        if self.echo == Echo::Own {
            self.expected_echo.clear();
            self.expected_echo.extend_from_slice(octets);
        }
        drop(self.port.set_timeout(SEND_TIMEOUT));
        write_all(&mut *self.port, octets).map_err(|error| PortError::in_use(&self.path, error))
    }

    fn baud(&self) -> Baud {
        self.baud
    }
}

impl std::fmt::Debug for SerialLine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SerialLine")
            .field("path", &self.path)
            .field("baud", &self.baud)
            .finish_non_exhaustive()
    }
}

/// How long a port may take to accept a telegram before it counts as stuck.
pub(super) const SEND_TIMEOUT: Duration = Duration::from_millis(200);

/// Reads what is there, waiting at most `max_wait` for the first octet.
pub(super) fn read_within(
    port: &mut dyn SerialPort,
    path: &Path,
    buf: &mut [u8],
    max_wait: Duration,
) -> Result<usize, PortError> {
    if buf.is_empty() {
        return Ok(0);
    }
    port.set_timeout(max_wait)
        .map_err(|error| PortError::in_use(path, error.into()))?;
    match port.read(buf) {
        // Readable without octets is a terminal that hung up.
        Ok(0) => Err(PortError::Unplugged {
            path: path.to_path_buf(),
        }),
        Ok(received) => Ok(received),
        Err(error) if is_transient(&error) => Ok(0),
        Err(error) => Err(PortError::in_use(path, error)),
    }
}

/// Writes everything; an interruption by a signal is no error.
pub(super) fn write_all(port: &mut dyn SerialPort, octets: &[u8]) -> io::Result<()> {
    let mut rest = octets;
    while !rest.is_empty() {
        match port.write(rest) {
            Ok(0) => return Err(io::ErrorKind::BrokenPipe.into()),
            Ok(written) => rest = rest.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Finds what the operating system would only report with an unspecific code.
#[cfg(unix)]
fn check_path(path: &Path) -> Result<(), PortError> {
    use std::os::unix::fs::FileTypeExt;
    let owned = || path.to_path_buf();
    match std::fs::metadata(path) {
        Ok(metadata) if metadata.file_type().is_char_device() => Ok(()),
        Ok(_) => Err(PortError::NotASerialPort { path: owned() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(PortError::NoSuchPort { path: owned() })
        }
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
            Err(PortError::Permission { path: owned() })
        }
        Err(source) => Err(PortError::Io {
            path: owned(),
            source,
        }),
    }
}

#[cfg(not(unix))]
fn check_path(_: &Path) -> Result<(), PortError> {
    Ok(())
}

/// Whether the path leads to a pseudo-terminal, also through a symbolic link.
fn is_pseudo_terminal(path: &Path) -> bool {
    std::fs::canonicalize(path).is_ok_and(|path| path.starts_with("/dev/pts"))
}

fn not_opened(path: &Path, baud: Baud, error: serialport::Error) -> PortError {
    let path = path.to_path_buf();
    match error.kind {
        ErrorKind::NoDevice => PortError::Busy { path },
        ErrorKind::Io(io::ErrorKind::NotFound) => PortError::NoSuchPort { path },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => PortError::Permission { path },
        ErrorKind::InvalidInput => PortError::BaudRefused {
            path,
            wanted: baud,
            offered: 0,
        },
        // A character device that is no terminal: the text of ENOTTY is all that is left of the cause.
        ErrorKind::Unknown
            if error.description.contains("typewriter") || error.description.contains("ioctl") =>
        {
            PortError::NotASerialPort { path }
        }
        _ => PortError::Io {
            path,
            source: error.into(),
        },
    }
}
