//! Both ends of the parameter channel, alone and composed.
//!
//! Expected octets: 9300 fact sheet, sections 3.1 to 3.3, 9 (row 22) and 11.
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use drivecom::param::{
    AnswerStyle, Client, ClientOptions, DataLength, EchoRule, ErrorCode, Frame, Handshake, Job, JobKind, Reply,
    RequestError, RequestRefused, Server, ServerAction, ServerOptions,
};
use drivecom::{CodeNumber, Subcode};
use proptest::prelude::*;

fn code(number: u16) -> CodeNumber {
    CodeNumber::new(number).unwrap()
}

fn read(number: u16) -> Job {
    Job::read(code(number), Subcode::NONE)
}

fn server(style: AnswerStyle, initial_handshake: Handshake) -> Server {
    Server::new(ServerOptions {
        style,
        initial_handshake,
    })
}

fn usual() -> Server {
    Server::default()
}

/// Polls until the job comes out; the request must be one.
fn take(server: &mut Server, octets: [u8; 8]) -> Job {
    match server.poll(&Frame(octets)) {
        ServerAction::Start(job) => job,
        other => panic!("expected a job of {}, got {other:?}", Frame(octets)),
    }
}

const READ_C1204: [u8; 8] = [0x71, 0x00, 0x5B, 0x4B, 0, 0, 0, 0];

// ---- server: octets ----

#[test]
fn writing_c0086_while_enabled_is_refused_with_the_octets_of_the_fact_sheet() {
    let mut server = usual();
    // A first job, so that handshake 0 is an edge.
    take(&mut server, READ_C1204);
    server.complete(Ok(0));
    let job = take(&mut server, [0x32, 0x00, 0x5F, 0xA9, 0x00, 0x10, 0x7A, 0xC0]);
    assert_eq!((job.kind, job.code, job.value), (JobKind::Write, code(86), 1_080_000));
    server.complete(Err(ErrorCode::OUT_OF_RANGE_OR_NOT_INHIBITED));
    assert_eq!(server.answer(), Frame([0xB0, 0x00, 0x5F, 0xA9, 0x08, 0x00, 0x00, 0x30]));
}

#[test]
fn reading_c1204_answers_with_its_value() {
    let mut server = usual();
    assert_eq!(take(&mut server, READ_C1204), read(1204));
    server.complete(Ok(1_790_708));
    assert_eq!(server.answer(), Frame([0x70, 0x00, 0x5B, 0x4B, 0x00, 0x1B, 0x52, 0xF4]));
}

#[test]
fn writing_c0039_1_carries_150_4() {
    let mut server = usual();
    let job = take(&mut server, [0x72, 0x01, 0x5F, 0xD8, 0x00, 0x16, 0xF3, 0x00]);
    assert_eq!(job, Job::write(code(39), Subcode(1), 1_504_000));
    server.complete(Ok(job.value));
    assert_eq!(server.answer(), Frame([0x70, 0x01, 0x5F, 0xD8, 0x00, 0x16, 0xF3, 0x00]));
}

#[test]
fn short_data_is_left_aligned_both_ways() {
    let mut server = usual();
    // C0150, two octets, as a read; index 24575 − 150 = 0x5F69.
    let job = take(&mut server, [0x51, 0x00, 0x5F, 0x69, 0, 0, 0, 0]);
    assert_eq!(job.length, DataLength::Two);
    server.complete(Ok(0x1234));
    assert_eq!(server.answer(), Frame([0x50, 0x00, 0x5F, 0x69, 0x12, 0x34, 0x00, 0x00]));
    // A one-octet write.
    let job = take(&mut server, [0x02, 0x00, 0x5F, 0x69, 0xFE, 9, 9, 9]);
    assert_eq!((job.length, job.value), (DataLength::One, -2));
}

