//! Alarms of a DP-V1 slave: announced, read with the diagnosis, acknowledged.

use dp_master::dp::v1::{
    AddAck, AlarmAck, AlarmSpecifier, AlarmType, AlarmTypes, Incident, MAX_ALARMS, SendAlarmError, V1Block,
    V1Capabilities,
};
use dp_master::dp::{Block, Diagnosis, ExtDiag, Overflow, SlaveEvent, sap};

use crate::v1_bench::{Bench, OWNER, RS, Reply, TOOL, capabilities, data};

/// All alarms, one of each type.
const EACH_TYPE: [u8; 3] = [0x80, 0xFC, 0x00];
/// All alarms, two in all.
const TWO: [u8; 3] = [0x80, 0xFC, 0x01];
/// All alarms, 32 in all.
const MANY: [u8; 3] = [0x80, 0xFC, 0x07];

fn bench(user: [u8; 3]) -> Bench {
    Bench::exchanging(capabilities(), &user)
}

fn send(bench: &mut Bench, alarm_type: AlarmType, slot: u8) -> Result<AlarmAck, SendAlarmError> {
    bench
        .slave
        .send_alarm((alarm_type, slot), Incident::Appears, AddAck::NotNeeded, &[0xAB])
}

/// Acknowledgement as a PDU.
fn ack_pdu(ack: AlarmAck) -> [u8; 4] {
    [0x5C, ack.slot, ack.alarm_type.0, ack.specifier.octet()]
}

/// The extended diagnosis the owner reads.
fn extended(bench: &mut Bench) -> Vec<u8> {
    bench.diagnosis(OWNER)[6..].to_vec()
}

/// Acknowledges at its own access point and fetches the answer.
fn acknowledge(bench: &mut Bench, dsap: u8, pdu: &[u8]) -> Reply {
    assert_eq!(bench.ask(OWNER, dsap, sap::MSAC1, pdu), Reply::Ack);
    bench.ask(OWNER, dsap, sap::MSAC1, &[])
}

#[test]
fn an_alarm_is_announced_read_and_acknowledged() {
    for dsap in [sap::MSAC1_ALARM, sap::MSAC1] {
        let mut bench = bench(TWO);
        assert_eq!(bench.exchange(&[1]), Reply::Ack);
        let ack = bench
            .slave
            .send_alarm(
                (AlarmType::PROCESS, 3),
                Incident::Appears,
                AddAck::Needed,
                &[0xAB, 0xCD],
            )
            .unwrap();
        // No inputs are configured: new diagnosis is an empty response of high priority.
        assert_eq!(bench.exchange(&[1]), Reply::High(vec![]));
        // Header 06, process alarm, slot 3, Seq_Nr 0 with Add_Ack, appeared.
        assert_eq!(extended(&mut bench), [0x06, 0x02, 0x03, 0x05, 0xAB, 0xCD]);
        // Read once; it waits for the acknowledgement.
        assert_eq!(bench.exchange(&[1]), Reply::Ack);
        assert_eq!(extended(&mut bench), []);
        assert_eq!(bench.slave.waiting_alarms(), 1);
        assert_eq!(acknowledge(&mut bench, dsap, &ack_pdu(ack)), data(&[0x5C, 3, 2, 0x05]));
        assert_eq!(
            bench.events(),
            [SlaveEvent::AlarmAcknowledged { alarm: ack }, SlaveEvent::Outputs]
        );
        assert_eq!(bench.slave.waiting_alarms(), 0);
        // It cannot be acknowledged again.
        assert_eq!(
            acknowledge(&mut bench, dsap, &ack_pdu(ack)),
            data(&[0xDC, 0x80, 0xB5, 0])
        );
    }
}

#[test]
fn a_diagnosis_carries_one_alarm_at_a_time_in_the_order_of_sending() {
    let mut bench = bench(MANY);
    let first = send(&mut bench, AlarmType::DIAGNOSIS, 1).unwrap();
    let second = send(&mut bench, AlarmType::PULL, 2).unwrap();
    assert_eq!((first.specifier.sequence, second.specifier.sequence), (0, 1));
    assert_eq!(bench.exchange(&[1]), Reply::High(vec![]));
    assert_eq!(extended(&mut bench), [0x05, 0x01, 0x01, 0x01, 0xAB]);
    // Still something new.
    assert_eq!(bench.exchange(&[1]), Reply::High(vec![]));
    // Pull, slot 2, Seq_Nr 1 << 3 | appeared.
    assert_eq!(extended(&mut bench), [0x05, 0x03, 0x02, 0x09, 0xAB]);
    assert_eq!(bench.exchange(&[1]), Reply::Ack);
    // Acknowledged in any order.
    assert_eq!(acknowledge(&mut bench, 50, &ack_pdu(second)), data(&ack_pdu(second)));
    assert_eq!(acknowledge(&mut bench, 50, &ack_pdu(first)), data(&ack_pdu(first)));
    assert_eq!(bench.slave.waiting_alarms(), 0);
}

