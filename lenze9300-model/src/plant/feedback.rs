use super::ShaftAngle;
use crate::noise;
use crate::units::{INC_PER_REV, RAD_PER_INC};

/// Resolver and its tracking converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackParams {
    /// Resolution of a revolution in bits, 8…16; other values are limited to that range.
    ///
    /// 16: every increment, the reading that fits fig. 72. 11: 2048 steps of 32 increments, as the thesis states. Source:
    /// 9300 facts 4.6, "Is the position really quantised to 2048 steps?".
    pub resolver_bits: u8,
    /// Natural frequency of the tracking loop, Hz. Assumed.
    ///
    /// Its speed lags an acceleration by 2ζ/ω − T/2 = 0.39 ms, which is what holding the speed feed-forward for 1 ms
    /// leads on average over the four speed samples (0.375 ms). The two cancel, so braking ends with 1.6 increments
    /// of following error instead of some 60.
    pub tracking_hz: f64,
    /// Damping of the tracking loop. Assumed.
    pub tracking_damping: f64,
    /// Errors of the resolver, from fidelity F2 on.
    pub errors: ResolverErrors,
}

/// Errors of a resolver and its converter.
///
/// ```text
/// shown = φ + once · sin φ + twice · sin(2 φ + 1 rad) + noise
/// ```
///
/// Once a turn comes from a mounting out of centre, twice a turn from windings that are not alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolverErrors {
    /// Amplitude of the error once a turn, arc minutes of the shaft. Assumed share of the accuracy.
    pub once_arcmin: f64,
    /// Amplitude of the error twice a turn, arc minutes of the shaft. Assumed share of the accuracy.
    pub twice_arcmin: f64,
    /// Noise of a sample, evenly distributed over ± this value, increments.
    pub noise_inc: f64,
}

impl Default for ResolverErrors {
    /// 10′ in all, the accuracy of the fact sheet (9300 facts 6, assumed there); the noise makes the displayed speed of a standing
    /// shaft tremble by 0.7 to 2 rpm as in figures 71 and 72 of the thesis (9300 facts 4.6).
    fn default() -> Self {
        Self {
            once_arcmin: 3.0,
            twice_arcmin: 7.0,
            noise_inc: 4.0,
        }
    }
}

impl Default for FeedbackParams {
    fn default() -> Self {
        Self {
            resolver_bits: 16,
            tracking_hz: 500.0,
            tracking_damping: core::f64::consts::FRAC_1_SQRT_2,
            errors: ResolverErrors::default(),
        }
    }
}

/// Gains of the sampled tracking loop, both per tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrackingGains {
    /// Share of the error that the position takes up.
    pub(crate) position: f64,
    /// Share of the error that the speed (increments a tick) takes up.
    pub(crate) speed: f64,
}

impl FeedbackParams {
    /// Gains of the tracking loop for a tick of `dt_s`.
    pub(crate) fn tracking_gains(&self, dt_s: f64) -> TrackingGains {
        // Poles s = −ζω ± jω√(1−ζ²) mapped by z = (1 + sT/2)/(1 − sT/2). The loop below has the characteristic polynomial
        // z² − (2 − k1 − k2) z + (1 − k1). No exp, no cos: the gains are the same bits on every machine.
        let wt = core::f64::consts::TAU * self.tracking_hz * dt_s;
        let (damping, quarter) = (self.tracking_damping * wt, 0.25 * wt * wt);
        let denominator = 1.0 + damping + quarter;
        let product = (1.0 - damping + quarter) / denominator;
        let sum = 2.0 * (1.0 - quarter) / denominator;
        let position = 1.0 - product;
        TrackingGains {
            position,
            speed: 2.0 - position - sum,
        }
    }
}

