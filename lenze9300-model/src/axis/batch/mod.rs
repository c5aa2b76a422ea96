//! Many axes at once.

mod lanes;

use self::lanes::{Constants, LANES, SpeedPeriod, State, tick};
use super::{Axis, AxisCommand, AxisParams, AxisSample, Pulses};
use crate::control::Decoupling;
use crate::plant::{Contact, Dq, Fidelity, LinkState, Mains, OutputStage, ShaftAngle, ShaftSegment};

/// Axes with the same tick, worked together: plant and loops of each, to the bit as [`Axis`] works them.
///
/// Meant for what runs thousands of axes (sweeps, error statistics). Eight axes share a structure of arrays whose loops the
/// compiler packs. An axis that meets anything unusual in a tick (torque or voltage limit, a stop inside the tick, LU or OU, brake
/// module, inhibit) is taken out and worked by [`Axis::tick`] until it is usual again; so there is one model and no second reading
/// of it. Axes that need sub-steps, have an elastic coupling, do not decouple or
/// are modelled at another fidelity than F1 always are.
///
/// # Example
///
/// ```
/// use lenze9300_model::{Axis, AxisBatch, AxisCommand, AxisParams};
///
/// let command = AxisCommand::Speed { omega_ref: 100.0, torque_ff: 0.0 };
/// let mut batch = AxisBatch::new(&[AxisParams::default(); 32])?;
/// let mut single = Axis::new(&AxisParams::default());
/// for axis in 0..batch.len() {
///     batch.set_command(axis, command);
/// }
/// for _ in 0..8000 {
///     batch.tick();
///     single.tick(command);
/// }
/// assert_eq!(batch.sample(31), *single.sample());
/// # Ok::<(), lenze9300_model::BatchError>(())
/// ```
#[derive(Debug, Clone)]
pub struct AxisBatch {
    groups: Vec<Group>,
    len: usize,
    ticks: u64,
    ticks_per_speed_period: u64,
}

/// Why axes cannot be worked together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BatchError {
    /// Their ticks differ.
    #[error("axis {axis}: expected a tick of {expected_ns} ns like axis 0, got {got_ns} ns")]
    Tick {
        /// The axis, counted from 0.
        axis: usize,
        /// Tick of axis 0.
        expected_ns: u64,
        /// Tick of this one.
        got_ns: u64,
    },
}

impl AxisBatch {
    /// Axes at rest, inhibited until they get a command.
    ///
    /// # Errors
    ///
    /// [`BatchError::Tick`] if the ticks differ.
    pub fn new(params: &[AxisParams]) -> Result<Self, BatchError> {
        if let Some(first) = params.first()
            && let Some((axis, other)) = params.iter().enumerate().find(|(_, p)| p.tick_ns != first.tick_ns)
        {
            return Err(BatchError::Tick {
                axis,
                expected_ns: first.tick_ns,
                got_ns: other.tick_ns,
            });
        }
        Ok(Self {
            groups: params.chunks(LANES).map(Group::new).collect(),
            len: params.len(),
            ticks_per_speed_period: params.first().map_or(1, AxisParams::ticks_per_speed_period),
            ticks: 0,
        })
    }

    /// Number of axes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// What an axis does from the next tick on.
    ///
    /// # Panics
    ///
    /// If there is no such axis, as everywhere below.
    pub fn set_command(&mut self, axis: usize, command: AxisCommand) {
        let moment = self.moment();
        let (group, lane) = self.place_mut(axis);
        group.set_command(lane, command, moment);
    }

    /// Torque of the load against the positive direction, reduced to the motor, Nm.
    pub fn set_load_torque(&mut self, axis: usize, load_nm: f64) {
        let (group, lane) = self.place_mut(axis);
        group.axes[lane].set_load_torque(load_nm);
        group.constants.load_nm[lane] = load_nm;
    }

    /// Moves all axes on by one tick.
    pub fn tick(&mut self) {
        let moment = self.moment();
        for group in &mut self.groups {
            group.tick(moment);
        }
        self.ticks += 1;
    }

