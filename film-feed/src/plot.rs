//! The oscilloscope picture of a feed: interpolator speed and motor speed over time (thesis fig. 73).

use plotters::prelude::*;
use thiserror::Error;

use crate::scope::Sample;

/// Why a picture could not be drawn.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlotError {
    /// There is nothing to draw.
    #[error("no feed was recorded, there is nothing to plot")]
    NothingRecorded,
    /// The drawing itself failed.
    #[error("the plot could not be drawn: {0}")]
    Drawing(String),
}

const SIZE: (u32, u32) = (1200, 720);
/// Light band, grey line, thin black line above: told apart without colour.
const BAND: RGBColor = RGBColor(222, 222, 222);
const SET_VALUE: RGBColor = RGBColor(140, 140, 140);
/// Half width of the band: the motor speed "swings by about 2 % about the set-value" (thesis, text of fig. 73).
const BAND_SHARE: f64 = 0.02;

/// Draws the samples of feed number `feed` as an SVG document.
///
/// # Errors
/// [`PlotError::NothingRecorded`] when no sample belongs to that feed.
pub fn speed_over_time(samples: &[Sample], feed: usize, title: &str) -> Result<String, PlotError> {
    let shown: Vec<&Sample> = samples.iter().filter(|sample| sample.feed == feed).collect();
    let (Some(first), Some(last)) = (shown.first(), shown.last()) else {
        return Err(PlotError::NothingRecorded);
    };
    let start_s = first.time_s;
    let duration_s = (last.time_s - start_s).max(0.001);
    let (low, high) = shown
        .iter()
        .flat_map(|sample| [sample.speed_set_rpm, sample.speed_act_rpm])
        .fold((0.0_f64, 1.0_f64), |(low, high), rpm| (low.min(rpm), high.max(rpm)));
    let margin = 0.05 * (high - low);

    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(drawing)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 26))
            .margin(18)
            .x_label_area_size(52)
            .y_label_area_size(80)
            .build_cartesian_2d(0.0..duration_s, (low - margin)..(high + margin))
            .map_err(drawing)?;
        chart
            .configure_mesh()
            .x_desc("time in s")
            .y_desc("motor speed in 1/min")
            .x_label_formatter(&|time| format!("{time:.2}"))
            .y_label_formatter(&|rpm| format!("{rpm:.0}"))
            .label_style(("sans-serif", 17))
            .axis_desc_style(("sans-serif", 19))
            .light_line_style(WHITE)
            .draw()
            .map_err(drawing)?;
        let point = |sample: &Sample, rpm: f64| (sample.time_s - start_s, rpm);
        let edge = |share: f64| move |sample: &&Sample| point(sample, sample.speed_set_rpm * share);
        let upper = shown.iter().map(edge(1.0 + BAND_SHARE));
        let lower = shown.iter().rev().map(edge(1.0 - BAND_SHARE));
        chart
            .draw_series([Polygon::new(upper.chain(lower).collect::<Vec<_>>(), BAND)])
            .map_err(drawing)?
            .label("±2 % of the set-value")
            .legend(|(x, y)| Rectangle::new([(x, y - 7), (x + 30, y + 7)], BAND.filled()));
        chart
            .draw_series(LineSeries::new(
                shown.iter().map(|sample| point(sample, sample.speed_set_rpm)),
                SET_VALUE.stroke_width(4),
            ))
            .map_err(drawing)?
            .label("interpolator speed (POS-NOUT)")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 30, y)], SET_VALUE.stroke_width(4)));
        chart
            .draw_series(LineSeries::new(
                shown.iter().map(|sample| point(sample, sample.speed_act_rpm)),
                BLACK.stroke_width(2),
            ))
            .map_err(drawing)?
            .label("motor speed (MCTRL-NACT)")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 30, y)], BLACK.stroke_width(2)));
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerMiddle)
            .legend_area_size(40)
            .label_font(("sans-serif", 18))
            .background_style(WHITE.mix(0.9))
            .border_style(BLACK)
            .draw()
            .map_err(drawing)?;
        area.present().map_err(drawing)?;
    }
    Ok(svg)
}

fn drawing<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> PlotError {
    PlotError::Drawing(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_names_its_curves_axes_and_title() {
        let samples: Vec<Sample> = (0..100)
            .map(|k| Sample {
                time_s: f64::from(k) * 0.001,
                feed: 3,
                speed_set_rpm: f64::from(k),
                speed_act_rpm: f64::from(k) - 1.0,
                ..Sample::default()
            })
            .collect();
        let svg = speed_over_time(&samples, 3, "Feed 3").unwrap();
        for text in [
            "Feed 3",
            "time in s",
            "motor speed in 1/min",
            "POS-NOUT",
            "MCTRL-NACT",
            "±2 %",
        ] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(svg.matches("<polyline").count() >= 2);
    }

    #[test]
    fn a_feed_that_was_not_recorded_cannot_be_plotted() {
        assert!(matches!(speed_over_time(&[], 1, "x"), Err(PlotError::NothingRecorded)));
    }
}
