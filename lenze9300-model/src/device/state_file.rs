//! What a drive keeps without supply, as a TOML file: the drive of a process survives its restart.
//!
//! ```toml
//! enabled_s = 1200
//! on_mains_s = 3600
//!
//! [set_1]
//! C0011 = 3000
//!
//! [[fault]]
//! number = 1030
//! time_s = 17
//! count = 2
//! ```
//!
//! A set holds the codes that differ from the factory setting; faults stand with the latest first, by their LECOM number.

use std::fmt::Write;

use toml::Spanned;
use toml::de::DeValue;

use super::fault::Fault;
use super::memory::{FaultEntry, FaultMemory};
use super::nonvolatile::{NonVolatile, SetNumber};
use crate::code::{CodeStore, read_code_table, write_codes};
use crate::toml_file::{Fields, FileError, Reader};

/// Writes what a drive keeps.
pub fn write_state_file(memory: &NonVolatile) -> String {
    let factory = CodeStore::factory();
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "enabled_s = {}\non_mains_s = {}",
        memory.enabled_s, memory.on_mains_s
    );
    for (key, number) in SETS {
        let _ = writeln!(text, "\n[{key}]");
        write_codes(&mut text, memory.set(number), &factory);
    }
    for entry in memory.faults.entries() {
        let FaultEntry { time_s, count, .. } = entry;
        let number = entry.lecom_number();
        let _ = writeln!(
            text,
            "\n[[fault]] # {}\nnumber = {number}\ntime_s = {time_s}\ncount = {count}",
            entry.fault
        );
    }
    text
}

/// Reads what [`write_state_file`] wrote, by a person changed or not.
///
/// A set that is missing is the factory setting.
///
/// # Errors
///
/// [`FileError`] with every mistake.
///
/// # Example
///
/// ```
/// use lenze9300_model::code::CodeStore;
/// use lenze9300_model::device::{NonVolatile, read_state_file, write_state_file};
///
/// let memory = NonVolatile::new(CodeStore::thesis());
/// let read = read_state_file(&write_state_file(&memory))?;
/// assert_eq!(read, memory);
/// # Ok::<(), lenze9300_model::FileError>(())
/// ```
pub fn read_state_file(text: &str) -> Result<NonVolatile, FileError> {
    Reader::read(text, |reader, file| {
        let mut fields = Fields::of(file);
        let mut memory = NonVolatile::new(CodeStore::factory());
        for (key, number) in SETS {
            let Some(value) = fields.take(key) else {
                continue;
            };
            let table = reader.table(value, key)?;
            let mut codes = CodeStore::factory();
            read_code_table(reader, table, &mut codes);
            memory.save(number, &codes);
        }
        for (key, seconds) in [
            ("enabled_s", &mut memory.enabled_s),
            ("on_mains_s", &mut memory.on_mains_s),
        ] {
            if let Some(value) = fields.take(key) {
                *seconds = reader.number(value, key, 0..=u32::MAX)?;
            }
        }
        if let Some(value) = fields.take("fault") {
            memory.faults = faults(reader, value);
        }
        fields.finish(reader);
        Some(memory)
    })
}

const SETS: [(&str, SetNumber); 4] = SetNumber::ALL_WITH_KEYS;

fn faults<'a>(reader: &mut Reader<'a>, value: &Spanned<DeValue<'a>>) -> FaultMemory {
    let mut entries = Vec::new();
    for (value, table) in reader.tables(value, "fault") {
        let mut fields = Fields::of(table);
        let mut number_of = |reader: &mut Reader<'a>, key| {
            let Some(value) = fields.take(key) else {
                reader.mistake(value.span(), format!("fault: `{key}` is missing"));
                return None;
            };
            reader.number(value, key, 0..=u32::MAX)
        };
        let number = number_of(reader, "number");
        let time_s = number_of(reader, "time_s");
        let count = number_of(reader, "count").and_then(|count| u16::try_from(count).ok());
        fields.finish(reader);
        let (Some(number), Some(time_s), Some(count)) = (number, time_s, count) else {
            continue;
        };
        let fault = u16::try_from(number).ok().and_then(Fault::from_lecom_number);
        let Some((fault, reaction)) = fault else {
            reader.mistake(
                value.span(),
                format!("fault: {number} is no LECOM number; expected one of those in C0168, such as 1030"),
            );
            continue;
        };
        entries.push(FaultEntry {
            fault,
            reaction,
            time_s,
            count,
        });
    }
    if entries.len() > FaultMemory::HISTORY {
        let (most, got) = (FaultMemory::HISTORY, entries.len());
        reader.mistake(value.span(), format!("fault: expected at most {most}, got {got}"));
    }
    FaultMemory::from_history(entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Inhibit;
    use crate::device::Reaction;

    #[test]
    fn sets_faults_and_hours_survive() {
        let mut memory = NonVolatile::new(CodeStore::thesis());
        let mut codes = CodeStore::factory();
        codes.write(1301, 7, -12_3456, Inhibit::Inactive).unwrap();
        memory.save(SetNumber::new(3).unwrap(), &codes);
        (memory.enabled_s, memory.on_mains_s) = (12, 4_000_000_000);
        for (time, fault, reaction) in [
            (5, Fault::Lu, Reaction::Message),
            (9, Fault::Oh4, Reaction::Warning),
            (10, Fault::Sd2, Reaction::Trip),
        ] {
            memory.faults.update(time, Some((fault, reaction)), |_| false);
        }
        // The present fault is gone with the supply, and remembered.
        let read = read_state_file(&write_state_file(&memory)).unwrap();
        memory.faults.update(11, None, |_| false);
        assert_eq!(read, memory);
    }

    #[test]
    fn every_mistake_is_told_with_its_line() {
        let text = "enabled_s = -1\n[set_1]\nC9999 = 1\n[set_5]\n[[fault]]\nnumber = 4082\ntime_s = 1\ncount = 1\n[[fault]]\nnumber = 82\n";
        let error = read_state_file(text).unwrap_err();
        let told: Vec<String> = error.mistakes.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "line 1: enabled_s: expected 0 to 4294967295, got -1",
                "line 3: C9999 does not exist",
            ]
        );
        let error = read_state_file(&text.replace("-1\n[", "1\n[").replace("C9999 = 1\n", "")).unwrap_err();
        let told: Vec<String> = error.mistakes.iter().map(ToString::to_string).collect();
        assert_eq!(
            told,
            [
                "line 3: `set_5` is unknown here; allowed are set_1, set_2, set_3, set_4, enabled_s, on_mains_s, fault",
                "line 4: fault: 4082 is no LECOM number; expected one of those in C0168, such as 1030",
                "line 8: fault: `count` is missing",
                "line 8: fault: `time_s` is missing",
            ]
        );
    }
}
