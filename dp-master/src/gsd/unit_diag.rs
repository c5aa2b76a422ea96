//! Texts for device-related and channel-related diagnosis.
//!
//! Bit 0 is the least significant bit of the first octet after the header of a device-related block, bit 8 that of the second. Slaves with
//! DP-V1 use the first three octets for kind, slot and specifier, so their own bits start at 24.

use std::collections::BTreeMap;

use serde::Serialize;

use super::diagnostic::Position;

/// A text and the explanation a tool may show with it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct DiagText {
    /// The text.
    pub text: String,
    /// What to do about it.
    pub help: Option<String>,
}

/// A number in several bits of the diagnosis (`Unit_Diag_Area`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnitDiagArea {
    /// Lowest bit, the least significant one of the number.
    pub first: u16,
    /// Highest bit.
    pub last: u16,
    /// Text by number.
    pub values: BTreeMap<u32, DiagText>,
    #[serde(skip)]
    pub(super) at: Position,
}

impl UnitDiagArea {
    /// The largest number its bits can hold.
    pub fn max(&self) -> u32 {
        match u32::from(self.last.saturating_sub(self.first)) + 1 {
            width @ 0..=31 => (1 << width) - 1,
            _ => u32::MAX,
        }
    }
}

/// What the bits of a device-related diagnosis mean.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct UnitDiag {
    /// Text of a bit that is 1 (`Unit_Diag_Bit`).
    pub bits: BTreeMap<u16, DiagText>,
    /// Text of a bit that is 0 (`Unit_Diag_Not_Bit`).
    pub not_bits: BTreeMap<u16, DiagText>,
    /// Numbers.
    pub areas: Vec<UnitDiagArea>,
}

impl UnitDiag {
    /// Nothing is said.
    pub fn is_empty(&self) -> bool {
        self.bits.is_empty() && self.not_bits.is_empty() && self.areas.is_empty()
    }
}
