//! Several masters with their slaves on one line, which may be cut in two.

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, MasterEvent, Mode, SlaveConfig, SlaveIdentity, SlaveIndex,
    SlaveState, Watchdog,
};
use dp_master::fdl::{BusParams, FdlState, Las, RingEvent};
use dp_master::phy::{PortId, VirtualBus, next_wakeup, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, BitTimes, Duration, Instant};

pub(crate) const BAUD: Baud = Baud::B1500000;

pub(crate) fn at(value: u8) -> Address {
    Address::new(value).unwrap()
}

/// The standard parameters with a small HSA, so that a look over the whole GAP does not take seconds.
pub(crate) fn params(hsa: u8) -> BusParams {
    BusParams {
        hsa: at(hsa),
        ..BusParams::standard(BAUD)
    }
}

pub(crate) struct Master {
    pub(crate) address: Address,
    pub(crate) params: BusParams,
    slaves: Vec<SlaveConfig>,
    pub(crate) port: PortId,
    /// `None` while it is switched off.
    pub(crate) station: Option<DpMaster<8>>,
    pub(crate) indices: Vec<SlaveIndex>,
    /// Everything it reported since it was switched on.
    pub(crate) events: Vec<(Instant, MasterEvent)>,
    half: Half,
}

/// On which side of the cut a station is; without a cut everybody is on the near one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Half {
    Near,
    Far,
}

