//! The chain in virtual time that a MACHINE.toml describes.

use lenze9300_model::code::table::number::{C0022, C0173, C0596, C1240, C1250};
use lenze9300_model::device::DriveConfig;
use lenze9300_model::plant::{
    BrakeModule, Coupling, DcLinkParams, FeedbackParams, LinkThresholds, MechanicsParams, ResolverErrors, ThermalParams,
};
use lenze9300_model::traverse::TraverseParameters;
use lenze9300_model::units::Rpm;
use lenze9300_model::{AxisParams, ControllerCodes, GainScaling};
use thiserror::Error;

use super::MachineFile;
use crate::machine::{FilmConfig, MarkConfig, ReaderParams, Roller};
use crate::operator::FeedPlan;
use crate::rig::RigConfig;

/// Why a machine cannot be run although it can be sized.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum NotRunnable {
    /// The drive is larger than the one that is modelled.
    #[error(
        "the current limit of {wanted_a} A is above {modelled_a} A, the range of C0022 of the modelled drive; set C0022 in [codes] to run the machine with less"
    )]
    CurrentLimit {
        /// What the machine's drive would be set to, A rms.
        wanted_a: f64,
        /// What C0022 can be set to, A rms.
        modelled_a: f64,
    },
}

impl MachineFile {
    /// Velocity as a share of C1240 in 0.01 %, as the block takes it.
    pub fn hundredth_percent_of_v_max(&self, speed_mm_s: f64) -> i16 {
        (speed_mm_s / self.codes.number(C1240, 0) * 10_000.0).round() as i16
    }

    /// The feeds of this machine: `feeds` of its kind, one every `feed.cycle_s`.
    ///
    /// Velocities and acceleration are rounded to 0.01 % of C1240 and C1250, the length to 0.1 mm, the steps of the block's inputs. The pause
    /// between feeds is what the cycle leaves beside the motion; PLC and bus add some 15 ms to each feed.
    pub fn feed_plan(&self, feeds: usize) -> FeedPlan {
        let pause_s = (self.feed.cycle_s - self.motion_s()).max(SHORTEST_PAUSE_S);
        FeedPlan {
            series: vec![(self.feed.mode, feeds)],
            length_tenth_mm: (self.feed.length_mm * 10.0).round() as i16,
            speed_hundredth_percent: self.hundredth_percent_of_v_max(self.feed.speed_mm_s),
            mark_speed_hundredth_percent: self.hundredth_percent_of_v_max(self.feed.mark_speed_mm_s),
            accel_hundredth_percent: (self.feed.acceleration_mm_s2 / self.codes.number(C1250, 0) * 10_000.0).round()
                as i16,
            pause_ns: (pause_s * 1e9) as u64,
            ..FeedPlan::default()
        }
    }

    /// The whole chain, with `seed` for everything random.
    ///
    /// Play of the gear is taken over when its stiffness is given. Not taken over, because the chain knows it otherwise or not at all: the
    /// gear's efficiency and error, the change of the film's pull. The film stretches when the roll it comes from is given.
    ///
    /// # Errors
    /// [`NotRunnable`] when the modelled drive cannot be set up so.
    pub fn rig_config(&self, seed: u64) -> Result<RigConfig, NotRunnable> {
        let modelled_a = self.codes.number(C0022, 0);
        if self.current_limit_a > modelled_a + 0.005 {
            return Err(NotRunnable::CurrentLimit {
                wanted_a: self.current_limit_a,
                modelled_a,
            });
        }
        Ok(RigConfig {
            baud: self.controls.baud,
            plc_cycle_ns: (self.controls.plc_cycle_ms * 1e6).round() as u64,
            dp_cycle_ns: (self.controls.dp_cycle_ms * 1e6).round() as u64,
            seed,
            slave_address: self.controls.address,
            // The tension of an elastic film comes on top, as the film makes it.
            load_torque_nm: self.torque_of_pull_nm(self.film.pull_n),
            drive: DriveConfig {
                axis: self.axis_params(seed),
                codes: self.codes.clone(),
                traverse: TraverseParameters {
                    target_window_e4: (self.positioning.target_window_mm * 1e4).round() as i32,
                    rounding: self.positioning.rounding,
                    ..TraverseParameters::default()
                },
                thermal: self.thermal_params(),
                touch_input: self.positioning.latch,
                feed_forward_inertia_kg_m2: self.positioning.feed_forward_inertia_kg_m2,
                ..DriveConfig::default()
            },
            film: FilmConfig {
                roller: Roller {
                    diameter_mm: self.mechanics.roller_diameter_mm,
                    gear_ratio: self.mechanics.gear_ratio(),
                },
                marks: MarkConfig {
                    repeat_mm: self.marks.repeat_mm,
                    tolerance_mm: self.marks.tolerance_mm,
                    width_mm: self.marks.width_mm,
                    seed,
                    ..MarkConfig::default()
                },
                web: self.web_params(),
            },
            reader: ReaderParams {
                delay_us: self.marks.reader_delay_us,
                jitter_us: self.marks.reader_jitter_us,
                seed,
                ..ReaderParams::default()
            },
            ..RigConfig::default()
        })
    }

