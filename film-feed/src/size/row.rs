//! One line of a sizing: a figure, what it may be, how far it is from that.

use std::fmt;

use serde::{Serialize, Serializer};

/// What a figure may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// It is told, not judged.
    None,
    /// No more than this.
    AtMost(f64),
    /// No less than this.
    AtLeast(f64),
    /// From the first to the second.
    Within(f64, f64),
}

/// How a row came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Told, not judged.
    Info,
    /// Within its limit.
    Pass,
    /// Beyond its limit.
    Fail,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Info => "–",
            Self::Pass => "pass",
            Self::Fail => "FAIL",
        })
    }
}

/// A figure of a sizing with its judgement.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What it belongs to.
    pub group: &'static str,
    /// Short name that stays the same from version to version.
    pub id: &'static str,
    /// What it is.
    pub name: String,
    /// The figure.
    pub value: f64,
    /// Its unit; empty for a plain number.
    pub unit: &'static str,
    /// What it may be.
    pub limit: Limit,
    /// How it is reckoned.
    pub formula: String,
}

impl Row {
    /// Whether the figure is within its limit.
    pub fn verdict(&self) -> Verdict {
        let within = match self.limit {
            Limit::None => return Verdict::Info,
            Limit::AtMost(most) => self.value <= most,
            Limit::AtLeast(least) => self.value >= least,
            Limit::Within(least, most) => (least..=most).contains(&self.value),
        };
        if within { Verdict::Pass } else { Verdict::Fail }
    }

    /// What is left up to the nearer limit, as a share of that limit; negative beyond it.
    pub fn margin(&self) -> Option<f64> {
        let below = |most: f64| (most - self.value) / most;
        let above = |least: f64| (self.value - least) / least;
        let margin = match self.limit {
            Limit::None => return None,
            Limit::AtMost(most) => below(most),
            Limit::AtLeast(least) => above(least),
            Limit::Within(least, most) => below(most).min(above(least)),
        };
        margin.is_finite().then_some(margin)
    }

    /// The figure with its unit.
    pub fn shown_value(&self) -> String {
        with_unit(self.value, self.unit)
    }

    /// The limit with its unit; empty if there is none.
    pub fn shown_limit(&self) -> String {
        match self.limit {
            Limit::None => String::new(),
            Limit::AtMost(most) => format!("≤ {}", with_unit(most, self.unit)),
            Limit::AtLeast(least) => format!("≥ {}", with_unit(least, self.unit)),
            Limit::Within(least, most) => format!("{}…{}", number(least), with_unit(most, self.unit)),
        }
    }

    /// The margin in percent; empty if there is none.
    pub fn shown_margin(&self) -> String {
        self.margin()
            .map_or(String::new(), |margin| format!("{:.0} %", 100.0 * margin))
    }
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (least, most) = match self.limit {
            Limit::None => (None, None),
            Limit::AtMost(most) => (None, Some(most)),
            Limit::AtLeast(least) => (Some(least), None),
            Limit::Within(least, most) => (Some(least), Some(most)),
        };
        RowView {
            group: self.group,
            id: self.id,
            name: &self.name,
            value: self.value,
            unit: self.unit,
            least,
            most,
            margin: self.margin(),
            verdict: self.verdict(),
            formula: &self.formula,
        }
        .serialize(serializer)
    }
}

#[derive(Serialize)]
struct RowView<'a> {
    group: &'static str,
    id: &'static str,
    name: &'a str,
    value: f64,
    unit: &'static str,
    least: Option<f64>,
    most: Option<f64>,
    margin: Option<f64>,
    verdict: Verdict,
    formula: &'a str,
}

fn with_unit(value: f64, unit: &str) -> String {
    let number = number(value);
    if unit.is_empty() {
        number
    } else {
        format!("{number} {unit}")
    }
}

/// Four significant digits, without a tail of zeros; very small ones with a power of ten.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value:.0}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    if magnitude < -3 {
        return format!("{value:.3e}");
    }
    let decimals = usize::try_from(3 - magnitude).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(value: f64, limit: Limit) -> Row {
        Row {
            group: "",
            id: "",
            name: String::new(),
            value,
            unit: "A",
            limit,
            formula: String::new(),
        }
    }

    #[test]
    fn a_row_is_judged_at_its_nearer_limit() {
        let cases = [
            (row(3.0, Limit::AtMost(4.0)), Verdict::Pass, Some(0.25)),
            (row(5.0, Limit::AtMost(4.0)), Verdict::Fail, Some(-0.25)),
            (row(5.0, Limit::AtLeast(4.0)), Verdict::Pass, Some(0.25)),
            (row(3.0, Limit::Within(2.0, 4.0)), Verdict::Pass, Some(0.25)),
            (row(1.0, Limit::Within(2.0, 4.0)), Verdict::Fail, Some(-0.5)),
            (row(1.0, Limit::None), Verdict::Info, None),
            (row(1.0, Limit::AtMost(0.0)), Verdict::Fail, None),
            (row(f64::NAN, Limit::AtMost(1.0)), Verdict::Fail, None),
        ];
        for (row, verdict, margin) in cases {
            assert_eq!((row.verdict(), row.margin()), (verdict, margin), "{row:?}");
        }
    }

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (11.4081, "11.41"),
            (2814.529, "2815"),
            (0.25, "0.25"),
            (0.000_066_4, "6.640e-5"),
            (-0.003_881, "-0.003881"),
            (12_000_000.0, "12000000"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
