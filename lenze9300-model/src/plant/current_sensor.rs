use super::inverter::electrical_angle;
use super::inverter::phases::Phases;
use super::{Dq, ShaftAngle};
use crate::noise;

/// Measurement of the currents of phases U and V, from fidelity F2 on; W follows from both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurrentSensorParams {
    /// What the sensors show without current, A, phase U and V. It makes a ripple of torque at the electrical frequency. Assumed.
    pub offset_a: [f64; 2],
    /// Relative error of the gain, phase U and V. A difference makes a ripple at twice the electrical frequency. Assumed.
    pub gain_error: [f64; 2],
    /// Noise, evenly distributed over ± this value, A. Assumed.
    pub noise_a: f64,
    /// Step of the converter, A. Assumed: 12 bits for ±8 A.
    pub step_a: f64,
}

impl Default for CurrentSensorParams {
    fn default() -> Self {
        Self {
            offset_a: [0.008, -0.005],
            gain_error: [0.005, -0.005],
            noise_a: 0.004,
            step_a: 16.0 / 4096.0,
        }
    }
}

/// The sensors of one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurrentSensor {
    params: CurrentSensorParams,
    n_p: u32,
    seed: u64,
}

/// Channels of the noise, phase U and V.
const CHANNELS: [u64; 2] = [0x6375_7255, 0x6375_7256];

impl CurrentSensor {
    pub(crate) fn new(params: &CurrentSensorParams, n_p: u32, seed: u64) -> Self {
        Self {
            params: *params,
            n_p,
            seed,
        }
    }

    /// What the controllers see of a current at tick number `tick`.
    pub(crate) fn measure(&self, current: Dq, angle: ShaftAngle, tick: u64) -> Dq {
        let theta = electrical_angle(angle, self.n_p);
        let Phases([u, v, _]) = Phases::from_stator(current.turned_by(theta));
        let [u, v] = [(u, 0), (v, 1)].map(|(current, phase)| self.read(current, phase, tick));
        Phases([u, v, -u - v]).to_stator().turned_by(-theta)
    }

    fn read(&self, current: f64, phase: usize, tick: u64) -> f64 {
        let p = &self.params;
        let analogue = current * (1.0 + p.gain_error[phase])
            + p.offset_a[phase]
            + p.noise_a * noise::symmetric(self.seed, CHANNELS[phase], tick);
        if p.step_a > 0.0 {
            (analogue / p.step_a).round() * p.step_a
        } else {
            analogue
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: CurrentSensorParams = CurrentSensorParams {
        offset_a: [0.0; 2],
        gain_error: [0.0; 2],
        noise_a: 0.0,
        step_a: 0.0,
    };

    #[test]
    fn exact_sensors_show_the_current() {
        let sensor = CurrentSensor::new(&EXACT, 3, 1);
        let shown = sensor.measure(Dq::new(0.3, 1.2), ShaftAngle::new(12_345, 0.5), 7);
        assert!((shown - Dq::new(0.3, 1.2)).magnitude() < 1e-12);
    }

    #[test]
    fn an_offset_turns_backwards_in_the_frame_of_the_rotor_once_an_electrical_turn() {
        // Offsets a, b of U and V are a vector of length √(a² + (a + 2b)²/3) that stands still (Clarke with W = −U − V).
        let params = CurrentSensorParams {
            offset_a: [0.02, -0.01],
            ..EXACT
        };
        let sensor = CurrentSensor::new(&params, 3, 1);
        let length = (0.02_f64.powi(2) + (0.02_f64 - 0.02).powi(2) / 3.0).sqrt();
        let mut sum = Dq::ZERO;
        for step in 0..12 {
            // Twelve places of one electrical turn, a third of the shaft's.
            let shown = sensor.measure(Dq::ZERO, ShaftAngle::new(0, f64::from(step) * 65_536.0 / 36.0), 0);
            assert!((shown.magnitude() - length).abs() < 1e-9);
            sum = sum + shown;
        }
        assert!(sum.magnitude() < 1e-6, "{sum:?}");
    }

    #[test]
    fn a_difference_of_the_gains_ripples_at_twice_the_electrical_frequency() {
        let params = CurrentSensorParams {
            gain_error: [0.01, -0.01],
            ..EXACT
        };
        let sensor = CurrentSensor::new(&params, 3, 1);
        let q = |turns: f64| {
            sensor
                .measure(Dq::new(0.0, 1.0), ShaftAngle::new(0, turns * 65_536.0 / 3.0), 0)
                .q
        };
        for step in 0..8 {
            let turns = f64::from(step) / 16.0;
            assert!((q(turns) - q(turns + 0.5)).abs() < 1e-9);
        }
        let values: Vec<f64> = (0..64).map(|k| q(f64::from(k) / 64.0)).collect();
        let span = values.iter().copied().fold(f64::MIN, f64::max) - values.iter().copied().fold(f64::MAX, f64::min);
        assert!(span > 0.01 && span < 0.04, "{span}");
    }
}
