//! The program `dp`, a file for each of its commands.
#![cfg(feature = "tool")]
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod bus_statistics;
mod busparam;
mod common;
mod decode;
mod info;
mod records;
mod run;
mod sniff;
mod stations;
