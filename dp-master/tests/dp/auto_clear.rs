//! Auto_Clear: one slave that fails clears them all, and Operate waits until every slave exchanges data.
//!
//! Source of the rules: EN 50170 part 8-2, Error_Action_Flag and Data_Control_Time.

use dp_master::address::Address;
use dp_master::dp::{
    Activation, AutoClear, AutoClearVote, DpMaster, MasterConfig, MasterError, MasterEvent, Mode, SlaveConfig,
    SlaveIdentity, SlaveState, StationStatus,
};
use dp_master::fdl::BusParams;
use dp_master::time::{Baud, Duration};

use crate::common::{Line, MASTER, slave_identity};

const BAUD: Baud = Baud::B1500000;
/// Longer than the retry interval of 20 ms, so that a slave has a second chance.
const CONTROL_TIME: Duration = Duration::from_millis(40);
/// Global_Control to all: 7F + 80, SA 82, FC 46, DSAP 3A, SSAP 3E, Clear_Data 02 or nothing.
const CLEAR: &str = "68 07 07 68 FF 82 46 3A 3E 02 00 41 16";
const OPERATE: &str = "68 07 07 68 FF 82 46 3A 3E 00 00 3F 16";

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

fn config(value: u8) -> SlaveConfig {
    SlaveConfig::new(address(value), 0x00DA, &[0xF3]).unwrap()
}

/// A master in Operate with slaves 3 and 4 with outputs 1 and 2; both are on the line.
fn line(auto_clear: AutoClear, slaves: &[SlaveConfig]) -> Line {
    // No master above ours: the search of the new ring is over at once.
    let params = BusParams {
        hsa: MASTER,
        ..BusParams::standard(BAUD)
    };
    let mut master = MasterConfig::new(MASTER, params);
    master.auto_clear = auto_clear;
    master.data_control_time = CONTROL_TIME;
    let mut line = Line::with_config(master, slaves);
    for value in [3, 4] {
        line.add_slave(SlaveIdentity {
            address: address(value),
            ..slave_identity(BAUD)
        });
    }
    for place in 0..slaves.len() {
        let index = line.indices[place];
        line.master.set_outputs(index, &[place as u8 + 1; 8]).unwrap();
    }
    line.master.set_mode(Mode::Operate);
    line
}

fn operating(auto_clear: AutoClear, slaves: &[SlaveConfig]) -> Line {
    let mut line = line(auto_clear, slaves);
    line.run_for(Duration::from_millis(30));
    assert_eq!(line.master.mode(), Mode::Operate);
    line.master_events();
    line
}

#[test]
fn operate_begins_when_every_slave_exchanges_data() {
    let mut line = line(AutoClear::ReturnToOperate, &[config(3), config(4)]);
    line.bus.disconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(60));
    assert_eq!(line.master.mode(), Mode::Clear);
    assert_eq!(line.master.requested_mode(), Mode::Operate);
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    assert_eq!(line.slaves[0].outputs(), [0; 8]);
    assert!(!line.tap.log.iter().any(|telegram| telegram == OPERATE));
    line.bus.reconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(40));
    assert_eq!(line.master.mode(), Mode::Operate);
    assert!(line.master_events().contains(&MasterEvent::OutputsReleased));
    assert!(line.tap.log.iter().any(|telegram| telegram == OPERATE));
    assert_eq!(
        (line.slaves[0].outputs(), line.slaves[1].outputs()),
        (&[1; 8][..], &[2; 8][..])
    );
    line.assert_no_violations();
}

#[test]
fn one_failed_slave_clears_all_within_the_control_time_and_they_return() {
    let mut line = operating(AutoClear::ReturnToOperate, &[config(3), config(4)]);
    let heard = line.tap.log.len();
    let failed = line.now;
    line.bus.disconnect(line.slave_ports[1]);
    line.run_until(|line| line.master.mode() == Mode::Clear);
    let after = line.now - failed;
    // Data_Control_Time, and at most one cycle (about 1 ms with the attempts at the absent slave).
    assert!(
        after >= CONTROL_TIME - Duration::from_millis(1) && after <= CONTROL_TIME + Duration::from_millis(1),
        "{after:?}"
    );
    let slave = line.indices[1];
    assert!(line.master_events().contains(&MasterEvent::AutoCleared { slave }));
    line.run_for(Duration::from_millis(3));
    assert_eq!(line.slaves[0].outputs(), [0; 8]);
    assert!(line.tap.log[heard..].iter().any(|telegram| telegram == CLEAR));
    line.bus.reconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(40));
    assert_eq!(line.master.mode(), Mode::Operate);
    assert_eq!(line.slaves[0].outputs(), [1; 8]);
    line.assert_no_violations();
}