/// Masters and slaves on a line.
pub(crate) struct Bench {
    pub(crate) now: Instant,
    /// Every station has the same port on both halves.
    pub(crate) halves: [VirtualBus; 2],
    pub(crate) masters: Vec<Master>,
    pub(crate) slaves: Vec<DpSlave>,
    slave_ports: Vec<PortId>,
    slave_halves: Vec<Half>,
    /// When more than one master held the token for the last time, seen over all halves that are joined.
    pub(crate) last_double: Option<Instant>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self {
            now: Instant::ZERO,
            halves: [VirtualBus::new(BAUD), VirtualBus::new(BAUD)],
            masters: Vec::new(),
            slaves: Vec::new(),
            slave_ports: Vec::new(),
            slave_halves: Vec::new(),
            last_double: None,
        }
    }

    /// Masters at these addresses, all switched off, without slaves.
    pub(crate) fn with_masters(addresses: &[u8], params: BusParams) -> Self {
        let mut bench = Self::new();
        for &address in addresses {
            bench.add_master(address, params, &[]);
        }
        bench
    }

    /// The same with one slave each, at the master's address + 40.
    pub(crate) fn with_slaves(addresses: &[u8], params: BusParams) -> Self {
        let mut bench = Self::new();
        for &address in addresses {
            bench.add_master(address, params, &[address + 40]);
        }
        bench
    }

    fn attach(&mut self) -> PortId {
        self.halves[1].attach();
        self.halves[0].attach()
    }

    /// A master that is switched off, and its slaves, which are on.
    pub(crate) fn add_master(&mut self, address: u8, params: BusParams, slaves: &[u8]) -> usize {
        let port = self.attach();
        let configs = slaves
            .iter()
            .map(|&slave| {
                let mut config = SlaveConfig::new(at(slave), 0x00DA, &[0xF3]).unwrap();
                config.watchdog = Some(Watchdog::at_least(Duration::from_millis(500)).unwrap());
                config
            })
            .collect();
        for &slave in slaves {
            let accepted = AcceptedConfigurations::Table(&[&[0xF3]]);
            let identity = SlaveIdentity::new(at(slave), 0x00DA, BAUD, accepted);
            self.slaves.push(DpSlave::new(identity).unwrap());
            let port = self.attach();
            self.slave_ports.push(port);
            self.slave_halves.push(Half::Near);
        }
        self.masters.push(Master {
            address: at(address),
            params,
            slaves: configs,
            port,
            station: None,
            indices: Vec::new(),
            events: Vec::new(),
            half: Half::Near,
        });
        self.masters.len() - 1
    }

    pub(crate) fn power_on(&mut self, master: usize) {
        let master = &mut self.masters[master];
        if master.station.is_some() {
            return;
        }
        for half in &mut self.halves {
            half.reconnect(master.port);
        }
        let mut station = DpMaster::new(MasterConfig::new(master.address, master.params)).unwrap();
        master.indices = master
            .slaves
            .iter()
            .map(|slave| station.add_slave(*slave).unwrap())
            .collect();
        station.set_mode(Mode::Operate);
        master.station = Some(station);
        master.events.clear();
    }

    /// At once, in the middle of a telegram if need be.
    pub(crate) fn power_off(&mut self, master: usize) {
        let master = &mut self.masters[master];
        master.station = None;
        for half in &mut self.halves {
            half.disconnect(master.port);
        }
    }

    /// Cuts the line: these masters are on the far half from now on, and every slave is where its master is.
    ///
    /// The cut waits until nobody is speaking there: what a cut telegram does is tested elsewhere.
    pub(crate) fn cut(&mut self, far: &[usize]) {
        self.regroup(|place| if far.contains(&place) { Half::Far } else { Half::Near });
    }

    pub(crate) fn rejoin(&mut self) {
        self.regroup(|_| Half::Near);
    }

    fn regroup(&mut self, half: impl Fn(usize) -> Half) {
        while self.anybody_sends() {
            self.step_to(Instant::MAX);
        }
        let mut slave = 0;
        for (place, master) in self.masters.iter_mut().enumerate() {
            master.half = half(place);
            for _ in &master.slaves {
                self.slave_halves[slave] = master.half;
                slave += 1;
            }
        }
    }

    fn anybody_sends(&self) -> bool {
        let ports = self.masters.iter().map(|master| master.port);
        let mut ports = ports.chain(self.slave_ports.iter().copied());
        ports.any(|port| self.halves.iter().any(|half| half.is_sending(port)))
    }

    pub(crate) fn station(&self, master: usize) -> &DpMaster<8> {
        self.masters[master].station.as_ref().unwrap()
    }

    pub(crate) fn state(&self, master: usize) -> FdlState {
        self.station(master).fdl_state()
    }

    /// Up to the next wake-up or `limit`, whichever comes first.
    pub(crate) fn step_to(&mut self, limit: Instant) {
        let mut next = limit;
        for pass in 0..2 {
            for (index, half) in [Half::Near, Half::Far].into_iter().enumerate() {
                let bus = &mut self.halves[index];
                let mut stations: Vec<(PortId, &mut dyn Station)> = Vec::new();
                for master in &mut self.masters {
                    if let Some(station) = &mut master.station
                        && master.half == half
                    {
                        stations.push((master.port, station));
                    }
                }
                let slaves = self.slaves.iter_mut().zip(&self.slave_ports).zip(&self.slave_halves);
                for ((slave, port), here) in slaves {
                    if *here == half {
                        stations.push((*port, slave));
                    }
                }
                if pass == 0 {
                    next = next_wakeup(bus, &stations).unwrap_or(limit).min(next);
                } else {
                    pump(bus, self.now, &mut stations);
                }
            }
            self.now = self.now.max(next);
        }
        self.observe();
    }

    fn observe(&mut self) {
        for master in &mut self.masters {
            if let Some(station) = &mut master.station {
                let now = self.now;
                master
                    .events
                    .extend(std::iter::from_fn(|| station.poll_event()).map(|event| (now, event)));
            }
        }
        for half in [Half::Near, Half::Far] {
            if self.holders(half).len() > 1 {
                self.last_double = Some(self.now);
            }
        }
    }

    /// Who holds the token.
    pub(crate) fn holders(&self, half: Half) -> Vec<Address> {
        self.masters
            .iter()
            .filter(|master| master.half == half)
            .filter(|master| master.station.as_ref().is_some_and(DpMaster::holds_token))
            .map(|master| master.address)
            .collect()
    }

    pub(crate) fn run_for(&mut self, span: Duration) {
        let end = self.now + span;
        while self.now < end {
            self.step_to(end);
        }
    }

    /// Steps until the condition holds; tells how long that took.
    pub(crate) fn run_until(&mut self, bound: Duration, mut done: impl FnMut(&Self) -> bool) -> Duration {
        let start = self.now;
        while !done(self) {
            assert!(
                self.now - start <= bound,
                "not reached within {bound} from {start}: {}",
                self.describe()
            );
            self.step_to(start + bound + Duration::from_nanos(1));
        }
        self.now - start
    }

    /// Steps until the condition has held for `span` on end, which must begin within the bound.
    ///
    /// What masters believe of a ring stays right for a moment after it has come apart: nobody has noticed yet.
    pub(crate) fn run_until_lasting(&mut self, bound: Duration, span: Duration, holds: impl Fn(&Self) -> bool) {
        let latest = self.now + bound;
        loop {
            self.run_until(latest - self.now, &holds);
            let since = self.now;
            while holds(self) {
                if self.now - since >= span {
                    return;
                }
                self.step_to(since + span);
            }
        }
    }

    pub(crate) fn live(&self) -> Las {
        let live = self.masters.iter().filter(|master| master.station.is_some());
        live.map(|master| master.address).collect()
    }

    /// Whether all masters that are on form one ring and know it.
    pub(crate) fn is_one_ring(&self) -> bool {
        self.is_ring_of(self.live())
    }

    pub(crate) fn is_ring_of(&self, members: Las) -> bool {
        self.masters
            .iter()
            .filter(|master| members.contains(master.address))
            .filter_map(|master| master.station.as_ref())
            .all(|station| station.is_in_ring() && station.las() == members)
    }

    pub(crate) fn all_exchange(&self) -> bool {
        self.masters.iter().all(|master| {
            master.station.as_ref().is_none_or(|station| {
                let mut slaves = master.indices.iter();
                slaves.all(|slave| station.state(*slave) == SlaveState::DataExchange)
            })
        })
    }

    pub(crate) fn ring_events(&self, master: usize) -> Vec<RingEvent> {
        let events = self.masters[master].events.iter();
        events
            .filter_map(|(_, event)| match event {
                MasterEvent::Ring(event) => Some(*event),
                _ => None,
            })
            .collect()
    }

    pub(crate) fn assert_no_violations(&self) {
        for half in &self.halves {
            let first = &half.violations()[..half.violations().len().min(3)];
            assert_eq!(first, [], "{}", self.describe());
        }
    }

    pub(crate) fn describe(&self) -> String {
        let mut text = format!("{}\n", self.now);
        for master in &self.masters {
            match &master.station {
                None => text += &format!("{}: off\n", master.address),
                Some(station) => {
                    let las: Vec<_> = station.las().iter().map(Address::value).collect();
                    let events: Vec<_> = master.events.iter().rev().take(6).rev().collect();
                    text += &format!(
                        "{}: {:?} {:?} member {} {las:?}, last events {events:?}\n",
                        master.address,
                        master.half,
                        station.fdl_state(),
                        station.is_in_ring()
                    );
                }
            }
        }
        text
    }
}

