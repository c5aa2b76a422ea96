//! Pictures of a loop as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;
use thiserror::Error;

use super::{BodePoint, LinearLoop, LoopKind, Margins, StepResponse};

/// Why a picture could not be drawn.
#[derive(Debug, Error)]
#[error("the plot could not be drawn: {0}")]
pub struct PlotError(String);

const SIZE: (u32, u32) = (1200, 720);
const GUIDE: RGBColor = RGBColor(150, 150, 150);
const POINTS: usize = 1200;
/// What is shown beyond the settling, as a multiple of it.
const SHOWN: f64 = 2.0;

/// The step response with its ±2 % band, as an SVG document.
///
/// # Errors
/// [`PlotError`] when the drawing itself fails.
pub fn plot_step(step: &StepResponse, which: LoopKind) -> Result<String, PlotError> {
    let end_s = step.points().last().map_or(1.0, |point| point.time_s);
    let shown_s = step
        .settle_s(0.02)
        .map_or(end_s, |settled| (SHOWN * settled).min(end_s));
    let shown: Vec<(f64, f64)> = step
        .points()
        .iter()
        .take_while(|point| point.time_s <= shown_s)
        .map(|point| (point.time_s * 1000.0, point.value))
        .collect();
    let highest = shown.iter().map(|point| point.1).fold(1.1, f64::max);
    let lowest = shown.iter().map(|point| point.1).fold(0.0, f64::min);
    let size = step.size();
    let title = format!(
        "Step of the {} loop: {:.3} {}, overshoot {:.1} %",
        which.name(),
        size.value,
        size.unit,
        step.overshoot_percent()
    );
    draw(|area| {
        let mut chart = ChartBuilder::on(area)
            .caption(title, ("sans-serif", 26))
            .margin(18)
            .x_label_area_size(52)
            .y_label_area_size(80)
            .build_cartesian_2d(0.0..shown_s * 1000.0, (lowest - 0.05)..(highest + 0.05))
            .map_err(drawing)?;
        chart
            .configure_mesh()
            .x_desc("time in ms")
            .y_desc("share of the step")
            .label_style(("sans-serif", 17))
            .axis_desc_style(("sans-serif", 19))
            .light_line_style(WHITE)
            .draw()
            .map_err(drawing)?;
        for level in [0.98, 1.0, 1.02] {
            let guide = [(0.0, level), (shown_s * 1000.0, level)];
            chart
                .draw_series(LineSeries::new(guide, GUIDE.stroke_width(1)))
                .map_err(drawing)?;
        }
        chart
            .draw_series(LineSeries::new(shown, BLACK.stroke_width(2)))
            .map_err(drawing)?;
        Ok(())
    })
}

/// Gain above, phase below, both crossings marked, as an SVG document.
///
/// # Errors
/// [`PlotError`] when the drawing itself fails.
pub fn plot_open_loop(open_loop: &LinearLoop, which: LoopKind) -> Result<String, PlotError> {
    let margins = Margins::of(open_loop);
    let points = BodePoint::series(open_loop, POINTS);
    let gains: Vec<(f64, f64)> = points.iter().map(|point| (point.frequency_hz, point.gain_db)).collect();
    let phases: Vec<(f64, f64)> = points
        .iter()
        .map(|point| (point.frequency_hz, point.phase_deg))
        .collect();
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return Err(PlotError("there is nothing to plot".to_string()));
    };
    let range = (first.frequency_hz, last.frequency_hz);
    let figure =
        |value: Option<f64>, unit: &str| value.map_or("none".to_string(), |value| format!("{value:.1} {unit}"));
    let title = format!(
        "Open {} loop: crossover {}, phase margin {}, gain margin {}",
        which.name(),
        figure(margins.crossover_hz, "Hz"),
        figure(margins.phase_margin_deg, "°"),
        figure(margins.gain_margin_db, "dB")
    );
    draw(|area| {
        let area = area.titled(&title, ("sans-serif", 26)).map_err(drawing)?;
        let (above, below) = area.split_vertically(SIZE.1 / 2);
        curve(&above, range, &gains, (0.0, margins.crossover_hz), "", "gain in dB")?;
        let marked = (-180.0, margins.phase_crossover_hz);
        curve(&below, range, &phases, marked, "frequency in Hz", "phase in °")
    })
}

fn curve(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    (first_hz, last_hz): (f64, f64),
    points: &[(f64, f64)],
    (level, mark_hz): (f64, Option<f64>),
    x_name: &str,
    y_name: &str,
) -> Result<(), PlotError> {
    let (low, high) = points
        .iter()
        .map(|point| point.1)
        .fold((level, level), |(low, high), value| (low.min(value), high.max(value)));
    let margin = 0.05 * (high - low);
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(80)
        .build_cartesian_2d((first_hz..last_hz).log_scale(), (low - margin)..(high + margin))
        .map_err(drawing)?;
    chart
        .configure_mesh()
        .x_desc(x_name)
        .y_desc(y_name)
        .label_style(("sans-serif", 16))
        .axis_desc_style(("sans-serif", 18))
        .light_line_style(WHITE)
        .draw()
        .map_err(drawing)?;
    let guide = [(first_hz, level), (last_hz, level)];
    chart
        .draw_series(LineSeries::new(guide, GUIDE.stroke_width(2)))
        .map_err(drawing)?;
    if let Some(at_hz) = mark_hz.filter(|at_hz| *at_hz <= last_hz) {
        let mark = [(at_hz, low - margin), (at_hz, high + margin)];
        chart
            .draw_series(LineSeries::new(mark, GUIDE.stroke_width(2)))
            .map_err(drawing)?;
    }
    chart
        .draw_series(LineSeries::new(points.iter().copied(), BLACK.stroke_width(2)))
        .map_err(drawing)?;
    Ok(())
}

fn draw(
    content: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(drawing)?;
        content(&area)?;
        area.present().map_err(drawing)?;
    }
    Ok(svg)
}

fn drawing<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> PlotError {
    PlotError(error.to_string())
}
