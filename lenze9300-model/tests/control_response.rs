//! Step responses and margins of the sampled loops against models of their own: scalar difference equations and
//! transfer functions written out here from the motor's equations, sharing no code with what they judge.

use std::f64::consts::TAU;

use lenze9300_model::control::tuning::{
    Cascade, NoiseLimit, TraceSample, current_loop_time_s, identify_mechanics, magnitude_optimum, quantisation_rms_inc,
    sampled_t_sigma_s, symmetrical_optimum,
};
use lenze9300_model::response::{LinearLoop, LoopKind, Margins, StepResponse};
use lenze9300_model::{Axis, AxisCommand, AxisParams, TICKS_PER_MS};
use nalgebra::Complex;

const R: f64 = 19.8;
const L: f64 = 30.5e-3;
const N_P: f64 = 3.0;
const J: f64 = 0.914e-4;
/// Nm per peak ampere: 0.70 Nm / 0.90 A rms.
const K_T: f64 = 0.70 / 0.90 / std::f64::consts::SQRT_2;
const PSI: f64 = K_T / (1.5 * N_P);

type Cx = Complex<f64>;

fn z_at(frequency_hz: f64, period_s: f64) -> Cx {
    Cx::from_polar(1.0, TAU * frequency_hz * period_s)
}

/// Falling zero of `value`, found between two frequencies.
fn zero(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    assert!(value(low) > 0.0 && value(high) < 0.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if value(middle) > 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    low
}

/// Current loop: PI, one tick of computing delay, winding under a held voltage.
///
/// L(z) = K_p (1 + T/T_N/(z − 1)) · (1 − a)/R / (z − a) · 1/z with a = exp(−T R/L).
fn current_open_loop(k_p: f64, t_n: f64, t: f64, frequency_hz: f64) -> Cx {
    let z = z_at(frequency_hz, t);
    let a = (-t * R / L).exp();
    (Cx::from(1.0) + t / t_n / (z - 1.0)) * k_p * ((1.0 - a) / R) / (z - a) / z
}

/// Overshoot in percent and first arrival in ticks of the same loop, from its difference equation.
fn current_step(k_p: f64, t_n: f64, t: f64) -> (f64, f64) {
    let a = (-t * R / L).exp();
    let (mut i, mut integral, mut pending) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut peak, mut arrival) = (0.0_f64, f64::NAN);
    for n in 0..4000_u32 {
        let error = 1.0 - i;
        let before = i;
        i = a * i + (1.0 - a) / R * pending;
        pending = k_p * error + integral;
        integral += t / t_n * k_p * error;
        peak = peak.max(i);
        if i >= 1.0 && arrival.is_nan() {
            arrival = f64::from(n) + (1.0 - before) / (i - before);
        }
    }
    (100.0 * (peak - 1.0), arrival)
}

fn with_tick(tick_ns: u64) -> AxisParams {
    AxisParams {
        tick_ns,
        ..AxisParams::default()
    }
}

// ---- current loop

#[test]
fn the_margins_of_the_current_loop_are_those_of_its_transfer_function() {
    for tick_ns in [62_500, 125_000, 250_000] {
        let params = with_tick(tick_ns);
        let t = tick_ns as f64 * 1e-9;
        // C0075 = 0.75 is 80 V/A (design, section 6), C0076 = 1.5 ms.
        let open = |f: f64| current_open_loop(80.0, 1.5e-3, t, f);
        let crossover = zero(1.0, 0.499 / t, |f| open(f).norm() - 1.0);
        let margin = 180.0 + open(crossover).arg().to_degrees();
        // Up to the crossing of −180° the imaginary part is negative.
        let phase_crossover = zero(10.0, 0.49 / t, |f| -open(f).im);
        let found = Margins::of(&LinearLoop::new(&params, LoopKind::Current));
        assert!(
            (found.crossover_hz.unwrap() / crossover - 1.0).abs() < 1e-6,
            "{found:?} {crossover}"
        );
        assert!(
            (found.phase_margin_deg.unwrap() - margin).abs() < 1e-5,
            "{found:?} {margin}"
        );
        assert!(
            (found.phase_crossover_hz.unwrap() / phase_crossover - 1.0).abs() < 1e-6,
            "{found:?}"
        );
        let gain_margin = -20.0 * open(phase_crossover).norm().log10();
        assert!(
            (found.gain_margin_db.unwrap() - gain_margin).abs() < 1e-5,
            "{found:?} {gain_margin}"
        );
    }
}

