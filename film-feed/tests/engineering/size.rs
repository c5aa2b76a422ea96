//! Sizing against calculation by hand and published examples.

use film_feed::catalogue::Catalogue;
use film_feed::machine_file::MachineFile;
use film_feed::size::{LoadCycle, Selection, Sizing, TorqueLimits, Verdict};
use proptest::prelude::*;

use crate::{THESIS, assert_near, changed, machine, value};

/// The axis of the thesis by hand, chapter 5.6 step by step. Numbers: motor thesis 7.2, drive thesis 7.3, machine thesis 8.3 (π·57 mm,
/// 7:1, 1200 mm/s, 2400 mm/s²); inertias and friction 9300 facts 6 and 10: J_motor = 0.25e-4, J_load = 32.536e-4 behind the gear,
/// 0.05 Nm. A cycle of 3 s: 0.5 s of acceleration, travel and braking each (thesis 8.3), 1.5 s of rest.
#[test]
fn the_axis_of_the_thesis_is_sized_as_by_hand() {
    let sizing = Sizing::of(&machine(THESIS));
    let rows = [
        // Thesis 5.6, formula VII: √(32.536e-4/0.25e-4) = √130.144
        ("gear_optimum", 11.4081),
        // ½·(7/11.4081 + 11.4081/7) = ½·(0.61360 + 1.62972)
        ("gear_torque", 1.12166),
        // Formula VIII: 32.536e-4/49
        ("reduced_inertia", 6.64e-5),
        // 0.664e-4/0.25e-4
        ("inertia_ratio", 2.656),
        // 60·1200·7/179.0708; 9300 facts 11
        ("motor_speed", 2814.529),
        ("usual_speed", 2814.529),
        // 3 pole pairs·2814.529/60
        ("output_frequency", 140.7265),
        // α = 2.4·7/0.0285 = 589.474 rad/s² (9300 facts 6: 589.5); J = 0.914e-4: 0.0538779 + 0.05
        ("torque_acceleration", 0.103_877_9),
        ("torque_travel", 0.05),
        // 0.0538779 − 0.05, the motor brakes
        ("torque_braking", 0.003_877_9),
        ("torque_rest", 0.0),
        // E = 132.352 V line-line (9300 facts 6: about 132 V). û_q = 884.211·0.122213 + 19.8·0.188878 = 111.8018,
        // û_d = 884.211·0.0305·0.188878 = 5.0938; √1.5·√(111.8018² + 5.0938²)
        ("voltage", 137.074),
        // (½ + 1 + ½)·2814.529·0.5/3
        ("mean_speed", 938.1765),
        // √((0.1038779² + 0.05² + 0.0038779²)·0.5/3)
        ("rms_torque", 0.047_091_5),
        // Formula IX: 0.1038779/0.777778
        ("peak_current_motor", 0.133_557),
        ("peak_current_drive", 0.133_557),
        ("peak_current_limit", 0.133_557),
        // 0.0470915/0.777778
        ("rms_current_motor", 0.060_546_2),
        ("rms_current_drive", 0.060_546_2),
        ("overload_time", 0.0),
        // ω = 294.737 rad/s: (0.1038779·147.368 + 0.05·294.737)·0.5/3
        ("mean_shaft_power", 5.007_53),
        // 0.1038779·294.737
        ("peak_shaft_power", 30.6166),
        // + 3·19.8·0.133557²
        ("peak_electrical_power", 31.6762),
        // (7.65416 + 7.36842)·0.5/1.5 … as above + 3·19.8·(0.133557² + 0.0642857²)·0.5/3 + 15 W
        ("mean_mains_power", 20.2250),
        // ½·0.914e-4·294.737²
        ("kinetic_energy", 3.969_95),
        // 0.0038779·294.737·0.5/2
        ("brake_energy_shaft", 0.285_740),
        // 3·19.8·0.00498586²·0.5
        ("brake_energy_copper", 7.3831e-4),
        // The difference
        ("brake_energy_link", 0.285_002),
        // √(2·400² + 2·0.285002/165e-6)
        ("link_voltage", 568.7307),
        // 100·(0.0470915/(0.70 − 0.10·938.1765/4000))²
        ("motor_utilisation", 0.484_497),
        // 25 + 100·(0.0605462/0.9)²
        ("winding_temperature", 25.452_57),
        // Mean current (0.133557 + 0.0642857 + 0.0049859)·0.5/3 = 0.0338048: 100·0.0338048/2.625
        ("drive_utilisation", 1.287_80),
        // 25 + 40·(0.15 + 0.85·0.0338048/2.5)
        ("heat_sink_temperature", 31.459_7),
        // 1 inc (9300 facts 11)
        ("resolver_step", 0.000_390_343),
        ("motion", 1.5),
        // 1.5 + 2·(5 + 1 + 3) ms
        ("cycle", 1.518),
        ("mains_low", 400.0),
        ("mains_high", 400.0),
    ];
    for (id, expected) in rows {
        let share = if id == "brake_energy_copper" { 5e-3 } else { 2e-5 };
        assert_near(id, value(&sizing, id), expected, share);
    }
    assert_eq!(sizing.rows.len(), rows.len(), "every row is calculated by hand");
    assert!(sizing.ok() && !sizing.resistor_needed, "{sizing}");
    // Thesis 7.2, 7.3, 8.3.
    let most = |id: &str| sizing.row(id).unwrap().shown_limit();
    assert_eq!(most("motor_speed"), "≤ 3000 1/min");
    assert_eq!(most("peak_current_motor"), "≤ 5 A");
    assert_eq!(most("peak_current_drive"), "≤ 3.75 A");
    assert_eq!(most("peak_current_limit"), "≤ 1.35 A");
    assert_eq!(most("rms_current_motor"), "≤ 0.9 A");
    assert_eq!(most("rms_current_drive"), "≤ 2.5 A");
    assert_eq!(most("link_voltage"), "≤ 770 V");
}

