//! How long the token rotated, and how long it may be held.
//!
//! ```text
//!  token ──────────── Trr ────────────► token ── Tth = Ttr − Trr ──► no more low priority
//! ```
//!
//! Source: IEC 61158-4-3 and EN 50170-2 part 4, 4.1.1.4, 4.1.1.5 and 4.4 (token rotation timer).

use crate::time::{Duration, Instant};

/// Which message cycles the station may start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Of both priorities: there is hold time left.
    Any,
    /// One of high priority: the token was late, and this one is guaranteed.
    High,
}

/// The token rotation timer of a station.
#[derive(Debug, Clone, Copy)]
pub(super) struct TokenTime {
    t_tr: Duration,
    /// When the token came last; `None` when that was before the station left the ring.
    received: Option<Instant>,
    hold_until: Instant,
    /// The guaranteed message cycle of this token was used.
    served: bool,
    last: Duration,
    longest: Duration,
}

impl TokenTime {
    pub(super) const fn new(t_tr: Duration) -> Self {
        Self {
            t_tr,
            received: None,
            hold_until: Instant::ZERO,
            served: false,
            last: Duration::ZERO,
            longest: Duration::ZERO,
        }
    }

    /// The token was received. The first one has no rotation behind it and is held for Ttr.
    pub(super) fn receive(&mut self, now: Instant) {
        let mut hold = self.t_tr;
        if let Some(before) = self.received.replace(now) {
            self.last = now - before;
            self.longest = self.longest.max(self.last);
            hold = self.t_tr - self.last;
        }
        self.hold_until = now + hold;
        self.served = false;
    }

    /// The station is no longer in the ring: what passes until the next token is no rotation.
    pub(super) fn forget(&mut self) {
        self.received = None;
    }

    /// What may be started now; nothing when the token has to be passed.
    #[inline]
    pub(super) fn access(&self, now: Instant) -> Option<Access> {
        if now < self.hold_until {
            Some(Access::Any)
        } else if self.served {
            None
        } else {
            Some(Access::High)
        }
    }

    /// A message cycle of high priority is started.
    #[inline]
    pub(super) fn serve_high(&mut self) {
        self.served = true;
    }

    /// The last real rotation time Trr and the longest one.
    pub(super) fn rotation(&self) -> (Duration, Duration) {
        (self.last, self.longest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    #[test]
    fn the_hold_time_is_what_the_rotation_left_of_ttr() {
        let mut time = TokenTime::new(Duration::from_micros(100));
        time.receive(at(1000));
        assert_eq!(time.access(at(1099)), Some(Access::Any));
        assert_eq!(time.access(at(1100)), Some(Access::High));
        // Trr = 70, so Tth = 30.
        time.receive(at(1070));
        assert_eq!(time.access(at(1099)), Some(Access::Any));
        assert_eq!(time.access(at(1100)), Some(Access::High));
        assert_eq!(time.rotation(), (Duration::from_micros(70), Duration::from_micros(70)));
    }

    #[test]
    fn a_late_token_allows_one_message_cycle_of_high_priority() {
        let mut time = TokenTime::new(Duration::from_micros(100));
        time.receive(at(0));
        time.receive(at(250));
        assert_eq!(time.access(at(250)), Some(Access::High));
        time.serve_high();
        assert_eq!(time.access(at(251)), None);
        time.receive(at(260));
        assert_eq!(time.access(at(260)), Some(Access::Any));
        assert_eq!(time.rotation(), (Duration::from_micros(10), Duration::from_micros(250)));
    }

    #[test]
    fn time_outside_the_ring_is_no_rotation() {
        let mut time = TokenTime::new(Duration::from_micros(100));
        time.receive(at(0));
        time.forget();
        time.receive(at(5000));
        assert_eq!(time.access(at(5099)), Some(Access::Any));
        assert_eq!(time.rotation().1, Duration::ZERO);
    }
}
