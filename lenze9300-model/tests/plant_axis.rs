//! The whole axis against energy, thresholds and standstill.

use lenze9300_model::plant::{Contact, DcLinkParams, LinkState, Mains, PmsmParams, ShaftAngle};
use lenze9300_model::units::Rpm;
use lenze9300_model::{Axis, AxisCommand, AxisParams, Pulses};

const TICK_S: f64 = 125e-6;

fn speed(omega_ref: f64) -> AxisCommand {
    AxisCommand::Speed {
        omega_ref,
        torque_ff: 0.0,
    }
}

fn run(axis: &mut Axis, seconds: f64, command: AxisCommand) {
    for _ in 0..(seconds / TICK_S).round() as u64 {
        axis.tick(command);
    }
}

fn frictionless() -> AxisParams {
    let mut params = AxisParams::default();
    params.mechanics.coulomb_nm = 0.0;
    params
}

/// The raw bits of everything that a tick shows.
fn bits(axis: &Axis) -> [u64; 9] {
    let s = axis.sample();
    [
        s.position as u64,
        s.angle.increments() as u64,
        s.angle.fraction().to_bits(),
        s.omega_meas.to_bits(),
        s.i_d.to_bits(),
        s.i_q.to_bits(),
        s.torque_ref.to_bits(),
        s.u_dc.to_bits(),
        s.voltage.q.to_bits(),
    ]
}

// Standstill

#[test]
fn an_inhibited_axis_stands_exactly_for_a_million_ticks() {
    // Source: design, section 5: "standstill must stand".
    let mut axis = Axis::new(&AxisParams::default());
    axis.set_load_torque(0.049);
    for _ in 0..1_000_000 {
        let segment = axis.tick(AxisCommand::Inhibited);
        assert_eq!(segment.start, segment.end);
    }
    assert_eq!(axis.sample().angle, ShaftAngle::default());
    assert_eq!(axis.sample().omega_meas, 0.0);
    assert_eq!(axis.tick_count(), 1_000_000);
}

#[test]
fn a_controlled_axis_stands_exactly_for_a_million_ticks_after_a_move() {
    let mut axis = Axis::new(&AxisParams::default());
    run(&mut axis, 0.3, speed(100.0));
    run(&mut axis, 0.5, speed(0.0));
    let at = axis.sample().angle;
    for _ in 0..1_000_000 {
        axis.tick(speed(0.0));
    }
    assert_eq!(axis.sample().angle, at);
    assert_eq!((axis.sample().omega_true, axis.sample().omega_meas), (0.0, 0.0));
    assert!(axis.sample().torque.abs() < 0.05);
}

#[test]
fn a_load_above_the_friction_is_held_by_the_controller() {
    let mut axis = Axis::new(&AxisParams::default());
    axis.set_load_torque(0.3);
    run(&mut axis, 1.0, speed(0.0));
    let s = axis.sample();
    assert!(s.omega_true.abs() < 1e-3, "{}", s.omega_true);
    assert!((s.torque - 0.3).abs() <= 0.0501, "{}", s.torque);
}

// Stationary operation

#[test]
fn film_speed_induces_132_volts() {
    // Source: 9300 facts 6, "at 2814.5 rpm E is about 132 V line-line"; without friction no current flows.
    let mut axis = Axis::new(&frictionless());
    run(&mut axis, 2.0, speed(Rpm(2814.5).to_rad_s()));
    let s = axis.sample();
    assert!(
        (s.voltage.line_to_line_rms() - 132.3).abs() < 0.5,
        "{}",
        s.voltage.line_to_line_rms()
    );
    assert!(s.current_rms() < 0.02 && !s.voltage_limited, "{s:?}");
}

#[test]
fn constant_speed_takes_the_torque_of_the_friction() {
    let mut axis = Axis::new(&AxisParams::default());
    run(&mut axis, 1.0, speed(200.0));
    let mean = (0..8000)
        .map(|_| {
            axis.tick(speed(200.0));
            axis.sample().torque
        })
        .sum::<f64>()
        / 8000.0;
    assert!((mean - 0.05).abs() < 1e-4, "{mean}");
    // 0.05 Nm over 0.778 Nm/A.
    assert!((axis.sample().current_rms() - 0.0643).abs() < 0.005);
}

