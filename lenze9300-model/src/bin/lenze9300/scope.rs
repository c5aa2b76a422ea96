//! `lenze9300 scope`: values of a running drive recorded by asking for its display codes.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use lenze9300_model::access::{AccessError, CodePlace, ParameterAccess};
use lenze9300_model::code::Form;
use lenze9300_model::picture;
use lenze9300_model::table::{Column, Table};
use serde::Serialize;

use crate::outcome::{Done, Failed, say};
use crate::provisional::Provisional;
use crate::way::WayArgs;

/// What `lenze9300 scope` takes.
#[derive(Debug, Args)]
pub(crate) struct ScopeArgs {
    #[command(flatten)]
    way: WayArgs,
    /// What to record, separated by commas: codes such as C0061, or N-ACT, U-DC, I-ACT, MCTRL-MSET2, POS-NOUT, C0067.
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        default_value = "N-ACT,I-ACT,U-DC"
    )]
    channels: Vec<Channel>,
    /// How long to record, 0.1…3600 s; Ctrl-C ends it earlier.
    #[arg(long, value_name = "S", default_value = "5", value_parser = parse_seconds)]
    time: f64,
    /// Least time from one sample to the next, 1…60000 ms. A code over the system bus takes two to three milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=60_000))]
    interval: u64,
    /// Where to write the samples: FILE.csv or FILE.parquet.
    #[arg(long, value_name = "FILE", required_unless_present = "svg", value_parser = parse_table_path)]
    out: Option<PathBuf>,
    /// Draw the curves into FILE.svg or FILE.png.
    #[arg(long, value_name = "FILE", value_parser = parse_picture_path)]
    svg: Option<PathBuf>,
    /// One JSON object about the recording instead of the sentence.
    #[arg(long)]
    json: bool,
}

/// A code under a name.
#[derive(Debug, Clone)]
struct Channel {
    name: String,
    place: CodePlace,
}

/// Signals that the drive shows in a code (9300 facts 4.4).
const SIGNALS: [(&str, u16); 5] = [
    ("POS-NOUT", 50),
    ("N-ACT", 51),
    ("U-DC", 53),
    ("I-ACT", 54),
    ("MCTRL-MSET2", 56),
];

impl FromStr for Channel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let signal = SIGNALS.iter().find(|(name, _)| name.eq_ignore_ascii_case(text));
        if let Some((name, code)) = signal {
            return Ok(Self {
                name: (*name).to_owned(),
                place: CodePlace::new(*code, 0),
            });
        }
        let place: CodePlace = text.parse().map_err(|_| {
            format!(
                "`{text}` is no channel; allowed are codes such as C0061, and {}",
                SIGNALS.map(|(name, _)| name).join(", ")
            )
        })?;
        Ok(Self {
            name: place.to_string(),
            place,
        })
    }
}

/// Records, and writes what was asked for: all of it, or what there is when it was interrupted or the drive answers no more.
pub(crate) fn scope(args: &ScopeArgs) -> Result<Done, Failed> {
    let mut access = args.way.open()?;
    // Before anything is recorded: what cannot be written must not be found out at the end.
    let out = args.out.as_deref().map(Provisional::create).transpose()?;
    let svg = args.svg.as_deref().map(Provisional::create).transpose()?;
    let column = |channel: &Channel| {
        let unit = channel.place.entry().map_or("", |entry| entry.unit);
        Column::new(channel.name.clone(), unit)
    };
    let mut table = Table::new(std::iter::once(Column::new("time_s", "")).chain(args.channels.iter().map(column)));
    let interrupted = interruption()?;
    let begun = Instant::now();
    let broken = record(&mut access, args, &interrupted, &mut table).err();
    let recorded_s = begun.elapsed().as_secs_f64();
    if table.rows() == 0
        && let Some(error) = broken
    {
        return Err(error.into());
    }
    if let Some((file, path)) = out.zip(args.out.as_deref()) {
        file.keep(|out| match has_extension(path, "parquet") {
            true => table.write_parquet(out),
            false => table.write_csv(out),
        })?;
    }
    if let Some((file, path)) = svg.zip(args.svg.as_deref()) {
        let svg = table.draw_svg("Oscilloscope").map_err(|error| error.to_string())?;
        let octets = picture::for_file(path, &svg).map_err(|error| error.to_string())?;
        file.keep(|out| out.write_all(&octets))?;
    }
    let recording = Recording {
        samples: table.rows(),
        time_s: recorded_s,
        mean_interval_ms: 1000.0 * recorded_s / table.rows().max(1) as f64,
        interrupted: interrupted.load(Ordering::Relaxed),
        error: broken.as_ref().map(ToString::to_string),
    };
    if args.json {
        say(&serde_json::to_string(&recording).map_err(|error| error.to_string())?)?;
    } else {
        say(&format!(
            "{} samples in {:.1} s, one in {:.1} ms",
            recording.samples, recording.time_s, recording.mean_interval_ms
        ))?;
    }
    Ok(match broken {
        Some(error) => {
            eprintln!("lenze9300: {error}; what was recorded before is written");
            Done::No
        }
        None => Done::Yes,
    })
}

