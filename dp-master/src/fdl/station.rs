//! The active station: a member of the token ring. Its parts are put together here.

use super::gap::Gap;
use super::las::Las;
use super::params::{BusParams, T_SYN};
use super::reception::Reception;
use super::ring::{Change, Ring};
use super::state::{Answer, FdlState, Sending, State};
use super::timers::{Timer, Timers};
use super::token_time::TokenTime;
use super::token_user::{Confirmation, FdlStatistics, Membership, Outcome, RingEvent, TokenUser};
use crate::address::Address;
use crate::station::{LineError, MAX_TELEGRAM};
use crate::time::{BitTimes, Duration, Instant};
use crate::wire::{Decoded, Decoder, Fcb, FunctionCode, Header, MAX_DATA, RequestFunction, Telegram};

/// A station alone spends at most one part in this many on tokens to itself while its user has something to send: 0.2 %.
const LONE_SHARE: u64 = 512;

/// An active station: listens, enters the ring of masters, uses the token for its [`TokenUser`] and passes it on.
///
/// | state | event | action | next state |
/// |---|---|---|---|
/// | Offline | first call, or the pause after a duplicate address is over | forget the ring | ListenToken |
/// | ListenToken | token | follow it; complete after two identical rotations | |
/// | | FDL status request | answer *not ready*, or *ready* once complete | ActiveIdle if complete and asked by PS |
/// | | SA = TS twice | [`RingEvent::DuplicateAddress`] | Offline |
/// | | silence for Ttimeout | the ring is this station alone | ClaimToken |
/// | PassiveIdle | FDL status request | answer *not ready* | |
/// | ActiveIdle | token PS → TS, or the second from one other SA | Tth = Ttr − Trr | UseToken |
/// | | other token | update the LAS | |
/// | | passed over in two rotations | [`RingEvent::Left`] | ListenToken |
/// | | SA = TS twice | [`RingEvent::DuplicateAddress`] | Offline |
/// | | request to TS | answer FDL status; refuse SDA and SRD (RS) | |
/// | | silence for Ttimeout | [`RingEvent::TokenLost`]; the LAS stays | UseToken (through ClaimToken) |
/// | ClaimToken | — | two tokens to itself, then the GAP is asked (at once for 100 ms at most, then with each token) | PassToken |
/// | UseToken, CheckAccessTime | Tth left, or one of high priority not yet sent | ask the user: request | AwaitDataResponse |
/// | | | SDN | CheckAccessTime |
/// | | time used up, or the user has nothing | | PassToken |
/// | AwaitDataResponse | answer, or none after all repetitions | tell the user | CheckAccessTime |
/// | PassToken | an address of the GAP is due | ask for its FDL status | AwaitStatusResponse |
/// | | — | token to NS | CheckTokenPass, UseToken when alone |
/// | AwaitStatusResponse | *ready* | it is the new NS | PassToken |
/// | | another answer, or none | | PassToken |
/// | CheckTokenPass | any character within Tsl | | ActiveIdle |
/// | | silence for Tsl, first and second time | repeat the token | CheckTokenPass |
/// | | third time | take NS out of the LAS | PassToken |
/// | every state with the token | token or request of another master | [`RingEvent::SecondToken`] | ActiveIdle |
///
/// States with the token are those of [`FdlState::holds_token`].
///
/// # A station alone
///
/// Nobody waits for its token. It passes the token to itself at the end of a user's cycle, and only when the hold time is
/// used up or 512 times the time of such a token has passed, so that a cycle is not lengthened by it; and in
/// every pause of the user, well before others would take it for lost. A user that has nothing to send does not hold it at
/// all. Looking for newcomers costs it at most one part in 160 of its time, so a newcomer may wait for 160 slot times for
/// each address up to HSA: a small HSA helps.
///
/// # Interpretations
///
/// - A station does not hear itself (see [`Station`](crate::station::Station)), so the checks of the own token frame by
///   simultaneous reception are left to the driver.
/// - In a pause, a station alone adds TS bit times to the idle time after its token, or takes them off the longest
///   silence. Two stations that claimed the token in the same instant do not hear each other while both send; on a real
///   line their clocks drift apart, in virtual time they would go on for ever.
/// - A station waits for its second own token to be passed over before it leaves, because a token frame has no frame check
///   sequence and two flipped bits may name another address.
/// - GAP maintenance is put off when the hold time is used up, once; with the next token it goes first
///   (EN 50170-2 part 4, 4.1.1.2).
///
/// Source: IEC 61158-4-3; EN 50170-2 part 4, 4.1.1; film-feed specification, section 2.
#[derive(Debug, Clone)]
pub struct ActiveStation {
    decoder: Decoder,
    core: Core,
}