/// Position and speed as the controllers see them.
///
/// The position is the exact angle rounded down to the resolver's step, without delay. The speed comes from a
/// second-order loop (type II) that tracks this position: an integrator holds the speed, so constant speed is followed
/// without error, and a step of the quantisation reaches the speed only through the loop's bandwidth.
#[doc(alias = "Resolver")]
#[derive(Debug, Clone)]
pub struct Feedback {
    pub(crate) mask: i64,
    pub(crate) position_gain: f64,
    pub(crate) speed_gain: f64,
    pub(crate) rad_s_per_inc_tick: f64,
    pub(crate) position: i64,
    pub(crate) error_inc: f64,
    pub(crate) speed_inc_per_tick: f64,
    disturbed: Option<Disturbed>,
}

/// A resolver with errors.
#[derive(Debug, Clone, Copy)]
struct Disturbed {
    errors: ResolverErrors,
    seed: u64,
    samples: u64,
}

/// Channel of the resolver's noise.
const CHANNEL: u64 = 0x7265_736F;

/// Increments in an arc minute.
const INC_PER_ARCMIN: f64 = INC_PER_REV as f64 / (360.0 * 60.0);

impl Disturbed {
    /// What the resolver shows, without noise.
    fn shown(&self, angle: ShaftAngle) -> ShaftAngle {
        let within = angle.increments().rem_euclid(INC_PER_REV) as f64 + angle.fraction();
        let phi = within * RAD_PER_INC;
        let error_arcmin =
            self.errors.once_arcmin * libm::sin(phi) + self.errors.twice_arcmin * libm::sin(2.0 * phi + 1.0);
        ShaftAngle::new(angle.increments(), angle.fraction() + error_arcmin * INC_PER_ARCMIN)
    }

    fn sample(&mut self, angle: ShaftAngle) -> i64 {
        self.samples += 1;
        let shown = self.shown(angle);
        let noise_inc = self.errors.noise_inc * noise::symmetric(self.seed, CHANNEL, self.samples);
        ShaftAngle::new(shown.increments(), shown.fraction() + noise_inc).increments()
    }
}

impl Feedback {
    /// A converter that has settled on a resting shaft, and a resolver without errors.
    #[must_use]
    pub fn new(params: &FeedbackParams, angle: ShaftAngle, dt_s: f64) -> Self {
        let bits = params.resolver_bits.clamp(8, 16);
        let mask = !((1_i64 << (16 - bits)) - 1);
        let gains = params.tracking_gains(dt_s);
        Self {
            mask,
            position_gain: gains.position,
            speed_gain: gains.speed,
            rad_s_per_inc_tick: RAD_PER_INC / dt_s,
            position: angle.increments() & mask,
            error_inc: 0.0,
            speed_inc_per_tick: 0.0,
            disturbed: None,
        }
    }

    /// The same with a resolver that errs as the parameters say; `seed` is that of its noise.
    #[must_use]
    pub fn with_errors(params: &FeedbackParams, angle: ShaftAngle, dt_s: f64, seed: u64) -> Self {
        let disturbed = Disturbed {
            errors: params.errors,
            seed,
            samples: 0,
        };
        Self {
            disturbed: Some(disturbed),
            ..Self::new(params, disturbed.shown(angle), dt_s)
        }
    }

    /// Increments that the resolver shows for an angle, without noise and at its finest.
    #[must_use]
    pub fn shown(&self, angle: ShaftAngle) -> i64 {
        self.disturbed
            .map_or(angle, |resolver| resolver.shown(angle))
            .increments()
    }

    /// Samples the shaft at the end of a tick.
    #[inline]
    pub fn sample(&mut self, angle: ShaftAngle) {
        let increments = match &mut self.disturbed {
            None => angle.increments(),
            Some(resolver) => resolver.sample(angle),
        };
        let position = increments & self.mask;
        // Only differences enter: exact however far the shaft has turned.
        let step = position.wrapping_sub(self.position) as f64;
        self.position = position;
        let error = self.error_inc + step - self.speed_inc_per_tick;
        self.speed_inc_per_tick += self.speed_gain * error;
        self.error_inc = error - self.position_gain * error;
        if self.error_inc.abs() < SETTLED_INC && self.speed_inc_per_tick.abs() < SETTLED_INC {
            // A resting shaft reads as resting, and no denormal numbers are left behind.
            self.error_inc = 0.0;
            self.speed_inc_per_tick = 0.0;
        }
    }

