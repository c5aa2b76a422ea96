//! Start-up of a slave on the virtual line: the telegrams octet by octet, refusals, and the way back.

use dp_master::dp::{LeaveReason, MasterEvent, Mode, SlaveConfig, SlaveEvent, SlavePhase, SlaveState, Watchdog};
use dp_master::time::{Baud, BitTimes, Duration};

use crate::common::{Line, MASTER, SLAVE, slave_identity};

/// Set_Prm for address 3, ident 0x00DA, watchdog 50 ms; then one exchange of eight octets each way.
///
/// Checked by hand against IEC 61158-4-3 and IEC 61158-6-3: SD2 LE LEr SD2, addresses with bit 7 for the access points,
/// FC 6D first contact, then 5D and 7D in turn, DSAP, SSAP 62 = 3E; FCS is the sum from DA to the last data octet.
/// Six octets of diagnosis and two access points are eight, and so are the outputs: LE = 3 + 8 = 0B. SD3 would be three octets
/// shorter, but DP devices send SD2.
const START_UP: &str = "\
DC 02 02
DC 02 02
10 00 02 49 4B 16
10 01 02 49 4C 16
DC 02 02
68 05 05 68 83 82 6D 3C 3E EC 16
68 0B 0B 68 82 83 08 3E 3C 02 05 00 FF 00 DA 67 16
68 0C 0C 68 83 82 5D 3D 3E 88 01 05 0B 00 DA 00 50 16
E5
68 06 06 68 83 82 7D 3E 3E F3 F1 16
E5
68 05 05 68 83 82 5D 3C 3E DC 16
68 0B 0B 68 82 83 08 3E 3C 00 0C 00 02 00 DA 6F 16
68 07 07 68 FF 82 46 3A 3E 00 00 3F 16
68 0B 0B 68 03 02 7D 11 22 33 44 55 66 77 88 E6 16
68 0B 0B 68 02 03 08 A1 A2 A3 A4 A5 A6 A7 A8 31 16
68 0B 0B 68 03 02 5D 11 22 33 44 55 66 77 88 C6 16
68 0B 0B 68 02 03 08 A1 A2 A3 A4 A5 A6 A7 A8 31 16
";

fn one_block() -> SlaveConfig {
    let mut config = SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap();
    config.watchdog = Some(Watchdog::from_factors(1, 5).unwrap());
    config
}

#[test]
fn the_start_up_is_the_sequence_of_the_standard_octet_by_octet() {
    let mut line = Line::new(Baud::B1500000, &[one_block()]);
    let slave = line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    let outputs = [0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88];
    line.master.set_outputs(index, &outputs).unwrap();
    line.run_until(|line| line.slaves[slave].phase() == SlavePhase::DataExchange);
    let inputs = [0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8];
    line.slaves[slave].set_inputs(&inputs);
    line.run_until(|line| line.tap.log.len() > START_UP.lines().count());
    let log: Vec<&str> = line.tap.log.iter().map(String::as_str).collect();
    let expected: Vec<&str> = START_UP.lines().collect();
    assert_eq!(log[..expected.len()], expected[..]);
    assert_eq!(line.master.inputs(index), inputs);
    assert_eq!(line.slaves[slave].outputs(), outputs);
    assert_eq!(
        line.slave_events(slave),
        [
            SlaveEvent::Parametrised {
                master: MASTER,
                watchdog: Watchdog::from_factors(1, 5)
            },
            SlaveEvent::Configured {
                lengths: one_block().configuration.lengths()
            },
            SlaveEvent::EnteredDataExchange,
            SlaveEvent::Outputs,
        ]
    );
    line.assert_no_violations();
}

#[test]
fn a_wrong_ident_number_is_reported_with_what_the_slave_really_is() {
    let mut config = one_block();
    config.ident = 0x1234;
    let mut line = Line::new(Baud::B1500000, &[config]);
    let slave = line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(200));
    let events = line.master_events();
    let refusals: Vec<_> = events
        .iter()
        .filter_map(|event| match event {
            MasterEvent::ParametersRefused { diagnosis, .. } => Some(diagnosis),
            _ => None,
        })
        .collect();
    // Once, although it is tried again and again.
    assert_eq!(refusals.len(), 1, "{events:?}");
    assert_eq!(refusals[0].ident, 0x00DA);
    assert_eq!(line.master.state(line.indices[0]), SlaveState::Refused);
    assert_eq!(line.slaves[slave].phase(), SlavePhase::WaitPrm);
    let attempts = line
        .tap
        .log
        .iter()
        .filter(|telegram| telegram.starts_with("68 0C 0C 68 83"));
    // 200 ms with a retry interval of 20 ms.
    assert!((5..=11).contains(&attempts.count()));
    line.assert_no_violations();
}

