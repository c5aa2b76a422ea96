//! The line: virtual, behind a port, recorded.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod capture;
mod driver;
mod ports;
mod virtual_bus;
mod wireshark;
