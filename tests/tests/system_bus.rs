//! The system bus beside the PLC: what commissioning clients do while a feed runs, and what they do not disturb.

use dp_master::time::{Duration, Instant};
use film_feed::operator::FeedPlan;
use film_feed::report::{FeedMode, RunReport};
use film_feed::rig::{RigConfig, TickObserver, TickView};
use film_feed::run::{Observation, observed};
use lenze9300_model::bus::can::sdo::{Data, Request};
use lenze9300_model::bus::can::{CanFrame, CanNode, CanPortId, SdoChannel, SdoClient, SdoOutcome, VirtualCan};
use system_tests::run;

/// A CAN bus at the drive: two clients, each on a parameter channel of its own, and a station that only makes noise.
struct SystemBus {
    bus: VirtualCan,
    node: Option<CanNode>,
    drive_port: CanPortId,
    clients: [Client; 2],
    flood: CanPortId,
    /// Foreign frames for each millisecond.
    flood_per_ms: u32,
    ms: u64,
}

struct Client {
    channel: SdoChannel,
    port: CanPortId,
    sdo: SdoClient,
    under_way: Option<(Request, i32)>,
    jobs: u32,
    /// What was read and is not what this client wrote before.
    mixed: u32,
}

impl SystemBus {
    fn new(flood_per_ms: u32) -> Self {
        let mut bus = VirtualCan::new();
        let drive_port = bus.attach(500_000);
        let clients = SdoChannel::ALL.map(|channel| Client {
            channel,
            port: bus.attach(500_000),
            sdo: SdoClient::new(1, channel),
            under_way: None,
            jobs: 0,
            mixed: 0,
        });
        let flood = bus.attach(500_000);
        Self {
            bus,
            node: None,
            drive_port,
            clients,
            flood,
            flood_per_ms,
            ms: 0,
        }
    }
}

impl TickObserver for SystemBus {
    fn tick(&mut self, view: &mut TickView<'_>) {
        if !view.ends_millisecond {
            return;
        }
        self.ms += 1;
        let now = Instant::ZERO + Duration::from_millis(self.ms);
        let node = self.node.get_or_insert_with(|| CanNode::new(view.drive.codes()));
        while let Some(frame) = self.bus.receive(self.drive_port) {
            node.handle_frame(&frame);
        }
        node.cycle_1ms(view.drive);
        while let Some(frame) = node.poll_transmit() {
            self.bus.send(self.drive_port, frame);
        }
        for n in 0..self.flood_per_ms {
            // Some come before everything of the drive's, some after.
            let id = if n % 2 == 0 { 0x010 } else { 0x7F0 };
            let octets = [self.ms as u8; 8];
            if let Some(frame) = CanFrame::new(id, &octets) {
                self.bus.send(self.flood, frame);
            }
        }
        for client in &mut self.clients {
            client.step(&mut self.bus, now);
        }
        while self.bus.receive(self.flood).is_some() {}
        self.bus.advance_to(now + Duration::from_millis(1));
    }
}

impl Client {
    /// Writes a value of its own into a variable of its own, reads it back, and so on.
    fn step(&mut self, bus: &mut VirtualCan, now: Instant) {
        while let Some(frame) = bus.receive(self.port) {
            self.sdo.handle_frame(&frame);
        }
        self.sdo.handle_timeout(now);
        match self.sdo.poll_outcome() {
            None => {}
            Some(Ok(outcome)) => {
                self.jobs += 1;
                if let (Some((_, written)), SdoOutcome::Value(value)) = (self.under_way, outcome) {
                    self.mixed += u32::from(value != written);
                }
            }
            Some(Err(error)) => panic!("{error}"),
        }
        // Variables 40 and 41 are used by no record of the film feed.
        let (subcode, base) = match self.channel {
            SdoChannel::First => (40, 1000),
            SdoChannel::Second => (41, 50_000),
        };
        let value = base + self.jobs as i32 / 2;
        let request = if self.jobs.is_multiple_of(2) {
            Request::Write {
                code: 1301,
                subcode,
                data: Data::four(value),
            }
        } else {
            Request::Read { code: 1301, subcode }
        };
        if self.sdo.submit(request).is_ok() {
            self.under_way = Some((request, value));
        }
        if let Some(frame) = self.sdo.poll_transmit(now) {
            bus.send(self.port, frame);
        }
    }
}

fn plan() -> FeedPlan {
    FeedPlan {
        series: vec![(FeedMode::Length, 2), (FeedMode::Mark, 2)],
        ..FeedPlan::default()
    }
}

fn run_beside(bus: &mut SystemBus) -> RunReport {
    observed(&RigConfig::default(), plan(), Observation::FeedsOnly, bus, || {})
        .unwrap_or_else(|error| panic!("{error}"))
        .0
}

#[test]
fn two_clients_at_work_lose_and_mix_nothing_and_leave_the_feeds_as_they_are() {
    let alone = run(&RigConfig::default(), plan());
    let mut bus = SystemBus::new(0);
    let beside = run_beside(&mut bus);
    assert!(alone.ok && beside.ok);
    assert_eq!(alone.feeds, beside.feeds, "the same feeds to the last bit");
    for client in &bus.clients {
        assert_eq!(client.mixed, 0);
        // Ten seconds, two to three milliseconds a job.
        assert!(client.jobs > 3000, "{}", client.jobs);
    }
}

#[test]
fn a_flood_of_foreign_frames_disturbs_neither_feeds_nor_clients() {
    // Three frames of some 120 bits a millisecond are 72 % of 500 kbit/s.
    let alone = run(&RigConfig::default(), plan());
    let mut bus = SystemBus::new(3);
    let beside = run_beside(&mut bus);
    assert_eq!(alone.feeds, beside.feeds, "the same feeds to the last bit");
    for client in &bus.clients {
        assert_eq!(client.mixed, 0);
        assert!(client.jobs > 2000, "{}", client.jobs);
    }
}

#[test]
fn what_a_client_writes_is_seen_from_every_other_access() {
    // 9300 facts 5: both parameter channels, the bus module and the keypad work on the same codes.
    struct Writer {
        node: Option<CanNode>,
        answer: Option<CanFrame>,
        ms: u64,
    }
    impl TickObserver for Writer {
        fn tick(&mut self, view: &mut TickView<'_>) {
            if !view.ends_millisecond {
                return;
            }
            self.ms += 1;
            let node = self.node.get_or_insert_with(|| CanNode::new(view.drive.codes()));
            if self.ms == 100 {
                let request = Request::Write {
                    code: 1302,
                    subcode: 20,
                    data: Data::four(50_0000),
                };
                let id = SdoChannel::Second.request_id(1);
                if let Some(frame) = CanFrame::new(id, &request.encode()) {
                    node.handle_frame(&frame);
                }
            }
            node.cycle_1ms(view.drive);
            while let Some(frame) = node.poll_transmit() {
                self.answer = Some(frame);
            }
            if self.ms == 101 {
                assert_eq!(
                    view.drive.read_code(1302, 20),
                    Ok(50_0000),
                    "seen from every other access"
                );
            }
        }
    }
    let mut writer = Writer {
        node: None,
        answer: None,
        ms: 0,
    };
    let report = observed(
        &RigConfig::default(),
        plan(),
        Observation::FeedsOnly,
        &mut writer,
        || {},
    )
    .unwrap_or_else(|error| panic!("{error}"))
    .0;
    assert!(report.ok);
    // 0x60: written (9300 facts 5).
    let answer = writer.answer.map(|frame| (frame.id(), frame.data()[0]));
    assert_eq!(answer, Some((1473, 0x60)));
}
