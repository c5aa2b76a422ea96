//! `lenze9300 serve` answers DP masters that other people wrote, over pseudo-terminals, in real time.
//!
//! Every behaviour is tried with both masters. `pyprofibus` needs a Python that has it: `PEERS_PYTHON` names it, otherwise
//! `python3` is tried; without the package the test says so and passes, unless `PEERS_REQUIRED` is set.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use peers::{Drive, Event, Master, NullModem, Peer};

const LENZE9300: &str = env!("CARGO_BIN_EXE_lenze9300-for-peers");

/// C1204 = 179.0708 as its code stands in the drive: × 10000 = 1 790 708 (9300 fact sheet, section 3.2).
const C1204: Event = Event::Value {
    ok: true,
    index: 0x5B4B,
    data: [0x00, 0x1B, 0x52, 0xF4],
};

/// One at a time: the masters wait 10 to 50 ms for an answer, and a crowd of them would test the scheduler.
fn alone() -> MutexGuard<'static, ()> {
    static LINE: Mutex<()> = Mutex::new(());
    LINE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// `#[test]`s of one body for both masters.
macro_rules! with_both_masters {
    ($($name:ident)*) => {
        mod pyprofibus {
            $(
                #[test]
                fn $name() {
                    match peers::Peer::pyprofibus() {
                        Ok(peer) => super::$name(&peer),
                        Err(why) => super::skipped(&why),
                    }
                }
            )*
        }

        mod profirust {
            $(
                #[test]
                fn $name() {
                    let program = env!("CARGO_BIN_EXE_profirust-master").into();
                    super::$name(&peers::Peer::Profirust { program });
                }
            )*
        }
    };
}

with_both_masters! {
    c1204_is_read_at_every_baud_rate
    c1204_is_read_on_a_port_named_by_its_path
    lost_requests_and_answers_are_repeated
    a_drive_that_restarts_is_taken_back
    a_master_that_is_killed_and_comes_back_at_once_goes_on
    a_master_that_comes_back_after_the_watchdog_goes_on
}

/// Says so on the real standard error: what a passing test prints is not shown.
fn skipped(why: &str) {
    // Without a standard error there is nobody to tell.
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}

/// A name in the scratch directory that is free, and is freed with this value.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Scratch(std::env::temp_dir().join(format!("peers-line-{}-{number}", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Best effort: a drive that was killed could not take its link away.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The master reaches data exchange and `values` times reads C1204 right.
///
/// On a loaded machine an answer can be late and the master start anew; what it reads is right nevertheless.
fn reads(master: &Master, values: u32) {
    assert_eq!(master.event(), Event::DataExchange);
    for _ in 0..values {
        assert_eq!(master.value(), C1204);
    }
}

fn c1204_is_read_at_every_baud_rate(peer: &Peer) {
    let _alone = alone();
    for baud in [
        9_600, 19_200, 45_450, 93_750, 187_500, 500_000, 1_500_000, 3_000_000, 6_000_000, 12_000_000,
    ] {
        let link = Scratch::new();
        let _drive = Drive::on_pty(LENZE9300, &link.0, baud);
        let master = peer.start(&link.0, baud, 2);
        reads(&master, 2);
        assert!(
            matches!(master.event(), Event::Done { exchanges } if exchanges >= 3),
            "{baud} bit/s"
        );
    }
}

fn c1204_is_read_on_a_port_named_by_its_path(peer: &Peer) {
    let _alone = alone();
    let line = NullModem::new();
    let [ours, theirs] = line.ends();
    let _drive = Drive::on_port(LENZE9300, ours, 500_000);
    let master = peer.start(theirs, 500_000, 6);
    reads(&master, 6);
    assert!(matches!(master.event(), Event::Done { .. }));
}

/// The frame count bit of one of the masters goes stale when answers are lost; the other's is never reset.
fn lost_requests_and_answers_are_repeated(peer: &Peer) {
    let _alone = alone();
    let line = NullModem::new();
    let [ours, theirs] = line.ends();
    let _drive = Drive::on_port(LENZE9300, ours, 500_000);
    let master = peer.start(theirs, 500_000, 0);
    reads(&master, 1);
    let before = line.lost();
    line.lose_every(9);
    for _ in 0..12 {
        // A master may leave data exchange and come back; what it reads is right.
        assert_eq!(master.value(), C1204);
    }
    assert!(line.lost() >= before + 4, "{} lost", line.lost());
    line.lose_every(0);
    for _ in 0..4 {
        assert_eq!(master.value(), C1204);
    }
}

fn a_drive_that_restarts_is_taken_back(peer: &Peer) {
    let _alone = alone();
    let line = NullModem::new();
    let [ours, theirs] = line.ends();
    let drive = Drive::on_port(LENZE9300, ours, 500_000);
    let master = peer.start(theirs, 500_000, 0);
    reads(&master, 3);
    drop(drive);
    master.wait_for(|event| *event == Event::Left);
    let _drive = Drive::on_port(LENZE9300, ours, 500_000);
    master.wait_for(|event| *event == Event::DataExchange);
    for _ in 0..3 {
        assert_eq!(master.value(), C1204);
    }
}

/// Kills one master after three values, when the handshake bit of the drive is 1, and starts another.
fn killed_and_back(peer: &Peer, away: Duration) {
    let _alone = alone();
    let line = NullModem::new();
    let [ours, theirs] = line.ends();
    let _drive = Drive::on_port(LENZE9300, ours, 500_000);
    for _ in 0..3 {
        let master = peer.start(theirs, 500_000, 0);
        reads(&master, 3);
        drop(master);
        std::thread::sleep(away);
    }
    let master = peer.start(theirs, 500_000, 4);
    reads(&master, 4);
    assert!(matches!(master.event(), Event::Done { .. }));
}

fn a_master_that_is_killed_and_comes_back_at_once_goes_on(peer: &Peer) {
    killed_and_back(peer, Duration::ZERO);
}

/// The masters ask for a watchdog of 1 s.
fn a_master_that_comes_back_after_the_watchdog_goes_on(peer: &Peer) {
    killed_and_back(peer, Duration::from_millis(1_300));
}

#[test]
fn a_python_without_the_package_is_named_with_what_to_do() {
    let why = Peer::pyprofibus_of(Path::new("/nonexistent/python")).expect_err("there is none");
    for told in ["/nonexistent/python", "pyprofibus==1.13", "PEERS_PYTHON"] {
        assert!(why.contains(told), "{why}");
    }
}
