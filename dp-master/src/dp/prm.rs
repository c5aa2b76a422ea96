//! Set_Prm: how a master tells a slave who it should be and how it is to be watched.
//!
//! ```text
//! octet 1  station status: 7 Lock_Req, 6 Unlock_Req, 5 Sync_Req, 4 Freeze_Req, 3 WD_On, 2…0 reserved
//! octet 2  WD_Fact_1 (1…255)         octet 3  WD_Fact_2 (1…255)
//! octet 4  min Tsdr in bit times, 0 = keep
//! octet 5  ident number high         octet 6  ident number low
//! octet 7  group ident, one bit a group
//! octet 8… user parameters (User_Prm_Data), at most 237
//! ```
//!
//! Source: 9300 facts 1.2; IEC 61158-6-3, coding of Set_Prm.

use super::watchdog::Watchdog;

/// Octets of Set_Prm before the user parameters.
pub const SET_PRM_LEN: usize = 7;
/// Most user parameter octets.
pub const MAX_USER_PRM: usize = 244 - SET_PRM_LEN;

/// What a master asks about the bond between it and the slave.
///
/// Source: IEC 61158-6-3, Set_Prm octet 1, bits 7 and 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LockRequest {
    /// `00`: only min Tsdr may be overwritten.
    Keep,
    /// `10`: the slave belongs to this master, all parameters are taken over.
    Lock,
    /// `01` and `11`: the slave is free for every master.
    Unlock,
}

/// The data unit of Set_Prm, lossless both ways.
#[doc(alias = "Parametriertelegramm")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetPrm<'a> {
    /// Octet 1 as it stands; use the methods to read it.
    pub station_status: u8,
    /// Octet 2.
    pub wd_fact_1: u8,
    /// Octet 3.
    pub wd_fact_2: u8,
    /// Octet 4: least bit times between request and reply, 0 keeps the value in use.
    pub min_tsdr: u8,
    /// Octets 5 and 6: ident number the master expects.
    pub ident: u16,
    /// Octet 7: groups the slave belongs to, one bit a group.
    pub group: u8,
    /// User parameters, 0…237 octets.
    pub user: &'a [u8],
}

impl<'a> SetPrm<'a> {
    /// Reads the data unit of a Set_Prm request.
    ///
    /// # Errors
    ///
    /// [`SetPrmError::TooShort`] below seven octets, [`SetPrmError::TooLong`] above 244.
    pub fn parse(data: &'a [u8]) -> Result<Self, SetPrmError> {
        if data.len() > SET_PRM_LEN + MAX_USER_PRM {
            return Err(SetPrmError::TooLong { got: data.len() });
        }
        let Some((&[station_status, wd_fact_1, wd_fact_2, min_tsdr, high, low, group], user)) =
            data.split_first_chunk::<SET_PRM_LEN>()
        else {
            return Err(SetPrmError::TooShort { got: data.len() });
        };
        Ok(Self {
            station_status,
            wd_fact_1,
            wd_fact_2,
            min_tsdr,
            ident: u16::from_be_bytes([high, low]),
            group,
            user,
        })
    }

    /// Writes the data unit; returns its length.
    ///
    /// # Errors
    ///
    /// [`SetPrmError::TooLong`] with more than 237 user parameters or when `buf` is too small.
    pub fn encode(&self, buf: &mut [u8]) -> Result<usize, SetPrmError> {
        let len = SET_PRM_LEN + self.user.len();
        let too_long = SetPrmError::TooLong { got: len };
        if self.user.len() > MAX_USER_PRM {
            return Err(too_long);
        }
        let Some((fixed, user)) = buf
            .get_mut(..len)
            .and_then(|target| target.split_first_chunk_mut::<SET_PRM_LEN>())
        else {
            return Err(too_long);
        };
        let [high, low] = self.ident.to_be_bytes();
        *fixed = [
            self.station_status,
            self.wd_fact_1,
            self.wd_fact_2,
            self.min_tsdr,
            high,
            low,
            self.group,
        ];
        user.copy_from_slice(self.user);
        Ok(len)
    }

    /// What is asked about the bond to the master.
    pub fn lock_request(&self) -> LockRequest {
        match (
            self.station_status & UNLOCK_REQ != 0,
            self.station_status & LOCK_REQ != 0,
        ) {
            (true, _) => LockRequest::Unlock,
            (false, true) => LockRequest::Lock,
            (false, false) => LockRequest::Keep,
        }
    }

    /// The slave shall obey Sync commands.
    pub fn sync_requested(&self) -> bool {
        self.station_status & SYNC_REQ != 0
    }

    /// The slave shall obey Freeze commands.
    pub fn freeze_requested(&self) -> bool {
        self.station_status & FREEZE_REQ != 0
    }

