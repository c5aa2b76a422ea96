//! The responder: a station that speaks only when asked.

use super::fcb::{Novelty, RetryGuard};
use super::params::T_SYN;
use super::reception::Reception;
use super::timers::{Timer, Timers};
use crate::address::Address;
use crate::station::{LineError, MAX_TELEGRAM};
use crate::time::{Baud, BitTimes, Duration, Instant};
use crate::wire::{Decoded, Decoder, FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram};

/// What stands behind a responder and carries requests out.
pub trait ResponderUser {
    /// A new request to this station which expects an answer: SRD or SDA.
    fn handle_request(&mut self, now: Instant, header: &Header, data: &[u8]) -> Response<'_>;

    /// A request recognised as a repetition; only its reply is repeated, but it proves that the master lives.
    fn handle_repetition(&mut self, now: Instant, header: &Header);

    /// An unacknowledged telegram (SDN) to this station or to all.
    fn handle_unacknowledged(&mut self, now: Instant, header: &Header, data: &[u8]);

    /// Time between the last bit of a request and the first of its reply, asked after each request. A change by Set_Prm
    /// already holds for its own acknowledgement.
    fn t_sdr(&self) -> BitTimes;
}

/// The answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response<'a> {
    /// The short acknowledgement, `E5`.
    ShortAck,
    /// Data with low priority (DL).
    Low(&'a [u8]),
    /// Data with high priority (DH): DP announces new diagnosis by it.
    High(&'a [u8]),
    /// A refusal without data.
    Refuse(ResponseFunction),
}

/// What a responder counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ResponderStatistics {
    /// Requests to this station, repetitions not counted.
    pub requests: u64,
    /// Repeated requests, answered with the stored reply.
    pub repetitions: u64,
    /// Replies sent.
    pub replies: u64,
    /// Runs of octets that were no telegram.
    pub discarded: u64,
    /// Characters the receiver could not use.
    pub line_errors: u64,
}

/// Address match, retry recognition and reply timing of a passive station.
///
/// The reply leaves min Tsdr after the last bit of the request. Octets that arrive before that withdraw it: somebody else speaks.
///
/// # Synchronisation
///
/// After octets that were no telegram nothing is acted on until the line was idle for Tsyn, so that no chance pattern inside a broken
/// telegram is taken for a request. Behind an operating system (`latency` above zero) gaps inside telegrams look like idle times, so idle is
/// only what is longer than the gaps forgiven; but a busy master leaves no such pause, and a slave that waits for one stays deaf for ever.
/// There two more things end the waiting: a pause of Tsyn unless a telegram has begun, and a telegram with a right frame check sequence,
/// which is not acted on itself.
#[derive(Debug, Clone)]
pub struct Responder {
    decoder: Decoder,
    core: Core,
}

impl Responder {
    /// A responder on a line; `latency` forgives gaps inside a telegram which an operating system makes.
    pub fn new(address: Address, baud: Baud, latency: Duration) -> Self {
        Self {
            decoder: Decoder::new(),
            core: Core {
                address,
                baud,
                t_syn: baud.duration(T_SYN),
                latency,
                longest: Reception::longest(baud) + latency,
                begun: Instant::ZERO,
                last_end: None,
                synchronised: true,
                guard: RetryGuard::new(),
                timers: Timers::default(),
                reply: [0; MAX_TELEGRAM],
                reply_len: 0,
                due: false,
                statistics: ResponderStatistics::default(),
            },
        }
    }

    /// The own address.
    pub fn address(&self) -> Address {
        self.core.address
    }

    /// Answers to another address from the next request on; a reply that is already due still leaves.
    pub fn set_address(&mut self, address: Address) {
        self.core.address = address;
        self.core.guard.clear();
    }

    /// Counters since the start.
    pub fn statistics(&self) -> ResponderStatistics {
        self.core.statistics
    }

    /// See [`Station::handle_octets`](crate::station::Station::handle_octets).
    pub fn handle_octets<U: ResponderUser>(&mut self, now: Instant, octets: &[u8], user: &mut U) {
        self.notice(now, octets.len());
        let Self { decoder, core } = self;
        // Whether what is pending afterwards began with these octets.
        let mut begins = decoder.pending() == 0;
        decoder.push(octets, |found| {
            begins = true;
            core.handle(now, found, user);
        });
        if decoder.pending() > 0 {
            // The beginning of a telegram read together with the request: somebody speaks.
            core.timers.stop(Timer::Pause);
            if begins {
                core.begun = now;
            }
        }
    }

    /// See [`Station::handle_line_error`](crate::station::Station::handle_line_error).
    pub fn handle_line_error<U: ResponderUser>(&mut self, now: Instant, error: LineError, user: &mut U) {
        self.notice(now, 1);
        self.core.statistics.line_errors += 1;
        // What follows the spoiled character is no start of a telegram, whatever it looks like.
        self.core.synchronised = false;
        let Self { decoder, core } = self;
        decoder.push_line_error(error, |found| core.handle(now, found, user));
    }

    /// See [`Station::handle_timeout`](crate::station::Station::handle_timeout).
    pub fn handle_timeout(&mut self, now: Instant) {
        if self.core.timers.expire(now) == Some(Timer::Pause) {
            self.core.due = true;
        }
    }

