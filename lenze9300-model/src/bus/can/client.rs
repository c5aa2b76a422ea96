use dp_master::time::{Duration, Instant};
use thiserror::Error;

use super::sdo::{Data, Refusal, Request, Response};
use super::{CanFrame, SdoChannel};

/// The other side of a parameter channel: one job at a time, repeated when no answer comes.
///
/// # Example
///
/// ```
/// use dp_master::time::Instant;
/// use lenze9300_model::bus::can::{CanFrame, SdoChannel, SdoClient, SdoOutcome};
/// use lenze9300_model::bus::can::sdo::Request;
///
/// let mut client = SdoClient::new(1, SdoChannel::First);
/// client.submit(Request::Read { code: 61, subcode: 0 })?;
/// let job = client.poll_transmit(Instant::ZERO).unwrap();
/// assert_eq!((job.id(), job.data()[0]), (0x601, 0x40));
/// let answer = CanFrame::new(0x581, &[0x43, 0xC2, 0x5F, 0, 0xB0, 0x8F, 0x06, 0]).unwrap();
/// client.handle_frame(&answer);
/// assert_eq!(client.poll_outcome(), Some(Ok(SdoOutcome::Value(43_0000))));
/// # Ok::<(), lenze9300_model::bus::can::SdoClientError>(())
/// ```
#[derive(Debug, Clone)]
pub struct SdoClient {
    node: u8,
    channel: SdoChannel,
    timeout: Duration,
    attempts: u8,
    state: State,
}

#[derive(Debug, Clone)]
enum State {
    Idle,
    /// The job waits to be sent; so many attempts were made before.
    ToSend {
        request: Request,
        before: u8,
    },
    /// Sent, the answer is due.
    Waiting {
        request: Request,
        before: u8,
        until: Instant,
    },
    Done(Result<SdoOutcome, SdoClientError>),
}

/// What a job brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SdoOutcome {
    /// The value that was read, raw as the bus carries it.
    Value(i32),
    /// It was written.
    Written,
}

/// Why a job brought nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SdoClientError {
    /// A job is under way.
    #[error("C{code:04}/{subcode}: a job for C{busy_with:04} is still under way on this channel")]
    Busy {
        /// Code asked for.
        code: u16,
        /// Subcode asked for.
        subcode: u8,
        /// Code of the job under way.
        busy_with: u16,
    },
    /// The drive refused.
    #[error("C{code:04}/{subcode}: {reason}")]
    Refused {
        /// Code.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// What the drive gave as reason.
        reason: Refusal,
    },
    /// Nobody answered.
    #[error(
        "C{code:04}/{subcode}: node {node} does not answer ({attempts} attempts): is it on, at this bit rate and address?"
    )]
    NoAnswer {
        /// Code.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// The node.
        node: u8,
        /// How often the job was sent.
        attempts: u8,
    },
}

impl SdoClient {
    /// A client for a node, 1…63.
    #[must_use]
    pub const fn new(node: u8, channel: SdoChannel) -> Self {
        Self {
            node,
            channel,
            timeout: Duration::from_millis(300),
            attempts: 3,
            state: State::Idle,
        }
    }

    /// How long an answer may take before the job is sent again, and how often it is sent at the most, 1 or more.
    #[must_use]
    pub const fn with_patience(mut self, timeout: Duration, attempts: u8) -> Self {
        self.timeout = timeout;
        self.attempts = if attempts == 0 { 1 } else { attempts };
        self
    }

    /// Begins a job.
    ///
    /// # Errors
    /// [`SdoClientError::Busy`].
    pub fn submit(&mut self, request: Request) -> Result<(), SdoClientError> {
        if let State::ToSend { request: busy, .. } | State::Waiting { request: busy, .. } = &self.state {
            let (code, subcode) = request.place();
            return Err(SdoClientError::Busy {
                code,
                subcode,
                busy_with: busy.place().0,
            });
        }
        self.state = State::ToSend { request, before: 0 };
        Ok(())
    }

    /// A job to read.
    ///
    /// # Errors
    /// [`SdoClientError::Busy`].
    pub fn read(&mut self, code: u16, subcode: u8) -> Result<(), SdoClientError> {
        self.submit(Request::Read { code, subcode })
    }

    /// A job to write four octets, or two for a code that has two.
    ///
    /// # Errors
    /// [`SdoClientError::Busy`].
    pub fn write(&mut self, code: u16, subcode: u8, data: Data) -> Result<(), SdoClientError> {
        self.submit(Request::Write { code, subcode, data })
    }

