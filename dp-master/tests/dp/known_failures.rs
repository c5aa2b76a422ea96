//! Failures that other stacks are known for, each with the test that ours does not have it.
//!
//! Others have their place elsewhere: a diagnosis block of length 0 in `dp_diag_blocks.rs`, endless start-up in
//! `dp_answers.rs` and below.

use dp_master::address::Address;
use dp_master::dp::{Configuration, LeaveReason, MasterEvent, Mode, SlaveConfig, SlaveEvent, SlaveState, Watchdog};
use dp_master::time::{Baud, BitTimes, Duration};
use dp_master::wire::{DecodeError, Decoded, Decoder, DiscardReason, FunctionCode, Telegram, decode_one};

use crate::common::bench::{BAUD, Bench};
use crate::common::{Line, SLAVE, slave_identity};

/// Diagnosis request of master 2: 83 + 82 + 6D + 3C + 3E = 1EC.
const REQUEST: [u8; 11] = [0x68, 0x05, 0x05, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0x3E, 0xEC, 0x16];

#[test]
fn the_second_sd2_octet_is_compared() {
    for octet in 0..=u8::MAX {
        let mut telegram = REQUEST;
        telegram[3] = octet;
        let read = decode_one(&telegram);
        let mut bench = Bench::new();
        if octet == 0x68 {
            assert!(read.is_ok());
            assert_eq!(bench.hear(&telegram).len(), 17);
        } else {
            assert!(matches!(read, Err(DecodeError::Corrupt(_))), "{octet:02X}: {read:?}");
            assert_eq!(bench.hear(&telegram), [0u8; 0], "{octet:02X}");
        }
    }
}

#[test]
fn both_lengths_are_compared() {
    let mut telegram = REQUEST;
    telegram[2] = 0x06;
    assert!(matches!(decode_one(&telegram), Err(DecodeError::Corrupt(_))));
    assert_eq!(Bench::new().hear(&telegram), [0u8; 0]);
}

#[test]
fn one_bad_octet_costs_itself_and_not_the_whole_buffer() {
    // Every octet in turn stands before three good telegrams, all in one piece.
    let good = Telegram::no_data(
        Address::new(3).unwrap(),
        Address::new(2).unwrap(),
        FunctionCode::from_octet(0x49),
    );
    for bad in 0..=u8::MAX {
        let mut octets = vec![bad];
        for _ in 0..3 {
            octets.extend([0x10, 0x03, 0x02, 0x49, 0x4E, 0x16]);
        }
        let mut found = 0;
        Decoder::new().push(&octets, |decoded| {
            found += usize::from(matches!(decoded, Decoded::Telegram(telegram) if telegram == good));
        });
        // DC 10 03 is a token: it takes two octets of the first telegram with it.
        let expected = if bad == 0xDC { 2 } else { 3 };
        assert_eq!(found, expected, "{bad:02X}");
    }
}

#[test]
fn bit_times_are_not_rounded_to_microseconds() {
    // 11 bits at 12 Mbit/s are 916.67 ns and must never be 0; at 45.45 kbit/s 242.02 µs.
    assert_eq!(Baud::B12000000.duration(BitTimes(11)), Duration::from_nanos(917));
    assert_eq!(Baud::B12000000.duration(BitTimes(1)), Duration::from_nanos(84));
    let slow = Baud::B45450.duration(BitTimes(11)).as_nanos();
    assert!((242_000..=242_050).contains(&slow), "{slow}");
    for baud in Baud::ALL {
        // 33 bits never take less than their share, and never a nanosecond more than rounding asks for.
        let exact = 33_000_000_000u64.div_ceil(u64::from(baud.bits_per_second()));
        assert_eq!(baud.duration(BitTimes(33)).as_nanos(), exact, "{baud}");
    }
}

#[test]
fn a_configuration_fault_is_told_once_and_tried_again_with_pauses() {
    let mut config = SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap();
    config.configuration = Configuration::new(&[0xF7]).unwrap();
    let mut line = Line::new(BAUD, &[config]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(1_000));
    let events = line.master_events();
    let told = events
        .iter()
        .filter(|event| matches!(event, MasterEvent::ConfigurationRefused { .. }));
    assert_eq!(told.count(), 1, "{events:?}");
    assert_eq!(line.master.state(line.indices[0]), SlaveState::Refused);
    // One start-up per retry interval of 20 ms, and the bus is free in between: four requests each.
    let starts = line
        .tap
        .log
        .iter()
        .filter(|telegram| telegram.starts_with("68 0C 0C 68 83 82"));
    assert!((40..=50).contains(&starts.count()));
    line.assert_no_violations();
}

#[test]
fn clear_and_stop_do_what_they_say() {
    let mut config = SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap();
    config.watchdog = Some(Watchdog::from_factors(1, 5).unwrap());
    let mut line = Line::new(BAUD, &[config]);
    line.add_slave(slave_identity(BAUD));
    let index = line.indices[0];
    line.master.set_outputs(index, &[5; 8]).unwrap();
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(10));
    assert_eq!(line.slaves[0].outputs(), [5; 8]);
    // Clear: exchanged with, zeros, told by Global_Control.
    line.master.set_mode(Mode::Clear);
    let exchanges = line.master.exchanges(index);
    line.run_for(Duration::from_millis(10));
    assert_eq!(line.slaves[0].outputs(), [0; 8]);
    assert!(line.master.exchanges(index) > exchanges);
    assert!(
        line.tap
            .log
            .iter()
            .any(|telegram| telegram == "68 07 07 68 FF 82 46 3A 3E 02 00 41 16")
    );
    // Stop: nothing but tokens and GAP requests, until the watchdog (50 ms) ends the exchange.
    line.master.set_mode(Mode::Stop);
    line.run_for(Duration::from_millis(1));
    let heard = line.tap.log.len();
    line.slave_events(0);
    line.run_for(Duration::from_millis(60));
    assert!(!line.tap.log[heard..].iter().any(|telegram| telegram.starts_with("68")));
    assert!(line.slave_events(0).contains(&SlaveEvent::LeftDataExchange {
        reason: LeaveReason::Watchdog
    }));
    assert_eq!(line.master.state(index), SlaveState::Offline);
}

#[test]
fn a_reason_is_named_for_what_is_discarded() {
    let mut telegram = REQUEST;
    telegram[9] ^= 1;
    assert!(matches!(
        decode_one(&telegram),
        Err(DecodeError::Corrupt(DiscardReason::Checksum { .. }))
    ));
}
