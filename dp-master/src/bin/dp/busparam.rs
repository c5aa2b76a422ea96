//! `dp busparam`: the bus parameters of a network, and which rules it breaks.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use dp_master::address::Address;
use dp_master::fdl::{BusPlan, Optical, OpticalTopology, Others, Profile, Segment, SlaveLoad, Violation};
use dp_master::time::{Baud, BitTimes, Duration};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::line_args::parse_station;
use crate::network::{NetworkFile, centimetres, millis};
use crate::output::{Outcome, Output, Trouble};

/// What `dp busparam` takes: a file, or the network in arguments.
#[derive(Debug, Args)]
pub(crate) struct BusparamArgs {
    /// The network as a file; docs/examples/network.toml shows one.
    #[arg(value_name = "NETWORK.toml", conflicts_with_all = ["baud", "profile", "segment", "repeaters", "optical", "master",
        "slave", "hsa", "acyclic", "watchdog", "constant_cycle"])]
    file: Option<PathBuf>,
    /// Baud rate in bit/s.
    #[arg(long, value_name = "RATE", required_unless_present = "file")]
    baud: Option<Baud>,
    /// How the parameters are chosen.
    #[arg(long, value_enum, default_value_t = ProfileName::Dp)]
    profile: ProfileName,
    /// A piece of cable, its stations with repeaters and its stub lines, such as 120:12 or 80.5:8:1.5; may be given several times.
    #[arg(long, value_name = "METRES[:STATIONS[:STUBS]]", value_parser = parse_segment)]
    segment: Vec<Segment>,
    /// Repeaters in series.
    #[arg(long, value_name = "N", default_value_t = 0)]
    repeaters: u32,
    /// Optical modules and glass, such as 4:2000, or 4:2000:ring for a redundant ring.
    #[arg(long, value_name = "MODULES:METRES[:ring]", value_parser = parse_optical)]
    optical: Option<Optical>,
    /// A master; may be given several times.
    #[arg(long, value_name = "ADDRESS", value_parser = parse_station, default_value = "2")]
    master: Vec<Address>,
    /// A slave with its octets of outputs and inputs, its max Tsdr and its master if that is not the first, such as 3:16:16 or
    /// 3:16:16:150@2; may be given several times.
    #[arg(long, value_name = "ADDRESS:OUT:IN[:TSDR][@MASTER]", value_parser = parse_slave)]
    slave: Vec<(SlaveLoad, Option<Address>)>,
    /// Highest address of a master, 0…126.
    #[arg(long, value_name = "N", value_parser = parse_station)]
    hsa: Option<Address>,
    /// Acyclic message cycles of full length for each master in one rotation.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(0..=1000))]
    acyclic: u32,
    /// The watchdog wished for, ms.
    #[arg(long, value_name = "MS", value_parser = parse_millis)]
    watchdog: Option<Duration>,
    /// The constant bus cycle wished for, ms.
    #[arg(long, value_name = "MS", value_parser = parse_millis)]
    constant_cycle: Option<Duration>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ProfileName {
    /// Only the stations named.
    Dp,
    /// With room for others.
    Standard,
    /// DP and FMS, up to 1.5 Mbit/s.
    Universal,
}

/// Calculates and checks; it fails when a rule is broken.
pub(crate) fn busparam(args: &BusparamArgs) -> Outcome {
    let network = match &args.file {
        Some(path) => NetworkFile::read(path)?,
        None => network_of(args)?,
    };
    let (plan, violations) = network.with(|network| {
        let plan = network.plan();
        let mut violations: Vec<Violation> = Vec::new();
        network.check(&plan, |violation| violations.push(violation));
        (plan, violations)
    });
    let mut out = Output::new();
    let rows = rows(&plan);
    if args.json {
        out.json(&report(network.baud, &rows, &plan, &violations));
    } else {
        out.text(format_args!("{:<26} {:>10} {:>14}\n", "", "tBIT", "µs"));
        for row in &rows {
            out.line(row.text(network.baud));
        }
        out.line(format_args!("{:<26} {:>10}", "retry limit", plan.params.retry_limit));
        out.line(format_args!("{:<26} {:>10}", "GAP factor", plan.params.gap_factor));
        out.line(format_args!("{:<26} {:>10}", "HSA", plan.params.hsa));
        out.line(format_args!(
            "{:<26} {:>10} {:>14}",
            "watchdog, proposed",
            "",
            micros(plan.watchdog)
        ));
        out.line("");
        match violations.as_slice() {
            [] => out.line("the network keeps all rules"),
            violations => violations
                .iter()
                .for_each(|violation| out.line(format_args!("violated: {violation}"))),
        }
    }
    out.flush();
    if violations.is_empty() {
        Ok(())
    } else {
        Err(Trouble::Told)
    }
}

