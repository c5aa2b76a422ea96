//! The constant bus cycle: cycles that take too long, and what becomes of the phase.

use dp_master::address::Address;
use dp_master::dp::{JobRequest, MasterConfig, MasterEvent, Mode, Overrun, SlaveConfig, sap};
use dp_master::fdl::BusParams;
use dp_master::time::{Baud, Duration, Instant};

use crate::common::{Line, MASTER, SLAVE, slave_identity};

const BAUD: Baud = Baud::B1500000;
/// A cycle of one slave with eight octets takes about 0.37 ms at 1.5 Mbit/s; two missing answers cost 0.27 ms each.
const PERIOD: Duration = Duration::from_micros(600);

fn exchanging(overrun: Overrun) -> Line {
    let mut config = MasterConfig::new(MASTER, BusParams::standard(BAUD));
    config.min_cycle = PERIOD;
    config.overrun = overrun;
    let mut line = Line::with_config(config, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) == 10);
    line.master_events();
    line
}

/// When each Data_Exchange request began.
fn starts(line: &Line, from: usize) -> Vec<Instant> {
    (from..line.tap.log.len())
        .filter(|&place| line.tap.log[place].starts_with("68 0B 0B 68 03 02"))
        .map(|place| line.tap.times[place])
        .collect()
}

/// One cycle with a job to an absent station, which costs a request and a repetition.
fn overrun(line: &mut Line) -> usize {
    // Into the pause before the next cycle.
    line.run_for(Duration::from_micros(200));
    let heard = line.tap.log.len();
    let absent = JobRequest::srd(Address::new(99).unwrap(), sap::SLAVE_DIAG, sap::MASTER, &[]);
    line.master.jobs().submit(&absent).unwrap();
    line.run_for(Duration::from_millis(6));
    heard
}

#[test]
fn cycles_in_time_are_counted_as_no_overrun() {
    let mut line = exchanging(Overrun::KeepPhase);
    let heard = line.tap.log.len();
    line.run_for(Duration::from_millis(6));
    let starts = starts(&line, heard);
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] == PERIOD), "{starts:?}");
    let statistics = line.master.statistics();
    assert_eq!((statistics.overruns, statistics.missed_cycles), (0, 0));
}

#[test]
fn after_an_overrun_the_next_cycle_follows_at_once() {
    let mut line = exchanging(Overrun::FollowAtOnce);
    let heard = overrun(&mut line);
    let gaps: Vec<_> = starts(&line, heard).windows(2).map(|pair| pair[1] - pair[0]).collect();
    let long: Vec<_> = gaps.iter().filter(|gap| **gap != PERIOD).collect();
    assert_eq!(long.len(), 1, "{gaps:?}");
    assert!(*long[0] > PERIOD && *long[0] < PERIOD + PERIOD);
    let statistics = line.master.statistics();
    assert_eq!((statistics.overruns, statistics.missed_cycles), (1, 0));
    assert!(matches!(line.master_events()[..], [MasterEvent::CycleOverrun { took }] if took > PERIOD));
    line.assert_no_violations();
}

#[test]
fn with_the_phase_kept_an_overrun_costs_one_cycle_and_shifts_none() {
    let mut line = exchanging(Overrun::KeepPhase);
    let heard = overrun(&mut line);
    let starts = starts(&line, heard);
    let gaps: Vec<_> = starts.windows(2).map(|pair| (pair[1] - pair[0]).as_nanos()).collect();
    let period = PERIOD.as_nanos();
    assert!(gaps.iter().all(|gap| gap % period == 0), "{gaps:?}");
    assert_eq!(gaps.iter().filter(|gap| **gap == 2 * period).count(), 1, "{gaps:?}");
    let statistics = line.master.statistics();
    assert_eq!((statistics.overruns, statistics.missed_cycles), (1, 1));
    assert!(matches!(line.master_events()[..], [MasterEvent::CycleOverrun { .. }]));
    line.assert_no_violations();
}

#[test]
fn overruns_in_a_row_are_one_event() {
    let mut line = exchanging(Overrun::FollowAtOnce);
    for station in 90..98 {
        let absent = JobRequest::srd(Address::new(station).unwrap(), sap::SLAVE_DIAG, sap::MASTER, &[]);
        line.master.jobs().submit(&absent).unwrap();
    }
    line.run_for(Duration::from_millis(12));
    assert_eq!(line.master.statistics().overruns, 8);
    assert_eq!(line.master_events().len(), 1);
}
