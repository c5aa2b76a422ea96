//! What real switches do to a voltage: dead time, voltage drops, pulses.

use super::phases::Phases;
use crate::plant::{Dq, Interval, RotorFixed, ShaftAngle, StatorFixed};
use crate::units::{INC_PER_REV, RAD_PER_INC};

/// Switches of the inverter, from fidelity F2 on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverterParams {
    /// Dead time between the switches of a phase, s, less what switching on is faster than off. Assumed.
    #[doc(alias = "Totzeit")]
    pub dead_time_s: f64,
    /// Voltage over a conducting switch or diode without current, V. Assumed.
    pub drop_v: f64,
    /// Resistance that comes to it with the current, Ω. Assumed.
    pub drop_ohm: f64,
    /// Current, A, below which dead time and drop fade out linearly, because the ripple makes both switches conduct within a
    /// period. Assumed.
    pub fading_a: f64,
}

impl Default for InverterParams {
    fn default() -> Self {
        Self {
            dead_time_s: 2.0e-6,
            drop_v: 1.2,
            drop_ohm: 0.1,
            fading_a: 0.03,
        }
    }
}

/// Where rotor and link stand at the start of a tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SwitchingPoint {
    /// Current in the rotor-fixed frame, A.
    pub(crate) current: Dq,
    /// Angle of the shaft.
    pub(crate) angle: ShaftAngle,
    /// Speed of the shaft, rad/s.
    pub(crate) omega: f64,
    /// Voltage of the link, V.
    pub(crate) u_dc: f64,
}

/// The output stage with its errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Switches {
    params: InverterParams,
    n_p: u32,
    period_s: f64,
}

/// Up to seven states of the switches in a pulse period.
pub(crate) type Pulses = [Option<Interval<StatorFixed>>; 7];

impl Switches {
    pub(crate) fn new(params: &InverterParams, n_p: u32, period_s: f64) -> Self {
        Self {
            params: *params,
            n_p,
            period_s,
        }
    }

    /// F2: the mean voltage of the period, in the rotor's frame.
    pub(crate) fn mean(&self, demanded: Dq, at: &SwitchingPoint) -> Interval<RotorFixed> {
        let theta = self.theta_in_the_middle(at);
        let currents = Phases::from_stator(at.current.turned_by(theta));
        let dead_v = self.params.dead_time_s / self.period_s * at.u_dc;
        let dead = currents.map(|i| dead_v * self.direction(i));
        let dead = dead.to_stator().turned_by(-theta);
        let drop_v = self.drop(currents).turned_by(-theta);
        Interval {
            terminals: RotorFixed(demanded - dead - drop_v),
            drop_v,
            duration_s: self.period_s,
        }
    }

