//! When the telegram being received must have ended.

use crate::station::MAX_TELEGRAM;
use crate::time::{Baud, Duration, Instant};
use crate::wire::{SC, SD1, SD2, SD3, SD4};

/// Follows one transmission from its first character and knows when its last one is due.
///
/// A line may hand over a telegram in pieces and even in two: the first character alone and the rest at its end. So
/// silence after a piece proves nothing, but the length announced in the telegram does. While it is not known
/// (spoiled start), the longest telegram is assumed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reception {
    /// When the first piece ended, and how many characters it had.
    piece_end: Instant,
    piece: usize,
    characters: usize,
    /// First two characters, as far as they were readable.
    head: [Option<u8>; 2],
}

impl Reception {
    /// Begins with the characters that ended at `now`.
    #[inline]
    pub(super) fn begin(now: Instant, octets: &[u8]) -> Self {
        Self {
            piece_end: now,
            piece: octets.len(),
            characters: octets.len(),
            head: [octets.first().copied(), octets.get(1).copied()],
        }
    }

    /// Begins with a character that could not be read.
    pub(super) fn begin_spoiled(now: Instant) -> Self {
        Self {
            piece_end: now,
            piece: 1,
            characters: 1,
            head: [None; 2],
        }
    }

    /// More characters of the same transmission.
    pub(super) fn extend(&mut self, octets: &[u8]) {
        for (slot, &octet) in self.head.iter_mut().skip(self.characters).zip(octets.iter()) {
            *slot = Some(octet);
        }
        self.characters += octets.len();
    }

    /// One more character, which could not be read.
    pub(super) fn extend_spoiled(&mut self) {
        self.characters += 1;
    }

    /// When the last character ends, or the longest telegram would.
    pub(super) fn end(&self, baud: Baud) -> Instant {
        let expected = match self.head {
            [Some(SC), _] => 1,
            [Some(SD4), _] => 3,
            [Some(SD1), _] => 6,
            [Some(SD3), _] => 14,
            [Some(SD2), Some(le)] => (usize::from(le) + 6).min(MAX_TELEGRAM),
            _ => MAX_TELEGRAM,
        };
        let characters = expected.max(self.characters);
        let first_end = self.piece_end - baud.characters(self.piece.saturating_sub(1));
        first_end + baud.characters(characters - 1)
    }

    /// The longest a telegram can take after its first character.
    pub(super) fn longest(baud: Baud) -> Duration {
        baud.characters(MAX_TELEGRAM - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_announced_length_gives_the_end() {
        let baud = Baud::B500000; // 11 bits = 22 µs
        let at = |micros| Instant::ZERO + Duration::from_micros(micros);
        let mut reception = Reception::begin(at(1000), &[SD2]);
        assert_eq!(reception.end(baud), at(1000 + 254 * 22));
        reception.extend(&[0x05]);
        // LE 5: 11 characters in all
        assert_eq!(reception.end(baud), at(1000 + 10 * 22));
        reception.extend_spoiled();
        assert_eq!(reception.end(baud), at(1000 + 10 * 22));
    }

    #[test]
    fn each_start_delimiter_announces_its_length() {
        let baud = Baud::B500000;
        let at = |micros| Instant::ZERO + Duration::from_micros(micros);
        // IEC 61158-4-3: SC is alone, then 3, 6 and 14 characters; 22 µs each, the first ends at 1000 µs.
        for (start, characters) in [(SC, 1), (SD4, 3), (SD1, 6), (SD3, 14)] {
            let reception = Reception::begin(at(1000), &[start]);
            assert_eq!(reception.end(baud), at(1000 + (characters - 1) * 22), "{start:02X}");
        }
        // Four of six at once: the first of them ended three characters before.
        assert_eq!(
            Reception::begin(at(1000), &[SD1, 3, 2, 0x49]).end(baud),
            at(1000 + 2 * 22)
        );
    }

    #[test]
    fn what_comes_is_as_long_as_it_is() {
        let baud = Baud::B500000;
        let at = |micros| Instant::ZERO + Duration::from_micros(micros);
        let mut reception = Reception::begin(at(1000), &[SC]);
        reception.extend(&[0x55, 0x55]);
        reception.extend(&[0x55, 0x55]);
        assert_eq!(reception.end(baud), at(1000 + 4 * 22));
        reception.extend_spoiled();
        reception.extend_spoiled();
        assert_eq!(reception.end(baud), at(1000 + 6 * 22));
        // 254 characters after the first.
        assert_eq!(Reception::longest(baud), Duration::from_micros(254 * 22));
    }

    #[test]
    fn a_spoiled_start_may_be_the_longest_telegram() {
        let baud = Baud::B500000;
        let mut reception = Reception::begin_spoiled(Instant::ZERO);
        reception.extend(&[0x05, 0x05]);
        assert_eq!(reception.end(baud), Instant::ZERO + Duration::from_micros(254 * 22));
    }
}