    /// What was seen of an axis at the end of the last tick.
    #[must_use]
    pub fn sample(&self, axis: usize) -> AxisSample {
        let (group, lane) = self.place(axis);
        group.sample(lane)
    }

    /// Position that the resolver gives, increments since power-up; cheaper than the whole [`sample`](Self::sample).
    #[must_use]
    pub fn position(&self, axis: usize) -> i64 {
        let (group, lane) = self.place(axis);
        if group.is_alone(lane) {
            group.axes[lane].sample().position
        } else {
            group.now().position[lane]
        }
    }

    /// The way that the shaft of an axis took in the last tick.
    #[must_use]
    pub fn segment(&self, axis: usize) -> ShaftSegment {
        let (group, lane) = self.place(axis);
        group.segment(lane)
    }

    fn moment(&self) -> Moment {
        Moment {
            tick: self.ticks,
            to_speed_period: match self.ticks % self.ticks_per_speed_period {
                0 => 0,
                since => self.ticks_per_speed_period - since,
            },
        }
    }

    fn place(&self, axis: usize) -> (&Group, usize) {
        assert!(axis < self.len, "axis {axis} of a batch of {}", self.len);
        (&self.groups[axis / LANES], axis % LANES)
    }

    fn place_mut(&mut self, axis: usize) -> (&mut Group, usize) {
        assert!(axis < self.len, "axis {axis} of a batch of {}", self.len);
        (&mut self.groups[axis / LANES], axis % LANES)
    }
}

/// Up to [`LANES`] axes.
#[derive(Debug, Clone)]
struct Group {
    /// State of an axis while it is alone; its parameters always.
    axes: Vec<Axis>,
    commands: Vec<AxisCommand>,
    /// Bit per lane: the axis is worked by itself.
    alone: u32,
    /// State after the last tick, and before it; which is which changes with every tick. Angle and speed are kept for every lane, all
    /// else for those that are not alone.
    states: [State; 2],
    newest: usize,
    constants: Constants,
}

/// Where a tick stands.
#[derive(Debug, Clone, Copy)]
struct Moment {
    /// Ticks before this one.
    tick: u64,
    /// Ticks until the speed controller runs, 0: in this one.
    to_speed_period: u64,
}

impl Group {
    fn new(params: &[AxisParams]) -> Self {
        let axes: Vec<_> = params.iter().map(Axis::new).collect();
        let mut constants = Constants::default();
        for (lane, axis) in axes.iter().enumerate() {
            store_constants(&mut constants, lane, axis);
        }
        Self {
            commands: vec![AxisCommand::Inhibited; axes.len()],
            alone: occupied(axes.len()),
            axes,
            states: [State::default(); 2],
            newest: 0,
            constants,
        }
    }

    fn now(&self) -> &State {
        &self.states[self.newest]
    }

    fn is_alone(&self, lane: usize) -> bool {
        self.alone & (1 << lane) != 0
    }

    fn set_command(&mut self, lane: usize, command: AxisCommand, moment: Moment) {
        self.commands[lane] = command;
        if let AxisCommand::Speed { omega_ref, torque_ff } = command {
            self.constants.omega_ref[lane] = omega_ref;
            self.constants.torque_ff[lane] = torque_ff;
        } else if !self.is_alone(lane) {
            load_axis(&mut self.axes[lane], &self.states[self.newest], lane, moment);
            self.alone |= 1 << lane;
        }
    }

