//! The fieldbus data link layer (FDL): who may speak when, and what happens when nobody answers.

mod bus_plan;
mod bus_rules;
mod bus_time;
mod fcb;
mod gap;
mod holder;
mod las;
mod listener;
mod params;
mod passive;
mod reception;
mod ring;
mod state;
mod station;
mod timers;
mod token_time;
mod token_user;

pub use bus_plan::{BusPlan, MasterLoad, Network, Optical, OpticalTopology, Others, Profile, Segment, SlaveLoad};
pub use bus_rules::{Violation, longest_segment_m, longest_stubs_m};
pub use bus_time::{MessageCycle, TOKEN_BITS, TYPICAL_TSDR, Way, octet_bits, response_octets, telegram_octets};
pub use fcb::{FcbCounter, Novelty, RetryGuard};
pub use las::Las;
pub use params::{BusParams, BusParamsError, T_SYN};
pub use passive::{Responder, ResponderStatistics, ResponderUser, Response};
pub use state::FdlState;
pub use station::ActiveStation;
pub use timers::{Timer, Timers};
pub use token_time::Access;
pub use token_user::{
    Action, Confirmation, FdlStatistics, LeaveCause, Membership, Outcome, Repeat, RingEvent, TokenUser,
};
