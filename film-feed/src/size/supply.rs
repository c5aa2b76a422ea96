//! Several axes on one DC link: a supply for the sum of their powers (thesis 5.6, "zentrale Einspeisung").

use std::f64::consts::SQRT_2;
use std::fmt;

use serde::Serialize;

use super::cycle::LoadCycle;
use super::number;
use super::row::{Limit, Row, Verdict};
use super::text::write_rows;
use crate::machine_file::MachineFile;

/// The supply of several axes whose DC links are joined.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[doc(alias = "Einspeisung")]
pub struct Supply {
    /// Names of the machines.
    pub machines: Vec<String>,
    /// Whether no row is beyond its limit.
    pub ok: bool,
    /// The rows.
    pub rows: Vec<Row>,
}

impl Supply {
    /// Sums the powers of the machines; `None` for fewer than two.
    ///
    /// Their cycles are not in step, so that all may accelerate, and all may brake, at the same time; a brake resistor of one serves all.
    pub fn of(machines: &[MachineFile]) -> Option<Self> {
        if machines.len() < 2 {
            return None;
        }
        let cycles: Vec<(&MachineFile, LoadCycle)> = machines.iter().map(|axis| (axis, LoadCycle::of(axis))).collect();
        let sum = |figure: &dyn Fn(&MachineFile, &LoadCycle) -> f64| -> f64 {
            cycles.iter().map(|(machine, cycle)| figure(machine, cycle)).sum()
        };
        let mean_w = sum(&|axis, cycle| cycle.mean(|point| point.electrical_w(&axis.motor)) + axis.drive.standby_w);
        let peak_w =
            sum(&|axis, cycle| cycle.peak(|point| point.electrical_w(&axis.motor)).max(0.0) + axis.drive.standby_w);
        let brake_peak_w = sum(&|axis, cycle| cycle.peak(|point| -point.electrical_w(&axis.motor)).max(0.0));
        let brake_mean_w = sum(&|axis, cycle| cycle.mean(|point| (-point.electrical_w(&axis.motor)).max(0.0)));
        let piled_j = sum(&|axis, cycle| cycle.piled_up_j(|point| -point.electrical_w(&axis.motor)));
        let capacitance_uf = sum(&|axis, _| axis.drive.link_capacitance_uf);
        let least = |figure: &dyn Fn(&MachineFile) -> f64| machines.iter().map(figure).fold(f64::INFINITY, f64::min);
        let switch_off_v = least(&|axis| axis.drive.link_overvoltage_v);
        let highest_v = SQRT_2 * -least(&|axis| -axis.mains.highest_v);
        let risen_v = (highest_v * highest_v + 2.0 * piled_j / (capacitance_uf * 1e-6)).sqrt();
        let brakes = || machines.iter().filter_map(|axis| axis.brake);
        let fitted = brakes().count() > 0;
        let mut rows = vec![
            row(
                "mean_power",
                "mean power of all axes",
                (mean_w, "W"),
                Limit::None,
                "ΣΣ(M·ω + 3·R·I²)·t/T + P_standby; what one gives back another takes",
            ),
            row(
                "peak_power",
                "greatest power, if all accelerate at once",
                (peak_w, "W"),
                Limit::None,
                "Σ max(M·ω + 3·R·I²) + P_standby",
            ),
            row(
                "brake_peak",
                "greatest power back, if all brake at once",
                (brake_peak_w, "W"),
                Limit::None,
                "Σ max −(M·ω + 3·R·I²)",
            ),
            row(
                "supply_link_voltage",
                "link voltage, if all brake at once, against switching off",
                (risen_v, "V"),
                if fitted {
                    Limit::None
                } else {
                    Limit::AtMost(switch_off_v)
                },
                format!("√(2·U_mains² + 2·ΣE/ΣC), ΣC = {} µF", number(capacitance_uf)),
            ),
        ];
        if fitted {
            // Resistors side by side: each takes what it can.
            let rated_w: f64 = brakes().map(|brake| brake.rated_w).sum();
            let peak_w: f64 = brakes()
                .map(|brake| brake.peak_w.min(brake.on_v * brake.on_v / brake.resistance_ohm))
                .sum();
            rows.push(row(
                "supply_brake_mean",
                "mean power back, against all resistors",
                (brake_mean_w, "W"),
                Limit::AtMost(rated_w),
                "ΣE/T against the sum of their ratings",
            ));
            rows.push(row(
                "supply_brake_peak",
                "greatest power back, against all resistors",
                (brake_peak_w, "W"),
                Limit::AtMost(peak_w),
                "against the sum of what each can take",
            ));
        }
        Some(Self {
            machines: machines.iter().map(|axis| axis.name.clone()).collect(),
            ok: rows.iter().all(|row| row.verdict() != Verdict::Fail),
            rows,
        })
    }
}

fn row(
    id: &'static str,
    name: &str,
    (value, unit): (f64, &'static str),
    limit: Limit,
    formula: impl Into<String>,
) -> Row {
    Row {
        group: "supply",
        id,
        name: name.to_owned(),
        value,
        unit,
        limit,
        formula: formula.into(),
    }
}

impl fmt::Display for Supply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "One DC link for {}", self.machines.join(", "))?;
        write_rows(f, &self.rows)
    }
}
