//! The profile's machine seen from the master: which control word leads to the wanted state.

use crate::command::Command;
use crate::control_word::ControlWord;
use crate::state::State;
use crate::status_word::StatusWord;

/// Where the master wants the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    /// *Switch-on disabled*: power off at once; a turning motor coasts.
    Off,
    /// *Ready to switch on*.
    Ready,
    /// *Switched on*.
    SwitchedOn,
    /// *Operation enabled*.
    OperationEnabled,
}

impl Target {
    /// The state in which the target is reached.
    #[must_use]
    pub const fn state(self) -> State {
        match self {
            Self::Off => State::SwitchOnDisabled,
            Self::Ready => State::ReadyToSwitchOn,
            Self::SwitchedOn => State::SwitchedOn,
            Self::OperationEnabled => State::OperationEnabled,
        }
    }
}

/// How far the drive is from the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Progress {
    /// The status word shows the target.
    Reached,
    /// On the way, or held back by something the status word does not show (terminal 28).
    Moving,
    /// *Fault* or *fault reaction active*: call [`Sequencer::request_fault_reset`].
    Faulted,
    /// Bit 9 is 0: the drive does not listen to the bus.
    NotRemote,
    /// The status word shows no state of the profile.
    UnknownState,
}

/// Master side of the profile for users that have no PLC block: status word in, control word out.
///
/// Call [`step`](Self::step) once per bus cycle with the newest status word. It never waits and never gives up: the
/// word it returns always points one state nearer to the target, and repeating it does no harm.
///
/// A fault is reset only on request, never by itself: the user should know of it.
///
/// # Example
///
/// ```
/// use drivecom::{ControlWord, Sequencer, StatusWord, Target};
///
/// let mut sequencer = Sequencer::new();
/// assert_eq!(sequencer.step(Target::OperationEnabled, StatusWord(0x0250)), ControlWord(0x0076)); // shutdown
/// assert_eq!(sequencer.step(Target::OperationEnabled, StatusWord(0x0231)), ControlWord(0x0077)); // switch on
/// assert_eq!(sequencer.step(Target::OperationEnabled, StatusWord(0x0233)), ControlWord(0x007F)); // enable
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sequencer {
    application: ControlWord,
    reset: Reset,
    reset_hold_steps: u16,
    progress: Progress,
}

impl Sequencer {
    /// A sequencer whose application bits are at rest ([`ControlWord::REST`]) and whose reset pulse lasts 20 steps.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            application: ControlWord::REST,
            reset: Reset::Idle,
            reset_hold_steps: 20,
            progress: Progress::UnknownState,
        }
    }

    /// Sets the bits this sequencer passes through: 4–6 and 8–15 of `word`. Bits 0–3 and 7 are its own.
    pub fn set_application(&mut self, word: ControlWord) {
        self.application = word;
    }

    /// Sets the longest time bit 7 stays high, in steps (at least 1).
    ///
    /// The drive must see the bit in one module cycle; the pulse also ends as soon as the status word leaves *fault*.
    pub fn set_reset_hold(&mut self, steps: u16) {
        self.reset_hold_steps = steps.max(1);
    }

    /// Asks for one fault reset: bit 7 low for a step, so that there is an edge, then high until the fault has gone.
    ///
    /// Ignored outside *fault*; the request waits while the fault reaction runs. Asking again while bit 7 is high
    /// begins anew with a low step, because a second reset needs a new edge.
    pub fn request_fault_reset(&mut self) {
        self.reset = Reset::Low;
    }

    /// Whether a requested fault reset is still under way.
    #[must_use]
    pub const fn is_resetting(&self) -> bool {
        !matches!(self.reset, Reset::Idle)
    }

    /// The control word to send now.
    pub fn step(&mut self, target: Target, status: StatusWord) -> ControlWord {
        let state = status.state();
        self.progress = progress(target, status, state);
        let reset_bit = self.advance_reset(state);
        let command = command(target, state).control_word().with_reset_fault(reset_bit);
        self.application.with_command_bits(command)
    }

    /// How far the drive was from the target at the last step.
    #[must_use]
    pub const fn progress(&self) -> Progress {
        self.progress
    }

    fn advance_reset(&mut self, state: Option<State>) -> bool {
        match (self.reset, state) {
            (Reset::Idle, _) => false,
            (Reset::Low, Some(State::FaultReactionActive)) => false,
            (Reset::Low, Some(State::Fault)) => {
                self.reset = Reset::High {
                    left: self.reset_hold_steps,
                };
                false
            }
            (Reset::High { left: left @ 1.. }, Some(State::Fault)) => {
                self.reset = Reset::High { left: left - 1 };
                true
            }
            // Out of fault, or the pulse has lasted long enough.
            (Reset::Low | Reset::High { .. }, _) => {
                self.reset = Reset::Idle;
                false
            }
        }
    }
}

impl Default for Sequencer {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reset {
    Idle,
    Low,
    High { left: u16 },
}

const fn progress(target: Target, status: StatusWord, state: Option<State>) -> Progress {
    match state {
        None => Progress::UnknownState,
        Some(State::Fault | State::FaultReactionActive) => Progress::Faulted,
        Some(_) if !status.remote() => Progress::NotRemote,
        Some(state) if state as u8 == target.state() as u8 => Progress::Reached,
        Some(_) => Progress::Moving,
    }
}

// The command that leads one state nearer; in states that are left by themselves, one that does nothing there.
const fn command(target: Target, state: Option<State>) -> Command {
    match (target, state) {
        (Target::Off, _) => Command::DisableVoltage,
        // The ramp is left to end by itself; taking bit 2 back would not stop it anyway.
        (_, Some(State::QuickStopActive)) => Command::QuickStop,
        (Target::Ready, _) => Command::Shutdown,
        (Target::SwitchedOn, Some(State::OperationEnabled)) => Command::InhibitOperation,
        (_, Some(State::ReadyToSwitchOn)) => Command::SwitchOn,
        (Target::SwitchedOn, Some(State::SwitchedOn)) => Command::SwitchOn,
        (Target::OperationEnabled, Some(State::SwitchedOn | State::OperationEnabled)) => Command::EnableOperation,
        _ => Command::Shutdown,
    }
}
