//! Feeds with print marks: records 03 and 04.

mod traverse_rig;

use lenze9300_model::code::table::number::*;
use lenze9300_model::traverse::*;
use traverse_rig::{PER_MM, Rig, number, reference_first};

fn printed() -> Rig {
    let mut rig = Rig::new();
    rig.inputs.program_inputs = 1;
    rig
}

/// Film-feed specification, section 6: the mark lies 1100 to 1200 mm ahead; the film stops 50 mm behind it.
#[test]
fn a_mark_anywhere_in_its_tolerance_is_found_and_left_50_mm_behind() {
    for ahead in [1100.0, 1100.5, 1125.0, 1150.0, 1175.0, 1200.0] {
        let mut rig = printed();
        rig.mark_ahead(ahead);
        let mark = rig.marks[0];
        rig.feed();
        assert_eq!(rig.film, mark + 128_092, "mark at {ahead} mm");
        let status = rig.traverse.status();
        assert!(status.ended && status.in_target && !status.no_mark_found);
        assert!(!rig.reversed());
        let target = mark + 128_092;
        assert!(rig.saw(TraverseEvent::MarkLatched { position: mark, target }));
    }
}

/// 9300 facts 4.2: no standstill between the records; position and speed go on.
#[test]
fn the_change_from_travel_to_search_is_on_the_fly() {
    let mut rig = printed();
    rig.mark_ahead(1150.0);
    rig.start();
    let mut before = rig.last;
    while rig.traverse.status().record != 4 {
        before = rig.last;
        rig.tick();
    }
    let after = rig.last;
    // 240 mm/s = 614.843 inc/ms. The tick before was still braking by at most 6.15 inc/ms.
    assert!((after.velocity - 614.843).abs() < 1e-3, "{}", after.velocity);
    assert!(before.velocity >= after.velocity - 1e-9 && before.velocity <= after.velocity + 6.149);
    let way = (after.position - before.position) as f64;
    let mean = 0.5 * (before.velocity + after.velocity);
    assert!((way - mean).abs() < 2.0, "{way} against {mean}");
    let next = rig.tick();
    assert!(((next.position - after.position) as f64 - 614.843).abs() <= 1.0);
    // VTPOS 061 + VTPOS 062 in whole increments (9300 facts 4.1: 2 818 032).
    assert_eq!(rig.traverse.status().target, 2_818_032 + 3_330_400);
}

/// The crossing lies inside a tick; the record after it starts at that moment, not at the tick.
#[test]
fn the_whole_motion_takes_its_exact_time() {
    for velocity in [30_0000, 47_1100, 100_0000] {
        let mut rig = printed();
        rig.set(C1302, 1, velocity);
        let ticks = rig.feed() as f64;
        // Travel 2 818 032 inc from rest to 20 %, then 3 330 400 inc from 20 % to rest, at 100 % acceleration.
        let (a, u) = (6.148_432_9, 614.843_291);
        let v = 3_074.216_455 * f64::from(velocity) / 100e4;
        let travel = v / a + (v - u) / a + (2_818_032.0 - v * v / a + 0.5 * u * u / a) / v;
        let search = u / a + (3_330_400.0 - 0.5 * u * u / a) / u;
        let exact = travel + search;
        assert!(ticks >= exact - 0.01 && ticks < exact + 1.0, "{ticks} against {exact}");
    }
}

/// Film-feed specification, section 6: with a missed mark the record runs on to the next one.
#[test]
fn after_a_missed_mark_the_search_runs_on_to_the_next() {
    let mut rig = printed();
    // A new roll: the first mark lies in the travel record, which does not look.
    rig.mark_ahead(900.0);
    rig.mark_ahead(2050.0);
    let mark = rig.marks[1];
    rig.feed();
    assert_eq!(rig.film, mark + 128_092);
    assert!(!rig.traverse.status().no_mark_found);
}

/// Film-feed specification, section 6: a reportable outcome, not a silent success.
#[test]
fn no_mark_at_all_is_reported_at_the_end_of_the_search() {
    let mut rig = printed();
    rig.feed();
    let status = rig.traverse.status();
    assert!(status.no_mark_found && status.ended);
    assert!(rig.saw(TraverseEvent::NoMarkFound { record: number(4) }));
    // 1100 + 100 + 1200 mm.
    assert!((rig.film_mm() - 2400.0).abs() < 0.001);
    rig.inputs.start = false;
    rig.run(2);
    rig.mark_ahead(1150.0);
    rig.start();
    assert!(!rig.traverse.status().no_mark_found, "the next start clears it");
}

