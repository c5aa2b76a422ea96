//! The safety rules, checked at every tick of the drive and every cycle of the PLC.
//!
//! The monitor looks only: it may be laid over any run of the rig. What it sees in a tick is a plain value
//! ([`Tick`]), so that a test can show it a trace that breaks a rule.

use std::fmt;

use drivecom::{ControlWord, State};
use film_feed::block::{Inputs, Outputs, ParameterTelegram};
use film_feed::rig::{Rig, TickObserver, TickView};
use lenze9300_model::Pulses;
use lenze9300_model::device::Fault;
use lenze9300_model::traverse::TraverseEvent;

use crate::MILLISECOND;

/// What must never happen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SafetyRule {
    /// No torque unless operation is enabled and terminal 28 is high.
    TorqueOnlyWhenEnabled,
    /// The torque stays below what C0022 allows.
    TorqueLimited,
    /// The axis stands until somebody asks it to move.
    StandsUntilAsked,
    /// Operation is enabled out of switched on only.
    EnabledStepByStep,
    /// No start without an edge of the start bit that somebody or a documented hazard of the block made.
    StartNeedsAnEdge,
    /// Stop dominates start.
    StopDominates,
    /// After a bus failure with the watchdog on, the axis stands within watchdog, C1883 and ramp.
    StandsAfterBusFailure,
    /// The film does not run backwards uncommanded.
    NoReversal,
    /// A parameter that the drive refused is reported, never shown as accepted.
    RefusalIsShown,
}

impl SafetyRule {
    /// All rules.
    pub const ALL: [Self; 9] = [
        Self::TorqueOnlyWhenEnabled,
        Self::TorqueLimited,
        Self::StandsUntilAsked,
        Self::EnabledStepByStep,
        Self::StartNeedsAnEdge,
        Self::StopDominates,
        Self::StandsAfterBusFailure,
        Self::NoReversal,
        Self::RefusalIsShown,
    ];

    /// The rule in one sentence.
    pub const fn text(self) -> &'static str {
        match self {
            Self::TorqueOnlyWhenEnabled => {
                "no torque unless operation is enabled (or quick stop brakes), terminal 28 is high and neither trip nor message stands; 1 ms to react"
            }
            Self::TorqueLimited => "torque at most 1.05 Nm and 5 % overshoot of the current loop",
            Self::StandsUntilAsked => {
                "the axis stands within two increments until a start edge was taken or jog was asked for"
            }
            Self::EnabledStepByStep => "operation enabled is entered out of switched on only",
            Self::StartNeedsAnEdge => {
                "a program starts or goes on within 3 ms of a falling bit 5 of the control word, made by POS_START or, counted apart, by ERROR"
            }
            Self::StopDominates => {
                "no program starts or goes on while bit 6 (stop) or bit 11 (reset) of the control word says no"
            }
            Self::StandsAfterBusFailure => {
                "after a bus failure with watchdog and C1882 the axis stands within watchdog + C1883 + ramp"
            }
            Self::NoReversal => {
                "the film never runs back by more than 0.05 mm unless jog asked for it or the program announced it"
            }
            Self::RefusalIsShown => {
                "a parameter whose answer has the error bit is among the troubles in the same PLC cycle"
            }
        }
    }

    /// Where it is from.
    pub const fn source(self) -> &'static str {
        match self {
            Self::TorqueOnlyWhenEnabled => "9300 fact sheet, sections 2.2 and 2.5",
            Self::TorqueLimited => "9300 fact sheet, section 6; film-feed specification, section 4",
            Self::StandsUntilAsked => "9300 fact sheet, section 4.3",
            Self::EnabledStepByStep => "9300 fact sheet, section 2.3, transition 4",
            Self::StartNeedsAnEdge => "9300 fact sheet, sections 4.3 and 9.1",
            Self::StopDominates => "9300 fact sheet, section 4.3",
            Self::StandsAfterBusFailure => "9300 fact sheet, section 1.5",
            Self::NoReversal => "9300 fact sheet, section 4.2",
            Self::RefusalIsShown => "9300 fact sheet, section 3.1; film-feed specification, section 11",
        }
    }
}

