//! Units at the borders of the crate.
//!
//! Inside, everything is `f64` in SI units with the unit in the name; a newtype stands where a number leaves or enters.
//!
//! Source: 9300 facts 4.6 (65536 increments a revolution, percent of C0011).

use core::f64::consts::TAU;
use core::ops::{Add, Neg, Sub};

/// Increments of one motor revolution.
///
/// Source: film-feed specification, section 4; 9300 facts 4.6.
pub const INC_PER_REV: i64 = 65_536;

/// Radians of one increment.
pub(crate) const RAD_PER_INC: f64 = TAU / INC_PER_REV as f64;

/// Increments of one radian.
pub(crate) const INC_PER_RAD: f64 = INC_PER_REV as f64 / TAU;

/// A position or a way at the motor shaft, 65536 to the revolution.
#[doc(alias = "Inkremente")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Increments(pub i64);

impl Increments {
    /// The angle in radians; exact to one part in 2^52.
    #[must_use]
    pub fn to_radians(self) -> f64 {
        self.0 as f64 * RAD_PER_INC
    }

    /// The 32 bits that POS_ACT carries: wraps as the drive does, after ±2^31 increments.
    ///
    /// Source: 9300 facts 4.6, "32-bit wrap of POS-ACT".
    #[must_use]
    pub fn to_wrapping_i32(self) -> i32 {
        self.0 as i32
    }
}

impl Add for Increments {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

impl Sub for Increments {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }
}

impl Neg for Increments {
    type Output = Self;

    fn neg(self) -> Self {
        Self(self.0.wrapping_neg())
    }
}

/// A speed of the motor shaft in revolutions per minute.
#[doc(alias = "Drehzahl")]
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Rpm(pub f64);

impl Rpm {
    /// The speed in rad/s.
    #[must_use]
    pub fn to_rad_s(self) -> f64 {
        self.0 * (TAU / 60.0)
    }

    /// From a speed in rad/s.
    #[must_use]
    pub fn from_rad_s(omega_mech_rad_s: f64) -> Self {
        Self(omega_mech_rad_s * (60.0 / TAU))
    }

    /// Increments travelled in a millisecond, the unit of the function blocks.
    #[must_use]
    pub fn to_increments_per_ms(self) -> f64 {
        self.0 * (INC_PER_REV as f64 / 60_000.0)
    }

    /// Share of a reference speed, C0011 as a rule.
    #[must_use]
    pub fn percent_of(self, reference: Self) -> Percent {
        Percent(self.0 / reference.0 * 100.0)
    }
}

/// Hundredths of a reference.
#[doc(alias = "Prozent")]
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Percent(pub f64);

impl Percent {
    /// The share as a factor: 100 % is 1.
    #[must_use]
    pub fn to_factor(self) -> f64 {
        self.0 / 100.0
    }
}

/// A way of the film or of the tool.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Millimetres(pub f64);

/// A speed of the film or of the tool.
#[doc(alias = "Geschwindigkeit")]
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct MillimetresPerSecond(pub f64);

/// An acceleration of the film or of the tool.
#[doc(alias = "Beschleunigung")]
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct MillimetresPerSecondSquared(pub f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_speed_is_3276_8_increments_a_millisecond() {
        // Source: 9300 facts 4.6, "n_max in increments".
        assert!((Rpm(3000.0).to_increments_per_ms() - 3276.8).abs() < 1e-9);
    }

    #[test]
    fn film_speed_1200_mm_per_s_is_93_82_percent() {
        // Source: 9300 facts 4.6: 2814.53 rpm = 93.82 %.
        assert!((Rpm(2814.53).percent_of(Rpm(3000.0)).0 - 93.82).abs() < 0.005);
    }

    #[test]
    fn pos_act_wraps_after_2_to_the_31_increments() {
        assert_eq!(Increments(1 << 31).to_wrapping_i32(), i32::MIN);
        assert_eq!(Increments(-(1 << 31) - 1).to_wrapping_i32(), i32::MAX);
    }

    #[test]
    fn a_revolution_is_two_pi() {
        assert!((Increments(INC_PER_REV).to_radians() - TAU).abs() < 1e-12);
        assert!((Rpm::from_rad_s(Rpm(4000.0).to_rad_s()).0 - 4000.0).abs() < 1e-9);
    }
}
