//! Data records for the master that parametrised the slave (MSAC1), at the slave.
//!
//! The numbers of transitions are rows of the table in `dp/v1/msac1.rs`.

use dp_master::dp::v1::{ErrorCode1, V1Capabilities, V1Channel, V1Error, V1RequestGone, V1Service, V1Status};
use dp_master::dp::{SlaveEvent, SlavePhase, StationStatus, Support, sap};
use dp_master::station::Station;
use dp_master::time::Duration;

use crate::v1_bench::{Bench, OWNER, RR, RS, Reply, TOOL, capabilities, data};

/// DPV1_Enable and nothing else.
const ENABLED: [u8; 3] = [0x80, 0x00, 0x00];
/// Read slot 1, index 2, at most 8 octets.
const READ: [u8; 4] = [0x5E, 1, 2, 8];

fn bench() -> Bench {
    Bench::exchanging(capabilities(), &ENABLED)
}

#[test]
fn a_read_is_acknowledged_polled_and_answered() {
    let mut bench = bench();
    assert_eq!(bench.c1(&READ), Reply::Ack);
    let request = bench.request();
    assert_eq!(request.id.channel(), V1Channel::Msac1);
    assert_eq!(request.master.value(), OWNER);
    let service = V1Service::Read {
        slot: 1,
        index: 2,
        length: 8,
    };
    assert_eq!(request.service, service);
    // Told once.
    assert_eq!(bench.slave.poll_v1_request(), None);
    // Still working; the cyclic exchange goes on.
    assert_eq!(bench.c1(&[]), Reply::Ack);
    assert_eq!(bench.exchange(&[7]), Reply::Ack);
    bench
        .slave
        .respond_v1(bench.now, request.id, Ok(&[0xCA, 0xFE]))
        .unwrap();
    assert_eq!(bench.c1(&[]), data(&[0x5E, 1, 2, 2, 0xCA, 0xFE]));
    // It is fetched once.
    assert_eq!(bench.c1(&[]), Reply::Ack);
}

#[test]
fn a_record_longer_than_asked_for_is_cut() {
    let mut bench = bench();
    bench.c1(&[0x5E, 1, 2, 3]);
    let id = bench.request().id;
    bench.slave.respond_v1(bench.now, id, Ok(&[1, 2, 3, 4, 5])).unwrap();
    assert_eq!(bench.c1(&[]), data(&[0x5E, 1, 2, 3, 1, 2, 3]));
}

#[test]
fn a_write_brings_its_data_and_is_answered_with_its_length() {
    let mut bench = bench();
    assert_eq!(bench.c1(&[0x5F, 4, 5, 3, 9, 8, 7]), Reply::Ack);
    let request = bench.request();
    match request.service {
        V1Service::Write {
            slot: 4,
            index: 5,
            data,
        } => assert_eq!(data.as_slice(), [9, 8, 7]),
        other => panic!("{other:?}"),
    }
    bench.slave.respond_v1(bench.now, request.id, Ok(&[])).unwrap();
    assert_eq!(bench.c1(&[]), data(&[0x5F, 4, 5, 3]));
}

#[test]
fn a_refusal_carries_the_error_of_the_application() {
    let mut bench = bench();
    bench.c1(&READ);
    let id = bench.request().id;
    let error = V1Error::new(ErrorCode1::INVALID_INDEX).with_detail(0x42);
    bench.slave.respond_v1(bench.now, id, Err(error)).unwrap();
    assert_eq!(bench.c1(&[]), data(&[0xDE, 0x80, 0xB0, 0x42]));
}

#[test]
fn a_lost_answer_is_repeated_and_nothing_is_asked_twice() {
    let mut bench = bench();
    assert_eq!(bench.c1(&READ), Reply::Ack);
    assert_eq!(bench.send_again(), Reply::Ack);
    let id = bench.request().id;
    assert_eq!(bench.slave.poll_v1_request(), None);
    bench.slave.respond_v1(bench.now, id, Ok(&[1])).unwrap();
    let answer = data(&[0x5E, 1, 2, 1, 1]);
    assert_eq!(bench.c1(&[]), answer);
    assert_eq!(bench.send_again(), answer);
    assert_eq!(bench.send_again(), answer);
}

