//! A passive station with whatever application a test gives it.

use dp_master::address::Address;
use dp_master::fdl::{Responder, ResponderUser};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};

pub(crate) struct PassiveStation<U> {
    responder: Responder,
    user: U,
}

impl<U> PassiveStation<U> {
    pub(crate) fn new(address: Address, baud: Baud, user: U) -> Self {
        Self {
            responder: Responder::new(address, baud, Duration::ZERO),
            user,
        }
    }
}

impl<U: ResponderUser> Station for PassiveStation<U> {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.responder.handle_octets(now, octets, &mut self.user);
    }
    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.responder.handle_line_error(now, error, &mut self.user);
    }
    fn handle_sent(&mut self, _now: Instant) {}
    fn handle_timeout(&mut self, now: Instant) {
        self.responder.handle_timeout(now);
    }
    fn poll_transmit(&mut self, _now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let reply = self.responder.take_reply()?;
        buf.get_mut(..reply.len())?.copy_from_slice(reply);
        Some(reply.len())
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.responder.poll_timeout()
    }
}
