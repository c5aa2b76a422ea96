//! A real line: an RS485 adapter on a serial port.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use serialport::{ClearBuffer, DataBits, ErrorKind, FlowControl, Parity, SerialPort, StopBits};

use super::linux::{set_low_latency, set_rs485};
use super::port::{Port, PortError, PortNote, is_transient};
use super::rts_switch::{RtsSwitch, TransmitLine};
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

/// What to do with the line RTS when opening. Some adapters take their supply from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rts {
    /// Leave it as it is.
    Leave,
    /// Switch it on.
    On,
    /// Switch it off.
    Off,
}

/// A level of RTS, as the pin of the port shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RtsLevel {
    /// Set, the usual level for sending.
    High,
    /// Cleared.
    Low,
}

impl RtsLevel {
    pub(super) const fn other(self) -> Self {
        match self {
            Self::High => Self::Low,
            Self::Low => Self::High,
        }
    }
}

/// Who switches the RS485 transmitter on and off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transmitter {
    /// The adapter itself, by what it is given to send. Most USB adapters do.
    #[default]
    Adapter,
    /// This program, with RTS around each telegram. [`Port::send`] then returns after the last bit.
    ///
    /// The operating system is up to some milliseconds late with switching off, and what is answered before is lost: min Tsdr must be longer.
    /// Good for slow lines and for trials.
    Software {
        /// RTS while sending.
        on_send: RtsLevel,
        /// From switching on to the first bit.
        before: Duration,
        /// From the last bit to switching off.
        after: Duration,
    },
    /// The driver of the port, with RTS (Linux: RS485 mode). It knows when the last bit has left.
    Kernel {
        /// RTS while sending.
        on_send: RtsLevel,
        /// From switching on to the first bit, whole milliseconds.
        before: Duration,
        /// From the last bit to switching off, whole milliseconds.
        after: Duration,
    },
}

impl FromStr for Transmitter {
    type Err = ParseTransmitterError;

    /// Reads `adapter`, `rts` or `kernel`; the latter two with `-inverted` when RTS is low while sending, and with `:BEFORE:AFTER`, delays of
    /// 0…100 ms, such as `kernel-inverted:1:0`.
    ///
    /// # Errors
    ///
    /// [`ParseTransmitterError`] for anything else.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut parts = text.split(':');
        let who = parts.next().unwrap_or_default();
        let mut delay = || match parts.next().map(str::parse) {
            None => Ok(Duration::ZERO),
            Some(Ok(millis @ 0..=100)) => Ok(Duration::from_millis(millis)),
            Some(_) => Err(ParseTransmitterError),
        };
        let (before, after) = (delay()?, delay()?);
        let (who, on_send) = match who.strip_suffix("-inverted") {
            Some(who) => (who, RtsLevel::Low),
            None => (who, RtsLevel::High),
        };
        match (who, parts.next(), text) {
            (_, None, "adapter") => Ok(Self::Adapter),
            ("rts", None, _) => Ok(Self::Software { on_send, before, after }),
            ("kernel", None, _) => Ok(Self::Kernel { on_send, before, after }),
            _ => Err(ParseTransmitterError),
        }
    }
}

/// A text that names no way to switch a transmitter; the message lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "allowed are adapter, rts and kernel, the latter two as rts-inverted and kernel-inverted too, with delays of 0…100 ms as in rts:1:1"
)]
pub struct ParseTransmitterError;

/// How quickly the driver passes octets on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gathering {
    /// At once, where the driver can (Linux: low latency). One that cannot is no error.
    #[default]
    Off,
    /// As the system is set.
    Leave,
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
    /// Who switches the transmitter; [`Transmitter::Adapter`] by default.
    pub transmitter: Transmitter,
    /// How quickly octets are passed on; [`Gathering::Off`] by default.
    pub gathering: Gathering,
}

