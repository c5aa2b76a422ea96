//! Every hazard of the 9300 fact sheet, section 9.1, is found by the advice before it happens, with a number that a run confirms, and is
//! reproduced by a run that ignores the advice. (What else the block and the drive do then: `hazards.rs`.)

use dp_master::dp::Mode;
use film_feed::advise::{Advice, Demands, Severity, advise};
use film_feed::operator::FeedPlan;
use film_feed::report::FeedMode;
use film_feed::rig::RigConfig;
use lenze9300_model::code::Inhibit;
use lenze9300_model::code::table::number::{C0142, C0582};
use lenze9300_model::device::Fault;
use lenze9300_model::plant::Mains;
use lenze9300_model::traverse::TraverseEvent;
use system_tests::{MILLISECOND, SECOND, in_mid_feed, ready, run, run_for, series, start_feed, traverse_events};

fn advice(config: &RigConfig, plan: &FeedPlan) -> Advice {
    advise(config, plan, &Demands::default())
}

fn with_code(code: u16, raw: i32) -> RigConfig {
    let mut config = RigConfig::default();
    config
        .drive
        .codes
        .write(code, 0, raw, Inhibit::Active)
        .expect("the code can be written");
    config
}

fn starts(events: &[(u64, TraverseEvent)]) -> usize {
    let started = |(_, event): &&(u64, TraverseEvent)| *event == TraverseEvent::ProgramStarted;
    events.iter().filter(started).count()
}

#[test]
fn the_machine_of_the_thesis_does_nothing_wrong_by_its_values_alone() {
    let advice = advice(&RigConfig::default(), &FeedPlan::default());
    assert!(advice.ok, "{advice}");
    let hazards: Vec<&str> = advice.findings.iter().map(|finding| finding.id).collect();
    // Section 9.1 without the reversal, which its 20 % do not make.
    assert_eq!(
        hazards,
        [
            "lost_start",
            "unwanted_start",
            "zero_outputs",
            "errors_as_data",
            "message_recovery"
        ]
    );
    for finding in &advice.findings {
        assert!(!finding.cause.is_empty() && !finding.remedy.is_empty() && finding.value.is_finite());
    }
}

#[test]
fn reversal() {
    let config = RigConfig::default();
    let plan = |hundredth_percent| FeedPlan {
        mark_speed_hundredth_percent: hundredth_percent,
        ..series(FeedMode::Mark, 3)
    };
    // Fact sheet, section 4.2: √(2·a·50 mm) = 489.9 mm/s, 40.8 %; a millisecond passes before the drive plans anew.
    let too_fast = advice(&config, &plan(4_500));
    let found = too_fast.find("reversal").unwrap();
    assert_eq!((found.severity, found.limit), (Severity::Fails, Some(50.0)));
    assert!((found.value - (540.0 * 540.0 / 4800.0 + 0.54)).abs() < 0.01, "{found}");
    assert!(found.remedy.contains("487.5 mm/s or less, 40.6 % of C1240"), "{found}");
    assert!(run(&config, plan(4_500)).feeds.iter().all(|feed| feed.reversed));
    // The advice taken: 40.6 %.
    assert!(advice(&config, &plan(4_060)).find("reversal").is_none());
    assert!(run(&config, plan(4_060)).feeds.iter().all(|feed| !feed.reversed));
    // Nor is there a hazard without marks.
    let by_length = FeedPlan {
        series: vec![(FeedMode::Length, 1)],
        ..plan(4_500)
    };
    assert!(advice(&config, &by_length).find("reversal").is_none());
}

