//! Error budget of a feed: how much each part of the machine can put the film beside its place, and which part to pay for.
//!
//! The error is that of the standing film: where it is at the end of a feed, against where the length of all feeds since the last reference
//! (by length) or the print mark (to the mark) should have put it. Every part has a bound that it never passes; the worst case is their sum,
//! the root of the sum of their squares is what parts that know nothing of each other seldom pass.
//!
//! | part | bound | source |
//! |---|---|---|
//! | rounding | fraction of an increment that the target loses, added up over the feeds in a row; what the block's 0.1 mm step loses | thesis ch. 9, 9300 facts 4.6 |
//! | constant | C1204 with its four decimals against π·d, added up likewise | 9300 facts 4.6 |
//! | resolution | a step of the resolver: two readings, each rounded down | 9300 facts 4.6 |
//! | accuracy | error of the resolver at either end of the way | 9300 facts 6 (assumed there) |
//! | control | where JOB_FIN lets static friction hold the axis: the target window, or less where the loops are stiffer | 9300 facts 4.3 |
//! | latch | way of the film until the drive has seen the edge | 9300 facts 4.3 |
//! | reader | way of the film until the reader has switched | machine file |
//! | strain, creep | relaxed film is shorter than what the roller passed; it falls behind the roller | `machine::WebParams` |
//! | film | change of the stretch between feeds, at the tool and from reader to roller | machine file |
//! | backlash, gear, roller | play, transmission error, diameter | machine file |
//!
//! ```
//! use film_feed::budget::Budget;
//! use film_feed::catalogue::Catalogue;
//! use film_feed::machine_file::MachineFile;
//!
//! let text = include_str!("../../docs/examples/machine.toml");
//! let machine = MachineFile::read(text, &Catalogue::built_in())?;
//! let budget = Budget::of(&machine);
//! // 0.455 increments of 0.39034 µm (9300 facts 11)
//! assert!((budget.part("rounding").unwrap().mm - 0.000_178).abs() < 1e-6);
//! # Ok::<(), lenze9300_model::FileError>(())
//! ```

use std::fmt;

use lenze9300_model::code::table::number::{C1202, C1203, C1204};
use lenze9300_model::traverse::{LatchMode, Rounding};
use serde::Serialize;

use crate::machine::RESIDUAL_PATH_MM;
use crate::machine_file::MachineFile;
use crate::report::FeedMode;
use crate::size::number;

/// What one part of the machine adds to the error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// Short name that stays the same from version to version.
    pub id: &'static str,
    /// What it is.
    pub name: &'static str,
    /// Bound of its error, mm.
    pub mm: f64,
    /// Its share of the worst case, 0…1.
    pub share: f64,
    /// How the bound is reckoned.
    pub formula: String,
    /// What makes it smaller.
    pub remedy: &'static str,
}

/// The error budget of one machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[doc(alias = "Fehlerbudget")]
pub struct Budget {
    /// Name of the machine.
    pub machine: String,
    /// How its feeds find their end.
    pub mode: FeedMode,
    /// The parts, in the order from the command to the film; those that are nothing are there, too.
    pub parts: Vec<Part>,
    /// Sum of all bounds, mm.
    pub worst_mm: f64,
    /// Root of the sum of their squares, mm.
    pub rss_mm: f64,
    /// What is allowed, mm.
    pub tolerance_mm: f64,
    /// Whether the root of the sum of squares is within it.
    pub ok: bool,
    /// The part to pay for: the largest. `None` when there is no error at all.
    pub pay_for: Option<&'static str>,
    /// Worst case and root of the sum of squares without that part, mm.
    pub without_it_mm: Option<(f64, f64)>,
}

