//! What a run found out: a row per feed, the bus, the verdict; as a table for people and as one object for machines.

use std::fmt;

use dp_master::dp::MasterStatistics;
use dp_master::time::Baud;
use lenze9300_model::plant::EnergyBalance;
use serde::Serialize;

use crate::machine::Film;

/// Largest error of a feed that counts as landed, mm (film-feed specification, sections 1 and 10).
pub const TOLERANCE_MM: f64 = 0.01;

/// How a feed finds its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FeedMode {
    /// By length: record 02 of the program.
    Length,
    /// By print mark: records 03 and 04 (German: Druckmarke).
    #[doc(alias = "Druckmarke")]
    Mark,
}

impl fmt::Display for FeedMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FeedMode::Length => "length",
            FeedMode::Mark => "mark",
        })
    }
}

/// One feed.
///
/// The figures that only the inside of the modelled drive and machine can tell are absent when the far end is a
/// real line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeedReport {
    /// Running number over the whole run, from 1.
    pub n: usize,
    /// How the feed found its end.
    pub mode: FeedMode,
    /// What the film had to move, mm: the feed length; in mark mode the way to 50 mm behind the mark that was found.
    /// Absent where no mark was found, or none can be seen from here.
    pub commanded_mm: Option<f64>,
    /// What the film moved, mm; over a real line what POS_ACT says it moved.
    pub film_mm: Option<f64>,
    /// `film_mm` minus `commanded_mm`, mm.
    pub error_mm: Option<f64>,
    /// The block's output POS_ACT when the feed was over, mm.
    pub pos_act_mm: Option<f64>,
    /// From the program's start in the drive until the interpolator reached its target, s.
    pub set_point_s: Option<f64>,
    /// From the program's start in the drive until the film stayed within ±0.01 mm of its target, s.
    pub in_position_s: Option<f64>,
    /// From POS_START to JOB_FIN as the PLC sees it, s.
    pub job_s: Option<f64>,
    /// Whether JOB_FIN came.
    pub finished: bool,
    /// Highest motor speed, 1/min.
    pub peak_rpm: Option<f64>,
    /// Highest air-gap torque, Nm.
    pub peak_torque_nm: Option<f64>,
    /// Motor current over the feed, A rms.
    pub rms_current_a: Option<f64>,
    /// Highest motor current, A rms: its peak value by √2, as C0054 shows it.
    pub peak_current_a: Option<f64>,
    /// Largest distance between position set-value and actual value, mm of film.
    pub max_following_error_mm: Option<f64>,
    /// Whether the film ran backwards by more than the tolerance.
    pub reversed: bool,
}

impl FeedReport {
    /// Whether the feed finished and, where the error can be known, landed within ±0.01 mm.
    pub fn landed(&self, error: ErrorKnown) -> bool {
        match (self.error_mm, error) {
            (Some(error_mm), _) => self.finished && error_mm.abs() <= TOLERANCE_MM,
            (None, ErrorKnown::Always) => false,
            (None, ErrorKnown::WhereTheBusTells) => self.finished,
        }
    }
}

/// Whether the error of every feed must be known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKnown {
    /// In the simulated machine the film can be measured: a feed without a figure did not land.
    Always,
    /// Over a real line the position of a print mark is not known here: JOB_FIN decides.
    WhereTheBusTells,
}

/// The bus over the whole run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BusReport {
    /// Baud rate, bit/s.
    pub baud: u32,
    /// Mean time from one DP cycle to the next, µs.
    pub cycle_us: f64,
    /// Bus time of the last Data_Exchange, first bit of the request to last bit of the reply, µs.
    pub exchange_us: f64,
    /// Telegrams the master sent and accepted.
    pub telegrams: u64,
    /// Requests the master repeated.
    pub retries: u64,
    /// Telegrams discarded as corrupt, by the master and (where it is ours) by the slave.
    pub rejected: u64,
}

impl BusReport {
    /// What the master counted, with `rejected_by_slave` telegrams that our own slave discarded.
    pub fn new(baud: Baud, master: &MasterStatistics, rejected_by_slave: u64) -> Self {
        BusReport {
            baud: baud.bits_per_second(),
            cycle_us: master.mean_cycle.as_nanos() as f64 / 1000.0,
            exchange_us: master.last_exchange.as_nanos() as f64 / 1000.0,
            telegrams: master.sent + master.received,
            retries: master.retries,
            rejected: master.discarded + rejected_by_slave,
        }
    }
}

/// A parameter of the block that the drive refused, or that was not answered.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ParameterTrouble {
    /// The code with its subcode, such as `C1301/1`.
    pub code: String,
    /// What happened, in one sentence.
    pub what: String,
}

