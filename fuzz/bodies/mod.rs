//! What the fuzz targets do with their octets: ordinary functions that panic when something is wrong.
//!
//! The fuzz targets call them with whatever libFuzzer thinks of, the test `fuzz` of the package `system-tests` with random octets and with
//! everything in `corpus/`.
#![allow(dead_code, reason = "each fuzz target uses one of them")]
#![allow(
    clippy::unwrap_used,
    reason = "a panic is how these functions report what they found"
)]

pub(crate) mod block;
pub(crate) mod can_messages;
pub(crate) mod capture;
pub(crate) mod decoder;
pub(crate) mod gsd;
pub(crate) mod input;
pub(crate) mod master;
pub(crate) mod panel;
pub(crate) mod parameter_channel;
pub(crate) mod slave;
pub(crate) mod system_bus;
pub(crate) mod toml_files;
