//! The profile generator: segments of constant jerk in closed form.
//!
//! A [`Plan`] is computed once and evaluated at integer ticks since its start, so nothing is summed up and nothing
//! drifts. As delivered the acceleration jumps (trapezoid, triangle): thesis fig. 63 gives exactly 1.5 s for 1200 mm,
//! which excludes an S-ramp (9300 facts 4.2). With a limited jerk the plans are those of `s_curve`.
//!
//! Unit of time: the tick of the 1 ms task. Unit of position: increment. Accuracy: position and velocity are continuous
//! at segment borders to 1e-6 inc and 1e-9 inc/ms for distances up to 2^32 inc; the target is met exactly.

use super::s_curve;

/// Where a motion is and how fast.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathState {
    /// Whole increments (the floor of the position).
    pub position: i64,
    /// What is left of the position, 0 ≤ fraction < 1 inc.
    pub fraction: f64,
    /// Velocity in inc/ms.
    pub velocity: f64,
    /// Acceleration in inc/ms²; without limit of the jerk it does not matter.
    pub acceleration: f64,
}

impl PathState {
    /// At rest on a whole increment.
    pub const fn at_rest(position: i64) -> Self {
        Self {
            position,
            fraction: 0.0,
            velocity: 0.0,
            acceleration: 0.0,
        }
    }
}

/// A point of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Whole increments (the floor of the position): what the drive outputs.
    pub position: i64,
    /// What is left of the position, 0 ≤ fraction < 1 inc.
    pub fraction: f64,
    /// Velocity in inc/ms.
    pub velocity: f64,
    /// Acceleration in inc/ms².
    pub acceleration: f64,
}

impl Motion {
    /// The state a new plan can start from.
    pub const fn state(&self) -> PathState {
        PathState {
            position: self.position,
            fraction: self.fraction,
            velocity: self.velocity,
            acceleration: self.acceleration,
        }
    }
}

/// The limits of a plan, magnitudes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Greatest speed in inc/ms, 0 or above. At 0 the axis stands still and never arrives.
    pub v_max: f64,
    /// Acceleration (speed rises) in inc/ms², above 0.
    pub acc: f64,
    /// Deceleration (speed falls) in inc/ms², above 0.
    pub dec: f64,
    /// Jerk (change of the acceleration) in inc/ms³, above 0; infinity lets the acceleration jump.
    pub jerk: f64,
}

impl Limits {
    /// The same limits with impossible values (negative, zero acceleration, not a number) raised to the least possible.
    fn checked(self) -> Self {
        let least = |value: f64, least: f64| if value > least { value } else { least };
        Self {
            v_max: least(self.v_max, 0.0),
            acc: least(self.acc, LEAST_ACCELERATION),
            dec: least(self.dec, LEAST_ACCELERATION),
            jerk: if self.jerk.is_nan() {
                f64::INFINITY
            } else {
                least(self.jerk, LEAST_JERK)
            },
        }
    }
}

/// Shape of the ramps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Profile {
    /// The acceleration jumps. Source: 9300 facts 4.2 (thesis fig. 63).
    #[default]
    Trapezoid,
    /// The acceleration changes with a limited rate.
    ///
    /// The drive's code for it is not known (9300 facts 4.2); an option of the model.
    #[doc(alias = "S-Rampe")]
    #[doc(alias = "Ruckbegrenzung")]
    SCurve {
        /// Greatest jerk, units/s³; 0 counts as the least possible.
        jerk: u32,
    },
}

/// A motion from a state to a target, or to a velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Whole increments that positions inside the plan count from, to keep them small.
    origin: i64,
    segments: [Segment; MAX_SEGMENTS],
    used: usize,
    end: Option<f64>,
    reversal: bool,
}

/// Constant jerk, given by the state at one moment.
///
/// Braking segments are anchored at their end: they meet the target exactly, however the sums before came out.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    until: f64,
    anchor_time: f64,
    anchor_position: f64,
    anchor_velocity: f64,
    acceleration: f64,
    jerk: f64,
}

