//! `dp read` and `dp write`, against a slave with connections of class 2 on a pseudo-terminal.

#![cfg(all(feature = "tool", unix))]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration as StdDuration;

use dp_master::address::Address;
use dp_master::dp::v1::{ErrorCode1, V1Capabilities, V1Error, V1Service};
use dp_master::dp::{AcceptedConfigurations, DpSlave, SlaveIdentity};
use dp_master::driver::Driver;
use dp_master::phy::PseudoTerminal;
use dp_master::time::{Baud, Duration};

use crate::common::slave::{IDENT, RunningSlave};
use crate::common::{Ended, Scratch, assert_refused, dp};

/// The index that is refused.
const REFUSED: u8 = 255;

/// Slot, index and data of a record that was written.
type Record = (u8, u8, Vec<u8>);

/// A slave at address 3 with one connection; what was written, with slot and index, is what its thread gives.
struct Records {
    link: Scratch,
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<Vec<Record>>>,
}

impl Records {
    /// Every record that is read holds 0, 1, 2, … 17.
    fn start() -> Self {
        let link = Scratch::new("line");
        let (mut port, _) = PseudoTerminal::open(Baud::B1500000).unwrap();
        port.link(&link.0).unwrap();
        let accepted = AcceptedConfigurations::Table(&[&[0x31]]);
        let mut slave = DpSlave::new(SlaveIdentity {
            latency_allowance: Duration::from_millis(20),
            v1: V1Capabilities {
                c2_connections: 1,
                ..V1Capabilities::NONE
            },
            ..SlaveIdentity::new(Address::new(3).unwrap(), IDENT, Baud::B1500000, accepted)
        })
        .unwrap();
        let end = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&end);
        let thread = std::thread::spawn(move || {
            let mut driver = Driver::new(port);
            let mut written = Vec::new();
            while !ended.load(Ordering::Relaxed) {
                driver.step(&mut slave, StdDuration::from_millis(5)).unwrap();
                while let Some(request) = slave.poll_v1_request() {
                    let record: Vec<u8> = (0..18).collect();
                    let answer = match request.service {
                        _ if request.service.place().1 == REFUSED => Err(V1Error::new(ErrorCode1::ACCESS_DENIED)),
                        V1Service::Write { slot, index, data } => {
                            written.push((slot, index, data.to_vec()));
                            Ok(&[][..])
                        }
                        _ => Ok(&record[..]),
                    };
                    slave.respond_v1(driver.now(), request.id, answer).unwrap();
                }
            }
            written
        });
        Self {
            link,
            end,
            thread: Some(thread),
        }
    }

    /// Ends it and gives what was written.
    fn stop(mut self) -> Vec<Record> {
        self.end.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Records {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

/// The command at address 3, slot 1, with these arguments behind.
fn at_slot_1(command: &str, line: &str, more: &[&str]) -> Ended {
    let mut arguments = vec![command, "--port", line, "--address", "3", "--slot", "1"];
    arguments.extend(more);
    dp(&arguments, "")
}

#[test]
fn a_record_is_read_in_rows_and_as_json_and_each_time_the_only_connection_is_free_again() {
    let slave = Records::start();
    let ended = at_slot_1("read", slave.link.path(), &["--index", "47"]);
    assert_eq!(
        (ended.code, ended.out.as_str()),
        (
            Some(0),
            "   0  00 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F\n  16  10 11\n"
        ),
        "{}",
        ended.err
    );
    let ended = at_slot_1("read", slave.link.path(), &["--index", "47", "--length", "2", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(
        report,
        serde_json::json!({"address": 3, "slot": 1, "index": 47, "data": "00 01"})
    );
    assert_eq!(ended.code, Some(0));
}

#[test]
fn a_record_is_written() {
    let slave = Records::start();
    let ended = at_slot_1("write", slave.link.path(), &["--index", "2", "--data", "01 02 FF"]);
    assert_eq!(
        (ended.code, ended.out.as_str()),
        (Some(0), "3 octets written\n"),
        "{}",
        ended.err
    );
    let ended = at_slot_1(
        "write",
        slave.link.path(),
        &["--index", "4", "--data", "0A0B", "--json"],
    );
    let report: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
    assert_eq!(
        report,
        serde_json::json!({"address": 3, "slot": 1, "index": 4, "written": 2})
    );
    assert_eq!(slave.stop(), [(1, 2, vec![0x01, 0x02, 0xFF]), (1, 4, vec![0x0A, 0x0B])]);
}

#[test]
fn a_record_that_answers_a_request_is_written_and_read_over_one_connection() {
    let slave = Records::start();
    let arguments = ["--index", "47", "--length", "2", "--request", "2A 01"];
    let ended = at_slot_1("read", slave.link.path(), &arguments);
    assert_eq!(
        (ended.code, ended.out.as_str()),
        (Some(0), "   0  00 01\n"),
        "{}",
        ended.err
    );
    assert_eq!(slave.stop(), [(1, 47, vec![0x2A, 0x01])]);
}

#[test]
fn a_refusal_of_the_slave_is_told() {
    let slave = Records::start();
    let sentence = format!(
        "dp: station 3 refuses slot 1 index 255: {}\n",
        V1Error::new(ErrorCode1::ACCESS_DENIED)
    );
    for (command, more) in [
        ("read", &["--index", "255"][..]),
        ("write", &["--index", "255", "--data", "01"]),
    ] {
        let ended = at_slot_1(command, slave.link.path(), more);
        assert_eq!((ended.code, ended.out.as_str()), (Some(1), ""), "{command}");
        assert_eq!(ended.err, sentence, "{command}");
    }
    assert!(sentence.contains("access denied"), "{sentence}");
    assert!(slave.stop().is_empty());
}

#[test]
fn a_slave_without_connections_is_told() {
    let slave = RunningSlave::start(3, &[]);
    let ended = at_slot_1("read", slave.link.path(), &["--index", "0"]);
    assert_eq!((ended.code, ended.out.as_str()), (Some(1), ""));
    assert!(
        ended.err.starts_with("dp: no connection to station 3: ")
            && ended.err.ends_with("; is it there, and does it speak DP-V1?\n"),
        "{}",
        ended.err
    );
}

#[test]
fn data_that_are_no_octets_or_too_many_are_refused() {
    let too_many = "00".repeat(241);
    for data in ["0G", "", &too_many] {
        let arguments = [
            "write",
            "--port",
            "x",
            "--address",
            "3",
            "--slot",
            "0",
            "--index",
            "0",
            "--data",
            data,
        ];
        let ended = dp(&arguments, "");
        assert_eq!((ended.code, ended.out.as_str()), (Some(2), ""), "{}", ended.err);
        assert!(ended.err.contains("--data <HEX>"), "{}", ended.err);
    }
    assert_refused(
        &[
            "write",
            "--port",
            "x",
            "--address",
            "3",
            "--slot",
            "0",
            "--index",
            "0",
            "--data",
            "0G",
        ],
        &[
            "invalid value '0G' for '--data <HEX>': allowed are 1…240 octets in hexadecimal, such as 0102 or \"01 02\"; \
             `dp help` and `dp COMMAND --help` list what is allowed",
        ],
    );
}
