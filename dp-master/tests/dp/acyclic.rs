//! Acyclic jobs on the virtual line: their telegrams, their place in the cycle, the frame count bit, polling, and how
//! they fail.

use dp_master::address::Address;
use dp_master::dp::{
    JobFailure, JobId, JobOutcome, JobRequest, LossCause, MAX_JOBS, MasterEvent, Mode, Poll, SlaveConfig, SlaveState,
    SubmitError, sap,
};
use dp_master::fdl::{ResponderUser, Response};
use dp_master::phy::Script;
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Header, ResponseFunction, StationType};
use proptest::prelude::*;

use crate::common::passive::PassiveStation;
use crate::common::puppet::{Puppet, Says};
use crate::common::{Line, MASTER, SLAVE, slave_identity};

const BAUD: Baud = Baud::B1500000;
const PEER: u8 = 9;

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

/// A slave with one access point, 49 ↔ 50, that needs some questions before its answer is ready.
struct SlowDevice {
    /// Questions without data that are answered with SC before the answer is ready.
    slow: usize,
    asked: usize,
    requests: Vec<Vec<u8>>,
    answer: Vec<u8>,
}

impl ResponderUser for SlowDevice {
    fn handle_request(&mut self, _now: Instant, header: &Header, data: &[u8]) -> Response<'_> {
        if header.dsap != Some(49) {
            return Response::Refuse(ResponseFunction::NoService);
        }
        if !data.is_empty() {
            self.requests.push(data.to_vec());
            self.asked = 0;
            return Response::ShortAck;
        }
        self.asked += 1;
        if self.asked > self.slow {
            Response::Low(&self.answer)
        } else {
            Response::ShortAck
        }
    }
    fn handle_repetition(&mut self, _now: Instant, _header: &Header) {}
    fn handle_unacknowledged(&mut self, _now: Instant, _header: &Header, _data: &[u8]) {}
    fn t_sdr(&self) -> BitTimes {
        BitTimes(11)
    }
}

fn add_server(line: &mut Line, slow: usize) {
    let device = SlowDevice {
        slow,
        asked: 0,
        requests: Vec::new(),
        answer: vec![0x5F, 1, 2],
    };
    line.add_station(Box::new(PassiveStation::new(address(PEER), BAUD, device)));
}

fn one_block() -> SlaveConfig {
    SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()
}

/// Runs until the job has ended.
fn finish(line: &mut Line, job: JobId) -> JobOutcome {
    let end = line.now + Duration::from_millis(2_000);
    loop {
        if let Some(outcome) = line.master.jobs().take(job) {
            return outcome;
        }
        assert!(line.now < end, "the job did not end:\n{}", line.tap.log.join("\n"));
        line.step();
    }
}

fn data(outcome: &JobOutcome) -> &[u8] {
    match outcome {
        JobOutcome::Response { data, .. } => data,
        other => panic!("no data: {other:?}"),
    }
}

/// Whole telegrams to this address octet as they stand in the log, from a place on; requests to an SAP have bit 7 set.
fn requests_to(line: &Line, from: usize, da: u8) -> Vec<String> {
    let is_to = |telegram: &&String| {
        let octets: Vec<u8> = telegram
            .split(' ')
            .map(|octet| u8::from_str_radix(octet, 16).unwrap())
            .collect();
        match octets[..] {
            [0x68, le, _, _, to, ..] => to == da && octets.len() == usize::from(le) + 6,
            [0x10, to, _, _, _, _] => to == da,
            _ => false,
        }
    };
    line.tap.log[from..].iter().filter(is_to).cloned().collect()
}

#[test]
fn a_master_in_stop_without_slaves_asks_any_station() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let request = JobRequest::srd(SLAVE, sap::GET_CFG, sap::MASTER, &[]);
    let job = line.master.jobs().submit(&request).unwrap();
    let outcome = finish(&mut line, job);
    assert_eq!(data(&outcome), [0xF3]);
    // IEC 61158-4-3: SRD of low priority, first contact: FC 6C; DSAP 59 = 3B, SSAP 62 = 3E.
    // 83 + 82 + 6C + 3B + 3E = 1EA
    let telegrams = [
        "68 05 05 68 83 82 6C 3B 3E EA 16",
        "68 06 06 68 82 83 08 3E 3B F3 79 16",
    ];
    let asked = line
        .tap
        .log
        .iter()
        .position(|telegram| telegram == telegrams[0])
        .unwrap();
    assert_eq!(line.tap.log[asked + 1], telegrams[1]);
    line.assert_no_violations();
}

