//! Feeds to the print mark: where marks may lie, and what happens when they are not there.

use film_feed::machine::{FilmConfig, MarkConfig, Missing};
use film_feed::operator::FeedPlan;
use film_feed::report::{FeedMode, TOLERANCE_MM};
use film_feed::rig::RigConfig;
use system_tests::{run, series};

fn with_marks(marks: MarkConfig) -> RigConfig {
    RigConfig {
        film: FilmConfig {
            marks,
            ..FilmConfig::default()
        },
        ..RigConfig::default()
    }
}

/// Film whose next mark always lies `ahead_mm` before the reader: their distance is 50 mm more.
fn mark_ahead(ahead_mm: f64) -> RigConfig {
    with_marks(MarkConfig {
        repeat_mm: ahead_mm + 50.0,
        tolerance_mm: 0.0,
        ..MarkConfig::default()
    })
}

#[test]
fn marks_at_1100_to_1200_mm_are_all_found_in_the_search_record() {
    // Film-feed specification, section 6: the next mark lies 1100…1200 mm ahead, always inside record 04.
    for ahead_mm in [1100.0, 1100.01, 1125.0, 1150.0, 1175.5, 1199.99, 1200.0] {
        let report = run(&mark_ahead(ahead_mm), series(FeedMode::Mark, 3));
        assert!(report.ok, "mark {ahead_mm} mm ahead:\n{report}");
        for feed in &report.feeds {
            let commanded_mm = feed.commanded_mm.unwrap();
            // Errors of the feed before shift the next way by as much.
            assert!((commanded_mm - ahead_mm - 50.0).abs() <= 2.0 * TOLERANCE_MM, "{report}");
            assert!(
                feed.error_mm.unwrap().abs() <= TOLERANCE_MM && !feed.reversed,
                "{report}"
            );
        }
    }
}

#[test]
fn scattered_marks_are_all_found() {
    for seed in 1..=5 {
        let report = run(
            &with_marks(MarkConfig {
                seed,
                ..MarkConfig::default()
            }),
            series(FeedMode::Mark, 20),
        );
        assert!(report.ok, "seed {seed}:\n{report}");
        let shortest = report
            .feeds
            .iter()
            .filter_map(|feed| feed.commanded_mm)
            .fold(f64::MAX, f64::min);
        let longest = report
            .feeds
            .iter()
            .filter_map(|feed| feed.commanded_mm)
            .fold(f64::MIN, f64::max);
        assert!(
            longest - shortest > 50.0,
            "the marks hardly scattered: {shortest}…{longest}"
        );
    }
}

#[test]
fn a_missed_mark_makes_the_search_run_on_to_the_next_one() {
    let marks = MarkConfig {
        tolerance_mm: 0.0,
        missing: Missing::Numbers(vec![2]),
        ..MarkConfig::default()
    };
    let report = run(&with_marks(marks), series(FeedMode::Mark, 3));
    assert!(report.ok, "{report}");
    let ways: Vec<f64> = report
        .feeds
        .iter()
        .map(|feed| feed.commanded_mm.unwrap().round())
        .collect();
    assert_eq!(ways, [1200.0, 2400.0, 1200.0], "{report}");
}

#[test]
fn film_without_marks_is_reported_and_never_a_silent_success() {
    // Film-feed specification, section 6: the record ends at its target without a touch probe.
    let marks = MarkConfig {
        missing: Missing::All,
        ..MarkConfig::default()
    };
    let report = run(&with_marks(marks), series(FeedMode::Mark, 1));
    let feed = &report.feeds[0];
    assert!(!report.ok && feed.finished, "{report}");
    assert_eq!(feed.error_mm, None);
    assert!(
        report.warnings.iter().any(|warning| warning.contains("no mark")),
        "{report}"
    );
    // 1100 mm, the tolerance band of 100 mm and one whole feed length.
    assert!((feed.film_mm.unwrap() - 2400.0).abs() < 0.1, "{report}");
}

#[test]
fn the_film_runs_backwards_only_above_the_speed_that_50_mm_can_brake() {
    // Fact sheet, section 4.2: √(2 · 2400 mm/s² · 50 mm) = 489.9 mm/s = 40.8 % of v_max.
    for (mark_speed, reversed) in [
        (1_000, false),
        (2_000, false),
        (4_000, false),
        (4_200, true),
        (6_000, true),
    ] {
        let plan = FeedPlan {
            mark_speed_hundredth_percent: mark_speed,
            ..series(FeedMode::Mark, 2)
        };
        let report = run(&mark_ahead(1150.0), plan);
        for feed in &report.feeds {
            assert_eq!(feed.reversed, reversed, "{mark_speed}: {report}");
            assert!(feed.error_mm.unwrap().abs() <= TOLERANCE_MM, "{mark_speed}: {report}");
        }
    }
}

#[test]
fn a_latch_sampled_each_millisecond_misses_by_up_to_the_way_of_one() {
    // Fact sheet, section 4.3: up to 1 ms · v = 0.24 mm at 240 mm/s, far outside ±0.01 mm.
    let mut config = with_marks(MarkConfig {
        seed: 3,
        ..MarkConfig::default()
    });
    config.drive.touch_input = lenze9300_model::traverse::LatchMode::Sampled1ms;
    let report = run(&config, series(FeedMode::Mark, 20));
    let errors: Vec<f64> = report.feeds.iter().map(|feed| feed.error_mm.unwrap()).collect();
    assert!(
        errors
            .iter()
            .all(|error| (-TOLERANCE_MM..0.24 + TOLERANCE_MM).contains(error)),
        "{report}"
    );
    assert!(errors.iter().any(|error| *error > 0.05), "{report}");
}
