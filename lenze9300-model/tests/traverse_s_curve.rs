//! The profile generator with limited jerk.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use lenze9300_model::traverse::{Limits, Motion, PathState, Plan};
use proptest::prelude::*;

/// The film at 1 µm per increment: 1200 mm/s, 2400 mm/s², and 24 000 mm/s³, which is a_max in 0.1 s.
const FILM: Limits = Limits {
    v_max: 1200.0,
    acc: 2.4,
    dec: 2.4,
    jerk: 0.024,
};

fn from_rest(target: i64, limits: &Limits) -> Plan {
    Plan::to_target(PathState::at_rest(0), target, limits, 0.0)
}

/// Least time from rest to rest with equal accelerations (textbook, three cases): d/v + v/a + a/j when both limits
/// are reached, a/j + √((a/j)² + 4 d/a) when the acceleration alone is, ∛(32 d/j) when neither is; with v < a²/j in
/// the first case d/v + 2 √(v/j).
fn rest_to_rest_ms(way: f64, v: f64, a: f64, j: f64) -> f64 {
    let v_ramp = if v * j >= a * a {
        v / a + a / j
    } else {
        2.0 * (v / j).sqrt()
    };
    if way >= v * v_ramp {
        return way / v + v_ramp;
    }
    let t = a / j;
    if way >= 2.0 * a * t * t {
        t + (t * t + 4.0 * way / a).sqrt() - t.min(0.0)
    } else {
        (32.0 * way / j).cbrt()
    }
}

// ---- times

#[test]
fn a_feed_of_1200_mm_takes_the_time_of_the_jerk_longer_than_with_a_trapezoid() {
    // d/v + v/a + a/j = 1 + 0.5 + 0.1 s.
    let plan = from_rest(1_200_000, &FILM);
    assert!((plan.end().unwrap() - 1600.0).abs() < 1e-9);
    assert_eq!(plan.at(1600, 0.0).position, 1_200_000);
    assert_eq!(plan.at(800, 0.0).velocity, 1200.0);
    assert!((plan.at(100, 0.0).acceleration - 2.4).abs() < 1e-12);
    // j t³/6 = 4 mm and j t²/2 = 120 mm/s after the 0.1 s of the jerk; half the way after half the time.
    assert!((plan.at(100, 0.0).velocity - 120.0).abs() < 1e-9);
    assert_eq!(plan.at(100, 0.0).position, 4000);
    assert_eq!(plan.at(800, 0.0).position, 600_000);
    assert!(!plan.reverses());
}

#[test]
fn short_ways_reach_neither_speed_nor_acceleration() {
    // Below 2 a³/j² = 48 mm: ∛(32 d/j).
    let plan = from_rest(1000, &FILM);
    assert!((plan.end().unwrap() - (32_000.0 / 0.024_f64).cbrt()).abs() < 1e-6);
    // Between: a/j + √((a/j)² + 4 d/a).
    let plan = from_rest(200_000, &FILM);
    let expected = 100.0 + (10_000.0 + 800_000.0 / 2.4_f64).sqrt();
    assert!(
        (plan.end().unwrap() - expected).abs() < 1e-6,
        "{:?} {expected}",
        plan.end()
    );
}

#[test]
fn no_way_takes_no_time() {
    assert_eq!(from_rest(0, &FILM).end(), Some(0.0));
}

#[test]
fn a_braking_axis_can_be_sent_a_little_farther_without_going_faster_again() {
    // In the middle of the braking of a feed the target moves 10 mm ahead: the braking is released and taken up again.
    let first = from_rest(1_200_000, &FILM);
    let state = first.at(1300, 0.0).state();
    let plan = Plan::to_target(state, 1_210_000, &FILM, 0.0);
    let end = plan.end().unwrap();
    let mut last = state.velocity;
    for tick in 0..end as u64 {
        let velocity = plan.at(tick, 0.0).velocity;
        assert!(velocity <= last + 1e-9, "faster again at {tick}");
        last = velocity;
    }
    assert_eq!(plan.at(0, end).position, 1_210_000);
    // And it is soon there: 300 ms were left, at a mean speed of some 300 mm/s for the 10 mm.
    assert!((300.0..345.0).contains(&end), "{end}");
}

