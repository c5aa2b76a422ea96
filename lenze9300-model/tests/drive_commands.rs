//! `lenze9300 param`, `scope`, `monitor` and `program` against a served drive, as processes: over the system bus through two slcan adapters,
//! which are played here, over PROFIBUS DP-V1 on a pseudo-terminal, and on a parameter file.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;

use serde_json::Value;

fn lenze9300(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lenze9300"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// Adapters on one bus: what one is told to send, all others tell. LAWICEL protocol: `t` with identifier, length and octets.
struct Bus {
    name: String,
}

impl Bus {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let name = format!("slcan:tcp://{}@500", listener.local_addr().unwrap());
        let adapters: Arc<Mutex<Vec<TcpStream>>> = Arc::default();
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                stream.set_nodelay(true).unwrap();
                adapters.lock().unwrap().push(stream.try_clone().unwrap());
                let others = Arc::clone(&adapters);
                thread::spawn(move || adapter(stream, &others));
            }
        });
        Self { name }
    }
}

fn adapter(mut stream: TcpStream, adapters: &Mutex<Vec<TcpStream>>) {
    let own = stream.peer_addr().unwrap();
    let mut line = Vec::new();
    let mut octet = [0];
    while stream.read_exact(&mut octet).is_ok() {
        if octet[0] != b'\r' {
            line.push(octet[0]);
            continue;
        }
        let answer: &[u8] = match line.first() {
            Some(b't') => {
                line.push(b'\r');
                for other in adapters.lock().unwrap().iter_mut() {
                    // Who has hung up hears nothing.
                    if other.peer_addr().is_ok_and(|peer| peer != own) {
                        let _ = other.write_all(&line);
                    }
                }
                b"z\r"
            }
            Some(b'F') => b"F00\r",
            _ => b"\r",
        };
        line.clear();
        if stream.write_all(answer).is_err() {
            return;
        }
    }
}

/// `lenze9300 serve`, ready; ended with its test.
struct Served(Child);

