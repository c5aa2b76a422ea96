//! The drive: the tasks in their order, from terminals and bus command to the shaft.

use super::fault::Fault;
use super::monitor::{FaultSet, Monitor, Restart};
use crate::code::table::number::{
    C0011, C0022, C0051, C0053, C0054, C0067, C0070, C0071, C0075, C0076, C0105, C0142, C0183, C0254, C0255, C0497,
    C1218,
};
use crate::code::{CodeError, CodeStore, Inhibit, WriteEffect};
use crate::control::PositionController;
use crate::plant::{LinkState, Mains, ShaftSegment};
use crate::traverse::{
    ActiveEdge, LatchMode, Program, Resolution, Setpoint, TouchProbe, Traverse, TraverseEvent, TraverseInputs,
    TraverseParameters, TraverseStatus, film_feed_program,
};
use crate::units::{INC_PER_RAD, Percent, Rpm};
use crate::{Axis, AxisCommand, AxisParams, ControllerCodes, TICKS_PER_MS};
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
    /// How E1 latches the position.
    pub touch_input: LatchMode,
    /// Self test after power-up, ms. Assumed: 100 ms.
    pub self_test_ms: u32,
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
            touch_input: LatchMode::Fast,
            self_test_ms: 100,
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
    /// E1, the touch-probe input.
    pub e1: bool,
}

impl Default for Terminals {
    fn default() -> Self {
        Terminals { x5_28: true, e1: false }
    }
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

/// One drive. Call [`tick`](Self::tick) every 125 µs of its time.
#[derive(Debug, Clone)]
pub struct Drive {
    axis: Axis,
    codes: CodeStore,
    traverse: Traverse,
    touch: TouchProbe,
    position: PositionController,
    monitor: Monitor,
    terminals: Terminals,
    aif: AifControl,
    /// Causes that tests and operators set from outside.
    injected: FaultSet,
    /// A parameter set is being loaded or saved.
    transferring: bool,
    /// The commands of the last millisecond, whose edges count.
    before: Edges,
    self_test_ms: u32,
    ms: u64,
    tick_in_ms: u64,
    /// Resolver position at which POS-ACT is zero, increments.
    reference: i64,
    setpoint: Setpoint,
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
    /// C1218/1, increments.
    following_error: i64,
}

impl Drive {
    /// A drive at power-up, mains on.
    pub fn new(config: DriveConfig) -> Self {
        let mut drive = Drive {
            axis: Axis::new(&config.axis),
            codes: config.codes,
            traverse: Traverse::with_parameters(config.program, config.traverse),
            touch: TouchProbe::new(config.touch_input, ActiveEdge::Rising),
            position: config.axis.position_controller(),
            monitor: Monitor::default(),
            terminals: Terminals::default(),
            aif: BEFORE_FIRST_COMMAND,
            injected: FaultSet::default(),
            transferring: false,
            before: Edges {
                trip_reset: false,
                released: true,
                inhibited: true,
            },
            self_test_ms: config.self_test_ms,
            ms: 0,
            tick_in_ms: 0,
            reference: 0,
            setpoint: Setpoint::default(),
            following_error: 0,
            enabled: false,
            command: AxisCommand::Inhibited,
            limits: Limits::default(),
            generation: 0,
        };
        drive.take_over_codes();
        drive
    }

    /// One tick of the current controller, 125 µs: every eighth time the 1 ms task, then the control loops.
    ///
    /// Returns the exact motion of the shaft, in which the machine finds the edges of its sensors; they come back by
    /// [`edge_e1`](Self::edge_e1) before the next tick.
    pub fn tick(&mut self) -> ShaftSegment {
        if self.tick_in_ms == 0 {
            self.task_1ms();
        }
        self.tick_in_ms = (self.tick_in_ms + 1) % TICKS_PER_MS;
        self.axis.tick(self.command)
    }

    /// The level at E1 changed at share `fraction` of the tick whose motion was `shaft`.
    pub fn edge_e1(&mut self, shaft: &ShaftSegment, fraction: f64, level: bool) {
        self.terminals.e1 = level;
        let edge = if level { ActiveEdge::Rising } else { ActiveEdge::Falling };
        self.touch
            .handle_edge(edge, shaft.angle_at(fraction).increments() - self.reference);
    }