/// A broken rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// Which.
    pub rule: SafetyRule,
    /// When, ns since power-up.
    pub at_ns: u64,
    /// The values that break it.
    pub values: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (ms, us) = (self.at_ns / MILLISECOND, self.at_ns % MILLISECOND / 1000);
        write!(f, "at {ms}.{us:03} ms: {}: {}", self.rule.text(), self.values)
    }
}

/// What the monitor sees of a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// End of the tick, ns since power-up.
    pub at_ns: u64,
    /// State of the DRIVECOM machine.
    pub state: State,
    /// The control word the drive works with.
    pub control_word: ControlWord,
    /// Level of terminal 28.
    pub terminal_28: bool,
    /// The stored TRIP.
    pub trip: Option<Fault>,
    /// A message keeps the output stage off.
    pub message: bool,
    /// Whether the output stage works.
    pub pulses: bool,
    /// Air-gap torque, Nm.
    pub torque_nm: f64,
    /// Speed of the motor, rad/s.
    pub speed_rad_s: f64,
    /// Position of the film, mm.
    pub film_mm: f64,
    /// What the traversing program told in the tick.
    pub events: Vec<TraverseEvent>,
}

/// Ticks between a level at the terminals or in the module and the output stage: terminal 28 and AIF are sampled by the
/// next 1 ms task (9300 fact sheet, section 2.5), eight ticks of 125 µs.
pub const REACTION_TICKS: u64 = 8;

/// Highest torque: C0022 allows 1.35 A · 0.778 Nm/A = 1.05 Nm (fact sheet, section 6); the current loop may overshoot its
/// set-value by less than 5 % (film-feed specification, section 4).
const TORQUE_LIMIT_NM: f64 = 1.05 * 1.05;

/// How far a standing axis may stray: an increment or two of the resolver. 179.0708 mm / 7 a revolution of 65 536.
const STANDING_MM: f64 = 2.0 / crate::INC_PER_MM;

/// From the edge in the module to the start in the program: the 1 ms tasks of module and drive, and one for luck of phase.
const EDGE_WINDOW_NS: u64 = 3 * MILLISECOND;

/// From POS_START or ERROR at the block to bit 5 in the drive: two PLC cycles of up to 20 ms, the DP cycle of the slowest
/// baud rate, 100 ms, and the module.
const CAUSE_WINDOW_NS: u64 = 200 * MILLISECOND;

/// Bound of a reversal, mm: five times the tolerance of a feed.
const REVERSAL_MM: f64 = 0.05;

/// The axis stands below this: 0.1 % of C0011 = 4000 1/min (9300 fact sheet, section 2.4), rad/s.
const STANDSTILL_RAD_S: f64 = 4.0 * std::f64::consts::PI / 30.0;

/// Watches the rules and keeps the first one broken.
#[derive(Debug, Clone, Default)]
pub struct SafetyMonitor {
    /// A start edge was taken, or manual mode was asked for at the drive: from here on the axis may move.
    pub asked: bool,
    /// A load may push the film back: reversals are not judged.
    pub pushed: bool,
    /// By how much more than 0.05 mm the film may run back, mm: a quick stop along a ramp of 0 s lets it swing (`docs/spec-notes.md`).
    pub swing_mm: f64,
    ticks: u64,
    torque_ticks: u64,
    violation: Option<Violation>,
    last_state: Option<State>,
    last_word: Option<ControlWord>,
    /// For how many ticks a reason to be without torque has held.
    unsafe_ticks: u64,
    edge_ns: Option<u64>,
    pos_start_ns: Option<u64>,
    error_ns: Option<u64>,
    hazard_starts: u64,
    starts: u64,
    stand_by_ns: Option<u64>,
    furthest_mm: Option<f64>,
    reversal_announced: bool,
    /// What the block will take for the answer in the next cycle, and the request it belongs to.
    answer: ParameterTelegram,
    request: ParameterTelegram,
}

impl SafetyMonitor {
    /// A monitor of an axis that was asked to move before.
    pub fn of_a_moving_axis() -> Self {
        SafetyMonitor {
            asked: true,
            ..SafetyMonitor::default()
        }
    }

    /// The first broken rule.
    pub fn violation(&self) -> Option<&Violation> {
        self.violation.as_ref()
    }

    /// Ticks seen.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Ticks with torque.
    pub fn torque_ticks(&self) -> u64 {
        self.torque_ticks
    }

