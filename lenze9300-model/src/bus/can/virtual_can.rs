use std::collections::VecDeque;

use dp_master::time::{Duration, Instant};

use super::CanFrame;
use crate::bus::can_port::BusState;

/// A CAN bus inside this program: arbitration by identifier, the time each frame takes, acknowledgement, error counters.
///
/// Frames wait at their stations. When the bus is free the lowest identifier goes first and lasts as many bits as it has with its stuff
/// bits; then every other station has it. A frame that nobody acknowledges, that is disturbed, or that a station with another bit
/// rate destroys, counts an error at its sender and is tried again. Counters and states follow the fault confinement of ISO 11898-1, with
/// its numbers: +8 for an error at a sender, −1 for a frame that went well; error passive from 128, off above 255.
///
/// # Example
///
/// ```
/// use dp_master::time::{Duration, Instant};
/// use lenze9300_model::bus::can::{CanFrame, VirtualCan};
///
/// let mut bus = VirtualCan::new();
/// let (a, b) = (bus.attach(500_000), bus.attach(500_000));
/// bus.send(a, CanFrame::new(0x181, &[1, 2]).unwrap());
/// bus.advance_to(Instant::ZERO + Duration::from_micros(200));
/// assert_eq!(bus.receive(b).map(|frame| frame.id()), Some(0x181));
/// ```
#[derive(Debug, Clone, Default)]
pub struct VirtualCan {
    now: Instant,
    stations: Vec<Station>,
    on_wire: Option<OnWire>,
    /// Until then the bus is not free.
    free_at: Instant,
    disturbed: u32,
}

/// A station of a [`VirtualCan`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CanPortId(usize);

#[derive(Debug, Clone)]
struct Station {
    bit_rate: u32,
    is_connected: bool,
    to_send: VecDeque<CanFrame>,
    received: VecDeque<CanFrame>,
    sending_errors: u32,
    receiving_errors: u32,
    is_off: bool,
}

#[derive(Debug, Clone, Copy)]
struct OnWire {
    sender: usize,
    frame: CanFrame,
    until: Instant,
    goes_well: bool,
}

/// Frames a station keeps to be sent, and of those it received; more are lost.
const KEPT: usize = 256;
/// Bits of an error frame with its delimiter and the intermission: 6 + 6 + 8 + 3.
const ERROR_BITS: u32 = 23;

impl VirtualCan {
    /// A bus without stations, at time 0.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a station with a bit rate, bit/s.
    pub fn attach(&mut self, bit_rate: u32) -> CanPortId {
        self.stations.push(Station {
            bit_rate: bit_rate.max(1),
            is_connected: true,
            to_send: VecDeque::new(),
            received: VecDeque::new(),
            sending_errors: 0,
            receiving_errors: 0,
            is_off: false,
        });
        CanPortId(self.stations.len() - 1)
    }

    /// Hands a frame to a station; `false` when it keeps too many already, or is off the bus.
    pub fn send(&mut self, station: CanPortId, frame: CanFrame) -> bool {
        let station = &mut self.stations[station.0];
        let takes = !station.is_off && station.to_send.len() < KEPT;
        if takes {
            station.to_send.push_back(frame);
        }
        takes
    }

    /// The oldest frame that a station has received.
    pub fn receive(&mut self, station: CanPortId) -> Option<CanFrame> {
        self.stations[station.0].received.pop_front()
    }

    /// Plugs a station in or out.
    pub fn set_connected(&mut self, station: CanPortId, is_connected: bool) {
        self.stations[station.0].is_connected = is_connected;
    }

    /// Sets the bit rate of a station, bit/s.
    pub fn set_bit_rate(&mut self, station: CanPortId, bit_rate: u32) {
        self.stations[station.0].bit_rate = bit_rate.max(1);
    }

    /// Lets the next so many frames be destroyed by a disturbance.
    pub fn disturb(&mut self, frames: u32) {
        self.disturbed = frames;
    }

    /// Puts a station that went off back on the bus, its counters at zero. (The 128 times 11 recessive bits that ISO 11898-1 asks for
    /// have passed before anybody does this.)
    pub fn restart(&mut self, station: CanPortId) {
        let station = &mut self.stations[station.0];
        station.is_off = false;
        station.sending_errors = 0;
        station.receiving_errors = 0;
    }

    /// Error state of a station.
    #[must_use]
    pub fn state(&self, station: CanPortId) -> BusState {
        self.stations[station.0].state()
    }

    /// Frames of a station that wait to be sent.
    #[must_use]
    pub fn waiting(&self, station: CanPortId) -> usize {
        self.stations[station.0].to_send.len()
    }