/// Where the energy of the run came from and went, J; see [`EnergyBalance`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnergyReport {
    /// Taken from the mains.
    pub mains_j: f64,
    /// Heat in mains and rectifier.
    pub source_loss_j: f64,
    /// Used by the drive's supply.
    pub standby_j: f64,
    /// Heat in the brake resistor.
    pub brake_j: f64,
    /// Heat in the switches of the inverter.
    pub inverter_loss_j: f64,
    /// Heat in the windings.
    pub copper_j: f64,
    /// Heat of friction.
    pub friction_j: f64,
    /// Heat in the gear.
    pub coupling_loss_j: f64,
    /// Given to the load, the film's tension among it.
    pub load_j: f64,
    /// What braking gave back to the DC link.
    pub regenerated_j: f64,
    /// Stored at the end more than at the start: capacitor, field, masses, twist.
    pub stored_j: f64,
    /// What does not add up, as a share of all that passed: the error of the integration.
    pub relative_residual: f64,
}

impl From<&EnergyBalance> for EnergyReport {
    fn from(balance: &EnergyBalance) -> Self {
        EnergyReport {
            mains_j: balance.mains_j,
            source_loss_j: balance.source_loss_j,
            standby_j: balance.standby_j,
            brake_j: balance.brake_j,
            inverter_loss_j: balance.inverter_loss_j,
            copper_j: balance.copper_j,
            friction_j: balance.friction_j,
            coupling_loss_j: balance.coupling_loss_j,
            load_j: balance.load_j,
            regenerated_j: balance.regenerated_j,
            stored_j: balance.capacitor_j + balance.field_j + balance.kinetic_j + balance.elastic_j,
            relative_residual: balance.relative_residual(),
        }
    }
}

/// What an elastic film went through since it was threaded last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FilmReport {
    /// Lowest tension, N; 0 when it ran slack.
    pub min_tension_n: f64,
    /// Highest tension, N.
    pub max_tension_n: f64,
    /// Way that it fell behind the roller by slip and creep, mm.
    pub slipped_mm: f64,
    /// Radius of the roll at the end, mm.
    pub roll_radius_mm: f64,
}

impl FilmReport {
    /// `None` for a film that does not stretch.
    pub fn new(film: &Film) -> Option<Self> {
        let (min_tension_n, max_tension_n) = film.tension_range_n()?;
        Some(FilmReport {
            min_tension_n,
            max_tension_n,
            slipped_mm: film.slipped_mm()?,
            roll_radius_mm: film.roll_radius_mm()?,
        })
    }
}

/// The whole run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    /// A row per feed.
    pub feeds: Vec<FeedReport>,
    /// The bus.
    pub bus: BusReport,
    /// Parameters refused or lost, each named once.
    pub parameters: Vec<ParameterTrouble>,
    /// Energy of the modelled drive; absent when the far end is a real line.
    pub energy: Option<EnergyReport>,
    /// An elastic film; absent for one that goes with the roller.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub film: Option<FilmReport>,
    /// What a user should know of feeds that finished otherwise.
    pub warnings: Vec<String>,
    /// Why the run ended early, if it did.
    pub aborted: Option<String>,
    /// Time that passed in the machine, s.
    pub simulated_s: f64,
    /// Time that passed outside, s.
    pub wall_s: f64,
    /// `simulated_s` by `wall_s`.
    pub speedup: f64,
    /// Whether every feed finished and landed.
    pub ok: bool,
}

impl RunReport {
    /// The feeds of one mode.
    pub fn series(&self, mode: FeedMode) -> impl Iterator<Item = &FeedReport> {
        self.feeds.iter().filter(move |feed| feed.mode == mode)
    }

    fn largest_error_mm(&self) -> Option<f64> {
        self.feeds
            .iter()
            .filter_map(|feed| feed.error_mm)
            .map(f64::abs)
            .reduce(f64::max)
    }
}

/// A table per series, then the summary.
impl fmt::Display for RunReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (mode, title) in [
            (FeedMode::Length, "Feeds by length"),
            (FeedMode::Mark, "Feeds to the print mark"),
        ] {
            let mut rows = self.series(mode).peekable();
            if rows.peek().is_none() {
                continue;
            }
            writeln!(f, "{title}")?;
            writeln!(f, "{HEADING}")?;
            for row in rows {
                write_row(f, row)?;
            }
            writeln!(f)?;
        }
        self.write_summary(f)
    }
}