impl Plan {
    /// The fastest motion within the limits from `start` to `target`, crossed with the speed `v_end` (inc/ms, 0 or
    /// above, in the direction of travel).
    ///
    /// - A start in the wrong direction brakes and turns round; a start above `v_max` brakes down to it first.
    /// - With `v_end` = 0 a target too near to brake is passed, and the axis returns to it (9300 facts 4.2).
    /// - Interpretation: with `v_end` > 0 the target is a change-over on the fly, which never turns round. When the
    ///   way is too short for `v_end`, the target is crossed with the nearest speed that can be reached.
    pub fn to_target(start: PathState, target: i64, limits: &Limits, v_end: f64) -> Self {
        let limits = limits.checked();
        let Limits { v_max, acc, dec, jerk } = limits;
        let v_end = v_end.clamp(0.0, v_max.max(0.0));
        if jerk.is_finite() {
            return s_curve::to_target(start, target, &limits, v_end);
        }
        let mut builder = Builder::new(start);
        let target = target.saturating_sub(start.position) as f64;

        let braking = 0.5 * start.velocity * start.velocity / dec;
        let way = target - builder.position;
        let wrong_direction = way * start.velocity < 0.0;
        let too_near = v_end == 0.0 && braking > way.abs() + POSITION_TOLERANCE;
        if start.velocity != 0.0 && (wrong_direction || too_near) {
            builder.change_velocity(0.0, dec);
            // Braking down onto a target behind is a stop in place, not a return.
            builder.reversal = (target - builder.position).abs() > POSITION_TOLERANCE;
        }

        let way = target - builder.position;
        if way.abs() <= POSITION_TOLERANCE && (v_end > 0.0 || builder.velocity == 0.0) {
            let (time, velocity) = (builder.time, builder.velocity);
            return builder.finish(start.position, Some(time), target, velocity);
        }
        let direction = if way == 0.0 {
            builder.velocity.signum()
        } else {
            way.signum()
        };
        let (way, v) = (way.abs(), builder.velocity.abs());

        let v_end = if v_end > 0.0 {
            let slowest = (v * v - 2.0 * dec * way).max(0.0).sqrt();
            let fastest = (v * v + 2.0 * acc * way).sqrt();
            v_end.clamp(slowest, fastest)
        } else {
            0.0
        };
        // Where acceleration and deceleration meet, unless v_max comes first.
        let apex = ((2.0 * acc * dec * way + dec * v * v + acc * v_end * v_end) / (acc + dec)).sqrt();
        let (peak, rate) = if v > v_max {
            (v_max.max(v_end), dec)
        } else {
            (apex.min(v_max).max(v).max(v_end), acc)
        };
        if peak == 0.0 {
            // v_max is 0: come to rest where that is possible, and stay there.
            builder.change_velocity(0.0, dec);
            let (time, position) = (builder.time, builder.position);
            let arrived = (target - position).abs() <= POSITION_TOLERANCE;
            return builder.finish(start.position, arrived.then_some(time), position, 0.0);
        }
        let to_peak = (peak * peak - v * v).abs() / (2.0 * rate);
        let from_peak = (peak * peak - v_end * v_end) / (2.0 * dec);
        let cruise = (way - to_peak - from_peak).max(0.0);
        builder.change_velocity(peak * direction, rate);
        builder.cruise(cruise / peak);
        builder.change_velocity_ending_at(target, v_end * direction, dec);
        let time = builder.time;
        builder.finish(start.position, Some(time), target, v_end * direction)
    }

    /// The fastest change to `velocity` (inc/ms, signed, not limited by `v_max`), held from then on.
    pub fn to_velocity(start: PathState, velocity: f64, limits: &Limits) -> Self {
        let limits = limits.checked();
        let Limits { acc, dec, jerk, .. } = limits;
        if jerk.is_finite() {
            return s_curve::to_velocity(start, velocity, &limits);
        }
        let mut builder = Builder::new(start);
        if start.velocity * velocity < 0.0 {
            builder.change_velocity(0.0, dec);
            builder.reversal = true;
        }
        let rate = if velocity.abs() > builder.velocity.abs() {
            acc
        } else {
            dec
        };
        builder.change_velocity(velocity, rate);
        let (time, position) = (builder.time, builder.position);
        builder.finish(start.position, Some(time), position, velocity)
    }

    /// The motion `ticks + fraction` milliseconds after the start of the plan.
    ///
    /// After the end the velocity stays: zero at a target to stop at, the final velocity on the fly.
    pub fn at(&self, ticks: u64, fraction: f64) -> Motion {
        let time = ticks as f64 + fraction;
        let last = self.used - 1;
        let segment = self.segments[..last]
            .iter()
            .find(|segment| time < segment.until)
            .unwrap_or(&self.segments[last]);
        let since = time - segment.anchor_time;
        let position = segment.position_after(since);
        let whole = position.floor();
        Motion {
            position: self.origin.saturating_add(whole as i64),
            fraction: position - whole,
            velocity: segment.velocity_after(since),
            acceleration: segment.acceleration + segment.jerk * since,
        }
    }

