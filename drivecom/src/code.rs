//! Numbers of codes and subcodes, and the index they have on the parameter channel.

use core::fmt;

/// Number of a code of the drive, 0…24575, as in "C1204".
///
/// On the parameter channel it appears as index = 24575 − number.
/// Source: 9300 fact sheet, section 3.2.
///
/// # Example
///
/// ```
/// use drivecom::CodeNumber;
///
/// let code = CodeNumber::new(86).unwrap();
/// assert_eq!(code.index(), 0x5FA9);
/// assert_eq!(code.to_string(), "C0086");
/// assert_eq!(CodeNumber::from_index(0x5FA9), Some(code));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[doc(alias = "Codestelle")]
pub struct CodeNumber(u16);

impl CodeNumber {
    /// The largest code number; its index is 0.
    pub const MAX: u16 = 24_575;

    /// The code with this number; `None` above 24575, which no index can carry.
    #[must_use]
    pub const fn new(number: u16) -> Option<Self> {
        if number <= Self::MAX { Some(Self(number)) } else { None }
    }

    /// The code an index names; `None` above 24575.
    #[must_use]
    pub const fn from_index(index: u16) -> Option<Self> {
        match Self::MAX.checked_sub(index) {
            Some(number) => Some(Self(number)),
            None => None,
        }
    }

    /// The number, 0…24575.
    #[must_use]
    pub const fn number(self) -> u16 {
        self.0
    }

    /// The index on the parameter channel: 24575 − number.
    #[must_use]
    pub const fn index(self) -> u16 {
        Self::MAX - self.0
    }
}

/// `C0086`, four digits at least.
impl fmt::Display for CodeNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "C{:04}", self.0)
    }
}

/// Number of a subcode, the "/1" in "C1301/1"; 0 for a code without subcodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[doc(alias = "Subindex")]
pub struct Subcode(pub u8);

impl Subcode {
    /// A code without subcodes.
    pub const NONE: Self = Self(0);
}

/// Nothing for subcode 0, otherwise `/1`: meant to follow a code number.
impl fmt::Display for Subcode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == 0 { Ok(()) } else { write!(f, "/{}", self.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Source: 9300 facts 3.2, example table, and section 11.
    #[test]
    fn indices_are_those_of_the_fact_sheet() {
        let table = [
            (1301, 0x5AEA),
            (1302, 0x5AE9),
            (1303, 0x5AE8),
            (1204, 0x5B4B),
            (1202, 0x5B4D),
            (1203, 0x5B4C),
            (86, 0x5FA9),
            (39, 0x5FD8),
        ];
        for (number, index) in table {
            assert_eq!(
                CodeNumber::new(number).map(CodeNumber::index),
                Some(index),
                "C{number:04}"
            );
        }
    }

    #[test]
    fn every_index_up_to_24575_names_one_code_and_none_above_does() {
        for index in 0..=24_575 {
            assert_eq!(CodeNumber::from_index(index).map(CodeNumber::index), Some(index));
        }
        assert_eq!(CodeNumber::from_index(24_576), None);
        assert_eq!(CodeNumber::from_index(u16::MAX), None);
        assert_eq!(CodeNumber::new(24_576), None);
    }

    #[test]
    fn a_code_prints_as_in_the_manual() {
        let code = CodeNumber::new(39).unwrap();
        assert_eq!(format!("{code}{}", Subcode(1)), "C0039/1");
        assert_eq!(format!("{code}{}", Subcode::NONE), "C0039");
    }
}
