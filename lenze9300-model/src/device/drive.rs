//! The drive: the tasks in their order, from terminals and bus command to the shaft.

use super::fault::{Fault, Reaction};
use super::memory::FaultMemory;
use super::monitor::{FaultSet, Monitor, Restart};
use super::nonvolatile::{NonVolatile, SetNumber};
use super::parameter_sets::Transfer;
use super::utilisation::Utilisation;
use crate::code::table::number::{
    C0002, C0003, C0011, C0040, C0042, C0043, C0050, C0051, C0052, C0053, C0054, C0056, C0057, C0059, C0060, C0061,
    C0063, C0064, C0067, C0087, C0089, C0105, C0121, C0122, C0135, C0142, C0150, C0161, C0167, C0168, C0169, C0170,
    C0173, C0178, C0179, C0183, C0255, C0358, C0596, C0858, C0859, C1218,
};
use crate::code::{CodeError, CodeStore, Inhibit, WriteEffect};
use crate::control::PositionController;
use crate::plant::{Fidelity, LinkState, LinkThresholds, Mains, ShaftSegment, Thermal, ThermalParams};
use crate::traverse::{
    ActiveEdge, LatchMode, Override, Program, RecordFault, Resolution, Setpoint, TouchProbe, Traverse, TraverseEvent,
    TraverseInputs, TraverseParameters, TraverseStatus, film_feed_program,
};
use crate::units::{INC_PER_RAD, Rpm};
use crate::{Axis, AxisCommand, AxisParams, ControllerCodes};
use drivecom::AifControl;

/// What a drive is made of.
#[derive(Debug, Clone)]
pub struct DriveConfig {
    /// Motor, power section, mechanics.
    pub axis: AxisParams,
    /// Parameters at power-up.
    pub codes: CodeStore,
    /// The traversing program.
    pub program: Program,
    /// Target window, rounding and jog of the positioning control.
    pub traverse: TraverseParameters,
    /// How motor and heat sink warm up.
    pub thermal: ThermalParams,
    /// How E1 latches the position.
    pub touch_input: LatchMode,
    /// Inertia by which the set-value's acceleration is fed forward as torque, kg m² at the motor; 0 switches it off, as in the drive of the
    /// thesis (9300 facts 4.6: none is visible). At the true inertia the following error of the ramps all but vanishes.
    #[doc(alias = "Beschleunigungsvorsteuerung")]
    pub feed_forward_inertia_kg_m2: f64,
    /// Self test after power-up, ms. Assumed: 100 ms.
    pub self_test_ms: u32,
    /// How long loading or saving a parameter set takes, ms; meanwhile every parameter job is refused. Assumed: 200 ms.
    pub parameter_transfer_ms: u32,
    /// Faults that stop the drive by FAIL-QSP, whatever their codes say. The codes that choose this reaction for the positioning
    /// faults are not known (9300 facts 10); as delivered none has it.
    pub fail_qsp: FaultSet,
}

/// Half width of the target window as commissioned for the film feed, mm ×10000: 0.009 mm, 23 increments.
///
/// JOB_FIN then means "landed": with the fact sheet's assumed 0.1 mm (section 4.3) the static friction can hold the film
/// up to 0.02 mm beside its target for half a second after JOB_FIN. The rest up to 0.01 mm is left to the rounding of
/// the target and of C1204.
const TARGET_WINDOW_E4: i32 = 90;

/// The commissioned drive of the film feed (film-feed specification, sections 5 and 6).
impl Default for DriveConfig {
    fn default() -> Self {
        DriveConfig {
            axis: AxisParams::default(),
            codes: CodeStore::thesis(),
            program: film_feed_program(),
            traverse: TraverseParameters {
                target_window_e4: TARGET_WINDOW_E4,
                ..TraverseParameters::default()
            },
            thermal: ThermalParams::default(),
            touch_input: LatchMode::Fast,
            feed_forward_inertia_kg_m2: 0.0,
            self_test_ms: 100,
            parameter_transfer_ms: 200,
            fail_qsp: FaultSet::default(),
        }
    }
}

/// Levels at the control terminals X5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Terminals {
    /// Terminal 28: `true` = HIGH = enabled.
    #[doc(alias = "Klemme 28")]
    #[doc(alias = "RFR")]
    pub x5_28: bool,
    /// E1 to E5. E1 is the touch-probe input; E2 to E5 are wired to the program function inputs 02 to 05 (assumed).
    pub e: [bool; 5],
}

impl Default for Terminals {
    fn default() -> Self {
        Terminals {
            x5_28: true,
            e: [false; 5],
        }
    }
}

