//! Extended diagnosis, block by block. Expected octets and meanings: IEC 61158-6-3, coding of Ext_Diag_Data; the table
//! of channel errors also in the Omron CS1W-PRM21 manual, appendix.

use dp_master::dp::{
    Block, BlockFault, Blocks, ChannelDiag, ChannelError, ChannelUnit, Diagnosis, Direction, ExtDiag, ExtDiagError,
    ExtDiagWriter, MAX_EXT_DIAG, MasterEvent, Mode, ModuleState, Overflow, SlaveConfig, StationStatus, module_states,
    sap,
};
use dp_master::time::Duration;
use dp_master::wire::Fcb;
use proptest::prelude::*;

use crate::common::bench::{BAUD, Bench};
use crate::common::{Line, SLAVE, slave_identity};

fn blocks(octets: &[u8]) -> Vec<Block<'_>> {
    Blocks::new(octets).collect()
}

#[test]
fn a_modular_station_names_its_module_and_the_broken_channel() {
    // What an ET 200 with a wire break at channel 2 of its fifth module tells: module bits, then the channel.
    let octets = [0x44, 0x10, 0x00, 0x00, 0x84, 0x42, 0xA6];
    let all = blocks(&octets);
    let [Block::Identifiers(modules), Block::Channel(channel)] = all[..] else {
        panic!("{all:?}");
    };
    assert!(modules.iter().eq([4]));
    assert!(modules.contains(4) && !modules.contains(3) && !modules.contains(1_000));
    assert_eq!(
        channel,
        ChannelDiag {
            module: 4,
            direction: Direction::Input,
            channel: 2,
            unit: ChannelUnit::Word,
            error: ChannelError::LINE_BREAK,
        }
    );
    assert_eq!(channel.error.text(), Some("line break"));
}

#[test]
fn every_kind_of_block_is_told_apart() {
    let octets = [0x42, 0x05, 0x81, 0x43, 0x67, 0xC7, 0x02, 0xAA];
    let all = blocks(&octets);
    assert_eq!(all.len(), 4);
    assert!(matches!(all[0], Block::Identifiers(modules) if modules.iter().eq([0, 2])));
    assert!(matches!(all[1], Block::Channel(channel) if channel.error == ChannelError::UPPER_LIMIT));
    assert_eq!(all[2], Block::Revision(7));
    assert_eq!(all[3], Block::Device(&[0xAA]));
}

#[test]
fn directions_units_and_errors_have_the_codes_and_texts_of_the_standard() {
    let read = |channel, error| match blocks(&[0x80, channel, error])[..] {
        [Block::Channel(channel)] => channel,
        ref other => panic!("{other:?}"),
    };
    let directions = [0x00, 0x40, 0x80, 0xC0].map(|octet| read(octet, 0).direction);
    assert_eq!(
        directions,
        [
            Direction::Reserved,
            Direction::Input,
            Direction::Output,
            Direction::InputOutput
        ]
    );
    let units: Vec<_> = (0..8).map(|code| read(0, code << 5).unit.text()).collect();
    assert_eq!(
        units,
        [
            "reserved", "bit", "2 bit", "4 bit", "byte", "word", "2 words", "reserved"
        ]
    );
    let texts: Vec<_> = (1..=9).map(|code| read(0, code).error.text().unwrap()).collect();
    assert_eq!(
        texts,
        [
            "short circuit",
            "undervoltage",
            "overvoltage",
            "overload",
            "overtemperature",
            "line break",
            "upper limit value exceeded",
            "lower limit value exceeded",
            "error",
        ]
    );
    for code in [0, 10, 15] {
        assert_eq!(read(0, code).error.text(), None);
        assert!(!read(0, code).error.is_manufacturer_specific());
    }
    for code in [16, 31] {
        assert_eq!(read(0, code).error.text(), None);
        assert!(read(0, code).error.is_manufacturer_specific());
    }
}

#[test]
fn every_channel_block_survives_reading_and_writing() {
    for first in 0x80..=0xBF {
        for rest in (0..=u16::MAX).step_by(7).map(u16::to_be_bytes) {
            let octets = [first, rest[0], rest[1]];
            assert_eq!(ChannelDiag::from_octets(octets).octets(), octets);
        }
    }
}

