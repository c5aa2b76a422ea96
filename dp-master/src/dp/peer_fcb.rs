//! Frame count bits towards stations that are no slaves of this master.

use crate::address::Address;
use crate::fdl::FcbCounter;

/// How many strangers are remembered.
const PEERS: usize = 16;

/// A small table; the station that was asked least recently gives way to a new one. A forgotten station is met with
/// first contact again, which is new to it whatever it remembers.
#[derive(Debug, Clone)]
pub(super) struct PeerFcbs {
    peers: [Peer; PEERS],
    asked: u64,
}

#[derive(Debug, Clone, Copy)]
struct Peer {
    /// Broadcast, which is no station, where a place is free.
    address: Address,
    counter: FcbCounter,
    asked: u64,
}

impl PeerFcbs {
    pub(super) const fn new() -> Self {
        let free = Peer {
            address: Address::BROADCAST,
            counter: FcbCounter::START,
            asked: 0,
        };
        Self {
            peers: [free; PEERS],
            asked: 0,
        }
    }

    /// The counter of a station, fresh when it is not known.
    pub(super) fn counter(&mut self, address: Address) -> &mut FcbCounter {
        self.asked += 1;
        let known = self.peers.iter().position(|peer| peer.address == address);
        let place = known.unwrap_or_else(|| {
            let places = self.peers.iter().enumerate();
            places.min_by_key(|(_, peer)| peer.asked).map_or(0, |(place, _)| place)
        });
        let peer = &mut self.peers[place % PEERS];
        if known.is_none() {
            peer.address = address;
            peer.counter = FcbCounter::START;
        }
        peer.asked = self.asked;
        &mut peer.counter
    }

    /// Meets every station with first contact from now on.
    pub(super) fn forget(&mut self) {
        *self = Self::new();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Fcb;

    fn address(value: u8) -> Address {
        Address::new(value).unwrap()
    }

    #[test]
    fn each_station_has_its_own_bit() {
        let mut peers = PeerFcbs::new();
        peers.counter(address(5)).confirm();
        assert_eq!(peers.counter(address(5)).current(), Fcb::Low);
        assert_eq!(peers.counter(address(6)).current(), Fcb::First);
        peers.forget();
        assert_eq!(peers.counter(address(5)).current(), Fcb::First);
    }

    #[test]
    fn the_station_asked_least_recently_is_forgotten() {
        let mut peers = PeerFcbs::new();
        for station in 0..PEERS as u8 {
            peers.counter(address(station)).confirm();
        }
        peers.counter(address(0));
        peers.counter(address(100)).confirm();
        assert_eq!(peers.counter(address(0)).current(), Fcb::Low);
        assert_eq!(peers.counter(address(100)).current(), Fcb::Low);
        assert_eq!(peers.counter(address(1)).current(), Fcb::First);
    }
}