impl Default for SerialOptions {
    fn default() -> Self {
        Self {
            access: Access::Exclusive,
            echo: Echo::None,
            rts: Rts::Leave,
            transmitter: Transmitter::Adapter,
            gathering: Gathering::Off,
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
    port: NativePort,
    path: PathBuf,
    baud: Baud,
    echo: Echo,
    /// What was sent and has not come back yet.
    expected_echo: Vec<u8>,
    rts_switch: Option<RtsSwitch>,
    notes: Vec<PortNote>,
}

#[cfg(unix)]
type NativePort = serialport::TTYPort;
#[cfg(windows)]
type NativePort = serialport::COMPort;

impl SerialLine {
    /// Opens a port and throws away what it had received before.
    ///
    /// # Errors
    ///
    /// [`PortError::NoSuchPort`], [`PortError::NotASerialPort`], [`PortError::Busy`], [`PortError::Permission`],
    /// [`PortError::BaudRefused`] when the adapter is more than 2 % off, [`PortError::NoRs485`] when the driver has no RS485 mode, and
    /// [`PortError::Io`] for anything else.
    pub fn open(path: impl AsRef<Path>, baud: Baud, options: SerialOptions) -> Result<Self, PortError> {
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
        let opened = match builder.clone().open_native() {
            // Some systems refuse parity on a pseudo-terminal instead of ignoring it.
            Err(_) if pseudo => builder.parity(Parity::None).open_native(),
            other => other,
        };
        let mut port = opened.map_err(|error| not_opened(path, baud, error))?;
        if !pseudo
            && let Ok(offered) = port.baud_rate()
            && !is_near(offered, baud.bits_per_second())
        {
            return Err(PortError::BaudRefused {
                path: path.to_path_buf(),
                wanted: baud,
                offered,
            });
        }
        match options.rts {
            Rts::Leave => {}
            // Not fatal: a pseudo-terminal has no such line, and an adapter that needs none may have none.
            Rts::On => drop(port.write_request_to_send(true)),
            Rts::Off => drop(port.write_request_to_send(false)),
        }
        let rts_switch = switch_transmitter(&mut port, path, pseudo, options.transmitter)?;
        let notes = if pseudo {
            Vec::new()
        } else {
            notes_of(&port, path, options.gathering)
        };
        // Not fatal either: octets from before are sorted out by the decoder.
        drop(port.clear(ClearBuffer::Input));
        Ok(Self {
            port,
            path: path.to_path_buf(),
            baud,
            echo: options.echo,
            expected_echo: Vec::new(),
            rts_switch,
            notes,
        })
    }

    /// What the user should know about this port; nothing that keeps it from working.
    #[must_use]
    pub fn notes(&self) -> &[PortNote] {
        &self.notes
    }

    /// The path it was opened with.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Port for SerialLine {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        let received = read_within(&mut self.port, &self.path, buf, max_wait)?;
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
        let sent = match self.rts_switch {
            Some(switch) => switch.send(&mut self.port, octets, self.baud.characters(octets.len()).into()),
            None => self.port.write_all(octets),
        };
        sent.map_err(|error| PortError::in_use(&self.path, error))
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

impl TransmitLine for NativePort {
    fn set_rts(&mut self, level: RtsLevel) -> bool {
        self.write_request_to_send(level == RtsLevel::High).is_ok()
    }

    fn write(&mut self, octets: &[u8]) -> io::Result<()> {
        io::Write::write_all(self, octets)
    }

    fn drain(&mut self) -> io::Result<()> {
        self.flush()
    }
}

/// Prepares what switches the transmitter. A pseudo-terminal has none, whatever is asked for.
fn switch_transmitter(
    port: &mut NativePort,
    path: &Path,
    pseudo: bool,
    transmitter: Transmitter,
) -> Result<Option<RtsSwitch>, PortError> {
    match transmitter {
        Transmitter::Software { on_send, before, after } if !pseudo => {
            // Off until something is to be sent.
            port.set_rts(on_send.other());
            Ok(Some(RtsSwitch { on_send, before, after }))
        }
        Transmitter::Kernel { on_send, before, after } if !pseudo => {
            set_rs485(port, on_send, whole_millis(before), whole_millis(after)).map_err(|source| {
                PortError::NoRs485 {
                    path: path.to_path_buf(),
                    source,
                }
            })?;
            Ok(None)
        }
        _ => Ok(None),
    }
}

/// Rounded up.
fn whole_millis(time: Duration) -> u32 {
    u32::try_from(time.as_micros().div_ceil(1_000)).unwrap_or(u32::MAX)
}

/// Makes the driver quick and collects what the user should know.
fn notes_of(port: &NativePort, path: &Path, gathering: Gathering) -> Vec<PortNote> {
    let mut notes = Vec::new();
    // Refused by drivers that gather nothing, as well as by those that always do: only the timer of an FTDI adapter can be seen.
    if gathering == Gathering::Off {
        drop(set_low_latency(port));
    }
    let real = std::fs::canonicalize(path);
    if let Some(note) = real
        .ok()
        .as_deref()
        .and_then(Path::file_name)
        .and_then(|name| PortNote::latency_timer(&Path::new(USB_SERIAL_DEVICES).join(name).join("latency_timer")))
    {
        notes.push(note);
    }
    if matches!(port.parity(), Ok(parity) if parity != Parity::Even) {
        notes.push(PortNote::ParityNotConfirmed {
            path: path.to_path_buf(),
        });
    }
    notes
}

/// Where Linux shows the settings of USB adapters.
const USB_SERIAL_DEVICES: &str = "/sys/bus/usb-serial/devices";

/// Finds what the operating system would only report with an unspecific code.
#[cfg(unix)]
fn check_path(path: &Path) -> Result<(), PortError> {
    use std::os::unix::fs::FileTypeExt;
    match std::fs::metadata(path) {
        Ok(metadata) if metadata.file_type().is_char_device() => Ok(()),
        Ok(_) => Err(PortError::NotASerialPort {
            path: path.to_path_buf(),
        }),
        Err(error) => Err(not_found(path, error)),
    }
}

#[cfg(unix)]
fn not_found(path: &Path, source: io::Error) -> PortError {
    let path = path.to_path_buf();
    match source.kind() {
        io::ErrorKind::NotFound => PortError::NoSuchPort { path },
        io::ErrorKind::PermissionDenied => PortError::Permission { path },
        _ => PortError::Io { path, source },
    }
}

#[cfg(not(unix))]
fn check_path(_: &Path) -> Result<(), PortError> {
    Ok(())
}

/// Whether the path leads to a pseudo-terminal, also through a symbolic link.
pub(super) fn is_pseudo_terminal(path: &Path) -> bool {
    std::fs::canonicalize(path).is_ok_and(|path| path.starts_with("/dev/pts"))
}

/// Whether a rate is near enough to the one wanted.
///
/// A UART takes the middle of the last bit: 5 % for both ends together, so 2 % for one.
const fn is_near(offered: u32, wanted: u32) -> bool {
    offered.abs_diff(wanted) <= wanted / 50
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
        ErrorKind::Unknown if error.description.contains("typewriter") || error.description.contains("ioctl") => {
            PortError::NotASerialPort { path }
        }
        _ => PortError::Io {
            path,
            source: error.into(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 45.45 kbit/s: 2 % are 909 bit/s. An adapter with a clock of 1.8432 MHz makes 46 080 of it, one that knows the usual rates only
    /// takes 38 400.
    #[test]
    fn a_rate_may_be_two_percent_off() {
        for (offered, near) in [
            (45_450, true),
            (46_080, true),
            (46_359, true),
            (46_360, false),
            (44_541, true),
            (44_540, false),
            (38_400, false),
        ] {
            assert_eq!(is_near(offered, 45_450), near, "{offered}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn what_the_system_says_of_a_port_is_told_as_what_can_be_done_about_it() {
        let path = Path::new("/dev/x");
        let baud = Baud::B45450;
        let of_path = |kind: io::ErrorKind| not_found(path, kind.into());
        let of_port = |kind, text: &str| not_opened(path, baud, serialport::Error::new(kind, text));
        for (error, message) in [
            (of_path(io::ErrorKind::NotFound), "there is no port /dev/x"),
            (
                of_path(io::ErrorKind::PermissionDenied),
                "no permission to open port /dev/x",
            ),
            (of_path(io::ErrorKind::NotADirectory), "port /dev/x: not a directory"),
            (
                of_port(ErrorKind::NoDevice, ""),
                "port /dev/x is in use by another program",
            ),
            (
                of_port(ErrorKind::Io(io::ErrorKind::NotFound), ""),
                "there is no port /dev/x",
            ),
            (
                of_port(ErrorKind::Io(io::ErrorKind::PermissionDenied), ""),
                "no permission to open port /dev/x",
            ),
            (
                of_port(ErrorKind::InvalidInput, ""),
                "port /dev/x does not run at 45.45 kbit/s, it offers 0 bit/s",
            ),
            // ENOTTY: glibc says "Inappropriate ioctl for device", others "Not a typewriter".
            (
                of_port(ErrorKind::Unknown, "Inappropriate ioctl for device"),
                "/dev/x is no serial port",
            ),
            (
                of_port(ErrorKind::Unknown, "Not a typewriter"),
                "/dev/x is no serial port",
            ),
            (
                of_port(ErrorKind::Unknown, "Too many links"),
                "port /dev/x: Too many links",
            ),
        ] {
            assert_eq!(error.to_string(), message);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_pseudo_terminal_is_known_by_its_path() {
        let (_near, far) = NativePort::pair().unwrap();
        assert!(is_pseudo_terminal(Path::new(&far.name().unwrap())));
        assert!(!is_pseudo_terminal(Path::new("/dev/null")));
    }

    #[test]
    fn a_delay_is_whole_milliseconds_rounded_up() {
        for (micros, millis) in [(0, 0), (1, 1), (1_000, 1), (1_001, 2), (100_000, 100)] {
            assert_eq!(whole_millis(Duration::from_micros(micros)), millis, "{micros} µs");
        }
    }

    /// A pseudo-terminal stands for an adapter whose driver can neither switch RTS nor confirm parity.
    #[cfg(unix)]
    #[test]
    fn a_driver_without_rts_or_parity_is_lived_with_and_one_without_rs485_mode_is_not() {
        let (mut near, mut far) = NativePort::pair().unwrap();
        let path = Path::new("/dev/x");
        let (before, after) = (Duration::from_millis(1), Duration::from_millis(2));
        let on_send = RtsLevel::High;
        let mut switch = |pseudo, transmitter| switch_transmitter(&mut far, path, pseudo, transmitter);
        let software = Transmitter::Software { on_send, before, after };
        let kernel = Transmitter::Kernel { on_send, before, after };
        let wanted = RtsSwitch { on_send, before, after };
        assert_eq!(switch(false, software).unwrap(), Some(wanted));
        assert!(matches!(switch(false, kernel), Err(PortError::NoRs485 { .. })));
        for (pseudo, transmitter) in [(true, software), (true, kernel), (false, Transmitter::Adapter)] {
            assert_eq!(switch(pseudo, transmitter).unwrap(), None, "{transmitter:?}");
        }

        assert!(!far.set_rts(RtsLevel::High));
        TransmitLine::write(&mut far, &[0xDC, 0x02, 0x02]).unwrap();
        let mut octets = [0; 3];
        io::Read::read_exact(&mut near, &mut octets).unwrap();
        assert_eq!(octets, [0xDC, 0x02, 0x02]);

        let note = PortNote::ParityNotConfirmed { path: path.into() };
        assert_eq!(notes_of(&far, path, Gathering::Off), [note]);
    }

    #[cfg(unix)]
    #[test]
    fn a_line_has_its_notes_and_is_shown_with_path_and_rate() {
        let line = SerialLine {
            port: NativePort::pair().unwrap().0,
            path: "/dev/x".into(),
            baud: Baud::B45450,
            echo: Echo::None,
            expected_echo: Vec::new(),
            rts_switch: None,
            notes: vec![PortNote::ParityNotConfirmed { path: "/dev/x".into() }],
        };
        assert_eq!(line.notes(), [PortNote::ParityNotConfirmed { path: "/dev/x".into() }]);
        assert_eq!(
            format!("{line:?}"),
            r#"SerialLine { path: "/dev/x", baud: B45450, .. }"#
        );
    }

    #[test]
    fn who_switches_the_transmitter_is_read_from_a_word() {
        let millis = Duration::from_millis;
        let software = |on_send, before, after| Transmitter::Software {
            on_send,
            before: millis(before),
            after: millis(after),
        };
        for (text, transmitter) in [
            ("adapter", Transmitter::Adapter),
            ("rts", software(RtsLevel::High, 0, 0)),
            ("rts-inverted", software(RtsLevel::Low, 0, 0)),
            ("rts:1:100", software(RtsLevel::High, 1, 100)),
            ("rts:1", software(RtsLevel::High, 1, 0)),
            (
                "kernel-inverted:1:0",
                Transmitter::Kernel {
                    on_send: RtsLevel::Low,
                    before: millis(1),
                    after: millis(0),
                },
            ),
        ] {
            assert_eq!(text.parse(), Ok(transmitter), "{text}");
        }
        for text in [
            "",
            "dtr",
            "adapter-inverted",
            "adapter:1",
            "rts:101",
            "rts:x",
            "rts:1:1:1",
            "rts-",
        ] {
            assert_eq!(text.parse::<Transmitter>(), Err(ParseTransmitterError), "{text}");
        }
    }
}
