//! What waits to be told.

use std::collections::VecDeque;

use super::CanBusEvent;

/// The last events of a port; nobody has to ask for them, so there are no more than [`KEPT`].
#[derive(Debug, Default)]
pub(super) struct Events(VecDeque<CanBusEvent>);

impl Events {
    pub(super) fn push(&mut self, event: CanBusEvent) {
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(event);
    }

    pub(super) fn pop(&mut self) -> Option<CanBusEvent> {
        self.0.pop_front()
    }
}

const KEPT: usize = 16;
