//! An adapter that speaks the LAWICEL protocol, on any line.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use dp_master::phy::{Port, PortError};

use super::events::Events;
use super::slcan::{Answer, BitRate, Command, Decoder, StatusFlags};
use super::{BusState, CanBusEvent, CanPort, CanPortError};
use crate::bus::can::CanFrame;

/// What an adapter needs of a line: octets, no bit rate of its own.
pub trait Line {
    /// Waits until octets arrive, at most `max_wait`, and returns how many were put to the front of `buf`.
    ///
    /// # Errors
    ///
    /// [`PortError`], of kind `Unplugged` when the adapter is gone.
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError>;

    /// Hands all octets to the line.
    ///
    /// # Errors
    ///
    /// As [`receive`](Self::receive).
    fn send(&mut self, octets: &[u8]) -> Result<(), PortError>;
}

impl<P: Port> Line for P {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        Port::receive(self, buf, max_wait)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        Port::send(self, octets)
    }
}

/// An adapter with the LAWICEL protocol behind a line.
///
/// The adapter is asked for its status once a second; firmware that does not answer (several do not) reports no state of the bus. The protocol
/// has no flag for bus off: an adapter there refuses frames.
#[derive(Debug)]
pub struct SlcanPort<P: Line> {
    line: P,
    name: String,
    decoder: Decoder,
    frames: VecDeque<CanFrame>,
    events: Events,
    state: BusState,
    /// A frame was refused since the last call of `send`.
    refused: bool,
    next_status: Instant,
}

impl<P: Line> SlcanPort<P> {
    /// Closes the bus of an adapter that somebody left open, sets the bit rate and opens it.
    ///
    /// An adapter that keeps silent is taken for one whose firmware acknowledges nothing.
    ///
    /// # Errors
    ///
    /// [`CanPortError::BitRateRefused`], [`CanPortError::NotOpened`] when the adapter says so, [`CanPortError::Line`] when the line fails.
    pub fn open(line: P, name: impl Into<String>, rate: BitRate) -> Result<Self, CanPortError> {
        let mut port = Self {
            line,
            name: name.into(),
            decoder: Decoder::default(),
            frames: VecDeque::new(),
            events: Events::default(),
            state: BusState::Active,
            refused: false,
            next_status: Instant::now() + STATUS_PERIOD,
        };
        // Ends whatever half a line the adapter has; its answers to this do not count.
        port.line.send(b"\r\r")?;
        port.command(Command::Close)?;
        port.drain()?;
        let name = port.name.clone();
        if port.command(Command::SetBitRate(rate))? == Some(Answer::Refused) {
            return Err(CanPortError::BitRateRefused {
                name,
                kbit_s: rate.kbit_s(),
            });
        }
        if port.command(Command::Open)? == Some(Answer::Refused) {
            return Err(CanPortError::NotOpened { name });
        }
        Ok(port)
    }

    /// Sends a command and waits for its answer.
    fn command(&mut self, command: Command) -> Result<Option<Answer>, CanPortError> {
        let mut octets = Vec::new();
        command.encode(&mut octets);
        self.line.send(&octets)?;
        let begun = Instant::now();
        while let Some(left) = ANSWER_TIME.checked_sub(begun.elapsed()) {
            let mut buf = [0; 64];
            let received = self.line.receive(&mut buf, left)?;
            let mut answer = None;
            for octet in &buf[..received] {
                match self.decoder.push(*octet) {
                    Some(found @ (Answer::Done | Answer::Refused)) => answer = answer.or(Some(found)),
                    Some(Answer::Frame(frame)) => self.frames.push_back(frame),
                    _ => {}
                }
            }
            if answer.is_some() {
                return Ok(answer);
            }
        }
        Ok(None)
    }

    /// Throws away what is still on its way. An adapter that does not close the bus may go on for ever, so not longer than an answer takes.
    fn drain(&mut self) -> Result<(), CanPortError> {
        let mut buf = [0; 256];
        let begun = Instant::now();
        while begun.elapsed() < ANSWER_TIME && self.line.receive(&mut buf, SETTLE)? > 0 {}
        self.decoder = Decoder::default();
        self.frames.clear();
        Ok(())
    }

    fn take(&mut self, answer: Answer) {
        match answer {
            Answer::Frame(frame) => self.frames.push_back(frame),
            Answer::Refused => self.refused = true,
            Answer::Status(flags) => self.note_status(flags),
            Answer::Extended | Answer::Done | Answer::Unknown => {}
        }
    }

    fn note_status(&mut self, flags: StatusFlags) {
        if flags.overrun() {
            self.events.push(CanBusEvent::Overrun);
        }
        let state = match flags {
            flags if flags.passive() => BusState::Passive,
            flags if flags.warning() => BusState::Warning,
            _ => BusState::Active,
        };
        if state != self.state {
            self.state = state;
            self.events.push(CanBusEvent::State(state));
        }
    }
}

impl<P: Line> CanPort for SlcanPort<P> {
    fn receive(&mut self, max_wait: Duration) -> Result<Option<CanFrame>, CanPortError> {
        if let Some(frame) = self.frames.pop_front() {
            return Ok(Some(frame));
        }
        if Instant::now() >= self.next_status {
            self.next_status = Instant::now() + STATUS_PERIOD;
            self.line.send(b"F\r")?;
        }
        let mut buf = [0; 256];
        let received = self.line.receive(&mut buf, max_wait)?;
        for octet in &buf[..received] {
            if let Some(answer) = self.decoder.push(*octet) {
                self.take(answer);
            }
        }
        Ok(self.frames.pop_front())
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), CanPortError> {
        if std::mem::take(&mut self.refused) {
            return Err(CanPortError::Full {
                name: self.name.clone(),
            });
        }
        let mut octets = Vec::with_capacity(22);
        Command::Send(*frame).encode(&mut octets);
        Ok(self.line.send(&octets)?)
    }

    fn poll_event(&mut self) -> Option<CanBusEvent> {
        self.events.pop()
    }
}

impl<P: Line> Drop for SlcanPort<P> {
    fn drop(&mut self) {
        // Best effort: an adapter left open fills its queue, and the next user closes it first anyway.
        drop(self.line.send(b"C\r"));
    }
}

/// How long an adapter may take to answer a command.
const ANSWER_TIME: Duration = Duration::from_millis(200);
/// Silence after which nothing more is on its way.
const SETTLE: Duration = Duration::from_millis(20);
const STATUS_PERIOD: Duration = Duration::from_secs(1);
