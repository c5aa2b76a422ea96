//! The modelled drive as a process.

mod bode;
mod loop_args;
mod monitor;
mod operator;
mod outcome;
mod param;
mod program;
mod provisional;
mod reader;
mod scope;
mod scope_orders;
mod serve;
mod signals;
mod state;
mod step;
mod system_bus;
mod way;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use outcome::{Done, EXIT_CODES, Failed};

/// A modelled Lenze 9300 servo position controller with its PROFIBUS module.
#[derive(Debug, Parser)]
#[command(name = "lenze9300", version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Answer a DP master on a serial line or a pseudo-terminal, and clients on the CAN system bus, in real time.
    #[command(after_help = EXIT_CODES)]
    Serve(serve::ServeArgs),
    /// Read, write, list, save, load and compare the codes of a drive, over CAN, PROFIBUS DP-V1 or in a file.
    #[command(after_help = EXIT_CODES)]
    Param(param::ParamArgs),
    /// Show state, fault and values of a running drive.
    #[command(after_help = EXIT_CODES)]
    Monitor(monitor::MonitorArgs),
    /// Record values of a running drive into a file.
    #[command(after_help = EXIT_CODES)]
    Scope(scope::ScopeArgs),
    /// Check a traversing program, or bring its codes into a drive.
    #[command(after_help = EXIT_CODES)]
    Program(program::ProgramArgs),
    /// List the signals that can be recorded, with unit and meaning.
    #[command(after_help = EXIT_CODES)]
    Signals(signals::SignalsArgs),
    /// Let a control loop answer a small step of its set-value: rise, overshoot, settling, margins.
    #[command(after_help = EXIT_CODES)]
    Step(step::StepArgs),
    /// Frequency response of an open control loop: crossover and margins.
    #[command(after_help = EXIT_CODES)]
    Bode(bode::BodeArgs),
}

/// The job ran and did not succeed, or the drive does not answer.
const NOT_DONE: u8 = 1;
/// Something given was wrong, or the port broke.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            print!("{error}");
            return ExitCode::SUCCESS;
        }
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            return fail("a subcommand is needed, such as `lenze9300 serve --pty /tmp/drive`");
        }
        Err(error) => {
            let text = error.to_string();
            // What follows the first empty line is usage. What comes before may be a list over several lines.
            let lines: Vec<&str> = text
                .lines()
                .take_while(|line| !line.trim().is_empty())
                .map(str::trim)
                .collect();
            let message = lines.join(" ");
            let sentence = message.strip_prefix("error: ").unwrap_or(&message);
            return fail(&format!(
                "{sentence}; `lenze9300 {}--help` lists what is allowed",
                subcommand()
            ));
        }
    };
    match cli.command {
        Command::Serve(args) => match serve::serve(&args) {
            Ok(never) => match never {},
            Err(sentence) => fail(&sentence),
        },
        Command::Param(args) => end(param::param(&args)),
        Command::Monitor(args) => end(monitor::monitor(&args)),
        Command::Scope(args) => end(scope::scope(&args)),
        Command::Program(args) => end(program::program(&args)),
        Command::Signals(args) => match signals::signals(&args) {
            Ok(()) => ExitCode::SUCCESS,
            Err(sentence) => fail(&sentence),
        },
        Command::Step(args) => finish(step::step(&args)),
        Command::Bode(args) => finish(bode::bode(&args)),
    }
}

/// The subcommand that was typed, with a space behind it; empty when there was none.
fn subcommand() -> String {
    let known = [
        "serve", "param", "monitor", "scope", "program", "signals", "step", "bode",
    ];
    let typed = std::env::args().nth(1).unwrap_or_default();
    known
        .iter()
        .find(|name| **name == typed)
        .map_or(String::new(), |name| format!("{name} "))
}

/// The exit code of a measurement: it failed when the loop does not come to rest.
fn finish(outcome: Result<loop_args::Verdict, String>) -> ExitCode {
    match outcome {
        Ok(loop_args::Verdict::Stable) => ExitCode::SUCCESS,
        Ok(loop_args::Verdict::Unstable) => {
            eprintln!("lenze9300: the loop is unstable with these gains; lower the gain or raise the integral time");
            ExitCode::from(NOT_DONE)
        }
        Err(sentence) => fail(&sentence),
    }
}

/// The exit code of a job at a drive.
fn end(outcome: Result<Done, Failed>) -> ExitCode {
    match outcome {
        Ok(Done::Yes) => ExitCode::SUCCESS,
        Ok(Done::No) => ExitCode::from(NOT_DONE),
        Err(Failed::AtDrive(sentence)) => {
            eprintln!("lenze9300: {sentence}");
            ExitCode::from(NOT_DONE)
        }
        Err(Failed::Given(sentence)) => fail(&sentence),
    }
}

fn fail(sentence: &str) -> ExitCode {
    eprintln!("lenze9300: {sentence}");
    ExitCode::from(BAD_INPUT)
}
