//! Sizing against runs of the model: what is drawn, what warms up, what comes back, what pulls.

use film_feed::machine_file::MachineFile;
use film_feed::operator::Operator;
use film_feed::rig::{Rig, TickView};
use film_feed::run::{Observation, simulated};
use film_feed::size::{Sizing, Supply};
use lenze9300_model::plant::Thermal;

use crate::{THESIS, assert_near, changed, machine, value};

#[test]
fn the_model_draws_what_was_sized() {
    for mode in ["length", "mark"] {
        let machine = changed(&[
            ("mode = \"length\"", &format!("mode = \"{mode}\"")),
            ("tolerance_mm = 50.0", "tolerance_mm = 0.0"),
        ]);
        let sizing = Sizing::of(&machine);
        let config = machine.rig_config(1).unwrap();
        let (report, samples) = simulated(&config, machine.feed_plan(2), Observation::Samples, || {}).unwrap();
        let feed = &report.feeds[1];
        assert_near("rpm", feed.peak_rpm.unwrap(), value(&sizing, "motor_speed"), 0.02);
        // The speed loop swings in when the axis breaks away; from 0.2 s on it has settled.
        let sized_nm = value(&sizing, "torque_acceleration");
        let peak_nm = feed.peak_torque_nm.unwrap();
        assert!(peak_nm > sized_nm && peak_nm < 1.5 * sized_nm, "{peak_nm} Nm");
        let start_s = samples.iter().find(|sample| sample.feed == 2).unwrap().time_s;
        let steady: Vec<f64> = samples
            .iter()
            .filter(|sample| (0.25..0.45).contains(&(sample.time_s - start_s)))
            .map(|sample| sample.torque_nm)
            .collect();
        // A sample a millisecond, always at the same place between two steps of the speed set-value: 1.4 % below the mean of all ticks.
        let mean_nm = steady.iter().sum::<f64>() / steady.len() as f64;
        assert_near("torque", mean_nm, sized_nm, 0.02);
        // The report's current counts from start to start, as the sizing's. At rest the loop may press against the static friction of
        // 0.05 Nm, which the sizing leaves out: to the mark it does.
        let (sized_a, found_a) = (value(&sizing, "rms_current_motor"), feed.rms_current_a.unwrap());
        let rest_share = 1.0 - machine.motion_s() / machine.feed.cycle_s;
        let pressing_a = (sized_a * sized_a + (0.05 * 0.9 / 0.7_f64).powi(2) * rest_share).sqrt();
        assert!(
            found_a > 0.99 * sized_a && found_a < 1.01 * pressing_a,
            "{sized_a} {found_a} {pressing_a}"
        );
    }
}

/// Currents and C0064 over 200 s of feeds; the temperatures from the lags of winding and heat sink themselves, which take an hour.
#[test]
fn the_model_warms_up_to_what_was_sized() {
    // A heavier load than the thesis', so that the share of friction pressed against at rest is small: 0.46 Nm while accelerating.
    let machine = changed(&[
        ("load_inertia_kg_m2 = 32.536e-4", "load_inertia_kg_m2 = 330e-4"),
        ("\"C0011\" = 3000", "C0011 = 3000\nC0070 = 38"),
    ]);
    let sizing = Sizing::of(&machine);
    assert!(sizing.ok(), "{sizing}");
    let mut rig = Rig::new(&machine.rig_config(1).unwrap()).unwrap();
    let mut operator = Operator::new(machine.feed_plan(70), 0);
    let (mut ticks, mut squares) = (0.0, 0.0);
    while rig.now_ns() < 205_000_000_000 {
        rig.advance_to_plc_cycle(&mut |view: &mut TickView<'_>| {
            let amperes = view.drive.axis().sample().current_rms();
            if view.now_ns > 10_000_000_000 {
                ticks += 1.0;
                squares += amperes * amperes;
            }
        });
        let (now_ns, outputs, rounds) = (rig.now_ns(), *rig.outputs(), rig.parameter_watch().rounds());
        operator.scan(now_ns, &outputs, rounds, rig.inputs_mut());
        rig.plc_cycle();
    }
    assert_near(
        "RMS current",
        f64::sqrt(squares / ticks),
        value(&sizing, "rms_current_motor"),
        0.03,
    );
    // C0064, mean of the last 180 s. At rest the loop presses against the static friction with up to 0.05 Nm, half of the time.
    let utilisation = rig.drive().codes().number(64, 0);
    let (sized, pressing) = (
        value(&sizing, "drive_utilisation"),
        100.0 * 0.5 * 0.05 * 0.9 / 0.7 / (1.05 * 2.5),
    );
    assert!(
        utilisation > sized && utilisation < sized + pressing,
        "{utilisation} {sized} {pressing}"
    );
    // The temperatures where the model's lags lead to with that current for ever.
    let mut thermal = Thermal::new(&machine.thermal_params(), &machine.motor.pmsm(), 1.0);
    for _ in 0..20_000 {
        thermal.advance(value(&sizing, "rms_current_motor"));
    }
    assert_near(
        "winding",
        thermal.motor_c(),
        value(&sizing, "winding_temperature"),
        1e-3,
    );
    let mut thermal = Thermal::new(&machine.thermal_params(), &machine.motor.pmsm(), 1.0);
    for _ in 0..20_000 {
        thermal.advance(value(&sizing, "drive_utilisation") / 100.0 * 1.05 * 2.5);
    }
    assert_near(
        "heat sink",
        thermal.heat_sink_c(),
        value(&sizing, "heat_sink_temperature"),
        1e-3,
    );
}

