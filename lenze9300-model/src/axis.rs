//! One axis: plant and sampled loops, advanced tick by tick.

mod batch;

use core::f64::consts::SQRT_2;

use crate::code::CodeStore;
use crate::code::table::number::{C0011, C0022, C0070, C0071, C0072, C0075, C0076, C0254, C0497};
use crate::control::{
    CurrentController, Decoupling, PiGains, PositionController, SpeedController, SpeedGains, SpeedInput, VoltageReserve,
};
use crate::plant::{
    CurrentSensor, CurrentSensorParams, DcLink, DcLinkParams, Dq, DriveTrain, EnergyBalance, Feedback, FeedbackParams,
    Fidelity, InverterParams, LinkState, LinkThresholds, Mains, MechanicsParams, OutputStage, PmsmParams, ShaftAngle,
    ShaftSegment, Switches, SwitchingPoint, limit_to_voltage_circle, without_denormals,
};
use crate::units::{Percent, Rpm};

pub use batch::{AxisBatch, BatchError};

/// Length of a tick as delivered, ns: one period of the current controller at a chopping frequency of 8 kHz (C0018 =
/// 1).
pub const TICK_NS: u64 = 125_000;

/// Ticks of [`TICK_NS`] in a period of the speed controller.
pub const TICKS_PER_SPEED_PERIOD: u64 = SPEED_PERIOD_NS / TICK_NS;

/// Ticks of [`TICK_NS`] in a millisecond, the period of the function blocks.
pub const TICKS_PER_MS: u64 = POSITION_PERIOD_NS / TICK_NS;

/// Period of the speed controller, ns. Source: 9300 facts 4.6 (assumed there).
const SPEED_PERIOD_NS: u64 = 250_000;

/// Period of position controller and function blocks, ns. Source: 9300 facts 4.6.
const POSITION_PERIOD_NS: u64 = 1_000_000;

/// Codes of the drive that set its controllers.
///
/// Values as in the code table, converted to floats and SI times. Source: film-feed specification, section 5; design,
/// section 6.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerCodes {
    /// C0011, n_max: reference of all speeds, rpm, 500…16000.
    pub c0011_n_max: Rpm,
    /// C0022, I_max: current limit, A rms, 0…3.75; also the reference of C0070.
    pub c0022_i_max_a: f64,
    /// C0070, speed controller Vp, 0…255: percent of the torque at C0022 for one percent of C0011.
    pub c0070_speed_gain: f64,
    /// C0071, speed controller Tn, s, 0.001…0.600; above 0.512 the integral part is off.
    pub c0071_speed_tn_s: f64,
    /// C0072, speed controller Td, s, 0…0.032.
    pub c0072_speed_td_s: f64,
    /// C0075, current controller Vp, 0…15.99: share of nominal link voltage over device peak current.
    pub c0075_current_gain: f64,
    /// C0076, current controller Tn, s, 0.0005…2.0; at 2.0 the integral part is off.
    pub c0076_current_tn_s: f64,
    /// C0254, position controller Vp, 0…3.9999.
    pub c0254_position_gain: f64,
    /// C0497, filter of the displayed speed, s, 0…0.050.
    pub c0497_speed_filter_s: f64,
    /// C0909, limit of the speed set-value, percent of C0011.
    pub c0909_speed_limit: Percent,
}

impl Default for ControllerCodes {
    fn default() -> Self {
        Self {
            c0011_n_max: Rpm(3000.0),
            c0022_i_max_a: 1.35,
            c0070_speed_gain: 5.0,
            c0071_speed_tn_s: 0.020,
            c0072_speed_td_s: 0.0,
            c0075_current_gain: 0.75,
            c0076_current_tn_s: 1.5e-3,
            c0254_position_gain: 0.4,
            c0497_speed_filter_s: 2.0e-3,
            c0909_speed_limit: Percent(175.0),
        }
    }
}

