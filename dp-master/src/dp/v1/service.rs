//! What the application of a slave is asked, and how its answer becomes a PDU.

use super::error::{ErrorCode1, V1Error};
use super::pdu::{MAX_V1_DATA, Reply, Request};
use crate::address::Address;
use crate::dp::{MAX_DATA, Octets};

/// The data of a record, at most 240 octets.
pub type V1Data = Octets<MAX_V1_DATA>;

/// Over which way a request came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum V1Channel {
    /// From the master that parametrised the slave (MSAC1).
    Msac1,
    /// From a master of class 2 (MSAC2).
    Msac2 {
        /// The access point of the connection, 0…48; it identifies the connection while that lasts.
        sap: u8,
    },
}

/// Names a request until it was answered or given up; no other request ever has the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct V1RequestId {
    pub(super) channel: V1Channel,
    pub(super) serial: u32,
}

impl V1RequestId {
    /// Over which way the request came.
    pub const fn channel(self) -> V1Channel {
        self.channel
    }
}

/// A request for the application.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct V1Request {
    /// Its name, for the answer.
    pub id: V1RequestId,
    /// Who asks.
    pub master: Address,
    /// What is asked.
    pub service: V1Service,
}

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum V1Service {
    /// Give the data record.
    Read {
        /// Slot, 0…254.
        slot: u8,
        /// Index, 0…255.
        index: u8,
        /// Most octets wanted; an answer that is longer is cut.
        length: u8,
    },
    /// Take the data record; the data of the answer are ignored.
    Write {
        /// Slot, 0…254.
        slot: u8,
        /// Index, 0…255.
        index: u8,
        /// The record.
        data: V1Data,
    },
    /// Take data and give others (MSAC2 only).
    DataTransport {
        /// Slot, 0…254.
        slot: u8,
        /// Index, 0…255.
        index: u8,
        /// The data.
        data: V1Data,
    },
}

/// The answer does not belong to a request that waits for one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the request was answered, timed out or given up")]
pub struct V1RequestGone;

/// A PDU as octets.
pub(super) type Pdu = Octets<MAX_DATA>;

/// A request that waits for the application.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    pub(super) serial: u32,
    pub(super) service: V1Service,
    /// The application knows.
    pub(super) told: bool,
}

impl Held {
    /// `None` for a request that is no affair of the application.
    pub(super) fn new(serial: u32, request: &Request<'_>) -> Option<Self> {
        let service = match *request {
            Request::Read { slot, index, length } => V1Service::Read { slot, index, length },
            Request::Write { slot, index, data } => V1Service::Write {
                slot,
                index,
                data: V1Data::from_slice(data)?,
            },
            Request::DataTransport { slot, index, data } => V1Service::DataTransport {
                slot,
                index,
                data: V1Data::from_slice(data)?,
            },
            _ => return None,
        };
        Some(Self {
            serial,
            service,
            told: false,
        })
    }

    /// The answer as a PDU. Data beyond what was asked for, or beyond `max_data`, are cut.
    pub(super) fn reply(&self, answer: Result<&[u8], V1Error>, max_data: u8) -> Pdu {
        let cut = |data: &'_ [u8], length: u8| -> usize { data.len().min(usize::from(length.min(max_data))) };
        let reply = match (answer, self.service) {
            (Ok(data), V1Service::Read { slot, index, length }) => Reply::Read {
                slot,
                index,
                data: data.get(..cut(data, length)).unwrap_or(&[]),
            },
            (Ok(_), V1Service::Write { slot, index, ref data }) => Reply::Written {
                slot,
                index,
                // At most 240.
                length: data.len() as u8,
            },
            (Ok(data), V1Service::DataTransport { slot, index, .. }) => Reply::DataTransport {
                slot,
                index,
                data: data.get(..cut(data, MAX_V1_DATA as u8)).unwrap_or(&[]),
            },
            (Err(error), service) => Reply::Negative {
                function: service.function(),
                error,
            },
        };
        pdu(&reply)
    }
}

impl V1Service {
    const fn function(&self) -> super::Function {
        match self {
            Self::Read { .. } => super::Function::Read,
            Self::Write { .. } => super::Function::Write,
            Self::DataTransport { .. } => super::Function::DataTransport,
        }
    }

    /// Slot and index.
    pub const fn place(&self) -> (u8, u8) {
        match *self {
            Self::Read { slot, index, .. }
            | Self::Write { slot, index, .. }
            | Self::DataTransport { slot, index, .. } => (slot, index),
        }
    }
}

/// The octets of a reply; every reply made here fits.
pub(super) fn pdu(reply: &Reply<'_>) -> Pdu {
    let mut octets = [0; MAX_DATA];
    let len = reply.encode(&mut octets).unwrap_or(0);
    Pdu::from_slice(octets.get(..len).unwrap_or(&[])).unwrap_or(Pdu::EMPTY)
}

/// What FDL answers to a telegram of DP-V1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::dp) enum Answer {
    /// Short acknowledgement: taken, or nothing to say yet.
    Acknowledge,
    /// So many octets at the front of the scratch buffer.
    Data(usize),
    /// RS: not for this master, or not now.
    NoService,
    /// RR: something is still under way.
    NoResource,
}

/// Puts a PDU into the scratch buffer.
pub(super) fn answer_with(pdu: &Pdu, scratch: &mut [u8; MAX_DATA]) -> Answer {
    for (place, octet) in scratch.iter_mut().zip(pdu.iter()) {
        *place = *octet;
    }
    Answer::Data(pdu.len())
}

/// Slot 255 is reserved.
pub(super) const RESERVED_SLOT: u8 = 255;
/// Refusal of the reserved slot.
pub(super) const NO_SUCH_SLOT: V1Error = V1Error::new(ErrorCode1::INVALID_SLOT);
