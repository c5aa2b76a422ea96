use core::f64::consts::SQRT_2;

use super::{
    current_loop_time_s, magnitude_optimum, position_gain, sampled_t_sigma_s, speed_loop_time_s, symmetrical_optimum,
};
use crate::control::PiGains;
use crate::{AxisParams, ControllerCodes};

/// Gains of all three loops of an axis, each tuned on the one inside it.
///
/// ```text
/// T_Σ  = 1.5 T                        power stage of a loop sampled with T
/// T_I  = 4 T_Σ                        current loop, thesis' reading
/// T_I' = T_I + delay of the speed     what the speed controller sees
/// T_n  = 3 T_I'                       speed loop, thesis' reading
/// ```
///
/// DEVIATION: the thesis tunes the speed controller on the current loop alone. Here the delays that a speed
/// controller of its own period adds are counted too: half a period of hold, and the lag 2ζ/ω of the converter that
/// reads the speed. Without them the phase margin of the speed loop falls from 44° to 29°.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cascade {
    /// Current controller, V/A and s (formulas I and II).
    pub current: PiGains,
    /// Speed controller, Nm·s/rad and s (formulas III and IV).
    pub speed: PiGains,
    /// Position controller, 1/s (formula V).
    pub k_v_per_s: f64,
}

impl Cascade {
    /// Gains for the motor, the inertia, the tick and the converter of an axis; its codes do not matter.
    #[must_use]
    pub fn of_axis(params: &AxisParams) -> Self {
        let motor = &params.motor;
        let t_sigma_s = sampled_t_sigma_s(params.tick_s());
        let t_i_s = current_loop_time_s(t_sigma_s) + Self::speed_delay_s(params);
        Self {
            current: magnitude_optimum(1.0 / motor.r_s, motor.l_q / motor.r_s, t_sigma_s),
            speed: symmetrical_optimum(params.mechanics.j_total_kg_m2(), t_i_s),
            k_v_per_s: position_gain(1.0, speed_loop_time_s(t_i_s)),
        }
    }

    /// The codes that come nearest to these gains: cut to the range and rounded to the step of each code.
    ///
    /// C0070 refers to the torque at C0022 and to C0011, which are taken from the axis. Ranges and steps: 9300 facts
    /// 4.4.
    #[must_use]
    pub fn to_codes(&self, params: &AxisParams) -> ControllerCodes {
        let volts_per_ampere = params.scaling.nominal_link_v / (SQRT_2 * params.scaling.device_i_max_a);
        let torque_per_speed = params.torque_max_nm() / params.codes.c0011_n_max.to_rad_s();
        ControllerCodes {
            c0070_speed_gain: on_grid(self.speed.k_p / torque_per_speed, 0.5, 0.0, 255.0),
            c0071_speed_tn_s: on_grid(self.speed.t_n_s * 1000.0, 0.5, 1.0, 512.0) / 1000.0,
            c0075_current_gain: on_grid(self.current.k_p / volts_per_ampere, 0.01, 0.0, 15.99),
            c0076_current_tn_s: on_grid(self.current.t_n_s * 1000.0, 0.1, 0.5, 1999.9) / 1000.0,
            c0254_position_gain: on_grid(self.k_v_per_s / params.scaling.k_v_per_c0254, 0.0001, 0.0, 3.9999),
            ..params.codes
        }
    }

    /// Half a period of hold and the lag of the converter, s.
    fn speed_delay_s(params: &AxisParams) -> f64 {
        let hold_s = 0.5 * params.ticks_per_speed_period() as f64 * params.tick_s();
        let omega = core::f64::consts::TAU * params.feedback.tracking_hz;
        hold_s + 2.0 * params.feedback.tracking_damping / omega
    }
}

fn on_grid(value: f64, step: f64, min: f64, max: f64) -> f64 {
    if value.is_nan() {
        return min;
    }
    ((value / step).round() * step).clamp(min, max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motor_of_the_thesis_gets_the_current_codes_of_the_thesis() {
        // Source: design, section 6: 81.3 V/A over 106.67 V/A is 0.76; L/R = 1.54 ms. The thesis has 0.75 and 1.5 ms.
        let params = AxisParams::default();
        let codes = Cascade::of_axis(&params).to_codes(&params);
        assert!((codes.c0075_current_gain - 0.76).abs() < 1e-12, "{codes:?}");
        assert!((codes.c0076_current_tn_s - 1.5e-3).abs() < 1e-12, "{codes:?}");
    }

    #[test]
    fn twice_the_inertia_asks_for_twice_the_speed_gain_and_the_same_times() {
        // Formula III is proportional to J, formulas IV and V do not know it.
        let params = AxisParams::default();
        let mut heavy = params;
        heavy.mechanics.j_load_kg_m2 += params.mechanics.j_total_kg_m2();
        let (light, heavy) = (Cascade::of_axis(&params), Cascade::of_axis(&heavy));
        assert!((heavy.speed.k_p / light.speed.k_p - 2.0).abs() < 1e-12);
        assert_eq!(heavy.speed.t_n_s, light.speed.t_n_s);
        assert_eq!(heavy.k_v_per_s, light.k_v_per_s);
    }

    #[test]
    fn codes_stay_inside_their_ranges_however_odd_the_axis() {
        // Source: 9300 facts 4.4.
        let mut params = AxisParams::default();
        params.mechanics.j_load_kg_m2 = 1.0;
        let codes = Cascade::of_axis(&params).to_codes(&params);
        assert_eq!(codes.c0070_speed_gain, 255.0);
        params.codes.c0022_i_max_a = 0.0;
        params.mechanics.j_load_kg_m2 = f64::NAN;
        let codes = Cascade::of_axis(&params).to_codes(&params);
        assert_eq!(codes.c0070_speed_gain, 0.0);
    }
}
