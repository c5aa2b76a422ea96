//! Slave_Diag: what a slave says about itself.
//!
//! ```text
//! octet 1  station status 1: 7 Master_Lock, 6 Prm_Fault, 5 Invalid_Slave_Response, 4 Not_Supported,
//!                            3 Ext_Diag, 2 Cfg_Fault, 1 Station_Not_Ready, 0 Station_Non_Existent
//! octet 2  station status 2: 7 Deactivated, 5 Sync_Mode, 4 Freeze_Mode, 3 WD_On, 2 always 1,
//!                            1 Stat_Diag, 0 Prm_Req
//! octet 3  station status 3: 7 Ext_Diag_Overflow
//! octet 4  address of the master that parametrised, 255 = none
//! octet 5  ident number high         octet 6  ident number low
//! octet 7… extended diagnosis in blocks, at most 238 octets
//! ```
//!
//! Source: 9300 facts 1.4; IEC 61158-6-3, coding of Slave_Diag.

use super::diag_block::Blocks;
use super::image::Octets;

/// Octets of Slave_Diag before the extended diagnosis.
pub const SLAVE_DIAG_LEN: usize = 6;
/// Most octets of extended diagnosis.
pub const MAX_EXT_DIAG: usize = 244 - SLAVE_DIAG_LEN;

/// Station status 1 and 2 as one word, status 1 in the low octet; reserved bits are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StationStatus(pub u16);

impl StationStatus {
    /// The master could not reach the slave (set by the master).
    pub const STATION_NON_EXISTENT: Self = Self(0x0001);
    /// The slave is not ready for data exchange.
    pub const STATION_NOT_READY: Self = Self(0x0002);
    /// The last Chk_Cfg did not fit the slave.
    pub const CFG_FAULT: Self = Self(0x0004);
    /// The extended diagnosis reports a fault.
    pub const EXT_DIAG: Self = Self(0x0008);
    /// The master asked for something the slave does not have.
    pub const NOT_SUPPORTED: Self = Self(0x0010);
    /// A reply could not be understood (set by the master).
    pub const INVALID_SLAVE_RESPONSE: Self = Self(0x0020);
    /// The last Set_Prm was faulty: ident number, length or values.
    pub const PRM_FAULT: Self = Self(0x0040);
    /// Another master has parametrised the slave (set by the master).
    pub const MASTER_LOCK: Self = Self(0x0080);
    /// The slave waits for Set_Prm and Chk_Cfg.
    pub const PRM_REQ: Self = Self(0x0100);
    /// The slave has no valid data; the master shall read the diagnosis until the bit is gone.
    pub const STAT_DIAG: Self = Self(0x0200);
    /// Bit 2 of station status 2, always 1 from a slave.
    pub const FIXED: Self = Self(0x0400);
    /// The watchdog runs.
    pub const WD_ON: Self = Self(0x0800);
    /// Freeze is in force.
    pub const FREEZE_MODE: Self = Self(0x1000);
    /// Sync is in force.
    pub const SYNC_MODE: Self = Self(0x2000);
    /// The master does not serve the slave (set by the master).
    pub const DEACTIVATED: Self = Self(0x8000);

    /// All bits of `other` are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// At least one bit of `other` is set.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// The bits of both.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The bits of `self` that are not in `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// `self` with the bits of `other` set when `on`.
    #[must_use]
    pub(crate) const fn with_if(self, other: Self, on: bool) -> Self {
        if on { self.with(other) } else { self }
    }
}

/// Whether there was more diagnosis than fits (Ext_Diag_Overflow, bit 7 of station status 3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overflow {
    /// Everything is there.
    #[default]
    Complete,
    /// There is more than was sent.
    Truncated,
}

/// The six standard octets of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StandardDiag {
    /// Octets 1 and 2.
    pub status: StationStatus,
    /// Octet 3 as it stands; [`overflow`](Self::overflow) reads its only defined bit.
    pub status_3: u8,
    /// Octet 4: the master that parametrised the slave; 255 = none.
    pub master: u8,
    /// Octets 5 and 6.
    pub ident: u16,
}

impl StandardDiag {
    /// Value of octet 4 when no master has parametrised the slave.
    pub const NO_MASTER: u8 = 0xFF;

    /// Whether the extended diagnosis was cut.
    pub fn overflow(&self) -> Overflow {
        if self.status_3 & EXT_DIAG_OVERFLOW != 0 {
            Overflow::Truncated
        } else {
            Overflow::Complete
        }
    }

