//! The program executor: works records off and produces the set-values.

use std::collections::VecDeque;

use super::active_plan::ActivePlan;
use super::homing::{Direction, HomingPhase, HomingRule, SLOW, reference_point};
use super::interpolator::{Limits, Motion, PathState, Plan, Profile};
use super::jog::{JogDirection, JogParameters};
use super::record::{
    InputLevel, Level, Mode, OutputLevel, Program, ProgramInput, Record, RecordNumber, ResidualPath, Successor, Target,
    TouchRule, TouchWindow,
};
use super::resolution::{Residue, Resolution, Rounding};
use super::signals::{Override, RecordFault, Setpoint, TraverseEvent, TraverseInputs, TraverseStatus};
use super::start_gate::StartGate;
use super::touch_probe::TouchEvent;
use super::variables::{final_velocity, length_e4, record_limits, whole_increments};
use crate::code::CodeStore;
use crate::code::table::number::*;

/// What can be set about the executor and has no code of the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TraverseParameters {
    /// Half width of the target window, units ×10000. Assumed 0.1 units: the value of the drive is not known.
    pub target_window_e4: i32,
    /// What becomes of fractions of an increment.
    pub rounding: Rounding,
    /// Shape of the ramps, of records and of manual traversing.
    pub profile: Profile,
    /// Manual traversing.
    pub jog: JogParameters,
    /// Software position limits, units ×10000 from the reference, negative and positive one; `None` for endless axes. They hold
    /// once there is a reference. No code of the drive is known for them (9300 facts 4.4).
    #[doc(alias = "Lage-Endgrenzen")]
    pub position_limits: Option<[i32; 2]>,
    /// Longest way of the search for a reference switch, units ×10000. Assumed: 10 000 units.
    pub homing_way_e4: i32,
}

impl Default for TraverseParameters {
    fn default() -> Self {
        Self {
            target_window_e4: 1000,
            rounding: Rounding::default(),
            profile: Profile::default(),
            jog: JogParameters::default(),
            position_limits: None,
            homing_way_e4: 100_000_000,
        }
    }
}

/// The positioning controller of the drive.
///
/// Call [`tick_1ms`](Self::tick_1ms) once a millisecond, then [`status`](Self::status) and
/// [`poll_event`](Self::poll_event) until it returns `None`; the queue keeps the newest 64 events.
///
/// Order inside a tick: loss or return of the enable; end of a braking motion; RESET, STOP; start edge; manual traversing;
/// records. Records without motion ("set reference") and the record after them share a tick, so a feed of 1.5 s takes
/// 1500 ticks from the start edge. Work per tick is bounded by 32 records; more are left for the next tick.
///
/// Codes are read when a record (or a jog motion) begins; later changes act from the next one on.
///
/// Interpretations, where 9300 facts 4.2 and 4.3 leave room:
/// - The previous target, from which relative records count, shifts with the reference, so neither following error nor
///   noise adds up; after jog, RESET and loss of the enable it is the place where the set-value came to rest.
/// - Without enable the set-value follows the actual position. When it returns, the axis brakes from its actual speed;
///   an interrupted program waits for a new start edge, which continues the record towards its old target.
/// - A touch during the braking after STOP still counts: it moves the target for the continuation.
/// - Manual traversing needs the program ended or reset, not merely interrupted.
#[derive(Clone, Debug)]
pub struct Traverse {
    program: Program,
    parameters: TraverseParameters,
    cycle: Cycle,
    gate: StartGate,
    cancel_level: bool,
    velocity_override: Override,
    /// Where the set-value rests when no motion is planned.
    rest: i64,
    motion: Option<ActivePlan>,
    /// Velocity the jog motion under way leads to in inc/ms.
    jog_velocity: f64,
    /// Deceleration of the last motion, for braking without a record.
    braking: Limits,
    target: i64,
    residue: Residue,
    passes: [u32; RecordNumber::MAX as usize],
    outputs: u16,
    enabled: bool,
    ended: bool,
    no_mark_found: bool,
    referenced: bool,
    fault: Option<RecordFault>,
    in_target: bool,
    ready: bool,
    last_record: u8,
    window: Option<((Resolution, i32), u64)>,
    events: VecDeque<TraverseEvent>,
}

