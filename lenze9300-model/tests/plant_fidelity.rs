//! The ladder of fidelity: the same feeds at every level, and what each level adds.

use drivecom::AifControl;
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::plant::{CurrentSensorParams, Fidelity, InverterParams, ResolverErrors};
use lenze9300_model::units::{INC_PER_REV, Rpm};
use lenze9300_model::{Axis, AxisCommand, AxisParams};

fn at(fidelity: Fidelity) -> AxisParams {
    AxisParams {
        fidelity,
        ..AxisParams::default()
    }
}

/// One feed of 1200 mm at full speed, the position every millisecond for 4 s from the start edge.
fn feed(params: AxisParams) -> (Vec<i64>, Drive) {
    let mut drive = Drive::new(DriveConfig {
        axis: params,
        ..DriveConfig::default()
    });
    for (code, subcode, value) in [(1301, 1, 1200_0000), (1302, 1, 100_0000), (1303, 1, 100_0000)] {
        drive
            .write_code(code, subcode, value)
            .expect("a code of the traversing program");
    }
    let mut positions = Vec::new();
    for ms in 0..4200 {
        let word = AifControl(0);
        drive.set_aif(if ms < 150 {
            word.with_controller_inhibit(true)
        } else {
            word.with_program_start(ms >= 200)
        });
        for _ in 0..drive.axis().params().ticks_per_position_period() {
            drive.tick();
        }
        if ms >= 200 {
            positions.push(drive.axis().sample().position);
        }
    }
    (positions, drive)
}

/// Increments of 1200.0 mm with C1204 = 179.0708 mm a turn of the roller, 7:1, cut as in the drive (film-feed specification 6).
const TARGET_INC: i64 = 3_074_216;

#[test]
fn every_level_makes_the_same_feed_with_the_errors_that_it_models() {
    let (exact, _) = feed(at(Fidelity::Averaged));
    for level in Fidelity::ALL {
        let (positions, drive) = feed(at(level));
        let last = *positions.last().expect("4 s of feed");
        // What the drive measures comes to ±0.01 mm, 25.6 increments (film-feed specification 1), at every level. Beside a resolver that
        // errs by 10′ it takes the integrator of the speed controller up to two seconds to pull it there out of static friction.
        assert!((last - TARGET_INC).abs() <= 25, "{level}: {last}");
        // On the way the set-values are the same.
        let apart = positions
            .iter()
            .zip(&exact)
            .map(|(a, b)| (a - b).abs())
            .max()
            .expect("4 s of feed");
        // ±0.1 mm, what chapter 2 of the thesis asks of a feed, are 256 increments; F0 has no following error at all, and that
        // of F1 is below 0.25 mm.
        let bound = if level == Fidelity::Kinematic { 640 } else { 256 };
        assert!(apart < bound, "{level}: {apart}");
        let energy = drive.axis().energy();
        assert!(
            energy.relative_residual().abs() < 1e-9,
            "{level}: {:e}",
            energy.relative_residual()
        );
        assert_eq!(energy.inverter_loss_j > 0.0, level.has_errors(), "{level}");
    }
}

#[test]
fn the_work_of_a_feed_hardly_depends_on_the_level() {
    // Acceleration and friction ask for the same torque everywhere; F0 leaves out how the loops swing.
    let (_, exact) = feed(at(Fidelity::Averaged));
    let exact = exact.axis().energy();
    for level in Fidelity::ALL {
        let (_, drive) = feed(at(level));
        let energy = drive.axis().energy();
        assert!((energy.friction_j / exact.friction_j - 1.0).abs() < 0.01, "{level}");
        // Errors only ever make currents of their own; the greatest is the torque of the integrator against static friction.
        let copper = energy.copper_j / exact.copper_j;
        let bounds = if level.has_errors() { 1.0..2.0 } else { 0.95..1.05 };
        assert!(bounds.contains(&copper), "{level}: {copper}");
    }
}

