//! Connections of masters of class 2 (MSAC2), at the slave.
//!
//! Test names carry the row of the table in `dp/v1/msac2.rs`. Times follow from Send_Timeout = 1 s at 1.5 Mbit/s: U and F 1 s, I 2 s.

use dp_master::address::Address;
use dp_master::dp::v1::{
    Abort, ErrorCode1, Instance, SendTimeout, V1Capabilities, V1Channel, V1Error, V1RequestGone, V1Service, reason,
};
use dp_master::dp::{LeaveReason, SlaveEvent, SlavePhase, sap};
use dp_master::station::Station;
use dp_master::time::Baud;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::v1_bench::{Bench, FIRST, INITIATE, OWNER, RS, Reply, SECOND_TOOL, TOOL, capabilities, data};

const MANAGER: u8 = sap::MSAC2_MANAGER;
const SSAP: u8 = sap::MSAC2_MASTER;
/// Read slot 1, index 2, at most 8 octets.
const READ: [u8; 4] = [0x5E, 1, 2, 8];
const IDLE: [u8; 1] = [0x48];
/// Abort by the application of the master, reason 5.
const ABORT: [u8; 3] = [0x58, 2, 0x25];
/// Where it will be (48), least Send_Timeout 1 s.
const RESOURCE: [u8; 4] = [0x56, 48, 0x00, 0x64];
/// 240 octets, Read and Write, profile 0x3B00, direct.
const INITIATED: [u8; 16] = [0x57, 240, 0x01, 0x00, 0, 0, 0x3B, 0x00, 0, 2, 0, 2, 0, 0, 0, 0];

fn bench() -> Bench {
    Bench::new(capabilities())
}

fn opened(sap: u8, master: u8) -> SlaveEvent {
    SlaveEvent::ConnectionOpened {
        sap,
        master: Address::new(master).unwrap(),
    }
}

fn closed(sap: u8, abort: Abort) -> SlaveEvent {
    SlaveEvent::ConnectionClosed { sap, abort }
}

/// The Abort of MSAC2 as octets.
fn abort_pdu(reason: u8) -> Reply {
    data(&[0x58, 0x00, 0x10 | reason])
}

/// A connection whose application works on a Read.
fn working() -> (Bench, dp_master::dp::v1::V1RequestId) {
    let mut bench = bench();
    bench.open();
    assert_eq!(bench.c2(FIRST, &READ), Reply::Ack);
    let id = bench.request().id;
    (bench, id)
}

/// A connection whose response waits to be fetched.
fn ready() -> Bench {
    let (mut bench, id) = working();
    bench.slave.respond_v1(bench.now, id, Ok(&[0xCA])).unwrap();
    bench
}

/// A connection whose Abort waits to be fetched.
fn aborting() -> Bench {
    let mut bench = bench();
    bench.open();
    assert_eq!(bench.c2(FIRST, &[0xFF]), Reply::Ack);
    bench.events();
    bench
}

#[test]
fn t1_the_manager_names_the_access_point_at_once_and_the_response_waits_there() {
    let mut bench = bench();
    assert_eq!(bench.slave.phase(), SlavePhase::WaitPrm);
    assert_eq!(bench.ask(TOOL, MANAGER, SSAP, &INITIATE), data(&RESOURCE));
    assert_eq!(bench.events(), [opened(FIRST, TOOL)]);
    assert_eq!(bench.c2(FIRST, &[]), data(&INITIATED));
    assert_eq!(bench.c2(FIRST, &[]), Reply::Ack);
}

#[test]
fn t1_the_addresses_of_initiate_come_back_and_padding_does_not() {
    let mut bench = bench();
    let mut initiate = vec![0x57, 0, 0, 0, 0, 100, 1, 0, 0, 0, 0, 0];
    // S-Addr: API 1, SCL 2, network 000000000007, MAC AB; D-Addr: API 5, SCL 0.
    let addresses = [1, 9, 0, 2, 1, 2, 0, 0, 0, 0, 0, 7, 0xAB, 5, 0];
    initiate.extend(addresses);
    initiate.extend([0xEE; 5]);
    bench.ask(TOOL, MANAGER, SSAP, &initiate);
    let mut expected = INITIATED[..8].to_vec();
    expected.extend(addresses);
    assert_eq!(bench.c2(FIRST, &[]), data(&expected));
}