#[derive(Clone, Copy, Debug)]
enum Cycle {
    Idle,
    Running(Run),
    Interrupted(Run),
}

/// The record being worked off.
#[derive(Clone, Copy, Debug)]
struct Run {
    record: RecordNumber,
    stage: Stage,
    latched: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Fields 1 to 4 are still to be worked off.
    Entering,
    /// On the way to the target.
    Travelling,
    /// Looking for the reference point.
    Homing(HomingPhase),
    /// The way was interrupted and is to be planned anew.
    Resuming,
    /// At the target; milliseconds left to wait.
    Dwelling(u64),
    /// Fields 14 to 17 are still to be worked off.
    Leaving,
}

impl Traverse {
    /// A controller at rest at position 0, with the default parameters.
    pub fn new(program: Program) -> Self {
        Self::with_parameters(program, TraverseParameters::default())
    }

    /// A controller at rest at position 0.
    pub fn with_parameters(program: Program, parameters: TraverseParameters) -> Self {
        Self {
            program,
            parameters,
            cycle: Cycle::Idle,
            gate: StartGate::default(),
            cancel_level: false,
            velocity_override: Override::FULL,
            rest: 0,
            motion: None,
            jog_velocity: 0.0,
            braking: Limits {
                v_max: 0.0,
                acc: 1.0,
                dec: 1.0,
                jerk: f64::INFINITY,
            },
            target: 0,
            residue: Residue::default(),
            passes: [0; RecordNumber::MAX as usize],
            outputs: 0,
            enabled: false,
            ended: false,
            no_mark_found: false,
            referenced: false,
            fault: None,
            in_target: false,
            ready: false,
            last_record: 0,
            window: None,
            events: VecDeque::with_capacity(EVENT_CAPACITY),
        }
    }

    /// The 1 ms task.
    pub fn tick_1ms(&mut self, inputs: &TraverseInputs, codes: &CodeStore) -> Setpoint {
        if let Some(motion) = &mut self.motion {
            motion.advance();
        }
        let mut tick = Tick {
            inputs,
            codes,
            touch: inputs.touch,
            shift: 0,
        };
        self.fault = None;
        self.referenced &= !inputs.reference_lost;
        self.follow_enable(&tick);
        self.settle();
        self.handle_reset_and_stop(inputs);
        self.handle_start(inputs, codes);
        self.handle_cancel(inputs.cancel);
        self.follow_override(inputs.velocity_override, codes);
        if inputs.enabled {
            if matches!(self.cycle, Cycle::Idle) {
                self.jog(inputs, codes);
            }
            if let Cycle::Interrupted(mut run) = self.cycle {
                self.latch_touch(&mut run, &mut tick);
                self.cycle = Cycle::Interrupted(run);
            }
            self.work_records(&mut tick);
        }
        self.finish_tick(&tick)
    }

    /// State after the last tick.
    pub fn status(&self) -> TraverseStatus {
        let touch_armed = match self.cycle {
            Cycle::Running(run) | Cycle::Interrupted(run) => {
                run.stage != Stage::Entering && !run.latched && self.touch_rule(run).is_some()
            }
            Cycle::Idle => false,
        };
        TraverseStatus {
            running: !matches!(self.cycle, Cycle::Idle),
            interrupted: matches!(self.cycle, Cycle::Interrupted(_)),
            ended: self.ended,
            in_target: self.in_target,
            record: self.last_record,
            ready_to_start: self.ready,
            no_mark_found: self.no_mark_found,
            touch_armed,
            referenced: self.referenced,
            fault: self.fault,
            moving: self.motion.is_some(),
            outputs: self.outputs,
            target: self.target,
        }
    }

    /// The oldest event not yet fetched.
    pub fn poll_event(&mut self) -> Option<TraverseEvent> {
        self.events.pop_front()
    }

    /// The parameters.
    pub fn parameters(&self) -> &TraverseParameters {
        &self.parameters
    }

    /// Changes the parameters; they act from the next record or jog motion on.
    pub fn set_parameters(&mut self, parameters: TraverseParameters) {
        self.parameters = parameters;
    }

    /// The fraction of an increment that relative records have left over (0 unless the residue is carried).
    pub fn residue(&self) -> Residue {
        self.residue
    }

