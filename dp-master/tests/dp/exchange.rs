//! Cyclic exchange: modes, Global_Control, lengths, and the time of a cycle at every baud rate.

use dp_master::address::Address;
use dp_master::dp::{
    ClearOutputs, ControlCommand, GlobalControl, MasterConfig, Mode, SlaveConfig, SlaveEvent, SlaveState, StationStatus,
};
use dp_master::fdl::BusParams;
use dp_master::time::{Baud, Duration};

use crate::common::{Line, MASTER, SLAVE, slave_identity};

/// The thesis: two blocks of eight octets each way.
fn thesis() -> SlaveConfig {
    let mut config = SlaveConfig::new(SLAVE, 0x00DA, &[0xF3, 0xF3]).unwrap();
    config.group = 0x01;
    config
}

fn exchanging(config: SlaveConfig, mode: Mode) -> Line {
    let mut line = Line::new(Baud::B1500000, &[config]);
    line.add_slave(slave_identity(Baud::B1500000));
    line.master.set_mode(mode);
    let lengths = config.configuration.lengths();
    line.master
        .set_outputs(line.indices[0], &vec![5; lengths.outputs])
        .unwrap();
    more(&mut line, 5);
    line.slave_events(0);
    line
}

fn more(line: &mut Line, exchanges: u64) {
    let slave = line.indices[0];
    let goal = line.master.exchanges(slave) + exchanges;
    line.run_until(|line| line.master.exchanges(slave) == goal);
}

#[test]
fn a_cycle_is_the_sum_of_its_telegrams_and_pauses_at_every_baud_rate() {
    for baud in Baud::ALL {
        let params = BusParams::standard(baud);
        let mut line = Line::new(baud, &[thesis()]);
        line.add_slave(slave_identity(baud));
        line.master.set_mode(Mode::Operate);
        more(&mut line, 10);
        let statistics = line.master.statistics();
        // Request and reply of 16 octets have 25 characters (9300 facts 1.6). A master alone keeps the token.
        let exchange = 25 * 11 + 11 + 25 * 11;
        let cycle = exchange + params.t_id1.0;
        let near = |measured: Duration, bits: u32| {
            let bits = f64::from(bits);
            let measured = measured.as_nanos() as f64 * f64::from(baud.bits_per_second()) / 1e9;
            assert!(
                (measured / bits - 1.0).abs() < 0.02,
                "{baud}: {measured} tBIT for {bits}"
            );
        };
        near(statistics.last_cycle, cycle);
        near(statistics.last_exchange, exchange);
        assert_eq!(
            (statistics.retries, statistics.timeouts, statistics.discarded),
            (0, 0, 0)
        );
        line.assert_no_violations();
    }
}

#[test]
fn an_exchange_of_the_thesis_takes_55_microseconds_at_12_mbit() {
    // 9300 facts 1.6: about 655 tBIT = 55 µs with Tid1.
    let mut line = Line::new(Baud::B12000000, &[thesis()]);
    line.add_slave(slave_identity(Baud::B12000000));
    line.master.set_mode(Mode::Operate);
    more(&mut line, 10);
    let with_tid1 = line.master.statistics().last_exchange.as_nanos() + 76 * 1000 / 12;
    assert!((52_000..56_000).contains(&with_tid1), "{with_tid1} ns");
}

#[test]
fn the_least_cycle_time_is_kept_to_the_nanosecond() {
    let mut config = MasterConfig::new(MASTER, BusParams::standard(Baud::B12000000));
    config.min_cycle = Duration::from_millis(2);
    let mut line = Line::with_config(config, &[thesis()]);
    line.add_slave(slave_identity(Baud::B12000000));
    line.master.set_mode(Mode::Operate);
    more(&mut line, 20);
    let statistics = line.master.statistics();
    assert_eq!(statistics.last_cycle, Duration::from_millis(2));
    assert_eq!(statistics.mean_cycle, Duration::from_millis(2));
    line.assert_no_violations();
}

#[test]
fn the_interval_of_a_slave_is_respected() {
    let mut config = thesis();
    config.min_slave_interval = Duration::from_millis(3);
    let mut line = exchanging(config, Mode::Operate);
    let heard = line.tap.log.len();
    more(&mut line, 4);
    let starts: Vec<_> = (heard..line.tap.log.len())
        .filter(|&place| line.tap.log[place].starts_with("68 13 13 68 03 02"))
        .map(|place| line.tap.times[place])
        .collect();
    assert!(starts.len() >= 4);
    for pair in starts.windows(2) {
        assert!(pair[1] - pair[0] >= config.min_slave_interval);
        assert!(pair[1] - pair[0] < Duration::from_micros(3_300));
    }
    line.assert_no_violations();
}

#[test]
fn clear_sends_zeros_and_operate_the_outputs() {
    let mut line = exchanging(thesis(), Mode::Operate);
    assert_eq!(line.slaves[0].outputs(), [5; 16]);
    line.master.set_mode(Mode::Clear);
    more(&mut line, 3);
    assert_eq!(line.slaves[0].outputs(), [0; 16]);
    assert!(line.slave_events(0).contains(&SlaveEvent::OutputsCleared));
    assert!(
        line.tap
            .log
            .contains(&"68 07 07 68 FF 82 46 3A 3E 02 00 41 16".to_owned())
    );
    line.master.set_mode(Mode::Operate);
    more(&mut line, 3);
    assert_eq!(line.slaves[0].outputs(), [5; 16]);
    line.assert_no_violations();
}