    /// Time of the bus.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.now
    }

    /// When the frame on the bus ends; `None` when there is none.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.on_wire.map(|frame| frame.until)
    }

    /// Lets the bus run until `now`.
    pub fn advance_to(&mut self, now: Instant) {
        loop {
            match self.on_wire {
                Some(frame) if frame.until <= now => {
                    self.on_wire = None;
                    self.free_at = frame.until;
                    self.end(frame);
                }
                Some(_) => break,
                None => {
                    let start = if self.free_at > self.now {
                        self.free_at
                    } else {
                        self.now
                    };
                    if start > now {
                        break;
                    }
                    match self.begin(start) {
                        Some(frame) => self.on_wire = Some(frame),
                        None => break,
                    }
                }
            }
        }
        self.now = now;
    }

    /// Arbitration: of all stations that have something to send, the lowest identifier; with the same one a data frame goes before the
    /// request for it (ISO 11898-1: the RTR bit of a data frame is dominant).
    fn begin(&mut self, start: Instant) -> Option<OnWire> {
        let (sender, frame) = self
            .stations
            .iter()
            .enumerate()
            .filter(|(_, station)| station.is_connected && !station.is_off)
            .filter_map(|(place, station)| station.to_send.front().map(|frame| (place, *frame)))
            .min_by_key(|(_, frame)| (frame.id(), frame.is_remote()))?;
        let bit_rate = self.stations[sender].bit_rate;
        let others = || {
            self.stations
                .iter()
                .enumerate()
                .filter(move |(place, station)| *place != sender && station.is_connected && !station.is_off)
                .map(|(_, station)| station)
        };
        let is_acknowledged = others().any(|station| station.bit_rate == bit_rate);
        // Who is error passive can no longer destroy frames.
        let is_destroyed = others().any(|station| station.bit_rate != bit_rate && !station.is_passive());
        let is_disturbed = self.disturbed > 0;
        if is_disturbed {
            self.disturbed -= 1;
        }
        let goes_well = is_acknowledged && !is_destroyed && !is_disturbed;
        let bits = frame.bits() + if goes_well { 0 } else { ERROR_BITS };
        let nanos = u64::from(bits) * 1_000_000_000 / u64::from(bit_rate);
        Some(OnWire {
            sender,
            frame,
            until: start + Duration::from_nanos(nanos),
            goes_well,
        })
    }

    fn end(&mut self, wire: OnWire) {
        let bit_rate = self.stations[wire.sender].bit_rate;
        let had_listeners = self
            .stations
            .iter()
            .enumerate()
            .any(|(place, station)| place != wire.sender && station.is_connected && !station.is_off);
        for (place, station) in self.stations.iter_mut().enumerate() {
            if place == wire.sender || !station.is_connected || station.is_off {
                continue;
            }
            if wire.goes_well && station.bit_rate == bit_rate {
                station.receiving_errors = station.receiving_errors.saturating_sub(1);
                if station.received.len() < KEPT {
                    station.received.push_back(wire.frame);
                }
            } else {
                // It sees no frame but errors.
                station.receiving_errors = (station.receiving_errors + 8).min(255);
            }
        }
        let sender = &mut self.stations[wire.sender];
        if wire.goes_well {
            sender.sending_errors = sender.sending_errors.saturating_sub(1);
            sender.to_send.pop_front();
        } else if had_listeners || sender.sending_errors < 128 {
            // An error passive station that nobody acknowledges does not count on: alone on the bus it never goes off.
            sender.sending_errors += 8;
        }
        if sender.sending_errors > 255 {
            sender.is_off = true;
            sender.to_send.clear();
        }
    }
}

impl Station {
    fn is_passive(&self) -> bool {
        self.sending_errors > 127 || self.receiving_errors > 127
    }

