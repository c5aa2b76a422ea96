//! The bus under the chain: baud rates, bit errors, a cut cable, the watchdog.

use dp_master::dp::SlaveState;
use dp_master::time::Baud;
use film_feed::operator::FeedPlan;
use film_feed::report::{FeedMode, TOLERANCE_MM};
use film_feed::rig::RigConfig;
use system_tests::{MILLISECOND, SECOND, in_mid_feed, ready, run, run_for, series};

#[test]
fn feeds_land_at_every_baud_rate_and_no_rule_of_the_line_is_broken() {
    for baud in Baud::ALL {
        let mut config = RigConfig {
            baud,
            ..RigConfig::default()
        };
        // Below 187.5 kbit/s a DP cycle takes longer than the PLC's default cycle; the block does not mind.
        config.plc_cycle_ns = 10 * MILLISECOND;
        let report = run(&config, series(FeedMode::Length, 1));
        assert!(report.ok, "{} bit/s:\n{report}", baud.bits_per_second());
        let mut rig = ready(&config);
        run_for(&mut rig, SECOND);
        assert!(
            rig.line().violations().is_empty(),
            "{} bit/s: {:?}",
            baud.bits_per_second(),
            rig.line().violations()
        );
    }
}

#[test]
fn an_exchange_takes_the_bus_time_of_its_telegrams() {
    // Fact sheet, section 1.6: two telegrams of 25 characters and Tsdr, about 655 tBIT with Tid1, 55 µs at 12 Mbit/s.
    let config = RigConfig {
        dp_cycle_ns: 0,
        ..RigConfig::default()
    };
    let report = run(&config, series(FeedMode::Length, 1));
    let t_bit_us = 1.0 / 12.0;
    let telegrams_us = 2.0 * 25.0 * 11.0 * t_bit_us;
    let least_us = telegrams_us + 11.0 * t_bit_us;
    assert!(
        (least_us..least_us + 1.0).contains(&report.bus.exchange_us),
        "{} against {least_us}",
        report.bus.exchange_us
    );
    // Min_Slave_Intervall 1 × 100 µs (fact sheet, section 1.1) is what limits the free-running cycle.
    // The mean counts the cycles of the start-up too, which have no Data_Exchange to wait for.
    assert!((99.9..103.0).contains(&report.bus.cycle_us), "{}", report.bus.cycle_us);
}

#[test]
fn with_one_bit_in_a_hundred_thousand_wrong_the_feeds_land_and_the_retries_are_counted() {
    for seed in 1..=3 {
        let config = RigConfig {
            bit_error_rate: 1e-5,
            seed,
            ..RigConfig::default()
        };
        let report = run(&config, FeedPlan::default());
        assert!(report.ok, "seed {seed}:\n{report}");
        assert!(report.bus.retries > 0 && report.bus.rejected > 0, "{report}");
        assert!(
            report
                .feeds
                .iter()
                .all(|feed| feed.error_mm.unwrap().abs() <= TOLERANCE_MM)
        );
    }
}

#[test]
fn two_runs_with_the_same_seed_are_identical_to_the_bit() {
    let config = RigConfig {
        bit_error_rate: 1e-5,
        seed: 42,
        ..RigConfig::default()
    };
    let figures = || {
        let report = run(&config, FeedPlan::default());
        // The shortest decimal form of a float is unique to its bits.
        serde_json::to_string(&report).unwrap()
    };
    let first = figures();
    assert_eq!(first, figures());
    let other = run(&RigConfig { seed: 43, ..config }, FeedPlan::default());
    assert_ne!(
        first,
        serde_json::to_string(&other).unwrap(),
        "the seed changes nothing"
    );
}

#[test]
fn a_cut_cable_ends_data_exchange_and_a_mended_one_brings_it_back() {
    let mut rig = ready(&RigConfig::default());
    rig.disconnect_module();
    run_for(&mut rig, 500 * MILLISECOND);
    assert_ne!(rig.slave_state(), SlaveState::DataExchange);
    rig.reconnect_module();
    assert!(rig.run_until(2 * SECOND, |rig| rig.slave_state() == SlaveState::DataExchange));
    assert!(rig.run_until(SECOND, |rig| rig.outputs().drive_ready));
}

#[test]
fn after_the_watchdog_the_drive_does_what_c1882_says() {
    // Fact sheet, section 1.5: none goes on with the last data; 2 = controller inhibit, 3 = quick stop (coding assumed).
    for (reaction, still_feeding) in [(0, true), (2, false), (3, false)] {
        let mut rig = in_mid_feed(&RigConfig::default(), 0.2);
        rig.drive_mut().write_code(1882, 0, reaction * 10_000).unwrap();
        rig.disconnect_module();
        // The watchdog takes 100 ms; another 300 ms brake from at most full speed along nothing but the torque limit.
        run_for(&mut rig, 400 * MILLISECOND);
        let speed_rpm = rig.drive().axis().sample().omega_meas * 30.0 / std::f64::consts::PI;
        assert_eq!(
            speed_rpm > 1000.0,
            still_feeding,
            "C1882 = {reaction}: {speed_rpm} 1/min"
        );
    }
}
