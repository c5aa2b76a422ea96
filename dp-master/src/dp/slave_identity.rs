//! Who a slave is: its address, ident number, accepted configurations and abilities.

use core::ops::RangeInclusive;

use super::cfg::{IoLengths, io_lengths};
use super::image::MAX_DATA;
use super::modules::{Slot, fit};
use super::prm::MAX_USER_PRM;
use super::v1::V1Capabilities;
use crate::address::Address;
use crate::time::{Baud, Duration};

/// Which identifier octets a slave accepts in Chk_Cfg.
#[derive(Debug, Clone, Copy)]
pub enum AcceptedConfigurations {
    /// These.
    Table(&'static [&'static [u8]]),
    /// Those that fit the slots of a modular slave.
    Modular(&'static [Slot]),
    /// Those for which the function gives lengths; for configurations with a rule instead of a list. Lengths above 244
    /// count as refused.
    Rule(fn(&[u8]) -> Option<IoLengths>),
}

impl AcceptedConfigurations {
    /// The lengths that the identifiers mean, if the slave accepts them.
    pub fn check(self, identifiers: &[u8]) -> Option<IoLengths> {
        let lengths = match self {
            Self::Table(table) if table.contains(&identifiers) => io_lengths(identifiers).ok(),
            Self::Modular(slots) if fit(slots, identifiers) => io_lengths(identifiers).ok(),
            Self::Table(_) | Self::Modular(_) => None,
            Self::Rule(rule) => rule(identifiers),
        };
        lengths.filter(|lengths| lengths.inputs <= MAX_DATA && lengths.outputs <= MAX_DATA)
    }
}

/// Whether a slave can do something optional.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// It can.
    Supported,
    /// It cannot; being asked for it is refused with Not_Supported.
    Unsupported,
}

/// Whether a slave takes its address over the bus (Set_Slave_Add).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AddressChange {
    /// No: it is set by switches, or fixed. The request is refused (RS).
    Unsupported,
    /// Yes, as long as nobody has parametrised the slave.
    Allowed,
    /// It could, but an earlier request has locked the address; the device has stored that. The request is acknowledged
    /// and ignored.
    Locked,
}

/// What becomes of the outputs when data exchange ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputsOnLeave {
    /// They become zero (the standard's way).
    Clear,
    /// They stay as they are; the device decides (9300 facts 1.5: reaction "none" goes on with the last data).
    Hold,
}

/// Who a slave is and what it accepts.
#[derive(Debug, Clone)]
pub struct SlaveIdentity {
    /// Station address, 0…126.
    pub address: Address,
    /// Ident number.
    pub ident: u16,
    /// Baud rate of the line; finding it is the driver's task.
    pub baud: Baud,
    /// Accepted configurations.
    pub configurations: AcceptedConfigurations,
    /// What Get_Cfg answers before a Chk_Cfg was accepted.
    pub real_configuration: &'static [u8],
    /// Accepted numbers of user parameter octets. Default 0…237.
    pub user_prm_len: RangeInclusive<usize>,
    /// Sync. Default supported (9300 facts 1.1).
    pub sync: Support,
    /// Freeze. Default supported (9300 facts 1.1).
    pub freeze: Support,
    /// Time between request and reply in tBIT, 11…1023: what the station needs, or Set_Prm's min Tsdr if that is
    /// longer. Default 11.
    pub min_tsdr: u16,
    /// Set_Slave_Add. Default unsupported (9300 facts 1.1).
    pub address_change: AddressChange,
    /// Outputs after data exchange. Default cleared.
    pub outputs_on_leave: OutputsOnLeave,
    /// Gaps inside a telegram which an operating system may make; zero on real hardware.
    pub latency_allowance: Duration,
    /// Data records, connections and alarms. Default none: a DP-V0 slave.
    pub v1: V1Capabilities,
}

impl SlaveIdentity {
    /// A slave with the defaults named at the fields.
    pub const fn new(address: Address, ident: u16, baud: Baud, configurations: AcceptedConfigurations) -> Self {
        let real_configuration = match configurations {
            AcceptedConfigurations::Table([first, ..]) => *first,
            _ => &[],
        };
        Self {
            address,
            ident,
            baud,
            configurations,
            real_configuration,
            user_prm_len: 0..=MAX_USER_PRM,
            sync: Support::Supported,
            freeze: Support::Supported,
            min_tsdr: 11,
            address_change: AddressChange::Unsupported,
            outputs_on_leave: OutputsOnLeave::Clear,
            latency_allowance: Duration::ZERO,
            v1: V1Capabilities::NONE,
        }
    }

    /// Checks address and reply time.
    ///
    /// # Errors
    ///
    /// [`IdentityError`], one variant a rule.
    pub fn validate(&self) -> Result<(), IdentityError> {
        if self.address.is_broadcast() {
            return Err(IdentityError::Address { got: self.address });
        }
        if !(11..=1023).contains(&self.min_tsdr) {
            return Err(IdentityError::MinTsdr { got: self.min_tsdr });
        }
        Ok(())
    }
}

/// Why an identity is no slave's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentityError {
    /// 127 is no station.
    #[error("slave address: expected 0 to 126, got {got}")]
    Address {
        /// The address.
        got: Address,
    },
    /// The reply time is out of range.
    #[error("min Tsdr of a slave: expected 11 to 1023 tBIT, got {got}")]
    MinTsdr {
        /// The value.
        got: u16,
    },
}