#[test]
fn the_end_without_a_mark_goes_on_where_field_11_says() {
    let rule = TouchRule {
        window: TouchWindow::TravelRange,
        residual: ResidualPath::None,
    };
    let search = Record {
        without_touch: Successor::Record(number(2)),
        ..Record::new(Mode::RelativeWithTouchProbe(rule), Target::Variable(1))
    };
    let back = Record::new(Mode::Absolute, Target::Zero);
    let mut rig = Rig::new();
    rig.traverse = Traverse::new(Program::new([reference_first(), (1, search), (2, back)]).unwrap());
    rig.set(C1211, 0, 32_0000);
    rig.tick();
    rig.feed();
    assert!(rig.saw(TraverseEvent::RecordStarted(number(2))));
    assert_eq!(rig.film, 0);
    assert!(rig.traverse.status().no_mark_found);
}

/// 9300 facts 4.2: √(2·a·50 mm) = 489.9 mm/s at 2400 mm/s²; 28.9 % at half the acceleration. The edge is acted upon in
/// the next tick, so the last half per cent below the limit can turn round as well.
#[test]
fn the_film_runs_backwards_above_the_limiting_speed_and_never_below() {
    for (acceleration, limit_mm_s) in [(100_0000, 489.9), (50_0000, 346.4)] {
        for step in 1..=100 {
            let speed = f64::from(step) * 12.0;
            if (speed / limit_mm_s - 1.0).abs() < 0.006 {
                continue;
            }
            let mut rig = printed();
            rig.set(C1303, 1, acceleration);
            rig.set(C1302, 2, step * 1_0000);
            rig.mark_ahead(1150.0);
            let mark = rig.marks[0];
            rig.start();
            let mut backwards = false;
            while rig.traverse.status().running {
                let before = rig.film;
                rig.tick();
                backwards |= rig.film < before;
            }
            assert_eq!(backwards, speed > limit_mm_s, "{speed} mm/s at {acceleration}");
            assert_eq!(rig.reversed(), backwards, "{speed} mm/s at {acceleration}");
            assert_eq!(rig.film, mark + 128_092);
        }
    }
}

/// The touch is acted upon one tick after it: v²/2a + v · 1 ms = 50 mm gives 487.5 mm/s (40.626 %) instead of 489.9.
#[test]
fn acting_a_millisecond_late_lowers_the_limit_of_the_reversal_a_little() {
    for (percent, backwards) in [(40_6200, false), (40_6300, true)] {
        let mut rig = printed();
        rig.set(C1302, 2, percent);
        rig.start();
        while rig.traverse.status().record != 4 {
            rig.tick();
        }
        rig.run(20);
        rig.inputs.touch = Some(TouchEvent {
            position: rig.last.position,
        });
        rig.tick();
        assert_eq!(rig.reversed(), backwards, "{percent}");
    }
}

/// 9300 facts 4.2: with rest 0 the drive overshoots by the braking distance and comes back.
#[test]
fn without_a_residual_path_the_axis_comes_back_to_the_mark() {
    let rule = TouchRule {
        window: TouchWindow::TravelRange,
        residual: ResidualPath::None,
    };
    let search = Record {
        velocity: Velocity::Variable(2),
        ..Record::new(Mode::RelativeWithTouchProbe(rule), Target::Variable(1))
    };
    let mut rig = Rig::new();
    rig.traverse = Traverse::new(Program::new([(1, search)]).unwrap());
    rig.tick();
    rig.mark_ahead(500.0);
    let mark = rig.marks[0];
    rig.start();
    let mut farthest = 0;
    while rig.traverse.status().running {
        rig.tick();
        farthest = farthest.max(rig.film);
    }
    // 240 mm/s: 12 mm (9300 facts 11), and up to 1 ms of travel until the edge is seen.
    let overshoot = (farthest - mark) as f64 / PER_MM;
    assert!((12.0..12.5).contains(&overshoot), "{overshoot}");
    assert_eq!(rig.film, mark);
    assert!(rig.reversed());
}

