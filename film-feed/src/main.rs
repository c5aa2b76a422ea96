//! The film feed application.

use std::process::ExitCode;

use clap::Parser;
use film_feed::cli::replay::{self, ReplayArgs};

/// The film feed: PLC block, bus, drive and film in one chain.
#[derive(Debug, Parser)]
#[command(version)]
enum Command {
    Replay(ReplayArgs),
}

fn main() -> ExitCode {
    match Command::parse() {
        Command::Replay(args) => match replay::run(args) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{error}");
                ExitCode::from(error.exit_code())
            }
        },
    }
}
