//! Feeds by length: where they land, how long they take, what they cost.

use film_feed::operator::FeedPlan;
use film_feed::report::{FeedMode, FeedReport, TOLERANCE_MM};
use film_feed::rig::RigConfig;
use system_tests::{INC_PER_MM, run, series};

#[test]
fn ten_of_ten_feeds_land_and_the_set_point_takes_one_and_a_half_seconds() {
    // Film-feed specification, section 9; fact sheet, section 11: 0.5 + 0.5 + 0.5 s.
    let report = run(&RigConfig::default(), series(FeedMode::Length, 10));
    assert!(report.ok, "{report}");
    assert_eq!(report.feeds.len(), 10);
    for feed in &report.feeds {
        assert!(feed.error_mm.unwrap().abs() <= TOLERANCE_MM, "{report}");
        assert_eq!(feed.set_point_s, Some(1.5), "{report}");
        assert!(!feed.reversed, "{report}");
        assert_in_position_time(feed, 2400.0);
    }
}

/// Not before the axis can be there, and not after JOB_FIN has said that it is.
///
/// While the set-value brakes with `a`, it is a·t²/2 away from the target at t before its end; the film is within
/// 0.01 mm of the target only when that way is at most 0.01 mm and the following error. JOB_FIN needs the axis inside the
/// target window (0.009 mm), which the film must not leave again.
fn assert_in_position_time(feed: &FeedReport, a_mm_s2: f64) {
    let in_position_s = feed.in_position_s.expect("the feed settled");
    let way_mm = TOLERANCE_MM + feed.max_following_error_mm.expect("the probe measures it");
    let earliest_s = feed.set_point_s.expect("the program ended") - (2.0 * way_mm / a_mm_s2).sqrt();
    let latest_s = feed.job_s.expect("JOB_FIN came");
    assert!(
        (earliest_s..=latest_s).contains(&in_position_s),
        "{in_position_s} s is not within {earliest_s}…{latest_s} s: {feed:?}"
    );
}

#[test]
fn every_length_lands_at_every_speed_and_acceleration() {
    for length_tenth_mm in [2_000, 2_001, 5_555, 9_875, 12_000, 15_003, 20_000] {
        for (speed, accel) in [
            (1_000, 1_000),
            (1_000, 10_000),
            (3_333, 5_000),
            (8_537, 10_000),
            (10_000, 1_000),
            (10_000, 10_000),
        ] {
            let plan = FeedPlan {
                length_tenth_mm,
                speed_hundredth_percent: speed,
                mark_speed_hundredth_percent: 1_000,
                accel_hundredth_percent: accel,
                ..series(FeedMode::Length, 2)
            };
            let report = run(&RigConfig::default(), plan);
            assert!(report.ok, "{length_tenth_mm} × 0.1 mm at {speed}/{accel}:\n{report}");
            for feed in &report.feeds {
                let expected_s = profile_s(f64::from(length_tenth_mm) / 10.0, f64::from(speed), f64::from(accel));
                let set_point_s = feed.set_point_s.unwrap();
                // The interpolator works in whole milliseconds: it reaches its target in the one that ends after it.
                assert!(
                    (expected_s - 1e-6..expected_s + 0.001).contains(&set_point_s),
                    "{length_tenth_mm} × 0.1 mm at {speed}/{accel}: {set_point_s} s, expected {expected_s} s"
                );
                assert_in_position_time(feed, 2400.0 * f64::from(accel) / 10_000.0);
            }
        }
    }
}

/// Time of a trapezoid or triangle, s: v/a + s/v or 2·√(s/a), with v_max 1200 mm/s and a_max 2400 mm/s² as 100 %.
fn profile_s(length_mm: f64, speed: f64, accel: f64) -> f64 {
    let v = 1200.0 * speed / 10_000.0;
    let a = 2400.0 * accel / 10_000.0;
    if length_mm >= v * v / a {
        length_mm / v + v / a
    } else {
        2.0 * (length_mm / a).sqrt()
    }
}

#[test]
fn the_rounding_of_the_target_is_the_only_error_that_adds_up() {
    // Fact sheet, section 11: 1200.0 mm is 3 074 216.455 inc and the drive keeps the integer part; the roller's own
    // constant π·57 mm lies 1.0e-7 above C1204. Both errors are the same in every feed.
    let report = run(&RigConfig::default(), series(FeedMode::Length, 40));
    let moved_mm: f64 = report.feeds.iter().map(|feed| feed.film_mm.unwrap()).sum();
    let roller_mm_per_inc = std::f64::consts::PI * 57.0 / (7.0 * 65_536.0);
    let expected_mm = 40.0 * 3_074_216.0 * roller_mm_per_inc;
    // The first and the last standstill may each lie some increments beside their set-value, no more.
    assert!(
        (moved_mm - expected_mm).abs() < 4.0 / INC_PER_MM,
        "{moved_mm} against {expected_mm}"
    );
}

#[test]
fn speed_torque_and_following_error_are_those_of_the_sizing() {
    let report = run(&RigConfig::default(), series(FeedMode::Length, 1));
    let feed = &report.feeds[0];
    // Fact sheet, section 11: 1200 mm/s is 2814.53 1/min; thesis ch. 9: the motor swings about 2 % around it.
    let peak_rpm = feed.peak_rpm.unwrap();
    assert!((2814.5..2814.5 * 1.02).contains(&peak_rpm), "{peak_rpm}");
    // Fact sheet, section 6: 2400 mm/s² is 589.5 rad/s² at the motor; design.md section 6: J = (0.25 + 0.664)·10⁻⁴
    // kg m²; fact sheet, section 6: friction 0.05 Nm. The speed controller overshoots above the steady torque.
    let steady_nm = 589.5 * (0.25 + 0.664) * 1e-4 + 0.05;
    let peak_nm = feed.peak_torque_nm.unwrap();
    assert!(
        (steady_nm..1.5 * steady_nm).contains(&peak_nm),
        "{peak_nm} against {steady_nm}"
    );
    // Torque constant 0.778 Nm/A rms (fact sheet, section 6): the peak current belongs to the peak torque.
    assert!(feed.rms_current_a.unwrap() < peak_nm / 0.778);
    assert!(feed.rms_current_a.unwrap() > 0.3 * steady_nm / 0.778);
}
