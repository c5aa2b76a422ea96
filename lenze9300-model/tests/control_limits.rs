//! What the loops do when torque or voltage runs out: nobody winds up, nothing swings, and no time is given away.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use std::f64::consts::SQRT_2;

use drivecom::AifControl;
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::traverse::{JogParameters, TraverseParameters};
use lenze9300_model::units::Rpm;
use lenze9300_model::{Axis, AxisCommand, AxisParams, TICKS_PER_MS};

const TICK_S: f64 = 125e-6;
const J: f64 = 0.914e-4;
/// C0022 = 1.35 A (9300 facts 6).
const TORQUE_MAX: f64 = 1.05;
/// C0070 = 5 (design, section 6).
const K_P: f64 = 0.01671;
/// Speed below which the drive reports standstill, rad/s: 0.1 % of C0011.
const STANDSTILL: f64 = 0.314;

/// True speed after each tick of a quick stop along the torque limit (C0105 = 0) from 1200 mm/s.
fn quick_stop(config: DriveConfig) -> Vec<f64> {
    let jog = JogParameters {
        velocity_percent_e4: 100_0000,
        ..JogParameters::default()
    };
    let mut drive = Drive::new(DriveConfig {
        traverse: TraverseParameters {
            jog,
            ..TraverseParameters::default()
        },
        ..config
    });
    let ticks = |drive: &mut Drive, ms: u64| -> Vec<f64> {
        (0..ms * TICKS_PER_MS)
            .map(|_| {
                drive.tick();
                drive.axis().sample().omega_true
            })
            .collect()
    };
    drive.set_aif(AifControl(0));
    ticks(&mut drive, 200);
    drive.set_aif(AifControl(0).with_manual(true).with_manual_positive(true));
    ticks(&mut drive, 1500);
    drive.set_aif(AifControl(0).with_quick_stop(true));
    ticks(&mut drive, 500)
}

/// The oracle: never faster backwards than `swing` rad/s, and at rest (0.1 % of C0011) after `within_s` at the latest.
fn judge_stop(speeds: &[f64], swing: f64, within_s: f64) -> Result<(), String> {
    let lowest = speeds.iter().copied().fold(0.0, f64::min);
    if lowest < -swing {
        return Err(format!("swings back with {lowest} rad/s"));
    }
    let moving = speeds
        .iter()
        .rposition(|omega| omega.abs() > STANDSTILL)
        .map_or(0, |last| last + 1);
    let stop_s = moving as f64 * TICK_S;
    if stop_s > within_s {
        return Err(format!("stands after {stop_s} s only"));
    }
    Ok(())
}

/// The limit is left at K_p |e| = M: the shaft slows by M/J until then, and along exp(−t K_p/J) afterwards. From
/// 294.7 rad/s that takes (294.7 − 62.8)/11 488 s and J/K_p · ln(62.8/0.314): 20.2 ms + 29.0 ms, and 1 ms for the
/// quick stop to be seen and the current to turn round. Friction helps.
#[test]
fn a_quick_stop_at_the_torque_limit_comes_to_rest_without_swinging_through_zero() {
    let within_s = stop_time_s(J);
    assert!((within_s - 0.0502).abs() < 1e-3, "{within_s}");
    for coulomb_nm in [0.0, 0.05, 0.1] {
        let mut config = DriveConfig::default();
        config.axis.mechanics.coulomb_nm = coulomb_nm;
        let speeds = quick_stop(config);
        assert_eq!(judge_stop(&speeds, STANDSTILL, within_s), Ok(()), "{coulomb_nm} Nm");
        // And not gently: while the limit holds, it is the whole limit (a millisecond for the current to rise).
        let slowed = speeds[8] - speeds[8 + 80];
        let expected = (TORQUE_MAX + coulomb_nm) / J * 80.0 * TICK_S;
        assert!((slowed / expected - 1.0).abs() < 0.02, "{slowed} {expected}");
    }
}

fn stop_time_s(j: f64) -> f64 {
    let left_at = TORQUE_MAX / K_P;
    (294.7 - left_at) / (TORQUE_MAX / j) + j / K_P * (left_at / STANDSTILL).ln() + 1e-3
}

#[test]
fn heavier_axes_hardly_swing() {
    // With three times the inertia T_N = 20 ms is a time constant of the loop, which swings by itself in small steps.
    // The waiting ends when the ripple of the resolver hides the fall of the error, at a few rad/s, and a part of
    // those is left to swing: 1 % of C0011 at most. (A bare rotor crosses zero by 6 rad/s whatever the integrator
    // does: its 42 000 rad/s² meet some 0.9 ms of delay in the loop.)
    for load in [1e-4, 2.5e-4] {
        let mut config = DriveConfig::default();
        config.axis.mechanics.j_load_kg_m2 = load;
        config.axis.mechanics.coulomb_nm = 0.0;
        let speeds = quick_stop(config);
        assert_eq!(
            judge_stop(&speeds, 10.0 * STANDSTILL, 2.0 * stop_time_s(0.25e-4 + load)),
            Ok(()),
            "{load}"
        );
    }
}

#[test]
fn the_oracle_rejects_a_swing_and_a_crawl() {
    // What an integrator that runs to the limit did: −31 rad/s after 25 ms.
    let swing: Vec<f64> = (0..800)
        .map(|tick| {
            let t = f64::from(tick) * TICK_S;
            if t < 0.025 {
                294.7 - 11_788.0 * t
            } else {
                -31.0 * (-(t - 0.025) / 0.011).exp()
            }
        })
        .collect();
    assert!(judge_stop(&swing, STANDSTILL, 0.0502).unwrap_err().contains("swings"));
    let crawl: Vec<f64> = (0..4000)
        .map(|tick| 294.7 * (-f64::from(tick) * TICK_S / 0.020).exp())
        .collect();
    assert!(judge_stop(&crawl, STANDSTILL, 0.0502).unwrap_err().contains("after"));
}