#[test]
fn the_torque_limit_of_c0022_is_1_05_nm_and_sets_the_acceleration() {
    // Source: 9300 facts 6. α = (1.05 − 0.05)/0.914e-4 = 10 941 rad/s².
    let mut axis = Axis::new(&AxisParams::default());
    run(&mut axis, 0.006, speed(300.0));
    assert!(axis.sample().torque_limited);
    let before = axis.sample().omega_true;
    run(&mut axis, 0.005, speed(300.0));
    let s = axis.sample();
    assert!((s.torque - 1.05).abs() < 0.03, "{}", s.torque);
    let alpha = (s.omega_true - before) / 0.005;
    assert!((alpha / 10_941.0 - 1.0).abs() < 0.05, "{alpha}");
}

// Inhibit and restart

#[test]
fn an_inhibited_axis_coasts_to_a_stop_after_the_analytic_time() {
    // t = J ω / M = 0.914e-4 · 300 / 0.05 = 0.548 s; φ = ω t / 2.
    let mut axis = Axis::new(&AxisParams::default());
    axis.set_shaft_speed(300.0);
    let mut ticks = 0_u32;
    while axis.sample().omega_true > 0.0 {
        axis.tick(AxisCommand::Inhibited);
        ticks += 1;
    }
    assert!((f64::from(ticks) * TICK_S - 0.5484).abs() <= TICK_S, "{ticks}");
    let turned = (axis.sample().angle.increments() as f64) * std::f64::consts::TAU / 65_536.0;
    assert!((turned - 0.5 * 300.0 * 0.5484).abs() < 1e-3, "{turned}");
}

#[test]
fn an_inhibit_takes_the_current_away_within_its_tick() {
    let mut axis = Axis::new(&AxisParams::default());
    run(&mut axis, 0.01, speed(300.0));
    assert!(axis.sample().i_q > 1.0);
    axis.tick(AxisCommand::Inhibited);
    let s = axis.sample();
    assert_eq!((s.i_d, s.i_q, s.torque, s.pulses), (0.0, 0.0, 0.0, Pulses::Inhibited));
}

#[test]
fn an_enable_at_speed_is_bumpless() {
    let mut axis = Axis::new(&AxisParams::default());
    axis.set_shaft_speed(250.0);
    run(&mut axis, 0.01, AxisCommand::Inhibited);
    let omega = axis.sample().omega_meas;
    let mut surge: f64 = 0.0;
    for _ in 0..16 {
        axis.tick(speed(omega));
        surge = surge.max(axis.sample().i_q.abs());
    }
    // The friction alone needs 0.091 A peak; a start from zero voltage would make 1.5 A in two ticks.
    assert!(surge < 0.1, "{surge}");
    assert_eq!(axis.sample().pulses, Pulses::Enabled);
}

// DC link

#[test]
fn braking_a_large_inertia_raises_the_link_to_the_ou_threshold() {
    // Source: film-feed specification, section 5: OU at 770 V. 20e-4 kg m² at 300 rad/s hold 90 J, the link takes
    // C/2 (770² − 565.7²) = 22.5 J above its rest voltage.
    let mut params = frictionless();
    params.mechanics.j_load_kg_m2 = 20e-4;
    let mut axis = Axis::new(&params);
    axis.set_shaft_speed(300.0);
    run(&mut axis, 0.01, speed(300.0));
    assert_eq!(axis.sample().link, LinkState::Normal);
    let (mut peak, mut inhibited_at_v, mut resumed_at_v) = (0.0_f64, None, None);
    for _ in 0..40_000 {
        axis.tick(speed(0.0));
        let s = axis.sample();
        peak = peak.max(s.u_dc);
        if s.pulses == Pulses::Inhibited && inhibited_at_v.is_none() {
            inhibited_at_v = Some(s.u_dc);
        }
        if s.pulses == Pulses::Enabled && inhibited_at_v.is_some() && resumed_at_v.is_none() {
            resumed_at_v = Some(s.u_dc);
        }
    }
    assert!((770.0..773.0).contains(&peak), "{peak}");
    assert!(inhibited_at_v.is_some_and(|v| v > 769.0), "{inhibited_at_v:?}");
    assert!(resumed_at_v.is_some_and(|v| v < 756.0), "{resumed_at_v:?}");
}

