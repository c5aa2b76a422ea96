//! The pictures of a sizing as SVG documents; lines differ in width and dashes, so that they can be told apart without colour.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::cycle::Point;
use super::limits::TorqueLimits;
use super::{Sizing, number};
use crate::machine_file::MachineFile;
use crate::plot::PlotError;

const SIZE: (u32, u32) = (1100, 620);
const GREY: RGBColor = RGBColor(140, 140, 140);
const FONT: &str = "sans-serif";

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Operating points and equivalent point in the torque-speed diagram (thesis fig. 42, 43).
///
/// # Errors
/// [`PlotError::Drawing`] when the drawing itself fails.
pub fn torque_over_speed(machine: &MachineFile, sizing: &Sizing) -> Result<String, PlotError> {
    let limits = TorqueLimits::of(machine);
    let motor = &machine.motor;
    let cycle = &sizing.cycle;
    let top_rpm = 1.3 * motor.rated_speed_rpm.max(cycle.peak(|point| point.rpm));
    let highest = cycle.peak(|point| point.torque_nm).max(limits.current_limit_nm());
    // Room for the legend above the curves.
    let top_nm = 1.5 * highest.max(motor.standstill_torque_nm).max(motor.peak_torque_nm);
    let bottom_nm = -cycle.peak(|point| -point.torque_nm).max(0.08 * top_nm) * 1.3;
    let speeds = || (0..=200).map(move |step| f64::from(step) / 200.0 * top_rpm);
    let curve = |torque_nm: &dyn Fn(f64) -> f64| speeds().map(|rpm| (rpm, torque_nm(rpm))).collect::<Vec<_>>();
    let motor_nm = curve(&|rpm| limits.voltage_limit_nm(rpm));
    let drive_nm = curve(&|rpm| limits.peak_nm(rpm));
    let mut s1_nm: Vec<_> = motor.s1_points().iter().map(|[rpm, nm]| (*rpm, *nm)).collect();
    // Down to nothing where it ends.
    s1_nm.extend(s1_nm.last().map(|(rpm, _)| (*rpm, 0.0)));
    let points: Vec<(f64, f64)> = cycle
        .phases
        .iter()
        .flat_map(|phase| [phase.at(0.0), phase.at(1.0)])
        .map(|point| (point.rpm, point.torque_nm))
        .collect();
    let equivalent = (cycle.mean(|point| point.rpm.abs()), cycle.rms(|point| point.torque_nm));
    picture(|area| {
        let mut chart = chart(
            area,
            &format!("{} on {}: operating points", sizing.motor, sizing.drive),
            (0.0, top_rpm, "motor speed in 1/min"),
            (bottom_nm, top_nm, "torque in Nm"),
        )?;
        line(
            &mut chart,
            motor_nm,
            "motor, with the voltage limit",
            BLACK.stroke_width(3),
        )?;
        line(
            &mut chart,
            drive_nm,
            "and current limit of drive and C0022",
            GREY.stroke_width(4),
        )?;
        dashed(&mut chart, s1_nm, "S1, for ever", BLACK.stroke_width(2))?;
        line(&mut chart, points.clone(), "one cycle", BLACK.stroke_width(1))?;
        chart
            .draw_series(points.into_iter().map(|point| Circle::new(point, 4, BLACK.filled())))
            .map_err(drawing)?
            .label("operating points")
            .legend(|(x, y)| Circle::new((x + 17, y), 4, BLACK.filled()));
        chart
            .draw_series([Cross::new(equivalent, 8, BLACK.stroke_width(3))])
            .map_err(drawing)?
            .label("equivalent point: mean speed, RMS torque")
            .legend(|(x, y)| Cross::new((x + 17, y), 6, BLACK.stroke_width(3)));
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}

/// Motor speed, torque and current over one cycle (thesis fig. 44).
///
/// # Errors
/// [`PlotError::Drawing`] when the drawing itself fails.
pub fn cycle_over_time(machine: &MachineFile, sizing: &Sizing) -> Result<String, PlotError> {
    let cycle = &sizing.cycle;
    let duration_s = cycle.duration_s();
    let over_time = |figure: &dyn Fn(Point) -> f64| {
        let mut begin_s = 0.0;
        let mut curve = Vec::new();
        for phase in &cycle.phases {
            for step in 0..=20 {
                let share = f64::from(step) / 20.0;
                curve.push((begin_s + share * phase.duration_s, figure(phase.at(share))));
            }
            begin_s += phase.duration_s;
        }
        curve
    };
    let motor = &machine.motor;
    let speed = over_time(&|point| point.rpm);
    let torque = over_time(&|point| point.torque_nm);
    let current = over_time(&|point| motor.current_a(point.torque_nm));
    let (rms_nm, rms_a) = (
        cycle.rms(|point| point.torque_nm),
        cycle.rms(|point| motor.current_a(point.torque_nm)),
    );
    picture(|area| {
        let [speed_area, load_area] = &area.split_evenly((2, 1))[..] else {
            return Err(PlotError::Drawing("the picture cannot be split".to_owned()));
        };
        let (_, top) = range(&speed);
        let mut chart = chart(
            speed_area,
            "One cycle",
            (0.0, duration_s, ""),
            (0.0, 1.1 * top, "speed in 1/min"),
        )?;
        line(&mut chart, speed, "", BLACK.stroke_width(2))?;
        let (low, high) = range(&torque);
        let (_, high_a) = range(&current);
        let (low, high) = (low.min(0.0), high.max(high_a));
        let margin = 0.12 * (high - low).max(1e-6);
        let mut chart = self::chart(
            load_area,
            "",
            (0.0, duration_s, "time in s"),
            (low - margin, high + 3.0 * margin, "torque in Nm, current in A"),
        )?;
        line(&mut chart, torque, "torque", BLACK.stroke_width(3))?;
        line(&mut chart, current, "current", GREY.stroke_width(3))?;
        let level = |value: f64| vec![(0.0, value), (duration_s, value)];
        dashed(&mut chart, level(rms_nm), "RMS torque", BLACK.stroke_width(2))?;
        dashed(&mut chart, level(rms_a), "RMS current", GREY.stroke_width(3))?;
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}

/// Torque to accelerate over the gear ratio, with the optimum and the ratio chosen (thesis fig. 40).
///
/// # Errors
/// [`PlotError::Drawing`] when the drawing itself fails.
pub fn gear_ratio(machine: &MachineFile, sizing: &Sizing) -> Result<String, PlotError> {
    let mechanics = &machine.mechanics;
    let ratio = mechanics.gear_ratio();
    let j_motor = machine.motor.rotor_inertia_kg_m2 + mechanics.gear_inertia_kg_m2;
    let optimum = sizing.row("gear_optimum").map_or(ratio, |row| row.value);
    // Per angular acceleration of the roller, the torque at the motor is J_motor·i + J_load/i.
    let accel_rad_s2 = machine.feed.acceleration_mm_s2 / (0.5 * mechanics.roller_diameter_mm);
    let torque_nm = |i: f64| (j_motor * i + mechanics.load_inertia_kg_m2 / i) * accel_rad_s2;
    let (from, to) = (0.3 * ratio.min(optimum).max(0.1 * ratio), 2.5 * ratio.max(optimum));
    let curve: Vec<_> = (0..=300)
        .map(|step| from + f64::from(step) / 300.0 * (to - from))
        .map(|i| (i, torque_nm(i)))
        .collect();
    let top = 1.1 * torque_nm(from).max(torque_nm(to));
    picture(|area| {
        let mut chart = chart(
            area,
            "Torque to accelerate over the gear ratio",
            (0.0, to, "gear ratio i"),
            (0.0, top, "torque at the motor in Nm, without friction"),
        )?;
        line(&mut chart, curve, "J_motor·i·α + J_load·α/i", BLACK.stroke_width(2))?;
        let label = format!("optimum, i = {}", number(optimum));
        let foot = |i: f64| vec![(i, 0.0), (i, torque_nm(i))];
        dashed(&mut chart, foot(optimum), &label, BLACK.stroke_width(1))?;
        chart
            .draw_series([Circle::new((ratio, torque_nm(ratio)), 6, BLACK.filled())])
            .map_err(drawing)?
            .label(format!("chosen, i = {}", number(ratio)))
            .legend(|(x, y)| Circle::new((x + 17, y), 6, BLACK.filled()));
        legend(&mut chart, SeriesLabelPosition::UpperRight)
    })
}

fn picture(draw: impl FnOnce(&Area<'_>) -> Result<(), PlotError>) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(drawing)?;
        draw(&area)?;
        area.present().map_err(drawing)?;
    }
    Ok(svg)
}

fn chart<'a, 'b>(
    area: &Area<'b>,
    title: &str,
    (left, right, x_name): (f64, f64, &str),
    (low, high, y_name): (f64, f64, &str),
) -> Result<Chart<'a, 'b>, PlotError> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(14).y_label_area_size(78);
    builder.x_label_area_size(if x_name.is_empty() { 28 } else { 50 });
    if !title.is_empty() {
        builder.caption(title, (FONT, 22));
    }
    let mut chart = builder.build_cartesian_2d(left..right, low..high).map_err(drawing)?;
    chart
        .configure_mesh()
        .x_desc(x_name)
        .y_desc(y_name)
        .x_label_formatter(&|value| tick(*value, right - left))
        .y_label_formatter(&|value| tick(*value, high - low))
        .label_style((FONT, 15))
        .axis_desc_style((FONT, 16))
        .light_line_style(WHITE)
        .draw()
        .map_err(drawing)?;
    Ok(chart)
}

/// As many decimals as the range needs.
fn tick(value: f64, range: f64) -> String {
    let decimals = (1.0 - range.abs().max(1e-12).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.decimals$}");
    // A negative zero is none.
    text.strip_prefix('-')
        .filter(|rest| rest.bytes().all(|b| b == b'0' || b == b'.'))
        .map_or(text.clone(), str::to_owned)
}

fn line(chart: &mut Chart<'_, '_>, curve: Vec<(f64, f64)>, label: &str, style: ShapeStyle) -> Result<(), PlotError> {
    let series = chart.draw_series(LineSeries::new(curve, style)).map_err(drawing)?;
    if !label.is_empty() {
        series
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 34, y)], style));
    }
    Ok(())
}

