//! Monitoring: which fault is present, what the drive does about it, and how it is reset.

use super::fault::{Fault, Reaction};

/// A set of faults, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FaultSet(u64);

const _: () = assert!(Fault::ALL.len() <= 64, "a fault has no bit");

impl FaultSet {
    /// Adds `fault` when `present`.
    #[must_use]
    pub fn with(self, fault: Fault, present: bool) -> Self {
        FaultSet(self.0 | (u64::from(present) << fault as u32))
    }

    /// Whether `fault` is in the set.
    pub fn contains(self, fault: Fault) -> bool {
        self.0 & (1 << fault as u32) != 0
    }

    /// Takes `fault` out.
    #[must_use]
    pub fn without(self, fault: Fault) -> Self {
        FaultSet(self.0 & !(1 << fault as u32))
    }

    /// The faults in it, in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = Fault> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let place = left.trailing_zeros() as usize;
            left &= left.wrapping_sub(1);
            Fault::ALL.get(place).copied()
        })
    }
}

/// The drive's monitoring: causes in, reactions out. Called once a millisecond.
#[derive(Debug, Clone, Default)]
pub struct Monitor {
    /// The TRIP that is stored until it is reset.
    trip: Option<Fault>,
    causes: FaultSet,
    /// Causes by what is done about them; a TRIP is stored instead.
    messages: FaultSet,
    warnings: FaultSet,
    fail_qsp: FaultSet,
    /// The fault shown: the highest reaction, then the earliest.
    shown: Option<(Fault, Reaction)>,
    /// For how long a message has been present without a break, ms.
    message_ms: u32,
    restart_lock: bool,
}

/// A message that lasts longer loses the reference, and C0142 decides whether the drive restarts by itself (9300 facts 2.5).
const LONG_MESSAGE_MS: u32 = 500;

/// Whether the drive enables itself again after a long message, a TRIP or mains on (C0142).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Restart {
    /// C0142 = 0: it stays inhibited until the enable is taken away and given again.
    Locked,
    /// C0142 = 1, as delivered.
    Automatic,
}

impl Monitor {
    /// One millisecond with these `causes` present; `reaction` tells what each of them asks for.
    pub fn update(&mut self, causes: FaultSet, reaction: impl Fn(Fault) -> Reaction, restart: Restart) {
        self.causes = causes;
        (self.messages, self.warnings, self.fail_qsp) = Default::default();
        for fault in causes.iter() {
            match reaction(fault) {
                Reaction::Trip => self.trip(fault),
                Reaction::Message => self.messages = self.messages.with(fault, true),
                Reaction::Warning => self.warnings = self.warnings.with(fault, true),
                Reaction::FailQsp => self.fail_qsp = self.fail_qsp.with(fault, true),
                Reaction::Off => {}
            }
        }
        if self.message().is_some() {
            self.message_ms = self.message_ms.saturating_add(1);
        } else {
            if self.message_ms > LONG_MESSAGE_MS && restart == Restart::Locked {
                self.restart_lock = true;
            }
            self.message_ms = 0;
        }
        self.show();
    }

    /// The only way into TRIP. The first one stays: the later are its consequences.
    pub fn trip(&mut self, cause: Fault) {
        self.trip.get_or_insert(cause);
    }

    /// Resets the TRIP; refused while its cause is there. Tells whether there was one and it is gone.
    pub fn reset_trip(&mut self) -> bool {
        let resets = self.trip.is_some() && !self.trip_cause_present();
        if resets {
            self.trip = None;
            self.show();
        }
        resets
    }

    /// Keeps the output stage off until the enable is taken away and given again.
    pub fn lock_restart(&mut self) {
        self.restart_lock = true;
    }

    /// The enable was taken away: the restart protection has done its work.
    pub fn release_restart_lock(&mut self) {
        self.restart_lock = false;
    }

    /// Whether the restart protection keeps the output stage off.
    pub fn restart_locked(&self) -> bool {
        self.restart_lock
    }

    /// The stored TRIP.
    pub fn tripped(&self) -> Option<Fault> {
        self.trip
    }

    /// Whether the cause of the stored TRIP is still there.
    pub fn trip_cause_present(&self) -> bool {
        self.trip.is_some_and(|fault| self.causes.contains(fault))
    }

    /// The causes of the last millisecond.
    pub fn causes(&self) -> FaultSet {
        self.causes
    }

    /// Whether a fault is stored, or its cause is there.
    pub fn is_present(&self, fault: Fault) -> bool {
        self.trip == Some(fault) || self.causes.contains(fault)
    }

    /// The message that keeps the output stage off.
    pub fn message(&self) -> Option<Fault> {
        self.messages.iter().next()
    }

    /// Whether this message is among those that keep the output stage off.
    pub fn has_message(&self, fault: Fault) -> bool {
        self.messages.contains(fault)
    }

    /// A warning.
    pub fn warning(&self) -> Option<Fault> {
        self.warnings.iter().next()
    }

    /// The fault that stops the drive by quick stop.
    pub fn fail_qsp(&self) -> Option<Fault> {
        self.fail_qsp.iter().next()
    }

    /// Whether a message has lasted so long that the reference is lost.
    pub fn reference_lost(&self) -> bool {
        self.message_ms > LONG_MESSAGE_MS
    }

    /// Whether monitoring keeps the output stage off.
    pub fn blocks_output(&self) -> bool {
        self.trip.is_some() || self.message().is_some() || self.restart_lock
    }

    /// The fault shown: the one with the highest reaction, of several the earliest.
    pub fn shown(&self) -> Option<(Fault, Reaction)> {
        self.shown
    }

