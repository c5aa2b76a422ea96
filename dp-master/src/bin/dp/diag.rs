//! `dp diag`: the diagnosis of a slave, in words.

use std::path::PathBuf;

use clap::Args;
use dp_master::address::Address;
use dp_master::dp::class2::ReadDiag;
use dp_master::dp::{Block, Diagnosis, Overflow, StandardDiag, StationStatus};
use dp_master::gsd::DiagnosisText;
use dp_master::wire::Hex;
use serde::Serialize;

use crate::gsd_file::read_gsd;
use crate::line_args::parse_station;
use crate::output::{Outcome, Output, note};
use crate::session::{LineArgs, Session};

/// What `dp diag` takes.
#[derive(Debug, Args)]
pub(crate) struct DiagArgs {
    #[command(flatten)]
    line: LineArgs,
    /// The slave.
    #[arg(long, value_name = "N", value_parser = parse_station)]
    address: Address,
    /// Its GSD file, for the maker's texts.
    #[arg(long, value_name = "FILE.gsd")]
    gsd: Option<PathBuf>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// Reads the diagnosis. A master that owns the slave loses nothing by it.
pub(crate) fn diag(args: &DiagArgs) -> Outcome {
    let gsd = args
        .gsd
        .as_deref()
        .map(read_gsd)
        .transpose()?
        .map(|reading| reading.gsd);
    let mut session = Session::open(&args.line)?;
    let diagnosis = session.need(args.address, ReadDiag { peer: args.address })?;
    session.leave();
    let standard = &diagnosis.standard;
    if let Some(gsd) = &gsd
        && let Some(ident) = gsd.general.ident_number
        && ident != standard.ident
    {
        note(format_args!(
            "the GSD file is for ident number {ident:04X}, the slave has {:04X}: texts may be wrong",
            standard.ident
        ));
    }
    let texts = gsd.map_or_else(Vec::new, |gsd| gsd.diagnosis_texts(&diagnosis));
    let mut out = Output::new();
    if args.json {
        out.json(&report(args.address, &diagnosis, texts));
    } else {
        out.line(format_args!(
            "station {}, ident number {:04X}",
            args.address, standard.ident
        ));
        match standard.master {
            StandardDiag::NO_MASTER => out.line("no master has parametrised it"),
            master => out.line(format_args!("parametrised by master {master}")),
        }
        for (name, meaning) in status_bits(standard.status) {
            out.line(format_args!("  {name:<24} {meaning}"));
        }
        if standard.overflow() == Overflow::Truncated {
            out.line("  Ext_Diag_Overflow        there is more diagnosis than the telegram holds");
        }
        if diagnosis.extended.is_empty() {
            out.line("no extended diagnosis");
        } else {
            out.line(format_args!("extended diagnosis {}", Hex(&diagnosis.extended)));
        }
        for block in diagnosis.blocks() {
            out.line(format_args!("  {}", describe(&block)));
        }
        for text in &texts {
            out.line(format_args!("  \"{text}\""));
            if let Some(help) = &text.help {
                out.line(format_args!("    {help}"));
            }
        }
    }
    out.flush();
    Ok(())
}

#[derive(Serialize)]
struct Report {
    address: u8,
    ident: String,
    master: Option<u8>,
    status: Vec<&'static str>,
    overflow: bool,
    extended: String,
    blocks: Vec<String>,
    texts: Vec<DiagnosisText>,
}

fn report(address: Address, diagnosis: &Diagnosis, texts: Vec<DiagnosisText>) -> Report {
    let standard = &diagnosis.standard;
    Report {
        address: address.value(),
        ident: format!("{:04X}", standard.ident),
        master: (standard.master != StandardDiag::NO_MASTER).then_some(standard.master),
        status: status_bits(standard.status).map(|(name, _)| name).collect(),
        overflow: standard.overflow() == Overflow::Truncated,
        extended: Hex(&diagnosis.extended).to_string(),
        blocks: diagnosis.blocks().map(|block| describe(&block)).collect(),
        texts,
    }
}

/// The bits that are set, with their meaning. Source: IEC 61158-6-3, Slave_Diag, octets 1 and 2.
fn status_bits(status: StationStatus) -> impl Iterator<Item = (&'static str, &'static str)> {
    STATUS_BITS
        .into_iter()
        .filter(move |(bit, ..)| status.contains(*bit))
        .map(|(_, name, meaning)| (name, meaning))
}

const STATUS_BITS: [(StationStatus, &str, &str); 14] = [
    (
        StationStatus::STATION_NON_EXISTENT,
        "Station_Non_Existent",
        "its master gets no answer from it",
    ),
    (
        StationStatus::STATION_NOT_READY,
        "Station_Not_Ready",
        "not ready to exchange data",
    ),
    (
        StationStatus::CFG_FAULT,
        "Cfg_Fault",
        "the configuration does not fit its modules",
    ),
    (
        StationStatus::EXT_DIAG,
        "Ext_Diag",
        "the extended diagnosis reports a fault",
    ),
    (
        StationStatus::NOT_SUPPORTED,
        "Not_Supported",
        "something was asked for that it cannot",
    ),
    (
        StationStatus::INVALID_SLAVE_RESPONSE,
        "Invalid_Slave_Response",
        "its master got an answer that makes no sense",
    ),
    (
        StationStatus::PRM_FAULT,
        "Prm_Fault",
        "the parameters do not fit: ident number, length or values",
    ),
    (
        StationStatus::MASTER_LOCK,
        "Master_Lock",
        "another master has parametrised it",
    ),
    (StationStatus::PRM_REQ, "Prm_Req", "waits for parameters"),
    (
        StationStatus::STAT_DIAG,
        "Stat_Diag",
        "has no valid data until this ends",
    ),
    (StationStatus::WD_ON, "WD_On", "its watchdog runs"),
    (StationStatus::FREEZE_MODE, "Freeze_Mode", "its inputs are frozen"),
    (StationStatus::SYNC_MODE, "Sync_Mode", "its outputs are frozen"),
    (StationStatus::DEACTIVATED, "Deactivated", "its master leaves it alone"),
];

fn describe(block: &Block<'_>) -> String {
    match block {
        Block::Device(octets) => format!("device: {}", Hex(octets)),
        Block::Identifiers(modules) => {
            let places: Vec<String> = modules.iter().map(|place| place.to_string()).collect();
            match places.as_slice() {
                [] => "no module has a diagnosis".to_owned(),
                places => format!("modules with a diagnosis, from 0: {}", places.join(", ")),
            }
        }
        Block::Channel(channel) => format!(
            "{} channel {} of module {} ({}): {}",
            channel.direction.text(),
            channel.channel,
            channel.module,
            channel.unit.text(),
            channel
                .error
                .text()
                .map_or_else(|| format!("fault {}", channel.error.0), ToOwned::to_owned)
        ),
        Block::Revision(revision) => format!("revision {revision}"),
        Block::Malformed { fault, .. } => format!("malformed: {fault}"),
    }
}
