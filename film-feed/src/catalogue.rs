//! Motors and drives by name: a catalogue in TOML, with a source for every number.
//!
//! The built-in catalogue (`film-feed/catalogue/motors.toml` and `drives.toml`) holds the pair of the thesis; a file of the same form
//! adds others:
//!
//! ```
//! use film_feed::catalogue::Catalogue;
//!
//! let built_in = Catalogue::built_in();
//! let motor = built_in.motor("MDSKS036-13").ok_or("it is built in")?;
//! assert_eq!(motor.pole_pairs(), 3);
//!
//! let wrong = Catalogue::read("[[motor]]\nname = \"X\"\nrated_speed = 4000\n").unwrap_err();
//! assert!(wrong.to_string().contains("line 3: `rated_speed` is unknown here"));
//! # Ok::<(), &str>(())
//! ```

use std::collections::BTreeMap;
use std::f64::consts::{SQRT_2, TAU};

use lenze9300_model::FileError;
use lenze9300_model::plant::PmsmParams;
use lenze9300_model::toml_file::Reader;
use serde::Serialize;
use toml::Spanned;
use toml::de::DeValue;

use crate::toml_section::Section;

/// A synchronous servo motor.
///
/// In TOML a table `[[motor]]` of a catalogue, or `[motor]` of a MACHINE.toml, with the names of the fields as keys; `assumed` is a
/// list of keys, `sources` a table from key to text.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[doc(alias = "Servomotor")]
pub struct Motor {
    /// Name by which a machine refers to it.
    pub name: String,
    /// Number in the motor list of the 9300 (C0086), if it has one; optional.
    pub motor_list: Option<u16>,
    /// Rated speed n_N, 1/min, 100…20 000.
    pub rated_speed_rpm: f64,
    /// Rated torque M_N, Nm: what it gives for ever at the rated speed, 0.001…10 000.
    pub rated_torque_nm: f64,
    /// Standstill torque M_0, Nm: what it gives for ever near speed zero, 0.001…10 000.
    pub standstill_torque_nm: f64,
    /// Greatest torque M_max, Nm, 0.001…10 000.
    pub peak_torque_nm: f64,
    /// Rated power P_N, W, 1…10⁶.
    pub rated_power_w: f64,
    /// Rated current I_N, A rms, 0.01…1000.
    pub rated_current_a: f64,
    /// Current I_0 at M_0, A rms, 0.01…1000.
    pub standstill_current_a: f64,
    /// Greatest current I_max, A rms, 0.01…1000.
    pub peak_current_a: f64,
    /// Rated voltage U_N, V line-line rms, 10…1000.
    pub rated_voltage_v: f64,
    /// Rated frequency f_N, Hz, 1…2000; with n_N it gives the pole pairs.
    pub rated_frequency_hz: f64,
    /// Resistance of a phase in star, Ω, 0.0001…1000.
    pub resistance_ohm: f64,
    /// Inductance of a phase in star, mH, 0.001…1000.
    pub inductance_mh: f64,
    /// Inertia of the rotor with its encoder, kg m², 10⁻⁹…100.
    #[doc(alias = "Trägheitsmoment")]
    pub rotor_inertia_kg_m2: f64,
    /// How much warmer than its surroundings the winding gets at I_0, K, 1…300 (100).
    pub winding_rise_k: f64,
    /// Temperature at which the motor is switched off, °C, 40…300 (150).
    pub winding_max_c: f64,
    /// Time constant of the winding, s, 1…10⁵ (60).
    pub winding_tau_s: f64,
    /// Time constant of the housing, s, 1…10⁵ (1200).
    pub housing_tau_s: f64,
    /// Points of the S1 curve in ascending order of the speed: `s1_rpm` and `s1_nm`, two lists of the same length, 1/min and Nm. Without
    /// them the curve is the straight line from M_0 at standstill to M_N at n_N.
    pub s1: Vec<[f64; 2]>,
    /// Keys whose number has no source.
    pub assumed: Vec<String>,
    /// Where the numbers are from, by key.
    pub sources: BTreeMap<String, String>,
}

