//! MACHINE.toml: everything that sizing, error budget, advice and simulation need to know of one axis, in one file.
//!
//! `docs/examples/machine.toml` is the axis of the thesis, with every key. Tables and keys have the names of the structs and fields
//! below; what is in parentheses behind a range is taken when the key is not there. Whatever is wrong is told with its line, each
//! mistake once; a key that nobody knows is a mistake.
//!
//! | table | struct | what it is |
//! |---|---|---|
//! | (top) | [`MachineFile`] | `name`, `ambient_c` |
//! | `[mechanics]` | [`Mechanics`] | roller, gear, inertias, friction |
//! | `[feed]` | [`Feed`] | what is to be moved, how fast, how often |
//! | `[film]` | [`FilmWeb`] | pull and stretch; optional |
//! | `[roll]` | [`FilmRoll`] | the roll the film comes from: with it the film of a run stretches; optional |
//! | `[marks]` | [`PrintMarks`] | print and reader; optional |
//! | `[motor]` | [`Motor`] | `name` from the catalogue, and what differs; or all of it |
//! | `[drive]` | [`DriveUnit`] | likewise |
//! | `[positioning]` | [`Positioning`] | what the drive does and has no code for; optional |
//! | `[mains]` | [`MainsSupply`] | optional |
//! | `[brake]` | [`BrakeResistor`] | only if one is fitted |
//! | `[plc]`, `[bus]` | [`Controls`] | cycles; optional |
//! | `[codes]` | [`CodeStore`] | codes of the drive, as in a parameter file; optional |
//!
//! Codes that follow from the rest need not be given: C1202, C1203 and C1204 come from gear and roller, C1240 and C1250 from the feed,
//! the motor's data from the motor, C0022 is 1.5 times the motor's rated current, at most what the drive can give (thesis 8.3).
//!
//! ```
//! use film_feed::catalogue::Catalogue;
//! use film_feed::machine_file::MachineFile;
//!
//! let text = include_str!("../../../docs/examples/machine.toml");
//! let machine = MachineFile::read(text, &Catalogue::built_in())?;
//! assert_eq!(machine.mechanics.gear_ratio(), 7.0);
//! let wrong = MachineFile::read(&text.replace("diameter_mm = 57.0", "diameter_mm = 0"), &Catalogue::built_in()).unwrap_err();
//! assert_eq!(wrong.to_string(), "line 10: mechanics.roller_diameter_mm: expected 1 to 5000, got 0");
//! # Ok::<(), lenze9300_model::FileError>(())
//! ```

mod devices;
mod profile;
mod read;
mod rig;
mod roll;

use std::f64::consts::PI;

use dp_master::time::Baud;
use lenze9300_model::code::CodeStore;
use lenze9300_model::traverse::{LatchMode, Rounding};
use lenze9300_model::units::INC_PER_REV;

pub use devices::Gear;
pub use profile::Segment;
pub use rig::NotRunnable;
pub use roll::FilmRoll;

use crate::catalogue::{DriveUnit, Motor};
use crate::report::FeedMode;

/// One axis with its machine.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineFile {
    /// What to call it in reports ("film feed").
    pub name: String,
    /// Temperature around motor and drive, °C, −30…80 (25).
    pub ambient_c: f64,
    /// Roller, gear, inertias, friction.
    pub mechanics: Mechanics,
    /// What is to be moved.
    pub feed: Feed,
    /// Pull and stretch of the film.
    pub film: FilmWeb,
    /// The roll the film comes from.
    pub roll: Option<FilmRoll>,
    /// Print and reader.
    pub marks: PrintMarks,
    /// The motor.
    pub motor: Motor,
    /// The drive.
    pub drive: DriveUnit,
    /// What the drive does and has no code for.
    pub positioning: Positioning,
    /// The mains.
    pub mains: MainsSupply,
    /// Brake module with its resistor.
    pub brake: Option<BrakeResistor>,
    /// PLC and bus.
    pub controls: Controls,
    /// The drive's codes: those of the thesis, what follows from the rest of the file, and what `[codes]` gives.
    pub codes: CodeStore,
    /// Current limit of the drive, A rms: C0022, or more where the drive is larger than that code's range.
    pub current_limit_a: f64,
}

