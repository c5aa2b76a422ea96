//! The command line: what a person types, checked before anything moves.

mod model;
mod output_file;
pub mod replay;
pub mod run;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

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
    /// Run the block alone on recorded images, one JSON line a PLC cycle.
    Replay(replay::ReplayArgs),
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
    eprintln!("film-feed: {sentence}; `film-feed run --help` lists what is allowed");
    BAD_INPUT
}
