use nalgebra::SVector;

use super::elastic::Elastic;
use super::energy::TrainEnergy;
use super::pmsm::{MotorEquations, MotorInput, MotorState};
use super::solver::{rk4_step_with_integral, substeps};
use super::{
    Contact, Dq, Interval, MechanicsParams, OutputStage, PmsmParams, RotorFixed, ShaftAngle, ShaftSegment, Terminals,
};

/// Motor and mechanics, integrated together.
///
/// One RK4 step per tick (more if the parameters ask for it, see [`substeps`]). Only when the speed passes zero, or an elastic
/// coupling changes its flank, is the tick divided at that moment, so that friction can change its side or hold; a few times at
/// most.
#[derive(Debug, Clone)]
pub struct DriveTrain {
    pub(crate) equations: MotorEquations,
    pub(crate) inv_l: Dq,
    /// Of all that turns with the rotor.
    pub(crate) inv_j: f64,
    /// On the rotor's side of the coupling.
    pub(crate) coulomb_nm: f64,
    pub(crate) viscous_nm_s: f64,
    pub(crate) load_nm: f64,
    pub(super) dt_s: f64,
    pub(crate) substeps: u32,
    pub(super) step_share: f64,
    pub(crate) current: Dq,
    pub(crate) omega: f64,
    pub(crate) angle: ShaftAngle,
    pub(crate) contact: Contact,
    pub(crate) electrical_w: f64,
    /// The driven side, if it is not rigidly coupled.
    pub(super) elastic: Option<Box<Elastic>>,
    pub(super) counted: TrainEnergy,
}

/// Integrals over a piece of a tick: current along d and q in the frame of the voltage, A s; current squared, A² s; speed
/// squared, rad²/s.
pub(super) type Passed = SVector<f64, 4>;

impl DriveTrain {
    /// Standing still without current at angle zero. `omega_max_rad_s` is the speed up to which the solver keeps its accuracy.
    #[must_use]
    pub fn new(motor: &PmsmParams, mechanics: &MechanicsParams, omega_max_rad_s: f64, dt_s: f64) -> Self {
        let elastic = Elastic::new(mechanics).map(Box::new);
        let (j_motor, coulomb_nm) = match &elastic {
            Some(elastic) => (mechanics.j_rotor_kg_m2, mechanics.coulomb_nm - elastic.coulomb_nm()),
            None => (mechanics.j_total_kg_m2(), mechanics.coulomb_nm),
        };
        let electrical = motor.spectral_radius(j_motor, omega_max_rad_s);
        let mechanical = elastic.as_ref().map_or(0.0, |elastic| elastic.spectral_radius(j_motor));
        let substeps = substeps(dt_s, electrical.max(mechanical));
        Self {
            equations: MotorEquations::new(motor),
            inv_l: Dq::new(1.0 / motor.l_d, 1.0 / motor.l_q),
            inv_j: 1.0 / j_motor,
            coulomb_nm,
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
            elastic,
            counted: TrainEnergy::default(),
        }
    }

    /// Divides each step of the solver into so many.
    #[must_use]
    pub(crate) fn with_steps_divided_by(mut self, parts: u32) -> Self {
        self.substeps *= parts.max(1);
        self.step_share = 1.0 / f64::from(self.substeps);
        self
    }

    /// Torque of the load against the positive direction, Nm, from the next tick on; behind an elastic coupling, if there is one.
    pub fn set_load_torque(&mut self, load_nm: f64) {
        self.load_nm = load_nm;
    }

    /// Currents of the motor, A peak.
    #[must_use]
    pub fn current(&self) -> Dq {
        self.current
    }

    /// Speed of the rotor, rad/s.
    #[must_use]
    pub fn omega(&self) -> f64 {
        self.omega
    }

    /// Angle of the rotor since power-up.
    #[must_use]
    pub fn angle(&self) -> ShaftAngle {
        self.angle
    }

    /// Speed of what is driven, reduced to the motor, rad/s; that of the rotor with a rigid shaft.
    #[must_use]
    pub fn driven_omega(&self) -> f64 {
        self.elastic.as_ref().map_or(self.omega, |elastic| elastic.omega())
    }

    /// Angle of what is driven, reduced to the motor; that of the rotor with a rigid shaft.
    #[must_use]
    pub fn driven_angle(&self) -> ShaftAngle {
        self.elastic
            .as_ref()
            .map_or(self.angle, |elastic| elastic.angle(self.angle))
    }

    /// Angle of the rotor at a share of the last tick, `0.0..=1.0`, whose motion of the driven side was `driven`.
    #[must_use]
    pub fn rotor_angle_at(&self, driven: &ShaftSegment, share: f64) -> ShaftAngle {
        self.elastic
            .as_ref()
            .map_or(driven, |elastic| elastic.rotor_segment())
            .angle_at(share)
    }

