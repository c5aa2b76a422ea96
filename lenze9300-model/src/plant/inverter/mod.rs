pub(crate) mod phases;
mod switches;

use super::Dq;

pub use switches::InverterParams;
pub(crate) use switches::{Switches, SwitchingPoint, electrical_angle};

/// What the output stage does during a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutputStage {
    /// Pulses inhibited: the stage is high-resistance and the motor coasts.
    ///
    /// The free-wheeling diodes drive a phase current to zero within L·I·√3/U_dc, about 0.15 ms at the current limit: one
    /// tick. This fidelity sets the current to zero at once and returns its energy to the DC link. Rectification of
    /// the back EMF by the diodes is left out: it needs a line voltage above U_dc, thus a link below 200 V at 3000 rpm.
    #[doc(alias = "Impulssperre")]
    Inhibited,
    /// The stage holds this voltage, in the rotor-fixed frame, for the whole tick.
    Active(Dq),
}

/// Result of the modulator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Realised {
    /// Voltage that the stage will make; at most the demanded one, in the same direction.
    pub voltage: Dq,
    /// Whether the demanded voltage lay outside the circle.
    pub limited: bool,
}

/// Averaged inverter: the mean voltage of a pulse period, without dead time and device drops (fidelity F1).
///
/// The demanded vector is shortened to the circle of radius U_dc/√3, the largest one inside the hexagon of the six switching
/// states, so that the realised voltage stays sinusoidal. Its direction is kept. The vector is held in the rotor-fixed
/// frame, as if the drive advanced the angle through the tick; this spares sine and cosine.
#[inline]
#[must_use]
pub fn limit_to_voltage_circle(demanded: Dq, u_dc: f64) -> Realised {
    let max_squared = u_dc * u_dc * (1.0 / 3.0);
    let squared = demanded.dot(demanded);
    if squared <= max_squared {
        Realised {
            voltage: demanded,
            limited: false,
        }
    } else {
        shorten(demanded, max_squared / squared)
    }
}

/// Out of line, so that neither division nor root is computed when the vector lies inside, which is nearly always.
#[cold]
fn shorten(demanded: Dq, share_squared: f64) -> Realised {
    Realised {
        voltage: demanded * share_squared.sqrt(),
        limited: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_inside_the_circle_passes_unchanged() {
        let demanded = Dq::new(-100.0, 300.0);
        let realised = limit_to_voltage_circle(demanded, 565.685);
        assert_eq!(
            realised,
            Realised {
                voltage: demanded,
                limited: false
            }
        );
    }

    #[test]
    fn a_vector_outside_is_shortened_to_u_dc_by_root_3_in_its_direction() {
        // Source: design, section 5; radius 565.7/√3 = 326.6 V.
        let realised = limit_to_voltage_circle(Dq::new(-300.0, 400.0), 565.7);
        assert!(realised.limited);
        assert!((realised.voltage.magnitude() - 326.607).abs() < 1e-3);
        assert!((realised.voltage.q / realised.voltage.d + 400.0 / 300.0).abs() < 1e-12);
    }

    #[test]
    fn a_dead_link_makes_no_voltage() {
        let realised = limit_to_voltage_circle(Dq::new(0.0, 50.0), 0.0);
        assert_eq!(realised.voltage.magnitude(), 0.0);
        assert!(realised.limited);
        assert!(!limit_to_voltage_circle(Dq::ZERO, 0.0).limited);
    }
}
