//! Cost of one simulated second: how many times faster than real the drive runs.
//!
//! `cargo bench -p lenze9300-model --bench simulated_second`; the throughput is simulated seconds (for a batch: seconds of all axes
//! together) in a second of one processor. Wanted (issue "The drive, true"): 1000 at a tick of 125 µs with a log at 1 kHz, 500
//! at 62.5 µs, 5000 for the batch.

use core::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use drivecom::AifControl;
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::scope::{Depth, Scope, ScopeConfig};
use lenze9300_model::signal::Signal;
use lenze9300_model::units::INC_PER_REV;
use lenze9300_model::{Axis, AxisBatch, AxisCommand, AxisParams, TICKS_PER_MS};

/// Channels of the log: what fig. 73 shows, and what tells whether the feed is good.
const LOG: [Signal; 8] = [
    Signal::PosSetp,
    Signal::PosAct,
    Signal::FollowingError,
    Signal::PosNout,
    Signal::MctrlNact,
    Signal::MctrlMset2,
    Signal::Current,
    Signal::DcLink,
];

/// A drive with its film-feed program, enabled, with a program start every two seconds.
struct Feeding {
    drive: Drive,
    ticks_per_ms: u64,
    ms: u64,
}

impl Feeding {
    fn new(tick_ns: u64) -> Self {
        let mut config = DriveConfig::default();
        config.axis.tick_ns = tick_ns;
        let ticks_per_ms = config.axis.ticks_per_position_period();
        let mut feeding = Self {
            drive: Drive::new(config),
            ticks_per_ms,
            ms: 0,
        };
        for (code, subcode, value) in [(1301, 1, 1200_0000), (1302, 1, 100_0000), (1303, 1, 100_0000)] {
            feeding
                .drive
                .write_code(code, subcode, value)
                .unwrap_or_else(|error| panic!("C{code}/{subcode}: {error}"));
        }
        feeding
    }

    fn millisecond(&mut self) {
        // Inhibited over the self test, then a feed of 1.5 s every 2 s.
        let word = AifControl(0);
        self.drive.set_aif(if self.ms < 150 {
            word.with_controller_inhibit(true)
        } else {
            word.with_program_start(self.ms % 2000 >= 200)
        });
        for _ in 0..self.ticks_per_ms {
            black_box(self.drive.tick());
        }
        self.ms += 1;
    }
}

fn drive(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simulated_second");
    // One iteration is a feed with its pause.
    group.throughput(Throughput::Elements(2)).sample_size(20);
    for (name, tick_ns) in [("drive_125_us", 125_000), ("drive_62_5_us", 62_500)] {
        let mut feeding = Feeding::new(tick_ns);
        for _ in 0..4000 {
            feeding.millisecond();
        }
        let before = feeding.drive.axis().sample().position;
        for _ in 0..2000 {
            feeding.millisecond();
        }
        let way = feeding.drive.axis().sample().position - before;
        assert!(way.abs() > 3_000_000, "the drive of the bench makes no feed: {way} inc");
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut log = Scope::new(ScopeConfig {
                    depth: Depth::Unlimited,
                    ..ScopeConfig::original(LOG)
                })
                .expect("channels, interval and depth are given");
                for _ in 0..2000 {
                    feeding.millisecond();
                    log.sample(&feeding.drive);
                }
                log.recording().rows().count()
            });
        });
    }
    group.finish();
}

/// The thesis' trapezoid of 1200 mm (0.5 s up, 0.5 s constant, 0.5 s down) and half a second of pause, as speed and
/// position set-values of the position controller, closed form in milliseconds.
fn trapezoid(ms: u64) -> (f64, f64) {
    const TURNS: f64 = 1200.0 / 179.0708 * 7.0;
    let (t, peak) = ((ms % 2000) as f64 * 1e-3, TURNS * TAU);
    match ms % 2000 {
        0..500 => (2.0 * peak * t, peak * t * t),
        500..1000 => (peak, peak * (t - 0.25)),
        1000..1500 => (2.0 * peak * (1.5 - t), peak * (1.0 - (1.5 - t) * (1.5 - t))),
        _ => (0.0, peak),
    }
}

fn batch(criterion: &mut Criterion) {
    const AXES: usize = 32;
    let mut group = criterion.benchmark_group("simulated_second");
    group.throughput(Throughput::Elements(2 * AXES as u64)).sample_size(20);
    // Like a sweep: every axis has its own inertia and friction, and starts a little later than the one before.
    let params: Vec<_> = (0..AXES)
        .map(|n| {
            let mut params = AxisParams::default();
            params.mechanics.j_load_kg_m2 *= 0.8 + 0.0125 * n as f64;
            params.mechanics.coulomb_nm *= 0.5 + 0.03 * n as f64;
            params
        })
        .collect();
    let position = params[0].position_controller();
    let command = |n: usize, ms: u64, reference: i64, actual: i64| {
        let (omega, angle) = trapezoid(ms + n as u64);
        let setpoint = reference + (angle * INC_PER_REV as f64 / TAU) as i64;
        AxisCommand::Speed {
            omega_ref: position.compute_output(setpoint - actual, omega),
            torque_ff: 0.0,
        }
    };
    let way = (trapezoid(1999).1 * INC_PER_REV as f64 / TAU) as i64;

    let mut axes = AxisBatch::new(&params).expect("one tick for all");
    let mut references = [0_i64; AXES];
    let mut work = move |ms: u64| {
        for (n, reference) in references.iter_mut().enumerate() {
            if (ms + n as u64).is_multiple_of(2000) && ms > 0 {
                *reference += way;
            }
            axes.set_command(n, command(n, ms, *reference, axes.position(n)));
        }
        for _ in 0..TICKS_PER_MS {
            axes.tick();
        }
        axes.position(0) - references[0]
    };
    let mut ms = 0;
    while ms < 1990 {
        work(ms);
        ms += 1;
    }
    let error = work(ms) - way;
    assert!(error.abs() < 40, "the axes of the bench do not follow: {error} inc");
    ms += 1;
    group.bench_function("batch_of_32_axes_125_us", |bencher| {
        bencher.iter(|| {
            for _ in 0..2000 {
                black_box(work(ms));
                ms += 1;
            }
        });
    });

    let mut axes: Vec<_> = params.iter().map(Axis::new).collect();
    let mut references = [0_i64; AXES];
    let mut ms = 0;
    group.bench_function("the_same_axes_one_by_one", |bencher| {
        bencher.iter(|| {
            for _ in 0..2000 {
                for (n, axis) in axes.iter_mut().enumerate() {
                    if (ms + n as u64).is_multiple_of(2000) && ms > 0 {
                        references[n] += way;
                    }
                    let command = command(n, ms, references[n], axis.sample().position);
                    for _ in 0..TICKS_PER_MS {
                        black_box(axis.tick(command));
                    }
                }
                ms += 1;
            }
        });
    });
    group.finish();
}

criterion_group!(benches, drive, batch);
criterion_main!(benches);