#[test]
fn a_stop_takes_the_jerk_into_account_and_holds() {
    let start = PathState {
        velocity: 1200.0,
        ..PathState::at_rest(0)
    };
    let plan = Plan::to_velocity(start, 0.0, &FILM);
    // v/a + a/j.
    assert!((plan.end().unwrap() - 600.0).abs() < 1e-9);
    assert_eq!(plan.at(600, 0.0).velocity, 0.0);
    assert_eq!(plan.at(600, 0.0).position, plan.at(100_000, 0.0).position);
    assert_eq!(plan.at(600, 0.0).position, 360_000);
}

#[test]
fn without_speed_the_axis_brakes_and_never_arrives() {
    let limits = Limits { v_max: 0.0, ..FILM };
    assert_eq!(from_rest(1000, &limits).end(), None);
    let moving = PathState {
        velocity: 240.0,
        ..PathState::at_rest(0)
    };
    let plan = Plan::to_target(moving, 1_000_000, &limits, 0.0);
    assert_eq!(plan.end(), None);
    assert_eq!(plan.at(10_000, 0.0).velocity, 0.0);
}

#[test]
fn impossible_limits_do_not_panic() {
    for bad in [f64::NAN, -1.0, 0.0, 1e-300] {
        for jerk in [bad, 0.024] {
            let limits = Limits {
                v_max: bad,
                acc: bad,
                dec: bad,
                jerk,
            };
            let start = PathState {
                velocity: 10.0,
                acceleration: -3.0,
                ..PathState::at_rest(0)
            };
            for v_end in [0.0, bad] {
                assert!(
                    Plan::to_target(start, 100, &limits, v_end)
                        .at(10, 0.0)
                        .velocity
                        .is_finite()
                );
            }
        }
    }
}

#[test]
fn a_very_high_jerk_is_the_trapezoid() {
    let hard = Limits { jerk: 1e6, ..FILM };
    let plan = from_rest(1_200_000, &hard);
    let trapezoid = from_rest(
        1_200_000,
        &Limits {
            jerk: f64::INFINITY,
            ..FILM
        },
    );
    for tick in 0..1600 {
        let (a, b) = (plan.at(tick, 0.0), trapezoid.at(tick, 0.0));
        assert!((a.position - b.position).abs() <= 1, "{tick}");
        assert!((a.velocity - b.velocity).abs() < 1e-4, "{tick}");
    }
}

// ---- properties

