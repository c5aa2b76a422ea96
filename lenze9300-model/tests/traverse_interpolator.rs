//! The profile generator.

use lenze9300_model::traverse::{Limits, PathState, Plan};
use proptest::prelude::*;

/// The film at 1 µm per increment: 1200 mm/s and 2400 mm/s².
const FILM: Limits = Limits {
    v_max: 1200.0,
    acc: 2.4,
    dec: 2.4,
    jerk: f64::INFINITY,
};

fn from_rest(target: i64, limits: &Limits) -> Plan {
    Plan::to_target(PathState::at_rest(0), target, limits, 0.0)
}

fn moving(velocity: f64) -> PathState {
    PathState {
        velocity,
        ..PathState::at_rest(0)
    }
}

/// 9300 facts 11: 0.5 + 0.5 + 0.5 s, 300 + 600 + 300 mm.
#[test]
fn a_feed_of_1200_mm_takes_exactly_one_and_a_half_seconds() {
    let plan = from_rest(1_200_000, &FILM);
    assert_eq!(plan.end(), Some(1500.0));
    assert_eq!(plan.at(500, 0.0).position, 300_000);
    assert_eq!(plan.at(1000, 0.0).position, 900_000);
    assert_eq!(plan.at(1500, 0.0).position, 1_200_000);
    assert_eq!(plan.at(1500, 0.0).velocity, 0.0);
    assert_eq!(plan.at(750, 0.0).velocity, 1200.0);
    assert_eq!(plan.at(10_000, 0.0).position, 1_200_000);
}

/// Below v²/a = 600 mm the profile is a triangle: t = 2·√(s/a).
#[test]
fn a_short_way_is_a_triangle() {
    let plan = from_rest(60_000, &FILM);
    let expected = 2.0 * (60_000.0_f64 / 2.4).sqrt();
    assert!((plan.end().unwrap() - expected).abs() < 1e-9);
    let peak = (60_000.0_f64 * 2.4).sqrt();
    assert!((plan.at(158, 0.113_883).velocity - peak).abs() < 1e-3);
}

#[test]
fn no_way_takes_no_time() {
    assert_eq!(from_rest(0, &FILM).end(), Some(0.0));
    assert!(!from_rest(0, &FILM).reverses());
}

/// 9300 facts 4.2: braking from 489.9 mm/s takes 50 mm.
#[test]
fn a_target_too_near_is_passed_and_returned_to() {
    let limit = (2.0_f64 * 2.4 * 50_000.0).sqrt();
    assert!((limit - 489.9).abs() < 0.01);
    assert!(!Plan::to_target(moving(limit), 50_000, &FILM, 0.0).reverses());
    assert!(!Plan::to_target(moving(limit - 0.1), 50_000, &FILM, 0.0).reverses());
    let plan = Plan::to_target(moving(limit + 0.1), 50_000, &FILM, 0.0);
    assert!(plan.reverses());
    let end = plan.end().unwrap();
    let ticks = end.ceil() as u64;
    let farthest = (0..=ticks).map(|tick| plan.at(tick, 0.0).position).max().unwrap();
    assert!(farthest > 50_000);
    assert_eq!(plan.at(ticks, 0.0).position, 50_000);
    assert_eq!(plan.at(ticks, 0.0).velocity, 0.0);
}

#[test]
fn the_crossing_on_the_fly_has_its_exact_time_and_speed() {
    let plan = Plan::to_target(PathState::at_rest(0), 1_100_000, &FILM, 240.0);
    // 0.5 s up (300 mm), down to 240 mm/s in 0.4 s (288 mm), 512 mm at 1200 mm/s between.
    let end = plan.end().unwrap();
    assert!((end - (500.0 + 512_000.0 / 1200.0 + 400.0)).abs() < 1e-9);
    let crossing = plan.at(0, end);
    assert_eq!(
        (crossing.position, crossing.fraction, crossing.velocity),
        (1_100_000, 0.0, 240.0)
    );
    assert!(
        (plan.at(0, end + 0.5).position - 1_100_120).abs() <= 1,
        "the speed stays"
    );
}

#[test]
fn a_way_too_short_for_the_final_speed_is_crossed_as_fast_or_slowly_as_possible() {
    let up = Plan::to_target(PathState::at_rest(0), 1000, &FILM, 240.0);
    assert!((up.end_velocity() - (2.0_f64 * 2.4 * 1000.0).sqrt()).abs() < 1e-9);
    let down = Plan::to_target(moving(1000.0), 1000, &FILM, 240.0);
    assert!((down.end_velocity() - (1e6 - 2.0 * 2.4 * 1000.0_f64).sqrt()).abs() < 1e-9);
    assert!(!up.reverses() && !down.reverses());
}

#[test]
fn without_speed_the_axis_brakes_and_never_arrives() {
    let limits = Limits { v_max: 0.0, ..FILM };
    assert_eq!(from_rest(1000, &limits).end(), None);
    let plan = Plan::to_target(moving(240.0), 1_000_000, &limits, 0.0);
    assert_eq!(plan.end(), None);
    assert_eq!(plan.at(100, 0.0).velocity, 0.0);
    assert_eq!(plan.at(100_000, 0.0).position, 12_000);
}

#[test]
fn impossible_limits_do_not_panic() {
    for bad in [f64::NAN, -1.0, 0.0] {
        let limits = Limits {
            v_max: bad,
            acc: bad,
            dec: bad,
            jerk: bad,
        };
        let plan = Plan::to_target(moving(10.0), 100, &limits, bad);
        assert!(plan.at(10, 0.0).velocity.is_finite());
    }
}

