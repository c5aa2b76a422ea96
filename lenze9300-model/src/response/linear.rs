use nalgebra::{Complex, DMatrix, DVector, SMatrix, SVector};

use super::LoopKind;
use crate::AxisParams;
use crate::control::{Decoupling, PiGains};
use crate::plant::TrackingGains;
use crate::units::INC_PER_RAD;

/// A sampled loop, cut open where its controller takes its measured value, in small-signal form about its operating
/// point.
///
/// ```text
/// s' = A s + B w        w  what the controller takes for the measured value
/// y  = C s              y  what is measured
/// ```
///
/// one step being one period of that controller: computing delay, hold, the inner loops with their own periods, the
/// decoupling, the coupling of both axes and the tracking converter are all inside. The matrices are those of the
/// tick, exact (matrix exponential), put together tick by tick. Left out is what is not linear: quantisation, limits,
/// and friction that turns round.
#[derive(Debug, Clone)]
pub struct LinearLoop {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: DVector<f64>,
    period_s: f64,
}

impl LinearLoop {
    /// The loop of an axis.
    #[must_use]
    pub fn new(params: &AxisParams, kind: LoopKind) -> Self {
        let model = TickModel::new(params, kind);
        let column = |state: State, w: f64| DVector::from_column_slice(model.period(&state, w).as_slice());
        let mut a = DMatrix::zeros(STATES, STATES);
        for place in 0..STATES {
            let mut unit = State::zeros();
            unit[place] = 1.0;
            a.set_column(place, &column(unit, 0.0));
        }
        Self {
            a,
            b: column(State::zeros(), 1.0),
            c: model.output(),
            period_s: params.tick_s() * kind.ticks_per_period(params) as f64,
        }
    }

    /// Period of the controller, s.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Half the sampling frequency, Hz: above it a sampled loop answers nothing new.
    #[must_use]
    pub fn nyquist_hz(&self) -> f64 {
        0.5 / self.period_s
    }

    /// Frequency response of the open loop, L(z) = −C (zI − A)⁻¹ B with z = exp(j2πfT).
    ///
    /// The loop closes with 1 + L. Not a number at a pole on the unit circle, such as frequency 0 of an integrator.
    #[must_use]
    pub fn open_loop(&self, frequency_hz: f64) -> Complex<f64> {
        let angle = core::f64::consts::TAU * frequency_hz * self.period_s;
        let z = Complex::new(angle.cos(), angle.sin());
        let matrix = DMatrix::from_fn(STATES, STATES, |row, column| {
            let diagonal = if row == column { z } else { Complex::new(0.0, 0.0) };
            diagonal - self.a[(row, column)]
        });
        let b = self.b.map(|value| Complex::new(value, 0.0));
        match matrix.lu().solve(&b) {
            Some(x) => -x.iter().zip(self.c.iter()).map(|(x, c)| x * *c).sum::<Complex<f64>>(),
            None => Complex::new(f64::NAN, f64::NAN),
        }
    }

    /// Largest magnitude of a pole of the closed loop; below 1 it is stable.
    ///
    /// From the growth of its powers: |A^n|^(1/n) with n = 2^40.
    #[must_use]
    pub fn closed_loop_radius(&self) -> f64 {
        let mut power = &self.a + &self.b * self.c.transpose();
        let mut log_radius = 0.0;
        let mut share = 1.0;
        for _ in 0..40 {
            let norm = power.norm();
            if norm == 0.0 {
                return 0.0;
            }
            if !norm.is_finite() {
                return f64::INFINITY;
            }
            log_radius += share * norm.ln();
            power /= norm;
            power = &power * &power;
            share *= 0.5;
        }
        (log_radius + share * power.norm().max(f64::MIN_POSITIVE).ln()).exp()
    }

    /// Whether the closed loop comes to rest.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.closed_loop_radius() < 1.0 - 1e-9
    }

    /// The first `periods` measured values after a step of the set-value by 1, the loop being closed; the first is
    /// that of the step.
    #[must_use]
    pub fn closed_loop_step(&self, periods: usize) -> Vec<f64> {
        let mut state = DVector::zeros(STATES);
        (0..periods)
            .map(|_| {
                let y = self.c.dot(&state);
                // A set-value counts like a measured value with the other sign: the controller sees their difference.
                state = &self.a * &state + &self.b * (y - 1.0);
                y
            })
            .collect()
    }
}

