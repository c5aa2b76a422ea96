//! `lenze9300 step`: the answer of a closed loop.

use clap::Args;
use lenze9300_model::response::plot_step;

use crate::loop_args::{LoopArgs, Measured, Verdict, write_picture};

/// What `lenze9300 step` takes.
#[derive(Debug, Args)]
pub(crate) struct StepArgs {
    #[command(flatten)]
    common: LoopArgs,
}

/// Measures, prints, draws.
pub(crate) fn step(args: &StepArgs) -> Result<Verdict, String> {
    let args = &args.common;
    let measured = Measured::new(args)?;
    if let (Some(path), Some(step)) = (&args.plot, &measured.step) {
        let svg = plot_step(step, args.which.kind()).map_err(|error| error.to_string())?;
        write_picture(path, &svg)?;
    }
    measured.print(args)
}
