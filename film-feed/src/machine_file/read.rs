use lenze9300_model::FileError;
use lenze9300_model::code::table::number::{C0022, C1240, C1250};
use lenze9300_model::code::{CodeStore, read_code_table};
use lenze9300_model::toml_file::{Fields, Reader};
use lenze9300_model::traverse::{LatchMode, Rounding};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::devices::{derived_codes, largest_current_a};
use super::{
    BrakeResistor, Controls, Feed, FilmRoll, FilmWeb, MachineFile, MainsSupply, Mechanics, Positioning, PrintMarks,
};
use crate::catalogue::{Catalogue, DriveUnit, Motor};
use crate::machine::WebParams;
use crate::report::FeedMode;
use crate::toml_section::Section;

impl MachineFile {
    /// Reads a MACHINE.toml; motor and drive may be named from `catalogue`.
    ///
    /// # Errors
    /// [`FileError`] with every mistake of the file.
    pub fn read(text: &str, catalogue: &Catalogue) -> Result<Self, FileError> {
        Reader::read(text, |reader, table| machine(reader, table, catalogue))
    }
}

fn machine<'a>(reader: &mut Reader<'a>, table: &DeTable<'a>, catalogue: &Catalogue) -> Option<MachineFile> {
    let empty = DeTable::new();
    let mut tables = Tables {
        reader,
        fields: Fields::of(table),
        empty: &empty,
    };
    let mechanics = tables.required("mechanics", read_mechanics);
    let feed_at = table.get("feed");
    let feed = tables.required("feed", read_feed);
    let motor = tables.required("motor", |motor| {
        let (name, base) = base(
            motor,
            |name| catalogue.motor(name),
            catalogue.motors().iter().map(|m| &m.name),
        )?;
        Some(Motor::read(motor, name, base))
    });
    let drive = tables.required("drive", |drive| {
        let (name, base) = base(
            drive,
            |name| catalogue.drive(name),
            catalogue.drives().iter().map(|d| &d.name),
        )?;
        Some(DriveUnit::read(drive, name, base))
    });
    let film = tables.optional("film", read_film);
    let roll = match table.get("roll") {
        Some(_) => tables.required("roll", read_roll),
        None => tables.fields.take("roll").and(None),
    };
    let mark_defaults = feed.as_ref().map_or(1200.0, |feed| feed.length_mm);
    let marks = tables.optional("marks", |marks| read_marks(marks, mark_defaults));
    let positioning = tables.optional("positioning", read_positioning);
    let mains = tables.optional("mains", read_mains);
    let brake = match table.get("brake") {
        Some(_) => tables.required("brake", read_brake),
        None => tables.fields.take("brake").and(None),
    };
    let plc_cycle_ms = tables.optional("plc", |plc| plc.real("cycle_ms", 1.0..=100.0, 5.0));
    let controls = tables.optional("bus", |bus| read_bus(bus, plc_cycle_ms));
    let codes_at = tables.fields.take("codes");
    let Tables { reader, mut fields, .. } = tables;
    let name = fields
        .take("name")
        .map_or(Some("film feed"), |value| reader.text(value, "name"));
    let ambient_c = fields
        .take("ambient_c")
        .map_or(Some(25.0), |value| reader.real(value, "ambient_c", -30.0..=80.0));
    fields.finish(reader);

    let (mechanics, mut feed, motor, drive) = (mechanics?, feed?, motor??, drive??);
    let largest_a = largest_current_a(&motor, &drive);
    let mut codes = derived_codes(&mechanics, &feed, &motor, largest_a);
    let derived_limit = codes.read(C0022, 0);
    if let Some(value) = codes_at
        && let Some(table) = reader.table(value, "codes")
    {
        read_code_table(reader, table, &mut codes);
    }
    // The range of C0022 ends at what the drive of the thesis can give; the limit of a larger drive does not fit the code.
    let current_limit_a = if codes.read(C0022, 0) == derived_limit {
        largest_a
    } else {
        codes.number(C0022, 0)
    };
    if let Some(feed_at) = feed_at {
        check_feed(reader, feed_at, &mut feed, &codes);
    }
    Some(MachineFile {
        name: name?.to_owned(),
        ambient_c: ambient_c?,
        mechanics,
        feed,
        film,
        roll,
        marks,
        motor,
        drive,
        positioning,
        mains,
        brake,
        controls,
        codes,
        current_limit_a,
    })
}