    /// Motor, mechanics, DC link and controllers of the drive model, with `seed` for the noise of its measurements.
    pub fn axis_params(&self, seed: u64) -> AxisParams {
        let thresholds = LinkThresholds::from_c0173(self.codes.number(C0173, 0) as u8);
        AxisParams {
            motor: self.motor.pmsm(),
            mechanics: MechanicsParams {
                j_rotor_kg_m2: self.motor.rotor_inertia_kg_m2,
                j_load_kg_m2: self.mechanics.reduced_inertia_kg_m2(),
                coulomb_nm: self.mechanics.friction_nm,
                viscous_nm_s: self.mechanics.viscous_nm_s,
                coupling: self.coupling(),
            },
            dc_link: DcLinkParams {
                mains_v_rms: self.mains.voltage_v,
                capacitance_f: self.drive.link_capacitance_uf * 1e-6,
                standby_w: self.drive.standby_w,
                thresholds: thresholds.unwrap_or(LinkThresholds::MAINS_400_V),
                brake: self.brake.map(|brake| BrakeModule {
                    resistance_ohm: brake.resistance_ohm,
                    on_v: brake.on_v,
                    off_v: brake.off_v,
                }),
                ..DcLinkParams::default()
            },
            feedback: FeedbackParams {
                resolver_bits: self.positioning.resolver_bits,
                errors: self.resolver_errors(),
                ..FeedbackParams::default()
            },
            codes: ControllerCodes::from_store(&self.codes),
            scaling: GainScaling {
                device_i_max_a: self.drive.peak_current_a,
                ..GainScaling::default()
            },
            noise_seed: seed,
            n_plant_max: Rpm(self.codes.number(C0596, 0)),
            ..AxisParams::default()
        }
    }

    /// The model's errors of the resolver, with this accuracy.
    fn resolver_errors(&self) -> ResolverErrors {
        let default = ResolverErrors::default();
        let share = self.positioning.resolver_accuracy_arcmin / (default.once_arcmin + default.twice_arcmin);
        ResolverErrors {
            once_arcmin: default.once_arcmin * share,
            twice_arcmin: default.twice_arcmin * share,
            ..default
        }
    }

    /// What lies between motor and load: nothing but a rigid shaft, unless the gear's stiffness is given.
    fn coupling(&self) -> Option<Coupling> {
        let mechanics = &self.mechanics;
        let stiffness = mechanics.gear_stiffness_nm_per_rad?;
        let coupling = Coupling::at_gear_output(stiffness, mechanics.gear_backlash_arcmin, mechanics.gear_ratio());
        // The damping is meant as a share of the critical one; these are the inertias that make it critical here.
        let (rotor, load) = (self.motor.rotor_inertia_kg_m2, mechanics.reduced_inertia_kg_m2());
        let reduced = rotor * load / (rotor + load);
        let damping_nm_s = 2.0 * Coupling::DAMPING_RATIO * (coupling.stiffness_nm_per_rad * reduced).sqrt();
        Some(Coupling {
            damping_nm_s,
            ..coupling
        })
    }

    /// How motor and heat sink warm up.
    pub fn thermal_params(&self) -> ThermalParams {
        ThermalParams {
            surroundings_c: self.ambient_c,
            winding_rise_k: self.motor.winding_rise_k,
            motor_i_0_a: self.motor.standstill_current_a,
            winding_tau_s: self.motor.winding_tau_s,
            housing_tau_s: self.motor.housing_tau_s,
            drive_loss_w: self.drive.loss_w,
            drive_i_n_a: self.drive.rated_current_a,
            heat_sink_rise_k: self.drive.heat_sink_rise_k,
            heat_sink_tau_s: self.drive.heat_sink_tau_s,
            ..ThermalParams::default()
        }
    }
}

/// Shorter the operator cannot be: the film has to come to rest and the PLC to see it.
const SHORTEST_PAUSE_S: f64 = 0.02;