#[test]
fn what_braking_returns_is_kinetic_energy_less_the_heat_of_the_copper() {
    // Energy balance, without friction and standby: J ω²/2 = ΔE_link + ∫ 3 R I² + rest of the motion.
    let mut params = frictionless();
    params.dc_link = DcLinkParams {
        standby_w: 0.0,
        capacitance_f: 2e-3,
        ..DcLinkParams::default()
    };
    params.mechanics.j_load_kg_m2 = 4.75e-4;
    let mut axis = Axis::new(&params);
    axis.set_shaft_speed(300.0);
    run(&mut axis, 0.001, speed(300.0));
    let j = 5.0e-4;
    let energy = |axis: &Axis| {
        let s = axis.sample();
        0.5 * j * s.omega_true * s.omega_true
            + 0.5 * 2e-3 * s.u_dc * s.u_dc
            + 0.75 * 30.5e-3 * (s.i_d * s.i_d + s.i_q * s.i_q)
    };
    let (before, mut heat_j) = (energy(&axis), 0.0);
    let omega_before = axis.sample().omega_true;
    for _ in 0..800 {
        axis.tick(speed(100.0));
        heat_j += 3.0 * 19.8 * axis.sample().current_rms().powi(2) * TICK_S;
    }
    let returned = 0.5 * j * (omega_before * omega_before - axis.sample().omega_true.powi(2));
    assert!(returned > 15.0, "{returned}");
    let missing = before - energy(&axis) - heat_j;
    assert!(missing.abs() < 0.01 * returned, "{missing} of {returned}");
}

#[test]
fn without_mains_the_link_falls_to_lu_and_the_pulses_stop() {
    // Source: 9300 facts 4.8: LU below 285 V is a message, self-clearing.
    let mut axis = Axis::new(&AxisParams::default());
    run(&mut axis, 0.2, speed(100.0));
    axis.set_mains(Mains::Off);
    run(&mut axis, 2.0, speed(100.0));
    let s = axis.sample();
    assert_eq!((s.link, s.pulses), (LinkState::Undervoltage, Pulses::Inhibited));
    assert!(s.u_dc < 285.0);
    assert_eq!(s.omega_true, 0.0);
    axis.set_mains(Mains::On);
    run(&mut axis, 0.5, speed(100.0));
    let s = axis.sample();
    assert_eq!((s.link, s.pulses), (LinkState::Normal, Pulses::Enabled));
    assert!((s.omega_true - 100.0).abs() < 1.0, "{}", s.omega_true);
}

#[test]
fn a_drive_without_mains_reports_lu_and_measures_its_position() {
    let mut axis = Axis::new(&AxisParams {
        mains: Mains::Off,
        ..AxisParams::default()
    });
    axis.set_shaft_speed(10.0);
    run(&mut axis, 0.01, speed(0.0));
    assert_eq!(axis.sample().pulses, Pulses::Inhibited);
    assert!(axis.sample().position > 500, "{}", axis.sample().position);
}

// Repeatability and edges

#[test]
fn the_same_commands_give_the_same_bits() {
    let trial = || {
        let mut axis = Axis::new(&AxisParams::default());
        let mut trace = Vec::new();
        for n in 0..20_000_u32 {
            axis.set_load_torque(if n % 700 < 90 { 0.2 } else { -0.03 });
            axis.tick(match n / 1000 % 4 {
                0 => AxisCommand::Inhibited,
                1 => speed(250.0),
                2 => speed(-90.0),
                _ => speed(0.0),
            });
            trace.push(bits(&axis));
        }
        trace
    };
    assert!(trial() == trial());
}

