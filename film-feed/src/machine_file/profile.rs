use super::MachineFile;
use crate::report::FeedMode;

/// A piece of the motion in which the speed changes evenly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// What happens in it.
    pub name: &'static str,
    /// How long it takes, s.
    pub duration_s: f64,
    /// Film speed at its begin, mm/s.
    pub from_mm_s: f64,
    /// Film speed at its end, mm/s.
    pub to_mm_s: f64,
}

impl MachineFile {
    /// One cycle: the motion of a feed, then rest until the next. Pieces that take no time are left out.
    ///
    /// By length a trapezoid, or a triangle if the travel velocity is not reached; to a mark the travel to 100 mm before the feed length,
    /// reached at the mark-reading velocity, then the search for a mark in its mean place (film-feed specification, section 6). A cycle
    /// that is too short for the motion has no rest.
    pub fn profile(&self) -> Vec<Segment> {
        let feed = &self.feed;
        let accel = feed.acceleration_mm_s2;
        let (travel_mm, last) = match feed.mode {
            FeedMode::Length => (feed.length_mm, 0.0),
            FeedMode::Mark => (feed.length_mm - SEARCH_MM, feed.mark_speed_mm_s),
        };
        // Highest speed of a motion without a constant part: v² = a·s + last²/2.
        let peak = (accel * travel_mm + 0.5 * last * last).sqrt().min(feed.speed_mm_s);
        let ramps_mm = (2.0 * peak * peak - last * last) / (2.0 * accel);
        let mut segments = vec![
            ("acceleration", peak / accel, 0.0, peak),
            ("travel", (travel_mm - ramps_mm) / peak, peak, peak),
        ];
        match feed.mode {
            FeedMode::Length => segments.push(("braking", peak / accel, peak, 0.0)),
            FeedMode::Mark => {
                let braking_mm = last * last / (2.0 * accel);
                segments.push(("slowing down", (peak - last) / accel, peak, last));
                segments.push(("search", (SEARCH_MM - braking_mm) / last, last, last));
                segments.push(("braking", last / accel, last, 0.0));
            }
        }
        let motion_s: f64 = segments.iter().map(|(_, duration_s, ..)| duration_s.max(0.0)).sum();
        segments.push(("rest", feed.cycle_s - motion_s, 0.0, 0.0));
        segments
            .into_iter()
            .filter(|(_, duration_s, ..)| *duration_s > 1e-9)
            .map(|(name, duration_s, from_mm_s, to_mm_s)| Segment {
                name,
                duration_s,
                from_mm_s,
                to_mm_s,
            })
            .collect()
    }

    /// How long a feed moves, s: [`profile`](Self::profile) without the rest.
    pub fn motion_s(&self) -> f64 {
        let moving = |segment: &Segment| segment.from_mm_s.max(segment.to_mm_s) > 0.0;
        self.profile()
            .iter()
            .filter(|segment| moving(segment))
            .map(|segment| segment.duration_s)
            .sum()
    }
}

/// The search begins 100 mm before the feed length, and ends 50 mm behind a mark that lies 50 mm before it (film-feed specification,
/// section 6).
const SEARCH_MM: f64 = 100.0;