#[test]
fn a_feed_to_the_mark_has_its_own_operating_points() {
    // 1200 → 240 mm/s at 2400 mm/s² takes 0.4 s with the same −0.0038779 Nm, the search turns at 0.05 Nm.
    let sizing = Sizing::of(&changed(&[("mode = \"length\"", "mode = \"mark\"")]));
    assert_near("slowing down", value(&sizing, "torque_slowing_down"), 0.003_877_9, 2e-5);
    assert_near("search", value(&sizing, "torque_search"), 0.05, 1e-12);
    assert!(sizing.ok());
}

/// A cycle of a published example: torque of friction and inertia only.
fn example(lead_mm: f64, gear: u16, j_load: f64, j_motor: f64, friction_nm: f64) -> MachineFile {
    let diameter = lead_mm / std::f64::consts::PI;
    changed(&[
        ("roller_diameter_mm = 57.0", &format!("roller_diameter_mm = {diameter}")),
        ("gear_numerator = 7", &format!("gear_numerator = {gear}")),
        (
            "load_inertia_kg_m2 = 32.536e-4",
            &format!("load_inertia_kg_m2 = {j_load}"),
        ),
        ("friction_nm = 0.05", &format!("friction_nm = {friction_nm}")),
        (
            "name = \"MDSKS036-13\"",
            &format!("name = \"MDSKS036-13\"\nrotor_inertia_kg_m2 = {j_motor}"),
        ),
        ("length_mm = 1200.0", "length_mm = 275.0"),
        ("speed_mm_s = 1200.0", "speed_mm_s = 250.0"),
        ("mark_speed_mm_s = 240.0", "# "),
        ("acceleration_mm_s2 = 2400.0", "acceleration_mm_s2 = 2500.0"),
        ("cycle_s = 3.0", "cycle_s = 1.5"),
    ])
}

