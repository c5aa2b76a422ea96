//! The chain in two processes over a pseudo-terminal, in real time.
//!
//! The only tests that look at a clock. Upper bounds are generous: a loaded machine makes everything slower, and nothing
//! may fail for that.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use dp_master::phy::{Port, PseudoTerminal};
use dp_master::time::Baud;
use system_tests::running::{Ended, Running};

/// `film-feed` and `lenze9300`, built for this test.
const FILM_FEED: &str = env!("CARGO_BIN_EXE_film-feed-under-test");
const LENZE9300: &str = env!("CARGO_BIN_EXE_lenze9300-under-test");

/// `lenze9300 serve` behind a pseudo-terminal linked at `link`, ready to answer at address 3.
fn serve(link: &Path) -> Running {
    let mut command = Command::new(LENZE9300);
    let (drive, line) = Running::ready(command.args(["serve", "--address", "3", "--pty"]).arg(link));
    assert!(line.contains("answering at address 3"), "{line}");
    assert!(line.contains("/dev/"), "it names the terminal: {line}");
    drive
}

/// `film-feed run` against that link.
fn film_feed(link: &Path, arguments: &[&str]) -> Running {
    Running::start(
        Command::new(FILM_FEED)
            .args(["run", "--json", "--port"])
            .arg(link)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped()),
    )
}

fn report(told: &str) -> serde_json::Value {
    serde_json::from_str(told).unwrap_or_else(|error| panic!("{error}: {told}"))
}

/// A name in the scratch directory that is free, and is freed with this value.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Scratch(std::env::temp_dir().join(format!("film-feed-line-{}-{number}", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Best effort; most often the drive has taken its link away.
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn three_feeds_land_in_real_time() {
    let link = Scratch::new();
    let drive = serve(&link.0);
    let Ended {
        status,
        told,
        complained,
    } = film_feed(&link.0, &["--series", "length", "--feeds", "3", "--address", "3"]).end();
    let report = report(&told);
    assert!(status.success(), "{report} {complained}");
    let feeds = report["feeds"].as_array().expect("a list of feeds");
    assert_eq!(feeds.len(), 3);
    for feed in feeds {
        assert_eq!(feed["finished"], true, "{report}");
        assert!(
            feed["error_mm"].as_f64().is_some_and(|error| error.abs() <= 0.01),
            "{report}"
        );
        // Film-feed specification, section 9: cycle time 1.5 s. A drive that was held up makes up for 100 ms at most;
        // what PLC, bus, settling and a loaded machine add has no bound worth a test.
        assert!(feed["job_s"].as_f64().is_some_and(|job| job > 1.4), "{report}");
    }
    assert!(
        report["wall_s"].as_f64().is_some_and(|wall| wall > 3.0 * 1.4),
        "it was no real time: {report}"
    );
    assert_eq!(report["parameters"].as_array().map(Vec::len), Some(0), "{report}");
    drop(drive);
}

#[test]
fn a_feed_to_the_mark_of_the_drives_own_reader_lands() {
    let link = Scratch::new();
    let drive = serve(&link.0);
    let Ended {
        status,
        told,
        complained,
    } = film_feed(&link.0, &["--print-marks", "--feeds", "1"]).end();
    let report = report(&told);
    assert!(status.success(), "{report} {complained}");
    // Marks every 1200 mm, the film 50 mm behind one: the whole way is one distance (film-feed specification, section 6).
    let moved = report["feeds"][0]["film_mm"].as_f64().expect("POS_ACT is a number");
    assert!((moved - 1200.0).abs() <= 0.02, "{report}");
    drop(drive);
}

#[test]
fn a_drive_that_does_not_answer_is_told_in_one_sentence() {
    let link = Scratch::new();
    let drive = serve(&link.0);
    let Ended {
        status,
        told,
        complained,
    } = film_feed(&link.0, &["--feeds", "1", "--address", "7"]).end();
    assert_eq!(status.code(), Some(1), "{told} {complained}");
    let report = report(&told);
    assert_eq!(report["ok"], false);
    assert_eq!(report["feeds"].as_array().map(Vec::len), Some(0));
    let reason = report["aborted"].as_str().expect("it says why");
    assert!(reason.contains("did not become ready"), "{reason}");
    drop(drive);
}

#[test]
fn a_drive_killed_in_mid_run_ends_the_run_with_one_reason() {
    let link = Scratch::new();
    let mut drive = serve(&link.0);
    let run = film_feed(&link.0, &["--series", "length", "--feeds", "100"]);
    std::thread::sleep(Duration::from_secs(3));
    drive.kill();
    let Ended {
        status,
        told,
        complained,
    } = run.end();
    assert_eq!(status.code(), Some(1), "{told} {complained}");
    assert!(
        complained.lines().count() == 1 && complained.ends_with("is gone, waiting for it to come back\n"),
        "{complained}"
    );
    let report = report(&told);
    assert_eq!(report["ok"], false);
    let reason = report["aborted"].as_str().expect("it says why");
    assert!(
        reason.starts_with("the line broke in mid-run: ") && reason.ends_with("is gone"),
        "{reason}"
    );
    assert!(!reason.contains('\n'), "{reason}");
    drop(drive);

    // The killed drive left its link behind, which leads nowhere now: one sentence for who wants to use it …
    assert!(
        std::fs::symlink_metadata(&link.0).is_ok(),
        "there is no stale link to test with"
    );
    let Ended {
        status,
        told,
        complained,
    } = film_feed(&link.0, &["--feeds", "1"]).end();
    assert_eq!((status.code(), told.as_str()), (Some(2), ""));
    assert_eq!(complained.lines().count(), 1, "{complained}");
    // … and no hindrance for the next drive.
    let next = serve(&link.0);
    assert!(std::fs::metadata(&link.0).is_ok(), "the link still leads nowhere");
    let Ended {
        status,
        told,
        complained,
    } = film_feed(&link.0, &["--series", "length", "--feeds", "1"]).end();
    assert!(status.success(), "{told} {complained}");
    drop(next);
}

