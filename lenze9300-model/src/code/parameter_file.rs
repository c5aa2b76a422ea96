//! Parameter files: the stored codes of a drive as text.
//!
//! TOML, one code a line, values with their decimals as the keypad shows them; the comment tells meaning and unit.
//!
//! ```toml
//! [codes]
//! "C0011" = 3000 # rpm, maximum speed, reference of all speeds
//! "C1301/1" = 1200.0000 # units, VTPOS, target positions
//! ```

use std::fmt::Write;
use std::str::FromStr;

use thiserror::Error;
use toml::{Spanned, Value};

use super::error::CodeError;
use super::store::{CodeStore, Inhibit};
use super::table::{CodeEntry, Concern, Form, Writable, entry};

/// Writes the stored codes that differ from `base`; against [`CodeStore::factory`] those that were set.
///
/// C0086 stands before the codes it resets, so that reading the file in its order gives the same drive.
pub fn write_parameter_file(codes: &CodeStore, base: &CodeStore) -> String {
    let mut text = String::from("[codes]\n");
    for difference in codes.differences(base) {
        let Some(line) = entry(difference.code) else {
            continue;
        };
        let gap = if line.unit.is_empty() { "" } else { ", " };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "\"{}\" = {} # {}{gap}{}",
            name(line, difference.subcode),
            line.decimal(difference.here),
            line.unit,
            line.name
        );
    }
    text
}

/// Reads a parameter file into `codes`, all of it or nothing.
///
/// Codes that the file does not name keep their value. The motor list comes first whatever the order in the file, because it
/// resets other codes; a motor that was changed by hand has C0086 = 0.
///
/// # Errors
///
/// [`ParameterFileError`] with every mistake of the file; `codes` is unchanged then.
///
/// # Example
///
/// ```
/// use lenze9300_model::code::{CodeStore, read_parameter_file};
///
/// let mut codes = CodeStore::factory();
/// read_parameter_file("[codes]\n\"C1301/1\" = 1200.0\nC0105 = 0.5\n", &mut codes)?;
/// assert_eq!(codes.read(1301, 1)?, 1200_0000);
/// let wrong = read_parameter_file("[codes]\nC0105 = 1000.0\nC9999 = 1\n", &mut codes).unwrap_err();
/// assert_eq!(wrong.to_string(), "line 2: C0105: 1000 is above 999.900 s; line 3: C9999 does not exist");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_parameter_file(text: &str, codes: &mut CodeStore) -> Result<(), ParameterFileError> {
    let file: File = toml::from_str(text).map_err(|error| {
        let line = error.span().map_or(1, |span| line_of(text, span.start));
        ParameterFileError::one(line, MistakeKind::Syntax(error.message().to_owned()))
    })?;
    let mut mistakes = Vec::new();
    let mut settings = Vec::new();
    for (key, value) in &file.codes {
        let line = line_of(text, key.span().start);
        match setting(key.as_ref(), value.as_ref()) {
            Ok(setting) => settings.push((line, setting)),
            Err(kind) => mistakes.push(FileMistake { line, kind }),
        }
    }
    // What resets others first; a sort that keeps the order of equals.
    settings.sort_by_key(|(_, setting)| match setting.entry.concern {
        Concern::MotorList => 0,
        _ => 1,
    });
    let mut trial = codes.clone();
    for (line, Setting { entry, subcode, raw }) in &settings {
        // A motor datum that is as the list has it leaves the motor what it is.
        if trial.read(entry.number, *subcode) == Ok(*raw) && entry.writable != Writable::Never {
            continue;
        }
        if let Err(error) = trial.write(entry.number, *subcode, *raw, Inhibit::Active) {
            let kind = MistakeKind::Refused(error);
            mistakes.push(FileMistake { line: *line, kind });
        }
    }
    if mistakes.is_empty() {
        codes.load(&trial);
        Ok(())
    } else {
        mistakes.sort_by_key(|mistake| mistake.line);
        Err(ParameterFileError { mistakes })
    }
}

/// What is wrong with a parameter file, one entry a mistake.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", mistakes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct ParameterFileError {
    /// In the order of the lines; never empty.
    pub mistakes: Vec<FileMistake>,
}

impl ParameterFileError {
    fn one(line: usize, kind: MistakeKind) -> Self {
        Self {
            mistakes: vec![FileMistake { line, kind }],
        }
    }
}

/// One mistake in a parameter file.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {kind}")]
pub struct FileMistake {
    /// Line in the file, from 1.
    pub line: usize,
    kind: MistakeKind,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
enum MistakeKind {
    #[error("{0}")]
    Syntax(String),
    #[error("`{0}` is no code; a code is written as C0011, one with subcodes as \"C1301/1\"")]
    Name(String),
    #[error("C{code:04} does not exist")]
    Unknown { code: u16 },
    #[error("{code}: expected a number, got {got}")]
    NoNumber { code: String, got: &'static str },
    #[error("{code}: {got} is {side} {bound}")]
    Range {
        code: String,
        got: String,
        side: &'static str,
        bound: String,
    },
    #[error("{0}")]
    Refused(CodeError),
}

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(with = "in_order")]
    codes: Vec<(Spanned<String>, Spanned<Value>)>,
}

/// A table as a list, with the places of its keys: mistakes are told by line.
mod in_order {
    use std::fmt;

    use serde::de::{Deserializer, MapAccess, Visitor};
    use toml::{Spanned, Value};

