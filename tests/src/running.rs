//! A program that runs beside a test.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// A process that ends with the test, however the test ends.
#[derive(Debug)]
pub struct Running(Child);

/// What a process left behind.
#[derive(Debug)]
pub struct Ended {
    /// How it ended.
    pub status: ExitStatus,
    /// Its standard output.
    pub told: String,
    /// Its standard error.
    pub complained: String,
}

impl Running {
    /// Starts it.
    ///
    /// # Panics
    /// When there is no such program.
    pub fn start(command: &mut Command) -> Self {
        match command.spawn() {
            Ok(child) => Self(child),
            Err(error) => panic!("{command:?} does not start: {error}"),
        }
    }

    /// Starts it and waits for its first line, with which programs of this project say that they are ready. What it says later, nobody
    /// reads.
    ///
    /// # Panics
    /// When there is no such program, or it ends without a word.
    pub fn ready(command: &mut Command) -> (Self, String) {
        let mut running = Self::start(command.stdin(Stdio::null()).stdout(Stdio::piped()));
        let mut line = String::new();
        let read = BufReader::new(running.output()).read_line(&mut line);
        assert!(read.is_ok() && !line.is_empty(), "{command:?} said nothing: {read:?}");
        (running, line)
    }

    /// Its piped standard output.
    ///
    /// # Panics
    /// When it is not piped, or was taken before.
    pub fn output(&mut self) -> impl Read + Send + use<> {
        let Some(out) = self.0.stdout.take() else {
            panic!("its output is piped");
        };
        out
    }

    /// Its piped standard error.
    ///
    /// # Panics
    /// When it is not piped, or was taken before.
    pub fn errors(&mut self) -> impl Read + Send + use<> {
        let Some(err) = self.0.stderr.take() else {
            panic!("its errors are piped");
        };
        err
    }

    /// Waits for its end, for a minute at the most. Output and errors are to be piped, and what it writes has to fit a pipe's buffer.
    ///
    /// # Panics
    /// When it does not end, or writes what is no UTF-8.
    pub fn end(mut self) -> Ended {
        let (mut out, mut err) = (self.output(), self.errors());
        let waited = Instant::now();
        let status = loop {
            match self.0.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) => assert!(waited.elapsed() < Duration::from_secs(60), "it waits for ever"),
                Err(error) => panic!("it cannot be asked: {error}"),
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let (mut told, mut complained) = (String::new(), String::new());
        let read = out
            .read_to_string(&mut told)
            .and_then(|_| err.read_to_string(&mut complained));
        assert!(read.is_ok(), "{read:?}");
        Ended {
            status,
            told,
            complained,
        }
    }

    /// Kills it; it gets no chance to tidy up.
    pub fn kill(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }

    /// Sends it a signal, such as `STOP`.
    ///
    /// # Panics
    /// When the signal cannot be sent.
    pub fn signal(&self, signal: &str) {
        let kill = format!("kill -{signal} {}", self.0.id());
        let status = Command::new("sh").args(["-c", &kill]).status();
        assert!(status.as_ref().is_ok_and(ExitStatus::success), "{kill}: {status:?}");
    }

    /// Resident memory, kB; on Linux, and while it runs.
    pub fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id())).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
        line.split_whitespace().nth(1)?.parse().ok()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
    }
}
