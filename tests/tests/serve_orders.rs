//! `lenze9300 serve` with a person at it: orders on standard input, programs and codes from files.

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};

/// `lenze9300`, built for this test.
const LENZE9300: &str = env!("CARGO_BIN_EXE_lenze9300-under-test");

/// A file or link in the scratch directory that is removed with this value.
struct Scratch(PathBuf);

impl Scratch {
    fn new(ending: &str) -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Scratch(std::env::temp_dir().join(format!("lenze9300-{}-{number}.{ending}", std::process::id())))
    }

    fn holding(ending: &str, text: &str) -> Self {
        let scratch = Self::new(ending);
        std::fs::write(&scratch.0, text).expect("the scratch directory can be written to");
        scratch
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Best effort; most often the drive has taken its link away.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// A drive that ends with the test.
struct Serving {
    child: Child,
    told: std::io::Lines<BufReader<std::process::ChildStdout>>,
    _link: Scratch,
}

impl Serving {
    fn new(arguments: &[&std::ffi::OsStr]) -> Self {
        let link = Scratch::new("pty");
        let mut child = Command::new(LENZE9300)
            .args(["serve", "--pty"])
            .arg(&link.0)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the drive starts");
        let told = BufReader::new(child.stdout.take().expect("its output is piped")).lines();
        let mut serving = Self {
            child,
            told,
            _link: link,
        };
        assert!(serving.line().contains("answering at address 3"));
        serving
    }

    fn line(&mut self) -> String {
        self.told.next().expect("it tells something").expect("it writes UTF-8")
    }

    fn order(&mut self, line: &str) {
        let stdin = self.child.stdin.as_mut().expect("its input is piped");
        writeln!(stdin, "{line}").expect("it reads its input");
    }

    fn status(&mut self) -> String {
        self.order("status");
        self.line()
    }

    /// The status once its beginning is the expected one; the drive needs a millisecond, and some for its self test.
    fn becomes(&mut self, beginning: &str) {
        for _ in 0..500 {
            if self.status().starts_with(beginning) {
                return;
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        panic!("{} instead of {beginning}", self.status());
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn orders_act_and_the_status_tells() {
    let mut drive = Serving::new(&[]);
    // Nobody is on the bus: inhibited over the AIF. Then terminal 28, a message, a TRIP, by their rank (9300 facts 4.4).
    drive.becomes("C0183 = 125, fault none");
    drive.order("28 off");
    drive.becomes("C0183 = 121, fault none");
    drive.order("mains off");
    drive.becomes("C0183 = 104, fault 1030 LU");
    drive.order("fault OC2 on");
    drive.becomes("C0183 = 102, fault 12 OC2 (earth fault)");
}

#[test]
fn a_recording_is_saved_while_the_drive_goes_on() {
    let csv = Scratch::new("with spaces.csv");
    let mut drive = Serving::new(&[]);
    for order in [
        "scope channels U-DC,N-ACT",
        "scope depth 200",
        "scope pre 0",
        "scope arm",
    ] {
        drive.order(order);
    }
    let mut told = String::new();
    for _ in 0..500 {
        drive.order("scope status");
        told = drive.line();
        if told == "scope done, 200 rows" {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert_eq!(told, "scope done, 200 rows");
    drive.order(&format!("scope save {}", csv.0.display()));
    assert_eq!(drive.line(), format!("200 rows in {}", csv.0.display()));
    let kept = std::fs::read_to_string(&csv.0).expect("it is there when that is told");
    let mut lines = kept.lines();
    assert_eq!(lines.next(), Some("time_s,U-DC V,N-ACT 1/min"));
    // A millisecond from row to row, whatever else the process did.
    let times: Vec<f64> = lines
        .map(|line| {
            line.split(',')
                .next()
                .and_then(|time| time.parse().ok())
                .expect("a time")
        })
        .collect();
    assert_eq!(times.len(), 200);
    assert!(
        times.windows(2).all(|pair| (pair[1] - pair[0] - 0.001).abs() < 1e-9),
        "{times:?}"
    );
    drive.becomes("C0183 = 125, fault none");
}

#[test]
fn what_the_fault_memory_holds_survives_a_restart() {
    let state = Scratch::new("toml");
    let arguments = ["--state".as_ref(), state.0.as_os_str()];
    let mut drive = Serving::new(&arguments);
    drive.becomes("C0183 = 125");
    drive.order("fault Sd2 on");
    drive.becomes("C0183 = 102");
    for _ in 0..500 {
        if state.0.exists() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    drop(drive);
    let kept = std::fs::read_to_string(&state.0).expect("it was written");
    // 9300 facts 4.9: Sd2 is 82.
    assert!(
        kept.contains("[[fault]] # Sd2") && kept.contains("number = 82"),
        "{kept}"
    );
    assert!(kept.contains("\"C1204\" = 179.0708"), "{kept}");
    let mut again = Serving::new(&arguments);
    again.becomes("C0183 = 125, fault none");
}

#[test]
fn a_program_with_mistakes_is_refused_with_all_of_them() {
    let program = Scratch::holding(
        "toml",
        "[[record]]\nnumber = 1\nmode = \"relative\"\njump = 2\n\n[codes]\nC9999 = 1\n",
    );
    let output = Command::new(LENZE9300)
        .args(["serve", "--pty", "/nonexistent/never-made", "--program"])
        .arg(&program.0)
        .output()
        .expect("it starts");
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8_lossy(&output.stderr);
    let expected = "line 2: record 1 goes on at record 2, which is not programmed; line 7: C9999 does not exist";
    assert!(told.contains(expected), "{told}");
    assert!(told.contains(&program.0.display().to_string()), "{told}");
}

#[test]
fn the_program_of_the_film_feed_is_accepted_from_its_file() {
    let program = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../lenze9300-model/programs/film-feed.toml"
    );
    let codes = Scratch::holding("toml", "[codes]\nC0070 = 6.5\n");
    let mut drive = Serving::new(&[
        "--program".as_ref(),
        program.as_ref(),
        "--codes".as_ref(),
        codes.0.as_os_str(),
    ]);
    drive.becomes("C0183 = 125, fault none");
}
