use crate::plant::without_denormals;

/// Gains of a PI controller in ideal form, K_p (1 + 1/(T_N s)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiGains {
    /// Proportional gain, output unit per input unit.
    #[doc(alias = "Proportionalverstärkung")]
    pub k_p: f64,
    /// Integral time, s; infinity switches the integral part off.
    #[doc(alias = "Nachstellzeit")]
    pub t_n_s: f64,
}

/// PI controller whose integrator follows what was realised.
///
/// `compute_output` only reads. After the output has gone through every limit, `update` gets the realised value:
///
/// ```text
/// u  = K_p e + x
/// x += T/T_N · (K_p e + u_realised − u)
/// ```
///
/// Without a limit the bracket is K_p·e, the plain integral. Under a limit it is u_realised − x: the integrator moves as if
/// the error had been the one that just demands the limit (Hanus' conditioning), runs to the limit with time constant T_N
/// and never past it. Thus the output leaves the limit as soon as the error changes its sign, whatever limited it
/// (torque, voltage, or a limit elsewhere).
#[derive(Debug, Clone)]
pub struct PiController {
    pub(crate) gains: PiGains,
    t_s: f64,
    pub(crate) t_s_over_t_n: f64,
    pub(crate) integral: f64,
}

impl PiController {
    /// A controller called every `t_s` seconds, with an empty integrator.
    #[must_use]
    pub fn new(gains: PiGains, t_s: f64) -> Self {
        Self {
            gains,
            t_s,
            t_s_over_t_n: t_s / gains.t_n_s,
            integral: 0.0,
        }
    }

    /// Changes the gains; the integrator, which holds output units, keeps its value, so the output does not jump by it.
    pub fn set_gains(&mut self, gains: PiGains) {
        self.gains = gains;
        self.t_s_over_t_n = self.t_s / gains.t_n_s;
    }

    /// Gains in use.
    #[must_use]
    pub fn gains(&self) -> PiGains {
        self.gains
    }

    /// Demanded output for a control error; changes nothing.
    #[inline]
    #[must_use]
    pub fn compute_output(&self, error: f64) -> f64 {
        self.gains.k_p * error + self.integral
    }

    /// Moves the integrator on by one period. `demanded` is what `compute_output` gave, `realised` what came of it.
    #[inline]
    pub fn update(&mut self, error: f64, demanded: f64, realised: f64) {
        self.integral += self.t_s_over_t_n * (self.gains.k_p * error + (realised - demanded));
        self.integral = without_denormals(self.integral);
    }

    /// Sets the integrator, in output units.
    pub fn reset(&mut self, integral: f64) {
        self.integral = integral;
    }

    /// Integral part of the output.
    #[must_use]
    pub fn integral(&self) -> f64 {
        self.integral
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: PiGains = PiGains { k_p: 2.0, t_n_s: 0.020 };

    #[test]
    fn after_one_integral_time_the_output_of_a_constant_error_has_doubled() {
        // Definition of T_N: the integral part equals the proportional one after T_N.
        let mut pi = PiController::new(GAINS, 250e-6);
        for _ in 0..80 {
            let u = pi.compute_output(0.5);
            pi.update(0.5, u, u);
        }
        assert!((pi.compute_output(0.5) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn computing_has_no_side_effect() {
        let pi = PiController::new(GAINS, 250e-6);
        assert_eq!(pi.compute_output(1.0).to_bits(), pi.compute_output(1.0).to_bits());
        assert_eq!(pi.integral(), 0.0);
    }

    #[test]
    fn a_limited_controller_leaves_the_limit_as_soon_as_the_error_changes_its_sign() {
        let mut pi = PiController::new(GAINS, 250e-6);
        for _ in 0..4000 {
            let u = pi.compute_output(3.0);
            pi.update(3.0, u, u.min(1.0));
        }
        // A plain integral would have grown to 2 · 3.0 · 1 s/20 ms = 300.
        assert!((pi.integral() - 1.0).abs() < 1e-9, "{}", pi.integral());
        assert!(pi.compute_output(-0.01) < 1.0);
    }

    #[test]
    fn an_infinite_integral_time_leaves_a_p_controller() {
        let mut pi = PiController::new(
            PiGains {
                k_p: 2.0,
                t_n_s: f64::INFINITY,
            },
            250e-6,
        );
        for _ in 0..100 {
            let u = pi.compute_output(1.0);
            pi.update(1.0, u, u.min(0.1));
        }
        assert_eq!(pi.compute_output(1.0), 2.0);
    }
}