#[test]
fn unwanted_start() {
    let config = RigConfig::default();
    let found = advice(&config, &FeedPlan::default());
    let found = found.find("unwanted_start").unwrap();
    assert!(
        found.cause.contains("OH4") && found.cause.contains("the film moves 1200.0 mm"),
        "{found}"
    );
    assert!(
        found.remedy.contains("hold POS_START high") && found.remedy.contains("C0582 (OH4)"),
        "{found}"
    );
    let warned = |config: &RigConfig, start_held: bool| {
        let mut rig = ready(config);
        rig.inputs_mut().pos_start = start_held;
        run_for(&mut rig, 3 * SECOND);
        let before = rig.film().position_mm();
        rig.drive_mut().inject(Fault::Oh4, true);
        let started = starts(&traverse_events(&mut rig, 3 * SECOND));
        (started, rig.film().position_mm() - before)
    };
    let (started, moved_mm) = warned(&config, false);
    assert!(
        started == 1 && (moved_mm - 1200.0).abs() <= 0.01,
        "{started}, {moved_mm}"
    );
    // Either remedy: POS_START held, or OH4 switched off.
    assert_eq!(warned(&config, true).0, 0);
    let off = with_code(C0582, 3_0000);
    let still = advice(&off, &FeedPlan::default());
    assert!(
        still
            .find("unwanted_start")
            .is_none_or(|found| !found.cause.contains("OH4"))
    );
    assert_eq!(warned(&off, false).0, 0);
}

#[test]
fn zero_outputs() {
    let config = RigConfig::default();
    let found = advice(&config, &FeedPlan::default());
    let found = found.find("zero_outputs").unwrap();
    // ½ J ω² / M by hand: 0.914e-4 kg m², 294.74 rad/s, 0.05 Nm: 79.4 rad, at 4.0713 mm/rad 323 mm.
    assert!((found.value - 323.3).abs() < 0.5, "{found}");
    // In the middle of the feed, at full speed.
    let mut rig = in_mid_feed(&config, 0.5);
    rig.master_mut().set_mode(Mode::Clear);
    assert!(rig.run_until(SECOND, |rig| rig.module().control_word().0 == 0));
    // The module hands the zeros to the drive some milliseconds later, at 1.2 mm/ms.
    let from_mm = rig.film().position_mm();
    run_for(&mut rig, 3 * SECOND);
    let coasted_mm = rig.film().position_mm() - from_mm;
    assert!((coasted_mm - found.value).abs() < 8.0, "{coasted_mm} mm, told {found}");
    rig.master_mut().set_mode(Mode::Operate);
    assert_eq!(starts(&traverse_events(&mut rig, 2 * SECOND)), 0, "stop dominates");
    assert!(!rig.outputs().job_finished, "the feed is lost");
}

#[test]
fn errors_as_data() {
    let mut config = RigConfig::default();
    let found = advice(&config, &FeedPlan::default());
    let found = found.find("errors_as_data").unwrap();
    // Fact sheet, section 9.1: 0x06070000/10000 = 10 112.2048 for 179.0708.
    assert!((found.value - 10_112.204_8 / 179.070_8).abs() < 1e-4, "{found}");
    // While a parameter set is saved every job is refused with 08 00 0000 (section 3.3).
    config.drive.parameter_transfer_ms = 1000;
    let mut rig = ready(&config);
    start_feed(&mut rig);
    assert!(rig.run_until(3 * SECOND, |rig| rig.outputs().job_finished));
    run_for(&mut rig, SECOND);
    let before_mm = rig.outputs().position_mm;
    assert!((before_mm - 1200.0).abs() < 0.1);
    rig.drive_mut().write_code(3, 0, 1_0000).expect("set 1 can be saved");
    let wrong = 0x0800_0000 as f32 / 10_000.0;
    assert!(
        rig.run_until(SECOND, |rig| (rig.block().constants().feed_constant - wrong).abs()
            < 1.0),
        "{:?}",
        rig.block().constants()
    );
    assert!(
        rig.run_until(SECOND, |rig| rig.outputs().position_mm > 10.0 * before_mm),
        "{:?}",
        rig.outputs()
    );
    // The remedy: who watches the parameter channel is told.
    assert!(!rig.parameter_watch().troubles().is_empty());
}

/// Starts by the clock, whatever the drive does: POS_START is high for 100 ms every `cycle_ms`. Tells how many programs began.
fn started_by_the_clock(cycle_ms: u64, starts_raised: usize) -> usize {
    let mut rig = ready(&RigConfig::default());
    run_for(&mut rig, SECOND);
    (0..starts_raised)
        .map(|_| {
            rig.inputs_mut().pos_start = true;
            let begun = starts(&traverse_events(&mut rig, 100 * MILLISECOND));
            rig.inputs_mut().pos_start = false;
            begun + starts(&traverse_events(&mut rig, (cycle_ms - 100) * MILLISECOND))
        })
        .sum()
}