    /// What C0067 shows: the LECOM number of the fault shown; 0 = none.
    pub fn lecom_number(&self) -> u16 {
        self.shown.map_or(0, |(fault, reaction)| fault.lecom_number(reaction))
    }

    fn show(&mut self) {
        let of = |faults: FaultSet, reaction| faults.iter().next().map(|fault| (fault, reaction));
        let highest = self
            .trip
            .map(|fault| (fault, Reaction::Trip))
            .or_else(|| of(self.messages, Reaction::Message))
            .or_else(|| of(self.warnings, Reaction::Warning))
            .or_else(|| of(self.fail_qsp, Reaction::FailQsp));
        // Of two with the same reaction the one that was there first stays.
        let stays = self.shown.is_some_and(|(fault, reaction)| {
            highest.is_some_and(|(_, highest)| highest == reaction)
                && match reaction {
                    Reaction::Trip => self.trip == Some(fault),
                    Reaction::Message => self.messages.contains(fault),
                    Reaction::Warning => self.warnings.contains(fault),
                    Reaction::FailQsp => self.fail_qsp.contains(fault),
                    Reaction::Off => false,
                }
        });
        if !stays {
            self.shown = highest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factory setting.
    fn reaction(fault: Fault) -> Reaction {
        fault.reactions()[0]
    }

    fn with(fault: Fault) -> FaultSet {
        FaultSet::default().with(fault, true)
    }

    #[test]
    fn a_trip_stays_until_it_is_reset_and_its_cause_is_gone() {
        let mut monitor = Monitor::default();
        monitor.update(with(Fault::Sd2), reaction, Restart::Automatic);
        monitor.reset_trip();
        assert_eq!(monitor.tripped(), Some(Fault::Sd2));
        monitor.update(FaultSet::default(), reaction, Restart::Automatic);
        assert!(monitor.blocks_output());
        monitor.reset_trip();
        assert_eq!(monitor.tripped(), None);
        assert!(!monitor.blocks_output());
    }

    #[test]
    fn the_first_trip_is_the_one_that_is_shown() {
        let mut monitor = Monitor::default();
        monitor.update(with(Fault::P03), reaction, Restart::Automatic);
        monitor.update(with(Fault::Nmax), reaction, Restart::Automatic);
        assert_eq!(monitor.tripped(), Some(Fault::P03));
        assert_eq!(monitor.lecom_number(), 153);
    }

    #[test]
    fn a_message_goes_by_itself() {
        let mut monitor = Monitor::default();
        monitor.update(with(Fault::Lu), reaction, Restart::Automatic);
        assert!(monitor.blocks_output());
        assert_eq!(monitor.lecom_number(), 1030);
        monitor.update(FaultSet::default(), reaction, Restart::Automatic);
        assert!(!monitor.blocks_output());
    }

    #[test]
    fn half_a_second_of_message_is_still_short_and_more_loses_the_reference() {
        let mut monitor = Monitor::default();
        for _ in 0..500 {
            monitor.update(with(Fault::Lu), reaction, Restart::Locked);
        }
        assert!(!monitor.reference_lost());
        monitor.update(with(Fault::Lu), reaction, Restart::Locked);
        assert!(monitor.reference_lost());
    }

    #[test]
    fn after_a_long_message_c0142_decides_about_the_restart() {
        for (restart, blocked) in [(Restart::Locked, true), (Restart::Automatic, false)] {
            let mut monitor = Monitor::default();
            for _ in 0..600 {
                monitor.update(with(Fault::Lu), reaction, restart);
            }
            monitor.update(FaultSet::default(), reaction, restart);
            assert_eq!(monitor.blocks_output(), blocked, "{restart:?}");
            monitor.release_restart_lock();
            assert!(!monitor.blocks_output());
        }
    }

    #[test]
    fn of_two_warnings_the_earlier_is_shown_and_a_message_covers_both() {
        let mut monitor = Monitor::default();
        let mut causes = with(Fault::P15);
        monitor.update(causes, reaction, Restart::Automatic);
        // OH4 stands before P15 in the table, and came later.
        causes = causes.with(Fault::Oh4, true);
        monitor.update(causes, reaction, Restart::Automatic);
        assert_eq!(monitor.shown(), Some((Fault::P15, Reaction::Warning)));
        monitor.update(causes.with(Fault::Lu, true), reaction, Restart::Automatic);
        assert_eq!(monitor.lecom_number(), 1030);
        monitor.update(causes.without(Fault::P15), reaction, Restart::Automatic);
        assert_eq!(monitor.shown(), Some((Fault::Oh4, Reaction::Warning)));
    }

    #[test]
    fn each_reaction_does_what_it_is_called_and_nothing_else() {
        for (reaction, [trips, message, warning, fail_qsp]) in [
            (Reaction::Trip, [true, false, false, false]),
            (Reaction::Message, [false, true, false, false]),
            (Reaction::Warning, [false, false, true, false]),
            (Reaction::FailQsp, [false, false, false, true]),
            (Reaction::Off, [false; 4]),
        ] {
            let mut monitor = Monitor::default();
            monitor.update(with(Fault::Eer), |_| reaction, Restart::Automatic);
            assert_eq!(monitor.tripped().is_some(), trips, "{reaction:?}");
            assert_eq!(monitor.message().is_some(), message, "{reaction:?}");
            assert_eq!(monitor.warning().is_some(), warning, "{reaction:?}");
            assert_eq!(monitor.fail_qsp().is_some(), fail_qsp, "{reaction:?}");
            assert_eq!(monitor.blocks_output(), trips || message, "{reaction:?}");
        }
    }
}
