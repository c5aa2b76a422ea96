//! The interpolator's trace inside the whole chain, judged from both sides: limits kept, no millisecond wasted.

use film_feed::machine::{FilmConfig, MarkConfig};
use film_feed::rig::{Rig, RigConfig, TickView};
use lenze9300_model::traverse::TraverseEvent;
use system_tests::interpolator_oracle::{Order, Point, Verdict, judge, rest_to_rest_ms, rest_to_speed_ms};
use system_tests::{INC_PER_MM, SECOND, ready, run_for};

/// The values of a feed, in the block's units.
#[derive(Debug, Clone, Copy)]
struct Feed {
    length_tenth_mm: i16,
    speed: i16,
    mark_speed: i16,
    accel: i16,
    read_mark: bool,
}

impl Feed {
    /// v_max is 1200 mm/s, a_max 2400 mm/s² (film-feed specification, section 5); inc/ms and inc/ms².
    fn v(percent_hundredths: i16) -> f64 {
        1200.0 * f64::from(percent_hundredths) / 10_000.0 * INC_PER_MM / 1_000.0
    }

    fn a(self) -> f64 {
        2400.0 * f64::from(self.accel) / 10_000.0 * INC_PER_MM / 1_000_000.0
    }

    fn length_mm(self) -> f64 {
        f64::from(self.length_tenth_mm) / 10.0
    }
}

/// What one feed left behind.
struct Trace {
    points: Vec<Point>,
    /// Target after the mark, increments from the reference.
    latched: Option<i64>,
}

/// The set-values of one feed, from its start to a quarter of a second after its end.
fn trace(config: &RigConfig, feed: Feed) -> Trace {
    let mut rig = ready(config);
    let inputs = rig.inputs_mut();
    inputs.distance = feed.length_tenth_mm;
    inputs.velocity = feed.speed;
    inputs.mark_velocity = feed.mark_speed;
    inputs.acceleration = feed.accel;
    inputs.read_mark = feed.read_mark;
    run_for(&mut rig, 2 * SECOND);
    while rig.drive_mut().poll_traverse_event().is_some() {}

    rig.inputs_mut().pos_start = true;
    let (mut started, mut ended, mut latched) = (false, false, None);
    let mut points = Vec::new();
    let mut watch = |view: &mut TickView<'_>| {
        while let Some(event) = view.drive.poll_traverse_event() {
            match event {
                TraverseEvent::ProgramStarted => started = true,
                TraverseEvent::ProgramEnded => ended = true,
                TraverseEvent::MarkLatched { target, .. } => latched = Some(target),
                _ => {}
            }
        }
        if started && view.ends_millisecond {
            let setpoint = view.drive.setpoint();
            points.push(Point {
                position: setpoint.position,
                velocity: setpoint.velocity,
            });
        }
        ended
    };
    let mut over = |rig: &mut Rig| {
        let mut ended = false;
        rig.cycle(&mut |view: &mut TickView<'_>| ended = watch(view));
        ended
    };
    while !over(&mut rig) {}
    for _ in 0..50 {
        over(&mut rig);
    }
    Trace { points, latched }
}

#[test]
fn feeds_by_length_keep_their_limits_and_waste_no_millisecond() {
    for length_tenth_mm in [2_000, 5_555, 12_000, 20_000] {
        for (speed, accel) in [
            (1_000, 1_000),
            (1_000, 10_000),
            (3_333, 5_000),
            (8_537, 9_999),
            (10_000, 1_000),
            (10_000, 10_000),
        ] {
            let feed = Feed {
                length_tenth_mm,
                speed,
                mark_speed: 1_000,
                accel,
                read_mark: false,
            };
            let found = trace(&RigConfig::default(), feed);
            // The drive keeps whole increments (fact sheet, section 4.6).
            let way = (feed.length_mm() * INC_PER_MM).floor();
            let order = Order {
                way: way as i64,
                v_max: Feed::v(speed),
                a_max: feed.a(),
                optimum_ms: rest_to_rest_ms(way, Feed::v(speed), feed.a()),
            };
            assert_eq!(judge(&found.points, &order), Ok(()), "{feed:?}");
        }
    }
}

#[test]
fn feeds_to_the_mark_keep_their_limits_and_waste_no_millisecond() {
    for (mark_speed, accel, ahead_mm) in [
        (2_000, 10_000, 1_150.0),
        (1_000, 10_000, 1_100.5),
        (4_000, 10_000, 1_199.0),
        (2_000, 5_000, 1_150.0),
    ] {
        let feed = Feed {
            length_tenth_mm: 12_000,
            speed: 10_000,
            mark_speed,
            accel,
            read_mark: true,
        };
        let config = RigConfig {
            film: FilmConfig {
                marks: MarkConfig {
                    repeat_mm: ahead_mm + 50.0,
                    tolerance_mm: 0.0,
                    ..MarkConfig::default()
                },
                ..FilmConfig::default()
            },
            ..RigConfig::default()
        };
        let found = trace(&config, feed);
        let way = found.latched.expect("a mark was found");
        // The latch stands on the true mark: mark + 50 mm, both cut to whole increments, seen through the film's constant
        // π·57 mm instead of C1204 (1.0e-7, 0.3 inc) and the standstill before, 26 inc at the most (±0.01 mm).
        assert!((way as f64 - (ahead_mm + 50.0) * INC_PER_MM).abs() < 30.0, "{way}");
        let (v, v_mark, a) = (Feed::v(feed.speed), Feed::v(mark_speed), feed.a());
        let travel = ((feed.length_mm() - 100.0) * INC_PER_MM).floor();
        // Record 03 from rest, crossed with the mark-reading speed; then that speed up to the braking point.
        let searching = (way as f64 - travel - v_mark * v_mark / (2.0 * a)) / v_mark + v_mark / a;
        let order = Order {
            way,
            v_max: v,
            a_max: a,
            optimum_ms: rest_to_speed_ms(travel, v, v_mark, a) + searching,
        };
        assert_eq!(judge(&found.points, &order), Ok(()), "{feed:?}");
        // Behind the change-over nothing is faster than the mark-reading speed.
        let search: Vec<&Point> = found
            .points
            .iter()
            .filter(|point| point.position as f64 > travel)
            .collect();
        assert!(search.iter().all(|point| point.velocity <= v_mark + 1e-6), "{feed:?}");
    }
}

#[test]
fn a_feed_slower_than_ordered_would_be_found_out() {
    // The judge has teeth: the trace of a feed at 99 % does not pass for one at 100 %, nor the other way round.
    let feed = |speed| Feed {
        length_tenth_mm: 12_000,
        speed,
        mark_speed: 1_000,
        accel: 10_000,
        read_mark: false,
    };
    let way = (1200.0 * INC_PER_MM).floor();
    let order = |speed| Order {
        way: way as i64,
        v_max: Feed::v(speed),
        a_max: feed(speed).a(),
        optimum_ms: rest_to_rest_ms(way, Feed::v(speed), feed(speed).a()),
    };
    let slow = trace(&RigConfig::default(), feed(9_900));
    assert!(matches!(
        judge(&slow.points, &order(10_000)),
        Err(Verdict::Duration { .. })
    ));
    let fast = trace(&RigConfig::default(), feed(10_000));
    assert!(matches!(
        judge(&fast.points, &order(9_900)),
        Err(Verdict::Velocity { .. })
    ));
}
