//! Set_Slave_Add at the slave: when it is obeyed, when it is ignored, and what the device learns.

use dp_master::address::Address;
use dp_master::dp::class2::{AskStatus, ChangeAddress, Pending, ServiceError};
use dp_master::dp::{
    AddressChange, AddressKept, AddressLock, JobFailure, SetSlaveAdd, SetSlaveAddError, SlaveEvent, SlaveIdentity, sap,
};
use dp_master::time::Duration;
use dp_master::wire::{Fcb, ResponseFunction, StationType};

use crate::common::bench::{BAUD, Bench, response};
use crate::common::{self, Line, slave_identity};

fn address(value: u8) -> Address {
    Address::new(value).unwrap()
}

/// As delivered: address 126, which can be changed.
fn delivered() -> SlaveIdentity {
    SlaveIdentity {
        address: Address::MAX_STATION,
        address_change: AddressChange::Allowed,
        ..slave_identity(BAUD)
    }
}

fn ask(bench: &mut Bench, data: &[u8]) -> Vec<u8> {
    bench.ask(1, Some(sap::SET_SLAVE_ADD), Fcb::First, data)
}

#[test]
fn a_slave_takes_its_address_and_answers_to_it_from_then_on() {
    let mut bench = Bench::with_identity(delivered());
    // New address 42, ident 00DA, changeable, two octets for the device.
    assert_eq!(ask(&mut bench, &[42, 0x00, 0xDA, 0x00, 0xB1, 0xB2]), [0xE5]);
    assert_eq!(bench.slave.address(), address(42));
    assert_eq!(
        bench.events(),
        [SlaveEvent::AddressChanged {
            address: address(42),
            lock: AddressLock::Changeable
        }]
    );
    assert_eq!(bench.slave.remaining_slave_data(), [0xB1, 0xB2]);
    // Slave_Diag to 126 = FE with bit 7: nobody answers; to 42 the six octets of a slave that waits for parameters.
    // FE + 81 + 6D + 3C + 3E = 266, AA + … = 212
    assert_eq!(
        bench.hear(&[0x68, 0x05, 0x05, 0x68, 0xFE, 0x81, 0x6D, 0x3C, 0x3E, 0x66, 0x16]),
        [0u8; 0]
    );
    let reply = bench.hear(&[0x68, 0x05, 0x05, 0x68, 0xAA, 0x81, 0x6D, 0x3C, 0x3E, 0x12, 0x16]);
    assert_eq!(reply[9..15], [0x02, 0x05, 0x00, 0xFF, 0x00, 0xDA]);
}

#[test]
fn the_address_may_be_changed_again_until_it_is_locked() {
    let mut bench = Bench::with_identity(delivered());
    for (new, no_add_chg) in [(10, 0x00), (11, 0x00), (12, 0xFF)] {
        assert_eq!(ask(&mut bench, &[new, 0x00, 0xDA, no_add_chg]), [0xE5]);
        assert_eq!(bench.slave.address(), address(new));
    }
    bench.events();
    assert_eq!(ask(&mut bench, &[13, 0x00, 0xDA, 0x00]), [0xE5]);
    assert_eq!(bench.slave.address(), address(12));
    assert_eq!(
        bench.events(),
        [SlaveEvent::AddressKept {
            cause: AddressKept::Locked
        }]
    );
}

#[test]
fn a_request_for_another_ident_number_or_an_impossible_one_is_ignored_with_its_cause() {
    for (data, cause) in [
        (&[42, 0x12, 0x34, 0][..], AddressKept::Ident { got: 0x1234 }),
        (
            &[126, 0x00, 0xDA, 0],
            AddressKept::Malformed(SetSlaveAddError::NewAddress { got: 126 }),
        ),
        (
            &[42, 0x00, 0xDA],
            AddressKept::Malformed(SetSlaveAddError::TooShort { got: 3 }),
        ),
    ] {
        let mut bench = Bench::with_identity(delivered());
        assert_eq!(ask(&mut bench, data), [0xE5]);
        assert_eq!(bench.slave.address(), Address::MAX_STATION);
        assert_eq!(bench.events(), [SlaveEvent::AddressKept { cause }]);
    }
}

#[test]
fn only_a_slave_that_waits_for_parameters_takes_an_address() {
    let mut bench = Bench::with_identity(delivered());
    assert_eq!(bench.set_prm(2, 0x80, Fcb::First), [0xE5]);
    let reply = ask(&mut bench, &[42, 0x00, 0xDA, 0x00]);
    assert_eq!(response(&reply), ResponseFunction::NoService);
    assert_eq!(bench.ask(2, Some(sap::CHK_CFG), Fcb::Low, &[0xF3]), [0xE5]);
    let reply = ask(&mut bench, &[42, 0x00, 0xDA, 0x00]);
    assert_eq!(response(&reply), ResponseFunction::NoService);
    // Released it waits again.
    assert_eq!(bench.set_prm(2, 0x40, Fcb::First), [0xE5]);
    assert_eq!(ask(&mut bench, &[42, 0x00, 0xDA, 0x00]), [0xE5]);
    assert_eq!(bench.slave.address(), address(42));
}

#[test]
fn a_master_of_class_2_gives_the_address_and_sees_the_slave_there() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(delivered());
    let request = SetSlaveAdd {
        new_address: address(42),
        ident: 0x00DA,
        lock: AddressLock::Changeable,
        remaining: &[],
    };
    let service = ChangeAddress::new(Address::MAX_STATION, &request).unwrap();
    let pending = Pending::start(service, line.master.jobs()).unwrap();
    line.run_for(Duration::from_millis(5));
    assert_eq!(pending.poll(line.master.jobs()), Some(Ok(())));
    // FC 6C; DSAP 55 = 37, SSAP 3E; FE + 82 + 6C + 37 + 3E + 2A + DA = 365
    let telegram = "68 09 09 68 FE 82 6C 37 3E 2A 00 DA 00 65 16";
    assert!(line.tap.log.iter().any(|heard| heard == telegram));
    let there = Pending::start(AskStatus { peer: address(42) }, line.master.jobs()).unwrap();
    let gone = Pending::start(
        AskStatus {
            peer: Address::MAX_STATION,
        },
        line.master.jobs(),
    )
    .unwrap();
    line.run_for(Duration::from_millis(5));
    assert_eq!(there.poll(line.master.jobs()), Some(Ok(StationType::Slave)));
    assert_eq!(
        gone.poll(line.master.jobs()),
        Some(Err(ServiceError::Failed(JobFailure::NoAnswer)))
    );
    line.assert_no_violations();
}

#[test]
fn a_slave_with_address_switches_refuses() {
    let mut line = Line::new(BAUD, &[]);
    line.add_slave(slave_identity(BAUD));
    let request = SetSlaveAdd {
        new_address: address(42),
        ident: 0x00DA,
        lock: AddressLock::Changeable,
        remaining: &[],
    };
    let service = ChangeAddress::new(common::SLAVE, &request).unwrap();
    let pending = Pending::start(service, line.master.jobs()).unwrap();
    line.run_for(Duration::from_millis(5));
    assert_eq!(
        pending.poll(line.master.jobs()),
        Some(Err(ServiceError::Failed(JobFailure::Refused(
            ResponseFunction::NoService
        ))))
    );
    line.assert_no_violations();
}
