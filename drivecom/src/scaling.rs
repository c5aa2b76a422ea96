//! What the numbers in the process words mean.
//!
//! Source: film-feed specification, section 7 (16384 = 100 % of C0011, low word first).

/// Counts of a process word at 100 %.
pub const FULL_SCALE: i16 = 16_384;

/// Percent of C0011 of a process word: −200.0 … +199.99 %.
///
/// Exact in `f64`: one count is 100/16384 = 0.006103515625 %.
#[must_use]
pub fn percent_from_raw(raw: i16) -> f64 {
    f64::from(raw) / f64::from(FULL_SCALE) * 100.0
}

/// A percentage that no process word can carry.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("expected a percentage within -200 and 199.99, got {percent}")]
pub struct PercentOutOfRange {
    /// What was asked for, in percent of C0011.
    pub percent: f64,
}

/// The process word nearest to a percentage, halves away from zero.
///
/// # Errors
///
/// [`PercentOutOfRange`] when the rounded count does not fit 16 bits, or for NaN.
pub fn raw_from_percent(percent: f64) -> Result<i16, PercentOutOfRange> {
    let counts = percent / 100.0 * f64::from(FULL_SCALE);
    let rounded = counts + if counts < 0.0 { -0.5 } else { 0.5 };
    // Written so that NaN fails as well.
    if rounded > f64::from(i16::MIN) - 1.0 && rounded < f64::from(i16::MAX) + 1.0 {
        Ok(rounded as i16)
    } else {
        Err(PercentOutOfRange { percent })
    }
}

/// The 32-bit value of two process words, **low word first**.
#[must_use]
pub const fn join_low_first(low: u16, high: u16) -> i32 {
    ((high as u32) << 16 | low as u32) as i32
}

/// The two process words of a 32-bit value: low word, high word.
#[must_use]
pub const fn split_low_first(value: i32) -> (u16, u16) {
    let bits = value as u32;
    (bits as u16, (bits >> 16) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Source: 9300 facts 11: MCTRL_NACT 4 / 11 LSB, and 1200 mm/s.
    #[test]
    fn the_check_values_of_the_fact_sheet_come_out() {
        assert!((percent_from_raw(4) - 0.024_414_06).abs() < 1e-8);
        assert!((percent_from_raw(11) - 0.067_138_67).abs() < 1e-8);
        // 2814.5292 rpm of C0011 = 3000 rpm.
        assert_eq!(raw_from_percent(2814.5292 / 3000.0 * 100.0), Ok(15_371));
    }

    // Source: film-feed specification, section 8.1, point 12.
    #[test]
    fn the_speed_word_is_signed_from_minus_200_to_199_99_percent() {
        assert_eq!(percent_from_raw(i16::MIN), -200.0);
        assert!((percent_from_raw(i16::MAX) - 199.99).abs() < 0.005);
    }

    #[test]
    fn every_word_survives_percent_and_back() {
        for raw in i16::MIN..=i16::MAX {
            assert_eq!(raw_from_percent(percent_from_raw(raw)), Ok(raw));
        }
    }

    #[test]
    fn a_percentage_beyond_the_word_is_refused() {
        // Halves go away from zero, so these two are the first on either side that miss the word; both exact in binary.
        let half_above = 32_767.5 / 16_384.0 * 100.0;
        let half_below = -32_768.5 / 163.84;
        for percent in [200.0, -200.01, half_above, half_below, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(raw_from_percent(percent), Err(PercentOutOfRange { percent }));
        }
        assert!(raw_from_percent(f64::NAN).is_err());
    }

    // 1200 mm = 3 074 216 inc (9300 facts 11) = 0x002E_E8A8.
    #[test]
    fn a_position_travels_low_word_first() {
        assert_eq!(split_low_first(3_074_216), (0xE8A8, 0x002E));
        assert_eq!(join_low_first(0xE8A8, 0x002E), 3_074_216);
        for value in [0, 1, -1, i32::MIN, i32::MAX, 0x0001_0000, -65_536] {
            let (low, high) = split_low_first(value);
            assert_eq!(join_low_first(low, high), value);
        }
    }
}
