use super::Dq;

/// What the terminals of the motor see while the output stage does not change.
///
/// A voltage is constant in one frame: that of the rotor for an averaged inverter which advances its angle through the tick
/// ([`RotorFixed`]), that of the stator while switches stand still ([`StatorFixed`]).
pub trait Terminals {
    /// Voltage in the rotor-fixed frame, V, when the shaft has turned by `theta_mech_rad` since the start of the tick.
    fn voltage(&self, theta_mech_rad: f64) -> Dq;

    /// A current of the rotor-fixed frame in the frame in which the voltage is constant, A.
    ///
    /// Its integral times that voltage is the energy that passed the terminals.
    fn current_in_own_frame(&self, current: Dq, theta_mech_rad: f64) -> Dq;

    /// The voltage in its own frame, V.
    fn own_voltage(&self) -> Dq;
}

/// A time during which the output stage does not change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval<T> {
    /// What the motor sees.
    pub terminals: T,
    /// Voltage that the switches themselves take, in the same frame, V; their loss is its product with the current.
    pub drop_v: Dq,
    /// How long, s.
    pub duration_s: f64,
}

/// A voltage that turns with the rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorFixed(pub Dq);

impl Terminals for RotorFixed {
    #[inline]
    fn voltage(&self, _: f64) -> Dq {
        self.0
    }

    #[inline]
    fn current_in_own_frame(&self, current: Dq, _: f64) -> Dq {
        current
    }

    #[inline]
    fn own_voltage(&self) -> Dq {
        self.0
    }
}

/// A voltage that stands still: `d` along the axis of phase U (α), `q` 90 degrees ahead (β).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatorFixed {
    /// The voltage in α and β, V.
    pub voltage: Dq,
    /// Electrical angle of the rotor at the start of the tick, rad.
    pub theta_el_rad: f64,
    /// Pole pairs.
    pub n_p: f64,
}

impl StatorFixed {
    fn theta_el(&self, theta_mech_rad: f64) -> f64 {
        self.theta_el_rad + self.n_p * theta_mech_rad
    }
}

impl Terminals for StatorFixed {
    fn voltage(&self, theta_mech_rad: f64) -> Dq {
        self.voltage.turned_by(-self.theta_el(theta_mech_rad))
    }

    fn current_in_own_frame(&self, current: Dq, theta_mech_rad: f64) -> Dq {
        current.turned_by(self.theta_el(theta_mech_rad))
    }

    fn own_voltage(&self) -> Dq {
        self.voltage
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    #[test]
    fn a_standing_voltage_lags_in_the_frame_of_a_rotor_that_turns() {
        // Rotor at 90° electrical: what lies along α lies along −q.
        let terminals = StatorFixed {
            voltage: Dq::new(100.0, 0.0),
            theta_el_rad: 0.0,
            n_p: 3.0,
        };
        let seen = terminals.voltage(FRAC_PI_2 / 3.0);
        assert!(seen.d.abs() < 1e-12 && (seen.q + 100.0).abs() < 1e-12, "{seen:?}");
    }

    #[test]
    fn the_power_is_the_same_in_both_frames() {
        let terminals = StatorFixed {
            voltage: Dq::new(100.0, -30.0),
            theta_el_rad: 0.7,
            n_p: 3.0,
        };
        let current = Dq::new(0.4, 1.2);
        let rotor = terminals.voltage(0.1).dot(current);
        let stator = terminals
            .own_voltage()
            .dot(terminals.current_in_own_frame(current, 0.1));
        assert!((rotor - stator).abs() < 1e-12 * rotor.abs());
    }
}
