//! The states of an active station.

use crate::address::Address;
use crate::time::Instant;

/// The states of the standard, by its names.
///
/// Source: IEC 61158-4-3, clause 8.2; EN 50170-2 part 4 (FDL controller).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FdlState {
    /// Neither hears nor speaks.
    Offline,
    /// Answers, and does not want to enter the ring.
    PassiveIdle,
    /// Hears who is in the ring, waits to be asked.
    ListenToken,
    /// Knows the ring, answers, waits for the token.
    ActiveIdle,
    /// Tells everybody that a new ring begins.
    ClaimToken,
    /// Has just received the token.
    UseToken,
    /// Waits for the answer to a request, or to repeat it.
    AwaitDataResponse,
    /// Has completed a message cycle: may it begin another one?
    CheckAccessTime,
    /// Asks one address of the GAP if one is due, and passes the token.
    PassToken,
    /// Waits for the successor to act.
    CheckTokenPass,
    /// Waits for the answer of an address of the GAP.
    AwaitStatusResponse,
}

impl FdlState {
    /// Whether a station in this state has the right to speak.
    ///
    /// In [`CheckTokenPass`](Self::CheckTokenPass) it has given it away, and takes it back when the successor does not act.
    pub const fn holds_token(self) -> bool {
        matches!(
            self,
            Self::ClaimToken
                | Self::UseToken
                | Self::AwaitDataResponse
                | Self::CheckAccessTime
                | Self::PassToken
                | Self::AwaitStatusResponse
        )
    }
}

/// The same with what each state remembers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Offline,
    PassiveIdle,
    ListenToken,
    ActiveIdle,
    ClaimToken {
        /// Tokens to ourselves still to be sent.
        left: u8,
    },
    UseToken,
    AwaitDataResponse(Answer),
    CheckAccessTime,
    PassToken {
        /// How often the present successor was passed the token already.
        attempts: u8,
    },
    CheckTokenPass {
        attempts: u8,
    },
    AwaitStatusResponse {
        asked: Address,
        since: Instant,
    },
}

/// Where the wait for an answer stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Answer {
    /// The slot or reception timer runs.
    Expected,
    /// It did not come or was bad: the request is repeated or given up after the pause.
    Missed,
}

impl State {
    pub(super) const fn name(self) -> FdlState {
        match self {
            Self::Offline => FdlState::Offline,
            Self::PassiveIdle => FdlState::PassiveIdle,
            Self::ListenToken => FdlState::ListenToken,
            Self::ActiveIdle => FdlState::ActiveIdle,
            Self::ClaimToken { .. } => FdlState::ClaimToken,
            Self::UseToken => FdlState::UseToken,
            Self::AwaitDataResponse(_) => FdlState::AwaitDataResponse,
            Self::CheckAccessTime => FdlState::CheckAccessTime,
            Self::PassToken { .. } => FdlState::PassToken,
            Self::CheckTokenPass { .. } => FdlState::CheckTokenPass,
            Self::AwaitStatusResponse { .. } => FdlState::AwaitStatusResponse,
        }
    }
}

/// What is on its way out, and so what its end means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sending {
    Nothing,
    /// A token to ourselves that tells of a new ring.
    Claim,
    /// A token to ourselves, the only station.
    TokenToSelf,
    /// A token to the successor.
    Token,
    Request,
    Unacknowledged,
    Status,
    Reply,
    /// Something whose sense was lost while it was sent.
    Stale,
}