/// Roller, gear, inertias, friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanics {
    /// Diameter of the film roller, mm, 1…5000.
    pub roller_diameter_mm: f64,
    /// How far the true diameter may be from that, mm, 0…10 (0).
    pub roller_diameter_tolerance_mm: f64,
    /// Gear, numerator: motor revolutions, 1…65 535 (C1202).
    pub gear_numerator: u16,
    /// Gear, denominator: roller revolutions, 1…65 535 (C1203).
    pub gear_denominator: u16,
    /// Efficiency of the gear, 0.05…1 (1). Counted by sizing; a run knows friction only.
    #[doc(alias = "Wirkungsgrad")]
    pub gear_efficiency: f64,
    /// Play of the gear at its output, arcmin, 0…600 (0).
    #[doc(alias = "Spiel")]
    pub gear_backlash_arcmin: f64,
    /// Stiffness of the gear at its output, Nm/rad, 0.001…10⁹; rigid when it is not given. With it a run has two masses and knows the play.
    #[doc(alias = "Drehsteifigkeit")]
    pub gear_stiffness_nm_per_rad: Option<f64>,
    /// Half width of the gear's transmission error at its output, arcmin, 0…600 (0).
    pub gear_error_arcmin: f64,
    /// Inertia of the gear at the motor's shaft, kg m², 0…100 (0).
    pub gear_inertia_kg_m2: f64,
    /// Inertia of everything behind the gear at the roller's shaft, kg m², 0…10⁶.
    #[doc(alias = "Trägheitsmoment der Last")]
    pub load_inertia_kg_m2: f64,
    /// Coulomb friction at the motor's shaft, Nm, 0…1000.
    #[doc(alias = "Reibmoment")]
    pub friction_nm: f64,
    /// Friction proportional to the speed at the motor's shaft, Nm·s/rad, 0…100 (0).
    pub viscous_nm_s: f64,
}

impl Mechanics {
    /// Motor revolutions per roller revolution.
    pub fn gear_ratio(&self) -> f64 {
        f64::from(self.gear_numerator) / f64::from(self.gear_denominator)
    }

    /// Film per roller revolution, mm: π d.
    #[doc(alias = "Vorschubkonstante")]
    pub fn feed_constant_mm(&self) -> f64 {
        PI * self.roller_diameter_mm
    }

    /// Motor speed at a film speed, 1/min.
    pub fn motor_rpm(&self, film_mm_s: f64) -> f64 {
        film_mm_s / self.feed_constant_mm() * self.gear_ratio() * 60.0
    }

    /// Film per increment of the motor, mm.
    pub fn mm_per_increment(&self) -> f64 {
        self.feed_constant_mm() / (self.gear_ratio() * INC_PER_REV as f64)
    }

    /// Film for an angle at the roller, mm per arcmin.
    pub fn mm_per_arcmin(&self) -> f64 {
        self.feed_constant_mm() / (360.0 * 60.0)
    }

    /// Inertia behind the gear as the motor sees it, kg m²: J / i², and the gear itself (thesis 5.6, formula VIII).
    pub fn reduced_inertia_kg_m2(&self) -> f64 {
        let ratio = self.gear_ratio();
        self.load_inertia_kg_m2 / (ratio * ratio) + self.gear_inertia_kg_m2
    }
}

/// What is to be moved, how fast, how often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feed {
    /// By length or to the print mark: `mode = "length"` or `"mark"` ("length").
    pub mode: FeedMode,
    /// Length, mm, 200…2000, the limits of the block.
    #[doc(alias = "Strecke")]
    pub length_mm: f64,
    /// Travel velocity, mm/s, 0.1…10⁵; 10…100 % of C1240.
    pub speed_mm_s: f64,
    /// Mark-reading velocity, mm/s, 0.1…10⁵; 10 % of C1240 up to the travel velocity (20 % of C1240, thesis fig. 68).
    pub mark_speed_mm_s: f64,
    /// Acceleration and deceleration, mm/s², 1…10⁶; 10…100 % of C1250.
    pub acceleration_mm_s2: f64,
    /// Time from start to start, s, 0.05…3600.
    #[doc(alias = "Taktzeit")]
    pub cycle_s: f64,
    /// How far a feed may be from what was asked for, mm, 0.0001…100 (0.01).
    pub tolerance_mm: f64,
    /// Feeds between two moments in which an error that adds up is taken away, by a mark or by hand, 1…10⁶ (1).
    pub feeds_in_a_row: u32,
}

