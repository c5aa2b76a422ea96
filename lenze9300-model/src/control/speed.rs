use super::{PiController, PiGains};

/// Speed controller: PI with torque limit, called every second tick (250 µs).
///
/// C0070 and C0071 give its gains, C0022 its limit; the differential part (C0072) is 0 in the thesis and left out.
#[doc(alias = "Drehzahlregler")]
#[derive(Debug, Clone)]
pub struct SpeedController {
    pi: PiController,
    torque_max_nm: f64,
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
    /// A controller with its torque limit, called every `t_s` seconds.
    #[must_use]
    pub fn new(gains: PiGains, torque_max_nm: f64, t_s: f64) -> Self {
        Self {
            pi: PiController::new(gains, t_s),
            torque_max_nm,
        }
    }

    /// One period: torque for a speed error plus a torque known in advance, within ±C0022.
    ///
    /// The limit stands behind both parts, so that the integrator knows what the feed-forward has used up.
    #[inline]
    pub fn step(&mut self, omega_error_rad_s: f64, torque_ff_nm: f64) -> TorqueDemand {
        let demanded = self.pi.compute_output(omega_error_rad_s) + torque_ff_nm;
        let torque_nm = demanded.clamp(-self.torque_max_nm, self.torque_max_nm);
        self.pi.update(omega_error_rad_s, demanded, torque_nm);
        TorqueDemand {
            torque_nm,
            limited: torque_nm != demanded,
        }
    }

    /// Sets the integrator, Nm: what the axis makes while somebody else commands the torque.
    pub fn preset(&mut self, torque_nm: f64) {
        self.pi.reset(torque_nm);
    }

    /// Empties the integrator.
    pub fn reset(&mut self) {
        self.pi.reset(0.0);
    }

    /// Changes gains and limit; the integrator stays.
    pub fn set_gains(&mut self, gains: PiGains, torque_max_nm: f64) {
        self.pi.set_gains(gains);
        self.torque_max_nm = torque_max_nm;
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

    #[test]
    fn the_torque_never_passes_the_limit_and_says_so() {
        let mut speed = SpeedController::new(
            PiGains {
                k_p: 0.01671,
                t_n_s: 0.020,
            },
            1.05,
            250e-6,
        );
        assert_eq!(
            speed.step(1000.0, 0.0),
            TorqueDemand {
                torque_nm: 1.05,
                limited: true
            }
        );
        assert_eq!(
            speed.step(-1000.0, -0.5),
            TorqueDemand {
                torque_nm: -1.05,
                limited: true
            }
        );
        let small = speed.step(1.0, 0.0);
        assert!(!small.limited);
    }

    #[test]
    fn one_percent_of_speed_error_demands_five_percent_of_torque() {
        // Source: design, section 6: C0070 = 5 means 5 % of 1.05 Nm per 1 % of 314.16 rad/s.
        let mut speed = SpeedController::new(
            PiGains {
                k_p: 0.01671,
                t_n_s: 0.020,
            },
            1.05,
            250e-6,
        );
        let demand = speed.step(0.01 * 314.159_265, 0.0);
        assert!((demand.torque_nm - 0.0525).abs() < 1e-5, "{demand:?}");
    }
}
