//! Runs a drive through feeds, a batch of axes and the step responses, and prints what came of it as bits.
//!
//! `cargo run --release -p lenze9300-model --example same_bits`: six lines, the same on every x86-64, whatever `target-cpu` it was built for.
//! `.ci/run` compares two builds.

use std::hash::{DefaultHasher, Hash, Hasher};

use drivecom::AifControl;
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::noise;
use lenze9300_model::plant::Mains;
use lenze9300_model::response::{LoopKind, StepResponse};
use lenze9300_model::signal::Signal;
use lenze9300_model::{AxisBatch, AxisCommand, AxisParams};

fn main() {
    for tick_ns in [125_000, 62_500] {
        let mut config = DriveConfig::default();
        config.axis.tick_ns = tick_ns;
        println!("drive, tick {tick_ns} ns: {}", drive(config));
    }
    println!("batch: {}", batch());
    for which in [LoopKind::Current, LoopKind::Speed, LoopKind::Position] {
        println!("step, {which:?}: {}", step(which));
    }
}

/// Ten seconds with feeds, a load, a dip of the mains; every signal once a millisecond.
fn drive(config: DriveConfig) -> String {
    let ticks_per_ms = config.axis.ticks_per_position_period();
    let mut drive = Drive::new(config);
    for (code, subcode, value) in [(1301, 1, 1200_0000), (1302, 1, 100_0000), (1303, 1, 100_0000)] {
        drive
            .write_code(code, subcode, value)
            .unwrap_or_else(|error| panic!("C{code}/{subcode}: {error}"));
    }
    let mut digest = DefaultHasher::new();
    for ms in 0..10_000_u32 {
        let word = AifControl(0);
        drive.set_aif(if ms < 150 {
            word.with_controller_inhibit(true)
        } else {
            word.with_program_start(ms % 2000 >= 200)
        });
        drive.set_load_torque(if ms > 5000 { 0.2 } else { 0.0 });
        drive.set_mains(if (8300..8320).contains(&ms) {
            Mains::Off
        } else {
            Mains::On
        });
        for _ in 0..ticks_per_ms {
            drive.tick();
        }
        for signal in Signal::ALL {
            signal.read(&drive).to_bits().hash(&mut digest);
        }
    }
    format!(
        "position {} inc, digest {:016x}",
        drive.axis().sample().position,
        digest.finish()
    )
}

/// Thirty-two axes with random speeds, some beyond the torque limit, for a second.
fn batch() -> String {
    let mut axes = AxisBatch::new(&[AxisParams::default(); 32]).unwrap_or_else(|error| panic!("{error}"));
    let mut digest = DefaultHasher::new();
    for ms in 0..1000 {
        for axis in 0..axes.len() {
            axes.set_command(
                axis,
                AxisCommand::Speed {
                    omega_ref: 300.0 * noise::symmetric(1, axis as u64, ms / 100),
                    torque_ff: 0.0,
                },
            );
        }
        for _ in 0..8 {
            axes.tick();
        }
        for axis in 0..axes.len() {
            let sample = axes.sample(axis);
            for value in [sample.omega_true, sample.i_q, sample.u_dc, sample.angle.fraction()] {
                value.to_bits().hash(&mut digest);
            }
        }
    }
    format!(
        "position of the last {} inc, digest {:016x}",
        axes.position(31),
        digest.finish()
    )
}

fn step(which: LoopKind) -> String {
    let response = StepResponse::measure(&AxisParams::default(), which);
    let mut digest = DefaultHasher::new();
    for point in response.points() {
        format!("{point:?}").hash(&mut digest);
    }
    format!(
        "overshoot {:?} %, digest {:016x}",
        response.overshoot_percent(),
        digest.finish()
    )
}
