//! What a recorded feed tells of its axis: inertia, friction, velocity gain, each with its standard error.
//!
//! - Inertia and friction by [`identify_mechanics`], the momentum balance over windows of some milliseconds.
//! - k_v from the law of the position controller, n_set = n_forward + k_v · following error, by least squares, if the trace has the speed
//!   set-value (MCTRL-NSET2). Without it from the torque, by the law of the speed controller, with its integral time known.
//!
//! ```
//! use film_feed::fit::{FitOptions, References, Trace, fit};
//!
//! // 1e-4 kg m² against 0.05 Nm: 0.2 s up with 500 rad/s², 0.2 s at 100 rad/s.
//! let mut csv = "Time [ms];N-ACT [rad/s];M-ACT [Nm]\n".to_owned();
//! for ms in 0..400 {
//!     let (omega, torque) = (1.0 + 0.5 * f64::from(ms.min(200)), if ms < 200 { 0.1 } else { 0.05 });
//!     csv += &format!("{ms};{omega};{torque}\n").replace('.', ",");
//! }
//! let trace = Trace::read(csv.as_bytes(), &References::default())?;
//! let report = fit(&trace, &FitOptions::default())?;
//! assert!((report.inertia_kg_m2.value - 1e-4).abs() < 2e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod gain;
mod trace;

use std::fmt;

use lenze9300_model::control::tuning::{IdentifyError, TraceSample, identify_mechanics};
use serde::Serialize;
use thiserror::Error;

pub use trace::{FollowingError, References, Trace, TraceError};

/// A number with what it may be off by.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Standard error: two thirds of all traces like this one give a value within ± this of the true one, as far as the residuals are
    /// independent of each other.
    pub standard_error: f64,
}

/// What a trace tells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitReport {
    /// Rows of the trace.
    pub rows: usize,
    /// Time from row to row, s.
    pub interval_s: f64,
    /// Inertia that the motor turns, kg m².
    #[serde(rename = "inertia_kg_m2")]
    pub inertia_kg_m2: Estimate,
    /// Coulomb friction at the motor, Nm; a pull of constant force in one direction is counted to it.
    pub coulomb_nm: Estimate,
    /// Friction proportional to the speed, Nm·s/rad.
    pub viscous_nm_s: Estimate,
    /// Share of the torque's variation that the three explain, 0…1.
    pub r_squared: f64,
    /// What they do not explain, Nm rms over the windows.
    pub residual_nm: f64,
    /// Windows that were used.
    pub windows: usize,
    /// Velocity gain of the position controller.
    pub k_v: Option<GainFit>,
    /// What a reader of the report should know.
    pub notes: Vec<String>,
}

/// How a trace is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Length of the windows of the momentum balance, s.
    pub window_s: f64,
    /// Integral time of the speed controller (C0071), s.
    pub speed_tn_s: f64,
}

/// Windows of 10 ms; C0071 = 20 ms (film-feed specification, section 5).
impl Default for FitOptions {
    fn default() -> Self {
        FitOptions {
            window_s: 0.01,
            speed_tn_s: 0.02,
        }
    }
}

/// What a velocity gain was reckoned from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GainSource {
    /// The speed set-value.
    SpeedSetValue,
    /// The torque, through the speed controller.
    Torque,
}

/// The velocity gain of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainFit {
    /// Velocity gain, 1/s.
    pub per_s: Estimate,
    /// What it was reckoned from.
    pub from: GainSource,
    /// The code C0254 that makes it (125 1/s for 1, assumed).
    pub c0254: f64,
    /// Share of the variation of the speed set-value beside the interpolator's, or of the torque, that is explained.
    pub r_squared: f64,
    /// Film, or whatever the file's unit of length is, per radian of the motor, as the trace shows it; none for increments.
    pub length_per_rad: Option<f64>,
}

/// Why a trace cannot be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// Inertia and friction cannot be told.
    #[error("inertia and friction: {0}; record at least one whole feed with its ramps")]
    Mechanics(#[from] IdentifyError),
}

