//! Searches the models of `system_tests::model_check` completely and prints what was found.
//!
//! Exit code 0: every rule holds, but for what is documented; 1: something else was found, or a search did not end; 2: used wrongly.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use system_tests::model_check::{MODELS, Named, Verdict};

/// Enumerates start-up and parameter handshake completely.
#[derive(Parser)]
struct Arguments {
    /// Which models; all of them without one.
    #[arg(value_parser = named, value_name = "MODEL")]
    models: Vec<&'static Named>,
    /// One JSON object a line instead of text.
    #[arg(long)]
    json: bool,
    /// Tell which models there are.
    #[arg(long)]
    list: bool,
}

fn named(name: &str) -> Result<&'static Named, String> {
    MODELS.iter().find(|model| model.name == name).ok_or_else(|| {
        let names: Vec<_> = MODELS.iter().map(|model| model.name).collect();
        format!("there is no such model; there are {}", names.join(", "))
    })
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.list {
        for model in &MODELS {
            println!("{:<20} {}", model.name, model.about);
        }
        return ExitCode::SUCCESS;
    }
    let models = match arguments.models.as_slice() {
        [] => MODELS.iter().collect(),
        chosen => chosen.to_vec(),
    };
    let mut code = ExitCode::SUCCESS;
    for model in models {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{prefix}: {pos} states, {elapsed}") {
            bar.set_style(style);
        }
        bar.set_prefix(model.name);
        let begin = Instant::now();
        let report = (model.run)(&mut |states| bar.set_position(states as u64));
        bar.finish_and_clear();
        if report.verdict() != Verdict::Holds {
            code = ExitCode::FAILURE;
        }
        if arguments.json {
            match serde_json::to_string(&report) {
                Ok(line) => println!("{line}"),
                Err(error) => {
                    eprintln!("the report cannot be written as JSON: {error}");
                    return ExitCode::FAILURE;
                }
            }
        } else {
            println!("{report}\n  {:.1} s", begin.elapsed().as_secs_f64());
        }
    }
    code
}
