use crate::units::{INC_PER_RAD, Increments};

/// Exact angle of the motor shaft since power-up: whole increments and a fraction in `0.0..1.0`.
///
/// Endless feeds in one direction neither drift nor lose resolution: the integer carries the way (7.7e9 years at
/// 3000 rpm), the fraction keeps its 52 bits.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct ShaftAngle {
    pub(crate) increments: i64,
    pub(crate) fraction: f64,
}

impl ShaftAngle {
    /// The angle `base + offset`, normalised. The offset is expected below 2^52 increments.
    #[inline]
    #[must_use]
    pub fn new(base: i64, offset_inc: f64) -> Self {
        // Floor without a library call: truncate, then step down for negative fractions.
        let truncated = offset_inc as i64;
        let floor = truncated - i64::from(truncated as f64 > offset_inc);
        let fraction = offset_inc - floor as f64;
        // A tiny negative offset rounds to a fraction of exactly 1.
        if fraction < 1.0 {
            Self {
                increments: base.wrapping_add(floor),
                fraction,
            }
        } else {
            Self {
                increments: base.wrapping_add(floor).wrapping_add(1),
                fraction: 0.0,
            }
        }
    }

    /// Whole increments, rounded down.
    #[must_use]
    pub fn increments(self) -> i64 {
        self.increments
    }

    /// Rest above the whole increments, `0.0..1.0`.
    #[must_use]
    pub fn fraction(self) -> f64 {
        self.fraction
    }

    /// Increments from `origin` to this angle.
    #[must_use]
    pub fn offset_from(self, origin: Self) -> f64 {
        self.increments.wrapping_sub(origin.increments) as f64 + (self.fraction - origin.fraction)
    }

    /// Angle further on by so many radians.
    #[inline]
    #[must_use]
    pub(crate) fn advanced_by_radians(self, delta_rad: f64) -> Self {
        Self::new(self.increments, self.fraction + delta_rad * INC_PER_RAD)
    }
}

impl From<Increments> for ShaftAngle {
    fn from(position: Increments) -> Self {
        Self {
            increments: position.0,
            fraction: 0.0,
        }
    }
}

/// Motion of the shaft during one tick, to locate edges inside it.
///
/// Between start and end lies the cubic Hermite polynomial of both angles and both speeds; with the time constants
/// of this axis it differs from the integrated motion by less than 1e-6 increments. Where a stop inside the tick
/// would make the polynomial overshoot, the slopes are limited, so that it is monotone whenever the shaft was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftSegment {
    /// Angle at the start of the tick.
    pub start: ShaftAngle,
    /// Angle at the end of the tick.
    pub end: ShaftAngle,
    /// Speed at the start of the tick, rad/s.
    pub omega_start: f64,
    /// Speed at the end of the tick, rad/s.
    pub omega_end: f64,
    /// Length of the tick, s.
    pub dt_s: f64,
}

impl ShaftSegment {
    /// Way of the tick in increments.
    #[must_use]
    pub fn travel(&self) -> f64 {
        self.end.offset_from(self.start)
    }

    /// Angle at a share of the tick, `0.0..=1.0`; shares outside are limited to it.
    #[must_use]
    pub fn angle_at(&self, share: f64) -> ShaftAngle {
        if share >= 1.0 {
            return self.end;
        }
        let offset = self.cubic().value(share.max(0.0));
        ShaftAngle::new(self.start.increments, self.start.fraction + offset)
    }

    /// Share of the tick, above 0 and up to 1, at which the shaft first reaches `target`; `None` if it does not.
    ///
    /// An angle at which the tick only starts belongs to the tick before: of consecutive segments exactly one reports
    /// a crossing. Newton's method inside a bracket, at most 64 rounds, exact to 1e-12 of a tick.
    #[must_use]
    pub fn crossing(&self, target: ShaftAngle) -> Option<f64> {
        let goal = target.offset_from(self.start);
        let travel = self.travel();
        let cubic = self.cubic();
        let (mut from, mut value) = (0.0, 0.0);
        for to in cubic.turning_points() {
            let next = if to >= 1.0 { travel } else { cubic.value(to) };
            let passed = (value < goal && goal <= next) || (value > goal && goal >= next);
            if passed {
                return Some(cubic.solve(goal, from, to));
            }
            (from, value) = (to, next);
        }
        None
    }

    fn cubic(&self) -> Cubic {
        let travel = self.travel();
        let slope = |omega: f64| {
            let slope = omega * self.dt_s * INC_PER_RAD;
            if slope * travel > 0.0 {
                // Slopes up to three times the secant keep a cubic monotone (Fritsch and Carlson).
                slope.clamp(-3.0 * travel.abs(), 3.0 * travel.abs())
            } else {
                slope
            }
        };
        let (m0, m1) = (slope(self.omega_start), slope(self.omega_end));
        Cubic {
            c1: m0,
            c2: 3.0 * travel - 2.0 * m0 - m1,
            c3: m0 + m1 - 2.0 * travel,
        }
    }
}

/// `c1 u + c2 u² + c3 u³`, increments from the start of the tick.
#[derive(Debug, Clone, Copy)]
struct Cubic {
    c1: f64,
    c2: f64,
    c3: f64,
}

impl Cubic {
    fn value(self, u: f64) -> f64 {
        ((self.c3 * u + self.c2) * u + self.c1) * u
    }

    fn slope(self, u: f64) -> f64 {
        (3.0 * self.c3 * u + 2.0 * self.c2) * u + self.c1
    }