    fn state(&self) -> BusState {
        let errors = self.sending_errors.max(self.receiving_errors);
        match (self.is_off, self.is_passive()) {
            (true, _) => BusState::Off,
            (false, true) => BusState::Passive,
            (false, false) if errors >= 96 => BusState::Warning,
            (false, false) => BusState::Active,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16) -> CanFrame {
        CanFrame::new(id, &[0x55; 8]).expect("a frame")
    }

    fn at_us(us: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(us)
    }

    #[test]
    fn the_lowest_identifier_goes_first_and_all_others_have_it() {
        let mut bus = VirtualCan::new();
        let [a, b, c] = [0; 3].map(|_| bus.attach(1_000_000));
        bus.send(a, frame(0x300));
        bus.send(b, frame(0x100));
        bus.send(a, frame(0x200));
        bus.advance_to(at_us(1000));
        let ids = |bus: &mut VirtualCan, port| {
            std::iter::from_fn(|| bus.receive(port))
                .map(|f| f.id())
                .collect::<Vec<_>>()
        };
        assert_eq!(
            ids(&mut bus, c),
            [0x100, 0x300, 0x200],
            "a station sends in its own order"
        );
        assert_eq!(ids(&mut bus, a), [0x100]);
        assert_eq!(ids(&mut bus, b), [0x300, 0x200]);
    }

    #[test]
    fn data_go_before_the_request_for_them() {
        let mut bus = VirtualCan::new();
        let [a, b, c] = [0; 3].map(|_| bus.attach(500_000));
        bus.send(a, CanFrame::new_remote(0x300, 8).expect("a request"));
        bus.send(b, frame(0x300));
        bus.advance_to(at_us(1000));
        let kinds: Vec<bool> = std::iter::from_fn(|| bus.receive(c)).map(|f| f.is_remote()).collect();
        assert_eq!(kinds, [false, true]);
    }

    #[test]
    fn a_frame_takes_its_bits() {
        let mut bus = VirtualCan::new();
        let (a, b) = (bus.attach(500_000), bus.attach(500_000));
        let long = frame(0x555);
        bus.send(a, long);
        bus.advance_to(at_us(1));
        let end = bus.poll_timeout().expect("it is on the bus");
        assert_eq!(end, at_us(u64::from(long.bits()) * 2));
        bus.advance_to(at_us(u64::from(long.bits()) * 2 - 1));
        assert!(bus.receive(b).is_none());
        bus.advance_to(at_us(u64::from(long.bits()) * 2));
        assert!(bus.receive(b).is_some());
    }

    #[test]
    fn alone_a_station_becomes_passive_and_never_goes_off() {
        // ISO 11898-1, exception of rule 3: no acknowledgement while error passive does not count.
        let mut bus = VirtualCan::new();
        let a = bus.attach(500_000);
        bus.send(a, frame(0x100));
        bus.advance_to(at_us(1_000_000));
        assert_eq!((bus.state(a), bus.waiting(a)), (BusState::Passive, 1));
        let b = bus.attach(500_000);
        bus.advance_to(at_us(1_001_000));
        assert!(bus.receive(b).is_some(), "with a second station it goes through");
    }

    #[test]
    fn a_station_at_a_wrong_bit_rate_goes_off_when_it_sends_and_hears_nothing_else() {
        let mut bus = VirtualCan::new();
        let (a, b, wrong) = (bus.attach(500_000), bus.attach(500_000), bus.attach(250_000));
        for n in 0..40 {
            bus.send(a, frame(0x100 + n));
        }
        bus.advance_to(at_us(50_000));
        assert_eq!(
            std::iter::from_fn(|| bus.receive(b)).count(),
            40,
            "it can only disturb for a while"
        );
        assert_eq!(bus.state(wrong), BusState::Passive);
        assert!(bus.receive(wrong).is_none());
        bus.send(wrong, frame(0x080));
        bus.advance_to(at_us(200_000));
        assert_eq!(bus.state(wrong), BusState::Off);
        assert!(!bus.send(wrong, frame(0x080)));
        bus.set_bit_rate(wrong, 500_000);
        bus.restart(wrong);
        assert!(bus.send(wrong, frame(0x080)));
        bus.advance_to(at_us(201_000));
        assert_eq!(bus.receive(a).map(|f| f.id()), Some(0x080));
    }

    #[test]
    fn a_disturbed_frame_is_sent_again() {
        let mut bus = VirtualCan::new();
        let (a, b) = (bus.attach(500_000), bus.attach(500_000));
        bus.disturb(3);
        bus.send(a, frame(0x100));
        bus.advance_to(at_us(2000));
        assert!(bus.receive(b).is_some() && bus.receive(b).is_none());
        // Thirty-two in a row are too many: 32 · 8 = 256.
        bus.disturb(32);
        bus.send(a, frame(0x100));
        bus.advance_to(at_us(100_000));
        assert_eq!(bus.state(a), BusState::Off);
    }

    #[test]
    fn who_is_unplugged_neither_sends_nor_hears() {
        let mut bus = VirtualCan::new();
        let (a, b, c) = (bus.attach(500_000), bus.attach(500_000), bus.attach(500_000));
        bus.set_connected(b, false);
        bus.send(a, frame(0x100));
        bus.send(b, frame(0x200));
        bus.advance_to(at_us(1000));
        assert_eq!(std::iter::from_fn(|| bus.receive(c)).count(), 1);
        assert!(bus.receive(b).is_none() && bus.waiting(b) == 1);
        bus.set_connected(b, true);
        bus.advance_to(at_us(2000));
        assert_eq!(std::iter::from_fn(|| bus.receive(c)).count(), 1);
    }
}