    /// The set-value with its fraction, and the acceleration: what an oscilloscope shows.
    pub fn motion(&self) -> Motion {
        self.motion.as_ref().map_or(
            Motion {
                position: self.rest,
                ..Motion::default()
            },
            |active| active.now(),
        )
    }

    fn follow_enable(&mut self, tick: &Tick<'_>) {
        let inputs = tick.inputs;
        let before = std::mem::replace(&mut self.enabled, inputs.enabled);
        if !inputs.enabled {
            self.rest = inputs.pos_act;
            self.motion = None;
            self.jog_velocity = 0.0;
            if let Cycle::Running(run) = self.cycle {
                self.cycle = Cycle::Interrupted(run.interrupted());
                self.emit(TraverseEvent::EnableLost);
            }
        } else if !before {
            let start = PathState {
                velocity: inputs.omega_act_inc_per_ms,
                ..PathState::at_rest(inputs.pos_act)
            };
            self.braking = self.current_limits(tick.codes);
            self.begin(Plan::to_velocity(start, 0.0, &self.braking), 0.0);
        }
    }

    /// Ends a braking or jog motion that has come to rest.
    fn settle(&mut self) {
        if matches!(self.cycle, Cycle::Running(_)) {
            return;
        }
        if let Some(active) = self.motion
            && active.plan.end_velocity() == 0.0
            && active.time_past_end().is_some()
        {
            // The output was the whole increment already: dropping the fraction moves nothing.
            self.rest = active.now().position;
            self.motion = None;
            if matches!(self.cycle, Cycle::Idle) {
                self.target = self.rest;
            }
        }
    }

    fn handle_reset_and_stop(&mut self, inputs: &TraverseInputs) {
        if inputs.stop || inputs.reset {
            self.ended = false;
        }
        if inputs.reset {
            self.no_mark_found = false;
            self.passes = [0; RecordNumber::MAX as usize];
            if !matches!(self.cycle, Cycle::Idle) {
                self.cycle = Cycle::Idle;
                self.emit(TraverseEvent::Reset);
                if self.motion.is_some() {
                    self.brake();
                } else if self.enabled {
                    self.target = self.rest;
                }
            }
        } else if inputs.stop
            && let Cycle::Running(run) = self.cycle
        {
            self.cycle = Cycle::Interrupted(run.interrupted());
            self.emit(TraverseEvent::Stopped);
            self.brake();
        }
    }

    fn handle_start(&mut self, inputs: &TraverseInputs, codes: &CodeStore) {
        let ready =
            inputs.enabled && !inputs.manual && self.motion.is_none() && !matches!(self.cycle, Cycle::Running(_));
        match self.gate.tick(inputs.start, ready, inputs.stop || inputs.reset) {
            None => {}
            Some(Err(refusal)) => self.emit(TraverseEvent::StartRefused(refusal)),
            Some(Ok(())) => {
                self.ended = false;
                if let Cycle::Interrupted(run) = self.cycle {
                    self.cycle = Cycle::Running(run);
                    self.emit(TraverseEvent::ProgramContinued);
                } else {
                    self.no_mark_found = false;
                    self.start_program(codes);
                }
            }
        }
    }

    /// POS-PS-CANCEL: the record ends where it is; a relative successor counts from there.
    fn handle_cancel(&mut self, level: bool) {
        let rising = !std::mem::replace(&mut self.cancel_level, level) && level;
        let Cycle::Running(run) = self.cycle else {
            return;
        };
        if !rising {
            return;
        }
        self.target = self.motion().position;
        self.emit(TraverseEvent::RecordCancelled { record: run.record });
        let successor = self
            .program
            .record(run.record)
            .map_or(Successor::End, |record| record.without_touch);
        self.go_on(successor);
    }

    /// Another share of the velocities: the way under way is planned anew.
    fn follow_override(&mut self, now: Override, codes: &CodeStore) {
        if std::mem::replace(&mut self.velocity_override, now) == now {
            return;
        }
        let Cycle::Running(run) = self.cycle else {
            return;
        };
        let Some(&record) = self.program.record(run.record) else {
            return;
        };
        match run.stage {
            Stage::Travelling | Stage::Homing(HomingPhase::Seeking) => {
                self.plan_to_target(&record, self.motion().state(), 0.0, codes);
            }
            Stage::Homing(HomingPhase::Leaving | HomingPhase::Approaching) => self.plan_slowly(&record, codes),
            Stage::Homing(HomingPhase::Braking)
            | Stage::Entering
            | Stage::Resuming
            | Stage::Dwelling(_)
            | Stage::Leaving => {}
        }
    }

