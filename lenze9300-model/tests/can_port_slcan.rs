//! An adapter with the LAWICEL protocol, over a pseudo-terminal and over TCP. The adapter is played here, octet for octet by the CAN232 manual.
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::io::{Read, Write};
use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use lenze9300_model::bus::can::CanFrame;
use lenze9300_model::bus::can_port::{
    AnyCanPort, BusState, CanBusEvent, CanPort, CanPortError, CanPortName, ReopeningCanPort, open,
};

const WAIT: Duration = Duration::from_millis(50);

/// Reads one line of the program, without its CR; `None` when the program hung up.
fn read_line(stream: &mut impl Read) -> Option<String> {
    let mut line = String::new();
    let mut octet = [0];
    loop {
        stream.read_exact(&mut octet).ok()?;
        match octet[0] {
            b'\r' => return Some(line),
            octet => line.push(char::from(octet)),
        }
    }
}

/// Answers commands as the manual says: CR, `z` CR for a frame, BEL for what it refuses. Returns all lines that were not empty.
fn adapter(
    mut stream: impl Read + Write,
    refused: Option<char>,
    mut on_frame: impl FnMut(&str) -> String,
) -> Vec<String> {
    let mut lines = Vec::new();
    while let Some(line) = read_line(&mut stream) {
        let answer = match line.chars().next() {
            first if first.is_some() && first == refused => "\x07".to_owned(),
            Some('t' | 'r') => format!("z\r{}", on_frame(&line)),
            Some('F') => "F20\r".to_owned(),
            _ => "\r".to_owned(),
        };
        if !line.is_empty() {
            lines.push(line);
        }
        if stream.write_all(answer.as_bytes()).is_err() {
            break;
        }
    }
    lines
}

fn server() -> (TcpListener, CanPortName) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let name = format!("slcan:tcp://{}@125", listener.local_addr().unwrap());
    (listener, name.parse().unwrap())
}

fn next_frame(port: &mut dyn CanPort) -> Option<CanFrame> {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(3) {
        if let Some(frame) = port.receive(WAIT).unwrap() {
            return Some(frame);
        }
    }
    None
}

