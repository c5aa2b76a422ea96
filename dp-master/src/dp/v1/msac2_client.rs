//! MSAC2 at the master: one connection to one slave, kept alive until somebody ends it.
//!
//! ```text
//!          connect             Resource                Initiate response
//!  Closed ─────────► Asking ────────────► Initiating ────────────────────► Open ◄──────────────┐
//!    ▲                 │                      │                            │  │ │              │ answer
//!    │                 │                      │                   request  │  │ └► Idling ─────┤
//!    │                 │                      │                            │  │     │ S        │
//!    │                 │                      │                            ▼  │     ▼          │
//!    │                 │                      │                        Waiting│  (queued) ─► Waiting
//!    │                 │                      │                            │  │     │
//!    └── Abort of the slave, RS, no answer ───┴────────────────────────────┴──┴─────┤
//!    └────────────────────── Aborting ◄── abort, no answer in time, what is no answer
//! ```
//!
//! S is Send_Timeout after the last answer; an answer may take 2 × Send_Timeout (timer R), see [`SendTimeout`].
//!
//! Source: IEC 61158-6-3, MSAC2M.

use super::abort::{Abort, reason};
use super::client::{Asked, V1Answer, V1ClientError, V1Failure, request_pdu};
use super::error::V1Error;
use super::initiate::{Features, Initiate, SendTimeout};
use super::pdu::{EncodePduError, MAX_V1_DATA, Reply, Request};
use super::service::Pdu;
use crate::address::Address;
use crate::dp::{JobFailure, JobId, JobOutcome, JobRequest, Jobs, SubmitError, sap};
use crate::time::{Duration, Instant};

/// What both sides agreed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Connected {
    /// Access point of the slave, 0…48.
    pub sap: u8,
    /// Send_Timeout in force.
    pub send_timeout: SendTimeout,
    /// Most octets of data in one PDU.
    pub max_data: u8,
    /// Services of the slave.
    pub features: Features,
    /// Services of the profile.
    pub profile_features: u16,
    /// The profile, 0 = none.
    pub profile_ident: u16,
}

/// What happened to a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box the data")]
pub enum Msac2Event {
    /// It is open.
    Opened(Connected),
    /// The answer to the request; after a refusal the connection goes on.
    Answer(Result<V1Answer, V1Error>),
    /// It was not opened: the slave refused Initiate.
    Rejected(V1Error),
    /// It has ended. A request that was under way may or may not have been carried out.
    Closed(Abort),
}

/// A connection of a master of class 2 to a slave.
///
/// It needs no exchange of data: any master may open one, also in [`Mode::Stop`](crate::dp::Mode::Stop).
///
/// # Order of calls
///
/// [`connect`](Self::connect); then [`step`](Self::step) after each step of the master and when [`poll_timeout`](Self::poll_timeout)
/// is due, until it has no event; a request once it is open, the next after the answer. The jobs are those of the master
/// ([`DpMaster::jobs`](crate::dp::DpMaster::jobs)), always the same.
#[derive(Debug, Clone)]
pub struct Msac2Client {
    slave: Address,
    state: State,
}

#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box the request")]
enum State {
    Closed,
    /// Initiate is at the resource manager.
    Asking {
        job: JobId,
        wanted: SendTimeout,
    },
    /// The access point is known, its response is polled for.
    Initiating {
        job: JobId,
        sap: u8,
        send_timeout: SendTimeout,
    },
    /// Nothing under way; Idle is due at `idle_at`.
    Open {
        link: Connected,
        idle_at: Instant,
    },
    /// A request is under way.
    Waiting {
        link: Connected,
        job: JobId,
        asked: Asked,
    },
    /// Idle is under way, and perhaps a request queued behind it.
    Idling {
        link: Connected,
        job: JobId,
        queued: Option<(Asked, Pdu)>,
    },
    /// The slave is told that it is over.
    Aborting {
        job: JobId,
        abort: Abort,
    },
    /// It is over; the application has to be told.
    Ended(Abort),
}

impl Msac2Client {
    /// A closed connection.
    pub const fn new(slave: Address) -> Self {
        Self {
            slave,
            state: State::Closed,
        }
    }

    /// The slave.
    pub const fn slave(&self) -> Address {
        self.slave
    }

    /// What was agreed on, while it is open.
    pub const fn connected(&self) -> Option<&Connected> {
        match &self.state {
            State::Open { link, .. } | State::Waiting { link, .. } | State::Idling { link, .. } => Some(link),
            _ => None,
        }
    }