/// What `--json` tells of a recording.
#[derive(Debug, Serialize)]
struct Recording {
    samples: usize,
    time_s: f64,
    mean_interval_ms: f64,
    /// Ended by Ctrl-C.
    interrupted: bool,
    /// Why the drive could not be read to the end.
    error: Option<String>,
}

/// Asks for all channels again and again until the time is over or somebody has enough.
fn record(
    access: &mut impl ParameterAccess,
    args: &ScopeArgs,
    interrupted: &AtomicBool,
    table: &mut Table,
) -> Result<(), AccessError> {
    let bar = progress(args.time);
    let begun = Instant::now();
    let mut next = begun;
    while begun.elapsed().as_secs_f64() < args.time && !interrupted.load(Ordering::Relaxed) {
        let mut row = vec![begun.elapsed().as_secs_f64()];
        for channel in &args.channels {
            let raw = access.read(channel.place).inspect_err(|_| bar.finish_and_clear())?;
            let factor = match channel.place.entry().map(|entry| entry.form) {
                Some(Form::FixedPoint4) => 10_000.0,
                Some(Form::Plain) | None => 1.0,
            };
            row.push(f64::from(raw) / factor);
        }
        table.push(&row);
        bar.set_position((begun.elapsed().as_secs_f64() * 10.0) as u64);
        // Time that was lost is not made up for.
        next = (next + Duration::from_millis(args.interval)).max(Instant::now());
        while let Some(wait) = next
            .checked_duration_since(Instant::now())
            .filter(|wait| !wait.is_zero())
        {
            if interrupted.load(Ordering::Relaxed) {
                break;
            }
            thread::park_timeout(wait);
        }
    }
    bar.finish_and_clear();
    Ok(())
}

/// Becomes true with Ctrl-C, which wakes this thread then.
fn interruption() -> Result<Arc<AtomicBool>, String> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let (flag, waiting) = (Arc::clone(&interrupted), thread::current());
    ctrlc::set_handler(move || {
        flag.store(true, Ordering::Relaxed);
        waiting.unpark();
    })
    .map_err(|error| format!("Ctrl-C cannot be heard: {error}"))?;
    Ok(interrupted)
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

fn parse_table_path(text: &str) -> Result<PathBuf, String> {
    parse_path(text, ["csv", "parquet"])
}

fn parse_picture_path(text: &str) -> Result<PathBuf, String> {
    parse_path(text, ["svg", "png"])
}

/// The name of the file says what is written into it.
fn parse_path(text: &str, allowed: [&str; 2]) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if allowed.iter().any(|extension| has_extension(&path, extension)) {
        Ok(path)
    } else {
        Err(format!("allowed are FILE.{} and FILE.{}", allowed[0], allowed[1]))
    }
}

/// A bar on a terminal, in tenths of a second.
fn progress(time_s: f64) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new((time_s * 10.0) as u64);
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {percent} %, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|seconds| (0.1..=3600.0).contains(seconds))
        .ok_or_else(|| "allowed is 0.1…3600 s".to_owned())
}