    /// Starts that the drive took.
    pub fn starts(&self) -> u64 {
        self.starts
    }

    /// Starts among them that ERROR made and nobody asked for (9300 fact sheet, section 9.1).
    pub fn hazard_starts(&self) -> u64 {
        self.hazard_starts
    }

    /// The bus has failed for the drive: it must stand by then.
    pub fn must_stand_by(&mut self, at_ns: u64) {
        self.stand_by_ns = Some(at_ns);
    }

    /// The bus is back.
    pub fn may_move_again(&mut self) {
        self.stand_by_ns = None;
    }

    /// Runs PLC cycles for so long under the rules.
    pub fn watch(&mut self, rig: &mut Rig, ns: u64) {
        let end = rig.now_ns() + ns;
        while rig.now_ns() < end {
            self.cycle(rig);
        }
    }

    /// Runs PLC cycles under the rules until `until` says so, for at most `limit_ns`; tells whether it did.
    pub fn watch_until(&mut self, rig: &mut Rig, limit_ns: u64, mut until: impl FnMut(&Rig) -> bool) -> bool {
        let end = rig.now_ns() + limit_ns;
        while rig.now_ns() < end {
            self.cycle(rig);
            if until(rig) {
                return true;
            }
        }
        false
    }

    /// One PLC cycle with everything that happens up to it.
    pub fn cycle(&mut self, rig: &mut Rig) {
        rig.advance_to_plc_cycle(self);
        rig.plc_cycle();
        self.saw_cycle(rig);
    }

    /// Sees what the block made of its cycle.
    pub fn saw_cycle(&mut self, rig: &mut Rig) {
        let (now_ns, inputs) = (rig.now_ns(), *rig.inputs_mut());
        self.judge_causes(now_ns, &inputs, rig.outputs());
        let block = rig.block();
        if block.exchange_is_done() {
            let troubles: Vec<&str> = rig
                .parameter_watch()
                .troubles()
                .iter()
                .map(|trouble| trouble.code.as_str())
                .collect();
            self.judge_answer(now_ns, &troubles);
        }
        let at_work = block.telegram_at_work();
        self.request = block.telegrams().get(at_work).copied().unwrap_or_default();
        self.answer = block.parameter_received();
    }

    fn judge_causes(&mut self, now_ns: u64, inputs: &Inputs, outputs: &Outputs) {
        if inputs.pos_start {
            self.pos_start_ns = Some(now_ns);
        }
        if outputs.error {
            self.error_ns = Some(now_ns);
        }
    }

    /// The block has taken the answer for that to its request.
    fn judge_answer(&mut self, now_ns: u64, troubles: &[&str]) {
        let refused = self.answer.is_refusal();
        let names = [self.answer, self.request].map(ParameterTelegram::code_name);
        if refused && !names.iter().any(|name| troubles.contains(&name.as_str())) {
            let values = format!("{} was refused, troubles are {troubles:?}", names[1]);
            self.broken(SafetyRule::RefusalIsShown, now_ns, values);
        }
    }

    fn broken(&mut self, rule: SafetyRule, at_ns: u64, values: String) {
        self.violation.get_or_insert(Violation { rule, at_ns, values });
    }

    /// Judges a tick.
    pub fn judge(&mut self, tick: &Tick) {
        self.ticks += 1;
        let word = tick.control_word;
        let fell = self.last_word.is_some_and(|last| last.not_program_start()) && !word.not_program_start();
        if fell {
            self.edge_ns = Some(tick.at_ns);
        }
        self.judge_torque(tick);
        for event in &tick.events {
            match event {
                TraverseEvent::ProgramStarted | TraverseEvent::ProgramContinued => self.judge_start(tick),
                TraverseEvent::ReversalPlanned { .. } => self.reversal_announced = true,
                _ => {}
            }
        }
        self.judge_motion(tick);
        // The state never skips a step upwards.
        if tick.state == State::OperationEnabled
            && !matches!(
                self.last_state,
                None | Some(State::OperationEnabled | State::SwitchedOn)
            )
        {
            let values = format!("{:?} → {:?}", self.last_state, tick.state);
            self.broken(SafetyRule::EnabledStepByStep, tick.at_ns, values);
        }
        self.last_state = Some(tick.state);
        self.last_word = Some(word);
    }