/// 9300 facts 4.2: minus |rest| when travelling negative; only the magnitude counts.
#[test]
fn travelling_backwards_the_rest_counts_backwards_whatever_its_sign() {
    for rest in [50_0000, -50_0000] {
        let rule = TouchRule {
            window: TouchWindow::TravelRange,
            residual: ResidualPath::Fixed(rest),
        };
        let search = Record {
            velocity: Velocity::Variable(2),
            ..Record::new(Mode::RelativeWithTouchProbe(rule), Target::Variable(3))
        };
        let mut rig = Rig::new();
        rig.set(C1301, 3, -1000_0000);
        rig.traverse = Traverse::new(Program::new([(1, search)]).unwrap());
        rig.tick();
        rig.start();
        rig.run(1000);
        let position = rig.last.position;
        rig.inputs.touch = Some(TouchEvent { position });
        rig.until_ended();
        assert_eq!(rig.film, position - 128_092);
    }
}

#[test]
fn touches_outside_the_window_and_after_the_first_do_not_count() {
    let rule = TouchRule {
        window: TouchWindow::Between { first: 5, second: 4 },
        residual: ResidualPath::Variable(6),
    };
    let search = Record {
        velocity: Velocity::Variable(2),
        ..Record::new(Mode::RelativeWithTouchProbe(rule), Target::Variable(1))
    };
    let mut rig = Rig::new();
    rig.set(C1301, 4, 300_0000);
    rig.set(C1301, 5, 400_0000);
    rig.set(C1301, 6, 50_0000);
    rig.traverse = Traverse::new(Program::new([(1, search)]).unwrap());
    rig.tick();
    for ahead in [100.0, 299.0, 350.0, 360.0] {
        rig.mark_ahead(ahead);
    }
    rig.feed();
    assert_eq!(rig.film, rig.marks[2] + 128_092);
}

#[test]
fn a_touch_counts_only_in_a_record_with_touch_probe() {
    let mut rig = Rig::new();
    rig.mark_ahead(600.0);
    rig.start();
    assert!(!rig.traverse.status().touch_armed);
    rig.until_ended();
    assert_eq!(rig.film, 3_074_216);
    assert!(
        !rig.events
            .iter()
            .any(|event| matches!(event, TraverseEvent::MarkLatched { .. }))
    );
}

#[test]
fn a_mark_that_passes_while_stop_brakes_still_makes_the_target() {
    let mut rig = printed();
    rig.mark_ahead(1150.0);
    let mark = rig.marks[0];
    rig.start();
    while rig.film < mark - 5000 {
        rig.tick();
    }
    assert!(rig.traverse.status().touch_armed);
    rig.inputs.stop = true;
    rig.run(200);
    rig.inputs.stop = false;
    assert!(!rig.traverse.status().touch_armed);
    rig.feed();
    assert_eq!(rig.film, mark + 128_092);
}

/// Film-feed specification, section 6: the whole feed again equals the distance between marks.
#[test]
fn feed_after_feed_equals_the_distance_between_the_marks() {
    let mut rig = printed();
    let mut mark = (1150.0 * PER_MM) as i64;
    for distance in [1200.0, 1150.0, 1250.0, 1237.3, 1162.9] {
        rig.marks.push(mark);
        rig.feed();
        assert_eq!(rig.film, mark + 128_092, "{distance}");
        mark += (distance * PER_MM) as i64;
    }
}

/// 9300 facts 4.3: up to 1 ms · v late, 0.24 mm at 240 mm/s.
#[test]
fn a_sampled_input_latches_up_to_a_millisecond_late() {
    let mut fast = TouchProbe::new(LatchMode::Fast, ActiveEdge::Rising);
    let mut slow = TouchProbe::new(LatchMode::Sampled1ms, ActiveEdge::Rising);
    for probe in [&mut fast, &mut slow] {
        assert_eq!(probe.tick_1ms(false, 0), None);
        probe.handle_edge(ActiveEdge::Falling, 50);
        probe.handle_edge(ActiveEdge::Rising, 100);
        probe.handle_edge(ActiveEdge::Rising, 200);
    }
    assert_eq!(fast.tick_1ms(true, 614), Some(TouchEvent { position: 100 }));
    assert_eq!(slow.tick_1ms(true, 614), Some(TouchEvent { position: 614 }));
    assert_eq!(fast.tick_1ms(true, 1228), None);
    assert_eq!(slow.tick_1ms(true, 1228), None);
}

#[test]
fn a_high_level_at_power_on_is_no_edge() {
    let mut slow = TouchProbe::new(LatchMode::Sampled1ms, ActiveEdge::Rising);
    assert_eq!(slow.tick_1ms(true, 5), None);
    let mut falling = TouchProbe::new(LatchMode::Sampled1ms, ActiveEdge::Falling);
    assert_eq!(falling.tick_1ms(true, 5), None);
    assert_eq!(falling.tick_1ms(false, 9), Some(TouchEvent { position: 9 }));
}
