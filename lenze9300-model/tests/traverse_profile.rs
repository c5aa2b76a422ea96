//! The shape of the ramps and the rounding of lengths through the whole positioning program; feed-forward through the
//! drive.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod traverse_rig;

use drivecom::AifControl;
use lenze9300_model::code::Inhibit;
use lenze9300_model::code::table::number::*;
use lenze9300_model::control::tuning::{following_error, peak_following_error};
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::traverse::*;
use lenze9300_model::{Axis, AxisCommand, AxisParams, TICKS_PER_MS};
use traverse_rig::{PER_MM, Rig, number};

const J: f64 = 0.914e-4;

/// a_max of 2400 mm/s² in 0.1 s.
fn s_curve() -> TraverseParameters {
    TraverseParameters {
        profile: Profile::SCurve { jerk: 24_000 },
        ..TraverseParameters::default()
    }
}

// ---- S-curve

#[test]
fn a_feed_with_an_s_curve_takes_a_tenth_of_a_second_longer_and_lands_as_exactly() {
    // d/v + v/a + a/j = 1 + 0.5 + 0.1 s; with a trapezoid 1.5 s (9300 facts 11).
    let mut rig = Rig::with_parameters(s_curve());
    assert_eq!(rig.feed(), 1600);
    assert_eq!(rig.film, 3_074_216);
    assert_eq!(Rig::new().feed(), 1500, "the trapezoid is the default");
}

#[test]
fn feeds_to_the_mark_work_with_an_s_curve() {
    let mut rig = Rig::with_parameters(s_curve());
    rig.inputs.program_inputs = 1;
    rig.mark_ahead(1150.0);
    rig.feed();
    // 50 mm behind the mark (film-feed specification, section 6), each length cut to whole increments.
    assert!((rig.film_mm() - 1200.0).abs() < 3.0 / PER_MM, "{}", rig.film_mm());
    assert!(!rig.reversed());
}

#[test]
fn stop_continuation_and_jog_keep_the_jerk_too() {
    let jerk = 24_000.0 * PER_MM / 1e9;
    let mut rig = Rig::with_parameters(s_curve());
    rig.start();
    let mut before = rig.last;
    let mut check = |rig: &mut Rig, ticks: u64| {
        for _ in 0..ticks {
            let now = rig.tick();
            let step = now.acceleration - before.acceleration;
            assert!(step.abs() <= jerk * (1.0 + 1e-6), "{step} at {}", rig.ticks);
            assert!(now.acceleration.abs() <= 2400.0 * PER_MM / 1e6 * (1.0 + 1e-6));
            // The set-value is continuous: its way is the mean of both speeds but for a twelfth of the jerk and the
            // floor.
            let way = (now.position - before.position) as f64 - 0.5 * (now.velocity + before.velocity);
            assert!(
                now.reference_shift != 0 || way.abs() < 1.0 + 2.0,
                "{way} at {}",
                rig.ticks
            );
            before = now;
        }
    };
    check(&mut rig, 250);
    rig.inputs.stop = true;
    check(&mut rig, 100);
    rig.inputs.stop = false;
    check(&mut rig, 700);
    rig.inputs.start = false;
    check(&mut rig, 2);
    rig.inputs.start = true;
    check(&mut rig, 2500);
    assert_eq!(rig.film, 3_074_216, "it went on to its target");
    rig.inputs.manual = true;
    rig.inputs.manual_pos = true;
    check(&mut rig, 300);
    rig.inputs.manual_pos = false;
    check(&mut rig, 400);
    assert_eq!(rig.last.velocity, 0.0);
}

// ---- rounding

/// 100 000 relative feeds of 0.5 mm in one run of a program; the way of the film.
fn hundred_thousand_feeds(rounding: Rounding) -> i64 {
    let parameters = TraverseParameters {
        rounding,
        ..TraverseParameters::default()
    };
    let record = Record {
        pieces: Some(Pieces {
            count: 1,
            to: Successor::End,
        }),
        jump: Successor::Record(number(1)),
        ..Record::new(Mode::Relative, Target::Variable(1))
    };
    let program = Program::new([(1, record)]).unwrap();
    let mut rig = Rig::with_parameters(parameters);
    rig.traverse = Traverse::with_parameters(program, parameters);
    for (code, value) in [(C1240, 2_140_000_000), (C1250, 2_140_000_000)] {
        rig.codes.write(code, 0, value, Inhibit::Active).unwrap();
    }
    rig.set(C1301, 1, 5000);
    rig.set(C1305, 1, 1_000_000_000);
    rig.tick();
    rig.start();
    for _ in 0..1_000_000 {
        rig.tick();
        if !rig.traverse.status().running {
            break;
        }
    }
    assert!(rig.traverse.status().ended);
    rig.film
}

