//! Both ends of the parameter channel, with jobs of any kind, frames from anywhere, and a channel that loses, repeats and spoils.

use drivecom::param::{
    AnswerStyle, Client, ClientOptions, DataLength, EchoRule, ErrorCode, Frame, Handshake, Job, JobKind, Reply, Server,
    ServerAction, ServerOptions,
};
use drivecom::{CodeNumber, Subcode};

use super::input::Input;

/// What the drive of this test has in a code: something that tells codes and subcodes apart.
fn value_of(job: &Job) -> i32 {
    match job.kind {
        JobKind::Read => i32::from(job.code.number()) << 8 | i32::from(job.subcode.0),
        JobKind::Write => job.value,
    }
}

/// The server and what it owes.
struct Drive {
    server: Server,
    running: Option<Job>,
}

impl Drive {
    fn poll(&mut self, request: &Frame) {
        let before = self.server.answer();
        match self.server.poll(request) {
            ServerAction::None => assert_eq!(self.server.answer(), before, "an answer changed by itself"),
            ServerAction::Start(job) => {
                assert_eq!(self.running, None, "a second job was started");
                assert_eq!(self.server.answer(), before, "answered before it was done");
                assert_eq!(job.code.index(), request.index());
                assert_eq!(job.subcode.0, request.subindex());
                self.running = Some(job);
            }
            ServerAction::Answered => {
                assert_eq!(self.running, None, "answered while a job runs");
                self.check_answer(request);
            }
        }
        assert_eq!(self.server.running(), self.running);
    }

    fn complete(&mut self, result: Result<i32, ErrorCode>) {
        let job = self.running.take();
        assert_eq!(self.server.complete(result), job.is_some());
        if job.is_some() {
            let answer = self.server.answer();
            assert_eq!(answer.error().is_some(), result.is_err());
        }
    }

    /// Index and subindex come back, and the handshake.
    fn check_answer(&self, request: &Frame) {
        let answer = self.server.answer();
        assert_eq!(
            (answer.index(), answer.subindex()),
            (request.index(), request.subindex())
        );
        assert_eq!(answer.service().handshake(), request.service().handshake());
    }
}

fn job(input: &mut Input<'_>) -> Option<Job> {
    let number = u16::from_be_bytes([input.octet(), input.octet()]);
    let length = match input.below(3) {
        0 => DataLength::One,
        1 => DataLength::Two,
        _ => DataLength::Four,
    };
    let value = i32::from_be_bytes([input.octet(), input.octet(), input.octet(), input.octet()]);
    Some(Job {
        kind: if input.below(2) == 0 {
            JobKind::Read
        } else {
            JobKind::Write
        },
        code: CodeNumber::new(number)?,
        subcode: Subcode(input.octet()),
        value,
        length,
    })
}

pub(crate) fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let settings = input.octet();
    let echo = match settings >> 4 & 3 {
        0 => EchoRule::Required,
        1 => EchoRule::Ignored,
        _ => EchoRule::WhenPresent,
    };
    let options = ClientOptions {
        timeout_cycles: u32::from(settings >> 6) * 5 + 1,
        attempts: settings >> 6 & 1 | 2,
        clearing_cycles: u32::from(settings & 1) * 4,
        echo,
    };
    let mut drive = Drive {
        server: Server::new(ServerOptions {
            style: match settings >> 1 & 3 {
                0 => AnswerStyle::RequestCopied,
                1 => AnswerStyle::HandshakeOnly,
                _ => AnswerStyle::Cleared,
            },
            initial_handshake: if settings & 8 == 0 {
                Handshake::Clear
            } else {
                Handshake::Set
            },
        }),
        running: None,
    };
    let mut client = Client::new(options);
    // What lies in the images between the two.
    let (mut request, mut answer) = (Frame::EMPTY, Frame::EMPTY);

    while !input.is_empty() {
        match input.below(9) {
            0 => {
                if let Some(job) = job(&mut input) {
                    let busy = client.running();
                    assert_eq!(client.request(job).is_err(), busy.is_some());
                }
            }
            1 => request = client.step(&answer),
            2 => drive.poll(&request),
            3 => {
                let result = drive.running.as_ref().map_or(0, value_of);
                drive.complete(Ok(result));
            }
            4 => {
                let error = ErrorCode::new(input.octet(), input.octet(), u16::from(input.octet()));
                drive.complete(Err(error));
            }
            5 => answer = drive.server.answer(),
            // A bus that fails shows zeros.
            6 => answer = Frame::EMPTY,
            7 => request = Frame::EMPTY,
            _ => {
                let mut octets = [0; 8];
                let given = input.take(8);
                octets[..given.len()].copy_from_slice(given);
                if input.below(2) == 0 {
                    request = Frame(octets);
                } else {
                    answer = Frame(octets);
                }
            }
        }
        let result = client.poll_result();
        assert!(
            result.is_none() || client.running().is_none(),
            "a result, and the job still runs"
        );
    }

    // The channel works again: whatever happened before, the job under way ends, and the next one gets its own answer.
    let limit = 10 * (options.timeout_cycles + options.clearing_cycles + 4) * (u32::from(options.attempts) + 1);
    let mut cycle = |client: &mut Client| {
        request = client.step(&answer);
        drive.poll(&request);
        if let Some(job) = drive.running {
            drive.complete(Ok(value_of(&job)));
        }
        answer = drive.server.answer();
        client.poll_result()
    };
    let mut ended = |client: &mut Client| (0..limit).find_map(|_| cycle(client));
    if client.running().is_some() {
        assert!(ended(&mut client).is_some(), "the job under way never ended");
    }
    // A job that nobody waits for any more may still run in the drive; the shortest time-out is one cycle.
    for _ in 0..3 {
        assert_eq!(cycle(&mut client), None);
    }
    let mut ended = |client: &mut Client| (0..limit).find_map(|_| cycle(client));
    let question = Job::read(CodeNumber::new(1204).unwrap(), Subcode(7));
    client.request(question).unwrap();
    let result = ended(&mut client);
    assert!(result.is_some(), "the job never ended");
    // Without looking at the echo a client takes what it gets, as documented.
    if echo != EchoRule::Ignored {
        let value = value_of(&question);
        assert_eq!(result, Some(Ok(Reply::Done { job: question, value })));
    }
}
