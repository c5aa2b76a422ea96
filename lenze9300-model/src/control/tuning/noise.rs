use crate::plant::FeedbackParams;

/// How far the noise of the resolver lets the speed gain go.
///
/// Noise of the position reaches the torque set-value through the tracking loop and the proportional part: σ_M = K_p
/// σ_ω. A ripple that is to stay below some torque bounds K_p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLimit {
    /// Standard deviation of the speed that the controller sees, rad/s.
    pub speed_rms_rad_s: f64,
    /// Largest proportional gain, Nm·s/rad; infinite without noise.
    pub k_p_max: f64,
}

impl NoiseLimit {
    /// For white noise of `position_rms_inc` (standard deviation, increments, one value a tick) and a torque ripple
    /// of at most
    /// `torque_rms_nm` (standard deviation, Nm).
    #[must_use]
    pub fn new(feedback: &FeedbackParams, tick_s: f64, position_rms_inc: f64, torque_rms_nm: f64) -> Self {
        let speed_rms_rad_s = position_rms_inc.abs() * speed_noise_gain(feedback, tick_s);
        Self {
            speed_rms_rad_s,
            k_p_max: torque_rms_nm / speed_rms_rad_s,
        }
    }
}

/// Standard deviation of the read speed, rad/s, for white position noise of one increment (standard deviation) a tick.
///
/// The tracking loop is linear: the variance is the sum of the squares of its answer to a single increment. The poles
/// are those of [`FeedbackParams`]; the sum ends when what is left is below 1e-12 of it.
#[must_use]
pub fn speed_noise_gain(feedback: &FeedbackParams, tick_s: f64) -> f64 {
    let gains = feedback.tracking_gains(tick_s);
    // The single increment comes as a step up in this tick and a step down in the next.
    let (mut error, mut speed, mut sum) = (0.0_f64, 0.0_f64, 0.0_f64);
    for tick in 0..1_000_000_u32 {
        let step = match tick {
            0 => 1.0,
            1 => -1.0,
            _ => 0.0,
        };
        let e = error + step - speed;
        speed += gains.speed * e;
        error = e - gains.position * e;
        sum += speed * speed;
        if tick > 8 && error * error + speed * speed < 1e-12 * sum {
            break;
        }
    }
    sum.sqrt() * crate::units::RAD_PER_INC / tick_s
}

/// Standard deviation of the rounding of a converter with so many bits, increments: a step over √12.
///
/// It acts like white noise as long as the shaft turns by more than a step a tick; at standstill a single step toggles.
#[must_use]
pub fn quantisation_rms_inc(resolver_bits: u8) -> f64 {
    f64::from(1_u32 << (16 - resolver_bits.clamp(8, 16))) / 12.0_f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::symmetric;
    use crate::plant::{Feedback, ShaftAngle};

    const TICK_S: f64 = 125e-6;

    #[test]
    fn the_gain_agrees_with_noise_sent_through_the_converter() {
        // Oracle: 200 000 rounded random positions through the converter itself. White noise of 100 increments, so
        // that its own rounding (0.29 inc) does not count; the estimate of a standard deviation is good to 1/√(2n).
        let params = FeedbackParams::default();
        let mut feedback = Feedback::new(&params, ShaftAngle::default(), TICK_S);
        let (mut sum, mut squares) = (0.0, 0.0);
        let n = 200_000_u64;
        for k in 0..n {
            let inc = (100.0 * 3.0_f64.sqrt() * symmetric(1, 0, k)).round() as i64;
            feedback.sample(ShaftAngle::new(inc, 0.0));
            sum += feedback.omega();
            squares += feedback.omega() * feedback.omega();
        }
        let n = n as f64;
        let measured = (squares / n - (sum / n) * (sum / n)).sqrt();
        let expected = 100.0 * speed_noise_gain(&params, TICK_S);
        // Correlated samples: a hundredth is four standard deviations of the estimate.
        assert!((measured / expected - 1.0).abs() < 0.01, "{measured} {expected}");
    }

    #[test]
    fn eleven_bits_are_32_times_as_noisy_as_sixteen_and_allow_a_32nd_of_the_gain() {
        // Source: 9300 facts 4.6: a step of 11 bits is 32 increments.
        let feedback = FeedbackParams::default();
        let limit = |bits| NoiseLimit::new(&feedback, TICK_S, quantisation_rms_inc(bits), 0.01);
        assert!((limit(16).k_p_max / limit(11).k_p_max - 32.0).abs() < 1e-9);
    }

    #[test]
    fn a_slower_converter_allows_more_gain() {
        let slow = FeedbackParams {
            tracking_hz: 250.0,
            ..FeedbackParams::default()
        };
        assert!(speed_noise_gain(&slow, TICK_S) < speed_noise_gain(&FeedbackParams::default(), TICK_S));
    }

    #[test]
    fn without_noise_there_is_no_limit() {
        let limit = NoiseLimit::new(&FeedbackParams::default(), TICK_S, 0.0, 0.01);
        assert_eq!(limit.k_p_max, f64::INFINITY);
    }
}