    /// The function blocks: monitoring, enable, traversing program, position controller. The speed set-value it forms
    /// is used by the speed controller in this tick.
    fn task_1ms(&mut self) {
        self.ms += 1;
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

        self.monitor(sample.omega_meas);
        self.enabled = self.initialised() && !self.inhibited() && !self.aif.quick_stop();

        let touch = self.touch.tick_1ms(self.terminals.e1, actual);
        let inputs = TraverseInputs {
            start: self.aif.program_start(),
            stop: self.aif.program_stop(),
            reset: self.aif.program_reset(),
            manual: self.aif.manual(),
            manual_pos: self.aif.manual_positive(),
            manual_neg: self.aif.manual_negative(),
            pfi01: self.aif.pfi01(),
            enabled: self.enabled,
            pos_act: actual,
            omega_act_inc_per_ms: sample.omega_meas * INC_PER_RAD / 1000.0,
            touch,
        };
        self.setpoint = self.traverse.tick_1ms(&inputs, &self.codes);
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
        if self.aif.quick_stop() {
            return AxisCommand::Speed {
                omega_ref: self.quick_stop_speed(),
                torque_ff: 0.0,
            };
        }
        let feed_forward = self.setpoint.velocity * 1000.0 / INC_PER_RAD;
        let error = self.setpoint.position - actual;
        AxisCommand::Speed {
            omega_ref: self.position.compute_output(error, feed_forward),
            torque_ff: 0.0,
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
            AxisCommand::Inhibited => self.axis.sample().omega_meas,
        };
        speed - speed.clamp(-step, step)
    }

    fn monitor(&mut self, omega: f64) {
        let link = self.axis.sample().link;
        let causes = self
            .injected
            .with(Fault::Lu, link == LinkState::Undervoltage)
            .with(Fault::Ou, link == LinkState::Overvoltage)
            .with(Fault::Eer, self.aif.trip_set())
            .with(Fault::Nmax, omega.abs() > self.axis.params().n_plant_max.to_rad_s())
            .with(Fault::P03, self.following_error.abs() > self.limits.p03)
            .with(Fault::P14, self.following_error.abs() > self.limits.following_error);
        let restart = if self.codes.number(C0142, 0) == 0.0 {
            Restart::Locked
        } else {
            Restart::Automatic
        };
        self.monitor.update(causes, restart);

        let now = Edges {
            trip_reset: self.aif.trip_reset(),
            released: self.terminals.x5_28,
            inhibited: self.externally_inhibited(),
        };
        let before = std::mem::replace(&mut self.before, now);
        // The falling edge at terminal 28 resets a TRIP too (fact sheet, section 2.5).
        if (now.trip_reset && !before.trip_reset) || (!now.released && before.released) {
            self.monitor.reset_trip();
        }
        // Taking the enable away counts, not that it is away: under LU the bus module inhibits by itself, and its inhibit
        // still stands when the message ends.
        if now.inhibited && !before.inhibited {
            self.monitor.release_restart_lock();
        }
    }

    fn externally_inhibited(&self) -> bool {
        !self.terminals.x5_28 || self.aif.controller_inhibit() || self.aif.disable()
    }