impl ControllerCodes {
    /// The codes of a drive as they stand now. C0909 has no place in the store and keeps its 175 %.
    #[must_use]
    pub fn from_store(codes: &CodeStore) -> Self {
        Self {
            c0011_n_max: Rpm(codes.number(C0011, 0)),
            c0022_i_max_a: codes.number(C0022, 0),
            c0070_speed_gain: codes.number(C0070, 0),
            c0071_speed_tn_s: codes.number(C0071, 0) / 1000.0,
            c0072_speed_td_s: codes.number(C0072, 0) / 1000.0,
            c0075_current_gain: codes.number(C0075, 0),
            c0076_current_tn_s: codes.number(C0076, 0) / 1000.0,
            c0254_position_gain: codes.number(C0254, 0),
            c0497_speed_filter_s: codes.number(C0497, 0) / 1000.0,
            ..Self::default()
        }
    }
}

/// Readings of the drive that no source gives, by which codes become gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainScaling {
    /// Link voltage that C0075 refers to, V: 565.7 at 400 V mains. Interpretation (design, section 6).
    pub nominal_link_v: f64,
    /// Largest current of the device, A rms: 3.75. Source: film-feed specification, section 1.
    pub device_i_max_a: f64,
    /// Position gain for C0254 = 1, 1/s: 125. Assumed (9300 facts 4.6).
    pub k_v_per_c0254: f64,
}

impl Default for GainScaling {
    fn default() -> Self {
        Self {
            nominal_link_v: SQRT_2 * 400.0,
            device_i_max_a: 3.75,
            k_v_per_c0254: 125.0,
        }
    }
}

/// Everything an axis is made of. The default is the axis of the thesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisParams {
    /// The motor.
    pub motor: PmsmParams,
    /// Inertias and friction.
    pub mechanics: MechanicsParams,
    /// Mains, rectifier and DC link.
    pub dc_link: DcLinkParams,
    /// Resolver and converter.
    pub feedback: FeedbackParams,
    /// Codes of the controllers.
    pub codes: ControllerCodes,
    /// How codes become gains.
    pub scaling: GainScaling,
    /// Whether the current controller decouples. Assumed on.
    pub decoupling: Decoupling,
    /// Highest speed of the plant, C0596 NMAX; up to it the solver keeps its accuracy. Source: 9300 facts 4.4.
    pub n_plant_max: Rpm,
    /// Mains at power-up of the model.
    pub mains: Mains,
    /// Length of a tick, ns, 10 000…250 000; values outside are limited to that range. 62 500 for a chopping
    /// frequency of 16 kHz.
    pub tick_ns: u64,
    /// How closely plant and measurements are modelled.
    pub fidelity: Fidelity,
    /// Switches of the inverter; act from F2 on.
    pub inverter: InverterParams,
    /// Measurement of the currents; acts from F2 on.
    pub current_sensor: CurrentSensorParams,
    /// Seed of all noise of this axis, from F2 on.
    pub noise_seed: u64,
}

impl Default for AxisParams {
    fn default() -> Self {
        Self {
            motor: PmsmParams::MDSKS036_13,
            mechanics: MechanicsParams::default(),
            dc_link: DcLinkParams::default(),
            feedback: FeedbackParams::default(),
            codes: ControllerCodes::default(),
            scaling: GainScaling::default(),
            decoupling: Decoupling::On,
            n_plant_max: Rpm(5500.0),
            mains: Mains::On,
            tick_ns: TICK_NS,
            fidelity: Fidelity::Averaged,
            inverter: InverterParams::default(),
            current_sensor: CurrentSensorParams::default(),
            noise_seed: 1,
        }
    }
}

impl AxisParams {
    /// Length of a tick, s.
    #[must_use]
    pub fn tick_s(&self) -> f64 {
        self.tick_ns.clamp(10_000, SPEED_PERIOD_NS) as f64 * 1e-9
    }

    /// Ticks in a period of the speed controller: the whole number nearest to 250 µs, the smaller of two equally near.
    ///
    /// Interpretation: the chopping frequency changes the period of the current controller alone.
    #[must_use]
    pub fn ticks_per_speed_period(&self) -> u64 {
        nearest_multiple(SPEED_PERIOD_NS, self.tick_ns.clamp(10_000, SPEED_PERIOD_NS))
    }