#[test]
fn a_wrong_configuration_is_reported_and_the_slave_starts_once_the_cause_is_gone() {
    let mut config = one_block();
    config.configuration = dp_master::dp::Configuration::new(&[0xF7]).unwrap();
    let mut line = Line::new(Baud::B1500000, &[config]);
    let slave = line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(50));
    let index = line.indices[0];
    assert!(line.master_events().iter().any(|event| matches!(
        event,
        MasterEvent::ConfigurationRefused { slave, .. } if *slave == index
    )));
    assert_eq!(line.master.state(index), SlaveState::Refused);
    // The module is exchanged for one that accepts eight words.
    let mut identity = slave_identity(Baud::B1500000);
    identity.configurations = dp_master::dp::AcceptedConfigurations::Table(&[&[0xF7]]);
    line.replace_slave(slave, identity);
    line.run_for(Duration::from_millis(50));
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_slave_that_was_switched_off_and_on_is_started_again() {
    let mut line = Line::new(Baud::B1500000, &[one_block()]);
    let slave = line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.master.exchanges(line.indices[0]) > 3);
    line.replace_slave(slave, slave_identity(Baud::B1500000));
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    let events = line.master_events();
    assert!(
        events
            .iter()
            .any(|event| matches!(event, MasterEvent::SlaveLost { .. })),
        "{events:?}"
    );
    line.assert_no_violations();
}

#[test]
fn stop_leaves_the_slaves_alone_and_operate_starts_them_again() {
    let mut line = Line::new(Baud::B1500000, &[one_block()]);
    let slave = line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.master.exchanges(line.indices[0]) > 3);
    line.slave_events(slave);
    line.master.set_mode(Mode::Stop);
    line.run_for(Duration::from_millis(60));
    assert!(line.slave_events(slave).contains(&SlaveEvent::LeftDataExchange {
        reason: LeaveReason::Watchdog
    }));
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_stop_and_start_within_one_exchange_takes_no_answer_for_another() {
    // The answer to the Data_Exchange under way must not be read as the diagnosis that the new start-up waits for.
    let mut line = Line::new(Baud::B1500000, &[one_block()]);
    line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.master_events();
    line.run_until(|line| {
        let last = line.tap.log.last();
        last.is_some_and(|last| last.starts_with("68 0B 0B 68 03 02") && last.len() == 50)
    });
    line.master.set_mode(Mode::Stop);
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    let events = line.master_events();
    assert!(
        matches!(
            events[..],
            [MasterEvent::SlaveLost { .. }, MasterEvent::DataExchange { .. }]
        ),
        "{events:?}"
    );
    line.assert_no_violations();
}

#[test]
fn a_slave_understands_outputs_that_come_as_sd3_and_answers_with_sd2() {
    let mut line = Line::new(Baud::B1500000, &[one_block()]);
    let slave = line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 3);
    line.slaves[slave].set_inputs(&[0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8]);
    // The same master with another interface: its fourth exchange, the frame count bit goes on to 5D.
    let other = line.bus.attach();
    line.bus.disconnect(line.master_port);
    line.run_for(Duration::from_millis(1));
    let sd3 = [
        0xA2, 0x03, 0x02, 0x5D, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88, 0xC6, 0x16,
    ];
    line.bus.transmit(line.now, other, &sd3);
    line.run_for(Duration::from_millis(1));
    assert_eq!(
        line.slaves[slave].outputs(),
        [0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88]
    );
    assert_eq!(
        line.tap.log.last().unwrap(),
        "68 0B 0B 68 02 03 08 A1 A2 A3 A4 A5 A6 A7 A8 31 16"
    );
}

#[test]
fn a_master_understands_a_diagnosis_that_comes_as_sd3() {
    let mut line = Line::new(Baud::B1500000, &[one_block()]);
    let slave = line.bus.attach();
    line.master.set_mode(Mode::Operate);
    let heard = |line: &Line, telegram: &str| line.tap.log.last().is_some_and(|last| last == telegram);
    line.run_until(|line| heard(line, "68 05 05 68 83 82 6D 3C 3E EC 16"));
    let sd3 = [
        0xA2, 0x82, 0x83, 0x08, 0x3E, 0x3C, 0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA, 0x67, 0x16,
    ];
    // 20 tBIT after the request: min Tsdr is 11.
    line.bus
        .transmit(line.now + Baud::B1500000.duration(BitTimes(20)), slave, &sd3);
    // The next request is Set_Prm: the diagnosis was read.
    line.run_until(|line| heard(line, "68 0C 0C 68 83 82 5D 3D 3E 88 01 05 0B 00 DA 00 50 16"));
    assert_eq!(line.master.statistics().retries, 0);
    line.assert_no_violations();
}
