//! The active station: holds the token, sends requests, waits for replies, repeats.
//!
//! It is made to be alone in the ring. When it hears another master it reports that and falls silent until the line was
//! quiet for Ttimeout.
//!
//! ```text
//!  ListenToken ──Ttimeout of silence──► Idle(ClaimToken) ─► Sending(Token) ─► Idle(UseToken) ◄──────────┐
//!       ▲                                                                        │                     │
//!       │                                       SDN, token: Sending ── Tid ──────┤                     │ Tid1
//!       │                                                                        ▼                     │
//!       └── token or request of another master (from every state)          Sending(Request) ─► AwaitReply ─ reply
//!                                                                                ▲                     │
//!                                                                         Idle(Repeat) ◄── Tsl, bad reply
//! ```
//!
//! Source: IEC 61158-4-3; film-feed specification, section 2.

use super::params::{BusParams, T_SYN};
use super::reception::Reception;
use super::timers::{Timer, Timers};
use crate::address::Address;
use crate::station::{LineError, MAX_TELEGRAM};
use crate::time::{Duration, Instant};
use crate::wire::{Decoded, Decoder, Header, Telegram};

/// What stands behind an active station and uses the token.
pub trait TokenUser {
    /// The token is held and the line is idle: what now? Nothing may change here except by time; the change comes with
    /// [`confirm`](Self::confirm).
    fn next_action(&mut self, now: Instant) -> Action<'_>;

    /// The action that was a [`Action::Send`] has ended.
    fn confirm(&mut self, now: Instant, confirmation: Confirmation<'_>);

    /// Something happened to the token.
    fn handle_ring(&mut self, now: Instant, event: RingEvent);
}

/// What the user wants to do with the token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action<'a> {
    /// Send a request; whether an answer is awaited follows from its function code.
    Send {
        /// Addresses, access points, function code. The source must be this station.
        header: Header,
        /// Data without access points.
        data: &'a [u8],
        /// Whether a missing answer is worth repeating the request.
        repeat: Repeat,
    },
    /// Nothing before this moment; the token is passed on now and then so that the line does not seem dead.
    WaitUntil(Instant),
    /// The cycle is complete.
    PassToken,
}

/// Whether a request is repeated when its answer is missing or bad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Repeat {
    /// Up to the retry limit of the bus parameters.
    UpToLimit,
    /// Never: a station that is probably not there.
    Never,
}

/// How a request ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Confirmation<'a> {
    /// When its first bit was sent, the first time.
    pub started: Instant,
    /// The outcome.
    pub outcome: Outcome<'a>,
}

/// The outcome of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome<'a> {
    /// Short acknowledgement.
    Acknowledged,
    /// A response of the addressed station.
    Response {
        /// Its header; the function code is a response.
        header: Header,
        /// Its data.
        data: &'a [u8],
    },
    /// No usable answer, also after all repetitions.
    NoAnswer,
    /// An unacknowledged telegram has left.
    Sent,
    /// Given up because the token was lost.
    Aborted,
}

/// What happened to the token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RingEvent {
    /// The line was silent long enough: this station is the ring.
    Claimed,
    /// Another master is on the line; this station is silent until it is gone. With the own address, somebody else has it too.
    ForeignMaster(Address),
}

/// What an active station counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FdlStatistics {
    /// Telegrams sent, tokens and repetitions counted.
    pub sent: u64,
    /// Valid telegrams received.
    pub received: u64,
    /// Repetitions sent.
    pub retries: u64,
    /// Slot times that passed without an answer, and answers that did not become complete.
    pub timeouts: u64,
    /// Runs of octets that were no telegram, and telegrams that nobody had asked for.
    pub discarded: u64,
    /// Characters the receiver could not use.
    pub line_errors: u64,
    /// Tokens sent.
    pub tokens: u64,
}

