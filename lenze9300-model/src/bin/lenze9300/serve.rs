//! `lenze9300 serve`: the drive and its bus module in real time.

use std::convert::Infallible;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration as StdDuration, Instant as StdInstant};

use clap::Args;
use dp_master::driver::Driver;
use dp_master::phy::{PortName, ReopeningPort, SerialOptions, Transmitter, request_real_time};
use dp_master::time::{Baud, Duration};
use lenze9300_model::bus::dp::{Emf2133, Emf2133Config, IDENT};
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::{TICK_NS, TICKS_PER_MS};

use crate::reader::MarkReader;

/// What `lenze9300 serve` takes.
#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// Line to answer on: a serial device, or tcp://host:port of a serial-device server.
    #[arg(long, value_name = "PATH", required_unless_present = "pty", conflicts_with = "pty")]
    port: Option<PortName>,
    /// Make a pseudo-terminal, link it here and answer on it.
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Who switches the RS485 transmitter: adapter, rts or kernel, also as rts-inverted, and with delays in ms as rts:1:1.
    #[arg(long, value_name = "HOW", default_value = "adapter", requires = "port")]
    rs485: Transmitter,
    /// Ask for real-time priority; a note says if it is refused.
    #[arg(long)]
    real_time: bool,
    /// Baud rate in bit/s, one of the ten of PROFIBUS.
    #[arg(long, value_name = "RATE", default_value = "1500000")]
    baud: Baud,
    /// Station address, 0…125.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(0..=125))]
    address: u8,
    /// Ident number the module answers with, such as 0x00DA.
    #[arg(long, value_name = "HEX", default_value_t = format!("0x{IDENT:04X}"))]
    ident: String,
    /// Distance of the print marks that a reader at E1 sees, 200.0…2000.0 mm; 0 = no reader.
    #[arg(long, value_name = "MM", default_value = "1200", value_parser = parse_mark_distance)]
    marks_every: i32,
    /// Seed of the module's processing times.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Gaps an operating system makes inside a telegram are no end of it.
const LATENCY: Duration = Duration::from_millis(20);

/// Answers until the process is ended. A port that is gone is waited for; the drive runs on without a bus.
pub(crate) fn serve(args: &ServeArgs) -> Result<Infallible, String> {
    let config = Emf2133Config {
        address: args.address,
        ident: parse_ident(&args.ident)?,
        seed: args.seed,
        latency_allowance: LATENCY,
        ..Emf2133Config::default()
    };
    let module = Emf2133::new(config, args.baud).map_err(|error| error.to_string())?;
    let name = match (&args.port, &args.pty) {
        (Some(name), _) => name.clone(),
        (None, Some(link)) => PortName::PseudoTerminal(link.clone()),
        (None, None) => return Err("--port PATH or --pty LINK is needed to answer on".to_string()),
    };
    let serial = SerialOptions {
        transmitter: args.rs485,
        ..SerialOptions::default()
    };
    let opened = ReopeningPort::open(&name, args.baud, serial).map_err(|error| error.to_string())?;
    opened.notes.iter().for_each(note);
    if args.real_time
        && let Err(refused) = request_real_time()
    {
        note(&refused);
    }
    announce(&match (&name, &opened.far_end) {
        (PortName::PseudoTerminal(link), Some(far_end)) => {
            format!(
                "answering at address {} on {} ({})",
                args.address,
                link.display(),
                far_end.display()
            )
        }
        _ => format!("answering at address {} on {name}", args.address),
    })?;
    answer(opened.port, module, args.marks_every)
}

/// One line on standard error that is no reason to end.
fn note(what: &impl std::fmt::Display) {
    eprintln!("lenze9300: {what}");
}

/// One line on standard output, at once: whoever started this process waits for it.
fn announce(line: &str) -> Result<(), String> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")
        .and_then(|()| out.flush())
        .map_err(|error| format!("standard output: {error}"))
}

/// The drive's milliseconds follow the clock; between them the line is served.
///
/// When the process was held up, the drive makes up for at most [`MAX_LAG`]; beyond that its time stands still, as if
/// the machine had been paused.
fn answer(port: ReopeningPort, mut module: Emf2133, marks_every_e4: i32) -> Result<Infallible, String> {
    let mut drive = Drive::new(DriveConfig::default());
    let mut reader = (marks_every_e4 != 0).then(|| MarkReader::new(marks_every_e4, drive.codes()));
    let mut driver = Driver::new(port);
    let mut next_ms = StdInstant::now();
    loop {
        let now = StdInstant::now();
        if now > next_ms + MAX_LAG {
            next_ms = now;
        }
        while next_ms <= now {
            module.cycle_1ms(&mut drive);
            for _ in 0..TICKS_PER_MS {
                let shaft = drive.tick();
                if let Some(reader) = &mut reader {
                    reader.follow(&shaft, &mut drive);
                }
            }
            while drive.poll_traverse_event().is_some() {}
            next_ms += MILLISECOND;
        }
        let wait = next_ms.saturating_duration_since(StdInstant::now());
        driver.step(&mut module, wait).map_err(|error| error.to_string())?;
        while let Some(event) = driver.port_mut().poll_event() {
            note(&event);
        }
    }
}

const MILLISECOND: StdDuration = StdDuration::from_nanos(TICK_NS * TICKS_PER_MS);
const MAX_LAG: StdDuration = StdDuration::from_millis(100);

fn parse_mark_distance(text: &str) -> Result<i32, String> {
    let mm: f64 = text.trim().parse().unwrap_or(f64::NAN);
    if mm == 0.0 || (200.0..=2000.0).contains(&mm) {
        Ok((mm * 10_000.0).round() as i32)
    } else {
        Err("allowed is 200.0…2000.0 mm, or 0 for no reader".to_string())
    }
}

fn parse_ident(text: &str) -> Result<u16, String> {
    let digits = text.trim_start_matches("0x").trim_start_matches("0X");
    u16::from_str_radix(digits, 16).map_err(|_| format!("--ident {text} is not a hexadecimal number 0x0000…0xFFFF"))
}
