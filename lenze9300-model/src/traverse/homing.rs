//! Homing: finding the machine's zero by a reference switch, the encoder's zero pulse, or both.
//!
//! ```text
//!             switch high                  at rest           switch low
//!  Seeking ───────────────► Braking ───────────────► Leaving ───────────► Approaching ── at rest ──► reference set
//!     │                                                                        ▲
//!     └── no switch to find: straight to the next zero pulse ─────────────────┘
//! ```
//!
//! The axis seeks the switch with the velocity of the record, turns round and leaves it slowly. The reference point is where
//! the switch falls, or the first zero pulse after that in the same direction. The axis stops on the reference point, which
//! then gets the value of the record's target.
//!
//! Assumed: that the drive homes with and without zero pulse is known (thesis ch. 5.4); how in detail is not (9300 facts 4.2).

use super::record::ProgramInput;

/// Increments between two zero pulses: one revolution of a two-pole resolver.
pub(super) const ZERO_PULSE_EVERY: i64 = super::resolution::INCREMENTS_PER_REVOLUTION;

/// Speed on leaving the switch, share of the record's velocity. Assumed.
pub(super) const SLOW: f64 = 0.1;

/// Rules of a homing record.
#[doc(alias = "Referenzfahrt")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomingRule {
    /// Where the search begins.
    pub direction: Direction,
    /// What marks the reference point.
    pub reference: HomingReference,
}

/// A direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Positions grow.
    Positive,
    /// Positions fall.
    Negative,
}

impl Direction {
    /// +1 or −1.
    pub const fn sign(self) -> i64 {
        match self {
            Self::Positive => 1,
            Self::Negative => -1,
        }
    }

    /// The other one.
    pub const fn reversed(self) -> Self {
        match self {
            Self::Positive => Self::Negative,
            Self::Negative => Self::Positive,
        }
    }
}

/// What marks the reference point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingReference {
    /// The place where the switch falls when it is left.
    Switch(ProgramInput),
    /// The first zero pulse behind that place.
    #[doc(alias = "Nullimpuls")]
    SwitchAndZeroPulse(ProgramInput),
    /// The next zero pulse; no switch.
    ZeroPulse,
}

impl HomingReference {
    /// The switch, if there is one.
    pub const fn switch(self) -> Option<ProgramInput> {
        match self {
            Self::Switch(input) | Self::SwitchAndZeroPulse(input) => Some(input),
            Self::ZeroPulse => None,
        }
    }
}

/// Where a homing stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HomingPhase {
    /// On the way to the switch.
    Seeking,
    /// On the switch, coming to rest.
    Braking,
    /// Off the switch, slowly.
    Leaving,
    /// On the way to the reference point.
    Approaching,
}

/// The reference point for a place at which the switch fell or the search began.
///
/// `resolver` is the position of the resolver when the axis is at `position`: its zero pulses lie at multiples of a revolution.
pub(super) fn reference_point(reference: HomingReference, direction: Direction, position: i64, resolver: i64) -> i64 {
    if let HomingReference::Switch(_) = reference {
        return position;
    }
    let behind = resolver.rem_euclid(ZERO_PULSE_EVERY);
    let way = match direction {
        // On a zero pulse the next one is a revolution away: it could have been missed by noise.
        Direction::Positive => ZERO_PULSE_EVERY - behind,
        Direction::Negative if behind == 0 => ZERO_PULSE_EVERY,
        Direction::Negative => behind,
    };
    position.saturating_add(direction.sign() * way)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_zero_pulse_lies_within_a_revolution_in_the_direction_of_travel() {
        // The resolver reads 1000 at position 70 000: zero pulses at 69 000 and 134 536.
        let point = |direction| reference_point(HomingReference::ZeroPulse, direction, 70_000, 1000);
        assert_eq!(point(Direction::Negative), 69_000);
        assert_eq!(point(Direction::Positive), 134_536);
        // Also with negative readings, and on the pulse itself.
        assert_eq!(
            reference_point(HomingReference::ZeroPulse, Direction::Positive, 0, -10),
            10
        );
        assert_eq!(
            reference_point(HomingReference::ZeroPulse, Direction::Negative, 0, 65_536),
            -65_536
        );
    }
}