    fn tick(&mut self, moment: Moment) {
        let [first, second] = &mut self.states;
        let (now, next) = if self.newest == 0 {
            (first, second)
        } else {
            (second, first)
        };
        let period = if moment.to_speed_period == 0 {
            SpeedPeriod::Begins
        } else {
            SpeedPeriod::Goes
        };
        let unusual = tick(now, next, &self.constants, period);
        self.newest = 1 - self.newest;
        let unusual = (0..LANES).fold(0, |bits, lane| bits | (u32::from(unusual[lane] != 0) << lane));
        let mut lanes = (unusual | self.alone) & occupied(self.axes.len());
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let axis = &mut self.axes[lane];
            if self.alone & (1 << lane) == 0 {
                load_axis(axis, now, lane, moment);
            }
            store_shaft(now, lane, axis);
            axis.tick(self.commands[lane]);
            store_shaft(next, lane, axis);
            if is_usual(axis, self.commands[lane]) {
                store_state(next, lane, axis);
                self.alone &= !(1 << lane);
            } else {
                self.alone |= 1 << lane;
            }
        }
    }

    fn sample(&self, lane: usize) -> AxisSample {
        if self.is_alone(lane) {
            *self.axes[lane].sample()
        } else {
            usual_sample(&self.axes[lane], self.now(), lane)
        }
    }

    fn segment(&self, lane: usize) -> ShaftSegment {
        let (before, now) = (&self.states[1 - self.newest], self.now());
        ShaftSegment {
            start: angle(before, lane),
            end: angle(now, lane),
            omega_start: before.omega[lane],
            omega_end: now.omega[lane],
            dt_s: self.constants.tick_s,
        }
    }
}

/// A bit for each of so many lanes.
fn occupied(axes: usize) -> u32 {
    (1 << axes) - 1
}

/// Whether the lanes can take an axis over.
fn is_usual(axis: &Axis, command: AxisCommand) -> bool {
    matches!(command, AxisCommand::Speed { .. })
        && axis.train.substeps == 1
        && axis.train.is_rigid()
        && axis.params.fidelity == Fidelity::Averaged
        && axis.current.decoupling == Decoupling::On
        && axis.pending != OutputStage::Inhibited
        && axis.sample.link == LinkState::Normal
        && !axis.link.chopper_on
        && !axis.sample.voltage_limited
        && axis.speed.landing_from.is_none()
        && axis.speed.omega_before.is_some()
}

fn angle(state: &State, lane: usize) -> ShaftAngle {
    ShaftAngle {
        increments: state.angle_inc[lane],
        fraction: state.angle_fraction[lane],
    }
}

fn usual_sample(axis: &Axis, state: &State, lane: usize) -> AxisSample {
    AxisSample {
        position: state.position[lane],
        omega_meas: state.omega_meas[lane],
        omega_filtered: state.omega_filtered[lane],
        i_d: state.i_d[lane],
        i_q: state.i_q[lane],
        torque: axis.train.equations.torque(state.i_d[lane], state.i_q[lane]),
        torque_ref: state.torque_ref[lane],
        voltage: Dq::new(state.applied_d[lane], state.applied_q[lane]),
        u_dc: state.u_dc[lane],
        link: LinkState::Normal,
        pulses: Pulses::Enabled,
        torque_limited: false,
        voltage_limited: false,
        omega_true: state.omega[lane],
        angle: angle(state, lane),
    }
}

/// From the lane into the axis.
fn load_axis(axis: &mut Axis, state: &State, lane: usize, moment: Moment) {
    axis.sample = usual_sample(axis, state, lane);
    axis.tick = moment.tick;
    axis.ticks_to_speed_period = moment.to_speed_period;
    axis.pending = OutputStage::Active(Dq::new(state.pending_d[lane], state.pending_q[lane]));
    axis.i_q_ref = state.i_q_ref[lane];
    axis.speed.pi.integral = state.integral_speed[lane];
    axis.speed.omega_before = Some(state.omega_before[lane]);
    axis.speed.landing_from = None;
    axis.current.d.integral = state.integral_d[lane];
    axis.current.q.integral = state.integral_q[lane];
    axis.train.current = Dq::new(state.i_d[lane], state.i_q[lane]);
    axis.train.omega = state.omega[lane];
    axis.train.angle = angle(state, lane);
    axis.train.electrical_w = state.electrical_w[lane];
    axis.train.contact = if state.contact[lane] > 0.0 {
        Contact::Positive
    } else if state.contact[lane] < 0.0 {
        Contact::Negative
    } else {
        Contact::Stuck
    };
    axis.link.voltage_v = state.u_dc[lane];
    axis.feedback.position = state.position[lane];
    axis.feedback.error_inc = state.error_inc[lane];
    axis.feedback.speed_inc_per_tick = state.speed_inc_per_tick[lane];
}