#[test]
fn a_job_ends_once_and_its_place_is_free_again() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let job = line.master.jobs().submit(&JobRequest::fdl_status(SLAVE)).unwrap();
    assert_eq!(line.master.jobs().room(), MAX_JOBS - 1);
    let outcome = finish(&mut line, job);
    assert!(matches!(
        outcome,
        JobOutcome::Response {
            station: StationType::Slave,
            function: ResponseFunction::Ok,
            ..
        }
    ));
    assert_eq!(line.master.jobs().take(job), None);
    assert_eq!(line.master.jobs().room(), MAX_JOBS);
}

#[test]
fn the_frame_count_bit_goes_on_over_cyclic_and_acyclic_requests_to_one_slave() {
    let mut line = Line::new(BAUD, &[one_block()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 5);
    let heard = line.tap.log.len();
    for _ in 0..2 {
        let request = JobRequest::srd(SLAVE, sap::GET_CFG, sap::MASTER, &[]);
        let job = line.master.jobs().submit(&request).unwrap();
        assert_eq!(data(&finish(&mut line, job)), [0xF3]);
    }
    line.run_until(|line| line.master.exchanges(index) == 9);
    let octet = |telegram: &str, at: usize| telegram.split(' ').nth(at).unwrap().to_owned();
    let fcs: Vec<String> = line.tap.log[heard..]
        .iter()
        .filter(|telegram| telegram.starts_with("68") && telegram.split(' ').nth(6).unwrap() > "40")
        .map(|telegram| octet(telegram, 6))
        .collect();
    assert!(fcs.iter().any(|fc| fc.ends_with('C')), "{fcs:?}");
    // FCB is bit 5: 5x and 7x in turn, whatever is asked.
    for pair in fcs.windows(2) {
        assert_ne!(pair[0][..1], pair[1][..1], "{fcs:?}");
    }
    assert_eq!(line.slaves[0].statistics().fdl.repetitions, 0);
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_stranger_is_met_with_first_contact_and_then_counted() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    for _ in 0..3 {
        let request = JobRequest::srd(SLAVE, sap::SLAVE_DIAG, sap::MASTER, &[]);
        let job = line.master.jobs().submit(&request).unwrap();
        assert_eq!(data(&finish(&mut line, job))[..3], [0x02, 0x05, 0x00]);
    }
    let fcs: Vec<_> = requests_to(&line, 0, 0x83)
        .iter()
        .map(|telegram| telegram[18..20].to_owned())
        .collect();
    assert_eq!(fcs, ["6C", "5C", "7C"]);
    line.assert_no_violations();
}

#[test]
fn a_lost_answer_is_repeated_by_the_station_and_not_carried_out_again() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let ask = |line: &mut Line| {
        let request = JobRequest::srd(SLAVE, sap::SLAVE_DIAG, sap::MASTER, &[]);
        line.master.jobs().submit(&request).unwrap()
    };
    let job = ask(&mut line);
    finish(&mut line, job);
    // Until the token is on its way the next bursts are: request, reply.
    let job = ask(&mut line);
    let heard = line.tap.log.len();
    line.run_until(|line| requests_to(line, heard, 0x83).len() == 1);
    line.bus.script(Script::Drop {
        burst: line.bus.bursts(),
    });
    let outcome = finish(&mut line, job);
    assert_eq!(data(&outcome).len(), 6);
    let sent = requests_to(&line, heard, 0x83);
    assert_eq!(sent.len(), 2);
    assert_eq!(sent[0], sent[1]);
    assert_eq!(line.slaves[0].statistics().fdl.repetitions, 1);
    line.assert_no_violations();
}