/// Inputs of the positioning function block that the film feed leaves unwired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PositioningSignals {
    /// POS-PS-CANCEL.
    pub cancel: bool,
    /// Share of the programmed velocities.
    pub velocity_override: Override,
}

/// What the drive shows to a bus module, once a millisecond.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriveStatus {
    /// The self test is done.
    pub initialised: bool,
    /// The stored TRIP.
    pub trip: Option<Fault>,
    /// Whether the cause of the stored TRIP is still there.
    pub trip_cause_present: bool,
    /// A message keeps the output stage off (LU, OU).
    pub message: bool,
    /// LU: there is no mains.
    pub undervoltage: bool,
    /// A warning.
    pub warning: bool,
    /// The drive stops or stands by FAIL-QSP.
    pub fail_qsp: bool,
    /// Terminal 28 is HIGH.
    pub released: bool,
    /// Speed is zero within 0.1 % of C0011.
    pub standstill: bool,
    /// Set-value reached: the interpolator stands.
    pub set_value_reached: bool,
    /// Torque or voltage limit reached.
    pub limit: bool,
    /// POS-RUNNING.
    pub running: bool,
    /// POS-ENDED and POS-IN-TARGET.
    pub ended_in_target: bool,
    /// MCTRL-NACT, 16384 = 100 % of C0011.
    pub speed: i16,
    /// POS-ACT, increments from the reference, wrapped to 32 bits.
    pub position: i32,
}

/// One drive. Call [`tick`](Self::tick) every 125 µs of its time (every [`AxisParams::tick_ns`], to be exact; the 1 ms task
/// needs a tick that divides 250 µs).
#[derive(Debug, Clone)]
pub struct Drive {
    axis: Axis,
    thermal: Thermal,
    utilisation: Utilisation,
    codes: CodeStore,
    traverse: Traverse,
    touch: TouchProbe,
    /// kg m² at the motor.
    feed_forward_inertia: f64,
    position: PositionController,
    monitor: Monitor,
    terminals: Terminals,
    positioning: PositioningSignals,
    aif: AifControl,
    /// C0135, a control word that keypad or system bus write; laid out as that of the bus module.
    word: AifControl,
    /// The control word of the system bus, laid out alike.
    can: AifControl,
    /// C0358 asked for a reset of the system bus.
    can_reset: bool,
    /// C0040 := 0.
    inhibited_by_code: bool,
    memory: NonVolatile,
    /// A parameter set is being loaded or saved.
    transfer: Option<Transfer>,
    parameter_transfer_ms: u32,
    fail_qsp: FaultSet,
    mains: Mains,
    /// Milliseconds that have not become a second of C0178 or C0179 yet.
    enabled_ms: u32,
    on_mains_ms: u32,
    /// Causes that tests and operators set from outside.
    injected: FaultSet,
    /// The commands of the last millisecond, whose edges count.
    before: Edges,
    self_test_ms: u32,
    ms: u64,
    tick_in_ms: u64,
    ticks_per_ms: u64,
    /// Resolver position at which POS-ACT is zero, increments.
    reference: i64,
    setpoint: Setpoint,
    /// Why the traversing program did not begin a record in the last millisecond.
    record_fault: Option<RecordFault>,
    following_error: i64,
    enabled: bool,
    command: AxisCommand,
    limits: Limits,
    generation: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Edges {
    trip_reset: bool,
    released: bool,
    inhibited: bool,
}

/// Figures derived from codes, refreshed when one of them changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Limits {
    /// C0011, rad/s.
    speed_reference: f64,
    /// C0255, increments.
    p03: i64,
    /// C1218/1 and /2, increments.
    following_error: [i64; 2],
    /// C0596, rad/s.
    plant_speed: f64,
    /// C0122, °C.
    heat_sink_c: f64,
    /// C0121, °C.
    motor_c: f64,
}

impl Drive {
    /// A commissioned drive at its first power-up: set 1 holds the codes of `config`.
    pub fn new(config: DriveConfig) -> Self {
        let memory = NonVolatile::new(config.codes.clone());
        Self::power_up(config, memory)
    }

