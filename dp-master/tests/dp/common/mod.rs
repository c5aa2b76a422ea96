//! A master and slaves on a virtual line, with a log of every telegram.

pub(crate) mod bench;
pub(crate) mod passive;
pub(crate) mod puppet;

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, MasterEvent, SlaveConfig, SlaveEvent, SlaveIdentity,
    SlaveIndex,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{PortId, VirtualBus, next_wakeup, pump};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};

pub(crate) const MASTER: Address = match Address::new(2) {
    Ok(address) => address,
    Err(_) => Address::BROADCAST,
};
pub(crate) const SLAVE: Address = match Address::new(3) {
    Ok(address) => address,
    Err(_) => Address::BROADCAST,
};

/// Eight octets each way, or the two blocks of the thesis.
pub(crate) fn slave_identity(baud: Baud) -> SlaveIdentity {
    SlaveIdentity::new(
        SLAVE,
        0x00DA,
        baud,
        AcceptedConfigurations::Table(&[&[0xF3], &[0xF3, 0xF3], &[0x20], &[0x10]]),
    )
}

/// A listener that joins the pieces in which the line delivers a transmission. A spoiled character shows as `??`.
pub(crate) struct Tap {
    baud: Baud,
    last_end: Instant,
    /// Every telegram in its order, as hexadecimal octets.
    pub(crate) log: Vec<String>,
    /// When the first bit of each telegram was sent.
    pub(crate) times: Vec<Instant>,
}

impl Tap {
    fn hear(&mut self, now: Instant, characters: &[Option<u8>]) {
        let begin = now - self.baud.characters(characters.len());
        // Rounding makes a character up to a nanosecond longer or shorter; the least pause between telegrams is 11 bits.
        if self.log.is_empty() || begin > self.last_end + self.baud.characters(1) - Duration::from_nanos(2) {
            self.log.push(String::new());
            self.times.push(begin);
        }
        self.last_end = now;
        let line = self.log.last_mut().unwrap();
        for character in characters {
            if !line.is_empty() {
                line.push(' ');
            }
            match character {
                Some(octet) => line.push_str(&format!("{octet:02X}")),
                None => line.push_str("??"),
            }
        }
    }
}

impl Station for Tap {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        let characters: Vec<_> = octets.iter().copied().map(Some).collect();
        self.hear(now, &characters);
    }
    fn handle_line_error(&mut self, now: Instant, _error: LineError) {
        self.hear(now, &[None]);
    }
    fn handle_sent(&mut self, _now: Instant) {}
    fn handle_timeout(&mut self, _now: Instant) {}
    fn poll_transmit(&mut self, _now: Instant, _buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        None
    }
    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}

/// A master and slaves on a line that is policed and logged.
pub(crate) struct Line {
    pub(crate) bus: VirtualBus,
    pub(crate) now: Instant,
    pub(crate) master: DpMaster<8>,
    pub(crate) master_port: PortId,
    pub(crate) indices: Vec<SlaveIndex>,
    pub(crate) slaves: Vec<DpSlave>,
    pub(crate) slave_ports: Vec<PortId>,
    /// Stations of other kinds.
    pub(crate) others: Vec<(PortId, Box<dyn Station>)>,
    pub(crate) tap: Tap,
    tap_port: PortId,
}

impl Line {
    /// Profile DP for one master: there is none above its address, so only two addresses are looked at for newcomers.
    pub(crate) fn new(baud: Baud, slaves: &[SlaveConfig]) -> Self {
        let params = BusParams {
            hsa: MASTER,
            ..BusParams::standard(baud)
        };
        Self::with_config(MasterConfig::new(MASTER, params), slaves)
    }

    pub(crate) fn with_config(config: MasterConfig, slaves: &[SlaveConfig]) -> Self {
        let baud = config.params.baud;
        let mut master = DpMaster::new(config).unwrap();
        let indices = slaves.iter().map(|slave| master.add_slave(*slave).unwrap()).collect();
        let mut bus = VirtualBus::new(baud);
        let master_port = bus.attach();
        let tap_port = bus.attach();
        Self {
            bus,
            now: Instant::ZERO,
            master,
            master_port,
            indices,
            slaves: Vec::new(),
            slave_ports: Vec::new(),
            others: Vec::new(),
            tap: Tap {
                baud,
                last_end: Instant::ZERO,
                log: Vec::new(),
                times: Vec::new(),
            },
            tap_port,
        }
    }

    pub(crate) fn add_slave(&mut self, identity: SlaveIdentity) -> usize {
        self.slaves.push(DpSlave::new(identity).unwrap());
        self.slave_ports.push(self.bus.attach());
        self.slaves.len() - 1
    }

    pub(crate) fn add_station(&mut self, station: Box<dyn Station>) {
        self.others.push((self.bus.attach(), station));
    }

    /// Power off and on, with another identity if need be.
    pub(crate) fn replace_slave(&mut self, slave: usize, identity: SlaveIdentity) {
        self.slaves[slave] = DpSlave::new(identity).unwrap();
    }

    /// Everything up to the next wake-up.
    pub(crate) fn step(&mut self) {
        self.step_to(Instant::MAX);
    }

    /// The same with further stations of the test.
    pub(crate) fn step_with(&mut self, more: &mut [(PortId, &mut dyn Station)]) {
        self.advance(Instant::MAX, more);
    }

    /// Everything up to the next wake-up or `limit`, whichever comes first.
    fn step_to(&mut self, limit: Instant) {
        self.advance(limit, &mut []);
    }

    fn advance(&mut self, limit: Instant, more: &mut [(PortId, &mut dyn Station)]) {
        let Self {
            bus,
            now,
            master,
            master_port,
            slaves,
            slave_ports,
            others,
            tap,
            tap_port,
            ..
        } = self;
        let mut stations: Vec<(PortId, &mut dyn Station)> = vec![(*master_port, master), (*tap_port, tap)];
        for (slave, port) in slaves.iter_mut().zip(slave_ports.iter()) {
            stations.push((*port, slave));
        }
        stations.extend(others.iter_mut().map(|(port, station)| (*port, station.as_mut() as _)));
        for (port, station) in more {
            stations.push((*port, &mut **station));
        }
        let at = next_wakeup(bus, &stations).unwrap_or(limit);
        *now = (*now).max(at.min(limit));
        pump(bus, *now, &mut stations);
    }

    /// Steps until the condition holds; the bound is two seconds of machine time.
    pub(crate) fn run_until(&mut self, mut done: impl FnMut(&Self) -> bool) {
        let end = self.now + Duration::from_millis(2_000);
        while !done(self) {
            assert!(self.now < end, "not reached:\n{}", self.tap.log.join("\n"));
            self.step();
        }
    }

    pub(crate) fn run_for(&mut self, span: Duration) {
        let end = self.now + span;
        while self.now < end {
            self.step_to(end);
        }
    }

    pub(crate) fn master_events(&mut self) -> Vec<MasterEvent> {
        std::iter::from_fn(|| self.master.poll_event()).collect()
    }

    pub(crate) fn slave_events(&mut self, slave: usize) -> Vec<SlaveEvent> {
        std::iter::from_fn(|| self.slaves[slave].poll_event()).collect()
    }

    /// Nobody broke a rule.
    pub(crate) fn assert_no_violations(&self) {
        assert_eq!(self.bus.violations(), []);
    }
}
