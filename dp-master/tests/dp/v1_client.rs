//! Both clients of a master on the virtual line: against slaves, beside the cyclic exchange, through noise, and against a station that answers
//! what it should not.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use dp_master::dp::v1::{
    Abort, AddAck, Addresses, AlarmMode, AlarmSap, AlarmType, AlarmTypes, ErrorCode1, Features, Incident, Initiate,
    Msac1Client, Msac2Client, Msac2Event, SendTimeout, V1Answer, V1Capabilities, V1ClientError, V1Data, V1Error,
    V1Failure, V1Service, V1Status, alarms_of, reason,
};
use dp_master::dp::{
    JobFailure, JobRequest, MAX_JOBS, MasterConfig, MasterEvent, Mode, Octets, SlaveConfig, SlaveEvent, SlaveIdentity,
    SlaveState, Support,
};
use dp_master::fdl::{BusParams, ResponderUser, Response};
use dp_master::phy::Disturbance;
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Header, ResponseFunction};

use crate::common::passive::PassiveStation;
use crate::common::{Line, MASTER, SLAVE, slave_identity};

const BAUD: Baud = Baud::B1500000;
const INITIATE: Initiate<'static> = Initiate {
    send_timeout: SendTimeout(100),
    features: Features::READ_WRITE,
    profile_features: 0,
    profile_ident: 0,
    addresses: Addresses::DIRECT,
};

fn identity() -> SlaveIdentity {
    SlaveIdentity {
        v1: V1Capabilities {
            c1_read_write: Support::Supported,
            alarms: AlarmTypes::ALL,
            c2_connections: 2,
            profile_ident: 0x3B00,
            ..V1Capabilities::NONE
        },
        ..slave_identity(BAUD)
    }
}

fn slave_config(status: V1Status) -> SlaveConfig {
    SlaveConfig {
        user_prm: Octets::from_slice(&status.octets()).unwrap(),
        ..SlaveConfig::new(SLAVE, 0x00DA, &[0xF3, 0xF3]).unwrap()
    }
}

/// A master in Operate that exchanges data with one slave, once in `min_cycle`.
fn exchanging(status: V1Status, min_cycle: Duration) -> Line {
    // Nobody is looked for above the master.
    let params = BusParams {
        hsa: MASTER,
        ..BusParams::standard(BAUD)
    };
    let config = MasterConfig {
        min_cycle,
        ..MasterConfig::new(MASTER, params)
    };
    let mut line = Line::with_config(config, &[slave_config(status)]);
    line.add_slave(identity());
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.master.state(line.indices[0]) == SlaveState::DataExchange);
    line.run_for(Duration::from_millis(5));
    line.master_events();
    line.slave_events(0);
    line
}

/// A master without slaves of its own, in Stop, and a slave that nobody has parametrised.
fn tool_line(slaves: usize) -> Line {
    let config = MasterConfig {
        min_cycle: Duration::from_millis(1),
        ..MasterConfig::new(MASTER, BusParams::standard(BAUD))
    };
    let mut line = Line::with_config(config, &[]);
    for _ in 0..slaves {
        line.add_slave(identity());
    }
    line
}

/// The application of a slave: answers a Read with as many octets as were asked, each with the number of the index; after `delay`.
struct Application {
    delay: Duration,
    waiting: Vec<(Instant, dp_master::dp::v1::V1Request)>,
}

impl Application {
    fn with_delay(milliseconds: u64) -> Self {
        Self {
            delay: Duration::from_millis(milliseconds),
            waiting: Vec::new(),
        }
    }

    fn serve(&mut self, line: &mut Line) {
        let (now, slave) = (line.now, &mut line.slaves[0]);
        while let Some(request) = slave.poll_v1_request() {
            self.waiting.push((now + self.delay, request));
        }
        self.waiting.retain(|(due, request)| {
            if *due > now {
                return true;
            }
            let answer = match request.service {
                V1Service::Read { index, length, .. } => Ok(vec![index; usize::from(length)]),
                V1Service::Write { index: 255, .. } => Err(V1Error::new(ErrorCode1::ACCESS_DENIED)),
                V1Service::Write { .. } => Ok(vec![]),
                V1Service::DataTransport { data, .. } => Ok(data.iter().rev().copied().collect()),
            };
            let _ = slave.respond_v1(now, request.id, answer.as_deref().map_err(|error| *error));
            false
        });
    }
}

