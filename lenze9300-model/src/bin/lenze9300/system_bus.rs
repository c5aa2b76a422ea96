//! The system bus of a served drive: a port in a thread of its own, because it waits for frames while the drive's time goes on.

use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread;
use std::time::Duration;

use lenze9300_model::bus::can::{CanFrame, CanNode};
use lenze9300_model::bus::can_port::{
    BusState, CanBusEvent, CanPort, CanPortError, CanPortErrorKind, CanPortName, ReopeningCanPort,
};
use lenze9300_model::device::Drive;

use crate::serve::note;

/// Node and port.
#[derive(Debug)]
pub(crate) struct SystemBus {
    node: CanNode,
    incoming: Receiver<FromPort>,
    outgoing: Sender<CanFrame>,
}

#[derive(Debug)]
enum FromPort {
    Frame(CanFrame),
    Event(CanBusEvent),
    /// The port can no longer be used.
    Failed(CanPortError),
}

/// How long the port waits for a frame before it looks for one to send.
const WAIT: Duration = Duration::from_micros(500);

impl SystemBus {
    /// Opens the port for a drive.
    ///
    /// # Errors
    ///
    /// One sentence that names the port.
    pub(crate) fn open(name: &CanPortName, drive: &Drive) -> Result<Self, String> {
        let port = ReopeningCanPort::open(name).map_err(|error| error.to_string())?;
        let node = CanNode::new(drive.codes());
        if let CanPortName::Slcan { rate, .. } = name
            && rate.kbit_s() * 1000 != node.bit_rate()
        {
            note(&format!(
                "{name} runs at {} kbit/s, C0351 says {}; the adapter's counts",
                rate.kbit_s(),
                node.bit_rate() / 1000
            ));
        }
        let (to_port, outgoing) = channel();
        let (from_port, incoming) = channel();
        thread::Builder::new()
            .name("system-bus".to_owned())
            .spawn(move || carry(port, &outgoing, &from_port))
            .map_err(|error| format!("no thread for {name}: {error}"))?;
        Ok(Self {
            node,
            incoming,
            outgoing: to_port,
        })
    }

    /// A millisecond of the drive, before its ticks.
    ///
    /// # Errors
    ///
    /// One sentence, when the port is of no use any more.
    pub(crate) fn millisecond(&mut self, drive: &mut Drive) -> Result<(), String> {
        loop {
            match self.incoming.try_recv() {
                Ok(FromPort::Frame(frame)) => self.node.handle_frame(&frame),
                Ok(FromPort::Event(event)) => {
                    if let CanBusEvent::State(state) = &event {
                        self.node.handle_bus_state(*state);
                    }
                    if let CanBusEvent::Back { .. } = &event {
                        self.node.handle_bus_state(BusState::Active);
                    }
                    note(&event);
                }
                Ok(FromPort::Failed(error)) => return Err(error.to_string()),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return Err("the system bus has ended".to_owned()),
            }
        }
        self.node.cycle_1ms(drive);
        while let Some(frame) = self.node.poll_transmit() {
            // The other end lives as long as the port; its end is told by the other channel.
            let _ = self.outgoing.send(frame);
        }
        while let Some(event) = self.node.poll_event() {
            note(&event);
        }
        Ok(())
    }

    /// Node address in force.
    pub(crate) fn node(&self) -> u8 {
        self.node.identifiers().node()
    }
}

/// Carries frames until the port or the drive is gone.
fn carry(mut port: ReopeningCanPort, outgoing: &Receiver<CanFrame>, from_port: &Sender<FromPort>) {
    let mut is_full = false;
    loop {
        loop {
            let frame = match outgoing.try_recv() {
                Ok(frame) => frame,
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return,
            };
            match port.send(&frame) {
                Ok(()) => is_full = false,
                // Nobody takes the frames: they are lost as on a cable that is not there. Told once.
                Err(error) if error.kind() == CanPortErrorKind::Full => {
                    if !std::mem::replace(&mut is_full, true) {
                        note(&error);
                    }
                }
                Err(error) => {
                    let _ = from_port.send(FromPort::Failed(error));
                    return;
                }
            }
        }
        let received = match port.receive(WAIT) {
            Ok(Some(frame)) => from_port.send(FromPort::Frame(frame)),
            Ok(None) => Ok(()),
            Err(error) => {
                let _ = from_port.send(FromPort::Failed(error));
                return;
            }
        };
        if received.is_err() {
            return;
        }
        while let Some(event) = port.poll_event() {
            if from_port.send(FromPort::Event(event)).is_err() {
                return;
            }
        }
    }
}
