//! `film-feed fit`: what a recorded feed tells of its axis.

use std::fs::{self, File};
use std::path::PathBuf;

use clap::Args;

use crate::fit::{self, FitOptions, References, Trace};

/// What `film-feed fit` takes.
#[derive(Debug, Clone, Args)]
pub struct FitArgs {
    /// A trace with time, speed and torque: of `film-feed run --trace` (CSV or Parquet), or exported by Global Drive Control.
    #[arg(value_name = "TRACE")]
    trace: PathBuf,
    /// Print the report as one JSON object.
    #[arg(long)]
    json: bool,
    /// Length of the windows over which momentum is balanced, 1…100 ms. Short ones are noisy, long ones blur the ramps.
    #[arg(long, value_name = "MS", default_value_t = 10.0, value_parser = within::<1, 100>)]
    window: f64,
    /// Integral time of the speed controller, C0071, above 0…10000 ms; used when the trace has no speed set-value.
    #[arg(long, value_name = "MS", default_value_t = 1e3 * FitOptions::default().speed_tn_s, value_parser = within::<0, 10_000>)]
    speed_tn: f64,
    /// 100 % of a speed in percent: C0011, 1…20000 1/min.
    #[arg(long, value_name = "RPM", default_value_t = References::default().n_max_rpm, value_parser = within::<1, 20_000>)]
    n_max: f64,
    /// 100 % of a torque in percent: C0057, above 0…10000 Nm.
    #[arg(long, value_name = "NM", default_value_t = References::default().torque_nm, value_parser = within::<0, 10_000>)]
    torque_reference: f64,
    /// Torque constant for a trace with I-Q, above 0…10000 Nm per ampere rms.
    #[arg(long, value_name = "NM_PER_A", default_value_t = References::default().torque_constant_nm_a, value_parser = within::<0, 10_000>)]
    torque_constant: f64,
}

/// A number from `FROM` to `TO`, and above 0.
fn within<const FROM: u32, const TO: u32>(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|value: &f64| *value > 0.0 && (f64::from(FROM)..=f64::from(TO)).contains(value))
        .ok_or_else(|| match FROM {
            0 => format!("allowed is above 0…{TO}"),
            _ => format!("allowed is {FROM}…{TO}"),
        })
}

/// Fits the trace; `Ok(false)` when it is a trace that does not tell.
///
/// # Errors
/// One sentence when the file cannot be read.
pub fn run(args: &FitArgs) -> Result<bool, String> {
    let shown = args.trace.display();
    let references = References {
        n_max_rpm: args.n_max,
        torque_nm: args.torque_reference,
        torque_constant_nm_a: args.torque_constant,
    };
    let unreadable = |error| format!("{shown} cannot be read: {error}");
    let is_parquet = args
        .trace
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"));
    let trace = if is_parquet {
        Trace::read_parquet(File::open(&args.trace).map_err(unreadable)?, &references)
    } else {
        Trace::read(&fs::read(&args.trace).map_err(unreadable)?, &references)
    };
    let trace = trace.map_err(|error| format!("{shown}: {error}"))?;
    let options = FitOptions {
        window_s: args.window / 1000.0,
        speed_tn_s: args.speed_tn / 1000.0,
    };
    let report = match fit::fit(&trace, &options) {
        Ok(report) => report,
        Err(error) => {
            eprintln!("film-feed: {shown}: {error}");
            return Ok(false);
        }
    };
    super::print(args.json, &report)?;
    Ok(true)
}
