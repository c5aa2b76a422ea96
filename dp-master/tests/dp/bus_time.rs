//! What a DP cycle costs on the line, against the sum of its telegrams and pauses.
//!
//! The ideal cycle of n slaves with 16 octets each way has no token: n · (request + min Tsdr + response + Tid1), for a
//! master alone has nobody to pass it to. A request and a response of 16 octets are SD2 telegrams of 9 + 16 = 25
//! characters of 11 bits; min Tsdr is 11 bits; Tid1 = max(Tsyn + Tsm, min Tsdr) with Tsyn = 33 and Tsm = 2 + 2·Tset + Tqui.
//!
//! Sources: EN 50170-2 part 4, 4.2.2 (message cycle time Tmc = Ts/r + Tsdr + Ta/r + Tid + 2·Ttd) and 4.1.7 (times); 9300
//! facts 1.6. The line here has no delay, so Ttd is 0.

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity, SlavePhase,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{PortId, VirtualBus, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, BitTimes, Instant};

const CHARACTERS: u64 = 9 + 16;

fn at(value: u8) -> Address {
    Address::new(value).unwrap()
}

/// Bits of the ideal cycle.
fn ideal(params: &BusParams, slaves: u64) -> u64 {
    let telegram = CHARACTERS * 11;
    slaves * (telegram + u64::from(params.t_sdr_min.0) + telegram + u64::from(params.t_id1.0))
}

struct Line {
    bus: VirtualBus,
    now: Instant,
    master: DpMaster<30>,
    slaves: Vec<DpSlave>,
    /// Of the master and then of the slaves.
    ports: Vec<PortId>,
}

impl Line {
    /// A master at address 1 with slaves from 10 on, all in data exchange and the GAP of the new ring searched.
    fn new(params: BusParams, slaves: u8) -> Self {
        let baud = params.baud;
        let mut master = DpMaster::new(MasterConfig::new(at(1), params)).unwrap();
        let mut bus = VirtualBus::new(baud);
        let mut ports = vec![bus.attach()];
        let mut stations = Vec::new();
        for address in (10..).take(usize::from(slaves)) {
            master
                .add_slave(SlaveConfig::new(at(address), 0x00DA, &[0xF3, 0xF3]).unwrap())
                .unwrap();
            let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
            stations.push(DpSlave::new(SlaveIdentity::new(at(address), 0x00DA, baud, accepted)).unwrap());
            ports.push(bus.attach());
        }
        master.set_mode(Mode::Operate);
        let mut line = Self {
            bus,
            now: Instant::ZERO,
            master,
            slaves: stations,
            ports,
        };
        // A first scan of 127 addresses; behind it one cycle for each.
        line.run_cycles(130, &params);
        assert!(line.all_exchange());
        line
    }

    fn all_exchange(&self) -> bool {
        let mut states = self.slaves.iter().map(DpSlave::phase);
        states.all(|phase| phase == SlavePhase::DataExchange)
    }

    fn run_cycles(&mut self, cycles: u64, params: &BusParams) {
        let goal = self.master.statistics().cycles + cycles;
        let span = params.baud.duration(BitTimes(20_000));
        while self.master.statistics().cycles < goal {
            self.now += span;
            let slaves = self.slaves.iter_mut().map(|slave| slave as &mut dyn Station);
            let stations = std::iter::once(&mut self.master as &mut dyn Station).chain(slaves);
            let mut stations: Vec<_> = self.ports.iter().copied().zip(stations).collect();
            pump(&mut self.bus, self.now, &mut stations);
        }
    }

    /// Mean bits of a cycle over at least this many cycles, tokens and questions for newcomers included.
    fn mean_cycle(&mut self, cycles: u64, params: &BusParams) -> f64 {
        let total = |line: &Self| {
            let statistics = line.master.statistics();
            statistics.mean_cycle.as_nanos() as f64 * statistics.cycles as f64
        };
        let (before, total_before) = (self.master.statistics().cycles, total(self));
        self.run_cycles(cycles, params);
        let count = (self.master.statistics().cycles - before) as f64;
        (total(self) - total_before) / count * f64::from(params.baud.bits_per_second()) / 1e9
    }
}

/// Every GAP address that is asked costs a slot time, so this is long enough to meet some: 10⁶ bits, and all of them at 10 cycles
/// of 30 slaves.
fn cycles(params: &BusParams, slaves: u64) -> u64 {
    1_000_000 / ideal(params, slaves) + 10
}

#[test]
fn at_every_baud_rate_a_cycle_is_within_2_percent_of_its_telegrams_and_pauses() {
    for baud in Baud::ALL {
        let params = BusParams::standard(baud);
        for slaves in [1, 30] {
            let mut line = Line::new(params, slaves);
            let ideal = ideal(&params, u64::from(slaves)) as f64;
            let ratio = line.mean_cycle(cycles(&params, u64::from(slaves)), &params) / ideal;
            println!("{baud}, {slaves} slaves: {ratio:.4} times the ideal of {ideal} tBIT");
            assert!((1.0..=1.02).contains(&ratio), "{baud}, {slaves} slaves: {ratio}");
            assert_eq!(line.bus.violations(), []);
        }
    }
}

#[test]
fn at_1500_kbit_a_cycle_is_at_most_1_02_times_the_ideal() {
    // 598 tBIT = 0.399 ms for one slave, 17 940 tBIT = 11.96 ms for thirty. Peers: 1.84 and 1.20.
    let params = BusParams::standard(Baud::B1500000);
    assert_eq!((ideal(&params, 1), ideal(&params, 30)), (598, 17_940));
    for slaves in [1, 30] {
        let mut line = Line::new(params, slaves);
        let ideal = ideal(&params, u64::from(slaves)) as f64;
        let ratio = line.mean_cycle(20_000_000 / ideal as u64, &params) / ideal;
        println!("{slaves} slaves: {ratio:.4} times the ideal");
        assert!((1.0..=1.02).contains(&ratio), "{slaves} slaves: {ratio}");
    }
}

#[test]
fn looking_for_newcomers_costs_a_master_alone_less_than_one_percent() {
    // Against the same master with nobody to look for: HSA 0 leaves address 0 alone.
    for baud in [Baud::B9600, Baud::B1500000, Baud::B12000000] {
        for slaves in [1, 30] {
            let looking = BusParams::standard(baud);
            let content = BusParams { hsa: at(0), ..looking };
            let [with, without] = [looking, content].map(|params| {
                let mut line = Line::new(params, slaves);
                line.mean_cycle(5_000_000 / ideal(&params, u64::from(slaves)), &params)
            });
            assert!(
                with / without < 1.01,
                "{baud}, {slaves} slaves: {with} for {without} tBIT"
            );
        }
    }
}

#[test]
fn a_small_ttr_costs_a_token_for_each_cycle_and_no_more() {
    // Ttr below a cycle: the hold time is used up every time, and the token goes round; questions for newcomers keep their distance.
    let params = BusParams {
        t_tr: BitTimes(500),
        ..BusParams::standard(Baud::B1500000)
    };
    let mut line = Line::new(params, 1);
    let token = f64::from(33 + params.t_id1.0);
    let most = (ideal(&params, 1) as f64 + token) * 1.01;
    let mean = line.mean_cycle(10_000, &params);
    assert!(mean <= most, "{mean} for {most} tBIT");
}
