//! A virtual RS485 line: characters in virtual time, and a policeman.

use super::fault::{Disturbance, Script, received};
use super::police::Police;
pub use super::police::{Rule, Violation};
use super::segment::{NEVER, Scratch};
use crate::station::LineError;
use crate::time::{Baud, Instant};

/// A place where a station is connected to a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PortId(pub(super) usize);

impl PortId {
    /// The number of the port: 0, 1, 2… in the order of [`VirtualBus::attach`].
    #[must_use]
    pub const fn index(self) -> usize {
        self.0
    }
}

/// Something that happened on the line, for one port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusEvent<'a> {
    /// The last bit of what this port sent left the line.
    Sent {
        /// When.
        at: Instant,
        /// The sender.
        port: PortId,
    },
    /// Octets arrived; they follow each other without a gap.
    Octets {
        /// When the last of their characters ended.
        at: Instant,
        /// The receiver.
        port: PortId,
        /// One or more octets.
        octets: &'a [u8],
    },
    /// A character that cannot be used ended.
    LineError {
        /// When it ended.
        at: Instant,
        /// The receiver.
        port: PortId,
        /// What the receiver makes of it.
        error: LineError,
    },
}

impl BusEvent<'_> {
    /// When it happened.
    #[must_use]
    pub const fn at(&self) -> Instant {
        match self {
            Self::Sent { at, .. } | Self::Octets { at, .. } | Self::LineError { at, .. } => *at,
        }
    }

    /// Whom it concerns.
    #[must_use]
    pub const fn port(&self) -> PortId {
        match self {
            Self::Sent { port, .. } | Self::Octets { port, .. } | Self::LineError { port, .. } => *port,
        }
    }
}

/// What went over a line since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Transmissions, each of contiguous characters.
    pub bursts: u64,
    /// Characters in them.
    pub characters: u64,
    /// Characters with flipped bits or spoiled by a script, noticed by the receivers or not. Collisions are not counted here.
    pub spoiled: u64,
    /// Characters that reached nobody: dropped, cut, or sent by a disconnected port.
    pub lost: u64,
    /// Broken rules, also those that no longer fit into the list.
    pub violations: u64,
}

/// A virtual RS485 line with any number of ports.
///
/// # Order
///
/// [`poll`](Self::poll) gives events in the order of time. Within one instant:
///
/// 1. the transmission that began first,
/// 2. of a transmission that ends: [`BusEvent::Sent`] for the sender, then its last octets for the receivers,
/// 3. receivers in the order of [`attach`](Self::attach).
///
/// Of each transmission every other port gets the first character when it ends, because the slot time is about that one, and the rest when
/// the last character ends. Characters that cannot be used divide the rest; they and the octets before them come when they end.
/// A port does not hear itself.
///
/// # Time
///
/// Character n of a transmission (counted from 1) ends `baud.characters(n)` after its start: rounded up to a nanosecond once, not once per
/// character.
///
/// # Collisions
///
/// Characters of two transmissions that overlap are [`LineError::Framing`] for everyone who is not sending. Octets that were on their way
/// when a collision begins are delivered at that moment.
///
/// # Cost
///
/// Work per transmission does not depend on its length except for copying it once, and nothing is allocated once the buffers have grown.
#[derive(Clone, Debug)]
pub struct VirtualBus {
    baud: Baud,
    ports: Vec<Port>,
    /// Transmissions on the line in the order of their start; those from index `active` on are kept for their buffers.
    bursts: Vec<Burst>,
    active: usize,
    due: Due,
    number: u64,
    disturbance: Option<Disturbance>,
    scripts: Vec<Script>,
    statistics: Statistics,
    police: Police,
    pub(super) scratch: Option<Box<Scratch>>,
}

/// The earliest run of the transmissions on the line.
#[derive(Clone, Copy, Debug)]
struct Due {
    /// When; [`NEVER`] without a transmission.
    at: Instant,
    /// Of which transmission: the one that began first when several are due.
    burst: usize,
}

impl Due {
    const NOTHING: Self = Self { at: NEVER, burst: 0 };
}

