//! The profile's commands and their patterns in the control word.

use core::fmt;

use crate::control_word::ControlWord;
use crate::state::Pattern;

/// A command of DRIVECOM profile 20.
///
/// | command | control bits 7 3 2 1 0 |
/// |---|---|
/// | shutdown | `x x 1 1 0` |
/// | switch on | `x x 1 1 1` |
/// | enable operation | `x 1 1 1 1` |
/// | inhibit operation | `x 0 1 1 1` |
/// | quick stop | `x x 0 1 x` |
/// | disable voltage | `x x x 0 x` |
/// | reset fault | `0→1 x x x x` |
///
/// The patterns overlap on purpose: `x 1 1 1 1` is "switch on" **and** "enable operation", which is how a drive walks
/// from *ready* through *switched on* to *operation enabled* on a standing word. So a control word carries a
/// [`CommandSet`], and the state decides which member acts.
///
/// Source: 9300 fact sheet, section 2.3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Command {
    /// Go to (or back to) *ready to switch on*.
    #[doc(alias = "Stillsetzen")]
    Shutdown,
    /// Go to *switched on*.
    #[doc(alias = "Einschalten")]
    SwitchOn,
    /// Go to *operation enabled*.
    #[doc(alias = "Betrieb freigeben")]
    EnableOperation,
    /// Go back to *switched on*.
    #[doc(alias = "Betrieb sperren")]
    InhibitOperation,
    /// Brake from *operation enabled*; from the states below, power stage off.
    #[doc(alias = "Schnellhalt")]
    QuickStop,
    /// Power stage off at once.
    #[doc(alias = "Spannung sperren")]
    DisableVoltage,
    /// Leave *fault*; acts with the rising edge of bit 7.
    #[doc(alias = "Störung zurücksetzen")]
    ResetFault,
}

impl Command {
    /// All commands in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::Shutdown,
        Self::SwitchOn,
        Self::EnableOperation,
        Self::InhibitOperation,
        Self::QuickStop,
        Self::DisableVoltage,
        Self::ResetFault,
    ];

    /// The bits of the control word that make this command. For [`Command::ResetFault`] the level after the edge.
    #[must_use]
    pub const fn pattern(self) -> Pattern {
        let (mask, value) = match self {
            Self::Shutdown => (0x07, 0x06),
            Self::SwitchOn => (0x07, 0x07),
            Self::EnableOperation => (0x0F, 0x0F),
            Self::InhibitOperation => (0x0F, 0x07),
            Self::QuickStop => (0x06, 0x02),
            Self::DisableVoltage => (0x02, 0x00),
            Self::ResetFault => (0x80, 0x80),
        };
        Pattern { mask, value }
    }

    /// The control word with nothing but this command: bits that do not count are 0.
    ///
    /// "Switch on" and "inhibit operation" come out as the same word; the profile means it so.
    #[must_use]
    pub const fn control_word(self) -> ControlWord {
        ControlWord(self.pattern().value)
    }

    /// The profile's name in plain words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shutdown => "shutdown",
            Self::SwitchOn => "switch on",
            Self::EnableOperation => "enable operation",
            Self::InhibitOperation => "inhibit operation",
            Self::QuickStop => "quick stop",
            Self::DisableVoltage => "disable voltage",
            Self::ResetFault => "reset fault",
        }
    }
}

impl fmt::Display for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What bit 7 of the control word did since the last module cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ResetEdge {
    /// It rose: "reset fault" is commanded.
    Rising,
    /// It stood still or fell.
    None,
}

impl ResetEdge {
    /// The edge between two consecutive control words.
    #[must_use]
    pub const fn between(previous: ControlWord, current: ControlWord) -> Self {
        if current.reset_fault() && !previous.reset_fault() {
            Self::Rising
        } else {
            Self::None
        }
    }
}

/// The commands one control word carries.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct CommandSet(u8);

impl CommandSet {
    /// No command.
    pub const NONE: Self = Self(0);

    /// The set of the listed commands.
    #[must_use]
    pub const fn of(commands: &[Command]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < commands.len() {
            bits |= 1 << commands[i] as u8;
            i += 1;
        }
        Self(bits)
    }

