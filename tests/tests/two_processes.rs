//! The chain in two processes over a pseudo-terminal, in real time.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Path of a binary of the workspace, built if it is not there yet.
fn binary(package: &str, name: &str) -> PathBuf {
    // The test runs from target/<profile>/deps.
    let mut directory = std::env::current_exe().expect("a test knows its own path");
    directory.pop();
    directory.pop();
    let mut build = Command::new(env!("CARGO"));
    build.args(["build", "--quiet", "--package", package, "--bin", name]);
    if directory.ends_with("release") {
        build.arg("--release");
    }
    assert!(build.status().expect("cargo runs").success(), "{name} does not build");
    directory.join(name)
}

/// Ends the process with the test, however the test ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn serve(link: &PathBuf) -> Running {
    let mut child = Command::new(binary("lenze9300-model", "lenze9300"))
        .args(["serve", "--address", "3", "--pty"])
        .arg(link)
        .stdout(Stdio::piped())
        .spawn()
        .expect("the drive starts");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("its output is piped"))
        .read_line(&mut line)
        .expect("it says that it answers");
    assert!(line.contains("answering at address 3"), "{line}");
    Running(child)
}

fn scratch(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("film-feed-{}-{name}", std::process::id()))
}

#[test]
fn three_feeds_land_in_real_time() {
    let link = scratch("drive");
    let drive = serve(&link);
    let output = Command::new(binary("film-feed", "film-feed"))
        .args([
            "run",
            "--series",
            "length",
            "--feeds",
            "3",
            "--json",
            "--address",
            "3",
            "--port",
        ])
        .arg(&link)
        .output()
        .expect("film-feed runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let report: serde_json::Value = serde_json::from_str(&text)
        .unwrap_or_else(|error| panic!("{error}: {text} {}", String::from_utf8_lossy(&output.stderr)));
    assert!(output.status.success(), "{report}");
    let feeds = report["feeds"].as_array().expect("a list of feeds");
    assert_eq!(feeds.len(), 3);
    for feed in feeds {
        assert_eq!(feed["finished"], true, "{report}");
        assert!(
            feed["error_mm"].as_f64().is_some_and(|error| error.abs() <= 0.01),
            "{report}"
        );
        // Film-feed specification, section 9: cycle time 1.5 s, and what PLC, bus and settling add.
        assert!(
            feed["job_s"].as_f64().is_some_and(|job| (1.5..2.5).contains(&job)),
            "{report}"
        );
    }
    // Three feeds of 1.5 s cannot be over sooner in real time.
    assert!(report["wall_s"].as_f64().is_some_and(|wall| wall > 4.5), "{report}");
    drop(drive);
}

#[test]
fn a_drive_that_does_not_answer_is_told_in_one_sentence() {
    let link = scratch("other-address");
    let drive = serve(&link);
    let mut child = Command::new(binary("film-feed", "film-feed"))
        .args(["run", "--series", "length", "--feeds", "1", "--address", "7", "--port"])
        .arg(&link)
        .stdout(Stdio::piped())
        .spawn()
        .expect("film-feed runs");
    let waited = std::time::Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("the process can be asked") {
            break status;
        }
        assert!(waited.elapsed() < Duration::from_secs(60), "it waits for ever");
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!(status.code(), Some(1));
    drop(drive);
}
