//! The drive's side of the parameter channel.

use super::error::ErrorCode;
use super::frame::{Frame, Service};
use super::job::{Job, JobKind};
use crate::code::{CodeNumber, Subcode};

/// How the answer's service octet is built; modules differ.
///
/// Source: 9300 fact sheet, section 3.1 and section 9, row 22.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AnswerStyle {
    /// Job bits 0: `0x30`/`0x70`, with error `0xB0`/`0xF0`. EMF2133IB, and 2131 from software 1.0 on.
    #[default]
    Cleared,
    /// Job bits copied from the request: `0x31`/`0x72`…, with error `0xB1`/`0xF2`…. The 2130IB.
    RequestCopied,
    /// Nothing but handshake and error: `0x00`/`0x40`, with error `0x80`/`0xC0`. Software up to 0.9 in 2131 mode.
    HandshakeOnly,
}

/// A level of the handshake bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Handshake {
    /// Bit 6 is 0.
    #[default]
    Clear,
    /// Bit 6 is 1.
    Set,
}

impl Handshake {
    const fn is_set(self) -> bool {
        matches!(self, Self::Set)
    }
}

/// What differs between modules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ServerOptions {
    /// Service octet of the answers.
    pub style: AnswerStyle,
    /// Handshake level of the answer before the first job; the rest of that answer is zero.
    pub initial_handshake: Handshake,
}

/// What the drive has to do after a poll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ServerAction {
    /// Nothing new.
    None,
    /// A job has come in: carry it out, now or later, and call [`Server::complete`].
    Start(Job),
    /// A request came in that the channel answered by itself: no job, a reserved job code, an impossible index.
    Answered,
}

/// Answers parameter jobs: requests in, jobs out, results in, answers out.
///
/// Per module cycle: [`poll`](Self::poll) with the newest request; when it hands out a [`Job`], call
/// [`complete`](Self::complete) in the same or any later cycle; send [`answer`](Self::answer). While a job runs the
/// old answer stays and no other job starts. A request whose handshake was inverted meanwhile is taken up by the
/// first poll after completion.
///
/// A new job is seen by the handshake bit alone: its level differs from that of the last accepted request. Before the
/// first job, a request of eight zero octets is what an output image shows before its master wrote anything, and is no
/// request, whatever the level: so a server that starts with [`Handshake::Set`] keeps showing it.
///
/// Source: 9300 fact sheet, section 3.
///
/// # Example
///
/// ```
/// use drivecom::param::{ErrorCode, Frame, Server, ServerAction, ServerOptions};
///
/// let mut server = Server::new(ServerOptions::default());
/// let read_c1204 = Frame([0x71, 0x00, 0x5B, 0x4B, 0, 0, 0, 0]);
/// let ServerAction::Start(job) = server.poll(&read_c1204) else { unreachable!() };
/// assert_eq!((job.code.number(), job.subcode.0), (1204, 0));
/// assert_eq!(server.answer(), Frame::EMPTY);
/// server.complete(Ok(1_790_708));
/// assert_eq!(server.answer(), Frame([0x70, 0x00, 0x5B, 0x4B, 0x00, 0x1B, 0x52, 0xF4]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Server {
    style: AnswerStyle,
    // Level of the last accepted request; the answer shows it once the job is done.
    accepted: bool,
    spoken_to: bool,
    running: Option<Running>,
    answered: Answered,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Running {
    job: Job,
    request: Frame,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Answered {
    Nothing {
        handshake: bool,
    },
    NoJob {
        request: Frame,
    },
    Job {
        request: Frame,
        result: Result<i32, ErrorCode>,
    },
}

impl Server {
    /// A server before its first job.
    #[must_use]
    pub const fn new(options: ServerOptions) -> Self {
        let handshake = options.initial_handshake.is_set();
        Self {
            style: options.style,
            accepted: handshake,
            spoken_to: false,
            running: None,
            answered: Answered::Nothing { handshake },
        }
    }

    /// Looks at the newest request.
    pub fn poll(&mut self, request: &Frame) -> ServerAction {
        let service = request.service();
        if self.running.is_some()
            || service.handshake() == self.accepted
            || (!self.spoken_to && *request == Frame::EMPTY)
        {
            return ServerAction::None;
        }
        self.accepted = service.handshake();
        self.spoken_to = true;
        let kind = match service.job() {
            Service::READ => JobKind::Read,
            Service::WRITE => JobKind::Write,
            Service::NO_JOB => {
                self.answered = Answered::NoJob { request: *request };
                return ServerAction::Answered;
            }
            _ => return self.refuse(*request, ErrorCode::IMPERMISSIBLE_JOB),
        };
        let Some(code) = CodeNumber::from_index(request.index()) else {
            return self.refuse(*request, ErrorCode::UNKNOWN_OBJECT);
        };
        let length = service.length();
        let subcode = Subcode(request.subindex());
        let job = Job {
            kind,
            code,
            subcode,
            value: request.value(length),
            length,
        };
        self.running = Some(Running { job, request: *request });
        ServerAction::Start(job)
    }

    /// Ends the running job: data for the answer, or why it was refused. Returns whether a job was running.
    ///
    /// The data of a write's answer is the caller's choice; the usual one is the value written.
    pub fn complete(&mut self, result: Result<i32, ErrorCode>) -> bool {
        match self.running.take() {
            Some(running) => {
                self.answered = Answered::Job {
                    request: running.request,
                    result,
                };
                true
            }
            None => false,
        }
    }

    /// The job that was handed out and not completed yet.
    #[must_use]
    pub const fn running(&self) -> Option<Job> {
        match self.running {
            Some(running) => Some(running.job),
            None => None,
        }
    }

    /// The answer to send now, computed from the last result.
    #[must_use]
    pub const fn answer(&self) -> Frame {
        match self.answered {
            Answered::Nothing { handshake } => Frame::EMPTY.with_service(Service(0).with_handshake(handshake)),
            Answered::NoJob { request } => {
                let service = Service(0).with_handshake(request.service().handshake());
                Frame::new(service, request.subindex(), request.index(), [0; 4])
            }
            Answered::Job { request, result } => {
                let service = self.answer_service(request.service());
                let (error, data) = match result {
                    Ok(value) => (false, request.service().length().write(value)),
                    Err(code) => (true, code.to_data()),
                };
                Frame::new(service.with_error(error), request.subindex(), request.index(), data)
            }
        }
    }

    fn refuse(&mut self, request: Frame, error: ErrorCode) -> ServerAction {
        self.answered = Answered::Job {
            request,
            result: Err(error),
        };
        ServerAction::Answered
    }

    const fn answer_service(&self, request: Service) -> Service {
        let kept = match self.style {
            AnswerStyle::Cleared => 0x70,
            AnswerStyle::RequestCopied => 0x7F,
            AnswerStyle::HandshakeOnly => Service::HANDSHAKE,
        };
        Service(request.0 & kept)
    }
}

impl Default for Server {
    fn default() -> Self {
        Self::new(ServerOptions::default())
    }
}