#[test]
fn t1_the_longer_send_timeout_wins() {
    for (wanted, effective_ms) in [(1, 1000), (100, 1000), (250, 2500)] {
        let mut bench = bench();
        let mut initiate = INITIATE;
        initiate[4..6].copy_from_slice(&u16::to_be_bytes(wanted));
        bench.ask(TOOL, MANAGER, SSAP, &initiate);
        // F: Send_Timeout.
        bench.events();
        bench.wait(effective_ms - 1);
        assert_eq!(bench.events(), [], "wanted {wanted}");
        bench.wait(2);
        assert_eq!(
            bench.events(),
            [closed(FIRST, Abort::msac2(reason::TIMEOUT))],
            "wanted {wanted}"
        );
    }
}

#[test]
fn t1_the_least_send_timeout_follows_from_the_baud_rate_unless_the_slave_has_its_own() {
    // Defaults of DP-V1 slave firmware: 1 s, 2 s, 4 s.
    for (baud, units) in [
        (Baud::B12000000, 100),
        (Baud::B1500000, 100),
        (Baud::B500000, 200),
        (Baud::B187500, 400),
        (Baud::B9600, 400),
    ] {
        assert_eq!(SendTimeout::least(baud), SendTimeout(units), "{baud}");
    }
    let own = V1Capabilities {
        c2_send_timeout: Some(SendTimeout(0x0123)),
        ..capabilities()
    };
    let mut bench = Bench::new(own);
    assert_eq!(bench.ask(TOOL, MANAGER, SSAP, &INITIATE), data(&[0x56, 48, 0x01, 0x23]));
}

#[test]
fn t2_what_is_no_initiate_gets_a_connection_that_aborts() {
    let mut wrong_length = INITIATE;
    wrong_length[13] = 3;
    let table: [(&[u8], u8); 5] = [
        (&READ, reason::INVALID_REQUEST),
        (&[0xFF], reason::INVALID_REQUEST),
        (&INITIATE[..9], reason::INVALID_REQUEST),
        (&INITIATE[..19], reason::INVALID_ADDRESS),
        (&wrong_length, reason::INVALID_ADDRESS),
    ];
    for (pdu, reason) in table {
        let mut bench = bench();
        assert_eq!(bench.ask(TOOL, MANAGER, SSAP, pdu), data(&RESOURCE), "{pdu:02X?}");
        assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason), "{pdu:02X?}");
        assert_eq!(bench.c2(FIRST, &[]), RS);
        // The application never heard of it.
        assert_eq!(bench.events(), []);
    }
}

#[test]
fn t3_the_manager_has_as_many_connections_as_the_slave_declares() {
    let mut bench = bench();
    let first = bench.open_for(TOOL);
    let second = bench.open_for(SECOND_TOOL);
    assert_eq!((first, second), (48, 47));
    assert_eq!(bench.ask(OWNER, MANAGER, SSAP, &INITIATE), RS);
    // One that ends makes room for the next.
    assert_eq!(bench.ask(TOOL, first, SSAP, &ABORT), Reply::Ack);
    assert_eq!(bench.open_for(OWNER), 48);
    // Access points of connections the slave does not have.
    assert_eq!(bench.c2(46, &[]), RS);
    assert_eq!(bench.c2(0, &READ), RS);
}

