//! From units to increments, exactly.

use crate::code::CodeStore;
use crate::code::table::number::{C1202, C1203, C1204, C1240, C1250};

/// Increments per motor revolution.
///
/// Source: 9300 facts 4.6.
pub const INCREMENTS_PER_REVOLUTION: i64 = 65_536;

/// What becomes of the fraction of an increment that a length leaves over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Rounding {
    /// Cut off, as in the drive: relative feeds fall short by 0.455 inc per 1200.0 mm, adding up.
    #[default]
    Truncate,
    /// Kept and added to the next relative length: n feeds are never more than one increment short.
    ///
    /// DEVIATION: the drive cannot do this; film-feed specification, section 11 asks for it.
    CarryResidue,
}

/// The exact ratio of increments to units (mm): 65536 · C1202 / (C1203 · C1204).
///
/// Lengths come as ×10000 integers, so that `increments = length_e4 · 65536·C1202_e4 / (C1203_e4·C1204_e4)` needs
/// integers only. Valid for every value the codes accept: no product exceeds 2^78.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    numerator: i128,
    denominator: i128,
}

impl Resolution {
    /// The resolution that C1202, C1203 and C1204 give now.
    pub fn from_codes(codes: &CodeStore) -> Self {
        Self::new(codes.raw(C1202, 0), codes.raw(C1203, 0), codes.raw(C1204, 0))
    }

    /// From gear numerator, gear denominator and feed constant, each ×10000.
    ///
    /// Values below 1 (which no code accepts) count as 1.
    pub fn new(gear_numerator_e4: i32, gear_denominator_e4: i32, feed_constant_e4: i32) -> Self {
        let [n, d, f] =
            [gear_numerator_e4, gear_denominator_e4, feed_constant_e4].map(|value| i128::from(value.max(1)));
        Self {
            numerator: i128::from(INCREMENTS_PER_REVOLUTION) * n,
            denominator: d * f,
        }
    }

    /// Whole increments of a length, truncated toward zero.
    pub fn whole_increments(&self, length_e4: i32) -> i64 {
        narrow(i128::from(length_e4) * self.numerator / self.denominator)
    }

    /// Whole increments of a length plus what earlier lengths left over.
    pub fn carried_increments(&self, length_e4: i32, residue: &mut Residue) -> i64 {
        let exact = i128::from(length_e4) * self.numerator + residue.in_parts_of(self.denominator);
        residue.remainder = exact % self.denominator;
        residue.denominator = self.denominator;
        narrow(exact / self.denominator)
    }

    /// A number of increments as a length ×10000, truncated toward zero and limited to 32 bits.
    pub fn units_e4(&self, increments: i64) -> i32 {
        let exact = i128::from(increments) * self.denominator / self.numerator;
        exact.clamp(i128::from(i32::MIN), i128::from(i32::MAX)) as i32
    }

    /// Increments per unit.
    pub fn increments_per_unit(&self) -> f64 {
        self.numerator as f64 / self.denominator as f64 * 10_000.0
    }

    /// Increments per unit ×10000, truncated and limited to what C1205 shows.
    pub fn increments_per_unit_e4(&self) -> i32 {
        let exact = self.numerator * 100_000_000 / self.denominator;
        exact.min(2_140_000_000) as i32
    }

    /// A velocity in inc/ms from a percentage ×10000 and the reference C1240 in units/s ×10000.
    pub fn velocity(&self, percent_e4: i32, v_max_e4: i32) -> f64 {
        let units_per_second = f64::from(v_max_e4) / 10_000.0 * (f64::from(percent_e4) / 1_000_000.0);
        units_per_second * self.increments_per_unit() / 1000.0
    }

    /// An acceleration in inc/ms² from a percentage ×10000 and the reference C1250 in units/s² ×10000.
    pub fn acceleration(&self, percent_e4: i32, a_max_e4: i32) -> f64 {
        self.velocity(percent_e4, a_max_e4) / 1000.0
    }

    /// [`Self::velocity`] with the reference read from the codes.
    pub fn velocity_from_codes(&self, percent_e4: i32, codes: &CodeStore) -> f64 {
        self.velocity(percent_e4, codes.raw(C1240, 0))
    }

    /// [`Self::acceleration`] with the reference read from the codes.
    pub fn acceleration_from_codes(&self, percent_e4: i32, codes: &CodeStore) -> f64 {
        self.acceleration(percent_e4, codes.raw(C1250, 0))
    }
}

/// The fraction of an increment that relative lengths have left over so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Residue {
    remainder: i128,
    denominator: i128,
}

impl Residue {
    /// The fraction in increments, above −1 and below 1.
    pub fn increments(&self) -> f64 {
        if self.denominator == 0 {
            0.0
        } else {
            self.remainder as f64 / self.denominator as f64
        }
    }

    /// The remainder as parts of `denominator`. A changed gear or feed constant makes the old fraction meaningless.
    fn in_parts_of(&self, denominator: i128) -> i128 {
        if self.denominator == denominator {
            self.remainder
        } else {
            0
        }
    }
}

/// Beyond ±2^50 inc (half a million kilometres of film) there is no axis; the limit keeps sums of targets in range.
const FARTHEST: i128 = 1 << 50;

fn narrow(value: i128) -> i64 {
    value.clamp(-FARTHEST, FARTHEST) as i64
}
