//! The touch probe: a digital input that latches the position.

/// How exactly the input latches.
///
/// The original is unknown: E1 is a slow input in a sibling drive (1 ms), E4 and E5 are fast. Source: 9300 facts 4.3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LatchMode {
    /// The position at the exact moment of the edge.
    #[default]
    Fast,
    /// The position at the first 1 ms sample that sees the new level: late by up to 1 ms · v, 0.24 mm at 240 mm/s.
    Sampled1ms,
}

/// The edge that counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ActiveEdge {
    /// Low to high, as in the film feed.
    #[default]
    Rising,
    /// High to low.
    Falling,
}

/// A latched position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TouchEvent {
    /// Actual position at the edge in inc, counted from the reference that holds when the event is handed over.
    pub position: i64,
}

/// The latch behind one input.
///
/// Per millisecond: [`handle_edge`](Self::handle_edge) for each edge the plant located since the last tick, then
/// [`tick_1ms`](Self::tick_1ms) once. What it returns goes to [`Traverse::tick_1ms`](super::Traverse::tick_1ms), which
/// knows whether the probe is armed. Two edges within one tick count as one: the first.
#[derive(Clone, Copy, Debug)]
pub struct TouchProbe {
    mode: LatchMode,
    edge: ActiveEdge,
    latched: Option<i64>,
    last_level: Option<bool>,
}

impl TouchProbe {
    /// A probe that has seen no level yet: the first sample is no edge.
    pub const fn new(mode: LatchMode, edge: ActiveEdge) -> Self {
        Self {
            mode,
            edge,
            latched: None,
            last_level: None,
        }
    }

    /// An edge at an exactly located position (inc). Ignored when sampling.
    pub fn handle_edge(&mut self, edge: ActiveEdge, position: i64) {
        if self.mode == LatchMode::Fast && edge == self.edge && self.latched.is_none() {
            self.latched = Some(position);
        }
    }

    /// The 1 ms task with the level of the input and the actual position (inc) now.
    pub fn tick_1ms(&mut self, level: bool, position: i64) -> Option<TouchEvent> {
        let before = self.last_level.replace(level);
        let seen = match self.edge {
            ActiveEdge::Rising => level && before == Some(false),
            ActiveEdge::Falling => !level && before == Some(true),
        };
        let latched = self.latched.take();
        match self.mode {
            LatchMode::Fast => latched,
            LatchMode::Sampled1ms => seen.then_some(position),
        }
        .map(|position| TouchEvent { position })
    }
}
