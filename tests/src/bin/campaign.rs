//! Runs the fault campaign and writes `TRUST.md`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use system_tests::campaign::soak::soak;
use system_tests::campaign::{FAMILIES, trust, try_family};

/// Tries faults on the modelled machine and tells whether the rules held.
///
/// Exit code 0: all held; 1: one did not, or the file could not be written; 2: used wrongly.
#[derive(Debug, Parser)]
struct Arguments {
    /// Cases of each family.
    #[arg(long, default_value_t = 60)]
    cases: usize,
    /// Five cases of each family.
    #[arg(long, conflicts_with = "cases")]
    short: bool,
    /// Only families with these names.
    #[arg(long, value_parser = FAMILIES.iter().map(|family| family.name).collect::<Vec<_>>())]
    only: Vec<String>,
    /// Seed of everything that is drawn.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Feeds of the soak behind the campaign.
    #[arg(long, default_value_t = 0)]
    soak: u64,
    /// Machines among which the feeds of the soak are divided.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    rigs: u64,
    /// Writes the table to this file.
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Prints one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let cases = if arguments.short { 5 } else { arguments.cases };
    let families: Vec<_> = FAMILIES
        .iter()
        .filter(|family| arguments.only.is_empty() || arguments.only.iter().any(|name| name == family.name))
        .collect();
    let bar = ProgressBar::new((families.len() * cases) as u64 + arguments.soak);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg} {elapsed}, {eta} left") {
        bar.set_style(style);
    }
    let mut outcomes = Vec::new();
    if cases > 0 {
        for family in families {
            bar.set_message(family.name);
            outcomes.push(try_family(family, cases, arguments.seed, || bar.inc(1)));
        }
    }
    bar.set_message("soak");
    let soaked = (arguments.soak > 0).then(|| soak(arguments.soak, arguments.rigs, arguments.seed, || bar.inc(1)));
    bar.finish_and_clear();

    let table = trust::table(&outcomes, soaked.as_ref(), arguments.seed);
    if arguments.json {
        println!("{}", serde_json::json!({ "families": outcomes, "soak": soaked }));
    } else {
        print!("{table}");
    }
    if let Some(file) = &arguments.write
        && let Err(error) = std::fs::write(file, &table)
    {
        eprintln!("{} could not be written: {error}", file.display());
        return ExitCode::from(1);
    }
    let held =
        outcomes.iter().all(|outcome| outcome.failures.is_empty()) && soaked.as_ref().is_none_or(|soak| soak.ok());
    if let Some(soak) = &soaked {
        for failure in &soak.failures {
            eprintln!("soak: {failure}");
        }
    }
    if held { ExitCode::SUCCESS } else { ExitCode::from(1) }
}
