//! The sizing as one page without anything outside: tables, formulas, pictures.

use std::fmt::Write;

use super::{Row, Sizing, Verdict, cycle_over_time, gear_ratio, number, torque_over_speed};
use crate::machine_file::MachineFile;
use crate::plot::PlotError;

/// The page; it can be printed in black and white.
///
/// # Errors
/// [`PlotError::Drawing`] when a picture cannot be drawn.
pub fn html(machine: &MachineFile, sizing: &Sizing) -> Result<String, PlotError> {
    let mut page = String::from(HEAD);
    let title = escaped(&format!("Sizing of {}", sizing.machine));
    // Writing to a string cannot fail.
    let _ = write!(
        page,
        "<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
    );
    let _ = writeln!(
        page,
        "<p>{} on {}. {}</p>",
        escaped(&sizing.motor),
        escaped(&sizing.drive),
        escaped(&sizing.resistor_sentence())
    );
    page.push_str(&verdict(sizing));
    page.push_str(&machine_table(machine));
    for svg in [
        torque_over_speed(machine, sizing)?,
        cycle_over_time(machine, sizing)?,
        gear_ratio(machine, sizing)?,
    ] {
        let _ = writeln!(page, "<figure>{svg}</figure>");
    }
    page.push_str(&rows_table(&sizing.rows));
    if !sizing.assumed.is_empty() {
        let _ = writeln!(
            page,
            "<p>Assumed, no source was found: {}.</p>",
            escaped(&sizing.assumed.join(", "))
        );
    }
    page.push_str("</body>\n</html>\n");
    Ok(page)
}

fn verdict(sizing: &Sizing) -> String {
    let failed: Vec<&Row> = sizing.failures().collect();
    let judged = sizing.rows.iter().filter(|row| row.verdict() != Verdict::Info).count();
    if failed.is_empty() {
        return format!("<p class=\"verdict\">All {judged} checks passed.</p>\n");
    }
    let mut text = format!(
        "<p class=\"verdict fail\">{} of {judged} checks failed:</p>\n<ul>\n",
        failed.len()
    );
    for row in failed {
        let _ = writeln!(
            text,
            "<li>{}: {}, allowed is {}</li>",
            escaped(&row.name),
            escaped(&row.shown_value()),
            escaped(&row.shown_limit())
        );
    }
    text.push_str("</ul>\n");
    text
}

fn machine_table(machine: &MachineFile) -> String {
    let (mechanics, feed, motor, drive) = (&machine.mechanics, &machine.feed, &machine.motor, &machine.drive);
    let facts = [
        ("roller", format!("{} mm", number(mechanics.roller_diameter_mm))),
        (
            "gear",
            format!("{}:{}", mechanics.gear_numerator, mechanics.gear_denominator),
        ),
        (
            "load inertia at the roller",
            format!("{} kg m²", number(mechanics.load_inertia_kg_m2)),
        ),
        ("friction at the motor", format!("{} Nm", number(mechanics.friction_nm))),
        (
            "feed",
            format!(
                "{} mm every {} s, {}",
                number(feed.length_mm),
                number(feed.cycle_s),
                match feed.mode {
                    crate::report::FeedMode::Length => "by length",
                    crate::report::FeedMode::Mark => "to the print mark",
                }
            ),
        ),
        (
            "speed, acceleration",
            format!(
                "{} mm/s, {} mm/s²",
                number(feed.speed_mm_s),
                number(feed.acceleration_mm_s2)
            ),
        ),
        (
            "motor: M_0, M_N, M_max",
            format!(
                "{}, {}, {} Nm",
                number(motor.standstill_torque_nm),
                number(motor.rated_torque_nm),
                number(motor.peak_torque_nm)
            ),
        ),
        (
            "motor: I_N, I_max, rotor",
            format!(
                "{} A, {} A, {} kg m²",
                number(motor.rated_current_a),
                number(motor.peak_current_a),
                number(motor.rotor_inertia_kg_m2)
            ),
        ),
        (
            "drive: I_N, I_max",
            format!(
                "{} A, {} A for {} s",
                number(drive.rated_current_a),
                number(drive.peak_current_a),
                number(drive.peak_time_s)
            ),
        ),
        (
            "current limit (C0022), ambient",
            format!(
                "{} A, {} °C",
                number(machine.current_limit_a),
                number(machine.ambient_c)
            ),
        ),
    ];
    let mut table = String::from("<table class=\"facts\">\n");
    for (name, value) in facts {
        let _ = writeln!(table, "<tr><th>{name}</th><td>{}</td></tr>", escaped(&value));
    }
    table.push_str("</table>\n");
    table
}

fn rows_table(rows: &[Row]) -> String {
    let mut table = String::from(
        "<table>\n<thead><tr><th>figure</th><th>value</th><th>limit</th><th>margin</th><th>verdict</th><th>formula</th></tr></thead>\n<tbody>\n",
    );
    let mut group = "";
    for row in rows {
        if row.group != group {
            group = row.group;
            let _ = writeln!(table, "<tr class=\"group\"><th colspan=\"6\">{group}</th></tr>");
        }
        let class = match row.verdict() {
            Verdict::Fail => " class=\"fail\"",
            Verdict::Pass | Verdict::Info => "",
        };
        let _ = writeln!(
            table,
            "<tr{class}><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&row.name),
            escaped(&row.shown_value()),
            escaped(&row.shown_limit()),
            escaped(&row.shown_margin()),
            row.verdict(),
            escaped(&row.formula),
        );
    }
    table.push_str("</tbody>\n</table>\n");
    table
}

/// Text of a machine's name or of a device is not markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

const HEAD: &str = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n";

const STYLE: &str = "
body { font-family: sans-serif; color: #000; background: #fff; max-width: 1100px; margin: 1.5em auto; padding: 0 1em; }
h1 { font-size: 1.5em; }
table { border-collapse: collapse; margin: 1em 0; width: 100%; font-size: 0.9em; }
table.facts { width: auto; }
th, td { text-align: left; padding: 0.25em 0.6em; border-bottom: 1px solid #ccc; vertical-align: top; }
td.number { text-align: right; white-space: nowrap; }
tr.group th { background: #eee; padding-top: 0.5em; }
tr.fail td, p.fail { font-weight: bold; text-decoration: underline; }
p.verdict { font-weight: bold; border: 2px solid #000; padding: 0.5em; display: inline-block; }
figure { margin: 1em 0; }
figure svg { max-width: 100%; height: auto; }
";
