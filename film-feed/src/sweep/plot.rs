//! A sweep as a picture: every figure over every parameter.

use plotters::coord::Shift;
use plotters::prelude::*;
use thiserror::Error;

use super::{ResultTable, Setting};

/// Why a sweep could not be drawn.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SweepPlotError {
    /// There is nothing to draw.
    #[error("no parameter is a number or no machine has run, there is nothing to plot")]
    Nothing,
    /// The drawing itself failed.
    #[error("the plot could not be drawn: {0}")]
    Drawing(String),
}

const PANEL: (u32, u32) = (380, 260);
const HEAD: u32 = 70;
/// Dots of a panel; of more machines every so many-th is shown.
const MOST_DOTS: usize = 3000;
const FIGURES: [(&str, &str); 4] = [
    ("abs_error_max_um", "largest error in µm"),
    ("in_position_p95_s", "in position (95 %) in s"),
    ("peak_current_a", "peak current in A rms"),
    ("mains_j", "energy from the mains in J"),
];
const GREY: RGBColor = RGBColor(150, 150, 150);

/// Draws the figures over the parameters that are numbers, a panel each, as an SVG document. Black dots are machines on which every feed
/// landed, grey crosses the others.
///
/// # Errors
/// [`SweepPlotError`].
pub fn draw_svg(table: &ResultTable) -> Result<String, SweepPlotError> {
    let is_number = |place: &usize| {
        let first = table.rows.first().and_then(|row| row.settings.get(*place));
        matches!(first, Some(Setting::Number(_)))
    };
    let parameters: Vec<usize> = (0..table.parameters.len()).filter(is_number).collect();
    if parameters.is_empty() {
        return Err(SweepPlotError::Nothing);
    }
    let size = (
        PANEL.0 * parameters.len().max(2) as u32,
        HEAD + PANEL.1 * FIGURES.len() as u32,
    );
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).map_err(drawing)?;
        let title = format!("{} machines; dot: every feed landed, cross: not", table.rows.len());
        let area = root.titled(&title, ("sans-serif", 24)).map_err(drawing)?;
        let panels = area.split_evenly((FIGURES.len(), parameters.len()));
        for (n, panel) in panels.iter().enumerate() {
            let (row, column) = (n / parameters.len(), n % parameters.len());
            draw_panel(panel, table, parameters[column], FIGURES[row])?;
        }
        root.present().map_err(drawing)?;
    }
    Ok(svg)
}

fn draw_panel(
    panel: &DrawingArea<SVGBackend<'_>, Shift>,
    table: &ResultTable,
    parameter: usize,
    (figure, label): (&str, &str),
) -> Result<(), SweepPlotError> {
    let every = table.rows.len().div_ceil(MOST_DOTS).max(1);
    let dots: Vec<(f64, f64, bool)> = table
        .rows
        .iter()
        .step_by(every)
        .filter_map(|row| match row.settings.get(parameter) {
            Some(Setting::Number(x)) => Some((*x, row.outcome.value(figure), row.outcome.all_landed())),
            _ => None,
        })
        .filter(|(_, y, _)| y.is_finite())
        .collect();
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        // A figure that does not vary gets room above and below.
        let room = (0.05 * (high - low)).max(1e-3 * high.abs()).max(1e-9);
        if low <= high {
            (low - room, high + room)
        } else {
            (0.0, 1.0)
        }
    };
    let (left, right) = ends(&mut dots.iter().map(|dot| dot.0));
    let (low, high) = ends(&mut dots.iter().map(|dot| dot.1));
    let mut chart = ChartBuilder::on(panel)
        .margin(10)
        .x_label_area_size(42)
        .y_label_area_size(70)
        .build_cartesian_2d(left..right, low..high)
        .map_err(drawing)?;
    chart
        .configure_mesh()
        .x_desc(table.parameters[parameter].as_str())
        .y_desc(label)
        .x_labels(5)
        .y_labels(5)
        .x_label_formatter(&|value| short(*value))
        .y_label_formatter(&|value| short(*value))
        .label_style(("sans-serif", 13))
        .axis_desc_style(("sans-serif", 14))
        .max_light_lines(0)
        .draw()
        .map_err(drawing)?;
    chart
        .draw_series(
            dots.iter()
                .filter(|dot| !dot.2)
                .map(|dot| Cross::new((dot.0, dot.1), 3, GREY)),
        )
        .map_err(drawing)?;
    chart
        .draw_series(
            dots.iter()
                .filter(|dot| dot.2)
                .map(|dot| Circle::new((dot.0, dot.1), 2, BLACK.filled())),
        )
        .map_err(drawing)?;
    Ok(())
}

/// Four digits that count.
fn short(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 || size == 0.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.2}"),
        size if size >= 1e-3 => format!("{value:.4}"),
        _ => format!("{value:.2e}"),
    }
}

fn drawing<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> SweepPlotError {
    SweepPlotError::Drawing(error.to_string())
}
