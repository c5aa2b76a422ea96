//! What the feeds of one machine came to.

use super::quantile;
use crate::report::{FeedReport, RunReport};

/// A column of the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    /// Its name, with the unit at its end.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Whether it counts something.
    pub is_count: bool,
}

const fn count(name: &'static str, meaning: &'static str) -> Output {
    Output {
        name,
        meaning,
        is_count: true,
    }
}

const fn real(name: &'static str, meaning: &'static str) -> Output {
    Output {
        name,
        meaning,
        is_count: false,
    }
}

/// The figures of a machine, in their order in the result. Quantiles are over its feeds (see [`quantile`]); `p95` is the 95 % one.
/// Missing where no feed has the figure.
pub const OUTPUTS: &[Output] = &[
    count("feeds", "feeds that were started"),
    count("finished", "feeds for which JOB_FIN came"),
    count("landed", "feeds that finished within feed.tolerance_mm"),
    count(
        "reversed",
        "feeds during which the film ran backwards by more than 0.01 mm",
    ),
    count("no_target", "feeds without a known target: no mark was found"),
    real("error_p05_um", "film moved minus film commanded, µm"),
    real("error_p50_um", "the same"),
    real("error_p95_um", "the same"),
    real("abs_error_p95_um", "magnitude of the error, µm"),
    real("abs_error_max_um", "the same"),
    real(
        "in_position_p50_s",
        "start of the program to within ±0.01 mm for good, s; of the feeds that came there",
    ),
    real("in_position_p95_s", "the same"),
    real("in_position_max_s", "the same"),
    real("job_p50_s", "POS_START to JOB_FIN as the PLC sees it, s"),
    real("job_max_s", "the same"),
    real(
        "following_error_max_mm",
        "largest distance between set-value and actual value, mm",
    ),
    real("peak_speed_rpm", "highest motor speed, 1/min"),
    real("peak_torque_nm", "highest air-gap torque, Nm"),
    real("peak_current_a", "highest motor current, A rms"),
    real(
        "rms_current_max_a",
        "motor current over a feed, A rms, of the worst feed",
    ),
    real(
        "mains_j",
        "energy from the mains over the whole run, its start and the pauses among it, J",
    ),
    real("copper_j", "heat in the windings, J"),
    real("friction_j", "heat of friction, J"),
    real("regenerated_j", "what braking gave back to the DC link, J"),
    real("simulated_s", "time that passed in the machine, s"),
];

/// The figures of one machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// In the order of [`OUTPUTS`]; NaN where there is none.
    pub values: Vec<f64>,
    /// Why the run ended early; empty if it did not.
    pub aborted: String,
}

impl Outcome {
    /// What a run came to, with `tolerance_mm` for "landed".
    pub fn new(report: &RunReport, tolerance_mm: f64) -> Self {
        let feeds = &report.feeds;
        let count = |is: &dyn Fn(&FeedReport) -> bool| feeds.iter().filter(|feed| is(feed)).count() as f64;
        let sorted = |value: &dyn Fn(&FeedReport) -> Option<f64>| {
            let mut values: Vec<f64> = feeds.iter().filter_map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let error_um = sorted(&|feed| feed.error_mm.map(|mm| mm * 1000.0));
        let abs_error_um = sorted(&|feed| feed.error_mm.map(|mm| mm.abs() * 1000.0));
        let in_position_s = sorted(&|feed| feed.in_position_s);
        let job_s = sorted(&|feed| feed.job_s);
        let largest = |value: &dyn Fn(&FeedReport) -> Option<f64>| quantile(&sorted(value), 1.0);
        let energy = |value: fn(&crate::report::EnergyReport) -> f64| report.energy.as_ref().map_or(f64::NAN, value);
        let values = vec![
            feeds.len() as f64,
            count(&|feed| feed.finished),
            count(&|feed| feed.finished && feed.error_mm.is_some_and(|mm| mm.abs() <= tolerance_mm)),
            count(&|feed| feed.reversed),
            count(&|feed| feed.commanded_mm.is_none()),
            quantile(&error_um, 0.05),
            quantile(&error_um, 0.5),
            quantile(&error_um, 0.95),
            quantile(&abs_error_um, 0.95),
            quantile(&abs_error_um, 1.0),
            quantile(&in_position_s, 0.5),
            quantile(&in_position_s, 0.95),
            quantile(&in_position_s, 1.0),
            quantile(&job_s, 0.5),
            quantile(&job_s, 1.0),
            largest(&|feed| feed.max_following_error_mm),
            largest(&|feed| feed.peak_rpm),
            largest(&|feed| feed.peak_torque_nm),
            largest(&|feed| feed.peak_current_a),
            largest(&|feed| feed.rms_current_a),
            energy(|energy| energy.mains_j),
            energy(|energy| energy.copper_j),
            energy(|energy| energy.friction_j),
            energy(|energy| energy.regenerated_j),
            report.simulated_s,
        ];
        Outcome {
            values,
            aborted: report.aborted.clone().unwrap_or_default(),
        }
    }

    /// A figure by its name; NaN where there is none.
    pub fn value(&self, name: &str) -> f64 {
        let place = OUTPUTS.iter().position(|output| output.name == name);
        place
            .and_then(|place| self.values.get(place))
            .copied()
            .unwrap_or(f64::NAN)
    }

    /// Whether all feeds of the machine landed.
    pub fn all_landed(&self) -> bool {
        self.aborted.is_empty() && self.value("landed") == self.value("feeds")
    }
}
