//! Telegrams: coding, decoding, what a disturbance can do to them, and how they are shown.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod control;
mod error_detection;
mod pretty;
mod service;
mod telegram;