#[derive(Clone, Debug)]
struct Port {
    connection: Connection,
    /// When its last transmission began and ended.
    sending: (Instant, Instant),
    /// Transmissions whose end it was not told yet.
    under_way: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Connection {
    Connected,
    Disconnected,
}

#[derive(Clone, Debug, Default)]
struct Burst {
    sender: usize,
    start: Instant,
    end: Instant,
    octets: Vec<u8>,
    /// Characters that are not simply their octet, by rising index.
    marks: Vec<(usize, Mark)>,
    /// What is delivered together, by rising time. The last one ends the transmission.
    runs: Vec<Run>,
    next_run: usize,
    next_receiver: usize,
    sent: bool,
    /// Whether it drives the line at all.
    on_line: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mark {
    Error(LineError),
    Collision,
    Lost,
}

#[derive(Clone, Copy, Debug)]
struct Run {
    from: usize,
    to: usize,
    at: Instant,
    mark: Option<Mark>,
}

impl VirtualBus {
    /// An undisturbed line without stations.
    #[must_use]
    pub fn new(baud: Baud) -> Self {
        Self {
            baud,
            ports: Vec::new(),
            bursts: Vec::new(),
            active: 0,
            due: Due::NOTHING,
            number: 0,
            disturbance: None,
            scripts: Vec::new(),
            statistics: Statistics::default(),
            police: Police::new(baud),
            scratch: None,
        }
    }

    /// The baud rate of the line.
    #[must_use]
    pub const fn baud(&self) -> Baud {
        self.baud
    }

    /// Connects a new port. A port that never transmits is a tap that hears everything.
    pub fn attach(&mut self) -> PortId {
        self.ports.push(Port {
            connection: Connection::Connected,
            sending: (Instant::ZERO, Instant::ZERO),
            under_way: 0,
        });
        PortId(self.ports.len() - 1)
    }

    /// Pulls the plug of a port, at once: what it sends reaches nobody (it is told [`BusEvent::Sent`] all the same) and it hears nothing.
    pub fn disconnect(&mut self, port: PortId) {
        self.plug(port, Connection::Disconnected);
    }

    /// Puts the plug back.
    pub fn reconnect(&mut self, port: PortId) {
        self.plug(port, Connection::Connected);
    }

    fn plug(&mut self, port: PortId, connection: Connection) {
        if let Some(port) = self.ports.get_mut(port.0) {
            port.connection = connection;
        }
    }

    /// Bit errors by chance from the next transmission on; `None` ends them.
    pub fn set_disturbance(&mut self, disturbance: Option<Disturbance>) {
        self.disturbance = disturbance;
    }

    /// Adds a fault at a chosen place. One that names a burst is forgotten when that burst was sent.
    pub fn script(&mut self, script: Script) {
        self.scripts.push(script);
    }

    /// How many transmissions there were, which is the number of the next one.
    #[must_use]
    pub const fn bursts(&self) -> u64 {
        self.number
    }

    /// What went over the line.
    #[must_use]
    pub const fn statistics(&self) -> Statistics {
        Statistics {
            violations: self.police.count(),
            ..self.statistics
        }
    }

    /// The first 1024 broken rules, in the order of time.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        self.police.violations()
    }

    /// Forgets the broken rules.
    pub fn clear_violations(&mut self) {
        self.police.clear();
    }

    /// Whether this port has a transmission on the line whose end it was not told yet.
    #[inline]
    #[must_use]
    pub fn is_sending(&self, port: PortId) -> bool {
        self.ports.get(port.0).is_some_and(|port| port.under_way > 0)
    }

    /// Puts octets on the line, the first start bit at `now`, character behind character. Returns when the last bit will have left.
    ///
    /// `now` must not be earlier than the last event that [`poll`](Self::poll) gave. No octets are no transmission.
    pub fn transmit(&mut self, now: Instant, port: PortId, octets: &[u8]) -> Instant {
        if octets.is_empty() || port.0 >= self.ports.len() {
            return now;
        }
        self.retire();
        let number = self.number;
        self.number += 1;
        self.statistics.bursts += 1;
        self.statistics.characters += octets.len() as u64;

        let end = now + self.baud.characters(octets.len());
        if self.bursts.len() == self.active {
            self.bursts.push(Burst::default());
        }
        let (active, [burst, ..]) = self.bursts.split_at_mut(self.active) else {
            return now;
        };
        let sender = &mut self.ports[port.0];
        sender.sending = (now, end);
        sender.under_way += 1;
        burst.begin(port.0, now, end, octets);
        burst.on_line = sender.connection == Connection::Connected;

        // The draw belongs to the burst, whether it arrives or not, so that pulling one plug does not change the fate of other telegrams.
        let spoiled_before = self.statistics.spoiled;
        if let Some(disturbance) = &mut self.disturbance {
            let Burst { octets, marks, .. } = &mut *burst;
            disturbance.burst(octets.len(), |index, flipped| {
                self.statistics.spoiled += 1;
                flip(octets, marks, index, flipped);
            });
        }
        if !self.scripts.is_empty() {
            play_scripts(&mut self.scripts, number, self.baud, burst, &mut self.statistics);
        }
        if burst.on_line {
            // Judged by what was sent, not by what a disturbance made of it.
            self.police.burst(now, end, port, octets);
            if !active.is_empty() {
                collide(active, burst, self.baud, now, &mut self.police);
            }
        } else {
            burst.marks.clear();
            burst.marks.extend((0..octets.len()).map(|index| (index, Mark::Lost)));
            self.statistics.spoiled = spoiled_before;
            self.statistics.lost += octets.len() as u64;
        }
        burst.plan(0, self.baud, now);
        self.active += 1;
        self.find_due();
        end
    }