    /// A drive at power-up with what it has kept: parameter set 1 is loaded, whatever codes `config` has.
    pub fn power_up(config: DriveConfig, memory: NonVolatile) -> Self {
        let mut drive = Drive {
            axis: Axis::new(&config.axis),
            thermal: Thermal::new(&config.thermal, &config.axis.motor, 0.001),
            utilisation: Utilisation::new(config.thermal.drive_i_n_a),
            codes: memory.set(SetNumber::FIRST).clone(),
            traverse: Traverse::with_parameters(config.program, config.traverse),
            touch: TouchProbe::new(config.touch_input, ActiveEdge::Rising),
            feed_forward_inertia: config.feed_forward_inertia_kg_m2,
            position: config.axis.position_controller(),
            monitor: Monitor::default(),
            terminals: Terminals::default(),
            positioning: PositioningSignals::default(),
            aif: BEFORE_FIRST_COMMAND,
            word: AifControl(0),
            can: AifControl(0),
            can_reset: false,
            inhibited_by_code: false,
            memory,
            transfer: None,
            parameter_transfer_ms: config.parameter_transfer_ms,
            fail_qsp: config.fail_qsp,
            mains: config.axis.mains,
            enabled_ms: 0,
            on_mains_ms: 0,
            injected: FaultSet::default(),
            before: Edges {
                trip_reset: false,
                released: true,
                inhibited: true,
            },
            self_test_ms: config.self_test_ms,
            ms: 0,
            tick_in_ms: 0,
            ticks_per_ms: config.axis.ticks_per_position_period(),
            reference: 0,
            setpoint: Setpoint::default(),
            record_fault: None,
            following_error: 0,
            enabled: false,
            command: AxisCommand::Inhibited,
            limits: Limits::default(),
            generation: 0,
        };
        drive.take_over_codes();
        drive
    }

    /// Takes the supply away: what was not saved is lost, as is the reference.
    pub fn power_off(self) -> NonVolatile {
        self.memory
    }

    /// One tick of the current controller, 125 µs as delivered: every eighth time the 1 ms task, then the control loops.
    ///
    /// Returns the exact motion of what the shaft drives, in which the machine finds the edges of its sensors; they come back by
    /// [`edge_e1`](Self::edge_e1) before the next tick.
    pub fn tick(&mut self) -> ShaftSegment {
        if self.tick_in_ms == 0 {
            self.task_1ms();
        }
        self.tick_in_ms += 1;
        if self.tick_in_ms == self.ticks_per_ms {
            self.tick_in_ms = 0;
        }
        self.axis.tick(self.command)
    }

    /// The level at E1 changed at share `fraction` of the tick whose motion was `shaft`.
    pub fn edge_e1(&mut self, shaft: &ShaftSegment, fraction: f64, level: bool) {
        self.terminals.e[0] = level;
        let edge = if level { ActiveEdge::Rising } else { ActiveEdge::Falling };
        self.touch
            .handle_edge(edge, self.axis.position_at(shaft, fraction) - self.reference);
    }

    /// The function blocks: monitoring, enable, traversing program, position controller. The speed set-value it forms
    /// is used by the speed controller in this tick.
    fn task_1ms(&mut self) {
        self.ms += 1;
        self.count_time();
        self.transfer_parameters();
        if self.codes.generation() != self.generation {
            self.take_over_codes();
        }
        let sample = *self.axis.sample();
        let actual = sample.position - self.reference;
        self.following_error = if self.enabled {
            self.setpoint.position - actual
        } else {
            0
        };

        let current_a = sample.current_rms();
        self.thermal.advance(current_a);
        self.utilisation.pass_1ms(current_a);
        self.monitor(sample.omega_meas);
        self.enabled = self.initialised() && !self.inhibited() && !self.quick_stop();

        let touch = self.touch.tick_1ms(self.terminals.e[0], actual);
        let inputs = TraverseInputs {
            start: self.aif.program_start(),
            stop: self.aif.program_stop(),
            reset: self.aif.program_reset(),
            manual: self.aif.manual(),
            manual_pos: self.aif.manual_positive(),
            manual_neg: self.aif.manual_negative(),
            cancel: self.positioning.cancel,
            program_inputs: self.program_inputs(),
            velocity_override: self.positioning.velocity_override,
            enabled: self.enabled,
            pos_act: actual,
            resolver: sample.position,
            reference_lost: self.monitor.reference_lost(),
            omega_act_inc_per_ms: sample.omega_meas * INC_PER_RAD / 1000.0,
            touch,
        };
        self.setpoint = self.traverse.tick_1ms(&inputs, &self.codes);
        // Monitored in the next millisecond, for one millisecond: what is stored is the TRIP.
        self.record_fault = self.traverse.status().fault;
        // The set-value is already counted from the new reference; the actual value follows here.
        self.reference -= self.setpoint.reference_shift;

        let actual = sample.position - self.reference;
        self.following_error = if self.enabled {
            self.setpoint.position - actual
        } else {
            0
        };
        self.command = self.axis_command(actual);
    }

