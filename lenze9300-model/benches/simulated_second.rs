//! Cost of one simulated second: how many times faster than real the drive runs.
//!
//! `cargo bench -p lenze9300-model --bench simulated_second`; the throughput is simulated seconds (for a batch: seconds of all axes
//! together) in a second of one processor. Wanted (issue "The drive, true"): 1000 at a tick of 125 µs with a log at 1 kHz, 500
//! at 62.5 µs.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use drivecom::AifControl;
use lenze9300_model::device::{Drive, DriveConfig};
use lenze9300_model::scope::{Depth, Scope, ScopeConfig};
use lenze9300_model::signal::Signal;

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

criterion_group!(benches, drive);
criterion_main!(benches);
