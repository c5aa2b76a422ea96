//! One DP cycle with one slave, 16 octets each way: through the virtual line, and the two stations alone.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity, SlaveIndex, SlaveState,
};
use dp_master::fdl::BusParams;
use dp_master::phy::{PortId, VirtualBus, next_wakeup, pump};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Instant};

const BAUD: Baud = Baud::B12000000;

fn stations() -> (DpMaster<1>, SlaveIndex, DpSlave) {
    let address = |value| Address::new(value).expect("a station address");
    let config = MasterConfig::new(address(2), BusParams::standard(BAUD));
    let mut master = DpMaster::new(config).expect("standard parameters");
    let identifiers = [0xF3, 0xF3];
    let slave = SlaveConfig::new(address(3), 0x00DA, &identifiers).expect("a configuration");
    let index = master.add_slave(slave).expect("room for one slave");
    master.set_mode(Mode::Operate);
    let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
    let identity = SlaveIdentity::new(address(3), 0x00DA, BAUD, accepted);
    (master, index, DpSlave::new(identity).expect("a slave"))
}

fn through_the_line(criterion: &mut Criterion) {
    let (mut master, index, mut slave) = stations();
    let mut bus = VirtualBus::new(BAUD);
    let ports = [bus.attach(), bus.attach()];
    let mut now = Instant::ZERO;
    let mut cycle = |master: &mut DpMaster<1>, slave: &mut DpSlave| {
        let done = master.statistics().cycles + 1;
        while master.statistics().cycles < done {
            let mut pair: [(PortId, &mut dyn Station); 2] = [(ports[0], &mut *master), (ports[1], &mut *slave)];
            now = next_wakeup(&bus, &pair).expect("somebody waits").max(now);
            pump(&mut bus, now, &mut pair);
        }
    };
    while master.state(index) != SlaveState::DataExchange {
        cycle(&mut master, &mut slave);
    }
    criterion.bench_function("dp cycle through the virtual line", |bench| {
        bench.iter(|| {
            cycle(&mut master, &mut slave);
            black_box(master.inputs(index)[0])
        });
    });
}

/// No line: the octets of one station are handed to the other, and time jumps from deadline to deadline.
fn stations_alone(criterion: &mut Criterion) {
    let (mut master, index, mut slave) = stations();
    let mut now = Instant::ZERO;
    let mut buf = [0; MAX_TELEGRAM];
    let mut cycle = |master: &mut DpMaster<1>, slave: &mut DpSlave| {
        // A cycle is a token, a request and a reply.
        for _ in 0..3 {
            let due = [master.poll_timeout(), slave.poll_timeout()];
            now = due.into_iter().flatten().min().expect("a deadline").max(now);
            let of_master = master.poll_timeout().is_some_and(|at| at <= now);
            if of_master {
                master.handle_timeout(now);
                if let Some(len) = master.poll_transmit(now, &mut buf) {
                    now += BAUD.characters(len);
                    master.handle_sent(now);
                    slave.handle_octets(now, &buf[..len]);
                }
            } else {
                slave.handle_timeout(now);
                if let Some(len) = slave.poll_transmit(now, &mut buf) {
                    now += BAUD.characters(len);
                    slave.handle_sent(now);
                    master.handle_octets(now, &buf[..len]);
                }
            }
        }
    };
    while master.exchanges(index) < 10 {
        cycle(&mut master, &mut slave);
    }
    criterion.bench_function("dp cycle of both stations without a line", |bench| {
        bench.iter(|| {
            cycle(&mut master, &mut slave);
            black_box(master.inputs(index)[0])
        });
    });
}

criterion_group!(benches, through_the_line, stations_alone);
criterion_main!(benches);