/// Where the station stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Silent; [`Timer::Token`] runs.
    ListenToken,
    /// Holds the token; once [`Timer::Pause`] has expired the next telegram may be sent.
    Idle(Next),
    /// A telegram is on its way out.
    Sending(Sending),
    /// [`Timer::Slot`] runs until the first character, then [`Timer::Reception`].
    AwaitReply,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    /// So many tokens to ourselves are left to be sent.
    ClaimToken(u8),
    UseToken,
    /// A token in a long wait, so that other stations do not take it for lost.
    KeepToken,
    Repeat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sending {
    Token(Next),
    Request,
    Unacknowledged,
}

/// An active station that is alone in the ring.
#[derive(Debug, Clone)]
pub struct ActiveStation {
    decoder: Decoder,
    core: Core,
}

impl ActiveStation {
    /// A silent station that will listen for Ttimeout from the first call on.
    ///
    /// `params` must be valid, see [`BusParams::validate`].
    pub fn new(address: Address, params: BusParams) -> Self {
        let mut timers = Timers::default();
        // The epoch is the caller's; the first timeout tells what time it is, and listening begins there.
        timers.start(Timer::Token, Instant::ZERO);
        let slot = params.slot_time();
        let four_slots = Duration::from_nanos(slot.as_nanos().saturating_mul(4));
        Self {
            decoder: Decoder::new(),
            core: Core {
                address,
                params,
                times: Times {
                    slot,
                    syn: params.baud.duration(T_SYN) + params.latency_allowance,
                    id1: params.baud.duration(params.t_id1),
                    id2: params.baud.duration(params.t_id2),
                    token: params.token_timeout(address),
                    // Below the 6 Tsl after which station 0 would claim the token.
                    keep: four_slots,
                    longest: Reception::longest(params.baud),
                },
                state: State::ListenToken,
                started: false,
                timers,
                reception: None,
                spoiled: false,
                foreign: None,
                request: Pending {
                    octets: [0; MAX_TELEGRAM],
                    len: 0,
                    peer: Address::BROADCAST,
                    attempts_left: 0,
                    started: Instant::ZERO,
                },
                line_free: Instant::ZERO,
                statistics: FdlStatistics::default(),
            },
        }
    }

    /// The own address (TS).
    pub fn address(&self) -> Address {
        self.core.address
    }

    /// The bus parameters.
    pub fn params(&self) -> &BusParams {
        &self.core.params
    }

    /// Counters since the start.
    pub fn statistics(&self) -> FdlStatistics {
        self.core.statistics
    }

    /// Whether the station holds the token.
    pub fn holds_token(&self) -> bool {
        self.core.state != State::ListenToken
    }

    /// See [`Station::handle_octets`](crate::station::Station::handle_octets).
    pub fn handle_octets<U: TokenUser>(&mut self, now: Instant, octets: &[u8], user: &mut U) {
        self.notice_gap(now, octets.len());
        let Self { decoder, core } = self;
        let baud = core.params.baud;
        match &mut core.reception {
            Some(reception) => reception.extend(octets),
            none => *none = Some(Reception::begin(now, octets, baud)),
        }
        core.line_active(now);
        decoder.push(octets, |found| core.handle(now, found, user));
        core.line_settle(now, decoder.pending());
    }

    /// See [`Station::handle_line_error`](crate::station::Station::handle_line_error).
    pub fn handle_line_error<U: TokenUser>(&mut self, now: Instant, error: LineError, user: &mut U) {
        self.notice_gap(now, 1);
        let Self { decoder, core } = self;
        core.statistics.line_errors += 1;
        match &mut core.reception {
            Some(reception) => reception.extend_spoiled(),
            none => *none = Some(Reception::begin_spoiled(now)),
        }
        core.line_active(now);
        core.spoiled = true;
        decoder.push_line_error(error, |found| core.handle(now, found, user));
        core.line_settle(now, decoder.pending());
    }

