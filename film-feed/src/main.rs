//! The film feed application.

use std::process::ExitCode;

fn main() -> ExitCode {
    film_feed::cli::main()
}