    fn start_program(&mut self, codes: &CodeStore) {
        let number = u8::try_from(codes.raw(C1211, 0) / 10_000).unwrap_or(0);
        let Some(record) = RecordNumber::new(number) else {
            return;
        };
        if self.program.record(record).is_none() {
            self.emit(TraverseEvent::NoSuchRecord(record));
            return;
        }
        self.emit(TraverseEvent::ProgramStarted);
        self.enter(record);
    }

    fn enter(&mut self, record: RecordNumber) {
        self.last_record = record.get();
        self.cycle = Cycle::Running(Run {
            record,
            stage: Stage::Entering,
            latched: false,
        });
        self.emit(TraverseEvent::RecordStarted(record));
    }

    fn jog(&mut self, inputs: &TraverseInputs, codes: &CodeStore) {
        let jog = self.parameters.jog;
        let direction = if inputs.manual {
            JogDirection::from_signals(inputs.manual_pos, inputs.manual_neg)
        } else {
            JogDirection::Standstill
        };
        if direction == JogDirection::Standstill && self.jog_velocity == 0.0 {
            return;
        }
        let resolution = Resolution::from_codes(codes);
        let full = resolution.velocity_from_codes(jog.velocity_percent_e4.clamp(0, 100_0000), codes);
        let speed = full * self.velocity_override.factor();
        let velocity = direction.velocity(speed);
        if velocity != self.jog_velocity {
            let percent_e4 = jog.acceleration_percent_e4.clamp(100, 100_0000);
            let rate = resolution.acceleration_from_codes(percent_e4, codes);
            self.braking = Limits {
                v_max: speed,
                acc: rate,
                dec: rate,
                jerk: self.jerk(codes),
            };
            let state = self.motion().state();
            // Within position limits, manual traversing comes to rest at the limit ahead.
            let limit = self.limits_in_force(&resolution).map(
                |[negative, positive]| {
                    if velocity < 0.0 { negative } else { positive }
                },
            );
            let plan = match limit {
                Some(limit) if velocity != 0.0 => {
                    let ahead = (limit.saturating_sub(state.position) as f64) * velocity > 0.0;
                    Plan::to_target(state, if ahead { limit } else { state.position }, &self.braking, 0.0)
                }
                _ => Plan::to_velocity(state, velocity, &self.braking),
            };
            self.begin(plan, 0.0);
            self.jog_velocity = velocity;
        }
    }

    fn work_records(&mut self, tick: &mut Tick<'_>) {
        for _ in 0..RecordNumber::MAX {
            let Cycle::Running(mut run) = self.cycle else {
                return;
            };
            // Programs are checked for missing successors; a missing record ends the program all the same.
            let Some(&record) = self.program.record(run.record) else {
                self.go_on(Successor::End);
                return;
            };
            let next = match run.stage {
                Stage::Entering => self.enter_record(&record, tick),
                Stage::Travelling => self.travel(&record, &mut run, tick),
                Stage::Homing(phase) => self.home(&record, run, phase, tick),
                Stage::Resuming => {
                    self.plan_to_target(&record, self.motion().state(), 0.0, tick.codes);
                    Some(Stage::Travelling)
                }
                Stage::Dwelling(0) => Some(Stage::Leaving),
                Stage::Dwelling(left) => {
                    self.cycle = Cycle::Running(Run {
                        stage: Stage::Dwelling(left - 1),
                        ..run
                    });
                    None
                }
                Stage::Leaving => {
                    let successor = self.successor(&record, run.record, tick);
                    self.go_on(successor);
                    continue;
                }
            };
            match next {
                Some(stage) => self.cycle = Cycle::Running(Run { stage, ..run }),
                None => return,
            }
        }
    }

