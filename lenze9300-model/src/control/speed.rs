use super::{PiController, PiGains};

/// Speed controller: PID with torque limit, called every 250 µs.
///
/// C0070, C0071 and C0072 give its gains, C0022 its limit:
///
/// ```text
/// M = K_p (ω_ref − ω) + x + M_ff − K_p T_D dω/dt
/// ```
///
/// Interpretation: the differential part (C0072, 0 in the thesis) looks at the measured speed alone, over one period
/// and without a filter of its own; the set-value steps once a millisecond and would kick it.
///
/// # At the limit
///
/// 1. While the limit holds, the integrator keeps its value: a load that it carries does not go away because the error is
///    large. Only an error of the other sign moves it.
/// 2. After the limit it waits while the error dies out: as long as the error keeps its sign and falls by a share of at
///    least T/(4 T_N) a period.
///
/// A PI controller on an inertia passes its set-value whenever it starts from the limit and integrates on the way,
/// because x comes back to where it was only after the error has had both signs. So the proportional part alone
/// brings the error down, along exp(−t K_p/J) from M_max/K_p, and x takes over what is left: a load, friction. An
/// integrator that runs to the limit swings through zero, after a quick stop from 2814 rpm by 300 rpm.
#[doc(alias = "Drehzahlregler")]
#[derive(Debug, Clone)]
pub struct SpeedController {
    pub(crate) pi: PiController,
    pub(crate) torque_max_nm: f64,
    /// K_p T_D / T, Nm·s/rad.
    pub(crate) differential: f64,
    t_s: f64,
    /// Share of the error by which it has to fall in a period while the integrator waits.
    landing_share: f64,
    /// The last error, while the integrator waits for it to die out.
    pub(crate) landing_from: Option<f64>,
    pub(crate) omega_before: Option<f64>,
}

/// Gains of the speed controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedGains {
    /// Proportional and integral part, Nm·s/rad and s.
    pub pi: PiGains,
    /// Differential time, s; 0 switches it off.
    #[doc(alias = "Vorhaltzeit")]
    pub t_d_s: f64,
    /// Torque limit, Nm.
    pub torque_max_nm: f64,
}

/// What the speed controller sees in a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedInput {
    /// Set-value, rad/s.
    pub omega_ref: f64,
    /// Measured speed, rad/s.
    pub omega_meas: f64,
    /// Torque known in advance, Nm.
    pub torque_ff_nm: f64,
    /// Whether the current controller could make the last torque.
    pub voltage: VoltageReserve,
}

/// Whether the inverter has voltage left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VoltageReserve {
    /// The torque set-value is made.
    Enough,
    /// The voltage circle holds the current: more torque would not come, so the integrator does not ask for more.
    Exhausted,
}

/// Torque set-value of the speed controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueDemand {
    /// Torque within the limit, Nm.
    pub torque_nm: f64,
    /// Whether the limit held it.
    pub limited: bool,
}

impl SpeedController {
    /// A controller called every `t_s` seconds.
    #[must_use]
    pub fn new(gains: SpeedGains, t_s: f64) -> Self {
        let mut controller = Self {
            pi: PiController::new(gains.pi, t_s),
            torque_max_nm: gains.torque_max_nm,
            differential: 0.0,
            t_s,
            landing_share: 0.0,
            landing_from: None,
            omega_before: None,
        };
        controller.set_gains(gains);
        controller
    }

    /// One period: torque for a speed error plus a torque known in advance, within ±C0022.
    ///
    /// The limit stands behind all parts, so that the integrator knows what the feed-forward has used up.
    #[inline]
    pub fn step(&mut self, input: &SpeedInput) -> TorqueDemand {
        let error = input.omega_ref - input.omega_meas;
        let before = self.omega_before.replace(input.omega_meas).unwrap_or(input.omega_meas);
        let demanded =
            self.pi.compute_output(error) + input.torque_ff_nm - self.differential * (input.omega_meas - before);
        let torque_nm = demanded.clamp(-self.torque_max_nm, self.torque_max_nm);
        let limited = torque_nm != demanded;
        if limited {
            if error * torque_nm <= 0.0 {
                self.pi.update(error, demanded, demanded);
            }
            self.landing_from = Some(error);
        } else if !self.waits(error) && (input.voltage == VoltageReserve::Enough || error * demanded <= 0.0) {
            self.pi.update(error, demanded, demanded);
        }
        TorqueDemand { torque_nm, limited }
    }

    /// Whether the error is still dying out after the limit.
    #[inline]
    fn waits(&mut self, error: f64) -> bool {
        let Some(last) = self.landing_from else {
            return false;
        };
        let falls = last * error > 0.0 && last.abs() - error.abs() >= self.landing_share * error.abs();
        self.landing_from = falls.then_some(error);
        falls
    }

    /// Sets the integrator, Nm: what the axis makes while somebody else commands the torque.
    pub fn preset(&mut self, torque_nm: f64) {
        self.pi.reset(torque_nm);
        self.landing_from = None;
        self.omega_before = None;
    }

    /// Empties the integrator and forgets the last speed.
    pub fn reset(&mut self) {
        self.preset(0.0);
    }