    /// A request could be sent now.
    pub const fn is_ready(&self) -> bool {
        matches!(self.state, State::Open { .. } | State::Idling { queued: None, .. })
    }

    /// Opens the connection.
    ///
    /// # Errors
    ///
    /// [`V1ClientError::NotClosed`], [`V1ClientError::Data`] with addresses that fit into no telegram, [`V1ClientError::Submit`]; nothing
    /// was sent then.
    pub fn connect(&mut self, jobs: &mut Jobs, initiate: &Initiate<'_>) -> Result<(), V1ClientError> {
        if !matches!(self.state, State::Closed) {
            return Err(V1ClientError::NotClosed);
        }
        let pdu = request_pdu(&Request::Initiate(*initiate))?;
        let wanted = initiate.send_timeout;
        // The answer is immediate at every slave that was seen; one that is not is polled for.
        let job = self.submit(jobs, sap::MSAC2_MANAGER, &pdu, wanted.twice().max(LEAST_PATIENCE))?;
        self.state = State::Asking { job, wanted };
        Ok(())
    }

    /// Reads a data record: slot 0…254, index 0…255, at most `length` octets.
    ///
    /// # Errors
    ///
    /// [`V1ClientError::NotOpen`], [`V1ClientError::Busy`], [`V1ClientError::Submit`]; nothing was sent then.
    pub fn read(&mut self, jobs: &mut Jobs, slot: u8, index: u8, length: u8) -> Result<(), V1ClientError> {
        self.request(jobs, &Request::Read { slot, index, length }, 0)
    }

    /// Writes a data record.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read), and [`V1ClientError::Data`] above the slave's [`max_data`](Connected::max_data).
    pub fn write(&mut self, jobs: &mut Jobs, slot: u8, index: u8, data: &[u8]) -> Result<(), V1ClientError> {
        self.request(jobs, &Request::Write { slot, index, data }, data.len())
    }

    /// Sends data and asks for others.
    ///
    /// # Errors
    ///
    /// As [`write`](Self::write).
    pub fn transport(&mut self, jobs: &mut Jobs, slot: u8, index: u8, data: &[u8]) -> Result<(), V1ClientError> {
        self.request(jobs, &Request::DataTransport { slot, index, data }, data.len())
    }

    fn request(&mut self, jobs: &mut Jobs, request: &Request<'_>, got: usize) -> Result<(), V1ClientError> {
        let link = *self.connected().ok_or(V1ClientError::NotOpen)?;
        if !self.is_ready() {
            return Err(V1ClientError::Busy);
        }
        let max = usize::from(link.max_data).min(MAX_V1_DATA);
        if got > max {
            return Err(V1ClientError::Data(EncodePduError { max, got }));
        }
        let pdu = request_pdu(request)?;
        let asked = Asked::new(request);
        if let State::Idling { queued, .. } = &mut self.state {
            *queued = Some((asked, pdu));
            return Ok(());
        }
        let job = self.submit(jobs, link.sap, &pdu, link.send_timeout.twice())?;
        self.state = State::Waiting { link, job, asked };
        Ok(())
    }

    /// Ends the connection; [`Msac2Event::Closed`] follows when the slave was told. Nothing happens when it is closed.
    pub fn abort(&mut self, jobs: &mut Jobs, abort: Abort) {
        match self.state {
            State::Closed | State::Aborting { .. } | State::Ended(_) => {}
            // Where it would have been is not known; it ends there by itself.
            State::Asking { job, .. } => {
                jobs.cancel(job);
                self.state = State::Ended(abort);
            }
            State::Initiating { job, sap, .. } => {
                jobs.cancel(job);
                self.tell_abort(jobs, sap, abort);
            }
            State::Open { link, .. } => self.tell_abort(jobs, link.sap, abort),
            State::Waiting { link, job, .. } | State::Idling { link, job, .. } => {
                jobs.cancel(job);
                self.tell_abort(jobs, link.sap, abort);
            }
        }
    }

    /// When [`step`](Self::step) must be called at the latest, although no job has ended.
    pub const fn poll_timeout(&self) -> Option<Instant> {
        match self.state {
            State::Open { idle_at, .. } => Some(idle_at),
            _ => None,
        }
    }