#[test]
fn a_diagnosis_block_of_length_zero_ends_the_division_and_is_named() {
    // Known failure of peers: an endless loop, or an index out of range.
    for header in [0x00, 0x40] {
        let octets = [header, 0x81, 0x00, 0x01];
        assert_eq!(
            blocks(&octets),
            [Block::Malformed {
                fault: BlockFault::LengthZero { header },
                octets: &octets,
            }]
        );
    }
}

#[test]
fn a_block_longer_than_the_diagnosis_is_named_with_both_lengths() {
    let octets = [0xC1, 0x05, 0x01, 0x02];
    assert_eq!(
        blocks(&octets),
        [
            Block::Revision(1),
            Block::Malformed {
                fault: BlockFault::Truncated {
                    header: 0x05,
                    expected: 5,
                    got: 3
                },
                octets: &octets[1..],
            }
        ]
    );
    assert!(matches!(
        blocks(&[0x81, 0x43])[..],
        [Block::Malformed {
            fault: BlockFault::Truncated {
                expected: 3,
                got: 2,
                ..
            },
            ..
        }]
    ));
}

#[test]
fn the_standard_octets_alone_have_no_blocks() {
    let diagnosis = Diagnosis::parse(&[0x00, 0x0C, 0x00, 0x02, 0x00, 0xDA]).unwrap();
    assert_eq!(diagnosis.blocks().count(), 0);
}

#[test]
fn module_states_stand_four_to_an_octet_the_first_lowest() {
    // Valid, error, wrong, none; then the fifth.
    let states: Vec<_> = module_states(&[0b11_10_01_00, 0b00_00_00_11]).take(5).collect();
    assert_eq!(
        states,
        [
            ModuleState::Valid,
            ModuleState::Error,
            ModuleState::WrongModule,
            ModuleState::NoModule,
            ModuleState::NoModule,
        ]
    );
}

#[test]
fn a_slave_writes_its_blocks_and_the_master_reads_them() {
    let channel = ChannelDiag {
        module: 1,
        direction: Direction::Output,
        channel: 0,
        unit: ChannelUnit::Bit,
        error: ChannelError::SHORT_CIRCUIT,
    };
    let mut writer = ExtDiagWriter::new();
    writer
        .device(&[0x32, 0x10])
        .modules(10, |module| module == 1 || module == 9)
        .channel(channel)
        .revision(3);
    assert_eq!(
        writer.octets(),
        [0x03, 0x32, 0x10, 0x43, 0x02, 0x02, 0x81, 0x80, 0x21, 0xC3]
    );

    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, writer.octets(), writer.overflow())
        .unwrap();
    line.run_for(Duration::from_millis(5));
    let diagnosis = line.master.diagnosis(index).unwrap();
    let read: Vec<_> = diagnosis.blocks().collect();
    assert_eq!(read, blocks(writer.octets()));
    assert_eq!(read[2], Block::Channel(channel));
    line.assert_no_violations();
}

#[test]
fn what_does_not_fit_is_announced_as_overflow() {
    let mut writer = ExtDiagWriter::with_limit(7);
    writer.device(&[1, 2, 3]).device(&[4, 5]).revision(1);
    assert_eq!(writer.octets(), [0x04, 1, 2, 3, 0x03, 4, 5]);
    assert_eq!(writer.overflow(), Overflow::Truncated);

    let mut bench = Bench::owned_by(2);
    bench
        .slave
        .set_ext_diag(ExtDiag::Fault, writer.octets(), writer.overflow())
        .unwrap();
    let reply = bench.ask(2, Some(sap::SLAVE_DIAG), Fcb::First, &[]);
    // Ext_Diag in octet 1, Ext_Diag_Overflow in octet 3.
    assert_eq!(reply[9..12], [0x08, 0x04, 0x80]);
    let diagnosis = Diagnosis::parse(&reply[9..reply.len() - 2]).unwrap();
    assert_eq!(diagnosis.standard.overflow(), Overflow::Truncated);
}

