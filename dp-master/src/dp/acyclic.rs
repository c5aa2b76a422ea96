//! Acyclic jobs of a master: one message cycle with any station, in what the DP cycle leaves over.
//!
//! ```text
//! cycle: slave 0, … slave n−1, Global_Control, one telegram of one job, token
//!
//! Waiting ──its turn──► UnderWay ──answer──► Done ──take──► free
//!    ▲                     │
//!    └── polled: no data ──┘
//! ```
//!
//! Jobs take turns in the order of submitting; one that polls goes to the back of the queue after each question, so
//! that a slow station does not keep the others waiting. A master works them in every mode, also in Stop and without
//! slaves: it is then a master of class 2.
//!
//! Source: IEC 61158-6-3 (MS2 and MM services run in the acyclic part of the cycle); IEC 61158-4-3 (SRD, FDL status).

use super::image::{MAX_DATA, Octets};
use crate::address::Address;
use crate::fdl::{Action, Outcome, Repeat};
use crate::time::{Duration, Instant};
use crate::wire::{Fcb, FunctionCode, Header, MAX_SAP, RequestFunction, ResponseFunction, StationType};

/// How many jobs a master holds at once, results that nobody fetched counted.
pub const MAX_JOBS: usize = 8;

/// A job of [`Jobs`]; never used twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JobId(u64);

/// Priority of a request on the data link layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Priority {
    /// FC x C: what acyclic services use.
    #[default]
    Low,
    /// FC x D: what a master of class 1 uses towards its slaves.
    High,
}

/// What a station is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JobKind {
    /// Send and request data.
    Srd {
        /// Access point of the station, 0…63; `None` is the default one.
        dsap: Option<u8>,
        /// Our access point, 0…63.
        ssap: Option<u8>,
        /// Priority.
        priority: Priority,
    },
    /// FDL status: whether it is there and what kind of station it is.
    FdlStatus,
    /// Ident data: maker, type and versions as text; few stations answer.
    Ident,
    /// Status of an access point, 0…63; few stations answer.
    LsapStatus {
        /// The access point.
        sap: u8,
    },
}

/// Whether a job goes on asking after an answer without data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Poll {
    /// One message cycle is all.
    #[default]
    Never,
    /// The request is delivered first; then the same access points are asked without data until data come. That is how
    /// MSAC fetches the response of a slave.
    UntilData {
        /// How long from the first bit of the request on. Afterwards the job ends with [`JobFailure::Expired`].
        within: Duration,
    },
}

/// A job before it is submitted.
///
/// # Example
///
/// ```
/// use dp_master::address::Address;
/// use dp_master::dp::{JobRequest, Poll, sap};
/// use dp_master::time::Duration;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let peer = Address::new(3)?;
/// let configuration = JobRequest::srd(peer, sap::GET_CFG, sap::MASTER, &[]);
/// let initiate = JobRequest::srd(peer, 49, 50, &[0x57]).polling(Duration::from_millis(500));
/// assert_eq!(configuration.poll, Poll::Never);
/// assert!(matches!(initiate.poll, Poll::UntilData { .. }));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JobRequest<'a> {
    /// The station, 0…126, not the master itself.
    pub peer: Address,
    /// What it is asked.
    pub kind: JobKind,
    /// Data of an SRD, 0…244 octets.
    pub data: &'a [u8],
    /// Whether a missing answer is worth repeating the request.
    pub repeat: Repeat,
    /// Whether the answer has to be polled for.
    pub poll: Poll,
}

impl<'a> JobRequest<'a> {
    /// SRD of low priority between two access points, repeated up to the retry limit.
    pub const fn srd(peer: Address, dsap: u8, ssap: u8, data: &'a [u8]) -> Self {
        Self {
            peer,
            kind: JobKind::Srd {
                dsap: Some(dsap),
                ssap: Some(ssap),
                priority: Priority::Low,
            },
            data,
            repeat: Repeat::UpToLimit,
            poll: Poll::Never,
        }
    }

    /// FDL status, not repeated: silence is the usual answer of an address.
    pub const fn fdl_status(peer: Address) -> Self {
        Self {
            peer,
            kind: JobKind::FdlStatus,
            data: &[],
            repeat: Repeat::Never,
            poll: Poll::Never,
        }
    }

    /// The same with polling for data.
    #[must_use]
    pub const fn polling(self, within: Duration) -> Self {
        Self {
            poll: Poll::UntilData { within },
            ..self
        }
    }
}