    /// Torque in the air gap, Nm.
    #[must_use]
    pub fn torque(&self) -> f64 {
        self.equations.torque(self.current.d, self.current.q)
    }

    /// What the friction pair on the rotor's side does.
    #[must_use]
    pub fn contact(&self) -> Contact {
        self.contact
    }

    /// Mean power that the inverter took from the DC link in the last tick, W; negative when it gave.
    #[must_use]
    pub fn electrical_power_w(&self) -> f64 {
        self.electrical_w
    }

    /// Energy in the windings, J; what the link gets back when the pulses stop.
    #[must_use]
    pub fn winding_energy_j(&self) -> f64 {
        let Dq { d, q } = self.current;
        0.75 * (self.equations.l_d * d * d + self.equations.l_q * q * q)
    }

    /// Energy of the turning masses, J.
    #[must_use]
    pub fn kinetic_energy_j(&self) -> f64 {
        let driven_j = self.elastic.as_ref().map_or(0.0, |elastic| elastic.kinetic_energy_j());
        0.5 * self.omega * self.omega / self.inv_j + driven_j
    }

    /// Energy in the twist of the coupling, J.
    #[must_use]
    pub fn elastic_energy_j(&self) -> f64 {
        self.elastic.as_ref().map_or(0.0, |elastic| elastic.stored_energy_j())
    }

    /// Where its energy went since power-up.
    pub(crate) fn counted(&self) -> TrainEnergy {
        self.counted
    }

    /// Whether rotor and load are one mass.
    #[must_use]
    pub fn is_rigid(&self) -> bool {
        self.elastic.is_none()
    }

    /// Steps that the solver takes in a tick.
    #[must_use]
    pub fn substeps(&self) -> u32 {
        self.substeps
    }

    /// Turns the shaft at a given speed from now on: the initial state of a trial.
    pub fn set_omega(&mut self, omega_mech_rad_s: f64) {
        let before_j = self.kinetic_energy_j();
        self.omega = omega_mech_rad_s;
        self.contact = Contact::sliding_at(omega_mech_rad_s);
        if let Some(elastic) = &mut self.elastic {
            elastic.set_omega(omega_mech_rad_s);
        }
        self.counted.external_j += self.kinetic_energy_j() - before_j;
    }

    /// One tick under what the output stage does; returns the motion of the driven side.
    #[inline]
    pub fn advance(&mut self, stage: OutputStage) -> ShaftSegment {
        match stage {
            OutputStage::Active(voltage) => self.advance_through([Interval {
                terminals: RotorFixed(voltage),
                drop_v: Dq::ZERO,
                duration_s: self.dt_s,
            }]),
            OutputStage::Inhibited => self.coast(),
        }
    }

    /// One tick through intervals that fill it; returns the motion of the driven side.
    #[inline]
    pub fn advance_through<T: Terminals>(&mut self, intervals: impl IntoIterator<Item = Interval<T>>) -> ShaftSegment {
        if self.elastic.is_some() {
            return self.advance_elastic(self.inv_l, intervals);
        }
        self.advance_rigid(self.inv_l, intervals)
    }

    /// One tick at a speed that the shaft takes at once, F0. `inertia_nm` is the torque that its change would take in a real drive, Nm;
    /// the current is the one that this, friction and load need together.
    pub(crate) fn advance_at(&mut self, omega: f64, inertia_nm: f64) -> ShaftSegment {
        let start = self.angle;
        let travel_rad = omega * self.dt_s;
        let kinetic_j = 0.5 * (omega * omega - self.omega * self.omega) / self.inv_j;
        let contact = Contact::sliding_at(omega);
        let resisting_nm = contact.sign() * self.coulomb_nm + self.viscous_nm_s * omega;
        let torque_nm = inertia_nm + resisting_nm + self.load_nm;
        let field_j = self.winding_energy_j();
        let current = Dq::new(0.0, torque_nm / self.equations.torque_psi);
        self.current = current;
        let copper_j = 1.5 * self.equations.r_s * current.dot(current) * self.dt_s;
        let moved_j = (resisting_nm + self.load_nm) * travel_rad;
        let electrical_j = kinetic_j + moved_j + copper_j + self.winding_energy_j() - field_j;
        self.counted.copper_j += copper_j;
        self.counted.friction_j += resisting_nm * travel_rad;
        self.counted.load_j += self.load_nm * travel_rad;
        self.contact = contact;
        self.end_tick(current, omega, travel_rad, electrical_j);
        ShaftSegment {
            start,
            end: self.angle,
            omega_start: self.omega,
            omega_end: self.omega,
            dt_s: self.dt_s,
        }
    }

