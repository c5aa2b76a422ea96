//! A configuration in TOML, read with every mistake told: file, line, what is allowed.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::ops::{Range, RangeInclusive};
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::output::Trouble;

/// The text of a file, and what is wrong with it.
#[derive(Debug)]
pub(crate) struct ConfigText<'d> {
    file: String,
    text: &'d str,
    mistakes: RefCell<Vec<(usize, String)>>,
}

/// A table of a configuration. Every key it may have is asked for; [`finish`](Self::finish) tells those that nobody asked for.
#[derive(Debug)]
pub(crate) struct Section<'d> {
    source: &'d ConfigText<'d>,
    /// As it stands in the file: `[[master]]`; empty for the top.
    name: String,
    at: usize,
    table: &'d DeTable<'d>,
    known: RefCell<BTreeSet<&'static str>>,
}

/// Reads a configuration: `read` asks for everything and gives what it found.
///
/// # Errors
///
/// One sentence for each mistake, in the order of lines.
pub(crate) fn read_config<T>(path: &Path, read: impl for<'d> FnOnce(&Section<'d>) -> Option<T>) -> Result<T, Trouble> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| Trouble::given(format_args!("{} cannot be read: {error}", path.display())))?;
    read_text(&path.display().to_string(), &text, read)
}

fn read_text<T>(file: &str, text: &str, read: impl for<'d> FnOnce(&Section<'d>) -> Option<T>) -> Result<T, Trouble> {
    let source = ConfigText {
        file: file.to_owned(),
        text,
        mistakes: RefCell::new(Vec::new()),
    };
    let (table, errors) = DeTable::parse_recoverable(text);
    if !errors.is_empty() {
        for error in &errors {
            source.mistake(error.span().map_or(0, |span| span.start), error.message());
        }
        return Err(source.trouble());
    }
    let top = Section {
        source: &source,
        name: String::new(),
        at: 0,
        table: table.get_ref(),
        known: RefCell::default(),
    };
    let found = read(&top);
    top.finish();
    match found {
        Some(found) if source.mistakes.borrow().is_empty() => Ok(found),
        _ => Err(source.trouble()),
    }
}

impl ConfigText<'_> {
    fn mistake(&self, at: usize, sentence: impl ToString) {
        self.mistakes.borrow_mut().push((at, sentence.to_string()));
    }

    fn trouble(&self) -> Trouble {
        let mut mistakes = self.mistakes.take();
        mistakes.sort();
        mistakes.dedup();
        let told = mistakes.into_iter().map(|(at, sentence)| {
            let line = self.text.get(..at).unwrap_or(self.text).matches('\n').count() + 1;
            format!("{}:{line}: {sentence}", self.file)
        });
        Trouble::Given(told.collect())
    }
}

impl<'d> Section<'d> {
    /// A whole number inside a range; `None` when there is none or it was wrong.
    pub(crate) fn number<T: TryFrom<i64> + Into<i64> + Copy>(
        &self,
        key: &'static str,
        range: RangeInclusive<T>,
    ) -> Option<T> {
        let (least, most): (i64, i64) = ((*range.start()).into(), (*range.end()).into());
        let value = self.value(key)?;
        let number = value
            .get_ref()
            .as_integer()
            .and_then(|number| i64::from_str_radix(number.as_str(), number.radix()).ok());
        match number
            .filter(|number| (least..=most).contains(number))
            .and_then(|number| T::try_from(number).ok())
        {
            Some(number) => Some(number),
            None => self.refuse(key, value, &format!("allowed is a whole number {least}…{most}")),
        }
    }

    /// A number inside a range.
    pub(crate) fn decimal(&self, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
        let value = self.value(key)?;
        let number = match value.get_ref() {
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
                .ok()
                .map(|number| number as f64),
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        };
        match number.filter(|number| range.contains(number)) {
            Some(number) => Some(number),
            None => self.refuse(
                key,
                value,
                &format!("allowed is a number {}…{}", range.start(), range.end()),
            ),
        }
    }

