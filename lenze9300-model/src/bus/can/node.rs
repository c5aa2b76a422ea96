use std::collections::VecDeque;

use drivecom::AifControl;

use super::sdo::{Data, Refusal, Request, Response, refusal_of};
use super::traffic::Traffic;
use super::{BIT_RATES, CanFrame, Identifiers, Nmt, NmtState, Object, SdoChannel};
use crate::bus::can_port::BusState;
use crate::code::table::number::{C0351, C0352, C0355, C0356, C0357, C0359, C0360, C0361, C0366, C0369};
use crate::code::{CodeStore, DataLength, entry};
use crate::device::{Drive, Fault};
use crate::signal::Signal;

/// The drive's side of the system bus.
///
/// Frames go in by [`handle_frame`](Self::handle_frame) as they come and out by [`poll_transmit`](Self::poll_transmit); once a
/// millisecond, before the drive's ticks, [`cycle_1ms`](Self::cycle_1ms) works parameter jobs, monitoring and cyclic process data.
/// The answer to a sync is sent at once, with the values of the millisecond before.
///
/// ```text
///                   reset node, reset communication, C0358
///        ┌───────────────────────────────┐
///        ▼            operational        │
///  pre-operational ◄────────────► operational          parameters: pre-operational, operational
///        ▲  pre-operational              ▲              process data: operational
///        └────────► stopped ◄────────────┘
/// ```
///
/// | process data | word 1 | word 2 | word 3 | word 4 |
/// |---|---|---|---|---|
/// | CAN-IN1 | control word, as C0135 | – | – | – |
/// | CAN-OUT1 | status word C0150 | MCTRL-NACT, 16384 = 100 % of C0011 | POS-ACT low | POS-ACT high |
/// | CAN-OUT2 | POS-SETP low | POS-SETP high | POS-ACT low | POS-ACT high |
/// | CAN-OUT3 | MCTRL-MSET2, 16384 = 100 % | U-DC, V | C0067 | program function outputs |
///
/// Words are sent low octet first. What is beside the first word of CAN-IN1 and CAN-OUT1 is assumed: on the device it is wired by codes
/// that no source lists. CAN-IN2 and CAN-IN3 can be read by [`process_in`](Self::process_in) and act on nothing.
///
/// Node address, bit rate and identifiers are taken over at power-up and with a reset of the node (assumed). After bus off the node
/// waits until its controller is on the bus again. Source: 9300 fact sheet, section 5.
///
/// # Example
///
/// ```
/// use lenze9300_model::bus::can::{CanFrame, CanNode};
/// use lenze9300_model::device::{Drive, DriveConfig};
///
/// let mut drive = Drive::new(DriveConfig::default());
/// let mut node = CanNode::new(drive.codes());
/// node.handle_frame(&CanFrame::new(0x601, &[0x40, 0xF3, 0x5F, 0, 0, 0, 0, 0]).unwrap());
/// node.cycle_1ms(&mut drive);
/// let answer = node.poll_transmit().unwrap();
/// assert_eq!((answer.id(), answer.data()[0]), (0x581, 0x43));
/// ```
#[derive(Debug, Clone)]
pub struct CanNode {
    identifiers: Identifiers,
    bit_rate: u32,
    state: NmtState,
    bus: BusState,
    ms: u64,
    /// Since the last reset of the node.
    up_ms: u64,
    reset_due: bool,
    /// Since process data are exchanged.
    operational_ms: u64,
    /// A job for each channel; a new one takes the place of one that was not worked yet.
    jobs: [Option<CanFrame>; 2],
    inputs: [Input; 3],
    /// Words of CAN-OUT1 to CAN-OUT3, as they stand, and as they were sent last.
    outputs: [Output; 3],
    since_sync_ms: u32,
    settings: Settings,
    traffic: Traffic,
    to_send: VecDeque<CanFrame>,
    events: VecDeque<CanNodeEvent>,
    /// When somebody else last used an identifier of this node, ms.
    twice_at_ms: Option<u64>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Input {
    octets: [u8; 8],
    /// Came in since the node was reset.
    known: bool,
    silent_ms: u32,
}

#[derive(Debug, Clone, Copy, Default)]
struct Output {
    octets: [u8; 8],
    sent: Option<[u8; 8]>,
    since_ms: u32,
}

/// Codes that act while the node runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Settings {
    is_master: bool,
    answers_sync: bool,
    boot_ms: u64,
    /// Of CAN-OUT2 and CAN-OUT3; 0 = on change.
    cycle_ms: [u32; 2],
    delay_ms: u64,
    sync_ms: u32,
    monitoring_ms: [u32; 3],
}

