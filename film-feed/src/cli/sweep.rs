//! `film-feed sweep`: many machines at once.

use std::fs::{self, File};
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::output_file::OutputFile;
use super::{BAD_INPUT, NOT_DONE};
use crate::sweep::{self, ResultTable, Shard, Summary, SweepSpec};

/// What `film-feed sweep` takes.
#[derive(Debug, Clone, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct SweepArgs {
    #[command(subcommand)]
    merge: Option<SweepCommand>,
    /// What to vary, and how; docs/examples/sweep.toml is one with every key.
    #[arg(value_name = "SPEC.toml", required = true)]
    spec: Option<PathBuf>,
    /// Write a row for each machine: as Parquet if the name ends in .parquet, as CSV if in .csv.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the summary as one JSON object.
    #[arg(long)]
    json: bool,
    /// Threads, 0…1024; 0 is one for each processor. The result does not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Run part I of N only; `film-feed sweep merge` puts the parts together.
    #[arg(long, value_name = "I/N", default_value = "1/1", requires = "out")]
    shard: ShardArg,
    /// Go on with a sweep that was stopped: machines that have run are not run again.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Draw every figure over every parameter as SVG, or as PNG by the name of the file.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

#[derive(Debug, Clone, Subcommand)]
enum SweepCommand {
    /// Put the parts of a sweep together; nothing is written when one is missing.
    Merge(MergeArgs),
}

#[derive(Debug, Clone, Args)]
struct MergeArgs {
    /// Results of all shards, CSV or Parquet.
    #[arg(value_name = "FILE", required = true)]
    parts: Vec<PathBuf>,
    /// Where to write the whole: as Parquet if the name ends in .parquet, as CSV if in .csv.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the summary as one JSON object.
    #[arg(long)]
    json: bool,
    /// Draw every figure over every parameter as SVG, or as PNG by the name of the file.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy)]
struct ShardArg(Shard);

impl FromStr for ShardArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(part, of)| (part.parse(), of.parse()));
        match numbers {
            Some((Ok(part), Ok(of))) if part >= 1 && part <= of => Ok(ShardArg(Shard { part, of })),
            _ => Err("expected I/N with I from 1 to N, such as 2/8".to_owned()),
        }
    }
}

/// A message with its exit code.
type Failure = (u8, String);

fn bad(sentence: impl ToString) -> Failure {
    (BAD_INPUT, sentence.to_string())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Csv,
    Parquet,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some(extension) if extension.eq_ignore_ascii_case("csv") => Ok(Format::Csv),
            Some(extension) if extension.eq_ignore_ascii_case("parquet") => Ok(Format::Parquet),
            _ => Err(bad(format!(
                "{}: the name of a result ends in .csv or .parquet",
                path.display()
            ))),
        }
    }
}

/// Runs the sweep, or merges its parts.
///
/// # Errors
/// An exit code with one sentence.
pub fn run(args: &SweepArgs) -> Result<bool, Failure> {
    match (&args.merge, &args.spec) {
        (Some(SweepCommand::Merge(args)), _) => merge(args),
        (None, Some(spec)) => sweep(args, spec),
        (None, None) => Err(bad("a SPEC.toml is needed")),
    }
}

fn sweep(args: &SweepArgs, spec_path: &Path) -> Result<bool, Failure> {
    let spec = read_spec(spec_path)?;
    let out = args.out.as_deref().map(|path| Ok((path, Format::of(path)?)));
    let out = out.transpose()?;
    let points: Vec<u64> = (1..=spec.points()).filter(|point| args.shard.0.has(*point)).collect();
    let mut table = ResultTable::new(&spec);
    let mut journal = match out {
        None => None,
        Some((path, format)) => Some(Journal::open(path, format, &spec, args.resume, &mut table)?),
    };
    let picture = args.plot.as_deref().map(OutputFile::create).transpose().map_err(bad)?;

    let done: std::collections::HashSet<u64> = table.rows.iter().map(|row| row.point).collect();
    let open: Vec<u64> = points.iter().copied().filter(|point| !done.contains(point)).collect();
    sweep::check(&spec, &open).map_err(|error| bad(format!("{}: {error}", spec_path.display())))?;

    let progress = progress_bar(args, open.len());
    let started = Instant::now();
    let heading = table.clone();
    sweep::run(&spec, &open, usize::from(args.threads), |row| {
        if let Some(journal) = &mut journal {
            heading.write_csv_row(&row, &mut journal.file)?;
            journal.file.flush()?;
        }
        table.rows.push(row);
        progress.inc(1);
        Ok(())
    })
    .map_err(|error| (NOT_DONE, error.to_string()))?;
    progress.finish_and_clear();
    let wall_s = started.elapsed().as_secs_f64();

    table.sort();
    if let (Some(journal), Some((path, format))) = (journal, out) {
        write_table(&table, path, format)?;
        journal.remove();
    }
    draw(&table, picture, args.plot.as_deref())?;
    let feeds = open.len() as f64 * f64::from(spec.feeds());
    let effort = Effort {
        machines_run: open.len(),
        wall_s,
        feeds_per_s: if wall_s > 0.0 { feeds / wall_s } else { 0.0 },
    };
    print(&table, Some(effort), args.json)
}

fn read_spec(path: &Path) -> Result<SweepSpec, Failure> {
    let text = fs::read_to_string(path).map_err(|error| bad(format!("{} cannot be read: {error}", path.display())))?;
    let beside = path.parent().unwrap_or(Path::new(""));
    SweepSpec::read(&text, |machine| {
        let machine = beside.join(machine);
        fs::read_to_string(&machine).map_err(|error| format!("{} cannot be read: {error}", machine.display()))
    })
    .map_err(|error| {
        let mistakes = error.mistakes.iter();
        let told: Vec<String> = mistakes
            .map(|mistake| format!("{}: {mistake}", path.display()))
            .collect();
        bad(told.join("\n"))
    })
}

