//! A plan under way.

use super::interpolator::{Motion, PathState, Plan};

/// A plan and the time since its start: whole ticks and the fraction by which it began before its first tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActivePlan {
    pub(super) plan: Plan,
    ticks: u64,
    lead: f64,
}

impl ActivePlan {
    /// A plan that began `lead` milliseconds (0 to 1) before the present tick.
    pub(super) fn new(plan: Plan, lead: f64) -> Self {
        Self { plan, ticks: 0, lead }
    }

    pub(super) fn advance(&mut self) {
        self.ticks += 1;
    }

    pub(super) fn now(&self) -> Motion {
        self.plan.at(self.ticks, self.lead)
    }

    /// Time since the end of the plan in ms, once it is over.
    pub(super) fn time_past_end(&self) -> Option<f64> {
        let past = self.ticks as f64 + self.lead - self.plan.end()?;
        // A plan to a standstill may be cut by a microsecond: at most 1e-5 inc are left then, and a feed of 1.5 s must not
        // take 1501 ticks because a float came out one digit long.
        let tolerance = if self.plan.end_velocity() == 0.0 {
            END_TOLERANCE_MS
        } else {
            0.0
        };
        (past >= -tolerance).then_some(past.max(0.0))
    }

    /// State and lead for the next plan: from rest at this tick, on the fly at the exact moment of the crossing.
    pub(super) fn hand_over(&self) -> (PathState, f64) {
        match (self.time_past_end(), self.plan.end()) {
            (Some(past), Some(end)) if self.plan.end_velocity() != 0.0 && past < 1.0 => {
                (self.plan.at(0, end).state(), past)
            }
            _ => (self.now().state(), 0.0),
        }
    }
}

/// A microsecond: far below what a set-value can show, far above the rounding of an end time.
const END_TOLERANCE_MS: f64 = 1e-3;