    type List = Vec<(Spanned<String>, Spanned<Value>)>;

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<List, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = List;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of codes")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<List, A::Error> {
                let mut list = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    list.push(entry);
                }
                Ok(list)
            }
        }
        deserializer.deserialize_map(Entries)
    }
}

struct Setting {
    entry: &'static CodeEntry,
    subcode: u8,
    raw: i32,
}

fn setting(key: &str, value: &Value) -> Result<Setting, MistakeKind> {
    let (code, subcode) = parse_name(key).ok_or_else(|| MistakeKind::Name(key.to_owned()))?;
    let entry = entry(code).ok_or(MistakeKind::Unknown { code })?;
    let number = match value {
        Value::Integer(integer) => *integer as f64,
        Value::Float(float) => *float,
        other => {
            return Err(MistakeKind::NoNumber {
                code: name(entry, subcode),
                got: other.type_str(),
            });
        }
    };
    let scale = match entry.form {
        Form::FixedPoint4 => 10_000.0,
        Form::Plain => 1.0,
    };
    let scaled = (number * scale).round();
    let range = |side, bound| MistakeKind::Range {
        code: name(entry, subcode),
        got: number.to_string(),
        side,
        bound: entry.show(bound),
    };
    // Checked before the conversion, which would saturate; not a number is in no range.
    if scaled < f64::from(entry.domain.min()) {
        return Err(range("below", entry.domain.min()));
    }
    if scaled > f64::from(entry.domain.max()) || scaled.is_nan() {
        return Err(range("above", entry.domain.max()));
    }
    Ok(Setting {
        entry,
        subcode,
        raw: scaled as i32,
    })
}

/// `C0011` or `C1301/1`.
fn parse_name(text: &str) -> Option<(u16, u8)> {
    let digits = text.strip_prefix(['C', 'c'])?;
    let (code, subcode) = digits.split_once('/').unwrap_or((digits, "0"));
    Some((decimal(code)?, decimal(subcode)?))
}

/// Digits only: the parser of the standard library takes a sign, too.
fn decimal<T: FromStr>(text: &str) -> Option<T> {
    text.bytes()
        .all(|octet| octet.is_ascii_digit())
        .then(|| text.parse().ok())
        .flatten()
}

fn name(entry: &CodeEntry, subcode: u8) -> String {
    if entry.last_subcode == 0 {
        format!("C{:04}", entry.number)
    } else {
        format!("C{:04}/{subcode}", entry.number)
    }
}

fn line_of(text: &str, offset: usize) -> usize {
    let before = text.as_bytes().get(..offset).unwrap_or(text.as_bytes());
    1 + before.iter().filter(|octet| **octet == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_again() {
        let factory = CodeStore::factory();
        let mut thesis = CodeStore::thesis();
        thesis.write(1301, 1, 987_5000, Inhibit::Inactive).unwrap();
        thesis.write(255, 0, 123_456, Inhibit::Inactive).unwrap();
        thesis.write(1301, 2, -2_140_000_000, Inhibit::Inactive).unwrap();
        let text = write_parameter_file(&thesis, &factory);
        assert!(
            text.contains("\"C1204\" = 179.0708 # units/rev, feed constant"),
            "{text}"
        );
        let mut read = CodeStore::factory();
        read_parameter_file(&text, &mut read).unwrap();
        assert_eq!(read.differences(&thesis).count(), 0);
        assert_eq!(read.read(86, 0), Ok(108_0000));
    }

    #[test]
    fn every_mistake_is_told_with_its_line_and_nothing_is_changed() {
        let mut codes = CodeStore::thesis();
        let before = codes.clone();
        let text = "[codes]\nC0070 = 7.0\nspeed = 1\nC0011 = \"fast\"\n\"C1301/111\" = 1.0\n\nC0051 = 3\nC0086 = 107\nC0022 = nan\nC0071 = -1e300\n";
        let error = read_parameter_file(text, &mut codes).unwrap_err();
        let told: Vec<String> = error.mistakes.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "line 3: `speed` is no code; a code is written as C0011, one with subcodes as \"C1301/1\"",
                "line 4: C0011: expected a number, got string",
                "line 5: C1301/111 does not exist: subcodes 1 to 110",
                "line 7: C0051/0 is a display and cannot be written",
                "line 8: C0086/0: 1070000 is not in the selection [0, 1080000]",
                "line 9: C0022: NaN is above 3.75 A",
                "line 10: C0071: -1000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000 is below 1.0 ms",
            ]
        );
        assert_eq!(codes, before);
    }

    #[test]
    fn a_motor_changed_by_hand_is_no_lenze_motor_any_more() {
        let mut codes = CodeStore::factory();
        read_parameter_file("[codes]\nC0084 = 20.0\nC0086 = 108\nC0085 = 30.5", &mut codes).unwrap();
        assert_eq!((codes.read(84, 0), codes.read(85, 0)), (Ok(20_0000), Ok(30_5000)));
        assert_eq!(codes.read(86, 0), Ok(0));
    }

    #[test]
    fn broken_toml_is_told_with_its_line() {
        let mut codes = CodeStore::factory();
        let error = read_parameter_file("[codes]\nC0070 = = 1\n", &mut codes).unwrap_err();
        assert!(error.to_string().starts_with("line 2: "), "{error}");
        let error = read_parameter_file("[parameters]\n", &mut codes).unwrap_err();
        assert!(error.to_string().starts_with("line 1: "), "{error}");
    }
}
