use core::fmt;

use serde::Serialize;

use super::{LoopKind, Margins, StepResponse};
use crate::AxisParams;

/// The figures of a loop: what `lenze9300 step` and `lenze9300 bode` print.
///
/// As JSON the fields keep their names and order, `which` being `loop`; a figure that does not exist is null.
/// [`Display`](fmt::Display) gives a table for people.
#[derive(Debug, Serialize)]
pub struct LoopFigures {
    /// Which loop.
    #[serde(rename = "loop")]
    pub which: LoopKind,
    /// Period of the current controller, µs.
    pub tick_us: f64,
    /// Proportional gain: V/A, Nm·s/rad or 1/s.
    pub kp: f64,
    /// Integral time, ms; none without an integral part.
    pub tn_ms: Option<f64>,
    /// By how much the step response passes its set-value, %.
    pub overshoot_percent: Option<f64>,
    /// First reach of the set-value, s.
    pub rise_s: Option<f64>,
    /// From when on the response stays within ±2 %, s.
    pub settle_2pct_s: Option<f64>,
    /// Where the gain of the open loop falls through 1, Hz.
    pub crossover_hz: Option<f64>,
    /// Distance of the phase from −180° there, degrees.
    pub phase_margin_deg: Option<f64>,
    /// By how much the gain may rise, dB.
    pub gain_margin_db: Option<f64>,
}

impl LoopFigures {
    /// From what was measured. Without a step response (an unstable loop) its figures are missing.
    #[must_use]
    pub fn new(which: LoopKind, params: &AxisParams, step: Option<&StepResponse>, margins: &Margins) -> Self {
        let gains = which.gains(params);
        Self {
            which,
            tick_us: params.tick_s() * 1e6,
            kp: gains.k_p,
            tn_ms: gains.t_n_s.map(|t_n_s| t_n_s * 1000.0),
            overshoot_percent: step.map(StepResponse::overshoot_percent),
            rise_s: step.and_then(StepResponse::rise_s),
            settle_2pct_s: step.and_then(|step| step.settle_s(0.02)),
            crossover_hz: margins.crossover_hz,
            phase_margin_deg: margins.phase_margin_deg,
            gain_margin_db: margins.gain_margin_db,
        }
    }

    /// The figures as one JSON object on one line.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Plain numbers and fixed keys: nothing that could fail to be written.
        serde_json::to_string(self).unwrap_or_default()
    }
}

impl fmt::Display for LoopFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let figure = |value: Option<f64>, factor: f64, digits: usize, unit: &str| {
            value.map_or_else(
                || "-".to_string(),
                |value| format!("{:.digits$} {unit}", value * factor),
            )
        };
        let rows = [
            ("loop", self.which.name().to_string()),
            ("tick", format!("{} µs", self.tick_us)),
            ("Kp", format!("{:.6} {}", self.kp, self.which.gain_unit())),
            ("Tn", figure(self.tn_ms, 1.0, 3, "ms")),
            ("overshoot", figure(self.overshoot_percent, 1.0, 2, "%")),
            ("rise (first reach)", figure(self.rise_s, 1000.0, 3, "ms")),
            ("settling (2 %)", figure(self.settle_2pct_s, 1000.0, 3, "ms")),
            ("crossover", figure(self.crossover_hz, 1.0, 2, "Hz")),
            ("phase margin", figure(self.phase_margin_deg, 1.0, 2, "°")),
            ("gain margin", figure(self.gain_margin_db, 1.0, 2, "dB")),
        ];
        let lines: Vec<String> = rows.iter().map(|(name, value)| format!("{name:<20}{value}")).collect();
        f.write_str(&lines.join("\n"))
    }
}
