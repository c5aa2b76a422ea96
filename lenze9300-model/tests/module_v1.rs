//! The drive's parameters over DP-V1: data record 47 through MSAC1 and MSAC2, beside the cyclic exchange.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use dp_master::address::Address;
use dp_master::dp::v1::{
    Addresses, ErrorCode1, Features, Initiate, Msac1Client, Msac2Client, Msac2Event, SendTimeout, V1Answer, V1Error,
    V1Failure, V1Status,
};
use dp_master::dp::{DpMaster, MasterConfig, Mode, Octets, SlaveConfig, SlaveIndex, SlaveState};
use dp_master::fdl::BusParams;
use dp_master::phy::{PortId, VirtualBus, pump};
use dp_master::station::Station;
use dp_master::time::{Baud, Duration, Instant};
use lenze9300_model::TICKS_PER_MS;
use lenze9300_model::bus::dp::{Emf2133, Emf2133Config, IDENT, PAR_AND_FOUR_WORDS};
use lenze9300_model::device::{Drive, DriveConfig};

const BAUD: Baud = Baud::B1500000;

struct Chain {
    bus: VirtualBus,
    ports: [PortId; 2],
    master: DpMaster<1>,
    axis: SlaveIndex,
    module: Emf2133,
    drive: Drive,
    now: Instant,
}

impl Chain {
    /// Master at 2 and module at 3, in data exchange with DPV1_Enable, outputs zero: the drive is inhibited.
    fn exchanging() -> Self {
        let (plc, drive) = (Address::new(2).unwrap(), Address::new(3).unwrap());
        let config = MasterConfig {
            min_cycle: Duration::from_millis(1),
            ..MasterConfig::new(plc, BusParams::standard(BAUD))
        };
        let mut master = DpMaster::new(config).unwrap();
        let slave = SlaveConfig {
            user_prm: Octets::from_slice(&V1Status::ENABLED.octets()).unwrap(),
            ..SlaveConfig::new(drive, IDENT, PAR_AND_FOUR_WORDS).unwrap()
        };
        let axis = master.add_slave(slave).unwrap();
        master.set_mode(Mode::Operate);
        let mut bus = VirtualBus::new(BAUD);
        let ports = [bus.attach(), bus.attach()];
        let mut chain = Self {
            bus,
            ports,
            master,
            axis,
            module: Emf2133::new(Emf2133Config::default(), BAUD).unwrap(),
            drive: Drive::new(DriveConfig::default()),
            now: Instant::ZERO,
        };
        for _ in 0..1000 {
            chain.step();
        }
        assert_eq!(chain.master.state(axis), SlaveState::DataExchange);
        chain
    }

    /// A millisecond.
    fn step(&mut self) {
        self.now += Duration::from_millis(1);
        let mut stations: [(PortId, &mut dyn Station); 2] =
            [(self.ports[0], &mut self.master), (self.ports[1], &mut self.module)];
        pump(&mut self.bus, self.now, &mut stations);
        self.module.cycle_1ms(&mut self.drive);
        for _ in 0..TICKS_PER_MS {
            self.drive.tick();
        }
    }

    /// Steps until the client has its answer, and how many milliseconds that took.
    fn answer(&mut self, client: &mut Msac1Client) -> (Result<V1Answer, V1Failure>, u32) {
        for ms in 0..3000 {
            self.step();
            if let Some(answer) = client.poll(self.master.jobs()) {
                return (answer, ms);
            }
        }
        panic!("no answer");
    }

    /// Writes a request to record 47 over MSAC1 and reads the response.
    fn parameters(&mut self, request: &[u8]) -> Vec<u8> {
        let mut client = Msac1Client::new(Address::new(3).unwrap());
        client.write(self.master.jobs(), 0, 47, request).unwrap();
        let (written, _) = self.answer(&mut client);
        let length = u8::try_from(request.len()).unwrap();
        assert_eq!(
            written,
            Ok(V1Answer::Written {
                slot: 0,
                index: 47,
                length
            })
        );
        client.read(self.master.jobs(), 0, 47, 240).unwrap();
        let (read, took_ms) = self.answer(&mut client);
        // As long as a job of the parameter channel (9300 facts 1.6: 30 to 50 ms), and a few DP cycles.
        assert!((20..=60).contains(&took_ms), "{took_ms} ms");
        data(read)
    }

    fn connect(&mut self) -> Msac2Client {
        let mut client = Msac2Client::new(Address::new(3).unwrap());
        let initiate = Initiate {
            send_timeout: SendTimeout(100),
            features: Features::READ_WRITE,
            profile_features: 0,
            profile_ident: 0,
            addresses: Addresses::DIRECT,
        };
        client.connect(self.master.jobs(), &initiate).unwrap();
        let event = self.event(&mut client);
        assert!(matches!(event, Msac2Event::Opened(_)), "{event:?}");
        client
    }

    fn event(&mut self, client: &mut Msac2Client) -> Msac2Event {
        for _ in 0..5000 {
            self.step();
            if let Some(event) = client.step(self.master.jobs(), self.now) {
                return event;
            }
        }
        panic!("no event");
    }
}

fn data<E: std::fmt::Debug>(answer: Result<V1Answer, E>) -> Vec<u8> {
    match answer {
        Ok(V1Answer::Data {
            slot: 0,
            index: 47,
            data,
        }) => data.to_vec(),
        other => panic!("{other:?}"),
    }
}

/// Read the value of C1204: index 0x5B4B (9300 facts 3.2).
const READ_C1204: [u8; 10] = [0x2A, 0x01, 0x00, 0x01, 0x10, 0x01, 0x5B, 0x4B, 0x00, 0x00];
/// 179.0708, a double word.
const C1204: [u8; 10] = [0x2A, 0x01, 0x00, 0x01, 0x43, 0x01, 0x00, 0x1B, 0x52, 0xF4];

