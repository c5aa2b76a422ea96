//! The master's side of the parameter channel.

use super::error::ErrorCode;
use super::frame::{Frame, Service};
use super::job::Job;

/// What the client makes of index and subindex in an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum EchoRule {
    /// A wrong echo is a lost delivery. An answer without echo (index and subindex zero) is taken as one too, until
    /// the drive has answered a repeated request in the same way: then it is a drive that echoes nothing.
    #[default]
    WhenPresent,
    /// Anything but the right echo is a lost delivery.
    Required,
    /// The handshake alone decides, as in the block of the film feed. Lost deliveries go unnoticed.
    Ignored,
}

/// Limits of the client. Cycles are calls of [`Client::step`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ClientOptions {
    /// Cycles without an answer after which a request has timed out, at least 1; per attempt.
    pub timeout_cycles: u32,
    /// Deliveries of one job before giving up, at least 1.
    pub attempts: u8,
    /// Cycles for which the handshake is laid down before a channel is used again that never answered.
    pub clearing_cycles: u32,
    /// Treatment of the echo.
    pub echo: EchoRule,
}

impl Default for ClientOptions {
    /// 1000 cycles, 3 attempts, 4 clearing cycles, echo checked when present.
    fn default() -> Self {
        Self {
            timeout_cycles: 1000,
            attempts: 3,
            clearing_cycles: 4,
            echo: EchoRule::WhenPresent,
        }
    }
}

/// How the drive answered. A refusal is an answer, not a failure of the channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reply {
    /// The job was carried out.
    Done {
        /// The job.
        job: Job,
        /// Data of the answer: of a read the value of the code, as the bus carries it.
        value: i32,
    },
    /// The drive refused the job.
    Refused {
        /// The job.
        job: Job,
        /// Its reason.
        error: ErrorCode,
    },
}

/// Why there is no answer to a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The handshake did not come back. The drive may still carry the job out.
    #[error("{job}: expected an answer within {cycles} cycles, got none")]
    Timeout {
        /// The job.
        job: Job,
        /// Cycles waited.
        cycles: u32,
    },
    /// The handshake came back, but every time with the answer to something else.
    #[error("{job}: expected its index and subindex in the answer, got {answer} in {attempts} attempts")]
    NotDelivered {
        /// The job.
        job: Job,
        /// The last answer.
        answer: Frame,
        /// Deliveries tried.
        attempts: u8,
    },
}

/// A job was asked for while another one runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected a free parameter channel, got one busy with: {running}")]
pub struct RequestRefused {
    /// The job under way.
    pub running: Job,
}

/// Asks parameter jobs of a drive, one at a time, without doing any I/O.
///
/// Call order: [`request`](Self::request), then once per bus cycle [`step`](Self::step) with the newest answer, sending
/// what it returns, until [`poll_result`](Self::poll_result) yields. Between jobs `step` may go on; it repeats the
/// last frame, which starts nothing.
///
/// A job is sent with the handshake opposite to that of the newest answer and is done when the answer shows the same
/// level **and** echoes the job. Where the echo is wrong the drive was never reached (it started with handshake 1, or
/// its image fell to zero): the client inverts again and repeats, within [`ClientOptions::attempts`]. A repeated write
/// writes the same value twice.
///
/// After a time-out the old request stays on the bus. The next job waits for its answer first, so that it cannot be
/// taken for its own, at most another time-out long; then it lays the handshake down for a few cycles and starts anew.
///
/// # Example
///
/// ```
/// use drivecom::param::{Client, ClientOptions, Frame, Job, Reply};
/// use drivecom::{CodeNumber, Subcode};
///
/// let mut client = Client::new(ClientOptions::default());
/// let job = Job::read(CodeNumber::new(1204).unwrap(), Subcode::NONE);
/// client.request(job)?;
/// assert_eq!(client.step(&Frame::EMPTY), Frame([0x71, 0x00, 0x5B, 0x4B, 0, 0, 0, 0]));
/// client.step(&Frame([0x70, 0x00, 0x5B, 0x4B, 0x00, 0x1B, 0x52, 0xF4]));
/// assert_eq!(client.poll_result(), Some(Ok(Reply::Done { job, value: 1_790_708 })));
/// # Ok::<(), drivecom::param::RequestRefused>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Client {
    options: ClientOptions,
    sent: Frame,
    phase: Phase,
    // Cycles since a request timed out that is still unanswered on the bus.
    unanswered: Option<u32>,
    echo: Echo,
    result: Option<Result<Reply, RequestError>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Idle,
    // Waits for the answer to the request that timed out before.
    Draining { job: Job },
    // Shows the level of the answer and no job, so that the next inversion is an edge for any drive.
    Clearing { job: Job, left: u32 },
    // Will be sent with the next step.
    Due { job: Job, attempt: u8 },
    Waiting { job: Job, attempt: u8, waited: u32 },
}

// What is known about this drive's echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Echo {
    Unknown,
    Seen,
    Absent,
}

impl Client {
    /// A client that has not spoken yet; it sends zeros until the first job.
    #[must_use]
    pub const fn new(options: ClientOptions) -> Self {
        Self {
            options,
            sent: Frame::EMPTY,
            phase: Phase::Idle,
            unanswered: None,
            echo: Echo::Unknown,
            result: None,
        }
    }

