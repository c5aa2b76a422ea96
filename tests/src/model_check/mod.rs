//! Model checking: two protocols of the chain are driven through everything that can happen to them, not through a sample.
//!
//! ```text
//! start_up    dp_master's master and slave on one line      faults of the line, restarts    no request carried out twice,
//! handshake   film_feed's block and drivecom's server       late drive, lost images, …      no job lost, no dead end
//! ```
//!
//! The machines are the real ones: a state is a clone of them, a step calls them, and [`fingerprint`] tells whether a state was
//! met before. The [`search`] is breadth first and ends when there is nothing new; the paths it prints are the shortest.
//!
//! What is left out of a state, and what the surroundings may do, is said at [`StartUp`] and [`Handshake`]. What the original
//! block is documented to get wrong (film-feed specification, section 8.1) is named where it shows and counts as documented;
//! anything else is a violation.
//!
//! The crate `stateright` was looked at: its properties are "always", "sometimes" and "eventually", and the question here, whether
//! there is a way back from everywhere, needs the edges backwards, which it does not keep.

mod fingerprint;
mod handshake;
mod line;
mod report;
mod search;
mod start_up;

pub use fingerprint::{Canon, fingerprint};
pub use handshake::{DriveFlaw, Handshake, Trouble};
pub use report::{Case, Report, Verdict};
pub use search::{Cause, Finding, Limits, Model, Step, search};
pub use start_up::{SlaveFlaw, StartUp, WatchdogChoice};

/// A model by its name, ready to be searched. `found` hears how many states there are, now and then.
pub struct Named {
    /// What it is called on the command line.
    pub name: &'static str,
    /// What it is, in one line.
    pub about: &'static str,
    /// Searches it.
    pub run: fn(&mut dyn FnMut(usize)) -> Report,
}

fn run<M: Model>(model: &M, found: &mut dyn FnMut(usize)) -> Report {
    search(model, Limits::default(), found)
}

/// Every model, the small ones first.
pub const MODELS: [Named; 9] = [
    Named {
        name: "handshake-bus",
        about: "block and drive, images lost in both directions, a drive that takes its time or refuses, a new length",
        run: |found| {
            run(
                &Handshake::new(
                    "handshake-bus",
                    &[Trouble::LostImage, Trouble::Refusal, Trouble::NewLength],
                ),
                found,
            )
        },
    },
    Named {
        name: "handshake-reset",
        about: "the same with Error_RESET at any time instead of a new length",
        run: |found| {
            run(
                &Handshake::new("handshake-reset", &[Trouble::LostImage, Trouble::ErrorReset]),
                found,
            )
        },
    },
    Named {
        name: "handshake-set",
        about: "a drive whose handshake begins with 1",
        run: |found| {
            run(
                &Handshake::new("handshake-set", &[Trouble::LostImage, Trouble::BeginsSet]),
                found,
            )
        },
    },
    Named {
        name: "handshake-power",
        about: "a drive that is switched off and on at any time",
        run: |found| {
            run(
                &Handshake::new("handshake-power", &[Trouble::LostImage, Trouble::PowerCycle]),
                found,
            )
        },
    },
    Named {
        name: "handshake-cleared",
        about: "a slave whose outputs are cleared at any time",
        run: |found| {
            run(
                &Handshake::new("handshake-cleared", &[Trouble::LostImage, Trouble::Cleared]),
                found,
            )
        },
    },
    Named {
        name: "handshake-swallowed",
        about: "a drive that takes a job and never answers",
        run: |found| {
            run(
                &Handshake::new(
                    "handshake-swallowed",
                    &[Trouble::LostImage, Trouble::Swallowed, Trouble::ErrorReset],
                ),
                found,
            )
        },
    },
    Named {
        name: "start-up",
        about: "master and slave without watchdog, from power-up to data exchange and back",
        run: |found| run(&StartUp::new(WatchdogChoice::Off), found),
    },
    Named {
        name: "start-up-short",
        about: "the same with a watchdog shorter than the master's pause before it tries again",
        run: |found| run(&StartUp::new(WatchdogChoice::Short), found),
    },
    Named {
        name: "start-up-long",
        about: "the same with a watchdog longer than that",
        run: |found| run(&StartUp::new(WatchdogChoice::Long), found),
    },
];