fn store_shaft(state: &mut State, lane: usize, axis: &Axis) {
    state.angle_inc[lane] = axis.train.angle.increments;
    state.angle_fraction[lane] = axis.train.angle.fraction;
    state.omega[lane] = axis.train.omega;
}

/// From the axis into the lane, beside what [`store_shaft`] stores.
fn store_state(state: &mut State, lane: usize, axis: &Axis) {
    let sample = &axis.sample;
    (state.i_d[lane], state.i_q[lane]) = (axis.train.current.d, axis.train.current.q);
    state.contact[lane] = axis.train.contact.sign();
    state.electrical_w[lane] = axis.train.electrical_w;
    state.u_dc[lane] = sample.u_dc;
    state.position[lane] = sample.position;
    state.error_inc[lane] = axis.feedback.error_inc;
    state.speed_inc_per_tick[lane] = axis.feedback.speed_inc_per_tick;
    state.omega_meas[lane] = sample.omega_meas;
    state.omega_filtered[lane] = sample.omega_filtered;
    state.omega_before[lane] = axis.speed.omega_before.unwrap_or(sample.omega_meas);
    state.torque_ref[lane] = sample.torque_ref;
    state.i_q_ref[lane] = axis.i_q_ref;
    state.integral_speed[lane] = axis.speed.pi.integral;
    state.integral_d[lane] = axis.current.d.integral;
    state.integral_q[lane] = axis.current.q.integral;
    (state.applied_d[lane], state.applied_q[lane]) = (sample.voltage.d, sample.voltage.q);
    if let OutputStage::Active(pending) = axis.pending {
        (state.pending_d[lane], state.pending_q[lane]) = (pending.d, pending.q);
    }
}

fn store_constants(k: &mut Constants, lane: usize, axis: &Axis) {
    let (train, link) = (&axis.train, &axis.link);
    let motor = &train.equations;
    k.tick_s = axis.tick_s;
    k.load_nm[lane] = train.load_nm;
    k.r_s[lane] = motor.r_s;
    (k.l_d[lane], k.l_q[lane]) = (motor.l_d, motor.l_q);
    (k.inv_l_d[lane], k.inv_l_q[lane]) = (train.inv_l.d, train.inv_l.q);
    k.psi_f[lane] = motor.psi_f;
    k.n_p[lane] = motor.n_p;
    k.torque_psi[lane] = motor.torque_psi;
    k.torque_saliency[lane] = motor.torque_saliency;
    k.inv_j[lane] = train.inv_j;
    k.coulomb_nm[lane] = train.coulomb_nm;
    k.viscous[lane] = train.viscous_nm_s;
    k.standby_w[lane] = link.params.standby_w;
    k.volt_squared_per_watt[lane] = link.volt_squared_per_watt;
    k.rectified_v[lane] = match link.mains {
        Mains::On => link.rectified_v,
        Mains::Off => f64::NEG_INFINITY,
    };
    k.source_share[lane] = link.source_share;
    k.lu_v[lane] = link.params.thresholds.lu_v;
    k.ou_v[lane] = link.params.thresholds.ou_v;
    k.brake_on_v[lane] = link.params.brake.map_or(f64::INFINITY, |brake| brake.on_v);
    k.resolver_mask[lane] = axis.feedback.mask;
    k.position_gain[lane] = axis.feedback.position_gain;
    k.speed_gain[lane] = axis.feedback.speed_gain;
    k.rad_s_per_inc_tick[lane] = axis.feedback.rad_s_per_inc_tick;
    k.filter_share[lane] = axis.filter_share;
    k.k_p_speed[lane] = axis.speed.pi.gains.k_p;
    k.t_over_t_n_speed[lane] = axis.speed.pi.t_s_over_t_n;
    k.differential[lane] = axis.speed.differential;
    k.torque_max_nm[lane] = axis.speed.torque_max_nm;
    k.amperes_per_nm[lane] = axis.amperes_per_nm;
    k.k_p_current[lane] = axis.current.d.gains.k_p;
    k.t_over_t_n_current[lane] = axis.current.d.t_s_over_t_n;
}
