//! TOML files that people write: every mistake is told, with its line.
//!
//! The tree keeps numbers as they were written, so decimals become ×10000 integers without a float between.
//!
//! ```
//! use lenze9300_model::toml_file::{Fields, Reader};
//!
//! let read = |text| Reader::read(text, |reader, table| {
//!     let mut fields = Fields::of(table);
//!     let speed = fields.take("speed").and_then(|value| reader.real(value, "speed", 0.0..=10.0));
//!     fields.finish(reader);
//!     speed
//! });
//! assert_eq!(read("speed = 2.5"), Ok(2.5));
//! assert_eq!(read("speed = 25").unwrap_err().to_string(), "line 1: speed: expected 0 to 10, got 25");
//! ```

use std::ops::Range;

use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What is wrong with a file, one entry a mistake.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", mistakes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct FileError {
    /// In the order of the lines; never empty.
    pub mistakes: Vec<FileMistake>,
}

/// One mistake in a file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Error)]
#[error("line {line}: {what}")]
pub struct FileMistake {
    /// Line in the file, from 1.
    pub line: usize,
    /// What was found and what is allowed.
    pub what: String,
}

/// A file being read, and what is wrong with it so far.
#[derive(Debug)]
pub struct Reader<'a> {
    text: &'a str,
    mistakes: Vec<FileMistake>,
}

impl<'a> Reader<'a> {
    /// Reads `text` and hands its table over; the result of `read` counts only if there was no mistake, and there is one if it is
    /// `None`.
    ///
    /// # Errors
    /// [`FileError`] with every mistake that the parser or `read` found.
    pub fn read<T>(text: &'a str, read: impl FnOnce(&mut Self, &DeTable<'a>) -> Option<T>) -> Result<T, FileError> {
        let mut reader = Self {
            text,
            mistakes: Vec::new(),
        };
        let (table, errors) = DeTable::parse_recoverable(text);
        for error in errors {
            reader.mistake(error.span().unwrap_or(0..0), error.message().to_owned());
        }
        // What the parser made of broken lines would only bring mistakes that nobody made.
        let result = reader
            .mistakes
            .is_empty()
            .then(|| read(&mut reader, table.get_ref()))
            .flatten();
        debug_assert!(
            result.is_some() || !reader.mistakes.is_empty(),
            "a mistake was not told"
        );
        match result {
            Some(result) if reader.mistakes.is_empty() => Ok(result),
            _ => {
                reader.mistakes.sort();
                Err(FileError {
                    mistakes: reader.mistakes,
                })
            }
        }
    }

    /// Notes a mistake at a place of the file.
    pub fn mistake(&mut self, at: Range<usize>, what: impl Into<String>) {
        let line = self.line(&at);
        self.mistakes.push(FileMistake {
            line,
            what: what.into(),
        });
    }

    /// How many mistakes were noted so far.
    pub fn mistakes(&self) -> usize {
        self.mistakes.len()
    }

    fn line(&self, at: &Range<usize>) -> usize {
        let before = self.text.as_bytes().get(..at.start).unwrap_or(self.text.as_bytes());
        1 + before.iter().filter(|octet| **octet == b'\n').count()
    }

    /// A table, or the mistake that it is none.
    pub fn table<'t>(&mut self, value: &'t Spanned<DeValue<'a>>, what: &str) -> Option<&'t DeTable<'a>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            self.wrong_type(value, what, "a table");
        }
        table
    }

    /// A text, or the mistake that it is none.
    pub fn text<'t>(&mut self, value: &'t Spanned<DeValue<'a>>, what: &str) -> Option<&'t str> {
        let text = value.get_ref().as_str();
        if text.is_none() {
            self.wrong_type(value, what, "a text");
        }
        text
    }

    /// A whole number within a range, or the mistake.
    fn integer(
        &mut self,
        value: &Spanned<DeValue<'a>>,
        what: &str,
        allowed: std::ops::RangeInclusive<i64>,
    ) -> Option<i64> {
        let Some(digits) = value.get_ref().as_integer() else {
            self.wrong_type(value, what, "a whole number");
            return None;
        };
        let number = i64::from_str_radix(digits.as_str(), digits.radix()).ok();
        let fitting = number.filter(|number| allowed.contains(number));
        if fitting.is_none() {
            let (from, to) = (allowed.start(), allowed.end());
            self.mistake(value.span(), format!("{what}: expected {from} to {to}, got {digits}"));
        }
        fitting
    }

    /// A number within a range, or the mistake.
    pub fn real(
        &mut self,
        value: &Spanned<DeValue<'a>>,
        what: &str,
        allowed: std::ops::RangeInclusive<f64>,
    ) -> Option<f64> {
        let written = match value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            DeValue::Float(float) => float.as_str(),
            _ => {
                self.wrong_type(value, what, "a number");
                return None;
            }
        };
        let fitting = written.parse().ok().filter(|number| allowed.contains(number));
        if fitting.is_none() {
            let (from, to) = (allowed.start(), allowed.end());
            self.mistake(value.span(), format!("{what}: expected {from} to {to}, got {written}"));
        }
        fitting
    }

    /// A whole number within a range of its type, or the mistake.
    pub fn number<N: Copy + Into<i64> + TryFrom<i64>>(
        &mut self,
        value: &Spanned<DeValue<'a>>,
        what: &str,
        allowed: std::ops::RangeInclusive<N>,
    ) -> Option<N> {
        let allowed = (*allowed.start()).into()..=(*allowed.end()).into();
        self.integer(value, what, allowed)
            .and_then(|number| number.try_into().ok())
    }

    /// The elements of `[[name]]`, each with its place.
    pub fn tables<'t>(
        &mut self,
        value: &'t Spanned<DeValue<'a>>,
        name: &str,
    ) -> Vec<(&'t Spanned<DeValue<'a>>, &'t DeTable<'a>)> {
        let Some(array) = value.get_ref().as_array() else {
            self.wrong_type(value, name, &format!("tables headed [[{name}]]"));
            return Vec::new();
        };
        array
            .iter()
            .filter_map(|element| self.table(element, name).map(|table| (element, table)))
            .collect()
    }

    /// A number times 10 to the power of `decimals`, as written; further decimals are a mistake.
    pub fn decimal(&mut self, value: &Spanned<DeValue<'a>>, what: &str, decimals: u32) -> Option<i64> {
        let written = match value.get_ref() {
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str(),
            DeValue::Float(float) => float.as_str(),
            _ => {
                self.wrong_type(value, what, "a number");
                return None;
            }
        };
        let scaled = scaled(written, decimals);
        if scaled.is_none() {
            let places = match decimals {
                0 => "a whole number".to_owned(),
                _ => format!("a number with at most {decimals} decimals"),
            };
            self.mistake(value.span(), format!("{what}: expected {places}, got {written}"));
        }
        scaled
    }

    /// Notes that a value has the wrong type.
    pub fn wrong_type(&mut self, value: &Spanned<DeValue<'a>>, what: &str, expected: &str) {
        let got = value.get_ref().type_str();
        self.mistake(value.span(), format!("{what}: expected {expected}, got {got}"));
    }
}

