//! What independent masters do on the wire, and how the slave meets them. The telegrams are theirs, octet by octet.

use dp_master::dp::{AcceptedConfigurations, Mode, SlaveConfig, SlaveIdentity, SlavePhase, sap};
use dp_master::phy::Script;
use dp_master::time::Duration;
use dp_master::wire::{Fcb, RequestFunction, ResponseFunction};

use crate::common::SLAVE;
use crate::common::bench::{BAUD, Bench, response};
use crate::common::{Line, slave_identity};

const PRM: [u8; 7] = [0x80, 0, 0, 11, 0x00, 0xDA, 0];

#[test]
fn the_exchange_works_without_token_and_global_control() {
    // One master sends neither, ever: diagnosis, parameters, configuration, diagnosis, exchange, and nothing else.
    let mut bench = Bench::new();
    let diagnosis = bench.ask(2, Some(sap::SLAVE_DIAG), Fcb::First, &[]);
    assert_eq!(diagnosis[9..15], [0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA]);
    assert_eq!(bench.ask(2, Some(sap::SET_PRM), Fcb::Low, &PRM), [0xE5]);
    assert_eq!(bench.ask(2, Some(sap::CHK_CFG), Fcb::High, &[0xF3]), [0xE5]);
    let diagnosis = bench.ask(2, Some(sap::SLAVE_DIAG), Fcb::Low, &[]);
    assert_eq!(diagnosis[9..15], [0x00, 0x04, 0x00, 0x02, 0x00, 0xDA]);
    bench.slave.set_inputs(&[9; 8]);
    for (fcb, value) in [(Fcb::High, 1), (Fcb::Low, 2), (Fcb::High, 3)] {
        let reply = bench.ask(2, None, fcb, &[value; 8]);
        assert_eq!(reply[7..15], [9; 8]);
        assert_eq!(bench.slave.outputs(), [value; 8]);
    }
}

#[test]
fn every_service_is_served_with_low_and_with_high_priority() {
    for function in [RequestFunction::SrdLow, RequestFunction::SrdHigh] {
        let mut bench = Bench::new();
        let fcbs = [
            Fcb::First,
            Fcb::Low,
            Fcb::High,
            Fcb::Low,
            Fcb::High,
            Fcb::Low,
            Fcb::High,
        ];
        let requests: [(Option<u8>, &[u8]); 7] = [
            (Some(sap::SLAVE_DIAG), &[]),
            (Some(sap::SET_PRM), &PRM),
            (Some(sap::CHK_CFG), &[0xF3]),
            (None, &[1; 8]),
            (Some(sap::GET_CFG), &[]),
            (Some(sap::RD_INP), &[]),
            (Some(sap::RD_OUTP), &[]),
        ];
        let replies: Vec<_> = requests
            .into_iter()
            .zip(fcbs)
            .map(|((dsap, data), fcb)| bench.ask_as(2, dsap, fcb, function, data))
            .collect();
        assert_eq!((&replies[1], &replies[2]), (&vec![0xE5], &vec![0xE5]));
        for place in [0, 3, 4, 5, 6] {
            assert_eq!(
                response(&replies[place]),
                ResponseFunction::DataLow,
                "request {place}, {function:?}"
            );
        }
        assert_eq!(bench.slave.outputs(), [1; 8]);
    }
}

#[test]
fn eight_octets_with_their_access_points_may_come_as_sd3() {
    // Six identifiers and two access points are eight octets: Chk_Cfg as SD3. A2, then DA 83, SA 82, FC 7D, 3E 3E, six
    // times 10. FCS: 83 + 82 + 7D + 3E + 3E + 60 = 25E.
    let mut bench = Bench::with_identity(SlaveIdentity::new(
        SLAVE,
        0x00DA,
        BAUD,
        AcceptedConfigurations::Table(&[&[0x10; 6]]),
    ));
    bench.ask(2, Some(sap::SET_PRM), Fcb::First, &PRM);
    let telegram = [
        0xA2, 0x83, 0x82, 0x7D, 0x3E, 0x3E, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x5E, 0x16,
    ];
    assert_eq!(bench.hear(&telegram), [0xE5]);
    assert_eq!(bench.slave.phase(), SlavePhase::DataExchange);
}