    /// See [`Station::handle_sent`](crate::station::Station::handle_sent).
    pub fn handle_sent<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        self.core.handle_sent(now, user);
        // Whatever is left over of an earlier reception cannot continue in the answer.
        self.decoder.idle();
    }

    /// See [`Station::handle_timeout`](crate::station::Station::handle_timeout).
    pub fn handle_timeout<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        // Each timer is stopped before it is served, and none is restarted for a moment that has passed: at most one round each.
        for _ in Timer::ALL {
            let Some(timer) = self.core.timers.expire(now) else {
                break;
            };
            self.core.handle_timer(now, timer, user);
        }
    }

    /// See [`Station::poll_transmit`](crate::station::Station::poll_transmit).
    pub fn poll_transmit<U: TokenUser>(
        &mut self,
        now: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        self.core.poll_transmit(now, buf, user)
    }

    /// See [`Station::poll_timeout`](crate::station::Station::poll_timeout).
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.core.timers.next()
    }

    /// After a silence of Tsyn a telegram begins, whatever was spoiled before. While an answer is awaited the slot and
    /// reception timers decide instead.
    fn notice_gap(&mut self, now: Instant, characters: usize) {
        let core = &mut self.core;
        if core.state == State::AwaitReply {
            return;
        }
        let begin = now - core.params.baud.characters(characters);
        if core.line_free + core.times.syn <= begin {
            core.reception = None;
            core.spoiled = false;
            self.decoder.idle();
        }
    }
}

/// Bus parameters as spans, converted once.
#[derive(Debug, Clone, Copy)]
struct Times {
    slot: Duration,
    syn: Duration,
    id1: Duration,
    id2: Duration,
    token: Duration,
    keep: Duration,
    longest: Duration,
}

/// The request under way, kept as octets: a repetition is the same telegram, frame count bit included.
#[derive(Debug, Clone)]
struct Pending {
    octets: [u8; MAX_TELEGRAM],
    len: usize,
    peer: Address,
    attempts_left: u8,
    started: Instant,
}

#[derive(Debug, Clone)]
struct Core {
    address: Address,
    params: BusParams,
    times: Times,
    state: State,
    started: bool,
    timers: Timers,
    reception: Option<Reception>,
    /// The answer being received is already known to be bad.
    spoiled: bool,
    /// The master heard last, reported once.
    foreign: Option<Address>,
    request: Pending,
    /// When the last own telegram or the last heard character ended.
    line_free: Instant,
    statistics: FdlStatistics,
}

impl Core {
    /// Characters were heard: whatever the station wants to send has to wait, and the token is not lost.
    fn line_active(&mut self, now: Instant) {
        self.line_free = now;
        match self.state {
            State::ListenToken => self.timers.start(Timer::Token, now + self.times.token),
            State::AwaitReply if self.timers.is_running(Timer::Slot) => {
                self.timers.stop(Timer::Slot);
                let end = now + self.times.longest + self.times.slot;
                self.timers.start(Timer::Reception, end);
            }
            State::Idle(_) => self.delay(now),
            State::AwaitReply | State::Sending(_) => {}
        }
        self.started = true;
    }

    /// After the characters were looked at.
    fn line_settle(&mut self, now: Instant, pending: usize) {
        if self.state == State::AwaitReply && self.reception.is_some() {
            if self.spoiled {
                self.fail(now);
            } else if let Some(reception) = &self.reception
                && pending > 1
            {
                let end = reception.end(self.params.baud) + self.times.slot;
                self.timers.start(Timer::Reception, end);
            }
        } else if pending == 0 && !self.spoiled {
            self.reception = None;
        }
    }

    /// The next transmission waits until whatever is being received has ended, and then Tid1.
    fn delay(&mut self, now: Instant) {
        let end = match &self.reception {
            Some(reception) => reception.end(self.params.baud).max(now),
            None => now,
        };
        let until = end + self.params.latency_allowance + self.times.id1;
        if self.timers.deadline(Timer::Pause).is_none_or(|at| at < until) {
            self.timers.start(Timer::Pause, until);
        }
    }

