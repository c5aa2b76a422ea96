//! Cost of the PLC block: one cycle against module images, and one line of replay.

#![allow(missing_docs, reason = "criterion_group! makes an undocumented public function")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use film_feed::{
    block::{FilmFeedBlock, Inputs, Periphery},
    replay::Replay,
};

/// A module whose parameter channel answers each request in the next cycle.
#[derive(Default)]
struct Module {
    request: [u8; 8],
    control: [u8; 8],
}

impl Periphery for Module {
    fn dprd_dat(&mut self, laddr: u16, record: &mut [u8; 8]) -> bool {
        *record = if laddr == 280 {
            [0x82, 0x37, 0, 3, 0, 0, 0, 7]
        } else {
            self.request
        };
        true
    }

    fn dpwr_dat(&mut self, laddr: u16, record: &[u8; 8]) -> bool {
        *(if laddr == 280 {
            &mut self.control
        } else {
            &mut self.request
        }) = *record;
        true
    }
}

fn block_cycle(criterion: &mut Criterion) {
    let mut block = FilmFeedBlock::new();
    let mut inputs = Inputs {
        pzd_adr: 280,
        enable: true,
        distance: 12_000,
        ..Inputs::default()
    };
    let mut module = Module::default();
    criterion.bench_function("block: one cycle", |bencher| {
        bencher.iter(|| {
            block.cycle(black_box(&mut inputs), &mut module);
            black_box(module.control)
        });
    });
}

fn replay_line(criterion: &mut Criterion) {
    let line =
        br#"{"c":7,"i":[0,0,0,0,null,0,0,1,10000,2500,10000,12000],"pi":"8237000300000007","qi":"31005b4b001b52f4"}"#;
    let mut replay = Replay::new();
    let mut answer = String::with_capacity(512);
    criterion.bench_function("replay: one line, parsed and answered", |bencher| {
        bencher.iter(|| {
            answer.clear();
            if let Ok(line) = Replay::parse(black_box(line)) {
                replay.step(&line, &mut answer);
            }
            black_box(answer.len())
        });
    });
}

criterion_group!(benches, block_cycle, replay_line);
criterion_main!(benches);
