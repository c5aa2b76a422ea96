use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

/// One line of a trace: what the motor made and how fast the shaft turned, at the same moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TraceSample {
    /// Torque in the air gap, Nm.
    pub torque_nm: f64,
    /// Speed of the shaft, rad/s.
    pub omega_rad_s: f64,
}

/// Mechanics as a trace shows them.
#[doc(alias = "Trägheitsmoment")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Identified {
    /// Inertia that the motor turns, kg m².
    pub j_total_kg_m2: f64,
    /// Coulomb friction, Nm.
    pub coulomb_nm: f64,
    /// Friction proportional to the speed, Nm·s/rad.
    pub viscous_nm_s: f64,
    /// What the three do not explain, Nm (root of the mean square over the windows).
    pub residual_nm: f64,
    /// Windows that were used.
    pub windows: usize,
    /// Standard errors of inertia, Coulomb and viscous friction, in their units: what the scatter of the windows leaves open, taken
    /// as independent of each other.
    pub standard_errors: [f64; 3],
    /// Share of the variation of the torque's momentum from window to window that the three explain (R²), at most 1.
    pub r_squared: f64,
}

/// Why a trace does not tell.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// A sample, or the time between two, is not a number that can be.
    #[error("sample {at} of the trace is not a finite number")]
    NotFinite {
        /// Its place.
        at: usize,
    },
    /// The time between two samples is not above zero.
    #[error("the sampling time is {got} s, above 0 is needed")]
    SamplingTime {
        /// What was given.
        got: f64,
    },
    /// Too little of the trace moves.
    #[error("{got} windows of the trace move in one direction, at least {needed} are needed")]
    TooShort {
        /// Windows found.
        got: usize,
        /// Windows needed.
        needed: usize,
    },
    /// The shaft turned, but at one speed only: inertia, friction and speed-dependent friction cannot be told apart.
    #[error("the trace holds too little acceleration to tell inertia from friction")]
    NotExcited,
}

