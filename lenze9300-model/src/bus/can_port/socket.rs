//! An interface of the Linux kernel.

use std::io;
use std::time::Duration;

use socketcan::{
    CanFrame as KernelFrame, CanSocket, EmbeddedFrame, Frame, Id, ShouldRetry, Socket, SocketOptions, StandardId,
};

use super::events::Events;
use super::{BusState, CanBusEvent, CanPort, CanPortError};
use crate::bus::can::CanFrame;

/// A raw socket on one interface. Error frames are switched on: from them come the states of the bus.
#[derive(Debug)]
pub struct SocketCanPort {
    socket: CanSocket,
    name: String,
    state: BusState,
    events: Events,
}

impl SocketCanPort {
    /// Opens an interface that is up.
    ///
    /// # Errors
    ///
    /// [`CanPortError::NoSuchInterface`], [`CanPortError::Down`], or [`CanPortError::Io`] for anything else.
    pub fn open(name: &str) -> Result<Self, CanPortError> {
        let failed = |error: io::Error| match error.raw_os_error() {
            Some(ENODEV) => CanPortError::NoSuchInterface { name: name.to_owned() },
            _ => failure(name, error),
        };
        let socket = CanSocket::open(name).map_err(failed)?;
        socket.set_error_filter_accept_all().map_err(failed)?;
        socket.set_write_timeout(SEND_TIMEOUT).map_err(failed)?;
        // A socket can be bound to an interface that is down; it would hear nothing for ever.
        if is_down(name) {
            return Err(CanPortError::Down { name: name.to_owned() });
        }
        Ok(Self {
            socket,
            name: name.to_owned(),
            state: BusState::Active,
            events: Events::default(),
        })
    }

    fn note_error_frame(&mut self, id_word: u32, data: &[u8]) {
        let controller = if id_word & ERR_CRTL == 0 {
            0
        } else {
            data.get(1).copied().unwrap_or(0)
        };
        if controller & CRTL_RX_OVERFLOW != 0 {
            self.events.push(CanBusEvent::Overrun);
        }
        let state = if id_word & ERR_BUSOFF != 0 {
            BusState::Off
        } else if id_word & ERR_RESTARTED != 0 || controller & CRTL_ACTIVE != 0 {
            BusState::Active
        } else if controller & CRTL_PASSIVE != 0 {
            BusState::Passive
        } else if controller & CRTL_WARNING != 0 {
            BusState::Warning
        } else {
            return;
        };
        if state != self.state {
            self.state = state;
            self.events.push(CanBusEvent::State(state));
        }
    }
}

impl CanPort for SocketCanPort {
    fn receive(&mut self, max_wait: Duration) -> Result<Option<CanFrame>, CanPortError> {
        let frame = match self.socket.read_frame_timeout(max_wait) {
            Ok(frame) => frame,
            Err(error) if error.should_retry() || is_time_out(&error) => return Ok(None),
            Err(error) => return Err(failure(&self.name, error)),
        };
        if frame.is_error_frame() {
            self.note_error_frame(frame.id_word(), frame.data());
            return Ok(None);
        }
        let Id::Standard(id) = frame.id() else { return Ok(None) };
        Ok(match frame {
            KernelFrame::Remote(_) => u8::try_from(frame.dlc())
                .ok()
                .and_then(|len| CanFrame::new_remote(id.as_raw(), len)),
            _ => CanFrame::new(id.as_raw(), frame.data()),
        })
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), CanPortError> {
        let converted = StandardId::new(frame.id()).and_then(|id| {
            if frame.is_remote() {
                KernelFrame::new_remote(id, usize::from(frame.dlc()))
            } else {
                KernelFrame::new(id, frame.data())
            }
        });
        let Some(converted) = converted else {
            // A `CanFrame` has no more than 11 bits and 8 octets.
            return Err(failure(&self.name, io::ErrorKind::InvalidInput.into()));
        };
        self.socket
            .write_frame(&converted)
            .map_err(|error| failure(&self.name, error))
    }

    fn poll_event(&mut self) -> Option<CanBusEvent> {
        self.events.pop()
    }
}

fn is_time_out(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// A failed call on an open socket.
fn failure(name: &str, source: io::Error) -> CanPortError {
    let name = name.to_owned();
    match source.raw_os_error() {
        Some(ENETDOWN) => CanPortError::Down { name },
        // What a socket gives whose interface was deleted.
        Some(ENODEV | ENXIO) => CanPortError::Removed { name },
        Some(ENOBUFS | EAGAIN) => CanPortError::Full { name },
        _ => CanPortError::Io { name, source },
    }
}

/// Unknown counts as up: a read says otherwise soon enough.
fn is_down(name: &str) -> bool {
    let flags = std::fs::read_to_string(format!("/sys/class/net/{name}/flags")).ok();
    let flags = flags.and_then(|text| u32::from_str_radix(text.trim().trim_start_matches("0x"), 16).ok());
    flags.is_some_and(|flags| flags & IFF_UP == 0)
}

const SEND_TIMEOUT: Duration = Duration::from_millis(100);

// Source: linux/errno.h, linux/if.h and linux/can/error.h.
const ENXIO: i32 = 6;
const EAGAIN: i32 = 11;
const ENODEV: i32 = 19;
const ENETDOWN: i32 = 100;
const ENOBUFS: i32 = 105;
const IFF_UP: u32 = 1;
const ERR_CRTL: u32 = 0x0004;
const ERR_BUSOFF: u32 = 0x0040;
const ERR_RESTARTED: u32 = 0x0100;
const CRTL_RX_OVERFLOW: u8 = 0x01;
const CRTL_WARNING: u8 = 0x04 | 0x08;
const CRTL_PASSIVE: u8 = 0x10 | 0x20;
const CRTL_ACTIVE: u8 = 0x40;
