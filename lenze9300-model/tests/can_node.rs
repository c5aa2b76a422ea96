//! The drive on its system bus, frame by frame. Source of every identifier and octet: 9300 fact sheet, section 5.
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use dp_master::time::{Duration, Instant};
use lenze9300_model::TICKS_PER_MS;
use lenze9300_model::bus::can::sdo::{Data, Refusal, Request};
use lenze9300_model::bus::can::{
    CanFrame, CanNode, CanNodeEvent, CanPortId, Nmt, NmtState, SdoChannel, SdoClient, SdoClientError, SdoOutcome,
    VirtualCan,
};
use lenze9300_model::bus::can_port::BusState;
use lenze9300_model::code::CodeStore;
use lenze9300_model::device::{Drive, DriveConfig, NonVolatile, SetNumber};

/// A drive, its node and a bus with one more station.
struct Bench {
    drive: Drive,
    node: CanNode,
    bus: VirtualCan,
    drive_port: CanPortId,
    port: CanPortId,
    ms: u64,
    bus_state: BusState,
}

impl Bench {
    fn new() -> Self {
        Self::with(&[])
    }

    /// With these codes saved in parameter set 1.
    fn with(codes: &[(u16, u8, i32)]) -> Self {
        let mut store = CodeStore::thesis();
        for (code, subcode, value) in codes {
            store
                .write(*code, *subcode, *value * 10_000, lenze9300_model::code::Inhibit::Active)
                .unwrap();
        }
        let mut memory = NonVolatile::new(CodeStore::thesis());
        memory.save(SetNumber::FIRST, &store);
        let drive = Drive::power_up(DriveConfig::default(), memory);
        let node = CanNode::new(drive.codes());
        let mut bus = VirtualCan::new();
        let (drive_port, port) = (bus.attach(node.bit_rate()), bus.attach(500_000));
        Self {
            drive,
            node,
            bus,
            drive_port,
            port,
            ms: 0,
            bus_state: BusState::Active,
        }
    }

    fn millisecond(&mut self) {
        self.ms += 1;
        while let Some(frame) = self.bus.receive(self.drive_port) {
            self.node.handle_frame(&frame);
        }
        let state = self.bus.state(self.drive_port);
        if state != self.bus_state {
            self.bus_state = state;
            self.node.handle_bus_state(state);
        }
        self.node.cycle_1ms(&mut self.drive);
        while let Some(frame) = self.node.poll_transmit() {
            self.bus.send(self.drive_port, frame);
        }
        for _ in 0..TICKS_PER_MS {
            self.drive.tick();
        }
        self.bus.advance_to(self.now());
    }

    fn now(&self) -> Instant {
        Instant::ZERO + Duration::from_millis(self.ms)
    }

    fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            self.millisecond();
        }
    }

    fn send(&mut self, id: u16, octets: &[u8]) {
        self.bus.send(self.port, CanFrame::new(id, octets).unwrap());
    }

    fn received(&mut self) -> Vec<CanFrame> {
        std::iter::from_fn(|| self.bus.receive(self.port)).collect()
    }

    /// A job of eight octets and its answer within 5 ms.
    fn ask(&mut self, id: u16, octets: [u8; 8]) -> Option<(u16, Vec<u8>)> {
        self.received();
        self.send(id, &octets);
        self.run(5);
        self.received()
            .into_iter()
            .find(|frame| (1409..=1535).contains(&frame.id()))
            .map(|frame| (frame.id(), frame.data().to_vec()))
    }

    fn events(&mut self) -> Vec<CanNodeEvent> {
        std::iter::from_fn(|| self.node.poll_event()).collect()
    }
}