/// Steps until the client has an answer.
fn answer(line: &mut Line, client: &mut Msac1Client, application: &mut Application) -> Result<V1Answer, V1Failure> {
    let end = line.now + Duration::from_millis(3_000);
    loop {
        assert!(line.now < end, "no answer:\n{}", line.tap.log.join("\n"));
        line.step();
        application.serve(line);
        if let Some(answer) = client.poll(line.master.jobs()) {
            return answer;
        }
    }
}

/// Steps until the connection has an event.
fn event(line: &mut Line, client: &mut Msac2Client, application: &mut Application) -> Msac2Event {
    let end = line.now + Duration::from_millis(20_000);
    loop {
        assert!(line.now < end, "no event:\n{}", line.tap.log[..40].join("\n"));
        line.step();
        if !line.slaves.is_empty() {
            application.serve(line);
        }
        if let Some(event) = client.step(line.master.jobs(), line.now) {
            return event;
        }
    }
}

fn opened(line: &mut Line) -> Msac2Client {
    let mut client = Msac2Client::new(SLAVE);
    client.connect(line.master.jobs(), &INITIATE).unwrap();
    let event = event(line, &mut client, &mut Application::with_delay(0));
    assert!(matches!(event, Msac2Event::Opened(_)), "{event:?}");
    client
}

fn record(slot: u8, index: u8, data: &[u8]) -> V1Answer {
    V1Answer::Data {
        slot,
        index,
        data: V1Data::from_slice(data).unwrap(),
    }
}

#[test]
fn a_data_record_is_read_and_written_beside_the_exchange() {
    let mut line = exchanging(V1Status::ENABLED, Duration::from_millis(1));
    let mut client = Msac1Client::new(SLAVE);
    let mut application = Application::with_delay(10);
    let before = line.tap.log.len();
    client.read(line.master.jobs(), 0, 47, 4).unwrap();
    assert_eq!(client.read(line.master.jobs(), 0, 47, 4), Err(V1ClientError::Busy));
    let result = answer(&mut line, &mut client, &mut application);
    assert_eq!(result, Ok(record(0, 47, &[47; 4])));
    assert!(!client.is_busy());
    client.write(line.master.jobs(), 1, 2, &[7, 8, 9]).unwrap();
    let written = V1Answer::Written {
        slot: 1,
        index: 2,
        length: 3,
    };
    assert_eq!(answer(&mut line, &mut client, &mut application), Ok(written));
    client.write(line.master.jobs(), 1, 255, &[7]).unwrap();
    let refused = V1Error::new(ErrorCode1::ACCESS_DENIED);
    assert_eq!(
        answer(&mut line, &mut client, &mut application),
        Err(V1Failure::Refused(refused))
    );
    line.assert_no_violations();

    // On the wire: request to SAP 51 (83 82: addresses with extension), acknowledged, polled, answered with low priority.
    let log: Vec<_> = line.tap.log[before..].iter().map(String::as_str).collect();
    let request = log
        .iter()
        .position(|telegram| telegram.contains("33 33 5E 00 2F 04"))
        .unwrap();
    // LE 9, DA 83, SA 82, FC 5C or 7C, DSAP 33, SSAP 33.
    assert!(log[request].starts_with("68 09 09 68 83 82 "), "{}", log[request]);
    assert_eq!(log[request + 1], "E5");
    let answers: Vec<_> = log
        .iter()
        .filter(|telegram| telegram.contains("08 33 33 5E 00 2F 04 2F 2F 2F 2F"))
        .collect();
    assert_eq!(answers.len(), 1);
}

