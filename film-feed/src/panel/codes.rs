//! Codes of a real drive, read and written through DP-V1 beside the process data.

use std::collections::VecDeque;

use dp_master::address::Address;
use dp_master::dp::v1::{Initiate, Msac2Client, Msac2Event, V1Answer, V1ClientError};
use dp_master::dp::{Jobs, SubmitError};
use dp_master::time::{Baud, Instant};
use drivecom::param::{RECORD_INDEX, RECORD_SLOT};
use lenze9300_model::access::{CodePlace, CodeRecord};

use super::engine::ClientId;
use super::protocol::Told;

/// What pages want of the drive's codes, one after the other, over one connection of class 2.
///
/// The connection is opened with the first wish and stays. What the master cannot take at the moment waits for the next call.
#[derive(Debug)]
pub(super) struct Codes {
    client: Msac2Client,
    drive: Address,
    baud: Baud,
    phase: Phase,
    wishes: VecDeque<(ClientId, CodeRecord)>,
    /// How often the connection broke for the wish in front.
    broken: u32,
    reference: u8,
}

/// Where the connection stands, and what was asked last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Closed,
    Opening,
    Open,
    /// The request goes to the data record.
    Requesting,
    /// The response is fetched from it.
    Fetching,
}

/// How often a wish is tried.
const ATTEMPTS: u32 = 3;
/// Wishes that wait; more are refused.
const WISHES: usize = 32;
/// Longest response.
const RESPONSE: u8 = 240;

impl Codes {
    /// No connection yet.
    pub(super) fn new(drive: Address, baud: Baud) -> Self {
        Self {
            client: Msac2Client::new(drive),
            drive,
            baud,
            phase: Phase::Closed,
            wishes: VecDeque::new(),
            broken: 0,
            reference: 0,
        }
    }

    /// Puts the wish of a page behind the others: to write the raw value, or to read without one.
    ///
    /// # Errors
    ///
    /// One sentence when too many wait.
    pub(super) fn ask(&mut self, asker: ClientId, place: CodePlace, written: Option<i32>) -> Result<(), String> {
        if self.wishes.len() == WISHES {
            return Err(format!(
                "{WISHES} codes are waited for already; ask again when they have come"
            ));
        }
        self.reference = self.reference.wrapping_add(1);
        let job = match written {
            Some(raw) => CodeRecord::write(self.reference, place, raw),
            None => CodeRecord::read(self.reference, place),
        };
        self.wishes.push_back((asker, job));
        Ok(())
    }

    /// Goes on; to be called whenever the master was worked. Gives an answer, and the page it is for.
    pub(super) fn work(&mut self, jobs: &mut Jobs, now: Instant) -> Option<(ClientId, Told)> {
        let step = match self.client.step(jobs, now) {
            Some(event) => self.take(jobs, event),
            None => self.begin(jobs),
        };
        let answer = match step {
            Ok(answer) => answer,
            Err(why) => self.wishes.pop_front().map(|(asker, _)| (asker, Told::Refused { why })),
        };
        if answer.is_some() {
            self.broken = 0;
        }
        answer
    }

    /// Begins the next wish, as far as the connection and the master's queue allow.
    fn begin(&mut self, jobs: &mut Jobs) -> Result<Option<(ClientId, Told)>, String> {
        let Some((_, job)) = self.wishes.front() else {
            return Ok(None);
        };
        match self.phase {
            Phase::Closed => {
                let initiate = Initiate::data_records(self.baud);
                let begun = self.client.connect(jobs, &initiate);
                self.go_to(Phase::Opening, begun)?;
            }
            Phase::Open => {
                let begun = self.client.write(jobs, RECORD_SLOT, RECORD_INDEX, &job.request());
                self.go_to(Phase::Requesting, begun)?;
            }
            Phase::Opening | Phase::Requesting | Phase::Fetching => {}
        }
        Ok(None)
    }

    fn take(&mut self, jobs: &mut Jobs, event: Msac2Event) -> Result<Option<(ClientId, Told)>, String> {
        let before = self.phase;
        match (before, event) {
            (_, Msac2Event::Opened(_)) => {
                self.phase = Phase::Open;
                Ok(None)
            }
            (_, Msac2Event::Rejected(error)) => {
                self.phase = Phase::Closed;
                Err(format!(
                    "station {} refuses a connection for its codes: {error}",
                    self.drive
                ))
            }
            (_, Msac2Event::Closed(abort)) => {
                self.phase = Phase::Closed;
                // Nobody was waiting for it: the next wish opens it again.
                if before == Phase::Open {
                    return Ok(None);
                }
                // An operating system may hold an answer up for longer than the bus waits. A write may have been carried out already.
                let is_read = self.wishes.front().is_some_and(|(_, job)| job.written().is_none());
                self.broken += 1;
                if self.broken < ATTEMPTS && (before == Phase::Opening || is_read) {
                    return Ok(None);
                }
                Err(format!(
                    "no connection to station {} for its codes: {abort}; is it there, and does it speak DP-V1?",
                    self.drive
                ))
            }
            (Phase::Requesting, Msac2Event::Answer(Ok(_))) => {
                let begun = self.client.read(jobs, RECORD_SLOT, RECORD_INDEX, RESPONSE);
                // Its job has just left the queue, so there is a place in it.
                self.phase = Phase::Open;
                begun.map_err(|error| error.to_string())?;
                self.phase = Phase::Fetching;
                Ok(None)
            }
            (_, Msac2Event::Answer(Ok(V1Answer::Data { data, .. }))) => {
                self.phase = Phase::Open;
                let Some((asker, job)) = self.wishes.front().copied() else {
                    return Ok(None);
                };
                let raw = job.result(&data).map_err(|error| error.to_string())?;
                self.wishes.pop_front();
                let place = job.place();
                let told = match job.written() {
                    Some(_) => Told::code_written(place, raw),
                    None => Told::code_read(place, raw),
                };
                Ok(Some((asker, told)))
            }
            (_, Msac2Event::Answer(answer)) => {
                self.phase = Phase::Open;
                Err(match answer {
                    Ok(_) => "the bus module gave an answer to another request".to_owned(),
                    Err(error) => format!("the bus module refuses: {error}"),
                })
            }
        }
    }

    fn go_to(&mut self, phase: Phase, begun: Result<(), V1ClientError>) -> Result<(), String> {
        match begun {
            Ok(()) => {
                self.phase = phase;
                Ok(())
            }
            // The queue is full, or the connection is just coming to its end: again with the next call.
            Err(
                V1ClientError::Submit(SubmitError::Full)
                | V1ClientError::Busy
                | V1ClientError::NotOpen
                | V1ClientError::NotClosed,
            ) => Ok(()),
            Err(error) => Err(error.to_string()),
        }
    }
}