#[test]
fn told_to_stay_in_clear_the_master_waits_for_the_user() {
    let mut line = operating(AutoClear::StayInClear, &[config(3), config(4)]);
    line.bus.disconnect(line.slave_ports[0]);
    line.run_for(Duration::from_millis(50));
    line.bus.reconnect(line.slave_ports[0]);
    line.run_for(Duration::from_millis(60));
    assert_eq!(line.master.mode(), Mode::Clear);
    assert_eq!(line.master.requested_mode(), Mode::Clear);
    assert_eq!(line.slaves[1].outputs(), [0; 8]);
    line.master.set_mode(Mode::Operate);
    line.run_for(Duration::from_millis(10));
    assert_eq!(line.master.mode(), Mode::Operate);
    assert_eq!(line.slaves[1].outputs(), [2; 8]);
}

#[test]
fn a_short_interruption_within_the_control_time_clears_nothing() {
    let mut line = operating(AutoClear::StayInClear, &[config(3), config(4)]);
    line.bus.disconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(10));
    line.bus.reconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(200));
    assert_eq!(line.master.mode(), Mode::Operate);
    assert!(
        !line
            .master_events()
            .iter()
            .any(|event| matches!(event, MasterEvent::AutoCleared { .. }))
    );
}

#[test]
fn a_slave_that_is_ignored_neither_clears_nor_delays() {
    let mut ignored = config(4);
    ignored.auto_clear = AutoClearVote::Ignored;
    let mut line = line(AutoClear::ReturnToOperate, &[config(3), ignored]);
    line.bus.disconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(60));
    assert_eq!(line.master.mode(), Mode::Operate);
    assert_eq!(line.slaves[0].outputs(), [1; 8]);
}

#[test]
fn without_auto_clear_the_others_go_on() {
    let mut line = operating(AutoClear::Off, &[config(3), config(4)]);
    line.bus.disconnect(line.slave_ports[1]);
    line.run_for(Duration::from_millis(100));
    assert_eq!(line.master.mode(), Mode::Operate);
    assert_eq!(line.slaves[0].outputs(), [1; 8]);
}

#[test]
fn an_inactive_slave_is_left_alone_and_counts_for_nothing() {
    let mut inactive = config(4);
    inactive.activation = Activation::Inactive;
    let mut line = operating(AutoClear::StayInClear, &[config(3), inactive]);
    let slave = line.indices[1];
    let asked = |line: &Line| {
        line.tap
            .log
            .iter()
            .filter(|telegram| telegram.starts_with("68 05 05 68 84"))
            .count()
    };
    assert_eq!(asked(&line), 0);
    assert!(line.master.station_status(slave).contains(StationStatus::DEACTIVATED));
    assert!(line.master.set_activation(slave, Activation::Active));
    line.run_for(Duration::from_millis(10));
    assert_eq!(line.master.state(slave), SlaveState::DataExchange);
    assert!(!line.master.station_status(slave).contains(StationStatus::DEACTIVATED));
    assert!(line.master.set_activation(slave, Activation::Inactive));
    let heard = line.tap.log.len();
    line.run_for(Duration::from_millis(60));
    assert_eq!(line.master.state(slave), SlaveState::Offline);
    assert_eq!(line.master.mode(), Mode::Operate);
    let to_it = |telegram: &&String| telegram.starts_with("68 0B 0B 68 04 02");
    assert!(line.tap.log[heard..].iter().filter(to_it).count() <= 1);
    line.assert_no_violations();
}

#[test]
fn a_control_time_below_two_cycles_is_refused() {
    let mut config = MasterConfig::new(MASTER, BusParams::standard(BAUD));
    config.auto_clear = AutoClear::StayInClear;
    config.min_cycle = Duration::from_millis(60);
    let error = DpMaster::<1>::new(config).map(|_| ()).unwrap_err();
    assert_eq!(
        error,
        MasterError::DataControlTime {
            least: Duration::from_millis(120),
            got: Duration::from_millis(100)
        }
    );
}
