//! User parameters: what can be set, where it stands in Set_Prm, and how values become octets.
//!
//! A parameter is defined once (`ExtUserPrmData`) and placed in the station's or a module's octets (`Ext_User_Prm_Data_Ref`), above constants
//! (`Ext_User_Prm_Data_Const`). Values of several octets are big-endian; bits and bit areas change nothing beside them.

use core::fmt;
use core::ops::RangeInclusive;
use std::collections::BTreeMap;

use serde::Serialize;

use super::diagnostic::Position;

/// How a parameter is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum PrmType {
    /// One bit of an octet, 0…7.
    Bit(u8),
    /// Neighbouring bits of an octet, 0…7, the first one the least significant of the value.
    BitArea {
        /// Lowest bit.
        first: u8,
        /// Highest bit.
        last: u8,
    },
    /// One octet, 0…255.
    Unsigned8,
    /// Two octets, 0…65 535.
    Unsigned16,
    /// Four octets, 0…4 294 967 295.
    Unsigned32,
    /// One octet, −128…127.
    Signed8,
    /// Two octets, −32 768…32 767.
    Signed16,
    /// Four octets, −2 147 483 648…2 147 483 647.
    Signed32,
}

impl PrmType {
    /// Octets it touches: 1, 2 or 4.
    pub fn octets(self) -> usize {
        match self {
            Self::Bit(_) | Self::BitArea { .. } | Self::Unsigned8 | Self::Signed8 => 1,
            Self::Unsigned16 | Self::Signed16 => 2,
            Self::Unsigned32 | Self::Signed32 => 4,
        }
    }

    /// The values it can hold.
    pub fn range(self) -> RangeInclusive<i64> {
        match self {
            Self::Bit(_) => 0..=1,
            Self::BitArea { first, last } => 0..=(1_i64 << (last.saturating_sub(first).min(7) + 1)) - 1,
            Self::Unsigned8 => 0..=u8::MAX.into(),
            Self::Unsigned16 => 0..=u16::MAX.into(),
            Self::Unsigned32 => 0..=u32::MAX.into(),
            Self::Signed8 => i8::MIN.into()..=i8::MAX.into(),
            Self::Signed16 => i16::MIN.into()..=i16::MAX.into(),
            Self::Signed32 => i32::MIN.into()..=i32::MAX.into(),
        }
    }

    /// The bits of its octets that are its own, as a big-endian number of [`octets`](Self::octets) octets.
    pub(super) fn mask(self) -> u32 {
        match self {
            Self::Bit(bit) => 1 << bit.min(7),
            Self::BitArea { first, last } => {
                let width = u32::from(last.saturating_sub(first).min(7)) + 1;
                (((1 << width) - 1) << first.min(7)) & 0xFF
            }
            Self::Unsigned8 | Self::Signed8 => 0xFF,
            Self::Unsigned16 | Self::Signed16 => 0xFFFF,
            Self::Unsigned32 | Self::Signed32 => 0xFFFF_FFFF,
        }
    }

    fn shift(self) -> u8 {
        match self {
            Self::Bit(bit) => bit.min(7),
            Self::BitArea { first, .. } => first.min(7),
            _ => 0,
        }
    }

    /// Writes `value` into its bits at `offset` and leaves all others as they are; `false` (and nothing written) when the octets end before
    /// or the value is outside of [`range`](Self::range).
    #[must_use]
    pub fn write(self, value: i64, octets: &mut [u8], offset: usize) -> bool {
        let len = self.octets();
        let Some(target) = offset.checked_add(len).and_then(|end| octets.get_mut(offset..end)) else {
            return false;
        };
        if !self.range().contains(&value) {
            return false;
        }
        // Two's complement: the low octets of a negative number are those of its type.
        let bits = ((value as u32) << self.shift()) & self.mask();
        let new = bits.to_be_bytes();
        let mask = self.mask().to_be_bytes();
        let first = 4 - len;
        for ((octet, new), mask) in target
            .iter_mut()
            .zip(new.iter().skip(first))
            .zip(mask.iter().skip(first))
        {
            *octet = (*octet & !mask) | new;
        }
        true
    }

    /// Reads its value at `offset`; `None` when the octets end before.
    pub fn read(self, octets: &[u8], offset: usize) -> Option<i64> {
        let source = octets.get(offset..offset.checked_add(self.octets())?)?;
        let whole = source.iter().fold(0_u32, |sum, &octet| (sum << 8) | u32::from(octet));
        Some(match self {
            Self::Signed8 => i64::from(whole as u8 as i8),
            Self::Signed16 => i64::from(whole as u16 as i16),
            Self::Signed32 => i64::from(whole as i32),
            _ => i64::from((whole & self.mask()) >> self.shift()),
        })
    }
}

impl fmt::Display for PrmType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bit(bit) => write!(f, "Bit({bit})"),
            Self::BitArea { first, last } => write!(f, "BitArea({first}-{last})"),
            other => fmt::Debug::fmt(other, f),
        }
    }
}

/// The numbers a file allows somewhere, as ranges and single values in the file's order; none means any.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct ValueSet(pub Vec<(i64, i64)>);

impl ValueSet {
    /// Whether `value` is allowed.
    pub fn contains(&self, value: i64) -> bool {
        self.is_any() || self.0.iter().any(|&(min, max)| (min..=max).contains(&value))
    }

    /// Whether nothing is said, so that everything is allowed.
    pub fn is_any(&self) -> bool {
        self.0.is_empty()
    }

    /// The only value there is, if there is but one.
    pub(super) fn only(&self) -> Option<i64> {
        match self.0[..] {
            [(min, max)] if min == max => Some(min),
            _ => None,
        }
    }
}

