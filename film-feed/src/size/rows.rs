//! The rows of a sizing, group by group.

use std::f64::consts::{SQRT_2, TAU};

use lenze9300_model::code::table::number::C0011;
use lenze9300_model::plant::ThermalParams;

use super::cycle::{LoadCycle, Phase, Point};
use super::limits::{TorqueLimits, peak_current_a, rated_current_a};
use super::number;
use super::row::{Limit, Row};
use crate::machine_file::MachineFile;

/// All rows, and whether braking needs a resistor.
pub(super) fn rows(machine: &MachineFile, cycle: &LoadCycle) -> (Vec<Row>, bool) {
    let mut rows = gear(machine, cycle);
    rows.extend(torque(machine, cycle));
    rows.extend(current(machine, cycle));
    rows.extend(power(machine, cycle));
    let (braking, resistor_needed) = braking(machine, cycle);
    rows.extend(braking);
    rows.extend(heat(machine, cycle));
    rows.extend(grip(machine));
    rows.push(feedback(machine));
    rows.extend(time_and_mains(machine));
    (rows, resistor_needed)
}

/// Makes the rows of one group.
struct Group(&'static str);

impl Group {
    fn row(
        &self,
        id: &'static str,
        name: impl Into<String>,
        (value, unit): (f64, &'static str),
        limit: Limit,
        formula: impl Into<String>,
    ) -> Row {
        Row {
            group: self.0,
            id,
            name: name.into(),
            value,
            unit,
            limit,
            formula: formula.into(),
        }
    }
}

/// Thesis 5.6, formulas VII and VIII.
fn gear(machine: &MachineFile, cycle: &LoadCycle) -> Vec<Row> {
    let group = Group("gear");
    let mechanics = &machine.mechanics;
    let ratio = mechanics.gear_ratio();
    let j_motor = machine.motor.rotor_inertia_kg_m2 + mechanics.gear_inertia_kg_m2;
    let optimum = (mechanics.load_inertia_kg_m2 / j_motor).sqrt();
    let reduced = mechanics.load_inertia_kg_m2 / (ratio * ratio);
    let rpm = cycle.peak(|point| point.rpm.abs());
    let n_max = machine.codes.number(C0011, 0);
    vec![
        group.row(
            "gear_optimum",
            "optimum gear ratio",
            (optimum, ""),
            Limit::None,
            format!(
                "√(J_load/J_motor) = √({} / {})",
                number(mechanics.load_inertia_kg_m2),
                number(j_motor)
            ),
        ),
        group.row(
            "gear_torque",
            "torque to accelerate, over that at the optimum",
            (0.5 * (ratio / optimum + optimum / ratio), ""),
            Limit::None,
            format!("½·(i/i_opt + i_opt/i), i = {}", number(ratio)),
        ),
        group.row(
            "reduced_inertia",
            "load inertia at the motor",
            (reduced, "kg m²"),
            Limit::None,
            "J_load/i²",
        ),
        group.row(
            "inertia_ratio",
            "load inertia over motor inertia",
            (reduced / j_motor, ""),
            Limit::None,
            "J_load/(i²·J_motor)",
        ),
        group.row(
            "motor_speed",
            "greatest motor speed, against C0011",
            (rpm, "1/min"),
            Limit::AtMost(n_max),
            "60·v·i/(π·d)",
        ),
        group.row(
            "usual_speed",
            "greatest motor speed, against the usual range",
            (rpm, "1/min"),
            Limit::Within(USUAL_RPM.0, USUAL_RPM.1),
            "60·v·i/(π·d); range: thesis 5.6",
        ),
        group.row(
            "output_frequency",
            "output frequency, against the drive",
            (f64::from(machine.motor.pole_pairs()) * rpm / 60.0, "Hz"),
            Limit::AtMost(machine.drive.output_max_hz),
            "p·n/60",
        ),
    ]
}

/// Thesis 5.6, fig. 42 and 43.
fn torque(machine: &MachineFile, cycle: &LoadCycle) -> Vec<Row> {
    let group = Group("torque");
    let limits = TorqueLimits::of(machine);
    let motor = &machine.motor;
    let mut rows: Vec<Row> = cycle
        .phases
        .iter()
        .map(|phase| operating_point(&group, &limits, phase))
        .collect();
    let mean_rpm = cycle.mean(|point| point.rpm.abs());
    let rms_nm = cycle.rms(|point| point.torque_nm);
    rows.extend([
        group.row(
            "voltage",
            "greatest motor voltage, against the lowest mains",
            (cycle.peak(|point| motor.voltage_v(point.rpm, point.torque_nm)), "V"),
            Limit::AtMost(limits.available_v()),
            "√(3/2)·|ω_el·ψ + R·î, ω_el·L·î|; U_link/√3 is U_mains line-line",
        ),
        group.row(
            "mean_speed",
            "mean speed, against the rated",
            (mean_rpm, "1/min"),
            Limit::AtMost(motor.rated_speed_rpm),
            "Σ|n|·t/T",
        ),
        group.row(
            "rms_torque",
            "RMS torque, against S1 at the mean speed",
            (rms_nm, "Nm"),
            Limit::AtMost(motor.s1_torque_nm(mean_rpm)),
            "√(Σ M²·t/T); S1 in straight lines between its points, from M_0 to M_N without",
        ),
    ]);
    rows
}

/// The corner of a phase that uses most of what is there at its speed.
fn operating_point(group: &Group, limits: &TorqueLimits<'_>, phase: &Phase) -> Row {
    // Braking torque is not bounded by the voltage: R·I and the back EMF work against each other.
    let available = |point: Point| {
        if point.torque_nm >= 0.0 {
            limits.peak_nm(point.rpm)
        } else {
            limits.current_limit_nm()
        }
    };
    let use_of = |point: Point| point.torque_nm.abs() / available(point);
    let (begin, end) = (phase.at(0.0), phase.at(1.0));
    let point = if use_of(begin) > use_of(end) { begin } else { end };
    let (id, formula) = match phase.name {
        "acceleration" => (
            "torque_acceleration",
            "J·α + M_friction + k·ω + (J_load/i²·α + F·r/i)/η",
        ),
        "travel" => ("torque_travel", "M_friction + k·ω + F·r/(i·η)"),
        "slowing down" => ("torque_slowing_down", "as when accelerating, α < 0"),
        "search" => ("torque_search", "M_friction + k·ω + F·r/(i·η)"),
        "braking" => ("torque_braking", "as when accelerating, α < 0"),
        _ => ("torque_rest", "F·r/i, held without help of the friction"),
    };
    group.row(
        id,
        format!("torque in {} at {} 1/min", phase.name, number(point.rpm)),
        (point.torque_nm.abs(), "Nm"),
        Limit::AtMost(available(point)),
        formula,
    )
}

/// Thesis 5.6, formula IX and fig. 44.
fn current(machine: &MachineFile, cycle: &LoadCycle) -> Vec<Row> {
    let group = Group("current");
    let (motor, drive) = (&machine.motor, &machine.drive);
    let amperes = |point: Point| motor.current_a(point.torque_nm);
    let (peak_a, rms_a) = (cycle.peak(amperes), cycle.rms(amperes));
    let rated_a = rated_current_a(machine);
    let above_rated_s: f64 = cycle
        .phases
        .iter()
        .filter(|phase| amperes(phase.at(0.0)).max(amperes(phase.at(1.0))) > rated_a)
        .map(|phase| phase.duration_s)
        // Not `sum`: that of nothing is −0.
        .fold(0.0, |sum, duration_s| sum + duration_s);
    vec![
        group.row(
            "peak_current_motor",
            "greatest current, against the motor",
            (peak_a, "A"),
            Limit::AtMost(motor.peak_current_a),
            format!("M/k_T, k_T = M_0/I_0 = {} Nm/A", number(motor.torque_constant_nm_a())),
        ),
        group.row(
            "peak_current_drive",
            "greatest current, against the drive",
            (peak_a, "A"),
            Limit::AtMost(peak_current_a(machine)),
            "M/k_T",
        ),
        group.row(
            "peak_current_limit",
            "greatest current, against C0022",
            (peak_a, "A"),
            Limit::AtMost(machine.current_limit_a),
            "M/k_T",
        ),
        group.row(
            "rms_current_motor",
            "RMS current, against the motor's rated",
            (rms_a, "A"),
            Limit::AtMost(motor.rated_current_a),
            "√(Σ I²·t/T)",
        ),
        group.row(
            "rms_current_drive",
            "RMS current, against the drive's rated",
            (rms_a, "A"),
            Limit::AtMost(rated_a),
            "√(Σ I²·t/T)",
        ),
        group.row(
            "overload_time",
            "time above the drive's rated current in a cycle",
            (above_rated_s, "s"),
            Limit::AtMost(drive.peak_time_s),
            "Σt of the phases with I > I_N",
        ),
    ]
}

fn power(machine: &MachineFile, cycle: &LoadCycle) -> Vec<Row> {
    let group = Group("power");
    let motor = &machine.motor;
    vec![
        group.row(
            "mean_shaft_power",
            "mean shaft power, against the motor's rated",
            (cycle.mean(|point| point.shaft_w().max(0.0)), "W"),
            Limit::AtMost(motor.rated_power_w),
            "Σ M·ω·t/T where the motor drives",
        ),
        group.row(
            "peak_shaft_power",
            "greatest shaft power",
            (cycle.peak(|point| point.shaft_w()), "W"),
            Limit::None,
            "M·ω",
        ),
        group.row(
            "peak_electrical_power",
            "greatest power from the link",
            (cycle.peak(|point| point.electrical_w(motor)), "W"),
            Limit::None,
            "M·ω + 3·R·I²",
        ),
        group.row(
            "mean_mains_power",
            "mean power from the link, with the drive's own supply",
            (
                cycle.mean(|point| point.electrical_w(motor).max(0.0)) + machine.drive.standby_w,
                "W",
            ),
            Limit::None,
            "Σ(M·ω + 3·R·I²)·t/T where positive, + P_standby",
        ),
    ]
}

/// Thesis 5.6, "Bremswiderstand".
fn braking(machine: &MachineFile, cycle: &LoadCycle) -> (Vec<Row>, bool) {
    let group = Group("braking");
    let (motor, drive, mechanics) = (&machine.motor, &machine.drive, &machine.mechanics);
    let j_total = motor.rotor_inertia_kg_m2 + mechanics.reduced_inertia_kg_m2();
    let omega = cycle.peak(|point| point.rpm) * TAU / 60.0;
    let at_shaft_j = cycle.integral(|point| (-point.shaft_w()).max(0.0));
    let back_w = |point: Point| (-point.electrical_w(motor)).max(0.0);
    let back_j = cycle.integral(back_w);
    let copper_j = cycle.integral(|point| {
        if point.shaft_w() < 0.0 {
            motor.copper_loss_w(point.torque_nm)
        } else {
            0.0
        }
    });
    let piled_j = cycle.piled_up_j(|point| -point.electrical_w(motor));
    let capacitance_f = drive.link_capacitance_uf * 1e-6;
    let full_v = SQRT_2 * machine.mains.highest_v;
    let risen_v = (full_v * full_v + 2.0 * piled_j / capacitance_f).sqrt();
    let resistor_needed = risen_v > drive.link_overvoltage_v;
    let mut rows = vec![
        group.row(
            "kinetic_energy",
            "energy of motion",
            (0.5 * j_total * omega * omega, "J"),
            Limit::None,
            "½·(J_motor + J_load/i²)·ω²",
        ),
        group.row(
            "brake_energy_shaft",
            "energy back at the shaft in a cycle",
            (at_shaft_j, "J"),
            Limit::None,
            "∫−M·ω·dt; friction and gear have taken theirs",
        ),
        group.row(
            "brake_energy_copper",
            "of it, turned into heat in the motor's copper",
            (copper_j.min(at_shaft_j), "J"),
            Limit::None,
            "∫3·R·I²·dt while braking",
        ),
        group.row(
            "brake_energy_link",
            "energy back into the link in a cycle",
            (back_j, "J"),
            Limit::None,
            "∫−(M·ω + 3·R·I²)·dt where positive",
        ),
        group.row(
            "link_voltage",
            "link voltage after braking without resistor, against switching off",
            (risen_v, "V"),
            match machine.brake {
                Some(_) => Limit::None,
                None => Limit::AtMost(drive.link_overvoltage_v),
            },
            format!("√(2·U_mains² + 2·E/C), C = {} µF", number(drive.link_capacitance_uf)),
        ),
    ];
    if let Some(brake) = &machine.brake {
        rows.extend([
            group.row(
                "brake_on",
                "resistor switched on before the drive switches off",
                (brake.on_v, "V"),
                Limit::Within(full_v, drive.link_overvoltage_v),
                "U_on from √2·U_mains to U_off",
            ),
            group.row(
                "brake_off",
                "resistor switched off above the mains",
                (brake.off_v, "V"),
                Limit::AtLeast(full_v),
                "below √2·U_mains the mains would feed it",
            ),
            group.row(
                "brake_mean_power",
                "mean power in the resistor",
                (
                    if risen_v > brake.on_v {
                        back_j / cycle.duration_s()
                    } else {
                        0.0
                    },
                    "W",
                ),
                Limit::AtMost(brake.rated_w),
                "E/T, all that comes back; 0 if the link does not reach U_on",
            ),
            group.row(
                "brake_peak_power",
                "greatest power into the resistor",
                (cycle.peak(back_w), "W"),
                Limit::AtMost(brake.peak_w.min(brake.on_v * brake.on_v / brake.resistance_ohm)),
                "−(M·ω + 3·R·I²), against its own limit and U_on²/R",
            ),
        ]);
    }
    (rows, resistor_needed)
}

/// Thesis 5.6, fig. 43; the temperatures as the drive model has them.
fn heat(machine: &MachineFile, cycle: &LoadCycle) -> Vec<Row> {
    let group = Group("heat");
    let (motor, drive) = (&machine.motor, &machine.drive);
    let amperes = |point: Point| motor.current_a(point.torque_nm);
    let (rms_a, mean_a) = (cycle.rms(amperes), cycle.mean(amperes));
    let s1_nm = motor.s1_torque_nm(cycle.mean(|point| point.rpm.abs()));
    let of_rated = rms_a / motor.standstill_current_a;
    let rated_a = rated_current_a(machine);
    let standby = ThermalParams::default().drive_standby_share;
    let sink_k = drive.heat_sink_rise_k * (standby + (1.0 - standby) * mean_a / drive.rated_current_a);
    vec![
        group.row(
            "motor_utilisation",
            "thermal utilisation of the motor",
            (100.0 * (cycle.rms(|point| point.torque_nm) / s1_nm).powi(2), "%"),
            Limit::AtMost(100.0),
            "(M_rms/M_S1)²",
        ),
        group.row(
            "winding_temperature",
            "winding temperature",
            (machine.ambient_c + motor.winding_rise_k * of_rated * of_rated, "°C"),
            Limit::AtMost(motor.winding_max_c),
            "ambient + ΔT_0·(I_rms/I_0)²",
        ),
        group.row(
            "drive_utilisation",
            "utilisation of the drive (I×t, C0064)",
            (100.0 * mean_a / (1.05 * rated_a), "%"),
            Limit::AtMost(100.0),
            "mean I/(1.05·I_N)",
        ),
        group.row(
            "heat_sink_temperature",
            "heat-sink temperature",
            (machine.ambient_c + sink_k, "°C"),
            Limit::AtMost(drive.heat_sink_max_c),
            "ambient + ΔT_N·(0.15 + 0.85·mean I/I_N)",
        ),
    ]
}

/// What the film takes before it slips; only with a roll.
fn grip(machine: &MachineFile) -> Option<Row> {
    let roll = machine.roll?;
    let (_, pull_n) = machine.pull_n(machine.feed.acceleration_mm_s2);
    Some(Group("film").row(
        "film_tension",
        "greatest tension of the film, against the grip of the roller",
        (pull_n, "N"),
        Limit::AtMost(roll.grip_n),
        "F_pull + M_brake/R + J_roll·a/R², full or all but empty",
    ))
}

/// Thesis 5.6, "Auswahl des Gebers".
fn feedback(machine: &MachineFile) -> Row {
    let bits = machine.positioning.resolver_bits;
    let steps = f64::from(1_u32 << bits.min(16));
    let per_turn_mm = machine.mechanics.feed_constant_mm() / machine.mechanics.gear_ratio();
    Group("feedback").row(
        "resolver_step",
        "step of the resolver, against the tolerance",
        (per_turn_mm / steps, "mm"),
        Limit::AtMost(machine.feed.tolerance_mm),
        format!("π·d/(i·2^{bits}); its accuracy: film-feed budget"),
    )
}

fn time_and_mains(machine: &MachineFile) -> Vec<Row> {
    let time = Group("time");
    let mains = Group("mains");
    let controls = &machine.controls;
    let reaction_s = 2e-3 * (controls.plc_cycle_ms + controls.dp_cycle_ms + MODULE_DELAY_MS);
    let drive = &machine.drive;
    let range = Limit::Within(drive.mains_min_v, drive.mains_max_v);
    vec![
        time.row(
            "motion",
            "time the film moves",
            (machine.motion_s(), "s"),
            Limit::None,
            "Σt of the motion",
        ),
        time.row(
            "cycle",
            "feed with PLC and bus, against the cycle",
            (machine.motion_s() + reaction_s, "s"),
            Limit::AtMost(machine.feed.cycle_s),
            "motion + 2·(T_PLC + T_DP + 3 ms in the module)",
        ),
        mains.row(
            "mains_low",
            "lowest mains, against the drive",
            (machine.mains.lowest_v, "V"),
            range,
            "line-line",
        ),
        mains.row(
            "mains_high",
            "highest mains, against the drive",
            (machine.mains.highest_v, "V"),
            range,
            "line-line",
        ),
    ]
}

/// Motor speeds into which a gear should bring the axis, 1/min (thesis 5.6).
const USUAL_RPM: (f64, f64) = (700.0, 6000.0);

/// Time of the bus module from the bus to the drive, and as long back, ms (9300 facts 1.6, assumed there).
const MODULE_DELAY_MS: f64 = 3.0;
