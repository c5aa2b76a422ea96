//! The oscilloscope's memory: named signals of the whole chain, once per millisecond.
//!
//! Signals are named once, here; the CSV file, the plot and the tests read the same samples.

use std::io::{self, Write};

use lenze9300_model::table::{Column, Table};

/// One sample of every signal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    /// Machine time, s.
    pub time_s: f64,
    /// Number of the feed under way, from 1; 0 between feeds.
    pub feed: usize,
    /// Traversing record at work, 0 = none.
    pub record: u8,
    /// Position set-value of the interpolator (POS-SETP), mm of film from the reference.
    pub position_set_mm: f64,
    /// Position actual value (POS-ACT), mm of film from the reference.
    pub position_act_mm: f64,
    /// What the film really moved since power-up, mm.
    pub film_mm: f64,
    /// Speed of the interpolator (POS-NOUT), 1/min at the motor.
    pub speed_set_rpm: f64,
    /// Motor speed (MCTRL-NACT before its filter), 1/min.
    pub speed_act_rpm: f64,
    /// Speed set-value of the position controller (MCTRL-NSET2), 1/min at the motor.
    pub speed_demand_rpm: f64,
    /// Air-gap torque, Nm.
    pub torque_nm: f64,
    /// Mean of the air-gap torque over the millisecond, Nm: without the ripple that its samples always meet at the same place.
    pub torque_mean_nm: f64,
    /// Torque-forming current, A rms.
    pub current_a_rms: f64,
    /// DC-link voltage, V.
    pub dc_link_v: f64,
    /// Control word on the bus as the module took it over.
    pub control_word: u16,
    /// Status word on the bus.
    pub status_word: u16,
}

/// Column names of the CSV file, in the order of [`Sample::write_csv`].
const COLUMNS: [&str; 15] = [
    "time_s",
    "feed",
    "record",
    "pos_setp_mm",
    "pos_act_mm",
    "film_mm",
    "pos_nout_rpm",
    "mctrl_nact_rpm",
    "mctrl_nset2_rpm",
    "torque_nm",
    "torque_mean_nm",
    "current_a_rms",
    "dc_link_v",
    "control_word",
    "status_word",
];

impl Sample {
    fn values(&self) -> [f64; COLUMNS.len()] {
        [
            self.time_s,
            self.feed as f64,
            f64::from(self.record),
            self.position_set_mm,
            self.position_act_mm,
            self.film_mm,
            self.speed_set_rpm,
            self.speed_act_rpm,
            self.speed_demand_rpm,
            self.torque_nm,
            self.torque_mean_nm,
            self.current_a_rms,
            self.dc_link_v,
            f64::from(self.control_word),
            f64::from(self.status_word),
        ]
    }

    fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(
            out,
            "{:.6},{},{},{:.6},{:.6},{:.6},{:.4},{:.4},{:.4},{:.6},{:.6},{:.6},{:.3},0x{:04X},0x{:04X}",
            self.time_s,
            self.feed,
            self.record,
            self.position_set_mm,
            self.position_act_mm,
            self.film_mm,
            self.speed_set_rpm,
            self.speed_act_rpm,
            self.speed_demand_rpm,
            self.torque_nm,
            self.torque_mean_nm,
            self.current_a_rms,
            self.dc_link_v,
            self.control_word,
            self.status_word,
        )
    }
}

/// Writes `samples` with a heading line.
///
/// # Errors
/// Whatever the writer reports.
pub fn write_csv(samples: &[Sample], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    for sample in samples {
        sample.write_csv(out)?;
    }
    out.flush()
}

/// The samples as columns under the same names, without units: they are in the names.
pub fn table(samples: &[Sample]) -> Table {
    let mut table = Table::new(COLUMNS.map(|name| Column::new(name, "")));
    for sample in samples {
        table.push(&sample.values());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_as_many_fields_as_the_heading() {
        let mut text = Vec::new();
        write_csv(
            &[Sample {
                status_word: 0x0237,
                ..Sample::default()
            }],
            &mut text,
        )
        .unwrap();
        let text = String::from_utf8(text).unwrap();
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [COLUMNS.len(); 2]);
        assert!(text.ends_with(",0x0000,0x0237\n"), "{text}");
    }
}