    /// Looks what became of the jobs and keeps the connection alive; the next event.
    pub fn step(&mut self, jobs: &mut Jobs, now: Instant) -> Option<Msac2Event> {
        match self.state {
            State::Closed => None,
            State::Ended(abort) => {
                self.state = State::Closed;
                Some(Msac2Event::Closed(abort))
            }
            State::Open { link, idle_at } => {
                if idle_at <= now {
                    self.idle(jobs, now, link);
                }
                None
            }
            State::Aborting { job, abort } => {
                // Whatever it answered: it is over.
                jobs.take(job)?;
                self.state = State::Closed;
                Some(Msac2Event::Closed(abort))
            }
            State::Asking { job, wanted } => {
                let outcome = jobs.take(job)?;
                self.asked(jobs, &outcome, wanted)
            }
            State::Initiating { job, sap, send_timeout } => {
                let outcome = jobs.take(job)?;
                self.initiated(jobs, now, &outcome, sap, send_timeout)
            }
            State::Waiting { link, job, asked } => {
                let outcome = jobs.take(job)?;
                self.answered(jobs, now, &outcome, link, asked)
            }
            State::Idling { link, job, queued } => {
                let outcome = jobs.take(job)?;
                self.idled(jobs, now, &outcome, link, queued)
            }
        }
    }

    fn asked(&mut self, jobs: &mut Jobs, outcome: &JobOutcome, wanted: SendTimeout) -> Option<Msac2Event> {
        match reply(outcome) {
            Ok(Reply::Resource(resource)) => {
                let send_timeout = wanted.max(resource.send_timeout);
                self.state = match self.submit(jobs, resource.sap, &Pdu::EMPTY, send_timeout.twice()) {
                    Ok(job) => State::Initiating {
                        job,
                        sap: resource.sap,
                        send_timeout,
                    },
                    // The connection at the slave ends by itself.
                    Err(_) => State::Ended(Abort::msac2(reason::RESOURCE)),
                };
                None
            }
            Ok(Reply::Negative { error, .. }) => {
                self.state = State::Closed;
                Some(Msac2Event::Rejected(error))
            }
            Ok(Reply::Abort(abort)) => self.closed(abort),
            Ok(_) => self.closed(Abort::msac2(reason::INVALID_RESPONSE)),
            Err(end) => self.closed(end.abort()),
        }
    }

    fn initiated(
        &mut self,
        jobs: &mut Jobs,
        now: Instant,
        outcome: &JobOutcome,
        sap: u8,
        send_timeout: SendTimeout,
    ) -> Option<Msac2Event> {
        match reply(outcome) {
            Ok(Reply::Initiated(initiated)) => {
                let link = Connected {
                    sap,
                    send_timeout,
                    max_data: initiated.max_data,
                    features: initiated.features,
                    profile_features: initiated.profile_features,
                    profile_ident: initiated.profile_ident,
                };
                self.open(now, link);
                Some(Msac2Event::Opened(link))
            }
            Ok(Reply::Negative { error, .. }) => {
                // Interpretation: a refused Initiate leaves no connection behind.
                self.state = State::Closed;
                Some(Msac2Event::Rejected(error))
            }
            Ok(Reply::Abort(abort)) => self.closed(abort),
            Ok(_) => self.fail(jobs, sap, End::NoAnswer),
            Err(end) => self.fail(jobs, sap, end),
        }
    }

    fn answered(
        &mut self,
        jobs: &mut Jobs,
        now: Instant,
        outcome: &JobOutcome,
        link: Connected,
        asked: Asked,
    ) -> Option<Msac2Event> {
        let result = match reply(outcome) {
            Ok(Reply::Abort(abort)) => return self.closed(abort),
            Ok(reply) => asked.answer(&reply),
            Err(end) => return self.fail(jobs, link.sap, end),
        };
        let answer = match result {
            Ok(answer) => Ok(answer),
            Err(V1Failure::Refused(error)) => Err(error),
            Err(_) => return self.fail(jobs, link.sap, End::NoAnswer),
        };
        self.open(now, link);
        Some(Msac2Event::Answer(answer))
    }

