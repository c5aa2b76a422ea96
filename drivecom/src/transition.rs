//! The sixteen numbered transitions of the profile and the drive's own moves, as one kind of table.

use core::fmt;

use crate::command::{Command, CommandSet};
use crate::machine::Conditions;
use crate::state::{State, StateSet};

/// One row: from any of these states, when triggered and not held, to that state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transition {
    /// Number in the profile, or name of the drive's own move.
    pub id: TransitionId,
    /// States it leaves; empty for transition 0, which enters the machine from outside.
    pub from: StateSet,
    /// State it enters.
    pub to: State,
    /// What sets it off.
    pub trigger: Trigger,
    /// What keeps it from happening although triggered.
    pub hold: Option<Hold>,
}

impl Transition {
    /// Whether this row moves a machine in `state` now.
    #[must_use]
    pub fn fires(&self, state: State, commands: CommandSet, conditions: Conditions) -> bool {
        self.from.contains(state)
            && self.trigger.is_set_off(commands, conditions)
            && !self.hold.is_some_and(|hold| hold.holds(conditions))
    }
}

/// Which row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TransitionId {
    /// Number 0…15 in the profile.
    Profile(u8),
    /// A move of the drive that the profile does not number.
    Drive(DriveMove),
}

impl fmt::Display for TransitionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Profile(number) => write!(f, "{number}"),
            Self::Drive(drive_move) => f.write_str(drive_move.name()),
        }
    }
}

/// A move outside the sixteen: hardware acts without a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriveMove {
    /// LU: no mains. The drive reports *switch-on disabled* while the message stands.
    /// Source: 9300 fact sheet, section 2.5 (assumed there).
    Undervoltage,
    /// Terminal 28 low: *operation enabled* falls to *switched on*. Source: 9300 fact sheet, section 2.5 (assumed there).
    TerminalLow,
    /// The trip was reset by another way (terminal, keypad, C0043): the bus sees *fault* go.
    /// Source: 9300 fact sheet, section 2.5, "TRIP reset ways".
    TripGone,
}

impl DriveMove {
    /// The move in plain words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Undervoltage => "undervoltage",
            Self::TerminalLow => "terminal 28 low",
            Self::TripGone => "trip gone",
        }
    }
}

/// What sets a transition off: any of the commands, or the event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trigger {
    /// Commands; any of them.
    pub commands: CommandSet,
    /// Event inside the drive.
    pub event: Option<Event>,
}

impl Trigger {
    /// Whether a command of the control word or the state of the drive sets the transition off.
    #[must_use]
    pub fn is_set_off(self, commands: CommandSet, conditions: Conditions) -> bool {
        self.commands.intersects(commands) || self.event.is_some_and(|event| event.happens(conditions))
    }
}

/// `shutdown`, `quick stop | disable voltage`, `disable voltage | standstill reached`.
impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for command in self.commands.iter() {
            write!(f, "{separator}{command}")?;
            separator = " | ";
        }
        match self.event {
            Some(event) => write!(f, "{separator}{}", event.name()),
            None => Ok(()),
        }
    }
}

/// Something the drive finds out by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Event {
    /// Mains or 24 V on; happens by construction of the machine.
    PowerOn,
    /// Self test passed.
    SelfTestDone,
    /// A trip is present.
    Fault,
    /// The reaction to the fault is finished.
    FaultReactionDone,
    /// The quick stop has reached standstill.
    StandstillReached,
    /// LU message.
    Undervoltage,
    /// Terminal 28 is low.
    TerminalLow,
    /// No trip is present.
    NoFault,
}

impl Event {
    /// Whether the conditions show the event.
    #[must_use]
    pub const fn happens(self, conditions: Conditions) -> bool {
        match self {
            Self::PowerOn => false,
            Self::SelfTestDone => conditions.self_test_done,
            Self::Fault => conditions.fault,
            Self::FaultReactionDone => conditions.fault_reaction_done,
            Self::StandstillReached => conditions.quick_stop_done,
            Self::Undervoltage => !conditions.power_ok,
            Self::TerminalLow => !conditions.release,
            Self::NoFault => !conditions.fault,
        }
    }

