//! A CAN port that is opened again when it was gone.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use super::events::Events;
use super::{AnyCanPort, CanBusEvent, CanPort, CanPortError, CanPortErrorKind, CanPortName, open};
use crate::bus::can::CanFrame;

/// A CAN port that waits for an interface that is down or removed, and for an adapter that was pulled.
///
/// Meanwhile nothing is received and what is sent is lost, as on a cable that is not there; both are told by
/// [`poll_event`](CanPort::poll_event). It is opened in a thread of its own, because opening may block for seconds.
pub struct ReopeningCanPort {
    state: State,
    name: CanPortName,
    events: Events,
}

enum State {
    There(AnyCanPort),
    Gone {
        opened: Receiver<AnyCanPort>,
        /// The thread that opens sleeps on the other end, and ends when this is dropped.
        _stop: Sender<()>,
    },
}

impl std::fmt::Debug for ReopeningCanPort {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReopeningCanPort")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

impl ReopeningCanPort {
    /// Opens a port, now and whenever it is gone.
    ///
    /// # Errors
    ///
    /// As [`open`]: at first it must be there.
    pub fn open(name: &CanPortName) -> Result<Self, CanPortError> {
        Ok(Self {
            state: State::There(open(name)?),
            name: name.clone(),
            events: Events::default(),
        })
    }

    /// Gives up the port and begins to open it again; any error that waiting does not mend is passed on.
    fn handle(&mut self, error: CanPortError) -> Result<(), CanPortError> {
        if !matches!(error.kind(), CanPortErrorKind::Down | CanPortErrorKind::Gone) {
            return Err(error);
        }
        self.events.push(CanBusEvent::Lost(error));
        let (tell, opened) = channel();
        let (stop, stopped) = channel::<()>();
        let name = self.name.clone();
        let open_again = move || {
            while stopped.recv_timeout(PAUSE) == Err(RecvTimeoutError::Timeout) {
                if let Ok(port) = open(&name) {
                    // Nobody waits any more: the port is closed again.
                    drop(tell.send(port));
                    return;
                }
            }
        };
        // The old port is closed here, before the first attempt. Without a thread nobody opens the port, which `wait` reports.
        self.state = State::Gone { opened, _stop: stop };
        drop(thread::Builder::new().name("can-opener".to_owned()).spawn(open_again));
        Ok(())
    }
}

impl CanPort for ReopeningCanPort {
    fn receive(&mut self, max_wait: Duration) -> Result<Option<CanFrame>, CanPortError> {
        match &mut self.state {
            State::There(port) => match port.receive(max_wait) {
                Ok(frame) => return Ok(frame),
                Err(error) => self.handle(error)?,
            },
            State::Gone { opened, .. } => match opened.recv_timeout(max_wait) {
                Ok(port) => {
                    self.state = State::There(port);
                    self.events.push(CanBusEvent::Back {
                        name: self.name.to_string(),
                    });
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(CanPortError::Removed {
                        name: self.name.to_string(),
                    });
                }
            },
        }
        Ok(None)
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), CanPortError> {
        match &mut self.state {
            State::There(port) => port.send(frame).or_else(|error| self.handle(error)),
            State::Gone { .. } => Ok(()),
        }
    }

    fn poll_event(&mut self) -> Option<CanBusEvent> {
        self.events.pop().or_else(|| match &mut self.state {
            State::There(port) => port.poll_event(),
            State::Gone { .. } => None,
        })
    }
}

const PAUSE: Duration = Duration::from_millis(100);
