//! What the reader has to say about a file, by line.

use core::fmt;

use serde::Serialize;

/// A place in a file, both counted from 1; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Position {
    /// Line.
    pub line: u32,
    /// Character in the line.
    pub column: u32,
}

impl Position {
    /// The first character of the file.
    pub const START: Self = Self { line: 1, column: 1 };
}

/// How bad it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The description is usable, but its author probably meant something else.
    Warning,
    /// Something could not be read, contradicts itself or is missing: what depends on it is not in the result.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// One remark of the reader.
///
/// Shown as `line 47: unknown keyword ...`; severity and column are fields of their own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Where it is about; for something that is missing, where it should have been.
    #[serde(flatten)]
    pub at: Position,
    /// One sentence.
    pub message: String,
}

impl Diagnostic {
    /// The line, counted from 1.
    pub fn line(&self) -> u32 {
        self.at.line
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.at.line, self.message)
    }
}

/// The remarks of one reading, in the order of the file once sorted.
#[derive(Debug, Default)]
pub(super) struct Remarks {
    all: Vec<Diagnostic>,
    left_out: usize,
}

/// A message of one line without the control characters a file may have brought into it: it is shown on terminals.
fn printable(message: String) -> String {
    if message.contains(char::is_control) {
        let escaped = |c: char| match c.is_control() {
            true => c.escape_default().to_string(),
            false => c.to_string(),
        };
        message.chars().map(escaped).collect()
    } else {
        message
    }
}

/// More remarks than this help nobody; the rest is counted.
const MOST: usize = 1_000;

impl Remarks {
    pub(super) fn error(&mut self, at: Position, message: impl Into<String>) {
        self.push(Severity::Error, at, message.into());
    }

    pub(super) fn warning(&mut self, at: Position, message: impl Into<String>) {
        self.push(Severity::Warning, at, message.into());
    }

    fn push(&mut self, severity: Severity, at: Position, message: String) {
        if self.all.len() < MOST {
            let message = printable(message);
            self.all.push(Diagnostic { severity, at, message });
        } else {
            self.left_out += 1;
        }
    }

    /// The remarks by line; at most a thousand and one that says how many were left out.
    pub(super) fn into_sorted(mut self) -> Vec<Diagnostic> {
        self.all.sort_by_key(|remark| remark.at);
        if self.left_out > 0 {
            let at = self.all.last().map_or(Position::START, |last| last.at);
            let message = format!("{} more errors and warnings are left out", self.left_out);
            self.all.push(Diagnostic {
                severity: Severity::Error,
                at,
                message,
            });
        }
        self.all
    }
}