/// Inertia and friction from a recorded feed, by least squares.
///
/// Newton's law in its integral form, over windows of `window` samples `dt_s` apart:
///
/// ```text
/// ∫ M dt = J Δω + M_C ∫ sgn ω dt + b ∫ ω dt
/// ```
///
/// Integrating spares the derivative of a noisy speed. Windows that stand or turn round are left out: there friction
/// takes any value. A constant load torque cannot be told from friction in a feed of one direction and is counted to
/// it.
///
/// Choose windows of 5 to 20 ms: shorter ones are noisy, longer ones blur the ramps. Record as fast as the
/// controllers run: the speed set-value steps once a millisecond, the torque answers with a ripple of that period,
/// and a trace taken once a millisecond always meets the same place of it (inertia some 3 % low).
///
/// # Errors
/// [`IdentifyError`]: every variant.
///
/// # Example
/// ```
/// use lenze9300_model::control::tuning::{TraceSample, identify_mechanics};
///
/// // 0.1 Nm accelerate 1e-4 kg m² against 0.05 Nm with 500 rad/s², then 0.05 Nm hold the speed.
/// let trace: Vec<TraceSample> = (0..400)
///     .map(|ms| TraceSample {
///         torque_nm: if ms < 200 { 0.1 } else { 0.05 },
///         omega_rad_s: 500.0 * 1e-3 * f64::from(ms.min(200)) + 1.0,
///     })
///     .collect();
/// let found = identify_mechanics(&trace, 1e-3, 10)?;
/// assert!((found.j_total_kg_m2 - 1e-4).abs() < 2e-6);
/// # Ok::<(), lenze9300_model::control::tuning::IdentifyError>(())
/// ```
pub fn identify_mechanics(trace: &[TraceSample], dt_s: f64, window: usize) -> Result<Identified, IdentifyError> {
    if !(dt_s > 0.0 && dt_s.is_finite()) {
        return Err(IdentifyError::SamplingTime { got: dt_s });
    }
    if let Some(at) = trace
        .iter()
        .position(|sample| !(sample.torque_nm.is_finite() && sample.omega_rad_s.is_finite()))
    {
        return Err(IdentifyError::NotFinite { at });
    }
    let rows: Vec<(Vector3<f64>, f64)> = trace
        .windows(window.max(1) + 1)
        .step_by(window.max(1))
        .filter_map(|samples| row(samples, dt_s))
        .collect();
    if rows.len() < LEAST_WINDOWS {
        return Err(IdentifyError::TooShort {
            got: rows.len(),
            needed: LEAST_WINDOWS,
        });
    }
    let columns = rows.iter().fold(Vector3::zeros(), |sum: Vector3<f64>, (row, _)| {
        sum + row.component_mul(row)
    });
    // Columns brought to length 1, so that the condition of the matrix means something. Without acceleration the
    // first is 0.
    let scale = columns.map(|square| if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 });
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for (row, momentum) in &rows {
        let row = row.component_mul(&scale);
        normal += row * row.transpose();
        right += row * *momentum;
    }
    let least = normal.symmetric_eigenvalues().min();
    if least.is_nan() || least < LEAST_EXCITATION {
        return Err(IdentifyError::NotExcited);
    }
    let factors = normal.cholesky().ok_or(IdentifyError::NotExcited)?;
    let solution = factors.solve(&right).component_mul(&scale);
    let window_s = window.max(1) as f64 * dt_s;
    let squares: f64 = rows
        .iter()
        .map(|(row, momentum)| ((momentum - row.dot(&solution)) / window_s).powi(2))
        .sum();
    // Covariance of the solution: variance of the residuals, with three degrees of freedom used up, by the inverse of the normal matrix.
    let variance = squares * window_s * window_s / (rows.len() - 3) as f64;
    let covariance = factors.inverse() * variance;
    let standard_error = |n: usize| covariance[(n, n)].max(0.0).sqrt() * scale[n];
    let mean = rows.iter().map(|(_, momentum)| momentum).sum::<f64>() / rows.len() as f64;
    let spread: f64 = rows
        .iter()
        .map(|(_, momentum)| ((momentum - mean) / window_s).powi(2))
        .sum();
    Ok(Identified {
        standard_errors: [standard_error(0), standard_error(1), standard_error(2)],
        r_squared: 1.0 - squares / spread,
        j_total_kg_m2: solution[0],
        coulomb_nm: solution[1],
        viscous_nm_s: solution[2],
        residual_nm: (squares / rows.len() as f64).sqrt(),
        windows: rows.len(),
    })
}

/// Change of speed, time with sign of the direction, way; and the momentum of the motor. `None` when it stood or
/// turned round.
fn row(samples: &[TraceSample], dt_s: f64) -> Option<(Vector3<f64>, f64)> {
    let (first, last) = (samples.first()?, samples.last()?);
    let direction = first.omega_rad_s.signum();
    if samples
        .iter()
        .any(|sample| sample.omega_rad_s * direction <= STANDSTILL_RAD_S)
    {
        return None;
    }
    let integral = |value: fn(&TraceSample) -> f64| {
        samples
            .windows(2)
            .map(|pair| 0.5 * (value(&pair[0]) + value(&pair[1])) * dt_s)
            .sum::<f64>()
    };
    let duration_s = (samples.len() - 1) as f64 * dt_s;
    Some((
        Vector3::new(
            last.omega_rad_s - first.omega_rad_s,
            direction * duration_s,
            integral(|sample| sample.omega_rad_s),
        ),
        integral(|sample| sample.torque_nm),
    ))
}

