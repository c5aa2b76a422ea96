//! What a station looks like to a line: octets and time in, octets and the next deadline out.

use crate::time::Instant;

/// The longest telegram in octets: SD2 with LE = 249.
pub const MAX_TELEGRAM: usize = 255;

/// Why a receiver could not use a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, thiserror::Error)]
pub enum LineError {
    /// The parity of the eight data bits and the parity bit is odd.
    #[error("parity error")]
    Parity,
    /// The stop bit was 0, or the character had no start.
    #[error("framing error")]
    Framing,
    /// The character arrived before the previous one was fetched.
    #[error("receiver overrun")]
    Overrun,
}

/// A station on a line, without the line: master and slave implement it, a virtual bus or a serial driver runs it.
///
/// # Order of calls
///
/// 1. Inputs in the order of time: [`handle_octets`](Self::handle_octets), [`handle_line_error`](Self::handle_line_error),
///    [`handle_sent`](Self::handle_sent) and, when [`poll_timeout`](Self::poll_timeout) is due, [`handle_timeout`](Self::handle_timeout).
///    A transmission that ended and octets that arrived at the same instant are told before the timeout of that instant.
/// 2. After every input: [`poll_transmit`](Self::poll_transmit) once. When it returned a length, the octets are put on the line at `now`
///    and it is not called again before [`handle_sent`](Self::handle_sent).
/// 3. Then [`poll_timeout`](Self::poll_timeout).
///
/// A station does not hear its own octets. Work per call is bounded, and nothing in here may panic on any octets.
pub trait Station {
    /// Octets, the last of whose characters ended at `now`. They follow each other without a gap.
    ///
    /// A line delivers the first character of a transmission on its own, as soon as it ended, because the slot time is about that one.
    fn handle_octets(&mut self, now: Instant, octets: &[u8]);

    /// One character that could not be used ended at `now`. It stands in its place between the octets.
    fn handle_line_error(&mut self, now: Instant, error: LineError);

    /// The last bit of our own telegram left the line at `now`: slot time and idle time start here.
    fn handle_sent(&mut self, now: Instant);

    /// The moment that [`poll_timeout`](Self::poll_timeout) named has come.
    ///
    /// Afterwards [`poll_timeout`](Self::poll_timeout) must be later than `now`.
    fn handle_timeout(&mut self, now: Instant);

    /// Writes a telegram to be sent *now* into `buf` and returns its length in octets, or `None` when there is nothing to send now.
    fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize>;

    /// The next moment at which [`handle_timeout`](Self::handle_timeout) and then [`poll_transmit`](Self::poll_transmit) must be called.
    fn poll_timeout(&self) -> Option<Instant>;
}