    fn judge_torque(&mut self, tick: &Tick) {
        let powered = matches!(tick.state, State::OperationEnabled | State::QuickStopActive);
        let allowed = powered && tick.terminal_28 && tick.trip.is_none() && !tick.message;
        self.unsafe_ticks = if allowed { 0 } else { self.unsafe_ticks + 1 };
        let torque = tick.pulses || tick.torque_nm != 0.0;
        if torque && self.unsafe_ticks > REACTION_TICKS {
            let values = format!(
                "torque {} Nm, pulses {} in {:?} with terminal 28 {}, trip {:?}, message {}",
                tick.torque_nm, tick.pulses, tick.state, tick.terminal_28, tick.trip, tick.message
            );
            self.broken(SafetyRule::TorqueOnlyWhenEnabled, tick.at_ns, values);
        }
        self.torque_ticks += u64::from(torque);
        if tick.torque_nm.abs() > TORQUE_LIMIT_NM {
            let values = format!("torque {} Nm", tick.torque_nm);
            self.broken(SafetyRule::TorqueLimited, tick.at_ns, values);
        }
    }

    fn judge_start(&mut self, tick: &Tick) {
        self.asked = true;
        self.starts += 1;
        self.reversal_announced = false;
        let recent = |at: Option<u64>, window: u64| at.is_some_and(|at| tick.at_ns.saturating_sub(at) <= window);
        let word = tick.control_word;
        if !recent(self.edge_ns, EDGE_WINDOW_NS) {
            let values = format!("control word {:#06x}, last edge at {:?} ns", word.0, self.edge_ns);
            self.broken(SafetyRule::StartNeedsAnEdge, tick.at_ns, values);
        } else if recent(self.pos_start_ns, CAUSE_WINDOW_NS) {
            // Somebody asked for it.
        } else if recent(self.error_ns, CAUSE_WINDOW_NS) {
            self.hazard_starts += 1;
        } else {
            let values = format!(
                "an edge that nobody made: POS_START was high last at {:?} ns, ERROR at {:?} ns",
                self.pos_start_ns, self.error_ns
            );
            self.broken(SafetyRule::StartNeedsAnEdge, tick.at_ns, values);
        }
        let was = self.last_word.unwrap_or(word);
        let stopped = |word: ControlWord| !word.not_program_stop() || word.program_reset();
        // The program works with the word of this task or of the one before.
        if stopped(word) && stopped(was) {
            let values = format!("started with control word {:#06x}", word.0);
            self.broken(SafetyRule::StopDominates, tick.at_ns, values);
        }
    }

    fn judge_motion(&mut self, tick: &Tick) {
        let jogging = tick.state == State::OperationEnabled && tick.control_word.manual();
        self.asked |= jogging;
        if !self.asked && tick.film_mm.abs() > STANDING_MM {
            let values = format!("{} mm before the first start", tick.film_mm);
            self.broken(SafetyRule::StandsUntilAsked, tick.at_ns, values);
        }
        if self
            .stand_by_ns
            .is_some_and(|by| tick.at_ns > by && tick.speed_rad_s.abs() > STANDSTILL_RAD_S)
        {
            let values = format!("{} rad/s, due to stand by {:?} ns", tick.speed_rad_s, self.stand_by_ns);
            self.broken(SafetyRule::StandsAfterBusFailure, tick.at_ns, values);
        }
        // While jog moves the film backwards, and brakes out of it, its way counts anew.
        let backwards_asked = jogging || self.pushed || self.reversal_announced;
        let furthest = match self.furthest_mm {
            Some(furthest) if !backwards_asked => furthest.max(tick.film_mm),
            _ => tick.film_mm,
        };
        if furthest - tick.film_mm > REVERSAL_MM + self.swing_mm {
            let values = format!("{} mm behind {furthest} mm", furthest - tick.film_mm);
            self.broken(SafetyRule::NoReversal, tick.at_ns, values);
        }
        self.furthest_mm = Some(furthest);
    }
}

