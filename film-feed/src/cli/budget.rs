//! `film-feed budget`: what puts the film beside its place, and which part to pay for.

use clap::Args;

use super::machine::MachineArgs;
use crate::budget::Budget;

/// What `film-feed budget` takes.
#[derive(Debug, Clone, Args)]
pub struct BudgetArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// Print the budget as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Reckons the budget; `Ok(true)` when the root of the sum of squares is within the tolerance.
///
/// # Errors
/// What was wrong with what was given.
pub fn run(args: &BudgetArgs) -> Result<bool, String> {
    let budget = Budget::of(&args.machine.read()?.0);
    super::print(args.json, &budget)?;
    Ok(budget.ok)
}
