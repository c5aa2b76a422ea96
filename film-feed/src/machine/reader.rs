//! The print-mark reader: how long after an edge of the mark its output switches.

use std::collections::VecDeque;

use lenze9300_model::noise;

/// Delay of the reader from mark to output.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[doc(alias = "Druckmarkenleser")]
pub struct ReaderParams {
    /// Mean delay, µs, 0 or more.
    pub delay_us: f64,
    /// Half width of its scatter, evenly distributed, µs, 0 or more. A delay below 0 counts as 0.
    pub jitter_us: f64,
    /// Seed of the scatter.
    pub seed: u64,
    /// How often the output falls back and comes again after each edge: 0 for a clean one.
    pub bounces: u32,
    /// Time from one edge of the bouncing to the next, µs, 0 or more.
    pub bounce_us: f64,
}

/// Edges on their way from the mark to the reader's output.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReaderDelay {
    params: ReaderParams,
    /// When the output switches, ns, and to which level; in the order of time.
    under_way: VecDeque<(f64, bool)>,
    edges: u64,
}

/// Channel of the counter-based noise that belongs to the reader.
const READER_CHANNEL: u64 = 0x7265_6164;

impl ReaderDelay {
    pub(crate) fn new(params: ReaderParams) -> Self {
        Self {
            params,
            ..Self::default()
        }
    }

    /// An edge of the mark passed at `at_ns`. The output switches no sooner than for the edge before.
    pub(crate) fn push(&mut self, at_ns: f64, level: bool) {
        let jitter_us = self.params.jitter_us * noise::symmetric(self.params.seed, READER_CHANNEL, self.edges);
        self.edges += 1;
        let due_ns = at_ns + 1000.0 * (self.params.delay_us + jitter_us).max(0.0);
        let due_ns = self.under_way.back().map_or(due_ns, |(last, _)| due_ns.max(*last));
        self.under_way.push_back((due_ns, level));
        for k in 0..2 * self.params.bounces {
            let bounce_ns = due_ns + 1000.0 * self.params.bounce_us.max(0.0) * f64::from(k + 1);
            self.under_way.push_back((bounce_ns, level ^ (k % 2 == 0)));
        }
    }

    /// The next edge of the output up to `now_ns`.
    pub(crate) fn pop(&mut self, now_ns: f64) -> Option<(f64, bool)> {
        let due = self.under_way.front().is_some_and(|(at_ns, _)| *at_ns <= now_ns);
        if due { self.under_way.pop_front() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_comes_out_after_the_delay_within_its_scatter() {
        let params = ReaderParams {
            delay_us: 200.0,
            jitter_us: 50.0,
            seed: 7,
            ..ReaderParams::default()
        };
        let mut reader = ReaderDelay::new(params);
        let mut spread: Vec<f64> = Vec::new();
        for k in 0..1000 {
            let at_ns = f64::from(k) * 1e6;
            reader.push(at_ns, k % 2 == 0);
            assert_eq!(reader.pop(at_ns + 149_999.0), None);
            let (due_ns, level) = reader.pop(at_ns + 250_000.0).unwrap();
            assert_eq!(level, k % 2 == 0);
            spread.push((due_ns - at_ns) / 1000.0);
        }
        spread.sort_by(f64::total_cmp);
        assert!(spread[0] >= 150.0 && spread[999] <= 250.0 && spread[999] - spread[0] > 98.0);
    }

    #[test]
    fn a_bouncing_edge_falls_back_and_comes_again() {
        let mut reader = ReaderDelay::new(ReaderParams {
            delay_us: 100.0,
            bounces: 2,
            bounce_us: 10.0,
            ..ReaderParams::default()
        });
        reader.push(0.0, true);
        let edges: Vec<(f64, bool)> = std::iter::from_fn(|| reader.pop(1e9)).collect();
        let expected = [
            (100e3, true),
            (110e3, false),
            (120e3, true),
            (130e3, false),
            (140e3, true),
        ];
        assert_eq!(edges, expected);
    }

    #[test]
    fn a_late_edge_never_overtakes_the_one_before() {
        let mut reader = ReaderDelay::new(ReaderParams {
            jitter_us: 1000.0,
            ..ReaderParams::default()
        });
        for k in 0..100 {
            reader.push(f64::from(k) * 1000.0, k % 2 == 0);
        }
        let mut last = (0.0, false);
        while let Some(edge) = reader.pop(1e9) {
            assert!(edge.0 >= last.0 && edge.1 != last.1, "{last:?} {edge:?}");
            last = edge;
        }
    }
}