#[test]
fn a_refusal_is_an_outcome_with_its_code() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    // Rd_Inp before data exchange.
    let request = JobRequest::srd(SLAVE, sap::RD_INP, sap::MASTER, &[]);
    let job = line.master.jobs().submit(&request).unwrap();
    let outcome = finish(&mut line, job);
    assert_eq!(
        outcome,
        JobOutcome::Failed(JobFailure::Refused(ResponseFunction::NoService))
    );
}

#[test]
fn each_failure_is_told_in_words() {
    let refused = |function| JobFailure::Refused(function).to_string();
    // UE, RR, RS: EN 50170-2, part 4, L_status.
    assert_eq!(
        refused(ResponseFunction::UserError),
        "the station refused: UE, error of its user"
    );
    assert_eq!(
        refused(ResponseFunction::NoResource),
        "the station refused: RR, no resource"
    );
    assert!(refused(ResponseFunction::NoService).starts_with("the station refused: RS,"));
    assert_eq!(
        refused(ResponseFunction::Unknown(7)),
        "the station refused: with a code that has no name"
    );
    let long = JobFailure::TooLong { got: 246 };
    assert_eq!(long.to_string(), "the response: expected at most 244 octets, got 246");
}

#[test]
fn an_absent_station_costs_the_repetitions_and_then_first_contact_again() {
    let mut line = Line::new(BAUD, &[]);
    for _ in 0..2 {
        let request = JobRequest::srd(address(PEER), sap::SLAVE_DIAG, sap::MASTER, &[]);
        let job = line.master.jobs().submit(&request).unwrap();
        assert_eq!(finish(&mut line, job), JobOutcome::Failed(JobFailure::NoAnswer));
    }
    // Retry limit 1 at 1.5 Mbit/s.
    let sent = requests_to(&line, 0, 0x80 + PEER);
    assert_eq!(sent.len(), 4);
    assert!(sent.iter().all(|telegram| &telegram[18..20] == "6C"), "{sent:?}");
    let job = line
        .master
        .jobs()
        .submit(&JobRequest::fdl_status(address(PEER)))
        .unwrap();
    assert_eq!(finish(&mut line, job), JobOutcome::Failed(JobFailure::NoAnswer));
    assert_eq!(requests_to(&line, 0, PEER).len(), 1, "FDL status is not repeated");
    line.assert_no_violations();
}

#[test]
fn a_polling_job_delivers_its_request_once_and_asks_until_there_are_data() {
    let mut line = Line::new(BAUD, &[]);
    add_server(&mut line, 3);
    let request = JobRequest::srd(address(PEER), 49, 50, &[0x57, 0xAA]).polling(Duration::from_millis(500));
    let job = line.master.jobs().submit(&request).unwrap();
    let outcome = finish(&mut line, job);
    assert_eq!(data(&outcome), [0x5F, 1, 2]);
    let sent = requests_to(&line, 0, 0x80 + PEER);
    let parts: Vec<_> = sent
        .iter()
        .map(|telegram| (&telegram[18..20], telegram.len()))
        .collect();
    // Two octets of data are 13 octets on the wire (38 characters of the log), none are 11 (32).
    assert_eq!(parts, [("6C", 38), ("5C", 32), ("7C", 32), ("5C", 32), ("7C", 32)]);
    line.assert_no_violations();
}

#[test]
fn polling_ends_after_its_time() {
    let mut line = Line::new(BAUD, &[]);
    add_server(&mut line, usize::MAX);
    let begun = line.now;
    let within = Duration::from_millis(50);
    let request = JobRequest::srd(address(PEER), 49, 50, &[0x57]).polling(within);
    let job = line.master.jobs().submit(&request).unwrap();
    assert_eq!(finish(&mut line, job), JobOutcome::Failed(JobFailure::Expired));
    // Before it stands the listening for the token: 2 ms for address 2 at 1.5 Mbit/s.
    let took = line.now - begun;
    assert!(took >= within && took < within + Duration::from_millis(4), "{took:?}");
}

