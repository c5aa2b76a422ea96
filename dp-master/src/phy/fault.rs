//! Disturbances of a line: bit errors by chance, and faults at a chosen place.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::station::LineError;
use crate::time::{BITS_PER_CHARACTER, Instant};

/// Bit errors by chance, repeatable for a seed.
///
/// The rate acts on each of the 11 bits of a character. A receiver sees what a UART would make of it:
///
/// | bits flipped | received as |
/// |---|---|
/// | start or stop | [`LineError::Framing`] |
/// | an odd number of data and parity bits | [`LineError::Parity`] |
/// | an even number of data and parity bits | another octet, unnoticed |
///
/// A flipped start bit really makes a UART miss the beginning and read the next edge as one; here that character alone is lost.
///
/// Instead of asking for every bit, the distance to the next flipped one is drawn (geometric distribution), so that an undisturbed
/// character costs nothing. Nothing here uses the platform's mathematics: the same seed gives the same bits everywhere.
#[derive(Clone, Debug)]
pub struct Disturbance {
    rng: Pcg64Mcg,
    rate: f64,
    /// ln(1 − rate).
    ln_keep: f64,
    /// Bits that pass before the next flipped one; [`u64::MAX`] when there is none.
    clean_bits: u64,
}

/// Why there is no such disturbance.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DisturbanceError {
    /// A probability is needed.
    #[error("bit error rate must be 0 to 1, got {got}")]
    Rate {
        /// The number given.
        got: f64,
    },
}

impl Disturbance {
    /// Bit errors with probability `bit_error_rate` (0…1) for each bit.
    ///
    /// # Errors
    ///
    /// [`DisturbanceError::Rate`] outside 0…1 and for NaN.
    pub fn new(seed: u64, bit_error_rate: f64) -> Result<Self, DisturbanceError> {
        if !(0.0..=1.0).contains(&bit_error_rate) {
            return Err(DisturbanceError::Rate { got: bit_error_rate });
        }
        let mut this = Self {
            rng: Pcg64Mcg::seed_from_u64(seed),
            rate: bit_error_rate,
            ln_keep: ln_one_minus(bit_error_rate),
            clean_bits: u64::MAX,
        };
        this.clean_bits = this.draw();
        Ok(this)
    }

    /// The probability for each bit.
    #[must_use]
    pub const fn bit_error_rate(&self) -> f64 {
        self.rate
    }

    /// Takes a burst of characters and calls `flip` with the index of each disturbed one and its flipped bits: bit 0 is the start bit, 1…8
    /// are the data, 9 is the parity, 10 is the stop bit.
    ///
    /// Costs a comparison when nothing is disturbed.
    #[inline]
    pub(super) fn burst(&mut self, characters: usize, flip: impl FnMut(usize, u16)) {
        let bits = characters as u64 * u64::from(BITS_PER_CHARACTER);
        if self.clean_bits >= bits {
            if self.clean_bits != u64::MAX {
                self.clean_bits -= bits;
            }
            return;
        }
        self.spoil(bits, flip);
    }

    #[cold]
    fn spoil(&mut self, bits: u64, mut flip: impl FnMut(usize, u16)) {
        let per_character = u64::from(BITS_PER_CHARACTER);
        let mut at = self.clean_bits;
        while at < bits {
            let character = at / per_character;
            let mut mask = 0_u16;
            while at < bits && at / per_character == character {
                mask |= 1 << (at % per_character);
                at = at.saturating_add(1).saturating_add(self.draw());
            }
            flip(character as usize, mask);
        }
        // A distance that has no end stays endless.
        self.clean_bits = if at == u64::MAX { at } else { at - bits };
    }

    /// How many bits pass before the next flipped one.
    fn draw(&mut self) -> u64 {
        if self.rate <= 0.0 {
            return u64::MAX;
        }
        if self.rate >= 1.0 {
            return 0;
        }
        // 53 bits, uniform in (0, 1].
        let uniform = ((self.rng.next_u64() >> 11) + 1) as f64 * (1.0 / (1_u64 << 53) as f64);
        // The cast saturates.
        (ln(uniform) / self.ln_keep) as u64
    }
}

/// What a UART makes of a character with these bits flipped: an error, or the mask for its eight data bits.
#[inline]
pub(super) fn received(flipped: u16) -> Result<u8, LineError> {
    const START_AND_STOP: u16 = 0b100_0000_0001;
    const DATA_AND_PARITY: u16 = 0b011_1111_1110;
    if flipped & START_AND_STOP != 0 {
        Err(LineError::Framing)
    } else if (flipped & DATA_AND_PARITY).count_ones() % 2 == 1 {
        Err(LineError::Parity)
    } else {
        Ok((flipped >> 1) as u8)
    }
}

/// A fault at a chosen place, for tests. Bursts and characters are counted from 0.
///
/// Bursts are numbered in the order of `transmit` calls; [`VirtualBus::bursts`](super::VirtualBus::bursts) is the number of the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Script {
    /// Nobody receives this burst; the line stays idle.
    Drop {
        /// Its number.
        burst: u64,
    },
    /// One character of a burst cannot be received.
    Spoil {
        /// Number of the burst.
        burst: u64,
        /// Index of the character.
        character: usize,
        /// What the receivers report.
        error: LineError,
    },
    /// Bits of one character of a burst are flipped; the receivers see what a UART makes of it.
    Flip {
        /// Number of the burst.
        burst: u64,
        /// Index of the character.
        character: usize,
        /// Bit 0 is the start bit, 1…8 are the data, 9 is the parity, 10 is the stop bit.
        bits: u16,
    },
    /// The line is cut: no character that ends in this time reaches anyone.
    Cut {
        /// Begin, included.
        from: Instant,
        /// End, not included.
        to: Instant,
    },
}

