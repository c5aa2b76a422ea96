//! The soak: very many feeds with disturbances, memory flat, nothing lost.

use std::f64::consts::PI;

use dp_master::phy::Disturbance;
use film_feed::rig::RigConfig;
use rayon::prelude::*;
use serde::Serialize;

use super::Draw;
use super::bench::{Bench, FeedEnd, LENGTH_MM};
use crate::INC_PER_MM;

/// What a soak found.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Soak {
    /// Machines that ran, beside and after each other.
    pub rigs: usize,
    /// Feeds that were commanded.
    pub commanded: u64,
    /// Feeds that landed within ±0.01 mm.
    pub landed: u64,
    /// Feeds that did not finish and said so.
    pub reported: u64,
    /// Disturbances beyond the bit errors: cable, noise, guard, second master.
    pub disturbances: u64,
    /// Largest distance of a film from the sum of its feeds, mm.
    pub worst_sum_mm: f64,
    /// How much the resident memory of the process grew after the first feeds, KiB.
    pub grown_kib: u64,
    /// What went wrong.
    pub failures: Vec<String>,
}

/// How much the memory may grow, KiB: the first allocations of two threads, not one octet a feed.
pub const MEMORY_BOUND_KIB: u64 = 16 * 1024;

/// How far a film may stand from the sum of its feeds, mm: where it began and where it is now lie within ±0.01 mm of their places each,
/// for friction holds a film there (film-feed specification, section 1).
const SUM_BOUND_MM: f64 = 2.0 * film_feed::report::TOLERANCE_MM;

/// Disturbances come this often, in feeds.
const EVERY: u64 = 50;

impl Soak {
    /// Whether nothing was lost, every film stands where its feeds put it and memory stayed flat.
    pub fn ok(&self) -> bool {
        self.failures.is_empty() && self.commanded == self.landed + self.reported && self.grown_kib <= MEMORY_BOUND_KIB
    }

    fn join(mut self, other: Self) -> Self {
        self.rigs += other.rigs;
        self.commanded += other.commanded;
        self.landed += other.landed;
        self.reported += other.reported;
        self.disturbances += other.disturbances;
        self.worst_sum_mm = self.worst_sum_mm.max(other.worst_sum_mm);
        self.failures.extend(other.failures);
        self
    }
}

/// Runs `feeds` feeds on `rigs` machines; `done` is called after each feed.
pub fn soak(feeds: u64, rigs: u64, seed: u64, done: impl Fn() + Sync) -> Soak {
    // What the allocator keeps of a first machine does not count.
    let warm = run_rig(feeds.min(20), seed, 0, &|| {});
    let before = resident_kib();
    let total = (0..rigs)
        .into_par_iter()
        .map(|rig| {
            let share = feeds / rigs + u64::from(rig < feeds % rigs);
            run_rig(share, seed, rig as usize, &done)
        })
        .reduce(Soak::default, Soak::join);
    let mut total = Soak {
        grown_kib: resident_kib().saturating_sub(before),
        ..total
    };
    total.failures.extend(warm.failures);
    total
}

fn run_rig(feeds: u64, seed: u64, number: usize, done: &(impl Fn() + Sync)) -> Soak {
    let mut soak = Soak {
        rigs: 1,
        ..Soak::default()
    };
    if let Err(reason) = feed_on(&mut soak, feeds, &mut Draw::new(seed, number), done) {
        soak.failures
            .push(format!("rig {number}, feed {}: {reason}", soak.commanded));
    }
    soak
}