#[test]
fn an_alarm_stands_before_the_other_diagnosis() {
    let mut bench = bench(TWO);
    bench
        .slave
        .set_ext_diag(ExtDiag::Fault, &[0x03, 0x32, 0x10], Overflow::Complete)
        .unwrap();
    send(&mut bench, AlarmType::DIAGNOSIS, 7).unwrap();
    let octets = bench.diagnosis(OWNER);
    let diagnosis = Diagnosis::parse(&octets).unwrap();
    let blocks: Vec<_> = diagnosis.blocks().collect();
    let [Block::Device(alarm), Block::Device(fault)] = blocks[..] else {
        panic!("{blocks:?}");
    };
    assert!(matches!(V1Block::parse(alarm), Some(V1Block::Alarm(alarm)) if alarm.slot == 7 && alarm.data == [0xAB]));
    assert_eq!(fault, [0x32, 0x10]);
    assert_eq!(extended(&mut bench), [0x03, 0x32, 0x10]);
}

#[test]
fn diagnosis_that_leaves_no_room_waits_for_its_turn() {
    let mut bench = bench(TWO);
    // Four device blocks of 59 octets: 236 of 238.
    let mut blocks = Vec::new();
    for _ in 0..4 {
        blocks.push(59);
        blocks.extend([0x11; 58]);
    }
    bench
        .slave
        .set_ext_diag(ExtDiag::Message, &blocks, Overflow::Complete)
        .unwrap();
    send(&mut bench, AlarmType::DIAGNOSIS, 7).unwrap();
    let octets = bench.diagnosis(OWNER);
    // Ext_Diag_Overflow: there is more.
    assert_eq!(
        (octets[2] & 0x80, &octets[6..]),
        (0x80, &[0x05, 0x01, 0x07, 0x01, 0xAB][..])
    );
    assert_eq!(bench.exchange(&[1]), Reply::High(vec![]));
    let octets = bench.diagnosis(OWNER);
    assert_eq!((octets[2] & 0x80, &octets[6..]), (0x00, &blocks[..]));
    assert_eq!(bench.exchange(&[1]), Reply::Ack);
}

#[test]
fn a_lost_diagnosis_is_repeated_with_its_alarm() {
    let mut bench = bench(TWO);
    send(&mut bench, AlarmType::DIAGNOSIS, 7).unwrap();
    let octets = bench.diagnosis(OWNER);
    assert_eq!(octets.len(), 11);
    assert_eq!(bench.send_again(), data(&octets));
}

#[test]
fn another_master_neither_sees_nor_acknowledges_an_alarm() {
    let mut bench = bench(TWO);
    let ack = send(&mut bench, AlarmType::DIAGNOSIS, 7).unwrap();
    assert_eq!(bench.diagnosis(TOOL).len(), 6);
    assert_eq!(extended(&mut bench).len(), 5);
    assert_eq!(bench.ask(TOOL, 50, 51, &ack_pdu(ack)), RS);
    assert_eq!(bench.ask(TOOL, 51, 51, &ack_pdu(ack)), RS);
    assert_eq!(bench.slave.waiting_alarms(), 1);
}

#[test]
fn an_alarm_that_was_not_read_cannot_be_acknowledged() {
    let mut bench = bench(TWO);
    let ack = send(&mut bench, AlarmType::DIAGNOSIS, 7).unwrap();
    assert_eq!(acknowledge(&mut bench, 50, &ack_pdu(ack)), data(&[0xDC, 0x80, 0xB5, 0]));
    // Nor with another slot, type or sequence number.
    extended(&mut bench);
    for (place, octet) in [(1, 8), (2, 2), (3, ack.specifier.octet() | 0x08)] {
        let mut wrong = ack_pdu(ack);
        wrong[place] = octet;
        assert_eq!(acknowledge(&mut bench, 50, &wrong), data(&[0xDC, 0x80, 0xB5, 0]));
    }
    assert_eq!(
        acknowledge(&mut bench, 50, &[0x5E, 0, 0, 1]),
        data(&[0xDC, 0x80, 0xB8, 0])
    );
    assert_eq!(acknowledge(&mut bench, 50, &ack_pdu(ack)), data(&ack_pdu(ack)));
}

