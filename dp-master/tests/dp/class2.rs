//! A master of class 2 beside the master of class 1: it reads what it wants and disturbs nobody.
//!
//! Mostly both are one station, or the slave belongs to somebody else; at the end the tool is a station of its own in
//! the ring.

use dp_master::address::Address;
use dp_master::dp::class2::{
    AskIdent, AskLsap, AskStatus, GetCfg, Pending, RdInp, RdOutp, ReadDiag, Service, ServiceError,
};
use dp_master::dp::{
    DpMaster, ExtDiag, JobFailure, MasterConfig, MasterEvent, Mode, Overflow, SlaveConfig, SlaveState, StationStatus,
};
use dp_master::fdl::BusParams;
use dp_master::phy::PortId;
use dp_master::time::Duration;
use dp_master::wire::{ResponseFunction, StationType};

use crate::common::bench::{BAUD, Bench};
use crate::common::{self, Line, MASTER, SLAVE, slave_identity};

fn ask<S: Service>(line: &mut Line, service: S) -> Result<S::Answer, ServiceError> {
    let pending = Pending::start(service, line.master.jobs()).unwrap();
    let end = line.now + Duration::from_millis(100);
    loop {
        if let Some(answer) = pending.poll(line.master.jobs()) {
            return answer;
        }
        assert!(line.now < end, "no answer:\n{}", line.tap.log.join("\n"));
        line.step();
    }
}

const REFUSED: ServiceError = ServiceError::Failed(JobFailure::Refused(ResponseFunction::NoService));

/// A tool without slaves of its own, and a slave that master 4 exchanges with.
fn with_a_slave_of_another() -> Line {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let mut bench = Bench::owned_by(4);
    bench.slave.set_inputs(&[0xA1; 8]);
    bench.ask(4, None, dp_master::wire::Fcb::High, &[0x51; 8]);
    line.now = bench.now;
    line.slaves[0] = bench.slave;
    line
}

#[test]
fn everything_of_a_slave_can_be_read_while_another_master_owns_it() {
    let mut line = with_a_slave_of_another();
    let peer = SLAVE;
    let diagnosis = ask(&mut line, ReadDiag { peer }).unwrap();
    assert_eq!((diagnosis.standard.master, diagnosis.standard.ident), (4, 0x00DA));
    assert!(!diagnosis.standard.status.intersects(StationStatus::STATION_NOT_READY));
    assert_eq!(ask(&mut line, GetCfg { peer }).unwrap()[..], [0xF3]);
    assert_eq!(ask(&mut line, RdInp { peer }).unwrap()[..], [0xA1; 8]);
    assert_eq!(ask(&mut line, RdOutp { peer }).unwrap()[..], [0x51; 8]);
    assert_eq!(ask(&mut line, AskStatus { peer }), Ok(StationType::Slave));
    assert_eq!(line.slaves[0].master().map(u8::from), Some(4));
    assert_eq!(line.slaves[0].outputs(), [0x51; 8]);
    line.assert_no_violations();
}

#[test]
fn a_slave_that_nobody_has_parametrised_tells_diagnosis_and_configuration_but_no_images() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let peer = SLAVE;
    let diagnosis = ask(&mut line, ReadDiag { peer }).unwrap();
    assert!(diagnosis.standard.status.contains(StationStatus::PRM_REQ));
    assert_eq!(ask(&mut line, GetCfg { peer }).unwrap()[..], [0xF3]);
    assert_eq!(ask(&mut line, RdInp { peer }), Err(REFUSED));
    assert_eq!(ask(&mut line, RdOutp { peer }), Err(REFUSED));
    line.assert_no_violations();
}

#[test]
fn the_own_slaves_can_be_asked_during_the_exchange() {
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.master_events();
    line.master.set_outputs(index, &[7; 8]).unwrap();
    line.slaves[0].set_inputs(&[9; 8]);
    line.run_for(Duration::from_millis(2));
    let peer = SLAVE;
    assert_eq!(ask(&mut line, RdInp { peer }).unwrap()[..], [9; 8]);
    assert_eq!(ask(&mut line, RdOutp { peer }).unwrap()[..], [7; 8]);
    assert_eq!(line.master_events(), []);
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    line.assert_no_violations();
}

#[test]
fn a_tool_that_reads_along_does_not_take_the_news_from_the_owner() {
    let mut line = with_a_slave_of_another();
    let trip = [0x03, 0x32, 0x10];
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, &trip, Overflow::Complete)
        .unwrap();
    let diagnosis = ask(&mut line, ReadDiag { peer: SLAVE }).unwrap();
    assert_eq!(diagnosis.extended[..], trip);
    // The owner's next exchange still announces: DH.
    let mut bench = Bench::new();
    std::mem::swap(&mut bench.slave, &mut line.slaves[0]);
    bench.now = line.now;
    let reply = bench.ask(4, None, dp_master::wire::Fcb::First, &[0x51; 8]);
    assert_eq!(common::bench::response(&reply), ResponseFunction::DataHigh);
}