/// Source: Yaskawa, user's manual of the Σ-V-MD series, 2.2.2 "Selection Calculations", p. 2-5: ball screw of 10 mm lead behind 2:1,
/// 0.275 m at 15 m/min, 40 times a minute; printed: t = 1.5 s, t_a = 0.1 s, t_c = 1.0 s, n_M = 3000 1/min, T_L = 0.43 Nm,
/// J_L = (1.58 + 0.31 + 0.40)e-4 = 2.29e-4 kg m², P_O = 135 W. RMS torque by the formula of the same maker's manuals (Junma series,
/// p. 36): √((T_P²·t_a + T_L²·t_c + T_S²·t_d)/t).
#[test]
fn a_published_trapezoid_is_reproduced() {
    // J_L1 + J_B at the screw are 4·1.89e-4; the 0.40e-4 of gear and coupling sit at the motor. The motor is one with 0.26e-4.
    let machine = example(10.0, 2, 7.56e-4, 0.26e-4, 0.43);
    let machine = MachineFile {
        mechanics: film_feed::machine_file::Mechanics {
            gear_inertia_kg_m2: 0.40e-4,
            ..machine.mechanics
        },
        ..machine
    };
    assert_near("J_L", machine.mechanics.reduced_inertia_kg_m2(), 2.29e-4, 1e-9);
    let cycle = LoadCycle::of(&machine);
    assert_near("n_M", cycle.peak(|point| point.rpm), 3000.0, 1e-9);
    let times: Vec<f64> = cycle.phases.iter().map(|phase| phase.duration_s).collect();
    for (found, expected) in times.iter().zip([0.1, 1.0, 0.1, 0.3]) {
        assert_near("time", *found, expected, 1e-9);
    }
    // P_O = 2π·3000·0.43/60, printed 135 W.
    assert_near("P_O", cycle.phases[1].at(0.0).shaft_w(), 135.0, 1e-3);
    // 2π·3000/60·2.55e-4/0.1 = 0.80111 Nm: T_P = 1.23111, T_S = 0.37111; √((0.151563 + 0.1849 + 0.013772)/1.5)
    assert_near("T_P", cycle.peak(|point| point.torque_nm), 1.231_11, 1e-5);
    assert_near("T_S", cycle.peak(|point| -point.torque_nm), 0.371_11, 2e-5);
    assert_near("T_rms", cycle.rms(|point| point.torque_nm), 0.483_21, 2e-5);
}

/// Source: Yaskawa, product manual of the Σ-S series, 2.4.1 "Example of Capacity Selection for Servomotors", p. 2-13: 3000 1/min in 0.1 s,
/// lead 5 mm, J_M = 0.00629e-4, J_L = 0.474e-4, T_L = 0.035; printed: P_O = 11.0 W, P_a = 46.78 W, T_P = 0.186 Nm.
#[test]
fn a_published_starting_torque_is_reproduced() {
    let cycle = LoadCycle::of(&example(5.0, 1, 0.474e-4, 0.00629e-4, 0.035));
    assert_near("T_P", cycle.peak(|point| point.torque_nm), 0.186, 3e-3);
    assert_near("P_O", cycle.phases[1].at(0.0).shaft_w(), 11.0, 1e-3);
    let omega = 3000.0 / 60.0 * std::f64::consts::TAU;
    let load_only = (cycle.phases[0].torque_nm[0] - 0.035) * 0.474 / (0.474 + 0.00629);
    assert_near("P_a", load_only * omega, 46.78, 1e-3);
}

/// Source: Firgelli Automations, "Motor Inertia Matching Ratio Calculator", its example: 0.002 and 0.08 kg m² behind 5:1 give 0.0032 kg m²
/// and 1.6:1.
#[test]
fn a_published_inertia_ratio_is_reproduced() {
    let sizing = Sizing::of(&changed(&[
        ("gear_numerator = 7", "gear_numerator = 5"),
        ("load_inertia_kg_m2 = 32.536e-4", "load_inertia_kg_m2 = 0.08"),
        (
            "name = \"MDSKS036-13\"",
            "name = \"MDSKS036-13\"\nrotor_inertia_kg_m2 = 0.002",
        ),
    ]));
    assert_near("reduced", value(&sizing, "reduced_inertia"), 0.0032, 1e-12);
    assert_near("ratio", value(&sizing, "inertia_ratio"), 1.6, 1e-12);
    // √(0.08/0.002) = √40
    assert_near("optimum", value(&sizing, "gear_optimum"), 6.324_555, 1e-6);
    assert!(!sizing.ok(), "such an axis is too heavy for this motor");
}