/// ln(1 − p) for 0 ≤ p ≤ 1, accurate also for the smallest p.
fn ln_one_minus(p: f64) -> f64 {
    if p < 0.25 {
        2.0 * atanh_series(-p / (2.0 - p))
    } else {
        ln(1.0 - p)
    }
}

/// Natural logarithm of 0 < x ≤ 1 by basic operations only, to about 2 units in the last place; −∞ at 0.
fn ln(x: f64) -> f64 {
    if x <= 0.0 {
        return f64::NEG_INFINITY;
    }
    // x = m · 2^e with √½ ≤ m < √2; subnormal numbers do not occur here.
    let bits = x.to_bits();
    let mut exponent = ((bits >> 52) & 0x7FF) as i64 - 1_023;
    let mut mantissa = f64::from_bits((bits & 0x000F_FFFF_FFFF_FFFF) | 0x3FF0_0000_0000_0000);
    if mantissa > core::f64::consts::SQRT_2 {
        mantissa *= 0.5;
        exponent += 1;
    }
    2.0 * atanh_series((mantissa - 1.0) / (mantissa + 1.0)) + exponent as f64 * core::f64::consts::LN_2
}

/// artanh(s) = s + s³/3 + s⁵/5 + … for |s| ≤ 0.172: the twelfth term is below 10⁻¹⁸.
fn atanh_series(s: f64) -> f64 {
    let square = s * s;
    let mut sum = 0.0;
    for k in (0..12_u32).rev() {
        sum = sum * square + 1.0 / f64::from(2 * k + 1);
    }
    s * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flips(seed: u64, rate: f64, bursts: usize, characters: usize) -> Vec<(usize, usize, u16)> {
        let mut disturbance = Disturbance::new(seed, rate).unwrap();
        let mut list = Vec::new();
        for burst in 0..bursts {
            disturbance.burst(characters, |index, mask| list.push((burst, index, mask)));
        }
        list
    }

    #[test]
    fn the_logarithm_is_that_of_the_library() {
        for x in [1.0, 0.999_999, 0.75, 0.707, 0.5, 0.1, 1e-3, 1e-9, 1.1e-16] {
            assert!(
                (ln(x) - f64::ln(x)).abs() <= 4e-16 * f64::ln(x).abs().max(1e-300),
                "ln {x}"
            );
        }
        for p in [1e-15, 1e-9, 1e-5, 1e-3, 0.1, 0.24, 0.26, 0.9] {
            let library = f64::ln_1p(-p);
            assert!(
                (ln_one_minus(p) - library).abs() <= 1e-15 * library.abs(),
                "ln(1 - {p})"
            );
        }
    }

    #[test]
    fn the_same_seed_flips_the_same_bits_and_another_seed_others() {
        assert_eq!(flips(7, 1e-3, 1_000, 25), flips(7, 1e-3, 1_000, 25));
        assert_ne!(flips(7, 1e-3, 1_000, 25), flips(8, 1e-3, 1_000, 25));
    }

    #[test]
    fn the_measured_error_rate_is_the_set_one() {
        for rate in [1e-4, 1e-3, 1e-2, 0.3] {
            let bits = 40_000.0 * 25.0 * 11.0;
            let flipped: u32 = flips(1, rate, 40_000, 25)
                .iter()
                .map(|(_, _, mask)| mask.count_ones())
                .sum();
            // Five standard deviations of the binomial distribution.
            let tolerance = 5.0 * (bits * rate * (1.0 - rate)).sqrt();
            assert!(
                (f64::from(flipped) - bits * rate).abs() < tolerance,
                "{rate}: {flipped} of {bits} bits"
            );
        }
    }

    #[test]
    fn every_one_of_the_eleven_bits_is_hit_alike() {
        let mut counts = [0_u32; 11];
        for (_, _, mask) in flips(3, 1e-2, 40_000, 25) {
            for (bit, count) in counts.iter_mut().enumerate() {
                *count += u32::from(mask >> bit & 1);
            }
        }
        // 10⁶ characters at 10⁻²: 10 000 each, standard deviation 100.
        for (bit, count) in counts.into_iter().enumerate() {
            assert!((9_500..10_500).contains(&count), "bit {bit}: {count}");
        }
    }

    #[test]
    fn rate_0_spoils_nothing_and_rate_1_spoils_every_bit() {
        assert!(flips(1, 0.0, 10_000, 255).is_empty());
        let all = flips(1, 1.0, 3, 2);
        assert_eq!(
            all,
            [
                (0, 0, 0x7FF),
                (0, 1, 0x7FF),
                (1, 0, 0x7FF),
                (1, 1, 0x7FF),
                (2, 0, 0x7FF),
                (2, 1, 0x7FF)
            ]
        );
    }

    #[test]
    fn a_rate_that_is_no_probability_is_refused() {
        for rate in [-1e-9, 1.000_001, f64::NAN, f64::INFINITY] {
            assert!(Disturbance::new(1, rate).is_err());
        }
    }

    #[test]
    fn a_uart_sees_framing_before_parity_and_misses_two_flips() {
        assert_eq!(received(0b000_0000_0001), Err(LineError::Framing));
        assert_eq!(received(0b100_0000_0000), Err(LineError::Framing));
        assert_eq!(received(0b100_0000_0010), Err(LineError::Framing));
        assert_eq!(received(0b010_0000_0000), Err(LineError::Parity));
        assert_eq!(received(0b000_0000_0010), Err(LineError::Parity));
        assert_eq!(received(0b010_0000_0010), Ok(0x01));
        assert_eq!(received(0b001_0000_0010), Ok(0x81));
    }
}