    /// Measured position, increments since power-up.
    #[must_use]
    pub fn position(&self) -> i64 {
        self.position
    }

    /// Measured speed, rad/s.
    #[must_use]
    pub fn omega(&self) -> f64 {
        self.speed_inc_per_tick * self.rad_s_per_inc_tick
    }

    /// Lets the converter settle at once on a shaft that already turns: the initial state of a trial.
    pub fn preset(&mut self, angle: ShaftAngle, omega_mech_rad_s: f64) {
        self.position = self.shown(angle) & self.mask;
        self.error_inc = 0.0;
        self.speed_inc_per_tick = omega_mech_rad_s / self.rad_s_per_inc_tick;
    }
}

/// Increments below which the tracking loop counts as settled.
pub(crate) const SETTLED_INC: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Rpm;

    const DT_S: f64 = 125e-6;

    fn run(params: &FeedbackParams, ticks: u32, angle_inc: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut feedback = Feedback::new(params, ShaftAngle::default(), DT_S);
        (1..=ticks)
            .map(|n| {
                feedback.sample(ShaftAngle::new(0, angle_inc(f64::from(n) * DT_S)));
                feedback.omega()
            })
            .collect()
    }

    #[test]
    fn eleven_bits_are_steps_of_32_increments() {
        // Source: 9300 facts 4.6, "1 step = 32 inc".
        let params = FeedbackParams {
            resolver_bits: 11,
            ..FeedbackParams::default()
        };
        let mut feedback = Feedback::new(&params, ShaftAngle::default(), DT_S);
        for (angle, expected) in [(31, 0), (32, 32), (65_535, 65_504), (-1, -32), (3_074_216, 3_074_208)] {
            feedback.sample(ShaftAngle::new(angle, 0.5));
            assert_eq!(feedback.position(), expected);
        }
    }

    #[test]
    fn a_constant_speed_is_read_without_error() {
        // 2814.53 rpm = 3074.216 inc/ms (9300 facts 4.6); type II: no stationary error, ripple of the quantisation only.
        let omegas = run(&FeedbackParams::default(), 4000, |t| 3_074_216.0 * t);
        let settled = &omegas[400..];
        let mean = settled.iter().sum::<f64>() / settled.len() as f64;
        assert!(
            (Rpm::from_rad_s(mean).0 - 2814.53).abs() < 0.01,
            "{}",
            Rpm::from_rad_s(mean).0
        );
        let worst = settled.iter().map(|o| (o - mean).abs()).fold(0.0, f64::max);
        // The drive itself shows 0.73…2 rpm of noise (9300 facts 4.6, standstill figures).
        assert!(Rpm::from_rad_s(worst).0 < 2.0, "{}", Rpm::from_rad_s(worst).0);
    }

    #[test]
    fn an_acceleration_is_read_late_by_two_damping_over_frequency() {
        // Lag of the speed of a type-II loop: 2ζ/ω_n − T/2 = 0.388 ms at 500 Hz and ζ = 1/√2.
        let alpha_inc = 589.5 / RAD_PER_INC;
        let omegas = run(&FeedbackParams::default(), 2000, |t| 0.5 * alpha_inc * t * t);
        let lags: Vec<f64> = (1000..2000)
            .map(|n| f64::from(n + 1) * DT_S - omegas[n as usize] / 589.5)
            .collect();
        let mean = lags.iter().sum::<f64>() / lags.len() as f64;
        assert!((mean - 0.388e-3).abs() < 5e-6, "{mean}");
    }

    #[test]
    fn a_resting_shaft_reads_exactly_zero_again() {
        let mut feedback = Feedback::new(&FeedbackParams::default(), ShaftAngle::default(), DT_S);
        for n in 0..4000_i64 {
            feedback.sample(ShaftAngle::new(n.min(1000) * 7, 0.3));
        }
        assert_eq!(feedback.omega(), 0.0);
        assert_eq!(feedback.position(), 7000);
    }
}
