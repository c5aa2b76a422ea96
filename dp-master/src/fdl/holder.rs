//! What a station does while it has the token: use it, wait for answers, look for newcomers, pass it on.

use super::state::{Answer, Sending, State};
use super::station::{Core, GapTurn};
use super::timers::Timer;
use super::token_time::Access;
use super::token_user::{Action, Confirmation, LeaveCause, Membership, Outcome, Repeat, RingEvent, TokenUser};
use crate::address::Address;
use crate::station::MAX_TELEGRAM;
use crate::time::{Duration, Instant};
use crate::wire::{Fcb, FunctionCode, Header, RequestFunction, StationType, Telegram};

/// How often a successor is passed the token before it is taken for gone: once and two repetitions.
///
/// Source: EN 50170-2 part 4, 4.1.1.1.
const TOKEN_ATTEMPTS: u8 = 3;

impl Core {
    /// The token was accepted or claimed.
    pub(super) fn begin_use(&mut self, now: Instant) {
        self.timers.stop(Timer::Token);
        self.withdraw_reply();
        self.time.receive(now);
        self.gap.count_rotation();
        self.gap_turn = GapTurn::Open;
        self.pass_by = Instant::MAX;
        self.worked = false;
        self.lone_until = now + self.lone_span();
        self.state = State::UseToken;
    }

    /// The token to ourselves has left.
    pub(super) fn token_returned(&mut self, now: Instant) {
        let waiting = self.pass_by != Instant::MAX;
        let idle = !self.worked && !waiting;
        self.begin_use(now);
        let spread = if idle { self.times.spread } else { Duration::ZERO };
        self.timers.start(Timer::Pause, now + self.times.id1 + spread);
    }

    /// The line is idle and the token ours: asks the user, at most twice.
    #[inline]
    pub(super) fn use_token<U: TokenUser>(
        &mut self,
        now: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        let mut asked_again = false;
        loop {
            let Some(access) = self.time.access(now) else {
                return self.begin_pass(now, buf, user);
            };
            match user.next_action(now, access) {
                Action::Send {
                    ref header,
                    data,
                    repeat,
                } => {
                    let high = header.fc.is_high_priority();
                    if access == Access::High && !high {
                        return self.begin_pass(now, buf, user);
                    }
                    // Eight octets go out as SD2, as real masters send them: not every slave knows SD3.
                    let Ok(len) = header.encode_without_sd3(data, buf) else {
                        // Only a user that exceeds a telegram gets here; asking it again at once would never end.
                        self.timers.start(Timer::Pause, now + self.times.slot);
                        let outcome = Outcome::NoAnswer;
                        user.confirm(now, Confirmation { started: now, outcome });
                        return None;
                    };
                    if high {
                        self.time.serve_high();
                    }
                    self.worked = true;
                    self.request.keep(header, data);
                    self.request.started = now;
                    self.request.attempts_left = match repeat {
                        Repeat::UpToLimit => self.params.retry_limit,
                        Repeat::Never => 0,
                    };
                    let what = if header.fc.expects_reply() && !header.da.is_broadcast() {
                        Sending::Request
                    } else {
                        Sending::Unacknowledged
                    };
                    return Some(self.request_goes_out(what, len));
                }
                Action::WaitUntil(until) if self.ring.is_alone() => return self.wait(now, until, buf, user),
                // Whoever waits in a ring lets the others work.
                Action::WaitUntil(until) if until > now => return self.begin_pass(now, buf, user),
                // Never a deadline that has passed.
                Action::WaitUntil(_) => {
                    self.timers.start(Timer::Pause, now + Duration::from_nanos(1));
                    return None;
                }
                Action::PassToken if !asked_again && self.may_begin_cycle(now, access) => {
                    asked_again = true;
                    self.worked = false;
                }
                Action::PassToken => return self.begin_pass(now, buf, user),
            }
        }
    }

    /// Whether a user that says it is complete is asked for its next cycle with the same token: when it was complete
    /// before the token came, or when the station is alone and nobody waits.
    fn may_begin_cycle(&self, now: Instant, access: Access) -> bool {
        if !self.worked {
            return true;
        }
        access == Access::Any
            && now < self.lone_until
            && self.ring.is_alone()
            && !self.gap.is_first()
            && self.membership == Membership::Ring
    }

