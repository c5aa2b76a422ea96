//! What a recorded feed tells of its axis: inertia, friction, velocity gain, each with its standard error.
//!
//! - Inertia and friction by [`identify_mechanics`], the momentum balance over windows of some milliseconds.
//! - k_v from the law of the position controller, n_set = n_forward + k_v · following error, by least squares; the trace needs the speed
//!   set-value (MCTRL-NSET2) for that.
//!
//! ```
//! use film_feed::fit::{References, Trace, fit};
//!
//! // 1e-4 kg m² against 0.05 Nm: 0.2 s up with 500 rad/s², 0.2 s at 100 rad/s.
//! let mut csv = "Time [ms];N-ACT [rad/s];M-ACT [Nm]\n".to_owned();
//! for ms in 0..400 {
//!     let (omega, torque) = (1.0 + 0.5 * f64::from(ms.min(200)), if ms < 200 { 0.1 } else { 0.05 });
//!     csv += &format!("{ms};{omega};{torque}\n").replace('.', ",");
//! }
//! let trace = Trace::read(csv.as_bytes(), &References::default())?;
//! let report = fit(&trace, 0.01)?;
//! assert!((report.inertia_kg_m2.value - 1e-4).abs() < 2e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod trace;

use std::fmt;

use lenze9300_model::control::tuning::{IdentifyError, TraceSample, identify_mechanics};
use nalgebra::{Matrix2, Vector2};
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

/// The velocity gain of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainFit {
    /// Velocity gain, 1/s.
    pub per_s: Estimate,
    /// The code C0254 that makes it (125 1/s for 1, assumed).
    pub c0254: f64,
    /// Share of the speed set-value's variation, beside the interpolator's, that the following error explains.
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

/// Fits a trace; windows are `window_s` long, at least one row.
///
/// # Errors
/// [`FitError`]. A k_v that cannot be told is no error, its reason is a note.
pub fn fit(trace: &Trace, window_s: f64) -> Result<FitReport, FitError> {
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
    let window = (window_s / trace.dt_s).round().max(1.0) as usize;
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
    let k_v = match gain(trace) {
        Ok(gain) => Some(gain),
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

/// k_v by least squares of n_set − n_forward on the following error, with a constant for what is left of either's zero.
fn gain(trace: &Trace) -> Result<GainFit, String> {
    let missing = |what: &str| {
        format!("the trace has no {what}; record MCTRL-NSET2, POS-NOUT and POS-ERR (or POS-SETP and POS-ACT)")
    };
    let set = trace
        .omega_set_rad_s
        .as_ref()
        .ok_or_else(|| missing("speed set-value"))?;
    let forward = trace
        .omega_forward_rad_s
        .as_ref()
        .ok_or_else(|| missing("speed of the interpolator"))?;
    let error = trace
        .following_error
        .as_ref()
        .ok_or_else(|| missing("following error"))?;
    let length_per_rad = match error.rad_per_unit {
        Some(_) => None,
        None => Some(length_per_rad(trace, error).ok_or_else(|| {
            "the following error is a length, and without POS-ACT in the same unit its gear cannot be told".to_owned()
        })?),
    };
    let rad_per_unit = error
        .rad_per_unit
        .or(length_per_rad.map(|length| 1.0 / length))
        .unwrap_or(1.0);
    let jumps = jumps(trace, error, 1.0 / rad_per_unit);
    // Only where the interpolator moves: at rest there is nothing but noise, and an inhibited drive obeys nothing.
    let rows: Vec<(f64, f64)> = set
        .iter()
        .zip(forward)
        .zip(&error.values)
        .zip(&jumps)
        .filter(|(((_, forward), _), jumps)| forward.abs() > LEAST_SPEED_RAD_S && !**jumps)
        .map(|(((set, forward), error), _)| (error * rad_per_unit, set - forward))
        .collect();
    if rows.len() < LEAST_ROWS {
        return Err(format!("{} rows move, at least {LEAST_ROWS} are needed", rows.len()));
    }
    let (line, standard_error, r_squared) =
        straight_line(&rows).ok_or_else(|| "the following error does not vary".to_owned())?;
    Ok(GainFit {
        per_s: Estimate {
            value: line,
            standard_error,
        },
        c0254: line / lenze9300_model::GainScaling::default().k_v_per_c0254,
        r_squared,
        length_per_rad,
    })
}

/// How far the position goes for a radian of the motor: least squares of its steps on those of the speed's integral.
fn length_per_rad(trace: &Trace, error: &FollowingError) -> Option<f64> {
    let position = error.position.as_ref()?;
    let (mut product, mut square) = (0.0, 0.0);
    for (omega, position) in trace.omega_rad_s.windows(2).zip(position.windows(2)) {
        let angle = 0.5 * (omega[0] + omega[1]) * trace.dt_s;
        let step = position[1] - position[0];
        // A new reference is no motion.
        if angle.abs() > LEAST_SPEED_RAD_S * trace.dt_s && step * angle > 0.0 {
            product += step * angle;
            square += angle * angle;
        }
    }
    (square > 0.0).then(|| product / square)
}

/// Rows at which the position is counted anew (record 01 sets the reference): it steps by more than a hundredth of its whole range
/// otherwise than the speed says. A following error formed from positions is none there.
fn jumps(trace: &Trace, error: &FollowingError, per_rad: f64) -> Vec<bool> {
    let Some(position) = &error.position else {
        return vec![false; error.values.len()];
    };
    let (low, high) = position
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(*value), high.max(*value))
        });
    let steps = position.windows(2).zip(&trace.omega_rad_s).map(|(pair, omega)| {
        let expected = omega * trace.dt_s * per_rad;
        (pair[1] - pair[0] - expected).abs() > 0.01 * (high - low)
    });
    std::iter::once(false).chain(steps).collect()
}

/// Slope of y over x with its standard error, and R².
fn straight_line(rows: &[(f64, f64)]) -> Option<(f64, f64, f64)> {
    let n = rows.len() as f64;
    let mut normal = Matrix2::zeros();
    let mut right = Vector2::zeros();
    for (x, y) in rows {
        let row = Vector2::new(*x, 1.0);
        normal += row * row.transpose();
        right += row * *y;
    }
    let inverse = normal.try_inverse()?;
    let solution = inverse * right;
    let mean = right[1] / n;
    let left: f64 = rows
        .iter()
        .map(|(x, y)| (y - solution[0] * x - solution[1]).powi(2))
        .sum();
    let all: f64 = rows.iter().map(|(_, y)| (y - mean).powi(2)).sum();
    let standard_error = (left / (n - 2.0) * inverse[(0, 0)]).sqrt();
    let result = (solution[0], standard_error, 1.0 - left / all);
    (result.0.is_finite() && result.2.is_finite()).then_some(result)
}

/// Below this the interpolator counts as standing, rad/s.
const LEAST_SPEED_RAD_S: f64 = 0.5;
/// Rows that a gain needs.
const LEAST_ROWS: usize = 20;

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
