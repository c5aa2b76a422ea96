//! Chosen signals of the drive during a run, as columns.

use lenze9300_model::signal::Signal;
use lenze9300_model::table::{Column, Table};

use crate::rig::{TickObserver, TickView};

/// Records signals of the drive by name, once in so many milliseconds.
#[derive(Debug, Clone)]
pub struct SignalTrace {
    signals: Vec<Signal>,
    interval_ms: u64,
    milliseconds: u64,
    table: Table,
}

impl SignalTrace {
    /// A trace of these signals; an interval of 0 counts as 1.
    pub fn new(signals: impl IntoIterator<Item = Signal>, interval_ms: u32) -> Self {
        let signals: Vec<Signal> = signals.into_iter().collect();
        let named = |signal: &Signal| Column::new(signal.name(), signal.unit());
        let columns = std::iter::once(Column::new("time_s", "")).chain(signals.iter().map(named));
        SignalTrace {
            table: Table::new(columns),
            signals,
            interval_ms: u64::from(interval_ms.max(1)),
            milliseconds: 0,
        }
    }

    /// What was recorded: the time, then a column for each signal.
    pub fn table(&self) -> &Table {
        &self.table
    }
}

impl TickObserver for SignalTrace {
    fn tick(&mut self, view: &mut TickView<'_>) {
        if !view.ends_millisecond {
            return;
        }
        self.milliseconds += 1;
        if !self.milliseconds.is_multiple_of(self.interval_ms) {
            return;
        }
        let mut row = vec![view.now_ns as f64 / 1e9];
        row.extend(self.signals.iter().map(|signal| signal.read(view.drive)));
        self.table.push(&row);
    }
}