#[test]
fn a_device_block_holds_62_octets_and_the_whole_238() {
    let content = [0; 63];
    let mut writer = ExtDiagWriter::new();
    writer.device(&content);
    assert_eq!((writer.octets(), writer.overflow()), (&[][..], Overflow::Truncated));
    let mut writer = ExtDiagWriter::new();
    for _ in 0..3 {
        writer.device(&content[..62]);
    }
    // 189 octets; 49 are left.
    writer.device(&content[..48]);
    assert_eq!(
        (writer.octets().len(), writer.overflow()),
        (MAX_EXT_DIAG, Overflow::Complete)
    );
    writer.revision(0);
    assert_eq!(
        (writer.octets().len(), writer.overflow()),
        (MAX_EXT_DIAG, Overflow::Truncated)
    );
}

#[test]
fn a_slave_sends_no_block_that_nobody_can_read() {
    let mut bench = Bench::new();
    let zero = bench
        .slave
        .set_ext_diag(ExtDiag::Fault, &[0x00, 0x01], Overflow::Complete);
    assert_eq!(zero, Err(ExtDiagError::Block(BlockFault::LengthZero { header: 0 })));
    let long = bench
        .slave
        .set_ext_diag(ExtDiag::Fault, &[0xC0; 239], Overflow::Complete);
    assert_eq!(long, Err(ExtDiagError::TooLong { got: 239 }));
    let reply = bench.ask(2, Some(sap::SLAVE_DIAG), Fcb::First, &[]);
    assert_eq!(reply[9..15], [0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA]);
}

#[test]
fn a_master_survives_a_peer_with_a_block_of_length_zero() {
    // The slave itself refuses to send one, so its telegram is replaced on the line: header 03 of the fault code
    // becomes 00.
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.master_events();
    let other = line.bus.attach();
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, &[0x03, 0x32, 0x10], Overflow::Complete)
        .unwrap();
    let heard = line.tap.log.len();
    line.run_until(|line| {
        line.tap.log[heard..]
            .iter()
            .any(|telegram| telegram.starts_with("68 05 05 68 83 82") && telegram.ends_with("16"))
    });
    line.bus.disconnect(line.slave_ports[0]);
    // Ext_Diag, master 2, ident 00DA; then the block whose header gives a length of 0.
    let reply = [
        0x68, 0x0E, 0x0E, 0x68, 0x82, 0x83, 0x08, 0x3E, 0x3C, 0x08, 0x04, 0x00, 0x02, 0x00, 0xDA, 0x00, 0x32, 0x10,
    ];
    let fcs = reply[4..].iter().fold(0u8, |sum, octet| sum.wrapping_add(*octet));
    let mut telegram = reply.to_vec();
    telegram.extend([fcs, 0x16]);
    let at = line.now + BAUD.characters(1);
    line.run_for(at - line.now);
    line.bus.transmit(line.now, other, &telegram);
    line.run_until(|line| {
        line.master
            .diagnosis(index)
            .is_some_and(|diagnosis| diagnosis.extended.len() == 3)
    });
    line.bus.reconnect(line.slave_ports[0]);
    line.run_for(Duration::from_millis(2));
    assert!(
        line.master_events()
            .iter()
            .any(|event| matches!(event, MasterEvent::Diagnosis { diagnosis, .. } if diagnosis.status.contains(StationStatus::EXT_DIAG)))
    );
    let diagnosis = line.master.diagnosis(index).unwrap();
    assert!(matches!(
        diagnosis.blocks().collect::<Vec<_>>()[..],
        [Block::Malformed {
            fault: BlockFault::LengthZero { header: 0 },
            ..
        }]
    ));
    // The exchange goes on.
    let before = line.master.exchanges(index);
    line.run_for(Duration::from_millis(2));
    assert!(line.master.exchanges(index) > before);
}

proptest! {
    /// Whatever a peer sends: the division ends, every octet is in one block, and only the last can be malformed.
    #[test]
    fn every_extended_diagnosis_is_divided_without_loss(octets in prop::collection::vec(any::<u8>(), 0..=MAX_EXT_DIAG)) {
        let all = blocks(&octets);
        let mut sum = 0;
        for (place, block) in all.iter().enumerate() {
            sum += match block {
                Block::Device(content) => 1 + content.len(),
                Block::Identifiers(modules) => 1 + modules.octets().len(),
                Block::Channel(_) => 3,
                Block::Revision(_) => 1,
                Block::Malformed { octets, .. } => {
                    prop_assert_eq!(place, all.len() - 1);
                    octets.len()
                }
            };
        }
        prop_assert_eq!(sum, octets.len());
    }
}
