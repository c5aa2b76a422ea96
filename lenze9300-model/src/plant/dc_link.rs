use core::f64::consts::SQRT_2;

use super::energy::LinkEnergy;

/// The three-phase mains in front of the rectifier.
#[doc(alias = "Netz")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mains {
    /// No mains; the electronics may still live on 24 V.
    Off,
    /// Mains present.
    On,
}

/// Voltage state of the DC link, by the thresholds of C0173.
///
/// Both are messages, not trips: the output stage is off as long as they last. Source: 9300 facts 4.8.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkState {
    /// Undervoltage, message LU (1030).
    #[doc(alias = "LU")]
    Undervoltage,
    /// Within the thresholds.
    Normal,
    /// Overvoltage, message OU (1020); lasts until the voltage is below the lower threshold.
    #[doc(alias = "OU")]
    Overvoltage,
}

/// Thresholds of C0173, V.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkThresholds {
    /// LU below this voltage.
    pub lu_v: f64,
    /// OU above this voltage.
    pub ou_v: f64,
    /// OU ends below this voltage.
    pub ou_clear_v: f64,
}

impl LinkThresholds {
    /// The row of C0173 (0…4); `None` for any other value.
    ///
    /// Source: 9300 facts 4.8. Rows 0, 2, 3 and 4 are assumed there (LU = 0.7125 times the mains voltage).
    #[must_use]
    pub const fn from_c0173(value: u8) -> Option<Self> {
        let (lu_v, ou_v, ou_clear_v) = match value {
            0 | 1 => (285.0, 770.0, 755.0),
            2 => (328.0, 770.0, 755.0),
            3 => (342.0, 770.0, 755.0),
            4 => (342.0, 800.0, 785.0),
            _ => return None,
        };
        Some(Self { lu_v, ou_v, ou_clear_v })
    }

    /// 400 V mains with or without a brake resistor, C0173 = 1. Source: film-feed specification, section 5.
    pub const MAINS_400_V: Self = Self {
        lu_v: 285.0,
        ou_v: 770.0,
        ou_clear_v: 755.0,
    };
}

/// External brake module with its resistor; the 93XX has none built in (9300 facts 4.8).
#[doc(alias = "Bremschopper")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrakeModule {
    /// Resistance, Ω.
    pub resistance_ohm: f64,
    /// Switches on above this voltage, V.
    pub on_v: f64,
    /// Switches off below this voltage, V.
    pub off_v: f64,
}

/// Rectifier, capacitor and thresholds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DcLinkParams {
    /// Line voltage of the mains, V rms; 320…528 V (9300 facts 4.10). 400 V gives 565.7 V at the link.
    pub mains_v_rms: f64,
    /// Capacitance of the link, F. Assumed.
    pub capacitance_f: f64,
    /// Resistance of mains and rectifier seen from the link, Ω. Assumed.
    pub source_ohm: f64,
    /// Resistance through which the link is charged below the LU threshold, Ω. Assumed.
    pub charging_ohm: f64,
    /// What the drive's own supply takes from the link, W. Assumed.
    pub standby_w: f64,
    /// Thresholds of LU and OU.
    pub thresholds: LinkThresholds,
    /// Brake module, if one is fitted.
    pub brake: Option<BrakeModule>,
}

impl DcLinkParams {
    /// Voltage of the unloaded link: the peak of the line voltage.
    #[must_use]
    pub fn rectified_v(&self) -> f64 {
        SQRT_2 * self.mains_v_rms
    }
}

impl Default for DcLinkParams {
    fn default() -> Self {
        Self {
            mains_v_rms: 400.0,
            capacitance_f: 165e-6,
            source_ohm: 2.0,
            charging_ohm: 82.0,
            standby_w: 15.0,
            thresholds: LinkThresholds::MAINS_400_V,
            brake: None,
        }
    }
}

/// DC link: an energy balance of the capacitor between rectifier, motor, brake module and the drive's own supply.
///
/// The state is the square of the voltage, so that powers add exactly. The rectifier only gives, never takes: braking
/// raises the voltage. Its charging is solved implicitly, because its time constant lies near the tick.
#[doc(alias = "Zwischenkreis")]
#[derive(Debug, Clone)]
pub struct DcLink {
    pub(crate) params: DcLinkParams,
    pub(crate) mains: Mains,
    pub(crate) voltage_v: f64,
    state: LinkState,
    pub(crate) chopper_on: bool,
    pub(crate) rectified_v: f64,
    pub(crate) volt_squared_per_watt: f64,
    charging_share: f64,
    pub(crate) source_share: f64,
    dt_s: f64,
    energy_at_start_j: f64,
    counted: LinkEnergy,
}

