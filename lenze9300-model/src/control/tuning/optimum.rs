//! The formulas themselves.
//!
//! They give gains for a controller in the form K_p (1 + 1/(T_N s)). They treat the sampled loops as continuous, as the
//! thesis does; the dead time of a sampled loop enters through T_Σ, see [`sampled_t_sigma_s`].

use crate::control::PiGains;

/// Magnitude optimum for a PI controller and a first-order plant, formulas I and II.
///
/// The plant is V_S/(1 + T_S s), behind a power stage 1/(1 + T_Σ s). T_N = T_S cancels the plant's pole and leaves
/// the open loop K_p V_S / (T_S s (1 + T_Σ s)). The closed loop is 1/(1 + s T_S/(K_p V_S) + s² T_S T_Σ/(K_p V_S));
/// its magnitude stays at 1 up to the highest frequency when the coefficient of ω² in its square vanishes: (T_S/(K_p
/// V_S))² = 2 T_S T_Σ/(K_p V_S), hence
///
/// ```text
/// K_p = T_S / (V_S · 2 T_Σ)   (I)        T_N = T_S   (II)
/// ```
///
/// The closed loop is then 1/(1 + 2 T_Σ s + 2 T_Σ² s²), damping 1/√2: 4.32 % overshoot, set-value first reached after
/// 3π/2 · T_Σ = 4.71 T_Σ. For a winding V_S = 1/R and T_S = L/R, so K_p = L/(2 T_Σ).
#[doc(alias = "Betragsoptimum")]
#[must_use]
pub fn magnitude_optimum(v_s: f64, t_s: f64, t_sigma_s: f64) -> PiGains {
    PiGains {
        k_p: t_s / (v_s * 2.0 * t_sigma_s),
        t_n_s: t_s,
    }
}

/// Symmetrical optimum for a PI controller and an integrating plant, formulas III and IV.
///
/// The plant is 1/(J s), behind a current loop taken as 1/(1 + T_I s). The open loop K_p (1 + T_N s)/(T_N s · J s ·
/// (1 + T_I s)) has its largest phase margin at ω = 1/√(T_N T_I), the middle of its two corners on the logarithmic
/// axis. With T_N = 4 T_I the gain is 1 there for K_p = J/√(T_N T_I):
///
/// ```text
/// K_p = J / (2 T_I)   (III)        T_N = 4 T_I   (IV)
/// ```
///
/// The step response overshoots by 43 %, because of the controller's zero; a set-value filter of T_N or ramps remove
/// it. J in kg m², K_p in Nm·s/rad.
#[doc(alias = "Symmetrisches Optimum")]
#[must_use]
pub fn symmetrical_optimum(j_total_kg_m2: f64, t_i_reg_s: f64) -> PiGains {
    PiGains {
        k_p: j_total_kg_m2 / (2.0 * t_i_reg_s),
        t_n_s: 4.0 * t_i_reg_s,
    }
}

/// Position gain after the magnitude optimum, formula V, in 1/s: k_v = T_i / (2 T_n).
///
/// The plant is T_i s in the denominator, behind a speed loop taken as 1/(1 + T_n s). `t_i` is 1 when position and
/// speed have matching units (rad and rad/s); the thesis' 60/resolution is the same integrator between rpm and
/// encoder steps.
#[doc(alias = "Lageverstärkung")]
#[must_use]
pub fn position_gain(t_i: f64, t_n_reg_s: f64) -> f64 {
    t_i / (2.0 * t_n_reg_s)
}

/// Following error of a position loop without speed feed-forward, formula VI: F = n / k_v.
///
/// In the unit of the position whose rate is the speed: rad/s over 1/s give rad.
#[doc(alias = "Schleppfehler")]
#[must_use]
pub fn following_error(speed: f64, k_v_per_s: f64) -> f64 {
    speed / k_v_per_s
}

/// Time constant of a power stage in a sampled loop: one period to compute, half a period of mean hold time.
#[doc(alias = "Ersatzzeitkonstante")]
#[must_use]
pub fn sampled_t_sigma_s(period_s: f64) -> f64 {
    1.5 * period_s
}

