//! `dp get-cfg`, `dp read-inputs`, `dp read-outputs`: what a slave has, whoever owns it.

use clap::Args;
use dp_master::address::Address;
use dp_master::dp::class2::{GetCfg, RdInp, RdOutp};
use dp_master::dp::io_lengths;
use dp_master::wire::{Hex, Modules};
use serde_json::json;

use crate::line_args::parse_station;
use crate::output::{Outcome, Output};
use crate::session::{LineArgs, Session};

/// What these commands take.
#[derive(Debug, Args)]
pub(crate) struct ReadArgs {
    #[command(flatten)]
    line: LineArgs,
    /// The slave.
    #[arg(long, value_name = "N", value_parser = parse_station)]
    address: Address,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// The identifiers of a slave and what they amount to.
pub(crate) fn get_cfg(args: &ReadArgs) -> Outcome {
    let mut session = Session::open(&args.line)?;
    let identifiers = session.need(args.address, GetCfg { peer: args.address })?;
    session.leave();
    let modules: Vec<String> = Modules(&identifiers).map(|module| module.to_string()).collect();
    let lengths = io_lengths(&identifiers);
    let mut out = Output::new();
    if args.json {
        out.json(&json!({
            "address": args.address.value(),
            "identifiers": Hex(&identifiers).to_string(),
            "modules": modules,
            "inputs": lengths.as_ref().ok().map(|lengths| lengths.inputs),
            "outputs": lengths.as_ref().ok().map(|lengths| lengths.outputs),
        }));
    } else {
        out.line(format_args!("station {}: {}", args.address, Hex(&identifiers)));
        for (index, module) in modules.iter().enumerate() {
            out.line(format_args!("  {index:>3}  {module}"));
        }
        match lengths {
            Ok(lengths) => out.line(format_args!(
                "{} octets of inputs, {} octets of outputs",
                lengths.inputs, lengths.outputs
            )),
            Err(error) => out.line(error),
        }
    }
    out.flush();
    Ok(())
}

/// The inputs of a slave in data exchange.
pub(crate) fn read_inputs(args: &ReadArgs) -> Outcome {
    let mut session = Session::open(&args.line)?;
    let image = session.need(args.address, RdInp { peer: args.address })?;
    session.leave();
    show(args, &image)
}

/// The outputs of a slave in data exchange.
pub(crate) fn read_outputs(args: &ReadArgs) -> Outcome {
    let mut session = Session::open(&args.line)?;
    let image = session.need(args.address, RdOutp { peer: args.address })?;
    session.leave();
    show(args, &image)
}

fn show(args: &ReadArgs, octets: &[u8]) -> Outcome {
    let mut out = Output::new();
    if args.json {
        out.json(&json!({ "address": args.address.value(), "data": Hex(octets).to_string() }));
    } else if octets.is_empty() {
        out.line("no octets in this direction");
    } else {
        for (row, octets) in octets.chunks(16).enumerate() {
            out.line(format_args!("{:>4}  {}", row * 16, Hex(octets)));
        }
    }
    out.flush();
    Ok(())
}
