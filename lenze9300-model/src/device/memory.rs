//! The fault memory: C0168 to C0170.

use super::fault::{Fault, Reaction};

/// An entry of the fault memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultEntry {
    /// The fault.
    pub fault: Fault,
    /// How the drive reacted.
    pub reaction: Reaction,
    /// When it came, or came again: C0179, seconds on mains.
    pub time_s: u32,
    /// How often it came in a row.
    pub count: u16,
}

impl FaultEntry {
    /// LECOM number, as C0168 shows it.
    pub fn lecom_number(&self) -> u16 {
        self.fault.lecom_number(self.reaction)
    }

    fn is_same(&self, other: &Self) -> bool {
        (self.fault, self.reaction) == (other.fault, other.reaction)
    }
}

/// The present fault and the last seven.
///
/// A fault is written to the history once it is gone or acknowledged. Of several at a time the one with the highest
/// reaction is kept, then the earliest. One that comes again right after itself only raises its count and renews its time.
///
/// Source: 9300 facts 4.9 (ER p. 8-2, 8-3).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FaultMemory {
    present: Option<FaultEntry>,
    history: [Option<FaultEntry>; HISTORY],
}

/// Entries besides the present one.
const HISTORY: usize = 7;

impl FaultMemory {
    /// Entries besides the present one.
    pub const HISTORY: usize = HISTORY;

    /// A memory with these past faults, the latest first; those beyond the seventh are forgotten.
    pub fn from_history(entries: impl IntoIterator<Item = FaultEntry>) -> Self {
        let mut memory = Self::default();
        for (place, entry) in memory.history.iter_mut().zip(entries) {
            *place = Some(entry);
        }
        memory
    }

    /// All entries as they would be without a present fault, the latest first.
    pub fn entries(&self) -> impl Iterator<Item = FaultEntry> {
        let mut without = self.clone();
        if let Some(entry) = without.present.take() {
            without.remember(entry);
        }
        without.history.into_iter().flatten()
    }

    /// Follows what is shown now. `still_there` tells whether a fault that is no longer shown only stands behind a higher one.
    pub fn update(&mut self, now_s: u32, shown: Option<(Fault, Reaction)>, still_there: impl Fn(Fault) -> bool) {
        let before = self.present;
        if before.map(|entry| (entry.fault, entry.reaction)) == shown {
            return;
        }
        if let Some(entry) = before
            && !(shown.is_some() && still_there(entry.fault))
        {
            self.remember(entry);
        }
        self.present = shown.map(|(fault, reaction)| FaultEntry {
            fault,
            reaction,
            time_s: now_s,
            count: 1,
        });
    }

    /// Entry 1 is the present fault, 2…8 are the last seven, the latest first; `None` for an empty place.
    pub fn entry(&self, subcode: u8) -> Option<FaultEntry> {
        match subcode {
            0 => None,
            1 => self.present,
            _ => self.history.get(usize::from(subcode) - 2).copied().flatten(),
        }
    }

    /// C0167 = 1: forgets the history; a present fault stays.
    pub fn clear(&mut self) {
        self.history = [None; HISTORY];
    }

    fn remember(&mut self, entry: FaultEntry) {
        match &mut self.history[0] {
            Some(latest) if latest.is_same(&entry) => {
                latest.time_s = entry.time_s;
                latest.count = latest.count.saturating_add(entry.count);
            }
            _ => {
                self.history.rotate_right(1);
                self.history[0] = Some(entry);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIP: Reaction = Reaction::Trip;

    fn gone(_: Fault) -> bool {
        false
    }

    #[test]
    fn a_fault_enters_the_history_when_it_is_gone() {
        let mut memory = FaultMemory::default();
        memory.update(10, Some((Fault::Sd2, TRIP)), gone);
        assert_eq!(
            memory.entry(1).map(|entry| (entry.lecom_number(), entry.time_s)),
            Some((82, 10))
        );
        assert_eq!(memory.entry(2), None);
        memory.update(12, None, gone);
        assert_eq!(memory.entry(1), None);
        assert_eq!(
            memory.entry(2).map(|entry| (entry.lecom_number(), entry.time_s)),
            Some((82, 10))
        );
    }

    #[test]
    fn a_repetition_raises_the_count_and_renews_the_time() {
        let mut memory = FaultMemory::default();
        for start in [10, 20, 30] {
            memory.update(start, Some((Fault::Lu, Reaction::Message)), gone);
            memory.update(start + 1, None, gone);
        }
        let latest = memory.entry(2).unwrap();
        assert_eq!((latest.lecom_number(), latest.time_s, latest.count), (1030, 30, 3));
        assert_eq!(memory.entry(3), None);
        // Something else in between makes it a new entry.
        memory.update(40, Some((Fault::Oc2, TRIP)), gone);
        memory.update(41, None, gone);
        memory.update(42, Some((Fault::Lu, Reaction::Message)), gone);
        memory.update(43, None, gone);
        let numbers: Vec<_> = (2..=4)
            .filter_map(|subcode| memory.entry(subcode))
            .map(|e| (e.lecom_number(), e.count))
            .collect();
        assert_eq!(numbers, [(1030, 1), (12, 1), (1030, 3)]);
    }

    #[test]
    fn of_several_at_a_time_only_the_highest_is_kept() {
        let mut memory = FaultMemory::default();
        memory.update(1, Some((Fault::Oh4, Reaction::Warning)), gone);
        memory.update(2, Some((Fault::Sd2, TRIP)), |fault| fault == Fault::Oh4);
        memory.update(3, None, gone);
        assert_eq!(memory.entry(2).map(|entry| entry.fault), Some(Fault::Sd2));
        assert_eq!(memory.entry(3), None);
    }

    #[test]
    fn seven_are_kept_and_clearing_leaves_the_present_one() {
        let mut memory = FaultMemory::default();
        for (time, fault) in Fault::ALL.into_iter().take(9).enumerate() {
            memory.update(time as u32, Some((fault, TRIP)), gone);
        }
        assert_eq!(memory.entry(1).map(|entry| entry.fault), Some(Fault::ALL[8]));
        assert_eq!(memory.entry(8).map(|entry| entry.fault), Some(Fault::ALL[1]));
        assert_eq!(memory.entry(9), None);
        memory.clear();
        assert_eq!(memory.entry(1).map(|entry| entry.fault), Some(Fault::ALL[8]));
        assert!((2..=8).all(|subcode| memory.entry(subcode).is_none()));
    }
}
