//! `lenze9300 monitor`: state, fault and values of a running drive, again and again.

use std::fmt::Write as _;
use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

use clap::Args;
use lenze9300_model::access::{AccessError, CodePlace, ParameterAccess};
use lenze9300_model::device::Fault;
use serde::Serialize;

use crate::outcome::{Done, Failed, say};
use crate::way::WayArgs;

/// What `lenze9300 monitor` takes.
#[derive(Debug, Args)]
pub(crate) struct MonitorArgs {
    #[command(flatten)]
    way: WayArgs,
    /// Milliseconds from one look to the next, 50…60000.
    #[arg(long, value_name = "MS", default_value_t = 500, value_parser = clap::value_parser!(u64).range(50..=60_000))]
    interval: u64,
    /// Look once.
    #[arg(long)]
    once: bool,
    /// One JSON object a line for each look.
    #[arg(long)]
    json: bool,
}

/// What is shown beside state, fault and bits, in this order.
const VALUES: [u16; 10] = [51, 52, 53, 54, 56, 61, 63, 64, 359, 361];

/// Bits of the status word C0150 that have a fixed meaning (9300 facts 2.4).
const STATUS_BITS: [(u8, &str); 5] = [
    (1, "pulses inhibited"),
    (6, "standstill"),
    (7, "controller inhibited"),
    (12, "warning"),
    (13, "message"),
];

/// State of the drive in bits 8 to 11 of C0150 (9300 facts 2.4).
fn drive_state(status_word: u16) -> &'static str {
    match status_word >> 8 & 0xF {
        0 => "initialising",
        1 => "restart protection",
        3 => "inhibited",
        6 => "enabled",
        7 => "message",
        8 => "TRIP",
        10 => "FAIL-QSP",
        _ => "unknown state",
    }
}

#[derive(Debug, Serialize)]
struct Look {
    diagnosis: i32,
    state: &'static str,
    fault: u16,
    fault_text: Option<String>,
    remedy: Option<&'static str>,
    status_word: u16,
    drive_state: &'static str,
    bits: Vec<&'static str>,
    values: Vec<Shown>,
}

#[derive(Debug, Serialize)]
struct Shown {
    code: u16,
    value: String,
    unit: &'static str,
    meaning: &'static str,
}

/// Shows the drive until it is interrupted, or once.
pub(crate) fn monitor(args: &MonitorArgs) -> Result<Done, Failed> {
    let mut access = args.way.open()?;
    let is_live = !args.once && !args.json && io::stdout().is_terminal();
    loop {
        let begun = Instant::now();
        let look = look(&mut access)?;
        if args.json {
            say(&serde_json::to_string(&look).map_err(|error| error.to_string())?)?;
        } else if is_live {
            // Home and clear to the end, so that the picture stands still.
            say(&format!("\x1b[H\x1b[J{}\nCtrl-C ends", text(&look)))?;
        } else {
            say(&text(&look))?;
        }
        if args.once {
            return Ok(if look.fault == 0 { Done::Yes } else { Done::No });
        }
        std::thread::sleep(Duration::from_millis(args.interval).saturating_sub(begun.elapsed()));
    }
}

fn look(access: &mut impl ParameterAccess) -> Result<Look, AccessError> {
    let whole = |raw: i32| raw / 10_000;
    let diagnosis = whole(access.read(CodePlace::new(183, 0))?);
    let fault = u16::try_from(whole(access.read(CodePlace::new(67, 0))?)).unwrap_or(u16::MAX);
    let status_word = access.read(CodePlace::new(150, 0))? as u16;
    let mut values = Vec::new();
    for code in VALUES {
        let subcode = u8::from(code == 361);
        let place = CodePlace::new(code, subcode);
        let raw = match access.read(place) {
            Ok(raw) => raw,
            // Another device may lack a display.
            Err(error) if error.is_refusal() => continue,
            Err(error) => return Err(error),
        };
        let entry = place.entry();
        values.push(Shown {
            code,
            value: place.decimal(raw),
            unit: entry.map_or("", |entry| entry.unit),
            meaning: entry.map_or("", |entry| entry.name),
        });
    }
    let known = Fault::from_lecom_number(fault).filter(|_| fault != 0);
    Ok(Look {
        diagnosis,
        state: state_of(diagnosis),
        fault,
        fault_text: known.map(|(fault, _)| format!("{} ({})", fault.display(), fault.cause())),
        remedy: known.map(|(fault, _)| fault.remedy()),
        status_word,
        drive_state: drive_state(status_word),
        bits: STATUS_BITS
            .iter()
            .filter(|(bit, _)| status_word >> bit & 1 == 1)
            .map(|(_, name)| *name)
            .collect(),
        values,
    })
}

/// C0183 in words. Source: 9300 facts 4.4.
fn state_of(diagnosis: i32) -> &'static str {
    match diagnosis {
        0 => "no fault, ready or running",
        101 => "initialising",
        102 => "TRIP",
        103 => "emergency stop",
        104 => "message",
        105 => "power off",
        111 => "operation inhibited by C0135",
        112 => "operation inhibited by the bus module",
        113 => "operation inhibited by the system bus",
        121 => "controller inhibited at terminal 28",
        122 | 123 => "controller inhibited inside the drive",
        124 => "controller inhibited by the keypad, C0040 or C0135",
        125 => "controller inhibited by the bus module",
        126 => "controller inhibited by the system bus",
        141 => "restart protection: take the enable away and give it again",
        151 => "quick stop by a fault or inside the drive",
        152 => "quick stop by the keypad or C0135",
        153 => "quick stop by the bus module",
        154 => "quick stop by the system bus",
        250 => "warning",
        _ => "unknown",
    }
}

fn text(look: &Look) -> String {
    let mut text = format!("C0183 {:>4}  {}\n", look.diagnosis, look.state);
    let fault = look.fault_text.as_deref().unwrap_or("none");
    // Writing to a string cannot fail.
    let _ = writeln!(text, "C0067 {:>4}  fault: {fault}", look.fault);
    if let Some(remedy) = look.remedy {
        let _ = writeln!(text, "            remedy: {remedy}");
    }
    let _ = write!(text, "C0150 {:#06X}  {}", look.status_word, look.drive_state);
    for bit in &look.bits {
        let _ = write!(text, ", {bit}");
    }
    text.push('\n');
    for shown in &look.values {
        let _ = writeln!(
            text,
            "C{:04} {:>12} {:<6} {}",
            shown.code, shown.value, shown.unit, shown.meaning
        );
    }
    text.truncate(text.trim_end().len());
    text
}