#[test]
fn each_limit_can_be_the_one_that_fails() {
    type Changes<'a> = &'a [(&'a str, &'a str)];
    let cases: [(Changes<'_>, &[&str]); 9] = [
        // 32 inc = 0.012491 mm (9300 facts 11) are more than ±0.01 mm.
        (&[("resolver_bits = 16", "resolver_bits = 11")], &["resolver_step"]),
        (&[("\"C0011\" = 3000", "\"C0011\" = 2500")], &["motor_speed"]),
        (&[("cycle_s = 3.0", "cycle_s = 1.51")], &["cycle"]),
        (
            &[
                ("voltage_v = 400.0 ", "voltage_v = 300.0 "),
                ("lowest_v = 400.0", "lowest_v = 300.0"),
                ("highest_v = 400.0", "highest_v = 300.0"),
            ],
            &["mains_low", "mains_high"],
        ),
        (
            &[("lowest_v = 400.0", "lowest_v = 130.0")],
            &["torque_acceleration", "torque_travel", "voltage", "mains_low"],
        ),
        (
            &[("\"C0022\" = 1.35", "\"C0022\" = 0.10")],
            &["torque_acceleration", "peak_current_limit"],
        ),
        (&[("ambient_c = 25.0", "ambient_c = 80.0")], &["heat_sink_temperature"]),
        // 0.8 Nm all the time: 1.07 A, more than the motor's 0.9 A and M_0 = 0.7 Nm; 25 + 100·(1.0708/0.9)² = 166.6 °C.
        (
            &[("pull_n = 0.0 ", "pull_n = 196.5 ")],
            &[
                "rms_torque",
                "rms_current_motor",
                "motor_utilisation",
                "winding_temperature",
            ],
        ),
        (
            &[
                ("gear_numerator = 7 ", "gear_numerator = 1 "),
                ("load_inertia_kg_m2 = 32.536e-4", "load_inertia_kg_m2 = 2e-4"),
            ],
            &["usual_speed"],
        ),
    ];
    for (changes, expected) in cases {
        let sizing = Sizing::of(&changed(changes));
        let failed: Vec<&str> = sizing.failures().map(|row| row.id).collect();
        assert_eq!(failed, expected, "{changes:?}\n{sizing}");
    }
}

#[test]
fn the_torque_speed_curve_ends_where_the_voltage_does() {
    let machine = machine(THESIS);
    let limits = TorqueLimits::of(&machine);
    // Back EMF 47.0 V per 1000 1/min (9300 facts 6) against 400 V: nothing is left above 8507 1/min.
    assert_eq!(limits.voltage_limit_nm(8600.0), 0.0);
    assert!(limits.voltage_limit_nm(8400.0) > 0.0);
    assert_eq!(limits.voltage_limit_nm(0.0), 3.10);
    let at_limit = limits.voltage_limit_nm(5000.0);
    assert_near("voltage", machine.motor.voltage_v(5000.0, at_limit), 400.0, 1e-6);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The energy that the motor gives in a cycle is what friction and pull take: all that went into the motion comes back.
    #[test]
    fn energy_is_neither_lost_nor_made(
        (mark, length, speed, accel) in (any::<bool>(), 200.0..2000.0_f64, 100.0..3000.0_f64, 300.0..20_000.0_f64),
        (inertia, friction, viscous, pull, ratio) in (0.0..0.1_f64, 0.0..0.5_f64, 0.0..1e-3_f64, 0.0..100.0_f64, 1_u16..50),
    ) {
        let mode = if mark { "mark" } else { "length" };
        // At the mark-reading velocity the search needs room to brake in.
        let slow = (0.2 * speed).min((2.0 * accel * 90.0_f64).sqrt());
        prop_assume!(slow >= 0.1 * speed);
        let machine = changed(&[
            ("mode = \"length\"", &format!("mode = \"{mode}\"")),
            ("length_mm = 1200.0", &format!("length_mm = {length}")),
            ("speed_mm_s = 1200.0", &format!("speed_mm_s = {speed}")),
            ("mark_speed_mm_s = 240.0", &format!("mark_speed_mm_s = {slow}")),
            ("acceleration_mm_s2 = 2400.0", &format!("acceleration_mm_s2 = {accel}")),
            ("load_inertia_kg_m2 = 32.536e-4", &format!("load_inertia_kg_m2 = {inertia}")),
            ("friction_nm = 0.05", &format!("friction_nm = {friction}")),
            ("viscous_nm_s = 0.0", &format!("viscous_nm_s = {viscous}")),
            ("pull_n = 0.0 ", &format!("pull_n = {pull} ")),
            ("gear_numerator = 7", &format!("gear_numerator = {ratio}")),
            ("cycle_s = 3.0", "cycle_s = 60.0"),
        ]);
        let peak_reaches_slow = accel * (length - 100.0) > 0.5 * slow * slow;
        prop_assume!(!mark || peak_reaches_slow);
        let cycle = LoadCycle::of(&machine);
        let rad_per_mm = machine.mechanics.gear_ratio() / (0.5 * machine.mechanics.roller_diameter_mm);
        let given = cycle.integral(|point| point.shaft_w());
        let omega = |rpm: f64| rpm / 60.0 * std::f64::consts::TAU;
        let taken = friction * length * rad_per_mm
            + cycle.integral(|point| viscous * omega(point.rpm).powi(2))
            + pull * length * 1e-3;
        prop_assert!((given - taken).abs() <= 1e-9 * (1.0 + cycle.integral(|point| point.shaft_w().abs())), "{} {}", given, taken);
        // The way is the length, and a mean square is never below the square of a mean.
        prop_assert!((cycle.integral(|point| omega(point.rpm)) / rad_per_mm - length).abs() < 1e-6 * length);
        prop_assert!(cycle.rms(|point| point.torque_nm) >= cycle.mean(|point| point.torque_nm.abs()) * (1.0 - 1e-12));
    }

    /// No gear needs less torque for the same acceleration than the optimum of formula VII.
    #[test]
    fn no_gear_needs_less_torque_than_the_optimum(j_load in 1e-5..1e-1_f64, j_motor in 1e-6..1e-2_f64, ratio in 1_u16..200) {
        let machine = changed(&[
            ("gear_numerator = 7", &format!("gear_numerator = {ratio}")),
            ("load_inertia_kg_m2 = 32.536e-4", &format!("load_inertia_kg_m2 = {j_load}")),
            ("name = \"MDSKS036-13\"", &format!("name = \"MDSKS036-13\"\nrotor_inertia_kg_m2 = {j_motor}")),
        ]);
        let sizing = Sizing::of(&machine);
        let torque = |i: f64| j_motor * i + j_load / i;
        let (ratio, optimum) = (f64::from(ratio), value(&sizing, "gear_optimum"));
        for other in [0.5, 0.9, 0.99, 1.01, 1.1, 2.0] {
            prop_assert!(torque(optimum * other) >= torque(optimum));
        }
        let over = torque(ratio) / torque(optimum);
        prop_assert!((value(&sizing, "gear_torque") - over).abs() < 1e-9 * over);
    }
}

#[test]
fn report_page_and_pictures_say_what_was_found() {
    let machine = changed(&[
        ("\"C0011\" = 3000", "\"C0011\" = 2500"),
        ("film feed of the thesis\"", "<feed> & co\""),
    ]);
    let sizing = Sizing::of(&machine);
    let text = sizing.to_string();
    assert!(
        text.ends_with("1 of 26 checks failed: greatest motor speed, against C0011."),
        "{text}"
    );
    let page = film_feed::size::html(&machine, &sizing).unwrap();
    assert_eq!(page.matches("<svg").count(), 3);
    assert!(page.contains("Sizing of &lt;feed&gt; &amp; co") && !page.contains("<feed>"));
    assert!(
        !page.contains("http:") || page.matches("http").count() == page.matches("http://www.w3.org/2000/svg").count()
    );
    for row in &sizing.rows {
        assert!(
            page.contains(&format!("<td class=\"number\">{}</td>", row.shown_value())),
            "{}",
            row.id
        );
    }
    let json = serde_json::to_value(&sizing).unwrap();
    let rows = json["rows"].as_array().unwrap();
    let failed: Vec<_> = rows.iter().filter(|row| row["verdict"] == "fail").collect();
    assert_eq!(
        (failed.len(), &failed[0]["id"], &failed[0]["most"]),
        (1, &"motor_speed".into(), &2500.0.into())
    );
    assert_eq!(sizing.row("motor_speed").unwrap().verdict(), Verdict::Fail);
}

/// Two more motors, twice and half as large; of no maker.
fn catalogue() -> Catalogue {
    let mut catalogue = Catalogue::built_in();
    for (name, factor, power_w) in [("large", 2.0, 500.0), ("small", 0.05, 12.5)] {
        let motor = include_str!("../../catalogue/motors.toml")
            .replace("MDSKS036-13", name)
            .replace("motor_list = 108 ", "motor_list = 0 ")
            .replace("0.60\n", &format!("{}\n", 0.60 * factor))
            .replace("0.70\n", &format!("{}\n", 0.70 * factor))
            .replace("3.10\n", &format!("{}\n", 3.10 * factor))
            .replace("= 0.90\n", &format!("= {}\n", 0.90 * factor))
            .replace("= 5.00\n", &format!("= {}\n", 5.00 * factor))
            .replace("= 250.0\n", &format!("= {power_w}\n"));
        catalogue.add(Catalogue::read(&motor).expect("the motor is complete"));
    }
    catalogue
}

#[test]
fn the_smallest_of_many_that_is_large_enough_comes_first() {
    let machine = machine(THESIS);
    let gears = ["3", "7", "18:2", "12"].map(|gear| gear.parse().unwrap());
    let selection = Selection::of(&machine, &catalogue(), &gears);
    assert_eq!(selection.candidates.len(), 12);
    let found: Vec<(String, bool)> = selection
        .candidates
        .iter()
        .map(|candidate| (format!("{} {}", candidate.motor, candidate.gear), candidate.ok))
        .collect();
    // 12:1 needs 4825 1/min, more than any of them is rated for. The small motor has 0.035 Nm for ever and 0.155 Nm for a moment; it turns
    // against 0.05 Nm of friction. Behind 3:1 the middle one has 0.096 Nm of acceleration and little speed.
    let (first, last) = (&found[0], found.last().unwrap());
    assert!(first.0.starts_with("MDSKS036-13") && first.1, "{selection}");
    assert!(!last.1, "{selection}");
    for (name, ok) in &found {
        let expected = !name.starts_with("small") && !name.ends_with("12:1");
        assert_eq!(*ok, expected, "{name}\n{selection}");
    }
    let oks: Vec<bool> = found.iter().map(|(_, ok)| *ok).collect();
    assert!(oks.is_sorted_by(|one, other| one >= other), "{selection}");
    // A candidate is what its own machine file would be: that of the thesis in its own words.
    let own = selection
        .candidates
        .iter()
        .find(|c| c.motor == "MDSKS036-13" && c.gear.to_string() == "7:1");
    let same = machine.with_devices(&machine.motor, &machine.drive, machine.gear());
    assert_eq!(same, machine);
    // C0011 follows the speed that is needed, so that it is never the tightest.
    assert!(own.unwrap().least_margin > 0.0 && selection.ok());
    assert_eq!(
        "7:0".parse::<film_feed::machine_file::Gear>().unwrap_err(),
        "a gear is written as 7 or 7:2, both from 1 to 65535, got 7:0"
    );
}