/// Pull and stretch of the film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmWeb {
    /// Force of the film against the feed at the roller, N, 0…10⁴ (0); that of `[roll]` comes on top.
    #[doc(alias = "Bahnzug")]
    pub pull_n: f64,
    /// How much that force differs from feed to feed when the film has come to rest, N, 0…10⁴ (0).
    pub pull_change_n: f64,
    /// Free length of film between roller and tool, mm, 0…10⁵ (0).
    pub free_length_mm: f64,
    /// Width, mm, 1…10⁴ (400).
    pub width_mm: f64,
    /// Thickness, µm, 1…10⁴ (100).
    pub thickness_um: f64,
    /// Modulus of elasticity, N/mm², 1…10⁶ (2000).
    pub modulus_n_mm2: f64,
}

impl FilmWeb {
    /// Force for a strain of 1, N: E·b·t.
    pub fn stiffness_n(&self) -> f64 {
        self.modulus_n_mm2 * self.width_mm * self.thickness_um * 1e-3
    }

    /// Stretch of the free length by a force, mm: F·L / (E·b·t).
    #[doc(alias = "Dehnung")]
    pub fn stretch_mm(&self, force_n: f64) -> f64 {
        force_n * self.free_length_mm / self.stiffness_n()
    }
}

impl Default for FilmWeb {
    fn default() -> Self {
        Self {
            pull_n: 0.0,
            pull_change_n: 0.0,
            free_length_mm: 0.0,
            width_mm: 400.0,
            thickness_um: 100.0,
            modulus_n_mm2: 2000.0,
        }
    }
}

/// Print and reader.
#[derive(Debug, Clone, Copy, PartialEq)]
#[doc(alias = "Druckmarke")]
pub struct PrintMarks {
    /// Mean distance from mark to mark, mm, 200…2000 (the feed length).
    pub repeat_mm: f64,
    /// Largest deviation of a distance, mm, 0…1000 (50).
    pub tolerance_mm: f64,
    /// Length of a mark, mm, 0.1…200 (5).
    pub width_mm: f64,
    /// Delay of the reader, µs, 0…10⁵ (0).
    pub reader_delay_us: f64,
    /// Half width of the scatter of that delay, µs, 0…10⁵ (0).
    pub reader_jitter_us: f64,
}

/// What the drive does and has no code for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Positioning {
    /// Resolution of the resolver, bits a revolution, 8…16 (16).
    pub resolver_bits: u8,
    /// Accuracy of the resolver, arcmin of the motor's shaft to either side, 0…600 (10, 9300 facts 6). A run knows it from fidelity F2 on.
    pub resolver_accuracy_arcmin: f64,
    /// How E1 latches: `latch = "exact"` or `"sampled"`, the 1 ms sample ("exact").
    pub latch: LatchMode,
    /// Fractions of an increment: `rounding = "truncate"` or `"carry"` to the next feed ("truncate").
    pub rounding: Rounding,
    /// Half width of the target window, mm, 0.0001…100 (0.009).
    pub target_window_mm: f64,
    /// Inertia by which the acceleration is fed forward, kg m² at the motor, 0…100 (0).
    pub feed_forward_inertia_kg_m2: f64,
}

/// The mains.
#[derive(Debug, Clone, Copy, PartialEq)]
#[doc(alias = "Netz")]
pub struct MainsSupply {
    /// Line-line voltage, V rms, 50…1000 (400).
    pub voltage_v: f64,
    /// Highest voltage at which braking must not switch the drive off, V rms, `voltage_v` up to 1000 (`voltage_v`).
    pub highest_v: f64,
    /// Lowest voltage at which the machine still has to work, V rms, 50 up to `voltage_v` (that).
    pub lowest_v: f64,
}

/// Brake module with its resistor at the DC link.
#[derive(Debug, Clone, Copy, PartialEq)]
#[doc(alias = "Bremswiderstand")]
pub struct BrakeResistor {
    /// Resistance, Ω, 1…10⁴.
    pub resistance_ohm: f64,
    /// What it may take for ever, W, 0.1…10⁵.
    pub rated_w: f64,
    /// What it may take for a moment, W, 1…10⁶ (U_on²/R).
    pub peak_w: f64,
    /// Switched on above this link voltage, V, 50…1500.
    pub on_v: f64,
    /// Switched off below this link voltage, V, 50 up to `on_v`.
    pub off_v: f64,
}

/// PLC and bus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controls {
    /// `plc.cycle_ms`: PLC cycle, ms, 1…100 (5).
    pub plc_cycle_ms: f64,
    /// `bus.dp_cycle_ms`: shortest DP cycle, ms, 0…100; 0 is as fast as the bus allows (1).
    pub dp_cycle_ms: f64,
    /// `bus.baud`: bit/s, one of the ten baud rates (12 000 000).
    pub baud: Baud,
    /// `bus.address`: DP address of the drive, 0…125 (3).
    pub address: u8,
}
