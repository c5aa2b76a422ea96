//! The two masters, each with the bus parameters and slaves of the other.

use dp_master::address::Address;
use dp_master::dp::{DpMaster, MasterConfig, Mode, SlaveConfig, SlaveIndex};
use dp_master::fdl::BusParams;
use dp_master::time::{Baud, BitTimes};
use profirust::dp::{DpMaster as PeerDp, Peripheral, PeripheralHandle, PeripheralOptions};
use profirust::fdl::{FdlActiveStation as PeerFdl, ParametersBuilder};

use crate::slaves::{FIRST_SLAVE, IDENT, IDENTIFIERS, IMAGE, MASTER};

/// Baud rate of all comparisons.
pub(crate) const BAUD: Baud = Baud::B1500000;
/// Tsl at that rate, profile DP.
pub(crate) const SLOT_BITS: u16 = 300;
/// Target rotation time: long enough for 30 slaves and what is in between.
const ROTATION_BITS: u32 = 78_000;
/// Token rotations between two polls of the GAP.
const GAP_FACTOR: u8 = 100;

/// This stack's master in Operate with so many slaves.
///
/// # Panics
/// When there are more than 30.
pub(crate) fn ours(slaves: u8) -> (DpMaster<30>, Vec<SlaveIndex>) {
    let station = |value| Address::new(value).unwrap_or_else(|error| panic!("{error}"));
    let params = BusParams {
        t_sl: BitTimes(SLOT_BITS.into()),
        t_tr: BitTimes(ROTATION_BITS),
        gap_factor: GAP_FACTOR,
        hsa: station(MASTER + 1),
        ..BusParams::standard(BAUD)
    };
    let mut master =
        DpMaster::new(MasterConfig::new(station(MASTER), params)).unwrap_or_else(|error| panic!("{error}"));
    let handles = (FIRST_SLAVE..FIRST_SLAVE + slaves)
        .map(|address| {
            let slave =
                SlaveConfig::new(station(address), IDENT, &IDENTIFIERS).unwrap_or_else(|error| panic!("{error}"));
            master.add_slave(slave).unwrap_or_else(|error| panic!("{error}"))
        })
        .collect();
    master.set_mode(Mode::Operate);
    (master, handles)
}

/// `profirust`'s master in Operate with so many slaves.
pub(crate) fn peers(slaves: u8) -> (PeerFdl, PeerDp<'static>, Vec<PeripheralHandle>) {
    let mut master = PeerDp::new(Vec::new());
    let handles = (FIRST_SLAVE..FIRST_SLAVE + slaves)
        .map(|address| {
            let options = PeripheralOptions {
                ident_number: IDENT,
                max_tsdr: 150,
                user_parameters: Some(&[]),
                config: Some(&IDENTIFIERS),
                ..Default::default()
            };
            master.add(Peripheral::new(address, options, vec![0; IMAGE], vec![0; IMAGE]))
        })
        .collect();
    let parameters = ParametersBuilder::new(MASTER, profirust::Baudrate::B1500000)
        .slot_bits(SLOT_BITS)
        .highest_station_address(MASTER + 1)
        .token_rotation_bits(ROTATION_BITS)
        .gap_wait_rotations(GAP_FACTOR)
        .build_verified(&master);
    let mut fdl = PeerFdl::new(parameters);
    fdl.set_online();
    master.enter_operate();
    (fdl, master, handles)
}
