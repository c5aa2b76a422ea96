//! Global_Control: modes told to all, commands to groups, and what a slave does that cannot obey.

use dp_master::address::Address;
use dp_master::dp::{
    ControlCommand, ControlError, Demand, GlobalControl, MasterConfig, MasterEvent, Mode, SlaveConfig, SlaveIdentity,
    StationStatus, Support, sap,
};
use dp_master::fdl::BusParams;
use dp_master::time::Duration;
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, Telegram};

use crate::common::bench::{BAUD, Bench};
use crate::common::{Line, MASTER, SLAVE, slave_identity};

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

fn in_group(value: u8, group: u8) -> SlaveConfig {
    let mut config = SlaveConfig::new(address(value), 0x00DA, &[0xF3]).unwrap();
    config.group = group;
    config.sync = Demand::Yes;
    config.freeze = Demand::Yes;
    config
}

/// Slaves 3 in group 1 and 4 in group 2, exchanging.
fn two_groups() -> Line {
    let mut line = Line::new(BAUD, &[in_group(3, 0x01), in_group(4, 0x02)]);
    for value in [3, 4] {
        line.add_slave(SlaveIdentity {
            address: address(value),
            ..slave_identity(BAUD)
        });
    }
    line.master.set_mode(Mode::Operate);
    line.run_until(|line| line.indices.iter().all(|index| line.master.exchanges(*index) > 3));
    line
}

fn set_outputs(line: &mut Line, value: u8) {
    for place in 0..2 {
        let index = line.indices[place];
        line.master.set_outputs(index, &[value; 8]).unwrap();
    }
    line.run_for(Duration::from_millis(3));
}

fn outputs(line: &Line) -> [u8; 2] {
    [0, 1].map(|slave| line.slaves[slave].outputs()[0])
}

fn command(command: ControlCommand, group_select: u8) -> GlobalControl {
    GlobalControl { command, group_select }
}

/// Global_Controls on the line: command and group.
fn controls(line: &Line, from: usize) -> Vec<String> {
    line.tap.log[from..]
        .iter()
        .filter(|telegram| telegram.starts_with("68 07 07 68 FF 82 46 3A 3E"))
        .map(|telegram| telegram[27..32].to_owned())
        .collect()
}

#[test]
fn sync_reaches_its_group_alone_and_unsync_frees_it() {
    let mut line = two_groups();
    set_outputs(&mut line, 1);
    line.master.send_control(command(ControlCommand::SYNC, 0x01)).unwrap();
    line.run_for(Duration::from_millis(3));
    set_outputs(&mut line, 2);
    assert_eq!(outputs(&line), [1, 2]);
    line.master.send_control(command(ControlCommand::UNSYNC, 0x01)).unwrap();
    line.run_for(Duration::from_millis(3));
    assert_eq!(outputs(&line), [2, 2]);
    line.assert_no_violations();
}

#[test]
fn commands_given_at_once_go_out_one_a_cycle_in_their_order() {
    let mut line = two_groups();
    let heard = line.tap.log.len();
    line.master.send_control(command(ControlCommand::SYNC, 0x01)).unwrap();
    line.master.send_control(command(ControlCommand::FREEZE, 0x02)).unwrap();
    line.run_for(Duration::from_millis(5));
    assert_eq!(controls(&line, heard), ["20 01", "08 02"]);
    let cycles = line.tap.log[heard..].split(|telegram| telegram.starts_with("68 0B 0B 68 03 02"));
    for cycle in cycles {
        assert!(
            cycle
                .iter()
                .filter(|telegram| telegram.starts_with("68 07 07 68 FF"))
                .count()
                <= 1
        );
    }
    let status = |slave: usize| line.slaves[slave].diagnosis().status;
    assert!(status(0).contains(StationStatus::SYNC_MODE) && !status(0).intersects(StationStatus::FREEZE_MODE));
    assert!(status(1).contains(StationStatus::FREEZE_MODE) && !status(1).intersects(StationStatus::SYNC_MODE));
}

#[test]
fn a_command_to_a_group_does_not_replace_the_clear_to_all() {
    let mut line = two_groups();
    let heard = line.tap.log.len();
    line.master.set_mode(Mode::Clear);
    line.master.send_control(command(ControlCommand::FREEZE, 0x01)).unwrap();
    line.run_for(Duration::from_millis(5));
    // In Clear every command carries Clear_Data: 08 + 02.
    assert_eq!(controls(&line, heard), ["02 00", "0A 01"]);
}

