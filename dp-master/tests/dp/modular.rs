//! A modular slave: slots, empty ones, and configurations it must refuse.

use dp_master::dp::{
    AcceptedConfigurations, Block, ChannelDiag, ChannelError, ChannelUnit, Direction, EMPTY_SLOT, ExtDiag,
    ExtDiagWriter, IoLengths, LeaveReason, MasterEvent, Mode, SlaveConfig, SlaveEvent, SlaveIdentity, SlavePhase,
    SlaveState, Slot, StationStatus, places, sap,
};
use dp_master::time::Duration;
use dp_master::wire::Fcb;

use crate::common::bench::{BAUD, Bench};
use crate::common::{Line, SLAVE};

/// Four octets of inputs; two words of outputs; an analogue module in the special format (4 words in, one octet of the
/// manufacturer); nothing.
const IO: &[&[u8]] = &[&[0x13], &[0x61], &[0x41, 0x43, 0x07], EMPTY_SLOT];
static STATION: [Slot; 4] = [Slot::new(&[&[0x31]]), Slot::new(IO), Slot::new(IO), Slot::new(IO)];

fn modular() -> SlaveIdentity {
    SlaveIdentity::new(SLAVE, 0x00DA, BAUD, AcceptedConfigurations::Modular(&STATION))
}

#[test]
fn a_station_with_an_empty_slot_is_configured_and_exchanged_with() {
    let identifiers = [0x31, 0x13, 0x00, 0x41, 0x43, 0x07];
    let config = SlaveConfig::new(SLAVE, 0x00DA, &identifiers).unwrap();
    // Head 2 in 2 out, then 4 in, nothing, 8 in.
    let lengths = IoLengths { inputs: 14, outputs: 2 };
    assert_eq!(config.configuration.lengths(), lengths);
    let mut line = Line::new(BAUD, &[config]);
    line.add_slave(modular());
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.master.set_outputs(index, &[0xA1, 0xA2]).unwrap();
    let inputs: Vec<u8> = (1..=14).collect();
    line.slaves[0].set_inputs(&inputs);
    line.run_until(|line| line.master.exchanges(index) > 3);
    assert_eq!(line.master.inputs(index), inputs);
    assert_eq!(line.slaves[0].outputs(), [0xA1, 0xA2]);
    assert_eq!(line.slaves[0].lengths(), lengths);
    assert_eq!(line.slaves[0].configuration(), identifiers);
    assert_eq!(places(line.slaves[0].configuration()).count(), 4);
    line.assert_no_violations();
}

#[test]
fn every_configuration_of_the_slots_is_accepted_and_no_other() {
    let accepts = |identifiers: &[u8]| {
        let mut bench = Bench::with_identity(modular());
        bench.set_prm(2, 0x80, Fcb::First);
        assert_eq!(bench.ask(2, Some(sap::CHK_CFG), Fcb::Low, identifiers), [0xE5]);
        bench.slave.phase() == SlavePhase::DataExchange
    };
    let mut accepted = 0;
    for first in IO {
        for second in IO {
            for third in IO {
                let identifiers = [&[0x31][..], first, second, third].concat();
                assert!(accepts(&identifiers), "{identifiers:02X?}");
                accepted += 1;
            }
        }
    }
    assert_eq!(accepted, 64);
    // Slots at the end left out; then: no head, a module too many, an unknown one, one that is cut off, nothing at all.
    assert!(accepts(&[0x31]) && accepts(&[0x31, 0x13]) && accepts(&[0x31, 0x00, 0x13]));
    for refused in [
        &[0x13, 0x13][..],
        &[0x31, 0x13, 0x13, 0x13, 0x13],
        &[0x31, 0x20],
        &[0x31, 0x41, 0x43],
        &[],
    ] {
        assert!(!accepts(refused), "{refused:02X?}");
    }
}

#[test]
fn a_configuration_that_does_not_fit_the_slots_is_told_to_both_sides() {
    let config = SlaveConfig::new(SLAVE, 0x00DA, &[0x31, 0x20]).unwrap();
    let mut line = Line::new(BAUD, &[config]);
    line.add_slave(modular());
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(10));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::Refused);
    assert!(
        line.master_events()
            .iter()
            .any(|event| matches!(event, MasterEvent::ConfigurationRefused { diagnosis, .. } if diagnosis.status.contains(StationStatus::CFG_FAULT)))
    );
    assert!(line.slave_events(0).contains(&SlaveEvent::ConfigurationRefused));
}

#[test]
fn another_configuration_in_data_exchange_changes_the_images() {
    let mut bench = Bench::with_identity(modular());
    bench.set_prm(2, 0x80, Fcb::First);
    bench.ask(2, Some(sap::CHK_CFG), Fcb::Low, &[0x31]);
    assert_eq!(bench.slave.lengths(), IoLengths { inputs: 2, outputs: 2 });
    bench.ask(2, Some(sap::CHK_CFG), Fcb::High, &[0x31, 0x61]);
    assert_eq!(bench.slave.lengths(), IoLengths { inputs: 2, outputs: 6 });
    assert_eq!(bench.slave.outputs(), [0; 6]);
    bench.events();
    // One that does not fit ends the exchange.
    bench.ask(2, Some(sap::CHK_CFG), Fcb::Low, &[0x13]);
    assert!(bench.events().contains(&SlaveEvent::LeftDataExchange {
        reason: LeaveReason::ConfigurationRefused
    }));
}

#[test]
fn the_diagnosis_counts_the_places_of_the_configuration() {
    let config = SlaveConfig::new(SLAVE, 0x00DA, &[0x31, 0x00, 0x41, 0x43, 0x07]).unwrap();
    let mut line = Line::new(BAUD, &[config]);
    line.add_slave(modular());
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    // The analogue module stands at octet 2, but it is place 2 of 3.
    let broken = ChannelDiag {
        module: 2,
        direction: Direction::Input,
        channel: 3,
        unit: ChannelUnit::Word,
        error: ChannelError::LINE_BREAK,
    };
    let count = places(line.slaves[0].configuration()).count();
    let mut writer = ExtDiagWriter::new();
    writer.modules(count, |module| module == 2).channel(broken);
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, writer.octets(), writer.overflow())
        .unwrap();
    line.run_for(Duration::from_millis(3));
    let blocks: Vec<_> = line.master.diagnosis(index).unwrap().blocks().collect();
    assert!(
        matches!(blocks[..], [Block::Identifiers(modules), Block::Channel(channel)] if modules.iter().eq([2]) && channel == broken)
    );
    let module = places(&[0x31, 0x00, 0x41, 0x43, 0x07]).nth(2).unwrap().unwrap();
    assert_eq!(module.octets(), [0x41, 0x43, 0x07]);
}