#[test]
fn a_resolver_errs_once_and_twice_a_turn_by_what_is_set() {
    let errors = ResolverErrors {
        once_arcmin: 3.0,
        twice_arcmin: 7.0,
        noise_inc: 0.0,
    };
    let mut params = at(Fidelity::WithErrors);
    params.feedback.errors = errors;
    let mut axis = Axis::new(&params);
    axis.set_shaft_speed(50.0);
    let mut largest: f64 = 0.0;
    for _ in 0..2000 {
        axis.tick(AxisCommand::Inhibited);
        let sample = axis.sample();
        let shown = sample.position as f64 - sample.angle.offset_from(Default::default());
        let turns = sample.angle.offset_from(Default::default()) / INC_PER_REV as f64;
        let phi = turns * std::f64::consts::TAU;
        let expected = (3.0 * phi.sin() + 7.0 * (2.0 * phi + 1.0).sin()) * INC_PER_REV as f64 / 21_600.0;
        // Rounded down to the increment.
        assert!(
            shown - expected <= 0.001 && shown - expected > -1.001,
            "{shown} {expected}"
        );
        largest = largest.max(shown.abs());
    }
    // 10′ are 30.3 increments, the accuracy of the fact sheet (9300 facts 6); the two sines do not peak together.
    assert!((20.0..=31.4).contains(&largest), "{largest}");
}

#[test]
fn a_standing_shaft_shows_the_trembling_speed_of_figures_71_and_72() {
    // 9300 facts 4.6: 0.0244 % and 0.0671 % of 3000 rpm at standstill, 0.73 and 2 rpm.
    let mut axis = Axis::new(&at(Fidelity::WithErrors));
    let mut largest: f64 = 0.0;
    for tick in 0..80_000 {
        axis.tick(AxisCommand::Inhibited);
        if tick > 8000 {
            largest = largest.max(Rpm::from_rad_s(axis.sample().omega_filtered).0.abs());
        }
    }
    assert!((0.73..=2.02).contains(&largest), "{largest} rpm");
    let mut exact = Axis::new(&at(Fidelity::Averaged));
    exact.tick(AxisCommand::Inhibited);
    assert_eq!(exact.sample().omega_filtered, 0.0);
}

#[test]
fn noise_is_that_of_its_seed() {
    let run = |noise_seed| {
        let mut axis = Axis::new(&AxisParams {
            noise_seed,
            ..at(Fidelity::Switched)
        });
        for _ in 0..2000 {
            axis.tick(AxisCommand::Speed {
                omega_ref: 30.0,
                torque_ff: 0.0,
            });
        }
        axis.sample().omega_true.to_bits()
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn ideal_switches_and_sensors_are_those_of_f1() {
    // With all errors off F2 is F1, but for the way the vectors take through the phases.
    let params = AxisParams {
        inverter: InverterParams {
            dead_time_s: 0.0,
            drop_v: 0.0,
            drop_ohm: 0.0,
            fading_a: 0.03,
        },
        current_sensor: CurrentSensorParams {
            offset_a: [0.0; 2],
            gain_error: [0.0; 2],
            noise_a: 0.0,
            step_a: 0.0,
        },
        ..at(Fidelity::WithErrors)
    };
    let params = AxisParams {
        feedback: lenze9300_model::plant::FeedbackParams {
            errors: ResolverErrors {
                once_arcmin: 0.0,
                twice_arcmin: 0.0,
                noise_inc: 0.0,
            },
            ..params.feedback
        },
        ..params
    };
    let (ideal, _) = feed(params);
    let (exact, _) = feed(at(Fidelity::Averaged));
    let apart = ideal.iter().zip(&exact).map(|(a, b)| (a - b).abs()).max();
    assert!(apart <= Some(1), "{apart:?}");
    // F3 without errors adds the ripple alone, whose mean is nothing.
    let (pulsed, _) = feed(AxisParams {
        fidelity: Fidelity::Switched,
        ..params
    });
    let apart = pulsed.iter().zip(&exact).map(|(a, b)| (a - b).abs()).max();
    assert!(apart <= Some(8), "{apart:?}");
}

#[test]
fn a_level_is_read_by_its_name() {
    for level in Fidelity::ALL {
        assert_eq!(level.name().parse(), Ok(level));
    }
    let refused = "f4".parse::<Fidelity>().expect_err("there is no f4");
    assert!(refused.to_string().contains("f0 (kinematic)"), "{refused}");
}