/// Oracle for a motion: limits kept at every set-point, continuous, and at every moment one limit used up: the jerk,
/// or the acceleration, or the speed. `Err` names what failed.
fn judge(plan: &Plan, start: PathState, target: i64, limits: &Limits) -> Result<(), String> {
    let end = plan.end().ok_or("never arrives")?;
    let ticks = end.ceil() as u64;
    let stride = (ticks / 300).max(1) as usize;
    let j = limits.jerk;
    let released = start.velocity + start.acceleration * start.acceleration.abs() / (2.0 * j);
    let v_allowed = limits.v_max.max(start.velocity.abs()).max(released.abs()) * (1.0 + 1e-9) + 1e-6;
    for tick in (0..ticks).step_by(stride) {
        let (now, next) = (plan.at(tick, 0.0), plan.at(tick + 1, 0.0));
        let later = plan.at(tick + stride as u64, 0.0);
        if (later.acceleration - now.acceleration).abs() > j * stride as f64 * (1.0 + 1e-9) + 1e-9 {
            return Err(format!("jerk between {tick} and {stride} later"));
        }
        if now.velocity.abs() > v_allowed {
            return Err(format!("speed {} at {tick}", now.velocity));
        }
        let bound = if now.velocity.abs() < 1e-3 {
            limits.acc.max(limits.dec)
        } else if now.acceleration * now.velocity < 0.0 {
            limits.dec
        } else {
            limits.acc
        };
        if now.acceleration.abs() > bound.max(start.acceleration.abs()) * (1.0 + 1e-9) + 1e-9 {
            return Err(format!("acceleration {} at {tick}", now.acceleration));
        }
        if (next.acceleration - now.acceleration).abs() > j * (1.0 + 1e-9) + 1e-9 {
            return Err(format!("jerk {} at {tick}", next.acceleration - now.acceleration));
        }
        // Between two set-points the acceleration strays from their line by at most j/2.
        if (next.velocity - now.velocity - 0.5 * (now.acceleration + next.acceleration)).abs() > 0.25 * j + 1e-6 {
            return Err(format!("velocity jumps at {tick}"));
        }
        let way = (next.position - now.position) as f64 + next.fraction - now.fraction;
        if (way - 0.5 * (now.velocity + next.velocity)).abs()
            > 0.125 * (now.acceleration.abs() + next.acceleration.abs() + j) + 1e-3
        {
            return Err(format!("position jumps at {tick}: {way}"));
        }
        let probes = [0.25, 0.75].map(|at| f64::from(u32::try_from(tick).unwrap()) + at);
        // A border of two phases can lie at one of them.
        if probes
            .iter()
            .all(|at| *at + 0.01 < end && !uses_a_limit(plan, *at, limits, start))
        {
            return Err(format!("needlessly slow at {tick}: {now:?}"));
        }
    }
    let last = plan.at(0, end);
    if last.position != target || last.fraction != 0.0 || last.velocity != 0.0 {
        return Err(format!("ends at {last:?}"));
    }
    let after = plan.at(ticks + 1000, 0.0);
    if after
        != (Motion {
            position: target,
            ..Motion::default()
        })
    {
        return Err(format!("leaves its target: {after:?}"));
    }
    Ok(())
}

fn uses_a_limit(plan: &Plan, at: f64, limits: &Limits, start: PathState) -> bool {
    const H: f64 = 0.005;
    let (before, now, after) = (plan.at(0, at - H), plan.at(0, at), plan.at(0, at + H));
    let jerk = (after.acceleration - before.acceleration) / (2.0 * H);
    let near = |value: f64, limit: f64| (value.abs() - limit).abs() < 1e-6 * limit.max(1.0);
    let accelerating = near(now.acceleration, limits.acc) || near(now.acceleration, limits.dec);
    let cruising = now.acceleration.abs() < 1e-9 && near(now.velocity, limits.v_max);
    let resting = now.acceleration.abs() < 1e-9 && now.velocity.abs() < 1e-3;
    let overspeed = start.velocity.abs() > limits.v_max && now.acceleration.abs() < 1e-9;
    (jerk.abs() / limits.jerk - 1.0).abs() < 1e-3 || accelerating || cruising || resting || overspeed
}

#[test]
fn the_oracle_rejects_slow_hard_and_jerky_plans() {
    let at_rest = PathState::at_rest(0);
    let judged = |limits: Limits| judge(&from_rest(1_200_000, &limits), at_rest, 1_200_000, &FILM).unwrap_err();
    assert!(judged(Limits { v_max: 600.0, ..FILM }).contains("slow"));
    assert!(judged(Limits { jerk: 0.012, ..FILM }).contains("slow"));
    assert!(judged(Limits { acc: 1.2, ..FILM }).contains("slow"));
    assert!(judged(Limits { v_max: 1300.0, ..FILM }).contains("speed"));
    assert!(judged(Limits { dec: 4.8, ..FILM }).contains("acceleration"));
    assert!(judged(Limits { jerk: 0.048, ..FILM }).contains("jerk"));
    assert!(
        judged(Limits {
            jerk: f64::INFINITY,
            ..FILM
        })
        .contains("jerk")
    );
}