/// The tables of the file.
struct Tables<'r, 't, 'a> {
    reader: &'r mut Reader<'a>,
    fields: Fields<'t, 'a>,
    empty: &'t DeTable<'a>,
}

impl<'t, 'a> Tables<'_, 't, 'a> {
    /// Reads a table that must be there; without it none of its keys is told as missing.
    fn required<T>(&mut self, name: &'static str, read: impl FnOnce(&mut Section<'_, 't, 'a>) -> T) -> Option<T> {
        let Some(value) = self.fields.take(name) else {
            self.reader.mistake(0..0, format!("the table [{name}] is missing"));
            return None;
        };
        let table = self.reader.table(value, name)?;
        let mut section = Section::new(self.reader, table, name, value.span());
        let result = read(&mut section);
        section.finish();
        Some(result)
    }

    /// Reads a table that may be missing, all of whose keys have values then.
    fn optional<T>(&mut self, name: &'static str, read: impl FnOnce(&mut Section<'_, 't, 'a>) -> T) -> T {
        let (table, at) = match self.fields.take(name) {
            None => (self.empty, 0..0),
            Some(value) => (self.reader.table(value, name).unwrap_or(self.empty), value.span()),
        };
        let mut section = Section::new(self.reader, table, name, at);
        let result = read(&mut section);
        section.finish();
        result
    }
}

/// The name that the table gives, and the device of the catalogue that has it.
///
/// `None` when the name is not in the catalogue and nothing else is given, so that the missing keys need not be told.
fn base<'c, 'n, 't, D>(
    section: &mut Section<'_, 't, '_>,
    find: impl FnOnce(&str) -> Option<&'c D>,
    known: impl Iterator<Item = &'n String>,
) -> Option<(Option<&'t str>, Option<&'c D>)> {
    let Some(value) = section.take("name") else {
        return Some((None, None));
    };
    let Some(name) = section.reader().text(value, "name") else {
        return Some((Some(""), None));
    };
    match find(name) {
        Some(device) => Some((Some(name), Some(device))),
        None if section.given() > 1 => Some((Some(name), None)),
        None => {
            let known: Vec<&str> = known.map(String::as_str).collect();
            let what = format!(
                "name: `{name}` is not in the catalogue, which has {}; name one of these or give all data",
                known.join(", ")
            );
            section.mistake(Some(value), what);
            None
        }
    }
}

fn read_mechanics(section: &mut Section<'_, '_, '_>) -> Mechanics {
    let arcmin = 0.0..=600.0;
    Mechanics {
        roller_diameter_mm: section.real("roller_diameter_mm", 1.0..=5000.0, None),
        roller_diameter_tolerance_mm: section.real("roller_diameter_tolerance_mm", 0.0..=10.0, 0.0),
        gear_numerator: section.whole("gear_numerator", 1..=65_535, None) as u16,
        gear_denominator: section.whole("gear_denominator", 1..=65_535, None) as u16,
        gear_efficiency: section.real("gear_efficiency", 0.05..=1.0, 1.0),
        gear_backlash_arcmin: section.real("gear_backlash_arcmin", arcmin.clone(), 0.0),
        gear_stiffness_nm_per_rad: section.optional_real("gear_stiffness_nm_per_rad", 1e-3..=1e9),
        gear_error_arcmin: section.real("gear_error_arcmin", arcmin, 0.0),
        gear_inertia_kg_m2: section.real("gear_inertia_kg_m2", 0.0..=100.0, 0.0),
        load_inertia_kg_m2: section.real("load_inertia_kg_m2", 0.0..=1e6, None),
        friction_nm: section.real("friction_nm", 0.0..=1000.0, None),
        viscous_nm_s: section.real("viscous_nm_s", 0.0..=100.0, 0.0),
    }
}

