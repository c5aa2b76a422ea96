use super::{PiController, PiGains};
use crate::plant::{Dq, PmsmParams};

/// Whether the current controller feeds the speed-dependent voltages forward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decoupling {
    /// −ω_el L_q i_q, ω_el L_d i_d and the back EMF are added to the output.
    On,
    /// The PI controllers remove them as a slow disturbance, as the thesis describes (ch. 5.3).
    Off,
}

/// Current controller: one PI for each axis of the rotor-fixed frame.
///
/// Called every tick. C0075 and C0076 give both its gains; the d current is led to zero, the q current makes the torque.
#[doc(alias = "Stromregler")]
#[derive(Debug, Clone)]
pub struct CurrentController {
    pub(crate) d: PiController,
    pub(crate) q: PiController,
    pub(crate) decoupling: Decoupling,
    l_d: f64,
    l_q: f64,
    psi_f: f64,
    n_p: f64,
}

/// Demand of the current controller, to be handed back to [`CurrentController::update`].
#[derive(Debug, Clone, Copy)]
pub struct CurrentDemand {
    /// Demanded voltage, V.
    pub voltage: Dq,
    /// Current error, A.
    pub error: Dq,
}

impl CurrentController {
    /// A controller for a motor, called every `t_s` seconds.
    #[must_use]
    pub fn new(gains: PiGains, motor: &PmsmParams, decoupling: Decoupling, t_s: f64) -> Self {
        Self {
            d: PiController::new(gains, t_s),
            q: PiController::new(gains, t_s),
            decoupling,
            l_d: motor.l_d,
            l_q: motor.l_q,
            psi_f: motor.psi_f,
            n_p: motor.n_p as f64,
        }
    }

    /// Demanded voltage; changes nothing.
    #[inline]
    #[must_use]
    pub fn compute_output(&self, reference: Dq, measured: Dq, omega_mech_rad_s: f64) -> CurrentDemand {
        let error = reference - measured;
        let voltage = Dq::new(self.d.compute_output(error.d), self.q.compute_output(error.q))
            + self.feed_forward(measured, omega_mech_rad_s);
        CurrentDemand { voltage, error }
    }

    /// Moves the integrators on, knowing what the inverter makes of the demand.
    #[inline]
    pub fn update(&mut self, demand: &CurrentDemand, realised: Dq) {
        self.d.update(demand.error.d, demand.voltage.d, realised.d);
        self.q.update(demand.error.q, demand.voltage.q, realised.q);
    }

    /// Starts anew with no current at the given speed and returns the voltage that keeps it so: the back EMF.
    pub fn reset(&mut self, omega_mech_rad_s: f64) -> Dq {
        let back_emf = Dq::new(0.0, self.n_p * omega_mech_rad_s * self.psi_f);
        let fed_forward = self.feed_forward(Dq::ZERO, omega_mech_rad_s);
        self.d.reset(0.0);
        self.q.reset(back_emf.q - fed_forward.q);
        back_emf
    }

    /// Changes the gains of both axes.
    pub fn set_gains(&mut self, gains: PiGains) {
        self.d.set_gains(gains);
        self.q.set_gains(gains);
    }

    #[inline]
    fn feed_forward(&self, current: Dq, omega_mech_rad_s: f64) -> Dq {
        match self.decoupling {
            Decoupling::Off => Dq::ZERO,
            Decoupling::On => {
                let omega_el = self.n_p * omega_mech_rad_s;
                Dq::new(
                    -omega_el * self.l_q * current.q,
                    omega_el * (self.l_d * current.d + self.psi_f),
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAINS: PiGains = PiGains {
        k_p: 80.0,
        t_n_s: 1.5e-3,
    };

    #[test]
    fn a_start_at_speed_demands_the_back_emf_with_and_without_decoupling() {
        // E = ω_el ψ = 3 · 300 rad/s · 0.1222 Wb.
        for decoupling in [Decoupling::On, Decoupling::Off] {
            let mut controller = CurrentController::new(GAINS, &PmsmParams::MDSKS036_13, decoupling, 125e-6);
            let start = controller.reset(300.0);
            let demand = controller.compute_output(Dq::ZERO, Dq::ZERO, 300.0);
            assert!((start.q - 110.0).abs() < 0.1, "{start:?}");
            assert!((demand.voltage - start).magnitude() < 1e-9, "{demand:?}");
        }
    }

    #[test]
    fn decoupling_adds_the_voltages_of_the_stationary_motor_equation() {
        // ω_el = 900 1/s, i = (1, 2) A, L = 30.5 mH: −900·0.0305·2 = −54.9 V; 900·0.0305·1 + 900 ψ.
        let motor = PmsmParams::MDSKS036_13;
        let controller = CurrentController::new(GAINS, &motor, Decoupling::On, 125e-6);
        let current = Dq::new(1.0, 2.0);
        let demand = controller.compute_output(current, current, 300.0);
        assert!((demand.voltage.d + 54.9).abs() < 1e-9);
        assert!((demand.voltage.q - (27.45 + 900.0 * motor.psi_f)).abs() < 1e-9);
    }
}