    /// One tick with an open output stage.
    fn coast(&mut self) -> ShaftSegment {
        self.current = Dq::ZERO;
        let open = [Interval {
            terminals: RotorFixed(Dq::ZERO),
            drop_v: Dq::ZERO,
            duration_s: self.dt_s,
        }];
        if self.elastic.is_some() {
            return self.advance_elastic(Dq::ZERO, open);
        }
        if self.contact == Contact::Stuck && Contact::at_rest(-self.load_nm, self.coulomb_nm) == Contact::Stuck {
            // Nothing flows, nothing moves: nothing to integrate.
            self.electrical_w = 0.0;
            return ShaftSegment {
                start: self.angle,
                end: self.angle,
                omega_start: 0.0,
                omega_end: 0.0,
                dt_s: self.dt_s,
            };
        }
        self.advance_rigid(Dq::ZERO, open)
    }

    #[inline]
    fn advance_rigid<T: Terminals>(
        &mut self,
        inv_l: Dq,
        intervals: impl IntoIterator<Item = Interval<T>>,
    ) -> ShaftSegment {
        let (start, omega_start) = (self.angle, self.omega);
        if self.contact == Contact::Stuck {
            self.contact = Contact::at_rest(self.torque() - self.load_nm, self.coulomb_nm);
        }
        let mut input = MotorInput {
            tau_against: 0.0,
            viscous: self.viscous_nm_s,
            inv_l,
            inv_j: self.inv_j,
        };
        let mut x = MotorState::new(self.current.d, self.current.q, self.omega, 0.0);
        let mut electrical_j = 0.0;
        for interval in intervals {
            let mut remaining_s = interval.duration_s;
            let mut passed = Passed::zeros();
            for _ in 0..MAX_PIECES {
                let (after, part, rest_s) = self.piece(&x, remaining_s, &mut input, &interval.terminals);
                self.counted.friction_j += self.contact_before(&input) * (after[3] - x[3]);
                x = after;
                passed += part;
                remaining_s = rest_s;
                if rest_s <= 0.0 {
                    break;
                }
            }
            if remaining_s > 0.0 {
                // Chattering about zero: what is left of the interval passes at rest.
                self.contact = Contact::Stuck;
                x[2] = 0.0;
                input.inv_j = 0.0;
                let (after, part) = self.integrate(&x, remaining_s, &input, &interval.terminals);
                x = after;
                passed += part;
            }
            electrical_j += self.count(&interval, &passed);
        }
        self.counted.load_j += self.load_nm * x[3];
        self.end_tick(Dq::new(x[0], x[1]), x[2], x[3], electrical_j);
        ShaftSegment {
            start,
            end: self.angle,
            omega_start,
            omega_end: self.omega,
            dt_s: self.dt_s,
        }
    }

    /// Takes over the state after a tick.
    #[inline]
    pub(super) fn end_tick(&mut self, current: Dq, omega: f64, travel_rad: f64, electrical_j: f64) {
        self.current = Dq::new(without_denormals(current.d), without_denormals(current.q));
        self.omega = without_denormals(omega);
        self.angle = self.angle.advanced_by_radians(travel_rad);
        self.electrical_w = electrical_j / self.dt_s;
        if electrical_j > 0.0 {
            self.counted.motoring_j += electrical_j;
        } else {
            self.counted.regenerated_j -= electrical_j;
        }
    }

    /// Counts the heat of an interval on the rotor's side; returns what the inverter took from the link, J.
    #[inline]
    pub(super) fn count<T: Terminals>(&mut self, interval: &Interval<T>, passed: &Passed) -> f64 {
        let charge = Dq::new(passed[0], passed[1]);
        let loss_j = 1.5 * interval.drop_v.dot(charge);
        self.counted.inverter_loss_j += loss_j;
        self.counted.copper_j += 1.5 * self.equations.r_s * passed[2];
        self.counted.friction_j += self.viscous_nm_s * passed[3];
        1.5 * interval.terminals.own_voltage().dot(charge) + loss_j
    }

    /// Torque with which dry friction held against the positive direction during a piece, Nm.
    #[inline]
    fn contact_before(&self, input: &MotorInput) -> f64 {
        input.tau_against - self.load_nm
    }

