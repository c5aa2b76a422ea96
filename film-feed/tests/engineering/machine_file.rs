//! The format: what is read, what is refused, what can be run.

use film_feed::catalogue::Catalogue;
use film_feed::machine_file::{MachineFile, NotRunnable};
use film_feed::report::FeedMode;
use film_feed::rig::RigConfig;
use film_feed::run::{Observation, simulated};
use lenze9300_model::code::CodeStore;

use crate::{THESIS, changed, machine};

/// Required keys only.
const LEAST: &str = r#"
[mechanics]
roller_diameter_mm = 57.0
gear_numerator = 7
gear_denominator = 1
load_inertia_kg_m2 = 32.536e-4
friction_nm = 0.05
[feed]
length_mm = 1200.0
speed_mm_s = 1200.0
acceleration_mm_s2 = 2400.0
cycle_s = 3.0
[motor]
name = "MDSKS036-13"
[drive]
name = "EVS9322-EP"
"#;

#[test]
fn the_example_is_the_axis_of_the_thesis() {
    let machine = machine(THESIS);
    let (ours, theirs) = (machine.rig_config(1).unwrap(), RigConfig::default());
    assert_eq!(machine.codes.differences(&CodeStore::thesis()).count(), 0);
    let (axis, thesis) = (&ours.drive.axis, &theirs.drive.axis);
    assert_eq!(axis.motor, thesis.motor);
    assert_eq!(axis.codes, thesis.codes);
    assert_eq!(
        (axis.dc_link, axis.feedback, axis.scaling),
        (thesis.dc_link, thesis.feedback, thesis.scaling)
    );
    assert_eq!(axis.n_plant_max, thesis.n_plant_max);
    assert!((axis.mechanics.j_load_kg_m2 - 0.664e-4).abs() < 1e-12);
    assert_eq!(axis.mechanics.j_rotor_kg_m2, thesis.mechanics.j_rotor_kg_m2);
    assert_eq!(ours.drive.thermal, theirs.drive.thermal);
    assert_eq!(ours.drive.traverse, theirs.drive.traverse);
    assert_eq!(
        (ours.film, ours.plc_cycle_ns, ours.dp_cycle_ns),
        (theirs.film, theirs.plc_cycle_ns, theirs.dp_cycle_ns)
    );
}

#[test]
fn what_the_example_marks_as_default_is_the_default() {
    let mut least = machine(LEAST);
    least.name = "film feed of the thesis".to_owned();
    assert_eq!(least, machine(THESIS));
}

#[test]
fn every_mistake_is_told_once_with_its_line() {
    let text = r#"name = 3
[mechanics]
roller_diameter_mm = 0
gear_numerator = 7.5
gear_denominator = 1
friction_nm = 0.05
roller = 57
[feed]
mode = "both"
length_mm = 100
speed_mm_s = "fast"
acceleration_mm_s2 = 2400.0
cycle_s = 3.0
[motor]
name = "MDSKS036-14"
[drive]
rated_current_a = 2.5
[mains]
voltage_v = 230
lowest_v = 400
[bus]
baud = 115200
[surprise]
"#;
    let error = MachineFile::read(text, &Catalogue::built_in()).unwrap_err();
    let told: Vec<String> = error.mistakes.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "line 1: name: expected a text, got integer",
            "line 2: mechanics.load_inertia_kg_m2 is missing; expected is a number from 0 to 1000000",
            "line 3: mechanics.roller_diameter_mm: expected 1 to 5000, got 0",
            "line 4: mechanics.gear_numerator: expected a whole number, got float",
            "line 7: `roller` is unknown here; allowed are roller_diameter_mm, roller_diameter_tolerance_mm, gear_numerator, \
             gear_denominator, gear_efficiency, gear_backlash_arcmin, gear_stiffness_nm_per_rad, gear_error_arcmin, gear_inertia_kg_m2, load_inertia_kg_m2, \
             friction_nm, viscous_nm_s",
            "line 9: feed.mode: expected length or mark, got both",
            "line 10: feed.length_mm: expected 200 to 2000, got 100",
            "line 11: feed.speed_mm_s: expected a number, got string",
            "line 15: name: `MDSKS036-14` is not in the catalogue, which has MDSKS036-13; name one of these or give all data",
            "line 16: drive.link_capacitance_uf is missing; expected is a number from 1 to 1000000",
            "line 16: drive.link_overvoltage_v is missing; expected is a number from 50 to 1500",
            "line 16: drive.loss_w is missing; expected is a number from 0 to 100000",
            "line 16: drive.mains_max_v is missing; expected is a number from 50 to 1000",
            "line 16: drive.mains_min_v is missing; expected is a number from 50 to 1000",
            "line 16: drive.name is missing; expected is a text",
            "line 16: drive.output_max_hz is missing; expected is a number from 1 to 5000",
            "line 16: drive.peak_current_a is missing; expected is a number from 0.01 to 1000",
            "line 16: drive.peak_time_s is missing; expected is a number from 0.001 to 10000",
            "line 16: drive.recovery_share is missing; expected is a number from 0 to 1",
            "line 16: drive.recovery_time_s is missing; expected is a number from 0 to 100000",
            "line 20: mains.lowest_v: expected 50 to 230, got 400",
            "line 22: bus.baud: expected 9600, 19200, 45450, 93750, 187500, 500000, 1500000, 3000000, 6000000 or 12000000",
            "line 23: `surprise` is unknown here; allowed are mechanics, feed, motor, drive, film, roll, marks, positioning, mains, brake, \
             plc, bus, codes, name, ambient_c",
        ]
    );
}