    /// One of some words.
    pub(crate) fn word<T: Copy>(&self, key: &'static str, words: &[(&'static str, T)]) -> Option<T> {
        let value = self.value(key)?;
        let word = value.get_ref().as_str();
        match words.iter().find(|(name, _)| word == Some(*name)) {
            Some((_, meaning)) => Some(*meaning),
            None => {
                let names: Vec<String> = words.iter().map(|(name, _)| format!("\"{name}\"")).collect();
                self.refuse(key, value, &format!("allowed is {}", listed(&names, "or")))
            }
        }
    }

    /// `true` or `false`.
    pub(crate) fn flag(&self, key: &'static str) -> Option<bool> {
        self.parsed(key, |value| {
            value.as_bool().ok_or_else(|| "allowed is true or false".to_owned())
        })
    }

    /// Whether there is such a key.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Keys that are allowed and were not asked for.
    pub(crate) fn ignore(&self, keys: &[&'static str]) {
        self.known.borrow_mut().extend(keys);
    }

    /// Every key with its value, of a table whose keys are names that the user chose.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (&'d str, &'d DeValue<'d>)> {
        self.table
            .iter()
            .map(|(key, value)| (key.get_ref().as_ref(), value.get_ref()))
    }

    /// Anything that is read from a value, with a sentence when it is not.
    pub(crate) fn parsed<T>(
        &self,
        key: &'static str,
        read: impl FnOnce(&DeValue<'_>) -> Result<T, String>,
    ) -> Option<T> {
        let value = self.value(key)?;
        match read(value.get_ref()) {
            Ok(found) => Some(found),
            Err(allowed) => self.refuse(key, value, &allowed),
        }
    }

    /// What is needed and missing is a mistake of the section.
    pub(crate) fn needed<T>(&self, key: &'static str, found: Option<T>) -> Option<T> {
        if found.is_none() && !self.table.contains_key(key) {
            let place = if self.name.is_empty() {
                "the file".to_owned()
            } else {
                self.name.clone()
            };
            self.source.mistake(self.at, format_args!("{place} needs `{key}`"));
        }
        found
    }

    /// The tables of `[[key]]`, or the only one of `[key]`.
    pub(crate) fn sections(&self, key: &'static str) -> Vec<Section<'d>> {
        let Some(value) = self.value(key) else {
            return Vec::new();
        };
        let section = |name: String, at: Range<usize>, table: &'d DeTable<'d>| Section {
            source: self.source,
            name,
            at: at.start,
            table,
            known: RefCell::default(),
        };
        match value.get_ref() {
            DeValue::Table(table) => vec![section(self.path_of("[", key, "]"), value.span(), table)],
            DeValue::Array(values) if values.iter().all(|value| value.get_ref().is_table()) => values
                .iter()
                .filter_map(|value| Some((value.span(), value.get_ref().as_table()?)))
                .map(|(at, table)| section(self.path_of("[[", key, "]]"), at, table))
                .collect(),
            _ => {
                self.refuse::<()>(
                    key,
                    value,
                    &format!("allowed are tables {}", self.path_of("[[", key, "]]")),
                );
                Vec::new()
            }
        }
    }

    /// The table of `[key]`.
    pub(crate) fn section(&self, key: &'static str) -> Option<Section<'d>> {
        let mut sections = self.sections(key).into_iter();
        let first = sections.next();
        if let Some(second) = sections.next() {
            self.source.mistake(
                second.at,
                format_args!("there is a second `{key}`, allowed is {}", self.path_of("[", key, "]")),
            );
        }
        first
    }

    /// A mistake about a key, told at its value.
    pub(crate) fn mistake(&self, key: &str, sentence: impl ToString) {
        let at = self.table.get(key).map_or(self.at, |value| value.span().start);
        self.source.mistake(at, sentence);
    }

    /// Tells the keys that nobody asked for.
    pub(crate) fn finish(&self) {
        let known = self.known.borrow();
        for (key, _) in self
            .table
            .iter()
            .filter(|(key, _)| !known.contains(key.get_ref().as_ref()))
        {
            let names: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
            let place = if self.name.is_empty() {
                String::new()
            } else {
                format!(" in {}", self.name)
            };
            self.source.mistake(
                key.span().start,
                format_args!(
                    "`{}` is unknown{place}, allowed are {}",
                    key.get_ref(),
                    listed(&names, "and")
                ),
            );
        }
    }

    fn value(&self, key: &'static str) -> Option<&'d Spanned<DeValue<'d>>> {
        self.known.borrow_mut().insert(key);
        self.table.get(key)
    }

    fn refuse<T>(&self, key: &str, value: &Spanned<DeValue<'_>>, allowed: &str) -> Option<T> {
        let text = self.source.text.get(value.span()).unwrap_or_default();
        // A table or a long list would not be one sentence any more.
        let got = match text.lines().next() {
            Some(line) if line.len() == text.len() && line.chars().count() <= 40 => line,
            _ => value.get_ref().type_str(),
        };
        self.source
            .mistake(value.span().start, format_args!("`{key}` is {got}, {allowed}"));
        None
    }

    /// `[master.slave]` for the key `slave` of `[[master]]`.
    fn path_of(&self, open: &str, key: &str, close: &str) -> String {
        let parent = self.name.trim_matches(['[', ']']);
        let dot = if parent.is_empty() { "" } else { "." };
        format!("{open}{parent}{dot}{key}{close}")
    }
}

/// `a, b and c`.
fn listed(names: &[String], joint: &str) -> String {
    match names {
        [] => "nothing".to_owned(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} {joint} {last}", all.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mistakes(text: &str, read: impl for<'d> FnOnce(&Section<'d>) -> Option<()>) -> Vec<String> {
        match read_text("x.toml", text, read) {
            Ok(()) => Vec::new(),
            Err(Trouble::Given(sentences)) => sentences,
            Err(other) => panic!("{other:?}"),
        }
    }

    #[test]
    fn every_mistake_is_told_with_its_line_and_what_is_allowed() {
        let text = "bauds = 5\naddress = 200\nprofile = \"fast\"\n[[slave]]\nlength = -1.5\n";
        let told = mistakes(text, |top| {
            top.number("address", 0_u8..=126);
            top.word("profile", &[("dp", 1), ("standard", 2), ("user", 3)]);
            for slave in top.sections("slave") {
                slave.decimal("length", 0.0..=100.0);
                slave.needed("ident", slave.number("ident", 0_u16..=0xFFFF));
                slave.finish();
            }
            Some(())
        });
        assert_eq!(
            told,
            [
                "x.toml:1: `bauds` is unknown, allowed are `address`, `profile` and `slave`",
                "x.toml:2: `address` is 200, allowed is a whole number 0…126",
                "x.toml:3: `profile` is \"fast\", allowed is \"dp\", \"standard\" or \"user\"",
                "x.toml:4: [[slave]] needs `ident`",
                "x.toml:5: `length` is -1.5, allowed is a number 0…100",
            ]
        );
    }

    #[test]
    fn a_text_that_is_no_toml_is_told_with_its_line() {
        let told = mistakes("address = 3\nbaud =\n", |_| Some(()));
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].starts_with("x.toml:2: "), "{told:?}");
    }

    #[test]
    fn hexadecimal_numbers_are_numbers() {
        let read = read_text("x.toml", "ident = 0x00DA", |top| top.number("ident", 0_u16..=0xFFFF));
        assert_eq!(read.ok(), Some(0xDA));
    }
}