    /// Whether the output stage is off, whatever the reason.
    pub fn inhibited(&self) -> bool {
        self.externally_inhibited() || self.monitor.blocks_output()
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
            undervoltage: self.monitor.message() == Some(Fault::Lu),
            warning: self.monitor.warning().is_some(),
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

    /// Sets the level at terminal 28; sampled by the next 1 ms task.
    pub fn set_terminal_28(&mut self, high: bool) {
        self.terminals.x5_28 = high;
    }

    /// Levels at the terminals.
    pub fn terminals(&self) -> Terminals {
        self.terminals
    }

    /// Mains on or off.
    pub fn set_mains(&mut self, mains: Mains) {
        self.axis.set_mains(mains);
    }

    /// Additional torque against the motor, Nm.
    pub fn set_load_torque(&mut self, torque_nm: f64) {
        self.axis.set_load_torque(torque_nm);
    }

    /// Sets or clears the cause of a fault from outside: a cut resolver cable, an earth fault.
    pub fn inject(&mut self, fault: Fault, present: bool) {
        self.injected = if present {
            self.injected.with(fault, true)
        } else {
            self.injected.without(fault)
        };
    }

    /// Begins or ends the transfer of a parameter set, as C0002 and C0003 do it, or the keypad: meanwhile every job is
    /// refused (fact sheet, section 3.3).
    #[doc(alias = "Parametersatz-Transfer")]
    pub fn set_parameter_transfer(&mut self, running: bool) {
        self.transferring = running;
    }

    /// Reads a code, raw as the bus carries it.
    ///
    /// # Errors
    /// [`CodeError::TransferRunning`], or see [`CodeStore::read`].
    pub fn read_code(&mut self, code: u16, subcode: u8) -> Result<i32, CodeError> {
        if self.transferring {
            return Err(CodeError::TransferRunning);
        }
        self.publish_displays();
        self.codes.read(code, subcode)
    }

    /// Writes a code, raw as the bus carries it.
    ///
    /// # Errors
    /// [`CodeError::TransferRunning`], or see [`CodeStore::write`].
    pub fn write_code(&mut self, code: u16, subcode: u8, value: i32) -> Result<(), CodeError> {
        if self.transferring {
            return Err(CodeError::TransferRunning);
        }
        let inhibit = if self.inhibited() {
            Inhibit::Active
        } else {
            Inhibit::Inactive
        };
        if self.codes.write(code, subcode, value, inhibit)? == WriteEffect::TripReset {
            self.monitor.reset_trip();
        }
        Ok(())
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

    /// Actual position from the reference, increments.
    #[doc(alias = "Lageistwert")]
    pub fn position(&self) -> i64 {
        self.axis.sample().position - self.reference
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
            (self.aif.disable(), 112),
            (!self.terminals.x5_28, 121),
            (self.aif.controller_inhibit(), 125),
            (self.monitor.blocks_output(), 141),
            (self.aif.quick_stop(), 153),
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

    /// Displays are computed when somebody looks.
    fn publish_displays(&mut self) {
        let sample = *self.axis.sample();
        let shows = [
            (C0051, Rpm::from_rad_s(sample.omega_meas).0),
            (C0053, sample.u_dc),
            (C0054, sample.current_rms()),
            (C0067, f64::from(self.monitor.lecom_number())),
            (C0183, f64::from(self.diagnosis())),
        ];
        for (code, value) in shows {
            // A display that the table does not have stays unread.
            let _ = self.codes.publish(code, 0, (value * 10_000.0).round() as i32);
        }
    }

    /// Derives gains and limits from the codes; after a write, not in every tick.
    fn take_over_codes(&mut self) {
        self.generation = self.codes.generation();
        let codes = &self.codes;
        self.axis.set_codes(ControllerCodes {
            c0011_n_max: Rpm(codes.number(C0011, 0)),
            c0022_i_max_a: codes.number(C0022, 0),
            c0070_speed_gain: codes.number(C0070, 0),
            c0071_speed_tn_s: codes.number(C0071, 0) / 1000.0,
            c0075_current_gain: codes.number(C0075, 0),
            c0076_current_tn_s: codes.number(C0076, 0) / 1000.0,
            c0254_position_gain: codes.number(C0254, 0),
            c0497_speed_filter_s: codes.number(C0497, 0) / 1000.0,
            c0909_speed_limit: SPEED_LIMIT,
        });
        self.position = self.axis.params().position_controller();
        self.limits = Limits {
            speed_reference: Rpm(codes.number(C0011, 0)).to_rad_s(),
            p03: codes.number(C0255, 0) as i64,
            following_error: Resolution::from_codes(codes).whole_increments(codes.raw(C1218, 1)),
        };
    }
}

/// 16384 = 100 % of C0011 (design rule; fact sheet, section 4.6).
const FULL_SPEED: f64 = 16_384.0;
/// Speed below which the axis counts as standing, share of C0011. Assumed (C0019 is 0 as delivered).
const STANDSTILL_SHARE: f64 = 0.001;
/// C0909, limit of the speed set-value, % of C0011 (fact sheet, section 4.6).
const SPEED_LIMIT: Percent = Percent(175.0);

/// What the drive sees before a module has said anything: inhibited and stopped.
const BEFORE_FIRST_COMMAND: AifControl = AifControl(0).with_controller_inhibit(true).with_program_stop(true);
