//! A two-sided judge of an interpolator's trace: the limits are kept, and nothing is needlessly slow.

use thiserror::Error;

/// The set-value at one moment; moments are 1 ms apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position set-value in whole increments (the floor of the true one), counted from where the way begins.
    pub position: i64,
    /// Speed feed-forward, inc/ms.
    pub velocity: f64,
}

/// What the way was ordered with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// Way to the target, increments, positive.
    pub way: i64,
    /// Greatest speed, inc/ms.
    pub v_max: f64,
    /// Greatest acceleration and deceleration, inc/ms².
    pub a_max: f64,
    /// The least time in which the way can be done, ms.
    pub optimum_ms: f64,
}

/// How a trace breaks its order. Times in ms from its begin.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Verdict {
    /// It does not begin at rest at 0.
    #[error("it begins at {0:?}")]
    Begin(Point),
    /// A speed above the limit, or against the way.
    #[error("speed {got} at {at} ms, allowed 0…{limit}")]
    Velocity {
        /// When.
        at: usize,
        /// The speed.
        got: f64,
        /// The limit.
        limit: f64,
    },
    /// A change of speed above the limit.
    #[error("speed changes by {got} in the millisecond before {at} ms, allowed {limit}")]
    Acceleration {
        /// When.
        at: usize,
        /// The change.
        got: f64,
        /// The limit.
        limit: f64,
    },
    /// Position and speed do not belong together.
    #[error("position moves by {got} in the millisecond before {at} ms, its speed says {expected}")]
    Inconsistent {
        /// When.
        at: usize,
        /// The way.
        got: i64,
        /// The mean of both speeds.
        expected: f64,
    },
    /// It never comes to rest at the target.
    #[error("it never rests at {way}")]
    NeverArrives {
        /// The target.
        way: i64,
    },
    /// It leaves the target again.
    #[error("it leaves the target at {at} ms")]
    Leaves {
        /// When.
        at: usize,
    },
    /// It arrives sooner than the limits allow, or later than a millisecond after the optimum.
    #[error("it takes {got} ms, the optimum is {optimum} ms")]
    Duration {
        /// The time it takes.
        got: usize,
        /// The least possible.
        optimum: f64,
    },
}

/// Judges a trace.
///
/// # Errors
/// The first rule it breaks.
pub fn judge(trace: &[Point], order: &Order) -> Result<(), Verdict> {
    // Rounding of the set-value's closed form: a millionth of an increment per millisecond is far below one bit of it.
    const EPSILON: f64 = 1e-6;
    match trace.first() {
        Some(first) if first.position == 0 && first.velocity == 0.0 => {}
        first => {
            return Err(Verdict::Begin(first.copied().unwrap_or(Point {
                position: 0,
                velocity: f64::NAN,
            })));
        }
    }
    for (at, point) in trace.iter().enumerate() {
        if !(-EPSILON..=order.v_max + EPSILON).contains(&point.velocity) {
            return Err(Verdict::Velocity {
                at,
                got: point.velocity,
                limit: order.v_max,
            });
        }
    }
    for (before, pair) in trace.windows(2).enumerate() {
        let [from, to] = pair else { continue };
        let at = before + 1;
        let change = (to.velocity - from.velocity).abs();
        if change > order.a_max + EPSILON {
            return Err(Verdict::Acceleration {
                at,
                got: change,
                limit: order.a_max,
            });
        }
        // Between the two moments the speed may leave their mean line by a triangle: at most a·(1 ms)²/4. One increment
        // each for the floor of both positions.
        let expected = f64::midpoint(from.velocity, to.velocity);
        let got = to.position - from.position;
        if (got as f64 - expected).abs() > order.a_max / 4.0 + 1.0 + EPSILON {
            return Err(Verdict::Inconsistent { at, got, expected });
        }
    }
    let rests = |point: &Point| point.position == order.way && point.velocity == 0.0;
    let Some(duration) = trace.iter().position(rests) else {
        return Err(Verdict::NeverArrives { way: order.way });
    };
    if let Some(left) = trace.iter().skip(duration).position(|point| !rests(point)) {
        return Err(Verdict::Leaves { at: duration + left });
    }
    // A microsecond for the rounding of the end (it is a quotient of floats).
    let got = duration as f64;
    if got < order.optimum_ms - 1e-3 || got > order.optimum_ms + 1.0 {
        return Err(Verdict::Duration {
            got: duration,
            optimum: order.optimum_ms,
        });
    }
    Ok(())
}