#[test]
fn a_diagnosis_of_our_own_slave_read_as_a_job_is_an_event_as_well() {
    // The slave cannot tell the job from the handler, both have one address: with either its news is delivered.
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.run_until(|line| line.master.exchanges(index) > 3);
    line.master_events();
    let trip = [0x03, 0x32, 0x10];
    line.slaves[0]
        .set_ext_diag(ExtDiag::Fault, &trip, Overflow::Complete)
        .unwrap();
    let diagnosis = ask(&mut line, ReadDiag { peer: SLAVE }).unwrap();
    assert_eq!(diagnosis.extended[..], trip);
    line.run_for(Duration::from_millis(5));
    let events = line.master_events();
    assert!(matches!(events[..], [MasterEvent::Diagnosis { .. }]), "{events:?}");
    assert_eq!(line.master.diagnosis(index).unwrap().extended[..], trip);
    // Nothing new, no event.
    ask(&mut line, ReadDiag { peer: SLAVE }).unwrap();
    line.run_for(Duration::from_millis(5));
    assert_eq!(line.master_events(), []);
    line.assert_no_violations();
}

#[test]
fn ident_data_and_access_points_are_refused_by_a_dp_slave() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let peer = SLAVE;
    assert_eq!(ask(&mut line, AskIdent { peer }), Err(REFUSED));
    assert_eq!(ask(&mut line, AskLsap { peer, sap: 62 }), Err(REFUSED));
    // IEC 61158-4-3: ident FC 4E, without frame count bit: 03 + 02 + 4E = 53.
    assert!(line.tap.log.iter().any(|telegram| telegram == "10 03 02 4E 53 16"));
    // LSAP status FC 4F, the access point as DAE: 83 + 02 + 4F + 3E = 112.
    assert!(
        line.tap
            .log
            .iter()
            .any(|telegram| telegram == "68 04 04 68 83 02 4F 3E 12 16")
    );
    line.assert_no_violations();
}

#[test]
fn a_given_up_service_frees_its_place() {
    let mut line = Line::new(BAUD, &[]);
    let room = line.master.jobs().room();
    let pending = Pending::start(GetCfg { peer: SLAVE }, line.master.jobs()).unwrap();
    pending.cancel(line.master.jobs());
    assert_eq!(line.master.jobs().room(), room);
}

/// A tool of class 2 as a station of its own in the ring of the master.
struct Tool {
    master: DpMaster<0>,
    port: PortId,
}

/// Runs line and tool together until the tool has its answer.
fn ask_from<S: Service>(line: &mut Line, tool: &mut Tool, service: S) -> Result<S::Answer, ServiceError> {
    let pending = Pending::start(service, tool.master.jobs()).unwrap();
    let end = line.now + Duration::from_millis(200);
    loop {
        if let Some(answer) = pending.poll(tool.master.jobs()) {
            return answer;
        }
        assert!(line.now < end, "no answer:\n{}", line.tap.log.join("\n"));
        line.step_with(&mut [(tool.port, &mut tool.master)]);
    }
}

#[test]
fn a_tool_in_the_ring_of_the_master_reads_its_slave_and_takes_nothing_from_it() {
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    line.master.set_outputs(index, &[0x51; 8]).unwrap();
    line.slaves[0].set_inputs(&[0xA1; 8]);
    line.run_until(|line| line.master.exchanges(index) > 3);
    let config = MasterConfig::new(Address::new(1).unwrap(), BusParams::standard(BAUD));
    let mut tool = Tool {
        master: DpMaster::new(config).unwrap(),
        port: line.bus.attach(),
    };
    let end = line.now + Duration::from_millis(1_500);
    while !tool.master.is_in_ring() {
        assert!(line.now < end, "the tool was not let into the ring");
        line.step_with(&mut [(tool.port, &mut tool.master)]);
    }
    line.master_events();
    let before = line.master.exchanges(index);
    let peer = SLAVE;
    let diagnosis = ask_from(&mut line, &mut tool, ReadDiag { peer }).unwrap();
    assert_eq!(diagnosis.standard.master, 2);
    assert_eq!(ask_from(&mut line, &mut tool, GetCfg { peer }).unwrap()[..], [0xF3]);
    assert_eq!(ask_from(&mut line, &mut tool, RdInp { peer }).unwrap()[..], [0xA1; 8]);
    assert_eq!(ask_from(&mut line, &mut tool, RdOutp { peer }).unwrap()[..], [0x51; 8]);
    let station = ask_from(&mut line, &mut tool, AskStatus { peer: MASTER }).unwrap();
    assert_eq!(station, StationType::MasterInRing);
    assert!(line.master.exchanges(index) > before);
    // The exchange went on all the time.
    assert_eq!(line.master.state(index), SlaveState::DataExchange);
    let lost = |event: &MasterEvent| matches!(event, MasterEvent::SlaveLost { .. });
    assert!(!line.master_events().iter().any(lost));
    line.assert_no_violations();
}
