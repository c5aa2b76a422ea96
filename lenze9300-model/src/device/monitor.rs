//! Monitoring: which fault is present, what the drive does about it, and how it is reset.

use super::fault::{Fault, Reaction};

/// A set of faults, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultSet(u16);

impl FaultSet {
    /// Adds `fault` when `present`.
    #[must_use]
    pub fn with(self, fault: Fault, present: bool) -> Self {
        FaultSet(self.0 | (u16::from(present) << fault as u16))
    }

    /// Whether `fault` is in the set.
    pub fn contains(self, fault: Fault) -> bool {
        self.0 & (1 << fault as u16) != 0
    }

    /// Takes `fault` out.
    #[must_use]
    pub fn without(self, fault: Fault) -> Self {
        FaultSet(self.0 & !(1 << fault as u16))
    }

    fn iter(self) -> impl Iterator<Item = Fault> {
        Fault::ALL.into_iter().filter(move |fault| self.contains(*fault))
    }
}

/// The drive's monitoring: causes in, reactions out. Called once a millisecond.
#[derive(Debug, Clone, Default)]
pub struct Monitor {
    /// The TRIP that is stored until it is reset.
    trip: Option<Fault>,
    causes: FaultSet,
    /// For how long a message has been present without a break, ms.
    message_ms: u32,
    restart_lock: bool,
}

/// A message that lasts longer loses the reference, and C0142 decides whether the drive restarts by itself
/// (9300 fact sheet, section 2.5).
const LONG_MESSAGE_MS: u32 = 500;

/// Whether the drive enables itself again after a long message (C0142).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restart {
    /// C0142 = 0: it stays inhibited until the enable is taken away and given again.
    Locked,
    /// C0142 = 1, as delivered.
    Automatic,
}

impl Monitor {
    /// One millisecond with these `causes` present.
    pub fn update(&mut self, causes: FaultSet, restart: Restart) {
        self.causes = causes;
        for fault in causes.iter().filter(|fault| fault.reaction() == Reaction::Trip) {
            self.trip(fault);
        }
        if self.message().is_some() {
            self.message_ms = self.message_ms.saturating_add(1);
        } else {
            if self.message_ms > LONG_MESSAGE_MS && restart == Restart::Locked {
                self.restart_lock = true;
            }
            self.message_ms = 0;
        }
    }

    /// The only way into TRIP. The first one stays: the later are its consequences.
    pub fn trip(&mut self, cause: Fault) {
        self.trip.get_or_insert(cause);
    }

    /// Resets the TRIP; refused while its cause is there.
    pub fn reset_trip(&mut self) {
        if !self.trip_cause_present() {
            self.trip = None;
        }
    }

    /// The enable was taken away: the restart protection has done its work.
    pub fn release_restart_lock(&mut self) {
        self.restart_lock = false;
    }

    /// The stored TRIP.
    pub fn tripped(&self) -> Option<Fault> {
        self.trip
    }

    /// Whether the cause of the stored TRIP is still there.
    pub fn trip_cause_present(&self) -> bool {
        self.trip.is_some_and(|fault| self.causes.contains(fault))
    }

    /// The message that keeps the output stage off.
    pub fn message(&self) -> Option<Fault> {
        self.causes.iter().find(|fault| fault.reaction() == Reaction::Message)
    }

    /// A warning.
    pub fn warning(&self) -> Option<Fault> {
        self.causes.iter().find(|fault| fault.reaction() == Reaction::Warning)
    }

    /// Whether a message has lasted so long that the reference is lost.
    pub fn reference_lost(&self) -> bool {
        self.message_ms > LONG_MESSAGE_MS
    }

    /// Whether monitoring keeps the output stage off.
    pub fn blocks_output(&self) -> bool {
        self.trip.is_some() || self.message().is_some() || self.restart_lock
    }

    /// What C0067 shows: the fault with the highest reaction, as LECOM number; 0 = none.
    pub fn lecom_number(&self) -> u16 {
        let present = self
            .trip
            .map(|fault| (fault, Reaction::Trip))
            .or_else(|| self.message().map(|fault| (fault, Reaction::Message)))
            .or_else(|| self.warning().map(|fault| (fault, Reaction::Warning)));
        present.map_or(0, |(fault, reaction)| fault.lecom_number(reaction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(fault: Fault) -> FaultSet {
        FaultSet::default().with(fault, true)
    }

    #[test]
    fn a_trip_stays_until_it_is_reset_and_its_cause_is_gone() {
        let mut monitor = Monitor::default();
        monitor.update(with(Fault::Sd2), Restart::Automatic);
        monitor.reset_trip();
        assert_eq!(monitor.tripped(), Some(Fault::Sd2));
        monitor.update(FaultSet::default(), Restart::Automatic);
        assert!(monitor.blocks_output());
        monitor.reset_trip();
        assert_eq!(monitor.tripped(), None);
        assert!(!monitor.blocks_output());
    }

    #[test]
    fn the_first_trip_is_the_one_that_is_shown() {
        let mut monitor = Monitor::default();
        monitor.update(with(Fault::P03), Restart::Automatic);
        monitor.update(with(Fault::Nmax), Restart::Automatic);
        assert_eq!(monitor.tripped(), Some(Fault::P03));
        assert_eq!(monitor.lecom_number(), 153);
    }

    #[test]
    fn a_message_goes_by_itself() {
        let mut monitor = Monitor::default();
        monitor.update(with(Fault::Lu), Restart::Automatic);
        assert!(monitor.blocks_output());
        assert_eq!(monitor.lecom_number(), 1030);
        monitor.update(FaultSet::default(), Restart::Automatic);
        assert!(!monitor.blocks_output());
    }

    #[test]
    fn half_a_second_of_message_is_still_short_and_more_loses_the_reference() {
        let mut monitor = Monitor::default();
        for _ in 0..500 {
            monitor.update(with(Fault::Lu), Restart::Locked);
        }
        assert!(!monitor.reference_lost());
        monitor.update(with(Fault::Lu), Restart::Locked);
        assert!(monitor.reference_lost());
    }

    #[test]
    fn after_a_long_message_c0142_decides_about_the_restart() {
        for (restart, blocked) in [(Restart::Locked, true), (Restart::Automatic, false)] {
            let mut monitor = Monitor::default();
            for _ in 0..600 {
                monitor.update(with(Fault::Lu), restart);
            }
            monitor.update(FaultSet::default(), restart);
            assert_eq!(monitor.blocks_output(), blocked, "{restart:?}");
            monitor.release_restart_lock();
            assert!(!monitor.blocks_output());
        }
    }
}