/// How a job ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box the data")]
pub enum JobOutcome {
    /// The station answered with data (DL, DH, RDL, RDH), or with its status.
    Response {
        /// What kind of station it is.
        station: StationType,
        /// The function code of the response; RDL and RDH say that it had no room for what was sent.
        function: ResponseFunction,
        /// The data without access points.
        data: Octets<MAX_DATA>,
    },
    /// Acknowledged without data: SC, or NR.
    Acknowledged,
    /// Neither.
    Failed(JobFailure),
}

/// Why a job brought nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum JobFailure {
    /// Refused: UE, RR, RS or a code without a name.
    #[error("the station refused: {}", function_text(*.0))]
    Refused(ResponseFunction),
    /// A response between other access points than those asked.
    #[error("the response came from access point {from:?} for {to:?}, which were not asked")]
    Misdirected {
        /// Access point of the station in the response.
        from: Option<u8>,
        /// Our access point in the response.
        to: Option<u8>,
    },
    /// More data than DP allows in a telegram.
    #[error("the response: expected at most {MAX_DATA} octets, got {got}")]
    TooLong {
        /// Octets received.
        got: usize,
    },
    /// No usable answer, with all repetitions.
    #[error("the station did not answer")]
    NoAnswer,
    /// The token was lost while the answer was awaited: the request may or may not have been carried out.
    #[error("the token was lost while the answer was awaited")]
    Aborted,
    /// No data within the time to poll.
    #[error("the station had no data within the time to poll")]
    Expired,
}

/// The acyclic jobs of a master: a queue of [`MAX_JOBS`] places.
///
/// A place is taken from [`submit`](Self::submit) until [`take`](Self::take) or [`cancel`](Self::cancel).
#[derive(Debug, Clone)]
pub struct Jobs {
    master: Address,
    slots: [Slot; MAX_JOBS],
    next_id: u64,
    next_turn: u64,
    /// How many wait, so that a cycle without jobs costs one comparison.
    waiting: usize,
    under_way: Option<usize>,
}

impl Jobs {
    pub(super) const fn new(master: Address) -> Self {
        Self {
            master,
            slots: [const { Slot::FREE }; MAX_JOBS],
            next_id: 0,
            next_turn: 0,
            waiting: 0,
            under_way: None,
        }
    }

    /// Takes a job over; the data are copied.
    ///
    /// # Errors
    ///
    /// [`SubmitError`]; nothing is changed then.
    pub fn submit(&mut self, request: &JobRequest<'_>) -> Result<JobId, SubmitError> {
        if request.peer.is_broadcast() || request.peer == self.master {
            return Err(SubmitError::Peer { got: request.peer });
        }
        for sap in request.kind.saps().into_iter().flatten() {
            if sap > MAX_SAP {
                return Err(SubmitError::Sap { got: sap });
            }
        }
        let Some(octets) = Octets::from_slice(request.data) else {
            return Err(SubmitError::DataTooLong {
                got: request.data.len(),
            });
        };
        let mut places = self.slots.iter_mut();
        let Some(slot) = places.find(|slot| slot.stage == Stage::Free) else {
            return Err(SubmitError::Full);
        };
        let id = JobId(self.next_id);
        *slot = Slot {
            id,
            turn: self.next_turn,
            stage: Stage::Waiting,
            peer: request.peer,
            kind: request.kind,
            repeat: request.repeat,
            poll: request.poll,
            delivered: false,
            deadline: None,
            octets,
        };
        self.next_id += 1;
        self.next_turn += 1;
        self.waiting += 1;
        Ok(id)
    }

    /// The outcome of a job that has ended; its place is free afterwards. `None` while it has not, and for an unknown
    /// job.
    pub fn take(&mut self, job: JobId) -> Option<JobOutcome> {
        let slot = self.slots.iter_mut().find(|slot| slot.id == job)?;
        let Stage::Done(end) = slot.stage else {
            return None;
        };
        slot.stage = Stage::Free;
        Some(match end {
            End::Response { station, function } => JobOutcome::Response {
                station,
                function,
                data: slot.octets,
            },
            End::Acknowledged => JobOutcome::Acknowledged,
            End::Failed(failure) => JobOutcome::Failed(failure),
        })
    }

