//! What a station does while it does not have the token: listen, answer, accept the token, notice that it is lost.

use super::ring::Heard;
use super::state::Sending;
use super::state::State;
use super::station::{Core, Reply};
use super::timers::Timer;
use super::token_user::{LeaveCause, Membership, RingEvent, TokenUser};
use crate::address::Address;
use crate::station::MAX_TELEGRAM;
use crate::time::Instant;
use crate::wire::{FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram};

impl Core {
    /// A valid telegram in a state without the token.
    pub(super) fn hear<U: TokenUser>(&mut self, now: Instant, telegram: Telegram<'_>, user: &mut U) {
        match telegram {
            Telegram::Token { sa, da } => {
                if sa == self.address {
                    self.own_address_heard(now, user);
                } else {
                    self.hear_token(now, sa, da, user);
                }
            }
            Telegram::Data { header, .. } if header.fc.is_request() => {
                if header.sa == self.address {
                    self.own_address_heard(now, user);
                } else if header.da == self.address {
                    self.hear_request(now, &header);
                }
            }
            Telegram::Data { .. } | Telegram::ShortAck => {}
        }
    }

    fn hear_token<U: TokenUser>(&mut self, now: Instant, sa: Address, da: Address, user: &mut U) {
        match self.state {
            State::ListenToken => self.ring.hear_listening(sa, da),
            State::ActiveIdle => match self.ring.hear(sa, da) {
                Heard::Elsewhere(change) => self.tell_change(now, change, user),
                Heard::Refused => {}
                Heard::Accepted(change) => {
                    let entered = self.ring.become_member();
                    self.duplicate = false;
                    self.begin_use(now);
                    self.timers.start(Timer::Pause, now + self.times.id1);
                    if entered {
                        user.handle_ring(now, RingEvent::Entered);
                    }
                    self.tell_change(now, change, user);
                }
                Heard::Excluded => self.leave(now, LeaveCause::Excluded, user),
            },
            _ => {}
        }
    }

    /// A request to this station.
    fn hear_request(&mut self, now: Instant, header: &Header) {
        let FunctionCode::Request { function, .. } = header.fc else {
            return;
        };
        let answer = match function {
            RequestFunction::FdlStatus => ResponseFunction::Ok,
            // No access point is served here; a station that only listens answers nothing else.
            RequestFunction::SdaLow
            | RequestFunction::SdaHigh
            | RequestFunction::SrdLow
            | RequestFunction::SrdHigh
            | RequestFunction::Ident
            | RequestFunction::LsapStatus
                if self.state != State::ListenToken =>
            {
                ResponseFunction::NoService
            }
            _ => return,
        };
        let fc = FunctionCode::response(self.station_type(), answer);
        self.reply = Some(Reply { to: header.sa, fc });
        self.timers.start(Timer::Pause, now + self.times.sdr_min);
        let invited = function == RequestFunction::FdlStatus && header.sa == self.ring.ps();
        if self.state == State::ListenToken && self.ring.is_known() && invited {
            self.state = State::ActiveIdle;
        }
    }

    /// What this station is to the others.
    fn station_type(&self) -> StationType {
        if self.ring.is_member() {
            StationType::MasterInRing
        } else if self.ring.is_known() && self.state != State::PassiveIdle {
            StationType::MasterReady
        } else {
            StationType::MasterNotReady
        }
    }

    pub(super) fn send_reply(&mut self, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let Reply { to, fc } = self.reply.take()?;
        let len = Telegram::no_data(to, self.address, fc).encode(buf).ok()?;
        self.statistics.sent += 1;
        self.sending = Sending::Reply;
        self.timers.stop(Timer::Token);
        Some(len)
    }

    pub(super) fn reply_sent(&mut self, now: Instant) {
        if matches!(self.state, State::ListenToken | State::ActiveIdle) {
            self.timers.start(Timer::Token, now + self.times.token);
        }
    }

    /// Somebody speaks before the answer was due.
    pub(super) fn withdraw_reply(&mut self) {
        self.reply = None;
        self.timers.stop(Timer::Pause);
    }

    /// A frame came from our own address.
    fn own_address_heard<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        self.statistics.discarded += 1;
        if self.state == State::PassiveIdle || !self.ring.own_address_heard() {
            return;
        }
        self.ring.clear_suspicion();
        if !core::mem::replace(&mut self.duplicate, true) {
            user.handle_ring(now, RingEvent::DuplicateAddress);
        }
        self.leave(now, LeaveCause::DuplicateAddress, user);
    }

    /// The one way out of the ring.
    pub(super) fn leave<U: TokenUser>(&mut self, now: Instant, cause: LeaveCause, user: &mut U) {
        for timer in Timer::ALL {
            self.timers.stop(timer);
        }
        self.reply = None;
        if self.sending != Sending::Nothing {
            self.sending = Sending::Stale;
        }
        let member = self.ring.is_member();
        self.gap.finish();
        match (cause, self.membership) {
            (LeaveCause::DuplicateAddress, _) => {
                self.silence();
                self.timers.start(Timer::Token, now + self.times.duplicate);
            }
            (_, Membership::Ring) => self.listen_again(now),
            (_, Membership::Passive) => {
                self.silence();
                self.state = State::PassiveIdle;
            }
            (_, Membership::Offline) => self.silence(),
        }
        if member {
            user.handle_ring(now, RingEvent::Left(cause));
        }
    }

    fn silence(&mut self) {
        self.ring.listen();
        self.time.forget();
        self.reception = None;
        self.spoiled = false;
        self.state = State::Offline;
    }

    /// To ListenToken, knowing nothing.
    pub(super) fn listen_again(&mut self, now: Instant) {
        self.ring.listen();
        self.time.forget();
        self.state = State::ListenToken;
        self.timers.start(Timer::Token, now + self.times.token);
    }

    /// Ttimeout of silence, the end of a pause Offline, or a command.
    pub(super) fn token_timeout<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        match (self.membership, self.state) {
            (Membership::Ring, State::Offline | State::PassiveIdle) => {
                self.line_free = now;
                self.listen_again(now);
            }
            (Membership::Ring, State::ListenToken) => {
                self.ring.claim_alone();
                self.gap.initialise(now);
                self.duplicate = false;
                self.prepare_to_speak();
                // Two tokens to itself, so that a station listening for the ring knows that it has one member.
                self.state = State::ClaimToken { left: 2 };
                user.handle_ring(now, RingEvent::Claimed);
            }
            (Membership::Ring, _) => {
                self.time.forget();
                self.prepare_to_speak();
                user.handle_ring(now, RingEvent::TokenLost);
                self.ring.become_member();
                self.begin_use(now);
                user.handle_ring(now, RingEvent::Claimed);
            }
            (Membership::Passive, State::PassiveIdle) | (Membership::Offline, State::Offline) => {}
            (Membership::Passive | Membership::Offline, _) => self.leave(now, LeaveCause::Commanded, user),
        }
    }

    fn prepare_to_speak(&mut self) {
        self.reception = None;
        self.spoiled = false;
        self.withdraw_reply();
    }
}
