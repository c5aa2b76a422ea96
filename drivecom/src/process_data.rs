//! The four process words of the bus image.

use crate::control_word::ControlWord;
use crate::scaling::{join_low_first, split_low_first};
use crate::status_word::StatusWord;

/// Four process words in eight consistent octets.
///
/// Layout: `word0` to `word3` in this order, each high octet first.
///
/// | word | to the drive | from the drive |
/// |---|---|---|
/// | 0 | control word | status word |
/// | 1 | – | MCTRL-NACT, 16384 = 100 % of C0011 |
/// | 2 | – | POS-ACT in increments, **low** word |
/// | 3 | – | POS-ACT in increments, **high** word |
///
/// Source: film-feed specification, section 7; 9300 fact sheet, section 9, row 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "PZD")]
pub struct ProcessData {
    /// Control or status word.
    pub word0: u16,
    /// Process word 1.
    pub word1: u16,
    /// Process word 2.
    pub word2: u16,
    /// Process word 3.
    pub word3: u16,
}

impl ProcessData {
    /// Octets of the image.
    pub const LEN: usize = 8;

    /// The words of an image.
    #[must_use]
    pub const fn from_octets(octets: [u8; Self::LEN]) -> Self {
        let [a, b, c, d, e, f, g, h] = octets;
        Self {
            word0: u16::from_be_bytes([a, b]),
            word1: u16::from_be_bytes([c, d]),
            word2: u16::from_be_bytes([e, f]),
            word3: u16::from_be_bytes([g, h]),
        }
    }

    /// The image of the words.
    #[must_use]
    pub const fn to_octets(self) -> [u8; Self::LEN] {
        let [a, b] = self.word0.to_be_bytes();
        let [c, d] = self.word1.to_be_bytes();
        let [e, f] = self.word2.to_be_bytes();
        let [g, h] = self.word3.to_be_bytes();
        [a, b, c, d, e, f, g, h]
    }

    /// What a master sends: the control word, the other words zero.
    #[must_use]
    pub const fn command(control: ControlWord) -> Self {
        Self {
            word0: control.0,
            word1: 0,
            word2: 0,
            word3: 0,
        }
    }

    /// What the drive sends: status word, speed in counts (16384 = 100 % of C0011), position in increments.
    #[must_use]
    pub const fn actual(status: StatusWord, speed: i16, position: i32) -> Self {
        let (word2, word3) = split_low_first(position);
        Self {
            word0: status.0,
            word1: speed as u16,
            word2,
            word3,
        }
    }

    /// Word 0 read as a control word.
    #[must_use]
    pub const fn control_word(self) -> ControlWord {
        ControlWord(self.word0)
    }

    /// Word 0 read as a status word.
    #[must_use]
    pub const fn status_word(self) -> StatusWord {
        StatusWord(self.word0)
    }

    /// Word 1 read as a signed speed, 16384 = 100 % of C0011.
    #[must_use]
    #[doc(alias = "MCTRL-NACT")]
    pub const fn speed(self) -> i16 {
        self.word1 as i16
    }

    /// Words 2 and 3 read as a position in increments (65536 per motor revolution).
    #[must_use]
    #[doc(alias = "POS-ACT")]
    pub const fn position(self) -> i32 {
        join_low_first(self.word2, self.word3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    // Source: film-feed specification, section 7: big-endian words, position low word first.
    #[test]
    fn the_image_shows_status_speed_and_position_in_the_order_of_the_bus() {
        let data = ProcessData::actual(StatusWord(0x0237), 15_371, 3_074_216);
        assert_eq!(data.to_octets(), [0x02, 0x37, 0x3C, 0x0B, 0xE8, 0xA8, 0x00, 0x2E]);
        assert_eq!(
            (data.status_word(), data.speed(), data.position()),
            (StatusWord(0x0237), 15_371, 3_074_216)
        );
    }

    #[test]
    fn a_command_leaves_the_other_words_zero() {
        let octets = ProcessData::command(ControlWord(0x007F)).to_octets();
        assert_eq!(octets, [0x00, 0x7F, 0, 0, 0, 0, 0, 0]);
        assert_eq!(ProcessData::from_octets(octets).control_word(), ControlWord(0x007F));
    }

    proptest! {
        #[test]
        fn every_image_survives_the_round_trip(octets in any::<[u8; 8]>()) {
            prop_assert_eq!(ProcessData::from_octets(octets).to_octets(), octets);
        }
    }
}