    /// Fields 1 to 8. `None`: still waiting.
    fn enter_record(&mut self, record: &Record, tick: &mut Tick<'_>) -> Option<Stage> {
        if record.wait.is_some_and(|condition| !tick.holds(condition)) {
            // A record entered on the fly has nowhere to go yet.
            if self.motion.is_some_and(|active| active.plan.end_velocity() != 0.0) {
                self.brake();
            }
            return None;
        }
        let resolution = Resolution::from_codes(tick.codes);
        if let Some(fault) = self.refusal(record, &resolution, tick.codes) {
            self.refuse(fault);
            return None;
        }
        self.switch(record.switch_before);
        match record.mode {
            Mode::Homing(rule) => return Some(self.begin_homing(record, rule, tick)),
            Mode::SetReference => {
                let value = whole_increments(record.target, &resolution, tick.codes);
                let shift = value.saturating_sub(tick.inputs.pos_act.saturating_add(tick.shift));
                self.shift_reference(shift);
                tick.shift = tick.shift.saturating_add(shift);
                self.referenced = true;
                return Some(Stage::Leaving);
            }
            Mode::Absolute | Mode::AbsoluteWithTouchProbe(_) => {
                self.target = whole_increments(record.target, &resolution, tick.codes);
            }
            Mode::Relative | Mode::RelativeWithTouchProbe(_) => {
                let way = match self.parameters.rounding {
                    Rounding::Truncate => whole_increments(record.target, &resolution, tick.codes),
                    Rounding::CarryResidue => {
                        let [length, offset] = length_e4(record.target, tick.codes);
                        resolution.carried_increments(length, &mut self.residue)
                            + resolution.carried_increments(offset, &mut self.residue)
                    }
                };
                self.target = self.target.saturating_add(way);
            }
        }
        let (state, lead) = match self.motion {
            Some(active) => active.hand_over(),
            None => (PathState::at_rest(self.rest), 0.0),
        };
        self.plan_to_target(record, state, lead, tick.codes);
        Some(Stage::Travelling)
    }

    /// Whether a record must not be begun.
    ///
    /// A relative target counts from the previous one, without what the residue will add: less than an increment.
    fn refusal(&self, record: &Record, resolution: &Resolution, codes: &CodeStore) -> Option<RecordFault> {
        let absolute = matches!(record.mode, Mode::Absolute | Mode::AbsoluteWithTouchProbe(_));
        if absolute && !self.referenced {
            return Some(RecordFault::NoReference);
        }
        let way = whole_increments(record.target, resolution, codes);
        let target = match record.mode {
            Mode::Absolute | Mode::AbsoluteWithTouchProbe(_) => way,
            Mode::Relative | Mode::RelativeWithTouchProbe(_) => self.target.saturating_add(way),
            Mode::SetReference | Mode::Homing(_) => return None,
        };
        self.outside_limits(target, resolution)
    }

    fn outside_limits(&self, target: i64, resolution: &Resolution) -> Option<RecordFault> {
        let [negative, positive] = self.limits_in_force(resolution)?;
        if target < negative {
            Some(RecordFault::BelowLimit)
        } else if target > positive {
            Some(RecordFault::AboveLimit)
        } else {
            None
        }
    }

    /// Position limits in increments, once there is a reference from which they count.
    fn limits_in_force(&self, resolution: &Resolution) -> Option<[i64; 2]> {
        let limits = self.parameters.position_limits.filter(|_| self.referenced)?;
        Some(limits.map(|limit| resolution.whole_increments(limit)))
    }

    /// The record is not begun: the program stands where it is, and the drive is told why.
    fn refuse(&mut self, fault: RecordFault) {
        let Cycle::Running(run) = self.cycle else {
            return;
        };
        self.fault = Some(fault);
        self.emit(TraverseEvent::RecordRefused {
            record: run.record,
            fault,
        });
        self.cycle = Cycle::Interrupted(run);
        self.brake();
    }

    fn begin_homing(&mut self, record: &Record, rule: HomingRule, tick: &Tick<'_>) -> Stage {
        self.referenced = false;
        match rule.reference.switch() {
            Some(switch) if tick.is_high(switch) => {
                self.brake();
                Stage::Homing(HomingPhase::Braking)
            }
            Some(_) => {
                let way = Resolution::from_codes(tick.codes).whole_increments(self.parameters.homing_way_e4);
                let state = self.motion().state();
                self.target = state.position.saturating_add(rule.direction.sign() * way);
                self.plan_to_target(record, state, 0.0, tick.codes);
                Stage::Homing(HomingPhase::Seeking)
            }
            None => {
                self.approach(record, rule, rule.direction, tick);
                Stage::Homing(HomingPhase::Approaching)
            }
        }
    }