fn speed(omega_ref: f64) -> AxisCommand {
    AxisCommand::Speed {
        omega_ref,
        torque_ff: 0.0,
    }
}

fn run(axis: &mut Axis, seconds: f64, omega_ref: f64, mut look: impl FnMut(&Axis)) {
    for _ in 0..(seconds / TICK_S).round() as u64 {
        axis.tick(speed(omega_ref));
        look(axis);
    }
}

#[test]
fn after_an_overload_the_speed_passes_by_no_more_than_was_integrated_before_the_limit() {
    // 1.5 Nm against 1.05 Nm for 20 ms brake the shaft by 0.5/J · 20 ms = 109 rad/s.
    let mut axis = Axis::new(&AxisParams::default());
    axis.set_shaft_speed(200.0);
    run(&mut axis, 0.5, 200.0, |_| {});
    axis.set_load_torque(1.5);
    run(&mut axis, 0.020, 200.0, |axis| {
        assert!(axis.sample().torque_ref <= TORQUE_MAX + 1e-9);
    });
    assert!(axis.sample().omega_true < 110.0);
    axis.set_load_torque(0.0);
    let mut highest = 0.0_f64;
    run(&mut axis, 0.2, 200.0, |axis| {
        highest = highest.max(axis.sample().omega_true)
    });
    // The limit is reached when the error is 60 rad/s, after 60/16 400 s; until then the integrator gains K_p/T_N times half
    // of 60 rad/s times 3.7 ms = 0.092 Nm, worth 5.5 rad/s of error. Had it run to the limit, it were 60.
    assert!(highest < 205.5, "{highest}");
    assert!(
        (axis.sample().omega_true - 200.0).abs() < 0.5,
        "{}",
        axis.sample().omega_true
    );
}

/// An axis whose set-values may go far beyond its voltage.
fn fast() -> AxisParams {
    let mut params = AxisParams {
        n_plant_max: Rpm(12_000.0),
        ..AxisParams::default()
    };
    params.codes.c0011_n_max = Rpm(12_000.0);
    params
}

/// U_dc/√3 = 326.6 V are filled by ω_el ψ + R i_q in q and ω_el L i_q in d; at 0.05 Nm i_q is 0.091 A, which leaves
/// ω_el ψ = 324.7 V: 8460 rpm. There is no field weakening, so that is where the speed stays (control, "When voltage
/// runs out").
#[test]
fn when_voltage_runs_out_the_speed_stays_where_the_back_emf_fills_the_circle() {
    let mut axis = Axis::new(&fast());
    run(&mut axis, 2.0, Rpm(10_000.0).to_rad_s(), |_| {});
    let psi: f64 = 0.70 / 0.90 / (1.5 * SQRT_2 * 3.0);
    let i_q = 0.05 / (4.5 * psi);
    let voltage = axis.sample().u_dc / 3.0_f64.sqrt();
    let expected = (voltage - 19.8 * i_q) / psi / 3.0;
    let found = axis.sample().omega_true;
    assert!(axis.sample().voltage_limited);
    assert!(
        (found / expected - 1.0).abs() < 0.01,
        "{} {}",
        Rpm::from_rad_s(found).0,
        Rpm::from_rad_s(expected).0
    );
}

#[test]
fn a_set_value_within_the_voltage_is_followed_at_once_after_one_beyond_it() {
    // Anti-windup by the realised voltage: from the moment of the new set-value the shaft slows with the whole torque
    // limit.
    let mut axis = Axis::new(&fast());
    run(&mut axis, 2.0, Rpm(10_000.0).to_rad_s(), |_| {});
    let before = axis.sample().omega_true;
    run(&mut axis, 0.010, Rpm(5000.0).to_rad_s(), |_| {});
    let slowed = before - axis.sample().omega_true;
    let possible = (TORQUE_MAX + 0.05) / J * 0.010;
    assert!(slowed > 0.85 * possible, "{slowed} {possible}");
    // C0070 refers to C0011 = 12 000 rpm here: a quarter of the gain, T_N below 4 J/K_p, so the loop itself swings.
    run(&mut axis, 1.0, Rpm(5000.0).to_rad_s(), |_| {});
    assert!((Rpm::from_rad_s(axis.sample().omega_true).0 - 5000.0).abs() < 5.0);
    assert!(!axis.sample().voltage_limited);
}

#[test]
fn the_current_stays_inside_its_circle_at_every_speed() {
    // √2 · 1.35 A; the current loop passes its set-value by 3.6 % (its z-domain model). The d current is led to zero.
    // While the q current turns round (3.8 A in 0.6 ms), the decoupling is 1.5 ticks late: ω_el L · 6.4 A/ms · 0.19
    // ms = 32 V over 80 V/A, 0.4 A at the most.
    let mut axis = Axis::new(&AxisParams::default());
    let bound = SQRT_2 * 1.35 * 1.04;
    for omega_ref in [290.0, -290.0, 0.0, 290.0] {
        run(&mut axis, 0.2, omega_ref, |axis| {
            let current = axis.sample().current_rms() * SQRT_2;
            assert!(current < bound, "{current}");
            assert!(axis.sample().i_d.abs() < 0.4, "{}", axis.sample().i_d);
        });
        assert!(axis.sample().i_d.abs() < 0.005, "{}", axis.sample().i_d);
    }
}