    /// The frame to be sent now, if there is one.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<CanFrame> {
        let State::ToSend { request, before } = self.state else {
            return None;
        };
        self.state = State::Waiting {
            request,
            before: before + 1,
            until: now + self.timeout,
        };
        Some(CanFrame::of(self.channel.request_id(self.node), request.encode(), 8))
    }

    /// When the client wants to be told the time.
    #[must_use]
    pub const fn poll_timeout(&self) -> Option<Instant> {
        match &self.state {
            State::Waiting { until, .. } => Some(*until),
            State::Idle | State::ToSend { .. } | State::Done(_) => None,
        }
    }

    /// The time.
    pub fn handle_timeout(&mut self, now: Instant) {
        let State::Waiting { request, before, until } = self.state else {
            return;
        };
        if now < until {
            return;
        }
        self.state = if before < self.attempts {
            State::ToSend { request, before }
        } else {
            let (code, subcode) = request.place();
            State::Done(Err(SdoClientError::NoAnswer {
                code,
                subcode,
                node: self.node,
                attempts: before,
            }))
        };
    }

    /// A frame of the bus. All but the answer that is waited for are passed over: another client may use the channel too, and a late
    /// answer to an earlier job is no answer to this one.
    pub fn handle_frame(&mut self, frame: &CanFrame) {
        let State::Waiting { request, .. } = &self.state else {
            return;
        };
        if frame.is_remote() || frame.id() != self.channel.response_id(self.node) {
            return;
        }
        let Ok(response) = Response::decode(frame.data()) else {
            return;
        };
        if response.place() != request.place() {
            return;
        }
        let outcome = match (request, response) {
            (Request::Read { .. }, Response::Value { data, .. }) => Ok(SdoOutcome::Value(data.value())),
            (Request::Write { .. }, Response::Written { .. }) => Ok(SdoOutcome::Written),
            (_, Response::Refused { code, subcode, reason }) => Err(SdoClientError::Refused { code, subcode, reason }),
            (Request::Read { .. }, Response::Written { .. }) | (Request::Write { .. }, Response::Value { .. }) => {
                return;
            }
        };
        self.state = State::Done(outcome);
    }

    /// What the job brought, once.
    pub fn poll_outcome(&mut self) -> Option<Result<SdoOutcome, SdoClientError>> {
        match std::mem::replace(&mut self.state, State::Idle) {
            State::Done(outcome) => Some(outcome),
            other => {
                self.state = other;
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waiting() -> SdoClient {
        let mut client = SdoClient::new(5, SdoChannel::Second).with_patience(Duration::from_millis(100), 2);
        client.read(61, 0).expect("nothing is under way");
        let frame = client.poll_transmit(Instant::ZERO).expect("the job");
        assert_eq!(frame.id(), 1605);
        client
    }

    #[test]
    fn a_job_is_repeated_and_then_given_up() {
        let mut client = waiting();
        let at = |ms| Instant::ZERO + Duration::from_millis(ms);
        assert_eq!(client.poll_timeout(), Some(at(100)));
        client.handle_timeout(at(99));
        assert!(client.poll_transmit(at(99)).is_none());
        client.handle_timeout(at(100));
        assert!(client.poll_transmit(at(100)).is_some(), "the second attempt");
        client.handle_timeout(at(200));
        let outcome = client.poll_outcome().expect("an end");
        let told = outcome.expect_err("nobody answers").to_string();
        assert!(
            told.starts_with("C0061/0: node 5 does not answer (2 attempts)"),
            "{told}"
        );
        assert!(client.poll_outcome().is_none());
    }

    #[test]
    fn answers_of_other_nodes_channels_codes_and_jobs_are_passed_over() {
        let mut client = waiting();
        let value = |id, code: u16| {
            let response = Response::Value {
                code,
                subcode: 0,
                data: Data::four(1),
            };
            CanFrame::new(id, &response.encode()).expect("a frame")
        };
        let written = Response::Written { code: 61, subcode: 0 }.encode();
        let short = CanFrame::new(1477, &[0x43]).expect("a frame");
        for frame in [
            value(1476, 61),
            value(1413, 61),
            value(1477, 62),
            CanFrame::new(1477, &written).expect("a frame"),
            short,
        ] {
            client.handle_frame(&frame);
            assert!(client.poll_outcome().is_none(), "{frame:?}");
        }
        client.handle_frame(&value(1477, 61));
        assert_eq!(client.poll_outcome(), Some(Ok(SdoOutcome::Value(1))));
    }

    #[test]
    fn one_job_at_a_time() {
        let mut client = waiting();
        let told = client.read(50, 0).expect_err("busy").to_string();
        assert!(told.contains("C0050/0: a job for C0061"), "{told}");
    }
}
