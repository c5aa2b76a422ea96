use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::time::{Duration, Instant};

use super::{AccessError, CodePlace, ParameterAccess};
use crate::bus::can::sdo::{Data, Request};
use crate::bus::can::{SdoChannel, SdoClient, SdoClientError, SdoOutcome};
use crate::bus::can_port::{BusState, CanBusEvent, CanPort, CanPortErrorKind};
use crate::code::DataLength;

/// Parameters over the system bus.
#[derive(Debug)]
pub struct CanAccess<P> {
    port: P,
    client: SdoClient,
    begun: StdInstant,
}

/// How long a full queue is given to drain before the frame counts as not sent.
const DRAIN: StdDuration = StdDuration::from_millis(100);

impl<P: CanPort> CanAccess<P> {
    /// The drive with this node address, 1…63, on one of its two channels.
    pub fn new(port: P, node: u8, channel: SdoChannel) -> Self {
        Self {
            port,
            client: SdoClient::new(node, channel),
            begun: StdInstant::now(),
        }
    }

    fn now(&self) -> Instant {
        let nanos = u64::try_from(self.begun.elapsed().as_nanos()).unwrap_or(u64::MAX);
        Instant::ZERO + Duration::from_nanos(nanos)
    }

    fn carry_out(&mut self, place: CodePlace, request: Request) -> Result<SdoOutcome, AccessError> {
        let no_way = |error: &dyn std::fmt::Display| AccessError::NoWay(error.to_string());
        self.client.submit(request).map_err(|error| no_way(&error))?;
        loop {
            let now = self.now();
            self.client.handle_timeout(now);
            if let Some(frame) = self.client.poll_transmit(now) {
                let full_since = StdInstant::now();
                while let Err(error) = self.port.send(&frame) {
                    if error.kind() != CanPortErrorKind::Full || full_since.elapsed() > DRAIN {
                        return Err(no_way(&error));
                    }
                    std::thread::sleep(StdDuration::from_millis(1));
                }
            }
            match self.client.poll_outcome() {
                None => {}
                Some(Ok(outcome)) => return Ok(outcome),
                Some(Err(SdoClientError::Refused { reason, .. })) => {
                    let reason = reason.to_string();
                    return Err(AccessError::Refused { place, reason });
                }
                Some(Err(error)) => return Err(AccessError::NoAnswer(error.to_string())),
            }
            let until = self.client.poll_timeout().unwrap_or(now);
            let wait = StdDuration::from(until - self.now()).max(StdDuration::from_millis(1));
            match self.port.receive(wait) {
                Ok(Some(frame)) => self.client.handle_frame(&frame),
                Ok(None) => {}
                Err(error) => return Err(no_way(&error)),
            }
            // A bus that does not work is the reason for what follows.
            while let Some(event) = self.port.poll_event() {
                if let CanBusEvent::State(BusState::Passive | BusState::Off) = event {
                    return Err(AccessError::NoAnswer(event.to_string()));
                }
            }
        }
    }
}

impl<P: CanPort> ParameterAccess for CanAccess<P> {
    fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
        let CodePlace { code, subcode } = place;
        match self.carry_out(place, Request::Read { code, subcode })? {
            SdoOutcome::Value(value) => Ok(value),
            SdoOutcome::Written => Err(AccessError::NoAnswer(format!(
                "{place}: a read was answered as a write"
            ))),
        }
    }

    fn write(&mut self, place: CodePlace, raw: i32) -> Result<(), AccessError> {
        let CodePlace { code, subcode } = place;
        let data = match place.entry().map(|entry| entry.length) {
            Some(DataLength::Two) => Data::two(raw),
            Some(DataLength::Four) | None => Data::four(raw),
        };
        self.carry_out(place, Request::Write { code, subcode, data })
            .map(|_| ())
    }
}
