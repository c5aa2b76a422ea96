//! Ports by name, serial-device servers, and ports that come back.

#![cfg(unix)]

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use dp_master::phy::{
    AnyPort, Port, PortError, PortErrorKind, PortEvent, PortName, PseudoTerminal, ReopeningPort, RtsLevel, SerialLine,
    SerialOptions, TcpLine, Transmitter, open,
};
use dp_master::time::Baud;

const BAUD: Baud = Baud::B187500;
const PATIENCE: Duration = Duration::from_secs(20);

fn read_exactly(port: &mut dyn Port, wanted: usize) -> Vec<u8> {
    let (mut all, mut buf, begin) = (Vec::new(), [0; 64], Instant::now());
    while all.len() < wanted && begin.elapsed() < PATIENCE {
        let received = port.receive(&mut buf, Duration::from_millis(100)).unwrap();
        all.extend_from_slice(&buf[..received]);
    }
    all
}

/// A name in the scratch directory that is freed with this value.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("dp-master-ports-{name}-{}", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        drop(std::fs::remove_file(&self.0));
    }
}

/// A serial-device server on a port of its own.
fn server() -> (TcpListener, PortName) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (listener, PortName::Tcp(address))
}

/// A port for a server that has just been closed.
fn connected() -> (TcpListener, TcpStream, AnyPort) {
    let (listener, name) = server();
    let port = open(&name, BAUD, SerialOptions::default()).unwrap().port;
    let far = listener.accept().unwrap().0;
    (listener, far, port)
}

// --- serial -------------------------------------------------------------------------------------------------------------------------------

