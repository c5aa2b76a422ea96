//! Cost of one tick (125 µs) of the running axis. Budget: 120 ns.
//!
//! Run with `cargo bench -p lenze9300-model --bench drive_tick`.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lenze9300_model::{Axis, AxisCommand, AxisParams};

fn drive_tick(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("drive_tick");
    group.throughput(Throughput::Elements(1));
    for (name, command) in [
        (
            "running",
            AxisCommand::Speed {
                omega_ref: 200.0,
                torque_ff: 0.0,
            },
        ),
        (
            "standing",
            AxisCommand::Speed {
                omega_ref: 0.0,
                torque_ff: 0.0,
            },
        ),
        ("inhibited", AxisCommand::Inhibited),
    ] {
        let mut axis = Axis::new(&AxisParams::default());
        for _ in 0..8000 {
            axis.tick(command);
        }
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(axis.tick(black_box(command))))
        });
    }
    group.finish();
}

criterion_group!(benches, drive_tick);
criterion_main!(benches);
