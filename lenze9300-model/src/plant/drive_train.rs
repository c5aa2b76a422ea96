use super::pmsm::{MotorEquations, MotorInput, MotorState};
use super::solver::{rk4_step, substeps};
use super::{Contact, Dq, MechanicsParams, OutputStage, PmsmParams, ShaftAngle, ShaftSegment};

/// Motor and rigid mechanics, integrated together.
///
/// One RK4 step per tick (more if the parameters ask for it, see [`substeps`]). Only when the speed passes zero is the tick
/// divided at that moment, so that friction can change its side or hold; at most four times.
#[derive(Debug, Clone)]
pub struct DriveTrain {
    pub(crate) equations: MotorEquations,
    pub(crate) inv_l_d: f64,
    pub(crate) inv_l_q: f64,
    l_d: f64,
    l_q: f64,
    pub(crate) inv_j: f64,
    pub(crate) coulomb_nm: f64,
    pub(crate) viscous_nm_s: f64,
    pub(crate) load_nm: f64,
    dt_s: f64,
    pub(crate) substeps: u32,
    step_share: f64,
    pub(crate) current: Dq,
    pub(crate) omega: f64,
    pub(crate) angle: ShaftAngle,
    pub(crate) contact: Contact,
    pub(crate) electrical_w: f64,
}

impl DriveTrain {
    /// Standing still without current at angle zero. `omega_max_rad_s` is the speed up to which the solver keeps its accuracy.
    #[must_use]
    pub fn new(motor: &PmsmParams, mechanics: &MechanicsParams, omega_max_rad_s: f64, dt_s: f64) -> Self {
        let j_total = mechanics.j_total_kg_m2();
        let substeps = substeps(dt_s, motor.spectral_radius(j_total, omega_max_rad_s));
        Self {
            equations: MotorEquations::new(motor),
            inv_l_d: 1.0 / motor.l_d,
            inv_l_q: 1.0 / motor.l_q,
            l_d: motor.l_d,
            l_q: motor.l_q,
            inv_j: 1.0 / j_total,
            coulomb_nm: mechanics.coulomb_nm,
            viscous_nm_s: mechanics.viscous_nm_s,
            load_nm: 0.0,
            dt_s,
            substeps,
            step_share: 1.0 / f64::from(substeps),
            current: Dq::ZERO,
            omega: 0.0,
            angle: ShaftAngle::default(),
            contact: Contact::Stuck,
            electrical_w: 0.0,
        }
    }

    /// Torque of the load against the positive direction, Nm, from the next tick on.
    pub fn set_load_torque(&mut self, load_nm: f64) {
        self.load_nm = load_nm;
    }

    /// Currents of the motor, A peak.
    #[must_use]
    pub fn current(&self) -> Dq {
        self.current
    }

    /// Speed of the shaft, rad/s.
    #[must_use]
    pub fn omega(&self) -> f64 {
        self.omega
    }

    /// Angle of the shaft since power-up.
    #[must_use]
    pub fn angle(&self) -> ShaftAngle {
        self.angle
    }

    /// Torque in the air gap, Nm.
    #[must_use]
    pub fn torque(&self) -> f64 {
        self.equations.torque(self.current.d, self.current.q)
    }

    /// What the friction pair does.
    #[must_use]
    pub fn contact(&self) -> Contact {
        self.contact
    }

    /// Mean electrical power of the last tick, W; positive when the motor takes it.
    #[must_use]
    pub fn electrical_power_w(&self) -> f64 {
        self.electrical_w
    }

    /// Energy in the windings, J; what the link gets back when the pulses stop.
    #[must_use]
    pub fn winding_energy_j(&self) -> f64 {
        0.75 * (self.l_d * self.current.d * self.current.d + self.l_q * self.current.q * self.current.q)
    }

    /// Steps that the solver takes in a tick.
    #[must_use]
    pub fn substeps(&self) -> u32 {
        self.substeps
    }

    /// Turns the shaft at a given speed from now on: the initial state of a trial.
    pub fn set_omega(&mut self, omega_mech_rad_s: f64) {
        self.omega = omega_mech_rad_s;
        self.contact = if omega_mech_rad_s > 0.0 {
            Contact::Positive
        } else if omega_mech_rad_s < 0.0 {
            Contact::Negative
        } else {
            Contact::Stuck
        };
    }