    fn idled(
        &mut self,
        jobs: &mut Jobs,
        now: Instant,
        outcome: &JobOutcome,
        link: Connected,
        queued: Option<(Asked, Pdu)>,
    ) -> Option<Msac2Event> {
        match reply(outcome) {
            Ok(Reply::Idle) => {}
            Ok(Reply::Abort(abort)) => return self.closed(abort),
            Ok(_) => return self.fail(jobs, link.sap, End::NoAnswer),
            Err(end) => return self.fail(jobs, link.sap, end),
        }
        let Some((asked, pdu)) = queued else {
            self.open(now, link);
            return None;
        };
        match self.submit(jobs, link.sap, &pdu, link.send_timeout.twice()) {
            Ok(job) => {
                self.state = State::Waiting { link, job, asked };
                None
            }
            // The place of the job that has just ended is free.
            Err(_) => self.fail(jobs, link.sap, End::Failed(Abort::msac2(reason::RESOURCE))),
        }
    }

    fn open(&mut self, now: Instant, link: Connected) {
        let idle_at = now + link.send_timeout.time();
        self.state = State::Open { link, idle_at };
    }

    fn idle(&mut self, jobs: &mut Jobs, now: Instant, link: Connected) {
        let pdu = request_pdu(&Request::Idle).unwrap_or(Pdu::EMPTY);
        self.state = match self.submit(jobs, link.sap, &pdu, link.send_timeout.twice()) {
            Ok(job) => State::Idling {
                link,
                job,
                queued: None,
            },
            // No place for a job now; the slave allows as much time again.
            Err(_) => State::Open {
                link,
                idle_at: now + RETRY,
            },
        };
    }

    /// The connection is gone at the slave.
    fn closed(&mut self, abort: Abort) -> Option<Msac2Event> {
        self.state = State::Closed;
        Some(Msac2Event::Closed(abort))
    }

    /// The connection ends here; the slave is told unless it said so itself.
    fn fail(&mut self, jobs: &mut Jobs, sap: u8, end: End) -> Option<Msac2Event> {
        if matches!(end, End::Gone(_)) {
            return self.closed(end.abort());
        }
        self.tell_abort(jobs, sap, end.abort());
        // It could not even be told.
        match self.state {
            State::Ended(abort) => self.closed(abort),
            _ => None,
        }
    }

    fn tell_abort(&mut self, jobs: &mut Jobs, sap: u8, abort: Abort) {
        let pdu = request_pdu(&Request::Abort(abort)).unwrap_or(Pdu::EMPTY);
        let job = JobRequest::srd(self.slave, sap, sap::MSAC2_MASTER, &pdu);
        self.state = match jobs.submit(&job) {
            Ok(job) => State::Aborting { job, abort },
            Err(_) => State::Ended(abort),
        };
    }

    fn submit(&self, jobs: &mut Jobs, dsap: u8, pdu: &Pdu, within: Duration) -> Result<JobId, SubmitError> {
        jobs.submit(&JobRequest::srd(self.slave, dsap, sap::MSAC2_MASTER, pdu).polling(within))
    }
}

/// Why there is no reply.
#[derive(Debug, Clone, Copy)]
enum End {
    /// The slave is not there, or has no such connection.
    Gone(Abort),
    /// Something else failed.
    Failed(Abort),
    /// What came is no answer.
    NoAnswer,
}

impl End {
    const fn abort(self) -> Abort {
        match self {
            Self::Gone(abort) | Self::Failed(abort) => abort,
            Self::NoAnswer => Abort::msac2(reason::INVALID_RESPONSE),
        }
    }
}

fn reply(outcome: &JobOutcome) -> Result<Reply<'_>, End> {
    match outcome {
        JobOutcome::Response { data, .. } => Reply::parse(data).map_err(|_| End::NoAnswer),
        // A job that polls does not end so.
        JobOutcome::Acknowledged => Err(End::NoAnswer),
        JobOutcome::Failed(failure) => Err(match *failure {
            JobFailure::Refused(function) => End::Gone(Abort::fdl(function.code())),
            JobFailure::NoAnswer => End::Gone(Abort::fdl(reason::FDL_NO_ANSWER)),
            JobFailure::Aborted => End::Failed(Abort::fdl(reason::FDL_NOT_IN_RING)),
            JobFailure::Expired => End::Failed(Abort::msac2(reason::TIMEOUT)),
            JobFailure::Misdirected { .. } | JobFailure::TooLong { .. } => End::NoAnswer,
        }),
    }
}

/// How long the resource manager may take, whatever Send_Timeout was asked for.
const LEAST_PATIENCE: Duration = Duration::from_millis(1_000);
/// Pause before Idle is tried again when the master had no place for it.
const RETRY: Duration = Duration::from_millis(10);