#[test]
fn the_step_of_the_current_loop_is_that_of_its_difference_equation() {
    for tick_ns in [62_500, 125_000, 250_000] {
        let params = with_tick(tick_ns);
        let t = tick_ns as f64 * 1e-9;
        let (overshoot, arrival) = current_step(80.0, 1.5e-3, t);
        let found = StepResponse::measure(&params, LoopKind::Current);
        assert!(!found.limited());
        // RK4 against the exact exponential.
        assert!(
            (found.overshoot_percent() - overshoot).abs() < 1e-3,
            "{} {overshoot}",
            found.overshoot_percent()
        );
        assert!(
            (found.rise_s().unwrap() / t - arrival).abs() < 1e-3,
            "{:?} {arrival}",
            found.rise_s()
        );
    }
}

/// Band of the sampled magnitude optimum, from its z-domain model: with T_N = T_S and a tick short against T_S the
/// open loop is 1/3 / (z (z − 1)), because K_p T/L = T/(2 · 1.5 T). Its closed loop z² − z + 1/3 answers a step with
/// 0, 0, 1/3, 2/3, 8/9, 1, 28/27, 28/27, …: 1/27 = 3.7 % of overshoot instead of the continuous 4.32 %, and arrival
/// after 5 ticks = 3.33 T_Σ instead of 4.71. The tick of 125 µs is 0.08 T_S: the exponential of the winding moves
/// both by less than a tenth.
#[test]
fn the_sampled_magnitude_optimum_overshoots_by_a_27th_and_arrives_after_five_ticks() {
    for tick_ns in [31_250, 62_500, 125_000] {
        let mut params = with_tick(tick_ns);
        let t = tick_ns as f64 * 1e-9;
        let gains = magnitude_optimum(1.0 / R, L / R, sampled_t_sigma_s(t));
        // 15.99 is the largest C0075; as a gain of the axis it may lie above.
        params.codes.c0075_current_gain = gains.k_p / (params.current_gains().k_p / params.codes.c0075_current_gain);
        params.codes.c0076_current_tn_s = gains.t_n_s;
        let step = StepResponse::measure(&params, LoopKind::Current);
        let ticks = step.rise_s().unwrap() / t;
        println!("{tick_ns} ns: {} %, {ticks} ticks", step.overshoot_percent());
        assert!(
            (step.overshoot_percent() - 100.0 / 27.0).abs() < 0.37,
            "{}",
            step.overshoot_percent()
        );
        assert!((ticks - 5.0).abs() < 0.5, "{ticks}");
    }
}

// ---- speed and position loop

/// The axis about a constant speed, without the d axis: winding and shaft under a held voltage, PI of the current
/// with the back EMF fed forward from the read speed, converter as a second-order loop, PI of the speed.
struct Scalar {
    t: f64,
    kp_i: f64,
    tn_i: f64,
    kp_n: f64,
    tn_n: f64,
    i: f64,
    omega: f64,
    theta: f64,
    pending: f64,
    x_i: f64,
    x_n: f64,
    track_error: f64,
    track_speed: f64,
}

