//! When a DP cycle begins: the constant bus cycle, and what happens to a cycle that took too long.

use crate::time::{Duration, Instant};

/// When a cycle begins after one that took too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overrun {
    /// At once; all later cycles are shifted. A cycle begins no sooner than one period after the start of the one
    /// before.
    #[default]
    FollowAtOnce,
    /// On the grid of the first cycle: the phase stays, periods without a start of their own are missed and counted. A
    /// cycle that begins late (the token was elsewhere, the driver woke up late) shifts nothing.
    KeepPhase,
}

/// The pace of the cycles.
#[derive(Debug, Clone)]
pub(super) struct Pace {
    /// Zero: as fast as possible.
    period: Duration,
    overrun: Overrun,
    cycle: Option<Cycle>,
    /// The last complete cycle was an overrun.
    overrunning: bool,
}

/// The cycle that began last.
#[derive(Debug, Clone, Copy)]
struct Cycle {
    started: Instant,
    /// The point of the grid it belongs to; the start itself unless the phase is kept.
    grid: Instant,
    /// When there was nothing left to send.
    ended: Option<Instant>,
}

/// What the beginning of a cycle tells about the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Begun {
    /// From start to start; `None` when there was none before.
    pub(super) last_cycle: Option<Duration>,
    /// It was not done when the next one was due: how long it took.
    pub(super) overran: Option<Duration>,
    /// The first overrun after a cycle in time.
    pub(super) is_first: bool,
    /// Periods without a start.
    pub(super) missed: u64,
}

impl Pace {
    pub(super) const fn new(period: Duration, overrun: Overrun) -> Self {
        Self {
            period,
            overrun,
            cycle: None,
            overrunning: false,
        }
    }

    /// When the next cycle may begin.
    pub(super) fn due(&self, now: Instant) -> Instant {
        let Some(cycle) = self.cycle else {
            return now;
        };
        let due = cycle.grid + self.period;
        match (self.overrun, cycle.ended) {
            (Overrun::KeepPhase, Some(ended)) if ended > due => cycle.grid + self.periods(ended - cycle.grid),
            _ => due,
        }
    }

    /// A cycle begins.
    pub(super) fn begin(&mut self, now: Instant) -> Begun {
        let due = self.due(now);
        let (mut grid, mut begun) = (now, Begun::default());
        if let Some(cycle) = self.cycle {
            begun.last_cycle = Some(now - cycle.started);
            let took = cycle.ended.map_or(Duration::ZERO, |ended| ended - cycle.started);
            let late = cycle.ended.is_some_and(|ended| ended > cycle.grid + self.period);
            if late && self.period > Duration::ZERO {
                begun.overran = Some(took);
                begun.is_first = !self.overrunning;
            }
            if self.overrun == Overrun::KeepPhase && self.period > Duration::ZERO {
                // The point of the grid at or before now; points that were passed over are gone.
                let late = now - due;
                grid = due + Duration::from_nanos(late.as_nanos() / self.period.as_nanos() * self.period.as_nanos());
                begun.missed = ((grid - cycle.grid).as_nanos() / self.period.as_nanos()).saturating_sub(1);
            }
        }
        self.overrunning = begun.overran.is_some();
        self.cycle = Some(Cycle {
            started: now,
            grid,
            ended: None,
        });
        begun
    }

    /// Nothing is left to send in this cycle.
    pub(super) fn end(&mut self, now: Instant) {
        if let Some(cycle) = &mut self.cycle {
            cycle.ended.get_or_insert(now);
        }
    }

    /// The token was away: what was before is no cycle.
    pub(super) fn restart(&mut self) {
        self.cycle = None;
        self.overrunning = false;
    }

    /// As many whole periods as cover the span.
    fn periods(&self, span: Duration) -> Duration {
        let period = self.period.as_nanos().max(1);
        Duration::from_nanos(span.as_nanos().div_ceil(period).saturating_mul(period))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_nanos(100);

    fn at(nanos: u64) -> Instant {
        Instant::from_nanos(nanos)
    }

    fn run(pace: &mut Pace, started: u64, ended: u64) -> Begun {
        let begun = pace.begin(at(started));
        pace.end(at(ended));
        begun
    }

    #[test]
    fn cycles_in_time_begin_one_period_apart() {
        for overrun in [Overrun::FollowAtOnce, Overrun::KeepPhase] {
            let mut pace = Pace::new(PERIOD, overrun);
            assert_eq!(pace.due(at(7)), at(7));
            assert_eq!(run(&mut pace, 7, 50), Begun::default());
            assert_eq!(pace.due(at(50)), at(107));
            let second = run(&mut pace, 107, 207);
            assert_eq!(
                (second.last_cycle, second.overran, second.missed),
                (Some(PERIOD), None, 0)
            );
            assert_eq!(pace.due(at(207)), at(207), "done at the very moment is in time");
        }
    }

    #[test]
    fn after_an_overrun_the_next_follows_at_once_and_all_are_shifted() {
        let mut pace = Pace::new(PERIOD, Overrun::FollowAtOnce);
        run(&mut pace, 0, 130);
        assert_eq!(pace.due(at(130)), at(100));
        let late = run(&mut pace, 130, 180);
        assert_eq!(late.overran, Some(Duration::from_nanos(130)));
        assert!(late.is_first);
        assert_eq!(late.missed, 0);
        assert_eq!(pace.due(at(180)), at(230));
    }

    #[test]
    fn with_the_phase_kept_the_next_point_of_the_grid_is_waited_for() {
        let mut pace = Pace::new(PERIOD, Overrun::KeepPhase);
        run(&mut pace, 0, 250);
        assert_eq!(pace.due(at(250)), at(300));
        let late = run(&mut pace, 300, 340);
        assert_eq!((late.overran, late.missed), (Some(Duration::from_nanos(250)), 2));
        assert_eq!(pace.due(at(340)), at(400));
    }

    #[test]
    fn a_late_start_shifts_no_grid() {
        let mut pace = Pace::new(PERIOD, Overrun::KeepPhase);
        run(&mut pace, 0, 40);
        // Woken up 30 ns late: no overrun, and the next one is due at 200.
        let second = run(&mut pace, 130, 170);
        assert_eq!((second.overran, second.missed), (None, 0));
        assert_eq!(pace.due(at(170)), at(200));
        // 250 ns late: two points are gone, nothing is made up for.
        let third = run(&mut pace, 450, 470);
        assert_eq!((third.overran, third.missed), (None, 2));
        assert_eq!(pace.due(at(470)), at(500));
    }

    #[test]
    fn only_the_first_overrun_of_a_row_is_marked() {
        let mut pace = Pace::new(PERIOD, Overrun::FollowAtOnce);
        run(&mut pace, 0, 150);
        assert!(run(&mut pace, 150, 300).is_first);
        assert!(!run(&mut pace, 300, 350).is_first);
        assert_eq!(run(&mut pace, 400, 450).overran, None);
        run(&mut pace, 500, 650);
        assert!(run(&mut pace, 650, 700).is_first);
    }

    #[test]
    fn without_a_period_nothing_is_late() {
        let mut pace = Pace::new(Duration::ZERO, Overrun::KeepPhase);
        run(&mut pace, 0, 1_000);
        assert!(pace.due(at(1_000)) <= at(1_000));
        assert_eq!(run(&mut pace, 1_000, 2_000).overran, None);
    }
}
