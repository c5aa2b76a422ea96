//! Set_Slave_Add: a slave without address switches gets its address over the bus.
//!
//! ```text
//! octet 1  new address, 0…125
//! octet 2  ident number high         octet 3  ident number low
//! octet 4  No_Add_Chg: 0 = may be changed again, any other value = only after the slave was reset to its delivery state
//! octet 5… Rem_Slave_Data, at most 240: kept by the slave for its user
//! ```
//!
//! Source: IEC 61158-6-3, coding of Set_Slave_Add; VPC3+C user manual revision 1.03, figure 6-4.

use crate::address::Address;

/// Octets of Set_Slave_Add before the remaining data.
pub const SET_SLAVE_ADD_LEN: usize = 4;
/// Most octets of remaining data.
pub const MAX_REMAINING: usize = 244 - SET_SLAVE_ADD_LEN;
/// The highest address that can be given: 126 is the one slaves are delivered with.
pub const MAX_NEW_ADDRESS: u8 = 125;

/// Whether an address given over the bus may be changed again (No_Add_Chg).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AddressLock {
    /// It may (octet 4 is 0).
    #[default]
    Changeable,
    /// Not before the slave was reset to its delivery state.
    Locked,
}

/// The data unit of Set_Slave_Add.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetSlaveAdd<'a> {
    /// The new address, 0…125.
    pub new_address: Address,
    /// Ident number the slave must have.
    pub ident: u16,
    /// Whether it may be changed again.
    pub lock: AddressLock,
    /// Remaining data, 0…240 octets.
    pub remaining: &'a [u8],
}

impl<'a> SetSlaveAdd<'a> {
    /// Reads the data unit of a request.
    ///
    /// # Errors
    ///
    /// [`SetSlaveAddError`], one variant a rule.
    pub fn parse(data: &'a [u8]) -> Result<Self, SetSlaveAddError> {
        let Some((&[address, high, low, no_add_chg], remaining)) = data.split_first_chunk::<SET_SLAVE_ADD_LEN>() else {
            return Err(SetSlaveAddError::TooShort { got: data.len() });
        };
        if remaining.len() > MAX_REMAINING {
            return Err(SetSlaveAddError::TooLong { got: data.len() });
        }
        let new_address = match Address::new(address) {
            Ok(new_address) if address <= MAX_NEW_ADDRESS => new_address,
            _ => return Err(SetSlaveAddError::NewAddress { got: address }),
        };
        Ok(Self {
            new_address,
            ident: u16::from_be_bytes([high, low]),
            lock: match no_add_chg {
                0 => AddressLock::Changeable,
                _ => AddressLock::Locked,
            },
            remaining,
        })
    }

    /// Writes the data unit; returns its length.
    ///
    /// # Errors
    ///
    /// [`SetSlaveAddError::NewAddress`] above 125, [`SetSlaveAddError::TooLong`] with more than 240 octets of remaining
    /// data or when `buf` is too small.
    pub fn encode(&self, buf: &mut [u8]) -> Result<usize, SetSlaveAddError> {
        let address = self.new_address.value();
        if address > MAX_NEW_ADDRESS {
            return Err(SetSlaveAddError::NewAddress { got: address });
        }
        let len = SET_SLAVE_ADD_LEN + self.remaining.len();
        let too_long = SetSlaveAddError::TooLong { got: len };
        if self.remaining.len() > MAX_REMAINING {
            return Err(too_long);
        }
        let Some((fixed, remaining)) = buf
            .get_mut(..len)
            .and_then(|target| target.split_first_chunk_mut::<SET_SLAVE_ADD_LEN>())
        else {
            return Err(too_long);
        };
        let [high, low] = self.ident.to_be_bytes();
        let no_add_chg = match self.lock {
            AddressLock::Changeable => 0x00,
            AddressLock::Locked => 0xFF,
        };
        *fixed = [address, high, low, no_add_chg];
        remaining.copy_from_slice(self.remaining);
        Ok(len)
    }
}

/// Why a Set_Slave_Add data unit cannot be read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SetSlaveAddError {
    /// The four standard octets are not complete.
    #[error("Set_Slave_Add: expected at least 4 octets, got {got}")]
    TooShort {
        /// Octets there were.
        got: usize,
    },
    /// More octets than a telegram or the buffer takes.
    #[error("Set_Slave_Add: expected at most 244 octets and room for them, got {got}")]
    TooLong {
        /// Octets there were.
        got: usize,
    },
    /// No address that can be given to a slave.
    #[error("new slave address: expected 0 to 125, got {got}")]
    NewAddress {
        /// The number.
        got: u8,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_octets_stand_where_the_standard_puts_them() {
        let request = SetSlaveAdd {
            new_address: Address::new(42).unwrap(),
            ident: 0x00DA,
            lock: AddressLock::Locked,
            remaining: &[1, 2],
        };
        let mut buf = [0; 8];
        assert_eq!(request.encode(&mut buf), Ok(6));
        assert_eq!(buf[..6], [42, 0x00, 0xDA, 0xFF, 1, 2]);
        assert_eq!(SetSlaveAdd::parse(&buf[..6]), Ok(request));
    }

    #[test]
    fn any_value_but_zero_locks_the_address() {
        for (octet, lock) in [
            (0x00, AddressLock::Changeable),
            (0x01, AddressLock::Locked),
            (0xFF, AddressLock::Locked),
        ] {
            assert_eq!(SetSlaveAdd::parse(&[5, 0, 0xDA, octet]).unwrap().lock, lock);
        }
    }

    #[test]
    fn each_broken_rule_is_named() {
        let parse = SetSlaveAdd::parse;
        assert_eq!(parse(&[5, 0, 0xDA]), Err(SetSlaveAddError::TooShort { got: 3 }));
        assert_eq!(
            parse(&[126, 0, 0xDA, 0]),
            Err(SetSlaveAddError::NewAddress { got: 126 })
        );
        assert_eq!(
            parse(&[0xFF, 0, 0xDA, 0]),
            Err(SetSlaveAddError::NewAddress { got: 255 })
        );
        assert_eq!(parse(&[0; 245]), Err(SetSlaveAddError::TooLong { got: 245 }));
    }

    #[test]
    fn what_no_slave_could_read_is_not_written() {
        let remaining = [0; 241];
        let mut buf = [0; 256];
        let mut request = SetSlaveAdd {
            new_address: Address::new(125).unwrap(),
            ident: 0x00DA,
            lock: AddressLock::Changeable,
            remaining: &remaining[..240],
        };
        assert_eq!(request.encode(&mut buf), Ok(244));
        assert_eq!(SetSlaveAdd::parse(&buf[..244]), Ok(request));
        assert_eq!(
            request.encode(&mut buf[..243]),
            Err(SetSlaveAddError::TooLong { got: 244 })
        );
        request.remaining = &remaining;
        assert_eq!(request.encode(&mut buf), Err(SetSlaveAddError::TooLong { got: 245 }));
        request.remaining = &[];
        request.new_address = Address::new(126).unwrap();
        assert_eq!(request.encode(&mut buf), Err(SetSlaveAddError::NewAddress { got: 126 }));
    }
}
