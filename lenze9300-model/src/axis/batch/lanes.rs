//! The usual tick of several axes at once, as a structure of arrays.
//!
//! Every line here is a line of [`Axis::tick`](crate::Axis::tick) for a feedback-controlled axis that meets no limit, in the same order of
//! operations; the loops over the lanes have no branch, so that the compiler makes packed instructions of them. What is not usual is
//! only found out ([`Unusual`]), never worked here.
#![allow(
    clippy::needless_range_loop,
    reason = "a lane is one index into thirty arrays; zipped iterators of them would hide the formulas"
)]

use crate::plant::{SETTLED_INC, without_denormals};
use crate::units::INC_PER_RAD;

/// Axes worked together. Eight doubles are four packed registers of plain x86-64; more lanes would only cost cache.
pub(super) const LANES: usize = 8;

/// One value for each axis.
pub(super) type Lane = [f64; LANES];

/// Bits set in the lanes that need the axis itself for this tick.
pub(super) type Unusual = [u64; LANES];

/// What changes from tick to tick.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct State {
    pub(super) i_d: Lane,
    pub(super) i_q: Lane,
    pub(super) omega: Lane,
    pub(super) angle_inc: [i64; LANES],
    pub(super) angle_fraction: Lane,
    /// +1, −1, or 0 while friction holds the shaft.
    pub(super) contact: Lane,
    pub(super) electrical_w: Lane,
    pub(super) u_dc: Lane,
    pub(super) position: [i64; LANES],
    pub(super) error_inc: Lane,
    pub(super) speed_inc_per_tick: Lane,
    pub(super) omega_meas: Lane,
    pub(super) omega_filtered: Lane,
    pub(super) omega_before: Lane,
    pub(super) torque_ref: Lane,
    pub(super) i_q_ref: Lane,
    pub(super) integral_speed: Lane,
    pub(super) integral_d: Lane,
    pub(super) integral_q: Lane,
    /// Voltage applied in the tick.
    pub(super) applied_d: Lane,
    pub(super) applied_q: Lane,
    /// Voltage computed for the next tick.
    pub(super) pending_d: Lane,
    pub(super) pending_q: Lane,
}

/// What stays: parameters of plant and controllers, and the command.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Constants {
    pub(super) omega_ref: Lane,
    pub(super) torque_ff: Lane,
    pub(super) load_nm: Lane,
    pub(super) r_s: Lane,
    pub(super) l_d: Lane,
    pub(super) l_q: Lane,
    pub(super) inv_l_d: Lane,
    pub(super) inv_l_q: Lane,
    pub(super) psi_f: Lane,
    pub(super) n_p: Lane,
    pub(super) torque_psi: Lane,
    pub(super) torque_saliency: Lane,
    pub(super) inv_j: Lane,
    pub(super) coulomb_nm: Lane,
    pub(super) viscous: Lane,
    pub(super) standby_w: Lane,
    pub(super) volt_squared_per_watt: Lane,
    /// Minus infinity without mains: the link is then above it at any voltage.
    pub(super) rectified_v: Lane,
    pub(super) source_share: Lane,
    pub(super) lu_v: Lane,
    pub(super) ou_v: Lane,
    /// Infinity without a brake module.
    pub(super) brake_on_v: Lane,
    pub(super) resolver_mask: [i64; LANES],
    pub(super) position_gain: Lane,
    pub(super) speed_gain: Lane,
    pub(super) rad_s_per_inc_tick: Lane,
    pub(super) filter_share: Lane,
    pub(super) k_p_speed: Lane,
    pub(super) t_over_t_n_speed: Lane,
    pub(super) differential: Lane,
    pub(super) torque_max_nm: Lane,
    pub(super) amperes_per_nm: Lane,
    pub(super) k_p_current: Lane,
    pub(super) t_over_t_n_current: Lane,
    pub(super) tick_s: f64,
}

/// Period of the speed controller or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SpeedPeriod {
    /// The speed controller runs in this tick.
    Begins,
    /// It holds its torque.
    Goes,
}

/// One tick: from `now` to `next`.
pub(super) fn tick(now: &State, next: &mut State, k: &Constants, period: SpeedPeriod) -> Unusual {
    let mut unusual = [0; LANES];
    match period {
        SpeedPeriod::Begins => speed(now, next, k, &mut unusual),
        SpeedPeriod::Goes => {
            next.torque_ref = now.torque_ref;
            next.i_q_ref = now.i_q_ref;
            next.integral_speed = now.integral_speed;
            next.omega_before = now.omega_before;
        }
    }
    current(now, next, k, &mut unusual);
    drive_train(now, next, k, &mut unusual);
    dc_link(now, next, k, &mut unusual);
    feedback(now, next, k);
    unusual
}

