//! The machine's operator: does on the block's inputs what the thesis' variable table did by hand (thesis ch. 9).
//!
//! He sees nothing but the block's outputs, so the same operator works the simulated machine and a real one.

use crate::block::{Inputs, Outputs};
use crate::report::FeedMode;

/// The feeds to run and the values to run them with, in the block's own units.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FeedPlan {
    /// Series in their order, each with the number of its feeds.
    pub series: Vec<(FeedMode, usize)>,
    /// Feed length, 0.1 mm.
    #[doc(alias = "Strecke")]
    pub length_tenth_mm: i16,
    /// Travel velocity, 0.01 % of C1240.
    #[doc(alias = "Geschw")]
    pub speed_hundredth_percent: i16,
    /// Mark-reading velocity, 0.01 % of C1240.
    #[doc(alias = "Geschw_DM")]
    pub mark_speed_hundredth_percent: i16,
    /// Acceleration and deceleration, 0.01 % of C1250.
    #[doc(alias = "Beschl_Verz")]
    pub accel_hundredth_percent: i16,
    /// Pause between JOB_FIN and the next start, ns. The film comes to rest in it.
    pub pause_ns: u64,
    /// Longest wait for DRIVE_RDY and for the parameters, ns.
    pub start_up_limit_ns: u64,
    /// Longest wait for JOB_FIN after POS_START, ns.
    pub feed_limit_ns: u64,
}

/// The thesis' test: one series of each kind, ten feeds of 1200.0 mm at full speed and acceleration (thesis ch. 9).
impl Default for FeedPlan {
    fn default() -> Self {
        FeedPlan {
            series: vec![(FeedMode::Length, 10), (FeedMode::Mark, 10)],
            length_tenth_mm: 12_000,
            speed_hundredth_percent: 10_000,
            mark_speed_hundredth_percent: 2_000,
            accel_hundredth_percent: 10_000,
            pause_ns: 300_000_000,
            start_up_limit_ns: 60_000_000_000,
            feed_limit_ns: 120_000_000_000,
        }
    }
}

/// What the operator tells.
#[derive(Debug, Clone, PartialEq)]
pub enum OperatorEvent {
    /// The drive is ready and has the parameters of this series; the first feed follows after the pause.
    SeriesReady(FeedMode),
    /// POS_START was raised in this cycle.
    FeedStarted(FeedMode),
    /// The pause after JOB_FIN is over: the feed can be judged.
    FeedOver {
        /// How it found its end.
        mode: FeedMode,
        /// POS_START to JOB_FIN, ns; none when JOB_FIN did not come in time.
        job_ns: Option<u64>,
    },
    /// All feeds are done.
    Finished,
    /// It cannot go on; why, in one sentence.
    Aborted(String),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// Waiting for DRIVE_RDY and a whole round of parameters since `rounds`.
    Preparing {
        since: u64,
        rounds: Option<u64>,
    },
    Pausing {
        until: u64,
        job: Option<Job>,
    },
    /// POS_START is up, RUNNING was not seen yet.
    Starting {
        since: u64,
    },
    Running {
        since: u64,
    },
    Done,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Job {
    job_ns: Option<u64>,
}

/// Works through a [`FeedPlan`], one call a PLC cycle, before the block.
#[derive(Debug, Clone)]
pub struct Operator {
    plan: FeedPlan,
    series: usize,
    feeds_done: usize,
    stage: Stage,
}

/// Rounds of the seven telegrams after which every parameter written before has reached the drive: the round under
/// way may have passed the changed telegram already, the next one carries it.
const ROUNDS_UNTIL_DELIVERED: u64 = 2;

impl Operator {
    /// An operator at the start of `plan`, at time `now_ns`.
    pub fn new(plan: FeedPlan, now_ns: u64) -> Self {
        Operator {
            plan,
            series: 0,
            feeds_done: 0,
            stage: Stage::Preparing {
                since: now_ns,
                rounds: None,
            },
        }
    }