    fn axis_command(&mut self, actual: i64) -> AxisCommand {
        if !self.initialised() || self.inhibited() {
            return AxisCommand::Inhibited;
        }
        if self.quick_stop() {
            return AxisCommand::Speed {
                omega_ref: self.quick_stop_speed(),
                torque_ff: 0.0,
            };
        }
        let mut velocity = self.setpoint.velocity;
        if self.axis.params().fidelity == Fidelity::Kinematic {
            // A shaft that takes on its speed at once gets the mean of the coming millisecond; the loops of a real one lag by as much.
            velocity += 0.5 * self.setpoint.acceleration;
        }
        let feed_forward = velocity * 1000.0 / INC_PER_RAD;
        let error = self.setpoint.position - actual;
        AxisCommand::Speed {
            omega_ref: self.position.compute_output(error, feed_forward),
            torque_ff: self.feed_forward_inertia * self.setpoint.acceleration * 1e6 / INC_PER_RAD,
        }
    }

    /// QSP leads the speed to zero along C0105, the time from C0011 to standstill; 0 s: at the torque limit.
    fn quick_stop_speed(&self) -> f64 {
        let ramp_s = self.codes.number(C0105, 0);
        if ramp_s <= 0.0 {
            return 0.0;
        }
        let step = self.limits.speed_reference / ramp_s * 0.001;
        let speed = match self.command {
            AxisCommand::Speed { omega_ref, .. } => omega_ref,
            AxisCommand::Torque { .. } | AxisCommand::Inhibited => self.axis.sample().omega_meas,
        };
        speed - speed.clamp(-step, step)
    }

    fn monitor(&mut self, omega: f64) {
        let link = self.axis.sample().link;
        let following_error = self.following_error.abs();
        let [first, second] = self.limits.following_error;
        // What was too warm stays so until it has cooled a little: otherwise a TRIP could be reset at once.
        let before = self.monitor.causes();
        let too_warm = |fault, now_c: f64, limit_c: f64| {
            let limit_c = if before.contains(fault) {
                limit_c - COOLED_K
            } else {
                limit_c
            };
            now_c > limit_c
        };
        let causes = self
            .injected
            .with(Fault::Lu, link == LinkState::Undervoltage)
            .with(Fault::Ou, link == LinkState::Overvoltage)
            .with(
                Fault::Eer,
                self.aif.trip_set() || self.word.trip_set() || self.can.trip_set(),
            )
            .with(Fault::Nmax, omega.abs() > self.limits.plant_speed)
            .with(Fault::P03, following_error > self.limits.p03)
            .with(Fault::P14, following_error > first)
            .with(Fault::P15, following_error > second)
            .with(Fault::Oc5, self.utilisation.exceeded())
            .with(
                Fault::Oh,
                too_warm(Fault::Oh, self.thermal.heat_sink_c(), HEAT_SINK_MAX_C),
            )
            .with(
                Fault::Oh4,
                too_warm(Fault::Oh4, self.thermal.heat_sink_c(), self.limits.heat_sink_c),
            )
            .with(Fault::Oh3, too_warm(Fault::Oh3, self.thermal.motor_c(), MOTOR_MAX_C))
            .with(
                Fault::Oh7,
                too_warm(Fault::Oh7, self.thermal.motor_c(), self.limits.motor_c),
            )
            .with(Fault::P04, self.record_fault == Some(RecordFault::BelowLimit))
            .with(Fault::P05, self.record_fault == Some(RecordFault::AboveLimit))
            .with(Fault::P06, self.record_fault == Some(RecordFault::NoReference));
        let restart = if self.codes.number(C0142, 0) == 0.0 {
            Restart::Locked
        } else {
            Restart::Automatic
        };
        let (codes, fail_qsp) = (&self.codes, self.fail_qsp);
        let reaction = |fault: Fault| {
            if fail_qsp.contains(fault) {
                Reaction::FailQsp
            } else {
                fault.reaction(codes)
            }
        };
        self.monitor.update(causes, reaction, restart);

        let now = Edges {
            trip_reset: self.aif.trip_reset() || self.word.trip_reset() || self.can.trip_reset(),
            released: self.terminals.x5_28,
            inhibited: self.externally_inhibited(),
        };
        let before = std::mem::replace(&mut self.before, now);
        // The falling edge at terminal 28 resets a TRIP too (9300 facts 2.5).
        if (now.trip_reset && !before.trip_reset) || (!now.released && before.released) {
            self.reset_trip();
        }
        // C0142 = 0: whoever left the enable standing over power-up must take it away first.
        if self.ms == u64::from(self.self_test_ms) + 1 && restart == Restart::Locked && !now.inhibited {
            self.monitor.lock_restart();
        }
        // Taking the enable away counts, not that it is away: under LU the bus module inhibits by itself, and its inhibit
        // still stands when the message ends.
        if now.inhibited && !before.inhibited {
            self.monitor.release_restart_lock();
        }
        let monitor = &self.monitor;
        let shown = monitor.shown();
        self.memory
            .faults
            .update(self.memory.on_mains_s, shown, |fault| monitor.is_present(fault));
    }

