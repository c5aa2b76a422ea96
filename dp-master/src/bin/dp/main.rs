//! `dp`: a tool to see and to work a PROFIBUS line.
//!
//! A file per command. Exit codes: 0 done, 1 ran and failed, 2 something given was wrong.

mod acyclic;
mod bus_statistics;
mod busparam;
mod config_text;
mod decode;
mod diag;
mod gsd_file;
mod info;
mod interrupt;
mod late_bar;
mod line_args;
mod list;
mod network;
mod output;
mod read_image;
mod run;
mod run_command;
mod run_config;
mod run_events;
mod run_view;
mod session;
mod set_address;
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
    /// Tell who is on a line: every station with its type, slaves with ident number, owner and status.
    List(list::ListArgs),
    /// Read the diagnosis of a slave, in words.
    Diag(diag::DiagArgs),
    /// Read the configuration that a slave has.
    GetCfg(read_image::ReadArgs),
    /// Read the inputs of a slave in data exchange.
    ReadInputs(read_image::ReadArgs),
    /// Read the outputs of a slave in data exchange.
    ReadOutputs(read_image::ReadArgs),
    /// Read a data record of a DP-V1 slave, whoever owns it.
    Read(acyclic::ReadArgs),
    /// Write a data record of a DP-V1 slave, whoever owns it.
    Write(acyclic::WriteArgs),
    /// Give a slave without switches an address.
    SetAddress(set_address::SetAddressArgs),
    /// Show a GSD file on one page, with its mistakes by line.
    Info(info::InfoArgs),
    /// Run a master with a process image, shown live; outputs are set by typing.
    Run(run::RunArgs),
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
        Command::List(args) => list::list(args),
        Command::Diag(args) => diag::diag(args),
        Command::GetCfg(args) => read_image::get_cfg(args),
        Command::ReadInputs(args) => read_image::read_inputs(args),
        Command::ReadOutputs(args) => read_image::read_outputs(args),
        Command::Read(args) => acyclic::read(args),
        Command::Write(args) => acyclic::write(args),
        Command::SetAddress(args) => set_address::set_address(args),
        Command::Info(args) => info::info(args),
        Command::Run(args) => run::run(args),
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