    /// Milliseconds from the start until the target (or the velocity) is reached; `None` when it never is.
    pub fn end(&self) -> Option<f64> {
        self.end
    }

    /// Whether the motion turns round on its way.
    pub fn reverses(&self) -> bool {
        self.reversal
    }

    /// The velocity after the end in inc/ms.
    pub fn end_velocity(&self) -> f64 {
        self.segments[self.used - 1].anchor_velocity
    }

    /// Counts positions from another reference: each grows by `shift` inc.
    pub fn shift_reference(&mut self, shift: i64) {
        self.origin = self.origin.saturating_add(shift);
    }
}

/// Strings segments together.
struct Builder {
    time: f64,
    position: f64,
    velocity: f64,
    segments: [Segment; MAX_SEGMENTS],
    used: usize,
    reversal: bool,
}

impl Builder {
    fn new(start: PathState) -> Self {
        Self {
            time: 0.0,
            position: start.fraction,
            velocity: start.velocity,
            segments: [Segment::STANDSTILL; MAX_SEGMENTS],
            used: 0,
            reversal: false,
        }
    }

    fn change_velocity(&mut self, to: f64, rate: f64) {
        let duration = (to - self.velocity).abs() / rate;
        let acceleration = if to < self.velocity { -rate } else { rate };
        self.push(duration, (self.time, self.position, self.velocity), acceleration);
        self.position += 0.5 * (self.velocity + to) * duration;
        self.velocity = to;
        self.time += duration;
    }

    fn cruise(&mut self, duration: f64) {
        self.push(duration, (self.time, self.position, self.velocity), 0.0);
        self.position += self.velocity * duration;
        self.time += duration;
    }

    fn change_velocity_ending_at(&mut self, position: f64, to: f64, rate: f64) {
        let duration = (to - self.velocity).abs() / rate;
        let acceleration = if to < self.velocity { -rate } else { rate };
        self.push(duration, (self.time + duration, position, to), acceleration);
        (self.time, self.position, self.velocity) = (self.time + duration, position, to);
    }

    fn push(&mut self, duration: f64, anchor: (f64, f64, f64), acceleration: f64) {
        if duration <= 0.0 {
            return;
        }
        let (anchor_time, anchor_position, anchor_velocity) = anchor;
        // At most brake, accelerate, cruise, brake, hold: MAX_SEGMENTS.
        if let Some(place) = self.segments.get_mut(self.used) {
            let until = self.time + duration;
            *place = Segment {
                until,
                anchor_time,
                anchor_position,
                anchor_velocity,
                acceleration,
                jerk: 0.0,
            };
            self.used += 1;
        }
    }

    /// Closes with the motion that goes on for ever.
    fn finish(mut self, origin: i64, end: Option<f64>, position: f64, velocity: f64) -> Plan {
        (self.position, self.velocity) = (position, velocity);
        self.push(f64::INFINITY, (self.time, position, velocity), 0.0);
        Plan {
            origin,
            segments: self.segments,
            used: self.used,
            end,
            reversal: self.reversal,
        }
    }
}

impl Segment {
    const STANDSTILL: Self = Self {
        until: f64::INFINITY,
        anchor_time: 0.0,
        anchor_position: 0.0,
        anchor_velocity: 0.0,
        acceleration: 0.0,
        jerk: 0.0,
    };

    fn position_after(&self, since: f64) -> f64 {
        self.anchor_position
            + since * (self.anchor_velocity + since * (0.5 * self.acceleration + since * (self.jerk / 6.0)))
    }

    fn velocity_after(&self, since: f64) -> f64 {
        self.anchor_velocity + since * (self.acceleration + 0.5 * self.jerk * since)
    }
}

/// Strings segments of constant jerk together; acceleration and velocity go on from one to the next.
pub(super) struct Strip {
    origin: i64,
    time: f64,
    position: f64,
    velocity: f64,
    acceleration: f64,
    lowest: f64,
    highest: f64,
    segments: [Segment; MAX_SEGMENTS],
    used: usize,
}

