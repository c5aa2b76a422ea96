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
#[derive(Debug, Clone, Copy)]
pub struct Timers {
    /// [`STOPPED`] for a timer that does not run.
    deadlines: [Instant; Timer::ALL.len()],
    /// Their minimum, kept up to date because it is asked for far more often than a deadline changes.
    earliest: Instant,
}

/// No moment that a timer could be set to: 584 years.
const STOPPED: Instant = Instant::MAX;

impl Timers {
    /// Starts or restarts a timer.
    #[inline]
    pub fn start(&mut self, timer: Timer, at: Instant) {
        let before = core::mem::replace(&mut self.deadlines[timer as usize], at);
        if at <= self.earliest {
            self.earliest = at;
        } else if before == self.earliest {
            self.find_earliest();
        }
    }

    /// Stops a timer.
    #[inline]
    pub fn stop(&mut self, timer: Timer) {
        self.start(timer, STOPPED);
    }

    /// When the timer is due, if it runs.
    #[inline]
    pub fn deadline(&self, timer: Timer) -> Option<Instant> {
        Some(self.deadlines[timer as usize]).filter(|at| *at != STOPPED)
    }

    /// Whether the timer runs.
    #[inline]
    pub fn is_running(&self, timer: Timer) -> bool {
        self.deadlines[timer as usize] != STOPPED
    }

    /// The earliest deadline.
    #[inline]
    pub fn next(&self) -> Option<Instant> {
        Some(self.earliest).filter(|at| *at != STOPPED)
    }

    /// A timer that is due at `now`; it is stopped before it is returned, so that acting on it may start it again.
    #[inline]
    pub fn expire(&mut self, now: Instant) -> Option<Timer> {
        if self.earliest > now {
            return None;
        }
        let timer = Timer::ALL
            .into_iter()
            .find(|&timer| self.deadline(timer).is_some_and(|at| at <= now))?;
        self.stop(timer);
        Some(timer)
    }

    #[inline]
    fn find_earliest(&mut self) {
        self.earliest = self.deadlines.iter().copied().fold(STOPPED, Instant::min);
    }
}

impl Default for Timers {
    fn default() -> Self {
        Self {
            deadlines: [STOPPED; Timer::ALL.len()],
            earliest: STOPPED,
        }
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

    #[test]
    fn the_earliest_deadline_is_the_minimum_after_every_change() {
        // Every sequence of four changes over three timers; the oracle is the plain minimum of what was set.
        let at = Instant::from_nanos;
        let timers = [Timer::Pause, Timer::Slot, Timer::Watchdog];
        let changes: Vec<(Timer, Option<Instant>)> = timers
            .into_iter()
            .flat_map(|timer| [None, Some(at(10)), Some(at(20))].map(|to| (timer, to)))
            .collect();
        let count = changes.len();
        for number in 0..count.pow(4) {
            let mut subject = Timers::default();
            let mut set = [None; 5];
            for place in 0..4 {
                let (timer, to) = changes[number / count.pow(place) % count];
                match to {
                    Some(to) => subject.start(timer, to),
                    None => subject.stop(timer),
                }
                set[timer as usize] = to;
                assert_eq!(subject.next(), set.iter().flatten().copied().min(), "sequence {number}");
            }
        }
    }
}
