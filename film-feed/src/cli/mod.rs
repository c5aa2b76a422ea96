//! The command line: what a person types, checked before anything moves.

pub mod advise;
pub mod budget;
pub mod fit;
mod machine;
mod model;
mod output_file;
#[cfg(feature = "panel")]
pub mod panel;
pub mod replay;
pub mod run;
pub mod size;
pub mod sweep;

use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use serde::Serialize;

/// Feeds film: PLC block, PROFIBUS-DP, Lenze 9300 and film in one chain.
#[derive(Debug, Parser)]
#[command(name = "film-feed", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Without a subcommand it is `run`.
    #[command(flatten)]
    run: run::RunArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run feeds, in virtual time or on a serial line, and report how they landed.
    Run(run::RunArgs),
    /// Size motor, gear, drive and brake resistor of a machine; exit code 1 when something is too small.
    Size(size::SizeArgs),
    /// Split the error of a feed into its parts; exit code 1 when the tolerance is not held.
    Budget(budget::BudgetArgs),
    /// Tell what will go wrong with a machine, and what to do, before anything moves; exit code 1 when something does by its values alone.
    Advise(advise::AdviseArgs),
    /// Tell inertia, friction and velocity gain of an axis from a recorded feed.
    Fit(fit::FitArgs),
    /// Serve the commissioning panel to a browser.
    #[cfg(feature = "panel")]
    Panel(panel::PanelArgs),
    /// Run the block alone on recorded images, one JSON line a PLC cycle.
    Replay(replay::ReplayArgs),
    /// Run many machines at once, each with other values, and tell what becomes of their feeds.
    Sweep(sweep::SweepArgs),
}

/// The job was done.
const DONE: u8 = 0;
/// The job ran and did not succeed.
const NOT_DONE: u8 = 1;
/// The job could not be started: something given was wrong.
const BAD_INPUT: u8 = 2;

/// Runs the application with the process' arguments; the result is its exit code.
pub fn main() -> ExitCode {
    ExitCode::from(dispatch())
}

fn dispatch() -> u8 {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return report_usage(&error),
    };
    let outcome = match cli.command {
        None => run::run(&cli.run).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Run(args)) => run::run(&args).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Size(args)) => size::run(&args).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Budget(args)) => budget::run(&args).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Advise(args)) => advise::run(&args).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Fit(args)) => fit::run(&args).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Sweep(args)) => sweep::run(&args),
        #[cfg(feature = "panel")]
        Some(Command::Panel(args)) => panel::run(&args).map_err(|sentence| (BAD_INPUT, sentence)),
        Some(Command::Replay(args)) => replay::run(args)
            .map(|()| true)
            .map_err(|error| (error.exit_code(), error.to_string())),
    };
    match outcome {
        Ok(true) => DONE,
        Ok(false) => NOT_DONE,
        Err((code, sentence)) => {
            eprintln!("film-feed: {sentence}");
            code
        }
    }
}

/// Prints a report, for machines or for people. Whoever closed the pipe has read enough.
fn print(json: bool, report: &(impl Serialize + Display)) -> Result<(), String> {
    let mut out = io::stdout().lock();
    let mut put = || -> io::Result<()> {
        if json {
            serde_json::to_writer(&mut out, report)?;
            writeln!(out)?;
        } else {
            writeln!(out, "{report}")?;
        }
        out.flush()
    };
    match put() {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("the report cannot be written: {error}"))
        }
        _ => Ok(()),
    }
}

/// Help goes to standard output; a mistake becomes one sentence on standard error.
fn report_usage(error: &clap::Error) -> u8 {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        print!("{error}");
        return DONE;
    }
    let text = error.to_string();
    // What follows the first empty line is usage. What comes before may be a list over several lines.
    let lines: Vec<&str> = text
        .lines()
        .take_while(|line| !line.trim().is_empty())
        .map(str::trim)
        .collect();
    let message = lines.join(" ");
    let sentence = message.strip_prefix("error: ").unwrap_or(&message);
    let given = std::env::args().nth(1).unwrap_or_default();
    let command = Cli::command();
    // Without a subcommand it is `run`.
    let asked = command.find_subcommand(&given).map_or("run", clap::Command::get_name);
    eprintln!("film-feed: {sentence}; `film-feed {asked} --help` lists what is allowed");
    BAD_INPUT
}

/// The octets of a picture for a file whose name says what it is to be: PNG or SVG.
fn picture(path: Option<&std::path::Path>, svg: &str) -> Result<Vec<u8>, String> {
    match path {
        Some(path) => lenze9300_model::picture::for_file(path, svg).map_err(|error| error.to_string()),
        None => Ok(svg.as_bytes().to_vec()),
    }
}