    /// With C0142 = 0 and the enable standing the drive stays inhibited until the enable is given anew.
    fn reset_trip(&mut self) {
        let locked = self.codes.number(C0142, 0) == 0.0;
        if self.monitor.reset_trip() && locked && !self.externally_inhibited() {
            self.monitor.lock_restart();
        }
    }

    fn externally_inhibited(&self) -> bool {
        !self.terminals.x5_28
            || self.inhibited_by_code
            || self.aif.controller_inhibit()
            || self.aif.disable()
            || self.word.controller_inhibit()
            || self.word.disable()
            || self.can.controller_inhibit()
            || self.can.disable()
    }

    fn quick_stop(&self) -> bool {
        self.aif.quick_stop() || self.word.quick_stop() || self.can.quick_stop() || self.monitor.fail_qsp().is_some()
    }

    /// Whether the output stage is off, whatever the reason.
    pub fn inhibited(&self) -> bool {
        self.externally_inhibited() || self.monitor.blocks_output()
    }

    fn count_time(&mut self) {
        let second = |ms: &mut u32, s: &mut u32, counts: bool| {
            *ms += u32::from(counts);
            if *ms == 1000 {
                (*ms, *s) = (0, s.saturating_add(1));
            }
        };
        let on_mains = self.mains == Mains::On;
        second(&mut self.on_mains_ms, &mut self.memory.on_mains_s, on_mains);
        second(&mut self.enabled_ms, &mut self.memory.enabled_s, self.enabled);
    }

    fn transfer_parameters(&mut self) {
        let Some(transfer) = &mut self.transfer else {
            return;
        };
        if !transfer.pass_1ms() {
            return;
        }
        transfer.carry_out(&mut self.codes, &mut self.memory);
        self.transfer = None;
    }

    fn initialised(&self) -> bool {
        self.ms > u64::from(self.self_test_ms)
    }

    /// What a bus module reports.
    pub fn status(&self) -> DriveStatus {
        let sample = self.axis.sample();
        let traverse = self.traverse.status();
        let speed = sample.omega_filtered / self.limits.speed_reference * FULL_SPEED;
        DriveStatus {
            initialised: self.initialised(),
            trip: self.monitor.tripped(),
            trip_cause_present: self.monitor.trip_cause_present(),
            message: self.monitor.message().is_some(),
            undervoltage: self.monitor.has_message(Fault::Lu),
            warning: self.monitor.warning().is_some(),
            fail_qsp: self.monitor.fail_qsp().is_some(),
            released: self.terminals.x5_28,
            standstill: sample.omega_meas.abs() < self.limits.speed_reference * STANDSTILL_SHARE,
            set_value_reached: self.enabled && !self.setpoint.moving,
            limit: sample.torque_limited || sample.voltage_limited,
            running: traverse.running,
            ended_in_target: traverse.ended && traverse.in_target,
            // Saturates at −200.0…+199.99 %.
            speed: speed.round() as i16,
            position: (sample.position - self.reference) as i32,
        }
    }

    /// Gives the bus' command; it acts in the next 1 ms task.
    pub fn set_aif(&mut self, command: AifControl) {
        self.aif = command;
    }

    /// Gives the command of the system bus; it acts in the next 1 ms task beside that of the bus module, and each of the two can
    /// stop the drive.
    pub fn set_can(&mut self, command: AifControl) {
        self.can = command;
    }

    /// Whether C0358 asked for a reset of the system bus since the last call.
    pub(crate) fn take_can_reset(&mut self) -> bool {
        std::mem::take(&mut self.can_reset)
    }

    /// Shows a value in a display code; what is none is passed over.
    pub(crate) fn show(&mut self, code: u16, subcode: u8, raw: i32) {
        let _ = self.codes.publish(code, subcode, raw);
    }