/// A value of the plan.
struct Row {
    name: &'static str,
    key: &'static str,
    bits: BitTimes,
}

impl Row {
    fn text(&self, baud: Baud) -> String {
        format!(
            "{:<26} {:>10} {:>14}",
            self.name,
            self.bits.0,
            micros(baud.duration(self.bits))
        )
    }
}

fn rows(plan: &BusPlan) -> [Row; 15] {
    let params = &plan.params;
    let row = |name, key, bits| Row { name, key, bits };
    [
        row("Tsl", "t_sl", params.t_sl),
        row("min Tsdr", "t_sdr_min", params.t_sdr_min),
        row("max Tsdr", "t_sdr_max", params.t_sdr_max),
        row("Tset", "t_set", params.t_set),
        row("Tqui", "t_qui", params.t_qui),
        row("Tid1", "t_id1", params.t_id1),
        row("Tid2", "t_id2", params.t_id2),
        row("Trdy", "t_rdy", params.t_rdy),
        row("Ttr", "t_tr", params.t_tr),
        row("Ttr, least for the load", "t_tr_least", plan.t_tr_least),
        row("there and back, 2·Ttd", "round_trip", plan.round_trip),
        row("cycle, least", "least_cycle", plan.least_cycle),
        row("cycle, typical", "typical_cycle", plan.typical_cycle),
        row("cycle, longest", "longest_cycle", plan.longest_cycle),
        row(
            "constant cycle, least",
            "least_constant_cycle",
            plan.least_constant_cycle,
        ),
    ]
}

/// Microseconds with three digits.
fn micros(span: Duration) -> String {
    format!("{}.{:03}", span.as_nanos() / 1_000, span.as_nanos() % 1_000)
}

#[derive(Serialize)]
struct Report {
    baud: u32,
    /// Each with `bits` and `us`.
    times: Map<String, Value>,
    retry_limit: u8,
    gap_factor: u8,
    hsa: u8,
    watchdog_ms: u64,
    violations: Vec<String>,
}

fn report(baud: Baud, rows: &[Row], plan: &BusPlan, violations: &[Violation]) -> Report {
    let time = |row: &Row| {
        let micros = baud.duration(row.bits).as_nanos() as f64 / 1_000.0;
        (row.key.to_owned(), json!({ "bits": row.bits.0, "us": micros }))
    };
    Report {
        baud: baud.bits_per_second(),
        times: rows.iter().map(time).collect(),
        retry_limit: plan.params.retry_limit,
        gap_factor: plan.params.gap_factor,
        hsa: plan.params.hsa.value(),
        watchdog_ms: plan.watchdog.as_nanos() / 1_000_000,
        violations: violations.iter().map(ToString::to_string).collect(),
    }
}