#[test]
fn outputs_of_eight_octets_may_come_as_sd3_and_as_sd2() {
    let mut bench = Bench::owned_by(2);
    // FC 7D: 03 + 02 + 7D + 8 · 11 = 10A; FC 5D: 03 + 02 + 5D + 8 · 22 = 172.
    let sd3 = [
        0xA2, 0x03, 0x02, 0x7D, 0x11, 0x11, 0x11, 0x11, 0x11, 0x11, 0x11, 0x11, 0x0A, 0x16,
    ];
    let sd2 = [
        0x68, 0x0B, 0x0B, 0x68, 0x03, 0x02, 0x5D, 0x22, 0x22, 0x22, 0x22, 0x22, 0x22, 0x22, 0x22, 0x72, 0x16,
    ];
    bench.hear(&sd3);
    assert_eq!(bench.slave.outputs(), [0x11; 8]);
    bench.hear(&sd2);
    assert_eq!(bench.slave.outputs(), [0x22; 8]);
}

#[test]
fn a_master_that_goes_on_with_a_stale_frame_count_bit_is_understood() {
    // After a lost reply it does not repeat: the same bit comes with other octets. A slave that looks at the bit alone
    // sends the old reply for ever.
    let mut bench = Bench::new();
    bench.ask(2, Some(sap::SLAVE_DIAG), Fcb::First, &[]);
    assert_eq!(bench.ask(2, Some(sap::SET_PRM), Fcb::Low, &PRM), [0xE5]);
    // The reply was lost; the master begins anew with the bit as it was.
    let diagnosis = bench.ask(2, Some(sap::SLAVE_DIAG), Fcb::Low, &[]);
    assert_eq!(
        diagnosis.len(),
        17,
        "a diagnosis, not the acknowledgement of the Set_Prm"
    );
    // The same access points with other octets.
    let mut other = PRM;
    other[6] = 0x01;
    assert_eq!(bench.ask(2, Some(sap::SET_PRM), Fcb::High, &PRM), [0xE5]);
    assert_eq!(bench.ask(2, Some(sap::SET_PRM), Fcb::High, &other), [0xE5]);
    assert_eq!(bench.ask(2, Some(sap::CHK_CFG), Fcb::High, &[0xF3]), [0xE5]);
    assert_eq!(bench.slave.phase(), SlavePhase::DataExchange);
}

#[test]
fn a_repeated_data_exchange_with_newer_outputs_gets_the_old_reply_and_its_octets_are_ignored() {
    let mut bench = Bench::owned_by(2);
    bench.slave.set_inputs(&[1; 8]);
    let reply = bench.ask(2, None, Fcb::High, &[7; 8]);
    bench.slave.set_inputs(&[2; 8]);
    let repeated = bench.ask(2, None, Fcb::High, &[8; 8]);
    assert_eq!(repeated, reply);
    assert_eq!(bench.slave.outputs(), [7; 8]);
    let next = bench.ask(2, None, Fcb::Low, &[8; 8]);
    assert_eq!(next[7..15], [2; 8]);
    assert_eq!(bench.slave.outputs(), [8; 8]);
}

#[test]
fn a_master_starts_a_lost_slave_with_first_contact() {
    // Peers forget to reset the bit; ours must not.
    let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
    line.add_slave(slave_identity(BAUD));
    line.master.set_mode(Mode::Operate);
    let index = line.indices[0];
    // Once with an even and once with an odd number of requests, so that the bit would be either.
    for exchanges in [6, 7] {
        line.run_until(|line| line.master.exchanges(index) >= exchanges);
        line.replace_slave(0, slave_identity(BAUD));
        let heard = line.tap.log.len();
        line.run_for(Duration::from_millis(5));
        let first = line.tap.log[heard..]
            .iter()
            .find(|telegram| telegram.starts_with("68 05 05 68 83 82"))
            .unwrap();
        // Slave_Diag with FC 6D: FCB 1, FCV 0.
        assert_eq!(&first[18..20], "6D");
    }
}

#[test]
fn a_lost_reply_between_start_up_services_is_repeated() {
    // Each burst of the start-up in turn is lost: request or reply, the slave comes up all the same.
    for lost in 2..14 {
        let mut line = Line::new(BAUD, &[SlaveConfig::new(SLAVE, 0x00DA, &[0xF3]).unwrap()]);
        line.add_slave(slave_identity(BAUD));
        line.bus.script(Script::Drop { burst: lost });
        line.master.set_mode(Mode::Operate);
        line.run_for(Duration::from_millis(60));
        assert!(line.master.exchanges(line.indices[0]) > 10, "burst {lost}");
        line.assert_no_violations();
    }
}