/// `mark_speed_mm_s` is NaN when it is not given; [`check_feed`] fills it in from C1240.
fn read_feed(section: &mut Section<'_, '_, '_>) -> Feed {
    let speed = 0.1..=1e5;
    Feed {
        mode: section.choice(
            "mode",
            &[("length", FeedMode::Length), ("mark", FeedMode::Mark)],
            FeedMode::Length,
        ),
        length_mm: section.real("length_mm", 200.0..=2000.0, None),
        speed_mm_s: section.real("speed_mm_s", speed.clone(), None),
        mark_speed_mm_s: section.optional_real("mark_speed_mm_s", speed).unwrap_or(f64::NAN),
        acceleration_mm_s2: section.real("acceleration_mm_s2", 1.0..=1e6, None),
        cycle_s: section.real("cycle_s", 0.05..=3600.0, None),
        tolerance_mm: section.real("tolerance_mm", 1e-4..=100.0, 0.01),
        feeds_in_a_row: section.whole("feeds_in_a_row", 1..=1_000_000, 1) as u32,
    }
}

fn read_film(section: &mut Section<'_, '_, '_>) -> FilmWeb {
    let default = FilmWeb::default();
    FilmWeb {
        pull_n: section.real("pull_n", 0.0..=1e4, default.pull_n),
        pull_change_n: section.real("pull_change_n", 0.0..=1e4, default.pull_change_n),
        free_length_mm: section.real("free_length_mm", 0.0..=1e5, default.free_length_mm),
        width_mm: section.real("width_mm", 1.0..=1e4, default.width_mm),
        thickness_um: section.real("thickness_um", 1.0..=1e4, default.thickness_um),
        modulus_n_mm2: section.real("modulus_n_mm2", 1.0..=1e6, default.modulus_n_mm2),
    }
}

fn read_roll(section: &mut Section<'_, '_, '_>) -> FilmRoll {
    let default = WebParams::default();
    let radius_mm = section.real("radius_mm", 40.0..=2000.0, 1e3 * default.roll_radius_m);
    let span_mm = section.real("span_mm", 300.0..=1e5, 1e3 * default.span_m);
    FilmRoll {
        radius_mm,
        core_radius_mm: section.real("core_radius_mm", 5.0..=radius_mm, 1e3 * default.core_radius_m),
        brake_nm: section.real("brake_nm", 0.0..=1000.0, None),
        span_mm,
        reader_to_roller_mm: section.real("reader_to_roller_mm", 0.0..=span_mm, 1e3 * default.reader_to_roller_m),
        grip_n: section.real("grip_n", 0.1..=1e6, default.grip_n),
        creep_per_n: section.real("creep_per_n", 0.0..=0.01, default.creep_per_n),
        density_kg_m3: section.real("density_kg_m3", 100.0..=10_000.0, default.density_kg_m3),
        damping_ratio: section.real("damping_ratio", 0.001..=1.0, default.damping_ratio),
    }
}

fn read_marks(section: &mut Section<'_, '_, '_>, length_mm: f64) -> PrintMarks {
    PrintMarks {
        repeat_mm: section.real("repeat_mm", 200.0..=2000.0, length_mm),
        tolerance_mm: section.real("tolerance_mm", 0.0..=1000.0, 50.0),
        width_mm: section.real("width_mm", 0.1..=200.0, 5.0),
        reader_delay_us: section.real("reader_delay_us", 0.0..=1e5, 0.0),
        reader_jitter_us: section.real("reader_jitter_us", 0.0..=1e5, 0.0),
    }
}

fn read_positioning(section: &mut Section<'_, '_, '_>) -> Positioning {
    Positioning {
        resolver_bits: section.whole("resolver_bits", 8..=16, 16) as u8,
        resolver_accuracy_arcmin: section.real("resolver_accuracy_arcmin", 0.0..=600.0, 10.0),
        latch: section.choice(
            "latch",
            &[("exact", LatchMode::Fast), ("sampled", LatchMode::Sampled1ms)],
            LatchMode::Fast,
        ),
        rounding: section.choice(
            "rounding",
            &[("truncate", Rounding::Truncate), ("carry", Rounding::CarryResidue)],
            Rounding::Truncate,
        ),
        target_window_mm: section.real("target_window_mm", 1e-4..=100.0, 0.009),
        feed_forward_inertia_kg_m2: section.real("feed_forward_inertia_kg_m2", 0.0..=100.0, 0.0),
    }
}

