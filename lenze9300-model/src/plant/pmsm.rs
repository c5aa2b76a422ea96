use core::f64::consts::SQRT_2;

use nalgebra::SVector;

use super::{Dq, Terminals};

/// State of motor and shaft within one tick: `[i_d A, i_q A, omega_mech rad/s, theta_mech rad]`.
///
/// The angle counts from the start of the tick; whole increments are kept as integers in [`super::ShaftAngle`].
pub type MotorState = SVector<f64, 4>;

/// Synchronous servo motor with magnets, described in the rotor-fixed frame with peak-valued quantities.
///
/// ```text
/// u_d = R i_d + L_d di_d/dt − ω_el L_q i_q
/// u_q = R i_q + L_q di_q/dt + ω_el (L_d i_d + ψ)
/// M   = 3/2 n_p (ψ + (L_d − L_q) i_d) i_q
/// ```
///
/// Left out at this fidelity: saturation (0.62 Nm/A at the peak current against 0.778), iron losses, cogging, and the
/// dependence of R and ψ on the temperature. Source: 9300 facts 6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PmsmParams {
    /// Stator resistance of a phase in star, Ω (C0084).
    #[doc(alias = "Ständerwiderstand")]
    pub r_s: f64,
    /// Inductance along d of a phase in star, H (C0085).
    #[doc(alias = "Streuinduktivität")]
    pub l_d: f64,
    /// Inductance along q of a phase in star, H (C0085).
    pub l_q: f64,
    /// Flux linkage of the magnets, peak value, Wb.
    pub psi_f: f64,
    /// Pole pairs.
    #[doc(alias = "Polpaarzahl")]
    pub n_p: u32,
}

impl PmsmParams {
    /// Motor MDSKS036-13, entry 108 of the drive's motor list.
    ///
    /// R = 19.8 Ω and L = 30.5 mH per phase, 3 pole pairs (60 · 200 Hz / 4000 rpm), torque constant M_0/I_0 =
    /// 0.70 Nm / 0.90 A = 0.778 Nm/A rms. Source: film-feed specification, section 5; 9300 facts 6.
    pub const MDSKS036_13: Self = Self::from_torque_constant(19.8, 30.5e-3, 0.70 / 0.90, 3);

    /// A motor without saliency from its torque constant in Nm per ampere rms.
    ///
    /// With i_q = √2·I the torque is 3/2 n_p ψ √2 I, hence ψ = k_T / (3/2 √2 n_p).
    #[must_use]
    pub const fn from_torque_constant(r_s: f64, l_s: f64, k_t_nm_per_a_rms: f64, n_p: u32) -> Self {
        Self {
            r_s,
            l_d: l_s,
            l_q: l_s,
            psi_f: k_t_nm_per_a_rms / (1.5 * SQRT_2 * n_p as f64),
            n_p,
        }
    }

    /// Torque in the air gap, Nm.
    #[must_use]
    pub fn torque(&self, current: Dq) -> f64 {
        1.5 * self.n_p as f64 * (self.psi_f + (self.l_d - self.l_q) * current.d) * current.q
    }

    /// Torque per peak ampere of q current at i_d = 0, Nm/A.
    #[must_use]
    pub fn torque_per_peak_ampere(&self) -> f64 {
        1.5 * self.n_p as f64 * self.psi_f
    }

    /// Torque constant in Nm per ampere rms.
    #[must_use]
    pub fn torque_constant_rms(&self) -> f64 {
        SQRT_2 * self.torque_per_peak_ampere()
    }

    /// Electrical speed in rad/s at a mechanical one.
    #[must_use]
    pub fn omega_el(&self, omega_mech_rad_s: f64) -> f64 {
        self.n_p as f64 * omega_mech_rad_s
    }

    /// Voltage that the turning magnets induce, V.
    #[must_use]
    pub fn back_emf(&self, omega_mech_rad_s: f64) -> Dq {
        Dq::new(0.0, self.omega_el(omega_mech_rad_s) * self.psi_f)
    }

    /// Heat in the three windings, W: 3 R I² with the rms current of a phase.
    #[must_use]
    pub fn copper_loss(&self, current: Dq) -> f64 {
        1.5 * self.r_s * current.dot(current)
    }

    /// Bound of the largest eigenvalue in 1/s with a given inertia and speed, for the choice of sub-steps.
    #[must_use]
    pub fn spectral_radius(&self, j_total_kg_m2: f64, omega_mech_max_rad_s: f64) -> f64 {
        let l_min = self.l_d.min(self.l_q);
        let damping = self.r_s / l_min;
        let rotation = self.omega_el(omega_mech_max_rad_s);
        let coupling_squared = self.torque_per_peak_ampere() * self.n_p as f64 * self.psi_f / (l_min * j_total_kg_m2);
        (damping * damping + rotation * rotation + coupling_squared).sqrt()
    }
}

impl Default for PmsmParams {
    fn default() -> Self {
        Self::MDSKS036_13
    }
}

