//! A station in real time on a pseudo-terminal.

#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::address::Address;
use dp_master::driver::Driver;
use dp_master::phy::{Echo, Port, PortError, PortErrorKind, PseudoTerminal, SerialLine, SerialOptions};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Decoded, Decoder, Fcb, FunctionCode, RequestFunction, ResponseFunction, StationType, Telegram};

const BAUD: Baud = Baud::B187500;
const PATIENCE: StdDuration = StdDuration::from_secs(20);

/// Asks for the FDL status again and again, or answers it.
struct Simple {
    role: Role,
    decoder: Decoder,
    next: Option<Instant>,
    wants: bool,
    telegrams: usize,
    sent: Vec<(Instant, Instant)>,
    last_transmit: Instant,
    calls: usize,
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Asks,
    Answers,
}

impl Simple {
    fn new(role: Role) -> Self {
        Self {
            role,
            decoder: Decoder::new(),
            next: (role == Role::Asks).then_some(Instant::ZERO),
            wants: false,
            telegrams: 0,
            sent: Vec::new(),
            last_transmit: Instant::ZERO,
            calls: 0,
        }
    }
}

impl Station for Simple {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.calls += 1;
        let mut telegrams = 0;
        self.decoder.push(octets, |decoded| {
            telegrams += usize::from(matches!(decoded, Decoded::Telegram(Telegram::Data { .. })))
        });
        self.telegrams += telegrams;
        if telegrams > 0 {
            let pause = if self.role == Role::Asks { 33 } else { 11 };
            self.next = Some(now + BAUD.duration(BitTimes(pause)));
        }
    }
    fn handle_line_error(&mut self, _: Instant, _: LineError) {}
    fn handle_sent(&mut self, now: Instant) {
        self.calls += 1;
        self.sent.push((self.last_transmit, now));
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.calls += 1;
        self.wants = true;
        // An unanswered request is repeated after 20 ms.
        self.next = (self.role == Role::Asks).then_some(now + Duration::from_millis(20));
    }
    fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        if !std::mem::take(&mut self.wants) {
            return None;
        }
        self.last_transmit = now;
        let (master, slave) = (Address::new(2).unwrap(), Address::new(3).unwrap());
        let telegram = match self.role {
            Role::Asks => Telegram::no_data(
                slave,
                master,
                FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus),
            ),
            Role::Answers => Telegram::no_data(
                master,
                slave,
                FunctionCode::response(StationType::Slave, ResponseFunction::Ok),
            ),
        };
        Some(telegram.encode(buf).unwrap())
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.next
    }
}

/// A port that gives at once what it was told to, and nothing at once when there is nothing.
#[derive(Default)]
struct Scripted {
    incoming: Vec<u8>,
    outgoing: Vec<u8>,
}

impl Port for Scripted {
    fn receive(&mut self, buf: &mut [u8], _: StdDuration) -> Result<usize, PortError> {
        let octets = std::mem::take(&mut self.incoming);
        buf[..octets.len()].copy_from_slice(&octets);
        Ok(octets.len())
    }
    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        self.outgoing.extend_from_slice(octets);
        Ok(())
    }
    /// 11 bits of 1/9600 s: a character of 1.1 ms, 255 of them last 292 ms.
    fn baud(&self) -> Baud {
        Baud::B9600
    }
}

/// Sends what stands first for the next thing that happens to it, and notes what that was.
#[derive(Default)]
struct Told {
    first: &'static [u8],
    after_sent: &'static [u8],
    after_octets: &'static [u8],
    after_timeout: &'static [u8],
    due: Option<Instant>,
    said: Vec<&'static str>,
    sent_at: Instant,
    octets_at: Instant,
}

impl Station for Told {
    fn handle_octets(&mut self, now: Instant, _: &[u8]) {
        self.said.push("octets");
        self.octets_at = now;
        self.first = self.after_octets;
    }
    fn handle_line_error(&mut self, _: Instant, _: LineError) {}
    fn handle_sent(&mut self, now: Instant) {
        self.said.push("sent");
        self.sent_at = now;
        self.first = self.after_sent;
    }
    fn handle_timeout(&mut self, _: Instant) {
        self.said.push("timeout");
        self.due = None;
        self.first = self.after_timeout;
    }
    fn poll_transmit(&mut self, _: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let octets = std::mem::take(&mut self.first);
        buf[..octets.len()].copy_from_slice(octets);
        (!octets.is_empty()).then_some(octets.len())
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.due
    }
}

/// A directory of its own that goes away again.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("dp-master-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
    fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