#[test]
fn the_service_octet_of_the_answer_follows_the_style_of_the_module() {
    // 9300 facts 3.1 and 9, row 22: request, then answer and error answer.
    let table = [
        (AnswerStyle::Cleared, 0x71, 0x70, 0xF0),
        (AnswerStyle::Cleared, 0x72, 0x70, 0xF0),
        (AnswerStyle::RequestCopied, 0x71, 0x71, 0xF1),
        (AnswerStyle::RequestCopied, 0x72, 0x72, 0xF2),
        (AnswerStyle::HandshakeOnly, 0x71, 0x40, 0xC0),
        (AnswerStyle::HandshakeOnly, 0x72, 0x40, 0xC0),
    ];
    for (style, request, done, refused) in table {
        for (result, expected) in [(Ok(0), done), (Err(ErrorCode::TOO_HIGH), refused)] {
            let mut server = server(style, Handshake::Clear);
            take(&mut server, [request, 0x01, 0x5A, 0xEA, 0, 0, 0, 0]);
            server.complete(result);
            assert_eq!(
                server.answer().service().0,
                expected,
                "{style:?} 0x{request:02X} {result:?}"
            );
        }
        // The same with handshake 0, from a module that starts with 1.
        for (result, expected) in [(Ok(0), done), (Err(ErrorCode::TOO_HIGH), refused)] {
            let mut server = server(style, Handshake::Set);
            take(&mut server, [request & !0x40, 0x01, 0x5A, 0xEA, 0, 0, 0, 0]);
            server.complete(result);
            assert_eq!(server.answer().service().0, expected & !0x40);
        }
    }
}

// ---- server: what it answers by itself ----

#[test]
fn a_reserved_job_code_is_an_impermissible_job() {
    for job_code in 3..=7_u8 {
        let mut server = usual();
        let request = Frame([0x70 | job_code, 0x00, 0x5B, 0x4B, 1, 2, 3, 4]);
        assert_eq!(server.poll(&request), ServerAction::Answered);
        assert_eq!(server.answer(), Frame([0xF0, 0x00, 0x5B, 0x4B, 0x06, 0x05, 0x00, 0x10]));
        assert_eq!(server.running(), None);
    }
}

#[test]
fn an_index_above_24575_names_no_object() {
    let mut server = usual();
    assert_eq!(
        server.poll(&Frame([0x71, 0x00, 0x60, 0x00, 0, 0, 0, 0])),
        ServerAction::Answered
    );
    assert_eq!(server.answer(), Frame([0xF0, 0x00, 0x60, 0x00, 0x06, 0x07, 0x00, 0x00]));
}

#[test]
fn a_toggled_handshake_without_a_job_is_acknowledged_without_data() {
    let mut server = usual();
    assert_eq!(
        server.poll(&Frame([0x70, 0x02, 0x5B, 0x4B, 1, 2, 3, 4])),
        ServerAction::Answered
    );
    assert_eq!(server.answer(), Frame([0x40, 0x02, 0x5B, 0x4B, 0, 0, 0, 0]));
}

#[test]
fn every_refusal_of_the_fact_sheet_reaches_the_wire_unchanged() {
    for (error, text) in ErrorCode::TABLE {
        let mut server = usual();
        take(&mut server, READ_C1204);
        server.complete(Err(*error));
        let answer = server.answer();
        assert_eq!(answer.error(), Some(*error), "{text}");
        assert_eq!(answer.0[..4], [0xF0, 0x00, 0x5B, 0x4B]);
    }
}

// ---- server: the handshake ----

#[test]
fn before_the_first_job_the_answer_is_all_zero() {
    let mut server = usual();
    assert_eq!(server.answer(), Frame::EMPTY);
    assert_eq!(server.poll(&Frame::EMPTY), ServerAction::None);
    assert_eq!(server.answer(), Frame::EMPTY);
}

#[test]
fn the_old_answer_stays_while_a_job_runs() {
    let mut server = usual();
    take(&mut server, READ_C1204);
    server.complete(Ok(7));
    let old = server.answer();
    take(&mut server, [0x31, 0x00, 0x5B, 0x4D, 0, 0, 0, 0]);
    for _ in 0..10 {
        assert_eq!(
            server.poll(&Frame([0x31, 0x00, 0x5B, 0x4D, 0, 0, 0, 0])),
            ServerAction::None
        );
        assert_eq!(server.answer(), old);
    }
    server.complete(Ok(70_000));
    assert_eq!(server.answer(), Frame([0x30, 0x00, 0x5B, 0x4D, 0x00, 0x01, 0x11, 0x70]));
}