impl Scalar {
    fn thesis() -> Self {
        Self {
            t: 125e-6,
            kp_i: 80.0,
            tn_i: 1.5e-3,
            // C0070 = 5: five percent of 1.05 Nm for one percent of 3000 rpm.
            kp_n: 5.0 * 1.05 / (3000.0 * TAU / 60.0),
            tn_n: 20e-3,
            i: 0.0,
            omega: 0.0,
            theta: 0.0,
            pending: 0.0,
            x_i: 0.0,
            x_n: 0.0,
            track_error: 0.0,
            track_speed: 0.0,
        }
    }

    fn measured(&self) -> f64 {
        self.track_speed / self.t
    }

    fn tick(&mut self, torque_ref: f64) {
        let error = torque_ref / K_T - self.i;
        let u = self.kp_i * error + self.x_i + N_P * PSI * self.measured();
        self.x_i += self.t / self.tn_i * self.kp_i * error;
        // Fifty small steps of the midpoint rule.
        let h = self.t / 50.0;
        let before = self.theta;
        for _ in 0..50 {
            let slope = |i: f64, omega: f64| ((self.pending - R * i - N_P * PSI * omega) / L, K_T * i / J);
            let (di, domega) = slope(self.i, self.omega);
            let (di, domega) = slope(self.i + 0.5 * h * di, self.omega + 0.5 * h * domega);
            self.theta += h * (self.omega + 0.5 * h * domega);
            self.i += h * di;
            self.omega += h * domega;
        }
        self.pending = u;
        // Converter: poles at −ζω ± jω√(1−ζ²) with 500 Hz and ζ = 1/√2, bilinear.
        let omega_0 = TAU * 500.0;
        let pole = Cx::new(-1.0, 1.0) * (omega_0 / 2.0_f64.sqrt());
        let z = (Cx::from(1.0) + pole * (0.5 * self.t)) / (Cx::from(1.0) - pole * (0.5 * self.t));
        let k1 = 1.0 - z.norm_sqr();
        let k2 = 2.0 - k1 - 2.0 * z.re;
        let error = self.track_error + (self.theta - before) - self.track_speed;
        self.track_speed += k2 * error;
        self.track_error = error * (1.0 - k1);
    }

    fn speed_period(&mut self, omega_ref: f64) {
        let error = omega_ref - self.measured();
        let torque = self.kp_n * error + self.x_n;
        self.x_n += 2.0 * self.t / self.tn_n * self.kp_n * error;
        self.tick(torque);
        self.tick(torque);
    }

    /// Frequency response of the open speed loop: controller as a formula, the rest from its answer to a pulse of
    /// torque. The answer ends in a constant speed; its differences die out and are summed up.
    fn open_speed_loop(frequency_hz: f64) -> Cx {
        let mut axis = Self::thesis();
        let period = 2.0 * axis.t;
        let z = z_at(frequency_hz, period);
        let (mut sum, mut last, mut power) = (Cx::from(0.0), 0.0, Cx::from(1.0));
        for k in 0..3000 {
            let torque = if k == 0 { 1.0 } else { 0.0 };
            axis.tick(torque);
            axis.tick(torque);
            power /= z;
            sum += power * (axis.measured() - last);
            last = axis.measured();
        }
        let controller = (Cx::from(1.0) + period / axis.tn_n / (z - 1.0)) * axis.kp_n;
        controller * sum / (Cx::from(1.0) - 1.0 / z)
    }

    /// The same for the position loop, from the answer of the closed speed loop to a pulse of its set-value.
    fn open_position_loop(k_v: f64, frequency_hz: f64) -> Cx {
        let mut axis = Self::thesis();
        let z = z_at(frequency_hz, 8.0 * axis.t);
        let (mut sum, mut last, mut power) = (Cx::from(0.0), 0.0, Cx::from(1.0));
        for k in 0..2000 {
            for _ in 0..4 {
                axis.speed_period(if k == 0 { 1.0 } else { 0.0 });
            }
            power /= z;
            sum += power * (axis.theta - last);
            last = axis.theta;
        }
        k_v * sum / (Cx::from(1.0) - 1.0 / z)
    }
}