    /// Ticks in a period of the position controller: whole periods of the speed controller, as near to 1 ms as they
    /// come.
    #[must_use]
    pub fn ticks_per_position_period(&self) -> u64 {
        let speed_ticks = self.ticks_per_speed_period();
        let speed_ns = speed_ticks * self.tick_ns.clamp(10_000, SPEED_PERIOD_NS);
        speed_ticks * nearest_multiple(POSITION_PERIOD_NS, speed_ns)
    }

    /// Gains of the current controller, V/A and s: C0075 · U_dc/(√2 I_max) = 80 V/A for the thesis.
    #[must_use]
    pub fn current_gains(&self) -> PiGains {
        let per_unit = self.scaling.nominal_link_v / (SQRT_2 * self.scaling.device_i_max_a);
        let t_n_s = self.codes.c0076_current_tn_s;
        PiGains {
            k_p: self.codes.c0075_current_gain * per_unit,
            t_n_s: if t_n_s >= 2.0 { f64::INFINITY } else { t_n_s },
        }
    }

    /// Torque limit, Nm: the torque of C0022, itself limited to what the device can give; 1.05 Nm for the thesis.
    #[must_use]
    pub fn torque_max_nm(&self) -> f64 {
        let i_max_a = self.codes.c0022_i_max_a.clamp(0.0, self.scaling.device_i_max_a);
        i_max_a * self.motor.torque_constant_rms()
    }

    /// Gains of the speed controller, Nm·s/rad and s: C0070 · M(C0022)/n_max = 0.01671 Nm·s/rad for the thesis.
    #[must_use]
    pub fn speed_gains(&self) -> PiGains {
        let t_n_s = self.codes.c0071_speed_tn_s;
        PiGains {
            k_p: self.codes.c0070_speed_gain * self.torque_max_nm() / self.codes.c0011_n_max.to_rad_s(),
            t_n_s: if t_n_s > 0.512 { f64::INFINITY } else { t_n_s },
        }
    }

    /// Everything the speed controller is made of.
    #[must_use]
    pub fn speed_controller_gains(&self) -> SpeedGains {
        SpeedGains {
            pi: self.speed_gains(),
            t_d_s: self.codes.c0072_speed_td_s,
            torque_max_nm: self.torque_max_nm(),
        }
    }

    /// Position controller: k_v = 125 1/s · C0254, limited to C0909.
    #[must_use]
    pub fn position_controller(&self) -> PositionController {
        PositionController::new(
            self.codes.c0254_position_gain * self.scaling.k_v_per_c0254,
            self.codes.c0909_speed_limit.to_factor() * self.codes.c0011_n_max.to_rad_s(),
        )
    }
}

/// What the axis is told to do during a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AxisCommand {
    /// Output stage off at once, the motor coasts; the position is still measured.
    #[doc(alias = "Reglersperre")]
    Inhibited,
    /// Make a torque, limited to C0022; the speed controller is led along, so that it takes over without a jump.
    Torque {
        /// Torque set-value, Nm; the current controller takes it up in this tick.
        torque_nm: f64,
    },
    /// Follow a speed. The speed controller takes the values up at its next period (every second tick).
    Speed {
        /// Speed set-value, rad/s at the motor shaft.
        omega_ref: f64,
        /// Torque known in advance, Nm; 0 in the drive of the thesis, which has no acceleration feed-forward.
        torque_ff: f64,
    },
}

/// Whether the output stage pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pulses {
    /// Inhibited, by command or by LU or OU.
    Inhibited,
    /// Pulsing.
    Enabled,
}