#[test]
fn changed_data_without_a_changed_handshake_starts_nothing() {
    let mut server = usual();
    take(&mut server, READ_C1204);
    server.complete(Ok(7));
    for other in [
        [0x72, 0x01, 0x5A, 0xEA, 1, 2, 3, 4],
        [0x71, 0x00, 0x5B, 0x4D, 0, 0, 0, 0],
    ] {
        assert_eq!(server.poll(&Frame(other)), ServerAction::None);
    }
}

#[test]
fn a_handshake_inverted_while_a_job_runs_is_taken_up_after_it() {
    let mut server = usual();
    take(&mut server, READ_C1204);
    let impatient = Frame([0x31, 0x00, 0x5B, 0x4D, 0, 0, 0, 0]);
    assert_eq!(server.poll(&impatient), ServerAction::None);
    assert!(server.complete(Ok(1)));
    assert_eq!(server.poll(&impatient), ServerAction::Start(read(1202)));
}

#[test]
fn completing_without_a_job_changes_nothing() {
    let mut server = usual();
    assert!(!server.complete(Ok(1)));
    assert_eq!(server.answer(), Frame::EMPTY);
}

#[test]
fn a_module_that_starts_with_handshake_1_keeps_it_until_a_job_inverts_it() {
    let mut server = server(AnswerStyle::Cleared, Handshake::Set);
    assert_eq!(server.answer(), Frame([0x40, 0, 0, 0, 0, 0, 0, 0]));
    assert_eq!(server.poll(&Frame::EMPTY), ServerAction::None, "nobody has spoken yet");
    assert_eq!(
        server.poll(&Frame(READ_C1204)),
        ServerAction::None,
        "handshake 1 is no edge here"
    );
    assert_eq!(server.answer(), Frame([0x40, 0, 0, 0, 0, 0, 0, 0]));
    take(&mut server, [0x31, 0x00, 0x5B, 0x4B, 0, 0, 0, 0]);
}

// ---- composed ----

/// A drive that needs some cycles for a job; the bus needs one cycle each way.
struct Chain {
    client: Client,
    server: Server,
    delay: u32,
    left: u32,
    to_drive: Frame,
    to_master: Frame,
    powered: bool,
    echoes: bool,
    done: Vec<Job>,
}

impl Chain {
    fn new(options: ServerOptions, delay: u32) -> Self {
        Self {
            client: Client::new(ClientOptions {
                timeout_cycles: 20,
                ..ClientOptions::default()
            }),
            server: Server::new(options),
            delay,
            left: 0,
            to_drive: Frame::EMPTY,
            to_master: Frame::EMPTY,
            powered: true,
            echoes: true,
            done: Vec::new(),
        }
    }

    /// What this drive says to a job: C1204 is 179.0708, C0086 is refused, all else echoes.
    fn execute(job: Job) -> Result<i32, ErrorCode> {
        match (job.code.number(), job.kind) {
            (1204, JobKind::Read) => Ok(1_790_708),
            (86, JobKind::Write) => Err(ErrorCode::OUT_OF_RANGE_OR_NOT_INHIBITED),
            _ => Ok(job.value),
        }
    }

    fn cycle(&mut self) {
        let request = self.client.step(&self.to_master);
        if self.powered {
            if let ServerAction::Start(_) = self.server.poll(&self.to_drive) {
                self.left = self.delay;
            }
            if let Some(job) = self.server.running() {
                match self.left.checked_sub(1) {
                    Some(left) => self.left = left,
                    None => {
                        self.done.push(job);
                        self.server.complete(Self::execute(job));
                    }
                }
            }
            self.to_master = self.server.answer();
            if !self.echoes {
                self.to_master.0[1..4].fill(0);
            }
        }
        self.to_drive = request;
    }

    fn ask(&mut self, job: Job) -> Result<Reply, RequestError> {
        self.client.request(job).unwrap();
        for _ in 0..1000 {
            self.cycle();
            if let Some(result) = self.client.poll_result() {
                return result;
            }
        }
        panic!("{job}: the client must come to an end");
    }
}

fn starts_with_1() -> ServerOptions {
    ServerOptions {
        initial_handshake: Handshake::Set,
        ..ServerOptions::default()
    }
}