/// Rows as they are done, beside the result, so that nothing is lost when the sweep is stopped.
struct Journal {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Journal {
    /// Begins a journal, or goes on with the one that is there: its rows, or those of a finished result, come into `table`.
    fn open(
        out: &Path,
        format: Format,
        spec: &SweepSpec,
        resume: bool,
        table: &mut ResultTable,
    ) -> Result<Self, Failure> {
        let mut name = out.file_name().unwrap_or_default().to_os_string();
        name.push(".rows");
        let path = out.with_file_name(name);
        let shown = path.display();
        if resume {
            let earlier = if path.exists() {
                Some((path.as_path(), Format::Csv))
            } else {
                out.exists().then_some((out, format))
            };
            if let Some((earlier, format)) = earlier {
                let found = read_table(earlier, format)?;
                if !found.rows.is_empty() && found.sweep != spec.fingerprint() {
                    return Err(bad(format!(
                        "{} is of another sweep: SPEC, machine or version have changed; start anew without --resume and with another --out",
                        earlier.display()
                    )));
                }
                table.rows = found.rows;
            }
        } else if path.exists() {
            return Err(bad(format!(
                "{shown} is left of a sweep that was stopped; go on with --resume, or delete it"
            )));
        }
        // Written anew, so that half a line at its end does not stay. Whole before it takes the place of the old one.
        let begin = || -> io::Result<BufWriter<File>> {
            let mut provisional = path.clone().into_os_string();
            provisional.push(".part");
            let mut file = BufWriter::new(File::create(&provisional)?);
            table.write_csv(&mut file)?;
            fs::rename(&provisional, &path)?;
            Ok(file)
        };
        let file = begin().map_err(|error| bad(format!("{shown} cannot be written: {error}")))?;
        Ok(Journal { path, file })
    }

    /// The result is in its place.
    fn remove(self) {
        // Left behind, it would only have its rows taken over by --resume.
        let _ = fs::remove_file(&self.path);
    }
}

fn read_table(path: &Path, format: Format) -> Result<ResultTable, Failure> {
    let read = || {
        let file = File::open(path)?;
        match format {
            Format::Csv => ResultTable::read_csv(file),
            Format::Parquet => ResultTable::read_parquet(file),
        }
    };
    read().map_err(|error| bad(format!("{}: {error}", path.display())))
}

fn write_table(table: &ResultTable, path: &Path, format: Format) -> Result<(), Failure> {
    OutputFile::create(path)
        .and_then(|file| {
            file.commit(|out| match format {
                Format::Csv => table.write_csv(out),
                Format::Parquet => table.write_parquet(out),
            })
        })
        .map_err(|sentence| (NOT_DONE, sentence))
}

fn merge(args: &MergeArgs) -> Result<bool, Failure> {
    let format = Format::of(&args.out)?;
    let parts = args
        .parts
        .iter()
        .map(|path| read_table(path, Format::of(path)?))
        .collect::<Result<Vec<_>, _>>()?;
    let picture = args.plot.as_deref().map(OutputFile::create).transpose().map_err(bad)?;
    let table = sweep::merge(parts).map_err(bad)?;
    write_table(&table, &args.out, format)?;
    draw(&table, picture, args.plot.as_deref())?;
    print(&table, None, args.json)
}

fn draw(table: &ResultTable, picture: Option<OutputFile>, path: Option<&Path>) -> Result<(), Failure> {
    let Some(file) = picture else { return Ok(()) };
    let svg = sweep::draw_svg(table).map_err(|error| (NOT_DONE, error.to_string()))?;
    let octets = super::picture(path, &svg).map_err(|sentence| (NOT_DONE, sentence))?;
    file.commit(|out| out.write_all(&octets))
        .map_err(|sentence| (NOT_DONE, sentence))
}

/// What running took; the only thing in the output that differs from time to time.
#[derive(Debug, Clone, Copy, Serialize)]
struct Effort {
    machines_run: usize,
    wall_s: f64,
    feeds_per_s: f64,
}

#[derive(Debug, Serialize)]
struct Report<'s> {
    #[serde(flatten)]
    summary: &'s Summary,
    #[serde(skip_serializing_if = "Option::is_none")]
    effort: Option<Effort>,
}

fn print(table: &ResultTable, effort: Option<Effort>, json: bool) -> Result<bool, Failure> {
    let summary = Summary::new(table);
    let mut out = io::stdout().lock();
    let mut write = || -> io::Result<()> {
        if json {
            let report = Report {
                summary: &summary,
                effort,
            };
            serde_json::to_writer(&mut out, &report)?;
            writeln!(out)?;
        } else {
            writeln!(out, "{summary}")?;
            if let Some(effort) = effort {
                writeln!(
                    out,
                    "{} machines run in {:.1} s, {:.0} feeds a second",
                    effort.machines_run, effort.wall_s, effort.feeds_per_s
                )?;
            }
        }
        out.flush()
    };
    match write() {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err((NOT_DONE, format!("the summary cannot be written: {error}")))
        }
        _ => Ok(true),
    }
}

/// A bar on a terminal, nothing elsewhere.
fn progress_bar(args: &SweepArgs, machines: usize) -> ProgressBar {
    if args.json || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(machines as u64);
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} machines, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}