    /// One PLC cycle: sees `outputs` of the last block call, sets `inputs` for the next.
    ///
    /// `rounds` is the number of complete rounds of the parameter telegrams so far.
    pub fn scan(&mut self, now_ns: u64, outputs: &Outputs, rounds: u64, inputs: &mut Inputs) -> Option<OperatorEvent> {
        let Some(&(mode, feeds)) = self.plan.series.get(self.series) else {
            return self.finish();
        };
        match self.stage {
            Stage::Preparing { since, rounds: None } => {
                self.write_values(mode, inputs);
                self.stage = Stage::Preparing {
                    since,
                    rounds: Some(rounds),
                };
                None
            }
            Stage::Preparing {
                since,
                rounds: Some(first),
            } => {
                if outputs.drive_ready && !outputs.error && rounds >= first + ROUNDS_UNTIL_DELIVERED {
                    self.stage = Stage::Pausing {
                        until: now_ns + self.plan.pause_ns,
                        job: None,
                    };
                    return Some(OperatorEvent::SeriesReady(mode));
                }
                if now_ns.saturating_sub(since) > self.plan.start_up_limit_ns {
                    return self.abort(not_ready(outputs, rounds - first));
                }
                None
            }
            Stage::Pausing { until, job: Some(job) } if now_ns >= until => {
                self.feeds_done += 1;
                self.stage = Stage::Pausing { until, job: None };
                let over = OperatorEvent::FeedOver {
                    mode,
                    job_ns: job.job_ns,
                };
                if job.job_ns.is_none() {
                    // The machine is in an unknown state: another start would only bury the first failure.
                    self.series = self.plan.series.len();
                } else if self.feeds_done == feeds {
                    self.series += 1;
                    self.feeds_done = 0;
                    self.stage = Stage::Preparing {
                        since: now_ns,
                        rounds: None,
                    };
                }
                Some(over)
            }
            Stage::Pausing { until, job: None } if now_ns >= until => {
                if !outputs.drive_ready || outputs.error {
                    return self.abort(not_ready(outputs, ROUNDS_UNTIL_DELIVERED));
                }
                inputs.pos_start = true;
                self.stage = Stage::Starting { since: now_ns };
                Some(OperatorEvent::FeedStarted(mode))
            }
            Stage::Pausing { .. } => None,
            Stage::Starting { since } => {
                if outputs.running {
                    inputs.pos_start = false;
                    self.stage = Stage::Running { since };
                }
                self.give_up_after(since, now_ns, inputs)
            }
            Stage::Running { since } => {
                if !outputs.running && outputs.job_finished {
                    let job = Some(Job {
                        job_ns: Some(now_ns - since),
                    });
                    self.stage = Stage::Pausing {
                        until: now_ns + self.plan.pause_ns,
                        job,
                    };
                    return None;
                }
                self.give_up_after(since, now_ns, inputs)
            }
            Stage::Done => None,
        }
    }

    fn write_values(&self, mode: FeedMode, inputs: &mut Inputs) {
        inputs.enable = true;
        inputs.read_mark = mode == FeedMode::Mark;
        inputs.velocity = self.plan.speed_hundredth_percent;
        inputs.mark_velocity = self.plan.mark_speed_hundredth_percent;
        inputs.acceleration = self.plan.accel_hundredth_percent;
        inputs.distance = self.plan.length_tenth_mm;
    }

    /// A feed that does not end in time is given up, and the run with it.
    fn give_up_after(&mut self, since: u64, now_ns: u64, inputs: &mut Inputs) -> Option<OperatorEvent> {
        if now_ns.saturating_sub(since) <= self.plan.feed_limit_ns {
            return None;
        }
        inputs.pos_start = false;
        self.stage = Stage::Pausing {
            until: now_ns,
            job: Some(Job { job_ns: None }),
        };
        None
    }

    fn finish(&mut self) -> Option<OperatorEvent> {
        if self.stage == Stage::Done {
            return None;
        }
        self.stage = Stage::Done;
        Some(OperatorEvent::Finished)
    }