    /// When the next event is due.
    #[inline]
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        (self.due.at != NEVER).then_some(self.due.at)
    }

    /// The same as a plain moment, [`NEVER`] for none.
    #[inline]
    pub(super) const fn due(&self) -> Instant {
        self.due.at
    }

    /// The next event that happened up to and including `now`. To be called until `None`.
    #[inline]
    pub fn poll(&mut self, now: Instant) -> Option<BusEvent<'_>> {
        if self.due.at > now {
            return None;
        }
        self.next_event(now)
    }

    #[inline]
    fn next_event(&mut self, now: Instant) -> Option<BusEvent<'_>> {
        let (index, run, receiver) = loop {
            let Due { at, burst: index } = self.due;
            if at > now {
                return None;
            }
            let ports = self.ports.len();
            let burst = self.bursts.get_mut(index)?;
            let run = *burst.runs.get(burst.next_run)?;
            if !burst.sent && burst.next_run + 1 == burst.runs.len() {
                burst.sent = true;
                self.ports[burst.sender].under_way -= 1;
                break (index, run, None);
            }
            let (sender, first) = (burst.sender, burst.next_receiver);
            let receiver = (first..ports).find(|receiver| *receiver != sender && self.hears(*receiver, sender, &run));
            let next = receiver.map_or(ports, |receiver| receiver + 1);
            self.bursts[index].next_receiver = next;
            if next == ports || (next + 1 == ports && next == sender) {
                self.advance(index);
            }
            if receiver.is_some() {
                break (index, run, receiver);
            }
        };
        let burst = &self.bursts[index];
        let at = run.at;
        Some(match (receiver.map(PortId), run.mark) {
            (None, _) => BusEvent::Sent {
                at,
                port: PortId(burst.sender),
            },
            (Some(port), None) => BusEvent::Octets {
                at,
                port,
                octets: &burst.octets[run.from..run.to],
            },
            (Some(port), Some(Mark::Error(error))) => BusEvent::LineError { at, port, error },
            (Some(port), Some(Mark::Collision | Mark::Lost)) => BusEvent::LineError {
                at,
                port,
                error: LineError::Framing,
            },
        })
    }

    #[inline]
    fn on_the_way(&self) -> &[Burst] {
        &self.bursts[..self.active]
    }

    /// Everybody has had the present run of a transmission.
    #[inline]
    fn advance(&mut self, index: usize) {
        if let Some(burst) = self.bursts.get_mut(index) {
            burst.next_run += 1;
            burst.next_receiver = 0;
        }
        self.find_due();
    }

    #[inline]
    fn find_due(&mut self) {
        let mut due = Due::NOTHING;
        // They stand in the order of their start.
        for (burst, at) in self.on_the_way().iter().map(Burst::due).enumerate() {
            if at < due.at {
                due = Due { at, burst };
            }
        }
        self.due = due;
    }

    /// Whether a port can receive a run of a transmission: it is connected, and it was not sending itself during the first character.
    #[inline]
    fn hears(&self, receiver: usize, sender: usize, run: &Run) -> bool {
        let port = &self.ports[receiver];
        if run.mark == Some(Mark::Lost)
            || port.connection == Connection::Disconnected
            || self.ports[sender].connection == Connection::Disconnected
        {
            return false;
        }
        // Only collisions overlap, so the comparison is not needed otherwise.
        run.mark != Some(Mark::Collision) || {
            let begin = run.at - self.baud.characters(1);
            begin >= port.sending.1 || run.at <= port.sending.0
        }
    }

    /// Puts finished transmissions behind the active ones and keeps the order of the others.
    #[inline]
    fn retire(&mut self) {
        let mut index = 0;
        while index < self.active {
            let burst = &self.bursts[index];
            if burst.next_run < burst.runs.len() {
                index += 1;
                continue;
            }
            self.active -= 1;
            for place in index..self.active {
                self.bursts.swap(place, place + 1);
            }
        }
    }
}

impl Burst {
    /// Starts anew with the buffers of the one that was here before.
    #[inline]
    fn begin(&mut self, sender: usize, start: Instant, end: Instant, octets: &[u8]) {
        (self.sender, self.start, self.end) = (sender, start, end);
        (self.next_run, self.next_receiver, self.sent) = (0, 0, false);
        self.octets.clear();
        self.octets.extend_from_slice(octets);
        self.marks.clear();
        self.runs.clear();
    }

