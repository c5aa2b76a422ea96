//! The fieldbus data link layer (FDL): who may speak when, and what happens when nobody answers.

mod bus_plan;
mod bus_rules;
mod bus_time;
mod fcb;
mod params;
mod passive;
mod reception;
mod station;
mod timers;

pub use bus_plan::{BusPlan, MasterLoad, Network, Optical, OpticalTopology, Others, Profile, Segment, SlaveLoad};
pub use bus_rules::{Violation, longest_segment_m, longest_stubs_m};
pub use bus_time::{MessageCycle, TOKEN_BITS, TYPICAL_TSDR, Way, octet_bits, response_octets, telegram_octets};
pub use fcb::{FcbCounter, Novelty, RetryGuard};
pub use params::{BusParams, BusParamsError, T_SYN};
pub use passive::{Responder, ResponderStatistics, ResponderUser, Response};
pub use station::{Action, ActiveStation, Confirmation, FdlStatistics, Outcome, Repeat, RingEvent, TokenUser};
pub use timers::{Timer, Timers};