fn styles() -> [ServerOptions; 6] {
    [
        AnswerStyle::Cleared,
        AnswerStyle::RequestCopied,
        AnswerStyle::HandshakeOnly,
    ]
    .map(|style| {
        [Handshake::Clear, Handshake::Set].map(|initial_handshake| ServerOptions {
            style,
            initial_handshake,
        })
    })
    .concat()
    .try_into()
    .unwrap()
}

#[test]
fn jobs_come_through_late_and_early_with_every_style_and_either_start_level() {
    for options in styles() {
        for delay in 0..8 {
            let mut chain = Chain::new(options, delay);
            let mut expected = Vec::new();
            for round in 0..3 {
                let write = Job::write(code(1301), Subcode(1), 12_000_000 + round);
                assert_eq!(
                    chain.ask(write),
                    Ok(Reply::Done {
                        job: write,
                        value: write.value
                    })
                );
                let job = read(1204);
                assert_eq!(chain.ask(job), Ok(Reply::Done { job, value: 1_790_708 }));
                expected.extend([write, job]);
            }
            assert_eq!(
                chain.done, expected,
                "each job once, in order: {options:?}, delay {delay}"
            );
        }
    }
}

#[test]
fn a_refused_job_is_an_answer_and_the_next_job_goes_on() {
    let mut chain = Chain::new(ServerOptions::default(), 2);
    let job = Job::write(code(86), Subcode::NONE, 1_080_000);
    let error = ErrorCode::OUT_OF_RANGE_OR_NOT_INHIBITED;
    assert_eq!(chain.ask(job), Ok(Reply::Refused { job, error }));
    let job = read(1204);
    assert_eq!(chain.ask(job), Ok(Reply::Done { job, value: 1_790_708 }));
}

#[test]
fn a_client_that_ignores_the_echo_falls_into_the_trap_of_the_block() {
    // Film-feed specification, section 8.1, point 8: the first telegram counts as done and was never delivered.
    let mut chain = Chain::new(starts_with_1(), 2);
    chain.client = Client::new(ClientOptions {
        echo: EchoRule::Ignored,
        ..ClientOptions::default()
    });
    let job = read(1204);
    assert_eq!(
        chain.ask(job),
        Ok(Reply::Done { job, value: 0 }),
        "data of an answer to nothing"
    );
    assert!(chain.done.is_empty());
}

#[test]
fn a_silent_drive_ends_in_a_timeout_counted_in_cycles() {
    let mut client = Client::new(ClientOptions {
        timeout_cycles: 5,
        ..ClientOptions::default()
    });
    let job = read(1204);
    client.request(job).unwrap();
    let mut cycles = 0;
    let result = loop {
        client.step(&Frame::EMPTY);
        cycles += 1;
        if let Some(result) = client.poll_result() {
            break result;
        }
    };
    // One step sends, five wait.
    assert_eq!((cycles, result), (6, Err(RequestError::Timeout { job, cycles: 5 })));
    assert_eq!(
        client.step(&Frame::EMPTY),
        job.request(true),
        "the request stays on the bus"
    );
}

#[test]
fn after_two_silent_timeouts_the_handshake_is_laid_down_for_the_cycles_of_the_option() {
    for clearing_cycles in [1, 4] {
        let mut client = Client::new(ClientOptions {
            timeout_cycles: 5,
            clearing_cycles,
            ..ClientOptions::default()
        });
        let (first, second) = (read(1204), read(1202));
        client.request(first).unwrap();
        while client.poll_result().is_none() {
            client.step(&Frame::EMPTY);
        }
        client.request(second).unwrap();
        let sent: Vec<_> = (0..20).map(|_| client.step(&Frame::EMPTY)).collect();
        let laid_down = sent.iter().filter(|frame| **frame == Frame::EMPTY).count();
        assert_eq!(laid_down, clearing_cycles as usize, "{sent:?}");
        let begins = sent.iter().position(|frame| *frame == second.request(true)).unwrap();
        assert!(sent[..begins].ends_with(&vec![Frame::EMPTY; laid_down]), "{sent:?}");
    }
}

#[test]
fn after_a_timeout_a_late_answer_is_not_taken_for_the_next_job() {
    let mut chain = Chain::new(ServerOptions::default(), 30);
    let first = Job::write(code(1301), Subcode(1), 1);
    let second = Job::write(code(1301), Subcode(1), 2);
    assert_eq!(chain.ask(first), Err(RequestError::Timeout { job: first, cycles: 20 }));
    chain.delay = 0;
    assert_eq!(chain.ask(second), Ok(Reply::Done { job: second, value: 2 }));
    assert_eq!(chain.done, [first, second]);
}