#[test]
fn a_slave_with_fail_safe_gets_empty_telegrams_in_clear() {
    let mut config = thesis();
    config.clear_outputs = ClearOutputs::Empty;
    let mut line = exchanging(config, Mode::Operate);
    line.master.set_mode(Mode::Clear);
    more(&mut line, 3);
    assert_eq!(line.slaves[0].outputs(), [0; 16]);
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    // SD1 to the slave with Data_Exchange: no data, FC 5D or 7D.
    assert!(line.tap.log.iter().any(|t| t.starts_with("10 03 02 5D")));
    line.assert_no_violations();
}

#[test]
fn sync_holds_the_outputs_until_the_next_sync_or_unsync() {
    let mut line = exchanging(thesis(), Mode::Operate);
    let slave = line.indices[0];
    let send = |line: &mut Line, command| {
        line.master
            .send_control(GlobalControl {
                command,
                group_select: 0x01,
            })
            .unwrap();
        more(line, 3);
    };
    send(&mut line, ControlCommand::SYNC);
    line.master.set_outputs(slave, &[6; 16]).unwrap();
    more(&mut line, 3);
    assert_eq!(line.slaves[0].outputs(), [5; 16]);
    let status = line.slaves[0].diagnosis().status;
    assert!(status.contains(StationStatus::SYNC_MODE));
    send(&mut line, ControlCommand::SYNC);
    assert_eq!(line.slaves[0].outputs(), [6; 16]);
    line.master.set_outputs(slave, &[7; 16]).unwrap();
    more(&mut line, 3);
    assert_eq!(line.slaves[0].outputs(), [6; 16]);
    send(&mut line, ControlCommand::UNSYNC);
    assert_eq!(line.slaves[0].outputs(), [7; 16]);
    line.assert_no_violations();
}

#[test]
fn freeze_holds_the_inputs_and_unfreeze_frees_them() {
    let mut line = exchanging(thesis(), Mode::Operate);
    let slave = line.indices[0];
    line.slaves[0].set_inputs(&[1; 16]);
    more(&mut line, 2);
    for (command, expected) in [
        (ControlCommand::FREEZE, 1),
        (ControlCommand::FREEZE, 2),
        (ControlCommand::UNFREEZE, 3),
    ] {
        line.master
            .send_control(GlobalControl {
                command,
                group_select: 0,
            })
            .unwrap();
        more(&mut line, 3);
        line.slaves[0].set_inputs(&[expected + 1; 16]);
        more(&mut line, 2);
        let seen = line.master.inputs(slave)[0];
        let frozen = command == ControlCommand::FREEZE;
        assert_eq!(seen, if frozen { expected } else { expected + 1 });
    }
    line.assert_no_violations();
}

#[test]
fn a_command_for_another_group_is_not_obeyed() {
    let mut line = exchanging(thesis(), Mode::Operate);
    line.master
        .send_control(GlobalControl {
            command: ControlCommand::CLEAR_DATA,
            group_select: 0x02,
        })
        .unwrap();
    more(&mut line, 3);
    assert!(!line.slave_events(0).contains(&SlaveEvent::OutputsCleared));
}

#[test]
fn outputs_only_and_inputs_only_slaves_are_exchanged_with() {
    // 0x20: one octet out, the reply is E5; 0x10: one octet in, the request is empty.
    for identifiers in [[0x20], [0x10]] {
        let config = SlaveConfig::new(SLAVE, 0x00DA, &identifiers).unwrap();
        let mut line = exchanging(config, Mode::Operate);
        line.slaves[0].set_inputs(&[0x42]);
        more(&mut line, 3);
        if identifiers == [0x20] {
            assert_eq!(line.slaves[0].outputs(), [5]);
        } else {
            assert_eq!(line.master.inputs(line.indices[0]), [0x42]);
        }
        line.assert_no_violations();
    }
}

#[test]
fn outputs_of_another_length_than_configured_are_refused() {
    let mut line = exchanging(thesis(), Mode::Operate);
    let error = line.master.set_outputs(line.indices[0], &[1; 15]).unwrap_err();
    assert_eq!((error.expected, error.got), (16, 15));
}

#[test]
fn the_same_run_gives_the_same_telegrams_at_the_same_times() {
    let run = || {
        let mut line = exchanging(thesis(), Mode::Operate);
        more(&mut line, 20);
        (line.tap.log, line.tap.times)
    };
    assert_eq!(run(), run());
}

#[test]
fn eight_slaves_are_served_in_the_order_of_adding() {
    let address = |value| Address::new(value).unwrap();
    let configs: Vec<_> = (10..18)
        .map(|value| SlaveConfig::new(address(value), 0x00DA, &[0xF3]).unwrap())
        .collect();
    let mut line = Line::new(Baud::B12000000, &configs);
    for value in 10..18 {
        let mut identity = slave_identity(Baud::B12000000);
        identity.address = address(value);
        line.add_slave(identity);
    }
    line.master.set_mode(Mode::Operate);
    more(&mut line, 5);
    assert!(
        line.indices
            .iter()
            .all(|&slave| line.master.state(slave) == SlaveState::DataExchange)
    );
    let heard = line.tap.log.len();
    more(&mut line, 1);
    let order: Vec<_> = line.tap.log[heard..]
        .iter()
        .filter(|telegram| telegram.starts_with("68 0B 0B 68") && telegram[15..17] == *"02")
        .map(|telegram| u8::from_str_radix(&telegram[12..14], 16).unwrap())
        .collect();
    assert_eq!(order[order.len() - 8..], [11, 12, 13, 14, 15, 16, 17, 10]);
    line.assert_no_violations();
}
