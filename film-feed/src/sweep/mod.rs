//! Many machines at once: what happens to the feeds when speeds, inertias, friction, gains, delays and the rest are not what they are.
//!
//! A SPEC.toml names a machine, what to vary, and how. Each point is a whole machine of its own, the real chain of block, bus, drive
//! and film ([`crate::rig`]), which runs some feeds; its row in the result tells how they went.
//!
//! ```toml
//! machine = "machine.toml"      # base, beside this file; the axis of the thesis if it is not given
//! layout = "grid"               # or "random", "list"
//! feeds = 10                    # a machine, 1…1000 (10)
//! seed = 1                      # 0…4294967295 (1)
//!
//! [set]                         # what differs from the machine, the same at all points
//! feed.mode = "mark"
//!
//! [[parameter]]                 # what is varied; the last one fastest
//! name = "feed.mark_speed_mm_s"
//! from = 120
//! to = 600
//! steps = 9
//!
//! [[parameter]]
//! name = "codes.C0070"
//! values = [3, 5, 8]
//! ```
//!
//! | key | meaning |
//! |---|---|
//! | `machine` | a MACHINE.toml ([`crate::machine_file`]), its path seen from the SPEC |
//! | `catalogue` | a file with further motors and drives ([`crate::catalogue`]), likewise |
//! | `layout` | `"grid"`: every value with every other; `"random"`: `count` points of a scrambled Sobol sequence (Burley 2020); `"list"`: the first values together, then the second ones |
//! | `count` | points of a random layout, 1…65 536 |
//! | `feeds` | feeds of a machine |
//! | `seed` | of the random layout, and of the machines |
//! | `seeds` | `"each"`: every machine has its own marks, noise and times; `"same"`: all have those of `seed`, so that only the parameters differ (`"each"`) |
//! | `[set]` | parameters that are the same for all machines |
//! | `[[parameter]]` | `name`, and `values`, or `from` and `to`, with `steps` in a grid, `scale = "linear"` or `"log"` (`"linear"`), and `step`, of which values are whole multiples (none; that of the code for codes) |
//!
//! Parameters have dotted names: every key of a MACHINE.toml with its table in front (`mechanics.friction_nm`, `bus.baud`,
//! `marks.reader_delay_us`, `codes.C0070`), and those of [`run_parameters`], which a machine file does not have.
//!
//! What comes out, and in which columns, is in [`ResultTable`]; the result depends on SPEC and machine alone, not on threads or shards.

mod layout;
mod machine;
mod outcome;
mod parameter;
mod plot;
mod quantile;
mod result;
mod spec;
mod summary;

use std::io;
use std::sync::Mutex;

use rayon::prelude::*;
use thiserror::Error;

pub use machine::{ImpossiblePoint, SweptMachine};
pub use outcome::{OUTPUTS, Outcome, Output};
pub use parameter::{Setting, run_parameters};
pub use plot::{SweepPlotError, draw_svg};
pub use quantile::quantile;
pub use result::{MergeError, ResultTable, Row, TableError, merge};
pub use spec::SweepSpec;
pub use summary::{Influence, Spread, Summary};

/// Why a sweep stopped.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A point is no machine.
    #[error(transparent)]
    Impossible(#[from] ImpossiblePoint),
    /// A row could not be kept.
    #[error("a result cannot be written: {0}")]
    Keeping(#[from] io::Error),
    /// There are no threads.
    #[error("the threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// One part of a sweep that is shared out: part `part` of `of`, counted from 1.
///
/// The points go round like cards, so that every part gets of the dear ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which part, 1 up to `of`.
    pub part: u64,
    /// How many parts there are.
    pub of: u64,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { part: 1, of: 1 };

    /// Whether point number `point`, from 1, belongs to this part; none does to part 0, or to parts of 0.
    pub fn has(self, point: u64) -> bool {
        match (point.checked_sub(1), self.part.checked_sub(1)) {
            (Some(place), Some(part)) => place.checked_rem(self.of) == Some(part),
            _ => false,
        }
    }
}

/// Points whose values make no machine, one of each kind of mistake.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{} of {tried} points cannot run: {}", impossible, first.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct Impossible {
    /// The first point of each kind of mistake.
    pub first: Vec<ImpossiblePoint>,
    /// How many points are impossible.
    pub impossible: usize,
    /// How many there are.
    pub tried: usize,
}

/// Tries whether every one of these points, numbered from 1, is a machine that can run; with all processors.
///
/// # Errors
/// [`Impossible`], each kind of mistake once.
pub fn check(spec: &SweepSpec, points: &[u64]) -> Result<(), Impossible> {
    let all: Vec<ImpossiblePoint> = points
        .par_iter()
        .filter_map(|point| spec.machine(*point).err())
        .collect();
    if all.is_empty() {
        return Ok(());
    }
    let mut first: Vec<ImpossiblePoint> = Vec::new();
    for point in &all {
        if !first.iter().any(|known| known.kind() == point.kind()) {
            first.push(point.clone());
        }
    }
    Err(Impossible {
        first,
        impossible: all.len(),
        tried: points.len(),
    })
}

/// Runs these points, numbered from 1, on `threads` threads, 0 for one a processor. `keep` gets each row as it is done, in any order.
///
/// # Errors
/// [`SweepError`]; rows that were kept before stay.
pub fn run(
    spec: &SweepSpec,
    points: &[u64],
    threads: usize,
    keep: impl FnMut(Row) -> io::Result<()> + Send,
) -> Result<(), SweepError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let keep = Mutex::new(keep);
    pool.install(|| {
        points.par_iter().with_max_len(1).try_for_each(|point| {
            let row = spec.machine(*point)?.run()?;
            // A panic in another thread ends the sweep anyway.
            let mut keep = keep.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            (*keep)(row)?;
            Ok(())
        })
    })
}
