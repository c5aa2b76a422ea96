//! Which motor, drive and gear of a catalogue are large enough: sized one after the other, as chapter 5.6 of the thesis narrows them down.

use std::cmp::Ordering;
use std::fmt;

use lenze9300_model::code::table::number::C0011;
use serde::Serialize;

use super::{Sizing, Verdict};
use crate::catalogue::Catalogue;
use crate::machine_file::{Gear, MachineFile};

/// A motor on a drive behind a gear, sized for a machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Name of the motor.
    pub motor: String,
    /// Name of the drive.
    pub drive: String,
    /// The gear.
    pub gear: Gear,
    /// Rated power of the motor, W, and rated current of the drive, A rms: what they cost goes with them.
    pub motor_rated_w: f64,
    /// See `motor_rated_w`.
    pub drive_rated_a: f64,
    /// Whether they are large enough.
    pub ok: bool,
    /// Short names of the rows beyond their limit.
    pub failed: Vec<&'static str>,
    /// Least margin of all rows, a share of the limit; negative beyond it.
    pub least_margin: f64,
    /// Name of the row that has it.
    pub tightest: String,
}

/// All candidates for a machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Selection {
    /// Name of the machine.
    pub machine: String,
    /// Those that are large enough, smallest first, then the others, nearest first.
    pub candidates: Vec<Candidate>,
}

impl Selection {
    /// Sizes every motor of the catalogue on every drive behind every one of these gears.
    ///
    /// What is set at commissioning follows the candidate: C0022 as in the motor list, C0011 5 % above the speed that is needed, at most
    /// the motor's rated speed.
    pub fn of(machine: &MachineFile, catalogue: &Catalogue, gears: &[Gear]) -> Self {
        let mut candidates = Vec::new();
        for motor in catalogue.motors() {
            for drive in catalogue.drives() {
                for gear in gears {
                    let mut other = machine.with_devices(motor, drive, *gear);
                    let wanted_rpm = 1.05 * other.mechanics.motor_rpm(machine.feed.speed_mm_s);
                    other.set_code(C0011, wanted_rpm.min(motor.rated_speed_rpm));
                    candidates.push(Candidate::of(&other, *gear));
                }
            }
        }
        candidates.sort_by(Candidate::compare);
        Self {
            machine: machine.name.clone(),
            candidates,
        }
    }

    /// Whether one of them is large enough.
    pub fn ok(&self) -> bool {
        self.candidates.first().is_some_and(|candidate| candidate.ok)
    }
}

impl Candidate {
    fn of(machine: &MachineFile, gear: Gear) -> Self {
        let sizing = Sizing::of(machine);
        // The row nearest to its limit; one beyond it has the least margin of all. C0011 was set to fit and tells nothing.
        let tightest = sizing
            .rows
            .iter()
            .filter(|row| match row.verdict() {
                Verdict::Info => false,
                Verdict::Pass => row.id != "motor_speed",
                Verdict::Fail => true,
            })
            .map(|row| (row.margin().unwrap_or(f64::NEG_INFINITY), row.name.as_str()))
            .min_by(|one, other| one.0.total_cmp(&other.0));
        let (least_margin, name) = tightest.unwrap_or((0.0, ""));
        Self {
            motor: machine.motor.name.clone(),
            drive: machine.drive.name.clone(),
            gear,
            motor_rated_w: machine.motor.rated_power_w,
            drive_rated_a: machine.drive.rated_current_a,
            ok: sizing.ok(),
            failed: sizing.failures().map(|row| row.id).collect(),
            least_margin,
            tightest: name.to_owned(),
        }
    }

    /// Large enough before too small; the smaller before the larger; the wider margin before the tighter.
    fn compare(&self, other: &Self) -> Ordering {
        let by_margin = || other.least_margin.total_cmp(&self.least_margin);
        let by_size = || {
            let drive = self.drive_rated_a.total_cmp(&other.drive_rated_a);
            self.motor_rated_w.total_cmp(&other.motor_rated_w).then(drive)
        };
        match (self.ok, other.ok) {
            (true, true) => by_size().then_with(by_margin),
            (false, false) => by_margin().then_with(by_size),
            (ours, theirs) => theirs.cmp(&ours),
        }
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let enough = self.candidates.iter().filter(|candidate| candidate.ok).count();
        writeln!(
            f,
            "{}: {enough} of {} candidates are large enough; the smallest of them first, then those that come nearest",
            self.machine,
            self.candidates.len()
        )?;
        let width = |text: fn(&Candidate) -> String| {
            let widths = self.candidates.iter().map(|candidate| text(candidate).chars().count());
            widths.max().unwrap_or(0).max(5)
        };
        let (motor, drive) = (width(|c| c.motor.clone()), width(|c| c.drive.clone()));
        write!(
            f,
            "\n{:<motor$}  {:<drive$}  {:>7}  {:>7}  {:<4}  tightest",
            "motor", "drive", "gear", "margin", ""
        )?;
        for candidate in &self.candidates {
            let verdict = if candidate.ok { Verdict::Pass } else { Verdict::Fail };
            write!(
                f,
                "\n{:<motor$}  {:<drive$}  {:>7}  {:>5.0} %  {verdict:<4}  {}",
                candidate.motor,
                candidate.drive,
                candidate.gear.to_string(),
                100.0 * candidate.least_margin,
                candidate.tightest
            )?;
        }
        Ok(())
    }
}