#[test]
fn a_second_request_finds_no_resource_while_the_first_is_worked_on() {
    let mut bench = bench();
    bench.c1(&READ);
    let id = bench.request().id;
    assert_eq!(bench.c1(&[0x5E, 9, 9, 8]), RR);
    bench.slave.respond_v1(bench.now, id, Ok(&[1])).unwrap();
    assert_eq!(bench.c1(&[]), data(&[0x5E, 1, 2, 1, 1]));
}

#[test]
fn a_new_request_replaces_an_answer_that_nobody_fetched() {
    let mut bench = bench();
    bench.c1(&READ);
    let id = bench.request().id;
    bench.slave.respond_v1(bench.now, id, Ok(&[1])).unwrap();
    assert_eq!(bench.c1(&[0x5E, 3, 3, 8]), Reply::Ack);
    assert_eq!(bench.request().service.place(), (3, 3));
    // The old name answers nothing any more.
    assert_eq!(bench.slave.respond_v1(bench.now, id, Ok(&[2])), Err(V1RequestGone));
}

#[test]
fn an_application_that_does_not_answer_in_time_is_busy() {
    let slow = V1Capabilities {
        c1_response_timeout: Duration::from_millis(200),
        ..capabilities()
    };
    let mut bench = Bench::exchanging(slow, &ENABLED);
    bench.c1(&READ);
    let id = bench.request().id;
    bench.wait(199);
    assert_eq!(bench.c1(&[]), Reply::Ack);
    bench.wait(2);
    assert_eq!(bench.slave.respond_v1(bench.now, id, Ok(&[1])), Err(V1RequestGone));
    assert_eq!(bench.c1(&[]), data(&[0xDE, 0x80, 0xC2, 0x00]));
    // And the next request is taken.
    assert_eq!(bench.c1(&READ), Reply::Ack);
    assert!(bench.slave.poll_v1_request().is_some());
}

#[test]
fn a_slave_that_is_called_late_gives_a_request_up_all_the_same() {
    let mut bench = bench();
    bench.c1(&READ);
    let id = bench.request().id;
    // The default of C1_Response_Timeout is 1 s.
    let late = bench.now + Duration::from_millis(1_300);
    bench.slave.handle_timeout(late);
    assert_eq!(bench.slave.respond_v1(late, id, Ok(&[1])), Err(V1RequestGone));
}

#[test]
fn only_the_parametrising_master_gets_in() {
    let mut bench = bench();
    assert_eq!(bench.ask(TOOL, sap::MSAC1, sap::MSAC1, &READ), RS);
    assert_eq!(bench.ask(TOOL, sap::MSAC1, sap::MSAC1, &[]), RS);
    assert_eq!(bench.slave.poll_v1_request(), None);
    // A foreign poll does not take the owner's answer either.
    bench.c1(&READ);
    let id = bench.request().id;
    bench.slave.respond_v1(bench.now, id, Ok(&[1])).unwrap();
    assert_eq!(bench.ask(TOOL, sap::MSAC1, sap::MSAC1, &[]), RS);
    assert_eq!(bench.c1(&[]), data(&[0x5E, 1, 2, 1, 1]));
}

#[test]
fn without_dpv1_enable_there_is_no_such_access_point() {
    for user in [
        &[][..],
        &[0x80, 0x00][..],
        &[0x00, 0x00, 0x00][..],
        &[0x40, 0xFC, 0x07][..],
    ] {
        let mut bench = Bench::exchanging(capabilities(), user);
        assert_eq!(bench.c1(&READ), RS, "{user:02X?}");
        assert_eq!(bench.ask(OWNER, sap::MSAC1_ALARM, sap::MSAC1, &[]), RS, "{user:02X?}");
    }
}

#[test]
fn a_dp_v0_slave_has_none_of_the_access_points_and_its_own_user_parameters() {
    let mut bench = Bench::exchanging(V1Capabilities::NONE, &ENABLED);
    assert_eq!(bench.slave.v1_status(), V1Status::default());
    for dsap in 0..=52 {
        assert_eq!(bench.ask(OWNER, dsap, 51, &READ), RS, "DSAP {dsap}");
    }
    // WD_Base_1ms of a slave that has no DPV1_Status means nothing.
    let mut bench = Bench::new(V1Capabilities::NONE);
    assert_eq!(bench.set_prm(0x88, [10, 1], &[0x84, 0, 0]), Reply::Ack);
    assert_eq!(bench.slave.watchdog().unwrap().time(), Duration::from_millis(100));
}

