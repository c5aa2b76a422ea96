//! Abort: either side ends an MSAC2 connection and says why.

use core::fmt;

/// Why a connection ends.
///
/// ```text
/// octet 1  58        octet 2  Subnet
/// octet 3  Instance_Reason_Code: instance (bits 5, 4), reason (bits 3…0), bits 7 and 6 reserved
/// ```
///
/// Interpretation: Additional_Detail belongs to the service, not to the PDU; octets behind the third are ignored when read and none is
/// written, as slave firmware does. Source: IEC 61158-6-3, Abort-REQ-PDU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[error("aborted by {instance}: {}", self.reason_name())]
pub struct Abort {
    /// Octet 2: where the abort began, seen from the one that is told. 0 no information, 1 local, 2 remote; others reserved.
    pub subnet: u8,
    /// Bits 5 and 4 of octet 3: which layer.
    pub instance: Instance,
    /// Bits 3…0 of octet 3: its reason; those of [`Instance::Msac2`] are the constants of [`reason`].
    pub reason: u8,
}

/// The layer that ended a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Instance {
    /// 0: the data link layer; the reason is the code of its response.
    Fdl,
    /// 1: the machine of the connection.
    Msac2,
    /// 2: the application.
    User,
    /// 3: reserved.
    Reserved,
}

impl fmt::Display for Instance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fdl => "FDL",
            Self::Msac2 => "MSAC2",
            Self::User => "the application",
            Self::Reserved => "a reserved instance",
        })
    }
}

/// Reasons of [`Instance::Msac2`], and those of [`Instance::Fdl`] that a master finds by itself.
///
/// Source: IEC 61158-6-3, coding of Reason_Code; the list stands in the manuals of masters (ProSoft MVI69-PDPMV1, page 123).
pub mod reason {
    /// ABT_SE: a service that this state does not allow.
    pub const SEQUENCE: u8 = 1;
    /// ABT_FE: an invalid request PDU.
    pub const INVALID_REQUEST: u8 = 2;
    /// ABT_TO: the connection timed out.
    pub const TIMEOUT: u8 = 3;
    /// ABT_RE: an invalid response PDU.
    pub const INVALID_RESPONSE: u8 = 4;
    /// ABT_IV: an invalid service of the application.
    pub const INVALID_SERVICE: u8 = 5;
    /// ABT_STO: the Send_Timeout asked for is too small.
    pub const SEND_TIMEOUT: u8 = 6;
    /// ABT_IA: invalid additional address information.
    pub const INVALID_ADDRESS: u8 = 7;
    /// ABT_OC: waiting for the confirmation of FDL.
    pub const AWAITS_FDL: u8 = 8;
    /// ABT_RES: no resource.
    pub const RESOURCE: u8 = 15;
    /// DS of FDL: the own station is not in the ring.
    pub const FDL_NOT_IN_RING: u8 = 14;
    /// NA of FDL: the other station does not answer.
    pub const FDL_NO_ANSWER: u8 = 15;
}

impl Abort {
    /// Ended by the machine of the connection, for one of the [`reason`]s.
    pub const fn msac2(reason: u8) -> Self {
        Self {
            subnet: 0,
            instance: Instance::Msac2,
            reason: reason & 0x0F,
        }
    }

    /// Ended by the application, for a reason of its own, 0…15.
    pub const fn user(reason: u8) -> Self {
        Self {
            subnet: 0,
            instance: Instance::User,
            reason: reason & 0x0F,
        }
    }

    /// Ended by the data link layer; the reason is the code of its response, or one of the [`reason`]s that begin with FDL.
    pub const fn fdl(reason: u8) -> Self {
        Self {
            subnet: 0,
            instance: Instance::Fdl,
            reason: reason & 0x0F,
        }
    }

    /// Octets 2 and 3.
    pub const fn octets(self) -> [u8; 2] {
        let instance = match self.instance {
            Instance::Fdl => 0x00,
            Instance::Msac2 => 0x10,
            Instance::User => 0x20,
            Instance::Reserved => 0x30,
        };
        [self.subnet, instance | self.reason & 0x0F]
    }

    /// From octets 2 and 3; the reserved bits 7 and 6 are ignored.
    pub const fn from_octets([subnet, instance_reason]: [u8; 2]) -> Self {
        Self {
            subnet,
            instance: match instance_reason >> 4 & 0x03 {
                0 => Instance::Fdl,
                1 => Instance::Msac2,
                2 => Instance::User,
                _ => Instance::Reserved,
            },
            reason: instance_reason & 0x0F,
        }
    }

