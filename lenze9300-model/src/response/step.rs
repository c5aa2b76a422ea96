use super::{BASE_INC_PER_MS, LoopKind};
use crate::plant::MechanicsParams;
use crate::units::{INC_PER_RAD, RAD_PER_INC};
use crate::{Axis, AxisCommand, AxisParams, AxisSample};

/// A point of a step response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepPoint {
    /// Time since the controller has taken the step up, s.
    pub time_s: f64,
    /// Controlled quantity from where it was, the step being 1.
    pub value: f64,
}

/// Size of the step and its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSize {
    /// Size in SI units.
    pub value: f64,
    /// A (peak), rad/s or rad.
    pub unit: &'static str,
}

/// Answer of a closed loop to a small step of its set-value, by the axis itself.
///
/// - Current: the shaft is locked, the q current steps by 1 % of the limit C0022.
/// - Speed: the shaft turns at 916 rpm; the set-value steps so that the torque uses a fifth of what C0022 leaves. The
///   quantity is the true speed of the shaft.
/// - Position: the shaft turns at 916 rpm with speed feed-forward; the set-value jumps likewise. The quantity is the
///   true angle.
///
/// About a constant speed friction is constant and the answer does not depend on the size, as long as no limit holds
/// ([`limited`](Self::limited)) and the shaft does not turn round.
#[derive(Debug, Clone)]
pub struct StepResponse {
    points: Vec<StepPoint>,
    size: StepSize,
    limited: bool,
}

impl StepResponse {
    /// Lets the axis answer, for as long as it takes: up to a second (current) or five.
    #[must_use]
    pub fn measure(params: &AxisParams, kind: LoopKind) -> Self {
        match kind {
            LoopKind::Current => current_step(params),
            LoopKind::Speed => speed_step(params),
            LoopKind::Position => position_step(params),
        }
    }

    /// The points, one a tick, from the moment of the step.
    #[must_use]
    pub fn points(&self) -> &[StepPoint] {
        &self.points
    }

    /// How big the step was.
    #[must_use]
    pub fn size(&self) -> StepSize {
        self.size
    }

    /// Whether torque, voltage or the limit of the speed set-value held the controller on the way: then the figures
    /// are those of a large signal.
    #[must_use]
    pub fn limited(&self) -> bool {
        self.limited
    }

    /// By how much the quantity passes its set-value, percent of the step.
    #[doc(alias = "Überschwingweite")]
    #[must_use]
    pub fn overshoot_percent(&self) -> f64 {
        let peak = self.points.iter().map(|point| point.value).fold(0.0, f64::max);
        100.0 * (peak - 1.0).max(0.0)
    }

    /// Time until the set-value is reached for the first time, s.
    #[doc(alias = "Anregelzeit")]
    #[must_use]
    pub fn rise_s(&self) -> Option<f64> {
        let place = self.points.iter().position(|point| point.value >= 1.0)?;
        Some(self.crossing(place, 1.0))
    }

    /// Time after which the quantity stays within ±`share` of the step around its set-value, s; `None` when it does
    /// not.
    #[doc(alias = "Ausregelzeit")]
    #[must_use]
    pub fn settle_s(&self, share: f64) -> Option<f64> {
        let outside = |point: &StepPoint| (point.value - 1.0).abs() > share;
        let last = self.points.iter().rposition(outside)?;
        let after = self.points.get(last + 1)?;
        let bound = if self.points[last].value > 1.0 {
            1.0 + share
        } else {
            1.0 - share
        };
        // The last hundredth of the trace must be quiet, or the end was only met by chance.
        let quiet_from_s = self.points.last()?.time_s * 0.99;
        (after.time_s < quiet_from_s).then(|| self.crossing(last + 1, bound))
    }

    /// When the line through `place` and the point before passes `level`.
    fn crossing(&self, place: usize, level: f64) -> f64 {
        let Some(after) = self.points.get(place) else {
            return f64::NAN;
        };
        let Some(before) = place.checked_sub(1).and_then(|place| self.points.get(place)) else {
            return after.time_s;
        };
        let share = (level - before.value) / (after.value - before.value);
        before.time_s + share * (after.time_s - before.time_s)
    }
}

/// Shaft locked: friction that nothing overcomes.
fn current_step(params: &AxisParams) -> StepResponse {
    let locked = AxisParams {
        mechanics: MechanicsParams {
            coulomb_nm: 1e6,
            ..params.mechanics
        },
        ..*params
    };
    let mut axis = Axis::new(&locked);
    // A tick without current: from here on the output stage pulses.
    axis.tick(AxisCommand::Torque { torque_nm: 0.0 });
    let torque_nm = 0.01 * params.torque_max_nm();
    let size = torque_nm / params.motor.torque_per_peak_ampere();
    let command = AxisCommand::Torque { torque_nm };
    record(&mut axis, CURRENT_S, StepSize { value: size, unit: "A" }, |axis, _| {
        axis.tick(command);
        (axis.sample().i_q / size, false)
    })
}