/// Place of each quantity in the state.
const I_D: usize = 0;
const I_Q: usize = 1;
const OMEGA: usize = 2;
/// Angle of the shaft, rad; kept in the position loop alone, elsewhere only its changes count.
const THETA: usize = 3;
const V_D: usize = 4;
const V_Q: usize = 5;
const X_D: usize = 6;
const X_Q: usize = 7;
const TRACK_ERROR: usize = 8;
const TRACK_SPEED: usize = 9;
const X_SPEED: usize = 10;
/// Speed measured in the period before, rad/s.
const OMEGA_BEFORE: usize = 11;
const STATES: usize = 12;

type State = SVector<f64, STATES>;

/// The axis during a tick, linear.
struct TickModel {
    kind: LoopKind,
    /// Plant over a tick: columns i_d, i_q, ω, θ, u_d, u_q.
    plant: SMatrix<f64, 4, 6>,
    current: PiGains,
    speed: PiGains,
    speed_t_d_s: f64,
    k_v_per_s: f64,
    amperes_per_nm: f64,
    tracking: TrackingGains,
    /// Voltages that the decoupling adds: u_d from i_q and ω, u_q from i_d and ω.
    decoupling: [[f64; 2]; 2],
    tick_s: f64,
    ticks_per_speed_period: u64,
    ticks_per_position_period: u64,
}

impl TickModel {
    fn new(params: &AxisParams, kind: LoopKind) -> Self {
        let motor = &params.motor;
        let n_p = f64::from(motor.n_p);
        let omega_el = n_p * kind.base_speed();
        let locked = kind == LoopKind::Current;
        let torque_per_ampere = motor.torque_per_peak_ampere();
        let friction_nm = params.mechanics.coulomb_nm + params.mechanics.viscous_nm_s * kind.base_speed();
        let i_q0 = if locked { 0.0 } else { friction_nm / torque_per_ampere };
        let inv_j = if locked {
            0.0
        } else {
            1.0 / params.mechanics.j_total_kg_m2()
        };
        let saliency = 1.5 * n_p * (motor.l_d - motor.l_q);
        let mut rates = SMatrix::<f64, 6, 6>::zeros();
        rates[(0, 0)] = -motor.r_s / motor.l_d;
        rates[(0, 1)] = omega_el * motor.l_q / motor.l_d;
        rates[(0, 2)] = n_p * motor.l_q * i_q0 / motor.l_d;
        rates[(0, 4)] = 1.0 / motor.l_d;
        rates[(1, 0)] = -omega_el * motor.l_d / motor.l_q;
        rates[(1, 1)] = -motor.r_s / motor.l_q;
        rates[(1, 2)] = -n_p * motor.psi_f / motor.l_q;
        rates[(1, 5)] = 1.0 / motor.l_q;
        rates[(2, 0)] = saliency * i_q0 * inv_j;
        rates[(2, 1)] = torque_per_ampere * inv_j;
        rates[(2, 2)] = -params.mechanics.viscous_nm_s * inv_j;
        rates[(3, 2)] = 1.0;
        let tick_s = params.tick_s();
        let mut plant: SMatrix<f64, 4, 6> = (rates * tick_s).exp().fixed_rows::<4>(0).into_owned();
        if locked {
            plant.row_mut(OMEGA).fill(0.0);
        }
        let decoupling = match params.decoupling {
            Decoupling::Off => [[0.0; 2]; 2],
            Decoupling::On => [
                [-omega_el * motor.l_q, -n_p * motor.l_q * i_q0],
                [omega_el * motor.l_d, n_p * motor.psi_f],
            ],
        };
        Self {
            kind,
            plant,
            current: params.current_gains(),
            speed: params.speed_gains(),
            speed_t_d_s: params.codes.c0072_speed_td_s,
            k_v_per_s: params.position_controller().k_v(),
            amperes_per_nm: 1.0 / torque_per_ampere,
            tracking: params.feedback.tracking_gains(tick_s),
            decoupling,
            tick_s,
            ticks_per_speed_period: params.ticks_per_speed_period(),
            ticks_per_position_period: params.ticks_per_position_period(),
        }
    }

