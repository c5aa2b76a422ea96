//! The eight states of DRIVECOM profile 20 and their patterns in the status word.

use core::fmt;

use crate::status_word::StatusWord;

/// A state of the drive's profile machine.
///
/// | state | status bits 6 5 3 2 1 0 | mask / value | power stage |
/// |---|---|---|---|
/// | not ready to switch on | `0 x 0 0 0 0` | 4F / 00 | off |
/// | switch-on disabled | `1 x 0 0 0 0` | 4F / 40 | off |
/// | ready to switch on | `0 1 0 0 0 1` | 6F / 21 | off |
/// | switched on | `0 1 0 0 1 1` | 6F / 23 | on allowed, function inhibited |
/// | operation enabled | `0 1 0 1 1 1` | 6F / 27 | on |
/// | quick stop active | `0 0 0 1 1 1` | 6F / 07 | on, ramping down |
/// | fault reaction active | `0 x 1 1 1 1` | 4F / 0F | depends |
/// | fault | `0 x 1 0 0 0` | 4F / 08 | off |
///
/// Source: 9300 fact sheet, section 2.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum State {
    /// Self test; left automatically.
    #[doc(alias = "Nicht einschaltbereit")]
    NotReadyToSwitchOn,
    /// Switch-on inhibited: waits for the command "shutdown".
    #[doc(alias = "Einschaltsperre")]
    SwitchOnDisabled,
    /// Waits for the command "switch on".
    #[doc(alias = "Einschaltbereit")]
    ReadyToSwitchOn,
    /// Power stage may be on, the drive function is inhibited.
    #[doc(alias = "Eingeschaltet")]
    SwitchedOn,
    /// The drive follows its set-values.
    #[doc(alias = "Betrieb freigegeben")]
    OperationEnabled,
    /// The quick-stop ramp runs.
    #[doc(alias = "Schnellhalt aktiv")]
    QuickStopActive,
    /// The drive reacts to a fault.
    #[doc(alias = "Störungsreaktion aktiv")]
    FaultReactionActive,
    /// Power stage off until the fault is reset.
    #[doc(alias = "Störung")]
    Fault,
}

impl State {
    /// All states in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::NotReadyToSwitchOn,
        Self::SwitchOnDisabled,
        Self::ReadyToSwitchOn,
        Self::SwitchedOn,
        Self::OperationEnabled,
        Self::QuickStopActive,
        Self::FaultReactionActive,
        Self::Fault,
    ];

    /// The pattern of this state in the status word.
    #[must_use]
    pub const fn pattern(self) -> Pattern {
        PATTERNS[self as usize]
    }

    /// The state a status word shows; `None` when no pattern fits, which a drive of the profile never sends.
    ///
    /// The eight patterns exclude each other, so the order of the table does not matter.
    #[must_use]
    pub const fn decode(word: StatusWord) -> Option<Self> {
        let mut i = 0;
        while i < Self::ALL.len() {
            if PATTERNS[i].matches(word.0) {
                return Some(Self::ALL[i]);
            }
            i += 1;
        }
        None
    }

    /// The profile's name in plain words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotReadyToSwitchOn => "not ready to switch on",
            Self::SwitchOnDisabled => "switch-on disabled",
            Self::ReadyToSwitchOn => "ready to switch on",
            Self::SwitchedOn => "switched on",
            Self::OperationEnabled => "operation enabled",
            Self::QuickStopActive => "quick stop active",
            Self::FaultReactionActive => "fault reaction active",
            Self::Fault => "fault",
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Bits that count and the value they must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Pattern {
    /// Bits that count.
    pub mask: u16,
    /// Their value; 0 outside the mask.
    pub value: u16,
}

impl Pattern {
    /// Whether `word` has the value in the bits that count.
    #[must_use]
    pub const fn matches(self, word: u16) -> bool {
        word & self.mask == self.value
    }
}

/// A set of states, for the origin column of the transition table.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StateSet(u8);

impl StateSet {
    /// No state; the origin of transition 0, which starts outside the machine.
    pub const NONE: Self = Self(0);

