//! The first three user parameters of a DP-V1 slave: DPV1_Status_1 … DPV1_Status_3.
//!
//! ```text
//! octet 1  7 DPV1_Enable, 6 Fail_Safe, 5 Publisher_Enable, 2 WD_Base_1ms, 1 and 0 reserved by DP-V1 (Dis_Stop_Bit, Dis_Start_Bit)
//! octet 2  7 Enable_Pull_Plug_Alarm, 6 Enable_Process_Alarm, 5 Enable_Diagnostic_Alarm,
//!          4 Enable_Manufacturer_Specific_Alarm, 3 Enable_Status_Alarm, 2 Enable_Update_Alarm, 0 Check_Cfg_Mode
//! octet 3  7 PrmCmd, 4 IsoM_Req, 3 Prm_Structure, 2…0 Alarm_Mode
//! ```
//!
//! Source: IEC 61158-6-3, coding of Set_Prm, DPV1_Status_1 to DPV1_Status_3.

use super::alarm::{AlarmType, AlarmTypes};

/// DPV1_Status_1 … DPV1_Status_3, lossless; zero is a slave that is used as DP-V0.
///
/// # Example
///
/// A master that wants to read and write data records and to hear of diagnosis alarms, two alarms at a time:
///
/// ```
/// use dp_master::dp::v1::{AlarmMode, AlarmTypes, V1Status};
/// let status = V1Status::ENABLED.with_alarms(AlarmTypes::DIAGNOSIS, AlarmMode::Two);
/// assert_eq!(status.octets(), [0x80, 0x20, 0x01]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct V1Status(pub [u8; 3]);

impl V1Status {
    /// DPV1_Enable and nothing else.
    pub const ENABLED: Self = Self([DPV1_ENABLE, 0, 0]);

    /// From the user parameters of Set_Prm; `None` when they are less than three.
    pub fn from_user_prm(user: &[u8]) -> Option<Self> {
        user.first_chunk().copied().map(Self)
    }

    /// The three octets, to stand before all other user parameters.
    pub const fn octets(self) -> [u8; 3] {
        self.0
    }

    /// The same with alarms enabled.
    #[must_use]
    pub const fn with_alarms(self, types: AlarmTypes, mode: AlarmMode) -> Self {
        let [first, second, third] = self.0;
        Self([first, second & !ALARMS | types.0 & ALARMS, third & !0x07 | mode.code()])
    }

    /// The same with the watchdog counted in units of 1 ms instead of 10 ms.
    #[must_use]
    pub const fn with_watchdog_1ms(self) -> Self {
        let [first, second, third] = self.0;
        Self([first | WD_BASE_1MS, second, third])
    }

    /// MSAC1 and alarms are enabled.
    pub const fn enabled(self) -> bool {
        self.0[0] & DPV1_ENABLE != 0
    }

    /// In Clear the slave gets an empty output telegram.
    pub const fn fail_safe(self) -> bool {
        self.0[0] & FAIL_SAFE != 0
    }

    /// The watchdog factors count in units of 1 ms.
    pub const fn watchdog_1ms(self) -> bool {
        self.0[0] & WD_BASE_1MS != 0
    }

    /// The alarms the master wants to hear of.
    pub const fn alarms(self) -> AlarmTypes {
        AlarmTypes(self.0[1] & ALARMS)
    }

    /// The master wants this alarm.
    pub const fn wants(self, alarm: AlarmType) -> bool {
        self.enabled() && self.alarms().contains(alarm)
    }

    /// How many alarms may wait for their acknowledgement at a time.
    pub const fn alarm_mode(self) -> AlarmMode {
        AlarmMode::from_code(self.0[2])
    }
}

/// Alarm_Mode: how many alarms may wait for their acknowledgement at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AlarmMode {
    /// 0: one of each type; their sequence number is 0.
    OneOfEachType,
    /// 1: two in all.
    Two,
    /// 2: four in all.
    Four,
    /// 3: eight in all.
    Eight,
    /// 4: twelve in all.
    Twelve,
    /// 5: sixteen in all.
    Sixteen,
    /// 6: 24 in all.
    TwentyFour,
    /// 7: 32 in all.
    ThirtyTwo,
}

