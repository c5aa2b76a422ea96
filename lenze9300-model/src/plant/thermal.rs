//! How warm motor and heat sink get.
//!
//! Losses flow through thermal resistances into heat capacities; each capacity is a lag of first order, exact for losses that
//! are constant over a step:
//!
//! ```text
//! copper loss ─► winding ─ R_wh ─► housing ─ R_ha ─► surroundings        loss of the power stage ─► heat sink ─ R ─► surroundings
//! ```

use super::PmsmParams;

/// Motor and heat sink as heat capacities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalParams {
    /// Temperature around motor and drive, °C. Assumed.
    pub surroundings_c: f64,
    /// How much warmer than its surroundings the winding gets at the continuous current, K. Assumed (9300 facts 6).
    pub winding_rise_k: f64,
    /// Share of that rise that lies between winding and housing. Assumed.
    pub winding_share: f64,
    /// Continuous current of the motor, I_0, A rms. Source: film-feed specification, section 5.
    pub motor_i_0_a: f64,
    /// Time constant of the winding, s. Assumed (9300 facts 6).
    pub winding_tau_s: f64,
    /// Time constant of the housing, s. Assumed (9300 facts 6).
    pub housing_tau_s: f64,
    /// Loss of the drive at its rated current, W. Source: 9300 facts 4.10.
    pub drive_loss_w: f64,
    /// Share of it that is there without current. Assumed.
    pub drive_standby_share: f64,
    /// Rated current of the drive, A rms. Source: 9300 facts 4.10, 8 kHz.
    pub drive_i_n_a: f64,
    /// How much warmer than its surroundings the heat sink gets at the rated current, K. Assumed.
    pub heat_sink_rise_k: f64,
    /// Time constant of the heat sink, s. Assumed.
    pub heat_sink_tau_s: f64,
}

impl Default for ThermalParams {
    fn default() -> Self {
        Self {
            surroundings_c: 25.0,
            winding_rise_k: 100.0,
            winding_share: 0.4,
            motor_i_0_a: 0.90,
            winding_tau_s: 60.0,
            housing_tau_s: 1200.0,
            drive_loss_w: 110.0,
            drive_standby_share: 0.15,
            drive_i_n_a: 2.5,
            heat_sink_rise_k: 40.0,
            heat_sink_tau_s: 300.0,
        }
    }
}

/// Temperatures of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thermal {
    surroundings_c: f64,
    /// Winding over housing, K.
    winding_k: f64,
    /// Housing over surroundings, K.
    housing_k: f64,
    /// Heat sink over surroundings, K.
    heat_sink_k: f64,
    winding_k_per_w: f64,
    housing_k_per_w: f64,
    sink_standby_k: f64,
    sink_k_per_a: f64,
    winding_step: f64,
    housing_step: f64,
    sink_step: f64,
    copper_w_per_a2: f64,
}

impl Thermal {
    /// A cold axis whose temperatures are followed every `dt_s` seconds.
    pub fn new(params: &ThermalParams, motor: &PmsmParams, dt_s: f64) -> Self {
        let copper_w_per_a2 = 3.0 * motor.r_s;
        let full_loss_w = copper_w_per_a2 * params.motor_i_0_a * params.motor_i_0_a;
        let k_per_w = params.winding_rise_k / full_loss_w;
        let step = |tau_s: f64| -(-dt_s / tau_s).exp_m1();
        Self {
            surroundings_c: params.surroundings_c,
            winding_k: 0.0,
            housing_k: 0.0,
            heat_sink_k: 0.0,
            winding_k_per_w: k_per_w * params.winding_share,
            housing_k_per_w: k_per_w * (1.0 - params.winding_share),
            sink_standby_k: params.heat_sink_rise_k * params.drive_standby_share,
            sink_k_per_a: params.heat_sink_rise_k * (1.0 - params.drive_standby_share) / params.drive_i_n_a,
            winding_step: step(params.winding_tau_s),
            housing_step: step(params.housing_tau_s),
            sink_step: step(params.heat_sink_tau_s),
            copper_w_per_a2,
        }
    }

    /// A step with this current, A rms. The loss of the power stage grows with the current, that of the copper with its square.
    #[inline]
    pub fn advance(&mut self, current_a_rms: f64) {
        let copper_w = self.copper_w_per_a2 * current_a_rms * current_a_rms;
        let towards = |from: &mut f64, to: f64, step: f64| *from += step * (to - *from);
        towards(&mut self.winding_k, self.winding_k_per_w * copper_w, self.winding_step);
        towards(&mut self.housing_k, self.housing_k_per_w * copper_w, self.housing_step);
        let sink_k = self.sink_standby_k + self.sink_k_per_a * current_a_rms;
        towards(&mut self.heat_sink_k, sink_k, self.sink_step);
    }

    /// Temperature at the sensor of the motor, which lies in the winding, °C (C0063).
    #[doc(alias = "Motortemperatur")]
    pub fn motor_c(&self) -> f64 {
        self.surroundings_c + self.housing_k + self.winding_k
    }

    /// Temperature of the heat sink, °C (C0061).
    #[doc(alias = "Kühlkörpertemperatur")]
    pub fn heat_sink_c(&self) -> f64 {
        self.surroundings_c + self.heat_sink_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warmed(current_a: f64, seconds: u32) -> Thermal {
        let mut thermal = Thermal::new(&ThermalParams::default(), &PmsmParams::MDSKS036_13, 1.0);
        for _ in 0..seconds {
            thermal.advance(current_a);
        }
        thermal
    }

    #[test]
    fn the_continuous_current_warms_the_winding_by_100_kelvin_in_the_end() {
        // Assumption of 9300 facts 6; after 20 housing time constants nothing moves.
        let thermal = warmed(0.90, 24_000);
        assert!((thermal.motor_c() - 125.0).abs() < 1e-3, "{}", thermal.motor_c());
    }

    #[test]
    fn each_part_follows_its_time_constant() {
        // 1 − 1/e of 40 K after 60 s, and of the housing's 60 K what 60 s of 1200 s give: 1 − e^(−0.05).
        let thermal = warmed(0.90, 60);
        let expected = 25.0 + 40.0 * (1.0 - (-1.0_f64).exp()) + 60.0 * (1.0 - (-0.05_f64).exp());
        assert!((thermal.motor_c() - expected).abs() < 1e-9, "{}", thermal.motor_c());
    }

    #[test]
    fn the_step_does_not_change_the_course() {
        let mut fine = Thermal::new(&ThermalParams::default(), &PmsmParams::MDSKS036_13, 0.001);
        for _ in 0..10_000 {
            fine.advance(1.35);
        }
        assert!((fine.motor_c() - warmed(1.35, 10).motor_c()).abs() < 1e-9);
        assert!((fine.heat_sink_c() - warmed(1.35, 10).heat_sink_c()).abs() < 1e-9);
    }

    #[test]
    fn the_rated_current_warms_the_heat_sink_by_its_rise() {
        assert!((warmed(2.5, 6000).heat_sink_c() - 65.0).abs() < 1e-3);
        // Without current the standby loss alone: 15 % of 40 K.
        assert!((warmed(0.0, 6000).heat_sink_c() - 31.0).abs() < 1e-3);
    }
}
