//! One table of a file that people write: values with their ranges, every mistake told with its line and with what is allowed.

use std::ops::{Range, RangeInclusive};

use lenze9300_model::toml_file::{Fields, Reader};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A table being read. A value that is wrong or missing is noted as a mistake, and something within its range stands in for it: the
/// whole file counts only without mistakes.
#[derive(Debug)]
pub(crate) struct Section<'r, 't, 'a> {
    reader: &'r mut Reader<'a>,
    fields: Fields<'t, 'a>,
    name: &'static str,
    at: Range<usize>,
    given: usize,
    mistakes_before: usize,
}

impl<'r, 't, 'a> Section<'r, 't, 'a> {
    /// The table `name`, which stands at `at`.
    pub(crate) fn new(
        reader: &'r mut Reader<'a>,
        table: &'t DeTable<'a>,
        name: &'static str,
        at: Range<usize>,
    ) -> Self {
        Self {
            mistakes_before: reader.mistakes(),
            reader,
            fields: Fields::of(table),
            name,
            at,
            given: table.len(),
        }
    }

    /// How many keys the table has.
    pub(crate) fn given(&self) -> usize {
        self.given
    }

    /// Whether all was well so far: only then it makes sense to compare values with each other.
    pub(crate) fn is_sound(&self) -> bool {
        self.reader.mistakes() == self.mistakes_before
    }

    fn what(&self, key: &str) -> String {
        if self.name.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.name)
        }
    }

    /// The value of a key, if it is there.
    pub(crate) fn take(&mut self, key: &'static str) -> Option<&'t Spanned<DeValue<'a>>> {
        self.fields.take(key)
    }

    /// A number within its range, if it is there.
    pub(crate) fn optional_real(&mut self, key: &'static str, allowed: RangeInclusive<f64>) -> Option<f64> {
        let value = self.take(key)?;
        let stand_in = *allowed.start();
        Some(self.reader.real(value, &self.what(key), allowed).unwrap_or(stand_in))
    }

    /// A number within its range, or `default` if it is not there; without a default it has to be.
    pub(crate) fn real(
        &mut self,
        key: &'static str,
        allowed: RangeInclusive<f64>,
        default: impl Into<Option<f64>>,
    ) -> f64 {
        let (from, to) = (*allowed.start(), *allowed.end());
        self.optional_real(key, allowed).or(default.into()).unwrap_or_else(|| {
            self.missing(key, &format!("a number from {from} to {to}"));
            from
        })
    }

    /// A list of numbers, each within the range, if it is there.
    pub(crate) fn reals(&mut self, key: &'static str, allowed: RangeInclusive<f64>) -> Option<Vec<f64>> {
        let value = self.take(key)?;
        let Some(array) = value.get_ref().as_array() else {
            self.reader.wrong_type(value, &self.what(key), "a list of numbers");
            return Some(Vec::new());
        };
        let what = self.what(key);
        let numbers = array
            .iter()
            .filter_map(|element| self.reader.real(element, &what, allowed.clone()));
        Some(numbers.collect())
    }

    /// A whole number within its range, or `default` if it is not there; without a default it has to be.
    pub(crate) fn whole(
        &mut self,
        key: &'static str,
        allowed: RangeInclusive<i64>,
        default: impl Into<Option<i64>>,
    ) -> i64 {
        let (from, to) = (*allowed.start(), *allowed.end());
        match (self.take(key), default.into()) {
            (Some(value), _) => self.reader.number(value, &self.what(key), allowed).unwrap_or(from),
            (None, Some(default)) => default,
            (None, None) => {
                self.missing(key, &format!("a whole number from {from} to {to}"));
                from
            }
        }
    }

    /// A text, if it is there.
    pub(crate) fn text(&mut self, key: &'static str) -> Option<&'t str> {
        let value = self.take(key)?;
        self.reader.text(value, &self.what(key))
    }

    /// One of several words, or `default` if the key is not there.
    pub(crate) fn choice<T: Copy>(&mut self, key: &'static str, words: &[(&str, T)], default: T) -> T {
        let Some(value) = self.take(key) else { return default };
        let Some(word) = self.reader.text(value, &self.what(key)) else {
            return default;
        };
        if let Some((_, chosen)) = words.iter().find(|(name, _)| *name == word) {
            return *chosen;
        }
        let allowed: Vec<&str> = words.iter().map(|(name, _)| *name).collect();
        let what = format!("{}: expected {}, got {word}", self.what(key), allowed.join(" or "));
        self.reader.mistake(value.span(), what);
        default
    }

    /// Notes that a key is missing.
    pub(crate) fn missing(&mut self, key: &str, expected: &str) {
        let what = format!("{} is missing; expected is {expected}", self.what(key));
        self.reader.mistake(self.at.clone(), what);
    }

    /// Notes a mistake at a value, or at the head of the table if there is none.
    pub(crate) fn mistake(&mut self, value: Option<&Spanned<DeValue<'a>>>, what: impl Into<String>) {
        let at = value.map_or_else(|| self.at.clone(), Spanned::span);
        self.reader.mistake(at, what);
    }

    /// The reader of the whole file.
    pub(crate) fn reader(&mut self) -> &mut Reader<'a> {
        self.reader
    }

    /// Notes every key that nobody asked for.
    pub(crate) fn finish(self) {
        self.fields.finish(self.reader);
    }
}