    /// What the reason means, as far as the standard says.
    pub const fn reason_name(&self) -> &'static str {
        match (self.instance, self.reason) {
            (Instance::Msac2, reason::SEQUENCE) => "service not allowed in this state (ABT_SE)",
            (Instance::Msac2, reason::INVALID_REQUEST) => "invalid request (ABT_FE)",
            (Instance::Msac2, reason::TIMEOUT) => "timeout (ABT_TO)",
            (Instance::Msac2, reason::INVALID_RESPONSE) => "invalid response (ABT_RE)",
            (Instance::Msac2, reason::INVALID_SERVICE) => "invalid service of the application (ABT_IV)",
            (Instance::Msac2, reason::SEND_TIMEOUT) => "Send_Timeout too small (ABT_STO)",
            (Instance::Msac2, reason::INVALID_ADDRESS) => "invalid additional address (ABT_IA)",
            (Instance::Msac2, reason::AWAITS_FDL) => "waiting for FDL (ABT_OC)",
            (Instance::Msac2, reason::RESOURCE) => "no resource (ABT_RES)",
            (Instance::Fdl, 1) => "user error (UE)",
            (Instance::Fdl, 2) => "no resource (RR)",
            (Instance::Fdl, 3) => "no service at this access point (RS)",
            (Instance::Fdl, reason::FDL_NOT_IN_RING) => "not in the ring (DS)",
            (Instance::Fdl, reason::FDL_NO_ANSWER) => "no answer (NA)",
            (Instance::User, _) => "a reason of its own",
            _ => "unknown reason",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instance_and_reason_share_an_octet() {
        // Instance in bits 5 and 4, reason in bits 3…0.
        assert_eq!(Abort::msac2(reason::TIMEOUT).octets(), [0x00, 0x13]);
        assert_eq!(Abort::msac2(reason::RESOURCE).octets(), [0x00, 0x1F]);
        assert_eq!(Abort::user(4).octets(), [0x00, 0x24]);
        assert_eq!(Abort::fdl(3).octets(), [0x00, 0x03]);
        for octet in 0..=0x3F {
            let octets = [2, octet];
            assert_eq!(Abort::from_octets(octets).octets(), octets);
        }
        assert_eq!(Abort::from_octets([0, 0xD3]), Abort::msac2(reason::TIMEOUT));
    }

    #[test]
    fn an_abort_tells_who_and_why() {
        let abort = Abort::msac2(reason::TIMEOUT);
        assert_eq!(abort.to_string(), "aborted by MSAC2: timeout (ABT_TO)");
    }

    /// The codes and their abbreviations: ProSoft MVI69-PDPMV1, page 123; UE, RR, RS, DS and NA: EN 50170-2, part 4, L_status.
    #[test]
    fn each_reason_has_its_code_and_its_abbreviation() {
        let msac2 = [
            (1, "ABT_SE"),
            (2, "ABT_FE"),
            (3, "ABT_TO"),
            (4, "ABT_RE"),
            (5, "ABT_IV"),
            (6, "ABT_STO"),
            (7, "ABT_IA"),
            (8, "ABT_OC"),
            (15, "ABT_RES"),
        ];
        let fdl = [(1, "UE"), (2, "RR"), (3, "RS"), (14, "DS"), (15, "NA")];
        for reason in 0..=15 {
            for (octet, known) in [(0x10 | reason, &msac2[..]), (reason, &fdl[..])] {
                let name = Abort::from_octets([0, octet]).reason_name();
                match known.iter().find(|(code, _)| *code == reason) {
                    Some((_, short)) => assert!(name.ends_with(&format!("({short})")), "{octet:02X}: {name}"),
                    None => assert_eq!(name, "unknown reason", "{octet:02X}"),
                }
            }
            assert_eq!(Abort::user(reason).reason_name(), "a reason of its own");
            assert_eq!(Abort::from_octets([0, 0x30 | reason]).reason_name(), "unknown reason");
        }
    }

    #[test]
    fn each_layer_is_named() {
        for (octet, named) in [
            (0x03, "by FDL:"),
            (0x13, "by MSAC2:"),
            (0x23, "by the application:"),
            (0x33, "by a reserved instance:"),
        ] {
            let told = Abort::from_octets([1, octet]).to_string();
            assert!(told.contains(named), "{told}");
        }
    }
}