#[test]
fn the_margins_of_the_speed_loop_are_those_of_the_scalar_model() {
    let found = Margins::of(&LinearLoop::new(&AxisParams::default(), LoopKind::Speed));
    let crossover = found.crossover_hz.unwrap();
    let there = Scalar::open_speed_loop(crossover);
    println!("{found:?} {}", there.norm());
    // The scalar model leaves the d axis out and integrates with another rule.
    assert!((there.norm() - 1.0).abs() < 1e-3, "{}", there.norm());
    let margin = 180.0 + there.arg().to_degrees();
    assert!((found.phase_margin_deg.unwrap() - margin).abs() < 0.05, "{margin}");
    let there = Scalar::open_speed_loop(found.phase_crossover_hz.unwrap());
    assert!(
        (found.gain_margin_db.unwrap() + 20.0 * there.norm().log10()).abs() < 0.05,
        "{there}"
    );
    assert!((there.arg().abs() - std::f64::consts::PI).abs() < 0.005, "{there}");
}

#[test]
fn the_margins_of_the_position_loop_are_those_of_the_scalar_model() {
    let found = Margins::of(&LinearLoop::new(&AxisParams::default(), LoopKind::Position));
    // C0254 = 0.4: 50 1/s (design, section 6).
    let there = Scalar::open_position_loop(50.0, found.crossover_hz.unwrap());
    println!("{found:?} {}", there.norm());
    assert!((there.norm() - 1.0).abs() < 1e-3, "{}", there.norm());
    let margin = 180.0 + there.arg().to_degrees();
    assert!((found.phase_margin_deg.unwrap() - margin).abs() < 0.05, "{margin}");
    let there = Scalar::open_position_loop(50.0, found.phase_crossover_hz.unwrap());
    assert!(
        (found.gain_margin_db.unwrap() + 20.0 * there.norm().log10()).abs() < 0.05,
        "{there}"
    );
}

#[test]
fn the_step_of_the_speed_loop_is_that_of_the_scalar_model() {
    // With the codes of the thesis, and with those of the symmetrical optimum: the sampled loop overshoots less than
    // the continuous 43.4 %, because the current loop is twice as fast as its 4 T_Σ.
    let thesis = AxisParams::default();
    let tuned = AxisParams {
        codes: Cascade::of_axis(&thesis).to_codes(&thesis),
        ..thesis
    };
    for (params, band) in [(thesis, 15.0..18.0), (tuned, 30.0..43.4)] {
        let mut model = Scalar::thesis();
        (model.kp_n, model.tn_n) = (params.speed_gains().k_p, params.speed_gains().t_n_s);
        (model.kp_i, model.tn_i) = (params.current_gains().k_p, params.current_gains().t_n_s);
        let (mut peak, mut arrival) = (0.0_f64, f64::NAN);
        for k in 0..400_u32 {
            let before = model.omega;
            model.speed_period(1.0);
            peak = peak.max(model.omega);
            if model.omega >= 1.0 && arrival.is_nan() {
                arrival = (f64::from(k) + (1.0 - before) / (model.omega - before)) * 250e-6;
            }
        }
        let overshoot = 100.0 * (peak - 1.0);
        let found = StepResponse::measure(&params, LoopKind::Speed);
        println!("{} % {overshoot} % {:?} s", found.overshoot_percent(), found.rise_s());
        assert!(!found.limited());
        assert!(band.contains(&overshoot), "{overshoot}");
        // The resolver rounds to an increment: 0.2 % of this step. The model looks every 250 µs, the axis twice as
        // often.
        assert!((found.overshoot_percent() - overshoot).abs() < 0.5, "{overshoot}");
        assert!((found.rise_s().unwrap() - arrival).abs() < 50e-6, "{arrival}");
    }
}