fn read_exactly(port: &mut dyn Port, wanted: usize) -> Vec<u8> {
    let (mut all, mut buf, begin) = (Vec::new(), [0; 64], StdInstant::now());
    while all.len() < wanted && begin.elapsed() < PATIENCE {
        let received = port.receive(&mut buf, StdDuration::from_millis(100)).unwrap();
        all.extend_from_slice(&buf[..received]);
    }
    all
}

#[test]
fn two_stations_exchange_telegrams_over_a_pseudo_terminal_in_two_threads() {
    let (near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let done = AtomicBool::new(false);
    let (master, slave) = thread::scope(|scope| {
        let slave = scope.spawn(|| {
            let mut driver = Driver::new(SerialLine::open(&far_path, BAUD, SerialOptions::default()).unwrap());
            let mut slave = Simple::new(Role::Answers);
            while !done.load(Ordering::Relaxed) {
                driver.step(&mut slave, StdDuration::from_millis(10)).unwrap();
            }
            slave
        });
        let mut driver = Driver::new(near);
        let mut master = Simple::new(Role::Asks);
        let begin = StdInstant::now();
        while master.telegrams < 50 && begin.elapsed() < PATIENCE {
            driver.step(&mut master, StdDuration::from_millis(10)).unwrap();
        }
        done.store(true, Ordering::Relaxed);
        (master, slave.join().unwrap())
    });
    assert!(master.telegrams >= 50, "{} answers", master.telegrams);
    assert!(slave.telegrams >= 50);
    // Every transmission was reported once, and not later than its computed end plus the time of a step.
    assert!(master.sent.len() >= 50);
    for (begin, end) in &master.sent {
        assert!(*end > *begin);
        assert!(
            *end - *begin <= BAUD.characters(6),
            "a transmission of 6 characters lasted {}",
            *end - *begin
        );
    }
}

#[test]
fn a_step_sleeps_until_the_deadline_and_does_not_spin() {
    let (near, _far_path) = PseudoTerminal::open(BAUD).unwrap();
    let mut driver = Driver::new(near);
    let mut station = Simple::new(Role::Asks);
    let begin = StdInstant::now();
    let mut steps = 0;
    while begin.elapsed() < StdDuration::from_millis(200) {
        driver.step(&mut station, StdDuration::from_millis(50)).unwrap();
        steps += 1;
    }
    // A request every 20 ms: one step for each timeout and one for each end of transmission.
    assert!(steps <= 25, "{steps} steps in 200 ms");
    assert!(station.sent.len() >= 2);
}

#[test]
fn a_step_without_anything_to_do_returns_after_max_wait() {
    let (near, _far_path) = PseudoTerminal::open(BAUD).unwrap();
    let mut driver = Driver::new(near);
    let mut station = Simple::new(Role::Answers);
    let begin = StdInstant::now();
    let activity = driver.step(&mut station, StdDuration::from_millis(30)).unwrap();
    assert!(begin.elapsed() >= StdDuration::from_millis(29));
    assert_eq!((activity.received, activity.sent, station.calls), (0, 0, 0));
}

#[test]
fn a_transmission_ends_when_its_last_bit_has_left_and_not_before() {
    let mut driver = Driver::new(Scripted::default());
    let mut station = Told {
        first: &[0x55; 255],
        ..Told::default()
    };
    let activity = driver.step(&mut station, StdDuration::ZERO).unwrap();
    assert_eq!((activity.received, activity.sent), (0, 255));
    // 255 characters of 11 bits at 9600 bit/s.
    let least = Duration::from_micros(292_187);
    while driver.now() < Instant::ZERO + least {
        assert!(station.said.is_empty(), "told after {}", driver.now());
        driver.step(&mut station, StdDuration::ZERO).unwrap();
        thread::sleep(StdDuration::from_millis(5));
    }
    let begin = StdInstant::now();
    while station.said.is_empty() && begin.elapsed() < PATIENCE {
        driver.step(&mut station, StdDuration::ZERO).unwrap();
    }
    assert_eq!(station.said, ["sent"]);
    assert!(station.sent_at >= Instant::ZERO + least);
}

#[test]
fn an_answer_ends_the_transmission_that_it_answers() {
    // Adapters may be quicker than the baud rate they are set to; nobody answers what has not been sent.
    let mut driver = Driver::new(Scripted::default());
    let mut station = Told {
        first: &[0x55; 200],
        after_sent: &[0xDC, 0x02, 0x02],
        ..Told::default()
    };
    driver.port_mut().incoming = vec![0xE5];
    let activity = driver.step(&mut station, StdDuration::ZERO).unwrap();
    assert_eq!(station.said, ["sent", "octets"]);
    assert!(station.sent_at <= station.octets_at);
    assert_eq!((activity.received, activity.sent), (1, 203));
    assert_eq!(driver.into_port().outgoing.len(), 203);
}

#[test]
fn what_a_station_says_to_octets_and_to_a_timeout_is_sent_in_the_same_step() {
    let mut driver = Driver::new(Scripted::default());
    let mut station = Told {
        after_octets: &[0x10, 0x02, 0x03, 0x00, 0x05, 0x16],
        ..Told::default()
    };
    driver.port_mut().incoming = vec![0xE5; 4];
    let activity = driver.step(&mut station, StdDuration::ZERO).unwrap();
    assert_eq!((activity.received, activity.sent), (4, 6));
    assert_eq!(driver.port_mut().outgoing, station.after_octets);

    let mut driver = Driver::new(Scripted::default());
    let mut station = Told {
        after_timeout: &[0xDC, 0x02, 0x02],
        due: Some(Instant::ZERO),
        ..Told::default()
    };
    let activity = driver.step(&mut station, StdDuration::ZERO).unwrap();
    assert_eq!(station.said, ["timeout"]);
    assert_eq!((activity.received, activity.sent), (0, 3));

    let mut early = Told {
        due: Some(Instant::MAX),
        ..Told::default()
    };
    driver.port_mut().incoming = vec![0xE5];
    driver.step(&mut early, StdDuration::ZERO).unwrap();
    assert!(!early.said.contains(&"timeout"));
}

#[test]
fn the_station_counts_its_time_from_the_epoch_of_the_driver() {
    let epoch = StdInstant::now();
    let driver = Driver::with_epoch(Scripted::default(), epoch);
    let late = epoch + StdDuration::from_millis(5);
    assert_eq!(driver.at(late), Instant::ZERO + Duration::from_millis(5));
    assert_eq!(driver.at(epoch - StdDuration::from_millis(5)), Instant::ZERO);
    thread::sleep(StdDuration::from_millis(2));
    let (before, now) = (driver.at(StdInstant::now()), driver.now());
    assert!(before >= Instant::ZERO + Duration::from_millis(2));
    assert!(now >= before);
}

#[test]
fn a_pulled_adapter_is_an_error_of_the_step() {
    let (near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let mut driver = Driver::new(SerialLine::open(&far_path, BAUD, SerialOptions::default()).unwrap());
    let mut station = Simple::new(Role::Answers);
    driver.step(&mut station, StdDuration::from_millis(1)).unwrap();
    drop(near);
    let error = driver.step(&mut station, StdDuration::from_millis(100)).unwrap_err();
    assert_eq!(error.kind(), PortErrorKind::Unplugged);
    assert_eq!(error.to_string(), format!("port {} is gone", far_path.display()));
}

#[test]
fn a_peer_may_leave_and_come_back_without_an_error_at_our_end() {
    let (mut near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    for round in 0..3_u8 {
        let mut peer = SerialLine::open(&far_path, BAUD, SerialOptions::default()).unwrap();
        // All values, so that a terminal that is not raw would show.
        let octets: Vec<u8> = (0..=u8::MAX).map(|octet| octet ^ round).collect();
        peer.send(&octets).unwrap();
        assert_eq!(read_exactly(&mut near, 256), octets);
        near.send(&octets).unwrap();
        assert_eq!(read_exactly(&mut peer, 256), octets);
        drop(peer);
        assert_eq!(near.receive(&mut [0; 8], StdDuration::from_millis(5)).unwrap(), 0);
    }
}

#[test]
fn telegrams_wait_for_a_peer_that_reads_late() {
    let (mut near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let mut peer = SerialLine::open(&far_path, BAUD, SerialOptions::default()).unwrap();
    near.send(&[0xDC, 0x02, 0x02]).unwrap();
    near.send(&[0xE5]).unwrap();
    assert_eq!(read_exactly(&mut peer, 4), [0xDC, 0x02, 0x02, 0xE5]);
}

#[test]
fn octets_fall_off_a_pseudo_terminal_that_nobody_reads() {
    let (mut near, _far_path) = PseudoTerminal::open(BAUD).unwrap();
    for _ in 0..200 {
        near.send(&[0x55; 255]).unwrap();
    }
}

#[test]
fn an_adapter_that_hears_itself_gives_only_what_others_sent() {
    let (mut near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let mut line = SerialLine::open(
        &far_path,
        BAUD,
        SerialOptions {
            echo: Echo::Own,
            ..SerialOptions::default()
        },
    )
    .unwrap();
    line.send(&[0xDC, 0x02, 0x02]).unwrap();
    assert_eq!(read_exactly(&mut near, 3), [0xDC, 0x02, 0x02]);
    near.send(&[0xDC, 0x02]).unwrap();
    assert_eq!(line.receive(&mut [0; 64], StdDuration::from_millis(50)).unwrap(), 0);
    near.send(&[0x02, 0xE5]).unwrap();
    assert_eq!(read_exactly(&mut line, 1), [0xE5]);
}

#[test]
fn an_echo_that_is_another_octet_ends_what_is_taken_away() {
    let (mut near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let options = SerialOptions {
        echo: Echo::Own,
        ..SerialOptions::default()
    };
    let mut line = SerialLine::open(&far_path, BAUD, options).unwrap();
    line.send(&[0xDC, 0x02, 0x02]).unwrap();
    assert_eq!(read_exactly(&mut near, 3), [0xDC, 0x02, 0x02]);
    // The second octet collided; what looks like the third is a telegram of somebody else.
    near.send(&[0xDC, 0x99]).unwrap();
    assert_eq!(read_exactly(&mut line, 1), [0x99]);
    near.send(&[0x02, 0x02]).unwrap();
    assert_eq!(read_exactly(&mut line, 2), [0x02, 0x02]);
}

#[test]
fn two_programs_may_open_the_same_pseudo_terminal() {
    let (_near, far_path) = PseudoTerminal::open(BAUD).unwrap();
    let open = || SerialLine::open(&far_path, BAUD, SerialOptions::default());
    let (first, second) = (open().unwrap(), open().unwrap());
    assert_eq!((first.path(), second.baud()), (far_path.as_path(), BAUD));
}

// --- names and errors ---------------------------------------------------------------------------------------------------------------------

#[test]
fn what_cannot_be_opened_says_why_in_one_sentence() {
    let scratch = Scratch::new("open");
    let missing = scratch.join("ttyNone");
    let error = SerialLine::open(&missing, BAUD, SerialOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), format!("there is no port {}", missing.display()));
    assert_eq!(error.kind(), PortErrorKind::NotFound);

    let file = scratch.join("file");
    std::fs::write(&file, b"text").unwrap();
    for path in [file.as_path(), Path::new("/dev/null"), scratch.0.as_path()] {
        let error = SerialLine::open(path, BAUD, SerialOptions::default()).unwrap_err();
        assert!(matches!(error, PortError::NotASerialPort { .. }), "{error}");
        assert_eq!(error.to_string(), format!("{} is no serial port", path.display()));
    }
    assert_eq!(std::fs::read(&file).unwrap(), b"text");
}

#[test]
fn a_link_names_the_far_end_and_goes_away_with_it() {
    let scratch = Scratch::new("link");
    let link = scratch.join("drive");
    {
        let (mut near, far_path) = PseudoTerminal::open(BAUD).unwrap();
        near.link(&link).unwrap();
        assert_eq!(std::fs::read_link(&link).unwrap(), far_path);
        let mut peer = SerialLine::open(&link, BAUD, SerialOptions::default()).unwrap();
        peer.send(&[0xE5]).unwrap();
        assert_eq!(read_exactly(&mut near, 1), [0xE5]);
    }
    assert!(std::fs::symlink_metadata(&link).is_err());
}

#[test]
fn an_old_link_is_replaced_and_the_replaced_owner_leaves_the_new_one_alone() {
    let scratch = Scratch::new("relink");
    let link = scratch.join("drive");
    let (mut first, _) = PseudoTerminal::open(BAUD).unwrap();
    first.link(&link).unwrap();
    let (mut second, second_path) = PseudoTerminal::open(BAUD).unwrap();
    second.link(&link).unwrap();
    drop(first);
    assert_eq!(std::fs::read_link(&link).unwrap(), second_path);
    assert_eq!(
        std::fs::read_dir(&scratch.0).unwrap().count(),
        1,
        "nothing is left over"
    );
}

#[test]
fn a_link_does_not_overwrite_a_file_or_a_directory() {
    let scratch = Scratch::new("taken");
    let (mut near, _) = PseudoTerminal::open(BAUD).unwrap();
    let file = scratch.join("precious");
    std::fs::write(&file, b"data").unwrap();
    assert!(matches!(near.link(&file), Err(PortError::LinkTaken { .. })));
    assert_eq!(std::fs::read(&file).unwrap(), b"data");
    assert!(matches!(near.link(&scratch.0), Err(PortError::LinkTaken { .. })));
    drop(near);
    assert_eq!(std::fs::read(&file).unwrap(), b"data");
}