    /// A station alone has nothing to do until `until`: the token goes round when the silence becomes long, and is back
    /// by then.
    fn wait<U: TokenUser>(
        &mut self,
        now: Instant,
        until: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        let quiet = self.line_free + self.times.keep;
        if until <= now {
            // Never a deadline that has passed.
            self.timers.start(Timer::Pause, now + Duration::from_nanos(1));
            return None;
        }
        if until <= quiet {
            self.timers.start(Timer::Pause, until);
            return None;
        }
        let token = quiet.min(until - self.times.own_token);
        if token > now {
            self.timers.start(Timer::Pause, token);
            return None;
        }
        self.pass_by = until;
        self.state = State::PassToken { attempts: 0 };
        self.pass_token(now, 0, buf, user)
    }

    fn begin_pass<U: TokenUser>(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM], user: &mut U) -> Option<usize> {
        self.state = State::PassToken { attempts: 0 };
        self.pass_token(now, 0, buf, user)
    }

    /// Asks an address of the GAP if one is due, else passes the token.
    pub(super) fn pass_token<U: TokenUser>(
        &mut self,
        now: Instant,
        attempts: u8,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        let alone = self.ring.is_alone();
        if alone && self.membership != Membership::Ring {
            self.leave(now, LeaveCause::Commanded, user);
            return None;
        }
        if attempts == 0
            && let Some(asked) = self.gap_address(now)
        {
            self.gap_turn = GapTurn::Taken;
            return self.send_status_request(now, asked, buf);
        }
        let ns = self.ring.ns();
        let telegram = Telegram::Token {
            da: ns,
            sa: self.address,
        };
        let len = telegram.encode(buf).ok()?;
        self.statistics.sent += 1;
        self.statistics.tokens += 1;
        if ns == self.address {
            self.sending = Sending::TokenToSelf;
        } else {
            self.sending = Sending::Token;
            self.state = State::CheckTokenPass { attempts: attempts + 1 };
        }
        Some(len)
    }

    /// The address of the GAP to be asked with this token.
    fn gap_address(&mut self, now: Instant) -> Option<Address> {
        let at_once = self.gap.is_at_once(now);
        if self.gap_turn == GapTurn::Taken && !at_once {
            return None;
        }
        if self.pass_by != Instant::MAX && self.pass_by < now + self.times.gap_request + self.times.own_token {
            return None;
        }
        let asked = self.gap.due(now, self.ring.las())?;
        if !at_once && self.time.access(now) != Some(Access::Any) {
            // Put off once; with the next token it goes first, so that a busy ring does not stay closed.
            self.gap_put_off = !self.gap_put_off;
            if self.gap_put_off {
                return None;
            }
        }
        Some(asked)
    }

    fn send_status_request(&mut self, now: Instant, asked: Address, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
        let len = Telegram::no_data(asked, self.address, fc).encode(buf).ok()?;
        self.statistics.sent += 1;
        self.statistics.gap_requests += 1;
        self.sending = Sending::Status;
        self.state = State::AwaitStatusResponse { asked, since: now };
        Some(len)
    }

    /// The question to an address of the GAP has ended.
    pub(super) fn status_known(&mut self, now: Instant, asked: Address, since: Instant) {
        self.timers.stop(Timer::Slot);
        self.timers.stop(Timer::Reception);
        self.gap.asked(since, now, asked);
        self.state = State::PassToken { attempts: 0 };
    }

    /// A character after the token: the successor has it.
    pub(super) fn token_taken<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        self.timers.stop(Timer::Slot);
        if self.membership == Membership::Ring {
            self.state = State::ActiveIdle;
        } else {
            self.leave(now, LeaveCause::Commanded, user);
        }
    }

    /// Silence after the token. It was longer than Tid1, so what follows may be sent at once.
    pub(super) fn token_not_taken<U: TokenUser>(&mut self, now: Instant, attempts: u8, user: &mut U) {
        self.statistics.timeouts += 1;
        if attempts < TOKEN_ATTEMPTS {
            self.statistics.token_retries += 1;
            self.state = State::PassToken { attempts };
            return;
        }
        let gone = self.ring.ns();
        self.ring.dismiss(gone);
        // No second question with this token.
        self.gap_turn = GapTurn::Taken;
        self.state = State::PassToken { attempts: 0 };
        user.handle_ring(now, RingEvent::StationLeft(gone));
    }

    pub(super) fn send_claim(&mut self, left: u8, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let (da, sa) = (self.address, self.address);
        let len = Telegram::Token { da, sa }.encode(buf).ok()?;
        self.statistics.sent += 1;
        self.statistics.tokens += 1;
        self.sending = Sending::Claim;
        self.state = State::ClaimToken {
            left: left.saturating_sub(1),
        };
        Some(len)
    }

    /// The answer did not come: the same again, or it is given up.
    pub(super) fn repeat<U: TokenUser>(
        &mut self,
        now: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        if let Some(left) = self.request.attempts_left.checked_sub(1) {
            self.request.attempts_left = left;
            self.statistics.retries += 1;
            let len = self.request.write(buf)?;
            return Some(self.request_goes_out(Sending::Request, len));
        }
        self.state = State::CheckAccessTime;
        let started = self.request.started;
        let outcome = Outcome::NoAnswer;
        user.confirm(now, Confirmation { started, outcome });
        self.use_token(now, buf, user)
    }

    /// The request lies in the buffer of the line.
    #[inline]
    fn request_goes_out(&mut self, what: Sending, len: usize) -> usize {
        self.statistics.sent += 1;
        self.state = match what {
            Sending::Request => State::AwaitDataResponse(Answer::Expected),
            _ => State::CheckAccessTime,
        };
        self.sending = what;
        len
    }

    /// A valid telegram while the token is ours.
    pub(super) fn hear_with_token<U: TokenUser>(&mut self, now: Instant, telegram: Telegram<'_>, user: &mut U) {
        match telegram {
            Telegram::Token { sa, .. } => self.yield_to(now, sa, telegram, user),
            Telegram::Data { header, .. } if header.fc.is_request() => self.yield_to(now, header.sa, telegram, user),
            Telegram::Data { header, data } => match self.state {
                State::AwaitDataResponse(Answer::Expected)
                    if header.sa == self.request.header.da && header.da == self.address =>
                {
                    let outcome = Outcome::Response { header, data };
                    let started = self.request.started;
                    self.succeed(now, Confirmation { started, outcome }, user);
                }
                State::AwaitStatusResponse { asked, since } if header.sa == asked && header.da == self.address => {
                    self.status_answered(now, asked, since, header, user);
                }
                _ => self.reject(),
            },
            Telegram::ShortAck if self.state == State::AwaitDataResponse(Answer::Expected) => {
                let outcome = Outcome::Acknowledged;
                let started = self.request.started;
                self.succeed(now, Confirmation { started, outcome }, user);
            }
            Telegram::ShortAck => self.reject(),
        }
    }

    /// A valid telegram that is no answer to what was asked.
    fn reject(&mut self) {
        self.statistics.discarded += 1;
        if matches!(
            self.state,
            State::AwaitDataResponse(Answer::Expected) | State::AwaitStatusResponse { .. }
        ) {
            self.spoiled = true;
        }
    }

    #[inline]
    fn succeed<U: TokenUser>(&mut self, now: Instant, confirmation: Confirmation<'_>, user: &mut U) {
        self.timers.stop(Timer::Slot);
        self.timers.stop(Timer::Reception);
        self.reception = None;
        self.state = State::CheckAccessTime;
        self.timers.start(Timer::Pause, now + self.times.id1);
        user.confirm(now, confirmation);
    }

    fn status_answered<U: TokenUser>(
        &mut self,
        now: Instant,
        asked: Address,
        since: Instant,
        header: Header,
        user: &mut U,
    ) {
        self.status_known(now, asked, since);
        self.reception = None;
        self.timers.start(Timer::Pause, now + self.times.id1);
        if let FunctionCode::Response {
            station: StationType::MasterReady,
            ..
        } = header.fc
        {
            self.ring.admit(asked);
            self.gap.finish();
            user.handle_ring(now, RingEvent::StationJoined(asked));
        }
    }

    /// The answer was bad: what follows waits until it has ended.
    pub(super) fn answer_is_bad(&mut self, now: Instant) {
        self.timers.stop(Timer::Slot);
        self.timers.stop(Timer::Reception);
        match self.state {
            State::AwaitStatusResponse { asked, since } => self.status_known(now, asked, since),
            _ => self.state = State::AwaitDataResponse(Answer::Missed),
        }
        self.delay(now);
    }

    /// Another master acts, so there are two tokens: this one is given up.
    fn yield_to<U: TokenUser>(&mut self, now: Instant, master: Address, telegram: Telegram<'_>, user: &mut U) {
        let awaited = matches!(self.state, State::AwaitDataResponse(_));
        let claimed = matches!(self.state, State::ClaimToken { .. }) || self.gap.is_at_once(now);
        self.timers.stop(Timer::Pause);
        self.timers.stop(Timer::Slot);
        self.timers.stop(Timer::Reception);
        self.state = State::ActiveIdle;
        if awaited {
            let started = self.request.started;
            let outcome = Outcome::Aborted;
            user.confirm(now, Confirmation { started, outcome });
        }
        user.handle_ring(now, RingEvent::SecondToken(master));
        if !self.ring.las().contains(master) {
            self.gap.hurry();
        }
        if claimed {
            // The ring that was just being made is not the only one.
            self.gap.finish();
            self.listen_again(now);
        }
        self.hear(now, telegram, user);
    }
}