/// The entries of a table, each to be fetched once; what is left over is a mistake.
#[derive(Debug)]
pub struct Fields<'t, 'a> {
    left: Vec<(&'t Spanned<std::borrow::Cow<'a, str>>, &'t Spanned<DeValue<'a>>)>,
    known: Vec<&'static str>,
}

impl<'t, 'a> Fields<'t, 'a> {
    /// The entries of `table`, none of them fetched yet.
    pub fn of(table: &'t DeTable<'a>) -> Self {
        Self {
            left: table.iter().collect(),
            known: Vec::new(),
        }
    }

    /// The value of a key, if it is there.
    pub fn take(&mut self, key: &'static str) -> Option<&'t Spanned<DeValue<'a>>> {
        self.known.push(key);
        let place = self.left.iter().position(|(name, _)| name.get_ref() == key)?;
        Some(self.left.swap_remove(place).1)
    }

    /// Notes every key that nobody asked for.
    pub fn finish(self, reader: &mut Reader<'a>) {
        for (name, _) in self.left {
            let known = self.known.join(", ");
            let what = format!("`{}` is unknown here; allowed are {known}", name.get_ref());
            reader.mistake(name.span(), what);
        }
    }
}

/// A decimal number times 10 to the power of `decimals`; `None` when it has more decimals than that, is no number or too long.
fn scaled(written: &str, decimals: u32) -> Option<i64> {
    let (sign, digits) = match written.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, written.strip_prefix('+').unwrap_or(written)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let fraction = fraction.trim_end_matches('0');
    let missing = decimals.checked_sub(u32::try_from(fraction.len()).ok()?)?;
    let all: String = [whole, fraction].concat();
    if all.is_empty() || !all.bytes().all(|octet| octet.is_ascii_digit()) {
        return None;
    }
    all.parse::<i64>()
        .ok()?
        .checked_mul(10_i64.checked_pow(missing)?)?
        .checked_mul(sign)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_scaled_as_they_were_written() {
        assert_eq!(scaled("179.0708", 4), Some(1_790_708));
        assert_eq!(scaled("-0.5", 4), Some(-5000));
        assert_eq!(scaled("+1200", 4), Some(12_000_000));
        assert_eq!(scaled("1.50000", 1), Some(15));
        // 0.1 + 0.2 has no exact float; the text has.
        assert_eq!(scaled("0.3", 4), Some(3000));
        for none in ["1.00001", "1e3", "nan", "inf", "", ".", "-", "99999999999999999999"] {
            assert_eq!(scaled(none, 4), None, "{none}");
        }
    }

    #[test]
    fn every_syntax_mistake_is_told() {
        let error = Reader::read("a = = 1\nb = 2\n[c\n", |_, _| Some(())).unwrap_err();
        let lines: Vec<usize> = error.mistakes.iter().map(|mistake| mistake.line).collect();
        assert_eq!((lines.first(), lines.last()), (Some(&1), Some(&3)), "{error}");
    }

    #[test]
    fn keys_that_nobody_asked_for_are_told_with_those_that_are_allowed() {
        let error = Reader::read("speed = 1\nway = 2\n", |reader, table| {
            let mut fields = Fields::of(table);
            fields.take("speed");
            fields.take("acceleration");
            fields.finish(reader);
            Some(())
        })
        .unwrap_err();
        assert_eq!(
            error.to_string(),
            "line 2: `way` is unknown here; allowed are speed, acceleration"
        );
    }
}