#[test]
fn polling_lets_the_other_jobs_through() {
    let mut line = Line::new(BAUD, &[]);
    add_server(&mut line, usize::MAX);
    line.add_slave(slave_identity(BAUD));
    let slow = JobRequest::srd(address(PEER), 49, 50, &[0x57]).polling(Duration::from_millis(100));
    let slow = line.master.jobs().submit(&slow).unwrap();
    line.run_for(Duration::from_millis(10));
    let heard = line.tap.log.len();
    let request = JobRequest::srd(SLAVE, sap::GET_CFG, sap::MASTER, &[]);
    let job = line.master.jobs().submit(&request).unwrap();
    assert_eq!(data(&finish(&mut line, job)), [0xF3]);
    assert!(requests_to(&line, heard, 0x80 + PEER).len() <= 2);
    assert_eq!(line.master.jobs().take(slow), None, "it still polls");
}

#[test]
fn a_cycle_holds_one_acyclic_telegram_at_most() {
    let mut line = Line::new(BAUD, &[one_block()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 5);
    let heard = line.tap.log.len();
    for station in 0..MAX_JOBS as u8 {
        let request = JobRequest::fdl_status(address(100 + station));
        line.master.jobs().submit(&request).unwrap();
    }
    line.run_for(Duration::from_millis(20));
    let mut asked = 0;
    for cycle in line.tap.log[heard..].split(|telegram| telegram.starts_with("68 0B 0B 68 03 02")) {
        let status = cycle.iter().filter(|telegram| telegram.starts_with("10")).count();
        assert!(status <= 1, "{cycle:?}");
        asked += status;
    }
    assert_eq!(asked, MAX_JOBS);
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_full_queue_and_impossible_requests_are_refused_by_name() {
    let mut line = Line::new(BAUD, &[]);
    let jobs = line.master.jobs();
    let status = JobRequest::fdl_status(address(PEER));
    let own = JobRequest::fdl_status(MASTER);
    assert_eq!(jobs.submit(&own), Err(SubmitError::Peer { got: MASTER }));
    let all = JobRequest::fdl_status(Address::BROADCAST);
    assert_eq!(
        jobs.submit(&all),
        Err(SubmitError::Peer {
            got: Address::BROADCAST
        })
    );
    let high = JobRequest::srd(SLAVE, 64, 62, &[]);
    assert_eq!(jobs.submit(&high), Err(SubmitError::Sap { got: 64 }));
    let long = [0; 245];
    let long = JobRequest::srd(SLAVE, 49, 50, &long);
    assert_eq!(jobs.submit(&long), Err(SubmitError::DataTooLong { got: 245 }));
    let submitted: Vec<_> = (0..MAX_JOBS).map(|_| jobs.submit(&status).unwrap()).collect();
    assert_eq!(jobs.submit(&status), Err(SubmitError::Full));
    jobs.cancel(submitted[0]);
    let last = jobs.submit(&status).unwrap();
    assert!(!submitted.contains(&last));
}

#[test]
fn a_cancelled_job_is_not_sent_and_one_under_way_leaves_no_outcome() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let never = line
        .master
        .jobs()
        .submit(&JobRequest::fdl_status(address(PEER)))
        .unwrap();
    line.master.jobs().cancel(never);
    let request = JobRequest::srd(SLAVE, sap::GET_CFG, sap::MASTER, &[]);
    let job = line.master.jobs().submit(&request).unwrap();
    line.run_until(|line| !requests_to(line, 0, 0x83).is_empty());
    line.master.jobs().cancel(job);
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.jobs().take(job), None);
    assert_eq!(line.master.jobs().room(), MAX_JOBS);
    assert_eq!(requests_to(&line, 0, PEER), Vec::<String>::new());
    line.assert_no_violations();
}

#[test]
fn a_lost_token_aborts_the_job_under_way_and_later_ones_follow() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let foreign = line.bus.attach();
    let request = JobRequest::srd(SLAVE, sap::GET_CFG, sap::MASTER, &[]);
    let job = line.master.jobs().submit(&request).unwrap();
    line.run_until(|line| !requests_to(line, 0, 0x83).is_empty());
    // Instead of the answer a token of another master is heard.
    line.bus.disconnect(line.slave_ports[0]);
    line.bus.transmit(line.now, foreign, &[0xDC, 0x05, 0x05]);
    assert_eq!(finish(&mut line, job), JobOutcome::Failed(JobFailure::Aborted));
    line.bus.reconnect(line.slave_ports[0]);
    let heard = line.tap.log.len();
    let job = line.master.jobs().submit(&request).unwrap();
    assert_eq!(data(&finish(&mut line, job)), [0xF3]);
    // The slave may have seen the first request: first contact again.
    assert_eq!(&requests_to(&line, heard, 0x83)[0][18..20], "6C");
}

