//! The modelled drive as a process.

mod reader;
mod serve;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

/// A modelled Lenze 9300 servo position controller with its PROFIBUS module.
#[derive(Debug, Parser)]
#[command(name = "lenze9300", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Answer a DP master on a serial line or a pseudo-terminal, in real time.
    Serve(serve::ServeArgs),
}

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
            return fail(&format!("{sentence}; `lenze9300 serve --help` lists what is allowed"));
        }
    };
    match cli.command {
        Command::Serve(args) => match serve::serve(&args) {
            Ok(never) => match never {},
            Err(sentence) => fail(&sentence),
        },
    }
}

fn fail(sentence: &str) -> ExitCode {
    eprintln!("lenze9300: {sentence}");
    ExitCode::from(BAD_INPUT)
}
