//! A master and two slaves on a virtual line, disturbed in every way that the line knows and some more.

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, ControlCommand, DpMaster, DpSlave, ExtDiag, GlobalControl, JobRequest, MasterConfig, Mode,
    Overflow, SlaveConfig, SlaveIdentity, SlaveIndex, Watchdog,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{PortId, Script, VirtualBus, next_wakeup, pump};
use dp_master::station::{LineError, Station};
use dp_master::time::{Baud, Duration, Instant};

use super::input::Input;

const BAUD: Baud = Baud::B1500000;
const IDENT: u16 = 0x00DA;
const CONFIGURATION: &[u8] = &[0x31];
const CONFIGURATIONS: &[&[u8]] = &[CONFIGURATION];

struct Bench {
    bus: VirtualBus,
    ports: [PortId; 3],
    /// A port from which anything may be said.
    stranger: PortId,
    master: DpMaster<4>,
    indices: [SlaveIndex; 2],
    slaves: [DpSlave; 2],
    now: Instant,
}

impl Bench {
    fn new(settings: u8) -> Self {
        let mut bus = VirtualBus::new(BAUD);
        let ports = [bus.attach(), bus.attach(), bus.attach()];
        let stranger = bus.attach();
        let plc = Address::new(2).unwrap();
        let mut master = DpMaster::new(MasterConfig::new(plc, BusParams::standard(BAUD))).unwrap();
        let addresses = [3, 4].map(|address| Address::new(address).unwrap());
        let indices = addresses.map(|address| {
            let mut slave = SlaveConfig::new(address, IDENT, CONFIGURATION).unwrap();
            slave.group = 1;
            if settings & 1 != 0 {
                slave.watchdog = Some(Watchdog::at_least(Duration::from_millis(20)).unwrap());
            }
            master.add_slave(slave).unwrap()
        });
        let slaves = addresses.map(|address| {
            let accepted = AcceptedConfigurations::Table(CONFIGURATIONS);
            DpSlave::new(SlaveIdentity::new(address, IDENT, BAUD, accepted)).unwrap()
        });
        Self {
            bus,
            ports,
            stranger,
            master,
            indices,
            slaves,
            now: Instant::ZERO,
        }
    }

    /// Goes to the next wake-up, at most so far.
    fn step(&mut self, limit: Instant) {
        let [first, second] = &mut self.slaves;
        let mut stations: [(PortId, &mut dyn Station); 3] = [
            (self.ports[0], &mut self.master),
            (self.ports[1], first),
            (self.ports[2], second),
        ];
        let next = next_wakeup(&self.bus, &stations).unwrap_or(limit).min(limit);
        self.now = self.now.max(next);
        pump(&mut self.bus, self.now, &mut stations);
    }

    fn run_for(&mut self, span: Duration) {
        let end = self.now + span;
        while self.now < end {
            self.step(end);
        }
    }

    fn exchanges(&self) -> u64 {
        self.indices
            .iter()
            .map(|index| self.master.exchanges(*index))
            .min()
            .unwrap_or(0)
    }

    /// Runs until both slaves have exchanged data so many times, at most two seconds.
    fn exchange(&mut self, times: u64) -> bool {
        let (wanted, end) = (self.exchanges() + times, self.now + Duration::from_millis(2_000));
        while self.exchanges() < wanted && self.now < end {
            self.step(end);
        }
        self.exchanges() >= wanted
    }

    fn check(&self) {
        for index in self.indices {
            assert_eq!(self.master.inputs(index).len(), 2);
        }
    }
}

