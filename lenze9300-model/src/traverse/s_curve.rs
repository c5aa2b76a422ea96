//! Motions with limited jerk, in closed form.
//!
//! Every motion is a string of phases of constant jerk: +j, 0 or −j. [`Ramp`] is the fastest change of velocity, at
//! most three phases. A motion to a target is two ramps with constant velocity between them, to a peak velocity and
//! from it, or, when a braking axis has to go a little farther, a braking that is released and taken up again. One
//! number (the peak, or the acceleration at the release) decides about the way; it is found by halving, once, when
//! the plan is made.

use super::interpolator::{Limits, POSITION_TOLERANCE, PathState, Plan, Strip};

/// The fastest change of velocity that ends without acceleration.
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    /// Duration in ms and jerk in inc/ms³.
    phases: [(f64, f64); 3],
}

/// Position, velocity and acceleration.
#[derive(Clone, Copy, Debug)]
struct State {
    position: f64,
    velocity: f64,
    acceleration: f64,
}

/// Greatest acceleration of each sign, and jerk; in the direction of the motion that is planned.
#[derive(Clone, Copy, Debug)]
struct Rates {
    up: f64,
    down: f64,
    jerk: f64,
}

impl Ramp {
    /// From velocity and acceleration to a velocity.
    ///
    /// Letting the acceleration go at once ends at v + a|a|/2j. From there it is decided whether more or less is
    /// needed; the acceleration then goes to a peak and back, held at the limit if it comes that far. An acceleration
    /// above the limit is led back first.
    fn new(velocity: f64, acceleration: f64, to: f64, rates: Rates) -> Self {
        let jerk = rates.jerk;
        let needed = to - released(velocity, acceleration, jerk);
        let (sign, limit) = if needed >= 0.0 {
            (1.0, rates.up)
        } else {
            (-1.0, rates.down)
        };
        let (a, change) = (sign * acceleration, sign * (to - velocity));
        if a > limit {
            let hold = (change - 0.5 * a * a / jerk) / limit;
            return Self {
                phases: [
                    ((a - limit) / jerk, -sign * jerk),
                    (hold.max(0.0), 0.0),
                    (limit / jerk, -sign * jerk),
                ],
            };
        }
        let peak = (jerk * change + 0.5 * a * a).max(0.0).sqrt().max(a);
        let (peak, hold) = if peak <= limit {
            (peak, 0.0)
        } else {
            let ramps = (limit * limit - 0.5 * a * a) / jerk;
            (limit, ((change - ramps) / limit).max(0.0))
        };
        Self {
            phases: [
                ((peak - a) / jerk, sign * jerk),
                (hold, 0.0),
                (peak / jerk, -sign * jerk),
            ],
        }
    }

    fn duration(&self) -> f64 {
        self.phases.iter().map(|(duration, _)| duration).sum()
    }

    /// Way from a velocity and an acceleration.
    fn way(&self, velocity: f64, acceleration: f64) -> f64 {
        let start = State {
            position: 0.0,
            velocity,
            acceleration,
        };
        self.phases
            .iter()
            .fold(start, |state, (duration, jerk)| state.after(*duration, *jerk))
            .position
    }
}

impl State {
    fn after(self, t: f64, jerk: f64) -> Self {
        Self {
            position: self.position + t * (self.velocity + t * (0.5 * self.acceleration + t * (jerk / 6.0))),
            velocity: self.velocity + t * (self.acceleration + 0.5 * jerk * t),
            acceleration: self.acceleration + jerk * t,
        }
    }

    fn mirrored(self, sign: f64) -> Self {
        Self {
            position: sign * self.position,
            velocity: sign * self.velocity,
            acceleration: sign * self.acceleration,
        }
    }
}

/// Velocity after the acceleration has been let go.
fn released(velocity: f64, acceleration: f64, jerk: f64) -> f64 {
    velocity + 0.5 * acceleration * acceleration.abs() / jerk
}

/// [`Plan::to_velocity`] with limited jerk.
///
/// Interpretation: where the motion turns round, the acceleration goes through the standstill and keeps the smaller
/// of both limits, unless it is quicker to come to rest first.
pub(super) fn to_velocity(start: PathState, velocity: f64, limits: &Limits) -> Plan {
    let ramp_to = |velocity: f64, rate: f64| {
        let rates = limits.rates(rate, rate);
        Ramp::new(start.velocity, start.acceleration, velocity, rates)
    };
    if start.velocity * velocity >= 0.0 {
        let rate = if velocity.abs() > start.velocity.abs() {
            limits.acc
        } else {
            limits.dec
        };
        let mut strip = Strip::new(start);
        push_forwards(&mut strip, &ramp_to(velocity, rate), 1.0);
        return strip.finish_at_velocity(velocity);
    }
    let through = ramp_to(velocity, limits.acc.min(limits.dec));
    let stop = ramp_to(0.0, limits.dec);
    let go = Ramp::new(0.0, 0.0, velocity, limits.rates(limits.acc, limits.acc));
    let mut strip = Strip::new(start);
    if stop.duration() + go.duration() < through.duration() {
        push_forwards(&mut strip, &stop, 1.0);
        strip.stand();
        push_forwards(&mut strip, &go, 1.0);
    } else {
        push_forwards(&mut strip, &through, 1.0);
    }
    strip.finish_at_velocity(velocity)
}

