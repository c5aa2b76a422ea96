//! `lenze9300 bode`: an open loop over frequency.

use clap::Args;
use lenze9300_model::response::plot_open_loop;

use crate::loop_args::{LoopArgs, Measured, Verdict, write_picture};

/// What `lenze9300 bode` takes.
#[derive(Debug, Args)]
pub(crate) struct BodeArgs {
    #[command(flatten)]
    common: LoopArgs,
}

/// Computes, prints, draws.
pub(crate) fn bode(args: &BodeArgs) -> Result<Verdict, String> {
    let args = &args.common;
    let measured = Measured::new(args)?;
    if let Some(path) = &args.plot {
        let svg = plot_open_loop(&measured.open_loop, args.which.kind()).map_err(|error| error.to_string())?;
        write_picture(path, &svg)?;
    }
    measured.print(args)
}