    /// Ends of the monotone pieces of 0…1 in order; 1 comes last and may come more than once.
    fn turning_points(self) -> [f64; 3] {
        let inside = |u: f64| if u > 0.0 && u < 1.0 { u } else { 1.0 };
        let quarter_discriminant = self.c2 * self.c2 - 3.0 * self.c3 * self.c1;
        if quarter_discriminant <= 0.0 {
            return [1.0; 3];
        }
        // The form without cancellation; a division by zero gives an infinity, which lies outside.
        let root = quarter_discriminant.sqrt();
        let sum = -(self.c2 + if self.c2 >= 0.0 { root } else { -root });
        let (a, b) = (inside(sum / (3.0 * self.c3)), inside(self.c1 / sum));
        [a.min(b), a.max(b), 1.0]
    }

    fn solve(self, goal: f64, from: f64, to: f64) -> f64 {
        let rising = self.value(to) > self.value(from);
        let (mut low, mut high) = (from, to);
        let mut u = 0.5 * (low + high);
        for _ in 0..64 {
            let error = self.value(u) - goal;
            if (error >= 0.0) == rising {
                high = u;
            } else {
                low = u;
            }
            if high - low <= 1e-13 {
                break;
            }
            let newton = u - error / self.slope(u);
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            if (next - u).abs() <= 1e-14 {
                return next;
            }
            u = next;
        }
        u
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(start: (i64, f64), end: (i64, f64), omega_start_inc_s: f64, omega_end_inc_s: f64) -> ShaftSegment {
        ShaftSegment {
            start: ShaftAngle::new(start.0, start.1),
            end: ShaftAngle::new(end.0, end.1),
            omega_start: omega_start_inc_s / INC_PER_RAD,
            omega_end: omega_end_inc_s / INC_PER_RAD,
            dt_s: 125e-6,
        }
    }

    #[test]
    fn an_angle_is_normalised_downwards() {
        let angle = ShaftAngle::new(10, -2.25);
        assert_eq!((angle.increments(), angle.fraction()), (7, 0.75));
        let angle = ShaftAngle::new(0, -1e-30);
        assert_eq!((angle.increments(), angle.fraction()), (0, 0.0));
        let angle = ShaftAngle::new(-5, 3.0);
        assert_eq!((angle.increments(), angle.fraction()), (-2, 0.0));
    }

    #[test]
    fn a_crossing_at_constant_speed_lies_at_its_share_of_the_way() {
        // 400 increments a tick from 1000.25: 1100.5 lies at 100.25/400.
        let s = segment((1000, 0.25), (1400, 0.25), 3.2e6, 3.2e6);
        let share = s.crossing(ShaftAngle::new(1100, 0.5)).unwrap();
        assert!((share - 100.25 / 400.0).abs() < 1e-12, "{share}");
    }

    #[test]
    fn a_crossing_under_acceleration_solves_the_parabola() {
        // s = v t + a t²/2 with v = 800 000 inc/s and a = 6.149e6 inc/s² (2400 mm/s²) over 125 µs.
        let (v, a, t) = (800_000.0, 6.149e6, 125e-6);
        let way = v * t + 0.5 * a * t * t;
        let s = segment((0, 0.0), (0, way), v, v + a * t);
        for goal in [1.0, 17.5, 50.0, 99.0] {
            let share = s.crossing(ShaftAngle::new(0, goal)).unwrap();
            let expected = ((v * v + 2.0 * a * goal).sqrt() - v) / (a * t);
            assert!((share - expected).abs() < 1e-6, "{share} {expected}");
        }
    }

    #[test]
    fn of_two_consecutive_segments_only_one_reports_the_common_angle() {
        let first = segment((0, 0.0), (100, 0.0), 8e5, 8e5);
        let second = segment((100, 0.0), (200, 0.0), 8e5, 8e5);
        let target = ShaftAngle::from(Increments(100));
        assert!(first.crossing(target).is_some_and(|share| (share - 1.0).abs() < 1e-12));
        assert_eq!(second.crossing(target), None);
    }

    #[test]
    fn a_reversal_inside_the_tick_is_found_on_the_way_out() {
        // Parabola through 0 at both ends with its top of v·T/4 = 25 increments at the middle.
        let v = 8e5;
        let s = segment((0, 0.0), (0, 0.0), v, -v);
        let share = s.crossing(ShaftAngle::new(0, 18.75)).unwrap();
        assert!((share - 0.25).abs() < 1e-9, "{share}");
        assert_eq!(s.crossing(ShaftAngle::new(0, 25.5)), None);
    }

    #[test]
    fn a_backward_motion_crosses_downwards() {
        let s = segment((50, 0.0), (-50, 0.0), -8e5, -8e5);
        let share = s.crossing(ShaftAngle::from(Increments(0))).unwrap();
        assert!((share - 0.5).abs() < 1e-12);
        assert_eq!(s.crossing(ShaftAngle::from(Increments(51))), None);
    }

    #[test]
    fn a_stop_inside_the_tick_never_overshoots() {
        // Stops after 20 % of the tick: the raw polynomial would run past the end and come back.
        let v = 8e4;
        let s = segment((0, 0.0), (0, 0.1 * v * 125e-6), v, 0.0);
        let end = s.travel();
        let mut last = 0.0;
        for n in 0..=100 {
            let at = s.angle_at(f64::from(n) / 100.0).offset_from(s.start);
            assert!(at >= last && at <= end + 1e-12, "{n}: {at}");
            last = at;
        }
    }

    #[test]
    fn a_shaft_at_rest_crosses_nothing() {
        let s = segment((7, 0.0), (7, 0.0), 0.0, 0.0);
        assert_eq!(s.crossing(ShaftAngle::new(7, 0.0)), None);
        assert_eq!(s.angle_at(0.3), s.start);
    }
}