/// What drive and observer see at the end of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisSample {
    /// Position that the resolver gives, increments since power-up.
    pub position: i64,
    /// Speed that the controllers see, rad/s.
    pub omega_meas: f64,
    /// The same behind the filter C0497, for displays and the speed word (MCTRL-NACT), rad/s.
    pub omega_filtered: f64,
    /// Current along d, A peak.
    pub i_d: f64,
    /// Current along q, A peak.
    pub i_q: f64,
    /// Torque in the air gap, Nm.
    pub torque: f64,
    /// Torque set-value of the speed controller, Nm.
    pub torque_ref: f64,
    /// Voltage applied during the tick, V peak of a phase; zero while inhibited.
    pub voltage: Dq,
    /// DC link, V.
    pub u_dc: f64,
    /// DC link against the thresholds of C0173.
    pub link: LinkState,
    /// Whether the output stage pulsed during the tick.
    pub pulses: Pulses,
    /// Whether C0022 limited the torque in the last period of the speed controller.
    pub torque_limited: bool,
    /// Whether the DC link limited the voltage that was computed in this tick.
    pub voltage_limited: bool,
    /// True speed of the motor's shaft, rad/s; only a model knows it.
    pub omega_true: f64,
    /// True angle of the motor's shaft since power-up.
    pub angle: ShaftAngle,
}

impl AxisSample {
    /// Motor current, A rms (C0054).
    #[must_use]
    pub fn current_rms(&self) -> f64 {
        Dq::new(self.i_d, self.i_q).phase_rms()
    }
}

/// One axis in virtual time.
///
/// A tick of [`AxisParams::tick_ns`] runs, in this order: sample (taken at the end of the tick before) → position and
/// interpolator (the caller's, once a millisecond, through the command) → speed (every second tick) → current → the
/// plant moves on under the voltage that the tick *before* has computed. One tick of computing delay, as in the
/// drive.
///
/// LU and OU inhibit the pulses within the same tick and the axis resumes by itself; the half-second rule belongs to
/// the device. Whenever pulses start, the controllers start with no current and no torque at the actual speed.
///
/// Same parameters, same commands: same bits. Nothing allocates, and no transcendental function is called in a tick.
#[derive(Debug, Clone)]
pub struct Axis {
    params: AxisParams,
    train: DriveTrain,
    link: DcLink,
    feedback: Feedback,
    /// Switches and sensors with their errors, from F2 on.
    real: Option<Box<RealParts>>,
    speed: SpeedController,
    current: CurrentController,
    pending: OutputStage,
    i_q_ref: f64,
    amperes_per_nm: f64,
    filter_share: f64,
    tick_s: f64,
    load_nm: f64,
    film_nm: f64,
    /// F0: torque that the change of speed takes in this period, Nm.
    inertia_nm: f64,
    tick: u64,
    ticks_per_speed_period: u64,
    ticks_to_speed_period: u64,
    sample: AxisSample,
}

/// What F1 takes for ideal.
#[derive(Debug, Clone, Copy)]
struct RealParts {
    switches: Switches,
    sensor: CurrentSensor,
    /// Current that the controllers see, A peak.
    measured: Dq,
}