    /// The set of the listed states.
    #[must_use]
    pub const fn of(states: &[State]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < states.len() {
            bits |= 1 << states[i] as u8;
            i += 1;
        }
        Self(bits)
    }

    /// Whether `state` belongs to the set.
    #[must_use]
    pub const fn contains(self, state: State) -> bool {
        self.0 & (1 << state as u8) != 0
    }

    /// The states of the set in the order of [`State::ALL`].
    pub fn iter(self) -> impl Iterator<Item = State> {
        State::ALL.into_iter().filter(move |state| self.contains(*state))
    }
}

impl fmt::Debug for StateSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter()).finish()
    }
}

// In the order of `State::ALL`.
const PATTERNS: [Pattern; 8] = [
    Pattern {
        mask: 0x4F,
        value: 0x00,
    },
    Pattern {
        mask: 0x4F,
        value: 0x40,
    },
    Pattern {
        mask: 0x6F,
        value: 0x21,
    },
    Pattern {
        mask: 0x6F,
        value: 0x23,
    },
    Pattern {
        mask: 0x6F,
        value: 0x27,
    },
    Pattern {
        mask: 0x6F,
        value: 0x07,
    },
    Pattern {
        mask: 0x4F,
        value: 0x0F,
    },
    Pattern {
        mask: 0x4F,
        value: 0x08,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_status_word_fits_two_patterns() {
        for word in 0..=u16::MAX {
            let fitting = State::ALL.iter().filter(|state| state.pattern().matches(word)).count();
            assert!(fitting <= 1, "0x{word:04X} fits {fitting} states");
        }
    }

    #[test]
    fn a_set_shows_its_states() {
        let set = StateSet::of(&[State::Fault, State::SwitchedOn]);
        assert_eq!(format!("{set:?}"), "{SwitchedOn, Fault}");
    }

    #[test]
    fn a_pattern_has_no_value_outside_its_mask() {
        for state in State::ALL {
            assert_eq!(state.pattern().value & !state.pattern().mask, 0, "{state}");
        }
    }

    // Source: 9300 facts 2.2, columns 6 5 3 2 1 0; both values where the column is an x.
    #[test]
    fn decoding_follows_the_bit_columns_of_the_fact_sheet() {
        let rows: [(u16, State); 12] = [
            (0b0000_0000, State::NotReadyToSwitchOn),
            (0b0010_0000, State::NotReadyToSwitchOn),
            (0b0100_0000, State::SwitchOnDisabled),
            (0b0110_0000, State::SwitchOnDisabled),
            (0b0010_0001, State::ReadyToSwitchOn),
            (0b0010_0011, State::SwitchedOn),
            (0b0010_0111, State::OperationEnabled),
            (0b0000_0111, State::QuickStopActive),
            (0b0000_1111, State::FaultReactionActive),
            (0b0010_1111, State::FaultReactionActive),
            (0b0000_1000, State::Fault),
            (0b0010_1000, State::Fault),
        ];
        // Whatever the other bits are (4, 7–15), the state is the same; and no further pattern decodes.
        for other in 0..=u16::MAX {
            let rest = other & !0x006F;
            if other & 0x006F != 0 {
                continue;
            }
            for low in 0..0x80_u16 {
                if low & !0x006F != 0 {
                    continue;
                }
                let expected = rows.iter().find(|(bits, _)| *bits == low).map(|(_, state)| *state);
                assert_eq!(State::decode(StatusWord(rest | low)), expected, "0x{:04X}", rest | low);
            }
        }
    }

    // Source: 9300 facts 2.2, last paragraph.
    #[test]
    fn the_example_words_decode() {
        assert_eq!(State::decode(StatusWord(0x0231)), Some(State::ReadyToSwitchOn));
        assert_eq!(State::decode(StatusWord(0x0233)), Some(State::SwitchedOn));
        assert_eq!(State::decode(StatusWord(0x0237)), Some(State::OperationEnabled));
    }
}
