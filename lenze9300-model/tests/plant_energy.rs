//! Energy: what the mains give is found again in heat, work and storage.

use drivecom::AifControl;
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::plant::{BrakeModule, Coupling, EnergyBalance, Mains};
use lenze9300_model::{Axis, AxisCommand, AxisParams};

/// The bound of the contract for a run.
const CLOSES_TO: f64 = 1e-9;

/// So many feeds of 1200 mm with a load and a short loss of the mains between them.
fn feeds(config: DriveConfig, feeds: u32) -> EnergyBalance {
    let ticks_per_ms = config.axis.ticks_per_position_period();
    let mut drive = Drive::new(config);
    for (code, subcode, value) in [(1301, 1, 1200_0000), (1302, 1, 100_0000), (1303, 1, 100_0000)] {
        drive
            .write_code(code, subcode, value)
            .expect("a code of the traversing program");
    }
    for ms in 0..2000 * feeds {
        let word = AifControl(0);
        drive.set_aif(if ms < 150 {
            word.with_controller_inhibit(true)
        } else {
            word.with_program_start(ms % 2000 >= 200)
        });
        drive.set_load_torque(if ms > 5000 { 0.2 } else { 0.0 });
        drive.set_mains(if (8300..8310).contains(&ms) {
            Mains::Off
        } else {
            Mains::On
        });
        for _ in 0..ticks_per_ms {
            drive.tick();
        }
    }
    assert!(
        drive.axis().sample().position > 3_000_000 * i64::from(feeds - 1),
        "the feeds were made"
    );
    drive.axis().energy()
}

#[test]
fn the_balance_of_feeds_closes() {
    let balance = feeds(DriveConfig::default(), 6);
    assert!(balance.copper_j > 1.0 && balance.friction_j > 1.0 && balance.regenerated_j > 0.1);
    assert!(
        balance.relative_residual().abs() < CLOSES_TO,
        "{:e}",
        balance.relative_residual()
    );
}

#[test]
fn the_balance_of_an_elastic_axis_with_play_closes() {
    let mut config = DriveConfig::default();
    config.axis.mechanics.coupling = Some(Coupling::at_gear_output(900.0, 6.0, 7.0));
    let balance = feeds(config, 6);
    assert!(balance.coupling_loss_j > 0.0);
    assert!(
        balance.relative_residual().abs() < CLOSES_TO,
        "{:e}",
        balance.relative_residual()
    );
}

/// A mass of 20e-4 kg m² thrown to and fro at the torque limit: what is brought to a stop goes through the brake resistor.
fn thrown_to_and_fro(tick_ns: u64) -> EnergyBalance {
    let mut params = AxisParams {
        tick_ns,
        ..AxisParams::default()
    };
    params.codes.c0022_i_max_a = 3.75;
    params.mechanics.j_load_kg_m2 = 20e-4;
    params.dc_link.capacitance_f = 40e-6;
    params.dc_link.brake = Some(BrakeModule {
        resistance_ohm: 470.0,
        on_v: 600.0,
        off_v: 580.0,
    });
    let mut axis = Axis::new(&params);
    let ticks = 4_000_000_000 / tick_ns;
    for tick in 0..ticks {
        let omega_ref = if (8 * tick / ticks).is_multiple_of(2) {
            300.0
        } else {
            -300.0
        };
        axis.tick(AxisCommand::Speed {
            omega_ref,
            torque_ff: 0.0,
        });
    }
    axis.energy()
}

#[test]
fn the_balance_of_braking_over_a_resistor_closes_with_the_fourth_power_of_the_step() {
    // Steps of the set-value are the hardest for the solver: the residual is its error, and RK4 errs with h⁴.
    let (coarse, fine) = (thrown_to_and_fro(125_000), thrown_to_and_fro(31_250));
    for balance in [&coarse, &fine] {
        assert!(balance.brake_j > 1.0, "{balance:?}");
    }
    let (coarse, fine) = (coarse.relative_residual().abs(), fine.relative_residual().abs());
    println!("{coarse:e} {fine:e}");
    assert!(coarse < 1e-6 && fine < CLOSES_TO, "{coarse:e} {fine:e}");
    assert!(fine < coarse / 64.0, "{coarse:e} {fine:e}");
}

#[test]
fn what_a_rigid_shaft_gets_and_gives_are_newton_s_and_ohm_s() {
    // A load of 0.3 Nm over one turn at constant speed: 2π · 0.3 J of work, and 2π · 0.05 J of friction; 3 R I² of heat for the
    // current of 0.35 Nm (k_T = 0.778 Nm/A, R = 19.8 Ω: film-feed specification 5).
    let mut axis = Axis::new(&AxisParams::default());
    axis.set_load_torque(0.3);
    let command = AxisCommand::Speed {
        omega_ref: 100.0,
        torque_ff: 0.0,
    };
    for _ in 0..16_000 {
        axis.tick(command);
    }
    let (before, angle) = (axis.energy(), axis.sample().angle);
    for _ in 0..8000 {
        axis.tick(command);
    }
    let after = axis.energy();
    let turned_rad = axis.sample().angle.offset_from(angle) / 65_536.0 * std::f64::consts::TAU;
    let near = |got: f64, expected: f64, share: f64| {
        assert!((got - expected).abs() < share * expected, "{got} {expected}");
    };
    near(turned_rad, 100.0, 1e-3);
    near(after.load_j - before.load_j, 0.3 * turned_rad, 1e-9);
    near(after.friction_j - before.friction_j, 0.05 * turned_rad, 1e-9);
    let current_a = 0.35 / (0.70 / 0.90);
    near(
        after.copper_j - before.copper_j,
        3.0 * 19.8 * current_a * current_a,
        1e-3,
    );
}
