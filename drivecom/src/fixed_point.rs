//! Values of codes: signed 32-bit numbers with four decimals.

use core::fmt;
use core::str::FromStr;

/// A value of a code: an `i32` that counts ten-thousandths, −214748.3648 … 214748.3647.
///
/// Source: 9300 fact sheet, section 3.2 ("C0039/x = 150.4 → 1 504 000 = 0x0016F300").
///
/// # Example
///
/// ```
/// use drivecom::FixedPoint;
///
/// let value: FixedPoint = "1200.0".parse()?;
/// assert_eq!(value.raw(), 0x00B7_1B00);
/// assert_eq!(value.to_string(), "1200.0000");
/// # Ok::<(), drivecom::ParseFixedPointError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[doc(alias = "Festkomma")]
pub struct FixedPoint(i32);

impl FixedPoint {
    /// Ten-thousandths per unit.
    pub const SCALE: i32 = 10_000;
    /// Zero.
    pub const ZERO: Self = Self(0);
    /// −214748.3648.
    pub const MIN: Self = Self(i32::MIN);
    /// 214748.3647.
    pub const MAX: Self = Self(i32::MAX);

    /// The value of so many ten-thousandths, as the bus carries it.
    #[must_use]
    pub const fn from_raw(ten_thousandths: i32) -> Self {
        Self(ten_thousandths)
    }

    /// Ten-thousandths, as the bus carries them.
    #[must_use]
    pub const fn raw(self) -> i32 {
        self.0
    }

    /// The nearest value to `units`, halves away from zero; `None` when it does not fit or is no number.
    #[must_use]
    pub fn from_f64(units: f64) -> Option<Self> {
        let scaled = units * f64::from(Self::SCALE);
        let half = if scaled < 0.0 { -0.5 } else { 0.5 };
        let rounded = scaled + half;
        // Written so that NaN fails as well.
        if rounded > f64::from(i32::MIN) - 1.0 && rounded < f64::from(i32::MAX) + 1.0 {
            Some(Self(rounded as i32))
        } else {
            None
        }
    }

    /// The value in units; exact to one rounding of `f64`.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / f64::from(Self::SCALE)
    }
}

/// Always four decimals, a minus only where needed: `1200.0000`, `-0.0001`.
impl fmt::Display for FixedPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        let magnitude = self.0.unsigned_abs();
        let scale = Self::SCALE.unsigned_abs();
        write!(f, "{sign}{}.{:04}", magnitude / scale, magnitude % scale)
    }
}

/// Why a text is no value of a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseFixedPointError {
    /// There is no digit in the text.
    #[error("expected a decimal number, got a text without digits")]
    NoDigits,
    /// A character that belongs to no decimal number.
    #[error("expected a decimal number, got {found:?} at octet {position}")]
    UnexpectedCharacter {
        /// The character.
        found: char,
        /// Its octet offset in the text.
        position: usize,
    },
    /// A digit other than 0 after the fourth decimal: the value cannot be kept exactly.
    #[error("expected at most four decimals, got another digit at octet {position}")]
    TooPrecise {
        /// Octet offset of that digit.
        position: usize,
    },
    /// Outside −214748.3648 … 214748.3647.
    #[error("expected a value within -214748.3648 and 214748.3647")]
    OutOfRange,
}

impl FromStr for FixedPoint {
    type Err = ParseFixedPointError;

    /// Reads `[+|-]digits[.digits]` exactly; either side of the point may be empty, zeros after the fourth decimal
    /// are allowed.
    ///
    /// # Errors
    ///
    /// Every variant of [`ParseFixedPointError`]; the value is never rounded or clamped.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let negative = text.starts_with('-');
        let mut raw = 0_i32;
        let mut decimals: Option<u32> = None;
        let mut any_digit = false;
        for (position, found) in text.char_indices() {
            match found {
                '+' | '-' if position == 0 => {}
                '.' if decimals.is_none() => decimals = Some(0),
                '0'..='9' => {
                    any_digit = true;
                    match &mut decimals {
                        Some(4) if found == '0' => continue,
                        Some(4) => return Err(ParseFixedPointError::TooPrecise { position }),
                        Some(count) => *count += 1,
                        None => {}
                    }
                    let digit = found as i32 - '0' as i32;
                    raw = push_digit(raw, digit, negative)?;
                }
                _ => return Err(ParseFixedPointError::UnexpectedCharacter { found, position }),
            }
        }
        if !any_digit {
            return Err(ParseFixedPointError::NoDigits);
        }
        for _ in decimals.unwrap_or(0)..4 {
            raw = push_digit(raw, 0, negative)?;
        }
        Ok(Self(raw))
    }
}