fn dashed(chart: &mut Chart<'_, '_>, curve: Vec<(f64, f64)>, label: &str, style: ShapeStyle) -> Result<(), PlotError> {
    chart
        .draw_series(DashedLineSeries::new(curve, DASH, GAP, style))
        .map_err(drawing)?
        .label(label)
        .legend(move |(x, y)| DashedPathElement::new([(x, y), (x + 34, y)], DASH, GAP, style));
    Ok(())
}

fn legend<'a, 'b: 'a>(chart: &mut Chart<'a, 'b>, position: SeriesLabelPosition) -> Result<(), PlotError> {
    chart
        .configure_series_labels()
        .position(position)
        .legend_area_size(44)
        .label_font((FONT, 15))
        .background_style(WHITE.mix(0.9))
        .border_style(GREY)
        .draw()
        .map_err(drawing)
}

fn range(curve: &[(f64, f64)]) -> (f64, f64) {
    curve
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, value)| {
            (low.min(*value), high.max(*value))
        })
}

fn drawing<E: std::error::Error + Send + Sync>(error: DrawingAreaErrorKind<E>) -> PlotError {
    PlotError::Drawing(error.to_string())
}

/// Length of a dash and of the gap behind it, px.
const DASH: u32 = 8;
const GAP: u32 = 5;
