//! Initiate: how an MSAC2 connection is opened, and what both sides agree on.
//!
//! ```text
//!          request                                          positive response
//! octet 1  57                                               57
//! 2…4      reserved                                         2  Max_Len_Data_Unit
//! 5, 6     Send_Timeout, × 10 ms                            3, 4  Features_Supported
//! 7, 8     Features_Supported                               5, 6  Profile_Features_Supported
//! 9, 10    Profile_Features_Supported                       7, 8  Profile_Ident_Number
//! 11, 12   Profile_Ident_Number                             9…12  S-Type, S-Len, D-Type, D-Len
//! 13…16    S-Type, S-Len, D-Type, D-Len                     13…   S-Addr, D-Addr
//! 17…      S-Addr, D-Addr
//! ```
//!
//! Words stand with the high octet first. Source: IEC 61158-6-3, Initiate-REQ-PDU, Initiate-RES-PDU, RM-REQ-PDU.

use crate::time::{Baud, Duration};

/// A time in units of 10 ms, as both sides of a connection watch each other with.
///
/// From it follow, on both sides, in the terms of the standard:
///
/// | timer | side | runs | time |
/// |---|---|---|---|
/// | U (user) | slave | from a request to the answer of the application | Send_Timeout |
/// | F (fetch) | slave | from the answer to the poll that fetches it | Send_Timeout |
/// | I (idle) | slave | from the fetched answer to the next request | 2 × Send_Timeout |
/// | S (send) | master | from a fetched answer to the Idle it sends if it has nothing else | Send_Timeout |
/// | R (receive) | master | from a request to its answer | 2 × Send_Timeout |
///
/// Interpretation: factors as observed at slave firmware; the master's follow from them: it is never later than the slave allows,
/// and never gives up before the slave does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SendTimeout(pub u16);

impl SendTimeout {
    /// The least Send_Timeout of a slave on a line of this baud rate: 1 s from 1.5 Mbit/s on, 2 s at 500 kbit/s, 4 s below.
    ///
    /// Source: defaults of DP-V1 slave firmware.
    pub const fn least(baud: Baud) -> Self {
        Self(match baud {
            Baud::B1500000 | Baud::B3000000 | Baud::B6000000 | Baud::B12000000 => 100,
            Baud::B500000 => 200,
            _ => 400,
        })
    }

    /// As a time.
    pub const fn time(self) -> Duration {
        Duration::from_millis(10 * self.0 as u64)
    }

    /// Twice the time: what the other side may take.
    pub const fn twice(self) -> Duration {
        Duration::from_millis(20 * self.0 as u64)
    }
}

/// Features_Supported: a bit for each optional service of a connection, octet 1 in the high octet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Features(pub u16);

impl Features {
    /// Read and Write of MSAC2, bit 0 of the first octet.
    pub const READ_WRITE: Self = Self(0x0100);

    /// All bits of `other` are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// One of the two addresses of Initiate: an access point inside a device, perhaps behind another network.
///
/// ```text
/// type 0: API, SCL                                     (length 2)
/// type 1: API, SCL, network address (6), MAC address   (length 8 and more)
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DeviceAddress<'a> {
    /// Type 0: inside the device itself.
    Local {
        /// API: which process of the application; 0 is the one of the device.
        api: u8,
        /// SCL: access level.
        scl: u8,
    },
    /// Type 1: in another network.
    Remote {
        /// API.
        api: u8,
        /// SCL.
        scl: u8,
        /// Address of the network.
        network: [u8; 6],
        /// Address of the device in it; its length is the network's affair.
        mac: &'a [u8],
    },
}

impl<'a> DeviceAddress<'a> {
    /// The device itself: API 0, SCL 0.
    pub const DEVICE: Self = Self::Local { api: 0, scl: 0 };

    /// Type octet.
    pub const fn kind(&self) -> u8 {
        match self {
            Self::Local { .. } => 0,
            Self::Remote { .. } => 1,
        }
    }

    /// Octets on the wire, without type and length.
    pub const fn len(&self) -> usize {
        match self {
            Self::Local { .. } => 2,
            Self::Remote { mac, .. } => 8 + mac.len(),
        }
    }

    /// Never: an address has at least two octets.
    pub const fn is_empty(&self) -> bool {
        false
    }

    fn parse(kind: u8, octets: &'a [u8]) -> Option<Self> {
        match (kind, octets) {
            (0, &[api, scl]) => Some(Self::Local { api, scl }),
            (1, &[api, scl, a, b, c, d, e, f, ref mac @ ..]) => Some(Self::Remote {
                api,
                scl,
                network: [a, b, c, d, e, f],
                mac,
            }),
            _ => None,
        }
    }