impl Motor {
    /// Pole pairs: 60 f_N / n_N.
    pub fn pole_pairs(&self) -> u32 {
        (60.0 * self.rated_frequency_hz / self.rated_speed_rpm).round() as u32
    }

    /// Torque constant up to the standstill torque, Nm per ampere rms: M_0 / I_0.
    #[doc(alias = "Drehmomentkonstante")]
    pub fn torque_constant_nm_a(&self) -> f64 {
        self.standstill_torque_nm / self.standstill_current_a
    }

    /// Current for a torque, A rms: M / k_T (thesis 5.6, formula IX). Above M_0 the iron saturates: from there the current grows along
    /// the straight line to (M_max, I_max), and on along it.
    pub fn current_a(&self, torque_nm: f64) -> f64 {
        let torque_nm = torque_nm.abs();
        let over_nm = torque_nm - self.standstill_torque_nm;
        let (torque_span, current_span) = (
            self.peak_torque_nm - self.standstill_torque_nm,
            self.peak_current_a - self.standstill_current_a,
        );
        if over_nm <= 0.0 || torque_span <= 0.0 {
            torque_nm / self.torque_constant_nm_a()
        } else {
            self.standstill_current_a + over_nm * current_span / torque_span
        }
    }

    /// Torque for a current, Nm: the reverse of [`current_a`](Self::current_a).
    pub fn torque_nm(&self, current_a: f64) -> f64 {
        let over_a = current_a - self.standstill_current_a;
        let (torque_span, current_span) = (
            self.peak_torque_nm - self.standstill_torque_nm,
            self.peak_current_a - self.standstill_current_a,
        );
        if over_a <= 0.0 || current_span <= 0.0 {
            current_a * self.torque_constant_nm_a()
        } else {
            self.standstill_torque_nm + over_a * torque_span / current_span
        }
    }

    /// Points of the S1 curve, 1/min and Nm; straight lines lie between them.
    ///
    /// Interpretation: of the thesis' motor the curve was not found; its two ends are known.
    #[doc(alias = "S1-Kennlinie")]
    pub fn s1_points(&self) -> Vec<[f64; 2]> {
        if self.s1.is_empty() {
            vec![
                [0.0, self.standstill_torque_nm],
                [self.rated_speed_rpm, self.rated_torque_nm],
            ]
        } else {
            self.s1.clone()
        }
    }

    /// Torque the motor gives for ever at a speed (S1 curve), Nm; as at the first point below it, none above the last.
    pub fn s1_torque_nm(&self, speed_rpm: f64) -> f64 {
        let speed_rpm = speed_rpm.abs();
        let points = self.s1_points();
        let Some([first_rpm, first_nm]) = points.first() else {
            return 0.0;
        };
        if speed_rpm <= *first_rpm {
            return *first_nm;
        }
        let piece = points.windows(2).find_map(|pair| match pair {
            [[from_rpm, from_nm], [to_rpm, to_nm]] if speed_rpm <= *to_rpm => {
                let share = (speed_rpm - from_rpm) / (to_rpm - from_rpm);
                Some(from_nm + share * (to_nm - from_nm))
            }
            _ => None,
        });
        piece.unwrap_or(0.0)
    }

    /// Line-line voltage in V rms that a speed and a torque need: |E + (R + jωL)·I|, with the current in the q axis.
    pub fn voltage_v(&self, speed_rpm: f64, torque_nm: f64) -> f64 {
        let pmsm = self.pmsm();
        let omega_el = f64::from(self.pole_pairs()) * speed_rpm * TAU / 60.0;
        // Motoring and braking differ: R·I adds to E or is taken from it.
        let i_q = SQRT_2 * self.current_a(torque_nm) * torque_nm.signum();
        let u_q = omega_el * pmsm.psi_f + pmsm.r_s * i_q;
        let u_d = -omega_el * pmsm.l_q * i_q;
        u_q.hypot(u_d) * 1.5_f64.sqrt()
    }

