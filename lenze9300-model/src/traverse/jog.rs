//! Manual traversing.

/// Direction asked for by MANUAL-POS and MANUAL-NEG.
#[doc(alias = "Handfahren")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JogDirection {
    /// Forward.
    Positive,
    /// Backward.
    Negative,
    /// None of the signals, or both. Source: 9300 facts 4.3.
    Standstill,
}

impl JogDirection {
    /// The direction two signals ask for together.
    pub const fn from_signals(positive: bool, negative: bool) -> Self {
        match (positive, negative) {
            (true, false) => Self::Positive,
            (false, true) => Self::Negative,
            (false, false) | (true, true) => Self::Standstill,
        }
    }

    /// A speed (magnitude) in this direction.
    pub fn velocity(self, speed: f64) -> f64 {
        match self {
            Self::Positive => speed,
            Self::Negative => -speed,
            Self::Standstill => 0.0,
        }
    }
}

/// Speed and ramp of manual traversing. Assumed: the codes of the drive for it are not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JogParameters {
    /// Speed, % of C1240 ×10000, 0 to 100 %.
    pub velocity_percent_e4: i32,
    /// Acceleration and deceleration, % of C1250 ×10000, above 0 to 100 %.
    pub acceleration_percent_e4: i32,
}

impl Default for JogParameters {
    fn default() -> Self {
        Self {
            velocity_percent_e4: 10_0000,
            acceleration_percent_e4: 100_0000,
        }
    }
}