/// The facts' example: C0061 read, 43 °C answered (SYSBUS p. 2-18).
fn read_c0061() -> CanFrame {
    CanFrame::new(0x601, &[0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).unwrap()
}

fn exchange(port: &mut AnyCanPort) {
    port.send(&read_c0061()).unwrap();
    let answer = next_frame(port).expect("the adapter passes the answer on");
    assert_eq!(
        (answer.id(), answer.data()),
        (0x581, &[0x43, 0xC2, 0x5F, 0, 0xB0, 0x8F, 6, 0][..])
    );
}

fn answer_c0061(line: &str) -> String {
    assert_eq!(line, "t601840C25F0000000000");
    "t581843C25F00B08F0600\r".to_owned()
}

#[test]
fn the_bus_is_closed_set_opened_and_closed_again_and_frames_go_both_ways() {
    let (listener, name) = server();
    let played = thread::spawn(move || adapter(listener.accept().unwrap().0, None, answer_c0061));
    let mut port = open(&name).unwrap();
    exchange(&mut port);
    drop(port);
    assert_eq!(played.join().unwrap(), ["C", "S4", "O", "t601840C25F0000000000", "C"]);
}

#[test]
#[cfg(unix)]
fn a_pseudo_terminal_serves_as_well() {
    use serialport::{SerialPort, TTYPort};
    let (mut near, far) = TTYPort::pair().unwrap();
    let name: CanPortName = format!("slcan:{}@1000", far.name().unwrap()).parse().unwrap();
    near.set_timeout(Duration::from_secs(2)).unwrap();
    drop(far);
    let played = thread::spawn(move || {
        // A read hangs up as long as nobody has the far end open.
        let begun = Instant::now();
        while near.bytes_to_read().unwrap_or(0) == 0 && begun.elapsed() < Duration::from_secs(5) {
            thread::sleep(Duration::from_millis(2));
        }
        adapter(near, None, answer_c0061)
    });
    let mut port = open(&name).unwrap();
    exchange(&mut port);
    drop(port);
    assert_eq!(played.join().unwrap()[..4], ["C", "S8", "O", "t601840C25F0000000000"]);
}

#[test]
fn a_refused_bit_rate_and_a_bus_that_does_not_open_are_told_apart() {
    for (refused, expected) in [('S', "refuses 125 kbit/s"), ('O', "does not open the bus")] {
        let (listener, name) = server();
        let played = thread::spawn(move || adapter(listener.accept().unwrap().0, Some(refused), |_| String::new()));
        let error = open(&name).map(drop).unwrap_err().to_string();
        assert!(error.contains(&name.to_string()) && error.contains(expected), "{error}");
        played.join().unwrap();
    }
}

#[test]
fn an_adapter_that_refuses_frames_is_a_bus_that_takes_none() {
    let (listener, name) = server();
    let played = thread::spawn(move || adapter(listener.accept().unwrap().0, Some('t'), |_| String::new()));
    let mut port = open(&name).unwrap();
    port.send(&read_c0061()).unwrap();
    // The refusal comes after the frame was handed over, so the next one is told.
    let begun = Instant::now();
    let error = loop {
        assert!(begun.elapsed() < Duration::from_secs(3), "no refusal arrived");
        assert_eq!(port.receive(WAIT).unwrap(), None);
        if let Err(error) = port.send(&read_c0061()) {
            break error;
        }
    };
    assert!(matches!(error, CanPortError::Full { .. }), "{error}");
    drop(port);
    played.join().unwrap();
}

/// Bit 5 of the status flags is error passive (CAN232 manual, command F).
#[test]
fn an_error_passive_controller_is_told_with_what_to_check() {
    let (listener, name) = server();
    let played = thread::spawn(move || adapter(listener.accept().unwrap().0, None, |_| String::new()));
    let mut port = open(&name).unwrap();
    let begun = Instant::now();
    let event = loop {
        assert!(begun.elapsed() < Duration::from_secs(5), "no event");
        port.receive(WAIT).unwrap();
        if let Some(event) = port.poll_event() {
            break event;
        }
    };
    assert!(matches!(event, CanBusEvent::State(BusState::Passive)), "{event}");
    assert!(event.to_string().contains("check bit rate"), "{event}");
    drop(port);
    played.join().unwrap();
}

#[test]
fn a_server_that_hangs_up_is_reported_and_used_again_when_it_is_back() {
    let (listener, name) = server();
    let played = thread::spawn(move || {
        // Three commands open the bus, with two empty lines before them; then the server hangs up.
        let (mut stream, _) = listener.accept().unwrap();
        for _ in 0..5 {
            read_line(&mut stream).unwrap();
            stream.write_all(b"\r").unwrap();
        }
        drop(stream);
        adapter(listener.accept().unwrap().0, None, answer_c0061)
    });
    let mut port = ReopeningCanPort::open(&name).unwrap();
    let mut events = Vec::new();
    let begun = Instant::now();
    while events.len() < 2 {
        assert!(begun.elapsed() < Duration::from_secs(5), "{events:?}");
        port.receive(WAIT).unwrap();
        events.extend(std::iter::from_fn(|| port.poll_event()).map(|event| event.to_string()));
    }
    assert!(events[0].ends_with("is gone; waiting for it"), "{events:?}");
    assert_eq!(events[1], format!("{name} is back"));
    port.send(&read_c0061()).unwrap();
    assert_eq!(next_frame(&mut port).unwrap().id(), 0x581);
    drop(port);
    played.join().unwrap();
}

#[test]
fn names_that_are_none_are_told_with_those_that_are() {
    for (text, message) in [
        (
            "slcan:/dev/ttyACM0@333",
            "333 is no bit rate, allowed are 10, 20, 50, 100, 125, 250, 500, 800 and 1000 kbit/s",
        ),
        (
            "/dev/can",
            "/dev/can is no CAN port, allowed are an interface such as can0, slcan:/dev/ttyACM0@500 and slcan:tcp://host:4001@500",
        ),
        (
            "slcan:tcp://host@500",
            "tcp://host is no server, tcp://host:port with a port of 1…65535 is needed",
        ),
    ] {
        assert_eq!(text.parse::<CanPortName>().unwrap_err().to_string(), message, "{text}");
    }
}