/// The thesis' reading of the tuned current loop as a first-order lag: about 4 T_Σ (ch. 5.3).
///
/// DEVIATION: the derivation above gives 2 T_Σ for the small-signal lag; the 4 T_Σ are the thesis' cautious value.
#[must_use]
pub fn current_loop_time_s(t_sigma_s: f64) -> f64 {
    4.0 * t_sigma_s
}

/// The thesis' reading of the tuned speed loop as a first-order lag: about 3 T_I (ch. 5.3).
#[must_use]
pub fn speed_loop_time_s(t_i_reg_s: f64) -> f64 {
    3.0 * t_i_reg_s
}

/// Largest following error of a jump of the acceleration, with exact speed feed-forward and no torque feed-forward.
///
/// Position P and speed PI around J give e(s) = α / (s³ + (K_p/J)(s + k_v)(s + 1/T_N)) for a jump of `alpha`, with
/// the current loop taken as ideal. The peak is found by stepping this equation in time; `alpha` may have any unit of
/// acceleration and the result has that of its way. A load torque M that appears at once counts as alpha = M/J.
#[must_use]
pub fn peak_following_error(alpha: f64, speed_gains: PiGains, j_total_kg_m2: f64, k_v_per_s: f64) -> f64 {
    let a2 = speed_gains.k_p / j_total_kg_m2;
    let a1 = a2 * (k_v_per_s + 1.0 / speed_gains.t_n_s);
    let a0 = a2 * k_v_per_s / speed_gains.t_n_s;
    // Impulse response: e = e' = 0, e'' = alpha. The step is small against the fastest of the three modes.
    let h_s = 0.002 / a2.max(a1.sqrt());
    let (mut e, mut de, mut dde) = (0.0_f64, 0.0_f64, alpha);
    let mut peak = 0.0_f64;
    for _ in 0..100_000 {
        dde += h_s * (-a2 * dde - a1 * de - a0 * e);
        de += h_s * dde;
        e += h_s * de;
        if e.abs() < peak {
            break;
        }
        peak = e.abs();
    }
    peak
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_winding_of_the_thesis_asks_for_81_3_volts_per_ampere() {
        // Source: design, section 6: L/(2 · 1.5 · 125 µs) = 81.3 V/A; T_N = L/R = 1.54 ms.
        let gains = magnitude_optimum(1.0 / 19.8, 30.5e-3 / 19.8, sampled_t_sigma_s(125e-6));
        assert!((gains.k_p - 81.33).abs() < 0.01, "{gains:?}");
        assert!((gains.t_n_s - 1.54e-3).abs() < 1e-5);
    }

    #[test]
    fn the_symmetrical_optimum_puts_the_crossover_between_its_corners() {
        // |F(jω)| = 1 at ω = 1/(2 T_I), phase margin atan(2) − atan(1/2) = 36.87° (textbook value).
        let (j, t_i) = (0.914e-4, 0.75e-3);
        let gains = symmetrical_optimum(j, t_i);
        let omega = 1.0 / (2.0 * t_i);
        let (wn, wi) = (omega * gains.t_n_s, omega * t_i);
        let magnitude = gains.k_p * (1.0 + wn * wn).sqrt() / (wn * j * omega * (1.0 + wi * wi).sqrt());
        assert!((magnitude - 1.0).abs() < 1e-12, "{magnitude}");
        let margin = (wn.atan() - wi.atan()).to_degrees();
        assert!((margin - 36.87).abs() < 0.01, "{margin}");
    }

    #[test]
    fn position_gain_and_following_error_match_the_thesis_formulas() {
        // V: 1/(2 · 10 ms) = 50 1/s; VI: 294.7 rad/s over 50 1/s = 5.89 rad.
        assert!((position_gain(1.0, 10e-3) - 50.0).abs() < 1e-12);
        assert!((following_error(294.7, 50.0) - 5.894).abs() < 1e-12);
    }

    #[test]
    fn the_equivalent_times_are_those_of_the_thesis() {
        // Source: film-feed specification, section 4: T_I-Reg about 4 T_Σ, T_n-Reg about 3 T_I-Reg.
        let t_i = current_loop_time_s(sampled_t_sigma_s(125e-6));
        assert!((t_i - 0.75e-3).abs() < 1e-15);
        assert!((speed_loop_time_s(t_i) - 2.25e-3).abs() < 1e-15);
    }
}
