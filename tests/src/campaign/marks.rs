//! Faults of the mark reader.

use film_feed::machine::{FilmConfig, MarkConfig, Missing, ReaderParams};
use film_feed::report::FeedMode;
use film_feed::rig::RigConfig;
use film_feed::run::{Observation, observed};

use super::{Draw, Family};
use crate::safety_monitor::SafetyMonitor;
use crate::series;

/// The reader's contact bounces.
pub(super) const BOUNCING: Family = Family {
    name: "reader-bounces",
    fault: "reader that bounces 1 to 8 times, 10 to 100 µs apart, at each edge of a mark; two feeds by mark",
    rule: "the first edge counts: every feed lands within ±0.01 mm of 50 mm behind its mark",
    case: bouncing,
};

fn bouncing(draw: &mut Draw) -> Result<(), String> {
    let config = RigConfig {
        reader: ReaderParams {
            bounces: draw.between(1, 8) as u32,
            bounce_us: draw.between(10, 100) as f64,
            ..ReaderParams::default()
        },
        film: FilmConfig {
            marks: MarkConfig {
                seed: draw.between(1, 1_000_000),
                ..MarkConfig::default()
            },
            ..FilmConfig::default()
        },
        ..RigConfig::default()
    };
    let mut monitor = SafetyMonitor::of_a_moving_axis();
    let (report, _) = observed(
        &config,
        series(FeedMode::Mark, 2),
        Observation::FeedsOnly,
        &mut monitor,
        || {},
    )
    .map_err(|error| error.to_string())?;
    match monitor.violation() {
        Some(violation) => Err(violation.to_string()),
        None if report.ok => Ok(()),
        None => Err(report.to_string()),
    }
}

/// The reader is dead.
pub(super) const DEAD: Family = Family {
    name: "reader-dead",
    fault: "reader that never switches; a feed by mark at 10 to 40 % search speed",
    rule: "the film stops at 2400 mm, the end of the search, and the run reports that no mark was found: never a silent success",
    case: dead,
};

fn dead(draw: &mut Draw) -> Result<(), String> {
    let config = RigConfig {
        film: FilmConfig {
            marks: MarkConfig {
                missing: Missing::All,
                ..MarkConfig::default()
            },
            ..FilmConfig::default()
        },
        ..RigConfig::default()
    };
    let plan = film_feed::operator::FeedPlan {
        mark_speed_hundredth_percent: draw.between(1_000, 4_000) as i16,
        ..series(FeedMode::Mark, 1)
    };
    // The recorder of the run takes the events of the program: the monitor judges motion, torque and state.
    let mut monitor = SafetyMonitor::of_a_moving_axis();
    let (report, _) =
        observed(&config, plan, Observation::FeedsOnly, &mut monitor, || {}).map_err(|error| error.to_string())?;
    let told = report.warnings.iter().any(|warning| warning.contains("no mark"));
    let moved_mm = report.feeds.first().and_then(|feed| feed.film_mm);
    let stopped = moved_mm.is_some_and(|moved| (moved - 2_400.0).abs() < 0.1);
    if report.ok || !told || !stopped {
        return Err(format!("moved {moved_mm:?} mm:\n{report}"));
    }
    match monitor.violation() {
        None => Ok(()),
        Some(violation) => Err(violation.to_string()),
    }
}