impl DcLink {
    /// A link in balance with its mains: charged if they are on, empty otherwise.
    #[must_use]
    pub fn new(params: &DcLinkParams, mains: Mains, dt_s: f64) -> Self {
        let rectified_v = params.rectified_v();
        let mut link = Self {
            params: *params,
            mains,
            voltage_v: match mains {
                Mains::On => rectified_v,
                Mains::Off => 0.0,
            },
            state: LinkState::Normal,
            chopper_on: false,
            rectified_v,
            volt_squared_per_watt: 2.0 * dt_s / params.capacitance_f,
            charging_share: implicit_share(dt_s, params.charging_ohm * params.capacitance_f),
            source_share: implicit_share(dt_s, params.source_ohm * params.capacitance_f),
            dt_s,
            energy_at_start_j: 0.0,
            counted: LinkEnergy::default(),
        };
        link.energy_at_start_j = link.energy_j();
        link.update_state();
        link
    }

    /// Switches the mains.
    pub fn set_mains(&mut self, mains: Mains) {
        self.mains = mains;
    }

    /// Whether the mains are on.
    #[must_use]
    pub fn mains(&self) -> Mains {
        self.mains
    }

    /// Voltage of the link, V.
    #[must_use]
    pub fn voltage(&self) -> f64 {
        self.voltage_v
    }

    /// Changes the thresholds of LU and OU.
    pub fn set_thresholds(&mut self, thresholds: LinkThresholds) {
        self.params.thresholds = thresholds;
    }

    /// Where the voltage stands against the thresholds.
    #[must_use]
    pub fn state(&self) -> LinkState {
        self.state
    }

    /// Energy in the capacitor, J.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        0.5 * self.params.capacitance_f * self.voltage_v * self.voltage_v
    }

    /// Where its energy came from and went since power-up.
    pub(crate) fn counted(&self) -> LinkEnergy {
        LinkEnergy {
            capacitor_j: self.energy_j() - self.energy_at_start_j,
            ..self.counted
        }
    }

    /// Energy that comes back at once, J: that of the winding when the pulses stop.
    pub(crate) fn absorb(&mut self, energy_j: f64) {
        self.voltage_v = (self.voltage_v * self.voltage_v + 2.0 * energy_j / self.params.capacitance_f).sqrt();
    }

    /// One tick with the mean power that the inverter took from the link, W; negative while braking.
    #[inline]
    pub fn advance(&mut self, inverter_w: f64) {
        let mut power_out = inverter_w;
        if self.voltage_v > 0.0 {
            power_out += self.params.standby_w;
            self.counted.standby_j += self.params.standby_w * self.dt_s;
        }
        if let Some(brake) = self.params.brake {
            self.chopper_on = self.voltage_v > if self.chopper_on { brake.off_v } else { brake.on_v };
            if self.chopper_on {
                let brake_w = self.voltage_v * self.voltage_v / brake.resistance_ohm;
                power_out += brake_w;
                self.counted.brake_j += brake_w * self.dt_s;
            }
        }
        let mut squared = self.voltage_v * self.voltage_v - self.volt_squared_per_watt * power_out;
        if squared < 0.0 {
            // An empty capacitor has nothing left to give; its last consumer, the supply, goes short.
            self.counted.standby_j += 0.5 * self.params.capacitance_f * squared;
            squared = 0.0;
        }
        let mut voltage_v = squared.sqrt();
        if self.mains == Mains::On && voltage_v < self.rectified_v {
            voltage_v = self.charge(voltage_v);
        }
        self.voltage_v = voltage_v;
        self.update_state();
    }

    /// The rectifier charges the capacitor from `from_v`; returns the voltage after the tick.
    ///
    /// A capacitor that a constant voltage U charges through whatever resistance takes U·C·Δu from it; C/2 of the difference of
    /// the squares of what was missing becomes heat.
    #[inline]
    fn charge(&mut self, from_v: f64) -> f64 {
        let share = if from_v < self.params.thresholds.lu_v {
            self.charging_share
        } else {
            self.source_share
        };
        let missing_v = self.rectified_v - from_v;
        let to_v = from_v + share * missing_v;
        let still_missing_v = self.rectified_v - to_v;
        let capacitance_f = self.params.capacitance_f;
        self.counted.mains_j += capacitance_f * self.rectified_v * (to_v - from_v);
        self.counted.source_loss_j += 0.5 * capacitance_f * (missing_v * missing_v - still_missing_v * still_missing_v);
        to_v
    }

    /// Length of the tick this link was made for, s.
    #[must_use]
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    #[inline]
    fn update_state(&mut self) {
        let t = &self.params.thresholds;
        let ou_v = if self.state == LinkState::Overvoltage {
            t.ou_clear_v
        } else {
            t.ou_v
        };
        self.state = if self.voltage_v < t.lu_v {
            LinkState::Undervoltage
        } else if self.voltage_v > ou_v {
            LinkState::Overvoltage
        } else {
            LinkState::Normal
        };
    }
}