    fn write(&self, target: &mut [u8]) {
        match (self, target) {
            (Self::Local { api, scl }, [first, second]) => (*first, *second) = (*api, *scl),
            (Self::Remote { api, scl, network, mac }, [first, second, a, b, c, d, e, f, rest @ ..])
                if rest.len() == mac.len() =>
            {
                (*first, *second) = (*api, *scl);
                [*a, *b, *c, *d, *e, *f] = *network;
                rest.copy_from_slice(mac);
            }
            // The caller gives as many octets as `len` says.
            _ => {}
        }
    }
}

/// Add_Addr_Param: where the request comes from and where it goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Addresses<'a> {
    /// S-Addr.
    pub source: DeviceAddress<'a>,
    /// D-Addr.
    pub destination: DeviceAddress<'a>,
}

impl<'a> Addresses<'a> {
    /// From a master straight to a slave.
    pub const DIRECT: Self = Self {
        source: DeviceAddress::DEVICE,
        destination: DeviceAddress::DEVICE,
    };

    /// Octets on the wire, types and lengths included.
    pub(super) const fn len(&self) -> usize {
        4 + self.source.len() + self.destination.len()
    }

    /// `None` when types, lengths and octets do not fit each other.
    pub(super) fn parse(octets: &'a [u8]) -> Option<Self> {
        let (&[s_type, s_len, d_type, d_len], rest) = octets.split_first_chunk()?;
        let (source, rest) = rest.split_at_checked(usize::from(s_len))?;
        // Interpretation: octets behind D-Addr are ignored; masters pad.
        let destination = rest.get(..usize::from(d_len))?;
        Some(Self {
            source: DeviceAddress::parse(s_type, source)?,
            destination: DeviceAddress::parse(d_type, destination)?,
        })
    }

    /// Fills `target`, which has as many octets as `len` says.
    pub(super) fn write(&self, target: &mut [u8]) -> Option<()> {
        let (fixed, rest) = target.split_first_chunk_mut()?;
        let s_len = u8::try_from(self.source.len()).ok()?;
        let d_len = u8::try_from(self.destination.len()).ok()?;
        *fixed = [self.source.kind(), s_len, self.destination.kind(), d_len];
        let (source, destination) = rest.split_at_mut_checked(self.source.len())?;
        self.source.write(source);
        self.destination.write(destination);
        Some(())
    }
}

/// What a master proposes for a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Initiate<'a> {
    /// Send_Timeout it would like; the slave's least one wins if that is longer.
    pub send_timeout: SendTimeout,
    /// Services it wants to use.
    pub features: Features,
    /// Services of the profile, coded by the profile.
    pub profile_features: u16,
    /// The profile, 0 = none.
    pub profile_ident: u16,
    /// From where to where.
    pub addresses: Addresses<'a>,
}

impl Initiate<'static> {
    /// What whoever reads and writes data records of a device at this baud rate proposes: no profile, no other network, and as short a
    /// time-out as the standard allows.
    ///
    /// ```
    /// use dp_master::dp::v1::{Features, Initiate};
    /// use dp_master::time::Baud;
    ///
    /// let initiate = Initiate::data_records(Baud::B1500000);
    /// assert_eq!((initiate.features, initiate.profile_ident), (Features::READ_WRITE, 0));
    /// ```
    #[must_use]
    pub const fn data_records(baud: Baud) -> Self {
        Self {
            send_timeout: SendTimeout::least(baud),
            features: Features::READ_WRITE,
            profile_features: 0,
            profile_ident: 0,
            addresses: Addresses::DIRECT,
        }
    }
}

/// What a slave grants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Initiated<'a> {
    /// Most octets of data in one PDU, at most 240.
    pub max_data: u8,
    /// Services it has.
    pub features: Features,
    /// Services of the profile, coded by the profile.
    pub profile_features: u16,
    /// The profile, 0 = none.
    pub profile_ident: u16,
    /// From where to where.
    pub addresses: Addresses<'a>,
}

/// The immediate answer of the resource manager at access point 49: where the connection will be.
///
/// ```text
/// octet 1  56        octet 2  Server_SAP, 0…48        octets 3, 4  least Send_Timeout, × 10 ms
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Resource {
    /// The access point of the slave at which the connection is from now on.
    pub sap: u8,
    /// Least Send_Timeout of the slave.
    pub send_timeout: SendTimeout,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feature_is_contained_when_all_its_bits_are() {
        let three = Features(0x0301);
        assert!(three.contains(Features::READ_WRITE) && three.contains(three));
        assert!(!Features::READ_WRITE.contains(three));
        assert!(!Features::default().contains(Features::READ_WRITE));
    }

    #[test]
    fn a_send_timeout_counts_in_ten_milliseconds() {
        let timeout = SendTimeout(150);
        assert_eq!(timeout.time(), Duration::from_millis(1_500));
        assert_eq!(timeout.twice(), Duration::from_millis(3_000));
    }

    #[test]
    fn an_address_is_never_empty() {
        assert!(!DeviceAddress::DEVICE.is_empty());
        assert_eq!(DeviceAddress::DEVICE.len(), 2);
    }
}
