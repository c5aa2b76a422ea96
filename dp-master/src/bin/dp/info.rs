//! `dp info`: a GSD file on one page.

use std::path::PathBuf;

use clap::Args;

use crate::gsd_file::read_gsd;
use crate::output::{Outcome, Output, Trouble};

/// What `dp info` takes.
#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// The GSD file.
    #[arg(value_name = "FILE.gsd")]
    file: PathBuf,
    /// Everything that was read as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Shows the description, and what is wrong with the file by line; it fails when there are errors.
pub(crate) fn info(args: &InfoArgs) -> Outcome {
    let reading = read_gsd(&args.file)?;
    let mut out = Output::new();
    if args.json {
        out.json(&reading);
    } else {
        out.text(reading.gsd.summary());
        for remark in &reading.diagnostics {
            out.line(format_args!(
                "{}:{}: {}: {}",
                args.file.display(),
                remark.line(),
                remark.severity,
                remark.message
            ));
        }
    }
    out.flush();
    if reading.errors().next().is_some() {
        return Err(Trouble::Told);
    }
    Ok(())
}
