//! Alarms and status messages: how a DP-V1 slave tells what happened, inside its diagnosis.
//!
//! ```text
//! octet 1  header of a device-related block: bits 7 and 6 zero, bits 5…0 length with this octet (4…63)
//! octet 2  bit 7 = 0: Alarm_Type, bit 7 = 1: Status_Type
//! octet 3  Slot_Number
//! octet 4  Specifier: bits 7…3 Seq_Nr, bit 2 Add_Ack, bits 1 and 0 what became of the cause
//! octet 5… data, at most 59
//! ```
//!
//! Source: IEC 61158-6-3, coding of Ext_Diag_Data, Alarm-PDU and Status-PDU.

use crate::dp::{Block, Diagnosis};

/// Alarm_Type, octet 2 of an alarm, 1…126; lossless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct AlarmType(pub u8);

impl AlarmType {
    /// Something is wrong with a module or channel.
    pub const DIAGNOSIS: Self = Self(1);
    /// Something happened in the process.
    pub const PROCESS: Self = Self(2);
    /// A module was pulled.
    pub const PULL: Self = Self(3);
    /// A module was plugged.
    pub const PLUG: Self = Self(4);
    /// The state of a module changed.
    pub const STATUS: Self = Self(5);
    /// A parameter of a module changed.
    pub const UPDATE: Self = Self(6);
    /// The first of the manufacturer's own, 32…126.
    pub const VENDOR: Self = Self(32);

    /// The bit that enables it in DPV1_Status_2; 0 for a type without one.
    const fn bit(self) -> u8 {
        match self.0 {
            1 => AlarmTypes::DIAGNOSIS.0,
            2 => AlarmTypes::PROCESS.0,
            3 | 4 => AlarmTypes::PULL_PLUG.0,
            5 => AlarmTypes::STATUS.0,
            6 => AlarmTypes::UPDATE.0,
            32..=126 => AlarmTypes::VENDOR.0,
            _ => 0,
        }
    }
}

/// A set of alarm types, as DPV1_Status_2 enables them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct AlarmTypes(pub u8);

impl AlarmTypes {
    /// None.
    pub const NONE: Self = Self(0);
    /// Pull and plug.
    pub const PULL_PLUG: Self = Self(0x80);
    /// Process.
    pub const PROCESS: Self = Self(0x40);
    /// Diagnosis.
    pub const DIAGNOSIS: Self = Self(0x20);
    /// Those of the manufacturer.
    pub const VENDOR: Self = Self(0x10);
    /// Status.
    pub const STATUS: Self = Self(0x08);
    /// Update.
    pub const UPDATE: Self = Self(0x04);
    /// All of them.
    pub const ALL: Self = Self(0xFC);

    /// Both.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether the type is among them.
    pub const fn contains(self, alarm: AlarmType) -> bool {
        self.0 & alarm.bit() != 0
    }

    /// Whether all of `other` are among them.
    pub const fn contains_all(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// What became of the cause of an alarm, bits 1 and 0 of the specifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Incident {
    /// 0: not said.
    #[default]
    Unspecified,
    /// 1: it appeared, the slot is disturbed.
    Appears,
    /// 2: it disappeared, the slot is good.
    Disappears,
    /// 3: it disappeared, others remain.
    DisappearsOthersRemain,
}

/// Whether the application of the master must acknowledge too, bit 2 of the specifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AddAck {
    /// The acknowledgement is all.
    #[default]
    NotNeeded,
    /// Something more is expected of the application, e.g. a Write.
    Needed,
}

/// Octet 4 of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct AlarmSpecifier {
    /// Sequence number 0…31.
    pub sequence: u8,
    /// Add_Ack.
    pub add_ack: AddAck,
    /// What became of the cause.
    pub incident: Incident,
}

