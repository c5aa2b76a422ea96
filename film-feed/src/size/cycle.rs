//! Speed, torque, current and power of the motor over one machine cycle.

use std::f64::consts::TAU;

use serde::Serialize;

use crate::catalogue::Motor;
use crate::machine_file::MachineFile;

/// A piece of the cycle in which speed and torque change evenly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Phase {
    /// What happens in it.
    pub name: &'static str,
    /// How long it takes, s.
    pub duration_s: f64,
    /// Motor speed at its begin and end, 1/min.
    pub rpm: [f64; 2],
    /// Torque at the motor's shaft at its begin and end, Nm; negative when the motor brakes.
    pub torque_nm: [f64; 2],
}

impl Phase {
    /// Speed and torque at a share of the phase, 0…1.
    pub fn at(&self, share: f64) -> Point {
        let between = |[from, to]: [f64; 2]| from + share * (to - from);
        Point {
            rpm: between(self.rpm),
            torque_nm: between(self.torque_nm),
        }
    }
}

/// An operating point of the motor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[doc(alias = "Arbeitspunkt")]
pub struct Point {
    /// Speed, 1/min.
    pub rpm: f64,
    /// Torque at the shaft, Nm.
    pub torque_nm: f64,
}

impl Point {
    /// Power at the shaft, W; negative when the motor brakes.
    pub fn shaft_w(&self) -> f64 {
        self.torque_nm * self.rpm * TAU / 60.0
    }

    /// Power that the motor takes from the DC link, W; negative when it gives. Iron and inverter are left out, which is on the safe side
    /// for the brake resistor.
    pub fn electrical_w(&self, motor: &Motor) -> f64 {
        self.shaft_w() + motor.copper_loss_w(self.torque_nm)
    }
}

/// The load of the motor over one cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[doc(alias = "Lastspiel")]
pub struct LoadCycle {
    /// In their order.
    pub phases: Vec<Phase>,
}

impl LoadCycle {
    /// The cycle of a machine.
    ///
    /// Torque at the shaft while the film moves: `(J_rotor + J_gear)·α + M_friction + k·ω + (J_load/i²·α + M_pull)/η`; where the load drives
    /// the motor, times η. At rest the motor holds the pull of the film without help of the friction.
    pub fn of(machine: &MachineFile) -> Self {
        let mechanics = &machine.mechanics;
        let ratio = mechanics.gear_ratio();
        let j_motor = machine.motor.rotor_inertia_kg_m2 + mechanics.gear_inertia_kg_m2;
        let j_load = mechanics.load_inertia_kg_m2 / (ratio * ratio);
        let rad_per_mm = TAU * ratio / mechanics.feed_constant_mm();
        let phases = machine
            .profile()
            .iter()
            .map(|segment| {
                // A pull that is small lets more energy come back, one that is large takes more to move.
                let accel_mm_s2 = (segment.to_mm_s - segment.from_mm_s) / segment.duration_s;
                let (least_n, most_n) = machine.pull_n(accel_mm_s2);
                let pull_nm = machine.torque_of_pull_nm(if accel_mm_s2 < 0.0 { least_n } else { most_n });
                let alpha = accel_mm_s2 * rad_per_mm;
                let behind_gear = j_load * alpha + pull_nm;
                let through_gear = if behind_gear >= 0.0 {
                    behind_gear / mechanics.gear_efficiency
                } else {
                    behind_gear * mechanics.gear_efficiency
                };
                let moves = segment.from_mm_s.max(segment.to_mm_s) > 0.0;
                let torque_nm = |speed_mm_s: f64| {
                    let friction = mechanics.friction_nm + mechanics.viscous_nm_s * speed_mm_s * rad_per_mm;
                    if moves {
                        j_motor * alpha + friction + through_gear
                    } else {
                        pull_nm
                    }
                };
                Phase {
                    name: segment.name,
                    duration_s: segment.duration_s,
                    rpm: [
                        mechanics.motor_rpm(segment.from_mm_s),
                        mechanics.motor_rpm(segment.to_mm_s),
                    ],
                    torque_nm: [torque_nm(segment.from_mm_s), torque_nm(segment.to_mm_s)],
                }
            })
            .collect();
        Self { phases }
    }

    /// Duration of the cycle, s.
    pub fn duration_s(&self) -> f64 {
        self.phases.iter().map(|phase| phase.duration_s).sum()
    }

    /// Integral of a figure over the cycle: Simpson's rule, exact for what grows with the cube of the time in a phase.
    pub fn integral(&self, figure: impl Fn(Point) -> f64) -> f64 {
        self.phases
            .iter()
            .map(|phase| {
                let sum: f64 = (0..STEPS)
                    .map(|step| {
                        let at = |half: u32| figure(phase.at(f64::from(2 * step + half) / f64::from(2 * STEPS)));
                        at(0) + 4.0 * at(1) + at(2)
                    })
                    .sum();
                sum * phase.duration_s / f64::from(6 * STEPS)
            })
            .sum()
    }

    /// Mean of a figure over the cycle.
    pub fn mean(&self, figure: impl Fn(Point) -> f64) -> f64 {
        self.integral(figure) / self.duration_s()
    }

    /// Root of the mean square of a figure over the cycle.
    #[doc(alias = "Effektivwert")]
    pub fn rms(&self, figure: impl Fn(Point) -> f64) -> f64 {
        self.mean(|point| figure(point).powi(2)).sqrt()
    }

    /// Greatest value of a figure at the corners of the phases and at points between them.
    pub fn peak(&self, figure: impl Fn(Point) -> f64) -> f64 {
        let steps = 0..=STEPS;
        let points = self.phases.iter().flat_map(|phase| {
            let steps = steps.clone();
            steps.map(move |step| phase.at(f64::from(step) / f64::from(STEPS)))
        });
        points.map(figure).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Largest energy that piles up when `into_store_w` flows into a store that cannot give back less than nothing, J: over two cycles, so
    /// that what spans their border counts.
    pub fn piled_up_j(&self, into_store_w: impl Fn(Point) -> f64) -> f64 {
        let (mut stored, mut most) = (0.0_f64, 0.0_f64);
        for phase in self.phases.iter().chain(&self.phases) {
            for step in 0..PILE_STEPS {
                let middle = phase.at((f64::from(step) + 0.5) / f64::from(PILE_STEPS));
                stored = (stored + into_store_w(middle) * phase.duration_s / f64::from(PILE_STEPS)).max(0.0);
                most = most.max(stored);
            }
        }
        most
    }
}

/// Pieces of a phase for an integral.
const STEPS: u32 = 64;
/// Pieces of a phase for a sum that stops at zero somewhere within it.
const PILE_STEPS: u32 = 1000;