/// `SpeedController::step` below the torque limit.
#[inline]
fn speed(now: &State, next: &mut State, k: &Constants, unusual: &mut Unusual) {
    for l in 0..LANES {
        let error = k.omega_ref[l] - now.omega_meas[l];
        let demanded = (k.k_p_speed[l] * error + now.integral_speed[l]) + k.torque_ff[l]
            - k.differential[l] * (now.omega_meas[l] - now.omega_before[l]);
        unusual[l] |= u64::from(!within(demanded.abs(), k.torque_max_nm[l]));
        let integral = now.integral_speed[l] + k.t_over_t_n_speed[l] * (k.k_p_speed[l] * error + 0.0);
        next.integral_speed[l] = without_denormals(integral);
        next.omega_before[l] = now.omega_meas[l];
        next.torque_ref[l] = demanded;
        next.i_q_ref[l] = demanded * k.amperes_per_nm[l];
    }
}

/// `CurrentController` with decoupling, inside the voltage circle.
#[inline]
fn current(now: &State, next: &mut State, k: &Constants, unusual: &mut Unusual) {
    for l in 0..LANES {
        let (error_d, error_q) = (0.0 - now.i_d[l], next.i_q_ref[l] - now.i_q[l]);
        let omega_el = k.n_p[l] * now.omega_meas[l];
        let u_d = (k.k_p_current[l] * error_d + now.integral_d[l]) + -omega_el * k.l_q[l] * now.i_q[l];
        let u_q = (k.k_p_current[l] * error_q + now.integral_q[l]) + omega_el * (k.l_d[l] * now.i_d[l] + k.psi_f[l]);
        let max_squared = now.u_dc[l] * now.u_dc[l] * (1.0 / 3.0);
        unusual[l] |= u64::from(!within(u_d * u_d + u_q * u_q, max_squared));
        let share = k.t_over_t_n_current[l];
        next.integral_d[l] = without_denormals(now.integral_d[l] + share * (k.k_p_current[l] * error_d + 0.0));
        next.integral_q[l] = without_denormals(now.integral_q[l] + share * (k.k_p_current[l] * error_q + 0.0));
        next.applied_d[l] = now.pending_d[l];
        next.applied_q[l] = now.pending_q[l];
        next.pending_d[l] = u_d;
        next.pending_q[l] = u_q;
    }
}

/// `DriveTrain::advance`: one RK4 step, in which the shaft does not stop.
///
/// Three loops: the compiler packs each, but not the three in one.
#[inline]
fn drive_train(now: &State, next: &mut State, k: &Constants, unusual: &mut Unusual) {
    let (mut against_nm, mut inv_j) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let drive_nm = torque(k, l, now.i_d[l], now.i_q[l]) - k.load_nm[l];
        let breaks_away = f64::from(drive_nm > k.coulomb_nm[l]) - f64::from(drive_nm < -k.coulomb_nm[l]);
        let (contact, inverse) = (now.contact[l], k.inv_j[l]);
        let contact = if contact == 0.0 { breaks_away } else { contact };
        against_nm[l] = k.load_nm[l] + contact * k.coulomb_nm[l];
        inv_j[l] = if contact == 0.0 { 0.0 } else { inverse };
        next.contact[l] = contact;
    }
    let (h, half, sixth) = (k.tick_s, 0.5 * k.tick_s, k.tick_s / 6.0);
    let mut travel_rad = [0.0; LANES];
    for l in 0..LANES {
        let (u_d, u_q) = (next.applied_d[l], next.applied_q[l]);
        let (i_d, i_q, omega) = (now.i_d[l], now.i_q[l], now.omega[l]);
        let derivative = |i_d: f64, i_q: f64, omega: f64| {
            let omega_el = k.n_p[l] * omega;
            (
                (u_d - k.r_s[l] * i_d + omega_el * k.l_q[l] * i_q) * k.inv_l_d[l],
                (u_q - k.r_s[l] * i_q - omega_el * (k.l_d[l] * i_d + k.psi_f[l])) * k.inv_l_q[l],
                (torque(k, l, i_d, i_q) - against_nm[l] - k.viscous[l] * omega) * inv_j[l],
            )
        };
        let (d1, q1, w1) = derivative(i_d, i_q, omega);
        let (i_d2, i_q2, o2) = (i_d + d1 * half, i_q + q1 * half, omega + w1 * half);
        let (d2, q2, w2) = derivative(i_d2, i_q2, o2);
        let (i_d3, i_q3, o3) = (i_d + d2 * half, i_q + q2 * half, omega + w2 * half);
        let (d3, q3, w3) = derivative(i_d3, i_q3, o3);
        let (i_d4, i_q4, o4) = (i_d + d3 * h, i_q + q3 * h, omega + w3 * h);
        let (d4, q4, w4) = derivative(i_d4, i_q4, o4);
        let charge_d = (i_d + (i_d2 + i_d3) * 2.0 + i_d4) * sixth;
        let charge_q = (i_q + (i_q2 + i_q3) * 2.0 + i_q4) * sixth;
        next.electrical_w[l] = 1.5 * (u_d * charge_d + u_q * charge_q) / h;
        next.i_d[l] = i_d + (d1 + (d2 + d3) * 2.0 + d4) * sixth;
        next.i_q[l] = i_q + (q1 + (q2 + q3) * 2.0 + q4) * sixth;
        next.omega[l] = omega + (w1 + (w2 + w3) * 2.0 + w4) * sixth;
        travel_rad[l] = 0.0 + (omega + (o2 + o3) * 2.0 + o4) * sixth;
    }
    for l in 0..LANES {
        unusual[l] |= u64::from(!within(0.0, next.omega[l] * next.contact[l]));
        let (i_d, i_q) = (without_denormals(next.i_d[l]), without_denormals(next.i_q[l]));
        next.i_d[l] = i_d;
        next.i_q[l] = i_q;
        next.omega[l] = without_denormals(next.omega[l]);
        // `ShaftAngle::new`
        let offset = now.angle_fraction[l] + travel_rad[l] * INC_PER_RAD;
        let floor = floor(offset);
        let fraction = offset - floor;
        let rounds_up = fraction >= 1.0;
        next.angle_inc[l] = now.angle_inc[l].wrapping_add(whole(floor)) + i64::from(rounds_up);
        next.angle_fraction[l] = if rounds_up { 0.0 } else { fraction };
    }
}