#[test]
fn the_examples_of_the_manual_are_answered_octet_for_octet() {
    let mut bench = Bench::new();
    bench.run(150);
    // C0012 := 20 s (PLC14 p. 3-45, SYSBUS p. 2-16).
    let answer = bench.ask(1537, [0x23, 0xF3, 0x5F, 0, 0x40, 0x0D, 0x03, 0]);
    assert_eq!(answer, Some((1409, vec![0x60, 0xF3, 0x5F, 0, 0, 0, 0, 0])));
    assert_eq!(bench.drive.read_code(12, 0), Ok(20_0000));
    // C0061: 43 °C in the manual (SYSBUS p. 2-18); here what the heat sink has, in the same layout.
    let temperature = bench.drive.read_code(61, 0).unwrap();
    let (id, octets) = bench.ask(1601, [0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).unwrap();
    assert_eq!((id, &octets[..4]), (1473, &[0x43, 0xC2, 0x5F, 0][..]));
    let shown = i32::from_le_bytes([octets[4], octets[5], octets[6], octets[7]]);
    assert!((shown - temperature).abs() < 100, "{shown} {temperature}");
    // A plain code of two octets: 0x4B.
    let (_, octets) = bench.ask(1537, [0x40, 0x78, 0x5F, 0, 0, 0, 0, 0]).unwrap();
    assert_eq!(octets[0], 0x4B);
}

#[test]
fn errors_are_answered_as_the_93xx_does() {
    let mut bench = Bench::new();
    bench.run(150);
    let mut refusal = |octets: [u8; 8]| {
        let (_, answer) = bench.ask(1537, octets).unwrap();
        assert_eq!((answer[0], &answer[1..4]), (0x80, &octets[1..4]));
        answer[4..].to_vec()
    };
    // Index 24575 − 9998 does not exist: 6/6 as data 3 / data 4. C0350/3: 5/6. C0061 written: 3/6 (PLC14 p. 3-45).
    assert_eq!(refusal([0x40, 0xF1, 0x38, 0, 0, 0, 0, 0]), [0, 0, 6, 6]);
    assert_eq!(refusal([0x40, 0xA1, 0x5E, 3, 0, 0, 0, 0]), [0, 0, 5, 6]);
    assert_eq!(refusal([0x23, 0xC2, 0x5F, 0, 1, 0, 0, 0]), [0, 0, 3, 6]);
    // C0350 := 64, above the range: 8/0/0031 in the places of class, code and additional code.
    assert_eq!(refusal([0x23, 0xA1, 0x5E, 0, 0, 0xC4, 0x09, 0])[2..], [0, 8]);
}

#[test]
fn a_command_that_the_drive_does_not_have_is_refused_at_once() {
    let mut bench = Bench::new();
    bench.run(150);
    // Source: CiA DS301: 0x21 begins a segmented download, 0xA4 a block upload, 0x60 asks for the next segment. The reason is that of the bus
    // module, class in data 4 and code in data 3 (9300 facts 3.3 and 5).
    for command in [0x21, 0xA4, 0x60] {
        let answer = bench.ask(1537, [command, 0xF3, 0x5F, 0, 4, 0, 0, 0]);
        assert_eq!(answer, Some((1409, vec![0x80, 0xF3, 0x5F, 0, 0x10, 0x00, 0x05, 0x06])));
    }
    // A client gives up, or its octets are too few: nobody waits for an answer.
    assert_eq!(bench.ask(1537, [0x80, 0xF3, 0x5F, 0, 0, 0, 0, 0]), None);
    bench.send(1537, &[0x40, 0xF3, 0x5F]);
    bench.run(5);
    assert!(bench.received().is_empty());
}

#[test]
fn two_clients_use_the_two_channels_at_once_and_nothing_is_mixed() {
    let mut bench = Bench::new();
    bench.run(150);
    let second = bench.bus.attach(500_000);
    let mut clients = [
        (SdoClient::new(1, SdoChannel::First), bench.port, 0_u32),
        (SdoClient::new(1, SdoChannel::Second), second, 0),
    ];
    for round in 0..2000_u32 {
        for (channel, (client, port, done)) in clients.iter_mut().enumerate() {
            let now = Instant::ZERO + Duration::from_millis(bench.ms);
            while let Some(frame) = bench.bus.receive(*port) {
                client.handle_frame(&frame);
            }
            client.handle_timeout(now);
            // Each channel reads target positions of its own, whose values tell the subcode.
            let subcode = |n: u32| (1 + 20 * channel as u32 + n % 20) as u8;
            match client.poll_outcome() {
                Some(Ok(SdoOutcome::Value(value))) => {
                    assert_eq!(value, i32::from(subcode(*done)) * 10_000);
                    *done += 1;
                }
                Some(other) => panic!("{other:?} in round {round}"),
                None => {}
            }
            if client.read(1301, subcode(*done)).is_ok()
                && let Some(frame) = client.poll_transmit(now)
            {
                bench.bus.send(*port, frame);
            }
        }
        if round == 0 {
            for subcode in 1..=40 {
                bench
                    .drive
                    .write_code(1301, subcode, i32::from(subcode) * 10_000)
                    .unwrap();
            }
        }
        bench.millisecond();
    }
    // A job and its answer take two or three milliseconds.
    for (_, _, done) in clients {
        assert!(done > 600, "{done}");
    }
}

#[test]
fn process_data_are_exchanged_only_while_operational() {
    let mut bench = Bench::new();
    bench.run(150);
    bench.send(128, &[]);
    bench.run(50);
    assert!(
        bench.received().is_empty(),
        "pre-operational: neither answer to a sync nor cyclic data"
    );
    bench.send(0, &[0x01, 1]);
    bench.run(2);
    assert_eq!(bench.node.state(), NmtState::Operational);
    bench.run(100);
    let frames = bench.received();
    let count = |id| frames.iter().filter(|frame| frame.id() == id).count();
    // C0356/2 and /3: every 10 ms, after the delay C0356/4 of 20 ms.
    assert!(
        (7..=8).contains(&count(642)) && (7..=8).contains(&count(770)),
        "{} {}",
        count(642),
        count(770)
    );
    assert_eq!(count(385), 0, "CAN-OUT1 waits for a sync");
    bench.send(128, &[]);
    bench.run(2);
    let answer = bench.received().into_iter().find(|frame| frame.id() == 385).unwrap();
    let word = |place: usize| u16::from_le_bytes([answer.data()[place], answer.data()[place + 1]]);
    assert_eq!(word(0), bench.drive.status_word());
    bench.send(0, &[0x02, 0]);
    bench.run(2);
    assert_eq!(bench.node.state(), NmtState::Stopped);
    assert_eq!(
        bench.ask(1537, [0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]),
        None,
        "stopped: no parameters either"
    );
    bench.send(0, &[0x80, 7]);
    bench.run(2);
    assert_eq!(bench.node.state(), NmtState::Stopped, "that was for node 7");
    bench.send(0, &[0x80, 1]);
    bench.run(2);
    assert_eq!(bench.node.state(), NmtState::PreOperational);
}

#[test]
fn events_send_on_change_when_the_cycle_is_zero() {
    let mut bench = Bench::with(&[(356, 2, 0), (356, 3, 0)]);
    bench.run(150);
    bench.send(0, &[0x01, 0]);
    bench.run(100);
    bench.received();
    bench.run(200);
    let at_rest = bench.received().len();
    assert!(at_rest <= 2, "nothing moves: {at_rest}");
    bench.drive.set_mains(lenze9300_model::plant::Mains::Off);
    bench.run(50);
    let falling = bench.received().iter().filter(|frame| frame.id() == 770).count();
    assert!(falling > 5, "the link falls volt by volt: {falling}");
}

#[test]
fn the_control_word_of_can_in1_stops_the_drive_beside_the_bus_module() {
    let mut bench = Bench::new();
    bench.run(150);
    bench.drive.set_aif(drivecom::AifControl(0));
    bench.run(50);
    assert_eq!(bench.drive.diagnosis(), 0);
    bench.send(0, &[0x01, 1]);
    bench.run(2);
    // 9300 facts 2.4 and 4.4: bit 9 CINH → C0183 = 126, bit 8 DISABLE → 113, bit 3 QSP → 154.
    for (bit, diagnosis) in [(9, 126), (8, 113), (3, 154)] {
        let [low, high] = (1_u16 << bit).to_le_bytes();
        bench.send(513, &[low, high, 0, 0, 0, 0, 0, 0]);
        bench.run(3);
        assert_eq!(bench.drive.diagnosis(), diagnosis, "bit {bit}");
        bench.send(513, &[0; 8]);
        bench.run(3);
        assert_eq!(bench.drive.diagnosis(), 0);
    }
    assert_eq!(bench.node.process_in(1), Some([0; 8]));
    assert_eq!(bench.node.process_in(2), None);
}

#[test]
fn missing_telegrams_are_ce1_to_ce3_with_the_reaction_of_their_code() {
    // C0591 = 0: TRIP after C0357/1; factory: off (9300 facts 4.9).
    let mut bench = Bench::with(&[(591, 0, 0), (592, 0, 2), (357, 1, 200), (357, 2, 300)]);
    bench.run(150);
    bench.run(1000);
    assert_eq!(bench.drive.shown_fault(), 0, "pre-operational: nothing is expected");
    bench.send(0, &[0x01, 1]);
    for _ in 0..10 {
        bench.run(50);
        bench.send(513, &[0; 8]);
        bench.send(641, &[0; 8]);
    }
    assert_eq!(bench.drive.shown_fault(), 0);
    bench.run(190);
    assert_eq!(bench.drive.shown_fault(), 0);
    bench.run(20);
    // CE1 has the number 62 as TRIP.
    assert_eq!(bench.drive.shown_fault(), 62);
    bench.send(513, &[0; 8]);
    bench.run(3);
    bench.drive.write_code(43, 0, 0).unwrap();
    bench.run(100);
    // CE2 as a warning: 2063.
    assert_eq!(bench.drive.shown_fault(), 2063);
}

#[test]
fn a_master_starts_the_net_and_sends_the_sync() {
    let mut bench = Bench::with(&[(352, 0, 1), (356, 1, 500), (369, 0, 20)]);
    bench.run(499);
    assert!(bench.received().iter().all(|frame| frame.id() == 128), "only the sync");
    bench.run(2);
    let frames = bench.received();
    let start = frames.iter().find(|frame| frame.id() == 0).unwrap();
    assert_eq!(*start, Nmt::Operational.frame(0));
    assert_eq!(bench.node.state(), NmtState::Operational);
    bench.run(200);
    let syncs = bench.received().iter().filter(|frame| frame.id() == 128).count();
    assert_eq!(syncs, 10);
}

#[test]
fn address_and_bit_rate_hold_from_the_next_reset_of_the_node() {
    let mut bench = Bench::new();
    bench.run(150);
    bench.drive.set_terminal_28(false);
    bench.run(5);
    bench.drive.write_code(350, 0, 9_0000).unwrap();
    bench.drive.write_code(351, 0, 1_0000).unwrap();
    assert!(
        bench.ask(1537, [0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).is_some(),
        "still node 1"
    );
    // C0358 := 1, the last job at the old address.
    bench.ask(1537, [0x23, 0x99, 0x5E, 0, 0x10, 0x27, 0, 0]);
    assert_eq!((bench.node.identifiers().node(), bench.node.bit_rate()), (9, 250_000));
    bench.bus.set_bit_rate(bench.drive_port, bench.node.bit_rate());
    bench.bus.set_bit_rate(bench.port, 250_000);
    let (id, _) = bench.ask(1545, [0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).unwrap();
    assert_eq!(id, 1417);
    // NMT reset node does the same.
    bench.drive.write_code(350, 0, 10_0000).unwrap();
    bench.send(0, &[0x81, 9]);
    bench.run(3);
    assert_eq!(bench.node.identifiers().node(), 10);
    // C0355 shows what is in force: CAN-IN1 and CAN-OUT1.
    bench.run(60);
    assert_eq!(bench.drive.read_code(355, 1), Ok(522_0000));
    assert_eq!(bench.drive.read_code(355, 2), Ok(394_0000));
}

#[test]
fn counters_and_load_show_what_passed() {
    let mut bench = Bench::new();
    bench.run(150);
    bench.send(0, &[0x01, 1]);
    bench.run(1);
    for _ in 0..2100 {
        bench.send(513, &[0; 8]);
        bench.send(0x7F0, &[0; 8]);
        bench.millisecond();
    }
    bench.run(60);
    let code = |bench: &mut Bench, code, subcode| bench.drive.read_code(code, subcode).unwrap() / 10_000;
    // NMT and 2100 of CAN-IN1; foreign frames are none of the drive's.
    assert_eq!(code(&mut bench, 360, 2), 2101);
    assert_eq!(code(&mut bench, 360, 8), 2100);
    let sent = code(&mut bench, 360, 1);
    assert_eq!(sent, code(&mut bench, 360, 4) + code(&mut bench, 360, 5));
    assert!((418..=432).contains(&sent), "two every 10 ms: {sent}");
    // A frame of eight zero octets a millisecond: some 127 bits of 500 (see `CanFrame::bits`).
    let bits = f64::from(CanFrame::new(513, &[0; 8]).unwrap().bits());
    assert!((f64::from(code(&mut bench, 361, 2)) - bits / 5.0).abs() <= 1.0);
    assert_eq!(code(&mut bench, 359, 0), 0, "operational");
}

#[test]
fn bus_off_is_ce4_and_recovers_when_the_controller_does() {
    let mut bench = Bench::with(&[(595, 0, 0)]);
    bench.run(150);
    bench.send(0, &[0x01, 1]);
    bench.run(50);
    // Everybody else has gone to another bit rate: what the drive sends is destroyed until it is off.
    bench.bus.set_bit_rate(bench.port, 125_000);
    bench.bus.send(bench.port, CanFrame::new(0x100, &[0; 8]).unwrap());
    bench.bus.attach(125_000);
    bench.run(400);
    assert_eq!(bench.bus.state(bench.drive_port), BusState::Off);
    assert!(bench.events().contains(&CanNodeEvent::BusOff));
    // CE4 as TRIP: 65. C0359 = 3.
    assert_eq!(bench.drive.shown_fault(), 65);
    bench.run(60);
    assert_eq!(bench.drive.read_code(359, 0), Ok(3_0000));
    bench.bus = VirtualCan::new();
    bench.drive_port = bench.bus.attach(500_000);
    bench.port = bench.bus.attach(500_000);
    bench.bus.advance_to(bench.now());
    bench.run(2);
    assert!(bench.events().contains(&CanNodeEvent::BusBack));
    bench.drive.write_code(43, 0, 0).unwrap();
    bench.run(3);
    assert_eq!(bench.drive.shown_fault(), 0);
    assert!(bench.ask(1537, [0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).is_some());
}

#[test]
fn a_node_address_that_is_there_twice_is_told_once_and_its_end_too() {
    let mut bench = Bench::new();
    bench.run(150);
    for _ in 0..5 {
        bench.send(1409, &[0x60, 0xF3, 0x5F, 0, 0, 0, 0, 0]);
        bench.run(100);
    }
    assert_eq!(bench.events(), [CanNodeEvent::AddressTwice { id: 1409, node: 1 }]);
    bench.run(1100);
    assert_eq!(bench.events(), [CanNodeEvent::AddressOnce { node: 1 }]);
}

#[test]
fn a_client_is_told_why_a_write_was_refused() {
    let mut bench = Bench::new();
    bench.run(150);
    bench.drive.set_aif(drivecom::AifControl(0));
    bench.run(10);
    let mut client = SdoClient::new(1, SdoChannel::First);
    // C0350 only while inhibited, and the drive is enabled.
    client
        .submit(Request::Write {
            code: 350,
            subcode: 0,
            data: Data::four(5_0000),
        })
        .unwrap();
    let frame = client.poll_transmit(bench.now()).unwrap();
    bench.send(frame.id(), frame.data());
    bench.run(5);
    for frame in bench.received() {
        client.handle_frame(&frame);
    }
    let Some(Err(SdoClientError::Refused { reason, .. })) = client.poll_outcome() else {
        panic!("it must be refused");
    };
    assert_eq!((reason.class, reason.code, reason.additional), (8, 0, 0x0030));
    assert_ne!(reason, Refusal::ACCESS_DENIED);
}