impl Axis {
    /// An axis at rest at position 0; the DC link is charged if the mains are on.
    #[must_use]
    pub fn new(params: &AxisParams) -> Self {
        let tick_s = params.tick_s();
        let ticks_per_speed_period = params.ticks_per_speed_period();
        let mechanics = MechanicsParams {
            // A shaft on a prescribed line has nothing to swing against.
            coupling: params
                .mechanics
                .coupling
                .filter(|_| params.fidelity != Fidelity::Kinematic),
            ..params.mechanics
        };
        let train = DriveTrain::new(&params.motor, &mechanics, params.n_plant_max.to_rad_s(), tick_s);
        // Noise shakes the currents in every tick, pulses have the whole voltage of the link behind them: shorter steps keep the energy
        // balance at 1e-9 all the same.
        let train = match params.fidelity {
            Fidelity::Kinematic | Fidelity::Averaged => train,
            Fidelity::WithErrors => train.with_steps_divided_by(2),
            Fidelity::Switched => train.with_steps_divided_by(4),
        };
        let link = DcLink::new(&params.dc_link, params.mains, tick_s);
        let sample = AxisSample {
            position: 0,
            omega_meas: 0.0,
            omega_filtered: 0.0,
            i_d: 0.0,
            i_q: 0.0,
            torque: 0.0,
            torque_ref: 0.0,
            voltage: Dq::ZERO,
            u_dc: link.voltage(),
            link: link.state(),
            pulses: Pulses::Inhibited,
            torque_limited: false,
            voltage_limited: false,
            omega_true: 0.0,
            angle: ShaftAngle::default(),
        };
        let mut axis = Self {
            params: *params,
            feedback: if params.fidelity.has_errors() {
                Feedback::with_errors(&params.feedback, train.angle(), tick_s, params.noise_seed)
            } else {
                Feedback::new(&params.feedback, train.angle(), tick_s)
            },
            real: params.fidelity.has_errors().then(|| {
                Box::new(RealParts {
                    switches: Switches::new(&params.inverter, params.motor.n_p, tick_s),
                    sensor: CurrentSensor::new(&params.current_sensor, params.motor.n_p, params.noise_seed),
                    measured: Dq::ZERO,
                })
            }),
            speed: SpeedController::new(params.speed_controller_gains(), ticks_per_speed_period as f64 * tick_s),
            current: CurrentController::new(params.current_gains(), &params.motor, params.decoupling, tick_s),
            train,
            link,
            pending: OutputStage::Inhibited,
            i_q_ref: 0.0,
            amperes_per_nm: 0.0,
            filter_share: 1.0,
            tick_s,
            load_nm: 0.0,
            film_nm: 0.0,
            inertia_nm: 0.0,
            tick: 0,
            ticks_per_speed_period,
            ticks_to_speed_period: 0,
            sample,
        };
        axis.set_codes(params.codes);
        axis
    }

    /// Moves the axis on by one tick and returns the way that what it drives took, reduced to the motor: that of its shaft, unless an
    /// elastic coupling lies between.
    pub fn tick(&mut self, command: AxisCommand) -> ShaftSegment {
        if self.params.fidelity == Fidelity::Kinematic {
            return self.tick_kinematic(command);
        }
        let speed_period = self.ticks_to_speed_period == 0;
        self.ticks_to_speed_period = if speed_period {
            self.ticks_per_speed_period - 1
        } else {
            self.ticks_to_speed_period - 1
        };
        let applied = match command {
            AxisCommand::Speed { omega_ref, torque_ff } if self.sample.link == LinkState::Normal => {
                self.start_if_inhibited();
                if speed_period {
                    self.control_speed(omega_ref, torque_ff);
                }
                self.control_current()
            }
            AxisCommand::Torque { torque_nm } if self.sample.link == LinkState::Normal => {
                self.start_if_inhibited();
                self.command_torque(torque_nm);
                self.control_current()
            }
            AxisCommand::Speed { .. } | AxisCommand::Torque { .. } | AxisCommand::Inhibited => self.inhibit(),
        };
        let segment = match (&self.real, applied) {
            (Some(real), OutputStage::Active(voltage)) => {
                let at = SwitchingPoint {
                    current: self.train.current(),
                    angle: self.train.angle(),
                    omega: self.train.omega(),
                    u_dc: self.sample.u_dc,
                };
                match self.params.fidelity {
                    Fidelity::Switched => {
                        let pulses = real.switches.pulses(voltage, &at);
                        self.train.advance_through(pulses.into_iter().flatten())
                    }
                    _ => self.train.advance_through([real.switches.mean(voltage, &at)]),
                }
            }
            _ => self.train.advance(applied),
        };
        self.link.advance(self.train.electrical_power_w());
        self.tick += 1;
        self.take_sample(applied);
        segment
    }