#[inline]
fn torque(k: &Constants, l: usize, i_d: f64, i_q: f64) -> f64 {
    (k.torque_psi[l] + k.torque_saliency[l] * i_d) * i_q
}

/// `DcLink::advance` between its thresholds, the brake module off.
#[inline]
fn dc_link(now: &State, next: &mut State, k: &Constants, unusual: &mut Unusual) {
    for l in 0..LANES {
        let power_out = next.electrical_w[l] + k.standby_w[l];
        let squared = now.u_dc[l] * now.u_dc[l] - k.volt_squared_per_watt[l] * power_out;
        let discharged = squared.sqrt();
        let charged = discharged + k.source_share[l] * (k.rectified_v[l] - discharged);
        let u_dc = if discharged < k.rectified_v[l] {
            charged
        } else {
            discharged
        };
        // Charging only raises the voltage. An empty link is not a number here.
        let normal = within(k.lu_v[l], discharged) & within(u_dc, k.ou_v[l]) & within(now.u_dc[l], k.brake_on_v[l]);
        unusual[l] |= u64::from(!normal);
        next.u_dc[l] = u_dc;
    }
}

/// `Feedback::sample` and the filter of the displayed speed.
#[inline]
fn feedback(now: &State, next: &mut State, k: &Constants) {
    for l in 0..LANES {
        let position = next.angle_inc[l] & k.resolver_mask[l];
        let step = float(position.wrapping_sub(now.position[l]));
        next.position[l] = position;
        let error = now.error_inc[l] + step - now.speed_inc_per_tick[l];
        let speed = now.speed_inc_per_tick[l] + k.speed_gain[l] * error;
        let error = error - k.position_gain[l] * error;
        let settled = error.abs() < SETTLED_INC && speed.abs() < SETTLED_INC;
        next.error_inc[l] = if settled { 0.0 } else { error };
        next.speed_inc_per_tick[l] = if settled { 0.0 } else { speed };
        let omega_meas = next.speed_inc_per_tick[l] * k.rad_s_per_inc_tick[l];
        next.omega_meas[l] = omega_meas;
        let filtered = now.omega_filtered[l] + k.filter_share[l] * (omega_meas - now.omega_filtered[l]);
        next.omega_filtered[l] = without_denormals(filtered);
    }
}

/// Whether a value keeps a bound; what is not a number does not.
#[inline]
fn within(value: f64, bound: f64) -> bool {
    value <= bound
}

/// Adding this to a number below 2^51 leaves its integer part in the mantissa: plain x86-64 has packed additions, but no packed
/// conversion to 64-bit integers.
const MAGIC: f64 = 6_755_399_441_055_744.0; // 1.5 · 2^52

/// Largest whole number not above `x`; |x| < 2^51.
#[inline]
fn floor(x: f64) -> f64 {
    let nearest = (x + MAGIC) - MAGIC;
    nearest - f64::from(nearest > x)
}

/// A whole number below 2^51 as an integer.
#[inline]
fn whole(x: f64) -> i64 {
    (x + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits()).cast_signed()
}

/// An integer below 2^51 as a float.
#[inline]
fn float(n: i64) -> f64 {
    f64::from_bits(MAGIC.to_bits().wrapping_add(n.cast_unsigned())) - MAGIC
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_are_those_of_the_standard_library() {
        for x in [
            0.0,
            0.3,
            -0.3,
            0.5,
            1.5,
            -1.5,
            2.0,
            -2.0,
            384.28,
            -384.28,
            1e15 + 0.5,
            -1e15 - 0.5,
            -1e-300,
        ] {
            assert_eq!(floor(x), x.floor(), "{x}");
            assert_eq!(whole(x.floor()), x.floor() as i64, "{x}");
        }
        for n in [0, 1, -1, 65_536, -65_536, 1 << 50, -(1 << 50)] {
            assert_eq!(float(n), n as f64);
        }
    }
}
