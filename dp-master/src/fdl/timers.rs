//! Named timers of a station; the station's deadline is the earliest of them.

use crate::time::Instant;

/// What a station can wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timer {
    /// Idle time before the next transmission (Tid1, Tid2), or the least response time (min Tsdr) of a responder.
    Pause,
    /// Slot time: the first character of the reply.
    Slot,
    /// The end of the telegram whose first characters have come.
    Reception,
    /// Ttimeout: the token is lost.
    Token,
    /// The watchdog a slave was given.
    Watchdog,
}

impl Timer {
    /// All of them, in the order in which they are served when due together.
    pub const ALL: [Self; 5] = [Self::Pause, Self::Slot, Self::Reception, Self::Token, Self::Watchdog];
}

/// The deadlines of one station.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timers {
    deadlines: [Option<Instant>; Timer::ALL.len()],
}

impl Timers {
    /// Starts or restarts a timer.
    pub fn start(&mut self, timer: Timer, at: Instant) {
        self.deadlines[timer as usize] = Some(at);
    }

    /// Stops a timer.
    pub fn stop(&mut self, timer: Timer) {
        self.deadlines[timer as usize] = None;
    }

    /// When the timer is due, if it runs.
    pub fn deadline(&self, timer: Timer) -> Option<Instant> {
        self.deadlines[timer as usize]
    }

    /// Whether the timer runs.
    pub fn is_running(&self, timer: Timer) -> bool {
        self.deadline(timer).is_some()
    }

    /// The earliest deadline.
    pub fn next(&self) -> Option<Instant> {
        self.deadlines.iter().flatten().min().copied()
    }

    /// A timer that is due at `now`; it is stopped before it is returned, so that acting on it may start it again.
    pub fn expire(&mut self, now: Instant) -> Option<Timer> {
        let timer = Timer::ALL
            .into_iter()
            .find(|&timer| self.deadline(timer).is_some_and(|at| at <= now))?;
        self.stop(timer);
        Some(timer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earliest_deadline_comes_first_and_fires_once() {
        let at = Instant::from_nanos;
        let mut timers = Timers::default();
        timers.start(Timer::Slot, at(30));
        timers.start(Timer::Watchdog, at(20));
        assert_eq!(timers.next(), Some(at(20)));
        assert_eq!(timers.expire(at(19)), None);
        assert_eq!(timers.expire(at(20)), Some(Timer::Watchdog));
        assert_eq!(timers.expire(at(20)), None);
        assert_eq!(timers.next(), Some(at(30)));
        timers.stop(Timer::Slot);
        assert_eq!(timers.next(), None);
    }
}