    /// When its next run is due; [`NEVER`] after the last one.
    #[inline]
    fn due(&self) -> Instant {
        self.runs.get(self.next_run).map_or(NEVER, |run| run.at)
    }

    /// Divides the characters from `from` on into runs; none of them is due before `not_before`.
    #[inline]
    fn plan(&mut self, from: usize, baud: Baud, not_before: Instant) {
        if self.marks.is_empty() && from == 0 {
            let at = self.start + baud.characters(1);
            self.runs.push(Run {
                from: 0,
                to: 1,
                at,
                mark: None,
            });
            if self.octets.len() > 1 {
                self.runs.push(Run {
                    from: 1,
                    to: self.octets.len(),
                    at: self.end,
                    mark: None,
                });
            }
        } else {
            self.plan_marked(from, baud, not_before);
        }
    }

    #[cold]
    fn plan_marked(&mut self, from: usize, baud: Baud, not_before: Instant) {
        let mut marks = self
            .marks
            .iter()
            .filter(|(index, _)| *index >= from)
            .copied()
            .peekable();
        let mut from = from;
        while from < self.octets.len() {
            let (to, mark) = match marks.peek() {
                Some(&(index, mark)) if index == from => {
                    marks.next();
                    (from + 1, Some(mark))
                }
                _ if from == 0 => (1, None),
                Some(&(index, _)) => (index, None),
                None => (self.octets.len(), None),
            };
            let at = (self.start + baud.characters(to)).max(not_before);
            self.runs.push(Run { from, to, at, mark });
            from = to;
        }
    }
}

/// Does to a burst what the scripts say, and forgets those that have had their turn.
#[cold]
fn play_scripts(scripts: &mut Vec<Script>, number: u64, baud: Baud, burst: &mut Burst, statistics: &mut Statistics) {
    let (start, length) = (burst.start, burst.octets.len());
    scripts.retain(|script| match *script {
        Script::Drop { burst: wanted } if wanted == number => {
            burst.on_line = false;
            false
        }
        Script::Spoil {
            burst: wanted,
            character,
            error,
        } if wanted == number => {
            if character < length {
                mark(&mut burst.marks, character, Mark::Error(error));
                statistics.spoiled += 1;
            }
            false
        }
        Script::Flip {
            burst: wanted,
            character,
            bits,
        } if wanted == number => {
            if character < length {
                flip(&mut burst.octets, &mut burst.marks, character, bits);
                statistics.spoiled += 1;
            }
            false
        }
        Script::Cut { from, to } => {
            for character in 0..length {
                let end = start + baud.characters(character + 1);
                if from <= end && end < to {
                    mark(&mut burst.marks, character, Mark::Lost);
                    statistics.lost += 1;
                }
            }
            start < to
        }
        Script::Drop { burst: wanted } | Script::Spoil { burst: wanted, .. } | Script::Flip { burst: wanted, .. } => {
            wanted > number
        }
    });
}

/// Spoils what overlaps with the transmissions that are on the line already.
#[cold]
fn collide(active: &mut [Burst], new: &mut Burst, baud: Baud, now: Instant, police: &mut Police) {
    for old in active.iter_mut().filter(|old| old.on_line && old.end > now) {
        police.collision(now, PortId(new.sender));
        for character in 0..new.octets.len() {
            if now + baud.characters(character) < old.end {
                mark(&mut new.marks, character, Mark::Collision);
            }
        }
        for character in 0..old.octets.len() {
            let begin = old.start + baud.characters(character);
            let end = old.start + baud.characters(character + 1);
            if end > now && begin < new.end {
                mark(&mut old.marks, character, Mark::Collision);
            }
        }
        // What was due up to now stays as it was planned, for part of the receivers may have it already.
        let kept = old.runs.iter().take_while(|run| run.at <= now).count();
        old.runs.truncate(kept);
        let from = old.runs.last().map_or(0, |run| run.to);
        old.plan(from, baud, now);
    }
}

/// Marks a character; what is lost stays lost, and a collision covers any other error.
fn mark(marks: &mut Vec<(usize, Mark)>, index: usize, new: Mark) {
    match marks.binary_search_by_key(&index, |(index, _)| *index) {
        Ok(place) => {
            if marks[place].1 != Mark::Lost {
                marks[place].1 = new;
            }
        }
        Err(place) => marks.insert(place, (index, new)),
    }
}

/// Flips bits of a character as a UART would see it.
fn flip(octets: &mut [u8], marks: &mut Vec<(usize, Mark)>, index: usize, flipped: u16) {
    match received(flipped) {
        Ok(mask) => {
            if let Some(octet) = octets.get_mut(index) {
                *octet ^= mask;
            }
        }
        Err(error) => mark(marks, index, Mark::Error(error)),
    }
}
