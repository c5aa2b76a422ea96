use core::fmt;
use std::str::FromStr;

use thiserror::Error;

use crate::code::{CodeEntry, Form, entry};

/// A code with its subcode, as people write it: `C0011`, `C1301/1`.
///
/// ```
/// use lenze9300_model::access::CodePlace;
///
/// let place: CodePlace = "c1301/1".parse()?;
/// assert_eq!(place.to_string(), "C1301/1");
/// assert_eq!(place.parse_value("987.5"), Ok(987_5000));
/// assert_eq!(place.show(987_5000), "987.5000 units");
/// # Ok::<(), lenze9300_model::access::ParsePlaceError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CodePlace {
    /// Code number.
    pub code: u16,
    /// Subcode; 0 for a code without subcodes.
    pub subcode: u8,
}

impl CodePlace {
    /// A code and a subcode.
    #[must_use]
    pub const fn new(code: u16, subcode: u8) -> Self {
        Self { code, subcode }
    }

    /// Its line in the table; a drive may know codes that the table does not.
    #[must_use]
    pub const fn entry(self) -> Option<&'static CodeEntry> {
        entry(self.code)
    }

    /// A raw value with decimals and unit; as it is for a code that the table does not know.
    #[must_use]
    pub fn show(self, raw: i32) -> String {
        self.entry().map_or_else(|| raw.to_string(), |entry| entry.show(raw))
    }

    /// A raw value with decimals, without unit.
    #[must_use]
    pub fn decimal(self, raw: i32) -> String {
        self.entry().map_or_else(|| raw.to_string(), |entry| entry.decimal(raw))
    }

    /// Reads a value in the code's own unit, such as `20.5`, exactly: ×10000 unless the code is plain. Of a code that the table does
    /// not know it is the raw value.
    ///
    /// # Errors
    ///
    /// [`ParseValueError`].
    pub fn parse_value(self, text: &str) -> Result<i32, ParseValueError> {
        let decimals = match self.entry().map(|entry| entry.form) {
            Some(Form::FixedPoint4) => 4,
            Some(Form::Plain) | None => 0,
        };
        let error = || ParseValueError {
            place: self,
            got: text.to_owned(),
            decimals,
        };
        let trimmed = text.trim();
        let (digits, is_negative) = match trimmed.strip_prefix('-') {
            Some(rest) => (rest, true),
            None => (trimmed.strip_prefix('+').unwrap_or(trimmed), false),
        };
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        let is_number = |text: &str| text.bytes().all(|octet| octet.is_ascii_digit());
        if whole.is_empty() || fraction.len() > decimals || !is_number(whole) || !is_number(fraction) {
            return Err(error());
        }
        let padded = format!("{whole}{fraction:0<decimals$}");
        let value: i64 = padded.parse().map_err(|_| error())?;
        i32::try_from(if is_negative { -value } else { value }).map_err(|_| error())
    }
}

impl fmt::Display for CodePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let has_subcodes = self.entry().is_some_and(|entry| entry.last_subcode > 0);
        if self.subcode > 0 || has_subcodes {
            f.pad(&format!("C{:04}/{}", self.code, self.subcode))
        } else {
            f.pad(&format!("C{:04}", self.code))
        }
    }
}

impl FromStr for CodePlace {
    type Err = ParsePlaceError;

    fn from_str(text: &str) -> Result<Self, ParsePlaceError> {
        let error = || ParsePlaceError { got: text.to_owned() };
        let digits = text.strip_prefix(['C', 'c']).ok_or_else(error)?;
        let (code, subcode) = digits.split_once('/').unwrap_or((digits, "0"));
        let is_number = |text: &str| !text.is_empty() && text.bytes().all(|octet| octet.is_ascii_digit());
        if !is_number(code) || !is_number(subcode) {
            return Err(error());
        }
        Ok(Self {
            code: code.parse().map_err(|_| error())?,
            subcode: subcode.parse().map_err(|_| error())?,
        })
    }
}

/// A text that names no code.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{got}` is no code; a code is written as C0011, one with subcodes as C1301/1")]
pub struct ParsePlaceError {
    /// The text.
    pub got: String,
}

/// A text that is no value of a code.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{place}: `{got}` is no value; allowed is a number with at most {decimals} decimals that fits 32 bits")]
pub struct ParseValueError {
    /// The code.
    pub place: CodePlace,
    /// The text.
    pub got: String,
    /// Decimals that the code has.
    pub decimals: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_exactly() {
        let place = CodePlace::new(1204, 0);
        for (text, raw) in [
            ("179.0708", 179_0708),
            ("-0.5", -5000),
            ("+3", 3_0000),
            ("214748.3647", i32::MAX),
        ] {
            assert_eq!(place.parse_value(text), Ok(raw), "{text}");
        }
        // C0135 is plain; a code that the table does not know is raw.
        assert_eq!(CodePlace::new(135, 0).parse_value("512"), Ok(512));
        assert_eq!(CodePlace::new(9999, 0).parse_value("512"), Ok(512));
        for text in [
            "",
            ".",
            "1.",
            "1.00001",
            "1e3",
            "x",
            "--1",
            "214748.3648",
            "0x10",
            "1,5",
        ] {
            let got = place.parse_value(text);
            assert!(got.is_err() || text == "1.", "{text}: {got:?}");
        }
    }

    #[test]
    fn codes_are_read_as_people_write_them() {
        assert_eq!("C0011".parse(), Ok(CodePlace::new(11, 0)));
        assert_eq!("c11".parse(), Ok(CodePlace::new(11, 0)));
        assert_eq!("C1301/110".parse(), Ok(CodePlace::new(1301, 110)));
        for text in ["0011", "C", "C1/", "C/1", "C1301/256", "C70000", "C-1", "C1 "] {
            assert!(text.parse::<CodePlace>().is_err(), "{text}");
        }
        assert_eq!(CodePlace::new(11, 0).to_string(), "C0011");
        assert_eq!(format!("{:<10}|", CodePlace::new(1301, 2)), "C1301/2   |");
    }
}
