//! What both clients of a master share: the request they sent and the answer that belongs to it.

use super::alarm::AlarmAck;
use super::error::V1Error;
use super::function::Function;
use super::pdu::{EncodePduError, PduError, Reply, Request};
use super::service::{Pdu, V1Data};
use crate::dp::{JobFailure, MAX_DATA, SubmitError};

/// A positive answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box the data")]
pub enum V1Answer {
    /// The data record, or the data of a Data_Transport.
    Data {
        /// Slot.
        slot: u8,
        /// Index.
        index: u8,
        /// As many octets as there were, at most as many as were asked for.
        data: V1Data,
    },
    /// The data record was written.
    Written {
        /// Slot.
        slot: u8,
        /// Index.
        index: u8,
        /// Octets that were taken.
        length: u8,
    },
    /// The alarm is acknowledged.
    AlarmAcknowledged(AlarmAck),
}

/// Why a request brought no positive answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum V1Failure {
    /// The slave refused it.
    #[error("refused: {0}")]
    Refused(V1Error),
    /// It did not get through, or no answer came in time.
    #[error(transparent)]
    Job(#[from] JobFailure),
    /// The answer is no PDU.
    #[error("the answer: {0}")]
    Unreadable(PduError),
    /// The answer is one to another request.
    #[error("the answer belongs to {got:?}, asked was {asked:?}, or to another slot or index")]
    Mismatch {
        /// Function of the request.
        asked: Function,
        /// Function of the answer.
        got: Function,
    },
}

/// Why a request was not begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum V1ClientError {
    /// The one before has not ended.
    #[error("a request is under way; wait for its answer")]
    Busy,
    /// The connection is not open.
    #[error("the connection is not open")]
    NotOpen,
    /// The connection is not closed.
    #[error("the connection is not closed")]
    NotClosed,
    /// Too much data.
    #[error("the request: {0}")]
    Data(#[from] EncodePduError),
    /// The master did not take it.
    #[error(transparent)]
    Submit(#[from] SubmitError),
}

/// A request on its way, as much of it as its answer has to repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Asked {
    function: Function,
    slot: u8,
    index: u8,
}

impl Asked {
    pub(super) const fn new(request: &Request<'_>) -> Self {
        let (slot, index) = match *request {
            Request::Read { slot, index, .. }
            | Request::Write { slot, index, .. }
            | Request::DataTransport { slot, index, .. } => (slot, index),
            Request::AlarmAck(ack) => (ack.slot, ack.alarm_type.0),
            Request::Idle | Request::Initiate(_) | Request::Abort(_) => (0, 0),
        };
        Self {
            function: request.function(),
            slot,
            index,
        }
    }

    /// The answer to this request.
    pub(super) fn answer(self, reply: &Reply<'_>) -> Result<V1Answer, V1Failure> {
        let asked = self.function;
        let (got, place, answer) = match *reply {
            Reply::Negative { function, error } if function == asked => return Err(V1Failure::Refused(error)),
            Reply::Negative { function, .. } => (function, (0, 0), None),
            Reply::Read { slot, index, data } => (Function::Read, (slot, index), data_answer(slot, index, data)),
            Reply::DataTransport { slot, index, data } => {
                (Function::DataTransport, (slot, index), data_answer(slot, index, data))
            }
            Reply::Written { slot, index, length } => {
                let answer = V1Answer::Written { slot, index, length };
                (Function::Write, (slot, index), Some(answer))
            }
            Reply::AlarmAck(ack) => {
                let place = (ack.slot, ack.alarm_type.0);
                (Function::AlarmAck, place, Some(V1Answer::AlarmAcknowledged(ack)))
            }
            Reply::Idle => (Function::Idle, (0, 0), None),
            Reply::Resource(_) => (Function::ResourceManager, (0, 0), None),
            Reply::Initiated(_) => (Function::Initiate, (0, 0), None),
            Reply::Abort(_) => (Function::Abort, (0, 0), None),
        };
        answer
            .filter(|_| got == asked && place == (self.slot, self.index))
            .ok_or(V1Failure::Mismatch { asked, got })
    }
}

fn data_answer(slot: u8, index: u8, data: &[u8]) -> Option<V1Answer> {
    let data = V1Data::from_slice(data)?;
    Some(V1Answer::Data { slot, index, data })
}

/// The octets of a request.
pub(super) fn request_pdu(request: &Request<'_>) -> Result<Pdu, EncodePduError> {
    let mut octets = [0; MAX_DATA];
    let got = request.encode(&mut octets)?;
    let too_long = EncodePduError { max: MAX_DATA, got };
    Pdu::from_slice(octets.get(..got).unwrap_or(&[])).ok_or(too_long)
}
