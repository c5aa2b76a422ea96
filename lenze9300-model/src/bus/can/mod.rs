//! The system bus (CAN) of the drive.
//!
//! | object | identifier, node n | here |
//! |---|---|---|
//! | NMT | 0 | [`Nmt`] |
//! | Sync | C0367 received, C0368 sent (128) | [`CanNode`] |
//! | CAN-IN1, to the drive, cyclic | 512 + n | [`CanNode`] |
//! | CAN-OUT1, answer to a sync | 384 + n | [`CanNode`] |
//! | CAN-IN2, CAN-IN3 | 640 + n, 768 + n | [`CanNode`] |
//! | CAN-OUT2, CAN-OUT3, on change or cyclic | 641 + n, 769 + n | [`CanNode`] |
//! | parameter channel 1 (SDO 1) to, from the drive | 1536 + n, 1408 + n | [`SdoClient`], [`CanNode`] |
//! | parameter channel 2 (SDO 2) to, from the drive | 1600 + n, 1472 + n | [`SdoClient`], [`CanNode`] |
//!
//! Nothing here does input or output: frames and time go in, frames and events come out. Ports are in
//! [`can_port`](super::can_port), an in-process bus is [`VirtualCan`].
//!
//! Source: 9300 fact sheet, section 5.

mod client;
mod frame;
mod identifiers;
mod nmt;
mod node;
pub mod sdo;
mod traffic;
mod virtual_can;

pub use client::{SdoClient, SdoClientError, SdoOutcome};
pub use frame::CanFrame;
pub use identifiers::{Identifiers, Object, SdoChannel};
pub use nmt::{Nmt, NmtState};
pub use node::{CanNode, CanNodeEvent};
pub use virtual_can::{CanPortId, VirtualCan};

/// The bit rates of C0351, bit/s, by its value.
pub const BIT_RATES: [u32; 5] = [500_000, 250_000, 125_000, 50_000, 1_000_000];