    /// Forgets a job, whatever has become of it. One that is under way is not called back: it may still be carried out.
    pub fn cancel(&mut self, job: JobId) {
        let Some(slot) = self.slots.iter_mut().find(|slot| slot.id == job) else {
            return;
        };
        match slot.stage {
            Stage::Waiting => {
                slot.stage = Stage::Free;
                self.waiting -= 1;
            }
            Stage::UnderWay => slot.stage = Stage::Abandoned,
            Stage::Done(_) => slot.stage = Stage::Free,
            Stage::Free | Stage::Abandoned => {}
        }
    }

    /// How many more jobs can be submitted now.
    pub fn room(&self) -> usize {
        self.slots.iter().filter(|slot| slot.stage == Stage::Free).count()
    }

    /// Whether a job waits for its turn.
    pub fn is_waiting(&self) -> bool {
        self.waiting > 0
    }

    /// The station of the job whose turn it is, which is under way from now on; the same until
    /// [`confirm`](Self::confirm).
    pub(super) fn begin(&mut self) -> Option<Address> {
        if self.under_way.is_none() && self.waiting > 0 {
            let places = self.slots.iter().enumerate();
            let waiting = places.filter(|(_, slot)| slot.stage == Stage::Waiting);
            self.under_way = waiting.min_by_key(|(_, slot)| slot.turn).map(|(place, _)| place);
            if let Some(slot) = self.under_way.and_then(|place| self.slots.get_mut(place)) {
                slot.stage = Stage::UnderWay;
                self.waiting -= 1;
            }
        }
        let slot = self.slots.get(self.under_way?)?;
        Some(slot.peer)
    }

    /// The telegram of the job that is under way; `fcb` counts only where the request is counted.
    pub(super) fn action(&self, fcb: Fcb) -> Option<Action<'_>> {
        let slot = self.slots.get(self.under_way?)?;
        let function = match slot.kind {
            JobKind::Srd {
                priority: Priority::Low,
                ..
            } => RequestFunction::SrdLow,
            JobKind::Srd {
                priority: Priority::High,
                ..
            } => RequestFunction::SrdHigh,
            JobKind::FdlStatus => RequestFunction::FdlStatus,
            JobKind::Ident => RequestFunction::Ident,
            JobKind::LsapStatus { .. } => RequestFunction::LsapStatus,
        };
        let fcb = if slot.kind.is_counted() { fcb } else { Fcb::Inactive };
        let [dsap, ssap] = slot.kind.saps();
        let header = Header {
            da: slot.peer,
            sa: self.master,
            dsap,
            ssap,
            fc: FunctionCode::request(fcb, function),
        };
        Some(Action::Send {
            header,
            data: &slot.octets,
            repeat: slot.repeat,
        })
    }

    /// The telegram of [`action`](Self::action) has ended; the station, and what becomes of its frame count bit.
    pub(super) fn confirm(&mut self, now: Instant, started: Instant, outcome: Outcome<'_>) -> Option<(Address, Count)> {
        let place = self.under_way.take()?;
        let slot = self.slots.get_mut(place)?;
        let end = slot.end(outcome);
        let count = match end {
            // What the station has seen is not known: only first contact is new to it in any case.
            End::Failed(JobFailure::NoAnswer | JobFailure::Aborted | JobFailure::Misdirected { .. }) => Count::Restart,
            _ if slot.kind.is_counted() => Count::Next,
            // It has forgotten the request before, so that no bit is a repetition to it.
            _ => Count::Keep,
        };
        let peer = slot.peer;
        if slot.stage == Stage::Abandoned {
            slot.stage = Stage::Free;
            return Some((peer, count));
        }
        slot.stage = Stage::Done(end);
        if let Poll::UntilData { within } = slot.poll {
            let deadline = *slot.deadline.get_or_insert(started + within);
            let again = match end {
                End::Acknowledged => true,
                // The request was delivered before: to ask again does no harm.
                End::Failed(JobFailure::Aborted) => slot.delivered,
                _ => false,
            };
            if again && now < deadline {
                slot.stage = Stage::Waiting;
                slot.delivered = true;
                slot.octets.reset(0);
                slot.turn = self.next_turn;
                self.next_turn += 1;
                self.waiting += 1;
            } else if again {
                slot.stage = Stage::Done(End::Failed(JobFailure::Expired));
            }
        }
        if let (Stage::Done(End::Response { .. }), Outcome::Response { data, .. }) = (slot.stage, outcome) {
            // Its length was looked at in `end`.
            slot.octets.replace(data);
        }
        Some((peer, count))
    }
}