#[test]
fn a_master_may_have_two_connections() {
    let mut bench = bench();
    let [first, second] = [bench.open(), bench.open()];
    assert_eq!([first, second], [48, 47]);
    assert_eq!(bench.c2(first, &READ), Reply::Ack);
    assert_eq!(bench.c2(second, &[0x5E, 3, 3, 8]), Reply::Ack);
    let requests = [bench.request(), bench.request()];
    assert_eq!(requests.map(|request| request.service.place()), [(1, 2), (3, 3)]);
    assert_eq!(requests[1].id.channel(), V1Channel::Msac2 { sap: 47 });
    // The second is answered first; neither gets the other's answer.
    bench.slave.respond_v1(bench.now, requests[1].id, Ok(&[2])).unwrap();
    assert_eq!(bench.c2(first, &[]), Reply::Ack);
    assert_eq!(bench.c2(second, &[]), data(&[0x5E, 3, 3, 1, 2]));
    bench.slave.respond_v1(bench.now, requests[0].id, Ok(&[1])).unwrap();
    assert_eq!(bench.c2(first, &[]), data(&[0x5E, 1, 2, 1, 1]));
}

#[test]
fn who_asks_the_manager_for_nothing_gets_no_connection() {
    let mut bench = bench();
    assert_eq!(bench.ask(TOOL, MANAGER, SSAP, &[]), Reply::Ack);
    assert_eq!(bench.c2(FIRST, &[]), RS);
    assert_eq!(bench.slave.poll_timeout(), None);
}

#[test]
fn t4_t15_a_read_is_acknowledged_polled_and_answered() {
    let (mut bench, id) = working();
    // 6: still working.
    assert_eq!(bench.c2(FIRST, &[]), Reply::Ack);
    bench.slave.respond_v1(bench.now, id, Ok(&[0xCA, 0xFE])).unwrap();
    assert_eq!(bench.c2(FIRST, &[]), data(&[0x5E, 1, 2, 2, 0xCA, 0xFE]));
    assert_eq!(bench.c2(FIRST, &[]), Reply::Ack);
}

#[test]
fn t7_write_and_data_transport_bring_their_data() {
    let mut bench = bench();
    bench.open();
    bench.c2(FIRST, &[0x5F, 4, 5, 2, 9, 8]);
    let request = bench.request();
    assert!(matches!(request.service, V1Service::Write { slot: 4, index: 5, data } if data.as_slice() == [9, 8]));
    bench.slave.respond_v1(bench.now, request.id, Ok(&[])).unwrap();
    assert_eq!(bench.c2(FIRST, &[]), data(&[0x5F, 4, 5, 2]));

    bench.c2(FIRST, &[0x51, 6, 7, 1, 3]);
    let request = bench.request();
    assert!(matches!(request.service, V1Service::DataTransport { slot: 6, index: 7, data } if data.as_slice() == [3]));
    bench.slave.respond_v1(bench.now, request.id, Ok(&[4, 5])).unwrap();
    assert_eq!(bench.c2(FIRST, &[]), data(&[0x51, 6, 7, 2, 4, 5]));
}

#[test]
fn t15_a_refusal_leaves_the_connection_open() {
    let (mut bench, id) = working();
    let error = V1Error::new(ErrorCode1::ACCESS_DENIED);
    bench.slave.respond_v1(bench.now, id, Err(error)).unwrap();
    assert_eq!(bench.c2(FIRST, &[]), data(&[0xDE, 0x80, 0xB6, 0x00]));
    assert_eq!(bench.c2(FIRST, &READ), Reply::Ack);
}

#[test]
fn t15_no_answer_is_longer_than_the_slave_announced() {
    let small = V1Capabilities {
        c2_max_data: 4,
        ..capabilities()
    };
    let mut bench = Bench::new(small);
    bench.open();
    bench.c2(FIRST, &READ);
    let id = bench.request().id;
    bench.slave.respond_v1(bench.now, id, Ok(&[7; 8])).unwrap();
    assert_eq!(bench.c2(FIRST, &[]), data(&[0x5E, 1, 2, 4, 7, 7, 7, 7]));
}

