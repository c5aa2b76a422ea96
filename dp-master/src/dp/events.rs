//! A bounded queue of events, in place.

/// First in, first out. When it is full the newest event is dropped and counted, so that the cause of a chain of events
/// survives.
#[derive(Debug, Clone)]
pub(super) struct EventQueue<T, const N: usize> {
    events: [Option<T>; N],
    first: usize,
    len: usize,
    lost: u64,
}

impl<T: Copy, const N: usize> EventQueue<T, N> {
    pub(super) const fn new() -> Self {
        Self {
            events: [None; N],
            first: 0,
            len: 0,
            lost: 0,
        }
    }

    pub(super) fn push(&mut self, event: T) {
        if self.len < N
            && let Some(slot) = self.events.get_mut((self.first + self.len) % N)
        {
            *slot = Some(event);
            self.len += 1;
        } else {
            self.lost += 1;
        }
    }

    pub(super) fn pop(&mut self) -> Option<T> {
        if self.len == 0 {
            return None;
        }
        let event = self.events.get_mut(self.first).and_then(Option::take);
        self.first = (self.first + 1) % N;
        self.len -= 1;
        event
    }

    /// The oldest, left where it is.
    pub(super) fn first(&self) -> Option<T> {
        self.events.get(self.first).copied().flatten()
    }

    pub(super) const fn lost(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_events_survive_and_the_lost_ones_are_counted() {
        let mut queue: EventQueue<u8, 2> = EventQueue::new();
        for event in 1..=4 {
            queue.push(event);
        }
        assert_eq!(queue.lost(), 2);
        assert_eq!(queue.pop(), Some(1));
        queue.push(5);
        assert_eq!(queue.pop(), Some(2));
        assert_eq!(queue.pop(), Some(5));
        assert_eq!(queue.pop(), None);
    }
}
