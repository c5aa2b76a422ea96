//! Block and drive in two processes over a pseudo-terminal, in real time, with every core busy beside them.
//!
//! Ten minutes: `SOAK_SECONDS=600 cargo test --release -p system-tests --test pty_soak -- --ignored --nocapture`.
#![cfg(target_os = "linux")]

use std::io::Read;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use system_tests::running::Running;

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
    let mut command = Command::new(env!("CARGO_BIN_EXE_lenze9300-under-test"));
    let (drive, _) = Running::ready(command.args(["serve", "--address", "3", "--pty"]).arg(&link));
    let feeds_asked = feeds.to_string();
    let mut master = Running::start(
        Command::new(env!("CARGO_BIN_EXE_film-feed-under-test"))
            .args(["run", "--json", "--series", "length", "--address", "3"])
            .args(["--feeds", &feeds_asked, "--port"])
            .arg(&link)
            .stdout(Stdio::piped())
            .stderr(Stdio::null()),
    );
    // The report is longer than a pipe's buffer.
    let mut out = master.output();
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