    /// Sets the level at terminal 28; sampled by the next 1 ms task.
    pub fn set_terminal_28(&mut self, high: bool) {
        self.terminals.x5_28 = high;
    }

    /// Sets the level at one of E2 to E5 (`number` 2…5), or at E1 while no film moves past its reader; sampled by the next 1 ms
    /// task. Other numbers are none of the drive's.
    pub fn set_input(&mut self, number: u8, high: bool) {
        let place = usize::from(number).checked_sub(1);
        if let Some(input) = place.and_then(|place| self.terminals.e.get_mut(place)) {
            *input = high;
        }
    }

    /// Sets the inputs of the positioning function block that the film feed leaves unwired.
    pub fn set_positioning(&mut self, signals: PositioningSignals) {
        self.positioning = signals;
    }

    /// PFI 01 comes over the bus, as in the thesis; PFI 02 to 05 are E2 to E5.
    fn program_inputs(&self) -> u32 {
        let [_, rest @ ..] = self.terminals.e;
        let terminals = (1_u32..).zip(rest).map(|(place, high)| u32::from(high) << place);
        terminals.fold(u32::from(self.aif.pfi01()), |inputs, input| inputs | input)
    }

    /// Levels at the terminals.
    pub fn terminals(&self) -> Terminals {
        self.terminals
    }

    /// Mains on or off.
    pub fn set_mains(&mut self, mains: Mains) {
        self.mains = mains;
        self.axis.set_mains(mains);
    }

    /// Additional torque against the motor, Nm.
    pub fn set_load_torque(&mut self, torque_nm: f64) {
        self.axis.set_load_torque(torque_nm);
    }

    /// Torque of the film's tension against the motor, Nm, beside that of the load.
    pub fn set_film_torque(&mut self, torque_nm: f64) {
        self.axis.set_film_torque(torque_nm);
    }

    /// Sets or clears the cause of a fault from outside: a cut resolver cable, an earth fault.
    pub fn inject(&mut self, fault: Fault, present: bool) {
        self.injected = if present {
            self.injected.with(fault, true)
        } else {
            self.injected.without(fault)
        };
    }

    /// Reads a code, raw as the bus carries it.
    ///
    /// # Errors
    /// [`CodeError::TransferRunning`], or see [`CodeStore::read`].
    pub fn read_code(&mut self, code: u16, subcode: u8) -> Result<i32, CodeError> {
        if self.transfer.is_some() {
            return Err(CodeError::TransferRunning);
        }
        self.publish_displays();
        self.codes.read(code, subcode)
    }

    /// Writes a code, raw as the bus carries it.
    ///
    /// C0002 and C0003 only begin a transfer: until it has ended every job is refused, as on the device.
    ///
    /// # Errors
    /// [`CodeError::TransferRunning`], or see [`CodeStore::write`].
    pub fn write_code(&mut self, code: u16, subcode: u8, value: i32) -> Result<(), CodeError> {
        if self.transfer.is_some() {
            return Err(CodeError::TransferRunning);
        }
        let inhibit = if self.inhibited() {
            Inhibit::Active
        } else {
            Inhibit::Inactive
        };
        if let WriteEffect::Command { code, value } = self.codes.write(code, subcode, value, inhibit)? {
            self.obey(code, value);
        }
        Ok(())
    }

    fn obey(&mut self, code: u16, value: i32) {
        match code {
            C0002 => self.transfer = Transfer::load(value / 10_000, self.parameter_transfer_ms),
            C0003 => self.transfer = Transfer::save(value / 10_000, self.parameter_transfer_ms),
            C0040 => self.inhibited_by_code = value == 0,
            C0043 if value == 0 => self.reset_trip(),
            C0135 => self.word = AifControl(value as u16),
            C0358 => self.can_reset |= value != 0,
            C0167 if value != 0 => self.memory.faults.clear(),
            _ => {}
        }
    }

    /// LECOM number of the present fault, as C0067 shows it; 0 = none.
    pub fn shown_fault(&self) -> u16 {
        self.monitor.lecom_number()
    }

    /// The fault memory.
    #[doc(alias = "Fehlerspeicher")]
    pub fn fault_memory(&self) -> &FaultMemory {
        &self.memory.faults
    }

    /// What the drive would keep if its supply went off now.
    pub fn nonvolatile(&self) -> &NonVolatile {
        &self.memory
    }

    /// The parameters.
    pub fn codes(&self) -> &CodeStore {
        &self.codes
    }

    /// Motor, power section and mechanics.
    pub fn axis(&self) -> &Axis {
        &self.axis
    }

