//! What a master does with each answer during the start-up and to a diagnosis: a puppet gives one wrong answer, for ever.
//!
//! Source: IEC 61158-6-3, slave handler (DIAG1, PRM, CFG, DIAG2, DATA); status bits: coding of Station_status_1 and 2.

use std::cell::Cell;
use std::rc::Rc;

use dp_master::dp::{LossCause, MasterEvent, Mode, SlaveConfig, SlaveState, sap};
use dp_master::time::{Baud, Duration};
use dp_master::wire::ResponseFunction;

use crate::common::puppet::{Puppet, Says};
use crate::common::{Line, SLAVE};

const BAUD: Baud = Baud::B1500000;

/// What is asked.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Asked {
    /// Slave_Diag before Set_Prm.
    FirstDiagnosis,
    Parameters,
    Configuration,
    /// Slave_Diag behind Chk_Cfg.
    SecondDiagnosis,
    Exchange,
    /// Slave_Diag in data exchange.
    LaterDiagnosis,
}

/// Station_status_1 and 2, Diag_Master_Add; ident 00DA.
fn diagnosis(status_1: u8, status_2: u8, master: u8) -> Says {
    Says::Data(
        ResponseFunction::DataLow,
        vec![status_1, status_2 | 0x04, 0x00, master, 0x00, 0xDA],
    )
}

/// A slave that takes everything, but for what the test answers in its place. It announces a diagnosis with its fifth exchange.
fn line(wrong: impl Fn(Asked) -> Option<Says> + 'static) -> Line {
    let step = Rc::new(Cell::new(Asked::FirstDiagnosis));
    let exchanges = Cell::new(0);
    let puppet = Puppet::new(
        SLAVE,
        BAUD,
        Box::new(move |_, dsap, _| {
            let asked = match (dsap, step.get()) {
                (Some(sap::SLAVE_DIAG), Asked::Configuration | Asked::SecondDiagnosis) => Asked::SecondDiagnosis,
                (Some(sap::SLAVE_DIAG), Asked::Exchange | Asked::LaterDiagnosis) => Asked::LaterDiagnosis,
                (Some(sap::SLAVE_DIAG), _) => Asked::FirstDiagnosis,
                (Some(sap::SET_PRM), _) => Asked::Parameters,
                (Some(sap::CHK_CFG), _) => Asked::Configuration,
                _ => Asked::Exchange,
            };
            step.set(asked);
            if let Some(says) = wrong(asked) {
                // All but Stat_Diag end the exchange: what is asked next is a start-up.
                if asked == Asked::LaterDiagnosis && says != diagnosis(0x00, 0x02, 2) {
                    step.set(Asked::FirstDiagnosis);
                }
                return says;
            }
            match asked {
                Asked::FirstDiagnosis => diagnosis(0x02, 0x01, 0xFF),
                Asked::Parameters | Asked::Configuration => Says::ShortAck,
                Asked::SecondDiagnosis | Asked::LaterDiagnosis => diagnosis(0x00, 0x00, 2),
                Asked::Exchange => {
                    exchanges.set(exchanges.get() + 1);
                    let function = if exchanges.get() == 5 {
                        ResponseFunction::DataHigh
                    } else {
                        ResponseFunction::DataLow
                    };
                    Says::Data(function, vec![1; 8])
                }
            }
        }),
    );
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_station(Box::new(puppet));
    line.master.set_mode(Mode::Operate);
    line
}

/// What the master has told of its slave.
fn slave_events(line: &mut Line) -> Vec<MasterEvent> {
    let mut events = line.master_events();
    events.retain(|event| !matches!(event, MasterEvent::Ring(_)));
    events
}

/// The events of 100 ms, of which the first tells what is wrong; the master tries again and does not say it twice.
fn told(asked: Asked, says: &Says) -> MasterEvent {
    let says = says.clone();
    let mut line = line(move |now| (now == asked).then(|| says.clone()));
    let index = line.indices[0];
    line.run_for(Duration::from_millis(100));
    let starts = line
        .tap
        .log
        .iter()
        .filter(|telegram| telegram.contains("3C 3E"))
        .count();
    assert!(starts >= 3, "it is tried again: {starts}");
    assert_ne!(line.master.state(index), SlaveState::DataExchange);
    let events = slave_events(&mut line);
    assert_eq!(events.len(), 1, "{events:?}");
    events[0]
}

#[test]
fn a_slave_whose_diagnosis_cannot_be_read_is_told_with_what_came() {
    for (says, got) in [
        (Says::ShortAck, 0),
        (Says::Data(ResponseFunction::NoReplyData, vec![]), 0),
        (Says::Data(ResponseFunction::DataLow, vec![0; 5]), 5),
    ] {
        for asked in [Asked::FirstDiagnosis, Asked::SecondDiagnosis] {
            let event = told(asked, &says);
            assert!(
                matches!(event, MasterEvent::DiagnosisUnreadable { got: octets, .. } if octets == got),
                "{event:?}"
            );
        }
    }
}

#[test]
fn a_negative_answer_in_the_start_up_is_told_with_its_code() {
    for function in [
        ResponseFunction::UserError,
        ResponseFunction::NoResource,
        ResponseFunction::NoService,
    ] {
        for asked in [
            Asked::FirstDiagnosis,
            Asked::Parameters,
            Asked::Configuration,
            Asked::SecondDiagnosis,
        ] {
            let event = told(asked, &Says::Data(function, vec![]));
            assert!(
                matches!(event, MasterEvent::StartUpRejected { function: code, .. } if code == function),
                "{asked:?}: {event:?}"
            );
        }
    }
}