    /// [`tick`](Self::tick) at F0: the shaft does what it is told.
    #[cold]
    fn tick_kinematic(&mut self, command: AxisCommand) -> ShaftSegment {
        let ready = self.sample.link == LinkState::Normal;
        let omega_before = self.sample.omega_true;
        let j_total = self.params.mechanics.j_total_kg_m2();
        let motion = match command {
            AxisCommand::Speed { omega_ref, .. } if ready => {
                // A set-value is worth a period of the position controller, and so is the torque that its change takes.
                if self.ticks_to_speed_period == 0 {
                    self.ticks_to_speed_period = self.params.ticks_per_position_period();
                    let period_s = self.ticks_to_speed_period as f64 * self.tick_s;
                    self.inertia_nm = (omega_ref - omega_before) * j_total / period_s;
                }
                self.ticks_to_speed_period -= 1;
                Some(omega_ref)
            }
            AxisCommand::Torque { torque_nm } if ready => {
                let max_nm = self.params.torque_max_nm();
                self.ticks_to_speed_period = 0;
                self.inertia_nm = torque_nm.clamp(-max_nm, max_nm);
                Some(omega_before + self.inertia_nm / j_total * self.tick_s)
            }
            AxisCommand::Speed { .. } | AxisCommand::Torque { .. } | AxisCommand::Inhibited => None,
        };
        let (segment, applied) = match motion {
            Some(omega) => {
                self.pending = OutputStage::Active(Dq::ZERO);
                let segment = self.train.advance_at(omega, self.inertia_nm);
                (segment, OutputStage::Active(self.motor_voltage()))
            }
            None => {
                self.ticks_to_speed_period = 0;
                let applied = self.inhibit();
                (self.train.advance(applied), applied)
            }
        };
        self.link.advance(self.train.electrical_power_w());
        self.tick += 1;
        self.take_sample(applied);
        self.sample.torque_ref = self.sample.torque;
        segment
    }

    /// Voltage that the motor needs for its current and speed when neither changes.
    fn motor_voltage(&self) -> Dq {
        let motor = &self.params.motor;
        let (current, omega) = (self.train.current(), self.train.omega());
        let omega_el = motor.omega_el(omega);
        motor.back_emf(omega)
            + current * motor.r_s
            + Dq::new(-omega_el * motor.l_q * current.q, omega_el * motor.l_d * current.d)
    }

    /// Position that the resolver gave, increments, at a share of the last tick, `0.0..=1.0`, whose motion was `driven`.
    #[must_use]
    pub fn position_at(&self, driven: &ShaftSegment, share: f64) -> i64 {
        self.feedback.shown(self.train.rotor_angle_at(driven, share))
    }

    /// What was seen at the end of the last tick.
    #[must_use]
    pub fn sample(&self) -> &AxisSample {
        &self.sample
    }

    /// Ticks since power-up.
    #[must_use]
    pub fn tick_count(&self) -> u64 {
        self.tick
    }

    /// Parameters in use.
    #[must_use]
    pub fn params(&self) -> &AxisParams {
        &self.params
    }

    /// Where its energy came from and went since power-up.
    #[must_use]
    pub fn energy(&self) -> EnergyBalance {
        let (train, link) = (self.train.counted(), self.link.counted());
        EnergyBalance {
            mains_j: link.mains_j,
            external_j: train.external_j,
            source_loss_j: link.source_loss_j,
            standby_j: link.standby_j,
            brake_j: link.brake_j,
            inverter_loss_j: train.inverter_loss_j,
            copper_j: train.copper_j,
            friction_j: train.friction_j,
            coupling_loss_j: train.coupling_loss_j,
            load_j: train.load_j,
            motoring_j: train.motoring_j,
            regenerated_j: train.regenerated_j,
            capacitor_j: link.capacitor_j,
            field_j: self.train.winding_energy_j(),
            kinetic_j: self.train.kinetic_energy_j(),
            elastic_j: self.train.elastic_energy_j(),
        }
    }

    /// Torque of the load against the positive direction, reduced to the motor, Nm.
    pub fn set_load_torque(&mut self, load_nm: f64) {
        self.load_nm = load_nm;
        self.train.set_load_torque(self.load_nm + self.film_nm);
    }