    /// Looks for the reference point. `None`: not there yet.
    fn home(&mut self, record: &Record, run: Run, phase: HomingPhase, tick: &mut Tick<'_>) -> Option<Stage> {
        let Mode::Homing(rule) = record.mode else {
            return Some(Stage::Leaving);
        };
        let on_switch = rule.reference.switch().is_some_and(|switch| tick.is_high(switch));
        let at_rest = self.motion.is_none_or(|active| active.time_past_end().is_some());
        let phase = match phase {
            HomingPhase::Seeking if on_switch => {
                self.brake();
                HomingPhase::Braking
            }
            HomingPhase::Seeking if at_rest => {
                self.emit(TraverseEvent::HomingFailed { record: run.record });
                self.rest = self.motion().position;
                self.motion = None;
                self.go_on(record.without_touch);
                return None;
            }
            HomingPhase::Braking if at_rest => {
                let way = Resolution::from_codes(tick.codes).whole_increments(self.parameters.homing_way_e4);
                self.target = self.motion().position.saturating_sub(rule.direction.sign() * way);
                self.plan_slowly(record, tick.codes);
                HomingPhase::Leaving
            }
            HomingPhase::Leaving if !on_switch => {
                self.approach(record, rule, rule.direction.reversed(), tick);
                HomingPhase::Approaching
            }
            HomingPhase::Leaving if at_rest => {
                self.emit(TraverseEvent::HomingFailed { record: run.record });
                self.rest = self.motion().position;
                self.motion = None;
                self.go_on(record.without_touch);
                return None;
            }
            HomingPhase::Approaching if at_rest => {
                self.rest = self.target;
                self.motion = None;
                let value = whole_increments(record.target, &Resolution::from_codes(tick.codes), tick.codes);
                let shift = value.saturating_sub(self.target);
                self.shift_reference(shift);
                tick.shift = tick.shift.saturating_add(shift);
                self.referenced = true;
                self.switch(record.switch_after);
                return Some(Stage::Leaving);
            }
            waiting => {
                // The stage was copied before the motion went on; nothing has changed.
                self.cycle = Cycle::Running(Run {
                    stage: Stage::Homing(waiting),
                    ..run
                });
                return None;
            }
        };
        self.cycle = Cycle::Running(Run {
            stage: Stage::Homing(phase),
            ..run
        });
        None
    }

    /// Leads the axis to the reference point that lies ahead in `direction` of where it is now.
    fn approach(&mut self, record: &Record, rule: HomingRule, direction: Direction, tick: &Tick<'_>) {
        let here = tick.inputs.pos_act.saturating_add(tick.shift);
        self.target = reference_point(rule.reference, direction, here, tick.inputs.resolver);
        self.plan_slowly(record, tick.codes);
    }

    /// The way to the target of a homing that has met its switch.
    fn plan_slowly(&mut self, record: &Record, codes: &CodeStore) {
        let limits = self.limits(record, codes);
        let slow = Limits {
            v_max: limits.v_max * SLOW,
            ..limits
        };
        self.begin(Plan::to_target(self.motion().state(), self.target, &slow, 0.0), 0.0);
    }

    /// On the way. `None`: not there yet.
    fn travel(&mut self, record: &Record, run: &mut Run, tick: &mut Tick<'_>) -> Option<Stage> {
        if self.latch_touch(run, tick) {
            self.cycle = Cycle::Running(*run);
            self.plan_to_target(record, self.motion().state(), 0.0, tick.codes);
            if self.motion.is_some_and(|active| active.plan.reverses()) {
                self.emit(TraverseEvent::ReversalPlanned { record: run.record });
            }
        }
        if let Some(active) = self.motion {
            active.time_past_end()?;
            if active.plan.end_velocity() == 0.0 {
                self.rest = self.target;
                self.motion = None;
            }
        }
        self.switch(record.switch_after);
        if record.mode.touch_rule().is_some() && !run.latched {
            self.no_mark_found = true;
            self.emit(TraverseEvent::NoMarkFound { record: run.record });
            self.go_on(record.without_touch);
            // The stage of the old record is gone: let the loop look at the new one.
            return match self.cycle {
                Cycle::Running(next) => {
                    *run = next;
                    Some(next.stage)
                }
                Cycle::Idle | Cycle::Interrupted(_) => None,
            };
        }
        let dwell = record.dwell.map_or(0, |number| tick.codes.raw(C1304, number) / 10_000);
        Some(Stage::Dwelling(u64::try_from(dwell).unwrap_or(0)))
    }