    /// What the loop measures: A, rad/s or rad.
    fn output(&self) -> DVector<f64> {
        let mut c = DVector::zeros(STATES);
        match self.kind {
            LoopKind::Current => c[I_Q] = 1.0,
            LoopKind::Speed => c[TRACK_SPEED] = self.rad_s_per_inc_tick(),
            LoopKind::Position => c[THETA] = 1.0,
        }
        c
    }

    /// One period of the loop's controller, which takes `w` for its measured value.
    fn period(&self, state: &State, w: f64) -> State {
        match self.kind {
            LoopKind::Current => {
                let mut next = self.tick(state, -w);
                (next[X_SPEED], next[OMEGA_BEFORE]) = (0.0, 0.0);
                next
            }
            LoopKind::Speed => self.speed_period(state, 0.0, w),
            LoopKind::Position => {
                let omega_ref = -self.k_v_per_s * w;
                let mut state = *state;
                for _ in 0..self.ticks_per_position_period / self.ticks_per_speed_period {
                    let omega_meas = state[TRACK_SPEED] * self.rad_s_per_inc_tick();
                    state = self.speed_period(&state, omega_ref, omega_meas);
                }
                state
            }
        }
    }

    fn speed_period(&self, state: &State, omega_ref: f64, omega_meas: f64) -> State {
        let period_s = self.ticks_per_speed_period as f64 * self.tick_s;
        let proportional = self.speed.k_p * (omega_ref - omega_meas);
        let differential = self.speed.k_p * self.speed_t_d_s / period_s * (omega_meas - state[OMEGA_BEFORE]);
        let i_q_ref = (proportional + state[X_SPEED] - differential) * self.amperes_per_nm;
        let mut next = *state;
        next[OMEGA_BEFORE] = omega_meas;
        next[X_SPEED] = integrated(state[X_SPEED], proportional, period_s / self.speed.t_n_s);
        for _ in 0..self.ticks_per_speed_period {
            let error = i_q_ref - next[I_Q];
            next = self.tick(&next, error);
        }
        next
    }

    /// One tick of the axis with an error of the q current.
    fn tick(&self, state: &State, error_q: f64) -> State {
        let error_d = -state[I_D];
        let omega_meas = state[TRACK_SPEED] * self.rad_s_per_inc_tick();
        let [from_q, from_d] = self.decoupling;
        let mut next = *state;
        next[V_D] = self.current.k_p * error_d + state[X_D] + from_q[0] * state[I_Q] + from_q[1] * omega_meas;
        next[V_Q] = self.current.k_p * error_q + state[X_Q] + from_d[0] * state[I_D] + from_d[1] * omega_meas;
        let share = self.tick_s / self.current.t_n_s;
        next[X_D] = integrated(state[X_D], self.current.k_p * error_d, share);
        next[X_Q] = integrated(state[X_Q], self.current.k_p * error_q, share);

        let before = SVector::<f64, 6>::new(state[I_D], state[I_Q], state[OMEGA], 0.0, state[V_D], state[V_Q]);
        let after = self.plant * before;
        next[I_D] = after[0];
        next[I_Q] = after[1];
        next[OMEGA] = after[2];
        next[THETA] = match self.kind {
            LoopKind::Position => state[THETA] + after[3],
            LoopKind::Current | LoopKind::Speed => 0.0,
        };
        let error = state[TRACK_ERROR] + after[3] * INC_PER_RAD - state[TRACK_SPEED];
        next[TRACK_SPEED] = state[TRACK_SPEED] + self.tracking.speed * error;
        next[TRACK_ERROR] = error - self.tracking.position * error;
        next
    }

    fn rad_s_per_inc_tick(&self) -> f64 {
        1.0 / (INC_PER_RAD * self.tick_s)
    }
}

/// An integrator after a period; one that is switched off holds nothing, so that it is no pole.
fn integrated(integral: f64, proportional: f64, share: f64) -> f64 {
    if share == 0.0 {
        0.0
    } else {
        integral + share * proportional
    }
}