#[test]
fn reading_all_the_time_lengthens_a_cycle_by_one_message_at_most() {
    let mut line = exchanging(V1Status::ENABLED, Duration::ZERO);
    let application = &mut Application::with_delay(3);
    let mut client = Msac1Client::new(SLAVE);
    line.run_for(Duration::from_millis(20));
    let quiet = line.master.statistics();
    let mut reads = 0;
    let mut longest = Duration::ZERO;
    while reads < 50 {
        if !client.is_busy() {
            client.read(line.master.jobs(), 0, 1, 240).unwrap();
        }
        line.step();
        application.serve(&mut line);
        longest = longest.max(line.master.statistics().last_cycle);
        if let Some(result) = client.poll(line.master.jobs()) {
            assert_eq!(result, Ok(record(0, 1, &[1; 240])));
            reads += 1;
        }
    }
    // The longest message cycle: an empty SRD with access points (11 characters), min Tsdr 11 tBIT, the longest response (4 octets of header
    // in the PDU, 240 of data, 2 access points, 9 of SD2: 255 characters), Tid1.
    let tid1 = BusParams::standard(BAUD).t_id1;
    let message = BAUD.characters(11) + BAUD.duration(BitTimes(11)) + BAUD.characters(255) + BAUD.duration(tid1);
    // And a question to one of the addresses 0 and 1, which lie in the GAP of a lone master: 6 characters and the slot time.
    let gap = BAUD.characters(6) + BusParams::standard(BAUD).slot_time();
    let allowed = quiet.longest_cycle + message + gap + Duration::from_micros(1);
    assert!(longest > quiet.longest_cycle, "something was read");
    assert!(longest <= allowed, "{longest:?} > {allowed:?}");
    assert_eq!(line.master.statistics().retries, 0);
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_slow_application_never_delays_the_exchange() {
    let mut line = exchanging(V1Status::ENABLED, Duration::from_millis(1));
    let mut client = Msac1Client::new(SLAVE);
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    let (exchanges, now) = (line.master.exchanges(line.indices[0]), line.now);
    let result = answer(&mut line, &mut client, &mut Application::with_delay(700));
    assert_eq!(result, Ok(record(0, 1, &[1; 8])));
    let elapsed = (line.now - now).as_nanos() / 1_000_000;
    let count = line.master.exchanges(line.indices[0]) - exchanges;
    assert!(
        elapsed >= 700 && count >= elapsed - 1,
        "{count} exchanges in {elapsed} ms"
    );
}

#[test]
fn a_slave_that_takes_longer_than_the_client_waits_is_busy_until_it_has_answered() {
    let mut line = exchanging(V1Status::ENABLED, Duration::from_millis(1));
    let mut client = Msac1Client::new(SLAVE).with_timeout(Duration::from_millis(50));
    let application = &mut Application::with_delay(200);
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    assert_eq!(
        answer(&mut line, &mut client, application),
        Err(V1Failure::Job(JobFailure::Expired))
    );
    client.read(line.master.jobs(), 0, 2, 8).unwrap();
    let busy = JobFailure::Refused(ResponseFunction::NoResource);
    assert_eq!(answer(&mut line, &mut client, application), Err(V1Failure::Job(busy)));
    for _ in 0..1_000 {
        line.step();
        application.serve(&mut line);
    }
    line.run_for(Duration::from_millis(200));
    application.serve(&mut line);
    // The late answer to the first request is not taken for one to the third.
    client.read(line.master.jobs(), 0, 3, 2).unwrap();
    application.delay = Duration::ZERO;
    assert_eq!(answer(&mut line, &mut client, application), Ok(record(0, 3, &[3; 2])));
}

#[test]
fn without_dpv1_enable_the_slave_refuses_and_the_exchange_goes_on() {
    let mut line = exchanging(V1Status::default(), Duration::from_millis(1));
    let mut client = Msac1Client::new(SLAVE);
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    let refused = JobFailure::Refused(ResponseFunction::NoService);
    let result = answer(&mut line, &mut client, &mut Application::with_delay(0));
    assert_eq!(result, Err(V1Failure::Job(refused)));
    line.run_for(Duration::from_millis(20));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
}

#[test]
fn a_slave_that_is_not_there_is_told() {
    let mut line = tool_line(0);
    let mut client = Msac1Client::new(SLAVE);
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    let end = line.now + Duration::from_millis(500);
    let result = loop {
        assert!(line.now < end);
        line.step();
        if let Some(result) = client.poll(line.master.jobs()) {
            break result;
        }
    };
    assert_eq!(result, Err(V1Failure::Job(JobFailure::NoAnswer)));
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    client.cancel(line.master.jobs());
    assert!(!client.is_busy());
    assert_eq!(client.poll(line.master.jobs()), None);
}

#[test]
fn an_alarm_goes_all_the_way() {
    for at in [AlarmSap::Shared, AlarmSap::Extra] {
        let status = V1Status::ENABLED.with_alarms(AlarmTypes::DIAGNOSIS, AlarmMode::Two);
        let mut line = exchanging(status, Duration::from_millis(1));
        let place = (AlarmType::DIAGNOSIS, 3);
        let sent = line.slaves[0]
            .send_alarm(place, Incident::Appears, AddAck::NotNeeded, &[0x11, 0x22])
            .unwrap();
        let index = line.indices[0];
        let mut seen = false;
        line.run_until(|line| {
            line.master
                .diagnosis(index)
                .is_some_and(|d| alarms_of(d).next().is_some())
        });
        for event in line.master_events() {
            seen |= matches!(event, MasterEvent::Diagnosis { .. });
        }
        assert!(seen);
        let alarm = line.master.diagnosis(index).map(|d| {
            let alarm = alarms_of(d).next().unwrap();
            assert_eq!(alarm.data, [0x11, 0x22]);
            alarm.ack()
        });
        assert_eq!(alarm, Some(sent));
        let mut client = Msac1Client::new(SLAVE);
        client.acknowledge(line.master.jobs(), at, sent).unwrap();
        let result = answer(&mut line, &mut client, &mut Application::with_delay(0));
        assert_eq!(result, Ok(V1Answer::AlarmAcknowledged(sent)));
        let told = SlaveEvent::AlarmAcknowledged { alarm: sent };
        assert!(line.slave_events(0).contains(&told));
        // A second acknowledgement finds nothing.
        client.acknowledge(line.master.jobs(), at, sent).unwrap();
        let result = answer(&mut line, &mut client, &mut Application::with_delay(0));
        let conflict = V1Error::new(ErrorCode1::STATE_CONFLICT);
        assert_eq!(result, Err(V1Failure::Refused(conflict)));
        line.assert_no_violations();
    }
}

#[test]
fn noise_costs_time_but_never_a_wrong_record() {
    let mut line = exchanging(V1Status::ENABLED, Duration::from_millis(1));
    line.bus.set_disturbance(Some(Disturbance::new(7, 2e-4).unwrap()));
    let mut client = Msac1Client::new(SLAVE).with_timeout(Duration::from_millis(100));
    let application = &mut Application::with_delay(2);
    let (mut good, mut failed) = (0, 0);
    for round in 0..400_u32 {
        let index = (round % 200) as u8;
        client.read(line.master.jobs(), 0, index, 20).unwrap();
        match answer(&mut line, &mut client, application) {
            Ok(result) => {
                assert_eq!(result, record(0, index, &[index; 20]));
                good += 1;
            }
            Err(V1Failure::Job(_)) => failed += 1,
            // The answer to a request before, whose own was lost with all repetitions.
            Err(other) => panic!("{other:?}"),
        }
    }
    assert!(line.master.statistics().retries > 50, "{:?}", line.master.statistics());
    assert!(good > 300, "{good} good, {failed} failed");
}

#[test]
fn a_connection_opens_reads_writes_transports_and_ends() {
    let mut line = tool_line(1);
    let mut client = Msac2Client::new(SLAVE);
    let application = &mut Application::with_delay(5);
    assert_eq!(client.read(line.master.jobs(), 0, 1, 2), Err(V1ClientError::NotOpen));
    client.connect(line.master.jobs(), &INITIATE).unwrap();
    assert_eq!(
        client.connect(line.master.jobs(), &INITIATE),
        Err(V1ClientError::NotClosed)
    );
    let Msac2Event::Opened(link) = event(&mut line, &mut client, application) else {
        panic!("not opened");
    };
    assert_eq!(
        (link.sap, link.send_timeout, link.max_data),
        (48, SendTimeout(100), 240)
    );
    assert_eq!((link.features, link.profile_ident), (Features::READ_WRITE, 0x3B00));
    assert_eq!(client.connected(), Some(&link));

    client.read(line.master.jobs(), 3, 9, 240).unwrap();
    assert_eq!(client.read(line.master.jobs(), 0, 1, 2), Err(V1ClientError::Busy));
    let got = event(&mut line, &mut client, application);
    assert_eq!(got, Msac2Event::Answer(Ok(record(3, 9, &[9; 240]))));

    client.write(line.master.jobs(), 3, 255, &[1]).unwrap();
    let refused = V1Error::new(ErrorCode1::ACCESS_DENIED);
    assert_eq!(
        event(&mut line, &mut client, application),
        Msac2Event::Answer(Err(refused))
    );

    client.transport(line.master.jobs(), 1, 1, &[1, 2, 3]).unwrap();
    let got = event(&mut line, &mut client, application);
    assert_eq!(got, Msac2Event::Answer(Ok(record(1, 1, &[3, 2, 1]))));

    client.abort(line.master.jobs(), Abort::user(6));
    assert_eq!(
        event(&mut line, &mut client, application),
        Msac2Event::Closed(Abort::user(6))
    );
    assert_eq!(client.connected(), None);
    let events = line.slave_events(0);
    let [
        SlaveEvent::ConnectionOpened { sap: 48, master },
        SlaveEvent::ConnectionClosed { sap: 48, abort },
    ] = events[..]
    else {
        panic!("{events:?}");
    };
    assert_eq!((master, abort), (MASTER, Abort::user(6)));
    line.assert_no_violations();
}

#[test]
fn idle_keeps_a_connection_for_minutes_and_a_request_may_come_at_any_time() {
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    let application = &mut Application::with_delay(0);
    let mut idles = 0;
    // A request every seven seconds, at ever other moments of the keep-alive.
    for round in 0..20_u64 {
        let until = line.now + Duration::from_millis(7_000 + 37 * round);
        let log = line.tap.log.len();
        while line.now < until {
            line.step();
            assert_eq!(client.step(line.master.jobs(), line.now), None);
        }
        // Idle (48) to SAP 48 (30) from SAP 50 (32).
        idles += line.tap.log[log..]
            .iter()
            .filter(|telegram| telegram.contains("30 32 48"))
            .count();
        client.read(line.master.jobs(), 0, 1, 2).unwrap();
        let got = event(&mut line, &mut client, application);
        assert_eq!(got, Msac2Event::Answer(Ok(record(0, 1, &[1; 2]))));
    }
    // Once a second and never needlessly more often.
    assert!((120..=150).contains(&idles), "{idles} Idle in 147 s");
    assert_eq!(line.slave_events(0).len(), 1, "opened and never closed");
}

#[test]
fn idle_is_due_a_send_timeout_after_the_last_answer_and_not_sent_sooner() {
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    let due = line.now + client.connected().unwrap().send_timeout.time();
    assert_eq!(client.poll_timeout(), Some(due));
    line.step();
    assert_eq!(client.step(line.master.jobs(), line.now), None);
    assert_eq!(client.poll_timeout(), Some(due), "nothing is under way");
    // 240 octets are the most.
    let most = client.write(line.master.jobs(), 0, 1, &[0; 240]);
    assert_eq!(most, Ok(()));
}

#[test]
fn without_a_place_for_its_job_idle_is_tried_again_soon() {
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    let due = client.poll_timeout().unwrap();
    while line.master.jobs().submit(&JobRequest::fdl_status(SLAVE)).is_ok() {}
    assert_eq!(client.step(line.master.jobs(), due), None);
    // 10 ms are a hundredth of the least Send_Timeout.
    assert_eq!(client.poll_timeout(), Some(due + Duration::from_millis(10)));
}

#[test]
fn a_request_behind_idle_is_queued() {
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    let due = client.poll_timeout().unwrap();
    while line.now < due {
        line.step();
    }
    assert_eq!(client.step(line.master.jobs(), line.now), None);
    assert!(client.is_ready());
    client.read(line.master.jobs(), 0, 1, 2).unwrap();
    assert!(!client.is_ready());
    assert_eq!(client.read(line.master.jobs(), 0, 1, 2), Err(V1ClientError::Busy));
    let got = event(&mut line, &mut client, &mut Application::with_delay(0));
    assert_eq!(got, Msac2Event::Answer(Ok(record(0, 1, &[1; 2]))));
}

#[test]
fn two_connections_of_one_master_and_no_third() {
    let mut line = tool_line(1);
    let mut clients = [opened(&mut line), opened(&mut line)];
    assert_eq!(
        clients.each_ref().map(|client| client.connected().unwrap().sap),
        [48, 47]
    );
    let mut third = Msac2Client::new(SLAVE);
    third.connect(line.master.jobs(), &INITIATE).unwrap();
    let application = &mut Application::with_delay(0);
    // RS of FDL is 3.
    assert_eq!(
        event(&mut line, &mut third, application),
        Msac2Event::Closed(Abort::fdl(3))
    );
    for (client, index) in clients.iter_mut().zip([5, 6]) {
        client.read(line.master.jobs(), 0, index, 1).unwrap();
    }
    for (client, index) in clients.iter_mut().zip([5, 6]) {
        let got = event(&mut line, client, application);
        assert_eq!(got, Msac2Event::Answer(Ok(record(0, index, &[index]))));
    }
    let mut client = Msac2Client::new(SLAVE);
    clients[0].abort(line.master.jobs(), Abort::user(0));
    event(&mut line, &mut clients[0], application);
    client.connect(line.master.jobs(), &INITIATE).unwrap();
    assert!(matches!(
        event(&mut line, &mut client, application),
        Msac2Event::Opened(_)
    ));
}

#[test]
fn both_ways_at_once_beside_the_exchange() {
    let mut line = exchanging(V1Status::ENABLED, Duration::from_millis(1));
    let mut c2 = opened(&mut line);
    let mut c1 = Msac1Client::new(SLAVE);
    let application = &mut Application::with_delay(20);
    c1.read(line.master.jobs(), 0, 1, 3).unwrap();
    c2.read(line.master.jobs(), 0, 2, 3).unwrap();
    let (mut first, mut second) = (None, None);
    while first.is_none() || second.is_none() {
        line.step();
        application.serve(&mut line);
        first = first.or(c1.poll(line.master.jobs()));
        second = second.or(c2.step(line.master.jobs(), line.now));
    }
    assert_eq!(first, Some(Ok(record(0, 1, &[1; 3]))));
    assert_eq!(second, Some(Msac2Event::Answer(Ok(record(0, 2, &[2; 3])))));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn an_abort_of_the_slave_is_told_with_its_reason() {
    // While a request is under way.
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    client.read(line.master.jobs(), 0, 1, 2).unwrap();
    line.run_for(Duration::from_millis(20));
    let now = line.now;
    line.slaves[0].abort_connection(now, 48, Abort::user(9));
    let got = event(&mut line, &mut client, &mut Application::with_delay(100_000));
    assert_eq!(got, Msac2Event::Closed(Abort::user(9)));

    // In between it is found with the next Idle.
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    let now = line.now;
    line.slaves[0].abort_connection(now, 48, Abort::user(9));
    let got = event(&mut line, &mut client, &mut Application::with_delay(0));
    assert!(matches!(got, Msac2Event::Closed(_)), "{got:?}");
}

#[test]
fn a_slave_whose_application_never_answers_ends_the_connection() {
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    client.read(line.master.jobs(), 0, 1, 2).unwrap();
    let begun = line.now;
    let got = event(&mut line, &mut client, &mut Application::with_delay(100_000));
    // U at the slave expires before R at the master: ABT_TO comes from there.
    assert_eq!(got, Msac2Event::Closed(Abort::msac2(reason::TIMEOUT)));
    let elapsed = line.now - begun;
    assert!(
        elapsed >= Duration::from_millis(1_000) && elapsed < Duration::from_millis(1_100),
        "{elapsed:?}"
    );
}

#[test]
fn a_slave_that_was_switched_off_or_restarted_is_noticed() {
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    line.replace_slave(0, identity());
    let got = event(&mut line, &mut client, &mut Application::with_delay(0));
    // It knows no such connection: RS.
    assert_eq!(got, Msac2Event::Closed(Abort::fdl(3)));

    let mut client = opened(&mut line);
    let port = line.slave_ports[0];
    line.bus.disconnect(port);
    let got = event(&mut line, &mut client, &mut Application::with_delay(0));
    assert_eq!(got, Msac2Event::Closed(Abort::fdl(reason::FDL_NO_ANSWER)));
    client.connect(line.master.jobs(), &INITIATE).unwrap();
    let got = event(&mut line, &mut client, &mut Application::with_delay(0));
    assert_eq!(got, Msac2Event::Closed(Abort::fdl(reason::FDL_NO_ANSWER)));
}

#[test]
fn ending_a_connection_is_possible_at_any_moment() {
    let application = &mut Application::with_delay(100);
    // While Initiate is under way.
    for steps in 0..12 {
        let mut line = tool_line(1);
        line.run_for(Duration::from_millis(20));
        let mut client = Msac2Client::new(SLAVE);
        client.connect(line.master.jobs(), &INITIATE).unwrap();
        for _ in 0..steps {
            line.step();
            client.step(line.master.jobs(), line.now);
        }
        client.abort(line.master.jobs(), Abort::user(1));
        client.abort(line.master.jobs(), Abort::user(2));
        assert_eq!(
            event(&mut line, &mut client, application),
            Msac2Event::Closed(Abort::user(1))
        );
        // A job that was under way gives its place back when it ends.
        line.run_for(Duration::from_millis(10));
        assert_eq!(line.master.jobs().room(), MAX_JOBS, "after {steps} steps");
    }
    // While a request is under way.
    let mut line = tool_line(1);
    let mut client = opened(&mut line);
    client.read(line.master.jobs(), 0, 1, 2).unwrap();
    line.run_for(Duration::from_millis(10));
    client.abort(line.master.jobs(), Abort::user(1));
    assert_eq!(
        event(&mut line, &mut client, application),
        Msac2Event::Closed(Abort::user(1))
    );
    let events = line.slave_events(0);
    let told = SlaveEvent::ConnectionClosed {
        sap: 48,
        abort: Abort::user(1),
    };
    assert_eq!(events.last(), Some(&told));
    // Closed twice is closed.
    client.abort(line.master.jobs(), Abort::user(1));
    line.step();
    assert_eq!(client.step(line.master.jobs(), line.now), None);
}

/// What is tried, the answers of the station, what the client makes of them, and how many requests the station heard.
type Row<'a> = (&'a str, &'a [Option<&'a [u8]>], Msac2Event, usize);