    /// Heat in the windings at a torque, W: 3 R I².
    pub fn copper_loss_w(&self, torque_nm: f64) -> f64 {
        let current_a = self.current_a(torque_nm);
        3.0 * self.resistance_ohm * current_a * current_a
    }

    /// The motor of the drive model.
    pub fn pmsm(&self) -> PmsmParams {
        PmsmParams::from_torque_constant(
            self.resistance_ohm,
            self.inductance_mh * 1e-3,
            self.torque_constant_nm_a(),
            self.pole_pairs(),
        )
    }

    /// Reads a motor of that name. What the table does not give comes from `base`.
    pub(crate) fn read(section: &mut Section<'_, '_, '_>, name: Option<&str>, base: Option<&Self>) -> Self {
        let of = |value: fn(&Self) -> f64| base.map(value);
        let name = required_name(section, name);
        let list = base.and_then(|motor| motor.motor_list).map_or(0, i64::from);
        let list = section.whole("motor_list", 0..=269, list);
        let torque = 0.001..=10_000.0;
        let current = 0.01..=1000.0;
        let motor = Self {
            name,
            motor_list: u16::try_from(list).ok().filter(|list| *list > 0),
            rated_speed_rpm: section.real("rated_speed_rpm", 100.0..=20_000.0, of(|m| m.rated_speed_rpm)),
            rated_torque_nm: section.real("rated_torque_nm", torque.clone(), of(|m| m.rated_torque_nm)),
            standstill_torque_nm: section.real("standstill_torque_nm", torque.clone(), of(|m| m.standstill_torque_nm)),
            peak_torque_nm: section.real("peak_torque_nm", torque, of(|m| m.peak_torque_nm)),
            rated_power_w: section.real("rated_power_w", 1.0..=1e6, of(|m| m.rated_power_w)),
            rated_current_a: section.real("rated_current_a", current.clone(), of(|m| m.rated_current_a)),
            standstill_current_a: section.real("standstill_current_a", current.clone(), of(|m| m.standstill_current_a)),
            peak_current_a: section.real("peak_current_a", current, of(|m| m.peak_current_a)),
            rated_voltage_v: section.real("rated_voltage_v", 10.0..=1000.0, of(|m| m.rated_voltage_v)),
            rated_frequency_hz: section.real("rated_frequency_hz", 1.0..=2000.0, of(|m| m.rated_frequency_hz)),
            resistance_ohm: section.real("resistance_ohm", 1e-4..=1000.0, of(|m| m.resistance_ohm)),
            inductance_mh: section.real("inductance_mh", 0.001..=1000.0, of(|m| m.inductance_mh)),
            rotor_inertia_kg_m2: section.real("rotor_inertia_kg_m2", 1e-9..=100.0, of(|m| m.rotor_inertia_kg_m2)),
            winding_rise_k: section.real("winding_rise_k", 1.0..=300.0, of(|m| m.winding_rise_k).or(Some(100.0))),
            winding_max_c: section.real("winding_max_c", 40.0..=300.0, of(|m| m.winding_max_c).or(Some(150.0))),
            winding_tau_s: section.real("winding_tau_s", 1.0..=1e5, of(|m| m.winding_tau_s).or(Some(60.0))),
            housing_tau_s: section.real("housing_tau_s", 1.0..=1e5, of(|m| m.housing_tau_s).or(Some(1200.0))),
            s1: s1(section, base),
            assumed: assumed(section, base.map(|motor| motor.assumed.as_slice())),
            sources: sources(section, base.map(|motor| &motor.sources)),
        };
        if !section.is_sound() {
            return motor;
        }
        let poles = 60.0 * motor.rated_frequency_hz / motor.rated_speed_rpm;
        if (poles - poles.round()).abs() > 0.01 * poles || poles.round() < 1.0 {
            section.mistake(
                None,
                format!("60·rated_frequency_hz/rated_speed_rpm: expected a whole number of pole pairs, got {poles:.3}"),
            );
        }
        if motor.rated_torque_nm > motor.standstill_torque_nm || motor.standstill_torque_nm > motor.peak_torque_nm {
            section.mistake(
                None,
                format!(
                    "expected rated_torque_nm ≤ standstill_torque_nm ≤ peak_torque_nm, got {}, {}, {}",
                    motor.rated_torque_nm, motor.standstill_torque_nm, motor.peak_torque_nm
                ),
            );
        }
        motor
    }
}

