//! The port on a real interface of the kernel. Runs where `WITH_VCAN` is set, with interface vcan0 up and the right to change it; with
//! `REQUIRE_VCAN=1` its absence is a failure.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::process::Command;
use std::time::{Duration, Instant};

use lenze9300_model::bus::can::CanFrame;
use lenze9300_model::bus::can_port::{CanPort, CanPortError, ReopeningCanPort, SocketCanPort};

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

fn next_frame(port: &mut impl CanPort) -> Option<CanFrame> {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(2) {
        if let Some(frame) = port.receive(Duration::from_millis(20)).unwrap() {
            return Some(frame);
        }
    }
    None
}

/// Receives until something happened to the port.
fn next_event(port: &mut ReopeningCanPort) -> String {
    let begun = Instant::now();
    loop {
        assert!(begun.elapsed() < Duration::from_secs(5), "nothing was told");
        port.receive(Duration::from_millis(20)).unwrap();
        if let Some(event) = port.poll_event() {
            return event.to_string();
        }
    }
}

#[test]
fn frames_of_every_length_and_requests_arrive_as_they_were_sent() {
    if !has_bus("frames") {
        return;
    }
    let interface = Interface::new("vcframes");
    let mut near = SocketCanPort::open(interface.0).unwrap();
    let mut far = SocketCanPort::open(interface.0).unwrap();
    let octets = [0x23, 0xF3, 0x5F, 0x00, 0x40, 0x0D, 0x03, 0x00];
    for len in 0..=8 {
        let frame = CanFrame::new(0x600 + u16::try_from(len).unwrap(), &octets[..len]).unwrap();
        near.send(&frame).unwrap();
        assert_eq!(next_frame(&mut far), Some(frame));
    }
    let request = CanFrame::new_remote(0x701, 1).unwrap();
    far.send(&request).unwrap();
    assert_eq!(next_frame(&mut near), Some(request));
}

#[test]
fn frames_with_29_bits_are_passed_over() {
    if !has_bus("extended") {
        return;
    }
    let interface = Interface::new("vcext");
    let mut port = SocketCanPort::open(interface.0).unwrap();
    for frame in ["00000601#40C25F0000000000", "601#40C25F0000000000"] {
        let status = Command::new("cansend").args([interface.0, frame]).status().unwrap();
        assert!(status.success());
    }
    let frame = next_frame(&mut port).unwrap();
    assert_eq!(
        (frame.id(), frame.data()),
        (0x601, &[0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0][..])
    );
    assert_eq!(
        port.receive(Duration::from_millis(50)).unwrap(),
        None,
        "one of the two only"
    );
}

#[test]
fn an_interface_that_is_not_there_or_down_is_told_by_name_with_the_remedy() {
    if !has_bus("names") {
        return;
    }
    let error = SocketCanPort::open("vcnone").unwrap_err();
    assert_eq!(
        error.to_string(),
        "vcnone: no such interface; ip link lists those there are"
    );
    let interface = Interface::new("vcdown");
    ip_link("set vcdown down");
    let error = SocketCanPort::open(interface.0).unwrap_err();
    assert!(matches!(error, CanPortError::Down { .. }), "{error}");
    assert_eq!(error.to_string(), "vcdown is down: ip link set vcdown up");
}

#[test]
fn an_interface_that_goes_down_or_is_removed_is_told_and_used_again_when_it_is_back() {
    if !has_bus("recovery") {
        return;
    }
    let interface = Interface::new("vcback");
    let mut port = ReopeningCanPort::open(&interface.0.parse().unwrap()).unwrap();
    let frame = CanFrame::new(0x601, &[1, 2, 3]).unwrap();

    ip_link("set vcback down");
    assert_eq!(
        next_event(&mut port),
        "vcback is down: ip link set vcback up; waiting for it"
    );
    port.send(&frame).unwrap();
    ip_link("set vcback up");
    assert_eq!(next_event(&mut port), "vcback is back");

    ip_link("del vcback");
    assert_eq!(next_event(&mut port), "vcback was removed; waiting for it");
    ip_link("add dev vcback type vcan");
    ip_link("set vcback up");
    assert_eq!(next_event(&mut port), "vcback is back");

    let mut far = SocketCanPort::open(interface.0).unwrap();
    port.send(&frame).unwrap();
    assert_eq!(next_frame(&mut far), Some(frame));
    far.send(&frame).unwrap();
    assert_eq!(next_frame(&mut port), Some(frame));
}
