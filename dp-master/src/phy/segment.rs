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
/// Returns when it must be called next, as [`next_wakeup`] does; the caller may go there or in any larger steps.
///
/// # Panics
///
/// In debug builds, when a station names a timeout that is not later than the one just handled, which would never end. Other builds leave
/// the call at that point.
pub fn pump(
    bus: &mut VirtualBus,
    now: Instant,
    stations: &mut [(PortId, &mut dyn Station)],
) -> Option<Instant> {
    let mut buf = bus
        .scratch
        .take()
        .unwrap_or_else(|| Box::new([0; MAX_TELEGRAM]));
    let wakeup = run(bus, now, stations, &mut buf);
    bus.scratch = Some(buf);
    wakeup
}

/// When the line or a station has something to do next.
#[must_use]
pub fn next_wakeup(bus: &VirtualBus, stations: &[(PortId, &mut dyn Station)]) -> Option<Instant> {
    bus.poll_timeout()
        .into_iter()
        .chain(earliest_timeout(stations))
        .min()
}

#[inline]
fn earliest_timeout(stations: &[(PortId, &mut dyn Station)]) -> Option<Instant> {
    stations
        .iter()
        .filter_map(|(_, station)| station.poll_timeout())
        .min()
}

/// Tells the stations what the line has for them up to `at`.
#[inline]
fn deliver(
    bus: &mut VirtualBus,
    at: Instant,
    stations: &mut [(PortId, &mut dyn Station)],
    buf: &mut [u8; MAX_TELEGRAM],
) {
    while let Some(event) = bus.poll(at) {
        let (at, port) = (event.at(), event.port());
        let Some(station) = find(stations, port) else {
            continue;
        };
        match event {
            BusEvent::Sent { .. } => station.handle_sent(at),
            BusEvent::Octets { octets, .. } => station.handle_octets(at, octets),
            BusEvent::LineError { error, .. } => station.handle_line_error(at, error),
        }
        send(bus, at, port, station, buf);
    }
}

#[inline]
fn run(
    bus: &mut VirtualBus,
    now: Instant,
    stations: &mut [(PortId, &mut dyn Station)],
    buf: &mut [u8; MAX_TELEGRAM],
) -> Option<Instant> {
    let quiet_until = loop {
        let (line, timer) = (bus.poll_timeout(), earliest_timeout(stations));
        match (line, timer) {
            (Some(at), timer) if at <= now && timer.is_none_or(|timer| at <= timer) => {
                deliver(bus, at, stations, buf);
            }
            (_, Some(at)) if at <= now => {
                if expire(bus, at, stations, buf) == Progress::Stuck {
                    debug_assert!(
                        false,
                        "a timeout was not later than the one handled at {at}"
                    );
                    return Some(at);
                }
            }
            _ => break line.into_iter().chain(timer).min(),
        }
    };
    let mut sent = false;
    for (port, station) in stations.iter_mut() {
        sent |= send(bus, now, *port, *station, buf);
    }
    if sent {
        next_wakeup(bus, stations)
    } else {
        quiet_until
    }
}

/// Whether time goes on for all stations.
#[derive(PartialEq, Eq)]
enum Progress {
    Made,
    Stuck,
}

/// Calls the stations whose timeout is due at `at`.
#[inline]
fn expire(
    bus: &mut VirtualBus,
    at: Instant,
    stations: &mut [(PortId, &mut dyn Station)],
    buf: &mut [u8; MAX_TELEGRAM],
) -> Progress {
    for (port, station) in stations.iter_mut() {
        if station.poll_timeout().is_none_or(|timeout| timeout > at) {
            continue;
        }
        station.handle_timeout(at);
        send(bus, at, *port, *station, buf);
        if station.poll_timeout().is_some_and(|timeout| timeout <= at) {
            return Progress::Stuck;
        }
    }
    Progress::Made
}

/// The station on a port; its place in the slice is usually the number of the port.
#[inline]
fn find<'a>(
    stations: &'a mut [(PortId, &mut dyn Station)],
    port: PortId,
) -> Option<&'a mut dyn Station> {
    let place = match stations.get(port.index()) {
        Some((here, _)) if *here == port => port.index(),
        _ => stations.iter().position(|(here, _)| *here == port)?,
    };
    stations
        .get_mut(place)
        .map(|(_, station)| &mut **station as &mut dyn Station)
}

/// Lets a station send, if it is not sending already; whether it did.
#[inline]
fn send(
    bus: &mut VirtualBus,
    at: Instant,
    port: PortId,
    station: &mut dyn Station,
    buf: &mut [u8; MAX_TELEGRAM],
) -> bool {
    if bus.is_sending(port) {
        return false;
    }
    let Some(octets) = station
        .poll_transmit(at, buf)
        .and_then(|length| buf.get(..length))
    else {
        return false;
    };
    bus.transmit(at, port, octets);
    !octets.is_empty()
}