#[test]
fn lost_start() {
    let by_the_clock = |cycle_s| {
        let demands = Demands {
            cycle_s: Some(cycle_s),
            ..Demands::default()
        };
        advise(&RigConfig::default(), &series(FeedMode::Length, 1), &demands)
    };
    // The program of 1200 mm takes 1.5 s (thesis fig. 63), the next start is taken 2 ms after its beginning plus that.
    for cycle_ms in [1400, 1500] {
        let early = by_the_clock(cycle_ms as f64 / 1000.0);
        let found = early.find("lost_start").unwrap();
        assert_eq!(found.severity, Severity::Fails);
        assert!((found.limit.unwrap() - 1.502).abs() < 1e-6, "{found}");
        assert_eq!(
            started_by_the_clock(cycle_ms, 4),
            2,
            "every second one is lost at {cycle_ms} ms"
        );
    }
    // The PLC cycle of 5 ms is the grid of starts.
    let later = by_the_clock(1.505);
    assert_eq!(later.find("lost_start").unwrap().severity, Severity::Hazard);
    assert_eq!(started_by_the_clock(1505, 4), 4);
    // That cycle leaves no time for JOB_FIN to be seen, which is told as well.
    let cycle = later.find("cycle").unwrap();
    assert!((cycle.value - (1.5 + 0.010 + 2.0 * 0.005_055)).abs() < 2e-4, "{cycle}");
}

#[test]
fn message_recovery() {
    let config = RigConfig::default();
    let found = advice(&config, &FeedPlan::default());
    let found = found.find("message_recovery").unwrap();
    // The number: how long the DC link lasts at rest.
    let mut rig = ready(&config);
    let off_at = rig.now_ns();
    rig.drive_mut().set_mains(Mains::Off);
    assert!(rig.run_until(60 * SECOND, |rig| rig.drive().status().undervoltage));
    let bridged_ms = (rig.now_ns() - off_at) as f64 / 1e6;
    // The drive holds the axis, which takes next to nothing beside its own supply.
    assert!(
        (bridged_ms / found.value - 1.0).abs() < 0.02,
        "{bridged_ms} ms, told {found}"
    );
    // The hazard: after 0.6 s of LU it enables itself.
    let enabled_again = |config: &RigConfig| {
        let mut rig = ready(config);
        rig.drive_mut().inject(Fault::Lu, true);
        run_for(&mut rig, 600 * MILLISECOND);
        assert!(!rig.outputs().drive_ready);
        rig.drive_mut().inject(Fault::Lu, false);
        run_for(&mut rig, 2 * SECOND);
        assert!(!rig.outputs().error, "the message is over");
        !rig.drive().inhibited()
    };
    assert!(enabled_again(&config));
    let locked = with_code(C0142, 0);
    assert!(advice(&locked, &FeedPlan::default()).find("message_recovery").is_none());
    assert!(!enabled_again(&locked));
}

/// The other checks: each is found with its number, and the run that ignores it shows why.
#[test]
fn marks_out_of_the_search_a_sampled_latch_and_a_coarse_resolver_spoil_the_feeds_they_are_told_of() {
    let marks = series(FeedMode::Mark, 6);
    // 60 mm of scatter: a mark can lie 1090 mm ahead, 10 mm before the search begins.
    let mut config = RigConfig::default();
    config.film.marks.tolerance_mm = 60.0;
    let found = advice(&config, &marks);
    let found = found.find("mark_early").unwrap();
    assert_eq!((found.value, found.limit), (1090.0, Some(1100.0)));
    let report = run(&config, series(FeedMode::Mark, 40));
    assert!(
        report.feeds.iter().any(|feed| feed.commanded_mm.unwrap() > 2000.0),
        "no mark was passed unseen"
    );

    // Marks 2500 mm apart: behind the end of the search.
    let mut config = RigConfig::default();
    (config.film.marks.repeat_mm, config.film.marks.tolerance_mm) = (2500.0, 0.0);
    let found = advice(&config, &marks);
    let found = found.find("mark_late").unwrap();
    assert_eq!((found.value, found.limit), (2450.0, Some(2400.0)));
    assert!(run(&config, marks.clone()).feeds[0].commanded_mm.is_none());

    // E1 sampled once a millisecond: 0.24 mm at 240 mm/s (fact sheet, section 4.3).
    let mut config = RigConfig::default();
    config.drive.touch_input = lenze9300_model::traverse::LatchMode::Sampled1ms;
    let found = advice(&config, &marks);
    assert!((found.find("latch").unwrap().value - 0.24).abs() < 1e-9);
    let errors: Vec<f64> = run(&config, marks.clone())
        .feeds
        .iter()
        .filter_map(|feed| feed.error_mm)
        .collect();
    assert!(
        errors.iter().any(|mm| mm.abs() > 0.01) && errors.iter().all(|mm| mm.abs() < 0.26),
        "{errors:?}"
    );

    // 11 bits: 32 increments of 0.39 µm.
    let mut config = RigConfig::default();
    config.drive.axis.feedback.resolver_bits = 11;
    let found = advice(&config, &marks);
    assert!((found.find("resolver").unwrap().value - 0.012_491).abs() < 1e-6);

    // A late reader: 240 mm/s · 100 µs.
    let mut config = RigConfig::default();
    config.reader.delay_us = 100.0;
    assert!((advice(&config, &marks).find("reader").unwrap().value - 0.024).abs() < 1e-9);
}

