//! Sizing of motor, gear, drive and brake resistor: chapter 5.6 of the thesis, row by row.
//!
//! [`Sizing::of`] reckons the load of one machine cycle ([`LoadCycle`]) and judges it in rows, each with its limit, margin and formula:
//!
//! | group | what is judged | thesis 5.6 |
//! |---|---|---|
//! | gear | optimum ratio, reduced inertia, motor speed | formulas VII, VIII, fig. 40, 41 |
//! | torque | every operating point against the torque-speed curve with its voltage limit; RMS torque at the mean speed against S1 | fig. 42, 43 |
//! | current | RMS and greatest current against motor, drive and C0022 | formula IX, fig. 44 |
//! | power | mean and greatest power | – |
//! | braking | energy that comes back, less what the motor's own copper takes; whether a resistor is needed, and is large enough | "Bremswiderstand" |
//! | heat | utilisation and temperature of motor and drive | fig. 43 |
//! | film | tension against the grip of the roller; only with a `[roll]` | – |
//! | feedback | step of the resolver at the film | "Auswahl des Gebers" |
//! | time, mains | whether the feed fits into the cycle, and the drive to the mains | – |
//!
//! [`Supply`] sums several axes on one DC link ("zentrale Einspeisung"). [`Selection`] sizes every motor, drive and gear of a catalogue ("aus einer Vielzahl an Motoren").
//!
//! The rows have the bare motion: where the speed loop swings in, the torque of the model is above them for some milliseconds (the axis of the
//! thesis breaking away: 31 % by length, 47 % to the mark); at rest it may press against static friction.
//!
//! Left out: iron loss of the motor (in its S1 curve it is contained), loss of the inverter in the brake energy (on the safe side), choice of
//! frame, cooling and cable.
//!
//! ```
//! use film_feed::catalogue::Catalogue;
//! use film_feed::machine_file::MachineFile;
//! use film_feed::size::Sizing;
//!
//! let text = include_str!("../../../docs/examples/machine.toml");
//! let machine = MachineFile::read(text, &Catalogue::built_in())?;
//! let sizing = Sizing::of(&machine);
//! assert!(sizing.ok());
//! // √(32.536e-4 / 0.25e-4)
//! assert!((sizing.row("gear_optimum").unwrap().value - 11.408).abs() < 1e-3);
//! # Ok::<(), lenze9300_model::FileError>(())
//! ```

mod cycle;
mod html;
mod limits;
mod plots;
mod row;
mod rows;
mod selection;
mod supply;
mod text;

use serde::Serialize;

pub use cycle::{LoadCycle, Phase, Point};
pub use html::html;
pub use limits::TorqueLimits;
pub use plots::{cycle_over_time, gear_ratio, torque_over_speed};
pub use row::{Limit, Row, Verdict};

pub use selection::{Candidate, Selection};
pub use supply::Supply;

pub(crate) use row::number;

use crate::machine_file::MachineFile;

/// The sizing of one machine.
#[derive(Debug, Clone, Serialize)]
#[doc(alias = "Auslegung")]
pub struct Sizing {
    /// Name of the machine.
    pub machine: String,
    /// Name of the motor.
    pub motor: String,
    /// Name of the drive.
    pub drive: String,
    /// Whether no row is beyond its limit.
    pub ok: bool,
    /// Whether braking needs a resistor.
    pub resistor_needed: bool,
    /// The rows, group by group.
    pub rows: Vec<Row>,
    /// The load of one cycle.
    pub cycle: LoadCycle,
    /// Numbers of the devices without a source, as `device.key`.
    pub assumed: Vec<String>,
}

impl Sizing {
    /// Sizes a machine.
    pub fn of(machine: &MachineFile) -> Self {
        let cycle = LoadCycle::of(machine);
        let (rows, resistor_needed) = rows::rows(machine, &cycle);
        let from = |device: &str, keys: &[String]| keys.iter().map(|key| format!("{device}.{key}")).collect::<Vec<_>>();
        let mut assumed = from("motor", &machine.motor.assumed);
        assumed.extend(from("drive", &machine.drive.assumed));
        Self {
            machine: machine.name.clone(),
            motor: machine.motor.name.clone(),
            drive: machine.drive.name.clone(),
            ok: rows.iter().all(|row| row.verdict() != Verdict::Fail),
            resistor_needed,
            rows,
            cycle,
            assumed,
        }
    }

    /// Whether no row is beyond its limit.
    pub fn ok(&self) -> bool {
        self.ok
    }

    /// The row of that short name.
    pub fn row(&self, id: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.id == id)
    }

    /// The rows beyond their limit.
    pub fn failures(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.verdict() == Verdict::Fail)
    }
}