/// A servo drive.
///
/// In TOML a table `[[drive]]` of a catalogue, or `[drive]` of a MACHINE.toml, with the names of the fields as keys; `assumed` and
/// `sources` as with [`Motor`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[doc(alias = "Servoregler")]
pub struct DriveUnit {
    /// Name by which a machine refers to it.
    pub name: String,
    /// Rated output current, A rms, 0.01…1000, at a chopping frequency of 8 kHz.
    pub rated_current_a: f64,
    /// Greatest output current, A rms, 0.01…1000, at 8 kHz.
    pub peak_current_a: f64,
    /// Rated output current at 16 kHz, A rms, 0.01…1000 (that at 8 kHz).
    pub rated_current_16_khz_a: f64,
    /// Greatest output current at 16 kHz, A rms, 0.01…1000 (that at 8 kHz).
    pub peak_current_16_khz_a: f64,
    /// How long it may give the greatest current, s, 0.001…10⁴.
    pub peak_time_s: f64,
    /// How long it has to give less after that, s, 0…10⁵.
    pub recovery_time_s: f64,
    /// Share of the rated current during that time, 0…1.
    pub recovery_share: f64,
    /// Least mains voltage, V rms, 50…1000.
    pub mains_min_v: f64,
    /// Greatest mains voltage, V rms, 50…1000.
    pub mains_max_v: f64,
    /// Greatest output frequency, Hz, 1…5000.
    pub output_max_hz: f64,
    /// Loss at the rated current, W, 0…10⁵.
    pub loss_w: f64,
    /// Capacitance of the DC link, µF, 1…10⁶.
    pub link_capacitance_uf: f64,
    /// Link voltage at which the drive switches off, V, 50…1500.
    pub link_overvoltage_v: f64,
    /// What its own supply takes from the link, W, 0…10⁴ (0).
    pub standby_w: f64,
    /// How much warmer than its surroundings the heat sink gets at the rated current, K, 1…200 (40).
    pub heat_sink_rise_k: f64,
    /// Time constant of the heat sink, s, 1…10⁵ (300).
    pub heat_sink_tau_s: f64,
    /// Temperature of the heat sink that is warned of, °C, 30…200 (85).
    pub heat_sink_max_c: f64,
    /// Keys whose number has no source.
    pub assumed: Vec<String>,
    /// Where the numbers are from, by key.
    pub sources: BTreeMap<String, String>,
}