impl AlarmSpecifier {
    /// From the octet, lossless.
    pub const fn from_octet(octet: u8) -> Self {
        Self {
            sequence: octet >> 3,
            add_ack: if octet & 0x04 == 0 {
                AddAck::NotNeeded
            } else {
                AddAck::Needed
            },
            incident: match octet & 0x03 {
                0 => Incident::Unspecified,
                1 => Incident::Appears,
                2 => Incident::Disappears,
                _ => Incident::DisappearsOthersRemain,
            },
        }
    }

    /// The octet; of the sequence number the low five bits.
    pub const fn octet(self) -> u8 {
        self.sequence << 3 | (self.add_ack as u8) << 2 | self.incident as u8
    }
}

/// A device-related block in the coding of DP-V1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum V1Block<'a> {
    /// An alarm, to be acknowledged.
    Alarm(Alarm<'a>),
    /// A status message, only to be read.
    Status {
        /// Status_Type without bit 7: 1 Status_Message, 2 Modul_Status, 32…126 of the manufacturer.
        status_type: u8,
        /// Slot.
        slot: u8,
        /// Octet 4 as it stands.
        specifier: u8,
        /// Data.
        data: &'a [u8],
    },
}

impl<'a> V1Block<'a> {
    /// Reads what stands behind the header of a device-related block, as
    /// [`Block::Device`](crate::dp::Block::Device) gives it; `None` below three octets, which only a DP-V0 slave sends.
    pub fn parse(device: &'a [u8]) -> Option<Self> {
        let (&[kind, slot, specifier], data) = device.split_first_chunk()?;
        Some(if kind & STATUS_MESSAGE != 0 {
            Self::Status {
                status_type: kind & !STATUS_MESSAGE,
                slot,
                specifier,
                data,
            }
        } else {
            Self::Alarm(Alarm {
                alarm_type: AlarmType(kind),
                slot,
                specifier: AlarmSpecifier::from_octet(specifier),
                data,
            })
        })
    }
}

/// An alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Alarm<'a> {
    /// Type.
    pub alarm_type: AlarmType,
    /// Slot, 0…254.
    pub slot: u8,
    /// Sequence number and what became of the cause.
    pub specifier: AlarmSpecifier,
    /// Data, at most 59 octets.
    pub data: &'a [u8],
}

impl Alarm<'_> {
    /// Writes the block with its header; returns its length, or `None` when the data are above 59 octets or `buf` is too small.
    pub fn encode(&self, buf: &mut [u8]) -> Option<usize> {
        let len = ALARM_HEADER + self.data.len();
        if self.data.len() > MAX_ALARM_DATA {
            return None;
        }
        let (fixed, data) = buf.get_mut(..len)?.split_first_chunk_mut()?;
        // At most 63.
        *fixed = [len as u8, self.alarm_type.0, self.slot, self.specifier.octet()];
        data.copy_from_slice(self.data);
        Some(len)
    }

    /// What acknowledges it.
    pub const fn ack(&self) -> AlarmAck {
        AlarmAck {
            slot: self.slot,
            alarm_type: self.alarm_type,
            specifier: self.specifier,
        }
    }
}

/// The alarms of a diagnosis, at most one from a slave that keeps to the standard.
///
/// Only a slave with [`V1Status::enabled`](super::V1Status::enabled) codes its device-related blocks so.
pub fn alarms_of(diagnosis: &Diagnosis) -> impl Iterator<Item = Alarm<'_>> {
    diagnosis.blocks().filter_map(|block| match block {
        Block::Device(device) => match V1Block::parse(device) {
            Some(V1Block::Alarm(alarm)) => Some(alarm),
            _ => None,
        },
        _ => None,
    })
}

/// The acknowledgement of an alarm; it names the alarm by type, slot and sequence number.
///
/// ```text
/// octet 1  5C        octet 2  Slot_Number        octet 3  Alarm_Type        octet 4  Specifier
/// ```
///
/// Source: IEC 61158-6-3, Alarm_Ack-REQ-PDU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct AlarmAck {
    /// Slot.
    pub slot: u8,
    /// Type.
    pub alarm_type: AlarmType,
    /// The specifier of the alarm.
    pub specifier: AlarmSpecifier,
}