impl Budget {
    /// The budget of a machine.
    pub fn of(machine: &MachineFile) -> Self {
        let mut parts = parts(machine);
        let worst_mm: f64 = parts.iter().map(|part| part.mm).sum();
        for part in &mut parts {
            part.share = if worst_mm > 0.0 { part.mm / worst_mm } else { 0.0 };
        }
        let largest = parts
            .iter()
            .filter(|part| part.mm > 0.0)
            .max_by(|one, other| one.mm.total_cmp(&other.mm));
        let pay_for = largest.map(|part| part.id);
        let without_it_mm = pay_for.map(|id| {
            let others = || parts.iter().filter(|part| part.id != id).map(|part| part.mm);
            (others().sum(), root_of_squares(others()))
        });
        let rss_mm = root_of_squares(parts.iter().map(|part| part.mm));
        Self {
            machine: machine.name.clone(),
            mode: machine.feed.mode,
            worst_mm,
            rss_mm,
            tolerance_mm: machine.feed.tolerance_mm,
            ok: rss_mm <= machine.feed.tolerance_mm,
            pay_for,
            without_it_mm,
            parts,
        }
    }

    /// The part of that short name.
    pub fn part(&self, id: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.id == id)
    }
}

fn root_of_squares(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}

fn part(id: &'static str, name: &'static str, mm: f64, formula: impl Into<String>, remedy: &'static str) -> Part {
    Part {
        id,
        name,
        mm,
        share: 0.0,
        formula: formula.into(),
        remedy,
    }
}

fn parts(machine: &MachineFile) -> Vec<Part> {
    let mut parts = command(machine).to_vec();
    parts.extend(drive(machine));
    parts.extend(mark(machine));
    parts.extend(mechanics(machine));
    parts
}

/// What is lost between the wish and the target.
fn command(machine: &MachineFile) -> [Part; 2] {
    let mechanics = &machine.mechanics;
    let inc_mm = mechanics.mm_per_increment();
    let (length_mm, feeds) = (machine.feed.length_mm, f64::from(machine.feed.feeds_in_a_row));
    let gear = machine.codes.number(C1202, 0) / machine.codes.number(C1203, 0);
    let constant_mm = machine.codes.number(C1204, 0);
    let per_mm = 65_536.0 * gear / constant_mm;
    let tenth_mm = (length_mm * 10.0).round() / 10.0;
    let (rounding_mm, formula) = match (machine.feed.mode, machine.positioning.rounding) {
        (FeedMode::Mark, _) => (
            (1.0 + (RESIDUAL_PATH_MM * per_mm).fract()) * inc_mm,
            "1 inc of the latch + what 50 mm lose".to_owned(),
        ),
        (FeedMode::Length, Rounding::Truncate) => (
            feeds * ((tenth_mm * per_mm).fract() * inc_mm + (length_mm - tenth_mm).abs()),
            format!(
                "{feeds}·frac({} mm·{} inc/mm)·{} µm, and the block's step of 0.1 mm",
                number(tenth_mm),
                number(per_mm),
                number(1000.0 * inc_mm)
            ),
        ),
        (FeedMode::Length, Rounding::CarryResidue) => (
            inc_mm + feeds * (length_mm - tenth_mm).abs(),
            "1 inc, the rest is carried on; and the block's step of 0.1 mm".to_owned(),
        ),
    };
    // True film per millimetre that the drive reckons with.
    let scale = 1.0 - per_mm * inc_mm;
    let (scaled_mm, way) = match machine.feed.mode {
        FeedMode::Length => (feeds * length_mm, format!("{feeds}·length")),
        FeedMode::Mark => (RESIDUAL_PATH_MM, "50 mm".to_owned()),
    };
    [
        part(
            "rounding",
            "whole increments of the target",
            rounding_mm,
            formula,
            "let the drive carry the residue (positioning.rounding), or set the reference more often (feed.feeds_in_a_row)",
        ),
        part(
            "constant",
            "feed constant C1204",
            (scaled_mm * scale).abs(),
            format!("{way}·|1 − π·d·C1202/(i·C1203·C1204)|"),
            "give gear and C1204 as they are, with all four decimals",
        ),
    ]
}

