//! The oscilloscope of a drive: channels, trigger with pre-trigger, memory.
//!
//! ```text
//!            first samples         trigger           memory full
//!  Filling ───────────────► Armed ─────────► Running ───────────► Done
//!     └── without a trigger ───────────────────┘
//! ```
//!
//! Global Drive Control's oscilloscope is known by one picture only (thesis fig. 73: two channels over 1.5 s). Assumed: four
//! channels of 2048 samples at multiples of 1 ms, trigger level with edge, position of the trigger in percent (9300 facts 4.11).

use std::collections::VecDeque;

use thiserror::Error;

use crate::device::Drive;
use crate::signal::Signal;
use crate::table::{Column, Table};

/// What an oscilloscope is to record.
#[derive(Debug, Clone, PartialEq)]
pub struct ScopeConfig {
    /// Signals, at least one.
    pub channels: Vec<Signal>,
    /// Milliseconds from one sample to the next, 1 or more.
    pub interval_ms: u32,
    /// Samples a channel keeps.
    pub depth: Depth,
    /// What starts the recording; `None`: at once.
    pub trigger: Option<Trigger>,
    /// Share of the memory that shows what was before the trigger, 0…100 %.
    pub pre_trigger_percent: u8,
}

/// Samples a channel keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// So many, 1 or more; then the recording is done.
    Samples(usize),
    /// All of them, until it is stopped. Before the trigger the newest [`Depth::ORIGINAL`] are kept for the pre-trigger.
    Unlimited,
}

impl Depth {
    /// The memory of the original. Assumed.
    pub const ORIGINAL: usize = 2048;
}

/// What starts a recording: a signal that passes a level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trigger {
    /// The signal; it need not be a channel.
    pub signal: Signal,
    /// Level in the unit of the signal.
    pub level: f64,
    /// In which direction.
    pub edge: Edge,
}

/// Direction of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// From below the level to it or above.
    Rising,
    /// From above the level to it or below.
    Falling,
}

impl ScopeConfig {
    /// These channels once a millisecond into the memory of the original, at once.
    pub fn original(channels: impl IntoIterator<Item = Signal>) -> Self {
        Self {
            channels: channels.into_iter().collect(),
            interval_ms: 1,
            depth: Depth::Samples(Depth::ORIGINAL),
            trigger: None,
            pre_trigger_percent: 10,
        }
    }
}

/// Why an oscilloscope cannot record that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ScopeError {
    /// Nothing to record.
    #[error("channels: expected at least one")]
    NoChannel,
    /// The drive has values once a millisecond.
    #[error("sampling interval: expected 1 ms or more, got 0")]
    NoInterval,
    /// No memory.
    #[error("memory depth: expected 1 sample or more, got 0")]
    NoMemory,
    /// More than the whole memory before the trigger.
    #[error("pre-trigger: expected 0 to 100 %, got {got}")]
    PreTrigger {
        /// Percent given.
        got: u8,
    },
}

/// Where a recording stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScopeState {
    /// Collects what is to be shown before the trigger; a trigger is not taken yet.
    Filling,
    /// Waits for the trigger.
    Armed,
    /// Records.
    Running,
    /// The memory is full, or it was stopped.
    Done,
}

/// An oscilloscope on one drive. Call [`sample`](Self::sample) once a millisecond, after its last tick.
///
/// # Example
///
/// ```
/// use lenze9300_model::device::{Drive, DriveConfig};
/// use lenze9300_model::scope::{Scope, ScopeConfig, ScopeState};
/// use lenze9300_model::signal::Signal;
///
/// let mut drive = Drive::new(DriveConfig::default());
/// let mut scope = Scope::new(ScopeConfig::original([Signal::PosNout, Signal::MctrlNact]))?;
/// while scope.state() != ScopeState::Done {
///     for _ in 0..lenze9300_model::TICKS_PER_MS {
///         drive.tick();
///     }
///     scope.sample(&drive);
/// }
/// assert_eq!(scope.recording().rows().count(), 2048);
/// # Ok::<(), lenze9300_model::scope::ScopeError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Scope {
    config: ScopeConfig,
    state: ScopeState,
    /// Values row by row, a row a sample.
    values: VecDeque<f64>,
    /// Rows before the trigger.
    before: usize,
    /// The signal of the trigger one sample ago.
    level: Option<f64>,
    ms: u64,
}