impl Served {
    fn new(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_lenze9300"))
            .arg("serve")
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        assert!(line.starts_with("answering"), "{line}");
        Self(child)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A directory of its own for each test, gone with it.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lenze9300-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Best effort.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn told(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn complained(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// What every way to a drive must do; `way` are its options.
fn the_whole_job(way: &[&str], scratch: &Scratch) {
    let run = |command: &[&str]| lenze9300(&[&["param"], command, way].concat());

    let output = run(&["write", "C0012=20", "C1301/40=987.5"]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    let output = run(&["read", "C0012", "C1301/40", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    let rows: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(rows[0]["raw"], 20_0000);
    assert_eq!(
        (&rows[1]["value"], &rows[1]["unit"]),
        (&"987.5000".into(), &"units".into())
    );

    // What is refused is told with the code, and is no success.
    let output = run(&["read", "C0012", "C9998"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        told(&output).contains("20.00") && !told(&output).contains("C9998"),
        "{}",
        told(&output)
    );
    let complaint = complained(&output);
    assert!(complaint.contains("C9998 could not be read: "), "{complaint}");
    let output = run(&["write", "C0061=20", "C0012=21"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complained(&output).contains("0 of 2 codes written, 1 not tried"),
        "{}",
        complained(&output)
    );
    let output = run(&["read", "C0012"]);
    assert!(
        told(&output).contains("20.00"),
        "what came after the refusal was not written: {}",
        told(&output)
    );

    // Saved, changed, compared, loaded, compared again.
    let file = scratch.path("saved.toml");
    let output = run(&["save", &file]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    assert!(
        std::fs::read_to_string(&file)
            .unwrap()
            .contains("\"C1301/40\" = 987.5000")
    );
    assert_eq!(run(&["compare", &file]).status.code(), Some(0));
    assert_eq!(run(&["write", "C1301/40=1"]).status.code(), Some(0));
    let output = run(&["compare", &file, "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let differences: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(differences.as_array().unwrap().len(), 1);
    assert_eq!(
        (&differences[0]["drive"], &differences[0]["expected"]),
        (&"1.0000".into(), &"987.5000".into())
    );
    std::fs::write(&file, "[codes]\n\"C1301/40\" = 987.5\n").unwrap();
    assert_eq!(run(&["load", &file]).status.code(), Some(0));
    let output = run(&["read", "C1301/40"]);
    assert!(told(&output).contains("987.5"), "{}", told(&output));
}

#[test]
fn a_place_where_nothing_can_be_kept_is_told_before_a_drive_is_asked() {
    let output = lenze9300(&[
        "param",
        "save",
        "/nonexistent-directory/x.toml",
        "--port",
        "/nonexistent-directory/port",
    ]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        complained(&output).contains("/nonexistent-directory/x.toml cannot be written"),
        "{}",
        complained(&output)
    );
}

#[test]
fn codes_over_the_system_bus() {
    let bus = Bus::new();
    let _drive = Served::new(&["--can", &bus.name, "--node", "7"]);
    let scratch = Scratch::new("can");
    the_whole_job(&["--can", &bus.name, "--node", "7"], &scratch);

    // The other channel, while the first is used by somebody else.
    let output = lenze9300(&[
        "param",
        "read",
        "C0061",
        "--can",
        &bus.name,
        "--node",
        "7",
        "--channel",
        "2",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    // 25 °C around a cold drive, 6 K of standby loss in the end.
    assert!(
        told(&output).contains("°C") && told(&output).contains("heat-sink"),
        "{}",
        told(&output)
    );

    // Nobody has this address.
    let output = lenze9300(&["param", "read", "C0061", "--can", &bus.name, "--node", "9"]);
    assert_eq!(output.status.code(), Some(1));
    let complaint = complained(&output);
    assert!(
        complaint.contains("C0061/0: node 9 does not answer (3 attempts)"),
        "{complaint}"
    );
    assert_eq!(complaint.lines().count(), 1);

    let output = lenze9300(&["monitor", "--once", "--can", &bus.name, "--node", "7"]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    for part in ["C0183", "C0067    0  fault: none", "C0150", "C0053", "565.", "C0359"] {
        assert!(told(&output).contains(part), "{part}: {}", told(&output));
    }

    let (csv, svg) = (scratch.path("s.csv"), scratch.path("s.svg"));
    let output = lenze9300(&[
        "scope",
        "--can",
        &bus.name,
        "--node",
        "7",
        "--channels",
        "N-ACT,C0053",
        "--time",
        "0.5",
        "--interval",
        "20",
        "--out",
        &csv,
        "--svg",
        &svg,
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    let csv = std::fs::read_to_string(csv).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("time_s,N-ACT rpm,C0053 V"));
    let rows = lines.count();
    assert!((5..=26).contains(&rows), "{rows}");
    assert!(csv.lines().nth(1).unwrap().contains(",565."), "{csv}");
    assert!(std::fs::read_to_string(svg).unwrap().contains("C0053 in V"));

    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/programs/film-feed.toml");
    let output = lenze9300(&["program", "load", program, "--can", &bus.name, "--node", "7"]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    assert!(told(&output).contains("records"), "{}", told(&output));

    // What the file says reaches the drive, whatever the drive held: 1200 units is what a commissioned drive has (9300 facts 11).
    let node = ["--can", bus.name.as_str(), "--node", "7"];
    let own = scratch.path("own.toml");
    let record = std::fs::read_to_string(program).unwrap();
    std::fs::write(&own, format!("{record}\n[codes]\n\"C1301/1\" = 1200.0\n")).unwrap();
    let run = |command: &[&str]| lenze9300(&[command, &node].concat());
    let output = lenze9300(&["program", "check", &own, "--json"]);
    let told_of: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&told_of["records"], &told_of["codes"]), (&4.into(), &1.into()));
    assert_eq!(run(&["param", "write", "C1301/1=5"]).status.code(), Some(0));
    let output = run(&["program", "load", &own]);
    assert!(told(&output).starts_with("1 code written"), "{}", told(&output));
    let output = run(&["param", "read", "C1301/1"]);
    assert!(told(&output).contains("1200.0000 units"), "{}", told(&output));
}

/// Starts a recording that would take a minute, lets `end` end it, and gives what it left.
fn recorded(name: &str, end: impl FnOnce(&Child, &mut Served)) -> (Output, String) {
    let bus = Bus::new();
    let mut drive = Served::new(&["--can", &bus.name, "--node", "7"]);
    let scratch = Scratch::new(name);
    let csv = scratch.path("run.csv");
    let arguments = [
        "scope", "--can", &bus.name, "--node", "7", "--time", "60", "--out", &csv, "--json",
    ];
    let recorder = Command::new(env!("CARGO_BIN_EXE_lenze9300"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    thread::sleep(std::time::Duration::from_millis(1500));
    end(&recorder, &mut drive);
    let output = recorder.wait_with_output().unwrap();
    (output, std::fs::read_to_string(csv).unwrap())
}

#[test]
fn a_recording_that_is_interrupted_is_kept() {
    let (output, csv) = recorded("interrupted", |recorder, _| {
        let pid = recorder.id().to_string();
        assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    });
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    let recording: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(recording["interrupted"], true);
    assert_eq!(recording["samples"], csv.lines().count() - 1);
    assert!(csv.lines().count() > 5, "{csv}");
}

#[test]
fn a_recording_whose_drive_goes_away_is_kept() {
    let (output, csv) = recorded("gone", |_, drive| drive.0.kill().unwrap());
    assert_eq!(output.status.code(), Some(1), "{}", complained(&output));
    let complaint = complained(&output);
    assert!(
        complaint.contains("node 7 does not answer") && complaint.contains("what was recorded before is written"),
        "{complaint}"
    );
    assert!(csv.lines().count() > 5, "{csv}");
}

#[test]
fn codes_over_profibus_beside_nobody() {
    let scratch = Scratch::new("dpv1");
    let line = scratch.path("line");
    let _drive = Served::new(&["--pty", &line]);
    let way = ["--port", line.as_str()];
    let run = |command: &[&str]| lenze9300(&[&["param"], command, &way].concat());
    let output = run(&["write", "C0012=20", "C1301/40=987.5"]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    let output = run(&["read", "C0012", "C1301/40", "C0135"]);
    assert_eq!(output.status.code(), Some(0), "{}", complained(&output));
    assert!(told(&output).contains("987.5000 units"), "{}", told(&output));
    let output = run(&["read", "C9998"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complained(&output).contains("the drive has no such code"),
        "{}",
        complained(&output)
    );
    let output = lenze9300(&["param", "read", "C0012", "--port", &line, "--address", "9"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complained(&output).contains("station 9"), "{}", complained(&output));
}

#[test]
fn codes_in_a_file() {
    let scratch = Scratch::new("file");
    let file = scratch.path("drive.toml");
    the_whole_job(&["--file", &file], &scratch);
    let output = lenze9300(&["param", "compare", "--file", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(told(&output).ends_with("2 codes differ\n"), "{}", told(&output));
    // Refusals speak the code's own unit: 0 to 999.9 s (9300 facts 4.4).
    let output = lenze9300(&["param", "write", "C0105=1000", "--file", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(told(&output), "");
    let complaint = complained(&output);
    assert!(
        complaint
            .contains("C0105 does not take 1000.000 s: 1000.000 s is above 999.900 s; allowed is 0.000…999.900 s\n"),
        "{complaint}"
    );
    let output = lenze9300(&["param", "read", "C9998", "--file", &file]);
    assert_eq!(told(&output), "");
    assert_eq!(
        complained(&output),
        "lenze9300: C9998 could not be read: does not exist\n"
    );

    let output = lenze9300(&["param", "list", "--file", &file]);
    assert!(
        told(&output).lines().count() > 300 && told(&output).contains("C0011"),
        "{}",
        told(&output)
    );
}

#[test]
fn mistakes_are_told_in_one_sentence_before_anything_is_touched() {
    let scratch = Scratch::new("mistakes");
    let file = scratch.path("wrong.toml");
    std::fs::write(&file, "[codes]\nC0105 = 1000.0\n").unwrap();
    let target = scratch.path("drive.toml");
    let cases: &[(&[&str], &str)] = &[
        (&["param", "read", "0061", "--file", &target], "`0061` is no code"),
        (&["param", "write", "C0012", "--file", &target], "C0012=20"),
        (
            &["param", "write", "C0012=fast", "--file", &target],
            "`fast` is no value",
        ),
        (&["param", "read", "C0061"], "--can PORT, --port PATH or --file FILE"),
        (
            &["param", "read", "C0061", "--can", "can99"],
            "can99: no such interface",
        ),
        (
            &["param", "load", &file, "--file", &target],
            "line 2: C0105: 1000.000 s is above 999.900 s",
        ),
        (
            &["scope", "--channels", "SPEED", "--out", "x.csv", "--file", &target],
            "`SPEED` is no channel",
        ),
        (&["program", "check", "/nonexistent/p.toml"], "/nonexistent/p.toml"),
        (
            &["scope", "--out", "run.xlsx", "--file", &target],
            "allowed are FILE.csv and FILE.parquet",
        ),
        (
            &["scope", "--svg", "run.jpg", "--file", &target],
            "allowed are FILE.svg and FILE.png",
        ),
        // Found before the recording, which would take an hour.
        (
            &[
                "scope",
                "--time",
                "3600",
                "--out",
                "/nonexistent/run.csv",
                "--file",
                &target,
            ],
            "/nonexistent/run.csv cannot be written",
        ),
    ];
    for (arguments, part) in cases {
        let output = lenze9300(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let complaint = complained(&output);
        assert!(complaint.contains(part), "{arguments:?}: {complaint}");
        assert_eq!(complaint.lines().count(), 1, "{arguments:?}: {complaint}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
    assert!(!std::path::Path::new(&target).exists(), "nothing was written");
}

#[test]
fn the_help_of_every_command_tells_the_exit_codes() {
    for command in [
        "serve", "param", "monitor", "scope", "program", "signals", "step", "bode",
    ] {
        let output = lenze9300(&[command, "--help"]);
        assert_eq!(output.status.code(), Some(0));
        for code in ["0  it is done", "1  it ran and did not work out", "2  used wrongly"] {
            assert!(told(&output).contains(code), "{command}: {}", told(&output));
        }
    }
}