impl fmt::Display for ValueSet {
    /// `0 to 255`, `0, 2, 5 to 7`, `any`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_any() {
            return f.write_str("any");
        }
        for (place, (min, max)) in self.0.iter().enumerate() {
            let comma = if place == 0 { "" } else { ", " };
            if min == max {
                write!(f, "{comma}{min}")?;
            } else {
                write!(f, "{comma}{min} to {max}")?;
            }
        }
        Ok(())
    }
}

/// Texts for the values of parameters (`PrmText`).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct PrmText {
    /// Text by value.
    pub texts: BTreeMap<i64, String>,
    #[serde(skip)]
    pub(super) at: Option<Position>,
}

/// A parameter that can be set (`ExtUserPrmData`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Parameter {
    /// Number by which it is referred to.
    pub reference: u16,
    /// Name; makers use the same name for several parameters, and lines of dashes as headings.
    pub name: String,
    /// Coding.
    pub data_type: PrmType,
    /// Value when nothing is set.
    pub default: i64,
    /// Allowed values.
    pub values: ValueSet,
    /// Number of the [`PrmText`] with the texts of its values.
    pub text: Option<u16>,
    /// A user may change it.
    pub changeable: bool,
    /// A tool shows it.
    pub visible: bool,
    #[serde(skip)]
    pub(super) at: Position,
}

impl Parameter {
    /// The value of this parameter is the number of the slot (from GSD revision 5).
    pub fn is_slot_number(&self) -> bool {
        self.name.eq_ignore_ascii_case("[SlotNumber]")
    }

    /// Whether `value` is allowed by the file and fits the coding.
    pub fn allows(&self, value: i64) -> bool {
        self.values.contains(value) && self.data_type.range().contains(&value)
    }
}

/// Octets that are always sent (`Ext_User_Prm_Data_Const`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PrmConstant {
    /// Where they start in the station's or module's part.
    pub offset: u8,
    /// The octets.
    pub octets: Vec<u8>,
    #[serde(skip)]
    pub(super) at: Position,
}

/// The place of a parameter (`Ext_User_Prm_Data_Ref`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct PrmPlace {
    /// Where it starts in the station's or module's part.
    pub offset: u8,
    /// Which one, a key of [`Gsd::parameters`](super::Gsd::parameters).
    pub reference: u16,
    #[serde(skip)]
    pub(super) at: Position,
}

/// How the user parameters of the station or of a module are made up.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct PrmLayout {
    /// Length the file gives: exact for modules (`Ext_Module_Prm_Data_Len`), the most for the station with its modules
    /// (`Max_User_Prm_Data_Len`).
    pub len: Option<u8>,
    /// Constants in the file's order; later ones overwrite earlier ones.
    pub constants: Vec<PrmConstant>,
    /// Parameters in the file's order; they overwrite constants.
    pub places: Vec<PrmPlace>,
}

impl PrmLayout {
    /// Nothing is said.
    pub fn is_empty(&self) -> bool {
        self.constants.is_empty() && self.places.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_bit_areas_do_not_wipe_their_neighbours() {
        let mut octets = [0b1010_0101];
        assert!(PrmType::BitArea { first: 2, last: 4 }.write(0b110, &mut octets, 0));
        assert_eq!(octets, [0b1011_1001]);
        assert!(PrmType::Bit(7).write(0, &mut octets, 0));
        assert_eq!(octets, [0b0011_1001]);
        assert!(PrmType::Bit(1).write(1, &mut octets, 0));
        assert_eq!(octets, [0b0011_1011]);
        assert_eq!(PrmType::BitArea { first: 2, last: 4 }.read(&octets, 0), Some(0b110));
    }

    #[test]
    fn values_of_several_octets_are_big_endian_and_signed_ones_in_twos_complement() {
        let written = |data_type: PrmType, value| {
            let mut octets = [0xEE; 6];
            assert!(data_type.write(value, &mut octets, 1));
            assert_eq!(data_type.read(&octets, 1), Some(value));
            octets
        };
        assert_eq!(
            written(PrmType::Unsigned16, 0x1234),
            [0xEE, 0x12, 0x34, 0xEE, 0xEE, 0xEE]
        );
        assert_eq!(
            written(PrmType::Unsigned32, 0xFEDC_BA98),
            [0xEE, 0xFE, 0xDC, 0xBA, 0x98, 0xEE]
        );
        assert_eq!(written(PrmType::Signed8, -1), [0xEE, 0xFF, 0xEE, 0xEE, 0xEE, 0xEE]);
        assert_eq!(written(PrmType::Signed16, -2), [0xEE, 0xFF, 0xFE, 0xEE, 0xEE, 0xEE]);
        assert_eq!(written(PrmType::Signed32, i32::MIN.into()), [0xEE, 0x80, 0, 0, 0, 0xEE]);
    }

    #[test]
    fn nothing_is_written_beyond_the_octets_or_the_range() {
        let mut octets = [7; 2];
        assert!(!PrmType::Unsigned16.write(1, &mut octets, 1));
        assert!(!PrmType::Unsigned8.write(1, &mut octets, usize::MAX));
        assert!(!PrmType::Signed8.write(128, &mut octets, 0));
        assert!(!PrmType::BitArea { first: 0, last: 1 }.write(4, &mut octets, 0));
        assert_eq!(octets, [7; 2]);
    }

    #[test]
    fn value_sets_are_shown_as_a_reader_would_say_them() {
        let set = ValueSet(vec![(0, 0), (2, 2), (5, 7)]);
        assert_eq!(set.to_string(), "0, 2, 5 to 7");
        assert!(set.contains(6) && !set.contains(1));
        assert!(ValueSet::default().contains(-9));
    }
}