impl DriveUnit {
    /// Reads a drive of that name. What the table does not give comes from `base`.
    pub(crate) fn read(section: &mut Section<'_, '_, '_>, name: Option<&str>, base: Option<&Self>) -> Self {
        let of = |value: fn(&Self) -> f64| base.map(value);
        let name = required_name(section, name);
        let current = 0.01..=1000.0;
        let rated_a = section.real("rated_current_a", current.clone(), of(|d| d.rated_current_a));
        let peak_a = section.real("peak_current_a", current.clone(), of(|d| d.peak_current_a));
        let (mains, share) = (50.0..=1000.0, 0.0..=1.0);
        let drive = Self {
            name,
            rated_current_a: rated_a,
            peak_current_a: peak_a,
            rated_current_16_khz_a: section.real(
                "rated_current_16_khz_a",
                current.clone(),
                of(|d| d.rated_current_16_khz_a).or(Some(rated_a)),
            ),
            peak_current_16_khz_a: section.real(
                "peak_current_16_khz_a",
                current,
                of(|d| d.peak_current_16_khz_a).or(Some(peak_a)),
            ),
            peak_time_s: section.real("peak_time_s", 0.001..=1e4, of(|d| d.peak_time_s)),
            recovery_time_s: section.real("recovery_time_s", 0.0..=1e5, of(|d| d.recovery_time_s)),
            recovery_share: section.real("recovery_share", share, of(|d| d.recovery_share)),
            mains_min_v: section.real("mains_min_v", mains.clone(), of(|d| d.mains_min_v)),
            mains_max_v: section.real("mains_max_v", mains, of(|d| d.mains_max_v)),
            output_max_hz: section.real("output_max_hz", 1.0..=5000.0, of(|d| d.output_max_hz)),
            loss_w: section.real("loss_w", 0.0..=1e5, of(|d| d.loss_w)),
            link_capacitance_uf: section.real("link_capacitance_uf", 1.0..=1e6, of(|d| d.link_capacitance_uf)),
            link_overvoltage_v: section.real("link_overvoltage_v", 50.0..=1500.0, of(|d| d.link_overvoltage_v)),
            standby_w: section.real("standby_w", 0.0..=1e4, of(|d| d.standby_w).or(Some(0.0))),
            heat_sink_rise_k: section.real(
                "heat_sink_rise_k",
                1.0..=200.0,
                of(|d| d.heat_sink_rise_k).or(Some(40.0)),
            ),
            heat_sink_tau_s: section.real("heat_sink_tau_s", 1.0..=1e5, of(|d| d.heat_sink_tau_s).or(Some(300.0))),
            heat_sink_max_c: section.real(
                "heat_sink_max_c",
                30.0..=200.0,
                of(|d| d.heat_sink_max_c).or(Some(85.0)),
            ),
            assumed: assumed(section, base.map(|drive| drive.assumed.as_slice())),
            sources: sources(section, base.map(|drive| &drive.sources)),
        };
        let ordered = drive.rated_current_a <= drive.peak_current_a && drive.mains_min_v <= drive.mains_max_v;
        if section.is_sound() && !ordered {
            section.mistake(
                None,
                format!(
                    "expected rated_current_a ≤ peak_current_a and mains_min_v ≤ mains_max_v, got {}, {} and {}, {}",
                    drive.rated_current_a, drive.peak_current_a, drive.mains_min_v, drive.mains_max_v
                ),
            );
        }
        drive
    }
}

/// Motors and drives that a machine may name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Catalogue {
    motors: Vec<Motor>,
    drives: Vec<DriveUnit>,
}

impl Catalogue {
    /// The catalogue that comes with the program.
    ///
    /// # Panics
    /// Never: a test reads the two files.
    pub fn built_in() -> Self {
        let mut catalogue = Self::default();
        for text in [
            include_str!("../catalogue/motors.toml"),
            include_str!("../catalogue/drives.toml"),
        ] {
            catalogue.add(Self::read(text).expect("the built-in catalogue is checked by a test"));
        }
        catalogue
    }

    /// Reads a catalogue file: tables `[[motor]]` and `[[drive]]`.
    ///
    /// # Errors
    /// [`FileError`] with every mistake of the file.
    pub fn read(text: &str) -> Result<Self, FileError> {
        Reader::read(text, |reader, table| {
            let mut fields = lenze9300_model::toml_file::Fields::of(table);
            let mut catalogue = Self::default();
            if let Some(value) = fields.take("motor") {
                for (element, table) in reader.tables(value, "motor") {
                    let mut section = Section::new(reader, table, "motor", element.span());
                    let name = section.text("name");
                    catalogue.motors.push(Motor::read(&mut section, name, None));
                    section.finish();
                }
            }
            if let Some(value) = fields.take("drive") {
                for (element, table) in reader.tables(value, "drive") {
                    let mut section = Section::new(reader, table, "drive", element.span());
                    let name = section.text("name");
                    catalogue.drives.push(DriveUnit::read(&mut section, name, None));
                    section.finish();
                }
            }
            fields.finish(reader);
            Some(catalogue)
        })
    }