    /// All commands whose pattern fits `control`; "reset fault" only with its edge.
    #[must_use]
    pub const fn decode(control: ControlWord, edge: ResetEdge) -> Self {
        // One of three exclusive families by bits 1 and 2, then the finer patterns; see the table above.
        let family = LEVEL_COMMANDS[(control.0 & 0x0F) as usize];
        match edge {
            ResetEdge::Rising => Self(family.0 | 1 << Command::ResetFault as u8),
            ResetEdge::None => family,
        }
    }

    /// Whether `command` belongs to the set.
    #[must_use]
    pub const fn contains(self, command: Command) -> bool {
        self.0 & (1 << command as u8) != 0
    }

    /// Whether the sets share a command.
    #[must_use]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// The commands of the set in the order of [`Command::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Command> {
        Command::ALL.into_iter().filter(move |command| self.contains(*command))
    }
}

impl fmt::Debug for CommandSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

// Commands of the sixteen values of bits 3 2 1 0, computed from the patterns when the crate is built.
const LEVEL_COMMANDS: [CommandSet; 16] = {
    let mut table = [CommandSet::NONE; 16];
    let mut word = 0;
    while word < 16 {
        let mut i = 0;
        while i < Command::ALL.len() {
            let command = Command::ALL[i];
            if !matches!(command, Command::ResetFault) && command.pattern().matches(word as u16) {
                table[word].0 |= 1 << command as u8;
            }
            i += 1;
        }
        word += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;
    use Command::{DisableVoltage, EnableOperation, InhibitOperation, QuickStop, ResetFault, Shutdown, SwitchOn};

    // Source: 9300 facts 2.3, typed from the pattern table; index is bits 3 2 1 0.
    #[test]
    fn each_value_of_the_low_bits_carries_the_commands_of_the_fact_sheet() {
        let expected: [&[Command]; 16] = [
            &[DisableVoltage],
            &[DisableVoltage],
            &[QuickStop],
            &[QuickStop],
            &[DisableVoltage],
            &[DisableVoltage],
            &[Shutdown],
            &[SwitchOn, InhibitOperation],
            &[DisableVoltage],
            &[DisableVoltage],
            &[QuickStop],
            &[QuickStop],
            &[DisableVoltage],
            &[DisableVoltage],
            &[Shutdown],
            &[SwitchOn, EnableOperation],
        ];
        for word in 0..=u16::MAX {
            let set = CommandSet::decode(ControlWord(word), ResetEdge::None);
            assert!(
                set.iter().eq(expected[usize::from(word & 0x0F)].iter().copied()),
                "0x{word:04X}: {set:?}"
            );
        }
    }

    #[test]
    fn reset_fault_joins_whatever_else_is_commanded() {
        let set = CommandSet::decode(ControlWord(0x0087), ResetEdge::Rising);
        assert_eq!(set, CommandSet::of(&[SwitchOn, InhibitOperation, ResetFault]));
    }

    #[test]
    fn only_a_rising_bit_7_is_an_edge() {
        let (low, high) = (ControlWord(0x0000), ControlWord(0x0080));
        assert_eq!(ResetEdge::between(low, high), ResetEdge::Rising);
        assert_eq!(ResetEdge::between(high, high), ResetEdge::None);
        assert_eq!(ResetEdge::between(high, low), ResetEdge::None);
        assert_eq!(ResetEdge::between(low, low), ResetEdge::None);
    }

    #[test]
    fn the_bare_word_of_a_command_carries_it() {
        for command in Command::ALL {
            let edge = ResetEdge::between(ControlWord(0), command.control_word());
            assert!(
                CommandSet::decode(command.control_word(), edge).contains(command),
                "{command}"
            );
        }
    }

    #[test]
    fn a_set_shows_its_commands() {
        assert_eq!(
            format!("{:?}", CommandSet::of(&[EnableOperation, SwitchOn])),
            "{SwitchOn, EnableOperation}"
        );
        assert_eq!(format!("{:?}", CommandSet::NONE), "{}");
    }
}
