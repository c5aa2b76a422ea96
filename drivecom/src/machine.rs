//! The profile's machine on the drive's side.

use crate::aif::AifControl;
use crate::command::{CommandSet, ResetEdge};
use crate::control_word::ControlWord;
use crate::state::State;
use crate::status_word::StatusWord;
use crate::transition::{self, TransitionId};

/// What the drive knows about itself, given to every [`Machine::step`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Conditions {
    /// The self test after power-on has passed.
    pub self_test_done: bool,
    /// Mains is there; `false` while the LU message stands.
    pub power_ok: bool,
    /// Terminal 28 is high and nothing else outside the bus inhibits the controller.
    #[doc(alias = "Reglerfreigabe")]
    pub release: bool,
    /// A trip is present: a level, from the trip until the drive has reset it.
    pub fault: bool,
    /// The reaction to the fault is finished (power stage off, or standstill).
    pub fault_reaction_done: bool,
    /// The cause of the trip has gone, so that a reset would succeed.
    pub fault_cause_gone: bool,
    /// The quick stop has reached standstill.
    pub quick_stop_done: bool,
}

impl Conditions {
    /// A healthy drive under mains with terminal 28 high: nothing stands in the way of any command.
    ///
    /// `quick_stop_done` is `false`: the axis counts as moving until somebody says otherwise.
    pub const HEALTHY: Self = Self {
        self_test_done: true,
        power_ok: true,
        release: true,
        fault: false,
        fault_reaction_done: true,
        fault_cause_gone: true,
        quick_stop_done: false,
    };
}

impl Default for Conditions {
    /// [`Conditions::HEALTHY`].
    fn default() -> Self {
        Self::HEALTHY
    }
}

/// The bits of the status word that do not follow from the machine's state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StatusInputs {
    /// Bit 7: warning.
    pub warning: bool,
    /// Bit 8: message, pulse inhibit by LU or OU.
    pub message: bool,
    /// Bit 9: controlled over the bus.
    pub remote: bool,
    /// Bit 10: set-value reached.
    pub set_value_reached: bool,
    /// Bit 11: limit reached.
    pub limit: bool,
    /// Bit 12: FAIL-QSP.
    pub fail_qsp: bool,
    /// Bit 14: the positioning program runs.
    pub running: bool,
    /// Bit 15: program ended and axis in target.
    pub ended_in_target: bool,
}

/// What one module cycle did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// State before.
    pub from: State,
    /// State after; equal to `from` when nothing moved.
    pub to: State,
    /// The row of the table that moved it.
    pub transition: Option<TransitionId>,
    /// Commands of this control word, obeyed or not.
    pub commands: CommandSet,
    /// What the drive is told, for the state after.
    pub aif: AifControl,
}

/// The DRIVECOM machine of the bus module: control words in, states, status words and drive commands out.
///
/// Call [`step`](Self::step) once per module cycle with the newest control word; it changes the state **at most
/// once**, by [`TRANSITIONS`](crate::TRANSITIONS) and [`DRIVE_MOVES`](crate::DRIVE_MOVES). Then read
/// [`status_word`](Self::status_word), which is computed from the state, never stored beside it.
///
/// A Moore machine: outputs depend on the state (and on control bits that pass through), not on how it was reached.
///
/// # Example
///
/// The walk of the film feed block, 9300 fact sheet, section 2.3:
///
/// ```
/// use drivecom::{Conditions, ControlWord, Machine, State};
///
/// let mut machine = Machine::new();
/// let mut step = |word| machine.step(ControlWord(word), Conditions::HEALTHY).to;
/// assert_eq!(step(0x0000), State::SwitchOnDisabled); // self test done
/// assert_eq!(step(0x0076), State::ReadyToSwitchOn);
/// assert_eq!(step(0x007F), State::SwitchedOn);
/// assert_eq!(step(0x007F), State::OperationEnabled); // one cycle later, on the standing word
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machine {
    state: State,
    // The word of the last cycle: remembers bit 7 for the edge, and bits 1 and 2 for the status word.
    control: ControlWord,
}

impl Machine {
    /// A machine after power-on (transition 0): *not ready to switch on*, control word 0.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            state: State::NotReadyToSwitchOn,
            control: ControlWord(0),
        }
    }

    /// One module cycle.
    ///
    /// "Reset fault" acts with the rising edge of bit 7 only. An edge that comes while the cause persists is used
    /// up: the drive stays in *fault*, and the next attempt needs a new edge. When the drive could not clear the trip
    /// after an accepted reset (`fault` still true in the following cycle), the machine falls back through *fault
    /// reaction active* to *fault*.
    pub fn step(&mut self, control: ControlWord, conditions: Conditions) -> Step {
        let edge = ResetEdge::between(self.control, control);
        let commands = CommandSet::decode(control, edge);
        let from = self.state;
        let taken = transition::next(from, commands, conditions);
        if let Some(transition) = taken {
            self.state = transition.to;
        }
        self.control = control;
        Step {
            from,
            to: self.state,
            transition: taken.map(|transition| transition.id),
            commands,
            aif: aif_control(self.state, control, edge),
        }
    }

    /// The state after the last step.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// The control word of the last step; 0 before the first.
    #[must_use]
    pub const fn control_word(&self) -> ControlWord {
        self.control
    }

    /// The status word of the present state.
    ///
    /// Bits 0–3 and 6 are the pattern of the state. Bit 4 is control bit 1, bit 5 control bit 2 (both low active:
    /// 0 = the command is active), except that the states whose pattern fixes bit 5 keep that value: a quick stop
    /// under way shows 0 even when the master has taken the command back, for there is no way back.
    #[must_use]
    pub const fn status_word(&self, inputs: StatusInputs) -> StatusWord {
        let pattern = self.state.pattern();
        let commands = StatusWord(0)
            .with_voltage_not_disabled(self.control.enable_voltage())
            .with_not_quick_stop(self.control.not_quick_stop());
        StatusWord((commands.0 & !pattern.mask) | pattern.value)
            .with_warning(inputs.warning)
            .with_message(inputs.message)
            .with_remote(inputs.remote)
            .with_set_value_reached(inputs.set_value_reached)
            .with_limit(inputs.limit)
            .with_fail_qsp(inputs.fail_qsp)
            .with_running(inputs.running)
            .with_ended_in_target(inputs.ended_in_target)
    }
}

impl Default for Machine {
    fn default() -> Self {
        Self::new()
    }
}

const fn aif_control(state: State, control: ControlWord, edge: ResetEdge) -> AifControl {
    let powered = matches!(
        state,
        State::SwitchedOn | State::OperationEnabled | State::QuickStopActive
    );
    AifControl(0)
        .with_quick_stop(matches!(state, State::QuickStopActive) || !control.not_drive_quick_stop())
        .with_program_start(!control.not_program_start())
        .with_program_stop(!control.not_program_stop())
        .with_program_reset(control.program_reset())
        .with_disable(matches!(state, State::SwitchedOn))
        .with_controller_inhibit(!powered)
        .with_trip_reset(matches!(edge, ResetEdge::Rising))
        .with_manual(control.manual())
        .with_manual_negative(control.manual_negative())
        .with_manual_positive(control.manual_positive())
        .with_pfi01(control.print_mark_mode())
}
