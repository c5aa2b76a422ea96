//! `lenze9300 scope`: values of a running drive recorded by asking for its display codes.

use std::fs::File;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use lenze9300_model::access::{CodePlace, ParameterAccess};
use lenze9300_model::code::Form;
use lenze9300_model::table::{Column, Table};

use crate::param::{Done, say};
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
    /// How long to record, 0.1…3600 s.
    #[arg(long, value_name = "S", default_value = "5", value_parser = parse_seconds)]
    time: f64,
    /// Least time from one sample to the next, 1…60000 ms. A code over the system bus takes two to three milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=60_000))]
    interval: u64,
    /// Where to write the samples: FILE.csv or FILE.parquet.
    #[arg(long, value_name = "FILE", required_unless_present = "svg")]
    out: Option<PathBuf>,
    /// Draw the curves, as SVG, or as PNG by the name of the file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
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

/// Records, and writes what was asked for.
pub(crate) fn scope(args: &ScopeArgs) -> Result<Done, String> {
    let mut access = args.way.open()?;
    let column = |channel: &Channel| {
        let unit = channel.place.entry().map_or("", |entry| entry.unit);
        Column::new(channel.name.clone(), unit)
    };
    let mut table = Table::new(std::iter::once(Column::new("time_s", "")).chain(args.channels.iter().map(column)));
    let bar = progress(args.time);
    let begun = Instant::now();
    let mut next = begun;
    while begun.elapsed().as_secs_f64() < args.time {
        let mut row = vec![begun.elapsed().as_secs_f64()];
        for channel in &args.channels {
            let raw = access.read(channel.place).map_err(|error| {
                bar.finish_and_clear();
                error.to_string()
            })?;
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
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    bar.finish_and_clear();
    if let Some(path) = &args.out {
        write(&table, path)?;
    }
    if let Some(path) = &args.svg {
        let svg = table.draw_svg("Oscilloscope").map_err(|error| error.to_string())?;
        crate::loop_args::write_picture(path, &svg)?;
    }
    say(&format!(
        "{} samples in {:.1} s, one in {:.1} ms",
        table.rows(),
        begun.elapsed().as_secs_f64(),
        1000.0 * begun.elapsed().as_secs_f64() / table.rows().max(1) as f64
    ))?;
    Ok(Done::Yes)
}

fn write(table: &Table, path: &Path) -> Result<(), String> {
    let cannot = |error: io::Error| format!("{} cannot be written: {error}", path.display());
    let mut out = BufWriter::new(File::create(path).map_err(cannot)?);
    let is_parquet = path
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    if is_parquet {
        table.write_parquet(&mut out)
    } else {
        table.write_csv(&mut out)
    }
    .and_then(|()| out.flush())
    .map_err(cannot)
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
