//! `film-feed size`: whether motor, gear, drive and brake resistor are large enough.

use std::fmt;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::machine::MachineArgs;
use super::output_file::OutputFile;
use crate::machine_file::{Gear, MachineFile};
use crate::size::{self, Selection, Sizing, Supply};

/// What `film-feed size` takes.
#[derive(Debug, Clone, Args)]
pub struct SizeArgs {
    #[command(flatten)]
    machine: MachineArgs,
    /// Print the sizing as one JSON object.
    #[arg(long)]
    json: bool,
    /// Write the sizing with its pictures as one HTML page.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// A further axis on the same DC link, whose power is summed up; may be given several times.
    #[arg(long, value_name = "MACHINE.toml", conflicts_with_all = ["html", "plot", "candidates"])]
    with: Vec<PathBuf>,
    /// Size every motor of the catalogue on every drive instead, the smallest that is large enough first.
    #[arg(long, conflicts_with_all = ["html", "plot"])]
    candidates: bool,
    /// Gears to try with --candidates, such as 5,7,10 or 7:2; that of the machine if not given.
    #[arg(long, value_name = "I,…", value_delimiter = ',', requires = "candidates")]
    gears: Vec<Gear>,
    /// Draw the operating points in the torque-speed diagram, as SVG, or as PNG by the name of the file.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

/// Sizes the machine; `Ok(true)` when no row is beyond its limit, or one of the candidates is large enough.
///
/// # Errors
/// What was wrong with what was given.
pub fn run(args: &SizeArgs) -> Result<bool, String> {
    let (machine, catalogue) = args.machine.read()?;
    if args.candidates {
        let own = [machine.gear()];
        let gears = if args.gears.is_empty() { &own } else { &args.gears[..] };
        let selection = Selection::of(&machine, &catalogue, gears);
        super::print(args.json, &selection)?;
        return Ok(selection.ok());
    }
    if !args.with.is_empty() {
        return several(args, machine);
    }
    let page = args.html.as_deref().map(OutputFile::create).transpose()?;
    let picture = args.plot.as_deref().map(OutputFile::create).transpose()?;
    let sizing = Sizing::of(&machine);
    if let Some(file) = page {
        let page = size::html(&machine, &sizing).map_err(|error| error.to_string())?;
        file.commit(|out| out.write_all(page.as_bytes()))?;
    }
    if let Some(file) = picture {
        let svg = size::torque_over_speed(&machine, &sizing).map_err(|error| error.to_string())?;
        let octets = super::picture(args.plot.as_deref(), &svg)?;
        file.commit(|out| out.write_all(&octets))?;
    }
    super::print(args.json, &sizing)?;
    Ok(sizing.ok())
}

/// Several axes, each sized by itself, and what they draw together.
#[derive(Debug, Serialize)]
struct Axes {
    axes: Vec<Sizing>,
    supply: Option<Supply>,
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for sizing in &self.axes {
            write!(f, "{sizing}\n\n")?;
        }
        let Some(supply) = &self.supply else { return Ok(()) };
        write!(
            f,
            "{supply}\n\nThe link is one: what the single axes say of theirs does not count."
        )
    }
}

fn several(args: &SizeArgs, first: MachineFile) -> Result<bool, String> {
    let mut machines = vec![first];
    for path in &args.with {
        machines.push(args.machine.read_another(path)?);
    }
    let axes = Axes {
        axes: machines.iter().map(Sizing::of).collect(),
        supply: Supply::of(&machines),
    };
    super::print(args.json, &axes)?;
    let together = axes.supply.as_ref().is_none_or(|supply| supply.ok);
    // On a link of their own the brake rows of each axis would count; on the common one those of the supply do.
    let apart = axes
        .axes
        .iter()
        .flat_map(Sizing::failures)
        .all(|row| row.group == "braking");
    Ok(together && apart)
}