    /// Takes over what `other` has; a device of the same name takes the place of the older one.
    pub fn add(&mut self, other: Self) {
        for motor in other.motors {
            self.motors.retain(|known| known.name != motor.name);
            self.motors.push(motor);
        }
        for drive in other.drives {
            self.drives.retain(|known| known.name != drive.name);
            self.drives.push(drive);
        }
    }

    /// The motor of that name.
    pub fn motor(&self, name: &str) -> Option<&Motor> {
        self.motors.iter().find(|motor| motor.name == name)
    }

    /// The drive of that name.
    pub fn drive(&self, name: &str) -> Option<&DriveUnit> {
        self.drives.iter().find(|drive| drive.name == name)
    }

    /// All motors.
    pub fn motors(&self) -> &[Motor] {
        &self.motors
    }

    /// All drives.
    pub fn drives(&self) -> &[DriveUnit] {
        &self.drives
    }
}

fn required_name(section: &mut Section<'_, '_, '_>, name: Option<&str>) -> String {
    if name.is_none() {
        section.missing("name", "a text");
    }
    name.unwrap_or_default().to_owned()
}

fn s1(section: &mut Section<'_, '_, '_>, base: Option<&Motor>) -> Vec<[f64; 2]> {
    let rpm = section.reals("s1_rpm", 0.0..=20_000.0);
    let nm = section.reals("s1_nm", 0.0..=10_000.0);
    let (rpm, nm) = match (rpm, nm) {
        (None, None) => return base.map(|motor| motor.s1.clone()).unwrap_or_default(),
        (rpm, nm) => (rpm.unwrap_or_default(), nm.unwrap_or_default()),
    };
    let ascending = rpm.is_sorted_by(|one, next| one < next);
    if section.is_sound() && (rpm.len() != nm.len() || rpm.len() < 2 || !ascending) {
        section.mistake(
            None,
            format!(
                "s1_rpm and s1_nm: expected two lists of the same length, 2 at least, the speeds ascending, got {} and {} numbers",
                rpm.len(),
                nm.len()
            ),
        );
    }
    rpm.into_iter().zip(nm).map(|(rpm, nm)| [rpm, nm]).collect()
}

fn assumed(section: &mut Section<'_, '_, '_>, base: Option<&[String]>) -> Vec<String> {
    let Some(value) = section.take("assumed") else {
        return base.unwrap_or_default().to_vec();
    };
    let keys = value
        .get_ref()
        .as_array()
        .map(|array| array.iter().map(key_text).collect());
    let keys: Option<Vec<String>> = keys.and_then(|keys: Vec<Option<String>>| keys.into_iter().collect());
    if keys.is_none() {
        section.reader().wrong_type(value, "assumed", "a list of texts");
    }
    keys.unwrap_or_default()
}

fn key_text(value: &Spanned<DeValue<'_>>) -> Option<String> {
    value.get_ref().as_str().map(str::to_owned)
}