    /// The event in plain words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PowerOn => "power on",
            Self::SelfTestDone => "self test done",
            Self::Fault => "fault",
            Self::FaultReactionDone => "reaction finished",
            Self::StandstillReached => "standstill reached",
            Self::Undervoltage => "LU message",
            Self::TerminalLow => "terminal 28 low",
            Self::NoFault => "no trip any more",
        }
    }
}

/// A condition that keeps a triggered transition from happening.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Hold {
    /// LU message: no way up.
    Undervoltage,
    /// Terminal 28 low: no way to *operation enabled*.
    TerminalLow,
    /// The cause of the fault still persists.
    CausePresent,
}

impl Hold {
    /// Whether the conditions hold the transition back.
    #[must_use]
    pub const fn holds(self, conditions: Conditions) -> bool {
        match self {
            Self::Undervoltage => !conditions.power_ok,
            Self::TerminalLow => !conditions.release,
            Self::CausePresent => !conditions.fault_cause_gone,
        }
    }
}

/// The sixteen transitions of the profile; index is number.
///
/// Source: 9300 fact sheet, section 2.3, second table. The holds are those of its section 2.5.
pub const TRANSITIONS: [Transition; 16] = {
    use Command::{DisableVoltage, EnableOperation, InhibitOperation, QuickStop, ResetFault, Shutdown, SwitchOn};
    use State::{
        Fault, FaultReactionActive, NotReadyToSwitchOn, OperationEnabled, QuickStopActive, ReadyToSwitchOn,
        SwitchOnDisabled, SwitchedOn,
    };
    let any = &[
        NotReadyToSwitchOn,
        SwitchOnDisabled,
        ReadyToSwitchOn,
        SwitchedOn,
        OperationEnabled,
        QuickStopActive,
    ];
    [
        row(0, &[], NotReadyToSwitchOn, &[], Some(Event::PowerOn), None),
        row(
            1,
            &[NotReadyToSwitchOn],
            SwitchOnDisabled,
            &[],
            Some(Event::SelfTestDone),
            None,
        ),
        row(
            2,
            &[SwitchOnDisabled],
            ReadyToSwitchOn,
            &[Shutdown],
            None,
            Some(Hold::Undervoltage),
        ),
        row(3, &[ReadyToSwitchOn], SwitchedOn, &[SwitchOn], None, None),
        row(
            4,
            &[SwitchedOn],
            OperationEnabled,
            &[EnableOperation],
            None,
            Some(Hold::TerminalLow),
        ),
        row(5, &[OperationEnabled], SwitchedOn, &[InhibitOperation], None, None),
        row(6, &[SwitchedOn], ReadyToSwitchOn, &[Shutdown], None, None),
        row(
            7,
            &[ReadyToSwitchOn],
            SwitchOnDisabled,
            &[QuickStop, DisableVoltage],
            None,
            None,
        ),
        row(8, &[OperationEnabled], ReadyToSwitchOn, &[Shutdown], None, None),
        row(9, &[OperationEnabled], SwitchOnDisabled, &[DisableVoltage], None, None),
        row(
            10,
            &[SwitchedOn],
            SwitchOnDisabled,
            &[DisableVoltage, QuickStop],
            None,
            None,
        ),
        row(11, &[OperationEnabled], QuickStopActive, &[QuickStop], None, None),
        row(
            12,
            &[QuickStopActive],
            SwitchOnDisabled,
            &[DisableVoltage],
            Some(Event::StandstillReached),
            None,
        ),
        row(13, any, FaultReactionActive, &[], Some(Event::Fault), None),
        row(
            14,
            &[FaultReactionActive],
            Fault,
            &[],
            Some(Event::FaultReactionDone),
            None,
        ),
        row(
            15,
            &[Fault],
            SwitchOnDisabled,
            &[ResetFault],
            None,
            Some(Hold::CausePresent),
        ),
    ]
};

