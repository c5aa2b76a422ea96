//! What a master does with each answer to Data_Exchange, and with slaves that accept everything and then do not
//! exchange.
//!
//! Source: IEC 61158-6-3, slave handler in the state DATA; IEC 61158-4-3, response codes.

use dp_master::dp::{LossCause, MasterEvent, Mode, SlaveConfig, SlaveState, StationStatus};
use dp_master::time::{Baud, Duration};
use dp_master::wire::ResponseFunction;

use crate::common::puppet::{Puppet, Says};
use crate::common::{Line, SLAVE};

const BAUD: Baud = Baud::B1500000;

fn line(exchange: impl FnMut(usize, &[u8]) -> Says + 'static) -> Line {
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_station(Box::new(Puppet::slave(SLAVE, BAUD, exchange)));
    line.master.set_mode(Mode::Operate);
    line
}

/// Data of a usual answer.
fn good(value: u8) -> Says {
    Says::Data(ResponseFunction::DataLow, vec![value; 8])
}

/// Five good exchanges, then one of another kind, then good ones.
fn once(says: Says) -> Line {
    let mut line = line(move |count, _| if count == 5 { says.clone() } else { good(1) });
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 5);
    line.master_events();
    line
}

fn starts(line: &Line, from: usize) -> usize {
    let set_prm = |telegram: &&String| telegram.starts_with("68 0C 0C 68 83 82") && telegram.contains("3D 3E");
    line.tap.log[from..].iter().filter(set_prm).count()
}

#[test]
fn rr_keeps_the_exchange_and_sends_the_outputs_again() {
    let mut line = once(Says::Data(ResponseFunction::NoResource, vec![]));
    let (index, heard) = (line.indices[0], line.tap.log.len());
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    assert_eq!(line.master_events(), []);
    assert_eq!(starts(&line, heard), 0);
    let statistics = line.master.statistics();
    assert_eq!((statistics.outputs_refused, statistics.rejected), (1, 1));
    // The refused one is no exchange.
    assert_eq!(statistics.exchanges, line.master.exchanges(index));
    line.assert_no_violations();
}

#[test]
fn rdl_brings_inputs_although_the_outputs_were_refused() {
    let mut line = once(Says::Data(ResponseFunction::DataLowNoResource, vec![9; 8]));
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 6);
    assert_eq!(line.master.inputs(index), [9; 8]);
    assert_eq!(line.master.statistics().outputs_refused, 1);
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    assert_eq!(line.master_events(), []);
}

#[test]
fn rdh_brings_inputs_and_asks_for_the_diagnosis() {
    let mut line = once(Says::Data(ResponseFunction::DataHighNoResource, vec![9; 8]));
    let (index, heard) = (line.indices[0], line.tap.log.len());
    line.run_until(|line| line.master.exchanges(index) == 6);
    assert_eq!(line.master.inputs(index), [9; 8]);
    line.run_for(Duration::from_millis(5));
    let diagnoses = line.tap.log[heard..]
        .iter()
        .filter(|telegram| telegram.starts_with("68 05 05 68 83 82"));
    assert_eq!(diagnoses.count(), 1);
    assert!(matches!(line.master_events()[..], [MasterEvent::Diagnosis { .. }]));
}

#[test]
fn dh_asks_for_the_diagnosis_in_the_next_cycle() {
    let mut line = once(Says::Data(ResponseFunction::DataHigh, vec![9; 8]));
    let index = line.indices[0];
    line.run_for(Duration::from_millis(5));
    assert!(matches!(line.master_events()[..], [MasterEvent::Diagnosis { .. }]));
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
}

#[test]
fn rs_ue_and_codes_without_a_name_start_the_slave_up_again() {
    for function in [
        ResponseFunction::NoService,
        ResponseFunction::UserError,
        ResponseFunction::Unknown(0x0B),
    ] {
        let mut line = once(Says::Data(function, vec![]));
        let (slave, heard) = (line.indices[0], line.tap.log.len());
        line.run_for(Duration::from_millis(5));
        assert_eq!(
            line.master_events(),
            [
                MasterEvent::SlaveLost {
                    slave,
                    cause: LossCause::Rejected(function)
                },
                MasterEvent::DataExchange { slave },
            ]
        );
        assert_eq!(starts(&line, heard), 1);
        // First contact again: Slave_Diag with FC 6D.
        assert!(
            line.tap.log[heard..]
                .iter()
                .any(|telegram| telegram.starts_with("68 05 05 68 83 82 6D"))
        );
        line.assert_no_violations();
    }
}

