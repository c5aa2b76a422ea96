//! Records what goes over a line: every telegram with its time, and the octets that belong to none.
//!
//! - [`Tracer`] divides a stream of octets; the two below are built on it.
//! - [`Tap`] listens on a virtual bus, or on a real line through a [`Driver`](crate::driver::Driver), as a station that never speaks.
//! - [`TracedPort`] records what passes through a [`Port`] in both directions.

use std::time::Duration as StdDuration;

use super::port::{Port, PortError};
use crate::station::{LineError, MAX_TELEGRAM, Station};
use crate::time::{Baud, BitTimes, Duration, Instant};
use crate::wire::{DecodeError, DiscardReason, ED, SC, SD1, SD2, SD3, SD4, Telegram, decode_one};

/// Which way a telegram went, seen from the port that recorded it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// It came from the line.
    Received,
    /// It was sent by whoever uses the port.
    Sent,
}

/// Something that went over the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trace<'a> {
    /// When its first start bit began, as far as the times of the octets tell.
    pub start: Instant,
    /// When its last character ended.
    pub end: Instant,
    /// Which way it went.
    pub direction: Direction,
    /// The octets as they stood on the line; empty when only a spoiled character was lost.
    pub octets: &'a [u8],
    /// What they are.
    pub content: Content<'a>,
}

/// What recorded octets are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content<'a> {
    /// A valid telegram.
    Telegram(Telegram<'a>),
    /// Octets that belong to no valid telegram.
    Discarded {
        /// Why.
        reason: DiscardReason,
        /// Characters that ended the run and could not be received; they are not among the octets.
        lost: usize,
    },
}

impl<'a> Trace<'a> {
    /// A trace of octets that are one whole telegram or none.
    #[must_use]
    pub fn of(start: Instant, end: Instant, direction: Direction, octets: &'a [u8]) -> Self {
        let content = match decode_one(octets) {
            Ok((telegram, used)) if used == octets.len() => Content::Telegram(telegram),
            Ok((_, used)) => Content::Discarded {
                reason: DiscardReason::StartDelimiter {
                    got: octets.get(used).copied().unwrap_or_default(),
                },
                lost: 0,
            },
            Err(DecodeError::Corrupt(reason)) => Content::Discarded { reason, lost: 0 },
            Err(DecodeError::Incomplete) => Content::Discarded {
                reason: DiscardReason::Truncated,
                lost: 0,
            },
        };
        Self {
            start,
            end,
            direction,
            octets,
            content,
        }
    }
}

/// Divides a stream of octets into telegrams and the rest, with times, keeping the octets as they were.
///
/// Like the [`Decoder`](crate::wire::Decoder) it goes on at the next start delimiter after a broken telegram. Unlike it, it keeps a telegram
/// together whose check sum is wrong while its end delimiter stands where its length says, for people want to see it whole; and it ends a
/// telegram that is not complete when the line was silent, because it is told the times.
///
/// Times are exact when octets are told as they end, as the virtual bus does. A serial adapter delivers several telegrams at once, with the
/// time of reading; then the last octet ended at that time and the others directly before it, without pauses.
#[derive(Clone, Debug)]
pub struct Tracer {
    baud: Baud,
    direction: Direction,
    silence: Duration,
    /// The beginning of a telegram that is not complete yet.
    partial: Vec<u8>,
    /// When the last character ended.
    last_end: Instant,
}

impl Tracer {
    /// A tracer for a line where a silence of Tsyn, 33 tBIT, ends a telegram.
    #[must_use]
    pub fn new(baud: Baud) -> Self {
        Self {
            baud,
            direction: Direction::Received,
            silence: baud.duration(T_SYN),
            partial: Vec::with_capacity(MAX_TELEGRAM),
            last_end: Instant::ZERO,
        }
    }

    /// The same for an adapter that may hold octets back for this long: only a longer silence ends a telegram.
    #[must_use]
    pub fn with_latency(mut self, latency: Duration) -> Self {
        self.silence = self.baud.duration(T_SYN) + latency;
        self
    }