#[test]
fn the_position_loop_follows_a_step_without_passing_it() {
    // Oracle: the scalar model with k_v = 50 1/s, the position read every millisecond.
    let mut model = Scalar::thesis();
    let (mut peak, mut settled_s) = (0.0_f64, 0.0_f64);
    for k in 0..1000_u32 {
        let omega_ref = 50.0 * (1.0 - model.theta);
        for _ in 0..4 {
            model.speed_period(omega_ref);
        }
        peak = peak.max(model.theta);
        if (model.theta - 1.0).abs() > 0.02 {
            settled_s = f64::from(k + 1) * 1e-3;
        }
    }
    let found = StepResponse::measure(&AxisParams::default(), LoopKind::Position);
    println!("{} % {:?} s", found.overshoot_percent(), found.settle_s(0.02));
    assert!((found.overshoot_percent() - 100.0 * (peak - 1.0)).abs() < 0.1, "{peak}");
    assert!((found.settle_s(0.02).unwrap() - settled_s).abs() < 2e-3, "{settled_s}");
}

#[test]
fn the_linear_loop_and_the_axis_answer_alike_tick_by_tick() {
    // The axis is not linear; for a small step it must be. Once a period of the controller.
    for (kind, ticks, tolerance) in [
        (LoopKind::Current, 1, 1e-5),
        (LoopKind::Position, TICKS_PER_MS as usize, 2e-3),
    ] {
        let params = AxisParams::default();
        let linear = LinearLoop::new(&params, kind).closed_loop_step(300);
        let measured = StepResponse::measure(&params, kind);
        for (n, expected) in linear.iter().enumerate() {
            let found = measured.points()[n * ticks].value;
            assert!((found - expected).abs() < tolerance, "{kind:?} {n}: {found} {expected}");
        }
    }
}

// ---- tuning

/// Derived band: the gain crosses 1 near 1/(2 T_I'), where the controller leads by atan(2) = 63.4° over the −180° of
/// both integrators. What lags there is the current loop with its true 2 T_Σ = 0.375 ms, half a period of hold, 0.125
/// ms, and the converter, 2ζ/ω − T/2 = 0.388 ms. T_I' counts the current loop twice over (4 T_Σ) and is 1.325 ms:
/// 0.888 ms/2.65 ms are 19.2°, which leaves 44°; had they been those 1.325 ms, it were the 36.9° of the textbook.
/// Tuned as the thesis does, with T_I = 0.75 ms alone, 33.9° are lost and 29.5° are left.
#[test]
fn a_cascade_tuned_by_the_formulas_keeps_the_margin_of_the_symmetrical_optimum() {
    for load in [0.0, 0.664e-4, 2e-4] {
        let mut params = AxisParams::default();
        params.mechanics.j_load_kg_m2 = load;
        params.codes = Cascade::of_axis(&params).to_codes(&params);
        let margins = Margins::of(&LinearLoop::new(&params, LoopKind::Speed));
        println!("{load}: {margins:?}");
        assert!((margins.phase_margin_deg.unwrap() - 44.0).abs() < 3.0, "{margins:?}");
        let position = LinearLoop::new(&params, LoopKind::Position);
        assert!(position.is_stable() && Margins::of(&position).phase_margin_deg.unwrap() > 45.0);
    }
    let mut params = AxisParams::default();
    let thesis = symmetrical_optimum(J, current_loop_time_s(sampled_t_sigma_s(125e-6)));
    params.codes.c0070_speed_gain *= thesis.k_p / params.speed_gains().k_p;
    params.codes.c0071_speed_tn_s = thesis.t_n_s;
    let margins = Margins::of(&LinearLoop::new(&params, LoopKind::Speed));
    assert!((margins.phase_margin_deg.unwrap() - 29.5).abs() < 3.0, "{margins:?}");
}