#[test]
fn an_answer_without_data_or_of_another_length_is_invalid() {
    for (says, got) in [
        (Says::ShortAck, 0),
        (Says::Data(ResponseFunction::NoReplyData, vec![]), 0),
        (Says::Data(ResponseFunction::DataLow, vec![1; 7]), 7),
        (Says::Data(ResponseFunction::DataLow, vec![1; 9]), 9),
    ] {
        let mut line = once(says);
        let slave = line.indices[0];
        line.run_until(|line| line.master.state(slave) != SlaveState::DataExchange);
        assert_eq!(
            line.master_events(),
            [MasterEvent::SlaveLost {
                slave,
                cause: LossCause::InputLength { expected: 8, got }
            }]
        );
        assert_eq!(line.master.inputs(slave), [1; 8], "what was valid stays");
    }
}

#[test]
fn silence_ends_the_exchange_after_the_retry_limit() {
    // Silent for one request and its repetition (retry limit 1 at 1.5 Mbit/s); the repetition reaches the puppet as a
    // request of its own.
    let mut line = line(|count, _| {
        if (5..7).contains(&count) {
            Says::Nothing
        } else {
            good(1)
        }
    });
    let slave = line.indices[0];
    line.run_until(|line| line.master.exchanges(slave) == 5);
    line.master_events();
    line.run_for(Duration::from_millis(30));
    assert_eq!(
        line.master_events(),
        [
            MasterEvent::SlaveLost {
                slave,
                cause: LossCause::NoAnswer
            },
            MasterEvent::DataExchange { slave },
        ]
    );
}

#[test]
fn a_slave_that_accepts_everything_and_never_exchanges_is_told_once_and_tried_with_pauses() {
    // Known failure of peers: an endless start-up at full speed. Here with a retry interval of 20 ms.
    for says in [
        Says::Data(ResponseFunction::NoService, vec![]),
        Says::Data(ResponseFunction::DataLow, vec![1; 4]),
    ] {
        let mut line = line(move |_, _| says.clone());
        line.run_for(Duration::from_millis(500));
        let slave = line.indices[0];
        let events = line.master_events();
        assert!(
            matches!(
                events[..],
                [_, MasterEvent::DataExchange { .. }, MasterEvent::SlaveLost { .. }]
            ),
            "{events:?}"
        );
        let starts = starts(&line, 0);
        assert!((20..=25).contains(&starts), "{starts}");
        assert_eq!(line.master.exchanges(slave), 0);
        line.assert_no_violations();
    }
}

#[test]
fn a_slave_that_exchanges_at_last_is_told() {
    let mut line = line(|count, _| {
        if count < 3 {
            Says::Data(ResponseFunction::NoService, vec![])
        } else {
            good(1)
        }
    });
    line.run_for(Duration::from_millis(200));
    let slave = line.indices[0];
    assert_eq!(line.master.state(slave), SlaveState::DataExchange);
    let events = line.master_events();
    assert!(
        matches!(
            events[..],
            [
                _,
                MasterEvent::DataExchange { .. },
                MasterEvent::SlaveLost { .. },
                MasterEvent::DataExchange { .. }
            ]
        ),
        "{events:?}"
    );
}

#[test]
fn the_status_of_a_station_carries_the_bits_of_the_master() {
    // Not there: Station_Non_Existent.
    let mut absent = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    absent.master.set_mode(Mode::Operate);
    absent.run_for(Duration::from_millis(10));
    let status = absent.master.station_status(absent.indices[0]);
    assert_eq!(status, StationStatus::STATION_NON_EXISTENT);
    // Inputs of another length from the first exchange on: Invalid_Slave_Response.
    let mut invalid = line(|_, _| Says::Data(ResponseFunction::DataLow, vec![1; 4]));
    invalid.run_for(Duration::from_millis(10));
    let status = invalid.master.station_status(invalid.indices[0]);
    assert!(status.contains(StationStatus::INVALID_SLAVE_RESPONSE));
    // Exchanging: nothing but what the slave says, 00 04.
    let mut good = line(|_, _| good(1));
    good.run_for(Duration::from_millis(10));
    assert_eq!(good.master.station_status(good.indices[0]), StationStatus(0x0400));
    // Owned by master 4: Master_Lock.
    let mut locked = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    locked.add_station(Box::new(Puppet::new(
        SLAVE,
        BAUD,
        Box::new(|_, _, _| Says::Data(ResponseFunction::DataLow, vec![0x00, 0x04, 0, 4, 0x00, 0xDA])),
    )));
    locked.master.set_mode(Mode::Operate);
    locked.run_for(Duration::from_millis(10));
    assert!(
        locked
            .master
            .station_status(locked.indices[0])
            .contains(StationStatus::MASTER_LOCK)
    );
}