fn feed_on(soak: &mut Soak, feeds: u64, draw: &mut Draw, done: &impl Fn()) -> Result<(), String> {
    let mut bench = Bench::ready(&RigConfig::default())?;
    let errors = Disturbance::new(draw.between(0, u64::MAX - 1), 1e-6).map_err(|error| error.to_string())?;
    bench.rig.line_mut().set_disturbance(Some(errors));
    let feed_mm = film_of_a_feed_mm();
    let mut begin_mm = bench.rig.film().position_mm();
    let mut in_a_row = 0_u64;
    for _ in 0..feeds {
        soak.commanded += 1;
        let mut end = FeedEnd::NotFinished;
        if bench.start() {
            if soak.commanded.is_multiple_of(EVERY) {
                disturb(&mut bench, draw)?;
                soak.disturbances += 1;
            }
            end = bench.finish()?;
        }
        match end {
            FeedEnd::Landed => {
                soak.landed += 1;
                in_a_row += 1;
                let off_mm = bench.rig.film().position_mm() - begin_mm - in_a_row as f64 * feed_mm;
                soak.worst_sum_mm = soak.worst_sum_mm.max(off_mm.abs());
                if off_mm.abs() > SUM_BOUND_MM {
                    return Err(format!("{off_mm} mm off the sum of {in_a_row} feeds"));
                }
            }
            FeedEnd::NotFinished => {
                soak.reported += 1;
                bench.recover(3_000)?;
                begin_mm = bench.rig.film().position_mm();
                in_a_row = 0;
            }
        }
        bench.rules_held()?;
        done();
    }
    Ok(())
}

/// What a feed moves. The drive counts in whole increments (fact sheet, section 4.2: relative targets are rounded) and knows the roller by
/// C1204, 179.0708 mm; the film lies on the roller itself, π · 57 mm around, seven turns of the motor (film-feed specification, section 1).
fn film_of_a_feed_mm() -> f64 {
    (LENGTH_MM * INC_PER_MM).round() * (PI * 57.0) / (65_536.0 * 7.0)
}

fn disturb(bench: &mut Bench, draw: &mut Draw) -> Result<(), String> {
    bench.run_ms(draw.between(0, 400));
    match draw.between(0, 2) {
        0 => {
            bench.rig.disconnect_module();
            bench.run_ms(draw.between(1, 300));
            bench.rig.reconnect_module();
        }
        1 => {
            bench.rig.set_second_master(true).map_err(|error| error.to_string())?;
            bench.run_ms(draw.between(1, 100));
            bench.rig.set_second_master(false).map_err(|error| error.to_string())?;
        }
        _ => {
            bench.rig.drive_mut().set_terminal_28(false);
            bench.run_ms(draw.between(5, 300));
            bench.rig.drive_mut().set_terminal_28(true);
        }
    }
    Ok(())
}

/// Resident memory of this process, KiB; 0 where the system does not tell. Pages of 4 KiB (Linux on x86-64).
fn resident_kib() -> u64 {
    std::fs::read_to_string("/proc/self/statm")
        .ok()
        .and_then(|statm| statm.split_whitespace().nth(1)?.parse::<u64>().ok())
        .map_or(0, |pages| pages * 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Soak {
        Soak {
            commanded: 3,
            landed: 2,
            reported: 1,
            ..Soak::default()
        }
    }

    #[test]
    fn a_lost_feed_grown_memory_and_a_failure_are_no_success() {
        assert!(good().ok());
        assert!(!Soak { commanded: 4, ..good() }.ok());
        assert!(
            !Soak {
                grown_kib: MEMORY_BOUND_KIB + 1,
                ..good()
            }
            .ok()
        );
        assert!(
            !Soak {
                failures: vec!["off".to_string()],
                ..good()
            }
            .ok()
        );
    }

    /// 200 mm are 512 369.41 increments of 179.0708 mm / (7 · 65 536); 512 369 of π · 57 mm are 0.18 µm less, 0.02 µm of it by C1204.
    #[test]
    fn a_feed_moves_whole_increments_of_the_roller_itself() {
        assert!(
            (film_of_a_feed_mm() - 199.999_819_3).abs() < 1e-7,
            "{}",
            film_of_a_feed_mm()
        );
    }

    #[test]
    fn memory_is_read_where_there_is_proc() {
        assert_eq!(resident_kib() > 0, std::path::Path::new("/proc/self/statm").exists());
    }
}