    /// Integrates until the end of the interval or until the speed passes zero; returns the state, what passed, and the time that
    /// is left.
    #[inline]
    fn piece(
        &mut self,
        x: &MotorState,
        duration_s: f64,
        input: &mut MotorInput,
        terminals: &impl Terminals,
    ) -> (MotorState, Passed, f64) {
        let sign = self.contact.sign();
        input.tau_against = self.load_nm + sign * self.coulomb_nm;
        input.inv_j = if self.contact == Contact::Stuck {
            0.0
        } else {
            self.inv_j
        };
        let (after, passed) = self.integrate(x, duration_s, input, terminals);
        // Stuck: sign and speed are zero, the product never negative.
        if after[2] * sign >= 0.0 {
            return (after, passed, 0.0);
        }
        self.stop_inside(x, &after, duration_s, input, terminals)
    }

    /// The speed has passed zero: goes back to that moment and decides what the contact does then.
    #[cold]
    fn stop_inside(
        &mut self,
        x: &MotorState,
        after: &MotorState,
        duration_s: f64,
        input: &MotorInput,
        terminals: &impl Terminals,
    ) -> (MotorState, Passed, f64) {
        // The speed is as good as linear within a tick. A stop at the very start (share 0) makes no step.
        let share = x[2] / (x[2] - after[2]);
        let until_s = if share > 0.0 { share * duration_s } else { 0.0 };
        let (mut stopped, passed) = if until_s > 0.0 {
            self.integrate(x, until_s, input, terminals)
        } else {
            (*x, Passed::zeros())
        };
        stopped[2] = 0.0;
        let drive_nm = self.equations.torque(stopped[0], stopped[1]) - self.load_nm;
        self.contact = Contact::at_rest(drive_nm, self.coulomb_nm);
        (stopped, passed, duration_s - until_s)
    }

    #[inline]
    fn integrate(
        &self,
        x: &MotorState,
        duration_s: f64,
        input: &MotorInput,
        terminals: &impl Terminals,
    ) -> (MotorState, Passed) {
        let h_s = duration_s * self.step_share;
        let step = |x: &MotorState| {
            rk4_step_with_integral(
                x,
                h_s,
                |x| self.equations.derivative(x, input, terminals),
                |x| passing(Dq::new(x[0], x[1]), x[2], x[3], terminals),
            )
        };
        let (mut x, mut passed) = step(x);
        for _ in 1..self.substeps {
            let (after, part) = step(&x);
            x = after;
            passed += part;
        }
        (x, passed)
    }
}

/// What [`Passed`] is the integral of.
#[inline]
pub(super) fn passing(current: Dq, omega: f64, theta_mech_rad: f64, terminals: &impl Terminals) -> Passed {
    let own = terminals.current_in_own_frame(current, theta_mech_rad);
    Passed::new(own.d, own.q, current.dot(current), omega * omega)
}

/// Zero for what is too small to matter (1e-18 of any unit here).
///
/// A decaying state would otherwise end in denormal numbers, which cost a hundred times as much to compute with.
#[inline]
pub(crate) fn without_denormals(value: f64) -> f64 {
    if value.abs() < 1e-18 { 0.0 } else { value }
}

/// Pieces into which stops may divide an interval.
const MAX_PIECES: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::{InverterParams, Switches, SwitchingPoint};
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
    fn the_ripple_of_switched_pulses_is_volt_seconds_over_the_inductance() {
        // A vector of ū along phase U is made of twice T_a/2 at 2/3 U_dc, T_a = T ū/(2/3 U_dc); while it lasts the current rises by
        // (2/3 U_dc − ū) T_a/2 / L beyond its mean slope: 38.4 mA for 19.8 V at 565.7 V and 30.5 mH.
        let ideal = InverterParams {
            dead_time_s: 0.0,
            drop_v: 0.0,
            drop_ohm: 0.0,
            ..InverterParams::default()
        };
        let switches = Switches::new(&ideal, 3, DT_S);
        let mut train = train(10.0);
        let mut rises = Vec::new();
        for _ in 0..200 {
            let at = SwitchingPoint {
                current: train.current(),
                angle: train.angle(),
                omega: 0.0,
                u_dc: 565.7,
            };
            rises.clear();
            for pulse in switches.pulses(Dq::new(19.8, 0.0), &at).into_iter().flatten() {
                let before = train.current().d;
                train.advance_through([pulse]);
                if pulse.terminals.voltage.d > 0.0 {
                    rises.push(train.current().d - before);
                }
            }
        }
        let active_s = DT_S * 19.8 / (2.0 / 3.0 * 565.7);
        let expected = (2.0 / 3.0 * 565.7 - 19.8) * active_s / 2.0 / 30.5e-3;
        assert_eq!(rises.len(), 2, "{rises:?}");
        for rise in rises {
            assert!((rise / expected - 1.0).abs() < 0.03, "{rise} {expected}");
        }
        // In the end the mean is U/R.
        assert!((train.current().d - 1.0).abs() < 0.03, "{}", train.current().d);
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
