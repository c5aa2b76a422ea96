//! The profile generator: constant-acceleration segments in closed form.
//!
//! A [`Plan`] is computed once and evaluated at integer ticks since its start, so nothing is summed up and nothing
//! drifts. Acceleration jumps (trapezoid, triangle): thesis fig. 63 gives exactly 1.5 s for 1200 mm, which excludes an
//! S-ramp (9300 facts 4.2).
//!
//! Unit of time: the tick of the 1 ms task. Unit of position: increment. Accuracy: position and velocity are continuous
//! at segment borders to 1e-6 inc and 1e-9 inc/ms for distances up to 2^32 inc; the target is met exactly.

/// Where a motion is and how fast.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathState {
    /// Whole increments (the floor of the position).
    pub position: i64,
    /// What is left of the position, 0 ≤ fraction < 1 inc.
    pub fraction: f64,
    /// Velocity in inc/ms.
    pub velocity: f64,
}

impl PathState {
    /// At rest on a whole increment.
    pub const fn at_rest(position: i64) -> Self {
        Self {
            position,
            fraction: 0.0,
            velocity: 0.0,
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
}

impl Limits {
    /// The same limits with impossible values (negative, zero acceleration, not a number) raised to the least possible.
    fn checked(self) -> Self {
        let least = |value: f64, least: f64| if value > least { value } else { least };
        Self {
            v_max: least(self.v_max, 0.0),
            acc: least(self.acc, LEAST_ACCELERATION),
            dec: least(self.dec, LEAST_ACCELERATION),
        }
    }
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

/// Constant acceleration, given by the state at one moment.
///
/// Braking segments are anchored at their end: they meet the target exactly, however the sums before came out.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    until: f64,
    anchor_time: f64,
    anchor_position: f64,
    anchor_velocity: f64,
    acceleration: f64,
}

impl Plan {
    /// The fastest motion within the limits from `start` to `target`, crossed with the speed `v_end` (inc/ms, 0 or
    /// above, in the direction of travel).
    ///
    /// - A start in the wrong direction brakes and turns round; a start above `v_max` brakes down to it first.
    /// - With `v_end` = 0 a target too near to brake is passed, and the axis returns to it (9300 facts 4.2).
    /// - Interpretation: with `v_end` > 0 the target is a change-over on the fly, which never turns round. When the way is
    ///   too short for `v_end`, the target is crossed with the nearest speed that can be reached.
    pub fn to_target(start: PathState, target: i64, limits: &Limits, v_end: f64) -> Self {
        let Limits { v_max, acc, dec } = limits.checked();
        let v_end = v_end.clamp(0.0, v_max.max(0.0));
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
        let Limits { acc, dec, .. } = limits.checked();
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
        let position = segment.anchor_position + since * (segment.anchor_velocity + 0.5 * segment.acceleration * since);
        let whole = position.floor();
        Motion {
            position: self.origin.saturating_add(whole as i64),
            fraction: position - whole,
            velocity: segment.anchor_velocity + segment.acceleration * since,
            acceleration: segment.acceleration,
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
    };
}

const MAX_SEGMENTS: usize = 5;

/// Replanning from a rounded state must not turn a motion that just fits into one that turns round.
const POSITION_TOLERANCE: f64 = 1e-6;

const LEAST_ACCELERATION: f64 = 1e-9;
