//! The reference of the codes, printed from their table.

use core::fmt;

use super::table::{CODE_TABLE, CodeEntry, Domain, Effect, Kind, Writable};

/// Prints the table of codes as Markdown.
///
/// `docs/codes.md` is this print-out; a test compares the two.
#[derive(Debug, Clone, Copy, Default)]
pub struct CodeReference;

impl fmt::Display for CodeReference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| code | meaning | values | unit | factory | written | model |")?;
        writeln!(f, "|---|---|---|---|---|---|---|")?;
        for entry in CODE_TABLE {
            writeln!(
                f,
                "| {} | {} | {} | {} | {} | {} | {} |",
                Name(entry),
                entry.name,
                Values(entry),
                entry.unit,
                Factory(entry),
                written(entry),
                match entry.effect {
                    Effect::Acts => "modelled",
                    Effect::Kept => "stored only",
                },
            )?;
        }
        Ok(())
    }
}

struct Name<'a>(&'a CodeEntry);

impl fmt::Display for Name<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entry = self.0;
        match (entry.first_subcode, entry.last_subcode) {
            (0, 0) => write!(f, "C{:04}", entry.number),
            (first, last) if first == last => write!(f, "C{:04}/{first}", entry.number),
            (first, last) => write!(f, "C{:04}/{first}…{last}", entry.number),
        }
    }
}

struct Values<'a>(&'a CodeEntry);

impl fmt::Display for Values<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let show = |raw| self.0.decimal(raw);
        match self.0.domain {
            Domain::Range { min, max, step } => write!(f, "{} {{{}}} {}", show(min), show(step), show(max)),
            Domain::Selection(values) => {
                for (place, value) in values.iter().enumerate() {
                    write!(f, "{}{}", if place == 0 { "" } else { ", " }, show(*value))?;
                }
                Ok(())
            }
        }
    }
}

struct Factory<'a>(&'a CodeEntry);

impl fmt::Display for Factory<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.kind == Kind::Display {
            return f.write_str("–");
        }
        for (place, value) in self.0.factory.iter().enumerate() {
            write!(f, "{}{}", if place == 0 { "" } else { ", " }, self.0.decimal(*value))?;
        }
        if self.0.factory.len() > 1 && self.0.factory.len() < self.0.count() {
            f.write_str("…")?;
        }
        Ok(())
    }
}

const fn written(entry: &CodeEntry) -> &'static str {
    match (entry.kind, entry.writable) {
        (Kind::Display, _) | (_, Writable::Never) => "display",
        (Kind::Action, Writable::Always) => "command",
        (Kind::Action, Writable::OnlyInhibited) => "command, inhibited only",
        (Kind::Stored, Writable::Always) => "always",
        (Kind::Stored, Writable::OnlyInhibited) => "inhibited only",
    }
}
