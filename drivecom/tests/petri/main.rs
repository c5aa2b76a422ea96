//! The parameter net, enumerated: first its markings alone, then the net composed with an abstract drive.
//!
//! Every check is also shown to reject a net or a drive that was broken on purpose, and prints how it got there.
//! Expected values: film-feed specification, section 8 (table of step 12) and section 8.1, points 5 to 8 and 17.

mod composed;
mod markings;

use drivecom::petri::{PARAMETER_TRANSITIONS, Transition};

/// A violation and the firings that lead to it.
#[derive(Debug)]
struct Counterexample(String);

type Verdict = Result<(), Counterexample>;

/// The net with one row changed, or taken away by returning `None`.
fn broken(number: u8, change: impl Fn(Transition) -> Option<Transition>) -> Vec<Transition> {
    PARAMETER_TRANSITIONS
        .into_iter()
        .filter_map(|t| if t.number == number { change(t) } else { Some(t) })
        .collect()
}