/// A station that answers what the test says: a PDU for each new request, `None` for `E5`, empty for RS.
struct FakeDevice {
    script: VecDeque<Option<Vec<u8>>>,
    /// What it gave last.
    given: Vec<u8>,
    heard: Heard,
}

impl ResponderUser for FakeDevice {
    fn handle_request(&mut self, _now: Instant, header: &Header, data: &[u8]) -> Response<'_> {
        if !data.is_empty() {
            self.heard
                .borrow_mut()
                .push((header.dsap.unwrap_or(255), data.to_vec()));
        }
        match self.script.pop_front() {
            None | Some(None) => Response::ShortAck,
            Some(Some(pdu)) if pdu.is_empty() => Response::Refuse(ResponseFunction::NoService),
            Some(Some(pdu)) => {
                self.given = pdu;
                Response::Low(&self.given)
            }
        }
    }
    fn handle_repetition(&mut self, _now: Instant, _header: &Header) {}
    fn handle_unacknowledged(&mut self, _now: Instant, _header: &Header, _data: &[u8]) {}
    fn t_sdr(&self) -> BitTimes {
        BitTimes(11)
    }
}

type Heard = Rc<RefCell<Vec<(u8, Vec<u8>)>>>;

fn fake(script: &[Option<&[u8]>]) -> (Line, Heard) {
    let mut line = tool_line(0);
    let heard = Heard::default();
    let device = FakeDevice {
        script: script.iter().map(|pdu| pdu.map(<[u8]>::to_vec)).collect(),
        given: Vec::new(),
        heard: Rc::clone(&heard),
    };
    line.add_station(Box::new(PassiveStation::new(SLAVE, BAUD, device)));
    (line, heard)
}

