//! A sweep on one page.

use std::fmt;

use serde::Serialize;

use super::{ResultTable, Row, Setting, quantile};

/// How a figure is spread over the machines of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spread {
    /// Name of the figure, with its unit at the end.
    pub figure: &'static str,
    /// Machines that have it.
    pub machines: usize,
    /// Least value.
    pub min: Option<f64>,
    /// 5 % quantile.
    pub p05: Option<f64>,
    /// Median.
    pub p50: Option<f64>,
    /// 95 % quantile.
    pub p95: Option<f64>,
    /// Greatest value.
    pub max: Option<f64>,
}

/// How strongly figures go with a parameter: rank correlation (Spearman), −1…1; none where one of both does not vary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Influence {
    /// Name of the parameter.
    pub parameter: String,
    /// With each of [`Summary::spreads`], in their order.
    pub on: Vec<Option<f64>>,
}

/// A sweep, or a part of one, on one page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Fingerprint of SPEC and machine.
    pub sweep: String,
    /// Points of the whole sweep.
    pub points: u64,
    /// Machines that have run.
    pub machines: usize,
    /// Those of which all feeds landed.
    pub all_landed: usize,
    /// Those that ended early.
    pub aborted: usize,
    /// Feeds of all machines.
    pub feeds: u64,
    /// Feeds that landed.
    pub landed: u64,
    /// Feeds during which the film ran backwards.
    pub reversed: u64,
    /// Feeds without a known target.
    pub no_target: u64,
    /// Over the machines.
    pub spreads: Vec<Spread>,
    /// Parameters that are numbers.
    pub influences: Vec<Influence>,
    /// The machine with the greatest error: its point.
    pub worst_point: Option<u64>,
}

/// The figures that a summary shows.
const FIGURES: [&str; 5] = [
    "abs_error_max_um",
    "in_position_p95_s",
    "job_p50_s",
    "peak_current_a",
    "mains_j",
];

impl Summary {
    /// The summary of a table.
    pub fn new(table: &ResultTable) -> Self {
        let rows = &table.rows;
        let total = |name| rows.iter().map(|row| row.outcome.value(name)).sum::<f64>() as u64;
        let spreads = FIGURES.map(|figure| spread(rows, figure)).to_vec();
        let influences = (0..table.parameters.len()).filter_map(|place| influence(table, place));
        let by_error = |row: &&Row| row.outcome.value("abs_error_max_um");
        Summary {
            sweep: table.sweep.clone(),
            points: table.points,
            machines: rows.len(),
            all_landed: rows.iter().filter(|row| row.outcome.all_landed()).count(),
            aborted: rows.iter().filter(|row| !row.outcome.aborted.is_empty()).count(),
            feeds: total("feeds"),
            landed: total("landed"),
            reversed: total("reversed"),
            no_target: total("no_target"),
            spreads,
            influences: influences.collect(),
            worst_point: rows
                .iter()
                .filter(|row| by_error(row).is_finite())
                // The first of equals.
                .reduce(|worst, row| if by_error(&row) > by_error(&worst) { row } else { worst })
                .map(|row| row.point),
        }
    }
}

fn spread(rows: &[Row], figure: &'static str) -> Spread {
    let mut values: Vec<f64> = rows.iter().map(|row| row.outcome.value(figure)).collect();
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let at = |share| Some(quantile(&values, share)).filter(|value| value.is_finite());
    Spread {
        figure,
        machines: values.len(),
        min: at(0.0),
        p05: at(0.05),
        p50: at(0.5),
        p95: at(0.95),
        max: at(1.0),
    }
}

fn influence(table: &ResultTable, place: usize) -> Option<Influence> {
    let numbers: Vec<f64> = table
        .rows
        .iter()
        .map(|row| match row.settings.get(place) {
            Some(Setting::Number(number)) => Some(*number),
            _ => None,
        })
        .collect::<Option<_>>()?;
    let on = FIGURES.map(|figure| {
        let pairs = numbers.iter().zip(&table.rows);
        let pairs = pairs.map(|(number, row)| (*number, row.outcome.value(figure)));
        rank_correlation(&pairs.filter(|(_, value)| value.is_finite()).collect::<Vec<_>>())
    });
    Some(Influence {
        parameter: table.parameters[place].clone(),
        on: on.to_vec(),
    })
}

/// Spearman's rank correlation: Pearson's of the ranks, equals sharing the mean of theirs. `None` when either does not vary.
fn rank_correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let x = ranks(&pairs.iter().map(|pair| pair.0).collect::<Vec<_>>());
    let y = ranks(&pairs.iter().map(|pair| pair.1).collect::<Vec<_>>());
    let mean = (pairs.len() as f64 + 1.0) / 2.0;
    let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum() };
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    (scale > 0.0).then(|| product(&x, &y) / scale)
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let equals = order[first..]
            .iter()
            .take_while(|place| values[**place] == values[order[first]])
            .count();
        for place in &order[first..first + equals] {
            ranks[*place] = (2 * first + equals + 1) as f64 / 2.0;
        }
        first += equals;
    }
    ranks
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} of {} machines, {} feeds: {} landed, {} reversed, {} without a known target; on {} machines every feed landed, {} ended early",
            self.machines,
            self.points,
            self.feeds,
            self.landed,
            self.reversed,
            self.no_target,
            self.all_landed,
            self.aborted
        )?;
        writeln!(f)?;
        writeln!(
            f,
            "{:<22}{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}",
            "over the machines", "machines", "min", "5 %", "median", "95 %", "max"
        )?;
        for spread in &self.spreads {
            write!(f, "{:<22}{:>10}", spread.figure, spread.machines)?;
            for value in [spread.min, spread.p05, spread.p50, spread.p95, spread.max] {
                write!(f, "{}", cell(value))?;
            }
            writeln!(f)?;
        }
        if !self.influences.is_empty() {
            writeln!(f)?;
            write!(f, "{:<32}", "rank correlation with")?;
            for spread in &self.spreads {
                write!(f, "{:>19}", spread.figure)?;
            }
            writeln!(f)?;
            for influence in &self.influences {
                write!(f, "{:<32}", influence.parameter)?;
                for value in &influence.on {
                    match value {
                        Some(value) => write!(f, "{value:>19.2}")?,
                        None => write!(f, "{:>19}", "–")?,
                    }
                }
                writeln!(f)?;
            }
        }
        if let Some(point) = self.worst_point {
            writeln!(f)?;
            write!(f, "greatest error: point {point}")?;
        }
        Ok(())
    }
}

fn cell(value: Option<f64>) -> String {
    match value {
        None => format!("{:>10}", "–"),
        Some(value) if value.abs() >= 1000.0 => format!("{value:>10.0}"),
        Some(value) => format!("{value:>10.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlation_is_that_of_a_textbook() {
        // IQ against hours of television, ten people; ρ = −29/165 = −0.1758 (Wikipedia, Spearman's rank correlation coefficient).
        let iq = [106.0, 100.0, 86.0, 101.0, 99.0, 103.0, 97.0, 113.0, 112.0, 110.0];
        let hours = [7.0, 27.0, 2.0, 50.0, 28.0, 29.0, 20.0, 12.0, 6.0, 17.0];
        let pairs: Vec<(f64, f64)> = iq.into_iter().zip(hours).collect();
        assert!((rank_correlation(&pairs).unwrap() + 29.0 / 165.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&[(1.0, 2.0), (1.0, 3.0)]), None);
        assert_eq!(ranks(&[5.0, 1.0, 5.0]), [2.5, 1.0, 2.5]);
    }
}
