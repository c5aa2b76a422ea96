//! How much of the bus's time a master uses for its cycle: both masters on the same virtual line.

use dp_master::address::Address;
use dp_master::dp::{AcceptedConfigurations, DpMaster, DpSlave, SlaveIdentity, SlaveIndex};
use dp_master::phy::{PortId, VirtualBus, next_wakeup, pump};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{BitTimes, Duration, Instant};
use profirust::dp::DpMaster as PeerDp;
use profirust::fdl::FdlActiveStation as PeerFdl;
use profirust::phy::ProfibusPhy;
use profirust::time::Instant as PeerInstant;

use crate::masters::{self, BAUD};
use crate::slaves::{FIRST_SLAVE, IDENT, IDENTIFIERS};

/// What a cycle took on the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BusTime {
    /// Slaves with 16 octets in and 16 out.
    pub slaves: u8,
    /// Mean of the cycles.
    pub cycle: Duration,
    /// The least a cycle could take.
    pub ideal: Duration,
}

impl BusTime {
    /// How often the ideal fits into the cycle.
    pub fn ratio(&self) -> f64 {
        self.cycle.as_nanos() as f64 / self.ideal.as_nanos() as f64
    }
}

/// Request and reply of 16 octets: 25 characters each.
const CHARACTERS: u32 = 25;
/// min Tsdr.
const T_SDR: u32 = 11;
/// Tsyn: no request may come sooner after a reply.
const T_SYN: u32 = 33;
/// Cycles before the measurement begins, and those it takes. A multiple of both GAP factors, so that whole rounds count.
const START_UP: u64 = 500;
const CYCLES: u64 = 2_000;

/// Each slave's request, Tsdr, reply and Tsyn, and nothing else.
fn ideal(slaves: u8) -> Duration {
    let exchange = 2 * CHARACTERS * 11 + T_SDR + T_SYN;
    BAUD.duration(BitTimes(exchange * u32::from(slaves)))
}

/// A master that counts its cycles.
trait Cycling: Station {
    fn cycles(&self) -> u64;
}

/// This stack's master with so many slaves, 1…30.
pub fn ours(slaves: u8) -> BusTime {
    let (master, handles) = masters::ours(slaves);
    let Some(&last) = handles.last() else {
        panic!("at least one slave is needed");
    };
    measure(Ours { master, last }, slaves)
}

/// `profirust`'s master with so many slaves, called every microsecond: its clock counts no finer.
pub fn peers(slaves: u8) -> BusTime {
    let (fdl, master, _) = masters::peers(slaves);
    let peer = Peers {
        fdl,
        master,
        port: LinePort::default(),
        next_call: Instant::ZERO,
        cycles: 0,
    };
    measure(peer, slaves)
}

fn measure(mut master: impl Cycling, slaves: u8) -> BusTime {
    let mut answering: Vec<DpSlave> = (FIRST_SLAVE..FIRST_SLAVE + slaves).map(slave).collect();
    let mut bus = VirtualBus::new(BAUD);
    let ports: Vec<PortId> = (0..=slaves).map(|_| bus.attach()).collect();
    let mut now = Instant::ZERO;
    let mut run_to = |cycles: u64| {
        while master.cycles() < cycles {
            let mut stations: Vec<(PortId, &mut dyn Station)> = vec![(ports[0], &mut master)];
            stations.extend(
                ports[1..]
                    .iter()
                    .zip(&mut answering)
                    .map(|(&port, slave)| (port, slave as &mut dyn Station)),
            );
            let Some(next) = next_wakeup(&bus, &stations) else {
                panic!("nobody waits for anything");
            };
            now = now.max(next);
            pump(&mut bus, now, &mut stations);
        }
        now
    };
    let begin = run_to(START_UP);
    let end = run_to(START_UP + CYCLES);
    assert_eq!(bus.violations(), [], "a rule of the line was broken");
    BusTime {
        slaves,
        cycle: Duration::from_nanos((end - begin).as_nanos() / CYCLES),
        ideal: ideal(slaves),
    }
}

fn slave(address: u8) -> DpSlave {
    let address = Address::new(address).unwrap_or_else(|error| panic!("{error}"));
    let accepted = AcceptedConfigurations::Table(&[&IDENTIFIERS]);
    DpSlave::new(SlaveIdentity::new(address, IDENT, BAUD, accepted)).unwrap_or_else(|error| panic!("{error}"))
}

struct Ours {
    master: DpMaster<30>,
    last: SlaveIndex,
}

impl Cycling for Ours {
    fn cycles(&self) -> u64 {
        self.master.exchanges(self.last)
    }
}

impl Station for Ours {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.master.handle_octets(now, octets);
    }
    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.master.handle_line_error(now, error);
    }
    fn handle_sent(&mut self, now: Instant) {
        self.master.handle_sent(now);
    }
    fn handle_timeout(&mut self, now: Instant) {
        self.master.handle_timeout(now);
    }
    fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        self.master.poll_transmit(now, buf)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.master.poll_timeout()
    }
}

/// The peer behind the interface of a station.
struct Peers {
    fdl: PeerFdl,
    master: PeerDp<'static>,
    port: LinePort,
    next_call: Instant,
    cycles: u64,
}

impl Cycling for Peers {
    fn cycles(&self) -> u64 {
        self.cycles
    }
}

impl Station for Peers {
    fn handle_octets(&mut self, _: Instant, octets: &[u8]) {
        self.port.received.extend_from_slice(octets);
    }
    fn handle_line_error(&mut self, _: Instant, error: LineError) {
        panic!("nothing disturbs this line: {error}");
    }
    fn handle_sent(&mut self, _: Instant) {
        self.port.sending = false;
    }
    fn handle_timeout(&mut self, now: Instant) {
        let micros = i64::try_from(now.as_nanos() / 1_000).unwrap_or(i64::MAX);
        self.fdl
            .poll(PeerInstant::from_micros(micros), &mut self.port, &mut self.master);
        self.cycles += u64::from(self.master.take_last_events().cycle_completed);
        self.next_call = now + Duration::from_micros(1);
    }
    fn poll_transmit(&mut self, _: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        if self.port.to_send.is_empty() {
            return None;
        }
        let length = self.port.to_send.len();
        buf[..length].copy_from_slice(&self.port.to_send);
        self.port.to_send.clear();
        self.port.sending = true;
        Some(length)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.next_call)
    }
}

#[derive(Default)]
struct LinePort {
    to_send: Vec<u8>,
    sending: bool,
    received: Vec<u8>,
}

impl ProfibusPhy for LinePort {
    fn poll_transmission(&mut self, _: PeerInstant) -> bool {
        self.sending || !self.to_send.is_empty()
    }

    fn transmit_data<F, R>(&mut self, _: PeerInstant, fill: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let mut telegram = [0; MAX_TELEGRAM];
        let (length, result) = fill(&mut telegram);
        self.to_send.extend_from_slice(&telegram[..length]);
        result
    }

    fn receive_data<F, R>(&mut self, _: PeerInstant, take: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let (taken, result) = take(&self.received);
        self.received.drain(..taken);
        result
    }
}