/// [`Plan::to_target`] with limited jerk.
///
/// Time-optimal from rest, and from any state that accelerates towards the target or not at all and keeps `v_max`. In
/// other cases every phase still uses one limit up.
///
/// Interpretations: a motion that has to turn round keeps the smaller of both accelerations until it is under way,
/// unless it is quicker to come to rest first. From above `v_max` it comes down to the greatest velocity, at most
/// `v_max`, from which the target can be reached. With `v_end` > 0 and a way too short for it, the target is crossed
/// with the nearest velocity that can be reached; if that is still changing, the end is the crossing.
pub(super) fn to_target(start: PathState, target: i64, limits: &Limits, v_end: f64) -> Plan {
    let target = target.saturating_sub(start.position) as f64;
    let state = State {
        position: start.fraction,
        velocity: start.velocity,
        acceleration: start.acceleration,
    };
    let stop = Ramp::new(
        state.velocity,
        state.acceleration,
        0.0,
        limits.rates(limits.dec, limits.dec),
    );
    let left = target - state.position - stop.way(state.velocity, state.acceleration);
    let mut strip = Strip::new(start);
    if v_end == 0.0 && left.abs() <= POSITION_TOLERANCE {
        push_backwards(&mut strip, &stop, target, 0.0, 1.0);
        return strip.finish_at_target(target, 0.0);
    }
    if limits.v_max == 0.0 {
        push_forwards(&mut strip, &stop, 1.0);
        return strip.finish_nowhere();
    }
    let direct = approach(strip, state, target, limits, v_end, left);
    if limits.acc == limits.dec || !direct.reverses() {
        return direct;
    }
    let mut strip = Strip::new(start);
    push_forwards(&mut strip, &stop, 1.0);
    let rest = strip.stand();
    let at_rest = State {
        position: rest,
        velocity: 0.0,
        acceleration: 0.0,
    };
    let stopped = approach(strip, at_rest, target, limits, v_end, target - rest);
    if stopped.end() < direct.end() { stopped } else { direct }
}

/// Goes on from a state, at which the strip has come to, to the target. `left` is the way from the nearest place to
/// stop at to the target.
fn approach(mut strip: Strip, state: State, target: f64, limits: &Limits, v_end: f64, left: f64) -> Plan {
    let way = target - state.position;
    let free = released(state.velocity, state.acceleration, limits.jerk);
    if v_end > 0.0 && way.abs() <= POSITION_TOLERANCE {
        let rates = limits.rates(limits.acc, limits.dec);
        let now = strip.time();
        push_forwards(
            &mut strip,
            &Ramp::new(state.velocity, state.acceleration, free, rates),
            1.0,
        );
        return strip.finish_crossing(now);
    }
    let sign = if v_end > 0.0 { way.signum() } else { left.signum() };
    let state = State {
        position: 0.0,
        ..state.mirrored(sign)
    };
    let turns = state.velocity < 0.0 || sign * free < 0.0;
    let up = if turns { limits.acc.min(limits.dec) } else { limits.acc };
    let problem = Problem {
        state,
        way: sign * way,
        v_end,
        v_max: limits.v_max,
        rates: limits.rates(up, limits.dec),
    };
    match problem.solve() {
        Solution::Peak { peak, cruise } => {
            let (to, from) = problem.ramps(peak);
            push_forwards(&mut strip, &to, sign);
            strip.cruise(cruise, sign * peak);
            push_backwards(&mut strip, &from, target, sign * v_end, sign);
            strip.finish_at_target(target, sign * v_end)
        }
        Solution::Release { until } => {
            let (time, stop) = problem.release(until);
            strip.push(time, sign * problem.rates.jerk);
            push_backwards(&mut strip, &stop, target, sign * v_end, sign);
            strip.finish_at_target(target, sign * v_end)
        }
        Solution::Direct { velocity } => {
            let ramp = problem.ramp_to(velocity);
            push_backwards(&mut strip, &ramp, target, sign * velocity, sign);
            strip.finish_at_target(target, sign * velocity)
        }
        Solution::Crossing { velocity, at } => {
            let at = strip.time() + at;
            push_forwards(&mut strip, &problem.ramp_to(velocity), sign);
            strip.finish_crossing(at)
        }
    }
}

impl Limits {
    fn rates(&self, up: f64, down: f64) -> Rates {
        Rates {
            up,
            down,
            jerk: self.jerk,
        }
    }
}

/// A motion to be planned, counted in its own direction from its start.
struct Problem {
    state: State,
    way: f64,
    v_end: f64,
    v_max: f64,
    rates: Rates,
}

enum Solution {
    /// To a peak velocity, on with it, and to the final velocity.
    Peak { peak: f64, cruise: f64 },
    /// Braking less than possible: released until this acceleration, then braked on.
    Release { until: f64 },
    /// Straight to this velocity, which is reached at the target.
    Direct { velocity: f64 },
    /// Towards this velocity; the target is crossed on the way, after this time.
    Crossing { velocity: f64, at: f64 },
}

