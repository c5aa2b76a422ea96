use nalgebra::Complex;

use super::LinearLoop;

/// Stability margins of an open loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Frequency at which the gain falls through 1, Hz; of several the one with the least margin.
    #[doc(alias = "Durchtrittsfrequenz")]
    pub crossover_hz: Option<f64>,
    /// Distance of the phase from −180° there, degrees.
    #[doc(alias = "Phasenreserve")]
    pub phase_margin_deg: Option<f64>,
    /// Frequency at which the phase passes −180°, Hz.
    pub phase_crossover_hz: Option<f64>,
    /// By how much the gain may rise before the loop oscillates there, dB.
    #[doc(alias = "Amplitudenreserve")]
    pub gain_margin_db: Option<f64>,
}

/// One point of an open loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodePoint {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Gain, dB.
    pub gain_db: f64,
    /// Phase, degrees, continuous over the points.
    pub phase_deg: f64,
}

impl Margins {
    /// Margins of a loop.
    #[must_use]
    pub fn of(open_loop: &LinearLoop) -> Self {
        Self::of_response(open_loop.nyquist_hz(), |frequency_hz| open_loop.open_loop(frequency_hz))
    }

    /// Margins of any open loop from five decades below `nyquist_hz` up to it.
    ///
    /// Both crossings are looked for on 2000 logarithmic points and then halved down to 1e-12 of the frequency. At
    /// the Nyquist frequency the response of a sampled loop is real: negative, it counts as a crossing of −180°.
    #[must_use]
    pub fn of_response(nyquist_hz: f64, response: impl Fn(f64) -> Complex<f64>) -> Self {
        let mut margins = Self {
            crossover_hz: None,
            phase_margin_deg: None,
            phase_crossover_hz: None,
            gain_margin_db: None,
        };
        let log_gain = |value: Complex<f64>| value.norm().ln();
        let mut before: Option<(f64, Complex<f64>)> = None;
        for frequency in frequencies(nyquist_hz, POINTS) {
            let value = response(frequency);
            if let Some((last, last_value)) = before {
                if log_gain(last_value) > 0.0 && log_gain(value) <= 0.0 {
                    let at = bisect(last, frequency, |f| log_gain(response(f)) > 0.0);
                    margins.take_gain_crossing(at, response(at));
                }
                // The imaginary part changes its sign on the negative axis.
                if last_value.im * value.im < 0.0 && last_value.re < 0.0 && value.re < 0.0 {
                    let sign = last_value.im.signum();
                    let at = bisect(last, frequency, |f| response(f).im * sign > 0.0);
                    margins.take_phase_crossing(at, response(at).norm());
                }
            }
            before = Some((frequency, value));
        }
        let end = response(nyquist_hz);
        if end.re < 0.0 && end.im.abs() < 1e-6 * end.norm() {
            margins.take_phase_crossing(nyquist_hz, end.norm());
        }
        margins
    }

    fn take_gain_crossing(&mut self, at_hz: f64, value: Complex<f64>) {
        // Phase from −180°: that of −L.
        let margin = (-value).arg().to_degrees();
        if self.phase_margin_deg.is_none_or(|least| margin < least) {
            self.crossover_hz = Some(at_hz);
            self.phase_margin_deg = Some(margin);
        }
    }

    fn take_phase_crossing(&mut self, at_hz: f64, gain: f64) {
        let margin = -20.0 * gain.log10();
        if self.gain_margin_db.is_none_or(|least| margin.abs() < least.abs()) {
            self.phase_crossover_hz = Some(at_hz);
            self.gain_margin_db = Some(margin);
        }
    }
}

impl BodePoint {
    /// Gain and phase of a loop at `count` frequencies, three decades up to the Nyquist frequency.
    #[must_use]
    pub fn series(open_loop: &LinearLoop, count: usize) -> Vec<Self> {
        let nyquist_hz = open_loop.nyquist_hz();
        let mut phase_deg = 0.0_f64;
        let mut points: Vec<Self> = Vec::with_capacity(count);
        for frequency_hz in frequencies(nyquist_hz, count) {
            let value = open_loop.open_loop(frequency_hz);
            let raw = value.arg().to_degrees();
            phase_deg = if points.is_empty() {
                // A double integrator starts at ±180°: below, as everything else does.
                if raw > 90.0 { raw - 360.0 } else { raw }
            } else {
                raw + 360.0 * ((phase_deg - raw) / 360.0).round()
            };
            points.push(Self {
                frequency_hz,
                gain_db: 20.0 * value.norm().log10(),
                phase_deg,
            });
        }
        let first_shown = nyquist_hz * 1e-3;
        points.retain(|point| point.frequency_hz >= first_shown);
        points
    }
}

/// Frequencies at which crossings are looked for.
const POINTS: usize = 2000;

/// Logarithmic frequencies from five decades below the Nyquist frequency to just below it.
fn frequencies(nyquist_hz: f64, count: usize) -> impl Iterator<Item = f64> {
    let last = count.max(2) - 1;
    (0..=last).map(move |place| {
        let exponent = -5.0 + 5.0 * place as f64 / last as f64;
        nyquist_hz * 10.0_f64.powf(exponent).min(1.0 - 1e-9)
    })
}

/// Where `above` turns false, between a frequency at which it holds and one at which it does not.
fn bisect(mut low: f64, mut high: f64, above: impl Fn(f64) -> bool) -> f64 {
    while high - low > 1e-12 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if above(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    #[test]
    fn an_integrator_with_dead_time_has_its_textbook_margins() {
        // L = ω_c/(jω) · exp(−jωT): phase margin 90° − ω_c T, −180° at ω = π/2T with gain ω_c·2T/π.
        let (omega_c, t) = (100.0, 2e-3);
        let margins = Margins::of_response(2000.0, |f| {
            let omega = TAU * f;
            Complex::new(0.0, -omega_c / omega) * Complex::new(0.0, -omega * t).exp()
        });
        assert!((margins.crossover_hz.unwrap() - omega_c / TAU).abs() < 1e-9);
        assert!((margins.phase_margin_deg.unwrap() - (90.0 - (omega_c * t).to_degrees())).abs() < 1e-7);
        assert!((margins.phase_crossover_hz.unwrap() - 0.25 / t).abs() < 1e-7);
        let gain = omega_c * 2.0 * t / core::f64::consts::PI;
        assert!((margins.gain_margin_db.unwrap() + 20.0 * gain.log10()).abs() < 1e-7);
    }

    #[test]
    fn a_loop_that_never_reaches_1_has_no_crossover() {
        let margins = Margins::of_response(1000.0, |f| Complex::new(0.5, 0.0) / Complex::new(1.0, f / 100.0));
        assert_eq!(margins.crossover_hz, None);
        assert_eq!(margins.phase_margin_deg, None);
        assert_eq!(margins.gain_margin_db, None);
    }
}