    /// Torque of the film's tension, which adds to that of the load, reduced to the motor, Nm.
    pub fn set_film_torque(&mut self, film_nm: f64) {
        self.film_nm = film_nm;
        self.train.set_load_torque(self.load_nm + self.film_nm);
    }

    /// Switches the mains.
    pub fn set_mains(&mut self, mains: Mains) {
        self.link.set_mains(mains);
    }

    /// Changes the thresholds of LU and OU (C0173).
    pub fn set_link_thresholds(&mut self, thresholds: LinkThresholds) {
        self.params.dc_link.thresholds = thresholds;
        self.link.set_thresholds(thresholds);
    }

    /// Takes over changed codes; integrators keep what they hold. Not meant for every tick.
    pub fn set_codes(&mut self, codes: ControllerCodes) {
        self.params.codes = codes;
        self.speed.set_gains(self.params.speed_controller_gains());
        self.current.set_gains(self.params.current_gains());
        self.amperes_per_nm = 1.0 / self.params.motor.torque_per_peak_ampere();
        self.filter_share = self.tick_s / (self.tick_s + codes.c0497_speed_filter_s.max(0.0));
    }

    /// Lets the controllers start anew at the actual speed, without current set-value or integral torque.
    pub fn reset_controllers(&mut self) {
        self.speed.reset();
        self.i_q_ref = 0.0;
        self.sample.torque_ref = 0.0;
        let back_emf = self.current.reset(self.sample.omega_meas);
        if self.pending != OutputStage::Inhibited {
            self.pending = OutputStage::Active(limit_to_voltage_circle(back_emf, self.sample.u_dc).voltage);
        }
    }

    /// Lets the shaft turn at a given speed at once, as if driven from outside: the initial state of a trial.
    pub fn set_shaft_speed(&mut self, omega_mech_rad_s: f64) {
        self.train.set_omega(omega_mech_rad_s);
        self.feedback.preset(self.train.angle(), omega_mech_rad_s);
        self.sample.omega_meas = omega_mech_rad_s;
        self.sample.omega_filtered = omega_mech_rad_s;
        self.sample.omega_true = omega_mech_rad_s;
    }

    #[inline]
    fn start_if_inhibited(&mut self) {
        if self.pending == OutputStage::Inhibited {
            self.start();
        }
    }

    #[inline]
    fn control_speed(&mut self, omega_ref: f64, torque_ff: f64) {
        let demand = self.speed.step(&SpeedInput {
            omega_ref,
            omega_meas: self.sample.omega_meas,
            torque_ff_nm: torque_ff,
            voltage: if self.sample.voltage_limited {
                VoltageReserve::Exhausted
            } else {
                VoltageReserve::Enough
            },
        });
        self.i_q_ref = demand.torque_nm * self.amperes_per_nm;
        self.sample.torque_ref = demand.torque_nm;
        self.sample.torque_limited = demand.limited;
    }

    fn command_torque(&mut self, torque_nm: f64) {
        let max_nm = self.params.torque_max_nm();
        let held = torque_nm.clamp(-max_nm, max_nm);
        self.speed.preset(held);
        self.i_q_ref = held * self.amperes_per_nm;
        self.sample.torque_ref = held;
        self.sample.torque_limited = held != torque_nm;
    }

    /// Current controller; returns what the output stage does in this tick: what the tick before has computed.
    #[inline]
    fn control_current(&mut self) -> OutputStage {
        let measured = match &self.real {
            None => Dq::new(self.sample.i_d, self.sample.i_q),
            Some(real) => real.measured,
        };
        let demand = self
            .current
            .compute_output(Dq::new(0.0, self.i_q_ref), measured, self.sample.omega_meas);
        let realised = limit_to_voltage_circle(demand.voltage, self.sample.u_dc);
        self.current.update(&demand, realised.voltage);
        self.sample.voltage_limited = realised.limited;
        std::mem::replace(&mut self.pending, OutputStage::Active(realised.voltage))
    }

