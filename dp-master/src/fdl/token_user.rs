//! What stands behind an active station: who uses the token, for what, and what it is told.

use super::token_time::Access;
use crate::address::Address;
use crate::time::{Duration, Instant};
use crate::wire::Header;

/// What stands behind an active station and uses the token.
pub trait TokenUser {
    /// The token is held and the line is idle: what now? Nothing may change here except by time; the change comes with
    /// [`confirm`](Self::confirm).
    ///
    /// With [`Access::High`] the token was late: only a request of high priority will be sent, anything else passes the
    /// token on. It is not asked at all once the time is used up; what it wanted to do is asked for with the next token.
    fn next_action(&mut self, now: Instant, access: Access) -> Action<'_>;

    /// The action that was a [`Action::Send`] has ended.
    fn confirm(&mut self, now: Instant, confirmation: Confirmation<'_>);

    /// Something happened to the token or the ring.
    fn handle_ring(&mut self, now: Instant, event: RingEvent);
}

/// What the user wants to do with the token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action<'a> {
    /// Send a request; whether an answer is awaited, and with which priority it goes, follows from its function code.
    Send {
        /// Addresses, access points, function code. The source must be this station.
        header: Header,
        /// Data without access points.
        data: &'a [u8],
        /// Whether a missing answer is worth repeating the request.
        repeat: Repeat,
    },
    /// Nothing before this moment. In a ring the token goes on; a station alone passes it to itself now and then so that
    /// the line does not seem dead, and is ready at that moment to the nanosecond.
    WaitUntil(Instant),
    /// The cycle is complete. In a ring the token goes on; a station alone may be asked for the next cycle at once.
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
    /// Given up because another master spoke.
    Aborted,
}

/// What happened to the token or the ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RingEvent {
    /// This station took the token after a silence of Ttimeout.
    Claimed,
    /// A ring fell silent while this station was in it; it will be claimed by the lowest address.
    TokenLost,
    /// This station was admitted and has had its first token.
    Entered,
    /// This station is no longer in the ring.
    Left(LeaveCause),
    /// Another master entered the ring.
    StationJoined(Address),
    /// Another master is no longer in the ring.
    StationLeft(Address),
    /// This station held the token and heard the master with this address act: it gave the token up.
    SecondToken(Address),
    /// Another station has our address. This one is silent for a while and then listens again.
    DuplicateAddress,
}

/// Why a station left the ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LeaveCause {
    /// The others passed the token over it twice; it listens and waits to be admitted again.
    Excluded,
    /// Another station has the same address.
    DuplicateAddress,
    /// It was told to.
    Commanded,
}

/// Whether a station wants to be in the ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Membership {
    /// It listens and enters.
    #[default]
    Ring,
    /// It only answers (PassiveIdle).
    Passive,
    /// It does neither hear nor speak (Offline).
    Offline,
}

/// What an active station counts and measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FdlStatistics {
    /// Telegrams sent, tokens and repetitions counted.
    pub sent: u64,
    /// Valid telegrams received.
    pub received: u64,
    /// Repetitions of requests sent.
    pub retries: u64,
    /// Slot times that passed without an answer, and answers that did not become complete.
    pub timeouts: u64,
    /// Runs of octets that were no telegram, and telegrams that nobody had asked for.
    pub discarded: u64,
    /// Characters the receiver could not use.
    pub line_errors: u64,
    /// Tokens sent, repetitions counted.
    pub tokens: u64,
    /// Tokens repeated because the successor did not act.
    pub token_retries: u64,
    /// Addresses asked for newcomers.
    pub gap_requests: u64,
    /// The last real token rotation time Trr; zero before the second token.
    pub last_rotation: Duration,
    /// The longest one.
    pub longest_rotation: Duration,
}
