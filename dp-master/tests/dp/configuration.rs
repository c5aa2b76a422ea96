//! What a master refuses to be configured with (IEC 61158-6-3, bus and slave parameter sets: addresses 0 to 126, min Tsdr at least 11).

use dp_master::address::Address;
use dp_master::dp::{AddSlaveError, DpMaster, MasterConfig, MasterError, SlaveConfig};
use dp_master::fdl::{BusParams, BusParamsError};
use dp_master::time::{Baud, BitTimes};

use crate::common::{MASTER, SLAVE};

fn config(address: Address) -> MasterConfig {
    MasterConfig::new(address, BusParams::standard(Baud::B1500000))
}

fn slave(address: Address) -> SlaveConfig {
    SlaveConfig::new(address, 0x00DA, &[0xF3]).unwrap()
}

#[test]
fn a_master_has_an_address_of_its_own_and_parameters_that_fit() {
    assert_eq!(
        DpMaster::<1>::new(config(Address::BROADCAST)).unwrap_err(),
        MasterError::Address {
            got: Address::BROADCAST
        }
    );
    let mut slow = config(MASTER);
    slow.params.t_sdr_min = BitTimes(10);
    assert_eq!(
        DpMaster::<1>::new(slow).unwrap_err(),
        MasterError::Params(BusParamsError::MinTsdr { got: BitTimes(10) })
    );
    assert_eq!(DpMaster::<1>::new(config(MASTER)).unwrap().address(), MASTER);
}

#[test]
fn a_slave_that_cannot_be_is_not_added_and_changes_nothing() {
    let mut master = DpMaster::<2>::new(config(MASTER)).unwrap();
    for got in [MASTER, Address::BROADCAST] {
        assert_eq!(master.add_slave(slave(got)), Err(AddSlaveError::Address { got }));
    }
    for (min_tsdr, is_taken) in [(1, false), (10, false), (11, true)] {
        let mut slave = slave(SLAVE);
        slave.min_tsdr = min_tsdr;
        let got = master.add_slave(slave);
        if is_taken {
            assert!(got.is_ok());
        } else {
            assert_eq!(got, Err(AddSlaveError::MinTsdr { got: min_tsdr }));
        }
    }
    assert_eq!(
        master.add_slave(slave(SLAVE)),
        Err(AddSlaveError::Duplicate { address: SLAVE })
    );
    assert_eq!(master.slave_count(), 1);
    // 0 leaves the slave what it has.
    let mut keeps = slave(Address::new(4).unwrap());
    keeps.min_tsdr = 0;
    assert!(master.add_slave(keeps).is_ok());
    assert_eq!(
        master.add_slave(slave(Address::new(5).unwrap())),
        Err(AddSlaveError::Full { capacity: 2 })
    );
    assert_eq!(master.slave_count(), 2);
}