fn network_of(args: &BusparamArgs) -> Result<NetworkFile, Trouble> {
    let mut masters: Vec<(Address, Vec<SlaveLoad>)> =
        args.master.iter().map(|address| (*address, Vec::new())).collect();
    for (slave, owner) in &args.slave {
        let place = match owner {
            None => masters.first_mut(),
            Some(owner) => masters.iter_mut().find(|(address, _)| address == owner),
        };
        let Some((_, slaves)) = place else {
            return Err(Trouble::given(format_args!(
                "slave {} belongs to a master that is not given, name it with --master",
                slave.address
            )));
        };
        slaves.push(*slave);
    }
    Ok(NetworkFile {
        baud: args.baud.ok_or_else(|| Trouble::given("--baud RATE is needed"))?,
        profile: match args.profile {
            ProfileName::Dp => Profile::Dp,
            ProfileName::Standard => Profile::Standard,
            ProfileName::Universal => Profile::Universal,
        },
        segments: args.segment.clone(),
        repeaters: args.repeaters,
        optical: args.optical,
        masters,
        others: Others::default(),
        hsa: args.hsa,
        acyclic: args.acyclic,
        watchdog: args.watchdog,
        constant_cycle: args.constant_cycle,
    })
}

fn parse_segment(text: &str) -> Result<Segment, String> {
    let allowed = || "allowed are metres, stations 0…1000 and metres of stub lines, such as 120:12:1.5".to_owned();
    let mut parts = text.split(':');
    let metres = |part: Option<&str>| match part.map(str::parse) {
        None => Ok(0.0),
        Some(Ok(metres)) if (0.0..=100_000.0).contains(&metres) => Ok(metres),
        Some(_) => Err(allowed()),
    };
    let length: f64 = metres(parts.next())?;
    let stations = match parts.next().map(str::parse) {
        None => 0,
        Some(Ok(stations @ 0..=1000)) => stations,
        Some(_) => return Err(allowed()),
    };
    let stubs: f64 = metres(parts.next())?;
    if parts.next().is_some() {
        return Err(allowed());
    }
    Ok(Segment {
        length_cm: centimetres(length),
        stations,
        stubs_cm: centimetres(stubs),
    })
}

fn parse_optical(text: &str) -> Result<Optical, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let (modules, metres, topology) = match *parts.as_slice() {
        [modules, metres] => (modules, metres, OpticalTopology::Line),
        [modules, metres, "ring"] => (modules, metres, OpticalTopology::RedundantRing),
        _ => ("", "", OpticalTopology::Line),
    };
    match (modules.parse(), metres.parse()) {
        (Ok(modules @ 1..=1000), Ok(fibre_m @ 0..=1_000_000)) => Ok(Optical {
            modules,
            fibre_m,
            topology,
        }),
        _ => Err("allowed are modules 1…1000 and whole metres of glass, such as 4:2000 or 4:2000:ring".to_owned()),
    }
}

fn parse_slave(text: &str) -> Result<(SlaveLoad, Option<Address>), String> {
    let allowed = || {
        "allowed are address 0…126, octets 0…1000 of outputs and inputs, max Tsdr and @MASTER, such as 3:16:16:150@2"
            .to_owned()
    };
    let (load, owner) = match text.split_once('@') {
        Some((load, owner)) => (load, Some(parse_station(owner)?)),
        None => (text, None),
    };
    let parts: Vec<&str> = load.split(':').collect();
    let (address, outputs, inputs, t_sdr_max) = match *parts.as_slice() {
        [address, outputs, inputs] => (address, outputs, inputs, None),
        [address, outputs, inputs, t_sdr] => {
            let bits: u16 = t_sdr.parse().map_err(|_| allowed())?;
            (address, outputs, inputs, Some(BitTimes(bits.into())))
        }
        _ => return Err(allowed()),
    };
    let octets = |text: &str| {
        text.parse()
            .ok()
            .filter(|octets| *octets <= 1000_usize)
            .ok_or_else(allowed)
    };
    let load = SlaveLoad {
        address: parse_station(address)?,
        outputs: octets(outputs)?,
        inputs: octets(inputs)?,
        t_sdr_max,
    };
    Ok((load, owner))
}

fn parse_millis(text: &str) -> Result<Duration, String> {
    text.parse()
        .ok()
        .filter(|value| (0.0..=1e6).contains(value))
        .map(millis)
        .ok_or_else(|| "allowed are 0…1000000 ms".to_owned())
}