/// Where it will be, and a least Send_Timeout of 0.5 s.
const RESOURCE: &[u8] = &[0x56, 20, 0x00, 0x32];
const INITIATED: &[u8] = &[0x57, 100, 0x01, 0x00, 0, 0, 0, 0, 0, 2, 0, 2, 0, 0, 0, 0];
const NO_SERVICE: &[u8] = &[];

#[test]
fn a_slave_that_answers_initiate_wrongly_gets_no_connection() {
    let invalid = Abort::msac2(reason::INVALID_RESPONSE);
    let table: [Row; 9] = [
        ("RS at 49", &[Some(NO_SERVICE)], Msac2Event::Closed(Abort::fdl(3)), 1),
        ("no resource PDU", &[Some(INITIATED)], Msac2Event::Closed(invalid), 1),
        (
            "access point 49",
            &[Some(&[0x56, 49, 0, 1])],
            Msac2Event::Closed(invalid),
            1,
        ),
        ("rubbish", &[Some(&[0xEE, 1])], Msac2Event::Closed(invalid), 1),
        (
            "refused",
            &[Some(&[0xD7, 0x80, 0xC3, 0])],
            Msac2Event::Rejected(V1Error::new(ErrorCode1::RESOURCE_UNAVAILABLE)),
            1,
        ),
        (
            "refused later",
            &[Some(RESOURCE), None, Some(&[0xD7, 0x80, 0xB6, 0])],
            Msac2Event::Rejected(V1Error::new(ErrorCode1::ACCESS_DENIED)),
            1,
        ),
        (
            "Abort",
            &[Some(RESOURCE), Some(&[0x58, 0, 0x17])],
            Msac2Event::Closed(Abort::msac2(reason::INVALID_ADDRESS)),
            1,
        ),
        // The slave hears the Abort.
        (
            "Idle instead",
            &[Some(RESOURCE), Some(&[0x48])],
            Msac2Event::Closed(invalid),
            2,
        ),
        (
            "RS at the connection",
            &[Some(RESOURCE), Some(NO_SERVICE)],
            Msac2Event::Closed(Abort::fdl(3)),
            1,
        ),
    ];
    for (name, script, expected, heard_count) in table {
        let (mut line, heard) = fake(script);
        let mut client = Msac2Client::new(SLAVE);
        client.connect(line.master.jobs(), &INITIATE).unwrap();
        assert_eq!(
            event(&mut line, &mut client, &mut Application::with_delay(0)),
            expected,
            "{name}"
        );
        assert_eq!(heard.borrow().len(), heard_count, "{name}");
        assert_eq!(line.master.jobs().room(), MAX_JOBS, "{name}");
        // And it may be tried again.
        assert_eq!(client.connect(line.master.jobs(), &INITIATE), Ok(()), "{name}");
    }
}