    /// The watchdog is on.
    pub fn watchdog_on(&self) -> bool {
        self.station_status & WD_ON != 0
    }

    /// The watchdog; `None` when it is off or a factor is 0 (which is a parameter fault when it is on).
    pub fn watchdog(&self) -> Option<Watchdog> {
        if self.watchdog_on() {
            Watchdog::from_factors(self.wd_fact_1, self.wd_fact_2)
        } else {
            None
        }
    }
}

/// Lock_Req, bit 7 of octet 1.
pub const LOCK_REQ: u8 = 0x80;
/// Unlock_Req, bit 6 of octet 1.
pub const UNLOCK_REQ: u8 = 0x40;
/// Sync_Req, bit 5 of octet 1.
pub const SYNC_REQ: u8 = 0x20;
/// Freeze_Req, bit 4 of octet 1.
pub const FREEZE_REQ: u8 = 0x10;
/// WD_On, bit 3 of octet 1.
pub const WD_ON: u8 = 0x08;

/// Why a Set_Prm data unit cannot be read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SetPrmError {
    /// The seven standard octets are not complete.
    #[error("Set_Prm: expected at least 7 octets, got {got}")]
    TooShort {
        /// Octets there were.
        got: usize,
    },
    /// More octets than a telegram or the buffer takes.
    #[error("Set_Prm: expected at most 244 octets and room for them, got {got}")]
    TooLong {
        /// Octets there were.
        got: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Duration;

    // Lock and WD_On, 10 ms × 5 × 1, min Tsdr 11, ident 0x00DA, group 1, three user octets.
    const OCTETS: [u8; 10] = [0x88, 5, 1, 11, 0x00, 0xDA, 0x01, 0xC0, 0x00, 0x00];

    #[test]
    fn the_octets_stand_where_the_standard_puts_them() {
        let prm = SetPrm::parse(&OCTETS).unwrap();
        assert_eq!(prm.lock_request(), LockRequest::Lock);
        assert_eq!(prm.watchdog().unwrap().time(), Duration::from_millis(50));
        assert_eq!((prm.min_tsdr, prm.ident, prm.group), (11, 0x00DA, 1));
        assert_eq!(prm.user, [0xC0, 0, 0]);
        assert!(!prm.sync_requested() && !prm.freeze_requested());
        let mut buf = [0; 16];
        assert_eq!(prm.encode(&mut buf), Ok(10));
        assert_eq!(buf[..10], OCTETS);
    }

    #[test]
    fn unlock_wins_over_lock() {
        let mut octets = OCTETS;
        for (status, expected) in [
            (0x00, LockRequest::Keep),
            (0x40, LockRequest::Unlock),
            (0x80, LockRequest::Lock),
            (0xC0, LockRequest::Unlock),
        ] {
            octets[0] = status;
            assert_eq!(SetPrm::parse(&octets).unwrap().lock_request(), expected);
        }
    }

    #[test]
    fn six_octets_are_too_short() {
        assert_eq!(SetPrm::parse(&OCTETS[..6]), Err(SetPrmError::TooShort { got: 6 }));
    }

    #[test]
    fn a_small_buffer_is_refused() {
        let prm = SetPrm::parse(&OCTETS).unwrap();
        assert!(prm.encode(&mut [0; 9]).is_err());
    }

    #[test]
    fn sync_freeze_and_watchdog_are_bits_5_4_and_3() {
        let mut octets = OCTETS;
        for (status, sync, freeze, watchdog) in [
            (0x20, true, false, false),
            (0x10, false, true, false),
            (0x08, false, false, true),
            (0xC7, false, false, false),
        ] {
            octets[0] = status;
            let prm = SetPrm::parse(&octets).unwrap();
            let got = (prm.sync_requested(), prm.freeze_requested(), prm.watchdog_on());
            assert_eq!(got, (sync, freeze, watchdog), "{status:02X}");
            assert_eq!(prm.watchdog().is_some(), watchdog);
        }
        // A factor of 0 is no time.
        octets[..2].copy_from_slice(&[0x08, 0]);
        assert_eq!(SetPrm::parse(&octets).unwrap().watchdog(), None);
    }

    #[test]
    fn the_longest_fits_a_telegram_and_no_longer_one_is_made_or_read() {
        let user = [0; 238];
        let mut buf = [0; 256];
        let mut prm = SetPrm::parse(&OCTETS).unwrap();
        prm.user = &user[..237];
        assert_eq!(prm.encode(&mut buf), Ok(244));
        assert_eq!(SetPrm::parse(&buf[..244]), Ok(prm));
        assert_eq!(SetPrm::parse(&buf[..245]), Err(SetPrmError::TooLong { got: 245 }));
        prm.user = &user;
        assert_eq!(prm.encode(&mut buf), Err(SetPrmError::TooLong { got: 245 }));
    }
}