    /// Octets, the last of which ended at `now`.
    pub fn push(&mut self, now: Instant, octets: &[u8], mut sink: impl FnMut(Trace<'_>)) {
        if octets.is_empty() {
            return;
        }
        let began = now - self.baud.characters(octets.len());
        if began - self.last_end >= self.silence {
            self.finish(&mut sink);
        }
        self.last_end = now;
        self.partial.extend_from_slice(octets);
        self.settle(None, &mut sink);
    }

    /// One character that could not be received ended at `now`.
    pub fn push_line_error(&mut self, now: Instant, error: LineError, mut sink: impl FnMut(Trace<'_>)) {
        let began = now - self.baud.characters(1);
        if began - self.last_end >= self.silence {
            self.finish(&mut sink);
        }
        self.last_end = now;
        self.settle(Some((DiscardReason::Line(error), 1)), &mut sink);
    }

    /// The line fell silent, or the recording ends: what has begun is told as truncated.
    pub fn finish(&mut self, mut sink: impl FnMut(Trace<'_>)) {
        if !self.partial.is_empty() {
            self.settle(Some((DiscardReason::Truncated, 0)), &mut sink);
        }
    }

    /// Takes everything from the front of `partial` until an incomplete telegram stands there.
    ///
    /// With an `end` nothing more will come; its characters that could not be received follow the last octet.
    fn settle(&mut self, end: Option<(DiscardReason, usize)>, sink: &mut impl FnMut(Trace<'_>)) {
        let lost = end.map_or(0, |(_, lost)| lost);
        let mut rest = self.partial.as_slice();
        let mut told_lost = false;
        while !rest.is_empty() {
            let (used, content) = match (decode_one(rest), end) {
                (Ok((telegram, used)), _) => (used, Content::Telegram(telegram)),
                (Err(DecodeError::Incomplete), None) => break,
                (Err(DecodeError::Incomplete), Some((reason, _))) => {
                    (to_next_start(rest), Content::Discarded { reason, lost: 0 })
                }
                (Err(DecodeError::Corrupt(reason)), _) => {
                    let used = match reason {
                        DiscardReason::Checksum { .. } => whole(rest),
                        _ => None,
                    };
                    let used = used.unwrap_or_else(|| to_next_start(rest));
                    (used, Content::Discarded { reason, lost: 0 })
                }
            };
            let (octets, behind) = rest.split_at(used.min(rest.len()));
            let (content, length) = match content {
                Content::Discarded { reason, .. } if behind.is_empty() && lost > 0 => {
                    told_lost = true;
                    (Content::Discarded { reason, lost }, octets.len() + lost)
                }
                content => (content, octets.len()),
            };
            let after = if told_lost { 0 } else { behind.len() + lost };
            let ended = self.last_end - self.baud.characters(after);
            sink(Trace {
                start: ended - self.baud.characters(length),
                end: ended,
                direction: self.direction,
                octets,
                content,
            });
            rest = behind;
        }
        if let Some((reason, lost)) = end
            && lost > 0
            && !told_lost
        {
            sink(Trace {
                start: self.last_end - self.baud.characters(lost),
                end: self.last_end,
                direction: self.direction,
                octets: &[],
                content: Content::Discarded { reason, lost },
            });
        }
        let kept = rest.len();
        let used = self.partial.len() - kept;
        self.partial.drain(..used);
    }
}

/// A station that only listens and tells everything it hears.
///
/// A virtual bus delivers to it as to any port; on a real line a [`Driver`](crate::driver::Driver) runs it.
///
/// # Example
///
/// ```
/// use dp_master::phy::{PortId, Tap, VirtualBus, pump};
/// use dp_master::station::Station;
/// use dp_master::time::{Baud, Instant};
///
/// let mut bus = VirtualBus::new(Baud::B1500000);
/// let (sender, ear) = (bus.attach(), bus.attach());
/// let mut heard = Vec::new();
/// let mut tap = Tap::new(Baud::B1500000, |trace: dp_master::phy::Trace<'_>| heard.push(trace.octets.to_vec()));
/// bus.transmit(Instant::ZERO, sender, &[0xDC, 0x02, 0x01]);
/// let mut stations: [(PortId, &mut dyn Station); 1] = [(ear, &mut tap)];
/// pump(&mut bus, Instant::from_nanos(1_000_000), &mut stations);
/// drop(tap);
/// assert_eq!(heard, [[0xDC, 0x02, 0x01]]);
/// ```
#[derive(Debug)]
pub struct Tap<S> {
    tracer: Tracer,
    sink: S,
}

impl<S: FnMut(Trace<'_>)> Tap<S> {
    /// A listener on a line of this baud rate.
    pub fn new(baud: Baud, sink: S) -> Self {
        Self::with_tracer(Tracer::new(baud), sink)
    }

    /// A listener with a tracer of your own, such as one that knows the latency of an adapter.
    pub const fn with_tracer(tracer: Tracer, sink: S) -> Self {
        Self { tracer, sink }
    }

    /// The recording ends: what has begun is told as truncated.
    pub fn finish(&mut self) {
        self.tracer.finish(&mut self.sink);
    }

    /// Where it goes.
    pub const fn sink_mut(&mut self) -> &mut S {
        &mut self.sink
    }
}

impl<S: FnMut(Trace<'_>)> Station for Tap<S> {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.tracer.push(now, octets, &mut self.sink);
    }

    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.tracer.push_line_error(now, error, &mut self.sink);
    }

    fn handle_sent(&mut self, _: Instant) {}

    /// A partial telegram is told after a while, not only with the next octet.
    fn handle_timeout(&mut self, now: Instant) {
        if self.poll_timeout().is_some_and(|at| at <= now) {
            self.finish();
        }
    }

    fn poll_transmit(&mut self, _: Instant, _: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        // A line tells the rest of a telegram when it ended, so the silence can only be known after the longest one.
        let longest = self.tracer.baud.characters(MAX_TELEGRAM);
        (!self.tracer.partial.is_empty()).then(|| self.tracer.last_end + longest + self.tracer.silence)
    }
}

/// A port that records what passes through it in both directions.
///
/// The clock is given, because only the driver reads one: give both the same epoch.
///
/// # Example
///
/// ```no_run
/// use dp_master::driver::Driver;
/// use dp_master::phy::{SerialLine, SerialOptions, Trace, TracedPort};
/// use dp_master::time::{Baud, Instant};
///
/// # fn main() -> Result<(), dp_master::phy::PortError> {
/// let epoch = std::time::Instant::now();
/// let port = SerialLine::open("/dev/ttyUSB0", Baud::B187500, SerialOptions::default())?;
/// let clock = move || Instant::ZERO + epoch.elapsed().into();
/// let port = TracedPort::new(port, clock, |trace: Trace<'_>| println!("{trace:?}"));
/// let driver = Driver::with_epoch(port, epoch);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct TracedPort<P, C, S> {
    port: P,
    clock: C,
    sink: S,
    tracer: Tracer,
}

impl<P: Port, C: FnMut() -> Instant, S: FnMut(Trace<'_>)> TracedPort<P, C, S> {
    /// Records everything on a port, with the times of `clock`.
    pub fn new(port: P, clock: C, sink: S) -> Self {
        let tracer = Tracer::new(port.baud()).with_latency(ADAPTER_LATENCY);
        Self {
            port,
            clock,
            sink,
            tracer,
        }
    }

    /// The port below.
    pub const fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// The recording ends: what has begun is told as truncated. Gives the port back.
    pub fn finish(mut self) -> P {
        self.tracer.finish(&mut self.sink);
        self.port
    }
}

impl<P: Port, C: FnMut() -> Instant, S: FnMut(Trace<'_>)> Port for TracedPort<P, C, S> {
    fn receive(&mut self, buf: &mut [u8], max_wait: StdDuration) -> Result<usize, PortError> {
        let received = self.port.receive(buf, max_wait)?;
        if let Some(octets) = buf.get(..received) {
            self.tracer.push((self.clock)(), octets, &mut self.sink);
        }
        Ok(received)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        let start = (self.clock)();
        self.port.send(octets)?;
        // Whoever is answered here was heard to the end, or never will be.
        self.tracer.finish(&mut self.sink);
        let end = start + self.port.baud().characters(octets.len());
        (self.sink)(Trace::of(start, end, Direction::Sent, octets));
        Ok(())
    }

    fn baud(&self) -> Baud {
        self.port.baud()
    }
}

/// Octets of the telegram in front, when its end delimiter stands where it must.
fn whole(octets: &[u8]) -> Option<usize> {
    let length = match *octets {
        [SD1, ..] => 6,
        [SD2, le, ..] => usize::from(le) + 6,
        [SD3, ..] => 14,
        _ => return None,
    };
    (octets.get(length - 1) == Some(&ED)).then_some(length)
}

/// Octets from the front to the next start delimiter behind it, or to the end.
fn to_next_start(octets: &[u8]) -> usize {
    octets
        .iter()
        .skip(1)
        .position(|octet| matches!(*octet, SD1 | SD2 | SD3 | SD4 | SC))
        .map_or(octets.len(), |index| index + 1)
}

/// Synchronisation time: no telegram has such a pause inside. Source: IEC 61158-4-3.
const T_SYN: BitTimes = BitTimes(33);
/// What an adapter as delivered may hold octets back (see [`SerialLine`](super::SerialLine)), and some more.
pub(super) const ADAPTER_LATENCY: Duration = Duration::from_millis(20);
