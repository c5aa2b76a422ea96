/// Where the energy of an axis came from and went since power-up, J.
///
/// Every part measures its own share, by integrals that the solver carries along; nothing here is a difference of the others. So
/// [`residual_j`](Self::residual_j) tells how far the integration is from conserving energy.
///
/// ```text
/// mains ─► rectifier ─► capacitor ─► inverter ─► winding ─► rotor ─► coupling ─► load
///            │ loss        │ supply, brake │ loss     │ copper   │ friction │ loss
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyBalance {
    /// Taken from the mains.
    pub mains_j: f64,
    /// Brought in by hand: a shaft set turning, a link set to a voltage.
    pub external_j: f64,
    /// Heat in mains, rectifier and charging resistor.
    pub source_loss_j: f64,
    /// Used by the drive's own supply.
    pub standby_j: f64,
    /// Heat in the brake resistor.
    pub brake_j: f64,
    /// Heat in the switches of the inverter; zero at fidelity F1.
    pub inverter_loss_j: f64,
    /// Heat in the windings.
    pub copper_j: f64,
    /// Heat of all friction.
    pub friction_j: f64,
    /// Heat in coupling and gear teeth; zero with a rigid shaft.
    pub coupling_loss_j: f64,
    /// Given to the load; negative when it drives.
    pub load_j: f64,
    /// What the DC link gave the inverter, counted while it gave.
    pub motoring_j: f64,
    /// What the DC link got back from it, a positive number.
    pub regenerated_j: f64,
    /// In the capacitor more than at power-up.
    pub capacitor_j: f64,
    /// In the magnetic field of the currents.
    pub field_j: f64,
    /// In turning masses.
    pub kinetic_j: f64,
    /// In the twist of the coupling.
    pub elastic_j: f64,
}

impl EnergyBalance {
    /// What came in less what went out and what is stored: zero for an exact integration.
    #[must_use]
    pub fn residual_j(&self) -> f64 {
        let lost = self.source_loss_j
            + self.standby_j
            + self.brake_j
            + self.inverter_loss_j
            + self.copper_j
            + self.friction_j
            + self.coupling_loss_j;
        let stored = self.capacitor_j + self.field_j + self.kinetic_j + self.elastic_j;
        self.mains_j + self.external_j - lost - self.load_j - stored
    }

    /// All energy that passed, by which a residual is judged: what came in, what the motor gave back, what the load gave.
    #[must_use]
    pub fn turnover_j(&self) -> f64 {
        self.mains_j + self.external_j.abs() + self.motoring_j + self.regenerated_j + self.load_j.abs()
    }

    /// Residual over turnover; zero if nothing has moved.
    #[must_use]
    pub fn relative_residual(&self) -> f64 {
        let turnover_j = self.turnover_j();
        if turnover_j > 0.0 {
            self.residual_j() / turnover_j
        } else {
            0.0
        }
    }
}

/// The drive train's share of the balance, J.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TrainEnergy {
    pub(crate) external_j: f64,
    pub(crate) inverter_loss_j: f64,
    pub(crate) copper_j: f64,
    pub(crate) friction_j: f64,
    pub(crate) coupling_loss_j: f64,
    pub(crate) load_j: f64,
    pub(crate) motoring_j: f64,
    pub(crate) regenerated_j: f64,
}

/// The DC link's share of the balance, J.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LinkEnergy {
    pub(crate) mains_j: f64,
    pub(crate) source_loss_j: f64,
    pub(crate) standby_j: f64,
    pub(crate) brake_j: f64,
    /// Change of the capacitor's energy.
    pub(crate) capacitor_j: f64,
}