#[test]
fn a_mode_that_changes_while_the_old_one_is_told_is_told_too() {
    let mut line = two_groups();
    line.master.set_mode(Mode::Clear);
    let heard = line.tap.log.len();
    // The first characters of the Clear are on the line.
    line.run_until(|line| {
        line.tap.log[heard..].iter().any(|telegram| {
            telegram.starts_with("68")
                && telegram.split(' ').nth(4).is_none_or(|da| da == "FF")
                && line.tap.log.last().unwrap() == telegram
                && telegram.len() < 38
        })
    });
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(5));
    assert_eq!(controls(&line, heard).last().map(String::as_str), Some("00 00"));
    set_outputs(&mut line, 7);
    assert_eq!(outputs(&line), [7, 7]);
}

#[test]
fn a_slave_that_comes_while_the_outputs_are_cleared_is_told() {
    let mut line = two_groups();
    line.master.set_mode(Mode::Clear);
    line.bus.disconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(10));
    let heard = line.tap.log.len();
    line.bus.reconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(50));
    assert_eq!(controls(&line, heard), ["02 00"]);
}

#[test]
fn the_mode_is_told_again_and_again_when_asked_for() {
    let mut config = MasterConfig::new(MASTER, BusParams::standard(BAUD));
    config.announce_mode = Some(Duration::from_millis(10));
    let mut line = Line::with_config(config, &[in_group(3, 0)]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    let heard = line.tap.log.len();
    line.run_for(Duration::from_millis(100));
    let told = controls(&line, heard);
    // Every 10 ms and at most one cycle of 0.4 ms later.
    assert!((9..=10).contains(&told.len()), "{told:?}");
    assert!(told.iter().all(|control| control == "00 00"));
    line.assert_no_violations();
}

#[test]
fn in_stop_and_with_a_full_queue_a_command_is_refused() {
    let mut line = two_groups();
    let sync = command(ControlCommand::SYNC, 0);
    for _ in 0..8 {
        line.master.send_control(sync).unwrap();
    }
    assert_eq!(line.master.send_control(sync), Err(ControlError::Full));
    line.master.set_mode(Mode::Stop);
    assert_eq!(line.master.send_control(sync), Err(ControlError::Stopped));
    let heard = line.tap.log.len();
    line.run_for(Duration::from_millis(10));
    assert_eq!(controls(&line, heard).len(), 0);
}

#[test]
fn a_slave_that_cannot_sync_says_so_and_goes_on() {
    let mut config = in_group(3, 0);
    // Asked for in Set_Prm it would refuse the parameters.
    config.sync = Demand::No;
    let mut line = Line::new(BAUD, &[config]);
    line.add_slave(SlaveIdentity {
        sync: Support::Unsupported,
        ..slave_identity(BAUD)
    });
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.master_events();
    line.master.send_control(command(ControlCommand::SYNC, 0)).unwrap();
    line.run_for(Duration::from_millis(3));
    let events = line.master_events();
    assert!(
        matches!(events[..], [MasterEvent::Diagnosis { diagnosis, .. }] if diagnosis.status.contains(StationStatus::NOT_SUPPORTED)),
        "{events:?}"
    );
    line.master.set_outputs(index, &[3; 8]).unwrap();
    line.run_for(Duration::from_millis(3));
    assert_eq!(line.slaves[0].outputs(), [3; 8], "the outputs follow");
    line.assert_no_violations();
}

#[test]
fn global_control_of_a_stranger_or_of_a_wrong_length_does_nothing() {
    let mut bench = Bench::owned_by(2);
    bench.ask(2, None, Fcb::High, &[7; 8]);
    let send = |bench: &mut Bench, master: u8, data: &[u8]| {
        let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::SdnHigh);
        let header = Header::new(Address::BROADCAST, address(master), fc).with_saps(sap::GLOBAL_CONTROL, sap::MASTER);
        let mut buf = [0; 255];
        let len = Telegram::Data { header, data }.encode(&mut buf).unwrap();
        assert_eq!(bench.hear(&buf[..len]), [0u8; 0]);
    };
    send(&mut bench, 4, &[0x02, 0x00]);
    send(&mut bench, 2, &[0x02]);
    send(&mut bench, 2, &[0x02, 0x00, 0x00]);
    assert_eq!(bench.slave.outputs(), [7; 8]);
    send(&mut bench, 2, &[0x02, 0x00]);
    assert_eq!(bench.slave.outputs(), [0; 8]);
    assert_eq!(bench.slave.address(), SLAVE);
}