#[test]
fn a_velocity_is_reached_along_the_ramp_and_held() {
    let plan = Plan::to_velocity(PathState::at_rest(7), 240.0, &FILM);
    assert_eq!(plan.end(), Some(100.0));
    assert_eq!(plan.at(100, 0.0).position, 7 + 12_000);
    assert_eq!(plan.at(1100, 0.0).position, 7 + 12_000 + 240_000);
    let back = Plan::to_velocity(moving(240.0), -240.0, &FILM);
    assert_eq!(back.end(), Some(200.0));
    assert!(back.reverses());
}

#[test]
fn hours_of_travel_do_not_drift() {
    let plan = Plan::to_velocity(moving(1.0 / 3.0), 1.0 / 3.0, &FILM);
    assert_eq!(plan.at(36_000_000, 0.5).position, 12_000_000);
}

fn limits() -> impl Strategy<Value = Limits> {
    (1.0..4000.0_f64, 0.05..10.0_f64, 0.05..10.0_f64).prop_map(|(v_max, acc, dec)| Limits {
        v_max,
        acc,
        dec,
        jerk: f64::INFINITY,
    })
}

/// Oracle for one motion: limits kept, continuous, and at every moment one limit used up. `Err` names what failed.
fn judge(plan: &Plan, start: PathState, target: i64, limits: &Limits) -> Result<(), String> {
    let end = plan.end().ok_or("never arrives")?;
    let ticks = end.floor() as u64;
    // Long plans are sampled, so that a case stays cheap.
    let stride = (ticks / 400).max(1) as usize;
    let allowed = limits.v_max.max(start.velocity.abs()) * (1.0 + 1e-9) + 1e-9;
    for tick in (0..ticks).step_by(stride) {
        let (now, next) = (plan.at(tick, 0.0), plan.at(tick + 1, 0.0));
        if now.velocity.abs() > allowed {
            return Err(format!("speed {} at {tick}", now.velocity));
        }
        let rate = limits.acc.max(limits.dec) * (1.0 + 1e-9) + 1e-9;
        if (next.velocity - now.velocity).abs() > rate {
            return Err(format!("velocity jumps at {tick}"));
        }
        let way = (next.position - now.position) as f64 + next.fraction - now.fraction;
        let mean = 0.5 * (now.velocity + next.velocity);
        if (way - mean).abs() > rate + 1e-3 {
            return Err(format!("position jumps at {tick}: {way} against {mean}"));
        }
        let braking = now.acceleration * now.velocity < 0.0;
        let bound = if braking { limits.dec } else { limits.acc };
        let ramping = (now.acceleration.abs() - bound).abs() < 1e-9 || now.velocity == 0.0;
        let cruising = now.acceleration == 0.0 && (now.velocity.abs() - limits.v_max).abs() < 1e-6;
        if !ramping && !cruising {
            return Err(format!("needlessly slow at {tick}: {now:?}"));
        }
    }
    let last = plan.at(0, end);
    if last.position != target || last.fraction != 0.0 {
        return Err(format!("ends at {last:?}"));
    }
    Ok(())
}

/// The oracle must reject a plan made for half the speed or for twice the acceleration.
#[test]
fn the_oracle_rejects_slow_and_hard_plans() {
    let slow = from_rest(1_200_000, &Limits { v_max: 600.0, ..FILM });
    assert!(
        judge(&slow, PathState::at_rest(0), 1_200_000, &FILM)
            .unwrap_err()
            .contains("slow")
    );
    let fast = from_rest(1_200_000, &Limits { v_max: 1300.0, ..FILM });
    assert!(
        judge(&fast, PathState::at_rest(0), 1_200_000, &FILM)
            .unwrap_err()
            .contains("speed")
    );
    let hard = from_rest(1_200_000, &Limits { acc: 4.8, ..FILM });
    assert!(
        judge(&hard, PathState::at_rest(0), 1_200_000, &FILM)
            .unwrap_err()
            .contains("jumps")
    );
}

proptest! {
    /// Rest to rest: t = s/v + v/2·(1/a + 1/d), or √(2·s·(1/a + 1/d)) for a triangle.
    #[test]
    fn from_rest_the_total_time_is_the_analytic_optimum(
        limits in limits(), target in -5_000_000_i64..5_000_000,
    ) {
        let plan = from_rest(target, &limits);
        let (s, v) = (target.abs() as f64, limits.v_max);
        let ramps = 1.0 / limits.acc + 1.0 / limits.dec;
        let optimum = if s >= 0.5 * v * v * ramps { s / v + 0.5 * v * ramps } else { (2.0 * s * ramps).sqrt() };
        prop_assert!((plan.end().unwrap() - optimum).abs() <= 1e-9 * optimum.max(1.0));
        prop_assert!(!plan.reverses());
        if let Err(reason) = judge(&plan, PathState::at_rest(0), target, &limits) { prop_assert!(false, "{reason}"); }
    }

    #[test]
    fn from_any_state_the_plan_arrives_within_the_limits_and_not_needlessly_late(
        limits in limits(), position in -1_000_000_i64..1_000_000, fraction in 0.0..1.0_f64,
        velocity in -5000.0..5000.0_f64, target in -1_000_000_i64..1_000_000,
    ) {
        let start = PathState { position, fraction, velocity, acceleration: 0.0 };
        let plan = Plan::to_target(start, target, &limits, 0.0);
        let first = plan.at(0, 0.0);
        prop_assert_eq!(first.position, position);
        prop_assert!((first.velocity - velocity).abs() < 1e-6);
        if let Err(reason) = judge(&plan, start, target, &limits) { prop_assert!(false, "{reason}"); }
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
        prop_assert!((again.end().unwrap() + moment - end).abs() < 1e-2, "{} + {moment} against {end}", again.end().unwrap());
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
        prop_assert!((after.velocity - before.velocity).abs() < 1e-4);
    }
}
