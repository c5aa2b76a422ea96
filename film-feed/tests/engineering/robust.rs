//! Whatever can be read can be reckoned with.

use film_feed::budget::Budget;
use film_feed::catalogue::Catalogue;
use film_feed::machine_file::MachineFile;
use film_feed::size::{self, Sizing, Verdict};
use proptest::prelude::*;

use crate::THESIS;

/// Every number of the file with the range its documentation gives; ranges that other values narrow are left to the reader to refuse.
const NUMBERS: &[(&str, &str, f64, f64)] = &[
    ("mechanics", "roller_diameter_mm", 1.0, 5000.0),
    ("mechanics", "roller_diameter_tolerance_mm", 0.0, 10.0),
    ("mechanics", "gear_efficiency", 0.05, 1.0),
    ("mechanics", "gear_backlash_arcmin", 0.0, 600.0),
    ("mechanics", "gear_error_arcmin", 0.0, 600.0),
    ("mechanics", "gear_inertia_kg_m2", 0.0, 100.0),
    ("mechanics", "load_inertia_kg_m2", 0.0, 1e6),
    ("mechanics", "friction_nm", 0.0, 1000.0),
    ("mechanics", "viscous_nm_s", 0.0, 100.0),
    ("feed", "length_mm", 200.0, 2000.0),
    ("feed", "speed_mm_s", 0.1, 1e5),
    ("feed", "acceleration_mm_s2", 1.0, 1e6),
    ("feed", "cycle_s", 0.05, 3600.0),
    ("feed", "tolerance_mm", 1e-4, 100.0),
    ("film", "pull_n", 0.0, 1e4),
    ("film", "pull_change_n", 0.0, 1e4),
    ("film", "free_length_mm", 0.0, 1e5),
    ("film", "width_mm", 1.0, 1e4),
    ("film", "thickness_um", 1.0, 1e4),
    ("film", "modulus_n_mm2", 1.0, 1e6),
    ("marks", "reader_delay_us", 0.0, 1e5),
    ("marks", "reader_jitter_us", 0.0, 1e5),
    ("motor", "rated_torque_nm", 0.001, 10_000.0),
    ("motor", "standstill_torque_nm", 0.001, 10_000.0),
    ("motor", "peak_torque_nm", 0.001, 10_000.0),
    ("motor", "rated_current_a", 0.01, 1000.0),
    ("motor", "standstill_current_a", 0.01, 1000.0),
    ("motor", "peak_current_a", 0.01, 1000.0),
    ("motor", "resistance_ohm", 1e-4, 1000.0),
    ("motor", "inductance_mh", 0.001, 1000.0),
    ("motor", "rotor_inertia_kg_m2", 1e-9, 100.0),
    ("drive", "rated_current_a", 0.01, 1000.0),
    ("drive", "peak_current_a", 0.01, 1000.0),
    ("drive", "link_capacitance_uf", 1.0, 1e6),
    ("positioning", "resolver_accuracy_arcmin", 0.0, 600.0),
    ("positioning", "target_window_mm", 1e-4, 100.0),
    ("mains", "voltage_v", 50.0, 1000.0),
];

/// The thesis' machine with some of its numbers anywhere in their ranges, the ends included.
fn any_machine() -> impl Strategy<Value = String> {
    let place = prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64];
    let changes = prop::collection::vec((0..NUMBERS.len(), place), 1..6);
    let brake_nm = prop::option::of(0.0..1000.0_f64);
    (changes, any::<bool>(), 1_u16..=65_535, any::<bool>(), brake_nm).prop_map(
        |(changes, mark, gear, geared, brake_nm)| {
            let mut file: Vec<String> = THESIS.lines().map(str::to_owned).collect();
            for (which, place) in changes {
                let (table, key, least, most) = NUMBERS[which];
                // Evenly over the powers of ten.
                let value = if least > 0.0 {
                    least * (most / least).powf(place)
                } else {
                    most * place.powi(6)
                };
                let value = value.clamp(least, most);
                set(&mut file, table, key, Some(&format!("{value:e}")));
            }
            if geared {
                set(&mut file, "mechanics", "gear_numerator", Some(&gear.to_string()));
            }
            set(
                &mut file,
                "feed",
                "mode",
                Some(if mark { "\"mark\"" } else { "\"length\"" }),
            );
            for (table, key) in [
                ("feed", "mark_speed_mm_s"),
                ("mains", "lowest_v"),
                ("mains", "highest_v"),
                ("marks", "repeat_mm"),
            ] {
                set(&mut file, table, key, None);
            }
            if let Some(brake_nm) = brake_nm {
                file.push(format!("[roll]\nbrake_nm = {brake_nm}"));
            }
            file.join("\n")
        },
    )
}

/// Gives a key of a table a value, or none.
fn set(file: &mut Vec<String>, table: &str, key: &str, value: Option<&str>) {
    let head = file
        .iter()
        .position(|line| line.starts_with(&format!("[{table}]")))
        .expect("the table is there");
    let end = file[head + 1..]
        .iter()
        .position(|line| line.starts_with('['))
        .map_or(file.len(), |lines| head + 1 + lines);
    let old = file[head..end]
        .iter()
        .position(|line| line.starts_with(&format!("{key} ")));
    if let Some(lines) = old {
        file.remove(head + lines);
    }
    if let Some(value) = value {
        file.insert(head + 1, format!("{key} = {value}"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn whatever_can_be_read_can_be_sized_and_drawn(text in any_machine()) {
        let Ok(machine) = MachineFile::read(&text, &Catalogue::built_in()) else {
            return Ok(());
        };
        let sizing = Sizing::of(&machine);
        for row in &sizing.rows {
            prop_assert!(!row.value.is_nan(), "{} {}", row.id, text);
        }
        // What is beyond all bounds fails, it does not pass by accident.
        let endless = |row: &&film_feed::size::Row| row.value.is_infinite() && row.verdict() == Verdict::Pass;
        prop_assert!(sizing.rows.iter().find(endless).is_none());
        prop_assert!(size::html(&machine, &sizing).is_ok());
        prop_assert!(!sizing.to_string().is_empty());
        let budget = Budget::of(&machine);
        prop_assert!(budget.parts.iter().all(|part| part.mm.is_finite() && part.mm >= 0.0), "{}", budget);
    }

    #[test]
    fn no_text_makes_the_reader_panic(at in 0_usize..4000, length in 0_usize..40, put in "[\\PC\\n]{0,12}") {
        let mut text: Vec<char> = THESIS.chars().collect();
        let begin = at.min(text.len());
        let end = (begin + length).min(text.len());
        text.splice(begin..end, put.chars());
        let text: String = text.into_iter().collect();
        if let Err(error) = MachineFile::read(&text, &Catalogue::built_in()) {
            let lines = text.lines().count();
            prop_assert!(error.mistakes.iter().all(|mistake| (1..=lines + 1).contains(&mistake.line)), "{}", error);
        }
    }
}