#[test]
fn c1204_is_read_through_msac1_while_data_are_exchanged() {
    let mut chain = Chain::exchanging();
    let (before, began) = (chain.master.exchanges(chain.axis), chain.now);
    assert_eq!(chain.parameters(&READ_C1204), C1204);
    let milliseconds = (chain.now - began).as_nanos() / 1_000_000;
    let exchanges = chain.master.exchanges(chain.axis) - before;
    assert!(exchanges + 2 >= milliseconds, "{exchanges} in {milliseconds} ms");
}

#[test]
fn c1204_is_read_through_msac2_by_whoever_asks() {
    let mut chain = Chain::exchanging();
    let mut client = chain.connect();
    client.write(chain.master.jobs(), 0, 47, &READ_C1204).unwrap();
    let written = chain.event(&mut client);
    assert!(
        matches!(written, Msac2Event::Answer(Ok(V1Answer::Written { .. }))),
        "{written:?}"
    );
    client.read(chain.master.jobs(), 0, 47, 240).unwrap();
    match chain.event(&mut client) {
        Msac2Event::Answer(answer) => assert_eq!(data(answer), C1204),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_length_is_written_and_both_channels_see_it() {
    let mut chain = Chain::exchanging();
    // C1301/1 := 987.5: index 0x5AEA, 9 875 000 = 0x0096AE38.
    let write = [
        0x01, 0x02, 0x00, 0x01, 0x10, 0x01, 0x5A, 0xEA, 0x00, 0x01, 0x43, 0x01, 0x00, 0x96, 0xAE, 0x38,
    ];
    assert_eq!(chain.parameters(&write), [0x01, 0x02, 0x00, 0x01]);
    assert_eq!(chain.drive.codes().read(1301, 1), Ok(987_5000));
}

#[test]
fn what_the_drive_refuses_is_told_by_number() {
    // Error numbers: 9300 facts 7. C9999 is unknown, C1301 has no subcode 111, C0051 is a display, C0070 goes up to 255.
    let mut chain = Chain::exchanging();
    let index = |code: u16| (24_575 - code).to_be_bytes();
    for (id, code, subcode, value, error) in [
        (0x01, 9999, 0, None, 0x00),
        (0x01, 1301, 111, None, 0x03),
        (0x02, 51, 0, Some(0), 0x01),
        (0x02, 70, 0, Some(256_0000), 0x02),
        (0x02, 86, 0, Some(107_0000), 0x14),
    ] {
        let [high, low] = index(code);
        let mut request = vec![0x05, id, 0x00, 0x01, 0x10, 0x01, high, low, 0x00, subcode];
        if let Some(value) = value {
            request.extend([0x43, 0x01]);
            request.extend(i32::to_be_bytes(value));
        }
        let expected = [0x05, id | 0x80, 0x00, 0x01, 0x44, 0x01, 0x00, error];
        assert_eq!(chain.parameters(&request), expected, "C{code:04}/{subcode}");
    }
    // The status word C0150 is a word; the drive is inhibited over the AIF: IMP, n = 0, CINH, state 3.
    let [high, low] = index(150);
    let read = [0x06, 0x01, 0x00, 0x01, 0x10, 0x01, high, low, 0x00, 0x00];
    assert_eq!(
        chain.parameters(&read),
        [0x06, 0x01, 0x00, 0x01, 0x42, 0x01, 0x03, 0xC2]
    );
}

#[test]
fn other_records_and_reads_without_a_request_are_refused() {
    let mut chain = Chain::exchanging();
    let mut client = Msac1Client::new(Address::new(3).unwrap());
    for (slot, index, code) in [
        (0, 47, ErrorCode1::STATE_CONFLICT),
        (0, 46, ErrorCode1::INVALID_INDEX),
        (1, 47, ErrorCode1::INVALID_SLOT),
    ] {
        client.read(chain.master.jobs(), slot, index, 240).unwrap();
        let (answer, _) = chain.answer(&mut client);
        assert_eq!(answer, Err(V1Failure::Refused(V1Error::new(code))), "{slot} {index}");
    }
    client.write(chain.master.jobs(), 0, 47, &[0x01, 0x01, 0x00]).unwrap();
    let (answer, _) = chain.answer(&mut client);
    let refused = V1Error::new(ErrorCode1::INVALID_PARAMETER);
    assert_eq!(answer, Err(V1Failure::Refused(refused)));
}

#[test]
fn two_ways_do_not_get_each_others_responses() {
    let mut chain = Chain::exchanging();
    let mut tool = chain.connect();
    let [high, low] = (24_575_u16 - 1202).to_be_bytes();
    let read_c1202 = [0x33, 0x01, 0x00, 0x01, 0x10, 0x01, high, low, 0x00, 0x00];
    tool.write(chain.master.jobs(), 0, 47, &read_c1202).unwrap();
    let written = chain.event(&mut tool);
    assert!(matches!(written, Msac2Event::Answer(Ok(_))), "{written:?}");
    assert_eq!(chain.parameters(&READ_C1204), C1204);
    tool.read(chain.master.jobs(), 0, 47, 240).unwrap();
    match chain.event(&mut tool) {
        // C1202 = 7.
        Msac2Event::Answer(answer) => {
            assert_eq!(
                data(answer),
                [0x33, 0x01, 0x00, 0x01, 0x43, 0x01, 0x00, 0x01, 0x11, 0x70]
            );
        }
        other => panic!("{other:?}"),
    }
}