impl TickObserver for SafetyMonitor {
    fn tick(&mut self, view: &mut TickView<'_>) {
        let mut events = Vec::new();
        while let Some(event) = view.drive.poll_traverse_event() {
            events.push(event);
        }
        let (sample, status) = (*view.drive.axis().sample(), view.drive.status());
        self.judge(&Tick {
            at_ns: view.now_ns,
            state: view.module.state(),
            control_word: view.module.control_word(),
            terminal_28: view.drive.terminals().x5_28,
            trip: status.trip,
            message: status.message,
            pulses: sample.pulses == Pulses::Enabled,
            torque_nm: sample.torque,
            speed_rad_s: sample.omega_true,
            film_mm: view.film.position_mm(),
            events,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits at rest with operation enabled (9300 fact sheet, section 2.3), and with the start bit low.
    const ENABLED: ControlWord = ControlWord(0x007F);
    const START: ControlWord = ControlWord(0x005F);

    fn standing(ms: u64) -> Tick {
        Tick {
            at_ns: ms * MILLISECOND,
            state: State::OperationEnabled,
            control_word: ENABLED,
            terminal_28: true,
            trip: None,
            message: false,
            pulses: true,
            torque_nm: 0.1,
            speed_rad_s: 0.0,
            film_mm: 0.0,
            events: Vec::new(),
        }
    }

    fn started(ms: u64) -> Tick {
        Tick {
            control_word: START,
            events: vec![TraverseEvent::ProgramStarted],
            ..standing(ms)
        }
    }

    fn held() -> Inputs {
        Inputs {
            pos_start: true,
            ..Inputs::default()
        }
    }

    fn judged(trace: impl IntoIterator<Item = Tick>) -> SafetyMonitor {
        let mut monitor = SafetyMonitor::default();
        monitor.judge_causes(0, &held(), &Outputs::default());
        for tick in trace {
            monitor.judge(&tick);
        }
        monitor
    }

    fn rule(monitor: &SafetyMonitor) -> Option<SafetyRule> {
        monitor.violation().map(|violation| violation.rule)
    }

    #[test]
    fn a_feed_that_was_asked_for_breaks_no_rule() {
        let moved = Tick {
            film_mm: 10.0,
            speed_rad_s: 100.0,
            ..standing(3)
        };
        let monitor = judged([standing(1), started(2), moved]);
        assert_eq!(monitor.violation(), None);
        assert_eq!((monitor.starts(), monitor.hazard_starts(), monitor.ticks()), (1, 0, 3));
    }

    #[test]
    fn torque_without_a_reason_is_caught_after_a_millisecond() {
        let low = Tick {
            terminal_28: false,
            ..standing(1)
        };
        let ticks = REACTION_TICKS as usize;
        assert_eq!(rule(&judged(vec![low.clone(); ticks])), None);
        for tick in [
            low,
            Tick {
                state: State::SwitchedOn,
                ..standing(1)
            },
            Tick {
                trip: Some(Fault::Oc1),
                torque_nm: 0.0,
                ..standing(1)
            },
            Tick {
                message: true,
                pulses: false,
                ..standing(1)
            },
        ] {
            let monitor = judged(vec![tick; ticks + 1]);
            assert_eq!(rule(&monitor), Some(SafetyRule::TorqueOnlyWhenEnabled));
        }
    }

    #[test]
    fn too_much_torque_is_caught_in_both_directions() {
        for torque_nm in [1.11, -1.11] {
            let tick = Tick {
                torque_nm,
                ..standing(1)
            };
            assert_eq!(rule(&judged([tick])), Some(SafetyRule::TorqueLimited));
        }
    }

    #[test]
    fn motion_before_the_first_start_is_caught() {
        let tick = Tick {
            film_mm: 0.01,
            ..standing(1)
        };
        assert_eq!(rule(&judged([tick])), Some(SafetyRule::StandsUntilAsked));
    }

    #[test]
    fn a_skipped_state_is_caught() {
        let ready = Tick {
            state: State::ReadyToSwitchOn,
            pulses: false,
            torque_nm: 0.0,
            ..standing(1)
        };
        assert_eq!(rule(&judged([ready, standing(2)])), Some(SafetyRule::EnabledStepByStep));
    }

    #[test]
    fn a_start_without_an_edge_is_caught_and_so_is_an_edge_that_nobody_made() {
        let no_edge = Tick {
            control_word: ENABLED,
            ..started(2)
        };
        assert_eq!(
            rule(&judged([standing(1), no_edge])),
            Some(SafetyRule::StartNeedsAnEdge)
        );
        // The edge is too old.
        let early = Tick {
            events: Vec::new(),
            ..started(2)
        };
        assert_eq!(
            rule(&judged([standing(1), early, started(6)])),
            Some(SafetyRule::StartNeedsAnEdge)
        );
        // POS_START was high long ago.
        let monitor = judged([standing(500), started(501)]);
        assert_eq!(rule(&monitor), Some(SafetyRule::StartNeedsAnEdge));
        assert!(monitor.violation().unwrap().to_string().contains("nobody made"));
    }

    #[test]
    fn a_start_that_error_made_is_counted_apart() {
        let mut monitor = SafetyMonitor::default();
        let error = Outputs {
            error: true,
            ..Outputs::default()
        };
        monitor.judge_causes(0, &Inputs::default(), &error);
        monitor.judge(&standing(1));
        monitor.judge(&started(2));
        assert_eq!((rule(&monitor), monitor.hazard_starts()), (None, 1));
    }

    #[test]
    fn a_start_against_stop_or_reset_is_caught() {
        for word in [START.0 & !0x0040, START.0 | 0x0800] {
            let stopped = Tick {
                control_word: ControlWord(word),
                events: Vec::new(),
                ..standing(2)
            };
            let start = Tick {
                events: vec![TraverseEvent::ProgramContinued],
                ..stopped.clone()
            };
            assert_eq!(
                rule(&judged([standing(1), stopped, start])),
                Some(SafetyRule::StopDominates)
            );
        }
    }

    #[test]
    fn an_axis_that_goes_on_after_a_bus_failure_is_caught() {
        let moving = |ms| Tick {
            speed_rad_s: 1.0,
            ..standing(ms)
        };
        let mut monitor = SafetyMonitor::of_a_moving_axis();
        monitor.must_stand_by(10 * MILLISECOND);
        monitor.judge(&moving(10));
        assert_eq!(monitor.violation(), None);
        monitor.judge(&moving(11));
        assert_eq!(rule(&monitor), Some(SafetyRule::StandsAfterBusFailure));
        assert_eq!(monitor.violation().unwrap().at_ns, 11 * MILLISECOND);
    }

    #[test]
    fn a_film_that_runs_back_is_caught_unless_jog_asked_for_it() {
        let at = |ms, film_mm, control_word| Tick {
            film_mm,
            control_word,
            ..standing(ms)
        };
        let jog = ControlWord(0x307F);
        let back = judged([standing(1), started(2), at(3, 10.0, ENABLED), at(4, 9.94, ENABLED)]);
        assert_eq!(rule(&back), Some(SafetyRule::NoReversal));
        let jogged = judged([
            standing(1),
            started(2),
            at(3, 10.0, jog),
            at(4, 9.94, jog),
            at(5, 9.93, ENABLED),
        ]);
        assert_eq!(jogged.violation(), None);
    }

    #[test]
    fn a_refused_parameter_that_is_not_among_the_troubles_is_caught() {
        // C1301 is index 24575 − 1301 (9300 fact sheet, section 3.1).
        let telegram = |service| ParameterTelegram {
            service,
            index: 24_575 - 1301,
            subindex: 1,
            ..ParameterTelegram::default()
        };
        for (service, troubles, expected) in [
            (0x80, vec!["C1302/1"], Some(SafetyRule::RefusalIsShown)),
            (0x80, vec!["C1302/1", "C1301/1"], None),
            (0x02, vec![], None),
        ] {
            let mut monitor = SafetyMonitor {
                answer: telegram(service),
                request: telegram(0x02),
                ..SafetyMonitor::default()
            };
            monitor.judge_answer(0, &troubles);
            assert_eq!(rule(&monitor), expected, "{troubles:?}");
        }
    }

    #[test]
    fn each_rule_has_its_own_text_and_a_source() {
        let mut texts: Vec<&str> = SafetyRule::ALL.iter().map(|rule| rule.text()).collect();
        texts.sort_unstable();
        texts.dedup();
        assert_eq!(texts.len(), SafetyRule::ALL.len());
        assert!(SafetyRule::ALL.iter().all(|rule| rule.source().contains("section")));
    }
}