#[test]
fn t4_a_lost_response_is_repeated() {
    let mut bench = ready();
    let answer = data(&[0x5E, 1, 2, 1, 0xCA]);
    assert_eq!(bench.c2(FIRST, &[]), answer);
    assert_eq!(bench.send_again(), answer);
    // Also the immediate answer of the manager: no second connection is taken for it.
    bench.diagnosis(SECOND_TOOL);
    let second = data(&[0x56, 47, 0x00, 0x64]);
    assert_eq!(bench.ask(SECOND_TOOL, MANAGER, SSAP, &INITIATE), second);
    assert_eq!(bench.send_again(), second);
    assert_eq!(bench.events(), [opened(47, SECOND_TOOL)]);
}

#[test]
fn a_repeated_first_contact_takes_a_second_connection_and_the_first_ends_by_itself() {
    // Without a valid frame count bit FDL cannot tell a repetition.
    let mut bench = bench();
    assert_eq!(bench.ask(TOOL, MANAGER, SSAP, &INITIATE), data(&RESOURCE));
    assert_eq!(bench.send_again(), data(&[0x56, 47, 0x00, 0x64]));
    assert_eq!(bench.c2(47, &[]), data(&INITIATED));
    bench.wait(1001);
    let [_, _, last] = bench.events()[..] else {
        panic!("opened twice, closed once");
    };
    assert_eq!(last, closed(FIRST, Abort::msac2(reason::TIMEOUT)));
    assert_eq!(bench.c2(47, &IDLE), Reply::Ack);
}

#[test]
fn t8_idle_is_answered_by_idle_and_keeps_the_connection() {
    let mut bench = bench();
    bench.open();
    for _ in 0..10 {
        bench.wait(1900);
        assert_eq!(bench.c2(FIRST, &IDLE), Reply::Ack);
        assert_eq!(bench.c2(FIRST, &[]), data(&IDLE));
    }
    assert_eq!(bench.slave.poll_v1_request(), None);
    assert_eq!(bench.events(), []);
}

#[test]
fn t9_slot_255_is_refused_without_asking_the_application() {
    let mut bench = bench();
    bench.open();
    assert_eq!(bench.c2(FIRST, &[0x5E, 255, 1, 8]), Reply::Ack);
    assert_eq!(bench.slave.poll_v1_request(), None);
    assert_eq!(bench.c2(FIRST, &[]), data(&[0xDE, 0x80, 0xB2, 0]));
    assert_eq!(bench.c2(FIRST, &READ), Reply::Ack);
}

#[test]
fn t10_a_service_of_another_place_is_a_sequence_error() {
    let alarm_ack = [0x5C, 1, 1, 0];
    for pdu in [&INITIATE[..], &alarm_ack] {
        let mut bench = bench();
        bench.open();
        assert_eq!(bench.c2(FIRST, pdu), Reply::Ack);
        assert_eq!(bench.events(), [closed(FIRST, Abort::msac2(reason::SEQUENCE))]);
        assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason::SEQUENCE));
        assert_eq!(bench.c2(FIRST, &[]), RS);
    }
}

#[test]
fn t11_what_is_no_pdu_aborts() {
    for pdu in [
        &[0x5D, 1, 2, 3][..],
        &[0x5E, 1],
        &[0x5F, 1, 1, 2, 0],
        &[0xDE, 0x80, 0xB0, 0],
        &[0x58],
    ] {
        let mut bench = bench();
        bench.open();
        assert_eq!(bench.c2(FIRST, pdu), Reply::Ack);
        assert_eq!(bench.events(), [closed(FIRST, Abort::msac2(reason::INVALID_REQUEST))]);
        assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason::INVALID_REQUEST), "{pdu:02X?}");
        // 5: it is free now.
        assert_eq!(bench.c2(FIRST, &[]), RS);
        assert_eq!(bench.open(), FIRST);
    }
}

