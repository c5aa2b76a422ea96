//! The alarms a slave has sent or wants to send.
//!
//! ```text
//! send ──► queued ──Slave_Diag of the master──► announced ──Alarm_Ack──► gone
//!                                             end of data exchange ──► all gone
//! ```
//!
//! A diagnosis carries one alarm at a time. Source: IEC 61158-6-3, MSAL1S.

use super::alarm::{AddAck, Alarm, AlarmAck, AlarmSpecifier, AlarmType, Incident, MAX_ALARM_DATA};
use super::status::V1Status;
use super::{AlarmTypes, V1Capabilities};
use crate::dp::Octets;

/// Most alarms of one slave that wait at a time; Alarm_Mode may allow fewer.
pub const MAX_ALARMS: usize = 8;

/// Why an alarm was not sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SendAlarmError {
    /// The slave does not have this alarm.
    #[error("alarm type {}: the slave does not declare it", alarm_type.0)]
    Unsupported {
        /// The type.
        alarm_type: AlarmType,
    },
    /// The master has not enabled it, or does not exchange data.
    #[error("alarm type {}: not enabled by a master", alarm_type.0)]
    NotEnabled {
        /// The type.
        alarm_type: AlarmType,
    },
    /// As many alarms as Alarm_Mode allows wait for their acknowledgement.
    #[error("{waiting} alarms wait for their acknowledgement; more are not allowed")]
    TooMany {
        /// How many.
        waiting: usize,
    },
    /// More data than an alarm block takes.
    #[error("alarm data: expected at most {MAX_ALARM_DATA} octets, got {got}")]
    DataTooLong {
        /// Octets given.
        got: usize,
    },
}

/// Where an alarm stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Progress {
    Queued,
    Announced,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    alarm_type: AlarmType,
    slot: u8,
    specifier: AlarmSpecifier,
    data: Octets<MAX_ALARM_DATA>,
    progress: Progress,
}

impl Entry {
    fn alarm(&self) -> Alarm<'_> {
        Alarm {
            alarm_type: self.alarm_type,
            slot: self.slot,
            specifier: self.specifier,
            data: &self.data,
        }
    }
}

/// Alarms in the order of sending.
#[derive(Debug, Clone)]
pub(super) struct Alarms {
    entries: [Option<Entry>; MAX_ALARMS],
    next_sequence: u8,
}

impl Alarms {
    pub(super) const NONE: Self = Self {
        entries: [None; MAX_ALARMS],
        next_sequence: 0,
    };

    pub(super) fn clear(&mut self) {
        *self = Self::NONE;
    }

    /// Queues an alarm; what is returned will acknowledge it.
    pub(super) fn send(
        &mut self,
        capabilities: &V1Capabilities,
        status: V1Status,
        (alarm_type, slot): (AlarmType, u8),
        (incident, add_ack): (Incident, AddAck),
        data: &[u8],
    ) -> Result<AlarmAck, SendAlarmError> {
        if !AlarmTypes::contains(capabilities.alarms, alarm_type) {
            return Err(SendAlarmError::Unsupported { alarm_type });
        }
        if !status.wants(alarm_type) {
            return Err(SendAlarmError::NotEnabled { alarm_type });
        }
        let Some(data) = Octets::from_slice(data) else {
            return Err(SendAlarmError::DataTooLong { got: data.len() });
        };
        let waiting = self.entries.iter().flatten().count();
        let too_many = SendAlarmError::TooMany { waiting };
        let sequence = match status.alarm_mode().limit() {
            Some(limit) if waiting < limit => self.free_sequence(),
            None if !self
                .entries
                .iter()
                .flatten()
                .any(|entry| entry.alarm_type == alarm_type) =>
            {
                0
            }
            _ => return Err(too_many),
        };
        let place = self.entries.get_mut(waiting).ok_or(too_many)?;
        let specifier = AlarmSpecifier {
            sequence,
            add_ack,
            incident,
        };
        let entry = place.insert(Entry {
            alarm_type,
            slot,
            specifier,
            data,
            progress: Progress::Queued,
        });
        let ack = entry.alarm().ack();
        self.next_sequence = (sequence + 1) % SEQUENCES;
        Ok(ack)
    }

    /// There are fewer alarms than numbers, so one is free.
    fn free_sequence(&self) -> u8 {
        let used = |sequence| {
            self.entries
                .iter()
                .flatten()
                .any(|entry| entry.specifier.sequence == sequence)
        };
        (0..SEQUENCES)
            .map(|step| (self.next_sequence + step) % SEQUENCES)
            .find(|&sequence| !used(sequence))
            .unwrap_or(0)
    }

    /// An alarm waits for a diagnosis to carry it.
    pub(super) fn is_queued(&self) -> bool {
        self.entries
            .iter()
            .flatten()
            .any(|entry| entry.progress == Progress::Queued)
    }

    /// The oldest queued alarm as a block at the front of `target`; it counts as announced then.
    pub(super) fn announce(&mut self, target: &mut [u8]) -> usize {
        let queued = self
            .entries
            .iter_mut()
            .flatten()
            .find(|entry| entry.progress == Progress::Queued);
        let Some(entry) = queued else { return 0 };
        let Some(len) = entry.alarm().encode(target) else {
            return 0;
        };
        entry.progress = Progress::Announced;
        len
    }

    /// Takes an acknowledged alarm out. Type, slot and sequence number name it.
    pub(super) fn acknowledge(&mut self, ack: AlarmAck) -> Option<AlarmAck> {
        let is_meant = |entry: &Entry| {
            entry.progress == Progress::Announced
                && entry.alarm_type == ack.alarm_type
                && entry.slot == ack.slot
                && entry.specifier.sequence == ack.specifier.sequence
        };
        let place = self
            .entries
            .iter()
            .position(|entry| entry.as_ref().is_some_and(is_meant))?;
        let acknowledged = self.entries.get_mut(place)?.take()?;
        // The others close up, so that the order and the free places stay at their ends.
        self.entries.get_mut(place..)?.rotate_left(1);
        Some(acknowledged.alarm().ack())
    }

    /// How many alarms wait, queued or announced.
    pub(super) fn waiting(&self) -> usize {
        self.entries.iter().flatten().count()
    }
}

/// Sequence numbers are 0…31.
const SEQUENCES: u8 = 32;
