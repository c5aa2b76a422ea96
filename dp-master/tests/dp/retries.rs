//! Lost, spoiled and missing telegrams: repetitions, the frame count bit, other slaves.

use dp_master::address::Address;
use dp_master::dp::{LossCause, MasterEvent, Mode, SlaveConfig, SlaveState};
use dp_master::phy::Script;
use dp_master::station::LineError;
use dp_master::time::{Baud, Duration};

use crate::common::{self, Line, SLAVE, slave_identity};

fn one_block(address: Address) -> SlaveConfig {
    SlaveConfig::new(address, 0x00DA, &[0xF3]).unwrap()
}

/// A line in data exchange, at the moment before a Data_Exchange request; bursts per cycle: request, reply.
fn exchanging(baud: Baud) -> Line {
    let mut line = Line::new(baud, &[one_block(SLAVE)]);
    line.add_slave(slave_identity(baud));
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 5);
    line
}

/// The burst that follows is the request.
const REQUEST: u64 = 0;
const REPLY: u64 = 1;

fn data_exchanges(line: &Line, from: usize) -> Vec<&str> {
    line.tap.log[from..]
        .iter()
        .map(String::as_str)
        .filter(|telegram| telegram.starts_with("68 0B 0B 68 03 02"))
        .collect()
}

#[test]
fn a_lost_request_is_repeated_with_the_same_frame_count_bit() {
    let mut line = exchanging(Baud::B1500000);
    let next = line.bus.bursts();
    line.bus.script(Script::Drop { burst: next + REQUEST });
    let heard = line.tap.log.len();
    let before = line.master.statistics();
    let exchanges = line.slaves[0].statistics().exchanges;
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 7);
    let after = line.master.statistics();
    assert_eq!(after.retries - before.retries, 1);
    assert_eq!(after.timeouts - before.timeouts, 1);
    assert_eq!(line.slaves[0].statistics().exchanges - exchanges, 2);
    // The tap did not hear the lost one. Five exchanges went before: 7D 5D 7D 5D 7D; now 5D, then 7D.
    let fcs: Vec<_> = data_exchanges(&line, heard)
        .iter()
        .map(|telegram| &telegram[18..20])
        .collect();
    assert_eq!(fcs, ["5D", "7D"]);
    line.assert_no_violations();
}

#[test]
fn after_a_lost_reply_the_outputs_are_applied_once() {
    let mut line = exchanging(Baud::B1500000);
    let next = line.bus.bursts();
    line.bus.script(Script::Drop { burst: next + REPLY });
    let heard = line.tap.log.len();
    let retries = line.master.statistics().retries;
    let before = line.slaves[0].statistics();
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 6);
    let after = line.slaves[0].statistics();
    assert_eq!(line.master.statistics().retries - retries, 1);
    assert_eq!(after.exchanges - before.exchanges, 1);
    assert_eq!(after.fdl.repetitions - before.fdl.repetitions, 1);
    let sent = data_exchanges(&line, heard);
    assert_eq!(sent.len(), 2);
    assert_eq!(sent[0], sent[1], "a repetition is the same telegram");
    line.assert_no_violations();
}

#[test]
fn a_repetition_follows_the_slot_time() {
    let mut line = exchanging(Baud::B1500000);
    let next = line.bus.bursts();
    line.bus.script(Script::Drop { burst: next + REPLY });
    let heard = line.tap.log.len();
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 6);
    let times = &line.tap.times[heard..];
    let sent: Vec<_> = line.tap.log[heard..]
        .iter()
        .zip(times)
        .filter(|(telegram, _)| telegram.starts_with("68 0B 0B 68 03 02"))
        .map(|(_, at)| *at)
        .collect();
    // Seventeen characters and Tsl = 300 tBIT: 487 tBIT = 324.667 µs at 1.5 Mbit/s.
    let gap = (sent[1] - sent[0]).as_nanos();
    assert!((324_660..324_680).contains(&gap), "{gap} ns");
}

#[test]
fn every_spoiled_character_of_a_reply_costs_one_repetition_and_nothing_else() {
    for baud in [Baud::B9600, Baud::B1500000, Baud::B12000000] {
        for character in 0..17 {
            for error in [LineError::Parity, LineError::Framing] {
                let mut line = exchanging(baud);
                let next = line.bus.bursts();
                line.bus.script(Script::Spoil {
                    burst: next + REPLY,
                    character,
                    error,
                });
                let retries = line.master.statistics().retries;
                line.run_until(|line| line.master.exchanges(line.indices[0]) == 7);
                assert_eq!(line.master.statistics().retries - retries, 1);
                assert_eq!(line.slaves[0].statistics().fdl.repetitions, 1);
                line.assert_no_violations();
            }
        }
    }
}

