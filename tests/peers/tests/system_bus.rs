//! The served drive on a real SocketCAN interface: our own tool, `cansend` and `candump` of can-utils, and the Python package `canopen`
//! against it; the interface goes down, is removed, and comes back.
//!
//! Runs where `WITH_VCAN` is set (a vcan module, `ip`, the right to make interfaces); with `REQUIRE_VCAN=1` its absence is a failure.
//! Source of every octet: 9300 fact sheet, section 5.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

fn has_bus(test: &str) -> bool {
    let there = std::env::var_os("WITH_VCAN").is_some();
    assert!(
        there || std::env::var_os("REQUIRE_VCAN").is_none_or(|value| value != "1"),
        "REQUIRE_VCAN=1, but WITH_VCAN is not set"
    );
    if !there {
        eprintln!("{test} skipped: no SocketCAN interface (WITH_VCAN is not set)");
    }
    there
}

/// Runs `ip link` with these words.
fn ip_link(words: &str) {
    let status = Command::new("ip")
        .arg("link")
        .args(words.split_whitespace())
        .status()
        .unwrap();
    assert!(status.success(), "ip link {words}: {status}");
}

/// An interface of a test's own, so that tests do not disturb each other; removed at the end.
struct Interface(&'static str);

impl Interface {
    fn new(name: &'static str) -> Self {
        ip_link(&format!("add dev {name} type vcan"));
        ip_link(&format!("set {name} up"));
        Self(name)
    }
}

impl Drop for Interface {
    fn drop(&mut self) {
        // A test may have removed it.
        drop(Command::new("ip").args(["link", "del", self.0]).status());
    }
}

/// A process that ends with its test, and the lines it writes to one of its outputs.
struct Process {
    child: Child,
    out: Receiver<String>,
    errors: Receiver<String>,
}

impl Process {
    fn start(command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?} does not start: {error}"));
        let (out, errors) = (lines(child.stdout.take()), lines(child.stderr.take()));
        Self { child, out, errors }
    }

    /// `lenze9300 serve` on an interface, ready.
    fn drive(interface: &str, node: u8) -> Self {
        let drive = Self::start(Command::new(env!("CARGO_BIN_EXE_lenze9300-for-peers")).args([
            "serve",
            "--can",
            interface,
            "--node",
            &node.to_string(),
        ]));
        let line = expect(&drive.out, "answering as node");
        assert!(line.contains(interface), "{line}");
        drive
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn lines(from: Option<impl Read + Send + 'static>) -> Receiver<String> {
    let (tell, lines) = channel();
    std::thread::spawn(move || {
        for line in from.into_iter().flat_map(|out| BufReader::new(out).lines()) {
            if line.is_err() || line.is_ok_and(|line| tell.send(line).is_err()) {
                break;
            }
        }
    });
    lines
}

/// The next line with this part, within 10 s.
fn expect(lines: &Receiver<String>, part: &str) -> String {
    let until = Instant::now() + Duration::from_secs(10);
    let mut seen = Vec::new();
    while let Ok(line) = lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
        if line.contains(part) {
            return line;
        }
        seen.push(line);
    }
    panic!("no line with {part:?} came, but {seen:?}");
}

fn cansend(interface: &str, frame: &str) {
    let status = Command::new("cansend").args([interface, frame]).status().unwrap();
    assert!(status.success(), "cansend {interface} {frame}: {status}");
}

/// `candump`, listening.
fn candump(interface: &str) -> Process {
    let dump = Process::start(Command::new("candump").args(["-L", interface]));
    // It says nothing when it is ready: send until a frame shows.
    let ready = Instant::now() + Duration::from_secs(10);
    loop {
        cansend(interface, "7FF#00");
        if dump.out.recv_timeout(Duration::from_millis(200)).is_ok() {
            return dump;
        }
        assert!(Instant::now() < ready, "candump shows nothing");
    }
}

#[test]
fn cansend_and_candump_meet_the_octets_of_the_manual() {
    if !has_bus("cansend_and_candump_meet_the_octets_of_the_manual") {
        return;
    }
    let interface = Interface::new("vcan10");
    let _drive = Process::drive(interface.0, 5);
    let dump = candump(interface.0);
    // C0012 := 20 s (PLC14 p. 3-45).
    cansend(interface.0, "605#23F35F00400D0300");
    expect(&dump.out, "585#60F35F0000000000");
    cansend(interface.0, "605#40F35F0000000000");
    expect(&dump.out, "585#43F35F00400D0300");
    // A code that does not exist: 6/6 as data 3 / data 4.
    cansend(interface.0, "645#40F1380000000000");
    expect(&dump.out, "5C5#80F1380000000606");
    // Operational, then a sync: CAN-OUT1.
    cansend(interface.0, "000#0105");
    expect(&dump.out, "286#");
    cansend(interface.0, "080#");
    expect(&dump.out, "185#");
}

#[test]
fn our_own_tool_commissions_the_drive() {
    if !has_bus("our_own_tool_commissions_the_drive") {
        return;
    }
    let interface = Interface::new("vcan14");
    let drive = Process::drive(interface.0, 2);
    let tool = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_lenze9300-for-peers"))
            .args(arguments)
            .args(["--can", interface.0, "--node", "2"])
            .output()
            .unwrap();
        let [out, errors] = [output.stdout, output.stderr].map(|octets| String::from_utf8(octets).unwrap());
        (output.status.code(), out, errors)
    };
    let (code, _, errors) = tool(&["param", "write", "C0012=20", "C1301/40=987.5"]);
    assert_eq!(code, Some(0), "{errors}");
    let (code, out, errors) = tool(&["param", "read", "C0012", "C1301/40", "--channel", "2"]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(out.contains("20.00") && out.contains("987.5000 units"), "{out}");
    let (code, out, errors) = tool(&["monitor", "--once"]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(out.contains("fault: none"), "{out}");
    // Down: the tool says so at once, the drive waits.
    ip_link("set vcan14 down");
    let (code, _, errors) = tool(&["param", "read", "C0012"]);
    assert_eq!(code, Some(2));
    assert!(errors.contains("vcan14 is down: ip link set vcan14 up"), "{errors}");
    ip_link("set vcan14 up");
    expect(&drive.errors, "vcan14 is back");
    let (code, _, errors) = tool(&["param", "read", "C0012"]);
    assert_eq!(code, Some(0), "{errors}");
}

#[test]
fn an_independent_canopen_client_reads_and_writes_codes() {
    if !has_bus("an_independent_canopen_client_reads_and_writes_codes") {
        return;
    }
    let python = std::env::var("PEERS_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_canopen = Command::new(&python)
        .args(["-c", "import canopen"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !has_canopen {
        let required = std::env::var_os("PEERS_REQUIRED").is_some_and(|required| !required.is_empty());
        let sentence = format!(
            "{python} does not find canopen: install tests/peers/requirements.txt with pip and name that Python in PEERS_PYTHON"
        );
        assert!(!required, "{sentence}");
        eprintln!("skipped: {sentence}");
        return;
    }
    let interface = Interface::new("vcan11");
    let _drive = Process::drive(interface.0, 9);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/canopen_client.py");
    let client = Process::start(Command::new(python).args([script, interface.0, "9"]));
    // C0061 of a cold drive: 25 °C around it and 6 K of standby loss in the end; ×10000, low octet first.
    let line = expect(&client.out, "\"code\": 61");
    let octets: serde_json::Value = serde_json::from_str(&line).unwrap();
    let octets = octets["octets"].as_str().unwrap().to_owned();
    assert_eq!(octets.len(), 8, "{line}");
    let value = u32::from_str_radix(&octets, 16).unwrap().swap_bytes();
    assert!((25_0000..32_0000).contains(&value), "{value}");
    let line = expect(&client.out, "\"code\": 12");
    assert!(line.contains("400d0300"), "{line}");
    // Data 1 to 4 of the refusal as canopen reads them: 0x06060000.
    let line = expect(&client.out, "\"code\": 9998");
    assert!(line.contains("06060000"), "{line}");
}

#[test]
fn an_interface_that_goes_down_or_away_is_told_and_waited_for() {
    if !has_bus("an_interface_that_goes_down_or_away_is_told_and_waited_for") {
        return;
    }
    let interface = Interface::new("vcan12");
    let drive = Process::drive(interface.0, 1);
    ip_link("set vcan12 down");
    expect(&drive.errors, "vcan12 is down: ip link set vcan12 up");
    ip_link("set vcan12 up");
    expect(&drive.errors, "vcan12 is back");
    ip_link("del vcan12");
    expect(&drive.errors, "vcan12");
    ip_link("add dev vcan12 type vcan");
    ip_link("set vcan12 up");
    expect(&drive.errors, "vcan12 is back");
    let dump = Process::start(Command::new("candump").args(["-L", interface.0]));
    let until = Instant::now() + Duration::from_secs(10);
    loop {
        cansend(interface.0, "601#40F35F0000000000");
        let answered = dump
            .out
            .recv_timeout(Duration::from_millis(200))
            .is_ok_and(|line| line.contains("581#43F35F00"));
        if answered {
            break;
        }
        assert!(Instant::now() < until, "the drive does not answer again");
    }
}

#[test]
fn a_node_address_twice_and_an_interface_that_is_not_there_are_told() {
    if !has_bus("a_node_address_twice_and_an_interface_that_is_not_there_are_told") {
        return;
    }
    let interface = Interface::new("vcan13");
    let drive = Process::drive(interface.0, 3);
    cansend(interface.0, "583#60F35F0000000000");
    expect(&drive.errors, "identifier 1411 of node 3");
    expect(&drive.errors, "node address 3 is there once again");
    // The same with two of our drives: the second hears the answers of the first.
    let second = Process::drive(interface.0, 3);
    cansend(interface.0, "603#40F35F0000000000");
    expect(&drive.errors, "of node 3");
    expect(&second.errors, "of node 3");

    let lost =
        Process::start(Command::new(env!("CARGO_BIN_EXE_lenze9300-for-peers")).args(["serve", "--can", "vcan99"]));
    expect(&lost.errors, "vcan99: no such interface");
}

#[test]
fn a_bus_with_many_errors_and_a_controller_that_is_off_are_told_and_the_drive_answers_again() {
    if !has_bus("a_bus_with_many_errors_and_a_controller_that_is_off_are_told_and_the_drive_answers_again") {
        return;
    }
    let interface = Interface::new("vcan14");
    let drive = Process::drive(interface.0, 1);
    let dump = candump(interface.0);
    // Error frames as the driver of a controller makes them (linux/can/error.h): what a wrong bit rate looks like first, error passive
    // while sending (class 0x004, data 1 = 0x20), and then bus off (class 0x040).
    cansend(interface.0, "20000004#0020000000000000");
    expect(&drive.errors, "error passive): check bit rate");
    // CE4 shall be a warning: C0595 := 2.
    cansend(interface.0, "601#23AC5D00204E0000");
    expect(&dump.out, "581#60AC5D00");
    cansend(interface.0, "20000040#0000000000000000");
    expect(&drive.errors, "bus off: check bit rate and wiring");
    expect(&drive.errors, "system bus off (CE4)");
    // Off the bus it hears nothing.
    cansend(interface.0, "601#40F35F0000000000");
    std::thread::sleep(Duration::from_millis(100));
    // The controller was started again (class 0x100).
    cansend(interface.0, "20000100#0000000000000000");
    expect(&drive.errors, "system bus is back");
    cansend(interface.0, "601#40C25F0000000000");
    let first = expect(&dump.out, " 581#");
    assert!(first.contains("581#43C25F00"), "answered while off: {first}");
    // Fault memory, C0168/2 after the fault went: 2065 = warning CE4.
    let until = Instant::now() + Duration::from_secs(10);
    loop {
        cansend(interface.0, "601#40575F0200000000");
        let line = expect(&dump.out, " 581#43575F02");
        if line.contains("581#43575F0210183B01") {
            break;
        }
        assert!(Instant::now() < until, "CE4 is not in the fault memory: {line}");
    }
}