/// A heavy, slow axis whose braking the link cannot take.
fn heavy(brake: &str) -> MachineFile {
    let text = THESIS
        .replace("load_inertia_kg_m2 = 32.536e-4", "load_inertia_kg_m2 = 1952e-4")
        .replace("acceleration_mm_s2 = 2400.0", "acceleration_mm_s2 = 600.0")
        .replace("length_mm = 1200.0", "length_mm = 2000.0")
        .replace("repeat_mm = 1200.0", "repeat_mm = 2000.0")
        .replace("cycle_s = 3.0", "cycle_s = 6.0")
        // Tuned to the load: 44 times the inertia of the thesis' axis.
        .replace("\"C0011\" = 3000", "\"C0011\" = 3000\nC0070 = 220")
        .replace("[plc]", &format!("{brake}\n[plc]"));
    machine(&text)
}

const BRAKE: &str = "[brake]\nresistance_ohm = 180.0\nrated_w = 100.0\non_v = 725.0\noff_v = 710.0\n";

#[test]
fn a_resistor_that_is_needed_is_asked_for_and_a_run_without_it_switches_off() {
    let (without, with) = (heavy(""), heavy(BRAKE));
    // α = 0.6·7/0.0285 = 147.368, J = 0.25e-4 + 1952e-4/49 = 4.008673e-3: 0.590752 Nm. v = √(0.6·2.0) = 1.095445 m/s,
    // ω = 269.057 rad/s in 1.825742 s. Braking 0.540752 Nm: 132.813 J at the shaft. I = 0.695253 A, 28.7125 W of copper: it takes
    // more than the shaft gives below 28.7125/0.540752 = 53.097 rad/s. 0.540752·(269.057 − 53.097)²/(2·147.368) = 85.567 J.
    let sizing = Sizing::of(&without);
    assert_near("at the shaft", value(&sizing, "brake_energy_shaft"), 132.813, 1e-4);
    assert_near("into the link", value(&sizing, "brake_energy_link"), 85.567, 1e-3);
    // √(320 000 + 2·85.567/165e-6)
    assert_near("link", value(&sizing, "link_voltage"), 1164.91, 1e-3);
    assert!(sizing.resistor_needed);
    let failed: Vec<&str> = sizing.failures().map(|row| row.id).collect();
    assert_eq!(failed, ["link_voltage"]);

    let sizing = Sizing::of(&with);
    assert!(sizing.resistor_needed && sizing.ok(), "{sizing}");
    // 85.567 J in 6 s; at the begin of braking 0.540752·269.057 − 28.7125 W; 725²/180 = 2920 W.
    assert_near("mean", value(&sizing, "brake_mean_power"), 14.2612, 1e-3);
    assert_near("peak", value(&sizing, "brake_peak_power"), 116.781, 1e-4);
    let small = BRAKE.replace("rated_w = 100.0", "rated_w = 10.0");
    let failed: Vec<&str> = Sizing::of(&heavy(&small))
        .failures()
        .map(|row| row.id)
        .collect::<Vec<_>>();
    assert_eq!(failed, ["brake_mean_power"]);

    // The model agrees. Without the resistor the link passes 770 V, the message OU takes the torque away (9300 facts 4.8) and the film
    // runs on; with it, it lands.
    const MESSAGE: u16 = 0x0100;
    for (machine, switches_off) in [(&without, true), (&with, false)] {
        let mut plan = machine.feed_plan(1);
        plan.feed_limit_ns = 10_000_000_000;
        let config = machine.rig_config(1).unwrap();
        let (report, samples) = simulated(&config, plan, Observation::Samples, || {}).unwrap();
        let message = samples
            .iter()
            .any(|sample| sample.feed == 1 && sample.status_word & MESSAGE != 0);
        let highest_v = samples.iter().map(|sample| sample.dc_link_v).fold(0.0, f64::max);
        assert_eq!(message, switches_off, "{report}");
        assert_eq!(report.ok, !switches_off, "{report}");
        if !switches_off {
            // The energies of the one feed. By hand: 3·19.8·(0.640752² + 0.540752²)/0.777778²·1.825742 J of copper, 0.05·269.057·1.825742 J
            // of friction. The resistor gets what the link does not keep and the drive's own supply does not take.
            let energy = report.energy.as_ref().unwrap();
            assert_near("given back", energy.regenerated_j, 85.567, 0.01);
            assert_near("copper", energy.copper_j, 126.025, 0.02);
            assert_near("friction", energy.friction_j, 24.5614, 1e-3);
            assert!(energy.brake_j > 0.0 && energy.brake_j < 85.567, "{} J", energy.brake_j);
        }
        assert_eq!(highest_v > 745.0, switches_off, "{highest_v} V");
        assert!(highest_v > 724.0, "{highest_v} V");
    }
}

