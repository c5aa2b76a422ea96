//! Manual traversing.

mod traverse_rig;

use lenze9300_model::code::table::number::*;
use lenze9300_model::traverse::*;
use traverse_rig::Rig;

/// 10 % of 1200 mm/s in inc/ms (9300 facts 11: 100 % are 3074.216).
const SPEED: f64 = 307.4216;

fn jogging() -> Rig {
    let mut rig = Rig::new();
    rig.inputs.manual = true;
    rig.inputs.manual_pos = true;
    rig
}

#[test]
fn manual_travels_at_the_manual_speed_along_the_ramp() {
    let mut rig = jogging();
    rig.run(51);
    assert!((rig.last.velocity - SPEED).abs() < 0.001, "{}", rig.last.velocity);
    rig.run(1000);
    // 50 ms up to 120 mm/s (3 mm), then 1000 ms at 120 mm/s.
    assert!((rig.film_mm() - 123.0).abs() < 0.2, "{}", rig.film_mm());
    assert!(!rig.traverse.status().running && !rig.traverse.status().ready_to_start);
}

#[test]
fn manual_negative_travels_backwards() {
    let mut rig = jogging();
    rig.inputs.manual_pos = false;
    rig.inputs.manual_neg = true;
    rig.run(200);
    assert!((rig.last.velocity + SPEED).abs() < 0.001);
    assert!(rig.film < 0);
}

/// 9300 facts 4.3: both or none = standstill.
#[test]
fn both_directions_are_a_standstill_and_so_is_none() {
    let mut rig = jogging();
    rig.inputs.manual_neg = true;
    rig.run(100);
    assert_eq!(rig.film, 0);
    rig.inputs.manual_neg = false;
    rig.run(200);
    rig.inputs.manual_neg = true;
    rig.run(60);
    assert_eq!(rig.last.velocity, 0.0);
    rig.inputs.manual_pos = false;
    rig.run(200);
    assert!((rig.last.velocity + SPEED).abs() < 0.001);
    rig.inputs.manual_neg = false;
    rig.run(60);
    assert_eq!(rig.last.velocity, 0.0);
}

#[test]
fn changing_the_direction_keeps_the_ramp() {
    let mut rig = jogging();
    rig.run(200);
    (rig.inputs.manual_pos, rig.inputs.manual_neg) = (false, true);
    let mut before = rig.last.velocity;
    for _ in 0..200 {
        let now = rig.tick().velocity;
        assert!((now - before).abs() < 6.149);
        before = now;
    }
    assert!((before + SPEED).abs() < 0.001);
}

#[test]
fn leaving_manual_brakes_and_the_next_feed_starts_there() {
    let mut rig = jogging();
    rig.run(200);
    rig.inputs.manual = false;
    rig.tick();
    assert!(rig.last.moving && !rig.traverse.status().ready_to_start);
    rig.run(60);
    assert!(!rig.last.moving && rig.traverse.status().ready_to_start && rig.traverse.status().in_target);
    let rest = rig.film;
    assert_eq!(rig.feed(), 1500);
    assert_eq!(rig.film, rest + 3_074_216);
}

/// 9300 facts 4.3: jog "while the program stands".
#[test]
fn manual_does_not_touch_a_running_program() {
    let mut rig = Rig::new();
    rig.start();
    rig.run(100);
    (rig.inputs.manual, rig.inputs.manual_neg) = (true, true);
    assert_eq!(rig.until_ended(), 1400);
    assert_eq!(rig.film, 3_074_216);
    // Ended: now it jogs.
    rig.run(100);
    assert!(rig.last.velocity < 0.0);
}

#[test]
fn speed_and_ramp_follow_their_parameters_and_codes() {
    let jog = JogParameters {
        velocity_percent_e4: 50_0000,
        acceleration_percent_e4: 10_0000,
    };
    let mut rig = Rig::with_parameters(TraverseParameters {
        jog,
        ..TraverseParameters::default()
    });
    rig.set(C1240, 0, 600_0000);
    (rig.inputs.manual, rig.inputs.manual_pos) = (true, true);
    // 300 mm/s at 240 mm/s²: 1.25 s.
    rig.run(1250);
    assert!(rig.last.velocity < 768.554);
    rig.run(2);
    assert!((rig.last.velocity - 768.554).abs() < 0.001, "{}", rig.last.velocity);
}