    /// Changes gains and limit; the integrator stays.
    pub fn set_gains(&mut self, gains: SpeedGains) {
        self.pi.set_gains(gains.pi);
        self.torque_max_nm = gains.torque_max_nm;
        self.landing_share = self.t_s / (4.0 * gains.pi.t_n_s);
        self.differential = gains.pi.k_p * gains.t_d_s / self.t_s;
    }

    /// Torque that the integrator holds, Nm.
    #[must_use]
    pub fn integral_nm(&self) -> f64 {
        self.pi.integral()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: SpeedGains = SpeedGains {
        pi: PiGains {
            k_p: 0.01671,
            t_n_s: 0.020,
        },
        t_d_s: 0.0,
        torque_max_nm: 1.05,
    };

    fn error(omega_rad_s: f64) -> SpeedInput {
        SpeedInput {
            omega_ref: omega_rad_s,
            omega_meas: 0.0,
            torque_ff_nm: 0.0,
            voltage: VoltageReserve::Enough,
        }
    }

    #[test]
    fn the_torque_never_passes_the_limit_and_says_so() {
        let mut speed = SpeedController::new(GAINS, 250e-6);
        let full = |torque_nm| TorqueDemand {
            torque_nm,
            limited: true,
        };
        assert_eq!(speed.step(&error(1000.0)), full(1.05));
        let braking = SpeedInput {
            torque_ff_nm: -0.5,
            ..error(-1000.0)
        };
        assert_eq!(speed.step(&braking), full(-1.05));
        let small = SpeedController::new(GAINS, 250e-6).step(&error(1.0));
        assert!(!small.limited);
    }

    #[test]
    fn one_percent_of_speed_error_demands_five_percent_of_torque() {
        // Source: design, section 6: C0070 = 5 means 5 % of 1.05 Nm per 1 % of 314.16 rad/s.
        let mut speed = SpeedController::new(GAINS, 250e-6);
        let demand = speed.step(&error(0.01 * 314.159_265));
        assert!((demand.torque_nm - 0.0525).abs() < 1e-5, "{demand:?}");
    }

    #[test]
    fn at_the_limit_the_integrator_keeps_what_it_carries() {
        let mut speed = SpeedController::new(GAINS, 250e-6);
        speed.preset(0.9);
        assert!(speed.step(&error(294.0)).limited);
        assert!(speed.step(&error(-294.0)).limited);
        assert_eq!(speed.integral_nm(), 0.9);
    }

    #[test]
    fn after_the_limit_the_integrator_waits_until_the_error_stops_to_fall() {
        let mut speed = SpeedController::new(GAINS, 250e-6);
        speed.step(&error(-294.0));
        for omega in [-60.0, -50.0, -40.0] {
            assert!(!speed.step(&error(omega)).limited);
            assert_eq!(speed.integral_nm(), 0.0);
        }
        // T/(4 T_N) = 0.3 %: from −40 rad/s it would have to fall below 39.875.
        speed.step(&error(-39.9));
        let integral = speed.integral_nm();
        assert!(
            (integral - 0.01671 * -39.9 * 250e-6 / 0.020).abs() < 1e-12,
            "{integral}"
        );
        speed.step(&error(-30.0));
        assert!(speed.integral_nm() < integral, "once it goes on, it goes on");
    }

    #[test]
    fn an_error_of_the_other_sign_ends_the_waiting() {
        let mut speed = SpeedController::new(GAINS, 250e-6);
        speed.step(&error(-294.0));
        speed.step(&error(1.0));
        assert!(speed.integral_nm() > 0.0);
    }

    #[test]
    fn the_differential_time_answers_a_change_of_the_measured_speed() {
        // K_p T_D dω/dt: 0.01671 · 1 ms · 2 rad/s in 250 µs = 0.1337 Nm against the change; a step of the set-value
        // does not count.
        let gains = SpeedGains { t_d_s: 1e-3, ..GAINS };
        let mut speed = SpeedController::new(gains, 250e-6);
        let plain = SpeedController::new(GAINS, 250e-6).step(&error(10.0));
        assert_eq!(speed.step(&error(10.0)), plain);
        let turning = SpeedInput {
            omega_ref: 12.0,
            omega_meas: 2.0,
            ..error(0.0)
        };
        let integral = speed.integral_nm();
        let demand = speed.step(&turning);
        let expected = 0.01671 * 10.0 + integral - 0.01671 * 1e-3 * 2.0 / 250e-6;
        assert!((demand.torque_nm - expected).abs() < 1e-12, "{demand:?}");
    }

    #[test]
    fn without_voltage_the_integrator_asks_for_no_more_but_lets_go() {
        let mut speed = SpeedController::new(GAINS, 250e-6);
        speed.preset(0.5);
        let exhausted = |omega| SpeedInput {
            voltage: VoltageReserve::Exhausted,
            ..error(omega)
        };
        speed.step(&exhausted(10.0));
        assert_eq!(speed.integral_nm(), 0.5);
        speed.step(&exhausted(-10.0));
        assert!(speed.integral_nm() < 0.5);
    }
}