    /// One tick under what the output stage does.
    #[inline]
    pub fn advance(&mut self, stage: OutputStage) -> ShaftSegment {
        let (voltage, inv_l_d, inv_l_q) = match stage {
            OutputStage::Active(voltage) => (voltage, self.inv_l_d, self.inv_l_q),
            OutputStage::Inhibited => {
                self.current = Dq::ZERO;
                (Dq::ZERO, 0.0, 0.0)
            }
        };
        let start = self.angle;
        let omega_start = self.omega;
        let current_start = self.current;
        if self.contact == Contact::Stuck {
            self.contact = Contact::at_rest(self.torque() - self.load_nm, self.coulomb_nm);
        }
        if self.contact == Contact::Stuck && stage == OutputStage::Inhibited {
            // Nothing flows, nothing moves: nothing to integrate.
            self.electrical_w = 0.0;
            return ShaftSegment {
                start,
                end: start,
                omega_start: 0.0,
                omega_end: 0.0,
                dt_s: self.dt_s,
            };
        }
        let mut input = MotorInput {
            voltage,
            tau_against: 0.0,
            viscous: self.viscous_nm_s,
            inv_l_d,
            inv_l_q,
            inv_j: self.inv_j,
        };
        let mut x = MotorState::new(self.current.d, self.current.q, self.omega, 0.0);
        let mut remaining_s = self.dt_s;
        for _ in 0..MAX_PIECES {
            let (after, rest_s) = self.piece(&x, remaining_s, &mut input);
            x = after;
            remaining_s = rest_s;
            if rest_s <= 0.0 {
                break;
            }
        }
        if remaining_s > 0.0 {
            // Chattering about zero: what is left of the tick passes at rest.
            self.contact = Contact::Stuck;
            x[2] = 0.0;
            input.inv_j = 0.0;
            x = self.integrate(&x, remaining_s, &input);
        }
        self.current = Dq::new(without_denormals(x[0]), without_denormals(x[1]));
        self.omega = without_denormals(x[2]);
        self.angle = start.advanced_by_radians(x[3]);
        self.electrical_w = 0.75 * voltage.dot(current_start + self.current);
        ShaftSegment {
            start,
            end: self.angle,
            omega_start,
            omega_end: self.omega,
            dt_s: self.dt_s,
        }
    }

    /// Integrates until the end of the tick or until the speed passes zero; returns the state and the time that is left.
    #[inline]
    fn piece(&mut self, x: &MotorState, duration_s: f64, input: &mut MotorInput) -> (MotorState, f64) {
        let sign = self.contact.sign();
        input.tau_against = self.load_nm + sign * self.coulomb_nm;
        input.inv_j = if self.contact == Contact::Stuck {
            0.0
        } else {
            self.inv_j
        };
        let after = self.integrate(x, duration_s, input);
        // Stuck: sign and speed are zero, the product never negative.
        if after[2] * sign >= 0.0 {
            return (after, 0.0);
        }
        self.stop_inside(x, &after, duration_s, input)
    }

    /// The speed has passed zero: goes back to that moment and decides what the contact does then.
    #[cold]
    fn stop_inside(
        &mut self,
        x: &MotorState,
        after: &MotorState,
        duration_s: f64,
        input: &MotorInput,
    ) -> (MotorState, f64) {
        // The speed is as good as linear within a tick. A stop at the very start (share 0) makes no step.
        let share = x[2] / (x[2] - after[2]);
        let until_s = if share > 0.0 { share * duration_s } else { 0.0 };
        let mut stopped = if until_s > 0.0 {
            self.integrate(x, until_s, input)
        } else {
            *x
        };
        stopped[2] = 0.0;
        let drive_nm = self.equations.torque(stopped[0], stopped[1]) - self.load_nm;
        self.contact = Contact::at_rest(drive_nm, self.coulomb_nm);
        (stopped, duration_s - until_s)
    }

    #[inline]
    fn integrate(&self, x: &MotorState, duration_s: f64, input: &MotorInput) -> MotorState {
        let h_s = duration_s * self.step_share;
        let mut x = *x;
        for _ in 0..self.substeps {
            x = rk4_step(&x, h_s, |x| self.equations.derivative(x, input));
        }
        x
    }
}

/// Zero for what is too small to matter (1e-18 of any unit here).
///
/// A decaying state would otherwise end in denormal numbers, which cost a hundred times as much to compute with.
#[inline]
pub(crate) fn without_denormals(value: f64) -> f64 {
    if value.abs() < 1e-18 { 0.0 } else { value }
}