/// A DP cycle of one slave with eight octets each way, at most a repetition and Global_Control with it.
pub(crate) const CYCLE: u64 = 2 * (17 * 11 * 2 + 11 + 300 + 37) + 200;

pub(crate) fn bits(count: u64) -> Duration {
    BAUD.duration(BitTimes(u32::try_from(count).unwrap()))
}

/// Times of the standard, computed here from the parameters and not taken from the code under test.
#[derive(Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) slot: u64,
    pub(crate) id1: u64,
    pub(crate) t_tr: u64,
    pub(crate) gap_factor: u64,
    pub(crate) hsa: u64,
}

impl Bounds {
    pub(crate) fn of(params: &BusParams) -> Self {
        Self {
            slot: u64::from(params.t_sl.0),
            id1: u64::from(params.t_id1.0),
            t_tr: u64::from(params.t_tr.0),
            gap_factor: u64::from(params.gap_factor),
            hsa: u64::from(params.hsa.value()),
        }
    }

    /// Ttimeout of a master in bits: 6·Tsl + 2·n·Tsl (EN 50170-2 part 4, 4.1.1.3 and 4.4).
    pub(crate) fn timeout(self, address: u8) -> u64 {
        (6 + 2 * u64::from(address)) * self.slot
    }

    /// A token and its idle time.
    pub(crate) fn token(self) -> u64 {
        33 + self.id1
    }

    /// A question to an address where nobody is.
    pub(crate) fn gap_request(self) -> u64 {
        66 + self.slot + self.id1
    }

    /// All questions of an initialisation, with its two tokens.
    pub(crate) fn initialisation(self) -> u64 {
        2 * self.token() + (self.hsa + 1) * self.gap_request() + self.token()
    }

    /// The longest time until a master alone has asked every address: gap_factor rotations and a rotation for each
    /// address, none longer than 512 tokens or 160 questions and the exchange that was under way.
    pub(crate) fn lone_scan(self, cycle: u64) -> u64 {
        let rotation = self.t_tr.min(512 * self.token()) + cycle + self.token() + self.gap_request();
        let between = rotation + 160 * self.gap_request();
        (self.gap_factor + 1) * rotation + (self.hsa + 2) * between
    }

    /// The longest rotation of `masters` whose DP cycles take `cycle` bits each. Every one asks one address at most and may find
    /// its successor gone (three tokens, three slots).
    pub(crate) fn rotation(self, masters: u64, cycle: u64) -> u64 {
        masters * (cycle + self.gap_request() + self.token() + 3 * (self.token() + self.slot))
    }

    /// The longest time until a ring has asked every address of every GAP, put off once for each when the token is late.
    pub(crate) fn ring_scan(self, masters: u64, cycle: u64) -> u64 {
        (self.gap_factor + 2 * (self.hsa + 2)) * self.rotation(masters, cycle)
    }

    /// How long masters may take to form one ring after the last of them was switched on or the line was last disturbed:
    /// the last Ttimeout, an initialisation, and for each of the others the search of a master alone and of the ring that
    /// grows.
    pub(crate) fn formation(self, addresses: &[u8]) -> u64 {
        let highest = addresses.iter().copied().max().unwrap();
        let masters = addresses.len() as u64;
        self.timeout(highest) + self.initialisation() + self.lone_scan(CYCLE) + masters * self.ring_scan(masters, CYCLE)
    }

    /// How long a ring is without its dead member: the telegram that was under way, the silence until the lowest of the
    /// others claims the token, and two rotations in which it is offered the token in vain and the others hear that.
    pub(crate) fn recovery(self, lowest: u8, masters: u64) -> u64 {
        255 * 11 + self.timeout(lowest) + 2 * self.rotation(masters, CYCLE)
    }

    /// The longest that two tokens may go on beside each other on one line: until two masters that speak in step with each
    /// other drift apart, which takes the search of each of them and 11 bits of drift, one or more with every token to
    /// itself; then two rotations until whoever is passed over gives up.
    pub(crate) fn doubled(self, masters: u64) -> u64 {
        let drift = 11 * (self.token() + 127);
        self.initialisation() + drift + 512 * self.token() + 2 * self.rotation(masters, CYCLE)
    }
}