#[test]
fn t12_a_request_out_of_turn_is_a_sequence_error() {
    for mut bench in [working().0, ready()] {
        assert_eq!(bench.c2(FIRST, &READ), Reply::Ack);
        assert_eq!(bench.events(), [closed(FIRST, Abort::msac2(reason::SEQUENCE))]);
        assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason::SEQUENCE));
    }
    let (mut bench, id) = working();
    bench.c2(FIRST, &IDLE);
    assert_eq!(bench.slave.respond_v1(bench.now, id, Ok(&[])), Err(V1RequestGone));
}

#[test]
fn t13_a_connection_that_ends_takes_nothing_more() {
    let mut bench = aborting();
    assert_eq!(bench.c2(FIRST, &READ), Reply::Ack);
    assert_eq!(bench.slave.poll_v1_request(), None);
    assert_eq!(bench.events(), []);
    assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason::INVALID_REQUEST));
}

#[test]
fn t14_abort_of_the_master_frees_the_connection_in_every_state() {
    let reason = Abort {
        subnet: 2,
        instance: Instance::User,
        reason: 5,
    };
    let initiating = {
        let mut bench = bench();
        bench.ask(TOOL, MANAGER, SSAP, &INITIATE);
        bench.events();
        bench
    };
    let open = {
        let mut bench = bench();
        bench.open();
        bench
    };
    for (state, mut bench, told) in [
        ("initiating", initiating, true),
        ("open", open, true),
        ("working", working().0, true),
        ("ready", ready(), true),
        ("aborting", aborting(), false),
    ] {
        assert_eq!(bench.c2(FIRST, &ABORT), Reply::Ack, "{state}");
        let expected = if told { vec![closed(FIRST, reason)] } else { vec![] };
        assert_eq!(bench.events(), expected, "{state}");
        assert_eq!(bench.c2(FIRST, &[]), RS, "{state}");
        assert_eq!(bench.slave.poll_timeout(), None, "{state}");
        assert_eq!(bench.open(), FIRST, "{state}");
    }
}

#[test]
fn t16_the_application_may_end_a_connection_in_every_state() {
    let open = {
        let mut bench = bench();
        bench.open();
        bench
    };
    for mut bench in [open, working().0, ready()] {
        bench.slave.abort_connection(bench.now, FIRST, Abort::user(9));
        assert_eq!(bench.events(), [closed(FIRST, Abort::user(9))]);
        assert_eq!(bench.c2(FIRST, &[]), data(&[0x58, 0x00, 0x29]));
        assert_eq!(bench.c2(FIRST, &[]), RS);
    }
    // Nothing to end.
    let mut bench = aborting();
    bench.slave.abort_connection(bench.now, FIRST, Abort::user(9));
    bench.slave.abort_connection(bench.now, 47, Abort::user(9));
    bench.slave.abort_connection(bench.now, 200, Abort::user(9));
    assert_eq!(bench.events(), []);
    assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason::INVALID_REQUEST));
}

#[test]
fn t17_an_application_that_does_not_answer_in_time_ends_the_connection() {
    let (mut bench, id) = working();
    bench.wait(999);
    assert_eq!(bench.c2(FIRST, &[]), Reply::Ack);
    bench.wait(2);
    assert_eq!(bench.events(), [closed(FIRST, Abort::msac2(reason::TIMEOUT))]);
    assert_eq!(bench.slave.respond_v1(bench.now, id, Ok(&[])), Err(V1RequestGone));
    assert_eq!(bench.c2(FIRST, &[]), abort_pdu(reason::TIMEOUT));
    assert_eq!(bench.c2(FIRST, &[]), RS);
}

#[test]
fn t18_a_response_nobody_fetches_ends_the_connection() {
    let mut bench = ready();
    bench.wait(999);
    assert_eq!(bench.events(), []);
    bench.wait(2);
    assert_eq!(bench.events(), [closed(FIRST, Abort::msac2(reason::TIMEOUT))]);
    assert_eq!(bench.c2(FIRST, &[]), RS);
    // So does an Abort, silently.
    let mut bench = aborting();
    bench.wait(1001);
    assert_eq!(bench.events(), []);
    assert_eq!(bench.c2(FIRST, &[]), RS);
}

