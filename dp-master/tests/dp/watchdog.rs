//! The watchdog of a slave.

use dp_master::dp::{LeaveReason, Mode, OutputsOnLeave, SlaveConfig, SlaveEvent, SlavePhase, SlaveState, Watchdog};
use dp_master::time::{Baud, Duration};

use crate::common::{Line, SLAVE, slave_identity};

fn guarded() -> SlaveConfig {
    let mut config = SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap();
    // 10 ms × 3
    config.watchdog = Watchdog::from_factors(3, 1);
    config
}

fn exchanging(hold: OutputsOnLeave) -> Line {
    let mut line = Line::new(Baud::B1500000, &[guarded()]);
    let mut identity = slave_identity(Baud::B1500000);
    identity.outputs_on_leave = hold;
    line.add_slave(identity);
    line.master.set_mode(Mode::Operate);
    line.master.set_outputs(line.indices[0], &[7; 8]).unwrap();
    line.run_until(|line| line.master.exchanges(line.indices[0]) == 5);
    line.slave_events(0);
    line
}

#[test]
fn when_the_master_dies_the_slave_leaves_after_exactly_the_watchdog_time() {
    let mut line = exchanging(OutputsOnLeave::Clear);
    let port = line.master_port;
    // The last sign of life is the end of the next request.
    line.run_until(|line| {
        line.tap
            .log
            .last()
            .is_some_and(|last| last.starts_with("68 0B 0B 68 03 02") && last.len() == 50)
    });
    let heard = line.now;
    line.bus.disconnect(port);
    line.run_until(|line| line.slaves[0].phase() == SlavePhase::WaitPrm);
    assert_eq!(line.now - heard, Duration::from_millis(30));
    assert_eq!(
        line.slave_events(0),
        [
            SlaveEvent::WatchdogExpired,
            SlaveEvent::LeftDataExchange {
                reason: LeaveReason::Watchdog
            }
        ]
    );
    assert_eq!(line.slaves[0].outputs(), [0; 8]);
    assert_eq!(line.slaves[0].master(), None);
}

#[test]
fn a_slave_told_to_hold_keeps_its_last_outputs() {
    let mut line = exchanging(OutputsOnLeave::Hold);
    let port = line.master_port;
    line.bus.disconnect(port);
    line.run_until(|line| line.slaves[0].phase() == SlavePhase::WaitPrm);
    assert_eq!(line.slaves[0].outputs(), [7; 8]);
}

#[test]
fn held_outputs_stay_until_the_returning_master_sends_its_own() {
    let mut line = exchanging(OutputsOnLeave::Hold);
    let port = line.master_port;
    line.bus.disconnect(port);
    line.run_for(Duration::from_millis(50));
    assert_eq!(line.slaves[0].phase(), SlavePhase::WaitPrm);
    line.bus.reconnect(port);
    // From the accepted Chk_Cfg to the first Data_Exchange the slave has its configuration and no outputs of the master.
    line.run_until(|line| line.slaves[0].phase() == SlavePhase::DataExchange);
    assert_eq!(line.slaves[0].outputs(), [7; 8]);
    line.run_for(Duration::from_millis(30));
    assert_eq!(line.slaves[0].outputs(), [7; 8]);
}

#[test]
fn after_the_expiry_the_returning_master_starts_the_slave_again() {
    let mut line = exchanging(OutputsOnLeave::Clear);
    let port = line.master_port;
    line.bus.disconnect(port);
    line.run_for(Duration::from_millis(50));
    line.bus.reconnect(port);
    line.run_for(Duration::from_millis(30));
    assert_eq!(line.slaves[0].phase(), SlavePhase::DataExchange);
    assert_eq!(line.master.state(line.indices[0]), SlaveState::DataExchange);
    assert_eq!(line.slaves[0].outputs(), [7; 8]);
}

#[test]
fn a_running_exchange_keeps_the_watchdog_quiet() {
    let mut line = exchanging(OutputsOnLeave::Clear);
    line.run_for(Duration::from_millis(500));
    assert!(!line.slave_events(0).contains(&SlaveEvent::WatchdogExpired));
    assert_eq!(line.master.statistics().retries, 0);
    line.assert_no_violations();
}
