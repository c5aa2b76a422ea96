//! The drive's node on the system bus, with frames of any kind, any state of its controller, codes written from every side, and time.

use std::collections::VecDeque;

use dp_master::time::{Duration, Instant};
use lenze9300_model::TICKS_PER_MS;
use lenze9300_model::bus::can::sdo::{Request, Response};
use lenze9300_model::bus::can::{CanFrame, CanNode, Nmt, NmtState, Object, SdoChannel, SdoClient, SdoOutcome};
use lenze9300_model::bus::can_port::BusState;
use lenze9300_model::device::{Drive, DriveConfig};

use super::input::Input;

/// The node and what it may answer.
struct Bench {
    drive: Drive,
    node: CanNode,
    is_off: bool,
    /// The job of each channel that the node has and has not answered yet.
    jobs: [Option<CanFrame>; 2],
    ms: u64,
}

impl Bench {
    fn hear(&mut self, frame: &CanFrame) {
        let before = self.node.state();
        let object = self.node.identifiers().object(frame.id());
        self.node.handle_frame(frame);
        if self.is_off {
            assert_eq!(self.node.state(), before, "heard while off the bus");
            return;
        }
        match object {
            Some(Object::SdoRequest(channel)) if !frame.is_remote() && before != NmtState::Stopped => {
                self.jobs[channel as usize] = Some(*frame);
            }
            Some(Object::Nmt) => {}
            _ => assert_eq!(self.node.state(), before, "only network management changes the state"),
        }
        self.sent();
    }

    fn millisecond(&mut self) {
        self.ms += 1;
        self.node.cycle_1ms(&mut self.drive);
        self.sent();
        for _ in 0..TICKS_PER_MS {
            self.drive.tick();
        }
    }

    /// Takes what the node sends.
    fn sent(&mut self) -> VecDeque<CanFrame> {
        let mut frames = VecDeque::new();
        while let Some(frame) = self.node.poll_transmit() {
            assert!(!self.is_off, "sent while off the bus");
            self.check(&frame);
            frames.push_back(frame);
        }
        frames
    }

    fn check(&mut self, frame: &CanFrame) {
        let identifiers = *self.node.identifiers();
        assert!(!frame.is_remote());
        // Identifiers are free: process data may have been given that of a parameter channel.
        if [Object::Out1, Object::Out2, Object::Out3]
            .into_iter()
            .any(|object| identifiers.id(object) == frame.id())
        {
            return;
        }
        if let Some(channel) = SdoChannel::ALL
            .into_iter()
            .find(|channel| channel.response_id(identifiers.node()) == frame.id() && frame.data().len() == 8)
            && let Some(job) = self.jobs[channel as usize].take()
        {
            let (asked, answered) = (job.data(), frame.data());
            assert_eq!(asked[1..4], answered[1..4], "an answer about something else");
            match (Request::decode(asked), Response::decode(answered).unwrap()) {
                (Ok(Request::Read { .. }), Response::Value { .. })
                | (Ok(Request::Write { .. }), Response::Written { .. })
                | (_, Response::Refused { .. }) => {}
                (job, answer) => panic!("{answer:?} to {job:?}"),
            }
        }
    }
}

fn frame(input: &mut Input<'_>, node: u8) -> Option<CanFrame> {
    const COMMANDS: [u8; 8] = [0x40, 0x23, 0x2B, 0x2F, 0x21, 0x80, 0x60, 0x43];
    let node = u16::from(node);
    let choice = input.octet();
    let id = match choice & 15 {
        0..=3 => 1536 + node,
        4..=6 => 1600 + node,
        7 | 8 => {
            return CanFrame::new(
                0,
                &[
                    [0x01, 0x02, 0x80, 0x81, 0x82][usize::from(input.below(5))],
                    input.octet() & 3,
                ],
            );
        }
        9 => return CanFrame::new(128, &[]),
        10 => 512 + node,
        11 => 384 + node,
        12 => return CanFrame::new_remote(u16::from_be_bytes([input.octet() & 7, input.octet()]), input.below(9)),
        _ => return CanFrame::new(u16::from_be_bytes([input.octet() & 7, input.octet()]), input.take(8)),
    };
    if choice & 0x80 != 0 {
        return CanFrame::new(id, input.take(8));
    }
    let command = COMMANDS[usize::from(choice >> 4 & 7)];
    // Codes of the system bus, or any.
    let code = match input.octet() {
        known @ 0..=19 => 350 + u16::from(known),
        _ => u16::from_be_bytes([input.octet(), input.octet()]),
    };
    let [low, high] = 24_575_u16.wrapping_sub(code).to_le_bytes();
    let value = (i32::from(input.octet()) * 10_000).to_le_bytes();
    let subcode = input.octet() & 7;
    CanFrame::new(
        id,
        &[command, low, high, subcode, value[0], value[1], value[2], value[3]],
    )
}

pub(crate) fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let drive = Drive::new(DriveConfig::default());
    let mut bench = Bench {
        node: CanNode::new(drive.codes()),
        drive,
        is_off: false,
        jobs: [None; 2],
        ms: 0,
    };
    while !input.is_empty() {
        match input.below(8) {
            0..=3 => {
                if let Some(frame) = frame(&mut input, bench.node.identifiers().node()) {
                    bench.hear(&frame);
                }
            }
            4 | 5 => {
                for _ in 0..=input.below(16) {
                    bench.millisecond();
                }
            }
            6 => {
                let state = [BusState::Active, BusState::Warning, BusState::Passive, BusState::Off]
                    [usize::from(input.below(4))];
                bench.is_off = state == BusState::Off;
                if bench.is_off {
                    // What was not worked when the controller went off may or may not be answered later.
                    bench.jobs = [None; 2];
                }
                bench.node.handle_bus_state(state);
            }
            _ => while bench.node.poll_event().is_some() {},
        }
        assert!((1..=63).contains(&bench.node.identifiers().node()));
    }

    // Whatever happened: on the bus again and reset, the node answers a client on each channel.
    bench.is_off = false;
    bench.node.handle_bus_state(BusState::Active);
    bench.jobs = [None; 2];
    // A transfer of parameter sets, which refuses every job, has ended by then.
    bench.hear(&Nmt::ResetNode.frame(0));
    for _ in 0..300 {
        bench.millisecond();
    }
    let node = bench.node.identifiers().node();
    for channel in SdoChannel::ALL {
        let id = channel.request_id(node);
        // Identifiers are free: a sync may have been given that of a parameter channel.
        if bench.node.identifiers().object(id) != Some(Object::SdoRequest(channel)) {
            continue;
        }
        let mut client = SdoClient::new(node, channel);
        client.read(350, 0).unwrap();
        let now = Instant::ZERO + Duration::from_millis(bench.ms);
        bench.node.handle_frame(&client.poll_transmit(now).unwrap());
        bench.node.cycle_1ms(&mut bench.drive);
        while let Some(frame) = bench.node.poll_transmit() {
            client.handle_frame(&frame);
        }
        let stored = bench.drive.read_code(350, 0).unwrap();
        assert_eq!(client.poll_outcome(), Some(Ok(SdoOutcome::Value(stored))));
    }
}