    /// When the reply is due.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.core.timers.deadline(Timer::Pause)
    }

    /// The reply, when it is due; it is due once.
    pub fn take_reply(&mut self) -> Option<&[u8]> {
        if !core::mem::take(&mut self.core.due) {
            return None;
        }
        self.core.statistics.replies += 1;
        self.core.reply.get(..self.core.reply_len)
    }

    fn notice(&mut self, now: Instant, characters: usize) {
        let core = &mut self.core;
        core.timers.stop(Timer::Pause);
        core.due = false;
        let begin = now - core.baud.characters(characters);
        let idle_for = |least| core.last_end.is_none_or(|end| end + least <= begin);
        if idle_for(core.t_syn + core.latency) {
            self.decoder.idle();
            core.synchronised = true;
        } else if self.decoder.pending() == 0 {
            core.synchronised |= core.is_behind_a_system() && idle_for(core.t_syn);
        } else if core.begun + core.longest < begin {
            // No telegram takes that long: a disturbance looked like the start of one and swallows what follows.
            self.decoder.idle();
            core.statistics.discarded += 1;
            core.synchronised = false;
        }
        core.last_end = Some(now);
    }
}

#[derive(Debug, Clone)]
struct Core {
    address: Address,
    baud: Baud,
    t_syn: Duration,
    /// Gaps inside a telegram that are forgiven.
    latency: Duration,
    /// The longest telegram, gaps included.
    longest: Duration,
    /// When the telegram that is not complete yet began, at the latest.
    begun: Instant,
    last_end: Option<Instant>,
    synchronised: bool,
    guard: RetryGuard,
    timers: Timers,
    reply: [u8; MAX_TELEGRAM],
    reply_len: usize,
    due: bool,
    statistics: ResponderStatistics,
}

impl Core {
    /// Whether gaps in what is received mean little.
    fn is_behind_a_system(&self) -> bool {
        self.latency > Duration::ZERO
    }

    fn handle<U: ResponderUser>(&mut self, now: Instant, found: Decoded<'_>, user: &mut U) {
        if matches!(found, Decoded::Telegram(_)) {
            // A telegram read together with the request before it withdraws the reply as if it had come later. (Rubbish does not: a driver
            // that is switched off often leaves a character behind.)
            self.timers.stop(Timer::Pause);
        }
        match found {
            Decoded::Discarded { .. } => {
                self.statistics.discarded += 1;
                self.synchronised = false;
            }
            Decoded::Telegram(Telegram::Data { header, data }) if self.synchronised => {
                self.handle_telegram(now, &header, data, user);
            }
            Decoded::Telegram(Telegram::Data { .. }) => self.synchronised = self.is_behind_a_system(),
            Decoded::Telegram(_) => {}
        }
    }

    fn handle_telegram<U: ResponderUser>(&mut self, now: Instant, header: &Header, data: &[u8], user: &mut U) {
        let FunctionCode::Request { function, .. } = header.fc else {
            return;
        };
        let to_all = header.da.is_broadcast();
        // A telegram that claims to come from ourselves would be answered to ourselves.
        if (header.da != self.address && !to_all) || header.sa == self.address {
            return;
        }
        match function {
            RequestFunction::SdnLow | RequestFunction::SdnHigh => {
                user.handle_unacknowledged(now, header, data);
            }
            _ if to_all => {}
            RequestFunction::FdlStatus => {
                self.answer_uncounted(header, ResponseFunction::Ok);
                self.schedule(now, user.t_sdr());
            }
            RequestFunction::SdaLow | RequestFunction::SdaHigh | RequestFunction::SrdLow | RequestFunction::SrdHigh => {
                match self.guard.judge(header, data) {
                    Novelty::Repetition => {
                        self.statistics.repetitions += 1;
                        user.handle_repetition(now, header);
                        self.schedule(now, user.t_sdr());
                    }
                    Novelty::New => {
                        self.statistics.requests += 1;
                        let response = user.handle_request(now, header, data);
                        self.answer(header, response);
                        self.schedule(now, user.t_sdr());
                    }
                }
            }
            RequestFunction::Ident | RequestFunction::LsapStatus => {
                self.answer_uncounted(header, ResponseFunction::NoService);
                self.schedule(now, user.t_sdr());
            }
            // Clock telegrams, multicast replies and codes without a name are not for a DP-V0 slave.
            _ => {}
        }
    }

    /// The answer takes the place of the stored reply, which can then not be repeated any more.
    fn answer_uncounted(&mut self, request: &Header, function: ResponseFunction) {
        self.statistics.requests += 1;
        self.guard.clear();
        self.answer(request, Response::Refuse(function));
    }

    fn answer(&mut self, request: &Header, response: Response<'_>) {
        let (function, data) = match response {
            Response::ShortAck => {
                self.store(Telegram::ShortAck);
                return;
            }
            Response::Low(data) => (ResponseFunction::DataLow, data),
            Response::High(data) => (ResponseFunction::DataHigh, data),
            // A refusal has no data, and without data there is no place for access points.
            Response::Refuse(function) => {
                let fc = FunctionCode::response(StationType::Slave, function);
                self.store(Telegram::no_data(request.sa, self.address, fc));
                return;
            }
        };
        let header = Header {
            da: request.sa,
            sa: self.address,
            dsap: request.ssap,
            ssap: request.dsap,
            fc: FunctionCode::response(StationType::Slave, function),
        };
        self.store(Telegram::Data { header, data });
    }

    fn store(&mut self, telegram: Telegram<'_>) {
        // Eight octets go out as SD2, as real slaves send them: not every receiver knows SD3.
        // A reply that does not fit into a telegram is none: the master sees a silent slave.
        self.reply_len = telegram.encode_without_sd3(&mut self.reply).unwrap_or(0);
    }

    fn schedule(&mut self, now: Instant, t_sdr: BitTimes) {
        if self.reply_len > 0 {
            self.timers.start(Timer::Pause, now + self.baud.duration(t_sdr));
        }
    }
}
