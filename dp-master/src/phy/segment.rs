//! Stations on a virtual line: who is called when.

use super::virtual_bus::{BusEvent, PortId, VirtualBus};
use crate::station::{MAX_TELEGRAM, Station};
use crate::time::Instant;

/// Runs stations on a line up to and including `now`, every call at its own time and in the order of time.
///
/// Within one instant first everything that the line delivers (order: see [`VirtualBus`]), then the timeouts, stations in the order of the
/// slice. After every input the station may send, unless it is sending. At the end every station may send at `now`, so that a command given
/// between two calls takes effect.
///
/// A station that was switched on or given a command between two calls may name a timeout that has passed. It is called at the time up to
/// which the last call ran, for that is when it happened.
///
/// Returns when it must be called next, as [`next_wakeup`] does; the caller may go there or in any larger steps.
///
/// # Panics
///
/// In debug builds, when a station names a timeout that is not later than the one just handled, which would never end. Other builds leave
/// the call at that point.
pub fn pump(bus: &mut VirtualBus, now: Instant, stations: &mut [(PortId, &mut dyn Station)]) -> Option<Instant> {
    let mut scratch = bus.scratch.take().unwrap_or_default();
    let wakeup = Pump {
        bus,
        stations,
        scratch: &mut scratch,
    }
    .run(now);
    bus.scratch = Some(scratch);
    wakeup
}

/// When the line or a station has something to do next.
#[must_use]
pub fn next_wakeup(bus: &VirtualBus, stations: &[(PortId, &mut dyn Station)]) -> Option<Instant> {
    let timeouts = stations.iter().filter_map(|(_, station)| station.poll_timeout());
    bus.poll_timeout().into_iter().chain(timeouts).min()
}

/// What a [`pump`] writes to; the line keeps it between two calls, so that nothing is allocated or cleared.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    telegram: [u8; MAX_TELEGRAM],
    /// When each station must be called next, in the order of the slice; [`NEVER`] for not at all. A station changes
    /// its mind only when it is called, so it is asked only then.
    timeouts: Vec<Instant>,
    /// Up to when the last call ran.
    reached: Instant,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            telegram: [0; MAX_TELEGRAM],
            timeouts: Vec::new(),
            reached: Instant::ZERO,
        }
    }
}

/// No moment that anything could be due at: 584 years.
pub(super) const NEVER: Instant = Instant::MAX;

struct Pump<'a, 's> {
    bus: &'a mut VirtualBus,
    stations: &'a mut [(PortId, &'s mut dyn Station)],
    scratch: &'a mut Scratch,
}

impl Pump<'_, '_> {
    fn run(&mut self, now: Instant) -> Option<Instant> {
        let reached = self.scratch.reached;
        let timeouts = self
            .stations
            .iter()
            .map(|(_, station)| timeout_of(*station).max(reached));
        self.scratch.timeouts.clear();
        self.scratch.timeouts.extend(timeouts);
        self.scratch.reached = reached.max(now);
        loop {
            let (line, timer) = (self.bus.due(), self.earliest_timeout());
            if line.min(timer) > now {
                break;
            }
            if line <= timer {
                self.deliver(line);
            } else if self.expire(timer) == Progress::Stuck {
                debug_assert!(false, "a timeout was not later than the one handled at {timer}");
                return Some(timer);
            }
        }
        for place in 0..self.stations.len() {
            self.follow_up(now, place);
        }
        let next = self.bus.due().min(self.earliest_timeout());
        (next != NEVER).then_some(next)
    }

    #[inline]
    fn earliest_timeout(&self) -> Instant {
        self.scratch.timeouts.iter().copied().fold(NEVER, Instant::min)
    }

    /// Tells the stations what the line has for them up to `at`.
    fn deliver(&mut self, at: Instant) {
        while let Some(event) = self.bus.poll(at) {
            let (at, port) = (event.at(), event.port());
            let Some(place) = find(self.stations, port) else {
                continue;
            };
            let (_, station) = &mut self.stations[place];
            match event {
                BusEvent::Sent { .. } => station.handle_sent(at),
                BusEvent::Octets { octets, .. } => station.handle_octets(at, octets),
                BusEvent::LineError { error, .. } => station.handle_line_error(at, error),
            }
            self.follow_up(at, place);
        }
    }

    /// Calls the stations whose timeout is due at `at`.
    fn expire(&mut self, at: Instant) -> Progress {
        for place in 0..self.stations.len() {
            if self.scratch.timeouts[place] > at {
                continue;
            }
            self.stations[place].1.handle_timeout(at);
            self.follow_up(at, place);
            if self.scratch.timeouts[place] <= at {
                return Progress::Stuck;
            }
        }
        Progress::Made
    }

    /// After every input: the station may send, if it is not sending already, and names its next timeout.
    #[inline]
    fn follow_up(&mut self, at: Instant, place: usize) {
        let (port, station) = &mut self.stations[place];
        let Scratch { telegram, timeouts, .. } = &mut *self.scratch;
        if !self.bus.is_sending(*port)
            && let Some(octets) = station
                .poll_transmit(at, telegram)
                .and_then(|length| telegram.get(..length))
        {
            self.bus.transmit(at, *port, octets);
        }
        timeouts[place] = timeout_of(*station);
    }
}

fn timeout_of(station: &dyn Station) -> Instant {
    station.poll_timeout().unwrap_or(NEVER)
}

/// Whether time goes on for all stations.
#[derive(PartialEq, Eq)]
enum Progress {
    Made,
    Stuck,
}

/// The place of the station on a port; it is usually the number of the port.
fn find(stations: &[(PortId, &mut dyn Station)], port: PortId) -> Option<usize> {
    match stations.get(port.index()) {
        Some((here, _)) if *here == port => Some(port.index()),
        _ => stations.iter().position(|(here, _)| *here == port),
    }
}