/// Most data octets of an alarm.
pub const MAX_ALARM_DATA: usize = 59;
/// Octets before the data of an alarm block.
const ALARM_HEADER: usize = 4;
/// Bit 7 of octet 2: a status message.
const STATUS_MESSAGE: u8 = 0x80;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_stands_in_the_diagnosis_as_a_device_related_block() {
        // Header 06: six octets; diagnosis alarm, slot 3, Seq_Nr 5 with Add_Ack, appeared: 5 << 3 | 4 | 1 = 2D.
        let alarm = Alarm {
            alarm_type: AlarmType::DIAGNOSIS,
            slot: 3,
            specifier: AlarmSpecifier {
                sequence: 5,
                add_ack: AddAck::Needed,
                incident: Incident::Appears,
            },
            data: &[0xAA, 0x55],
        };
        let mut buf = [0; 16];
        assert_eq!(alarm.encode(&mut buf), Some(6));
        assert_eq!(buf[..6], [0x06, 0x01, 0x03, 0x2D, 0xAA, 0x55]);

        let mut octets = [0u8; 6].to_vec();
        octets.extend(&buf[..6]);
        octets.extend([0x04, 0x81, 0x00, 0x00]);
        let diagnosis = Diagnosis::parse(&octets).unwrap();
        let blocks: Vec<_> = diagnosis
            .blocks()
            .map(|block| match block {
                Block::Device(device) => V1Block::parse(device).unwrap(),
                other => panic!("{other:?}"),
            })
            .collect();
        let status = V1Block::Status {
            status_type: 1,
            slot: 0,
            specifier: 0,
            data: &[],
        };
        assert_eq!(blocks, [V1Block::Alarm(alarm), status]);
        assert_eq!(alarms_of(&diagnosis).collect::<Vec<_>>(), [alarm]);
    }

    #[test]
    fn every_specifier_survives() {
        for octet in 0..=u8::MAX {
            assert_eq!(AlarmSpecifier::from_octet(octet).octet(), octet);
        }
    }

    /// Bits of DPV1_Status_2: 80 pull and plug, 40 process, 20 diagnosis, 10 of the manufacturer, 08 status, 04 update.
    #[test]
    fn sets_of_alarm_types_are_joined_and_compared() {
        let both = AlarmTypes::PROCESS.with(AlarmTypes::DIAGNOSIS);
        assert_eq!(both, AlarmTypes(0x60));
        assert_eq!(both.with(AlarmTypes::DIAGNOSIS), both);
        for (other, all) in [
            (AlarmTypes::NONE, true),
            (AlarmTypes::PROCESS, true),
            (both, true),
            (AlarmTypes::STATUS, false),
            (AlarmTypes::DIAGNOSIS.with(AlarmTypes::UPDATE), false),
        ] {
            assert_eq!(both.contains_all(other), all, "{other:?}");
        }
    }

    #[test]
    fn sixty_octets_of_data_do_not_fit() {
        let alarm = |data| Alarm {
            alarm_type: AlarmType::PROCESS,
            slot: 0,
            specifier: AlarmSpecifier::default(),
            data,
        };
        let data = [0; 60];
        assert_eq!(alarm(&data[..59]).encode(&mut [0; 244]), Some(63));
        assert_eq!(alarm(&data[..60]).encode(&mut [0; 244]), None);
        assert_eq!(alarm(&data[..4]).encode(&mut [0; 7]), None);
    }

    #[test]
    fn the_device_block_of_a_dp_v0_slave_is_no_alarm() {
        // 9300 facts 1.4: header 03, two octets of fault code.
        assert_eq!(V1Block::parse(&[0x32, 0x10]), None);
    }
}
