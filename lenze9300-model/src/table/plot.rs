use plotters::prelude::*;
use thiserror::Error;

use super::{Column, Table};

/// Why a table could not be drawn.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TablePlotError {
    /// A time and something over it are needed.
    #[error(
        "nothing to draw: expected a time and at least one column with two rows or more, got {columns} columns of {rows} rows"
    )]
    Empty {
        /// Columns there are, the time among them.
        columns: usize,
        /// Rows there are.
        rows: usize,
    },
    /// The drawing itself failed.
    #[error("the plot could not be drawn: {0}")]
    Drawing(String),
}

const WIDTH: u32 = 1200;
const PANEL_HEIGHT: u32 = 220;
const HEAD: u32 = 50;
const FOOT: u32 = 60;
/// Steps along the time; more points than two for each are thinned to their lowest and highest.
const STEPS: usize = 1100;

impl Table {
    /// The columns over the first one, a panel for each below the other, as an SVG document that reads in black and white.
    ///
    /// Where there are more rows than the picture has room for, each narrow span of time shows its lowest and highest value: no peak
    /// is lost.
    ///
    /// # Errors
    ///
    /// [`TablePlotError`].
    pub fn draw_svg(&self, title: &str) -> Result<String, TablePlotError> {
        let rows = self.rows();
        let (Some((time, columns)), true) = (self.columns.split_first(), rows > 1) else {
            return Err(self.empty());
        };
        if columns.is_empty() {
            return Err(self.empty());
        }
        let height = HEAD + PANEL_HEIGHT * columns.len() as u32 + FOOT;
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
            root.fill(&WHITE).map_err(drawing)?;
            let area = root.titled(title, ("sans-serif", 26)).map_err(drawing)?;
            let mut rest = area;
            for (n, column) in columns.iter().enumerate() {
                let is_last = n + 1 == columns.len();
                let (panel, below) = rest.split_vertically(if is_last { PANEL_HEIGHT + FOOT } else { PANEL_HEIGHT });
                draw_panel(&panel, &time.values[..rows], column, is_last)?;
                rest = below;
            }
            root.present().map_err(drawing)?;
        }
        Ok(svg)
    }

    fn empty(&self) -> TablePlotError {
        TablePlotError::Empty {
            columns: self.columns.len(),
            rows: self.rows(),
        }
    }
}

fn draw_panel(
    panel: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    time: &[f64],
    column: &Column,
    is_last: bool,
) -> Result<(), TablePlotError> {
    let points = thinned(time, &column.values[..time.len()]);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    };
    let (from_s, to_s) = range(&mut points.iter().map(|point| point.0));
    let (low, high) = range(&mut points.iter().map(|point| point.1));
    if !(low.is_finite() && high.is_finite() && from_s < to_s) {
        return Err(TablePlotError::Drawing(format!("{} has no numbers", column.name)));
    }
    let margin = if high > low {
        0.08 * (high - low)
    } else if low == 0.0 {
        1.0
    } else {
        0.01 * low.abs()
    };
    // As many decimals as the five labels need to differ.
    let decimals = (1.0 - (high - low + 2.0 * margin).log10().floor()).clamp(0.0, 9.0) as usize;
    let name = if column.unit.is_empty() {
        column.name.clone()
    } else {
        format!("{} in {}", column.name, column.unit)
    };
    let mut chart = ChartBuilder::on(panel)
        .margin(8)
        .margin_right(24)
        .x_label_area_size(if is_last { 48 } else { 18 })
        .y_label_area_size(100)
        .build_cartesian_2d(from_s..to_s, (low - margin)..(high + margin))
        .map_err(drawing)?;
    let mut mesh = chart.configure_mesh();
    if is_last {
        mesh.x_desc("time in s");
    }
    mesh.y_desc(name)
        .y_labels(5)
        .y_label_formatter(&|value| format!("{value:.decimals$}"))
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 17))
        .light_line_style(WHITE)
        .draw()
        .map_err(drawing)?;
    chart
        .draw_series(LineSeries::new(points, BLACK.stroke_width(1)))
        .map_err(drawing)?;
    Ok(())
}

/// The points, or lowest and highest of each span where there are more than the picture has room for.
fn thinned(time: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let points = || time.iter().copied().zip(values.iter().copied());
    let finite = |point: &(f64, f64)| point.0.is_finite() && point.1.is_finite();
    if time.len() <= 2 * STEPS {
        return points().filter(finite).collect();
    }
    let all: Vec<(f64, f64)> = points().filter(finite).collect();
    let mut thin = Vec::with_capacity(2 * STEPS + 2);
    for span in all.chunks(all.len().div_ceil(STEPS).max(1)) {
        let lowest = span.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let highest = span.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        let (Some(lowest), Some(highest)) = (lowest, highest) else {
            continue;
        };
        let in_order = if lowest.0 <= highest.0 {
            [lowest, highest]
        } else {
            [highest, lowest]
        };
        thin.extend(in_order);
    }
    thin
}

fn drawing(error: impl std::fmt::Display) -> TablePlotError {
    TablePlotError::Drawing(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_has_its_panel_with_name_and_unit() {
        let mut table = Table::new([
            Column::new("time_s", ""),
            Column::new("N-ACT", "1/min"),
            Column::new("PS", ""),
        ]);
        for n in 0..100 {
            let t = f64::from(n) / 100.0;
            table.push(&[t, 3000.0 * t, f64::from(n / 50)]);
        }
        let svg = table.draw_svg("Two signals").expect("it can be drawn");
        for part in ["Two signals", "N-ACT in 1/min", "PS", "time in s"] {
            assert!(svg.contains(part), "{part}");
        }
        assert!(svg.trim_end().ends_with("</svg>"));
    }

    #[test]
    fn a_peak_of_one_row_is_not_lost_among_many() {
        let time: Vec<f64> = (0..100_000).map(|n| f64::from(n) / 1000.0).collect();
        let mut values = vec![1.0; 100_000];
        values[77_777] = 9.0;
        let thin = thinned(&time, &values);
        assert!(thin.len() <= 2 * STEPS + 2);
        assert!(thin.contains(&(77.777, 9.0)));
        assert!(thin.is_sorted_by(|a, b| a.0 <= b.0), "in the order of time");
    }

    #[test]
    fn nothing_is_told_apart_from_something() {
        let empty = Table::new([Column::new("time_s", ""), Column::new("PS", "")]);
        let error = empty.draw_svg("").expect_err("no rows");
        assert!(error.to_string().contains("got 2 columns of 0 rows"), "{error}");
    }
}