#[test]
fn a_slave_that_answers_a_request_wrongly_loses_the_connection_and_is_told() {
    let table: [&[u8]; 8] = [
        // The refusal of another function.
        &[0xDF, 0x80, 0xB0, 0],
        // Another index, another slot, another function.
        &[0x5E, 0, 2, 1, 9],
        &[0x5E, 1, 1, 1, 9],
        &[0x5F, 0, 1, 1],
        &[0x48],
        // A length that does not fit, a function without a name, Initiate again.
        &[0x5E, 0, 1, 2, 9],
        &[0x5D, 0, 1, 1, 9],
        INITIATED,
    ];
    for pdu in table {
        let (mut line, heard) = fake(&[Some(RESOURCE), Some(INITIATED), None, Some(pdu)]);
        let mut client = opened(&mut line);
        client.read(line.master.jobs(), 0, 1, 8).unwrap();
        let got = event(&mut line, &mut client, &mut Application::with_delay(0));
        assert_eq!(
            got,
            Msac2Event::Closed(Abort::msac2(reason::INVALID_RESPONSE)),
            "{pdu:02X?}"
        );
        // ABT_RE of MSAC2 at the connection's access point.
        assert_eq!(heard.borrow().last(), Some(&(20, vec![0x58, 0x00, 0x14])));
    }
}