/// What the drive cannot see or does not correct.
fn drive(machine: &MachineFile) -> [Part; 3] {
    let mechanics = &machine.mechanics;
    let positioning = &machine.positioning;
    let bits = u32::from(positioning.resolver_bits);
    let step_mm = mechanics.mm_per_increment() * f64::from(1_u32 << (16_u32.saturating_sub(bits)));
    let arcmin_mm = mechanics.mm_per_arcmin() / mechanics.gear_ratio();
    let axis = machine.axis_params(0);
    let k_v = axis.codes.c0254_position_gain * axis.scaling.k_v_per_c0254;
    let stiffness = axis.speed_gains().k_p * k_v;
    let mm_per_rad = 0.5 * mechanics.roller_diameter_mm / mechanics.gear_ratio();
    let held_mm = mechanics.friction_nm / stiffness * mm_per_rad;
    [
        part(
            "resolution",
            "step of the resolver",
            step_mm,
            format!("2^−{bits} turns at the motor, two readings rounded down"),
            "a converter or encoder with more bits (positioning.resolver_bits)",
        ),
        part(
            "accuracy",
            "accuracy of the resolver",
            2.0 * positioning.resolver_accuracy_arcmin * arcmin_mm,
            format!(
                "2·{}′·π·d/(21 600·i): begin and end of the way",
                number(positioning.resolver_accuracy_arcmin)
            ),
            "an encoder that is more accurate (positioning.resolver_accuracy_arcmin), or a larger gear ratio",
        ),
        part(
            "control",
            "where static friction may hold the axis at JOB_FIN",
            positioning.target_window_mm.min(held_mm),
            format!(
                "least of the target window {} mm and M_friction·d/(2·i·K_p·k_v) = {} mm",
                number(positioning.target_window_mm),
                number(held_mm)
            ),
            "a smaller target window (positioning.target_window_mm), stiffer loops (C0070, C0254), less friction",
        ),
    ]
}

/// What happens between the mark and the latched position.
fn mark(machine: &MachineFile) -> [Part; 2] {
    let speed_mm_s = match machine.feed.mode {
        FeedMode::Length => 0.0,
        FeedMode::Mark => machine.feed.mark_speed_mm_s,
    };
    let (delay_s, formula) = match machine.positioning.latch {
        LatchMode::Fast => (FAST_INPUT_S, "v_mark·10 µs"),
        LatchMode::Sampled1ms => (1e-3, "v_mark·1 ms"),
    };
    let marks = &machine.marks;
    [
        part(
            "latch",
            "latch of the mark in the drive",
            speed_mm_s * delay_s,
            formula,
            "a fast input (positioning.latch = \"exact\"), or a slower mark-reading velocity",
        ),
        part(
            "reader",
            "delay of the mark reader",
            speed_mm_s * (marks.reader_delay_us + marks.reader_jitter_us) * 1e-6,
            "v_mark·(delay + jitter)",
            "a faster reader, a slower mark-reading velocity; a delay that is always the same can be taken off the residual path",
        ),
    ]
}

