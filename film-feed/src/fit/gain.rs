//! The velocity gain of the position controller.

use nalgebra::{Matrix2, Vector2};

use super::{Estimate, FollowingError, GainFit, GainSource, Trace};

/// k_v from the speed set-value if the trace has it, else from the torque.
pub(super) fn gain(trace: &Trace, speed_tn_s: f64) -> Result<GainFit, String> {
    let missing = |what: &str| {
        format!("the trace has no {what}; record MCTRL-NSET2, POS-NOUT and POS-ERR (or POS-SETP and POS-ACT)")
    };
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
    let moves: Vec<bool> = forward
        .iter()
        .zip(&jumps)
        .map(|(forward, jumps)| forward.abs() > LEAST_SPEED_RAD_S && !jumps)
        .collect();
    let error_rad: Vec<f64> = error.values.iter().map(|value| value * rad_per_unit).collect();
    let (law, from) = match &trace.omega_set_rad_s {
        Some(set) => (
            position_law(set, forward, &error_rad, &moves),
            GainSource::SpeedSetValue,
        ),
        None => (
            speed_law(trace, forward, &error_rad, &moves, speed_tn_s),
            GainSource::Torque,
        ),
    };
    let (per_s, r_squared) = law?;
    Ok(GainFit {
        per_s,
        from,
        c0254: per_s.value / lenze9300_model::GainScaling::default().k_v_per_c0254,
        r_squared,
        length_per_rad,
    })
}

/// Least squares of n_set − n_forward on the following error, with a constant for what is left of either's zero.
fn position_law(set: &[f64], forward: &[f64], error: &[f64], moves: &[bool]) -> Result<(Estimate, f64), String> {
    let rows: Vec<[f64; 3]> = set
        .iter()
        .zip(forward)
        .zip(error)
        .zip(moves)
        .filter(|(_, moves)| **moves)
        .map(|(((set, forward), error), _)| [*error, 1.0, set - forward])
        .collect();
    let plane = Plane::fit(&rows)?;
    let mean = rows.iter().map(|row| row[2]).sum::<f64>() / rows.len() as f64;
    let spread: f64 = rows.iter().map(|row| (row[2] - mean).powi(2)).sum();
    let estimate = Estimate {
        value: plane.solution[0],
        standard_error: plane.covariance[(0, 0)].sqrt(),
    };
    Ok((estimate, 1.0 - plane.squares / spread))
}

/// The law of the speed controller, whose input is δ = n_forward − n + k_v·e, and ∫(n_forward − n) dt = e:
///
/// ```text
/// M = K_p δ + K_p/T_n ∫δ dt = K_p (n_forward − n + e/T_n) + K_p k_v (e + ∫e dt / T_n) + constant
/// ```
///
/// K_p and K_p·k_v by least squares, with a constant for each motion; k_v is their ratio. Without T_n the two gains of the law could be
/// told only as a pair: k_v and 1/T_n come in it alike.
fn speed_law(
    trace: &Trace,
    forward: &[f64],
    error: &[f64],
    moves: &[bool],
    tn_s: f64,
) -> Result<(Estimate, f64), String> {
    let mut rows: Vec<[f64; 3]> = Vec::new();
    let mut motion: Vec<[f64; 3]> = Vec::new();
    let mut integral = 0.0;
    for n in 0..moves.len() {
        if moves[n] {
            integral += error[n] * trace.dt_s;
            let speed_error = forward[n] - trace.omega_rad_s[n];
            motion.push([
                speed_error + error[n] / tn_s,
                error[n] + integral / tn_s,
                trace.torque_nm[n],
            ]);
        }
        if !moves[n] || n + 1 == moves.len() {
            integral = 0.0;
            let count = motion.len().max(1) as f64;
            let mean: [f64; 3] = std::array::from_fn(|k| motion.iter().map(|row| row[k]).sum::<f64>() / count);
            rows.extend(motion.drain(..).map(|row| std::array::from_fn(|k| row[k] - mean[k])));
        }
    }
    let plane = Plane::fit(&rows)?;
    let [k_p, product] = [plane.solution[0], plane.solution[1]];
    if k_p <= 0.0 {
        return Err(
            "the torque does not follow the speed error; is C0071 right, and are all signals of the same drive?"
                .to_owned(),
        );
    }
    let k_v = product / k_p;
    // Error of a ratio, to first order.
    let c = &plane.covariance;
    let variance = (c[(1, 1)] + k_v * k_v * c[(0, 0)] - 2.0 * k_v * c[(0, 1)]) / (k_p * k_p);
    let spread: f64 = rows.iter().map(|row| row[2] * row[2]).sum();
    let estimate = Estimate {
        value: k_v,
        standard_error: variance.max(0.0).sqrt(),
    };
    Ok((estimate, 1.0 - plane.squares / spread))
}

/// z = a·x + b·y by least squares.
struct Plane {
    solution: Vector2<f64>,
    covariance: Matrix2<f64>,
    squares: f64,
}

impl Plane {
    fn fit(rows: &[[f64; 3]]) -> Result<Self, String> {
        if rows.len() < LEAST_ROWS {
            return Err(format!("{} rows move, at least {LEAST_ROWS} are needed", rows.len()));
        }
        let mut normal = Matrix2::zeros();
        let mut right = Vector2::zeros();
        for [x, y, z] in rows {
            let row = Vector2::new(*x, *y);
            normal += row * row.transpose();
            right += row * *z;
        }
        let inverse = normal
            .try_inverse()
            .filter(|inverse| inverse.iter().all(|entry| entry.is_finite()))
            .ok_or("the following error does not vary")?;
        let solution = inverse * right;
        let squares: f64 = rows
            .iter()
            .map(|[x, y, z]| (z - solution[0] * x - solution[1] * y).powi(2))
            .sum();
        Ok(Plane {
            solution,
            covariance: inverse * (squares / (rows.len() - 2) as f64),
            squares,
        })
    }
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

/// Below this the interpolator counts as standing, rad/s.
const LEAST_SPEED_RAD_S: f64 = 0.5;
/// Rows that a gain needs.
const LEAST_ROWS: usize = 20;