/// What becomes of the frame count bit towards a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Count {
    /// The other bit is next.
    Next,
    /// As it was.
    Keep,
    /// First contact is next.
    Restart,
}

impl JobKind {
    /// DSAP and SSAP.
    const fn saps(self) -> [Option<u8>; 2] {
        match self {
            Self::Srd { dsap, ssap, .. } => [dsap, ssap],
            Self::FdlStatus | Self::Ident => [None, None],
            Self::LsapStatus { sap } => [Some(sap), None],
        }
    }

    /// Whether the request carries a frame count bit.
    const fn is_counted(self) -> bool {
        matches!(self, Self::Srd { .. })
    }
}

#[derive(Debug, Clone)]
struct Slot {
    id: JobId,
    turn: u64,
    stage: Stage,
    peer: Address,
    kind: JobKind,
    repeat: Repeat,
    poll: Poll,
    /// The request has been acknowledged; what is sent from now on are polls.
    delivered: bool,
    /// End of the polling, from the first telegram on.
    deadline: Option<Instant>,
    /// Data of the request, later of the response.
    octets: Octets<MAX_DATA>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Free,
    Waiting,
    UnderWay,
    /// Under way, and nobody wants to know the outcome.
    Abandoned,
    Done(End),
}

/// How a job ended; the data of a response stay in the slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Response {
        station: StationType,
        function: ResponseFunction,
    },
    Acknowledged,
    Failed(JobFailure),
}

impl Slot {
    const FREE: Self = Self {
        id: JobId(u64::MAX),
        turn: 0,
        stage: Stage::Free,
        peer: Address::BROADCAST,
        kind: JobKind::FdlStatus,
        repeat: Repeat::Never,
        poll: Poll::Never,
        delivered: false,
        deadline: None,
        octets: Octets::EMPTY,
    };

    fn end(&self, outcome: Outcome<'_>) -> End {
        let (header, data) = match outcome {
            Outcome::Acknowledged | Outcome::Sent => return End::Acknowledged,
            Outcome::NoAnswer => return End::Failed(JobFailure::NoAnswer),
            Outcome::Aborted => return End::Failed(JobFailure::Aborted),
            Outcome::Response { header, data } => (header, data),
        };
        let FunctionCode::Response { station, function } = header.fc else {
            return End::Failed(JobFailure::NoAnswer);
        };
        match function {
            ResponseFunction::Ok if self.kind.is_counted() => return End::Acknowledged,
            ResponseFunction::NoReplyData => return End::Acknowledged,
            ResponseFunction::Ok
            | ResponseFunction::DataLow
            | ResponseFunction::DataHigh
            | ResponseFunction::DataLowNoResource
            | ResponseFunction::DataHighNoResource => {}
            refusal => return End::Failed(JobFailure::Refused(refusal)),
        }
        let [dsap, ssap] = self.kind.saps();
        if self.kind.is_counted() && (header.ssap != dsap || header.dsap != ssap) {
            return End::Failed(JobFailure::Misdirected {
                from: header.ssap,
                to: header.dsap,
            });
        }
        if data.len() > MAX_DATA {
            return End::Failed(JobFailure::TooLong { got: data.len() });
        }
        End::Response { station, function }
    }
}

/// The negative acknowledgements as the standard names them.
fn function_text(function: ResponseFunction) -> &'static str {
    match function {
        ResponseFunction::UserError => "UE, error of its user",
        ResponseFunction::NoResource => "RR, no resource",
        ResponseFunction::NoService => "RS, no such service or access point now",
        _ => "with a code that has no name",
    }
}

/// Why a job was not taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SubmitError {
    /// All places are taken.
    #[error("acyclic jobs: expected at most {MAX_JOBS} at once; fetch outcomes or cancel jobs")]
    Full,
    /// The address is the master's or that of all stations.
    #[error("address of an acyclic job: expected 0 to 126 and not the master's, got {got}")]
    Peer {
        /// The address.
        got: Address,
    },
    /// A service access point above 63.
    #[error("service access point of an acyclic job: expected 0 to 63, got {got}")]
    Sap {
        /// The number.
        got: u8,
    },
    /// More data than DP allows in a telegram.
    #[error("data of an acyclic job: expected at most {MAX_DATA} octets, got {got}")]
    DataTooLong {
        /// Octets given.
        got: usize,
    },
}