/// Exactly 0.5 mm are 65536 · 7 · 5000 / 1790708 = 1280.923523 inc (film-feed specification, section 5); a feed loses
/// 0.923523 inc.
#[test]
fn a_hundred_thousand_feeds_fall_short_by_as_many_fractions_and_by_none_with_the_residue_carried() {
    let (numerator, denominator) = (65_536_i128 * 7 * 5000, 1_790_708_i128);
    let exact = (100_000 * numerator / denominator) as i64;
    let fractions = (100_000 * (numerator % denominator) / denominator) as i64;
    assert_eq!(fractions, 92_352);
    assert_eq!(exact - hundred_thousand_feeds(Rounding::Truncate), fractions);
    assert_eq!(exact - hundred_thousand_feeds(Rounding::CarryResidue), 0);
}

// ---- feed-forward

/// Formula VI of the thesis: F = n/k_v.
#[test]
fn without_speed_feed_forward_the_following_error_is_speed_over_gain() {
    let params = AxisParams::default();
    let position = params.position_controller();
    let mut axis = Axis::new(&params);
    let inc_per_ms = 2000_i64;
    let mut setpoint = 0;
    for _ in 0..2000 {
        let error = setpoint - axis.sample().position;
        let omega_ref = position.compute_output(error, 0.0);
        setpoint += inc_per_ms;
        for _ in 0..TICKS_PER_MS {
            axis.tick(AxisCommand::Speed {
                omega_ref,
                torque_ff: 0.0,
            });
        }
    }
    // C0254 = 0.4 is 50 1/s (design, section 6): 2 000 000 inc/s over 50 1/s.
    let expected = following_error(inc_per_ms as f64 * 1000.0, 50.0);
    assert!((expected - 40_000.0).abs() < 1e-9);
    let found = (setpoint - axis.sample().position) as f64;
    assert!((found - expected).abs() < 4.0, "{found}");
}

/// Largest following error of a run-up to 1200 mm/s by hand, mm; its following error at the end too.
fn run_up(inertia: f64, profile: Profile) -> f64 {
    let mut config = DriveConfig {
        feed_forward_inertia_kg_m2: inertia,
        ..DriveConfig::default()
    };
    config.axis.mechanics.coulomb_nm = 0.0;
    config.traverse.profile = profile;
    config.traverse.jog.velocity_percent_e4 = 100_0000;
    let mut drive = Drive::new(config);
    drive.set_aif(AifControl(0));
    let mut peak = 0.0_f64;
    for ms in 0..1400 {
        if ms == 200 {
            drive.set_aif(AifControl(0).with_manual(true).with_manual_positive(true));
        }
        for _ in 0..TICKS_PER_MS {
            drive.tick();
        }
        peak = peak.max(drive.following_error().abs() as f64 / PER_MM);
    }
    peak
}

#[test]
fn torque_feed_forward_takes_the_following_error_of_a_ramp_away() {
    // Without it a jump of the acceleration by 2400 mm/s² makes the analytic peak; with the true inertia the torque
    // is there one millisecond and the delays of the loop later, some 2 ms of 20 ms. It is off by default (9300 facts
    // 4.6).
    let params = AxisParams::default();
    let expected = peak_following_error(2400.0, params.speed_gains(), J, 50.0);
    assert_eq!(DriveConfig::default().feed_forward_inertia_kg_m2, 0.0);
    let without = run_up(0.0, Profile::Trapezoid);
    let with = run_up(J, Profile::Trapezoid);
    println!("{without} {with} mm, analytic {expected} mm");
    assert!((without / expected - 1.0).abs() < 0.15, "{without} {expected}");
    assert!(with < 0.25 * without, "{with} {without}");
    // Half the inertia takes half of it away.
    let half = run_up(0.5 * J, Profile::Trapezoid);
    assert!((half / without - 0.5).abs() < 0.15, "{half} {without}");
    // A limited jerk asks for less from the start.
    let smooth = run_up(0.0, Profile::SCurve { jerk: 24_000 });
    println!("{smooth} mm with an S-curve");
    assert!(smooth < 0.6 * without, "{smooth} {without}");
}

#[test]
fn the_acceleration_of_the_set_value_is_that_of_its_ramp() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(100);
    let expected = 2400.0 * PER_MM / 1e6;
    assert!((rig.last.acceleration - expected).abs() < 1e-9);
    rig.run(600);
    assert_eq!(rig.last.acceleration, 0.0);
}