    fn handle<U: TokenUser>(&mut self, now: Instant, found: Decoded<'_>, user: &mut U) {
        let telegram = match found {
            Decoded::Telegram(telegram) => telegram,
            Decoded::Discarded { .. } => {
                self.statistics.discarded += 1;
                self.spoiled = true;
                return;
            }
        };
        // Inside a spoiled telegram anything may look like one.
        if self.spoiled {
            self.statistics.discarded += 1;
            return;
        }
        self.statistics.received += 1;
        match telegram {
            Telegram::Token { sa, .. } => self.yield_to(now, sa, user),
            Telegram::Data { header, .. } if header.fc.is_request() => {
                if header.sa == self.address {
                    self.statistics.discarded += 1;
                } else {
                    self.yield_to(now, header.sa, user);
                }
            }
            Telegram::Data { header, data } => {
                if self.state == State::AwaitReply && header.sa == self.request.peer && header.da == self.address {
                    self.succeed(now, Outcome::Response { header, data }, user);
                } else {
                    self.reject();
                }
            }
            Telegram::ShortAck if self.state == State::AwaitReply => {
                self.succeed(now, Outcome::Acknowledged, user);
            }
            Telegram::ShortAck => self.reject(),
        }
    }

    /// A valid telegram that is no answer to what was asked.
    fn reject(&mut self) {
        self.statistics.discarded += 1;
        if self.state == State::AwaitReply {
            self.spoiled = true;
        }
    }

    fn succeed<U: TokenUser>(&mut self, now: Instant, outcome: Outcome<'_>, user: &mut U) {
        self.timers.stop(Timer::Slot);
        self.timers.stop(Timer::Reception);
        self.reception = None;
        self.state = State::Idle(Next::UseToken);
        self.timers.start(Timer::Pause, now + self.times.id1);
        let started = self.request.started;
        user.confirm(now, Confirmation { started, outcome });
    }

    /// The answer was bad: once it has ended, the request is repeated or given up.
    fn fail(&mut self, now: Instant) {
        self.timers.stop(Timer::Slot);
        self.timers.stop(Timer::Reception);
        self.state = State::Idle(Next::Repeat);
        self.delay(now);
    }

    /// Another master speaks: silence.
    fn yield_to<U: TokenUser>(&mut self, now: Instant, master: Address, user: &mut U) {
        let busy = matches!(
            self.state,
            State::AwaitReply | State::Idle(Next::Repeat) | State::Sending(Sending::Request | Sending::Unacknowledged)
        );
        let held = self.state != State::ListenToken;
        self.state = State::ListenToken;
        for timer in [Timer::Pause, Timer::Slot, Timer::Reception] {
            self.timers.stop(timer);
        }
        self.timers.start(Timer::Token, now + self.times.token);
        if busy {
            let started = self.request.started;
            let outcome = Outcome::Aborted;
            user.confirm(now, Confirmation { started, outcome });
        }
        if held || self.foreign != Some(master) {
            self.foreign = Some(master);
            user.handle_ring(now, RingEvent::ForeignMaster(master));
        }
    }