fn speed_step(params: &AxisParams) -> StepResponse {
    let (mut axis, omega) = turning(params, LoopKind::Speed);
    let ticks = params.ticks_per_speed_period();
    let command = |omega_ref| AxisCommand::Speed {
        omega_ref,
        torque_ff: 0.0,
    };
    for _ in 0..settling_ticks(params) / ticks * ticks {
        axis.tick(command(omega));
    }
    let size = usable_torque_nm(params) / params.speed_gains().k_p;
    let start = axis.sample().omega_true;
    let size_named = StepSize {
        value: size,
        unit: "rad/s",
    };
    record(&mut axis, MOVING_S, size_named, |axis, _| {
        axis.tick(command(omega + size));
        ((axis.sample().omega_true - start) / size, false)
    })
}

fn position_step(params: &AxisParams) -> StepResponse {
    let (mut axis, omega) = turning(params, LoopKind::Position);
    let controller = params.position_controller();
    let ticks = params.ticks_per_position_period();
    let inc_per_period = (BASE_INC_PER_MS * 1000.0 * params.tick_s() * ticks as f64).round();
    let omega_ff = inc_per_period * RAD_PER_INC / (params.tick_s() * ticks as f64);
    let gain = params.speed_gains().k_p * controller.k_v();
    let size_inc = (usable_torque_nm(params) / gain * INC_PER_RAD).clamp(64.0, 1e9).round();
    let mut setpoint = axis.sample().position;
    let mut omega_ref = omega;
    let mut advance = |axis: &mut Axis, tick: u64, jump_inc: i64| {
        if tick.is_multiple_of(ticks) {
            setpoint += jump_inc;
            omega_ref = controller.compute_output(setpoint - axis.sample().position, omega_ff);
            setpoint += inc_per_period as i64;
        }
        axis.tick(AxisCommand::Speed {
            omega_ref,
            torque_ff: 0.0,
        });
        omega_ref.abs() >= params.codes.c0909_speed_limit.to_factor() * params.codes.c0011_n_max.to_rad_s()
    };
    for tick in 0..settling_ticks(params) / ticks * ticks {
        advance(&mut axis, tick, 0);
    }
    let start = axis.sample().angle;
    let inc_per_tick = inc_per_period / ticks as f64;
    let size_named = StepSize {
        value: size_inc * RAD_PER_INC,
        unit: "rad",
    };
    record(&mut axis, MOVING_S, size_named, |axis, tick| {
        let limited = advance(axis, tick, if tick == 0 { size_inc as i64 } else { 0 });
        let way = axis.sample().angle.offset_from(start) - inc_per_tick * (tick + 1) as f64;
        (way / size_inc, limited)
    })
}

/// An axis that turns at the base speed.
fn turning(params: &AxisParams, kind: LoopKind) -> (Axis, f64) {
    let omega = kind.base_speed();
    let mut axis = Axis::new(params);
    axis.set_shaft_speed(omega);
    (axis, omega)
}

/// Torque that a step may ask for at once: a fifth of what friction leaves.
fn usable_torque_nm(params: &AxisParams) -> f64 {
    let left = params.torque_max_nm() - params.mechanics.coulomb_nm;
    0.2 * left.max(0.05 * params.torque_max_nm())
}

fn settling_ticks(params: &AxisParams) -> u64 {
    (MOVING_S / params.tick_s()) as u64
}

/// Runs the axis; `tick` moves it on and tells the value and whether a set-value was limited.
fn record(
    axis: &mut Axis,
    duration_s: f64,
    size: StepSize,
    mut tick: impl FnMut(&mut Axis, u64) -> (f64, bool),
) -> StepResponse {
    let tick_s = axis.params().tick_s();
    let mut limited = false;
    let mut points = vec![StepPoint {
        time_s: 0.0,
        value: 0.0,
    }];
    for n in 0..(duration_s / tick_s) as u64 {
        let (value, held) = tick(axis, n);
        let sample: &AxisSample = axis.sample();
        limited |= held || sample.torque_limited || sample.voltage_limited;
        points.push(StepPoint {
            time_s: (n + 1) as f64 * tick_s,
            value,
        });
    }
    StepResponse { points, size, limited }
}

/// How long the current loop is watched, s.
const CURRENT_S: f64 = 1.0;
/// How long speed and position loop settle before the step and are watched after it, s.
const MOVING_S: f64 = 5.0;
