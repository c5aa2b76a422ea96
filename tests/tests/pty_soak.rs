//! Block and drive in two processes over a pseudo-terminal, in real time, with every core busy beside them.
//!
//! Ten minutes: `SOAK_SECONDS=600 cargo test --release -p system-tests --test pty_soak -- --ignored --nocapture`.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A process that ends with the test, however the test ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    /// Resident memory, kB.
    fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id())).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
        line.split_whitespace().nth(1)?.parse().ok()
    }
}

/// Keeps every core busy until it is dropped.
struct Load(Arc<AtomicBool>);

impl Load {
    fn on_every_core() -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        for _ in 0..cores {
            let stop = Arc::clone(&stop);
            std::thread::spawn(move || while !stop.load(Ordering::Relaxed) {});
        }
        Self(stop)
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A feed with its pause on a machine that keeps up, s: 340 of them took 627 s.
const FEED_S: f64 = 1.85;

#[test]
#[ignore = "it takes every core, which the real-time tests beside it would feel; CI runs it alone"]
fn feeds_land_under_load_and_memory_stays() {
    let seconds = std::env::var("SOAK_SECONDS").map_or(8.0, |text| text.parse().expect("SOAK_SECONDS is a number"));
    let feeds = (seconds / FEED_S).ceil() as usize;
    let link = std::env::temp_dir().join(format!("film-feed-soak-{}", std::process::id()));
    let mut drive = Command::new(env!("CARGO_BIN_EXE_lenze9300-under-test"))
        .args(["serve", "--address", "3", "--pty"])
        .arg(&link)
        .stdout(Stdio::piped())
        .spawn()
        .map(Running)
        .expect("the drive starts");
    let mut line = String::new();
    let told = drive.0.stdout.take().expect("its output is piped");
    BufReader::new(told)
        .read_line(&mut line)
        .expect("it says that it answers");
    let mut master = Command::new(env!("CARGO_BIN_EXE_film-feed-under-test"))
        .args([
            "run",
            "--json",
            "--series",
            "length",
            "--address",
            "3",
            "--feeds",
            &feeds.to_string(),
            "--port",
        ])
        .arg(&link)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map(Running)
        .expect("film-feed starts");
    // The report is longer than a pipe's buffer.
    let mut out = master.0.stdout.take().expect("its output is piped");
    let report = std::thread::spawn(move || {
        let mut text = String::new();
        out.read_to_string(&mut text).map(|_| text)
    });
    let load = Load::on_every_core();

    // Threads and buffers are there after the first seconds.
    let begin = Instant::now();
    let (mut first, mut last) = (None, None);
    while !report.is_finished() {
        assert!(
            begin.elapsed().as_secs_f64() < 60.0 + 3.0 * seconds,
            "it waits for ever"
        );
        std::thread::sleep(Duration::from_millis(500));
        if let (Some(master), Some(drive)) = (master.memory(), drive.memory())
            && begin.elapsed() > Duration::from_secs(3)
        {
            first.get_or_insert((master, drive));
            last = Some((master, drive));
        }
    }
    drop(load);
    let text = report.join().expect("it reads").expect("it writes UTF-8");
    let report: serde_json::Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let (first, last) = (first.expect("memory was seen"), last.expect("memory was seen"));
    println!(
        "{feeds} feeds in {:.0} s, bus {}, memory in kB {first:?} -> {last:?}",
        begin.elapsed().as_secs_f64(),
        report["bus"]
    );
    assert_eq!(report["ok"], true, "{text}");
    let done = report["feeds"].as_array().expect("a list of feeds");
    assert_eq!(done.len(), feeds);
    assert!(done.iter().all(|feed| feed["finished"] == true), "{text}");
    // A leak of an octet a telegram would be 1.5 MB in ten minutes; what a page more or less is belongs to the system.
    assert!(
        last.0 < first.0 + 1024 && last.1 < first.1 + 1024,
        "{first:?} -> {last:?}"
    );
}