impl AlarmMode {
    /// From bits 2…0 of DPV1_Status_3; the others are ignored.
    pub const fn from_code(code: u8) -> Self {
        match code & 0x07 {
            0 => Self::OneOfEachType,
            1 => Self::Two,
            2 => Self::Four,
            3 => Self::Eight,
            4 => Self::Twelve,
            5 => Self::Sixteen,
            6 => Self::TwentyFour,
            _ => Self::ThirtyTwo,
        }
    }

    /// The code, 0…7.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// How many alarms in all; `None` when only their types limit them.
    pub const fn limit(self) -> Option<usize> {
        match self {
            Self::OneOfEachType => None,
            Self::Two => Some(2),
            Self::Four => Some(4),
            Self::Eight => Some(8),
            Self::Twelve => Some(12),
            Self::Sixteen => Some(16),
            Self::TwentyFour => Some(24),
            Self::ThirtyTwo => Some(32),
        }
    }
}

const DPV1_ENABLE: u8 = 0x80;
const FAIL_SAFE: u8 = 0x40;
const WD_BASE_1MS: u8 = 0x04;
/// The bits of DPV1_Status_2 that enable alarms.
const ALARMS: u8 = 0xFC;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_user_parameters_say_nothing() {
        assert_eq!(V1Status::from_user_prm(&[0x80, 0x00]), None);
        assert_eq!(
            V1Status::from_user_prm(&[0x80, 0x00, 0x00, 0x55]),
            Some(V1Status::ENABLED)
        );
    }

    #[test]
    fn each_alarm_has_its_bit() {
        // IEC 61158-6-3, DPV1_Status_2; types 1…6 and 32…126.
        for (alarm, bit) in [
            (1, 0x20),
            (2, 0x40),
            (3, 0x80),
            (4, 0x80),
            (5, 0x08),
            (6, 0x04),
            (32, 0x10),
        ] {
            let alarm = AlarmType(alarm);
            assert!(V1Status([0x80, bit, 0]).wants(alarm), "{alarm:?}");
            assert!(!V1Status([0x80, !bit, 0]).wants(alarm), "{alarm:?}");
            assert!(!V1Status([0x00, bit, 0]).wants(alarm), "without DPV1_Enable: {alarm:?}");
        }
    }

    #[test]
    fn the_alarm_modes_are_those_of_the_standard() {
        let limits: Vec<_> = (0..8).map(|code| AlarmMode::from_code(code).limit()).collect();
        let expected = [None, Some(2), Some(4), Some(8), Some(12), Some(16), Some(24), Some(32)];
        assert_eq!(limits, expected);
        for code in 0..8 {
            assert_eq!(AlarmMode::from_code(code).code(), code);
        }
    }

    /// IEC 61158-6-3: DPV1_Status_1 bit 7 DPV1_Enable, bit 6 Fail_Safe, bit 2 WD_Base_1ms; DPV1_Status_2 bits 7…2 alarms;
    /// DPV1_Status_3 bits 2…0 Alarm_Mode.
    #[test]
    fn what_is_set_leaves_the_other_bits_as_they_are() {
        let every = V1Status([0xFF; 3]).with_alarms(AlarmTypes::DIAGNOSIS, AlarmMode::Two);
        assert_eq!(every.octets(), [0xFF, 0x23, 0xF9]);
        let none = V1Status([0; 3]).with_alarms(AlarmTypes(0xFF), AlarmMode::ThirtyTwo);
        assert_eq!(none.octets(), [0x00, 0xFC, 0x07]);
        assert_eq!(V1Status([0x84, 1, 2]).with_watchdog_1ms().octets(), [0x84, 1, 2]);
        assert_eq!(V1Status([0x80, 1, 2]).with_watchdog_1ms().octets(), [0x84, 1, 2]);
    }

    #[test]
    fn each_bit_of_the_first_octet_is_read_alone() {
        for bit in 0..8 {
            for (octet, set) in [(1 << bit, true), (!(1 << bit), false)] {
                let status = V1Status([octet, 0xFF, 0]);
                assert_eq!(status.enabled(), (bit == 7) == set, "{octet:02X}");
                assert_eq!(status.fail_safe(), (bit == 6) == set, "{octet:02X}");
                assert_eq!(status.watchdog_1ms(), (bit == 2) == set, "{octet:02X}");
                assert_eq!(status.alarms(), AlarmTypes::ALL);
            }
        }
    }
}