// Counts down for negative numbers, so that the smallest value of all is read without overflow.
fn push_digit(raw: i32, digit: i32, negative: bool) -> Result<i32, ParseFixedPointError> {
    let shifted = raw.checked_mul(10);
    let sum = if negative {
        shifted.and_then(|raw| raw.checked_sub(digit))
    } else {
        shifted.and_then(|raw| raw.checked_add(digit))
    };
    sum.ok_or(ParseFixedPointError::OutOfRange)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<i32, ParseFixedPointError> {
        text.parse::<FixedPoint>().map(FixedPoint::raw)
    }

    // Source: 9300 facts 3.2 and 11.
    #[test]
    fn the_check_values_of_the_fact_sheet_are_exact() {
        let table = [
            ("1200.0", 0x00B7_1B00),
            ("1100.0", 0x00A7_D8C0),
            ("100.00", 0x000F_4240),
            ("20.00", 0x0003_0D40),
            ("85.37", 0x000D_06C4),
            ("150.4", 0x0016_F300),
            ("179.0708", 0x001B_52F4),
            ("7", 0x0001_1170),
            ("1", 0x0000_2710),
        ];
        for (text, raw) in table {
            assert_eq!(parse(text), Ok(raw), "{text}");
        }
    }

    #[test]
    fn the_ends_of_the_range_are_read_and_one_step_beyond_is_not() {
        assert_eq!(parse("-214748.3648"), Ok(i32::MIN));
        assert_eq!(parse("214748.3647"), Ok(i32::MAX));
        assert_eq!(parse("214748.3648"), Err(ParseFixedPointError::OutOfRange));
        assert_eq!(parse("-214748.3649"), Err(ParseFixedPointError::OutOfRange));
        assert_eq!(parse("99999999999999999999"), Err(ParseFixedPointError::OutOfRange));
    }

    #[test]
    fn a_fifth_decimal_is_refused_unless_it_is_zero() {
        assert_eq!(parse("1.23450"), Ok(12_345));
        assert_eq!(parse("1.23456"), Err(ParseFixedPointError::TooPrecise { position: 6 }));
    }

    #[test]
    fn texts_that_are_no_numbers_say_where() {
        assert_eq!(parse(""), Err(ParseFixedPointError::NoDigits));
        assert_eq!(parse("-"), Err(ParseFixedPointError::NoDigits));
        assert_eq!(parse("."), Err(ParseFixedPointError::NoDigits));
        let at = |found, position| Err(ParseFixedPointError::UnexpectedCharacter { found, position });
        assert_eq!(parse("1.2.3"), at('.', 3));
        assert_eq!(parse("1-"), at('-', 1));
        assert_eq!(parse("1,5"), at(',', 1));
        assert_eq!(parse("1e3"), at('e', 1));
        assert_eq!(parse("ü"), at('ü', 0));
    }

    #[test]
    fn rounding_from_f64_goes_to_the_nearest_and_refuses_what_does_not_fit() {
        assert_eq!(FixedPoint::from_f64(179.0708), Some(FixedPoint(1_790_708)));
        assert_eq!(FixedPoint::from_f64(-0.00006), Some(FixedPoint(-1)));
        assert_eq!(FixedPoint::from_f64(0.00004), Some(FixedPoint(0)));
        assert_eq!(FixedPoint::from_f64(214_748.364_7), Some(FixedPoint::MAX));
        assert_eq!(FixedPoint::from_f64(-214_748.364_8), Some(FixedPoint::MIN));
        assert_eq!(FixedPoint::from_f64(214_748.364_8), None);
        assert_eq!(FixedPoint::from_f64(f64::NAN), None);
        assert_eq!(FixedPoint::from_f64(f64::INFINITY), None);
        // Halfway beyond the ends goes away from zero, and out of the range.
        assert_eq!(FixedPoint::from_f64(214_748.364_75), None);
        assert_eq!(FixedPoint::from_f64(-214_748.364_85), None);
    }

    #[test]
    fn only_what_is_below_zero_has_a_minus() {
        assert_eq!(FixedPoint::ZERO.to_string(), "0.0000");
        assert_eq!(FixedPoint::from_raw(-1).to_string(), "-0.0001");
    }

    proptest! {
        #[test]
        fn printing_and_reading_is_the_identity(raw in any::<i32>()) {
            prop_assert_eq!(parse(&FixedPoint(raw).to_string()), Ok(raw));
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in "\\PC{0,24}") {
            let _ = parse(&text);
        }

        #[test]
        fn a_double_carries_every_value(raw in any::<i32>()) {
            prop_assert_eq!(FixedPoint::from_f64(FixedPoint(raw).to_f64()), Some(FixedPoint(raw)));
        }
    }
}