#[test]
fn t19_silence_of_the_master_ends_the_connection() {
    let mut bench = bench();
    bench.open();
    // Polls are no sign of life of the application behind them.
    bench.wait(1000);
    assert_eq!(bench.c2(FIRST, &[]), Reply::Ack);
    bench.wait(998);
    assert_eq!(bench.events(), []);
    bench.wait(3);
    assert_eq!(bench.events(), [closed(FIRST, Abort::msac2(reason::TIMEOUT))]);
    assert_eq!(bench.c2(FIRST, &IDLE), RS);
    assert_eq!(bench.open(), FIRST);
}

#[test]
fn t20_nobody_else_gets_at_a_connection() {
    let mut bench = ready();
    assert_eq!(bench.ask(SECOND_TOOL, FIRST, SSAP, &[]), RS);
    assert_eq!(bench.ask(SECOND_TOOL, FIRST, SSAP, &ABORT), RS);
    assert_eq!(bench.ask(TOOL, FIRST, 51, &[]), RS);
    assert_eq!(bench.events(), []);
    assert_eq!(bench.c2(FIRST, &[]), data(&[0x5E, 1, 2, 1, 0xCA]));
}

#[test]
fn a_connection_does_not_care_for_data_exchange() {
    let mut bench = Bench::exchanging(capabilities(), &[0x80, 0, 0]);
    bench.open();
    bench.c2(FIRST, &READ);
    let id = bench.request().id;
    bench.c1(&[0x5E, 7, 7, 1]);
    let of_the_owner = bench.request().id;
    bench.set_prm(0x40, [0, 0], &[]);
    let left = SlaveEvent::LeftDataExchange {
        reason: LeaveReason::Unlocked,
    };
    assert_eq!(bench.events(), [left]);
    assert_eq!(
        bench.slave.respond_v1(bench.now, of_the_owner, Ok(&[])),
        Err(V1RequestGone)
    );
    bench.slave.respond_v1(bench.now, id, Ok(&[1])).unwrap();
    assert_eq!(bench.c2(FIRST, &[]), data(&[0x5E, 1, 2, 1, 1]));
}

#[test]
fn a_request_of_the_connection_before_is_not_answered_in_the_next() {
    let (mut bench, id) = working();
    bench.c2(FIRST, &ABORT);
    assert_eq!(bench.open(), FIRST);
    bench.c2(FIRST, &READ);
    assert_eq!(bench.slave.respond_v1(bench.now, id, Ok(&[1])), Err(V1RequestGone));
    assert_eq!(bench.c2(FIRST, &[]), Reply::Ack);
}

/// One thing that can happen to a slave.
#[derive(Debug, Clone)]
enum Happening {
    Telegram {
        master: u8,
        dsap: u8,
        ssap: u8,
        pdu: Vec<u8>,
    },
    Repetition,
    Exchange,
    SetPrm {
        user: Vec<u8>,
    },
    Respond {
        fine: bool,
        octets: usize,
    },
    Abort {
        sap: u8,
    },
    Wait {
        ms: u64,
    },
}

fn pdu() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        Just(vec![]),
        Just(INITIATE.to_vec()),
        Just(READ.to_vec()),
        Just(IDLE.to_vec()),
        Just(ABORT.to_vec()),
        Just(vec![0x5F, 1, 2, 1, 0]),
        Just(vec![0x51, 1, 2, 1, 0]),
        Just(vec![0x5C, 1, 1, 0]),
        vec(any::<u8>(), 1..=244),
        (0x48..=0x5Fu8, vec(any::<u8>(), 0..30)).prop_map(|(function, mut rest)| {
            rest.insert(0, function);
            rest
        }),
    ]
}

