//! `film-feed advise`: what will go wrong, before it does.

use clap::Args;

use super::machine::MachineArgs;
use crate::advise::{Advice, Demands, advise};
use crate::operator::FeedPlan;
use crate::rig::RigConfig;

/// What `film-feed advise` takes.
#[derive(Debug, Clone, Args)]
pub struct AdviseArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// Print the findings as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Prints the findings; `Ok(true)` when nothing goes wrong by the machine's values alone.
///
/// # Errors
/// What was wrong with what was given.
pub fn run(args: &AdviseArgs) -> Result<bool, String> {
    let (machine, _) = args.machine.read()?;
    let rig = machine.rig_config(1).map_err(|error| error.to_string())?;
    let demands = Demands {
        tolerance_mm: machine.feed.tolerance_mm,
        cycle_s: Some(machine.feed.cycle_s),
    };
    let advice = advise(&rig, &machine.feed_plan(1), &demands);
    super::print(args.json, &advice)?;
    Ok(advice.ok)
}

/// Warns, on standard error, of what the values of a run make go wrong. What only may happen is left to `film-feed advise`.
pub(super) fn warn(rig: &RigConfig, plan: &FeedPlan) {
    let advice: Advice = advise(rig, plan, &Demands::default());
    for finding in advice.failures() {
        eprintln!("film-feed: warning: {finding}");
    }
}