/// What a user of the bus should know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CanNodeEvent {
    /// The node went into another state.
    #[error("system bus: node is {}", state_name(*.0))]
    State(NmtState),
    /// Another station sends with an identifier that only this node may use.
    #[error(
        "system bus: another station sends with identifier {id} of node {node}; give each station an address of its own (C0350)"
    )]
    AddressTwice {
        /// The identifier.
        id: u16,
        /// This node.
        node: u8,
    },
    /// That has not happened for a second.
    #[error("system bus: node address {node} is there once again")]
    AddressOnce {
        /// This node.
        node: u8,
    },
    /// The controller is off the bus after too many errors.
    #[error("system bus off (CE4): check wiring, terminators and bit rate")]
    BusOff,
    /// It is on the bus again.
    #[error("system bus is back")]
    BusBack,
}

const fn state_name(state: NmtState) -> &'static str {
    match state {
        NmtState::PreOperational => "pre-operational",
        NmtState::Operational => "operational",
        NmtState::Stopped => "stopped",
    }
}

/// Frames that wait to be sent; more are lost, as in a controller.
const QUEUE: usize = 64;
/// Events that wait to be told.
const EVENTS: usize = 32;
/// How long an identifier of this node must be unused by others before its address counts as its own again.
const TWICE_MS: u64 = 1000;
/// How often displays are shown anew; they are read by people.
const DISPLAY_MS: u64 = 50;

impl CanNode {
    /// A node at power-up, with the addresses and times that the codes hold.
    #[must_use]
    pub fn new(codes: &CodeStore) -> Self {
        let mut node = Self {
            identifiers: Identifiers::from_codes(codes),
            bit_rate: BIT_RATES[0],
            state: NmtState::PreOperational,
            bus: BusState::Active,
            ms: 0,
            up_ms: 0,
            reset_due: false,
            operational_ms: 0,
            jobs: [None; 2],
            inputs: [Input::default(); 3],
            outputs: [Output::default(); 3],
            since_sync_ms: 0,
            settings: Settings::default(),
            traffic: Traffic::default(),
            to_send: VecDeque::new(),
            events: VecDeque::new(),
            twice_at_ms: None,
        };
        node.reset(codes);
        node
    }

    /// Identifiers in force.
    #[must_use]
    pub fn identifiers(&self) -> &Identifiers {
        &self.identifiers
    }

    /// Bit rate in force, bit/s.
    #[must_use]
    pub fn bit_rate(&self) -> u32 {
        self.bit_rate
    }

    /// State of the node.
    #[must_use]
    pub fn state(&self) -> NmtState {
        self.state
    }

    /// The octets that came last as CAN-IN1, CAN-IN2 or CAN-IN3 (`number` 1…3); `None` before the first.
    #[must_use]
    pub fn process_in(&self, number: u8) -> Option<[u8; 8]> {
        let place = usize::from(number).checked_sub(1)?;
        self.inputs
            .get(place)
            .filter(|input| input.known)
            .map(|input| input.octets)
    }

    /// A frame of the bus. Those of others are passed over.
    pub fn handle_frame(&mut self, frame: &CanFrame) {
        if self.bus == BusState::Off {
            return;
        }
        let Some(object) = self.identifiers.object(frame.id()) else {
            return;
        };
        if object.is_sent_by_the_drive() {
            self.note_twice(frame);
            return;
        }
        if frame.is_remote() {
            return;
        }
        self.traffic.received(frame, object);
        match object {
            Object::Nmt => {
                if let Some(command) = Nmt::for_node(frame.data(), self.identifiers.node()) {
                    self.obey(command);
                }
            }
            Object::Sync if self.state == NmtState::Operational && self.settings.answers_sync => {
                self.send_output(0);
            }
            Object::SdoRequest(channel) if self.state != NmtState::Stopped => {
                self.jobs[channel as usize] = Some(*frame);
            }
            Object::In1 => self.take_in(0, frame),
            Object::In2 => self.take_in(1, frame),
            Object::In3 => self.take_in(2, frame),
            _ => {}
        }
    }

    /// The error state of the controller changed.
    pub fn handle_bus_state(&mut self, bus: BusState) {
        if (bus == BusState::Off) != (self.bus == BusState::Off) {
            self.to_send.clear();
            self.tell(if bus == BusState::Off {
                CanNodeEvent::BusOff
            } else {
                CanNodeEvent::BusBack
            });
        }
        self.bus = bus;
    }