fn happening() -> impl Strategy<Value = Happening> {
    let telegram = (
        prop_oneof![Just(TOOL), Just(OWNER), Just(SECOND_TOOL)],
        prop_oneof![46..=51u8, 0..=63u8],
        prop_oneof![50..=51u8, 0..=62u8],
        pdu(),
    );
    prop_oneof![
        8 => telegram.prop_map(|(master, dsap, ssap, pdu)| Happening::Telegram { master, dsap, ssap, pdu }),
        2 => Just(Happening::Repetition),
        2 => Just(Happening::Exchange),
        1 => vec(any::<u8>(), 0..6).prop_map(|user| Happening::SetPrm { user }),
        4 => (any::<bool>(), 0..300usize).prop_map(|(fine, octets)| Happening::Respond { fine, octets }),
        1 => (40..60u8).prop_map(|sap| Happening::Abort { sap }),
        2 => (0..2500u64).prop_map(|ms| Happening::Wait { ms }),
    ]
}

proptest! {
    /// Whatever comes: no panic, no answer that is no PDU, opened and closed connections in turn, and afterwards all of them are free again.
    #[test]
    fn no_sequence_of_telegrams_leaves_a_slave_astray(happenings in vec(happening(), 1..60)) {
        let mut bench = Bench::exchanging(capabilities(), &[0x80, 0xFC, 0x07]);
        let mut open = std::collections::BTreeSet::new();
        let mut waiting = Vec::new();
        for happening in happenings {
            let reply = match happening {
                Happening::Telegram { master, dsap, ssap, pdu } => {
                    let is_v1 = dsap <= sap::MSAC1;
                    let reply = bench.ask(master, dsap, ssap, &pdu);
                    is_v1.then_some(reply)
                }
                Happening::Repetition => { bench.send_again(); None }
                Happening::Exchange => { bench.exchange(&[1]); None }
                Happening::SetPrm { user } => { bench.set_prm(0x80, [0, 0], &user); None }
                Happening::Respond { fine, octets } => {
                    while let Some(request) = bench.slave.poll_v1_request() {
                        waiting.push(request.id);
                    }
                    if let Some(id) = waiting.pop() {
                        let octets = vec![0x55; octets];
                        let answer = if fine { Ok(&octets[..]) } else { Err(V1Error::new(ErrorCode1(octets.len() as u8))) };
                        let _ = bench.slave.respond_v1(bench.now, id, answer);
                    }
                    None
                }
                Happening::Abort { sap } => { bench.slave.abort_connection(bench.now, sap, Abort::user(1)); None }
                Happening::Wait { ms } => { bench.wait(ms); None }
            };
            match reply {
                Some(Reply::Data(pdu)) => {
                    let readable = dp_master::dp::v1::Reply::parse(&pdu).is_ok();
                    // A refusal at MSAC1 echoes a function code without a name.
                    let refusal = pdu.len() == 4 && pdu[0] & 0x80 != 0 && pdu[1..] == [0x80, 0xA9, 0x00];
                    prop_assert!(readable || refusal, "{:02X?}", pdu);
                }
                Some(Reply::High(_) | Reply::Nothing) => prop_assert!(false, "{:?}", reply),
                _ => {}
            }
            for event in bench.events() {
                match event {
                    SlaveEvent::ConnectionOpened { sap, .. } => prop_assert!(open.insert(sap)),
                    SlaveEvent::ConnectionClosed { sap, .. } => prop_assert!(open.remove(&sap)),
                    _ => {}
                }
            }
            prop_assert!(open.len() <= 2);
        }
        // Every wait is bounded: 65 535 × 20 ms is the longest that Initiate can ask for; three phases may follow each other.
        bench.wait(4 * 65_535 * 20);
        for event in bench.events() {
            if let SlaveEvent::ConnectionClosed { sap, .. } = event {
                prop_assert!(open.remove(&sap));
            }
        }
        prop_assert!(open.is_empty());
        prop_assert_eq!([bench.open(), bench.open()], [48, 47]);
    }
}
