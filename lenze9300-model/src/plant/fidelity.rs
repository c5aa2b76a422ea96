/// How closely an axis is modelled, from the cheapest to the dearest; the controllers above are the same in all.
///
/// Source: design, section 5. What each level leaves out and how much that matters: `FIDELITY.md`.
///
/// ```
/// use lenze9300_model::plant::Fidelity;
///
/// assert_eq!("f2".parse(), Ok(Fidelity::WithErrors));
/// assert_eq!(Fidelity::default().to_string(), "f1");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum Fidelity {
    /// F0: the shaft takes on each speed set-value of the position controller at once, and so is where the interpolator wants it at the
    /// end of every millisecond. Torque, current and energy are those that this motion needs; the torque limit, the speed and
    /// the current controller do not act. For long series in which only the set-values matter.
    Kinematic,
    /// F1: an inverter that makes the mean voltage of each pulse period exactly, an exact measurement of the currents, a resolver without
    /// errors.
    #[default]
    Averaged,
    /// F2: as F1, with dead time and voltage drops of the switches, offset, gain, noise and resolution of the current
    /// measurement, errors of the resolver.
    WithErrors,
    /// F3: as F2, with each edge of the pulses: ripple of current and torque.
    Switched,
}

impl Fidelity {
    /// All levels, cheapest first.
    pub const ALL: [Self; 4] = [Self::Kinematic, Self::Averaged, Self::WithErrors, Self::Switched];

    /// `f0` to `f3`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kinematic => "f0",
            Self::Averaged => "f1",
            Self::WithErrors => "f2",
            Self::Switched => "f3",
        }
    }

    /// Whether measurements have errors.
    #[must_use]
    pub const fn has_errors(self) -> bool {
        matches!(self, Self::WithErrors | Self::Switched)
    }
}

impl core::fmt::Display for Fidelity {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

/// No such level.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{got}\" is no fidelity: f0 (kinematic), f1 (averaged), f2 (with errors) and f3 (switched) are")]
pub struct UnknownFidelity {
    /// What was given.
    pub got: String,
}

impl core::str::FromStr for Fidelity {
    type Err = UnknownFidelity;

    /// Reads `f0` to `f3`, in either case.
    fn from_str(text: &str) -> Result<Self, UnknownFidelity> {
        Self::ALL
            .into_iter()
            .find(|level| level.name().eq_ignore_ascii_case(text))
            .ok_or_else(|| UnknownFidelity { got: text.to_owned() })
    }
}
