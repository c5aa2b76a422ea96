//! The table of what was tried: `TRUST.md`.

use std::fmt::Write;

use super::soak::Soak;
use super::{FAMILIES, Outcome};
use crate::safety_monitor::SafetyRule;

/// The table as Markdown.
pub fn table(outcomes: &[Outcome], soak: Option<&Soak>, seed: u64) -> String {
    let mut text = String::from(HEAD);
    text.push_str("\n| family | fault | rule | cases tried | result | repeat with |\n|---|---|---|---|---|---|\n");
    for family in FAMILIES {
        let Some(outcome) = outcomes.iter().find(|outcome| outcome.name == family.name) else {
            continue;
        };
        let (name, cases) = (outcome.name, outcome.cases);
        let result = match outcome.failures.len() {
            0 => "held in all".to_string(),
            broken => format!("**not held in {broken}**"),
        };
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {cases} | {result} | `{COMMAND} --only {name} --cases {cases} --seed {seed}` |",
            family.fault, family.rule
        );
    }
    if let Some(soak) = soak {
        let result = format!(
            "{}: {} landed, {} not finished and said so, {} disturbances, at most {:.4} mm off the sum, memory grew {} KiB",
            if soak.ok() { "held" } else { "**not held**" },
            soak.landed,
            soak.reported,
            soak.disturbances,
            soak.worst_sum_mm,
            soak.grown_kib
        );
        let _ = writeln!(
            text,
            "| soak | feeds of 200 mm with bit errors at 1e-6 and every 50th disturbed (cable, second master, guard) | {SOAK_RULE} | {} feeds on {} rigs | {result} | `{COMMAND} --cases 0 --soak {} --rigs {} --seed {seed}` |",
            soak.commanded, soak.rigs, soak.commanded, soak.rigs
        );
    }
    text.push_str("\n## Safety rules, at every tick of 125 µs of every case\n\n| rule | source |\n|---|---|\n");
    for rule in SafetyRule::ALL {
        let _ = writeln!(text, "| {} | {} |", rule.text(), rule.source());
    }
    for outcome in outcomes.iter().filter(|outcome| !outcome.failures.is_empty()) {
        let _ = writeln!(text, "\n## Not held: {}\n", outcome.name);
        for (number, reason) in outcome.failures.iter().take(3) {
            let _ = writeln!(text, "- case {number}: {}", reason.lines().next().unwrap_or_default());
        }
    }
    text
}

const COMMAND: &str = "cargo run --release -p system-tests --bin campaign --";

const SOAK_RULE: &str = "feeds commanded = landed within ±0.01 mm + reported as not finished; every film stands within ±0.02 mm of the sum of its feeds, whole increments of a roller of π · 57 mm, since the last interruption (both ends lie within ±0.01 mm); resident memory grows by 16 MiB at most";

const HEAD: &str = "# What was attacked, and what held

Written by the program `campaign` of the package `system-tests`; do not edit. All of it is modelled: block, master, line, module,
drive and film in virtual time. It says nothing about a machine (`SAFETY.md`). Each case ends with the cause gone, the
operator's stop and acknowledgement, and a feed that must land.
";