/// Share of a difference that an implicit Euler step of a first-order lag removes.
fn implicit_share(dt_s: f64, time_constant_s: f64) -> f64 {
    dt_s / (time_constant_s + dt_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 125e-6;

    fn link(mains: Mains) -> DcLink {
        DcLink::new(
            &DcLinkParams {
                standby_w: 0.0,
                ..DcLinkParams::default()
            },
            mains,
            DT_S,
        )
    }

    #[test]
    fn mains_of_400_v_give_565_7_v() {
        // Source: 9300 facts 4.8, "DC link 566 V unloaded".
        assert!((link(Mains::On).voltage() - 565.685).abs() < 1e-3);
        assert_eq!(link(Mains::On).state(), LinkState::Normal);
        assert_eq!(link(Mains::Off).state(), LinkState::Undervoltage);
    }

    #[test]
    fn an_empty_link_charges_to_the_peak_of_the_mains() {
        let mut link = link(Mains::Off);
        link.set_mains(Mains::On);
        for _ in 0..4000 {
            link.advance(0.0);
        }
        assert!((link.voltage() - 565.685).abs() < 0.01, "{}", link.voltage());
        assert_eq!(link.state(), LinkState::Normal);
    }

    #[test]
    fn braking_energy_stays_in_the_capacitor() {
        // Energy balance: E = C/2 u²; 100 W back for 0.1 s add 10 J.
        let mut link = link(Mains::On);
        let before = link.energy_j();
        for _ in 0..800 {
            link.advance(-100.0);
        }
        assert!(
            (link.energy_j() - before - 10.0).abs() < 1e-6,
            "{}",
            link.energy_j() - before
        );
    }

    #[test]
    fn overvoltage_starts_above_770_v_and_ends_below_755_v() {
        // Source: film-feed specification, section 5, C0173 = 1.
        let mut link = link(Mains::Off);
        let mut seen = Vec::new();
        link.voltage_v = 765.0;
        for (power, ticks) in [(-400.0, 30), (400.0, 100)] {
            for _ in 0..ticks {
                link.advance(power);
                if seen.last().is_none_or(|(state, _)| *state != link.state()) {
                    seen.push((link.state(), link.voltage()));
                }
            }
        }
        let states: Vec<_> = seen.iter().map(|(state, _)| *state).collect();
        assert_eq!(states, [LinkState::Normal, LinkState::Overvoltage, LinkState::Normal]);
        assert!((770.0..771.0).contains(&seen[1].1), "{seen:?}");
        assert!((754.0..755.0).contains(&seen[2].1), "{seen:?}");
    }

    #[test]
    fn undervoltage_starts_below_285_v_without_mains() {
        // Source: 9300 facts 4.8. From 565.7 V to 285 V the capacitor gives 19.7 J: 1.313 s at 15 W.
        let mut link = DcLink::new(&DcLinkParams::default(), Mains::On, DT_S);
        link.set_mains(Mains::Off);
        let mut ticks = 0_u32;
        while link.state() == LinkState::Normal {
            link.advance(0.0);
            ticks += 1;
        }
        let expected_s = 0.5 * 165e-6 * (320_000.0 - 285.0 * 285.0) / 15.0;
        assert!((f64::from(ticks) * DT_S - expected_s).abs() < 2.0 * DT_S, "{ticks}");
        assert!(link.voltage() < 285.0);
    }

    #[test]
    fn a_brake_module_keeps_the_link_below_the_threshold() {
        let brake = BrakeModule {
            resistance_ohm: 470.0,
            on_v: 745.0,
            off_v: 725.0,
        };
        let mut link = DcLink::new(
            &DcLinkParams {
                brake: Some(brake),
                ..DcLinkParams::default()
            },
            Mains::On,
            DT_S,
        );
        let mut peak: f64 = 0.0;
        for _ in 0..8000 {
            link.advance(-600.0);
            peak = peak.max(link.voltage());
        }
        assert!(peak > 745.0 && peak < 750.0, "{peak}");
    }

    #[test]
    fn c0173_has_five_rows() {
        assert_eq!(LinkThresholds::from_c0173(1), Some(LinkThresholds::MAINS_400_V));
        assert_eq!(LinkThresholds::from_c0173(4).map(|t| t.ou_v), Some(800.0));
        assert_eq!(LinkThresholds::from_c0173(5), None);
    }
}
