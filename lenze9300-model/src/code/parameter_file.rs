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

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::store::{CodeStore, Inhibit};
use super::table::{CodeEntry, Concern, Form, Writable, entry};
use crate::toml_file::{Fields, FileError, Reader};

/// Writes the stored codes that differ from `base`; against [`CodeStore::factory`] those that were set.
///
/// C0086 stands before the codes it resets, so that reading the file in its order gives the same drive.
pub fn write_parameter_file(codes: &CodeStore, base: &CodeStore) -> String {
    let mut text = String::from("[codes]\n");
    write_codes(&mut text, codes, base);
    text
}

/// A line for every stored code that differs from `base`.
pub(crate) fn write_codes(text: &mut String, codes: &CodeStore, base: &CodeStore) {
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
}

/// Reads a parameter file into `codes`, all of it or nothing.
///
/// Codes that the file does not name keep their value. The motor list comes first whatever the order in the file, because it
/// resets other codes; a motor that was changed by hand has C0086 = 0.
///
/// # Errors
///
/// [`FileError`] with every mistake of the file; `codes` is unchanged then.
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
/// assert_eq!(wrong.to_string(), "line 2: C0105: 1000.000 s is above 999.900 s; line 3: C9999 does not exist");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_parameter_file(text: &str, codes: &mut CodeStore) -> Result<(), FileError> {
    let read = Reader::read(text, |reader, file| {
        let mut fields = Fields::of(file);
        let mut trial = codes.clone();
        if let Some(value) = fields.take("codes")
            && let Some(table) = reader.table(value, "codes")
        {
            read_code_table(reader, table, &mut trial);
        }
        fields.finish(reader);
        Some(trial)
    })?;
    codes.load(&read);
    Ok(())
}

/// Reads what a parameter file sets, in the order in which it must be written: the motor list first, because it resets other codes.
/// Each value as code, subcode, raw.
///
/// # Errors
///
/// [`FileError`] with every mistake of the file, tried on a drive at its factory setting.
///
/// ```
/// use lenze9300_model::code::read_parameter_settings;
///
/// let settings = read_parameter_settings("[codes]\nC0105 = 0.5\nC0086 = 108\n")?;
/// assert_eq!(settings, [(86, 0, 108_0000), (105, 0, 5000)]);
/// # Ok::<(), lenze9300_model::FileError>(())
/// ```
pub fn read_parameter_settings(text: &str) -> Result<Vec<(u16, u8, i32)>, FileError> {
    Reader::read(text, |reader, file| {
        let mut fields = Fields::of(file);
        let mut settings = Vec::new();
        if let Some(value) = fields.take("codes")
            && let Some(table) = reader.table(value, "codes")
        {
            settings = read_code_table(reader, table, &mut CodeStore::factory());
        }
        fields.finish(reader);
        Some(settings)
    })
}

/// Writes the codes of a table, given by their names as in a parameter file, into a store; for files that hold such a table among
/// others. Each mistake is told to `reader`. Gives them as [`read_parameter_settings`] does.
pub fn read_code_table<'a>(reader: &mut Reader<'a>, table: &DeTable<'a>, codes: &mut CodeStore) -> Vec<(u16, u8, i32)> {
    let settings = settings_of(reader, table);
    write_settings(reader, &settings, codes);
    settings
        .iter()
        .map(|setting| (setting.entry.number, setting.subcode, setting.raw))
        .collect()
}

fn settings_of<'a>(reader: &mut Reader<'a>, table: &DeTable<'a>) -> Vec<Setting> {
    let mut settings: Vec<_> = table
        .iter()
        .filter_map(|(key, value)| setting(reader, key.get_ref(), key.span(), value))
        .collect();
    // What resets others first; a sort that keeps the order of equals.
    settings.sort_by_key(|setting| match setting.entry.concern {
        Concern::MotorList => 0,
        _ => 1,
    });
    settings
}

fn write_settings(reader: &mut Reader<'_>, settings: &[Setting], codes: &mut CodeStore) {
    for Setting {
        entry,
        subcode,
        raw,
        at,
    } in settings
    {
        // A motor datum that is as the list has it leaves the motor what it is.
        if codes.read(entry.number, *subcode) == Ok(*raw) && entry.writable != Writable::Never {
            continue;
        }
        if let Err(error) = codes.write(entry.number, *subcode, *raw, Inhibit::Active) {
            reader.mistake(at.clone(), error.to_string());
        }
    }
}

struct Setting {
    entry: &'static CodeEntry,
    subcode: u8,
    raw: i32,
    at: std::ops::Range<usize>,
}

fn setting<'a>(
    reader: &mut Reader<'a>,
    key: &str,
    at: std::ops::Range<usize>,
    value: &Spanned<DeValue<'a>>,
) -> Option<Setting> {
    let Some((code, subcode)) = parse_name(key) else {
        reader.mistake(
            at,
            format!("`{key}` is no code; a code is written as C0011, one with subcodes as \"C1301/1\""),
        );
        return None;
    };
    let Some(entry) = entry(code) else {
        reader.mistake(at, format!("C{code:04} does not exist"));
        return None;
    };
    let what = name(entry, subcode);
    let decimals = match entry.form {
        Form::FixedPoint4 => 4,
        Form::Plain => 0,
    };
    let scaled = reader.decimal(value, &what, decimals)?;
    // Checked before the number is cut to 32 bits; the store checks the rest.
    let bound = match scaled {
        _ if scaled < i64::from(entry.domain.min()) => Some(("below", entry.domain.min())),
        _ if scaled > i64::from(entry.domain.max()) => Some(("above", entry.domain.max())),
        _ => None,
    };
    let fitting = i32::try_from(scaled).ok();
    if let Some((side, bound)) = bound {
        let got = fitting.map_or_else(|| "it".to_owned(), |raw| entry.show(raw));
        reader.mistake(value.span(), format!("{what}: {got} is {side} {}", entry.show(bound)));
        return None;
    }
    Some(Setting {
        entry,
        subcode,
        raw: fitting?,
        at,
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
        let text = "[codes]\nC0070 = 7.0\nspeed = 1\nC0011 = \"fast\"\n\"C1301/111\" = 1.0\n\nC0051 = 3\nC0086 = 107\nC0022 = nan\nC0071 = -1000000.5\nC0255 = 1.5\nC0105 = 0.00001\n[drive]\n";
        let error = read_parameter_file(text, &mut codes).unwrap_err();
        let told: Vec<String> = error.mistakes.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "line 3: `speed` is no code; a code is written as C0011, one with subcodes as \"C1301/1\"",
                "line 4: C0011: expected a number, got string",
                "line 5: C1301/111 does not exist: subcodes 1 to 110",
                "line 7: C0051/0 is a display and cannot be written",
                "line 8: C0086/0: 107 is not in the selection 0, 108",
                "line 9: C0022: expected a number with at most 4 decimals, got nan",
                "line 10: C0071: it is below 1.0 ms",
                "line 11: C0255: expected a whole number, got 1.5",
                "line 12: C0105: expected a number with at most 4 decimals, got 0.00001",
                "line 13: `drive` is unknown here; allowed are codes",
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
    }
}