#[test]
fn a_slave_that_never_answers_is_given_twice_send_timeout() {
    let (mut line, heard) = fake(&[Some(RESOURCE), Some(INITIATED)]);
    let mut client = opened(&mut line);
    // The master wanted 1 s, the slave can do with 0.5 s: the longer is in force.
    assert_eq!(client.connected().unwrap().send_timeout, SendTimeout(100));
    assert_eq!(client.connected().unwrap().max_data, 100);
    let too_much = client.write(line.master.jobs(), 0, 1, &[0; 101]);
    assert!(matches!(too_much, Err(V1ClientError::Data(error)) if error.max == 100));
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    let begun = line.now;
    let got = event(&mut line, &mut client, &mut Application::with_delay(0));
    assert_eq!(got, Msac2Event::Closed(Abort::msac2(reason::TIMEOUT)));
    let elapsed = line.now - begun;
    assert!(
        elapsed >= Duration::from_millis(2_000) && elapsed < Duration::from_millis(2_010),
        "{elapsed:?}"
    );
    assert_eq!(heard.borrow().last(), Some(&(20, vec![0x58, 0x00, 0x13])));
}

#[test]
fn a_slave_that_needs_more_time_gets_it() {
    let slow_resource: &[u8] = &[0x56, 20, 0x01, 0x90];
    let (mut line, _) = fake(&[Some(slow_resource), Some(INITIATED)]);
    let client = opened(&mut line);
    assert_eq!(client.connected().unwrap().send_timeout, SendTimeout(400));
}

#[test]
fn a_refusal_of_msac1_that_is_no_pdu_is_told_as_it_is() {
    let (mut line, _) = fake(&[None, Some(&[0xDE, 0x80])]);
    let mut client = Msac1Client::new(SLAVE);
    client.read(line.master.jobs(), 0, 1, 8).unwrap();
    let end = line.now + Duration::from_millis(500);
    let result = loop {
        assert!(line.now < end);
        line.step();
        if let Some(result) = client.poll(line.master.jobs()) {
            break result;
        }
    };
    assert!(matches!(result, Err(V1Failure::Unreadable(_))), "{result:?}");
}
