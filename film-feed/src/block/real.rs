//! S7 REAL arithmetic: IEEE 754 single precision, rounded after every instruction.
//!
//! Rust's `f32` operators do just that, once each instruction is one of them; the functions stand for the instructions of
//! the source. 0/0 and infinity times zero are "not a number" (film-feed specification, section 8.1 point 11), and
//! whatever is calculated from that is too. Only the bits of such a value need a hand: [`stored`].

/// Bit pattern of every "not a number": all ones, as an S7 shows it.
pub(crate) const NAN_BITS: u32 = 0xFFFF_FFFF;

/// `DTR`: DINT to REAL, rounded to nearest even. Above 2^24 the low bits go.
#[inline]
pub(crate) fn dtr(dint: i32) -> f32 {
    dint as f32
}

/// `ITD` then `DTR` on a word: the sign is bit 15.
#[inline]
pub(crate) fn word_to_real(word: u16) -> f32 {
    dtr(i32::from(word as i16))
}

/// `*R`. Infinity times zero is not a number.
#[inline]
pub(crate) fn mul(a: f32, b: f32) -> f32 {
    a * b
}

/// `/R`. A zero divisor gives an infinity with the sign of the dividend; 0/0 is not a number.
///
/// The divisors of the block are never −0: a DINT has no negative zero.
#[inline]
pub(crate) fn div(dividend: f32, divisor: f32) -> f32 {
    dividend / divisor
}

/// A value as it is stored: one bit pattern for all NaN. Which one the host's unit makes is not defined, and replay
/// compares bits. To be called where a result can be not a number, once, at the end: on the way the pattern has no effect.
#[inline]
pub(crate) fn stored(value: f32) -> f32 {
    if value.is_nan() {
        f32::from_bits(NAN_BITS)
    } else {
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinity_times_zero_is_all_ones() {
        assert_eq!(stored(mul(f32::INFINITY, 0.0)).to_bits(), 0xFFFF_FFFF);
        assert_eq!(stored(mul(0.0, f32::NEG_INFINITY)).to_bits(), 0xFFFF_FFFF);
    }

    #[test]
    fn a_zero_divisor_gives_an_infinity_with_the_sign_of_the_dividend() {
        assert_eq!(stored(div(1.5, 0.0)).to_bits(), 0x7F80_0000);
        assert_eq!(stored(div(-1.5, 0.0)).to_bits(), 0xFF80_0000);
    }

    /// IEEE 754; film-feed specification, section 8.1 point 11.
    #[test]
    fn zero_by_zero_is_all_ones_and_so_is_what_is_calculated_from_it() {
        for dividend in [0.0, -0.0] {
            let quotient = div(dividend, 0.0);
            for result in [quotient, mul(quotient, 0.0), mul(2.0, quotient), div(1.0, quotient)] {
                assert_eq!(stored(result).to_bits(), 0xFFFF_FFFF);
            }
        }
    }

    #[test]
    fn a_word_is_sign_extended_and_a_large_double_word_loses_its_low_bits() {
        assert_eq!(word_to_real(0x8000), -32768.0);
        assert_eq!(word_to_real(0x7FFF), 32767.0);
        // 2^24 + 1 lies halfway between two REAL; it goes to the even one.
        assert_eq!(dtr(16_777_217), 16_777_216.0);
    }
}
