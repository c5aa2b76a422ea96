//! `dp`: a tool to see and to work a PROFIBUS line.
//!
//! A file per command. Exit codes: 0 done, 1 ran and failed, 2 something given was wrong.

mod bus_statistics;
mod busparam;
mod config_text;
mod decode;
mod interrupt;
mod late_bar;
mod line_args;
mod network;
mod output;
mod sniff;
mod telegram_record;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use output::Trouble;

/// Sees and works a PROFIBUS line: telegrams, stations, bus parameters.
#[derive(Debug, Parser)]
#[command(name = "dp", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Explain telegrams given in hexadecimal.
    Decode(decode::DecodeArgs),
    /// Listen to a line or read a capture: telegrams and statistics. Never sends.
    Sniff(sniff::SniffArgs),
    /// Calculate the bus parameters of a network and check its rules.
    Busparam(busparam::BusparamArgs),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return report_usage(&error),
    };
    let outcome = match &cli.command {
        Command::Decode(args) => decode::decode(args),
        Command::Sniff(args) => sniff::sniff(args),
        Command::Busparam(args) => busparam::busparam(args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Trouble::Given(sentences)) => {
            for sentence in sentences {
                eprintln!("dp: {sentence}");
            }
            ExitCode::from(2)
        }
        Err(Trouble::Failed(sentence)) => {
            eprintln!("dp: {sentence}");
            ExitCode::from(1)
        }
        Err(Trouble::Told) => ExitCode::from(1),
    }
}

/// Help goes to standard output; a mistake becomes one sentence on standard error.
fn report_usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        print!("{error}");
        return ExitCode::SUCCESS;
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        eprintln!("dp: a command is needed, such as `dp decode 10 03 02 49 4E 16`; `dp --help` lists them");
        return ExitCode::from(2);
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
    eprintln!("dp: {sentence}; `dp help` and `dp COMMAND --help` list what is allowed");
    ExitCode::from(2)
}