impl Strip {
    pub(super) fn new(start: PathState) -> Self {
        Self {
            origin: start.position,
            time: 0.0,
            position: start.fraction,
            velocity: start.velocity,
            acceleration: start.acceleration,
            lowest: start.velocity,
            highest: start.velocity,
            segments: [Segment::STANDSTILL; MAX_SEGMENTS],
            used: 0,
        }
    }

    /// Goes on from where the strip has come to.
    pub(super) fn push(&mut self, duration: f64, jerk: f64) {
        let segment = Segment {
            until: self.time + duration,
            anchor_time: self.time,
            anchor_position: self.position,
            anchor_velocity: self.velocity,
            acceleration: self.acceleration,
            jerk,
        };
        self.take(duration, segment, 0.0);
    }

    /// Time since the start, ms.
    pub(super) fn time(&self) -> f64 {
        self.time
    }

    /// What has come to rest but for rounding rests; returns its position.
    pub(super) fn stand(&mut self) -> f64 {
        (self.velocity, self.acceleration) = (0.0, 0.0);
        self.position
    }

    /// Constant velocity, without acceleration.
    pub(super) fn cruise(&mut self, duration: f64, velocity: f64) {
        (self.velocity, self.acceleration) = (velocity, 0.0);
        self.push(duration, 0.0);
    }

    /// Goes on so that it ends with this position, velocity and acceleration.
    pub(super) fn push_ending_at(
        &mut self,
        duration: f64,
        (position, velocity, acceleration): (f64, f64, f64),
        jerk: f64,
    ) {
        let end = self.time + duration.max(0.0);
        let segment = Segment {
            until: end,
            anchor_time: end,
            anchor_position: position,
            anchor_velocity: velocity,
            acceleration,
            jerk,
        };
        self.take(duration, segment, -duration);
    }

    /// Closes at a target that is passed or rested at with this velocity.
    pub(super) fn finish_at_target(mut self, target: f64, velocity: f64) -> Plan {
        (self.position, self.velocity, self.acceleration) = (target, velocity, 0.0);
        let end = self.time;
        self.finish(Some(end))
    }

    /// Closes with a velocity that is held from now on.
    pub(super) fn finish_at_velocity(mut self, velocity: f64) -> Plan {
        (self.velocity, self.acceleration) = (velocity, 0.0);
        let end = self.time;
        self.finish(Some(end))
    }

    /// Closes with what was reached; the target was crossed at `time`.
    pub(super) fn finish_crossing(mut self, time: f64) -> Plan {
        self.acceleration = 0.0;
        self.finish(Some(time))
    }

    /// Closes at rest, short of any target.
    pub(super) fn finish_nowhere(mut self) -> Plan {
        (self.velocity, self.acceleration) = (0.0, 0.0);
        self.finish(None)
    }

    fn take(&mut self, duration: f64, segment: Segment, begin: f64) {
        if duration > 0.0 {
            if let Some(place) = self.segments.get_mut(self.used) {
                *place = segment;
                self.used += 1;
            }
            // The velocity has its extremes at the borders and where the acceleration passes zero.
            let end = begin + duration;
            let turning = -segment.acceleration / segment.jerk;
            let inside = if turning > begin && turning < end { turning } else { end };
            for since in [begin, inside, end] {
                self.lowest = self.lowest.min(segment.velocity_after(since));
                self.highest = self.highest.max(segment.velocity_after(since));
            }
            self.time += duration;
            self.position = segment.position_after(end);
            self.velocity = segment.velocity_after(end);
            self.acceleration = segment.acceleration + segment.jerk * end;
        }
    }

    fn finish(mut self, end: Option<f64>) -> Plan {
        let reversal = self.lowest < -VELOCITY_TOLERANCE && self.highest > VELOCITY_TOLERANCE;
        self.push(f64::INFINITY, 0.0);
        Plan {
            origin: self.origin,
            segments: self.segments,
            used: self.used,
            end,
            reversal,
        }
    }
}

/// A stop, two ramps with a cruise between them, three phases each ramp, and the end.
const MAX_SEGMENTS: usize = 11;

/// Replanning from a rounded state must not turn a motion that just fits into one that turns round.
pub(super) const POSITION_TOLERANCE: f64 = 1e-6;

const LEAST_ACCELERATION: f64 = 1e-9;

const LEAST_JERK: f64 = 1e-12;

/// A velocity (inc/ms) below which a plan with limited jerk does not count as turned round.
const VELOCITY_TOLERANCE: f64 = 1e-3;
