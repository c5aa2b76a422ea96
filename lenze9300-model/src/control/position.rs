use crate::units::RAD_PER_INC;

/// Position controller: proportional, with the speed of the set-value fed forward.
///
/// Called once a millisecond, with the function blocks. C0254 gives its gain.
#[doc(alias = "Lageregler")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionController {
    k_v_per_s: f64,
    omega_max_rad_s: f64,
}

impl PositionController {
    /// From the velocity gain k_v in 1/s and the limit of the speed set-value in rad/s.
    #[must_use]
    pub fn new(k_v_per_s: f64, omega_max_rad_s: f64) -> Self {
        Self {
            k_v_per_s,
            omega_max_rad_s,
        }
    }

    /// Speed set-value in rad/s at the motor shaft.
    ///
    /// `error_inc` is set-value minus measured position in increments; `omega_ff_rad_s` the speed of the set-value. The sum is
    /// limited to C0909, ±175 % of C0011. Source: 9300 facts 4.6.
    #[inline]
    #[must_use]
    pub fn compute_output(&self, error_inc: i64, omega_ff_rad_s: f64) -> f64 {
        let omega = omega_ff_rad_s + self.k_v_per_s * (error_inc as f64 * RAD_PER_INC);
        omega.clamp(-self.omega_max_rad_s, self.omega_max_rad_s)
    }

    /// Velocity gain k_v, 1/s.
    #[must_use]
    pub fn k_v(&self) -> f64 {
        self.k_v_per_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    #[test]
    fn a_turn_of_error_demands_kv_turns_a_second() {
        let controller = PositionController::new(50.0, 1e9);
        assert!((controller.compute_output(65_536, 0.0) - 50.0 * TAU).abs() < 1e-9);
        assert!((controller.compute_output(-65_536, 10.0) - (10.0 - 50.0 * TAU)).abs() < 1e-9);
    }

    #[test]
    fn the_speed_set_value_is_limited_to_175_percent() {
        // Source: 9300 facts 4.6, C0909 = ±175 % of C0011 = 5250 rpm.
        let limit = 1.75 * 3000.0 * TAU / 60.0;
        let controller = PositionController::new(50.0, limit);
        assert_eq!(controller.compute_output(i64::from(i32::MAX), 0.0), limit);
        assert_eq!(controller.compute_output(i64::from(i32::MIN), 0.0), -limit);
    }
}