/// Three unknowns, and some to average.
const LEAST_WINDOWS: usize = 8;
/// Smallest eigenvalue of the scaled normal matrix (1 would be: all three fully independent).
const LEAST_EXCITATION: f64 = 1e-4;
/// Speed below which a shaft counts as standing, rad/s.
const STANDSTILL_RAD_S: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    /// A trapezoid of speed and the torque that Newton's law asks for.
    fn trapezoid(j: f64, coulomb: f64, viscous: f64) -> Vec<TraceSample> {
        (0..1500)
            .map(|ms| {
                let t = f64::from(ms) * 1e-3;
                let (alpha, omega) = if t < 0.5 {
                    (589.5, 589.5 * t)
                } else if t < 1.0 {
                    (0.0, 294.75)
                } else {
                    (-589.5, 589.5 * (1.5 - t))
                };
                TraceSample {
                    torque_nm: j * alpha + coulomb + viscous * omega,
                    omega_rad_s: omega,
                }
            })
            .collect()
    }

    #[test]
    fn a_trace_after_newtons_law_gives_its_three_parameters_back() {
        let found = identify_mechanics(&trapezoid(0.914e-4, 0.05, 2e-5), 1e-3, 10).unwrap();
        // Only the windows across the two corners err, by the trapezoid rule over one sample.
        assert!((found.j_total_kg_m2 / 0.914e-4 - 1.0).abs() < 5e-3, "{found:?}");
        assert!((found.coulomb_nm - 0.05).abs() < 5e-4, "{found:?}");
        assert!((found.viscous_nm_s - 2e-5).abs() < 4e-6, "{found:?}");
    }

    /// The standard errors have to be what repeated traces scatter by: 400 traces with seeded noise on the torque.
    #[test]
    fn standard_errors_are_the_scatter_of_repeated_traces() {
        let found: Vec<Identified> = (0..400)
            .map(|seed| {
                let mut trace = trapezoid(0.914e-4, 0.05, 2e-5);
                for (n, sample) in trace.iter_mut().enumerate() {
                    sample.torque_nm += 0.03 * crate::noise::symmetric(seed, 5, n as u64);
                }
                identify_mechanics(&trace, 1e-3, 10).unwrap()
            })
            .collect();
        let told = found.iter().map(|found| found.standard_errors[0]).sum::<f64>() / 400.0;
        let mean = found.iter().map(|found| found.j_total_kg_m2).sum::<f64>() / 400.0;
        let squares: f64 = found.iter().map(|found| (found.j_total_kg_m2 - mean).powi(2)).sum();
        let scatter = (squares / 399.0).sqrt();
        // 400 samples give a standard deviation within 3.5 % (1/√800); what the corners leave counts as noise, too.
        assert!((told / scatter - 1.0).abs() < 0.12, "told {told:e}, found {scatter:e}");
        assert!((mean / 0.914e-4 - 1.0).abs() < 5e-3, "{mean:e}");
        assert!(found.iter().all(|found| found.r_squared > 0.9 && found.r_squared < 1.0));
    }

    #[test]
    fn backwards_it_is_the_same() {
        let mirrored: Vec<TraceSample> = trapezoid(0.914e-4, 0.05, 2e-5)
            .iter()
            .map(|sample| TraceSample {
                torque_nm: -sample.torque_nm,
                omega_rad_s: -sample.omega_rad_s,
            })
            .collect();
        let found = identify_mechanics(&mirrored, 1e-3, 10).unwrap();
        let forwards = identify_mechanics(&trapezoid(0.914e-4, 0.05, 2e-5), 1e-3, 10).unwrap();
        assert!((found.j_total_kg_m2 - forwards.j_total_kg_m2).abs() < 1e-12);
        assert!((found.coulomb_nm - forwards.coulomb_nm).abs() < 1e-9);
    }

    #[test]
    fn traces_that_cannot_tell_are_refused_by_name() {
        let steady = vec![
            TraceSample {
                torque_nm: 0.05,
                omega_rad_s: 100.0
            };
            500
        ];
        assert_eq!(identify_mechanics(&steady, 1e-3, 10), Err(IdentifyError::NotExcited));
        assert!(matches!(
            identify_mechanics(&steady[..20], 1e-3, 10),
            Err(IdentifyError::TooShort { got: 1, .. })
        ));
        assert!(matches!(
            identify_mechanics(&steady, 0.0, 10),
            Err(IdentifyError::SamplingTime { .. })
        ));
        let mut broken = steady;
        broken[7].torque_nm = f64::NAN;
        assert_eq!(
            identify_mechanics(&broken, 1e-3, 10),
            Err(IdentifyError::NotFinite { at: 7 })
        );
    }
}