impl Scope {
    /// An oscilloscope that waits for its first sample.
    ///
    /// # Errors
    ///
    /// [`ScopeError`].
    pub fn new(config: ScopeConfig) -> Result<Self, ScopeError> {
        if config.channels.is_empty() {
            return Err(ScopeError::NoChannel);
        }
        if config.interval_ms == 0 {
            return Err(ScopeError::NoInterval);
        }
        if config.depth == Depth::Samples(0) {
            return Err(ScopeError::NoMemory);
        }
        if config.pre_trigger_percent > 100 {
            return Err(ScopeError::PreTrigger {
                got: config.pre_trigger_percent,
            });
        }
        let mut scope = Self {
            state: ScopeState::Filling,
            values: VecDeque::new(),
            before: 0,
            level: None,
            ms: 0,
            config,
        };
        scope.settle();
        Ok(scope)
    }

    /// What it was told to record.
    pub fn config(&self) -> &ScopeConfig {
        &self.config
    }

    /// Where the recording stands.
    pub fn state(&self) -> ScopeState {
        self.state
    }

    /// A millisecond of the drive has passed.
    pub fn sample(&mut self, drive: &Drive) {
        if self.state == ScopeState::Done {
            return;
        }
        let now = self.ms;
        self.ms += 1;
        // The trigger is looked at in every millisecond, so that none is lost between two samples.
        if let Some(trigger) = self.config.trigger {
            let level = trigger.signal.read(drive);
            let before = self.level.replace(level);
            if self.state == ScopeState::Armed && before.is_some_and(|before| trigger.is_passed(before, level)) {
                self.start();
            }
        }
        if !now.is_multiple_of(u64::from(self.config.interval_ms)) {
            return;
        }
        self.values
            .extend(self.config.channels.iter().map(|signal| signal.read(drive)));
        if self.state == ScopeState::Armed && self.rows() > self.pre_trigger() {
            self.values.drain(..self.config.channels.len());
        }
        self.settle();
    }

    /// Ends the recording with what there is.
    pub fn stop(&mut self) {
        self.state = ScopeState::Done;
    }

    /// What has been recorded so far.
    pub fn recording(&self) -> Recording<'_> {
        Recording { scope: self }
    }

    fn start(&mut self) {
        self.state = ScopeState::Running;
        self.before = self.rows();
    }

    fn rows(&self) -> usize {
        self.values.len() / self.config.channels.len()
    }

    fn depth(&self) -> usize {
        match self.config.depth {
            Depth::Samples(depth) => depth,
            Depth::Unlimited => usize::MAX,
        }
    }

    fn pre_trigger(&self) -> usize {
        let memory = match self.config.depth {
            Depth::Samples(depth) => depth,
            Depth::Unlimited => Depth::ORIGINAL,
        };
        memory * usize::from(self.config.pre_trigger_percent) / 100
    }

    /// Moves on as far as the number of samples allows.
    fn settle(&mut self) {
        if self.state == ScopeState::Filling {
            if self.config.trigger.is_none() {
                self.state = ScopeState::Running;
            } else if self.rows() >= self.pre_trigger() {
                self.state = ScopeState::Armed;
            }
        }
        if self.state == ScopeState::Running && self.rows() >= self.depth() {
            self.state = ScopeState::Done;
        }
    }
}

impl Trigger {
    fn is_passed(&self, before: f64, now: f64) -> bool {
        match self.edge {
            Edge::Rising => before < self.level && now >= self.level,
            Edge::Falling => before > self.level && now <= self.level,
        }
    }
}

/// What an oscilloscope has recorded.
#[derive(Debug, Clone, Copy)]
pub struct Recording<'a> {
    scope: &'a Scope,
}

impl<'a> Recording<'a> {
    /// The channels, in the order of the values of a row.
    pub fn channels(&self) -> &'a [Signal] {
        &self.scope.config.channels
    }

    /// Rows from the oldest: time in seconds, 0 at the first sample from the trigger on, and a value for each channel.
    pub fn rows(&self) -> impl Iterator<Item = (f64, Vec<f64>)> + 'a {
        let scope = self.scope;
        let width = scope.config.channels.len();
        let interval_ms = i64::from(scope.config.interval_ms);
        (0..scope.rows()).map(move |row| {
            let values = scope.values.range(row * width..(row + 1) * width).copied().collect();
            let ms = (row as i64 - scope.before as i64) * interval_ms;
            (ms as f64 / 1000.0, values)
        })
    }

    /// The recording as columns, the time first.
    pub fn table(&self) -> Table {
        let named = |signal: &Signal| Column::new(signal.name(), signal.unit());
        let time = Column::new("time_s", "");
        let mut table = Table::new(std::iter::once(time).chain(self.channels().iter().map(named)));
        for (time_s, values) in self.rows() {
            let mut row = vec![time_s];
            row.extend(values);
            table.push(&row);
        }
        table
    }
}