    /// First tick with pulses: meets the turning motor with its own voltage, so that no current surges.
    #[cold]
    fn start(&mut self) {
        self.pending = OutputStage::Active(Dq::ZERO);
        self.reset_controllers();
    }

    #[inline]
    fn inhibit(&mut self) -> OutputStage {
        if self.pending != OutputStage::Inhibited {
            self.pending = OutputStage::Inhibited;
            self.link.absorb(self.train.winding_energy_j());
            self.i_q_ref = 0.0;
            self.sample.torque_ref = 0.0;
            self.sample.torque_limited = false;
            self.sample.voltage_limited = false;
        }
        OutputStage::Inhibited
    }

    #[inline]
    fn take_sample(&mut self, applied: OutputStage) {
        let angle = self.train.angle();
        self.feedback.sample(angle);
        let current = self.train.current();
        if let Some(real) = &mut self.real {
            real.measured = real.sensor.measure(current, angle, self.tick);
        }
        let sample = &mut self.sample;
        sample.position = self.feedback.position();
        sample.omega_meas = self.feedback.omega();
        sample.omega_filtered =
            without_denormals(sample.omega_filtered + self.filter_share * (sample.omega_meas - sample.omega_filtered));
        sample.i_d = current.d;
        sample.i_q = current.q;
        sample.torque = self.train.torque();
        sample.u_dc = self.link.voltage();
        sample.link = self.link.state();
        (sample.voltage, sample.pulses) = match applied {
            OutputStage::Active(voltage) => (voltage, Pulses::Enabled),
            OutputStage::Inhibited => (Dq::ZERO, Pulses::Inhibited),
        };
        sample.omega_true = self.train.omega();
        sample.angle = angle;
    }
}

/// How many of `part` come nearest to `whole`, at least one; of two equally near numbers the smaller.
fn nearest_multiple(whole: u64, part: u64) -> u64 {
    ((2 * whole + part - 1) / (2 * part)).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_codes_of_the_thesis_give_the_gains_of_the_design() {
        // Source: design, section 6: 80 V/A, 0.01671 Nm·s/rad, 50 1/s, 1.05 Nm.
        let params = AxisParams::default();
        assert!((params.current_gains().k_p - 80.0).abs() < 0.01);
        assert!((params.current_gains().t_n_s - 1.5e-3).abs() < 1e-12);
        assert!((params.speed_gains().k_p - 0.01671).abs() < 5e-6);
        assert!((params.torque_max_nm() - 1.05).abs() < 1e-9);
        assert!((params.position_controller().k_v() - 50.0).abs() < 1e-9);
    }

    #[test]
    fn long_integral_times_switch_the_integral_part_off() {
        // Source: 9300 facts 4.4: C0071 above 512 ms off, C0076 at 2000 ms off.
        let mut params = AxisParams::default();
        params.codes.c0071_speed_tn_s = 0.5125;
        params.codes.c0076_current_tn_s = 2.0;
        assert_eq!(params.speed_gains().t_n_s, f64::INFINITY);
        assert_eq!(params.current_gains().t_n_s, f64::INFINITY);
    }

    #[test]
    fn the_tick_follows_the_chopping_frequency_and_the_outer_periods_stay() {
        // Source: 9300 facts 4.6: 250 µs and 1 ms; 16 kHz is a period of 62.5 µs.
        for (tick_ns, speed, position) in [(125_000, 2, 8), (62_500, 4, 16), (100_000, 2, 10), (250_000, 1, 4)] {
            let params = AxisParams {
                tick_ns,
                ..AxisParams::default()
            };
            assert_eq!(params.ticks_per_speed_period(), speed, "{tick_ns}");
            assert_eq!(params.ticks_per_position_period(), position, "{tick_ns}");
        }
    }

    #[test]
    fn a_current_limit_above_the_device_is_cut() {
        let mut params = AxisParams::default();
        params.codes.c0022_i_max_a = 9.0;
        assert!((params.torque_max_nm() - 3.75 * 0.70 / 0.90).abs() < 1e-9);
    }
}
