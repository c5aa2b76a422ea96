//! `dp list`: who is on the line.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant as StdInstant;

use clap::Args;
use dp_master::address::Address;
use dp_master::dp::StandardDiag;
use dp_master::dp::class2::{LiveList, LiveListEvent, ReadDiag, Scan};
use dp_master::wire::{StationType, StatusBits};
use serde::Serialize;

use crate::gsd_file::read_gsd;
use crate::late_bar::LateBar;
use crate::line_args::parse_station;
use crate::output::{Outcome, Output, Trouble};
use crate::session::{LONGEST_WAIT, LineArgs, Session};

/// What `dp list` takes.
#[derive(Debug, Args)]
pub(crate) struct ListArgs {
    #[command(flatten)]
    line: LineArgs,
    /// Highest address to ask.
    #[arg(long, value_name = "N", default_value = "126", value_parser = parse_station)]
    to: Address,
    /// GSD file of a device that may be there, for its name; may be given several times.
    #[arg(long, value_name = "FILE.gsd")]
    gsd: Vec<PathBuf>,
    /// One JSON object for each station.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Row {
    address: u8,
    station: &'static str,
    this_program: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    ident: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    /// The master that has parametrised it.
    #[serde(skip_serializing_if = "Option::is_none")]
    master: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    status: Option<String>,
}

/// Asks every address once, then every slave for its diagnosis; it fails when nobody answers.
pub(crate) fn list(args: &ListArgs) -> Outcome {
    let mut names = BTreeMap::new();
    for path in &args.gsd {
        let general = read_gsd(path)?.gsd.general;
        if let Some(ident) = general.ident_number {
            names.insert(ident, general.model_name.unwrap_or_default());
        }
    }
    let mut session = Session::open(&args.line)?;
    let found = scan(args, &mut session)?;
    let mut out = Output::new();
    if !args.json {
        out.line(format_args!(
            "{:>7}  {:<16} {:<6} {:<8} {}",
            "address", "station", "ident", "master", "status"
        ));
    }
    let mut others = 0;
    for (address, station) in found {
        let own = address == args.line.own_address;
        others += u32::from(!own);
        let mut row = Row {
            address: address.value(),
            station: station_name(station),
            this_program: own,
            ident: None,
            name: None,
            master: None,
            status: None,
        };
        if station == StationType::Slave
            && let Ok(diagnosis) = session.ask(ReadDiag { peer: address })?
        {
            let standard = diagnosis.standard;
            row.ident = Some(format!("{:04X}", standard.ident));
            row.name = names.get(&standard.ident).cloned();
            row.master = (standard.master != StandardDiag::NO_MASTER).then_some(standard.master);
            row.status = Some(StatusBits(standard.status).to_string());
        }
        if args.json {
            out.json(&row);
            continue;
        }
        let status = match (own, row.status) {
            (true, _) => "this program".to_owned(),
            (false, status) => [status, row.name].into_iter().flatten().collect::<Vec<_>>().join("  "),
        };
        let master = match (row.station, row.master) {
            (_, Some(master)) => master.to_string(),
            ("slave", None) if row.ident.is_some() => "none".to_owned(),
            _ => String::new(),
        };
        let line = format!(
            "{:>7}  {:<16} {:<6} {:<8} {}",
            row.address,
            row.station,
            row.ident.unwrap_or_default(),
            master,
            status
        );
        out.line(line.trim_end());
    }
    session.leave();
    out.flush();
    if others == 0 {
        return Err(Trouble::failed(
            "nobody else answers; are baud rate, polarity of A and B, and terminators right?",
        ));
    }
    Ok(())
}

fn scan(args: &ListArgs, session: &mut Session) -> Result<Vec<(Address, StationType)>, Trouble> {
    let mut list = LiveList::new(args.line.own_address, args.to, Scan::Once);
    let bar = LateBar::new(u64::from(args.to.value()) + 1, "{bar:40} {pos} of {len} addresses");
    let mut moved = StdInstant::now();
    let mut asked = session.master.statistics().sent;
    let mut last = 0;
    while !list.is_finished() {
        while let Some(event) = list.poll(session.master.jobs()) {
            if let LiveListEvent::Found { address, .. } = event {
                bar.advance(u64::from(address.value()).saturating_sub(last));
                last = address.value().into();
            }
        }
        let sent = session.master.statistics().sent;
        if sent != asked {
            (asked, moved) = (sent, StdInstant::now());
        }
        if moved.elapsed() > LONGEST_WAIT {
            list.cancel(session.master.jobs());
            bar.finish();
            return Err(session.no_token());
        }
        if let Err(trouble) = session.step() {
            bar.finish();
            return Err(trouble);
        }
        bar.tick();
    }
    bar.finish();
    Ok(list.stations().collect())
}

const fn station_name(station: StationType) -> &'static str {
    match station {
        StationType::Slave => "slave",
        StationType::MasterNotReady => "master not ready",
        StationType::MasterReady => "master ready",
        StationType::MasterInRing => "master in ring",
    }
}
