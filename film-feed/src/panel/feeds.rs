use lenze9300_model::traverse::TraverseEvent;

use super::protocol::FeedView;
use crate::machine::RESIDUAL_PATH_MM;

/// Judges feeds as they end, whoever starts them.
#[derive(Debug, Clone, Default)]
pub(super) struct FeedJudge {
    number: u32,
    under_way: Option<UnderWay>,
    ended: Vec<FeedView>,
    /// Positions count from the start of a feed, as POS_ACT does.
    counts_from_start: bool,
}

#[derive(Debug, Clone, Copy)]
struct UnderWay {
    start_mm: f64,
    commanded_mm: Option<f64>,
    is_mark: bool,
    begun_s: f64,
    /// When JOB_FIN came.
    finished_s: Option<f64>,
    /// When RUNNING went.
    over_s: Option<f64>,
}

/// How long the film is left to settle before it is measured, s.
const SETTLE_S: f64 = 0.15;

impl FeedJudge {
    /// A judge of positions that count from the start of each feed.
    pub(super) fn counting_from_start() -> Self {
        Self {
            counts_from_start: true,
            ..Self::default()
        }
    }

    /// Once a millisecond. `distance_mm` is what a feed by length shall move.
    pub(super) fn millisecond(
        &mut self,
        time_s: f64,
        film_mm: f64,
        running: bool,
        finished: bool,
        request: (bool, f64),
    ) {
        let (is_mark, distance_mm) = request;
        match &mut self.under_way {
            None if running => {
                self.under_way = Some(UnderWay {
                    start_mm: if self.counts_from_start { 0.0 } else { film_mm },
                    commanded_mm: (!is_mark).then_some(distance_mm),
                    is_mark,
                    begun_s: time_s,
                    finished_s: None,
                    over_s: None,
                });
            }
            None => {}
            Some(feed) => {
                if finished && feed.finished_s.is_none() {
                    feed.finished_s = Some(time_s);
                }
                if running {
                    feed.over_s = None;
                } else if feed.over_s.is_none() {
                    feed.over_s = Some(time_s);
                }
                if feed.over_s.is_some_and(|over_s| time_s - over_s >= SETTLE_S) {
                    let feed = *feed;
                    self.under_way = None;
                    self.end(&feed, film_mm, time_s);
                }
            }
        }
    }

    /// A feed to the mark learns its target.
    pub(super) fn event(&mut self, event: &TraverseEvent, last_mark_mm: f64) {
        if let (Some(feed), TraverseEvent::MarkLatched { .. }) = (&mut self.under_way, event)
            && feed.is_mark
        {
            feed.commanded_mm = Some(last_mark_mm + RESIDUAL_PATH_MM - feed.start_mm);
        }
    }

    /// Feeds that ended since the last call.
    pub(super) fn take(&mut self) -> Vec<FeedView> {
        std::mem::take(&mut self.ended)
    }

    fn end(&mut self, feed: &UnderWay, film_mm: f64, time_s: f64) {
        self.number += 1;
        let moved_mm = film_mm - feed.start_mm;
        self.ended.push(FeedView {
            n: self.number,
            mode: if feed.is_mark { "mark" } else { "length" },
            commanded_mm: feed.commanded_mm,
            error_um: feed.commanded_mm.map(|commanded| 1000.0 * (moved_mm - commanded)),
            seconds: feed.finished_s.unwrap_or(time_s) - feed.begun_s,
            finished: feed.finished_s.is_some(),
        });
    }
}
