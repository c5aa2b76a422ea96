//! `lenze9300 signals`: what can be recorded, by name.

use std::io::{self, Write};

use clap::Args;
use lenze9300_model::signal::Signal;
use serde::Serialize;

/// What `lenze9300 signals` takes.
#[derive(Debug, Args)]
pub(crate) struct SignalsArgs {
    /// One JSON array instead of the table.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row {
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
}

/// Lists the signals.
pub(crate) fn signals(args: &SignalsArgs) -> Result<(), String> {
    write(args, &mut io::stdout().lock()).or_else(|error| match error.kind() {
        // Whoever closed the pipe has read enough.
        io::ErrorKind::BrokenPipe => Ok(()),
        _ => Err(format!("standard output: {error}")),
    })
}

fn write(args: &SignalsArgs, out: &mut impl Write) -> io::Result<()> {
    let rows = Signal::ALL.map(|signal| Row {
        name: signal.name(),
        unit: signal.unit(),
        meaning: signal.meaning(),
    });
    if args.json {
        serde_json::to_writer(&mut *out, &rows)?;
        return writeln!(out);
    }
    writeln!(out, "{:<12} {:<6} meaning", "signal", "unit")?;
    for row in rows {
        writeln!(out, "{:<12} {:<6} {}", row.name, row.unit, row.meaning)?;
    }
    Ok(())
}
