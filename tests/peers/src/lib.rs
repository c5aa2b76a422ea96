//! Independent PROFIBUS stacks beside this one: what their tests and benches share.
//!
//! | peer | language | where |
//! |---|---|---|
//! | `pyprofibus` 1.13 | Python | `pyprofibus_master.py`, a DP master on a serial port |
//! | `profirust` 0.6.0 | Rust | `src/bin/profirust-master.rs`, the same master; benches |
//!
//! Both masters take the same options and tell the same events, so that one test runs with either. Users of the stack
//! build none of this: only the tests of the workspace do.

pub mod bus_time;
mod in_memory;
mod masters;
mod null_modem;
mod process;
mod slaves;

pub use in_memory::{Calls, OurCycles, PeerCycles};
pub use null_modem::NullModem;
pub use process::{Drive, Event, Master, Peer};