    /// Takes a touch if the record waits for one; the target moves.
    fn latch_touch(&mut self, run: &mut Run, tick: &mut Tick<'_>) -> bool {
        let Some(rule) = self.touch_rule(*run) else {
            return false;
        };
        if run.latched || run.stage == Stage::Entering {
            return false;
        }
        let Some(TouchEvent { position }) = tick.touch.take() else {
            return false;
        };
        let position = position.saturating_add(tick.shift);
        let resolution = Resolution::from_codes(tick.codes);
        if let TouchWindow::Between { first, second } = rule.window {
            let [a, b] =
                [first, second].map(|number| whole_increments(Target::Variable(number), &resolution, tick.codes));
            if position < a.min(b) || position > a.max(b) {
                return false;
            }
        }
        let rest = match rule.residual {
            ResidualPath::None => 0,
            ResidualPath::Fixed(length) => resolution.whole_increments(length),
            ResidualPath::Variable(number) => whole_increments(Target::Variable(number), &resolution, tick.codes),
        }
        .saturating_abs();
        let motion = self.motion();
        let backwards = if motion.velocity == 0.0 {
            self.target < motion.position
        } else {
            motion.velocity < 0.0
        };
        self.target = position.saturating_add(if backwards { -rest } else { rest });
        run.latched = true;
        self.emit(TraverseEvent::MarkLatched {
            position,
            target: self.target,
        });
        true
    }

    fn touch_rule(&self, run: Run) -> Option<TouchRule> {
        self.program.record(run.record)?.mode.touch_rule().copied()
    }

    /// Fields 14 to 17.
    fn successor(&mut self, record: &Record, number: RecordNumber, tick: &Tick<'_>) -> Successor {
        if let Some(branch) = [record.branch_1, record.branch_2]
            .into_iter()
            .flatten()
            .find(|branch| tick.holds(branch.when))
        {
            return branch.to;
        }
        if let Some(pieces) = record.pieces
            && let Some(passes) = self.passes.get_mut(number.index())
        {
            *passes += 1;
            if i64::from(*passes) >= i64::from(tick.codes.raw(C1305, pieces.count) / 10_000) {
                *passes = 0;
                return pieces.to;
            }
        }
        record.jump
    }

    fn go_on(&mut self, successor: Successor) {
        match successor {
            Successor::Record(record) => self.enter(record),
            Successor::End => {
                self.cycle = Cycle::Idle;
                self.ended = true;
                self.emit(TraverseEvent::ProgramEnded);
                // Only a record with final velocity leaves a motion behind.
                if self.motion.is_some() {
                    self.brake();
                }
            }
        }
    }

    fn plan_to_target(&mut self, record: &Record, state: PathState, lead: f64, codes: &CodeStore) {
        let limits = self.limits(record, codes);
        let share = self.velocity_override.factor();
        let plan = Plan::to_target(state, self.target, &limits, final_velocity(record, codes) * share);
        self.braking = limits;
        self.begin(plan, lead);
    }

    /// Limits of a record with the override.
    fn limits(&self, record: &Record, codes: &CodeStore) -> Limits {
        let programmed = record_limits(record, codes);
        Limits {
            v_max: programmed.v_max * self.velocity_override.factor(),
            jerk: self.jerk(codes),
            ..programmed
        }
    }

    fn begin(&mut self, plan: Plan, lead: f64) {
        self.motion = Some(ActivePlan::new(plan, lead));
    }

    /// Brakes the motion under way with the ramp it had.
    fn brake(&mut self) {
        if self.motion.is_some() {
            self.begin(Plan::to_velocity(self.motion().state(), 0.0, &self.braking), 0.0);
        }
        self.jog_velocity = 0.0;
    }

