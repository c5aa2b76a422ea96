//! What a search found, for people and for machines.

use std::fmt;

use serde::Serialize;
use serde::ser::{SerializeStruct, Serializer};

use super::search::Finding;

/// Something found, with the shortest way to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Case {
    /// What.
    pub what: &'static str,
    /// Where it is documented; `None` for a violation.
    pub documented: Option<&'static str>,
    /// In how many steps, or states for a dead end.
    pub count: usize,
    /// The shortest path to it.
    pub path: Vec<String>,
}

impl Case {
    pub(super) fn new(finding: Finding, path: Vec<String>) -> Self {
        Self {
            what: finding.what,
            documented: finding.documented,
            count: 1,
            path,
        }
    }

    pub(super) fn is(&self, finding: &Finding) -> bool {
        self.what == finding.what && self.documented == finding.documented
    }
}

/// Whether a model keeps its rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Everything was searched, and what was found is documented.
    Holds,
    /// Something was found that is not documented.
    Violated,
    /// The search was cut off, or there was nothing to search for.
    Incomplete,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// The model.
    pub model: String,
    /// Different states.
    pub states: usize,
    /// Steps between them.
    pub transitions: usize,
    /// Steps to the state that is furthest from the beginning.
    pub depth: u32,
    /// States where everything works.
    pub goals: usize,
    /// Undisturbed steps from the worst state back to one of those.
    pub longest_way_back: u32,
    /// Whether the search ended because there was nothing new.
    pub exhausted: bool,
    /// States without a way back, one case each kind.
    pub dead_ends: Vec<Case>,
    /// What the steps showed, one case each kind.
    pub findings: Vec<Case>,
}

impl Report {
    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        if self.violations().next().is_some() {
            Verdict::Violated
        } else if !self.exhausted || self.goals == 0 {
            Verdict::Incomplete
        } else {
            Verdict::Holds
        }
    }

    /// What is not documented.
    pub fn violations(&self) -> impl Iterator<Item = &Case> {
        self.cases().filter(|case| case.documented.is_none())
    }

    /// What the original is documented to do.
    pub fn documented(&self) -> impl Iterator<Item = &Case> {
        self.cases().filter(|case| case.documented.is_some())
    }

    fn cases(&self) -> impl Iterator<Item = &Case> {
        self.findings.iter().chain(&self.dead_ends)
    }
}

impl Serialize for Report {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let dead_ends: usize = self.dead_ends.iter().map(|case| case.count).sum();
        let mut fields = serializer.serialize_struct("Report", 10)?;
        fields.serialize_field("model", &self.model)?;
        fields.serialize_field("states", &self.states)?;
        fields.serialize_field("transitions", &self.transitions)?;
        fields.serialize_field("depth", &self.depth)?;
        fields.serialize_field("longest_way_back", &self.longest_way_back)?;
        fields.serialize_field("exhausted", &self.exhausted)?;
        fields.serialize_field("dead_ends", &dead_ends)?;
        fields.serialize_field("documented", &self.documented().collect::<Vec<_>>())?;
        fields.serialize_field("violations", &self.violations().collect::<Vec<_>>())?;
        fields.serialize_field("result", &self.verdict())?;
        fields.end()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = if self.exhausted { "all of them" } else { "cut off" };
        writeln!(
            f,
            "{}: {} states ({end}), {} transitions, {} steps deep, back within {} undisturbed steps",
            self.model, self.states, self.transitions, self.depth, self.longest_way_back
        )?;
        for case in self.cases() {
            let source = case.documented.unwrap_or("NOT DOCUMENTED");
            writeln!(f, "  {} ({} times): {source}", case.what, case.count)?;
            for (number, step) in case.path.iter().enumerate() {
                writeln!(f, "    {:>3}  {step}", number + 1)?;
            }
        }
        let verdict = match self.verdict() {
            Verdict::Holds if self.findings.is_empty() && self.dead_ends.is_empty() => "holds: nothing found",
            Verdict::Holds => "holds: what was found is documented",
            Verdict::Violated => "VIOLATED",
            Verdict::Incomplete => "INCOMPLETE: nothing is proved",
        };
        write!(f, "  {verdict}")
    }
}