fn limits() -> impl Strategy<Value = Limits> {
    (1.0..4000.0_f64, 0.05..10.0_f64, 0.05..10.0_f64, -4.0..0.0_f64).prop_map(|(v_max, acc, dec, exponent)| Limits {
        v_max,
        acc,
        dec,
        jerk: 10.0_f64.powf(exponent),
    })
}

/// Time and end of a plain way to stop: let the acceleration go, then brake.
fn plain_stop(start: PathState, limits: &Limits) -> f64 {
    let j = limits.jerk;
    let released = (start.velocity + start.acceleration * start.acceleration.abs() / (2.0 * j)).abs();
    let ramp = if released * j >= limits.dec * limits.dec {
        released / limits.dec + limits.dec / j
    } else {
        2.0 * (released / j).sqrt()
    };
    start.acceleration.abs() / j + ramp
}

proptest! {
    #[test]
    fn from_rest_the_time_is_the_analytic_optimum(mut limits in limits(), target in -5_000_000_i64..5_000_000) {
        limits.dec = limits.acc;
        let plan = from_rest(target, &limits);
        let optimum = rest_to_rest_ms(target.abs() as f64, limits.v_max, limits.acc, limits.jerk);
        prop_assert!((plan.end().unwrap() - optimum).abs() <= 1e-6 * optimum.max(1.0), "{:?} {optimum}", plan.end());
        prop_assert!(!plan.reverses());
        if let Err(reason) = judge(&plan, PathState::at_rest(0), target, &limits) { prop_assert!(false, "{reason}"); }
    }

    #[test]
    fn from_any_state_the_plan_arrives_within_the_limits_and_not_needlessly_late(
        limits in limits(), fraction in 0.0..1.0_f64, speed in -1.2..1.2_f64, push in -1.2..1.2_f64,
        target in -1_000_000_i64..1_000_000,
    ) {
        let start = PathState {
            position: 0,
            fraction,
            velocity: speed * limits.v_max,
            acceleration: push * limits.acc.min(limits.dec),
        };
        let plan = Plan::to_target(start, target, &limits, 0.0);
        let first = plan.at(0, 0.0);
        prop_assert!(first.position.abs() <= 1 && (first.velocity - start.velocity).abs() < 1e-6);
        prop_assert!((first.acceleration - start.acceleration).abs() < 1e-6);
        if let Err(reason) = judge(&plan, start, target, &limits) { prop_assert!(false, "{reason}"); }
        // Two-sided: no slower than to stop first and to go then, at the smaller acceleration; no faster than without
        // a limit of the jerk.
        let stopped = Plan::to_velocity(start, 0.0, &limits);
        let rest = stopped.at(0, stopped.end().unwrap());
        let way = (target - rest.position) as f64 - rest.fraction;
        let late = plain_stop(start, &limits)
            + rest_to_rest_ms(way.abs(), limits.v_max, limits.acc.min(limits.dec), limits.jerk);
        prop_assert!(plan.end().unwrap() <= late * (1.0 + 1e-6) + 1.0, "{:?} {late}", plan.end());
        if speed.abs() < 0.5 && push == 0.0 {
            let trapezoid = Plan::to_target(start, target, &Limits { jerk: f64::INFINITY, ..limits }, 0.0);
            prop_assert!(plan.end().unwrap() >= trapezoid.end().unwrap() - 1e-6);
        }
    }

    #[test]
    fn planning_anew_on_the_way_changes_neither_path_nor_time(
        limits in limits(), target in 1000_i64..3_000_000, part in 0.01..0.99_f64,
    ) {
        let plan = from_rest(target, &limits);
        let end = plan.end().unwrap();
        let moment = part * end;
        let again = Plan::to_target(plan.at(0, moment).state(), target, &limits, 0.0);
        prop_assert!(!again.reverses());
        // What rounding leaves of the way, 1e-6 inc, takes ∛(32 · 1e-6/j) at the end.
        let late = again.end().unwrap() + moment - end;
        prop_assert!(late.abs() < 1e-3 + (32e-6 / limits.jerk).cbrt(), "{late} at {moment} of {end}");
    }

    #[test]
    fn a_new_target_from_any_moment_of_a_motion_is_reached(
        limits in limits(), first in 1000_i64..3_000_000, part in 0.0..1.0_f64, second in -3_000_000_i64..3_000_000,
    ) {
        let plan = from_rest(first, &limits);
        let start = plan.at(0, part * plan.end().unwrap()).state();
        let again = Plan::to_target(start, second, &limits, 0.0);
        if let Err(reason) = judge(&again, start, second, &limits) { prop_assert!(false, "{reason}"); }
    }

    #[test]
    fn two_records_on_the_fly_are_one_smooth_motion(
        limits in limits(), way in 10_000_i64..3_000_000, rest in 100_000_i64..1_000_000, share in 0.05..1.0_f64,
    ) {
        let first = Plan::to_target(PathState::at_rest(0), way, &limits, share * limits.v_max);
        let end = first.end().unwrap();
        let second = Plan::to_target(first.at(0, end).state(), way + rest, &limits, 0.0);
        let (before, after) = (first.at(0, end - 1e-6), second.at(0, 0.0));
        prop_assert!(((after.position - before.position) as f64 + after.fraction - before.fraction).abs() < 0.1);
        prop_assert!((after.velocity - before.velocity).abs() < 1e-3);
        prop_assert!((after.acceleration - before.acceleration).abs() < 1e-3);
    }

    #[test]
    fn on_the_fly_the_target_is_crossed_forwards_from_any_state(
        limits in limits(), speed in -1.0..1.0_f64, push in -1.0..1.0_f64, target in 1_i64..1_000_000,
        share in 0.05..1.0_f64,
    ) {
        let start = PathState {
            velocity: speed * limits.v_max,
            acceleration: push * limits.acc.min(limits.dec),
            ..PathState::at_rest(0)
        };
        let plan = Plan::to_target(start, target, &limits, share * limits.v_max);
        let crossing = plan.at(0, plan.end().unwrap());
        let there = (crossing.position - target) as f64 + crossing.fraction;
        prop_assert!(there.abs() < 1e-4, "{there}");
        prop_assert!(crossing.velocity >= -1e-9, "{crossing:?}");
        let mut last = plan.at(0, 0.0);
        for tick in 1..(plan.end().unwrap() as u64).min(500) {
            let now = plan.at(tick, 0.0);
            prop_assert!((now.acceleration - last.acceleration).abs() <= limits.jerk * (1.0 + 1e-9) + 1e-9);
            let rate = limits.acc.max(limits.dec).max(start.acceleration.abs());
            prop_assert!((now.velocity - last.velocity).abs() <= rate + 1e-6);
            last = now;
        }
    }

    #[test]
    fn a_velocity_is_reached_within_the_limits_from_any_state(
        limits in limits(), speed in -1.2..1.2_f64, push in -1.2..1.2_f64, to in -1.0..1.0_f64,
    ) {
        let start = PathState {
            velocity: speed * limits.v_max,
            acceleration: push * limits.acc.min(limits.dec),
            ..PathState::at_rest(0)
        };
        let velocity = to * limits.v_max;
        let plan = Plan::to_velocity(start, velocity, &limits);
        let end = plan.end().unwrap();
        prop_assert_eq!(plan.at(0, end + 1.0).velocity, velocity);
        prop_assert!((plan.at(0, end - 1e-7).velocity - velocity).abs() < 1e-3);
        let mut last = plan.at(0, 0.0);
        for tick in 1..(end.ceil() as u64).min(500) {
            let now = plan.at(tick, 0.0);
            let bound = limits.acc.max(limits.dec).max(start.acceleration.abs());
            prop_assert!(now.acceleration.abs() <= bound * (1.0 + 1e-9) + 1e-9);
            prop_assert!((now.acceleration - last.acceleration).abs() <= limits.jerk * (1.0 + 1e-9) + 1e-9);
            last = now;
        }
    }
}
