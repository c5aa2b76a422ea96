//! `film-feed replay`: the PLC block cycle by cycle, JSON lines in and out.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Write},
    path::{Path, PathBuf},
};

use crate::replay::{Line, LineError, Replay};

/// Run the PLC block alone: recorded inputs and bus images in, outputs and images out.
///
/// Reads one JSON line per PLC cycle, and {"reset":…} for a power-up; writes one JSON line per cycle. The whole input is
/// checked before the first line is written.
#[derive(Debug, Clone, PartialEq, Eq, clap::Args)]
pub struct ReplayArgs {
    /// Read from this file instead of standard input.
    #[arg(long, value_name = "FILE")]
    pub input: Option<PathBuf>,
    /// Answer each line as it arrives, instead of checking the whole input first.
    #[arg(long)]
    pub stream: bool,
}

/// Why a replay ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// A line was not understood.
    #[error("line {line}: {source}")]
    Line {
        /// Counted from 1, blank lines included.
        line: usize,
        /// What is wrong with it, and what is allowed.
        source: LineError,
    },
    /// The input file cannot be opened.
    #[error("cannot open {path}: {source}", path = path.display())]
    Open {
        /// As given with `--input`.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The input broke off.
    #[error("cannot read the input: {0}")]
    Read(#[source] io::Error),
    /// The answers could not be written.
    #[error("cannot write the answers: {0}")]
    Write(#[source] io::Error),
}

impl ReplayError {
    /// Exit code of the program: 2 if the input is at fault, 1 if the system is.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Line { .. } | Self::Open { .. } => 2,
            Self::Read(_) | Self::Write(_) => 1,
        }
    }
}

/// Runs the command on standard input (or the file) and standard output.
///
/// # Errors
///
/// [`ReplayError`]. Unless `--stream` was given, nothing has been written if a line is broken.
pub fn run(args: ReplayArgs) -> Result<(), ReplayError> {
    let stdout = io::stdout().lock();
    match &args.input {
        Some(path) => replay(BufReader::new(open(path)?), stdout, args.stream),
        None => replay(io::stdin().lock(), stdout, args.stream),
    }
}

fn open(path: &Path) -> Result<File, ReplayError> {
    File::open(path).map_err(|source| ReplayError::Open {
        path: path.to_owned(),
        source,
    })
}

/// Runs the command between any reader and writer; `stream` as in [`ReplayArgs::stream`].
///
/// # Errors
///
/// As [`run`].
pub fn replay(input: impl BufRead, output: impl Write, stream: bool) -> Result<(), ReplayError> {
    if stream {
        replay_streaming(input, output)
    } else {
        replay_checked(input, output)
    }
}

fn replay_streaming(mut input: impl BufRead, mut output: impl Write) -> Result<(), ReplayError> {
    let mut replay = Replay::new();
    let (mut line, mut answer) = (Vec::new(), String::new());
    for number in 1.. {
        line.clear();
        if input.read_until(b'\n', &mut line).map_err(ReplayError::Read)? == 0 {
            break;
        }
        answer.clear();
        replay.step(&parse(number, &line)?, &mut answer);
        if !answer.is_empty() {
            output
                .write_all(answer.as_bytes())
                .and_then(|()| output.flush())
                .map_err(ReplayError::Write)?;
        }
    }
    Ok(())
}

fn replay_checked(mut input: impl Read, mut output: impl Write) -> Result<(), ReplayError> {
    /// Answers are handed over in pieces of about this many octets.
    const CHUNK: usize = 1 << 16;
    let mut text = Vec::new();
    input.read_to_end(&mut text).map_err(ReplayError::Read)?;
    let lines = text
        .split(|octet| *octet == b'\n')
        .zip(1..)
        .map(|(line, number)| parse(number, line))
        .collect::<Result<Vec<_>, _>>()?;

    let mut replay = Replay::new();
    let mut answers = String::with_capacity(CHUNK + 512);
    for line in &lines {
        replay.step(line, &mut answers);
        if answers.len() >= CHUNK {
            output.write_all(answers.as_bytes()).map_err(ReplayError::Write)?;
            answers.clear();
        }
    }
    output
        .write_all(answers.as_bytes())
        .and_then(|()| output.flush())
        .map_err(ReplayError::Write)
}

fn parse(number: usize, line: &[u8]) -> Result<Line, ReplayError> {
    // Editors on one well-known system begin a file with a byte order mark.
    let line = if number == 1 {
        line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line)
    } else {
        line
    };
    Replay::parse(line).map_err(|source| ReplayError::Line { line: number, source })
}