    /// F3: the pulses of a period, symmetrical about its middle, with a common share that makes the most of the link.
    pub(crate) fn pulses(&self, demanded: Dq, at: &SwitchingPoint) -> Pulses {
        let theta = self.theta_in_the_middle(at);
        let currents = Phases::from_stator(at.current.turned_by(theta));
        let wanted = Phases::from_stator(demanded.turned_by(theta));
        let [u, v, w] = wanted.0;
        let common = -0.5 * (u.max(v).max(w) + u.min(v).min(w));
        let mut edges = [(0.0, 0.0); 3];
        for ((edge, voltage), current) in edges.iter_mut().zip(wanted.0).zip(currents.0) {
            let share = if at.u_dc > 0.0 {
                0.5 + (voltage + common) / at.u_dc
            } else {
                0.5
            };
            *edge = self.edges(share.clamp(0.0, 1.0), current);
        }
        let drop_v = self.drop(currents);
        let mut moments = [0.0, self.period_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (n, (rise_s, fall_s)) in edges.into_iter().enumerate() {
            moments[2 + 2 * n] = rise_s;
            moments[3 + 2 * n] = fall_s;
        }
        moments.sort_by(f64::total_cmp);
        let mut pulses = [None; 7];
        for (pulse, span) in pulses.iter_mut().zip(moments.windows(2)) {
            let duration_s = span[1] - span[0];
            if duration_s <= 0.0 {
                continue;
            }
            let middle_s = 0.5 * (span[0] + span[1]);
            let legs = edges.map(|(rise_s, fall_s)| {
                if rise_s <= middle_s && middle_s < fall_s {
                    0.5 * at.u_dc
                } else {
                    -0.5 * at.u_dc
                }
            });
            *pulse = Some(Interval {
                terminals: StatorFixed {
                    voltage: Phases(legs).to_stator() - drop_v,
                    theta_el_rad: self.theta(at),
                    n_p: f64::from(self.n_p),
                },
                drop_v,
                duration_s,
            });
        }
        pulses
    }

    /// When a phase goes high and low again, s since the start of the period.
    ///
    /// A current out of the phase keeps it low during the dead time, one into it high: the first rises late, the second falls late.
    fn edges(&self, share: f64, current: f64) -> (f64, f64) {
        let half = 0.5 * share * self.period_s;
        let late_s = self.params.dead_time_s * self.direction(current);
        let middle = 0.5 * self.period_s;
        let rise = middle - half + late_s.max(0.0);
        let fall = middle + half - late_s.min(0.0);
        (
            rise.min(self.period_s),
            fall.clamp(rise.min(self.period_s), self.period_s),
        )
    }

    /// Voltage that the switches take, in the stator's frame.
    fn drop(&self, currents: Phases) -> Dq {
        currents
            .map(|i| self.params.drop_v * self.direction(i) + self.params.drop_ohm * i)
            .to_stator()
    }

    /// −1…1.
    fn direction(&self, current: f64) -> f64 {
        (current / self.params.fading_a.max(1e-6)).clamp(-1.0, 1.0)
    }

    fn theta(&self, at: &SwitchingPoint) -> f64 {
        electrical_angle(at.angle, self.n_p)
    }

    fn theta_in_the_middle(&self, at: &SwitchingPoint) -> f64 {
        self.theta(at) + 0.5 * f64::from(self.n_p) * at.omega * self.period_s
    }
}

/// Electrical angle of the rotor, rad, `0.0..2π·n_p`-reduced to one electrical turn.
pub(crate) fn electrical_angle(angle: ShaftAngle, n_p: u32) -> f64 {
    let whole = angle.increments().wrapping_mul(i64::from(n_p)).rem_euclid(INC_PER_REV);
    (whole as f64 + angle.fraction() * f64::from(n_p)) * RAD_PER_INC
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    const PERIOD_S: f64 = 125e-6;

    fn switches(params: InverterParams) -> Switches {
        Switches::new(&params, 3, PERIOD_S)
    }

    fn ideal() -> InverterParams {
        InverterParams {
            dead_time_s: 0.0,
            drop_v: 0.0,
            drop_ohm: 0.0,
            ..InverterParams::default()
        }
    }

    fn at(current: Dq, increments: i64) -> SwitchingPoint {
        SwitchingPoint {
            current,
            angle: ShaftAngle::new(increments, 0.25),
            omega: 0.0,
            u_dc: 565.7,
        }
    }

    /// Mean of the pulses, turned back into the rotor's frame.
    fn mean_of(pulses: &Pulses, theta: f64) -> Dq {
        let mut sum = Dq::ZERO;
        let mut time_s = 0.0;
        for pulse in pulses.iter().flatten() {
            sum = sum + pulse.terminals.voltage * pulse.duration_s;
            time_s += pulse.duration_s;
        }
        assert!((time_s - PERIOD_S).abs() < 1e-15, "the pulses fill the period");
        (sum * (1.0 / PERIOD_S)).turned_by(-theta)
    }

    #[test]
    fn ideal_pulses_have_the_demanded_mean_at_every_angle_up_to_the_circle() {
        // The largest vector with a common share is U_dc/√3 (design, section 5).
        let switches = switches(ideal());
        for increments in (0..65_536).step_by(777) {
            let at = at(Dq::ZERO, increments);
            for demanded in [Dq::new(0.0, 565.7 / 3.0_f64.sqrt()), Dq::new(-80.0, 20.0), Dq::ZERO] {
                let pulses = switches.pulses(demanded, &at);
                let mean = mean_of(&pulses, electrical_angle(at.angle, 3));
                assert!((mean - demanded).magnitude() < 1e-9, "{increments} {mean:?}");
                assert!(pulses.iter().flatten().count() <= 7);
            }
        }
    }

    #[test]
    fn dead_time_costs_each_phase_its_share_of_the_link_against_the_current() {
        // 2 µs of 125 µs at 565.7 V are 9.05 V a phase. Phase U carries 1 A, V and W −0.5 A each: signs +, −, −, a vector of
        // 4/3 · 9.05 = 12.07 V along U (Clarke).
        let params = InverterParams {
            dead_time_s: 2e-6,
            ..ideal()
        };
        let switches = switches(params);
        let at = SwitchingPoint {
            angle: ShaftAngle::default(),
            ..at(Dq::new(1.0, 0.0), 0)
        };
        let expected = 4.0 / 3.0 * 2.0 / 125.0 * 565.7;
        let demanded = Dq::new(50.0, 30.0);
        let mean = switches.mean(demanded, &at).terminals.0;
        assert!((demanded.d - mean.d - expected).abs() < 1e-9 && (mean.q - demanded.q).abs() < 1e-9);
        let pulsed = mean_of(&switches.pulses(demanded, &at), 0.0);
        assert!((pulsed - mean).magnitude() < 1e-9, "{pulsed:?} {mean:?}");
    }

    #[test]
    fn the_loss_of_the_switches_is_current_times_drop_of_each_phase() {
        // 1 A, −0.5 A, −0.5 A with 1.2 V + 0.1 Ω: 1.3 + 2 · 0.5 · 1.25 = 2.55 W. In a vector of the frame: 3/2 of the product.
        let switches = switches(InverterParams {
            dead_time_s: 0.0,
            ..InverterParams::default()
        });
        let at = SwitchingPoint {
            angle: ShaftAngle::default(),
            ..at(Dq::new(1.0, 0.0), 0)
        };
        let loss_w = 1.5 * switches.mean(Dq::ZERO, &at).drop_v.dot(at.current);
        assert!((loss_w - 2.55).abs() < 1e-12, "{loss_w}");
    }

    #[test]
    fn three_electrical_turns_make_one_of_the_shaft() {
        let third = electrical_angle(ShaftAngle::new(65_536 / 3, 1.0 / 3.0), 3);
        assert!(third.abs() < 1e-9 || (third - TAU).abs() < 1e-9, "{third}");
        assert!((electrical_angle(ShaftAngle::new(-65_536 / 12, -1.0 / 3.0), 3) - 0.75 * TAU).abs() < 1e-3);
    }
}
