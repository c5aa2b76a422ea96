use std::fmt;

use super::{Row, Sizing, Verdict};

impl fmt::Display for Sizing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Sizing of {}: {} on {}", self.machine, self.motor, self.drive)?;
        write_rows(f, &self.rows)?;
        write!(f, "\n\n")?;
        if !self.assumed.is_empty() {
            writeln!(f, "Assumed, no source was found: {}.", self.assumed.join(", "))?;
        }
        writeln!(f, "{}", self.resistor_sentence())?;
        let failed: Vec<&str> = self.failures().map(|row| row.name.as_str()).collect();
        let judged = self.rows.iter().filter(|row| row.verdict() != Verdict::Info).count();
        if failed.is_empty() {
            write!(f, "All {judged} checks passed.")
        } else {
            write!(f, "{} of {judged} checks failed: {}.", failed.len(), failed.join("; "))
        }
    }
}

/// The rows as a table, each group with a head of its own; without a line end behind the last.
pub(super) fn write_rows(f: &mut fmt::Formatter<'_>, rows: &[Row]) -> fmt::Result {
    let widest = |text: fn(&Row) -> String| {
        let widths = rows.iter().map(|row| text(row).chars().count());
        widths.max().unwrap_or(0)
    };
    let name = widest(|row| row.name.clone());
    let value = widest(Row::shown_value).max(5);
    let limit = widest(Row::shown_limit).max(5);
    let mut group = "";
    for row in rows {
        if row.group != group {
            group = row.group;
            write!(
                f,
                "\n\n{group:<width$}  {:>value$}  {:>limit$}  {:>6}  {:<4}  formula",
                "value",
                "limit",
                "margin",
                "",
                width = name + 2,
            )?;
        }
        write!(
            f,
            "\n  {:<name$}  {:>value$}  {:>limit$}  {:>6}  {:<4}  {}",
            row.name,
            row.shown_value(),
            row.shown_limit(),
            row.shown_margin(),
            row.verdict(),
            row.formula,
        )?;
    }
    Ok(())
}

impl Sizing {
    /// Whether a brake resistor is needed, in one sentence.
    pub fn resistor_sentence(&self) -> String {
        let fitted = self.row("brake_on").is_some();
        match (self.resistor_needed, fitted) {
            (false, false) => "No brake resistor is needed: the link takes what comes back.".to_owned(),
            (false, true) => "The brake resistor is not needed: the link takes what comes back.".to_owned(),
            (true, true) => "A brake resistor is needed, and is fitted.".to_owned(),
            (true, false) => "A brake resistor is needed: the link cannot take what comes back.".to_owned(),
        }
    }
}
