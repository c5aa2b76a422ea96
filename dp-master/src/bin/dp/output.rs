//! How a command ends, and what it writes.

use std::fmt::Display;
use std::io::{self, Write};

/// Why a command did not do its job.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// Something given was wrong: exit code 2. One sentence for each mistake.
    Given(Vec<String>),
    /// It ran and failed: exit code 1.
    Failed(String),
    /// As `Failed`, and the output has said why.
    Told,
}

impl Trouble {
    /// One thing given was wrong.
    pub(crate) fn given(sentence: impl Display) -> Self {
        Self::Given(vec![sentence.to_string()])
    }

    /// It ran and failed.
    pub(crate) fn failed(sentence: impl Display) -> Self {
        Self::Failed(sentence.to_string())
    }
}

/// How a command ended.
pub(crate) type Outcome = Result<(), Trouble>;

/// Standard output. When whoever reads it has seen enough, the process ends quietly.
#[derive(Debug)]
pub(crate) struct Output {
    out: io::StdoutLock<'static>,
}

impl Output {
    pub(crate) fn new() -> Self {
        Self {
            out: io::stdout().lock(),
        }
    }

    /// Text as it is.
    pub(crate) fn text(&mut self, text: impl Display) {
        self.settle(|out| write!(out, "{text}"));
    }

    /// A line.
    pub(crate) fn line(&mut self, text: impl Display) {
        self.settle(|out| writeln!(out, "{text}"));
    }

    /// A JSON object on a line of its own.
    pub(crate) fn json(&mut self, value: &impl serde::Serialize) {
        self.settle(|out| {
            serde_json::to_writer(&mut *out, value)?;
            writeln!(out)
        });
    }

    /// What was written is to be seen now.
    pub(crate) fn flush(&mut self) {
        self.settle(Write::flush);
    }

    fn settle(&mut self, write: impl FnOnce(&mut io::StdoutLock<'static>) -> io::Result<()>) {
        match write(&mut self.out) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => std::process::exit(0),
            Err(error) => {
                eprintln!("dp: standard output: {error}");
                std::process::exit(1)
            }
        }
    }
}

/// A remark on standard error; the command goes on.
pub(crate) fn note(what: impl Display) {
    eprintln!("dp: {what}");
}