#[test]
fn alarm_mode_limits_how_many_wait() {
    // 0: one of each type, with sequence number 0.
    let mut of_each = bench(EACH_TYPE);
    let first = send(&mut of_each, AlarmType::DIAGNOSIS, 1).unwrap();
    assert_eq!(
        send(&mut of_each, AlarmType::DIAGNOSIS, 2),
        Err(SendAlarmError::TooMany { waiting: 1 })
    );
    let process = send(&mut of_each, AlarmType::PROCESS, 2).unwrap();
    assert_eq!([first, process].map(|ack| ack.specifier.sequence), [0, 0]);
    extended(&mut of_each);
    acknowledge(&mut of_each, 50, &ack_pdu(first));
    assert!(send(&mut of_each, AlarmType::DIAGNOSIS, 2).is_ok());

    // 1: two in all.
    let mut two = bench(TWO);
    for _ in 0..2 {
        send(&mut two, AlarmType::DIAGNOSIS, 1).unwrap();
    }
    assert_eq!(
        send(&mut two, AlarmType::PROCESS, 1),
        Err(SendAlarmError::TooMany { waiting: 2 })
    );

    // 7: 32 in all; the slave itself holds fewer.
    let mut many = bench(MANY);
    for _ in 0..MAX_ALARMS {
        send(&mut many, AlarmType::DIAGNOSIS, 1).unwrap();
    }
    let waiting = MAX_ALARMS;
    assert_eq!(
        send(&mut many, AlarmType::DIAGNOSIS, 1),
        Err(SendAlarmError::TooMany { waiting })
    );
}

#[test]
fn sequence_numbers_run_from_0_to_31_and_none_is_used_twice_at_a_time() {
    let mut bench = bench(TWO);
    let held = send(&mut bench, AlarmType::UPDATE, 9).unwrap();
    extended(&mut bench);
    let mut seen = vec![held.specifier.sequence];
    for _ in 0..40 {
        let ack = send(&mut bench, AlarmType::STATUS, 1).unwrap();
        seen.push(ack.specifier.sequence);
        extended(&mut bench);
        acknowledge(&mut bench, 50, &ack_pdu(ack));
    }
    let expected: Vec<u8> = (0..=31).chain(1..=9).collect();
    assert_eq!(seen, expected);
}

#[test]
fn only_alarms_that_slave_and_master_know_are_sent() {
    let few = V1Capabilities {
        alarms: AlarmTypes::DIAGNOSIS.with(AlarmTypes::VENDOR),
        ..capabilities()
    };
    // The master wants process, diagnosis and manufacturer's alarms.
    let mut bench = Bench::exchanging(few, &[0x80, 0x70, 0x07]);
    let unsupported = |alarm_type| Err(SendAlarmError::Unsupported { alarm_type });
    assert_eq!(send(&mut bench, AlarmType::PROCESS, 1), unsupported(AlarmType::PROCESS));
    assert_eq!(send(&mut bench, AlarmType(0), 1), unsupported(AlarmType(0)));
    assert_eq!(send(&mut bench, AlarmType(127), 1), unsupported(AlarmType(127)));
    assert!(send(&mut bench, AlarmType::DIAGNOSIS, 1).is_ok());
    assert!(send(&mut bench, AlarmType(126), 1).is_ok());
    // The master does not want them.
    for user in [[0x80, 0x40, 0x07], [0x00, 0xFC, 0x07]] {
        let mut bench = Bench::exchanging(few, &user);
        let alarm_type = AlarmType::DIAGNOSIS;
        assert_eq!(
            send(&mut bench, alarm_type, 1),
            Err(SendAlarmError::NotEnabled { alarm_type })
        );
        assert_eq!(bench.exchange(&[1]), Reply::Ack);
    }
}

#[test]
fn without_data_exchange_there_are_no_alarms() {
    let mut bench = Bench::new(capabilities());
    let alarm_type = AlarmType::DIAGNOSIS;
    let not_enabled = Err(SendAlarmError::NotEnabled { alarm_type });
    assert_eq!(send(&mut bench, alarm_type, 1), not_enabled);
    bench.set_prm(0x80, [0, 0], &TWO);
    assert_eq!(send(&mut bench, alarm_type, 1), not_enabled);
    bench.start_up(&TWO);
    send(&mut bench, alarm_type, 1).unwrap();
    // Those that wait end with it.
    bench.set_prm(0x40, [0, 0], &[]);
    assert_eq!(bench.slave.waiting_alarms(), 0);
    bench.start_up(&TWO);
    assert_eq!(extended(&mut bench), []);
}

#[test]
fn sixty_octets_are_too_many() {
    let mut bench = bench(TWO);
    let mut send = |data: &[u8]| {
        let place = (AlarmType::DIAGNOSIS, 1);
        bench
            .slave
            .send_alarm(place, Incident::Appears, AddAck::NotNeeded, data)
    };
    assert_eq!(send(&[0; 60]), Err(SendAlarmError::DataTooLong { got: 60 }));
    assert!(send(&[0; 59]).is_ok());
    assert_eq!(
        AlarmSpecifier::from_octet(extended(&mut bench)[3]).incident,
        Incident::Appears
    );
}