#[test]
fn data_exchange_is_needed() {
    let mut bench = Bench::new(capabilities());
    assert_eq!(bench.c1(&READ), RS);
    bench.set_prm(0x80, [0, 0], &ENABLED);
    assert_eq!(bench.slave.phase(), SlavePhase::WaitCfg);
    assert_eq!(bench.c1(&READ), RS);
    bench.start_up(&ENABLED);
    assert_eq!(bench.c1(&READ), Reply::Ack);
}

#[test]
fn the_request_ends_with_data_exchange() {
    let mut bench = bench();
    bench.c1(&READ);
    let id = bench.request().id;
    // Unlock.
    bench.set_prm(0x40, [0, 0], &[]);
    assert_eq!(bench.slave.respond_v1(bench.now, id, Ok(&[1])), Err(V1RequestGone));
    bench.start_up(&ENABLED);
    assert_eq!(bench.c1(&[]), Reply::Ack);
    assert_eq!(bench.slave.poll_timeout(), None);
}

#[test]
fn what_is_no_request_of_msac1_is_refused_by_cause() {
    let mut bench = bench();
    let table: [(&[u8], [u8; 4]); 10] = [
        // Slot 255 is reserved.
        (&[0x5E, 255, 1, 8], [0xDE, 0x80, 0xB2, 0]),
        (&[0x5F, 255, 1, 1, 0], [0xDF, 0x80, 0xB2, 0]),
        // Length octet and data differ.
        (&[0x5F, 1, 1, 2, 0], [0xDF, 0x80, 0xB1, 0]),
        (&[0x5E, 1], [0xDE, 0x80, 0xB8, 0]),
        (&[0x5C], [0xDC, 0x80, 0xB8, 0]),
        // Services of MSAC2, and one without a name.
        (&[0x51, 1, 1, 1, 0], [0xD1, 0x80, 0xA9, 0]),
        (&[0x48], [0xC8, 0x80, 0xA9, 0]),
        (&[0x5D, 1, 2, 3], [0xDD, 0x80, 0xA9, 0]),
        // A function with the bit of a negative response already.
        (&[0xDE, 1, 1, 1], [0xDE, 0x80, 0xA9, 0]),
        (&[0x00], [0x80, 0x80, 0xA9, 0]),
    ];
    for (request, refusal) in table {
        assert_eq!(bench.c1(request), Reply::Ack, "{request:02X?}");
        assert_eq!(bench.slave.poll_v1_request(), None);
        assert_eq!(bench.c1(&[]), data(&refusal), "{request:02X?}");
    }
}

#[test]
fn a_slave_without_data_records_may_still_have_alarms() {
    let alarms_only = V1Capabilities {
        c1_read_write: Support::Unsupported,
        ..capabilities()
    };
    let mut bench = Bench::exchanging(alarms_only, &ENABLED);
    assert_eq!(bench.c1(&READ), RS);
    assert_eq!(bench.ask(OWNER, sap::MSAC1_ALARM, sap::MSAC1, &[]), Reply::Ack);
}

#[test]
fn the_watchdog_counts_milliseconds_when_the_master_says_so() {
    // WD_Base_1ms is bit 2 of DPV1_Status_1; 20 × 1 × 1 ms.
    let mut bench = Bench::new(capabilities());
    bench.set_prm(0x88, [20, 1], &[0x84, 0, 0]);
    assert_eq!(bench.slave.watchdog().unwrap().time(), Duration::from_millis(20));
    assert_eq!(bench.slave.v1_status().octets(), [0x84, 0, 0]);
    bench.ask(OWNER, sap::CHK_CFG, sap::MASTER, &[0x20]);
    bench.wait(19);
    assert_eq!(bench.slave.phase(), SlavePhase::DataExchange);
    bench.wait(2);
    assert!(bench.events().contains(&SlaveEvent::WatchdogExpired));
}

#[test]
fn a_slave_that_cannot_count_milliseconds_refuses_the_parameters() {
    let coarse = V1Capabilities {
        watchdog_1ms: Support::Unsupported,
        ..capabilities()
    };
    let mut bench = Bench::new(coarse);
    bench.set_prm(0x88, [20, 1], &[0x84, 0, 0]);
    assert_eq!(bench.slave.phase(), SlavePhase::WaitPrm);
    let status = bench.slave.diagnosis().status;
    assert!(status.contains(StationStatus::PRM_FAULT.with(StationStatus::NOT_SUPPORTED)));
}