pub(crate) fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let settings = input.octet();
    let mut bench = Bench::new(settings);
    bench.master.set_mode(Mode::Operate);
    if settings & 2 != 0 {
        assert!(bench.exchange(3), "the exchange was not reached");
    }

    while !input.is_empty() {
        let burst = bench.bus.bursts() + u64::from(input.octet() & 7);
        match input.below(14) {
            0 => bench.bus.script(Script::Drop { burst }),
            1 | 2 => {
                let character = usize::from(input.octet() & 31);
                let bits = u16::from_be_bytes([input.octet(), input.octet()]) & 0x7FF;
                bench.bus.script(Script::Flip { burst, character, bits });
            }
            3 => bench.bus.script(Script::Spoil {
                burst,
                character: usize::from(input.octet() & 31),
                error: LineError::Parity,
            }),
            4 => {
                let to = bench.now + Duration::from_micros(u64::from(input.octet()) * 20);
                bench.bus.script(Script::Cut { from: bench.now, to });
            }
            5 => {
                let octets = input.octets();
                let (now, stranger) = (bench.now, bench.stranger);
                if !bench.bus.is_sending(stranger) {
                    bench.bus.transmit(now, stranger, octets);
                }
            }
            6 => {
                // A token from somewhere to someone.
                let token = [0xDC, input.octet() & 0x7F, input.octet() & 0x7F];
                let (now, stranger) = (bench.now, bench.stranger);
                if !bench.bus.is_sending(stranger) {
                    bench.bus.transmit(now, stranger, &token);
                }
            }
            7 => bench.master.set_mode(match input.below(3) {
                0 => Mode::Stop,
                1 => Mode::Clear,
                _ => Mode::Operate,
            }),
            8 => {
                let outputs = [input.octet(), input.octet()];
                bench.master.set_outputs(bench.indices[0], &outputs).unwrap();
                bench.slaves[1].set_inputs(&outputs);
            }
            9 => {
                // Refused in Stop and with a full queue.
                let _ = bench.master.send_control(GlobalControl {
                    command: ControlCommand(input.octet()),
                    group_select: input.octet(),
                });
            }
            10 => {
                let octets = input.octets();
                let _ = bench.slaves[0].set_ext_diag(ExtDiag::Fault, octets, Overflow::Complete);
            }
            11 => {
                let peer = Address::new(input.octet() & 0x7F).unwrap_or(Address::BROADCAST);
                let (dsap, ssap) = (input.octet() & 63, input.octet() & 63);
                let octets = input.octets();
                let octets = octets.get(..244).unwrap_or(octets);
                let mut request = JobRequest::srd(peer, dsap, ssap, octets);
                if settings & 4 != 0 {
                    request = request.polling(Duration::from_millis(5));
                }
                let _ = bench.master.jobs().submit(&request);
            }
            12 => while bench.master.poll_event().is_some() {},
            _ => {}
        }
        bench.run_for(Duration::from_micros(u64::from(input.octet()) * 10));
        bench.check();
    }

    // The line is undisturbed again: within two seconds the slaves get what was set for them.
    bench.run_for(Duration::from_millis(30));
    bench.master.set_mode(Mode::Operate);
    let release = GlobalControl {
        command: ControlCommand::UNSYNC.with(ControlCommand::UNFREEZE),
        group_select: 0,
    };
    for _ in 0..100 {
        if bench.master.send_control(release).is_ok() {
            break;
        }
        // Commands still wait for a slave that can obey.
        bench.run_for(Duration::from_millis(5));
    }
    for (index, outputs) in bench.indices.into_iter().zip([[0x12, 0x34], [0x56, 0x78]]) {
        bench.master.set_outputs(index, &outputs).unwrap();
    }
    for (slave, inputs) in bench.slaves.iter_mut().zip([[0xAB, 0xCD], [0xEF, 0x01]]) {
        slave.set_inputs(&inputs);
    }
    assert!(bench.exchange(5), "the exchange did not come back");
    assert_eq!(bench.slaves[0].outputs(), [0x12, 0x34]);
    assert_eq!(bench.slaves[1].outputs(), [0x56, 0x78]);
    assert_eq!(bench.master.inputs(bench.indices[0]), [0xAB, 0xCD]);
    assert_eq!(bench.master.inputs(bench.indices[1]), [0xEF, 0x01]);
    bench.check();
}
