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
    /// Friction proportional to the speed of the motor, Nm·s/rad. None by default.
    pub viscous_nm_s: f64,
    /// What lies between rotor and load. `None`, the default: they are one rigid mass.
    pub coupling: Option<Coupling>,
}

/// Shaft, belt or gear between two masses: a spring with damping and free play.
///
/// All values are reduced to the motor: a stiffness at the output of a gear is divided by the square of its ratio, an angle
/// multiplied by the ratio. The teeth press and never pull; what one flank leaves, the other meets after the free play.
///
/// ```
/// use lenze9300_model::plant::{Coupling, MechanicsParams};
///
/// // A gear of 7:1 with 6′ of play and 900 Nm/rad at its output.
/// let coupling = Coupling::at_gear_output(900.0, 6.0, 7.0);
/// let mechanics = MechanicsParams { coupling: Some(coupling), ..MechanicsParams::default() };
/// let resonance_hz = mechanics.resonance_rad_s().map(|omega| omega / std::f64::consts::TAU);
/// assert!((resonance_hz.unwrap() - 160.1).abs() < 0.1);
/// ```
#[doc(alias = "Zweimassenschwinger")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Torque per angle of twist, Nm/rad.
    #[doc(alias = "Drehsteifigkeit")]
    pub stiffness_nm_per_rad: f64,
    /// Torque per speed of twist, Nm·s/rad.
    pub damping_nm_s: f64,
    /// Free play from flank to flank, rad; 0 for none.
    #[doc(alias = "Lose")]
    pub backlash_rad: f64,
    /// Share of the Coulomb friction that lies on the driven side, 0…1. Assumed.
    pub friction_share: f64,
}

impl Coupling {
    /// A gear whose stiffness, Nm/rad, and play, arc minutes, are told at its output, as catalogues do; the damping is
    /// [`DAMPING_RATIO`](Self::DAMPING_RATIO) of the critical one with the inertias of the default axis, half of the friction is
    /// the load's.
    #[must_use]
    pub fn at_gear_output(stiffness_nm_per_rad: f64, backlash_arcmin: f64, ratio: f64) -> Self {
        let stiffness = stiffness_nm_per_rad / (ratio * ratio);
        let axis = MechanicsParams::default();
        let reduced = axis.j_rotor_kg_m2 * axis.j_load_kg_m2 / axis.j_total_kg_m2();
        Self {
            stiffness_nm_per_rad: stiffness,
            damping_nm_s: 2.0 * Self::DAMPING_RATIO * (stiffness * reduced).sqrt(),
            backlash_rad: backlash_arcmin / 60.0 * core::f64::consts::PI / 180.0 * ratio,
            friction_share: 0.5,
        }
    }

    /// Damping of steel shafts and gears, as a share of the critical one. Assumed.
    pub const DAMPING_RATIO: f64 = 0.02;
}

impl MechanicsParams {
    /// Inertia that the motor turns, kg m².
    #[must_use]
    pub fn j_total_kg_m2(&self) -> f64 {
        self.j_rotor_kg_m2 + self.j_load_kg_m2
    }

    /// Angular frequency at which both masses swing against each other, rad/s: √(c (1/J_M + 1/J_L)); `None` for a rigid shaft.
    ///
    /// Source: Schröder, *Elektrische Antriebe – Regelung von Antriebssystemen*, two-mass system.
    #[must_use]
    pub fn resonance_rad_s(&self) -> Option<f64> {
        self.coupling
            .map(|c| (c.stiffness_nm_per_rad * (1.0 / self.j_rotor_kg_m2 + 1.0 / self.j_load_kg_m2)).sqrt())
    }

    /// Angular frequency at which the load swings while the rotor stands, rad/s: √(c/J_L); `None` for a rigid shaft.
    #[must_use]
    pub fn antiresonance_rad_s(&self) -> Option<f64> {
        self.coupling
            .map(|c| (c.stiffness_nm_per_rad / self.j_load_kg_m2).sqrt())
    }
}

impl Default for MechanicsParams {
    fn default() -> Self {
        Self {
            j_rotor_kg_m2: 0.25e-4,
            j_load_kg_m2: 0.664e-4,
            coulomb_nm: 0.05,
            viscous_nm_s: 0.0,
            coupling: None,
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

    /// The contact of a shaft that turns at this speed.
    pub(crate) fn sliding_at(omega: f64) -> Self {
        Self::at_rest(omega, 0.0)
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