/// Pieces into which stops may divide a tick.
const MAX_PIECES: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rpm;

    const DT_S: f64 = 125e-6;

    fn train(coulomb_nm: f64) -> DriveTrain {
        let mechanics = MechanicsParams {
            coulomb_nm,
            ..MechanicsParams::default()
        };
        DriveTrain::new(&PmsmParams::MDSKS036_13, &mechanics, Rpm(5500.0).to_rad_s(), DT_S)
    }

    #[test]
    fn a_locked_winding_follows_the_exponential_of_its_time_constant() {
        // i(t) = U/R (1 − exp(−t R/L)) with R, L from C0084, C0085; torque below friction, so the shaft stays.
        let mut train = train(10.0);
        for _ in 0..16 {
            train.advance(OutputStage::Active(Dq::new(0.0, 10.0)));
        }
        let expected = 10.0 / 19.8 * (1.0 - (-16.0 * DT_S * 19.8 / 30.5e-3_f64).exp());
        assert!(
            (train.current().q - expected).abs() < 2e-7,
            "{} {expected}",
            train.current().q
        );
        assert_eq!(train.contact(), Contact::Stuck);
        assert_eq!(train.angle(), ShaftAngle::default());
    }

    #[test]
    fn a_coasting_shaft_stops_where_friction_has_eaten_its_energy() {
        // J ω²/2 = M φ and t = J ω / M (Newton); J = 0.914e-4 kg m², M = 0.05 Nm.
        let mut train = train(0.05);
        let omega = Rpm(2814.5).to_rad_s();
        train.set_omega(omega);
        let mut ticks = 0_u32;
        while train.contact() != Contact::Stuck {
            train.advance(OutputStage::Inhibited);
            ticks += 1;
        }
        let stop_s = 0.914e-4 * omega / 0.05;
        assert_eq!(ticks, (stop_s / DT_S).ceil() as u32);
        let stop_rad = 0.5 * 0.914e-4 * omega * omega / 0.05;
        let travelled = train.angle().offset_from(ShaftAngle::default()) * crate::units::RAD_PER_INC;
        assert!((travelled - stop_rad).abs() < 1e-7 * stop_rad, "{travelled} {stop_rad}");
        assert_eq!(train.omega(), 0.0);
    }

    #[test]
    fn a_load_below_friction_moves_nothing_and_one_above_accelerates() {
        let mut train = train(0.05);
        train.set_load_torque(0.0499);
        for _ in 0..1000 {
            train.advance(OutputStage::Inhibited);
        }
        assert_eq!((train.omega(), train.angle()), (0.0, ShaftAngle::default()));
        train.set_load_torque(0.06);
        for _ in 0..800 {
            train.advance(OutputStage::Inhibited);
        }
        // a = −(0.06 − 0.05)/J over 0.1 s.
        let expected = -0.01 / 0.914e-4 * 0.1;
        assert!(
            (train.omega() - expected).abs() < 1e-9 * expected.abs(),
            "{}",
            train.omega()
        );
    }

    #[test]
    fn a_load_above_friction_turns_the_shaft_back_through_standstill() {
        // Decelerates with (0.15 + 0.05)/J, then accelerates backwards with (0.15 − 0.05)/J.
        let mut train = train(0.05);
        train.set_omega(10.0);
        train.set_load_torque(0.15);
        let stop_s = 0.914e-4 * 10.0 / 0.2;
        for _ in 0..80 {
            train.advance(OutputStage::Inhibited);
        }
        let expected = -(80.0 * DT_S - stop_s) * 0.1 / 0.914e-4;
        assert!(
            (train.omega() - expected).abs() < 1e-6 * expected.abs(),
            "{} {expected}",
            train.omega()
        );
        assert_eq!(train.contact(), Contact::Negative);
    }

    #[test]
    fn energy_is_conserved_without_friction_and_resistance() {
        // A lossless motor turns all its electrical energy into motion and field.
        let motor = PmsmParams {
            r_s: 0.0,
            ..PmsmParams::MDSKS036_13
        };
        let mechanics = MechanicsParams {
            coulomb_nm: 0.0,
            ..MechanicsParams::default()
        };
        let mut train = DriveTrain::new(&motor, &mechanics, Rpm(5500.0).to_rad_s(), DT_S / 16.0);
        let mut taken_j = 0.0;
        for _ in 0..1600 {
            train.advance(OutputStage::Active(Dq::new(0.0, 40.0)));
            taken_j += train.electrical_power_w() * DT_S / 16.0;
        }
        let stored_j = 0.5 * 0.914e-4 * train.omega() * train.omega() + train.winding_energy_j();
        assert!((taken_j - stored_j).abs() < 1e-4 * stored_j, "{taken_j} {stored_j}");
    }

    #[test]
    fn the_thesis_axis_takes_one_step_a_tick_and_the_bare_rotor_too() {
        assert_eq!(train(0.05).substeps(), 1);
        let bare = MechanicsParams {
            j_load_kg_m2: 0.0,
            ..MechanicsParams::default()
        };
        let train = DriveTrain::new(&PmsmParams::MDSKS036_13, &bare, Rpm(5500.0).to_rad_s(), DT_S);
        assert_eq!(train.substeps(), 1);
    }
}
