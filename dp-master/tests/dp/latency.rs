//! A slave behind an operating system, where idle times of the line are not seen.

use dp_master::address::Address;
use dp_master::dp::{AcceptedConfigurations, DpSlave, SlaveIdentity};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};

// Request_FDL_Status from 2 to 3, and its reply: slave, OK (IEC 61158-4-3).
const STATUS_REQUEST: [u8; 6] = [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16];
const STATUS_REPLY: [u8; 6] = [0x10, 0x02, 0x03, 0x00, 0x05, 0x16];
/// The same request to a station that is not there.
const STATUS_REQUEST_TO_4: [u8; 6] = [0x10, 0x04, 0x02, 0x49, 0x4F, 0x16];
/// Shorter than the allowance: the master never leaves the line idle for as long as that.
const POLL_PERIOD: Duration = Duration::from_millis(8);
const BAUD: Baud = Baud::B500000;

struct Line {
    slave: DpSlave,
    now: Instant,
}

impl Line {
    fn with_allowance(latency_allowance: Duration) -> Self {
        let address = Address::new(3).expect("a station");
        let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
        let identity = SlaveIdentity {
            latency_allowance,
            ..SlaveIdentity::new(address, 0x00DA, BAUD, accepted)
        };
        Self {
            slave: DpSlave::new(identity).expect("a slave"),
            now: Instant::ZERO + Duration::from_millis(1000),
        }
    }

    /// Octets that are read now, and what the slave sends within 1 ms.
    fn give(&mut self, octets: &[u8]) -> Option<Vec<u8>> {
        self.slave.handle_octets(self.now, octets);
        let mut buf = [0; MAX_TELEGRAM];
        assert_eq!(self.slave.poll_transmit(self.now, &mut buf), None, "before Tsdr");
        let due = self.slave.poll_timeout()?;
        assert!(due <= self.now + Duration::from_millis(1));
        self.slave.handle_timeout(due);
        let length = self.slave.poll_transmit(due, &mut buf)?;
        Some(buf[..length].to_vec())
    }

    fn poll(&mut self) -> Option<Vec<u8>> {
        self.now += POLL_PERIOD;
        self.give(&STATUS_REQUEST)
    }
}

fn line() -> Line {
    Line::with_allowance(Duration::from_millis(20))
}

#[test]
fn after_one_bad_octet_and_a_pause_of_tsyn_the_next_request_is_answered() {
    let mut line = line();
    assert!(line.poll().is_some());
    line.now += Duration::from_millis(1);
    assert_eq!(line.give(&[0x00]), None);
    for _ in 0..10 {
        assert_eq!(line.poll().as_deref(), Some(&STATUS_REPLY[..]));
    }
}

#[test]
fn after_one_bad_octet_without_any_pause_the_second_request_is_answered() {
    let mut line = line();
    assert!(line.poll().is_some());
    line.now += Duration::from_millis(1);
    assert_eq!(line.give(&[0x00]), None);
    let mut next = || {
        line.now += BAUD.characters(STATUS_REQUEST.len());
        line.give(&STATUS_REQUEST)
    };
    assert_eq!(next(), None, "it may be a pattern inside a broken telegram");
    assert_eq!(next().as_deref(), Some(&STATUS_REPLY[..]));
}

#[test]
fn a_character_left_behind_by_each_request_does_not_matter() {
    let mut line = line();
    let mut octets = STATUS_REQUEST.to_vec();
    octets.push(0x00);
    for _ in 0..10 {
        line.now += POLL_PERIOD;
        assert_eq!(line.give(&octets).as_deref(), Some(&STATUS_REPLY[..]));
    }
}

#[test]
fn a_disturbance_that_looks_like_a_long_telegram_does_not_swallow_what_follows_for_long() {
    let mut line = line();
    assert!(line.poll().is_some());
    line.now += Duration::from_millis(1);
    assert_eq!(line.give(&[0x68, 0xF9, 0xF9, 0x68]), None);
    // 255 characters are 5.6 ms, the allowance 20 ms: over with the fourth request, which synchronises; the fifth is answered.
    for _ in 0..4 {
        assert_eq!(line.poll(), None);
    }
    assert_eq!(line.poll().as_deref(), Some(&STATUS_REPLY[..]));
}

#[test]
fn a_telegram_in_pieces_with_forgiven_gaps_is_one() {
    let mut line = line();
    let (first, rest) = STATUS_REQUEST.split_at(1);
    line.now += POLL_PERIOD;
    assert_eq!(line.give(first), None);
    line.now += Duration::from_millis(15);
    assert_eq!(line.give(rest).as_deref(), Some(&STATUS_REPLY[..]));
}

#[test]
fn what_stands_behind_a_request_withdraws_its_reply() {
    let mut line = line();
    let mut octets = STATUS_REQUEST.to_vec();
    octets.extend(STATUS_REQUEST_TO_4);
    assert_eq!(line.give(&octets), None, "the master has gone on");
    line.now += POLL_PERIOD;
    octets.truncate(STATUS_REQUEST.len() + 1);
    assert_eq!(line.give(&octets), None, "somebody speaks");
}

#[test]
fn without_an_allowance_only_an_idle_line_ends_the_waiting() {
    let mut line = Line::with_allowance(Duration::ZERO);
    assert!(line.poll().is_some());
    line.now += Duration::from_millis(1);
    assert_eq!(line.give(&[0x00]), None);
    // Three requests without a pause, each 6 characters of 22 µs after the one before; Tsyn is 33 bits, 66 µs.
    for _ in 0..3 {
        line.now += BAUD.characters(STATUS_REQUEST.len());
        assert_eq!(line.give(&STATUS_REQUEST), None);
    }
    line.now += BAUD.characters(STATUS_REQUEST.len()) + Duration::from_micros(66);
    assert_eq!(line.give(&STATUS_REQUEST).as_deref(), Some(&STATUS_REPLY[..]));
}