    /// Takes a job, to be sent with the next [`step`](Self::step). A result nobody fetched is dropped.
    ///
    /// # Errors
    ///
    /// [`RequestRefused`] while another job is under way; nothing changes then.
    pub const fn request(&mut self, job: Job) -> Result<(), RequestRefused> {
        if let Some(running) = self.running() {
            return Err(RequestRefused { running });
        }
        self.result = None;
        self.phase = match self.unanswered {
            Some(_) => Phase::Draining { job },
            None => Phase::Due { job, attempt: 1 },
        };
        Ok(())
    }

    /// One bus cycle: the newest answer in, the request to send out.
    pub fn step(&mut self, received: &Frame) -> Frame {
        self.watch_the_unanswered(received);
        match self.phase {
            Phase::Idle => {}
            Phase::Draining { job } => self.drain(job, received),
            Phase::Clearing { job, left } => self.clear(job, left),
            Phase::Due { .. } => {}
            Phase::Waiting { job, attempt, waited } => self.wait(job, attempt, waited, received),
        }
        // Whatever led here in this cycle, a job that is due goes out at once.
        if let Phase::Due { job, attempt } = self.phase {
            self.sent = job.request(!received.service().handshake());
            self.phase = Phase::Waiting {
                job,
                attempt,
                waited: 0,
            };
        }
        self.sent
    }

    /// The outcome of the last job, once.
    pub const fn poll_result(&mut self) -> Option<Result<Reply, RequestError>> {
        self.result.take()
    }

    /// The job under way.
    #[must_use]
    pub const fn running(&self) -> Option<Job> {
        match self.phase {
            Phase::Idle => None,
            Phase::Draining { job }
            | Phase::Clearing { job, .. }
            | Phase::Due { job, .. }
            | Phase::Waiting { job, .. } => Some(job),
        }
    }

    /// The frame on the bus: the last one [`step`](Self::step) returned.
    #[must_use]
    pub const fn sent(&self) -> Frame {
        self.sent
    }

    fn watch_the_unanswered(&mut self, received: &Frame) {
        if let Some(cycles) = self.unanswered {
            let answered = received.service().handshake() == self.sent.service().handshake();
            self.unanswered = if answered { None } else { Some(cycles.saturating_add(1)) };
        }
    }

    fn drain(&mut self, job: Job, received: &Frame) {
        match self.unanswered {
            None => self.phase = Phase::Due { job, attempt: 1 },
            Some(cycles) if cycles >= self.options.timeout_cycles => {
                self.unanswered = None;
                self.sent = Frame::EMPTY.with_service(Service(0).with_handshake(received.service().handshake()));
                self.phase = Phase::Clearing {
                    job,
                    left: self.options.clearing_cycles,
                };
            }
            Some(_) => {}
        }
    }

    fn clear(&mut self, job: Job, left: u32) {
        self.phase = match left.checked_sub(1) {
            Some(left) if left > 0 => Phase::Clearing { job, left },
            _ => Phase::Due { job, attempt: 1 },
        };
    }

    fn wait(&mut self, job: Job, attempt: u8, waited: u32, received: &Frame) {
        if received.service().handshake() != self.sent.service().handshake() {
            let waited = waited.saturating_add(1);
            if waited < self.options.timeout_cycles {
                self.phase = Phase::Waiting { job, attempt, waited };
            } else {
                self.unanswered = Some(0);
                self.finish(Err(RequestError::Timeout { job, cycles: waited }));
            }
        } else if self.belongs_to(job, attempt, received) {
            self.finish(Ok(match received.error() {
                Some(error) => Reply::Refused { job, error },
                None => Reply::Done {
                    job,
                    value: received.value(job.length),
                },
            }));
        } else if attempt < self.options.attempts {
            self.phase = Phase::Due {
                job,
                attempt: attempt + 1,
            };
        } else {
            self.finish(Err(RequestError::NotDelivered {
                job,
                answer: *received,
                attempts: attempt,
            }));
        }
    }

    fn finish(&mut self, result: Result<Reply, RequestError>) {
        self.phase = Phase::Idle;
        self.result = Some(result);
    }

    // Whether an answer with the right handshake is the answer to this job.
    fn belongs_to(&mut self, job: Job, attempt: u8, received: &Frame) -> bool {
        if self.options.echo == EchoRule::Ignored {
            return true;
        }
        // Job bits of the answer are 0, or copied from the request by older modules.
        let job_bits = received.service().job();
        if job_bits != Service::NO_JOB && job_bits != job.kind.code() {
            return false;
        }
        let (index, subindex) = (received.index(), received.subindex());
        if index == job.code.index() && subindex == job.subcode.0 {
            self.echo = Echo::Seen;
            return true;
        }
        let absent = index == 0 && subindex == 0;
        if !absent || self.options.echo == EchoRule::Required || self.echo == Echo::Seen {
            return false;
        }
        if self.echo == Echo::Unknown && attempt > 1 {
            self.echo = Echo::Absent;
        }
        self.echo == Echo::Absent
    }
}

impl Default for Client {
    fn default() -> Self {
        Self::new(ClientOptions::default())
    }
}