    /// Ramps of the interrupted record, or of manual traversing.
    fn current_limits(&self, codes: &CodeStore) -> Limits {
        if let Cycle::Running(run) | Cycle::Interrupted(run) = self.cycle
            && let Some(record) = self.program.record(run.record)
        {
            return Limits {
                jerk: self.jerk(codes),
                ..record_limits(record, codes)
            };
        }
        let percent_e4 = self.parameters.jog.acceleration_percent_e4.clamp(100, 100_0000);
        let rate = Resolution::from_codes(codes).acceleration_from_codes(percent_e4, codes);
        Limits {
            v_max: 0.0,
            acc: rate,
            dec: rate,
            jerk: self.jerk(codes),
        }
    }

    /// Greatest jerk of the profile in inc/ms³.
    fn jerk(&self, codes: &CodeStore) -> f64 {
        match self.parameters.profile {
            Profile::Trapezoid => f64::INFINITY,
            Profile::SCurve { jerk } => {
                f64::from(jerk) * Resolution::from_codes(codes).increments_per_unit() / 1_000_000_000.0
            }
        }
    }

    fn shift_reference(&mut self, shift: i64) {
        self.rest = self.rest.saturating_add(shift);
        self.target = self.target.saturating_add(shift);
        if let Some(active) = &mut self.motion {
            active.plan.shift_reference(shift);
        }
        self.emit(TraverseEvent::SetReference { shift });
    }

    fn switch(&mut self, output: Option<OutputLevel>) {
        if let Some(OutputLevel { output, level }) = output {
            let bit = 1_u16.checked_shl(u32::from(output.saturating_sub(1))).unwrap_or(0);
            match level {
                Level::High => self.outputs |= bit,
                Level::Low => self.outputs &= !bit,
            }
        }
    }

    /// Half width of the target window in inc. Cached: 128-bit divisions are too dear for every millisecond.
    fn target_window(&mut self, codes: &CodeStore) -> u64 {
        let key = (Resolution::from_codes(codes), self.parameters.target_window_e4);
        match self.window {
            Some((known, window)) if known == key => window,
            _ => {
                let window = key.0.whole_increments(key.1).unsigned_abs();
                self.window = Some((key, window));
                window
            }
        }
    }

    fn finish_tick(&mut self, tick: &Tick<'_>) -> Setpoint {
        let motion = self.motion();
        let pos_act = tick.inputs.pos_act.saturating_add(tick.shift);
        let window = self.target_window(tick.codes);
        // Without enable the set-value follows: the actual position alone tells whether the axis is still there.
        let reference = if self.enabled { motion.position } else { self.target };
        let at_target = self.motion.is_none() && reference == self.target;
        self.in_target = at_target && pos_act.abs_diff(reference) <= window;
        self.ready = self.enabled && !tick.inputs.manual && self.motion.is_none() && matches!(self.cycle, Cycle::Idle);
        Setpoint {
            position: motion.position,
            velocity: motion.velocity,
            acceleration: motion.acceleration,
            moving: self.motion.is_some(),
            reference_shift: tick.shift,
        }
    }

    fn emit(&mut self, event: TraverseEvent) {
        // Keep the newest: a caller that never polls must not make the queue grow.
        if self.events.len() == EVENT_CAPACITY {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }
}

impl Run {
    fn interrupted(self) -> Self {
        match self.stage {
            Stage::Travelling => Self {
                stage: Stage::Resuming,
                ..self
            },
            // What was found so far counts no more: the axis may have been moved.
            Stage::Homing(_) => Self {
                stage: Stage::Entering,
                ..self
            },
            Stage::Entering | Stage::Resuming | Stage::Dwelling(_) | Stage::Leaving => self,
        }
    }
}

/// What a tick carries through the records it works off.
struct Tick<'a> {
    inputs: &'a TraverseInputs,
    codes: &'a CodeStore,
    touch: Option<TouchEvent>,
    shift: i64,
}

impl Tick<'_> {
    fn is_high(&self, input: ProgramInput) -> bool {
        self.inputs.program_inputs >> (input.get() - 1) & 1 == 1
    }

    fn holds(&self, condition: InputLevel) -> bool {
        self.is_high(condition.input) == (condition.level == Level::High)
    }
}

const EVENT_CAPACITY: usize = 64;