    /// The next frame to be sent.
    pub fn poll_transmit(&mut self) -> Option<CanFrame> {
        self.to_send.pop_front()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<CanNodeEvent> {
        self.events.pop_front()
    }

    /// A millisecond of the drive, before its ticks.
    pub fn cycle_1ms(&mut self, drive: &mut Drive) {
        self.ms += 1;
        self.up_ms += 1;
        self.settings = Settings::from_codes(drive.codes());
        if drive.take_can_reset() {
            self.obey(Nmt::ResetNode);
        }
        if std::mem::take(&mut self.reset_due) {
            self.reset(drive.codes());
        }
        if self.twice_at_ms.is_some_and(|at| self.ms - at > TWICE_MS) {
            self.twice_at_ms = None;
            let node = self.identifiers.node();
            self.tell(CanNodeEvent::AddressOnce { node });
        }
        self.start_the_net();
        self.serve_parameters(drive);
        self.monitor(drive);
        self.form_outputs(drive);
        self.send_process_data();
        self.traffic.pass_1ms(self.bit_rate);
        if self.ms % DISPLAY_MS == 1 {
            self.show(drive);
        }
    }

    fn obey(&mut self, command: Nmt) {
        let state = match command {
            Nmt::Operational => NmtState::Operational,
            Nmt::Stopped => NmtState::Stopped,
            Nmt::PreOperational => NmtState::PreOperational,
            Nmt::ResetNode | Nmt::ResetCommunication => {
                // Addresses are read in the next millisecond, which has the codes.
                self.reset_due = true;
                NmtState::PreOperational
            }
        };
        self.enter(state);
    }

    fn enter(&mut self, state: NmtState) {
        if state == self.state {
            return;
        }
        self.state = state;
        self.operational_ms = 0;
        for input in &mut self.inputs {
            input.silent_ms = 0;
        }
        self.tell(CanNodeEvent::State(state));
    }

    fn reset(&mut self, codes: &CodeStore) {
        self.identifiers = Identifiers::from_codes(codes);
        self.settings = Settings::from_codes(codes);
        let rate = codes.number(C0351, 0) as usize;
        self.bit_rate = BIT_RATES.get(rate).copied().unwrap_or(BIT_RATES[0]);
        self.jobs = [None; 2];
        self.inputs = [Input::default(); 3];
        self.outputs = [Output::default(); 3];
        self.since_sync_ms = 0;
        self.traffic = Traffic::default();
        self.to_send.clear();
        self.up_ms = 0;
    }

    fn note_twice(&mut self, frame: &CanFrame) {
        if self.twice_at_ms.replace(self.ms).is_none() {
            let (id, node) = (frame.id(), self.identifiers.node());
            self.tell(CanNodeEvent::AddressTwice { id, node });
        }
    }

    fn take_in(&mut self, place: usize, frame: &CanFrame) {
        if self.state != NmtState::Operational {
            return;
        }
        let input = &mut self.inputs[place];
        // A short telegram leaves the rest as it was.
        let octets = frame.data();
        input.octets[..octets.len()].copy_from_slice(octets);
        input.known = true;
        input.silent_ms = 0;
    }

    /// A master starts the net after its boot-up time.
    fn start_the_net(&mut self) {
        if self.settings.is_master && self.up_ms == self.settings.boot_ms.max(1) {
            self.send(Nmt::Operational.frame(0));
            self.enter(NmtState::Operational);
        }
    }

    fn serve_parameters(&mut self, drive: &mut Drive) {
        for channel in SdoChannel::ALL {
            let Some(job) = self.jobs[channel as usize].take() else {
                continue;
            };
            let response = match Request::decode(job.data()) {
                Ok(request) => carry_out(request, drive),
                Err(_) => match refusal_of(job.data()) {
                    Some(refused) => refused,
                    None => continue,
                },
            };
            let id = self.identifiers.id(Object::SdoResponse(channel));
            self.send(CanFrame::of(id, response.encode(), 8));
        }
    }

    fn monitor(&mut self, drive: &mut Drive) {
        let is_operational = self.state == NmtState::Operational;
        if is_operational {
            self.operational_ms += 1;
        }
        for ((input, limit_ms), fault) in
            self.inputs
                .iter_mut()
                .zip(self.settings.monitoring_ms)
                .zip([Fault::Ce1, Fault::Ce2, Fault::Ce3])
        {
            if is_operational {
                input.silent_ms = input.silent_ms.saturating_add(1);
            }
            drive.inject(fault, is_operational && limit_ms > 0 && input.silent_ms > limit_ms);
        }
        drive.inject(Fault::Ce4, self.bus == BusState::Off);
        let [low, high, ..] = self.inputs[0].octets;
        drive.set_can(AifControl(u16::from_le_bytes([low, high])));
    }

    fn form_outputs(&mut self, drive: &Drive) {
        let status = drive.status();
        let words = |words: [u16; 4]| {
            let mut octets = [0; 8];
            for (place, word) in octets.chunks_exact_mut(2).zip(words) {
                place.copy_from_slice(&word.to_le_bytes());
            }
            octets
        };
        let halves = |value: i32| {
            let bits = value as u32;
            [bits as u16, (bits >> 16) as u16]
        };
        let [actual_low, actual_high] = halves(status.position);
        let [set_low, set_high] = halves(drive.setpoint().position as i32);
        let torque = (Signal::MctrlMset2.read(drive) / 100.0 * FULL).round() as i16;
        self.outputs[0].octets = words([drive.status_word(), status.speed as u16, actual_low, actual_high]);
        self.outputs[1].octets = words([set_low, set_high, actual_low, actual_high]);
        self.outputs[2].octets = words([
            torque as u16,
            Signal::DcLink.read(drive) as u16,
            drive.shown_fault(),
            drive.traverse_status().outputs,
        ]);
    }

    fn send_process_data(&mut self) {
        self.since_sync_ms = self.since_sync_ms.saturating_add(1);
        if self.settings.sync_ms > 0 && self.since_sync_ms >= self.settings.sync_ms {
            self.since_sync_ms = 0;
            self.send(CanFrame::of(self.identifiers.sync_sent(), [0; 8], 0));
        }
        if self.state != NmtState::Operational || self.operational_ms <= self.settings.delay_ms {
            return;
        }
        for (place, cycle_ms) in (1..).zip(self.settings.cycle_ms) {
            let output = &mut self.outputs[place];
            output.since_ms = output.since_ms.saturating_add(1);
            let due = match cycle_ms {
                0 => output.sent != Some(output.octets),
                cycle_ms => output.since_ms >= cycle_ms,
            };
            if due {
                self.send_output(place);
            }
        }
    }

    fn send_output(&mut self, place: usize) {
        let output = &mut self.outputs[place];
        output.sent = Some(output.octets);
        output.since_ms = 0;
        let octets = output.octets;
        let object = [Object::Out1, Object::Out2, Object::Out3][place];
        self.send(CanFrame::of(self.identifiers.id(object), octets, 8));
    }

    fn send(&mut self, frame: CanFrame) {
        if self.bus == BusState::Off || self.to_send.len() == QUEUE {
            return;
        }
        self.traffic.sent(&frame, self.identifiers.object(frame.id()));
        self.to_send.push_back(frame);
    }

    fn show(&self, drive: &mut Drive) {
        let state = match (self.bus, self.state) {
            (BusState::Off, _) => 3,
            (BusState::Warning | BusState::Passive, _) => 2,
            (BusState::Active, NmtState::Operational) => 0,
            // The display knows no "stopped".
            (BusState::Active, NmtState::PreOperational | NmtState::Stopped) => 1,
        };
        drive.show(C0359, 0, state * 10_000);
        for (subcode, object) in (1..).zip(Object::PROCESS) {
            drive.show(C0355, subcode, i32::from(self.identifiers.id(object)) * 10_000);
        }
        for (subcode, count) in (1..).zip(self.traffic.counts()) {
            drive.show(C0360, subcode, i32::from(count) * 10_000);
        }
        for (subcode, percent) in (1..).zip(self.traffic.percent()) {
            drive.show(C0361, subcode, i32::from(percent) * 10_000);
        }
    }

    fn tell(&mut self, event: CanNodeEvent) {
        if self.events.len() == EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }
}

/// 16384 = 100 %.
const FULL: f64 = 16_384.0;

impl Settings {
    fn from_codes(codes: &CodeStore) -> Self {
        let whole = |code, subcode| codes.number(code, subcode) as u32;
        Self {
            is_master: whole(C0352, 0) == 1,
            answers_sync: whole(C0366, 0) == 1,
            boot_ms: u64::from(whole(C0356, 1)),
            cycle_ms: [whole(C0356, 2), whole(C0356, 3)],
            delay_ms: u64::from(whole(C0356, 4)),
            sync_ms: whole(C0369, 0),
            monitoring_ms: [1, 2, 3].map(|subcode| whole(C0357, subcode)),
        }
    }
}

/// Works a parameter job.
fn carry_out(request: Request, drive: &mut Drive) -> Response {
    let (code, subcode) = request.place();
    let outcome = match request {
        Request::Read { .. } => drive.read_code(code, subcode).map(Some),
        Request::Write { data, .. } => drive
            .codes()
            .check_length(code, data.len())
            .and_then(|()| drive.write_code(code, subcode, data.value()))
            .map(|()| None),
    };
    match outcome {
        Ok(None) => Response::Written { code, subcode },
        Ok(Some(value)) => {
            let data = match entry(code).map(|entry| entry.length) {
                Some(DataLength::Two) => Data::two(value),
                Some(DataLength::Four) | None => Data::four(value),
            };
            Response::Value { code, subcode, data }
        }
        Err(error) => Response::Refused {
            code,
            subcode,
            reason: Refusal::from(&error),
        },
    }
}