#[test]
fn a_drive_that_was_away_answers_again_when_it_is_back() {
    let mut chain = Chain::new(ServerOptions::default(), 1);
    let job = read(1204);
    for _ in 0..3 {
        chain.ask(job).unwrap();
        chain.powered = false;
        assert!(matches!(chain.ask(job), Err(RequestError::Timeout { .. })));
        assert!(matches!(chain.ask(job), Err(RequestError::Timeout { .. })));
        // It lost its memory meanwhile.
        chain.server = Server::default();
        chain.powered = true;
        assert_eq!(chain.ask(job), Ok(Reply::Done { job, value: 1_790_708 }));
    }
}

#[test]
fn an_answer_image_that_falls_to_zero_is_no_answer() {
    // Film-feed specification, section 8.1, point 9: the block takes it as data 0.
    let mut chain = Chain::new(ServerOptions::default(), 0);
    let job = read(1204);
    chain.ask(job).unwrap();
    // The next request carries handshake 0; the image falls to zero before the drive sees it.
    chain.client.request(job).unwrap();
    assert_eq!(chain.client.step(&chain.to_master), job.request(false));
    assert_eq!(
        chain.client.step(&Frame::EMPTY),
        job.request(true),
        "asked again, inverted"
    );
    assert_eq!(chain.client.poll_result(), None);
}

#[test]
fn a_drive_that_has_echoed_once_must_go_on_echoing() {
    let mut chain = Chain::new(ServerOptions::default(), 0);
    let job = read(1204);
    chain.ask(job).unwrap();
    chain.client.request(job).unwrap();
    let mut sent = chain.client.step(&chain.to_master);
    // Every level comes back, but with nothing behind it.
    let result = loop {
        let empty = Frame([sent.0[0] & 0x40, 0, 0, 0, 0, 0, 0, 0]);
        sent = chain.client.step(&empty);
        if let Some(result) = chain.client.poll_result() {
            break result;
        }
    };
    assert!(
        matches!(result, Err(RequestError::NotDelivered { attempts: 3, .. })),
        "{result:?}"
    );
}

#[test]
fn a_drive_without_echo_is_recognised_by_its_second_answer() {
    let mut chain = Chain::new(ServerOptions::default(), 1);
    chain.echoes = false;
    let job = read(1204);
    assert_eq!(chain.ask(job), Ok(Reply::Done { job, value: 1_790_708 }));
    assert_eq!(chain.done.len(), 2, "the first answer could have been a standing one");
    assert_eq!(chain.ask(job), Ok(Reply::Done { job, value: 1_790_708 }));
    assert_eq!(chain.done.len(), 3, "from then on each job once");
}

#[test]
fn where_the_echo_is_required_a_drive_without_it_is_never_believed() {
    let mut chain = Chain::new(ServerOptions::default(), 1);
    chain.echoes = false;
    chain.client = Client::new(ClientOptions {
        echo: EchoRule::Required,
        ..ClientOptions::default()
    });
    let result = chain.ask(read(1204));
    assert!(
        matches!(result, Err(RequestError::NotDelivered { attempts: 3, .. })),
        "{result:?}"
    );
}

#[test]
fn an_answer_that_never_fits_ends_the_attempts() {
    let mut client = Client::default();
    let job = read(1204);
    client.request(job).unwrap();
    let mut sent = client.step(&Frame::EMPTY);
    let mut attempts = 1;
    let result = loop {
        // Somebody answers C1202 whatever is asked.
        let stranger = read(1202).request(sent.service().handshake());
        let next = client.step(&stranger);
        if let Some(result) = client.poll_result() {
            break result;
        }
        assert_ne!(next.service().handshake(), sent.service().handshake());
        sent = next;
        attempts += 1;
    };
    assert_eq!(attempts, 3);
    assert!(
        matches!(result, Err(RequestError::NotDelivered { attempts: 3, .. })),
        "{result:?}"
    );
}