    /// Set-value of the interpolator.
    pub fn setpoint(&self) -> Setpoint {
        self.setpoint
    }

    /// Position set-value minus actual value of the last 1 ms task, increments; 0 while not enabled.
    #[doc(alias = "Schleppfehler")]
    pub fn following_error(&self) -> i64 {
        self.following_error
    }

    /// Speed set-value that the position controller gave the speed controller in the last 1 ms task (MCTRL-NSET2, C0050), rad/s at the
    /// motor; 0 while inhibited.
    #[doc(alias = "Drehzahlsollwert")]
    pub fn speed_set_value(&self) -> f64 {
        match self.command {
            AxisCommand::Speed { omega_ref, .. } => omega_ref,
            AxisCommand::Torque { .. } | AxisCommand::Inhibited => 0.0,
        }
    }

    /// Actual position from the reference, increments.
    #[doc(alias = "Lageistwert")]
    pub fn position(&self) -> i64 {
        self.axis.sample().position - self.reference
    }

    /// Temperature of the heat sink, °C (C0061).
    #[doc(alias = "Kühlkörpertemperatur")]
    pub fn heat_sink_c(&self) -> f64 {
        self.thermal.heat_sink_c()
    }

    /// State of the traversing program.
    pub fn traverse_status(&self) -> TraverseStatus {
        self.traverse.status()
    }

    /// Next thing that happened in the traversing program.
    pub fn poll_traverse_event(&mut self) -> Option<TraverseEvent> {
        self.traverse.poll_event()
    }

    /// Why the drive does not move, as C0183 tells: 0 = OK (fact sheet, section 4.4; the lowest number wins).
    pub fn diagnosis(&self) -> u16 {
        let reasons = [
            (!self.initialised(), 101),
            (self.monitor.tripped().is_some(), 102),
            (self.monitor.message().is_some(), 104),
            (self.word.disable(), 111),
            (self.aif.disable(), 112),
            (self.can.disable(), 113),
            (!self.terminals.x5_28, 121),
            (self.inhibited_by_code || self.word.controller_inhibit(), 124),
            (self.aif.controller_inhibit(), 125),
            (self.can.controller_inhibit(), 126),
            (self.monitor.restart_locked(), 141),
            (self.monitor.fail_qsp().is_some(), 151),
            (self.word.quick_stop(), 152),
            (self.aif.quick_stop(), 153),
            (self.can.quick_stop(), 154),
            (self.monitor.warning().is_some(), 250),
        ];
        reasons
            .iter()
            .find(|(active, _)| *active)
            .map_or(0, |(_, number)| *number)
    }

    /// Fault to report on the bus as object 603Fh: 0 = none.
    pub fn drivecom_error_code(&self) -> u16 {
        self.monitor
            .tripped()
            .or(self.monitor.message())
            .map_or(0, Fault::drivecom_code)
    }

    /// The drive's own status word, C0150.
    ///
    /// | bit | 1 | 6 | 7 | 8–11 | 12 | 13 | 14 | 15 |
    /// |---|---|---|---|---|---|---|---|---|
    /// | | pulses inhibited | n = 0 | CINH | state | warning | message | RUNNING | ended, in target |
    ///
    /// States: 0 initialising, 1 restart protection, 3 inhibited, 6 enabled, 7 message, 8 TRIP, 10 FAIL-QSP. Source: 9300
    /// facts 2.4 (states assumed there). Bits 0, 2 to 5 can be assigned by C0156 and are 0.
    pub fn status_word(&self) -> u16 {
        let status = self.status();
        let state = if !status.initialised {
            0
        } else if status.trip.is_some() {
            8
        } else if status.message {
            7
        } else if self.monitor.restart_locked() {
            1
        } else if self.inhibited() {
            3
        } else if status.fail_qsp {
            10
        } else {
            6
        };
        let off = !status.initialised || self.inhibited();
        let bit = |set: bool, place: u16| u16::from(set) << place;
        bit(off, 1)
            | bit(status.standstill, 6)
            | bit(self.externally_inhibited(), 7)
            | state << 8
            | bit(status.warning, 12)
            | bit(status.message, 13)
            | bit(status.running, 14)
            | bit(status.ended_in_target, 15)
    }