#[test]
fn a_request_that_polls_is_described_by_its_builder() {
    let within = Duration::from_millis(3);
    let request = JobRequest::srd(SLAVE, 51, 51, &[1]).polling(within);
    assert_eq!(request.poll, Poll::UntilData { within });
}

/// One thing that happens on the line or in the queue.
#[derive(Debug, Clone, Copy)]
enum Happening {
    /// The burst after so many is lost.
    Lose(u8),
    AskConfiguration,
    AskDiagnosis,
    AskStatus,
    /// Cancels the job submitted so many before.
    Cancel(u8),
    Wait(u16),
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        (0u8..6).prop_map(Happening::Lose),
        Just(Happening::AskConfiguration),
        Just(Happening::AskDiagnosis),
        Just(Happening::AskStatus),
        (0u8..4).prop_map(Happening::Cancel),
        (0u16..800).prop_map(Happening::Wait),
    ]
}

proptest! {
    /// Cyclic and acyclic requests to one slave, telegrams lost at any moment, and a slave that looks at the frame
    /// count bit alone: no answer is ever taken for that of another request, and every place in the queue comes free
    /// again.
    #[test]
    fn no_answer_is_taken_for_another_however_telegrams_are_lost(
        happenings in prop::collection::vec(happening(), 1..60),
    ) {
        let mut line = Line::new(BAUD, &[one_block()]);
        let puppet = Puppet::slave(SLAVE, BAUD, |_, _| Says::Data(ResponseFunction::DataLow, vec![0x5A; 8]));
        line.add_station(Box::new(puppet.looking_at_the_bit_alone()));
        line.master.set_mode(Mode::Operate);
        let index = line.indices[0];
        line.run_until(|line| line.master.exchanges(index) > 2);
        let mut open = Vec::new();
        for happening in happenings {
            let kind = match happening {
                Happening::Lose(after) => {
                    let burst = line.bus.bursts() + u64::from(after);
                    line.bus.script(Script::Drop { burst });
                    None
                }
                Happening::AskConfiguration => Some((JobRequest::srd(SLAVE, sap::GET_CFG, sap::MASTER, &[]), 1)),
                Happening::AskDiagnosis => Some((JobRequest::srd(SLAVE, sap::SLAVE_DIAG, sap::MASTER, &[]), 6)),
                Happening::AskStatus => Some((JobRequest::fdl_status(SLAVE), 0)),
                Happening::Cancel(before) => {
                    if let Some(place) = open.len().checked_sub(1 + usize::from(before)) {
                        let (job, _) = open.remove(place);
                        line.master.jobs().cancel(job);
                    }
                    None
                }
                Happening::Wait(micros) => {
                    line.run_for(Duration::from_micros(u64::from(micros)));
                    None
                }
            };
            if let Some((request, len)) = kind
                && let Ok(job) = line.master.jobs().submit(&request)
            {
                open.push((job, len));
            }
            prop_assert!([[0x00; 8], [0x5A; 8]].contains(&line.master.inputs(index).try_into().unwrap()));
        }
        line.run_for(Duration::from_millis(60));
        for (job, len) in open {
            match line.master.jobs().take(job) {
                Some(JobOutcome::Response { data, .. }) => prop_assert_eq!(data.len(), len),
                Some(JobOutcome::Failed(JobFailure::NoAnswer)) => {}
                other => prop_assert!(false, "{:?}", other),
            }
        }
        prop_assert_eq!(line.master.jobs().room(), MAX_JOBS);
        prop_assert_eq!(line.master.state(index), SlaveState::DataExchange);
        let exchanges = line.master.exchanges(index);
        line.run_for(Duration::from_millis(5));
        prop_assert!(line.master.exchanges(index) > exchanges);
        // Losses alone, no answer of another length or access point.
        for event in line.master_events() {
            if let MasterEvent::SlaveLost { cause, .. } = event {
                prop_assert_eq!(cause, LossCause::NoAnswer);
            }
        }
    }
}