#[test]
fn a_pseudo_terminal_has_no_rts_and_no_rs485_mode_and_neither_is_fatal() {
    let (mut near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let delay = Duration::from_millis(1);
    for transmitter in [
        Transmitter::Adapter,
        Transmitter::Software {
            on_send: RtsLevel::High,
            before: delay,
            after: delay,
        },
        Transmitter::Kernel {
            on_send: RtsLevel::Low,
            before: delay,
            after: delay,
        },
    ] {
        let options = SerialOptions {
            transmitter,
            ..SerialOptions::default()
        };
        let mut line = SerialLine::open(&far_path, BAUD, options).unwrap();
        assert_eq!(line.notes(), [], "{transmitter:?}");
        line.send(&[0xDC, 0x02, 0x02]).unwrap();
        assert_eq!(read_exactly(&mut near, 3), [0xDC, 0x02, 0x02], "{transmitter:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_process_started_later_does_not_keep_a_pseudo_terminal_open() {
    let (near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let mut line = SerialLine::open(&far_path, BAUD, SerialOptions::default()).unwrap();
    let mut sleeper = std::process::Command::new("sleep").arg("60").spawn().unwrap();
    drop(near);
    let error = line.receive(&mut [0; 8], PATIENCE).err().map(|error| error.kind());
    sleeper.kill().unwrap();
    sleeper.wait().unwrap();
    assert_eq!(error, Some(PortErrorKind::Unplugged));
}

// --- names --------------------------------------------------------------------------------------------------------------------------------

#[test]
fn every_kind_of_port_is_opened_by_its_name() {
    let link = Scratch::new("named");
    let options = SerialOptions::default();
    let mut made = open(&PortName::PseudoTerminal(link.0.clone()), BAUD, options).unwrap();
    assert_eq!(std::fs::read_link(&link.0).ok(), made.far_end);
    let mut serial = open(&PortName::Serial(link.0.clone()), BAUD, options).unwrap();
    assert_eq!((serial.far_end, serial.port.baud()), (None, BAUD));
    serial.port.send(&[0xE5]).unwrap();
    assert_eq!(read_exactly(&mut made.port, 1), [0xE5]);

    let (_listener, mut far, mut tcp) = connected();
    tcp.send(&[0xE5]).unwrap();
    let mut octet = [0];
    far.read_exact(&mut octet).unwrap();
    assert_eq!(octet, [0xE5]);
}

// --- TCP ----------------------------------------------------------------------------------------------------------------------------------

#[test]
fn telegrams_go_both_ways_through_a_serial_device_server() {
    let (_listener, mut far, mut port) = connected();
    let octets: Vec<u8> = (0..=u8::MAX).collect();
    port.send(&octets).unwrap();
    let mut heard = [0; 256];
    far.read_exact(&mut heard).unwrap();
    assert_eq!(heard.as_slice(), octets);
    far.write_all(&octets).unwrap();
    assert_eq!(read_exactly(&mut port, 256), octets);
}

#[test]
fn a_silent_server_makes_a_read_wait_as_long_as_it_may_and_no_longer() {
    let (_listener, _far, mut port) = connected();
    let begin = Instant::now();
    assert_eq!(port.receive(&mut [0; 8], Duration::from_millis(30)).unwrap(), 0);
    assert!(begin.elapsed() >= Duration::from_millis(29));
    let begin = Instant::now();
    assert_eq!(port.receive(&mut [0; 8], Duration::ZERO).unwrap(), 0);
    assert!(begin.elapsed() < Duration::from_secs(1));
}

#[test]
fn a_server_that_closes_is_gone() {
    let (_listener, far, mut port) = connected();
    drop(far);
    let error = port.receive(&mut [0; 8], PATIENCE).unwrap_err();
    assert_eq!(error.kind(), PortErrorKind::Unplugged);
    let message = error.to_string();
    assert!(
        message.starts_with("port tcp://127.0.0.1:") && message.ends_with(" is gone"),
        "{message}"
    );
}

#[test]
fn a_server_that_breaks_the_connection_off_is_gone() {
    let (_listener, far, mut port) = connected();
    port.send(&[0xE5]).unwrap();
    far.peek(&mut [0]).unwrap();
    // Closed with an octet unread: the system resets the connection.
    drop(far);
    let error = port.receive(&mut [0; 8], PATIENCE).unwrap_err();
    assert_eq!(error.kind(), PortErrorKind::Unplugged);
}

#[test]
fn a_server_that_is_not_there_is_told_in_one_sentence() {
    let (listener, name) = server();
    drop(listener);
    let error = open(&name, BAUD, SerialOptions::default()).unwrap_err();
    assert_eq!(error.kind(), PortErrorKind::Unreachable);
    let message = error.to_string();
    assert!(message.starts_with(&format!("{name} cannot be reached: ")), "{message}");
    assert!(matches!(
        TcpLine::connect("no-such-host.invalid:4001", BAUD, Duration::from_secs(1)),
        Err(PortError::Unreachable { .. })
    ));
}

#[test]
fn a_server_that_reads_nothing_is_stuck_and_does_not_hold_the_caller() {
    let (_listener, _far, mut port) = connected();
    let begin = Instant::now();
    let error = loop {
        match port.send(&[0x55; 255]) {
            Ok(()) => assert!(begin.elapsed() < PATIENCE, "nothing ever fills up"),
            Err(error) => break error,
        }
    };
    assert!(matches!(error, PortError::Stuck { .. }), "{error}");
}

// --- ports that come back -----------------------------------------------------------------------------------------------------------------

/// Reads until the port tells something.
fn next_event(port: &mut ReopeningPort) -> PortEvent {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        assert_eq!(port.receive(&mut [0; 8], Duration::from_millis(20)).unwrap(), 0);
        if let Some(event) = port.poll_event() {
            return event;
        }
    }
    panic!("the port tells nothing");
}

#[test]
fn a_pulled_adapter_is_reported_and_opened_again_when_it_is_back() {
    let link = Scratch::new("pulled");
    let plug = || {
        let (mut near, _) = PseudoTerminal::open(BAUD).unwrap();
        near.link(&link.0).unwrap();
        near
    };
    let mut near = plug();
    let name = PortName::Serial(link.0.clone());
    let mut port = ReopeningPort::open(&name, BAUD, SerialOptions::default()).unwrap().port;
    assert!(port.is_there());
    near.send(&[0xE5]).unwrap();
    assert_eq!(read_exactly(&mut port, 1), [0xE5]);

    drop(near);
    let gone = next_event(&mut port);
    assert_eq!(
        gone.to_string(),
        format!("port {} is gone, waiting for it to come back", link.0.display())
    );
    assert!(!port.is_there());
    port.send(&[0xE5]).unwrap();

    let mut near = plug();
    let back = next_event(&mut port);
    assert!(matches!(back, PortEvent::Back { .. }), "{back}");
    assert!(port.is_there());
    near.send(&[0xDC, 0x02, 0x02]).unwrap();
    assert_eq!(read_exactly(&mut port, 3), [0xDC, 0x02, 0x02]);
    port.send(&[0xE5]).unwrap();
    assert_eq!(
        read_exactly(&mut near, 1),
        [0xE5],
        "what was sent while it was gone is lost"
    );
}

#[test]
fn a_terminal_that_somebody_else_got_is_never_written_to() {
    let link = Scratch::new("stale");
    let (near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    // Made by hand, so that it stays behind like that of a program that was killed.
    std::os::unix::fs::symlink(&far_path, &link.0).unwrap();
    let mut through_link = ReopeningPort::open(&PortName::Serial(link.0.clone()), BAUD, SerialOptions::default())
        .unwrap()
        .port;
    let mut direct = ReopeningPort::open(&PortName::Serial(far_path), BAUD, SerialOptions::default())
        .unwrap()
        .port;
    drop(near);
    assert!(matches!(next_event(&mut through_link), PortEvent::Gone { .. }));
    assert!(matches!(next_event(&mut direct), PortEvent::Gone { .. }));
    // The system gives the lowest free number, most often the one that has just become free.
    let _others: Vec<_> = (0..4).map(|_| PseudoTerminal::open(BAUD).unwrap()).collect();
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_millis(1_000) {
        for port in [&mut through_link, &mut direct] {
            assert_eq!(port.receive(&mut [0; 8], Duration::from_millis(20)).unwrap(), 0);
            assert!(!port.is_there(), "somebody else's terminal was opened");
        }
    }
}

#[test]
fn a_server_that_restarts_is_connected_again() {
    let (listener, name) = server();
    let mut port = ReopeningPort::open(&name, BAUD, SerialOptions::default()).unwrap().port;
    drop(listener.accept().unwrap());
    assert!(matches!(next_event(&mut port), PortEvent::Gone { .. }));
    // It waits in the queue of the listener until it is accepted.
    let back = next_event(&mut port);
    assert!(matches!(back, PortEvent::Back { .. }), "{back}");
    let mut far = listener.accept().unwrap().0;
    port.send(&[0xE5]).unwrap();
    let mut octet = [0];
    far.read_exact(&mut octet).unwrap();
    assert_eq!(octet, [0xE5]);
}

/// A port that is unplugged from the beginning.
struct Unplugged;

impl Port for Unplugged {
    fn receive(&mut self, _: &mut [u8], _: Duration) -> Result<usize, PortError> {
        Err(PortError::Unplugged { path: "/dev/x".into() })
    }
    fn send(&mut self, _: &[u8]) -> Result<(), PortError> {
        Err(PortError::Unplugged { path: "/dev/x".into() })
    }
    fn baud(&self) -> Baud {
        BAUD
    }
}

/// Time that this thread has spent on a processor. Source: Documentation/scheduler/sched-stats.rst, field 1 in nanoseconds.
#[cfg(target_os = "linux")]
fn processor_time() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    Duration::from_nanos(text.split_whitespace().next().unwrap().parse().unwrap())
}

#[cfg(target_os = "linux")]
#[test]
fn waiting_for_a_port_neither_spins_nor_tries_without_end() {
    let tries = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&tries);
    let mut port = ReopeningPort::new(Unplugged, move || {
        counted.fetch_add(1, Ordering::Relaxed);
        Err(PortError::NoSuchPort { path: "/dev/x".into() })
    });
    let (begin, spent) = (Instant::now(), processor_time());
    let mut reads = 0;
    while begin.elapsed() < Duration::from_millis(1_600) {
        assert_eq!(port.receive(&mut [0; 8], Duration::from_millis(50)).unwrap(), 0);
        reads += 1;
    }
    // The first read fails at once, every other waits: 1600 / 50, and one begun before the end.
    assert!(reads <= 34, "{reads} reads in 1.6 s");
    let spent = processor_time() - spent;
    assert!(spent < Duration::from_millis(160), "{spent:?} of 1.6 s on a processor");
    // After 0.1, 0.3, 0.7 and 1.5 s.
    assert!(tries.load(Ordering::Relaxed) <= 4, "{tries:?} attempts");
}

#[test]
fn an_adapter_that_breaks_at_once_every_time_is_not_opened_ever_faster() {
    let tries = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&tries);
    let mut port = ReopeningPort::new(Unplugged, move || {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(Unplugged)
    });
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_millis(1_600) {
        port.receive(&mut [0; 8], Duration::from_millis(50)).unwrap();
    }
    // After 0.1, 0.3, 0.7 and 1.5 s, though it was there for a moment each time.
    assert!(tries.load(Ordering::Relaxed) <= 4, "{tries:?} attempts");
}

#[test]
fn a_port_that_does_not_come_back_in_time_is_an_error_for_good() {
    let limit = Duration::from_millis(150);
    let mut port =
        ReopeningPort::new(Unplugged, || Err(PortError::NoSuchPort { path: "/dev/x".into() })).with_limit(limit);
    let begin = Instant::now();
    let error = loop {
        match port.receive(&mut [0; 8], Duration::from_millis(20)) {
            Ok(received) => assert_eq!(received, 0),
            Err(error) => break error,
        }
        assert!(begin.elapsed() < PATIENCE);
    };
    assert!(begin.elapsed() >= limit);
    assert_eq!(error.to_string(), "port /dev/x is gone");
    assert_eq!(port.send(&[0xE5]).unwrap_err().to_string(), "port /dev/x is gone");
    assert!(port.receive(&mut [0; 8], Duration::ZERO).is_err());
}

#[test]
fn an_error_that_opening_again_cannot_mend_is_passed_on() {
    struct Stuck;
    impl Port for Stuck {
        fn receive(&mut self, _: &mut [u8], _: Duration) -> Result<usize, PortError> {
            Ok(0)
        }
        fn send(&mut self, _: &[u8]) -> Result<(), PortError> {
            Err(PortError::Stuck { path: "/dev/x".into() })
        }
        fn baud(&self) -> Baud {
            BAUD
        }
    }
    let mut port = ReopeningPort::new(Stuck, || Ok(Stuck));
    assert!(matches!(port.send(&[0xE5]), Err(PortError::Stuck { .. })));
    assert!(port.is_there());
    assert_eq!(port.poll_event(), None);
}
