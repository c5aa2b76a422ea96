//! Feeds to the print mark: where marks may lie, and what happens when they are not there.

use film_feed::machine::{FilmConfig, MarkConfig, Missing};
use film_feed::operator::FeedPlan;
use film_feed::report::{FeedMode, TOLERANCE_MM};
use film_feed::rig::RigConfig;
use film_feed::run::{Observation, simulated};
use film_feed::scope::Sample;
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
fn the_set_value_turns_round_only_above_the_speed_that_50_mm_can_brake() {
    // Fact sheet, section 4.2: √(2 · 2400 mm/s² · 50 mm) = 489.9 mm/s = 40.8 % of v_max. The program looks at the latch
    // once a millisecond, by which the axis may be as much nearer to its target: between 40.6 % and 40.8 % it depends.
    for (mark_speed, reverses) in [
        (1_000, false),
        (2_000, false),
        (4_000, false),
        (4_060, false),
        (4_090, true),
        (4_200, true),
        (6_000, true),
    ] {
        let v_mm_s = 1200.0 * f64::from(mark_speed) / 10_000.0;
        let braking_mm = v_mm_s * v_mm_s / (2.0 * 2400.0);
        assert_eq!(braking_mm > 50.0, reverses, "the table is wrong");
        assert!(reverses || braking_mm + 0.001 * v_mm_s <= 50.0, "the table is wrong");

        let plan = FeedPlan {
            mark_speed_hundredth_percent: mark_speed,
            ..series(FeedMode::Mark, 2)
        };
        let (report, samples) = simulated(&mark_ahead(1150.0), plan, Observation::Samples, || {}).unwrap();
        for feed in &report.feeds {
            let samples: Vec<&Sample> = samples.iter().filter(|sample| sample.feed == feed.n).collect();
            // Way of the set-value backwards: its speed is linear between two samples a millisecond apart.
            let mm_per_s_and_rpm = std::f64::consts::PI * 57.0 / 7.0 / 60.0;
            let back_mm: f64 = samples
                .iter()
                .map(|sample| (-sample.speed_set_rpm).max(0.0) * mm_per_s_and_rpm * 0.001)
                .sum();
            // It passes the target by what 50 mm lack, and by the way of the millisecond at most.
            let expected = if reverses {
                braking_mm - 50.0 - 0.002..braking_mm - 50.0 + 0.001 * v_mm_s + 0.002
            } else {
                0.0..1e-9
            };
            assert!(expected.contains(&back_mm), "{mark_speed}: {back_mm} {expected:?}");
            assert!(feed.error_mm.unwrap().abs() <= TOLERANCE_MM, "{mark_speed}: {report}");
            assert!(feed.reversed || !reverses, "{mark_speed}: {report}");

            // Behind a set-value that never turns round the film swings by no more than it follows wrongly: once to
            // either side.
            let swing_mm = retreat(samples.iter().map(|sample| sample.film_mm));
            if !reverses {
                assert!(
                    swing_mm <= 2.0 * feed.max_following_error_mm.unwrap(),
                    "{mark_speed}: {swing_mm}"
                );
            }
            // Samples lie further apart than ticks: they may miss the very top of a swing, never invent one.
            assert!(feed.reversed || swing_mm <= TOLERANCE_MM, "{mark_speed}: {swing_mm}");
        }
    }
}

/// Greatest way back from the highest position before.
fn retreat(positions: impl Iterator<Item = f64>) -> f64 {
    let (mut highest, mut deepest) = (f64::MIN, 0.0_f64);
    for position in positions {
        highest = highest.max(position);
        deepest = deepest.max(highest - position);
    }
    deepest
}

#[test]
fn marks_are_found_at_every_reading_speed_and_acceleration() {
    // Below the speeds at which 50 mm are too short to brake (fact sheet, section 4.2: 40.8 %, 28.9 % at half and 12.9 %
    // at a tenth of the acceleration) nothing turns round; above them the film still lands.
    for (accel, speeds) in [
        (10_000, [1_000, 2_500, 5_000, 10_000]),
        (5_000, [1_000, 2_000, 2_800, 6_000]),
        (1_000, [1_000, 1_200, 2_000, 4_000]),
    ] {
        for mark_speed in speeds {
            let plan = FeedPlan {
                mark_speed_hundredth_percent: mark_speed,
                accel_hundredth_percent: accel,
                ..series(FeedMode::Mark, 2)
            };
            let report = run(&with_marks(MarkConfig::default()), plan);
            assert!(report.ok, "{mark_speed}/{accel}: {report}");
            for feed in &report.feeds {
                assert!(feed.in_position_s <= feed.job_s, "{mark_speed}/{accel}: {report}");
            }
        }
    }
}

#[test]
fn the_mark_counts_at_any_feed_length() {
    // Record 03 travels the length less 100 mm, record 04 searches 100 mm and one more length (film-feed specification,
    // section 6): with ±50 mm of print the mark lies inside the search whatever the length is.
    for length_tenth_mm in [2_000, 6_500, 20_000] {
        let length_mm = f64::from(length_tenth_mm) / 10.0;
        let config = with_marks(MarkConfig {
            repeat_mm: length_mm,
            tolerance_mm: 50.0,
            ..MarkConfig::default()
        });
        let plan = FeedPlan {
            length_tenth_mm,
            ..series(FeedMode::Mark, 5)
        };
        let report = run(&config, plan);
        assert!(report.ok, "{length_mm} mm: {report}");
    }
}

#[test]
fn a_mark_before_the_search_is_not_seen_and_the_feed_goes_to_the_next_one() {
    // Film-feed specification, section 6: only record 04 has a touch probe; 03 ends at the length − 100 mm.
    let report = run(&mark_ahead(1099.0), series(FeedMode::Mark, 1));
    // The next mark lies one distance (1149 mm) further.
    let expected_mm = 1099.0 + 1149.0 + 50.0;
    assert!(report.ok, "{report}");
    assert!(
        (report.feeds[0].film_mm.unwrap() - expected_mm).abs() <= TOLERANCE_MM,
        "{report}"
    );
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
