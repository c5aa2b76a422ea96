//! MSAC1 at the slave: data records for the master that parametrised it.
//!
//! The way exists while that master exchanges data and has set DPV1_Enable; to everybody else, and at all other times, the access point
//! does not (RS). One request is under way at a time.
//!
//! | state | telegram at access point 51 | answer | next |
//! |---|---|---|---|
//! | Idle, Ready | request | `E5` | Working; an answer nobody fetched is forgotten, its master began anew |
//! | Idle, Ready | unusable request | `E5` | Ready, with a refusal |
//! | Idle | poll (no data) | `E5` | Idle |
//! | Working | poll | `E5` | Working |
//! | Working | request | RR | Working |
//! | Working | – the application answers | – | Ready |
//! | Working | – C1_Response_Timeout passes | – | Ready, with "resource busy" |
//! | Ready | poll | the answer | Idle |
//!
//! Source: IEC 61158-6-3, MSAC1S.

use super::error::{ErrorCode1, V1Error};
use super::function::{Function, NEGATIVE};
use super::pdu::{MAX_V1_DATA, PduError, Request};
use super::service::{Answer, Held, Pdu, RESERVED_SLOT, V1RequestGone, answer_with};
use crate::dp::MAX_DATA;
use crate::time::{Duration, Instant};

/// The way of the parametrising master.
#[derive(Debug, Clone)]
pub(super) enum Msac1 {
    /// No data exchange, or DPV1_Enable not set.
    Closed,
    /// Nothing under way.
    Idle,
    /// The application works until `until` at most.
    Working { request: Held, until: Instant },
    /// The answer waits to be fetched.
    Ready { reply: Pdu },
}

impl Msac1 {
    /// A telegram at access point 51 from the parametrising master; acknowledgements of alarms are taken out before.
    pub(super) fn handle(
        &mut self,
        now: Instant,
        data: &[u8],
        serial: u32,
        timeout: Duration,
        scratch: &mut [u8; MAX_DATA],
    ) -> Answer {
        match (&*self, data.is_empty()) {
            (Self::Closed, _) => Answer::NoService,
            (Self::Idle | Self::Working { .. }, true) => Answer::Acknowledge,
            (Self::Working { .. }, false) => Answer::NoResource,
            (Self::Ready { reply }, true) => {
                let answer = answer_with(reply, scratch);
                *self = Self::Idle;
                answer
            }
            (Self::Idle | Self::Ready { .. }, false) => {
                *self = Self::begin(now + timeout, data, serial);
                Answer::Acknowledge
            }
        }
    }

    /// Working on a request, or ready with its refusal.
    fn begin(until: Instant, data: &[u8], serial: u32) -> Self {
        let code = data.first().copied().unwrap_or_default();
        let code_1 = match Request::parse(data) {
            Ok(Request::Read { slot, .. } | Request::Write { slot, .. }) if slot == RESERVED_SLOT => {
                ErrorCode1::INVALID_SLOT
            }
            Ok(request @ (Request::Read { .. } | Request::Write { .. })) => match Held::new(serial, &request) {
                Some(request) => return Self::Working { request, until },
                None => ErrorCode1::WRITE_LENGTH_ERROR,
            },
            Err(PduError::Length { function, .. }) => match function {
                Function::Write => ErrorCode1::WRITE_LENGTH_ERROR,
                _ => ErrorCode1::INVALID_PARAMETER,
            },
            // A service of MSAC2, or none at all.
            Ok(_) | Err(_) => ErrorCode1::FEATURE_NOT_SUPPORTED,
        };
        // The function code may be one without a name.
        let octets = [code | NEGATIVE, V1Error::DPV1, code_1.0, 0];
        let reply = Pdu::from_slice(&octets).unwrap_or(Pdu::EMPTY);
        Self::Ready { reply }
    }

    pub(super) fn respond(&mut self, serial: u32, answer: Result<&[u8], V1Error>) -> Result<(), V1RequestGone> {
        match self {
            Self::Working { request, .. } if request.serial == serial => {
                let reply = request.reply(answer, MAX_V1_DATA as u8);
                *self = Self::Ready { reply };
                Ok(())
            }
            _ => Err(V1RequestGone),
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if let Self::Working { request, until } = self
            && *until <= now
        {
            let reply = request.reply(Err(V1Error::new(ErrorCode1::RESOURCE_BUSY)), 0);
            *self = Self::Ready { reply };
        }
    }

    pub(super) fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Working { until, .. } => Some(*until),
            _ => None,
        }
    }
}
