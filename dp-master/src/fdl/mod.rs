//! The fieldbus data link layer (FDL): who may speak when, and what happens when nobody answers.

mod fcb;
mod params;
mod passive;
mod reception;
mod station;
mod timers;

pub use fcb::{FcbCounter, Novelty, RetryGuard};
pub use params::{BusParams, BusParamsError, T_SYN};
pub use passive::{Responder, ResponderStatistics, ResponderUser, Response};
pub use station::{Action, ActiveStation, Confirmation, FdlStatistics, Outcome, Repeat, RingEvent, TokenUser};
pub use timers::{Timer, Timers};