    /// Displays are computed when somebody looks.
    fn publish_displays(&mut self) {
        let sample = *self.axis.sample();
        let status = self.status();
        let params = self.axis.params();
        let speed_reference = self.speed_set_value();
        let torque_max_nm = params.torque_max_nm();
        let pole_pairs = 60.0 * self.codes.number(C0089, 0) / self.codes.number(C0087, 0);
        let halves = status.position as u32;
        let words = [status.speed, halves as i16, (halves >> 16) as i16];
        let shows = [
            (C0040, f64::from(u8::from(!self.inhibited()))),
            (C0042, f64::from(u8::from(self.quick_stop()))),
            (C0043, f64::from(u8::from(status.trip.is_some()))),
            (C0050, 100.0 * speed_reference / self.limits.speed_reference),
            (C0051, Rpm::from_rad_s(sample.omega_meas).0),
            // Amplitude of a phase to rms from line to line.
            (C0052, sample.voltage.magnitude() * 1.5_f64.sqrt()),
            (C0053, sample.u_dc),
            (C0054, sample.current_rms()),
            (C0056, 100.0 * sample.torque_ref / torque_max_nm),
            (C0057, torque_max_nm),
            (C0059, pole_pairs.round()),
            (C0060, (sample.position.rem_euclid(65_536) / 32) as f64),
            (C0061, self.thermal.heat_sink_c()),
            (C0063, self.thermal.motor_c()),
            (C0064, self.utilisation.percent()),
            (C0067, f64::from(self.monitor.lecom_number())),
            (C0161, f64::from(self.monitor.lecom_number())),
            (C0183, f64::from(self.diagnosis())),
        ];
        // A display that the table does not have stays unread.
        for (code, value) in shows {
            let _ = self.codes.publish(code, 0, (value * 10_000.0).round() as i32);
        }
        for (subcode, word) in (1..).zip(words) {
            let percent_e4 = i64::from(word) * 1_000_000 / 16_384;
            let _ = self.codes.publish(C0858, subcode, percent_e4 as i32);
        }
        let plain = [
            (C0135, i32::from(self.word.0)),
            (C0150, i32::from(self.status_word())),
            (C0178, i32::try_from(self.memory.enabled_s).unwrap_or(i32::MAX)),
            (C0179, i32::try_from(self.memory.on_mains_s).unwrap_or(i32::MAX)),
            (C0859, status.position),
        ];
        for (code, value) in plain {
            let _ = self.codes.publish(code, 0, value);
        }
        for subcode in 1..=8 {
            let entry = self.memory.faults.entry(subcode);
            let number = entry.map_or(0, |entry| i32::from(entry.lecom_number()));
            let time_s = entry.map_or(0, |entry| i32::try_from(entry.time_s).unwrap_or(i32::MAX));
            let count = entry.map_or(0, |entry| i32::from(entry.count));
            let _ = self.codes.publish(C0168, subcode, number * 10_000);
            let _ = self.codes.publish(C0169, subcode, time_s);
            let _ = self.codes.publish(C0170, subcode, count * 10_000);
        }
    }

    /// Derives gains and limits from the codes; after a write, not in every tick.
    fn take_over_codes(&mut self) {
        self.generation = self.codes.generation();
        let codes = &self.codes;
        self.axis.set_codes(ControllerCodes::from_store(codes));
        self.position = self.axis.params().position_controller();
        self.limits = Limits {
            speed_reference: Rpm(codes.number(C0011, 0)).to_rad_s(),
            p03: codes.number(C0255, 0) as i64,
            following_error: [1, 2]
                .map(|which| Resolution::from_codes(codes).whole_increments(codes.raw(C1218, which))),
            plant_speed: Rpm(codes.number(C0596, 0)).to_rad_s(),
            heat_sink_c: codes.number(C0122, 0),
            motor_c: codes.number(C0121, 0),
        };
        // The table offers exactly the rows that there are.
        if let Some(thresholds) = LinkThresholds::from_c0173(codes.number(C0173, 0) as u8) {
            self.axis.set_link_thresholds(thresholds);
        }
    }
}

/// 16384 = 100 % of C0011 (design rule; fact sheet, section 4.6).
const FULL_SPEED: f64 = 16_384.0;
/// OH: fixed by the device. Assumed, above the greatest C0122.
const HEAT_SINK_MAX_C: f64 = 90.0;
/// How far what was too warm must cool. Assumed.
const COOLED_K: f64 = 5.0;
/// OH3: fixed by the device (9300 facts 4.9).
const MOTOR_MAX_C: f64 = 150.0;
/// Speed below which the axis counts as standing, share of C0011. Assumed (C0019 is 0 as delivered).
const STANDSTILL_SHARE: f64 = 0.001;

/// What the drive sees before a module has said anything: inhibited and stopped.
const BEFORE_FIRST_COMMAND: AifControl = AifControl(0).with_controller_inhibit(true).with_program_stop(true);