/// What acts on motor and shaft during one piece of a tick, with the reciprocals that make the derivative cheap.
///
/// A locked shaft has `inv_j = 0`, an open output stage `inv_l = 0`: the derivative needs no branch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotorInput {
    /// Torque against the positive direction, without the viscous part, Nm.
    pub(crate) tau_against: f64,
    pub(crate) viscous: f64,
    /// Reciprocals of the inductances along d and q, 1/H.
    pub(crate) inv_l: Dq,
    pub(crate) inv_j: f64,
}

/// The constants of the derivative, formed once.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MotorEquations {
    pub(crate) r_s: f64,
    pub(crate) l_d: f64,
    pub(crate) l_q: f64,
    pub(crate) psi_f: f64,
    pub(crate) n_p: f64,
    pub(crate) torque_psi: f64,
    pub(crate) torque_saliency: f64,
}

impl MotorEquations {
    pub(crate) fn new(params: &PmsmParams) -> Self {
        let n_p = params.n_p as f64;
        Self {
            r_s: params.r_s,
            l_d: params.l_d,
            l_q: params.l_q,
            psi_f: params.psi_f,
            n_p,
            torque_psi: 1.5 * n_p * params.psi_f,
            torque_saliency: 1.5 * n_p * (params.l_d - params.l_q),
        }
    }

    #[inline]
    pub(crate) fn torque(&self, i_d: f64, i_q: f64) -> f64 {
        (self.torque_psi + self.torque_saliency * i_d) * i_q
    }

    /// Time derivatives of the currents, A/s.
    #[inline]
    pub(crate) fn current_slopes(&self, current: Dq, omega: f64, voltage: Dq, inv_l: Dq) -> (f64, f64) {
        let omega_el = self.n_p * omega;
        (
            (voltage.d - self.r_s * current.d + omega_el * self.l_q * current.q) * inv_l.d,
            (voltage.q - self.r_s * current.q - omega_el * (self.l_d * current.d + self.psi_f)) * inv_l.q,
        )
    }

    /// Time derivative of the state of a motor on a rigid shaft.
    #[inline]
    pub(crate) fn derivative(&self, x: &MotorState, input: &MotorInput, terminals: &impl Terminals) -> MotorState {
        let (i_d, i_q, omega) = (x[0], x[1], x[2]);
        let (slope_d, slope_q) = self.current_slopes(Dq::new(i_d, i_q), omega, terminals.voltage(x[3]), input.inv_l);
        MotorState::new(
            slope_d,
            slope_q,
            (self.torque(i_d, i_q) - input.tau_against - input.viscous * omega) * input.inv_j,
            omega,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rpm;

    const MOTOR: PmsmParams = PmsmParams::MDSKS036_13;

    #[test]
    fn the_voltage_constant_is_47_volts_per_1000_rpm() {
        // Source: 9300 facts 6, "Voltage constant, line-line rms 47.0 V per 1000 rpm".
        let volts = MOTOR.back_emf(Rpm(1000.0).to_rad_s()).line_to_line_rms();
        assert!((volts - 47.0).abs() < 0.05, "{volts}");
    }

    #[test]
    fn the_back_emf_at_film_speed_is_132_volts() {
        // Source: 9300 facts 6, "at 2814.5 rpm E is about 132 V line-line".
        let volts = MOTOR.back_emf(Rpm(2814.5).to_rad_s()).line_to_line_rms();
        assert!((volts - 132.0).abs() < 0.5, "{volts}");
    }

    #[test]
    fn the_copper_loss_at_0_9_a_is_48_watts() {
        // Source: 9300 facts 6, 3 R I² = 3 · 19.8 · 0.81 = 48.1 W.
        let loss = MOTOR.copper_loss(Dq::new(0.0, 0.9 * SQRT_2));
        assert!((loss - 48.114).abs() < 1e-9, "{loss}");
    }

    #[test]
    fn the_current_limit_of_1_35_a_is_1_05_nm() {
        // Source: 9300 facts 6, "Torque limit by C0022 = 1.35 A: 1.05 Nm".
        let torque = MOTOR.torque(Dq::new(0.0, 1.35 * SQRT_2));
        assert!((torque - 1.05).abs() < 1e-12, "{torque}");
    }

    #[test]
    fn the_electrical_time_constant_is_1_54_ms() {
        // Source: 9300 facts 6, L/R = 1.54 ms.
        assert!((MOTOR.l_q / MOTOR.r_s - 1.54e-3).abs() < 1e-5);
    }

    #[test]
    fn the_rated_voltage_bound_is_not_exceeded_at_the_rated_point() {
        // Source: 9300 facts 6: |E + (R + jωL) I| at 0.9 A and 4000 rpm stays below U_N = 245 V with k_T = 0.778.
        let omega = Rpm(4000.0).to_rad_s();
        let current = Dq::new(0.0, 0.9 * SQRT_2);
        let omega_el = MOTOR.omega_el(omega);
        let voltage = MOTOR.back_emf(omega) + Dq::new(-omega_el * MOTOR.l_q * current.q, MOTOR.r_s * current.q);
        let volts = voltage.line_to_line_rms();
        assert!(volts < 245.0 && volts > 220.0, "{volts}");
    }
}