/// Least time from rest to rest over `way`, ms: trapezoid w/v + v/a, or triangle 2·√(w/a).
pub fn rest_to_rest_ms(way: f64, v_max: f64, a_max: f64) -> f64 {
    if way * a_max >= v_max * v_max {
        way / v_max + v_max / a_max
    } else {
        2.0 * (way / a_max).sqrt()
    }
}

/// Least time from rest over `way`, crossing its end with `v_end` ≤ `v_max`, ms.
pub fn rest_to_speed_ms(way: f64, v_max: f64, v_end: f64, a_max: f64) -> f64 {
    // Peak without limit: p² − v_e²/2 = a·w.
    let peak = (a_max * way + v_end * v_end / 2.0).sqrt().min(v_max);
    let travelled = (peak * peak + peak * peak - v_end * v_end) / (2.0 * a_max);
    (peak + peak - v_end) / a_max + (way - travelled) / peak
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDER: Order = Order {
        way: 3_074_216,
        v_max: 3074.216,
        a_max: 6.148_432,
        optimum_ms: 1500.0,
    };

    /// A perfect trapezoid: 0.5 s up, 0.5 s at v_max, 0.5 s down, dilated in time by `stretch`.
    fn trapezoid(stretch: f64) -> Vec<Point> {
        let (v, a) = (ORDER.v_max, ORDER.a_max);
        let total = 1500.0;
        (0..=((total * stretch).ceil() as usize + 3))
            .map(|k| {
                let t = (k as f64 / stretch).min(total);
                let (position, velocity) = if t < 500.0 {
                    (a * t * t / 2.0, a * t)
                } else if t < 1000.0 {
                    (v * (t - 250.0), v)
                } else {
                    let left = total - t;
                    (ORDER.way as f64 - a * left * left / 2.0, a * left)
                };
                Point {
                    position: (position + 1e-7).floor() as i64,
                    velocity: velocity / stretch,
                }
            })
            .collect()
    }

    #[test]
    fn the_perfect_trapezoid_is_accepted() {
        assert_eq!(judge(&trapezoid(1.0), &ORDER), Ok(()));
    }

    #[test]
    fn a_trace_a_few_milliseconds_slower_is_rejected() {
        assert!(matches!(
            judge(&trapezoid(1.002), &ORDER),
            Err(Verdict::Duration { got: 1503, .. })
        ));
    }

    #[test]
    fn a_trace_that_is_too_fast_is_rejected() {
        assert!(matches!(
            judge(&trapezoid(0.999), &ORDER),
            Err(Verdict::Velocity { .. })
        ));
        let wide = Order {
            v_max: 2.0 * ORDER.v_max,
            ..ORDER
        };
        assert!(matches!(
            judge(&trapezoid(0.999), &wide),
            Err(Verdict::Acceleration { .. })
        ));
    }

    #[test]
    fn a_jump_of_the_position_is_rejected() {
        let mut trace = trapezoid(1.0);
        for point in trace.iter_mut().skip(700) {
            point.position += 5;
        }
        assert!(matches!(
            judge(&trace, &ORDER),
            Err(Verdict::Inconsistent { at: 700, .. })
        ));
    }

    #[test]
    fn a_trace_that_stops_short_or_comes_back_is_rejected() {
        let trace = trapezoid(1.0);
        assert_eq!(
            judge(&trace[..1500], &ORDER),
            Err(Verdict::NeverArrives { way: ORDER.way })
        );
        let mut back = trace.clone();
        back.push(Point {
            position: ORDER.way - 1,
            velocity: 0.0,
        });
        assert!(matches!(judge(&back, &ORDER), Err(Verdict::Leaves { .. })));
    }

    #[test]
    fn the_closed_forms_agree_with_the_check_values() {
        // Fact sheet, section 11: 0.5 + 0.5 + 0.5 s.
        assert!((rest_to_rest_ms(1200.0, 1.2, 0.0024) - 1500.0).abs() < 1e-9);
        // Crossing at rest is stopping.
        assert!((rest_to_speed_ms(1200.0, 1.2, 0.0, 0.0024) - 1500.0).abs() < 1e-9);
        // 1100 mm, crossed with 240 mm/s: up 0.5 s and 300 mm, down 0.4 s and 288 mm, 512 mm between.
        assert!((rest_to_speed_ms(1100.0, 1.2, 0.24, 0.0024) - (900.0 + 512.0 / 1.2)).abs() < 1e-9);
    }
}