#[test]
fn every_spoiled_character_of_a_request_costs_one_repetition_and_nothing_else() {
    for baud in [Baud::B9600, Baud::B1500000, Baud::B12000000] {
        for character in 0..17 {
            let mut line = exchanging(baud);
            let next = line.bus.bursts();
            line.bus.script(Script::Spoil {
                burst: next + REQUEST,
                character,
                error: LineError::Parity,
            });
            let retries = line.master.statistics().retries;
            line.run_until(|line| line.master.exchanges(line.indices[0]) == 7);
            assert_eq!(line.master.statistics().retries - retries, 1);
            assert_eq!(line.slaves[0].statistics().fdl.repetitions, 0);
            line.assert_no_violations();
        }
    }
}

#[test]
fn two_flipped_bits_that_pass_the_parity_are_caught_by_the_telegram() {
    // Each character of the reply in turn, data bits 1 and 3.
    for character in 0..17 {
        let mut line = exchanging(Baud::B1500000);
        line.slaves[0].set_inputs(&[9; 8]);
        line.run_until(|line| line.master.exchanges(line.indices[0]) == 8);
        let next = line.bus.bursts();
        line.bus.script(Script::Flip {
            burst: next + REPLY,
            character,
            bits: 0b1010,
        });
        line.run_until(|line| line.master.exchanges(line.indices[0]) == 9);
        assert_eq!(line.master.inputs(line.indices[0]), [9; 8]);
        assert_eq!(line.master.statistics().retries, 1, "character {character}");
        line.assert_no_violations();
    }
}

#[test]
fn a_slave_that_falls_silent_is_lost_after_the_retry_limit() {
    // Retry limit 1 at 1.5 Mbit/s: the request and one repetition.
    let mut line = exchanging(Baud::B1500000);
    line.master_events();
    let port = line.slave_ports[0];
    line.bus.disconnect(port);
    let heard = line.tap.log.len();
    let slave = line.indices[0];
    line.run_until(|line| line.master.state(slave) == SlaveState::Offline);
    assert_eq!(data_exchanges(&line, heard).len(), 2);
    assert_eq!(
        line.master_events(),
        [MasterEvent::SlaveLost {
            slave,
            cause: LossCause::NoAnswer
        }]
    );
    // Back on the line it is started again, with first contact (6D).
    line.bus.reconnect(port);
    let heard = line.tap.log.len();
    line.run_until(|line| line.master.state(slave) == SlaveState::DataExchange);
    assert!(
        line.tap.log[heard..]
            .iter()
            .any(|telegram| telegram.starts_with("68 05 05 68 83 82 6D"))
    );
    line.assert_no_violations();
}

#[test]
fn a_silent_slave_does_not_stop_the_others() {
    let silent = Address::new(9).unwrap();
    let mut line = Line::new(Baud::B1500000, &[one_block(silent), one_block(SLAVE)]);
    line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(100));
    assert_eq!(line.master.state(line.indices[0]), SlaveState::Offline);
    assert_eq!(line.master.state(line.indices[1]), SlaveState::DataExchange);
    // A cycle of one slave takes about 0.35 ms, an attempt at the silent one 0.29 ms every 20 ms.
    assert!(line.master.exchanges(line.indices[1]) > 250);
    let attempts = line
        .tap
        .log
        .iter()
        .filter(|telegram| telegram.starts_with("68 05 05 68 89"))
        .count();
    assert!((4..=6).contains(&attempts), "{attempts}");
    line.assert_no_violations();
}

#[test]
fn without_latency_allowance_the_token_is_not_missed_in_a_long_pause() {
    // min_cycle 5 ms at 1.5 Mbit/s: 6·Tsl is 1.2 ms, so station 0 must hear something in between.
    let mut config =
        dp_master::dp::MasterConfig::new(common::MASTER, dp_master::fdl::BusParams::standard(Baud::B1500000));
    config.min_cycle = Duration::from_millis(5);
    let mut line = Line::with_config(config, &[one_block(SLAVE)]);
    line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(100));
    let limit = Duration::from_micros(1_200);
    // From the end of the listening on.
    let gaps = line.tap.times.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(gaps.max().unwrap() < limit);
    assert_eq!(line.master.statistics().last_cycle, config.min_cycle);
    line.assert_no_violations();
}
