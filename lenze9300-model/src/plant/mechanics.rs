/// Inertias, friction and their sources.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MechanicsParams {
    /// Inertia of rotor and resolver, kg m². Assumed, 0.15…0.5e-4 is plausible (9300 facts 6).
    #[doc(alias = "Trägheitsmoment")]
    pub j_rotor_kg_m2: f64,
    /// Inertia of gear, film shaft and load, reduced to the motor (divided by the square of the gear ratio), kg m².
    ///
    /// Film shaft of steel, 57 mm by 400 mm, behind 7:1. Assumed (design, section 6).
    pub j_load_kg_m2: f64,
    /// Coulomb friction at the motor, Nm; also what it takes to break away. Assumed (9300 facts 6).
    #[doc(alias = "Reibmoment")]
    pub coulomb_nm: f64,
    /// Friction proportional to the speed, Nm·s/rad. None by default.
    pub viscous_nm_s: f64,
}

impl MechanicsParams {
    /// Inertia that the motor turns, kg m².
    #[must_use]
    pub fn j_total_kg_m2(&self) -> f64 {
        self.j_rotor_kg_m2 + self.j_load_kg_m2
    }
}

impl Default for MechanicsParams {
    fn default() -> Self {
        Self {
            j_rotor_kg_m2: 0.25e-4,
            j_load_kg_m2: 0.664e-4,
            coulomb_nm: 0.05,
            viscous_nm_s: 0.0,
        }
    }
}

/// Contact of the friction pair.
///
/// A stick state instead of a smoothed sign: a shaft that stands is held by whatever torque it takes, up to the Coulomb
/// torque, and its speed is exactly zero. Smoothed friction would creep. Source: design, section 5 (Karnopp).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// Held; the speed is exactly zero.
    #[doc(alias = "Haften")]
    Stuck,
    /// Sliding in the positive direction, or about to.
    Positive,
    /// Sliding in the negative direction, or about to.
    Negative,
}

impl Contact {
    /// What a shaft at rest does under a driving torque.
    #[inline]
    pub(crate) fn at_rest(drive_nm: f64, coulomb_nm: f64) -> Self {
        if drive_nm > coulomb_nm {
            Self::Positive
        } else if drive_nm < -coulomb_nm {
            Self::Negative
        } else {
            Self::Stuck
        }
    }

    /// Sign of the speed.
    #[inline]
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Stuck => 0.0,
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }
}