#[test]
fn too_little_torque_and_too_much_speed_are_told_before_the_drive_trips() {
    let plan = series(FeedMode::Length, 1);
    // C0022 = 0.12 A gives 0.0933 Nm; the ramp needs 0.914e-4 kg m² · 589.5 rad/s² + 0.05 Nm = 0.1039 Nm.
    let weak = |milliamperes: i32| {
        let mut config = with_code(22, milliamperes * 10);
        config.drive.axis.codes = lenze9300_model::ControllerCodes::from_store(&config.drive.codes);
        config
    };
    let found = advice(&weak(120), &plan);
    let found = found.find("torque").unwrap();
    assert!(
        (found.value - 0.1039).abs() < 1e-4 && (found.limit.unwrap() - 0.0933).abs() < 1e-4,
        "{found}"
    );
    let plan_short = FeedPlan {
        feed_limit_ns: 5 * SECOND,
        ..plan.clone()
    };
    assert!(!run(&weak(120), plan_short).ok);
    assert!(advice(&weak(600), &plan).find("torque").is_none());
    assert!(run(&weak(600), plan.clone()).ok);

    // A soft loop: ΔM/(K_p·k_v) beyond C1218/1.
    let mut soft = with_code(70, 4000);
    soft.drive.axis.codes = lenze9300_model::ControllerCodes::from_store(&soft.drive.codes);
    assert!(advice(&soft, &plan).find("following_error").is_some());
    let default = run(&RigConfig::default(), plan.clone());
    // The bound holds, and is not far off: 0.51 mm for 0.29 mm.
    let told_mm = 0.1039 / (0.016_71 * 50.0) * 4.0713;
    let real_mm = default.feeds[0].max_following_error_mm.unwrap();
    assert!(real_mm < told_mm && told_mm < 3.0 * real_mm, "{real_mm} {told_mm}");

    // v_max must lie below 1279.077 mm/s at C0011 = 3000 1/min (film-feed specification, section 5).
    let fast = with_code(1240, 1280_0000);
    let found = advice(&fast, &plan);
    let found = found.find("speed").unwrap();
    assert!(found.value > 3000.0 && found.limit == Some(3000.0), "{found}");
    assert!(found.remedy.contains("1279.1 mm/s or less"), "{found}");
    assert!(advice(&with_code(1240, 1279_0000), &plan).find("speed").is_none());

    // JOB_FIN within 0.1 mm, the fact sheet's assumed window, says nothing of 0.01 mm.
    let mut config = RigConfig::default();
    config.drive.traverse.target_window_e4 = 1000;
    assert_eq!(advice(&config, &plan).find("target_window").unwrap().value, 0.1);
    // 30 000 motor revolutions a roller revolution: 1200 mm are 1.3e10 increments.
    let mut geared = with_code(1202, 300_000_000);
    geared.film.roller.gear_ratio = 30_000.0;
    assert!(advice(&geared, &plan).find("range").unwrap().value > 1.3e10);
}
