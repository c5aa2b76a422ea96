//! Axes worked together give the bits of axes worked one by one.

use lenze9300_model::control::Decoupling;
use lenze9300_model::noise;
use lenze9300_model::plant::BrakeModule;
use lenze9300_model::{Axis, AxisBatch, AxisCommand, AxisParams, AxisSample, BatchError};

/// All that is a number, as bits: equality of floats would let −0 and 0 pass for the same.
fn bits(sample: &AxisSample) -> [u64; 13] {
    [
        sample.position.cast_unsigned(),
        sample.omega_meas.to_bits(),
        sample.omega_filtered.to_bits(),
        sample.i_d.to_bits(),
        sample.i_q.to_bits(),
        sample.torque.to_bits(),
        sample.torque_ref.to_bits(),
        sample.voltage.d.to_bits(),
        sample.voltage.q.to_bits(),
        sample.u_dc.to_bits(),
        sample.omega_true.to_bits(),
        sample.angle.increments().cast_unsigned(),
        sample.angle.fraction().to_bits(),
    ]
}

/// Thirteen axes, no two alike, so that a group is not full; among them what the lanes do not work at all.
fn assorted(tick_ns: u64) -> Vec<AxisParams> {
    (0..13)
        .map(|n| {
            let mut params = AxisParams {
                tick_ns,
                ..AxisParams::default()
            };
            params.mechanics.j_load_kg_m2 *= 0.5 + 0.25 * f64::from(n);
            params.mechanics.coulomb_nm *= 0.3 * f64::from(n);
            match n {
                2 => params.feedback.resolver_bits = 11,
                3 => params.mechanics.viscous_nm_s = 1e-4,
                4 => params.codes.c0072_speed_td_s = 1e-3,
                5 => params.decoupling = Decoupling::Off,
                // Braking it raises the link to OU.
                6 => params.mechanics.j_load_kg_m2 = 20e-4,
                7 => {
                    params.mechanics.j_load_kg_m2 = 20e-4;
                    params.dc_link.brake = Some(BrakeModule {
                        resistance_ohm: 470.0,
                        on_v: 745.0,
                        off_v: 725.0,
                    });
                }
                8 => params.dc_link.mains_v_rms = 230.0,
                _ => {}
            }
            params
        })
        .collect()
}

/// Speeds to reach and ramps, stops, torques and inhibits, at moments of their own for every axis.
fn command(axis: usize, ms: u64) -> AxisCommand {
    let random = |counter| noise::symmetric(7, axis as u64, counter);
    let (act, since) = (ms / 50, ms % 50);
    match noise::below(7, axis as u64, 2 * act, 8) {
        0 => AxisCommand::Inhibited,
        1 => AxisCommand::Torque {
            torque_nm: random(2 * act + 1),
        },
        2 => AxisCommand::Speed {
            omega_ref: 0.0,
            torque_ff: 0.0,
        },
        3 => AxisCommand::Speed {
            omega_ref: 300.0 * random(2 * act + 1),
            torque_ff: 0.1,
        },
        _ => AxisCommand::Speed {
            omega_ref: 5.0 * random(2 * act + 1) * since as f64,
            torque_ff: 0.0,
        },
    }
}

#[test]
fn a_batch_gives_the_bits_of_single_axes_through_limits_stops_and_inhibits() {
    for tick_ns in [125_000, 62_500] {
        let params = assorted(tick_ns);
        let mut batch = AxisBatch::new(&params).expect("one tick for all");
        let mut single: Vec<_> = params.iter().map(Axis::new).collect();
        let (mut limited, mut inhibited, mut stopped) = (0, 0, 0);
        for ms in 0..3000 {
            for (n, axis) in single.iter_mut().enumerate() {
                let load_nm = if ms % 700 > 500 { 0.06 } else { 0.0 };
                batch.set_load_torque(n, load_nm);
                axis.set_load_torque(load_nm);
                batch.set_command(n, command(n, ms));
            }
            for tick in 0..1_000_000 / tick_ns {
                batch.tick();
                for (n, axis) in single.iter_mut().enumerate() {
                    let segment = axis.tick(command(n, ms));
                    let at = format!("axis {n}, {ms} ms, tick {tick} of {tick_ns} ns");
                    assert_eq!(batch.segment(n), segment, "{at}");
                    assert_eq!(bits(&batch.sample(n)), bits(axis.sample()), "{at}");
                    assert_eq!(batch.sample(n), *axis.sample(), "{at}");
                    assert_eq!(batch.position(n), axis.sample().position, "{at}");
                    limited += u32::from(axis.sample().torque_limited || axis.sample().voltage_limited);
                    inhibited += u32::from(axis.sample().pulses == lenze9300_model::Pulses::Inhibited);
                    stopped += u32::from(axis.sample().omega_true == 0.0);
                }
            }
        }
        // The trial went through what it is named after.
        assert!(
            limited > 1000 && inhibited > 1000 && stopped > 1000,
            "{limited} {inhibited} {stopped}"
        );
    }
}

#[test]
fn axes_of_different_ticks_do_not_go_together() {
    let params = [
        AxisParams::default(),
        AxisParams {
            tick_ns: 62_500,
            ..AxisParams::default()
        },
    ];
    assert_eq!(
        AxisBatch::new(&params).map(|batch| batch.len()),
        Err(BatchError::Tick {
            axis: 1,
            expected_ns: 125_000,
            got_ns: 62_500
        })
    );
    assert!(AxisBatch::new(&[]).is_ok_and(|batch| batch.is_empty()));
}