impl ActiveStation {
    /// A station that listens from the first call on.
    ///
    /// `params` must be valid, see [`BusParams::validate`].
    pub fn new(address: Address, params: BusParams) -> Self {
        let mut timers = Timers::default();
        // The epoch is the caller's; the first timeout tells what time it is, and listening begins there.
        timers.start(Timer::Token, Instant::ZERO);
        Self {
            decoder: Decoder::new(),
            core: Core {
                address,
                times: Times::new(address, &params),
                state: State::Offline,
                sending: Sending::Nothing,
                membership: Membership::Ring,
                timers,
                reception: None,
                spoiled: false,
                request: Pending::nothing(address),
                reply: None,
                ring: Ring::new(address),
                gap: Gap::new(address, params.hsa, params.gap_factor),
                gap_turn: GapTurn::Open,
                gap_put_off: false,
                time: TokenTime::new(params.baud.duration(params.t_tr)),
                lone_until: Instant::ZERO,
                worked: false,
                pass_by: Instant::MAX,
                duplicate: false,
                line_free: Instant::ZERO,
                statistics: FdlStatistics::default(),
                params,
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

    /// Counters and times since the start.
    pub fn statistics(&self) -> FdlStatistics {
        let (last_rotation, longest_rotation) = self.core.time.rotation();
        FdlStatistics {
            last_rotation,
            longest_rotation,
            ..self.core.statistics
        }
    }

    /// The state.
    pub fn state(&self) -> FdlState {
        self.core.state.name()
    }

    /// Whether the station holds the token.
    pub fn holds_token(&self) -> bool {
        self.state().holds_token()
    }

    /// Whether the station has had the token and the others have not taken it out of the ring since.
    pub fn is_in_ring(&self) -> bool {
        self.core.ring.is_member()
    }

    /// The list of active stations; empty while it is being built.
    pub fn las(&self) -> Las {
        self.core.ring.las()
    }

    /// Whether the station wants to be in the ring.
    pub fn membership(&self) -> Membership {
        self.core.membership
    }

    /// Tells the station to leave the ring or to come back. It passes the token on before it leaves.
    ///
    /// Afterwards [`poll_timeout`](Self::poll_timeout) may name an earlier moment.
    pub fn set_membership(&mut self, membership: Membership) {
        if self.core.membership == membership {
            return;
        }
        self.core.membership = membership;
        if !self.core.state.name().holds_token() && self.core.sending == Sending::Nothing {
            // The change itself needs to know the time.
            self.core.timers.start(Timer::Token, Instant::ZERO);
        }
    }

    /// See [`Station::handle_octets`](crate::station::Station::handle_octets).
    pub fn handle_octets<U: TokenUser>(&mut self, now: Instant, octets: &[u8], user: &mut U) {
        if self.core.is_deaf() {
            return;
        }
        self.notice_gap(now, octets.len());
        let Self { decoder, core } = self;
        match &mut core.reception {
            Some(reception) => reception.extend(octets),
            none => *none = Some(Reception::begin(now, octets)),
        }
        core.line_active(now, user);
        decoder.push(octets, |found| core.handle(now, found, user));
        core.line_settle(now, decoder.pending());
    }

    /// See [`Station::handle_line_error`](crate::station::Station::handle_line_error).
    pub fn handle_line_error<U: TokenUser>(&mut self, now: Instant, error: LineError, user: &mut U) {
        if self.core.is_deaf() {
            return;
        }
        self.notice_gap(now, 1);
        let Self { decoder, core } = self;
        core.statistics.line_errors += 1;
        match &mut core.reception {
            Some(reception) => reception.extend_spoiled(),
            none => *none = Some(Reception::begin_spoiled(now)),
        }
        core.line_active(now, user);
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
    #[inline]
    pub fn poll_transmit<U: TokenUser>(
        &mut self,
        now: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        self.core.poll_transmit(now, buf, user)
    }

    /// See [`Station::poll_timeout`](crate::station::Station::poll_timeout).
    #[inline]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.core.timers.next()
    }

    /// After a silence of Tsyn a telegram begins, whatever was spoiled before. While an answer is awaited the slot and
    /// reception timers decide instead.
    fn notice_gap(&mut self, now: Instant, characters: usize) {
        let core = &mut self.core;
        if core.awaits_answer() {
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
pub(super) struct Times {
    pub(super) slot: Duration,
    pub(super) syn: Duration,
    pub(super) id1: Duration,
    pub(super) id2: Duration,
    /// Before an answer of our own.
    pub(super) sdr_min: Duration,
    /// Silence after which the token is lost.
    pub(super) token: Duration,
    /// The longest silence a station alone allows itself.
    pub(super) keep: Duration,
    /// What a station alone adds to the idle time when nothing is to be done.
    pub(super) spread: Duration,
    /// A token to itself with its idle time.
    pub(super) own_token: Duration,
    /// A question to an address of the GAP that nobody answers.
    pub(super) gap_request: Duration,
    pub(super) longest: Duration,
    /// The pause after a duplicate address.
    pub(super) duplicate: Duration,
}

impl Times {
    fn new(address: Address, params: &BusParams) -> Self {
        let baud = params.baud;
        let slot = params.slot_time();
        let id1 = baud.duration(params.t_id1);
        let ts = u64::from(address.value());
        // Four slots are below the six after which station 0 would claim the token.
        let keep = Duration::from_nanos(slot.as_nanos().saturating_mul(4));
        let earlier = Duration::from_nanos(slot.as_nanos().saturating_mul(ts) / 128);
        Self {
            slot,
            syn: baud.duration(T_SYN) + params.latency_allowance,
            id1,
            id2: baud.duration(params.t_id2),
            sdr_min: baud.duration(params.t_sdr_min),
            token: params.token_timeout(address),
            keep: keep - earlier,
            spread: baud.duration(BitTimes(u32::from(address.value()))),
            own_token: baud.characters(TOKEN_CHARACTERS) + id1,
            gap_request: baud.characters(STATUS_CHARACTERS) + slot + id1,
            longest: Reception::longest(baud),
            duplicate: DUPLICATE_PAUSE,
        }
    }
}

/// SD4, DA, SA.
const TOKEN_CHARACTERS: usize = 3;
/// SD1, DA, SA, FC, FCS, ED.
const STATUS_CHARACTERS: usize = 6;

/// How long a station is silent when its address is in use. Long enough to read the message, short enough that pulling the
/// other plug helps at once; it does not speak before it has listened again.
const DUPLICATE_PAUSE: Duration = Duration::from_millis(1_000);

/// The request under way, frame count bit included: a repetition is the same telegram.
///
/// Kept as what it was made of and not as octets: the octets have just been written to the line's buffer, and reading back what was
/// written a moment ago is slow.
#[derive(Debug, Clone)]
pub(super) struct Pending {
    pub(super) header: Header,
    data: [u8; MAX_DATA],
    len: usize,
    pub(super) attempts_left: u8,
    pub(super) started: Instant,
}

impl Pending {
    fn nothing(address: Address) -> Self {
        let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::FdlStatus);
        Self {
            header: Header::new(Address::BROADCAST, address, fc),
            data: [0; MAX_DATA],
            len: 0,
            attempts_left: 0,
            started: Instant::ZERO,
        }
    }

    /// Keeps what is being sent, so that it can be repeated; it fits, because it was encoded.
    #[inline]
    pub(super) fn keep(&mut self, header: &Header, data: &[u8]) {
        self.header = *header;
        if let Some(target) = self.data.get_mut(..data.len()) {
            target.copy_from_slice(data);
            self.len = data.len();
        }
    }

    /// The same telegram again, to the front of `buf`.
    pub(super) fn write(&self, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let data = self.data.get(..self.len)?;
        self.header.encode_without_sd3(data, buf).ok()
    }
}

/// An answer to another master; none that this station gives has data.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reply {
    pub(super) to: Address,
    pub(super) fc: FunctionCode,
}

/// Whether this token may still be used to ask an address of the GAP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GapTurn {
    Open,
    Taken,
}

/// Everything but the decoder, which lends out the telegrams.
///
/// What is done with the token stands in `holder`, what is done without it in `listener`.
#[derive(Debug, Clone)]
pub(super) struct Core {
    pub(super) address: Address,
    pub(super) params: BusParams,
    pub(super) times: Times,
    pub(super) state: State,
    pub(super) sending: Sending,
    pub(super) membership: Membership,
    pub(super) timers: Timers,
    pub(super) reception: Option<Reception>,
    /// What is being received is already known to be bad.
    pub(super) spoiled: bool,
    pub(super) request: Pending,
    /// The answer that is due when the pause is over.
    pub(super) reply: Option<Reply>,
    pub(super) ring: Ring,
    pub(super) gap: Gap,
    pub(super) gap_turn: GapTurn,
    /// The hold time was used up when an address of the GAP was due.
    pub(super) gap_put_off: bool,
    pub(super) time: TokenTime,
    /// Until when a station alone need not pass the token to itself.
    pub(super) lone_until: Instant,
    /// The user has sent something since it was last complete.
    pub(super) worked: bool,
    /// When the user wants the line again, while it waits.
    pub(super) pass_by: Instant,
    /// The duplicate address was reported and the station has not been in the ring since.
    pub(super) duplicate: bool,
    /// When the last own telegram or the last heard character ended.
    pub(super) line_free: Instant,
    pub(super) statistics: FdlStatistics,
}

impl Core {
    /// Whether nothing is heard: off, or sending.
    fn is_deaf(&self) -> bool {
        self.state == State::Offline || self.sending != Sending::Nothing
    }

    fn awaits_answer(&self) -> bool {
        matches!(
            self.state,
            State::AwaitDataResponse(Answer::Expected) | State::AwaitStatusResponse { .. }
        )
    }

    /// Characters were heard: whatever the station wants to send has to wait, and the token is not lost.
    fn line_active<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        self.line_free = now;
        match self.state {
            State::AwaitDataResponse(Answer::Expected) | State::AwaitStatusResponse { .. } => {
                // Until when the telegram must have ended is said after a look at it: most often it is complete.
                self.timers.stop(Timer::Slot);
            }
            State::Offline => {}
            State::PassiveIdle | State::ListenToken | State::ActiveIdle => self.withdraw_reply(),
            State::CheckTokenPass { .. } => self.token_taken(now, user),
            _ => self.delay(now),
        }
    }

    /// After the characters were looked at.
    fn line_settle(&mut self, now: Instant, pending: usize) {
        match self.state {
            State::AwaitDataResponse(Answer::Expected) | State::AwaitStatusResponse { .. } => {
                if self.reception.is_none() {
                    return;
                }
                if self.spoiled {
                    self.answer_is_bad(now);
                } else if let Some(reception) = &self.reception
                    && pending > 1
                {
                    let end = reception.end(self.params.baud) + self.times.slot;
                    self.timers.start(Timer::Reception, end);
                } else if !self.timers.is_running(Timer::Reception) {
                    let end = now + self.times.longest + self.times.slot;
                    self.timers.start(Timer::Reception, end);
                }
            }
            State::ListenToken | State::ActiveIdle => {
                if pending == 0 && !self.spoiled {
                    self.reception = None;
                }
                // The rest of a telegram comes when it ends, and until then the line is not silent.
                let end = match &self.reception {
                    Some(reception) => reception.end(self.params.baud).max(now),
                    None => now,
                };
                self.timers.start(Timer::Token, end + self.times.token);
            }
            _ => {
                if pending == 0 && !self.spoiled {
                    self.reception = None;
                }
            }
        }
    }

    /// The next transmission waits until whatever is being received has ended, and then Tid1.
    pub(super) fn delay(&mut self, now: Instant) {
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
            // Behind an operating system idle times are not seen. There a frame check sequence ends the confusion.
            let checked = matches!(telegram, Telegram::Data { .. });
            if checked && self.params.latency_allowance > Duration::ZERO && !self.awaits_answer() {
                self.spoiled = false;
            }
            return;
        }
        self.statistics.received += 1;
        match self.state {
            State::Offline => {}
            State::PassiveIdle | State::ListenToken | State::ActiveIdle => self.hear(now, telegram, user),
            _ => self.hear_with_token(now, telegram, user),
        }
    }

    fn handle_sent<U: TokenUser>(&mut self, now: Instant, user: &mut U) {
        self.line_free = now;
        self.reception = None;
        self.spoiled = false;
        match core::mem::replace(&mut self.sending, Sending::Nothing) {
            Sending::Nothing => {}
            Sending::Stale | Sending::Reply => self.reply_sent(now),
            Sending::Request | Sending::Status => self.timers.start(Timer::Slot, now + self.times.slot),
            Sending::Unacknowledged => {
                self.timers.start(Timer::Pause, now + self.times.id2);
                let started = self.request.started;
                let outcome = Outcome::Sent;
                user.confirm(now, Confirmation { started, outcome });
            }
            Sending::Token => self.timers.start(Timer::Slot, now + self.times.slot),
            Sending::TokenToSelf => self.token_returned(now),
            Sending::Claim => {
                if self.state == (State::ClaimToken { left: 0 }) {
                    self.time.receive(now);
                    self.state = State::PassToken { attempts: 0 };
                }
                self.timers.start(Timer::Pause, now + self.times.id1);
            }
        }
    }

    fn handle_timer<U: TokenUser>(&mut self, now: Instant, timer: Timer, user: &mut U) {
        match (timer, self.state) {
            (Timer::Token, State::Offline | State::PassiveIdle | State::ListenToken | State::ActiveIdle) => {
                self.token_timeout(now, user);
            }
            // A command that came while the token was being checked; it is obeyed when that is over.
            (Timer::Token, _) => {}
            (Timer::Slot, State::CheckTokenPass { attempts }) => self.token_not_taken(now, attempts, user),
            (Timer::Slot, State::AwaitDataResponse(Answer::Expected)) => {
                self.statistics.timeouts += 1;
                // The line has been idle for longer than Tid1 already.
                self.state = State::AwaitDataResponse(Answer::Missed);
            }
            (Timer::Slot, State::AwaitStatusResponse { asked, since }) => self.status_known(now, asked, since),
            (Timer::Reception, State::AwaitDataResponse(Answer::Expected) | State::AwaitStatusResponse { .. }) => {
                self.statistics.timeouts += 1;
                self.answer_is_bad(now);
            }
            // An expired pause needs no reaction but the poll for a telegram that follows.
            _ => {}
        }
    }

    #[inline]
    fn poll_transmit<U: TokenUser>(
        &mut self,
        now: Instant,
        buf: &mut [u8; MAX_TELEGRAM],
        user: &mut U,
    ) -> Option<usize> {
        if self.timers.is_running(Timer::Pause) || self.sending != Sending::Nothing {
            return None;
        }
        match self.state {
            State::CheckAccessTime | State::UseToken => self.use_token(now, buf, user),
            State::AwaitDataResponse(Answer::Missed) => self.repeat(now, buf, user),
            State::PassToken { attempts } => self.pass_token(now, attempts, buf, user),
            State::ClaimToken { left } => self.send_claim(left, buf),
            State::PassiveIdle | State::ListenToken | State::ActiveIdle => self.send_reply(buf),
            State::Offline
            | State::AwaitDataResponse(Answer::Expected)
            | State::CheckTokenPass { .. }
            | State::AwaitStatusResponse { .. } => None,
        }
    }

    pub(super) fn tell_change<U: TokenUser>(&mut self, now: Instant, change: Change, user: &mut U) {
        if change.is_none() || !self.ring.is_member() {
            return;
        }
        for address in change.left.iter() {
            user.handle_ring(now, RingEvent::StationLeft(address));
        }
        for address in change.joined.iter() {
            user.handle_ring(now, RingEvent::StationJoined(address));
        }
    }

    /// How long a station alone may go on without a token to itself.
    pub(super) fn lone_span(&self) -> Duration {
        Duration::from_nanos(self.times.own_token.as_nanos().saturating_mul(LONE_SHARE))
    }
}