#[test]
fn data_where_an_acknowledgement_belongs_are_no_acknowledgement() {
    for asked in [Asked::Parameters, Asked::Configuration] {
        let event = told(asked, &Says::Data(ResponseFunction::DataLow, vec![1]));
        assert!(
            matches!(
                event,
                MasterEvent::StartUpRejected {
                    function: ResponseFunction::DataLow,
                    ..
                }
            ),
            "{asked:?}: {event:?}"
        );
    }
}

#[test]
fn a_fault_in_the_second_diagnosis_is_told_by_its_kind() {
    let kind = |status_1, status_2, master| match told(Asked::SecondDiagnosis, &diagnosis(status_1, status_2, master)) {
        MasterEvent::ParametersRefused { .. } => "parameters",
        MasterEvent::ConfigurationRefused { .. } => "configuration",
        MasterEvent::OwnedByOther { .. } => "owned",
        other => panic!("{other:?}"),
    };
    // Prm_Fault, Not_Supported, Cfg_Fault, Prm_Req; the parameters come before the configuration.
    assert_eq!(kind(0x40, 0x00, 2), "parameters");
    assert_eq!(kind(0x10, 0x00, 2), "parameters");
    assert_eq!(kind(0x04, 0x00, 2), "configuration");
    assert_eq!(kind(0x44, 0x00, 2), "parameters");
    assert_eq!(kind(0x00, 0x01, 2), "parameters");
    assert_eq!(kind(0x00, 0x00, 5), "owned");
    assert_eq!(kind(0x40, 0x00, 5), "owned");
}

#[test]
fn a_slave_of_another_master_is_left_alone() {
    let event = told(Asked::FirstDiagnosis, &diagnosis(0x00, 0x00, 5));
    assert!(matches!(event, MasterEvent::OwnedByOther { .. }), "{event:?}");
}

#[test]
fn a_slave_that_is_not_ready_is_asked_again_until_it_is() {
    // Station_Not_Ready, Stat_Diag.
    for (status_1, status_2) in [(0x02, 0x00), (0x00, 0x02)] {
        let asked_before = Cell::new(0);
        let mut line = line(move |now| {
            if now != Asked::SecondDiagnosis || asked_before.get() == 4 {
                return None;
            }
            asked_before.set(asked_before.get() + 1);
            Some(diagnosis(status_1, status_2, 2))
        });
        let slave = line.indices[0];
        line.run_until(|line| line.master.state(slave) == SlaveState::DataExchange);
        assert_eq!(slave_events(&mut line), [MasterEvent::DataExchange { slave }]);
    }
}

#[test]
fn a_diagnosis_that_ends_the_exchange_is_told_as_its_cause() {
    for (says, expected) in [
        (Says::ShortAck, Some(ResponseFunction::NoReplyData)),
        (
            Says::Data(ResponseFunction::DataLow, vec![0; 5]),
            Some(ResponseFunction::NoReplyData),
        ),
        (
            Says::Data(ResponseFunction::UserError, vec![]),
            Some(ResponseFunction::UserError),
        ),
        // Prm_Fault, Cfg_Fault, Station_Not_Ready, Prm_Req, another master.
        (diagnosis(0x40, 0, 2), None),
        (diagnosis(0x04, 0, 2), None),
        (diagnosis(0x02, 0, 2), None),
        (diagnosis(0x00, 0x01, 2), None),
        (diagnosis(0x00, 0x00, 5), None),
    ] {
        let wrong = says.clone();
        let mut line = line(move |now| (now == Asked::LaterDiagnosis).then(|| wrong.clone()));
        let index = line.indices[0];
        line.run_until(|line| line.master.exchanges(index) == 5);
        line.master_events();
        line.run_until(|line| line.master.state(index) != SlaveState::DataExchange);
        let cause = match line.master_events()[..] {
            [MasterEvent::SlaveLost { cause, .. }] => cause,
            ref other => panic!("{says:?}: {other:?}"),
        };
        match expected {
            Some(function) => assert_eq!(cause, LossCause::Rejected(function), "{says:?}"),
            None => assert!(matches!(cause, LossCause::Diagnosis(_)), "{says:?}: {cause:?}"),
        }
        // It talks: the start-up begins in the next cycle and brings it back.
        line.run_until(|line| line.master.state(index) == SlaveState::DataExchange);
    }
}

#[test]
fn a_slave_without_valid_data_is_asked_for_its_diagnosis_until_it_has_some() {
    // Stat_Diag.
    let asked_before = Cell::new(0);
    let mut line = line(move |now| {
        if now != Asked::LaterDiagnosis || asked_before.get() == 4 {
            return None;
        }
        asked_before.set(asked_before.get() + 1);
        Some(diagnosis(0x00, 0x02, 2))
    });
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 5);
    line.master_events();
    let heard = line.tap.log.len();
    line.run_until(|line| line.master.exchanges(index) == 8);
    let asked = line.tap.log[heard..]
        .iter()
        .filter(|telegram| telegram.starts_with("68 05 05 68 83 82"))
        .count();
    assert_eq!(asked, 5, "four times without data, once with");
    let events = line.master_events();
    assert_eq!(events.len(), 2, "the same diagnosis is told once: {events:?}");
    assert!(
        events
            .iter()
            .all(|event| matches!(event, MasterEvent::Diagnosis { .. })),
        "{events:?}"
    );
}
