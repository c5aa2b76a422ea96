//! The fault campaign: families of faults, each with the rule that must hold, tried in many cases under the safety
//! rules of [`crate::safety_monitor`].
//!
//! A case is determined by family, number and seed alone. Each ends with the cause gone, the operator's acknowledgement
//! and a feed that must land: nothing stays broken.

pub mod bench;
mod drive;
mod line;
mod marks;
mod plc;
pub mod soak;
mod stations;
pub mod trust;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// A family of faults.
#[derive(Debug, Clone, Copy)]
pub struct Family {
    /// Its name for the command line.
    pub name: &'static str,
    /// What is done.
    pub fault: &'static str,
    /// What must hold, besides the safety rules at every tick.
    pub rule: &'static str,
    /// Tries one case; tells why the rule does not hold.
    pub case: fn(&mut Draw) -> Result<(), String>,
}

/// All families, in the order of the table.
pub const FAMILIES: &[Family] = &[
    line::BIT_ERRORS,
    line::BURSTS,
    line::LOST,
    line::DOUBLED,
    line::LATE,
    line::BABBLING,
    line::CABLE,
    line::CABLE_WITH_REACTION,
    stations::MASTER_KILLED,
    stations::SLAVE_CYCLED,
    stations::SECOND_MASTER,
    plc::STOPPED,
    plc::REFUSED,
    drive::MAINS,
    drive::GUARD,
    drive::FOLLOWING,
    drive::ENCODER,
    marks::BOUNCING,
    marks::DEAD,
];

/// What a case draws its details from.
#[derive(Debug, Clone)]
pub struct Draw {
    rng: Pcg64Mcg,
    /// Number of the case in its family: what is gone through in order goes by it.
    pub number: usize,
}

impl Draw {
    /// For case `number` of a campaign.
    pub fn new(seed: u64, number: usize) -> Self {
        Draw {
            rng: Pcg64Mcg::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(number as u64)),
            number,
        }
    }

    /// Evenly from `from` up to and including `to`.
    pub fn between(&mut self, from: u64, to: u64) -> u64 {
        from + self.rng.next_u64() % (to - from + 1)
    }

    /// The element of `all` whose turn it is.
    pub fn in_turn<T: Copy>(&self, all: &[T]) -> T {
        all[self.number % all.len()]
    }
}

/// How a family did.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Outcome {
    /// Its name.
    pub name: &'static str,
    /// Cases tried.
    pub cases: usize,
    /// Those whose rule did not hold: number and reason.
    pub failures: Vec<(usize, String)>,
}

/// Tries `cases` cases of a family on all cores; `done` is called after each.
pub fn try_family(family: &Family, cases: usize, seed: u64, done: impl Fn() + Sync) -> Outcome {
    let failures = (0..cases)
        .into_par_iter()
        .filter_map(|number| {
            let held = (family.case)(&mut Draw::new(seed, number));
            done();
            held.err().map(|reason| (number, reason))
        })
        .collect();
    Outcome {
        name: family.name,
        cases,
        failures,
    }
}
