//! S7 REAL arithmetic: IEEE 754 single precision, rounded after every instruction, with the S7's special values.

/// Bit pattern of every "not a number": all ones, as the S7 soft PLC of the golden traces shows it.
pub(crate) const NAN_BITS: u32 = 0xFFFF_FFFF;

/// `DTR`: DINT to REAL, rounded to nearest even. Above 2^24 the low bits go.
pub(crate) fn dtr(dint: i32) -> f32 {
    dint as f32
}

/// `ITD` then `DTR` on a word: the sign is bit 15.
pub(crate) fn word_to_real(word: u16) -> f32 {
    dtr(i32::from(word as i16))
}

/// `*R`. Infinity times zero is not a number.
pub(crate) fn mul(a: f32, b: f32) -> f32 {
    canonical(a * b)
}

/// `/R`. A zero divisor gives an infinity with the sign of the dividend.
///
/// Interpretation: that includes 0/0, which IEEE 754 would call not a number. The S7 soft PLC which executed the printed
/// source for the golden traces gives +∞, and so does this function. It shows only when a gear numerator of zero meets a
/// gear denominator that is not: before the constants were read the multiplication by zero that follows makes it not a
/// number either way. See `PARITY.md`.
pub(crate) fn div(dividend: f32, divisor: f32) -> f32 {
    if divisor == 0.0 && !dividend.is_nan() {
        return if dividend >= 0.0 {
            f32::INFINITY
        } else {
            f32::NEG_INFINITY
        };
    }
    canonical(dividend / divisor)
}

/// One bit pattern for all NaN: which one the host's unit makes is not defined, and replay compares bits.
fn canonical(value: f32) -> f32 {
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
        assert_eq!(mul(f32::INFINITY, 0.0).to_bits(), 0xFFFF_FFFF);
        assert_eq!(mul(0.0, f32::NEG_INFINITY).to_bits(), 0xFFFF_FFFF);
    }

    #[test]
    fn a_zero_divisor_gives_an_infinity_with_the_sign_of_the_dividend() {
        assert_eq!(div(1.5, 0.0).to_bits(), 0x7F80_0000);
        assert_eq!(div(-1.5, 0.0).to_bits(), 0xFF80_0000);
        assert_eq!(div(0.0, 0.0).to_bits(), 0x7F80_0000);
    }

    #[test]
    fn a_word_is_sign_extended_and_a_large_double_word_loses_its_low_bits() {
        assert_eq!(word_to_real(0x8000), -32768.0);
        assert_eq!(word_to_real(0x7FFF), 32767.0);
        // 2^24 + 1 lies halfway between two REAL; it goes to the even one.
        assert_eq!(dtr(16_777_217), 16_777_216.0);
    }
}