#[test]
fn position_does_not_drift_over_18_000_turns_in_one_direction() {
    let mut params = frictionless();
    params.feedback.resolver_bits = 16;
    let mut axis = Axis::new(&params);
    axis.set_shaft_speed(Rpm(3000.0).to_rad_s());
    for _ in 0..2_880_000 {
        axis.tick(AxisCommand::Inhibited);
    }
    // 3000 rpm for 6 minutes without friction: 18 000 turns exactly, by Newton's first law.
    let expected = 18_000.0 * 65_536.0;
    let angle = axis.sample().angle;
    let error = angle.increments() as f64 + angle.fraction() - expected;
    assert!(error.abs() < 1e-3, "{error}");
    assert_eq!(axis.sample().position, angle.increments());
}

#[test]
fn every_edge_along_an_acceleration_is_found_once_and_at_its_moment() {
    // Oracle: with constant torque φ = α t²/2, so the edge at φ lies at t = √(2 φ / α), to 1e-6 of a tick.
    let mut axis = Axis::new(&frictionless());
    axis.set_load_torque(-0.05);
    let alpha_inc = 0.05 / 0.914e-4 * 65_536.0 / std::f64::consts::TAU;
    let mut next = 1_000.25_f64;
    for tick in 0..4_000_u32 {
        let segment = axis.tick(AxisCommand::Inhibited);
        while let Some(share) = segment.crossing(ShaftAngle::new(0, next)) {
            let expected_ticks = (2.0 * next / alpha_inc).sqrt() / TICK_S;
            let found_ticks = f64::from(tick) + share;
            assert!(
                (found_ticks - expected_ticks).abs() < 1e-6,
                "{next}: {found_ticks} {expected_ticks}"
            );
            next += 1_000.25;
        }
    }
    assert!(next > 500_000.0, "{next}");
}

#[test]
fn a_locked_shaft_is_stuck_and_a_turning_one_is_not() {
    assert_eq!(Contact::Stuck, {
        let mechanics = AxisParams::default().mechanics;
        lenze9300_model::plant::DriveTrain::new(&PmsmParams::MDSKS036_13, &mechanics, 500.0, TICK_S).contact()
    });
}

// ---- torque command, tick

#[test]
fn a_commanded_torque_accelerates_the_inertia_and_is_held_at_c0022() {
    // Newton: (0.2 − 0.05) Nm / 0.914e-4 kg m² over 50 ms, less the rise of the current (some 0.7 ms).
    let mut axis = Axis::new(&AxisParams::default());
    for _ in 0..400 {
        axis.tick(AxisCommand::Torque { torque_nm: 0.2 });
    }
    let expected = 0.15 / 0.914e-4 * 0.05;
    let ratio = axis.sample().omega_true / expected;
    assert!((0.98..1.0).contains(&ratio), "{ratio}");
    assert!(!axis.sample().torque_limited);
    axis.tick(AxisCommand::Torque { torque_nm: 2.0 });
    assert!(axis.sample().torque_limited);
    assert!((axis.sample().torque_ref - 1.05).abs() < 1e-9);
}

#[test]
fn the_speed_controller_takes_a_commanded_torque_over_without_a_jump() {
    let mut axis = Axis::new(&AxisParams::default());
    for _ in 0..400 {
        axis.tick(AxisCommand::Torque { torque_nm: 0.2 });
    }
    let omega_ref = axis.sample().omega_meas;
    axis.tick(AxisCommand::Speed {
        omega_ref,
        torque_ff: 0.0,
    });
    assert!(
        (axis.sample().torque_ref - 0.2).abs() < 1e-9,
        "{}",
        axis.sample().torque_ref
    );
}

#[test]
fn at_16_khz_the_axis_follows_as_well_with_twice_the_ticks() {
    // C0018 = 2: a tick of 62.5 µs; speed and position controller keep their 250 µs and 1 ms.
    let params = AxisParams {
        tick_ns: 62_500,
        ..AxisParams::default()
    };
    let mut axis = Axis::new(&params);
    for _ in 0..16_000 {
        axis.tick(AxisCommand::Speed {
            omega_ref: 100.0,
            torque_ff: 0.0,
        });
    }
    assert!(
        (axis.sample().omega_true - 100.0).abs() < 0.2,
        "{}",
        axis.sample().omega_true
    );
    // A second at 100 rad/s but for the run-up.
    let turned = axis.sample().position as f64 * std::f64::consts::TAU / 65_536.0;
    assert!((97.0..100.5).contains(&turned), "{turned}");
}
