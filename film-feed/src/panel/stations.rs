//! Who is on the line, asked when a page wants to know.

use dp_master::address::Address;
use dp_master::dp::DpMaster;
use dp_master::dp::class2::{LiveList, Scan};
use dp_master::wire::StationType;

/// The live list of one master; empty until it is asked for.
#[derive(Debug, Default)]
pub(super) struct Stations {
    list: Option<LiveList>,
}

impl Stations {
    /// Asks all addresses anew; a round under way is given up.
    pub(super) fn ask<const N: usize>(&mut self, master: &mut DpMaster<N>) {
        if let Some(mut list) = self.list.take() {
            list.cancel(master.jobs());
        }
        self.list = Some(LiveList::new(master.address(), Address::MAX_STATION, Scan::Once));
    }

    /// Goes on; to be called whenever the master was worked.
    pub(super) fn work<const N: usize>(&mut self, master: &mut DpMaster<N>) {
        let Some(list) = &mut self.list else { return };
        // What is new is kept by the list itself.
        while !list.is_finished() && list.poll(master.jobs()).is_some() {}
    }

    /// Whether addresses are still to be asked.
    pub(super) fn are_asked(&self) -> bool {
        self.list.as_ref().is_some_and(|list| !list.is_finished())
    }

    /// Who is there so far: address and kind.
    pub(super) fn found(&self) -> Vec<(u8, &'static str)> {
        let kind = |station| match station {
            StationType::Slave => "slave",
            StationType::MasterNotReady => "master, not ready for the ring",
            StationType::MasterReady => "master, ready for the ring",
            StationType::MasterInRing => "master in the ring",
        };
        let stations = self.list.iter().flat_map(LiveList::stations);
        stations
            .map(|(address, station)| (address.value(), kind(station)))
            .collect()
    }
}