#[test]
fn the_answer_to_the_other_direction_is_a_stranger() {
    let mut client = Client::default();
    let job = Job::write(code(1301), Subcode(1), 5);
    client.request(job).unwrap();
    client.step(&Frame::EMPTY);
    // Job bits "read" in the answer of a module that copies them.
    client.step(&Frame([0x71, 0x01, 0x5A, 0xEA, 0, 0, 0, 5]));
    assert_eq!(client.poll_result(), None);
}

#[test]
fn a_second_job_is_refused_while_one_runs() {
    let mut client = Client::default();
    client.request(read(1204)).unwrap();
    assert_eq!(client.request(read(1202)), Err(RequestRefused { running: read(1204) }));
    client.step(&Frame::EMPTY);
    assert_eq!(client.request(read(1202)), Err(RequestRefused { running: read(1204) }));
    assert_eq!(client.running(), Some(read(1204)));
}

#[test]
fn errors_name_the_job_what_was_expected_and_what_came() {
    let job = read(1204);
    assert_eq!(
        RequestError::Timeout { job, cycles: 5 }.to_string(),
        "read C1204: expected an answer within 5 cycles, got none"
    );
    assert_eq!(
        RequestRefused { running: job }.to_string(),
        "expected a free parameter channel, got one busy with: read C1204"
    );
}

proptest! {
    #[test]
    fn no_octets_make_the_server_panic_and_every_answer_shows_the_accepted_level(
        requests in prop::collection::vec((any::<[u8; 8]>(), any::<bool>()), 0..64),
        start in any::<bool>(),
    ) {
        let initial_handshake = if start { Handshake::Set } else { Handshake::Clear };
        let mut server = server(AnswerStyle::Cleared, initial_handshake);
        for (octets, complete) in requests {
            let before = server.answer();
            let busy = server.running().is_some();
            let action = server.poll(&Frame(octets));
            prop_assert!(!busy || action == ServerAction::None);
            if action != ServerAction::Answered {
                prop_assert_eq!(server.answer(), before);
            }
            if complete && server.complete(Ok(1)) {
                prop_assert!(server.running().is_none());
            }
            if action == ServerAction::Answered || (complete && matches!(action, ServerAction::Start(_))) {
                prop_assert_eq!(server.answer().service().handshake(), octets[0] & 0x40 != 0);
                prop_assert_eq!(server.answer().0[1..4].to_vec(), octets[1..4].to_vec());
            }
        }
    }

    #[test]
    fn whatever_a_drive_sends_the_client_ends_within_its_limits(
        answers in prop::collection::vec(any::<[u8; 8]>(), 1..40),
        number in 0..=24_575_u16,
    ) {
        let options = ClientOptions { timeout_cycles: 10, ..ClientOptions::default() };
        let mut client = Client::new(options);
        let job = read(number);
        client.request(job).unwrap();
        let mut cycles = 0;
        let mut stream = answers.iter().cycle();
        while client.poll_result().is_none() {
            client.step(&Frame(*stream.next().unwrap()));
            cycles += 1;
            prop_assert!(cycles <= 1 + 10 * 3, "bounded by attempts and time-out");
        }
        prop_assert_eq!(client.running(), None);
    }

    #[test]
    fn any_delays_and_job_lists_come_through_once_and_in_order(
        jobs in prop::collection::vec((0..=24_575_u16, any::<u8>(), any::<i32>(), any::<bool>(), 0..10_u32), 1..12),
        start in any::<bool>(),
    ) {
        let options = if start { starts_with_1() } else { ServerOptions::default() };
        let mut chain = Chain::new(options, 0);
        let mut expected = Vec::new();
        for (number, subcode, value, write, delay) in jobs {
            let job = if write {
                Job::write(code(number), Subcode(subcode), value)
            } else {
                Job::read(code(number), Subcode(subcode))
            };
            // Index 0, subindex 0 (C24575) looks like no echo at all and cannot be told from a lost delivery.
            prop_assume!(number != 24_575);
            chain.delay = delay;
            let reply = chain.ask(job);
            let expected_reply = match Chain::execute(job) {
                Ok(value) => Reply::Done { job, value },
                Err(error) => Reply::Refused { job, error },
            };
            prop_assert_eq!(reply, Ok(expected_reply));
            expected.push(job);
        }
        prop_assert_eq!(&chain.done, &expected);
    }
}
