//! How the commands at a drive come out, and what they say on standard output.

use std::io::{self, Write};

use lenze9300_model::access::AccessError;

/// How a command that ran came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Done {
    Yes,
    /// It ran and failed, and has told why: a code was refused, something differs.
    No,
}

/// Why a command ended early, in one sentence.
#[derive(Debug)]
pub(crate) enum Failed {
    /// Something given was wrong: an option, a file, a port that is not there.
    Given(String),
    /// The drive refuses, or does not answer.
    AtDrive(String),
}

impl From<String> for Failed {
    fn from(sentence: String) -> Self {
        Self::Given(sentence)
    }
}

impl From<AccessError> for Failed {
    fn from(error: AccessError) -> Self {
        match error {
            AccessError::NoWay(sentence) => Self::Given(sentence),
            other => Self::AtDrive(other.to_string()),
        }
    }
}

/// Stands below the help of every command.
pub(crate) const EXIT_CODES: &str = "Exit codes:
  0  it is done
  1  it ran and did not work out: the drive gives no answer or refuses, something differs, a loop is unstable
  2  used wrongly: an argument, a file or a port that is not as it must be";

/// Lines on standard output. Whoever closed the pipe has read enough.
pub(crate) fn say(text: &str) -> Result<(), String> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(format!("standard output: {error}")),
        _ => Ok(()),
    }
}