    /// The six octets.
    pub const fn octets(&self) -> [u8; SLAVE_DIAG_LEN] {
        let [status_1, status_2] = self.status.0.to_le_bytes();
        let [high, low] = self.ident.to_be_bytes();
        [status_1, status_2, self.status_3, self.master, high, low]
    }
}

/// A diagnosis as read: standard octets and extended diagnosis.
#[doc(alias = "Diagnose")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Diagnosis {
    /// The six standard octets.
    pub standard: StandardDiag,
    /// Extended diagnosis, 0…238 octets; see [`Diagnosis::blocks`].
    pub extended: Octets<MAX_EXT_DIAG>,
}

impl Diagnosis {
    /// Reads the data unit of a Slave_Diag reply.
    ///
    /// # Errors
    ///
    /// [`SlaveDiagError::TooShort`] below six octets, [`SlaveDiagError::TooLong`] above 244.
    pub fn parse(data: &[u8]) -> Result<Self, SlaveDiagError> {
        let Some((&[status_1, status_2, status_3, master, high, low], extended)) =
            data.split_first_chunk::<SLAVE_DIAG_LEN>()
        else {
            return Err(SlaveDiagError::TooShort { got: data.len() });
        };
        let Some(extended) = Octets::from_slice(extended) else {
            return Err(SlaveDiagError::TooLong { got: data.len() });
        };
        Ok(Self {
            standard: StandardDiag {
                status: StationStatus(u16::from_le_bytes([status_1, status_2])),
                status_3,
                master,
                ident: u16::from_be_bytes([high, low]),
            },
            extended,
        })
    }

    /// Writes the data unit; returns its length.
    ///
    /// # Errors
    ///
    /// [`SlaveDiagError::TooLong`] when `buf` is too small.
    pub fn encode(&self, buf: &mut [u8]) -> Result<usize, SlaveDiagError> {
        let len = SLAVE_DIAG_LEN + self.extended.len();
        let Some((standard, extended)) = buf
            .get_mut(..len)
            .and_then(|target| target.split_first_chunk_mut::<SLAVE_DIAG_LEN>())
        else {
            return Err(SlaveDiagError::TooLong { got: len });
        };
        *standard = self.standard.octets();
        extended.copy_from_slice(&self.extended);
        Ok(len)
    }

    /// The blocks of the extended diagnosis in their order.
    pub fn blocks(&self) -> Blocks<'_> {
        Blocks::new(&self.extended)
    }
}

/// Why a Slave_Diag data unit cannot be read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SlaveDiagError {
    /// The six standard octets are not complete.
    #[error("Slave_Diag: expected at least 6 octets, got {got}")]
    TooShort {
        /// Octets there were.
        got: usize,
    },
    /// More octets than a telegram or the buffer takes.
    #[error("Slave_Diag: expected at most 244 octets and room for them, got {got}")]
    TooLong {
        /// Octets there were.
        got: usize,
    },
}

/// Ext_Diag_Overflow, bit 7 of octet 3.
pub(crate) const EXT_DIAG_OVERFLOW: u8 = 0x80;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dp::Block;

    // A slave in data exchange with master 2, watchdog on, which reports overvoltage
    // (9300 facts 1.4: header 03, then 603Fh code 0x3210).
    const TRIPPED: [u8; 9] = [0x08, 0x0C, 0x00, 0x02, 0x00, 0xDA, 0x03, 0x32, 0x10];

    #[test]
    fn a_diagnosis_with_a_device_block_is_read_and_written_back() {
        let diag = Diagnosis::parse(&TRIPPED).unwrap();
        assert!(diag.standard.status.contains(StationStatus::EXT_DIAG));
        assert!(diag.standard.status.contains(StationStatus::WD_ON));
        assert!(!diag.standard.status.intersects(StationStatus::PRM_REQ));
        assert_eq!((diag.standard.master, diag.standard.ident), (2, 0x00DA));
        let mut blocks = diag.blocks();
        assert_eq!(blocks.next(), Some(Block::Device(&[0x32, 0x10])));
        assert_eq!(blocks.next(), None);
        let mut buf = [0; 16];
        assert_eq!(diag.encode(&mut buf), Ok(9));
        assert_eq!(buf[..9], TRIPPED);
    }

    #[test]
    fn five_octets_are_too_short() {
        assert_eq!(
            Diagnosis::parse(&TRIPPED[..5]),
            Err(SlaveDiagError::TooShort { got: 5 })
        );
    }
}
