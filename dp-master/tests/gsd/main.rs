//! The reader of GSD files, and what follows from them: octets of configuration and parameters, diagnosis in words.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

mod bad_files;
mod bench;
mod diagnosis;
mod keywords;
mod language;
mod second_opinion;
mod setup;