/// Fits a trace; windows are at least one row long.
///
/// # Errors
/// [`FitError`]. A k_v that cannot be told is no error, its reason is a note.
pub fn fit(trace: &Trace, options: &FitOptions) -> Result<FitReport, FitError> {
    let samples: Vec<TraceSample> = trace
        .torque_nm
        .iter()
        .zip(&trace.omega_rad_s)
        .map(|(torque_nm, omega_rad_s)| TraceSample {
            torque_nm: *torque_nm,
            omega_rad_s: *omega_rad_s,
        })
        .collect();
    // A mean torque belongs to the time before its row, the integral of `identify_mechanics` takes half of each end.
    let samples = if trace.torque_is_mean {
        centred(samples)
    } else {
        samples
    };
    let window = (options.window_s / trace.dt_s).round().max(1.0) as usize;
    let found = identify_mechanics(&samples, trace.dt_s, window)?;
    let estimate = |value, standard_error| Estimate { value, standard_error };
    let mut notes = Vec::new();
    // The ripple of the torque has the period of the position controller, 1 ms.
    if !trace.torque_is_mean && trace.dt_s > 0.4e-3 {
        notes.push(format!(
            "the torque was sampled every {:.3} ms, always at the same place of its ripple of 1 ms: inertia may read some 3 % low; record the mean torque (torque_mean_nm of `film-feed run --trace`), or faster",
            trace.dt_s * 1e3
        ));
    }
    let k_v = match gain::gain(trace, options.speed_tn_s) {
        Ok(gain) => {
            if gain.from == GainSource::Torque {
                notes.push(format!(
                    "k_v was reckoned from the torque, with T_n = {} ms (C0071): it may be some 10 % off; record MCTRL-NSET2 for a better one",
                    options.speed_tn_s * 1e3
                ));
            }
            Some(gain)
        }
        Err(why) => {
            notes.push(format!("k_v: {why}"));
            None
        }
    };
    Ok(FitReport {
        rows: trace.omega_rad_s.len(),
        interval_s: trace.dt_s,
        inertia_kg_m2: estimate(found.j_total_kg_m2, found.standard_errors[0]),
        coulomb_nm: estimate(found.coulomb_nm, found.standard_errors[1]),
        viscous_nm_s: estimate(found.viscous_nm_s, found.standard_errors[2]),
        r_squared: found.r_squared,
        residual_nm: found.residual_nm,
        windows: found.windows,
        k_v,
        notes,
    })
}

/// The torque at a row as the mean of those of the times before and behind it.
fn centred(mut samples: Vec<TraceSample>) -> Vec<TraceSample> {
    let means: Vec<f64> = samples.iter().map(|sample| sample.torque_nm).collect();
    for (n, sample) in samples.iter_mut().enumerate() {
        let behind = means.get(n + 1).unwrap_or(&means[n]);
        sample.torque_nm = 0.5 * (means[n] + behind);
    }
    samples
}

impl fmt::Display for FitReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} rows of {:.3} ms, {} windows; the fit explains {:.3} % of the torque's variation, {:.2} mNm are left",
            self.rows,
            self.interval_s * 1e3,
            self.windows,
            self.r_squared * 100.0,
            self.residual_nm * 1e3
        )?;
        let mut row = |name: &str, unit: &str, scale: f64, estimate: &Estimate| {
            writeln!(
                f,
                "{name:<20}{:>12.4} ± {:.4} {unit}",
                estimate.value * scale,
                estimate.standard_error * scale
            )
        };
        row("inertia", "10⁻⁴ kg m² at the motor", 1e4, &self.inertia_kg_m2)?;
        row("Coulomb friction", "Nm at the motor", 1.0, &self.coulomb_nm)?;
        row("viscous friction", "10⁻⁶ Nm·s/rad", 1e6, &self.viscous_nm_s)?;
        if let Some(gain) = &self.k_v {
            row("k_v", "1/s", 1.0, &gain.per_s)?;
            writeln!(f, "{:<20}{:>12.4}   R² {:.4}", "C0254", gain.c0254, gain.r_squared)?;
            if let Some(length) = gain.length_per_rad {
                writeln!(
                    f,
                    "{:<20}{:>12.4}   mm per motor revolution",
                    "gear and roller",
                    length * std::f64::consts::TAU
                )?;
            }
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        write!(f, "fitted by least squares; ± is the standard error")
    }
}
