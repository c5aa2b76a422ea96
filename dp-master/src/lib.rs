//! PROFIBUS FDL and DP, master and slave side, sans I/O.
//!
//! This crate moves telegrams. From the wire upwards:
//!
//! | layer | modules | without `std` |
//! |---|---|---|
//! | time, addresses | [`time`], [`address`] | yes |
//! | octets ↔ telegrams | [`wire`] | yes |
//! | what a station looks like to a line | [`station`] | yes |
//! | who may speak when: token, slot time, repetitions | [`fdl`] | yes |
//! | DP-V0 master and slave | [`dp`] | yes |
//! | what a device says about itself: GSD files | `gsd` | no |
//! | lines: virtual, disturbed, serial, pseudo-terminal, TCP | `phy` | no |
//! | one station in real time on a port | `driver` | no |
//!
//! Nothing here reads a clock, starts a thread or keeps a global, except `driver` and the real ports of `phy`, whose job it is. Time comes in as [`time::Instant`].
//!
//! # Example
//!
//! ```
//! use dp_master::address::Address;
//! use dp_master::wire::{Fcb, FunctionCode, RequestFunction, Telegram, decode_one};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
//! let question = Telegram::no_data(Address::new(3)?, Address::new(2)?, fc);
//! let mut buf = [0; dp_master::station::MAX_TELEGRAM];
//! let length = question.encode(&mut buf)?;
//! assert_eq!(buf[..length], [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]);
//! assert_eq!(decode_one(&buf[..length])?, (question, 6));
//! # Ok(())
//! # }
//! ```
//!
//! # Left out
//!
//! FMS (CSRD and its access points), redundancy, address extensions for other segments.
#![cfg_attr(not(feature = "std"), no_std)]

pub mod address;
pub mod dp;
#[cfg(feature = "std")]
pub mod driver;
pub mod fdl;
#[cfg(feature = "std")]
pub mod gsd;
#[cfg(feature = "std")]
pub mod phy;
pub mod station;
pub mod time;
pub mod wire;
