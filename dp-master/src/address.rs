//! Station addresses.

use core::fmt;
use core::str::FromStr;

/// The address of a station, 0…126, or [`Address::BROADCAST`] (127).
///
/// On the wire it is the low seven bits of the address octet; bit 7 says that a service access point follows in the data.
///
/// Source: 9300 facts 1.1 (addresses 0–126); IEC 61158-4-3 (127 is the global address).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address(u8);

impl Address {
    /// The global address: every station listens, none answers.
    pub const BROADCAST: Self = Self(127);
    /// The highest address a station can have.
    pub const MAX_STATION: Self = Self(126);

    /// The address of a station.
    ///
    /// # Errors
    ///
    /// [`AddressError::OutOfRange`] above 126. Broadcast is no station; name it [`Address::BROADCAST`].
    pub const fn new(value: u8) -> Result<Self, AddressError> {
        if value <= Self::MAX_STATION.0 {
            Ok(Self(value))
        } else {
            Err(AddressError::OutOfRange { got: value })
        }
    }

    /// The address in an address octet without extension: 0…127, `None` when bit 7 is set.
    #[inline]
    #[must_use]
    pub const fn from_wire(octet: u8) -> Option<Self> {
        if octet <= Self::BROADCAST.0 {
            Some(Self(octet))
        } else {
            None
        }
    }

    /// The address in an address octet whose bit 7 has another meaning and is ignored here.
    #[inline]
    pub(crate) const fn from_low_bits(octet: u8) -> Self {
        Self(octet & 0x7F)
    }

    /// The number, 0…127.
    #[inline]
    #[must_use]
    pub const fn value(self) -> u8 {
        self.0
    }

    /// Whether this is the global address.
    #[inline]
    #[must_use]
    pub const fn is_broadcast(self) -> bool {
        self.0 == Self::BROADCAST.0
    }
}

impl TryFrom<u8> for Address {
    type Error = AddressError;

    fn try_from(value: u8) -> Result<Self, AddressError> {
        Self::new(value)
    }
}

impl From<Address> for u8 {
    fn from(address: Address) -> Self {
        address.0
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        text.trim()
            .parse::<u8>()
            .map_err(|_| AddressError::NotANumber)
            .and_then(Self::new)
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Why something is not the address of a station.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AddressError {
    /// Above 126.
    #[error("station address must be 0 to 126, got {got}")]
    OutOfRange {
        /// The number given.
        got: u8,
    },
    /// Text that is no number from 0 to 255.
    #[error("station address must be a number from 0 to 126")]
    NotANumber,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_station_has_an_address_from_0_to_126() {
        assert_eq!(Address::new(0).map(u8::from), Ok(0));
        assert_eq!(Address::new(126), Ok(Address::MAX_STATION));
        assert_eq!(Address::new(127), Err(AddressError::OutOfRange { got: 127 }));
        assert_eq!(Address::new(255), Err(AddressError::OutOfRange { got: 255 }));
    }

    #[test]
    fn the_wire_also_knows_the_global_address() {
        assert_eq!(Address::from_wire(127), Some(Address::BROADCAST));
        assert_eq!(Address::from_wire(128), None);
        assert!(Address::BROADCAST.is_broadcast());
        assert!(!Address::MAX_STATION.is_broadcast());
    }

    #[test]
    fn text_is_read_with_the_same_limits() {
        assert_eq!("3".parse::<Address>(), Address::new(3));
        assert_eq!("127".parse::<Address>(), Err(AddressError::OutOfRange { got: 127 }));
        assert_eq!("-1".parse::<Address>(), Err(AddressError::NotANumber));
        assert_eq!("300".parse::<Address>(), Err(AddressError::NotANumber));
        assert_eq!(Address::MAX_STATION.to_string(), "126");
    }
}