#[test]
fn what_depends_on_codes_is_checked_with_them() {
    let read = |codes: &str| MachineFile::read(&format!("{LEAST}[codes]\n{codes}"), &Catalogue::built_in());
    let told = |codes: &str| read(codes).unwrap_err().to_string();
    assert_eq!(
        told("C1240 = 1000"),
        "line 10: feed.speed_mm_s: expected 100.0000 to 1000.0000, 10 to 100 % of C1240, got 1200"
    );
    assert_eq!(told("C0022 = 4"), "line 18: C0022: 4.00 A is above 3.75 A");
    assert_eq!(read("C0022 = 2.5").unwrap().current_limit_a, 2.5);
    // The thesis commands 1.5·0.9 A = 1.35 A (C0086 = 108; 9300 facts 9, row 15).
    assert_eq!(read("").unwrap().current_limit_a, 1.35);
    let slower = read("C1240 = 2400").unwrap();
    assert_eq!(slower.feed_plan(1).speed_hundredth_percent, 5000);
    assert_eq!(slower.feed.mark_speed_mm_s, 480.0);
}

#[test]
fn a_machine_runs_as_long_as_it_is_reckoned_to() {
    // By length 0.5 s + 0.5 s + 0.5 s (film-feed specification, section 5). To the mark at 240 mm/s from 1200 mm/s: ramps
    // (2·1200 − 240)/2400 = 0.9 s over 588 mm, 512 mm at 1200 mm/s, then 100 mm less 12 mm at 240 mm/s and 0.1 s of braking.
    let to_mark = 0.9 + 512.0 / 1200.0 + 88.0 / 240.0 + 0.1;
    for (mode, motion_s) in [("length", 1.5), ("mark", to_mark)] {
        let machine = changed(&[
            ("mode = \"length\"", &format!("mode = \"{mode}\"")),
            ("tolerance_mm = 50.0", "tolerance_mm = 0.0"),
        ]);
        assert!(
            (machine.motion_s() - motion_s).abs() < 1e-12,
            "{mode}: {}",
            machine.motion_s()
        );
        let config = machine.rig_config(1).unwrap();
        let (report, _) = simulated(&config, machine.feed_plan(2), Observation::FeedsOnly, || {}).unwrap();
        assert!(report.ok, "{report}");
        for feed in &report.feeds {
            // The set-value of a mark feed is planned in whole milliseconds after the latch.
            let set_point_s = feed.set_point_s.unwrap();
            assert!((set_point_s - motion_s).abs() < 2.5e-3, "{mode}: {set_point_s} s");
        }
    }
}

#[test]
fn the_pull_of_the_film_reaches_the_motor_in_a_run() {
    // 40 N at 28.5 mm are 1.14 Nm, 0.1629 Nm behind 7:1; the torque at constant speed is that and 0.05 Nm of friction.
    let machine = changed(&[("pull_n = 0.0 ", "pull_n = 40.0 ")]);
    assert!((machine.torque_of_pull_nm(40.0) - 0.162_857).abs() < 1e-6);
    let config = machine.rig_config(1).unwrap();
    let plan = machine.feed_plan(1);
    assert_eq!(plan.series, [(FeedMode::Length, 1)]);
    let (_, samples) = simulated(&config, plan, Observation::Samples, || {}).unwrap();
    let start_s = samples.iter().find(|sample| sample.feed == 1).unwrap().time_s;
    let steady: Vec<f64> = samples
        .iter()
        .filter(|sample| (0.8..0.95).contains(&(sample.time_s - start_s)))
        .map(|sample| sample.torque_nm)
        .collect();
    let mean = steady.iter().sum::<f64>() / steady.len() as f64;
    assert!((mean - 0.212_857).abs() < 2e-3, "{mean} Nm");
}

#[test]
fn a_drive_larger_than_the_modelled_one_can_be_sized_and_not_run() {
    let machine = changed(&[
        ("name = \"EVS9322-EP\"", "name = \"EVS9322-EP\"\npeak_current_a = 8.0"),
        (
            "name = \"MDSKS036-13\"",
            "name = \"MDSKS036-13\"\nrated_current_a = 4.0\nmotor_list = 0",
        ),
        ("\"C0022\" = 1.35 ", "# "),
    ]);
    assert_eq!(machine.current_limit_a, 6.0);
    let refused = machine.rig_config(1).unwrap_err();
    assert_eq!(
        refused,
        NotRunnable::CurrentLimit {
            wanted_a: 6.0,
            modelled_a: 3.75
        }
    );
}

#[test]
fn the_documentation_has_every_key_and_no_other() {
    let documentation = include_str!("../../../docs/machine-file.md");
    let tables = [
        "mechanics",
        "feed",
        "film",
        "roll",
        "marks",
        "motor",
        "drive",
        "positioning",
        "mains",
        "brake",
        "plc",
        "bus",
    ];
    // A key that nobody knows makes the reader list those it does.
    let text: String = tables.map(|table| format!("[{table}]\nnobody_knows = 1\n")).concat();
    let error = MachineFile::read(&format!("nobody_knows = 1\n{text}"), &Catalogue::built_in()).unwrap_err();
    let mut known: Vec<&str> = error
        .mistakes
        .iter()
        .filter_map(|mistake| mistake.what.split_once("allowed are "))
        .flat_map(|(_, keys)| keys.split(", "))
        .filter(|key| !tables.contains(key) && *key != "codes")
        .collect();
    known.sort_unstable();
    known.dedup();
    let mut documented: Vec<&str> = documentation
        .lines()
        .filter(|line| line.starts_with("| `"))
        .filter_map(|line| line.split('|').nth(1))
        .flat_map(|cell| cell.split(','))
        .map(|key| key.trim().trim_matches('`'))
        .collect();
    documented.sort_unstable();
    documented.dedup();
    assert_eq!(documented, known);
}
