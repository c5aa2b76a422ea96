//! FDL: bus parameters, the station's state machine, and rings of several masters.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod bus_parameters;
mod failures;
mod noise;
mod responder;
mod ring;
mod ring_bench;
mod schedule;
mod station;
mod token_errors;
