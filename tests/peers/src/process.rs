//! The drive and the masters as processes that tell what happens to them.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// A process that ends with the test, however the test ends, and the lines it writes.
#[derive(Debug)]
struct Process {
    child: Child,
    lines: Receiver<String>,
}

impl Process {
    fn start(command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?} does not start: {error}"));
        let (tell, lines) = channel();
        let out = child.stdout.take();
        std::thread::spawn(move || {
            for line in out.into_iter().flat_map(|out| BufReader::new(out).lines()) {
                // The test may have stopped listening.
                if line.is_err() || line.is_ok_and(|line| tell.send(line).is_err()) {
                    break;
                }
            }
        });
        Process { child, lines }
    }

    fn line(&self, until: Instant) -> Option<String> {
        self.lines
            .recv_timeout(until.saturating_duration_since(Instant::now()))
            .ok()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // SIGKILL: no farewell telegram, no clean-up. It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `lenze9300 serve` at address 3; killed when dropped.
#[derive(Debug)]
pub struct Drive {
    _process: Process,
}

impl Drive {
    /// On a port that exists.
    pub fn on_port(program: &str, port: &Path, baud: u32) -> Self {
        Self::serve(program, "--port", port, baud)
    }

    /// On a pseudo-terminal of its own, linked at `link`.
    pub fn on_pty(program: &str, link: &Path, baud: u32) -> Self {
        Self::serve(program, "--pty", link, baud)
    }

    fn serve(program: &str, where_to: &str, path: &Path, baud: u32) -> Self {
        let baud = baud.to_string();
        let process = Process::start(
            Command::new(program)
                .args(["serve", "--address", "3", "--baud", &baud, where_to])
                .arg(path),
        );
        let line = process.line(Instant::now() + PATIENCE).unwrap_or_default();
        assert!(line.contains("answering at address 3"), "the drive says: {line:?}");
        Drive { _process: process }
    }
}

/// An independent DP master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Peer {
    /// `pyprofibus`, run by this Python.
    PyProfibus {
        /// Interpreter that finds the packages.
        python: PathBuf,
    },
    /// `profirust`, as this program.
    Profirust {
        /// `profirust-master`.
        program: PathBuf,
    },
}

/// Where to find a Python that has the packages; without it `python3` is tried.
const PYTHON: &str = "PEERS_PYTHON";
/// When set to anything but the empty string, a peer that cannot be had is a failure.
const REQUIRED: &str = "PEERS_REQUIRED";

impl Peer {
    /// Python with `pyprofibus`, or why it cannot be had here: `PEERS_PYTHON` names the interpreter, otherwise it is
    /// `python3`.
    ///
    /// # Errors
    /// One sentence that says what is missing and how to get it.
    ///
    /// # Panics
    /// When `PEERS_REQUIRED` is set and it cannot be had.
    pub fn pyprofibus() -> Result<Self, String> {
        let python = std::env::var_os(PYTHON).map_or_else(|| PathBuf::from("python3"), PathBuf::from);
        let found = Self::pyprofibus_of(&python);
        if let Err(sentence) = &found {
            let required = std::env::var_os(REQUIRED).is_some_and(|required| !required.is_empty());
            assert!(!required, "{sentence}");
        }
        found
    }

    /// The same with this interpreter, whatever the environment says.
    ///
    /// # Errors
    /// As [`pyprofibus`](Self::pyprofibus).
    pub fn pyprofibus_of(python: &Path) -> Result<Self, String> {
        let found = Command::new(python)
            .args(["-c", "import pyprofibus, serial"])
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success());
        if found {
            return Ok(Peer::PyProfibus { python: python.into() });
        }
        Err(format!(
            "{} does not find pyprofibus: install pyprofibus==1.13 and pyserial==3.5 with pip and name that Python in {PYTHON}",
            python.display()
        ))
    }

    /// Starts it as a master at address 2 for the drive at address 3.
    ///
    /// After `values` answers of the parameter channel it stops; 0 = never.
    pub fn start(&self, port: &Path, baud: u32, values: u32) -> Master {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut command = match self {
            Peer::PyProfibus { python } => {
                let mut command = Command::new(python);
                command
                    .arg("-u")
                    .arg(root.join("pyprofibus_master.py"))
                    .arg("--gsd")
                    .arg(root.join("../../lenze9300-model/gsd/LENZ00DA.GSD"));
                command
            }
            Peer::Profirust { program } => Command::new(program),
        };
        command
            .arg("--port")
            .arg(port)
            .args(["--baud", &baud.to_string(), "--values", &values.to_string()]);
        Master {
            process: Process::start(&mut command),
        }
    }
}

/// A master under way; killed when dropped.
#[derive(Debug)]
pub struct Master {
    process: Process,
}

/// What a master tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The slave was parametrised and configured and exchanges data.
    DataExchange,
    /// Data exchange was lost.
    Left,
    /// An answer of the parameter channel.
    Value {
        /// Whether bit 7 of the service octet was 0.
        ok: bool,
        /// The index of the answer.
        index: u16,
        /// The four data octets.
        data: [u8; 4],
    },
    /// It has read as many values as it was to, in so many exchanges.
    Done {
        /// Data_Exchange answered with data.
        exchanges: u64,
    },
}

/// How long anything may take on a loaded machine.
const PATIENCE: Duration = Duration::from_secs(40);

impl Master {
    /// The next event.
    ///
    /// # Panics
    /// When none comes, or one that is not known.
    pub fn event(&self) -> Event {
        let until = Instant::now() + PATIENCE;
        loop {
            let Some(line) = self.process.line(until) else {
                panic!("the master tells nothing more");
            };
            // A peer prints warnings of its own.
            if !line.starts_with('{') {
                continue;
            }
            return parse(&line).unwrap_or_else(|| panic!("the master tells: {line}"));
        }
    }

    /// Events up to one that fulfils `wanted`, which is returned.
    pub fn wait_for(&self, wanted: impl Fn(&Event) -> bool) -> Event {
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            let event = self.event();
            if wanted(&event) {
                return event;
            }
        }
        panic!("the event does not come");
    }

    /// Events up to the next answer of the parameter channel, which is returned.
    pub fn value(&self) -> Event {
        self.wait_for(|event| matches!(event, Event::Value { .. }))
    }
}

fn parse(line: &str) -> Option<Event> {
    let told: serde_json::Value = serde_json::from_str(line).ok()?;
    match told["event"].as_str()? {
        "data exchange" => Some(Event::DataExchange),
        "left" => Some(Event::Left),
        "value" => Some(Event::Value {
            ok: told["ok"].as_bool()?,
            index: told["index"].as_u64()?.try_into().ok()?,
            data: u32::from_str_radix(told["data"].as_str()?, 16).ok()?.to_be_bytes(),
        }),
        "done" => Some(Event::Done {
            exchanges: told["exchanges"].as_u64()?,
        }),
        _ => None,
    }
}