fn sources(section: &mut Section<'_, '_, '_>, base: Option<&BTreeMap<String, String>>) -> BTreeMap<String, String> {
    let mut sources = base.cloned().unwrap_or_default();
    let Some(value) = section.take("sources") else {
        return sources;
    };
    let Some(table) = section.reader().table(value, "sources") else {
        return sources;
    };
    for (key, value) in table {
        if let Some(text) = section.reader().text(value, key.get_ref()) {
            sources.insert(key.get_ref().to_string(), text.to_owned());
        }
    }
    sources
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_the_built_in_catalogue_has_a_source() {
        for (text, list) in [
            (include_str!("../catalogue/motors.toml"), "motor"),
            (include_str!("../catalogue/drives.toml"), "drive"),
        ] {
            let file: toml::Table = toml::from_str(text).unwrap();
            for device in file[list].as_array().unwrap() {
                let sources = device["sources"].as_table().unwrap();
                for (key, value) in device.as_table().unwrap() {
                    if value.is_float() || value.is_integer() {
                        assert!(
                            sources.contains_key(key),
                            "{list} {:?}: {key} has no source",
                            device["name"]
                        );
                    }
                }
                for key in device["assumed"].as_array().unwrap() {
                    assert!(sources[key.as_str().unwrap()].as_str().unwrap().contains("assumed"));
                }
            }
        }
    }

    #[test]
    fn derived_figures_of_the_thesis_motor_are_those_of_the_fact_sheet() {
        // Source: 9300 facts 6.
        let catalogue = Catalogue::built_in();
        let motor = catalogue.motor("MDSKS036-13").unwrap();
        assert_eq!(motor.pole_pairs(), 3);
        assert!((motor.torque_constant_nm_a() - 0.778).abs() < 5e-4);
        assert!((motor.copper_loss_w(0.7) - 48.114).abs() < 1e-9);
        assert!(
            (motor.current_a(1.05) - 1.35).abs() > 0.01,
            "above M_0 the iron saturates"
        );
        assert!((motor.peak_torque_nm / motor.current_a(motor.peak_torque_nm) - 0.62).abs() < 1e-12);
        assert!((motor.torque_nm(motor.current_a(2.0)) - 2.0).abs() < 1e-12);
        assert!((motor.voltage_v(2814.5, 0.0) - 132.0).abs() < 0.5);
        assert!((motor.s1_torque_nm(2000.0) - 0.65).abs() < 1e-12);
        assert_eq!(motor.s1_torque_nm(4001.0), 0.0);
    }

    #[test]
    fn an_s1_curve_of_points_is_followed_and_a_broken_one_refused() {
        let with = |curve: &str| {
            let text = include_str!("../catalogue/motors.toml").replace("assumed = ", &format!("{curve}\nassumed = "));
            Catalogue::read(&text)
        };
        let catalogue = with("s1_rpm = [500, 3000, 4500]\ns1_nm = [0.7, 0.65, 0.2]").unwrap();
        let motor = catalogue.motor("MDSKS036-13").unwrap();
        for (rpm, nm) in [
            (0.0, 0.7),
            (500.0, 0.7),
            (-1750.0, 0.675),
            (3750.0, 0.425),
            (4500.0, 0.2),
            (4501.0, 0.0),
        ] {
            assert!((motor.s1_torque_nm(rpm) - nm).abs() < 1e-12, "{rpm}");
        }
        for broken in [
            "s1_rpm = [500, 3000]",
            "s1_rpm = [3000, 500]\ns1_nm = [1, 2]",
            "s1_rpm = [1]\ns1_nm = [1]",
        ] {
            let told = with(broken).unwrap_err().to_string();
            assert!(
                told.contains("expected two lists of the same length, 2 at least"),
                "{told}"
            );
        }
        let told = with("s1_rpm = 5\ns1_nm = [1, true]").unwrap_err().to_string();
        assert!(
            told.contains("motor.s1_rpm: expected a list of numbers")
                && told.contains("motor.s1_nm: expected a number"),
            "{told}"
        );
    }

    #[test]
    fn a_device_of_the_same_name_takes_the_place_of_the_older() {
        let mut catalogue = Catalogue::built_in();
        let other = include_str!("../catalogue/motors.toml").replace("0.25e-4", "0.30e-4");
        catalogue.add(Catalogue::read(&other).unwrap());
        assert_eq!(catalogue.motors().len(), 1);
        assert_eq!(catalogue.motor("MDSKS036-13").unwrap().rotor_inertia_kg_m2, 0.30e-4);
    }
}
