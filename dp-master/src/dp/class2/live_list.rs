//! The live list: which addresses answer, and with what kind of station.

use crate::address::Address;
use crate::dp::acyclic::{JobFailure, JobId, JobOutcome, JobRequest, Jobs};
use crate::fdl::Repeat;
use crate::wire::StationType;

/// How far a live list goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scan {
    /// Every address once.
    #[default]
    Once,
    /// Round after round, so that stations that come and go are noticed.
    Continuous,
}

/// What a live list noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiveListEvent {
    /// A station answered that had not before, or answers as another kind now.
    Found {
        /// Its address.
        address: Address,
        /// Its kind.
        station: StationType,
    },
    /// A station does not answer any more.
    Lost {
        /// Its address.
        address: Address,
    },
    /// Every address was asked once more.
    Round,
}

/// Asks address after address for its FDL status, one job at a time: a DP cycle is lengthened by one such telegram at
/// most.
///
/// An address where nobody was is asked once a round; a known station is repeated up to the retry limit before it
/// counts as lost. An absent address costs a slot time.
#[doc(alias = "Lifelist")]
#[derive(Debug, Clone)]
pub struct LiveList {
    own: Address,
    last: Address,
    scan: Scan,
    /// The address asked next; above `last` when a single round is over.
    next: u8,
    job: Option<JobId>,
    found: [Option<StationType>; STATIONS],
    rounds: u32,
}

const STATIONS: usize = Address::MAX_STATION.value() as usize + 1;

impl LiveList {
    /// A list over the addresses 0…`last` (126, or the HSA); `own` is the master's, which is not asked and stands in
    /// the list as a master in the ring.
    pub fn new(own: Address, last: Address, scan: Scan) -> Self {
        let mut found = [None; STATIONS];
        if let Some(place) = found.get_mut(usize::from(own.value())) {
            *place = Some(StationType::MasterInRing);
        }
        Self {
            own,
            last: last.min(Address::MAX_STATION),
            scan,
            next: 0,
            job: None,
            found,
            rounds: 0,
        }
    }

    /// Goes on. Call it whenever the master was worked; it returns one event at a time, so until `None`.
    ///
    /// When the queue of jobs is full it waits.
    pub fn poll(&mut self, jobs: &mut Jobs) -> Option<LiveListEvent> {
        if let Some(job) = self.job {
            let outcome = jobs.take(job)?;
            self.job = None;
            // Asked again when the token is back: nothing was learnt.
            if outcome != JobOutcome::Failed(JobFailure::Aborted) {
                let event = self.note(&outcome);
                self.next += 1;
                if event.is_some() {
                    return event;
                }
            }
        }
        if self.next == self.own.value() {
            self.next += 1;
        }
        let Some(address) = Address::new(self.next).ok().filter(|&next| next <= self.last) else {
            return self.end_round();
        };
        let request = JobRequest {
            repeat: match self.station(address) {
                Some(_) => Repeat::UpToLimit,
                None => Repeat::Never,
            },
            ..JobRequest::fdl_status(address)
        };
        self.job = jobs.submit(&request).ok();
        None
    }

    /// The kind of station at an address, as far as it is known.
    pub fn station(&self, address: Address) -> Option<StationType> {
        *self.found.get(usize::from(address.value()))?
    }

    /// All stations in the order of their addresses.
    pub fn stations(&self) -> Stations<'_> {
        Stations { list: self, next: 0 }
    }

    /// How many rounds are complete.
    pub fn rounds(&self) -> u32 {
        self.rounds
    }

    /// Whether a single round is over.
    pub fn is_finished(&self) -> bool {
        self.scan == Scan::Once && self.rounds > 0
    }

    /// Gives up the job under way, so that the list can be dropped.
    pub fn cancel(&mut self, jobs: &mut Jobs) {
        if let Some(job) = self.job.take() {
            jobs.cancel(job);
        }
    }

    fn note(&mut self, outcome: &JobOutcome) -> Option<LiveListEvent> {
        let now = match outcome {
            JobOutcome::Response { station, .. } => Some(*station),
            // It is there, though it answers with something else.
            JobOutcome::Acknowledged | JobOutcome::Failed(JobFailure::Refused(_)) => Some(StationType::Slave),
            JobOutcome::Failed(_) => None,
        };
        let address = Address::new(self.next).ok()?;
        let place = self.found.get_mut(usize::from(self.next))?;
        let before = core::mem::replace(place, now);
        match now {
            Some(station) if before != now => Some(LiveListEvent::Found { address, station }),
            None if before.is_some() => Some(LiveListEvent::Lost { address }),
            _ => None,
        }
    }

    fn end_round(&mut self) -> Option<LiveListEvent> {
        if self.is_finished() {
            return None;
        }
        self.rounds = self.rounds.saturating_add(1);
        if self.scan == Scan::Continuous {
            self.next = 0;
        }
        Some(LiveListEvent::Round)
    }
}

/// The stations of a [`LiveList`].
#[derive(Debug, Clone)]
pub struct Stations<'a> {
    list: &'a LiveList,
    next: u8,
}

impl Iterator for Stations<'_> {
    type Item = (Address, StationType);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let address = Address::new(self.next).ok()?;
            self.next += 1;
            if let Some(station) = self.list.station(address) {
                return Some((address, station));
            }
        }
    }
}