impl RunReport {
    fn write_summary(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let finished = self.feeds.iter().filter(|feed| feed.finished).count();
        let within = self
            .feeds
            .iter()
            .filter(|feed| feed.error_mm.is_some_and(|error| error.abs() <= TOLERANCE_MM))
            .count();
        let reversed = self.feeds.iter().filter(|feed| feed.reversed).count();
        let measured = self.feeds.iter().filter(|feed| feed.error_mm.is_some()).count();
        let all = self.feeds.len();
        write!(
            f,
            "{within} of {all} feeds within ±{TOLERANCE_MM} mm, {finished} finished, {reversed} reversed"
        )?;
        if measured < all {
            write!(f, ", {} without a known target", all - measured)?;
        }
        match self.largest_error_mm() {
            Some(error) => writeln!(f, "; largest error {:.2} µm", error * 1000.0)?,
            None => writeln!(f)?,
        }
        writeln!(
            f,
            "bus: {} kbit/s, DP cycle {:.1} µs, exchange {:.1} µs, {} telegrams, {} retries, {} rejected",
            f64::from(self.bus.baud) / 1000.0,
            self.bus.cycle_us,
            self.bus.exchange_us,
            self.bus.telegrams,
            self.bus.retries,
            self.bus.rejected
        )?;
        if let Some(energy) = &self.energy {
            writeln!(
                f,
                "energy: {:.1} J from the mains: {:.1} J copper, {:.1} J friction, {:.1} J load, {:.1} J supply; braking gave back {:.1} J",
                energy.mains_j,
                energy.copper_j,
                energy.friction_j,
                energy.load_j,
                energy.standby_j,
                energy.regenerated_j
            )?;
        }
        if let Some(film) = &self.film {
            writeln!(
                f,
                "film: tension {:.1}…{:.1} N, {:.3} mm slipped, roll radius {:.1} mm",
                film.min_tension_n, film.max_tension_n, film.slipped_mm, film.roll_radius_mm
            )?;
        }
        for trouble in &self.parameters {
            writeln!(f, "parameter {}: {}", trouble.code, trouble.what)?;
        }
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        if let Some(reason) = &self.aborted {
            writeln!(f, "ended early: {reason}")?;
        }
        write!(
            f,
            "{:.3} s of machine time in {:.3} s ({:.0} times real time): {}",
            self.simulated_s,
            self.wall_s,
            self.speedup,
            if self.ok { "ok" } else { "NOT OK" }
        )
    }
}

const HEADING: &str = "   n  commanded       film      error    POS_ACT  set-point  in pos.     job   peak  torque  current  foll. err.  reversed  finished
             mm         mm         µm         mm          s        s       s  1/min      Nm    A rms          mm";

fn write_row(f: &mut fmt::Formatter<'_>, row: &FeedReport) -> fmt::Result {
    writeln!(
        f,
        "{:>4} {} {} {} {}  {} {} {} {} {} {} {} {:>9} {:>9}",
        row.n,
        cell(row.commanded_mm, 10, 4),
        cell(row.film_mm, 10, 4),
        cell(row.error_mm.map(|mm| mm * 1000.0), 10, 3),
        cell(row.pos_act_mm, 10, 4),
        cell(row.set_point_s, 9, 3),
        cell(row.in_position_s, 8, 3),
        cell(row.job_s, 7, 3),
        cell(row.peak_rpm, 6, 0),
        cell(row.peak_torque_nm, 7, 3),
        cell(row.rms_current_a, 8, 3),
        cell(row.max_following_error_mm, 11, 4),
        if row.reversed { "yes" } else { "no" },
        if row.finished { "yes" } else { "NO" },
    )
}

/// A figure in a column; a dash where there is none.
fn cell(value: Option<f64>, width: usize, decimals: usize) -> String {
    match value {
        Some(value) => format!("{value:>width$.decimals$}"),
        None => format!("{:>width$}", "–"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn feed(error_mm: Option<f64>, finished: bool) -> FeedReport {
        FeedReport {
            n: 1,
            mode: FeedMode::Length,
            commanded_mm: Some(1200.0),
            film_mm: error_mm.map(|error| 1200.0 + error),
            error_mm,
            pos_act_mm: Some(1200.0),
            set_point_s: Some(1.5),
            in_position_s: Some(1.6),
            job_s: Some(1.6),
            finished,
            peak_rpm: None,
            peak_torque_nm: None,
            rms_current_a: None,
            peak_current_a: None,
            max_following_error_mm: None,
            reversed: false,
        }
    }

    #[test]
    fn a_feed_lands_only_within_a_hundredth_of_a_millimetre() {
        assert!(feed(Some(0.01), true).landed(ErrorKnown::Always));
        assert!(feed(Some(-0.01), true).landed(ErrorKnown::Always));
        assert!(!feed(Some(0.010_1), true).landed(ErrorKnown::Always));
        assert!(!feed(Some(0.0), false).landed(ErrorKnown::Always));
    }

    #[test]
    fn an_unknown_error_counts_as_landed_only_where_the_bus_cannot_tell() {
        assert!(!feed(None, true).landed(ErrorKnown::Always));
        assert!(feed(None, true).landed(ErrorKnown::WhereTheBusTells));
        assert!(!feed(None, false).landed(ErrorKnown::WhereTheBusTells));
    }

    #[test]
    fn the_object_has_the_documented_keys_in_their_order() {
        let json = serde_json::to_string(&feed(Some(0.0), true)).unwrap();
        let keys: Vec<usize> = [
            "n",
            "mode",
            "commanded_mm",
            "film_mm",
            "error_mm",
            "pos_act_mm",
            "set_point_s",
            "in_position_s",
            "job_s",
            "finished",
            "peak_rpm",
            "peak_torque_nm",
            "rms_current_a",
            "peak_current_a",
            "max_following_error_mm",
            "reversed",
        ]
        .iter()
        .map(|key| {
            json.find(&format!("\"{key}\":"))
                .unwrap_or_else(|| panic!("{key} is missing in {json}"))
        })
        .collect();
        assert!(keys.is_sorted(), "{json}");
        assert!(json.contains("\"mode\":\"length\""));
    }
}