impl Problem {
    fn solve(&self) -> Solution {
        let State {
            velocity, acceleration, ..
        } = self.state;
        let free = released(velocity, acceleration, self.rates.jerk);
        let straight = self.ramp_to(self.v_end).way(velocity, acceleration);
        if self.v_end > 0.0 && self.way < straight {
            return self.cross_as_near_as_possible(free);
        }
        let from = if free > self.v_max {
            self.v_end
        } else {
            free.max(self.v_end)
        };
        let way_over = |peak: f64| {
            let (to, from) = self.ramps(peak);
            to.way(velocity, acceleration) + from.way(peak, 0.0)
        };
        let fastest = way_over(self.v_max);
        if fastest <= self.way {
            return Solution::Peak {
                peak: self.v_max,
                cruise: (self.way - fastest) / self.v_max,
            };
        }
        if acceleration < 0.0 && free <= self.v_max && free > self.v_end && way_over(free) > self.way {
            let until = halve(acceleration, 0.0, |until| {
                let time = (until - acceleration) / self.rates.jerk;
                let at = self.state.after(time, self.rates.jerk);
                at.position + self.release(until).1.way(at.velocity, at.acceleration) <= self.way
            });
            return Solution::Release { until };
        }
        let peak = halve(from, self.v_max, |peak| way_over(peak) <= self.way);
        // What the halving leaves over passes at the peak; at rest there is nothing to pass.
        let left = (self.way - way_over(peak)).max(0.0);
        let cruise = if peak * 1e3 > left { left / peak } else { 0.0 };
        Solution::Peak { peak, cruise }
    }

    /// The way is too short to reach the final velocity.
    fn cross_as_near_as_possible(&self, free: f64) -> Solution {
        let State {
            velocity, acceleration, ..
        } = self.state;
        let way_to = |to: f64| self.ramp_to(to).way(velocity, acceleration);
        let nearest = free.max(0.0);
        if way_to(nearest) <= self.way {
            // Between what needs no way at all and the final velocity, whichever of both is the smaller one.
            let velocity = halve(nearest, self.v_end, |to| way_to(to) <= self.way);
            return Solution::Direct { velocity };
        }
        let to = if free > 0.0 { free } else { self.v_end };
        let ramp = self.ramp_to(to);
        let position = |time: f64| position_after(self.state, &ramp, time);
        // The first crossing: the position may turn round on its way.
        let duration = ramp.duration();
        let steps = 256;
        let after = (1..=steps)
            .map(|step| duration * f64::from(step) / f64::from(steps))
            .find(|time| position(*time) >= self.way)
            .unwrap_or(duration);
        let before = (after - duration / f64::from(steps)).max(0.0);
        Solution::Crossing {
            velocity: to,
            at: halve(before, after, |time| position(time) < self.way),
        }
    }

    fn ramp_to(&self, velocity: f64) -> Ramp {
        Ramp::new(self.state.velocity, self.state.acceleration, velocity, self.rates)
    }

    /// To a peak velocity and from there to the final one.
    fn ramps(&self, peak: f64) -> (Ramp, Ramp) {
        (self.ramp_to(peak), Ramp::new(peak, 0.0, self.v_end, self.rates))
    }

    /// Time until the acceleration has risen to `until`, and the ramp from there.
    fn release(&self, until: f64) -> (f64, Ramp) {
        let time = (until - self.state.acceleration) / self.rates.jerk;
        let at = self.state.after(time, self.rates.jerk);
        (time, Ramp::new(at.velocity, at.acceleration, self.v_end, self.rates))
    }
}

/// Position some time after the begin of a ramp.
fn position_after(mut state: State, ramp: &Ramp, mut time: f64) -> f64 {
    for (duration, jerk) in ramp.phases {
        state = state.after(time.min(duration), jerk);
        time -= duration;
        if time <= 0.0 {
            break;
        }
    }
    state.position
}

/// The last number from `good` towards `bad` at which `holds`; both may be the smaller one. Down to neighbouring
/// floats.
fn halve(mut good: f64, mut bad: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (good + bad);
        if middle == good || middle == bad {
            break;
        }
        if holds(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    good
}

/// Appends a ramp where the strip has come to.
fn push_forwards(strip: &mut Strip, ramp: &Ramp, sign: f64) {
    for (duration, jerk) in ramp.phases {
        strip.push(duration, sign * jerk);
    }
}

/// Appends a ramp that ends at a position with a velocity, whatever the sums before came out to.
fn push_backwards(strip: &mut Strip, ramp: &Ramp, position: f64, velocity: f64, sign: f64) {
    let mut end = State {
        position,
        velocity,
        acceleration: 0.0,
    };
    let mut ends = [end; 3];
    for (place, (duration, jerk)) in ramp.phases.iter().enumerate().rev() {
        ends[place] = end;
        end = end.after(-duration, sign * jerk);
    }
    for ((duration, jerk), end) in ramp.phases.into_iter().zip(ends) {
        strip.push_ending_at(duration, (end.position, end.velocity, end.acceleration), sign * jerk);
    }
}