/// What lies between the motor and the film.
fn mechanics(machine: &MachineFile) -> [Part; 6] {
    let (mechanics, film, feed) = (&machine.mechanics, &machine.film, &machine.feed);
    let arcmin_mm = mechanics.mm_per_arcmin();
    let radius_m = 0.5e-3 * mechanics.roller_diameter_mm;
    // As long as the pull is stronger than the load's inertia while braking, the teeth never leave their flank.
    let inertia_nm = mechanics.load_inertia_kg_m2 * feed.acceleration_mm_s2 * 1e-3 / radius_m;
    let (braking_n, _) = machine.pull_n(-feed.acceleration_mm_s2);
    let preloaded = braking_n * radius_m > inertia_nm;
    let way_mm = match feed.mode {
        FeedMode::Length => f64::from(feed.feeds_in_a_row) * feed.length_mm,
        FeedMode::Mark => RESIDUAL_PATH_MM,
    };
    // The roller passes film that is stretched; on the product it is relaxed.
    let (_, pull_n) = machine.pull_n(0.0);
    let stiffness_n = film.stiffness_n();
    let to_reader_mm = machine.roll.map_or(0.0, |roll| roll.reader_to_roller_mm);
    let creep_per_n = machine.roll.map_or(0.0, |roll| roll.creep_per_n);
    let tolerance = mechanics.roller_diameter_tolerance_mm / mechanics.roller_diameter_mm;
    [
        part(
            "backlash",
            "play of the gear",
            if preloaded {
                0.0
            } else {
                mechanics.gear_backlash_arcmin * arcmin_mm
            },
            if preloaded {
                "0: F·r > J_load·α, the pull keeps the teeth on their flank".to_owned()
            } else {
                format!("{}′·π·d/21 600", number(mechanics.gear_backlash_arcmin))
            },
            "a gear with less play, or a pull of the film above J_load·a/r²",
        ),
        part(
            "gear",
            "transmission error of the gear",
            2.0 * mechanics.gear_error_arcmin * arcmin_mm,
            format!(
                "2·{}′·π·d/21 600: begin and end of the way",
                number(mechanics.gear_error_arcmin)
            ),
            "a better gear, or an encoder at the roller",
        ),
        part(
            "roller",
            "diameter of the roller",
            way_mm * tolerance,
            format!("{} mm·Δd/d", number(way_mm)),
            "measure the roller and correct C1204, or feed to marks",
        ),
        part(
            "strain",
            "film that is stretched on the roller",
            way_mm * pull_n / (stiffness_n + pull_n),
            format!(
                "{} mm·ε/(1 + ε), ε = F/(E·b·t), F up to {} N",
                number(way_mm),
                number(pull_n)
            ),
            "less pull (roll.brake_nm), or take the strain into C1204, or feed to marks",
        ),
        part(
            "creep",
            "creep of the film on the roller",
            way_mm * creep_per_n * pull_n,
            format!("{} mm·creep·F", number(way_mm)),
            "more pressure or a better surface of the roller, or feed to marks",
        ),
        part(
            "film",
            "film that comes to rest with another stretch",
            film.stretch_mm(film.pull_change_n) + to_reader_mm * pull_n / stiffness_n,
            "(ΔF·L + F·L_reader)/(E·b·t)",
            "a steadier pull of the film, shorter ways from reader to roller and from roller to tool",
        ),
    ]
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "Error budget of {}, feeds {}",
            self.machine,
            match self.mode {
                FeedMode::Length => "by length",
                FeedMode::Mark => "to the print mark",
            }
        )?;
        let width = self
            .parts
            .iter()
            .map(|part| part.name.chars().count())
            .max()
            .unwrap_or(0);
        writeln!(
            f,
            "\n{:<width$}  {:>11}  {:>6}  formula",
            "part", "bound in µm", "share"
        )?;
        for part in &self.parts {
            writeln!(
                f,
                "{:<width$}  {:>11}  {:>4.0} %  {}",
                part.name,
                number(1000.0 * part.mm),
                100.0 * part.share,
                part.formula
            )?;
        }
        writeln!(
            f,
            "\nworst case ±{} mm, root of the sum of squares ±{} mm, allowed ±{} mm",
            number(self.worst_mm),
            number(self.rss_mm),
            number(self.tolerance_mm)
        )?;
        let (Some(part), Some((worst_mm, rss_mm))) = (self.pay_for.and_then(|id| self.part(id)), self.without_it_mm)
        else {
            return write!(f, "There is nothing to pay for.");
        };
        writeln!(f, "Pay for the {}: {}.", part.name, part.remedy)?;
        writeln!(
            f,
            "Without it ±{} mm and ±{} mm are left.",
            number(worst_mm),
            number(rss_mm)
        )?;
        f.write_str(if self.worst_mm <= self.tolerance_mm {
            "The tolerance is held even in the worst case."
        } else if self.ok {
            "The tolerance is held, though not in the worst case."
        } else {
            "The tolerance is NOT held."
        })
    }
}

/// What a fast input takes to latch, s (9300 facts 4.3: E4 and E5 "in less than 10 µs"; the model latches at the edge itself).
const FAST_INPUT_S: f64 = 10e-6;
