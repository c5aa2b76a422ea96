//! The program `dp` as a process, for the tests of its commands.

#[cfg(unix)]
pub(crate) mod slave;

use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// How it ended, and what it said.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// Runs it with these arguments and this standard input.
pub(crate) fn dp(arguments: &[&str], input: &str) -> Ended {
    let mut child = start(arguments);
    let mut stdin = child.stdin.take().unwrap();
    // It may end without reading, which is no failure of the test.
    drop(stdin.write_all(input.as_bytes()));
    drop(stdin);
    end(child)
}

/// Starts it with everything piped.
pub(crate) fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_dp"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Waits for its end, a minute at the most.
pub(crate) fn end(mut child: Child) -> Ended {
    use std::io::Read;
    let (mut out, mut err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        out.read_to_string(&mut text).map(|_| text)
    });
    let begin = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begin.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("it does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let mut complained = String::new();
    err.read_to_string(&mut complained).unwrap();
    Ended {
        code: status.code(),
        out: reader.join().unwrap().unwrap(),
        err: complained,
    }
}

/// A mistake: exit code 2, nothing on standard output, these sentences on standard error.
pub(crate) fn assert_refused(arguments: &[&str], sentences: &[&str]) {
    let ended = dp(arguments, "");
    assert_eq!(
        (ended.code, ended.out.as_str()),
        (Some(2), ""),
        "{arguments:?}: {}",
        ended.err
    );
    let told: Vec<&str> = ended.err.lines().collect();
    let wanted: Vec<String> = sentences.iter().map(|sentence| format!("dp: {sentence}")).collect();
    assert_eq!(told, wanted, "{arguments:?}");
}

/// A file name that is free, and freed with this value.
pub(crate) struct Scratch(pub(crate) PathBuf);

impl Scratch {
    pub(crate) fn new(name: &str) -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("dp-tool-{}-{number}-{name}", std::process::id())))
    }

    pub(crate) fn with(name: &str, content: &str) -> Self {
        let this = Self::new(name);
        std::fs::write(&this.0, content).unwrap();
        this
    }

    pub(crate) fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        drop(std::fs::remove_file(&self.0));
    }
}