fn read_mains(section: &mut Section<'_, '_, '_>) -> MainsSupply {
    let voltage_v = section.real("voltage_v", 50.0..=1000.0, 400.0);
    MainsSupply {
        voltage_v,
        highest_v: section.real("highest_v", voltage_v..=1000.0, voltage_v),
        lowest_v: section.real("lowest_v", 50.0..=voltage_v, voltage_v),
    }
}

fn read_brake(section: &mut Section<'_, '_, '_>) -> BrakeResistor {
    let resistance_ohm = section.real("resistance_ohm", 1.0..=1e4, None);
    let on_v = section.real("on_v", 50.0..=1500.0, None);
    BrakeResistor {
        resistance_ohm,
        rated_w: section.real("rated_w", 0.1..=1e5, None),
        peak_w: section.real("peak_w", 1.0..=1e6, on_v * on_v / resistance_ohm),
        on_v,
        off_v: section.real("off_v", 50.0..=on_v, None),
    }
}

fn read_bus(section: &mut Section<'_, '_, '_>, plc_cycle_ms: f64) -> Controls {
    const BAUD: i64 = 12_000_000;
    let place = section.take("baud");
    let wanted = place.and_then(|value| section.reader().number(value, "bus.baud", 1..=BAUD));
    let bits_per_second = if place.is_some() { wanted } else { Some(BAUD) };
    let baud = bits_per_second.and_then(|wanted: i64| wanted.to_string().parse().ok());
    if baud.is_none() && bits_per_second.is_some() {
        section.mistake(
            place,
            "bus.baud: expected 9600, 19200, 45450, 93750, 187500, 500000, 1500000, 3000000, 6000000 or 12000000",
        );
    }
    Controls {
        plc_cycle_ms,
        dp_cycle_ms: section.real("dp_cycle_ms", 0.0..=100.0, 1.0),
        baud: baud.unwrap_or(dp_master::time::Baud::B12000000),
        address: section.whole("address", 0..=125, 3) as u8,
    }
}

/// Velocities and acceleration reach the drive as shares of C1240 and C1250, 10 % at least and 100 % at most (block, clamps).
fn check_feed<'a>(reader: &mut Reader<'a>, at: &Spanned<DeValue<'a>>, feed: &mut Feed, codes: &CodeStore) {
    let (v_max, a_max) = (codes.number(C1240, 0), codes.number(C1250, 0));
    if feed.mark_speed_mm_s.is_nan() {
        feed.mark_speed_mm_s = (0.2 * v_max).min(feed.speed_mm_s);
    }
    let place = |key| {
        at.get_ref()
            .as_table()
            .and_then(|table| table.get(key))
            .unwrap_or(at)
            .span()
    };
    for (key, value, code, reference) in [
        ("speed_mm_s", feed.speed_mm_s, "C1240", v_max),
        ("mark_speed_mm_s", feed.mark_speed_mm_s, "C1240", v_max),
        ("acceleration_mm_s2", feed.acceleration_mm_s2, "C1250", a_max),
    ] {
        let share = value / reference;
        if !(0.0999..=1.0001).contains(&share) {
            let what = format!(
                "feed.{key}: expected {:.4} to {reference:.4}, 10 to 100 % of {code}, got {value}",
                reference / 10.0
            );
            reader.mistake(place(key), what);
        }
    }
    if feed.mark_speed_mm_s > feed.speed_mm_s {
        let what = format!(
            "feed.mark_speed_mm_s: expected at most speed_mm_s, {}, got {}",
            feed.speed_mm_s, feed.mark_speed_mm_s
        );
        reader.mistake(place("mark_speed_mm_s"), what);
    }
}
