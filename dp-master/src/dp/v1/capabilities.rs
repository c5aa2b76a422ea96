//! What a slave can do of DP-V1, as its GSD file says.

use super::alarm::AlarmTypes;
use super::initiate::SendTimeout;
use super::pdu::MAX_V1_DATA;
use crate::dp::Support;
use crate::time::Duration;

/// What a slave can do of DP-V1; the keywords are those of its GSD file.
///
/// With neither data records, alarms nor the 1 ms watchdog it is a DP-V0 slave towards the master of class 1: its user parameters are its own
/// and are not read as [`V1Status`](super::V1Status). MSAC2 does not depend on them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct V1Capabilities {
    /// C1_Read_Write_supp: the parametrising master reads and writes data records (MSAC1).
    pub c1_read_write: Support,
    /// C1_Response_Timeout: a request which the application has not answered in this time is answered with "resource busy". Default 1 s.
    pub c1_response_timeout: Duration,
    /// Diagnostic_Alarm_supp … Update_Alarm_supp: alarms the slave can send.
    pub alarms: AlarmTypes,
    /// WD_Base_1ms_supp: the watchdog may count in units of 1 ms.
    pub watchdog_1ms: Support,
    /// C2_Max_Count: connections of masters of class 2 at a time (MSAC2), 0…[`MAX_CONNECTIONS`]. More are cut.
    pub c2_connections: u8,
    /// C2_Max_Data_Len: most octets of data in a PDU of a connection, at most 240. Default 240.
    pub c2_max_data: u8,
    /// C2_Min_Send_Timeout; `None` takes [`SendTimeout::least`] of the baud rate.
    pub c2_send_timeout: Option<SendTimeout>,
    /// Profile_Ident_Number told when a connection opens; 0 = none.
    pub profile_ident: u16,
    /// Profile_Features_Supported told when a connection opens.
    pub profile_features: u16,
}

impl V1Capabilities {
    /// A DP-V0 slave.
    pub const NONE: Self = Self {
        c1_read_write: Support::Unsupported,
        c1_response_timeout: Duration::from_millis(1_000),
        alarms: AlarmTypes::NONE,
        watchdog_1ms: Support::Unsupported,
        c2_connections: 0,
        c2_max_data: MAX_V1_DATA as u8,
        c2_send_timeout: None,
        profile_ident: 0,
        profile_features: 0,
    };

    /// Whether the first three user parameters are DPV1_Status_1 … 3.
    pub const fn has_status(&self) -> bool {
        matches!(self.c1_read_write, Support::Supported)
            || matches!(self.watchdog_1ms, Support::Supported)
            || self.alarms.0 != 0
    }
}

impl Default for V1Capabilities {
    fn default() -> Self {
        Self::NONE
    }
}

/// Most MSAC2 connections of one slave; each has its own buffers, held in place.
pub const MAX_CONNECTIONS: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    /// Records, alarms or the 1 ms watchdog: each of them needs DPV1_Status; connections need nothing of it.
    #[test]
    fn each_capability_of_class_1_alone_makes_user_parameters_of_dp_v1() {
        let none = V1Capabilities::NONE;
        let c1_read_write = Support::Supported;
        let watchdog_1ms = Support::Supported;
        let alarms = AlarmTypes::UPDATE;
        for (capabilities, has_status) in [
            (none, false),
            (V1Capabilities { c1_read_write, ..none }, true),
            (V1Capabilities { watchdog_1ms, ..none }, true),
            (V1Capabilities { alarms, ..none }, true),
            (
                V1Capabilities {
                    c2_connections: 2,
                    ..none
                },
                false,
            ),
        ] {
            assert_eq!(capabilities.has_status(), has_status, "{capabilities:?}");
        }
    }
}