#[test]
fn an_unstable_loop_is_called_unstable() {
    let mut params = AxisParams::default();
    params.codes.c0070_speed_gain = 255.0;
    let speed = LinearLoop::new(&params, LoopKind::Speed);
    assert!(!speed.is_stable() && speed.closed_loop_radius() > 1.0);
    // The gain margin says where it begins: 20.1 dB above C0070 = 5 are 50.8.
    let margin = Margins::of(&LinearLoop::new(&AxisParams::default(), LoopKind::Speed))
        .gain_margin_db
        .unwrap();
    let limit = 5.0 * 10.0_f64.powf(margin / 20.0);
    for (share, stable) in [(0.999, true), (1.001, false)] {
        params.codes.c0070_speed_gain = limit * share;
        assert_eq!(LinearLoop::new(&params, LoopKind::Speed).is_stable(), stable, "{limit}");
    }
}

#[test]
fn a_feed_of_the_axis_shows_its_inertia_and_friction() {
    // 0 to 250 rad/s and back along 589.5 rad/s², recorded in every tick: the set-value steps once a millisecond and
    // the torque answers with a ripple of that period, which a trace taken once a millisecond would read 3 % low.
    let params = AxisParams::default();
    let mut axis = Axis::new(&params);
    let mut trace = Vec::new();
    for ms in 0..1300_u32 {
        let t = f64::from(ms) * 1e-3;
        let omega_ref = (589.5 * t).min(250.0).min(589.5 * (1.3 - t));
        for _ in 0..TICKS_PER_MS {
            axis.tick(AxisCommand::Speed {
                omega_ref,
                torque_ff: 0.0,
            });
            let sample = axis.sample();
            trace.push(TraceSample {
                torque_nm: sample.torque,
                omega_rad_s: sample.omega_meas,
            });
        }
    }
    let found = identify_mechanics(&trace, 125e-6, 80).unwrap();
    println!("{found:?}");
    // Assumed mechanics of the model: 0.914e-4 kg m², 0.05 Nm, none viscous (design, section 6).
    assert!((found.j_total_kg_m2 / J - 1.0).abs() < 0.01, "{found:?}");
    assert!((found.coulomb_nm - 0.05).abs() < 0.001, "{found:?}");
    assert!(found.viscous_nm_s.abs() < 1e-5, "{found:?}");
}

#[test]
fn the_noise_limit_predicts_the_torque_ripple_of_a_turning_axis() {
    // Oracle: the axis itself, its torque set-value recorded. At one speed the rounding makes a few spectral lines;
    // over many speeds their mean is white. The limit counts the proportional part alone; feedback through the loop
    // changes low frequencies a little.
    let mut params = AxisParams::default();
    params.feedback.resolver_bits = 11;
    params.codes.c0070_speed_gain = 2.0;
    let (mut squares, speeds) = (0.0, 60_u32);
    for n in 0..speeds {
        let omega_ref = 120.0 + f64::from(n) * 1.2345;
        let mut axis = Axis::new(&params);
        axis.set_shaft_speed(omega_ref);
        let mut torques = Vec::new();
        for tick in 0..12_000 {
            axis.tick(AxisCommand::Speed {
                omega_ref,
                torque_ff: 0.0,
            });
            if tick >= 8_000 {
                torques.push(axis.sample().torque_ref);
            }
        }
        let mean = torques.iter().sum::<f64>() / torques.len() as f64;
        squares += torques.iter().map(|t| (t - mean) * (t - mean)).sum::<f64>() / torques.len() as f64;
    }
    let rms = (squares / f64::from(speeds)).sqrt();
    let limit = NoiseLimit::new(&params.feedback, params.tick_s(), quantisation_rms_inc(11), 1.0);
    let predicted = params.speed_gains().k_p * limit.speed_rms_rad_s;
    println!("{rms} {predicted}");
    assert!((rms / predicted - 1.0).abs() < 0.2, "{rms} {predicted}");
    // One Nm of ripple belongs to the limit by definition.
    assert!((limit.k_p_max * limit.speed_rms_rad_s - 1.0).abs() < 1e-12);
}