    fn abort(&mut self, reason: String) -> Option<OperatorEvent> {
        self.stage = Stage::Done;
        Some(OperatorEvent::Aborted(reason))
    }
}

fn not_ready(outputs: &Outputs, rounds: u64) -> String {
    if outputs.error {
        "the drive reports an error (fault, message, warning or fail-QSP in its status word)".to_string()
    } else if !outputs.drive_ready {
        "the drive did not become ready (DRIVE_RDY stayed low); check the bus, terminal 28 and the mains".to_string()
    } else {
        format!(
            "the parameters did not reach the drive ({rounds} of {ROUNDS_UNTIL_DELIVERED} rounds of the parameter telegrams done)"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn plan(series: &[(FeedMode, usize)]) -> FeedPlan {
        FeedPlan {
            series: series.to_vec(),
            pause_ns: 10 * MS,
            start_up_limit_ns: 100 * MS,
            feed_limit_ns: 50 * MS,
            ..FeedPlan::default()
        }
    }

    fn ready() -> Outputs {
        Outputs {
            switched_on: true,
            drive_ready: true,
            ..Outputs::default()
        }
    }

    /// Scans once a millisecond from `from_ms` on until something is told.
    fn until_told(
        operator: &mut Operator,
        from_ms: u64,
        outputs: &Outputs,
        inputs: &mut Inputs,
    ) -> (u64, OperatorEvent) {
        (from_ms..from_ms + 1000)
            .find_map(|ms| Some((ms, operator.scan(ms * MS, outputs, ms, inputs)?)))
            .expect("the operator never says anything")
    }

    #[test]
    fn nothing_starts_before_the_parameters_went_round_twice_and_the_pause_is_over() {
        let (mut operator, mut inputs) = (Operator::new(plan(&[(FeedMode::Length, 1)]), 0), Inputs::default());
        let (at, told) = until_told(&mut operator, 0, &ready(), &mut inputs);
        // One round a millisecond here: written at 0, delivered at 2.
        assert_eq!((at, told), (2, OperatorEvent::SeriesReady(FeedMode::Length)));
        assert!(inputs.enable && !inputs.pos_start && inputs.distance == 12_000);
        let (at, told) = until_told(&mut operator, 3, &ready(), &mut inputs);
        assert_eq!((at, told), (12, OperatorEvent::FeedStarted(FeedMode::Length)));
        assert!(inputs.pos_start);
    }

    #[test]
    fn start_is_taken_back_when_running_is_seen_and_the_job_ends_with_job_finished() {
        let (mut operator, mut inputs) = (Operator::new(plan(&[(FeedMode::Mark, 1)]), 0), Inputs::default());
        until_told(&mut operator, 0, &ready(), &mut inputs);
        let (start, _) = until_told(&mut operator, 3, &ready(), &mut inputs);
        assert!(inputs.read_mark);
        // JOB_FIN of the feed before does not end this one.
        let before = Outputs {
            job_finished: true,
            ..ready()
        };
        assert_eq!(operator.scan((start + 1) * MS, &before, 99, &mut inputs), None);
        assert!(inputs.pos_start);
        let running = Outputs {
            running: true,
            ..ready()
        };
        assert_eq!(operator.scan((start + 2) * MS, &running, 99, &mut inputs), None);
        assert!(!inputs.pos_start);
        let (at, told) = until_told(&mut operator, start + 20, &before, &mut inputs);
        assert_eq!(
            told,
            OperatorEvent::FeedOver {
                mode: FeedMode::Mark,
                job_ns: Some(20 * MS)
            }
        );
        assert_eq!(at, start + 30, "the pause comes first");
        assert_eq!(
            until_told(&mut operator, at, &before, &mut inputs).1,
            OperatorEvent::Finished
        );
    }

    #[test]
    fn a_feed_that_never_ends_is_given_up_and_no_other_is_started() {
        let (mut operator, mut inputs) = (Operator::new(plan(&[(FeedMode::Length, 5)]), 0), Inputs::default());
        until_told(&mut operator, 0, &ready(), &mut inputs);
        let (start, _) = until_told(&mut operator, 3, &ready(), &mut inputs);
        let (at, told) = until_told(&mut operator, start + 1, &ready(), &mut inputs);
        assert_eq!(
            told,
            OperatorEvent::FeedOver {
                mode: FeedMode::Length,
                job_ns: None
            }
        );
        assert!(!inputs.pos_start);
        assert_eq!(
            until_told(&mut operator, at, &ready(), &mut inputs).1,
            OperatorEvent::Finished
        );
    }

    #[test]
    fn a_drive_that_stays_away_or_reports_an_error_ends_the_run_with_a_reason() {
        let error = Outputs { error: true, ..ready() };
        for (outputs, reason) in [
            (Outputs::default(), "did not become ready"),
            (error, "reports an error"),
        ] {
            let (mut operator, mut inputs) = (Operator::new(plan(&[(FeedMode::Length, 1)]), 0), Inputs::default());
            let (at, told) = until_told(&mut operator, 0, &outputs, &mut inputs);
            assert!(
                matches!(&told, OperatorEvent::Aborted(why) if why.contains(reason)),
                "{told:?}"
            );
            assert_eq!(at, 101);
            assert!(!inputs.pos_start);
        }
    }
}