/// The drive's own moves, in the order in which they are tried.
///
/// Interpretation: a quick stop that runs when terminal 28 falls stays in *quick stop active* until standstill; the
/// sources name only *operation enabled*.
pub const DRIVE_MOVES: [Transition; 3] = {
    use State::{Fault, OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
    let above_disabled = StateSet::of(&[ReadyToSwitchOn, SwitchedOn, OperationEnabled, QuickStopActive]);
    [
        own(
            DriveMove::Undervoltage,
            above_disabled,
            SwitchOnDisabled,
            Event::Undervoltage,
        ),
        own(
            DriveMove::TerminalLow,
            StateSet::of(&[OperationEnabled]),
            SwitchedOn,
            Event::TerminalLow,
        ),
        own(
            DriveMove::TripGone,
            StateSet::of(&[Fault]),
            SwitchOnDisabled,
            Event::NoFault,
        ),
    ]
};

/// The one row that moves the machine now, or `None`: fault first, then the drive's own moves, then the profile.
///
/// The order matters only between those groups: hardware acts before commands. Inside the profile's table no two
/// rows of a state can fire together, except beside transition 13.
pub(crate) fn next(state: State, commands: CommandSet, conditions: Conditions) -> Option<&'static Transition> {
    let mut rows = ROWS_OF_STATE[state as usize];
    while rows != 0 {
        let transition = ROWS.get(rows.trailing_zeros() as usize)?;
        if transition.fires(state, commands, conditions) {
            return Some(transition);
        }
        rows &= rows - 1;
    }
    None
}

// Both tables in the order of precedence: transition 13, the drive's own moves, then the profile by number.
static ROWS: [Transition; 20] = {
    let mut rows = [TRANSITIONS[13]; 20];
    let mut i = 0;
    while i < DRIVE_MOVES.len() {
        rows[1 + i] = DRIVE_MOVES[i];
        i += 1;
    }
    i = 0;
    while i < TRANSITIONS.len() {
        rows[4 + i] = TRANSITIONS[i];
        i += 1;
    }
    rows
};

// Which rows leave a state, row n at bit n: a state has six at most, and the machine steps once per bus cycle.
const ROWS_OF_STATE: [u32; 8] = {
    let mut masks = [0; 8];
    let mut state = 0;
    while state < State::ALL.len() {
        let mut row = 0;
        while row < ROWS.len() {
            if ROWS[row].from.contains(State::ALL[state]) {
                masks[state] |= 1 << row;
            }
            row += 1;
        }
        state += 1;
    }
    masks
};

const fn row(
    number: u8,
    from: &[State],
    to: State,
    commands: &[Command],
    event: Option<Event>,
    hold: Option<Hold>,
) -> Transition {
    Transition {
        id: TransitionId::Profile(number),
        from: StateSet::of(from),
        to,
        trigger: Trigger {
            commands: CommandSet::of(commands),
            event,
        },
        hold,
    }
}

const fn own(drive_move: DriveMove, from: StateSet, to: State, event: Event) -> Transition {
    Transition {
        id: TransitionId::Drive(drive_move),
        from,
        to,
        trigger: Trigger {
            commands: CommandSet::NONE,
            event: Some(event),
        },
        hold: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_of_a_row_is_its_number() {
        for (index, transition) in TRANSITIONS.iter().enumerate() {
            assert_eq!(transition.id, TransitionId::Profile(index as u8));
        }
    }

    #[test]
    fn a_row_prints_its_number_or_its_name() {
        assert_eq!(TransitionId::Profile(13).to_string(), "13");
        assert_eq!(
            TransitionId::Drive(DriveMove::Undervoltage).to_string(),
            DriveMove::Undervoltage.name()
        );
    }

    #[test]
    fn a_trigger_prints_its_commands_and_its_event() {
        assert_eq!(TRANSITIONS[2].trigger.to_string(), "shutdown");
        assert_eq!(TRANSITIONS[7].trigger.to_string(), "quick stop | disable voltage");
        assert_eq!(
            TRANSITIONS[12].trigger.to_string(),
            "disable voltage | standstill reached"
        );
    }
}
