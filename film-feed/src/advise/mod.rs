//! Advice before anything moves: what these values will do, and what the thesis' block does when something happens.
//!
//! Every finding has a cause, a number with its limit, and a remedy. Two kinds:
//!
//! - [`Severity::Fails`]: the feeds of this machine go wrong by its values alone;
//! - [`Severity::Hazard`]: they go wrong when something else happens, such as a warning of the drive or a dip of the mains (9300 facts 9.1).
//!
//! | id | what is compared | source |
//! |---|---|---|
//! | `reversal` | braking from the mark-reading velocity ↔ residual path | 9300 facts 4.2, 9.1 |
//! | `mark_early`, `mark_late` | where the next mark can lie ↔ where it is searched | film-feed specification 6 |
//! | `speed` | motor speed ↔ C0011, C0596 | film-feed specification 5; 9300 facts 4.7 |
//! | `torque` | torque of the ramps ↔ C0022 | 9300 facts 4.4 |
//! | `following_error` | following error of the ramps ↔ C1218/1 | 9300 facts 4.7 |
//! | `latch`, `reader` | way of the film until the edge is seen ↔ tolerance | 9300 facts 4.3 |
//! | `resolver` | step of the resolver ↔ tolerance | 9300 facts 4.6 |
//! | `target_window` | JOB_FIN ↔ tolerance | 9300 facts 4.3 |
//! | `range` | longest way ↔ 32 bits; POS_ACT ↔ 24 bits of a REAL | film-feed specification 4, 8 |
//! | `cycle` | motion, PLC and bus ↔ time from start to start | 9300 facts 1.6 |
//! | `lost_start` | start by the clock ↔ end of the program | 9300 facts 4.3, 9.1 |
//! | `unwanted_start` | warnings that make a start edge | 9300 facts 9.1 |
//! | `zero_outputs` | coasting when the master goes to Clear | 9300 facts 9.1 |
//! | `errors_as_data` | POS_ACT after a rejected read | 9300 facts 9.1 |
//! | `message_recovery` | C0142 ↔ a dip of the mains | 9300 facts 2.5, 9.1 |
//!
//! ```
//! use film_feed::advise::advise;
//! use film_feed::operator::FeedPlan;
//! use film_feed::rig::RigConfig;
//!
//! let plan = FeedPlan { mark_speed_hundredth_percent: 4_500, ..FeedPlan::default() };
//! let advice = advise(&RigConfig::default(), &plan, &Default::default());
//! let reversal = advice.find("reversal").ok_or("540 mm/s is too fast for 50 mm")?;
//! assert!((reversal.value - 61.29).abs() < 0.01); // 540²/(2 · 2400) + 540 · 1 ms
//! # Ok::<(), &str>(())
//! ```

mod block;
mod motion;
mod values;

use std::fmt;

use serde::Serialize;

use crate::operator::FeedPlan;
use crate::report::TOLERANCE_MM;
use crate::rig::RigConfig;
use values::Values;

/// How sure a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// By these values alone.
    Fails,
    /// When something else happens.
    Hazard,
}

/// One thing to know before the machine runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Short name that stays the same from version to version.
    pub id: &'static str,
    /// How sure it is.
    pub severity: Severity,
    /// What happens, and why.
    pub cause: String,
    /// The number it hangs on.
    pub value: f64,
    /// What the number may be; none where there is no bound but the event itself.
    pub limit: Option<f64>,
    /// Unit of both.
    pub unit: &'static str,
    /// What to do.
    pub remedy: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.id, self.cause, self.remedy)
    }
}

/// What a machine file knows and a run does not need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demands {
    /// How far a feed may be from what was asked for, mm.
    pub tolerance_mm: f64,
    /// Time from start to start of a machine that starts by the clock, s; none when the operator waits for JOB_FIN.
    pub cycle_s: Option<f64>,
}

impl Default for Demands {
    fn default() -> Self {
        Demands {
            tolerance_mm: TOLERANCE_MM,
            cycle_s: None,
        }
    }
}

/// All findings of a machine; those that fail come first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Advice {
    /// What was found.
    pub findings: Vec<Finding>,
    /// Whether nothing fails by the values alone.
    pub ok: bool,
}

impl Advice {
    /// The finding of this name.
    pub fn find(&self, id: &str) -> Option<&Finding> {
        self.findings.iter().find(|finding| finding.id == id)
    }

    /// Those that fail by the values alone.
    pub fn failures(&self) -> impl Iterator<Item = &Finding> {
        self.findings
            .iter()
            .filter(|finding| finding.severity == Severity::Fails)
    }
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (severity, title) in [
            (Severity::Fails, "Goes wrong with these values"),
            (Severity::Hazard, "Goes wrong when something happens"),
        ] {
            let mut found = self
                .findings
                .iter()
                .filter(|finding| finding.severity == severity)
                .peekable();
            if found.peek().is_none() {
                continue;
            }
            writeln!(f, "{title}")?;
            for finding in found {
                write!(f, "  {}: {}", finding.id, short(finding.value))?;
                match finding.limit {
                    Some(limit) => writeln!(f, " {} against {} {}", finding.unit, short(limit), finding.unit)?,
                    None => writeln!(f, " {}", finding.unit)?,
                }
                writeln!(f, "    why:    {}", finding.cause)?;
                writeln!(f, "    remedy: {}", finding.remedy)?;
            }
            writeln!(f)?;
        }
        let fails = self.failures().count();
        if fails == 0 {
            write!(f, "nothing goes wrong by these values alone")
        } else {
            write!(
                f,
                "{fails} of {} findings go wrong by these values alone",
                self.findings.len()
            )
        }
    }
}

/// Looks at everything that [`crate::run`] would be given.
pub fn advise(rig: &RigConfig, plan: &FeedPlan, demands: &Demands) -> Advice {
    let values = Values::new(rig, plan, demands);
    let mut findings = motion::findings(&values);
    findings.extend(block::findings(&values));
    findings.sort_by_key(|finding| finding.severity);
    let ok = findings.iter().all(|finding| finding.severity != Severity::Fails);
    Advice { findings, ok }
}

/// A number with four digits that count.
fn short(value: f64) -> String {
    let size = value.abs();
    let decimals = if size >= 1000.0 || size == 0.0 {
        0
    } else {
        (3 - size.log10().floor() as i32).clamp(0, 6) as usize
    };
    format!("{value:.decimals$}")
}
