//! Diagnosis announced by a reply of high priority.

use dp_master::dp::{Block, ExtDiag, InputValidity, MasterEvent, Mode, Overflow, SlaveConfig, StationStatus};
use dp_master::time::{Baud, Duration};

use crate::common::{Line, SLAVE, slave_identity};

fn exchanging(identifiers: &[u8]) -> Line {
    let config = SlaveConfig::new(SLAVE, 0x00DA, identifiers).unwrap();
    let mut line = Line::new(Baud::B1500000, &[config]);
    line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 5);
    line.master_events();
    line
}

#[test]
fn a_trip_is_announced_read_once_and_the_exchange_goes_on() {
    let mut line = exchanging(&[0xF3]);
    let slave = line.indices[0];
    let heard = line.tap.log.len();
    // Overvoltage, 603Fh code 0x3210 (9300 facts 1.4).
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, &[0x03, 0x32, 0x10], Overflow::Complete)
        .unwrap();
    line.run_until(|line| line.master.exchanges(slave) == 9);
    let events = line.master_events();
    let [MasterEvent::Diagnosis { diagnosis, .. }] = events[..] else {
        panic!("{events:?}");
    };
    assert!(diagnosis.status.contains(StationStatus::EXT_DIAG));
    assert_eq!(diagnosis.master, 2);
    let read = line.master.diagnosis(slave).unwrap();
    assert_eq!(read.blocks().collect::<Vec<_>>(), [Block::Device(&[0x32, 0x10])]);
    let log = &line.tap.log[heard..];
    // Data_Exchange replies: one with FC 0A, all others 08.
    let count = |start: &str| log.iter().filter(|line| line.starts_with(start)).count();
    assert_eq!(count("68 0B 0B 68 02 03 0A"), 1);
    assert_eq!(count("68 0B 0B 68 02 03 08"), 3);
    assert_eq!(count("68 05 05 68 83 82"), 1);
    line.assert_no_violations();
}

#[test]
fn a_fault_that_goes_is_announced_too() {
    let mut line = exchanging(&[0xF3]);
    let slave = line.indices[0];
    for (kind, code) in [(ExtDiag::Fault, 0x10), (ExtDiag::Message, 0x00)] {
        line.slaves[0]
            .set_ext_diag(kind, &[0x03, 0x00, code], Overflow::Complete)
            .unwrap();
        let exchanges = line.master.exchanges(slave);
        line.run_until(|line| line.master.exchanges(slave) == exchanges + 3);
    }
    let faults: Vec<_> = line
        .master_events()
        .iter()
        .filter_map(|event| match event {
            MasterEvent::Diagnosis { diagnosis, .. } => Some(diagnosis.status.contains(StationStatus::EXT_DIAG)),
            _ => None,
        })
        .collect();
    assert_eq!(faults, [true, false]);
}

#[test]
fn the_same_diagnosis_again_is_no_news() {
    let mut line = exchanging(&[0xF3]);
    let slave = line.indices[0];
    for _ in 0..3 {
        line.slaves[0]
            .set_ext_diag(ExtDiag::Fault, &[0x03, 0x00, 0x10], Overflow::Truncated)
            .unwrap();
        let exchanges = line.master.exchanges(slave);
        line.run_until(|line| line.master.exchanges(slave) == exchanges + 3);
    }
    let events = line.master_events();
    assert_eq!(events.len(), 1, "{events:?}");
    let diagnosis = line.master.diagnosis(slave).unwrap();
    assert_eq!(diagnosis.standard.overflow(), Overflow::Truncated);
}

#[test]
fn a_slave_without_inputs_announces_with_an_empty_reply() {
    let mut line = exchanging(&[0x20]);
    let slave = line.indices[0];
    let heard = line.tap.log.len();
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, &[0x03, 0x10, 0x00], Overflow::Complete)
        .unwrap();
    line.run_until(|line| line.master.exchanges(slave) == 8);
    assert_eq!(line.master_events().len(), 1);
    // SD1 DA 02 SA 03 FC 0A FCS 0F ED
    assert!(line.tap.log[heard..].contains(&"10 02 03 0A 0F 16".to_owned()));
    // Otherwise it acknowledges with E5.
    assert_eq!(line.tap.log[heard..].iter().filter(|t| *t == "E5").count(), 2);
    line.assert_no_violations();
}

#[test]
fn more_than_238_octets_are_refused_and_nothing_changes() {
    let mut line = exchanging(&[0xF3]);
    let before = line.slaves[0].diagnosis();
    let too_long = [0; 239];
    assert!(
        line.slaves[0]
            .set_ext_diag(ExtDiag::Fault, &too_long, Overflow::Complete)
            .is_err()
    );
    assert_eq!(line.slaves[0].diagnosis(), before);
}

#[test]
fn a_slave_without_valid_data_is_asked_for_diagnosis_until_it_has_some() {
    let mut line = exchanging(&[0xF3]);
    let slave = line.indices[0];
    line.slaves[0].set_input_validity(InputValidity::Invalid);
    line.run_for(Duration::from_millis(2));
    let (exchanges, heard) = (line.master.exchanges(slave), line.tap.log.len());
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.exchanges(slave), exchanges);
    let asked = |telegram: &&String| telegram.starts_with("68 05 05 68 83 82");
    assert!(line.tap.log[heard..].iter().filter(asked).count() > 10);
    // Told once, however often it is read.
    let events = line.master_events();
    assert!(
        matches!(events[..], [MasterEvent::Diagnosis { diagnosis, .. }] if diagnosis.status.contains(StationStatus::STAT_DIAG)),
        "{events:?}"
    );
    line.slaves[0].set_input_validity(InputValidity::Valid);
    line.run_for(Duration::from_millis(5));
    assert!(line.master.exchanges(slave) > exchanges);
    let events = line.master_events();
    assert!(
        matches!(events[..], [MasterEvent::Diagnosis { diagnosis, .. }] if !diagnosis.status.intersects(StationStatus::STAT_DIAG)),
        "{events:?}"
    );
    line.assert_no_violations();
}