#[test]
fn a_roll_pulls_at_the_motor_as_by_hand_and_in_the_model() {
    let machine = changed(&[("[marks]", "[roll]\nbrake_nm = 1.0\n[marks]")]);
    // Full: J = ½·π·905·0.4·(0.08⁴ − 0.038⁴) + 0.001 = 0.0231051 kg m², 3.6102 kg at 80 mm; 12.5 N + 3.6102·2.4 = 21.164 N. All but
    // empty: 0.001/0.038² = 0.6925 kg; 26.316 N + 1.662 N = 27.978 N.
    let (least_n, most_n) = machine.pull_n(2400.0);
    assert_near("full", least_n, 21.164, 1e-3);
    assert_near("empty", most_n, 27.978, 1e-4);
    // Braking at 2.4 m/s² the brake alone holds the roll: 12.5 − 8.66 N.
    assert_near("braking", machine.pull_n(-2400.0).0, 3.836, 1e-3);
    let sizing = Sizing::of(&machine);
    // 0.1038779 + 27.978·0.0285/7
    assert_near("acceleration", value(&sizing, "torque_acceleration"), 0.217_788, 1e-4);
    assert_near("tension", value(&sizing, "film_tension"), 27.978, 1e-4);
    let slipping = Sizing::of(&changed(&[(
        "[marks]",
        "[roll]\nbrake_nm = 1.0\ngrip_n = 25.0\n[marks]",
    )]));
    assert_eq!(
        slipping.failures().map(|row| row.id).collect::<Vec<_>>(),
        ["film_tension"]
    );
    // In the model the roll is full.
    let (_, samples) = simulated(
        &machine.rig_config(1).unwrap(),
        machine.feed_plan(1),
        Observation::Samples,
        || {},
    )
    .unwrap();
    let start_s = samples.iter().find(|sample| sample.feed == 1).unwrap().time_s;
    let steady: Vec<f64> = samples
        .iter()
        .filter(|sample| (0.3..0.45).contains(&(sample.time_s - start_s)))
        .map(|sample| sample.torque_nm)
        .collect();
    let mean_nm = steady.iter().sum::<f64>() / steady.len() as f64;
    assert_near("in the model", mean_nm, 0.103_877_9 + 21.164 * 0.0285 / 7.0, 0.03);
}

/// Two axes of the thesis and the heavy one on one link, with the numbers of their own tests.
#[test]
fn several_axes_share_a_link_as_by_hand() {
    let thesis = machine(THESIS);
    assert_eq!(Supply::of(std::slice::from_ref(&thesis)), None);
    let row = |supply: &Supply, id: &str| supply.rows.iter().find(|row| row.id == id).unwrap().value;

    let two = Supply::of(&[thesis.clone(), thesis.clone()]).unwrap();
    // 20.2250 W are what each takes, 0.285002 J in 3 s what it gives back: 2·(20.2250 − 0.0950).
    assert_near("mean", row(&two, "mean_power"), 40.260, 1e-4);
    // 2·(31.6762 + 15)
    assert_near("peak", row(&two, "peak_power"), 93.3524, 1e-5);
    // Twice the energy in twice the capacitance.
    assert_near("link", row(&two, "supply_link_voltage"), 568.7307, 1e-6);
    assert!(two.ok);

    // 0.285002 + 85.567 J in 330 µF: √(320 000 + 2·85.852/330e-6).
    let mixed = Supply::of(&[thesis.clone(), heavy("")]).unwrap();
    assert_near("link", row(&mixed, "supply_link_voltage"), 916.71, 1e-3);
    assert!(!mixed.ok, "{mixed}");
    // The resistor of one serves both: 0.285002/3 + 14.2612 W against 100 W; at once 0.0038779·294.737 − 0.0015 + 116.781 W.
    let braked = Supply::of(&[thesis, heavy(BRAKE)]).unwrap();
    assert_near("mean", row(&braked, "supply_brake_mean"), 14.3562, 1e-3);
    assert_near("peak", row(&braked, "supply_brake_peak"), 117.922, 1e-4);
    assert!(braked.ok, "{braked}");
}