#[test]
fn a_drive_that_falls_silent_in_mid_run_ends_the_run_with_one_reason() {
    let link = Scratch::new();
    let drive = serve(&link.0);
    let run = film_feed(&link.0, &["--series", "length", "--feeds", "100"]);
    std::thread::sleep(Duration::from_secs(3));
    // Stopped, not ended: the line is there, nobody answers, and in time nobody empties it either.
    drive.signal("STOP");
    let Ended {
        status,
        told,
        complained,
    } = run.end();
    assert_eq!(status.code(), Some(1), "{told} {complained}");
    let report = report(&told);
    let reason = report["aborted"].as_str().expect("it says why");
    let reasons = [
        "the drive left the bus in mid-run: ",
        "takes no octets",
        "did not become ready",
    ];
    assert!(reasons.into_iter().any(|known| reason.contains(known)), "{reason}");
    drop(drive);
}

/// Asks the station for its FDL status until it answers.
fn answers(line: &mut PseudoTerminal) -> bool {
    // SD1, DA 3, SA 2, FC 49, FCS 4E, ED; the answer of a slave is FC 00 (film-feed specification, section 2).
    let (question, answer) = (
        [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16],
        [0x10, 0x02, 0x03, 0x00, 0x05, 0x16],
    );
    let (asked, mut heard) = (Instant::now(), Vec::new());
    while asked.elapsed() < Duration::from_secs(20) {
        line.send(&question).expect("the terminal takes octets");
        let mut octets = [0; 64];
        let received = line
            .receive(&mut octets, Duration::from_millis(100))
            .expect("it can be read");
        heard.extend_from_slice(&octets[..received]);
        if heard.windows(answer.len()).any(|window| window == answer) {
            return true;
        }
    }
    false
}

#[test]
fn a_drive_whose_adapter_was_pulled_answers_again_when_it_is_plugged_in() {
    let link = Scratch::new();
    let plug = || {
        let (mut line, _) = PseudoTerminal::open(Baud::B1500000).expect("there is another terminal");
        line.link(&link.0).expect("its name is free");
        line
    };
    let mut line = plug();
    let mut drive = Running::start(
        Command::new(LENZE9300)
            .args(["serve", "--address", "3", "--port"])
            .arg(&link.0)
            .stdout(Stdio::null())
            .stderr(Stdio::piped()),
    );
    let mut errors = BufReader::new(drive.errors());
    let mut told = || {
        let mut sentence = String::new();
        errors.read_line(&mut sentence).expect("it says what happened");
        sentence
    };
    assert!(answers(&mut line));
    drop(line);
    let gone = format!(
        "lenze9300: port {} is gone, waiting for it to come back\n",
        link.0.display()
    );
    assert_eq!(told(), gone);
    let mut line = plug();
    assert!(told().starts_with("lenze9300: the port is back after "));
    assert!(answers(&mut line));
    drop(drive);
}

#[test]
fn a_name_that_is_taken_by_a_file_is_refused_and_the_file_stays() {
    let taken = Scratch::new();
    std::fs::write(&taken.0, "mine").unwrap();
    let output = Command::new(LENZE9300)
        .args(["serve", "--pty"])
        .arg(&taken.0)
        .output()
        .expect("the drive starts");
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    let complained = String::from_utf8_lossy(&output.stderr);
    assert_eq!(complained.lines().count(), 1, "{complained}");
    assert!(
        complained.starts_with("lenze9300: ") && complained.contains("not overwritten"),
        "{complained}"
    );
    assert_eq!(std::fs::read_to_string(&taken.0).unwrap(), "mine");
}

#[test]
fn the_drives_bad_input_gets_one_sentence_too() {
    for (arguments, named) in [
        (&["serve"][..], "--port"),
        (
            &["serve", "--port", "/nonexistent-directory/x"],
            "/nonexistent-directory/x",
        ),
        (
            &["serve", "--pty", "/nonexistent-directory/x"],
            "/nonexistent-directory/x",
        ),
        (&["serve", "--pty", "x", "--baud", "115200"], "187500"),
        (&["serve", "--pty", "x", "--address", "126"], "0..=125"),
        (&["serve", "--pty", "x", "--ident", "XYZ"], "0x0000…0xFFFF"),
        (&["serve", "--pty", "x", "--marks-every", "100"], "200.0…2000.0 mm"),
        (&["serve", "--pty", "x", "--port", "y"], "--port"),
        (&["dance"], "dance"),
        (&[], "subcommand"),
    ] {
        let output = Command::new(LENZE9300)
            .args(arguments)
            .output()
            .expect("the drive starts");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        let complained = String::from_utf8_lossy(&output.stderr);
        assert_eq!(complained.lines().count(), 1, "{arguments:?}: {complained}");
        assert!(
            complained.starts_with("lenze9300: ") && complained.contains(named),
            "{arguments:?}: {complained}"
        );
    }
    assert!(!Path::new("x").exists(), "nothing half done");
}