    fn handle_sent<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        self.line_free = now;
        let State::Sending(what) = self.state else {
            return;
        };
        self.reception = None;
        self.spoiled = false;
        match what {
            Sending::Token(next) => {
                self.state = State::Idle(next);
                self.timers.start(Timer::Pause, now + self.times.id1);
            }
            Sending::Unacknowledged => {
                self.state = State::Idle(Next::UseToken);
                self.timers.start(Timer::Pause, now + self.times.id2);
                let started = self.request.started;
                let outcome = Outcome::Sent;
                user.confirm(now, Confirmation { started, outcome });
            }
            Sending::Request => {
                self.state = State::AwaitReply;
                self.timers.start(Timer::Slot, now + self.times.slot);
            }
        }
    }

    fn handle_timer<U: TokenUser>(&mut self, now: Instant, timer: Timer, user: &mut U) {
        match (timer, self.state) {
            (Timer::Token, State::ListenToken) if !self.started => {
                self.started = true;
                self.timers.start(Timer::Token, now + self.times.token);
            }
            (Timer::Token, State::ListenToken) => {
                self.foreign = None;
                self.reception = None;
                self.spoiled = false;
                // Two tokens to itself, so that a station listening for the ring knows that it has one member.
                self.state = State::Idle(Next::ClaimToken(2));
                user.handle_ring(now, RingEvent::Claimed);
            }
            (Timer::Slot, State::AwaitReply) => {
                self.statistics.timeouts += 1;
                // The line has been idle for longer than Tid1 already.
                self.state = State::Idle(Next::Repeat);
            }
            (Timer::Reception, State::AwaitReply) => {
                self.statistics.timeouts += 1;
                self.fail(now);
            }
            // An expired pause needs no reaction but the poll for a telegram that follows.
            _ => {}
        }
    }

    fn poll_transmit<U: TokenUser>(
        &mut self,
        now: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        let State::Idle(next) = self.state else {
            return None;
        };
        if self.timers.is_running(Timer::Pause) {
            return None;
        }
        match next {
            Next::ClaimToken(left) => {
                let then = match left {
                    0 | 1 => Next::UseToken,
                    _ => Next::ClaimToken(left - 1),
                };
                self.send_token(buf, then)
            }
            Next::KeepToken => self.send_token(buf, Next::UseToken),
            Next::Repeat => {
                if let Some(left) = self.request.attempts_left.checked_sub(1) {
                    self.request.attempts_left = left;
                    self.statistics.retries += 1;
                    return self.send_request(buf, Sending::Request);
                }
                let started = self.request.started;
                let outcome = Outcome::NoAnswer;
                self.state = State::Idle(Next::UseToken);
                user.confirm(now, Confirmation { started, outcome });
                self.use_token(now, buf, user)
            }
            Next::UseToken => self.use_token(now, buf, user),
        }
    }

    fn use_token<U: TokenUser>(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM], user: &mut U) -> Option<usize> {
        match user.next_action(now) {
            Action::Send { header, data, repeat } => {
                // Eight octets go out as SD2, as real masters send them: not every slave knows SD3.
                let telegram = Telegram::Data { header, data };
                let Ok(len) = telegram.encode_without_sd3(&mut self.request.octets) else {
                    // Only a user that exceeds a telegram gets here; asking it again at once would never end.
                    self.timers.start(Timer::Pause, now + self.times.slot);
                    let outcome = Outcome::NoAnswer;
                    let started = now;
                    user.confirm(now, Confirmation { started, outcome });
                    return None;
                };
                self.request.len = len;
                self.request.peer = header.da;
                self.request.started = now;
                self.request.attempts_left = match repeat {
                    Repeat::UpToLimit => self.params.retry_limit,
                    Repeat::Never => 0,
                };
                let awaits_answer = header.fc.expects_reply() && !header.da.is_broadcast();
                let what = if awaits_answer {
                    Sending::Request
                } else {
                    Sending::Unacknowledged
                };
                self.send_request(buf, what)
            }
            Action::WaitUntil(until) => {
                let keep = self.line_free + self.times.keep;
                if until <= now {
                    // Never a deadline that has passed.
                    self.timers.start(Timer::Pause, now + Duration::from_nanos(1));
                } else if keep <= now {
                    return self.send_token(buf, Next::UseToken);
                } else if keep < until {
                    self.state = State::Idle(Next::KeepToken);
                    self.timers.start(Timer::Pause, keep);
                } else {
                    self.timers.start(Timer::Pause, until);
                }
                None
            }
            Action::PassToken => self.send_token(buf, Next::UseToken),
        }
    }

    fn send_token(&mut self, buf: &mut [u8; MAX_TELEGRAM], then: Next) -> Option<usize> {
        let token = Telegram::Token {
            da: self.address,
            sa: self.address,
        };
        let len = token.encode(buf).ok()?;
        self.statistics.sent += 1;
        self.statistics.tokens += 1;
        self.state = State::Sending(Sending::Token(then));
        Some(len)
    }

    fn send_request(&mut self, buf: &mut [u8; MAX_TELEGRAM], what: Sending) -> Option<usize> {
        let len = self.request.len;
        let (target, source) = (buf.get_mut(..len)?, self.request.octets.get(..len)?);
        target.copy_from_slice(source);
        self.statistics.sent += 1;
        self.state = State::Sending(what);
        Some(len)
    }
}
