//! The GAP: which address a master asks next whether a station stands there that wants to enter the ring.
//!
//! A master looks after the addresses between itself (TS) and its successor (NS), as far as they are not above HSA. One
//! look over all of them is a scan, one address a token at most. Between two scans the token rotates `gap_factor` times.
//!
//! A master that makes a new ring asks all addresses first, but does not keep its user waiting for longer than
//! [`INITIALISATION`]: at 9.6 kbit/s, or behind an operating system, 126 slot times are seconds. What is then left of the
//! scan goes one address a token, and a token a cycle.
//!
//! A master alone in the ring would pay for each look with a slot time of silence. So in all later scans its looks keep a
//! distance of [`LONE_SHARE`] times what one costs.
//!
//! Source: IEC 61158-4-3 and EN 50170-2 part 4, 4.1.1.2 (GAP, GAPL, gap update time, "one address per token receipt"),
//! 4.1.1.3 (initialisation). Interpretation: the bound of the initialisation and the distance of a master alone.

use super::las::Las;
use crate::address::Address;
use crate::time::{Duration, Instant};

/// A master alone spends at most one part in this many on looking for others: 0.6 %.
pub(super) const LONE_SHARE: u64 = 160;

/// How long a new ring is searched for members before its maker begins to work.
const INITIALISATION: Duration = Duration::from_millis(100);

/// The search for newcomers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    ts: Address,
    hsa: Address,
    factor: u8,
    phase: Phase,
    /// Not before this moment while alone.
    not_before: Instant,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// So many token rotations until the next scan.
    Waiting(u8),
    /// The addresses up to this one were asked.
    Scanning(Address),
    /// The same in a ring that has just been made: nobody is waiting for the token.
    First { last: Address, at_once_until: Instant },
}

impl Gap {
    pub(super) const fn new(ts: Address, hsa: Address, factor: u8) -> Self {
        Self {
            ts,
            hsa,
            factor,
            phase: Phase::Waiting(factor),
            not_before: Instant::ZERO,
        }
    }

    /// The ring is initialised: every address is asked, at first without anything else in between.
    pub(super) fn initialise(&mut self, now: Instant) {
        self.phase = Phase::First {
            last: self.ts,
            at_once_until: now + INITIALISATION,
        };
    }

    /// Whether the scan that belongs to the initialisation of the ring goes on.
    pub(super) fn is_first(&self) -> bool {
        matches!(self.phase, Phase::First { .. })
    }

    /// Whether it goes on with the same token.
    pub(super) fn is_at_once(&self, now: Instant) -> bool {
        matches!(self.phase, Phase::First { at_once_until, .. } if now < at_once_until)
    }

    /// Another master was heard that is not in the list: the next scan begins with the next token.
    pub(super) fn hurry(&mut self) {
        if matches!(self.phase, Phase::Waiting(_)) {
            self.phase = Phase::Waiting(1);
        }
    }

    /// A successor was found, or the ring was lost: the scan is over.
    pub(super) fn finish(&mut self) {
        self.phase = Phase::Waiting(self.factor);
    }

    /// The token came: one more rotation.
    pub(super) fn count_rotation(&mut self) {
        if let Phase::Waiting(left) = &mut self.phase {
            *left = left.saturating_sub(1);
            if *left == 0 {
                self.phase = Phase::Scanning(self.ts);
            }
        }
    }

    /// The address to be asked with this token, if one is due.
    pub(super) fn due(&mut self, now: Instant, las: Las) -> Option<Address> {
        let (last, paced) = match self.phase {
            Phase::Waiting(_) => return None,
            Phase::Scanning(last) => (last, las.len() <= 1),
            Phase::First { last, .. } => (last, false),
        };
        if paced && now < self.not_before {
            return None;
        }
        let found = self.following(last, las);
        if found.is_none() {
            self.finish();
        }
        found
    }

    /// The address was asked, which took until `now` since `started`.
    pub(super) fn asked(&mut self, started: Instant, now: Instant, address: Address) {
        let cost = (now - started).as_nanos();
        self.not_before = now + Duration::from_nanos(cost.saturating_mul(LONE_SHARE));
        match &mut self.phase {
            Phase::Scanning(last) | Phase::First { last, .. } => *last = address,
            Phase::Waiting(_) => {}
        }
    }

    /// The next address of the GAP after `last`.
    fn following(&self, last: Address, las: Las) -> Option<Address> {
        let ns = las.next(self.ts).unwrap_or(self.ts);
        let next = match last.value() {
            value if value >= self.hsa.value() => 0,
            value => value + 1,
        };
        let next = Address::from_low_bits(next);
        // The circle is closed at NS, or at TS for a station alone. Neither is met by counting when it is above HSA.
        let steps = |to: Address| steps(self.ts, to);
        let turned = last != self.ts && steps(next) <= steps(last);
        (steps(next) < steps(ns) && !turned).then_some(next)
    }
}

/// How far the way up from one address to another is, and around the highest one; to itself it is the longest.
const fn steps(from: Address, to: Address) -> u8 {
    to.value().wrapping_sub(from.value() + 1) & 0x7F
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(value: u8) -> Address {
        Address::new(value).unwrap()
    }

    fn las(values: &[u8]) -> Las {
        values.iter().copied().map(at).collect()
    }

    /// The addresses of one scan.
    fn scan(ts: u8, hsa: u8, members: &[u8]) -> Vec<u8> {
        let mut gap = Gap::new(at(ts), at(hsa), 1);
        gap.initialise(Instant::ZERO);
        let asked = std::iter::from_fn(|| {
            let address = gap.due(Instant::ZERO, las(members))?;
            gap.asked(Instant::ZERO, Instant::ZERO, address);
            Some(address.value())
        })
        .take(300)
        .collect();
        assert!(!gap.is_first());
        asked
    }

    #[test]
    fn the_gap_lies_between_the_station_and_its_successor() {
        assert_eq!(scan(2, 126, &[2, 6]), [3, 4, 5]);
        assert_eq!(scan(6, 8, &[2, 6]), [7, 8, 0, 1]);
        assert_eq!(scan(2, 126, &[2, 3]), []);
    }

    #[test]
    fn a_master_alone_asks_every_address_up_to_hsa_but_its_own() {
        assert_eq!(scan(2, 5, &[2]), [3, 4, 5, 0, 1]);
        assert_eq!(scan(0, 3, &[0]), [1, 2, 3]);
        assert_eq!(scan(5, 5, &[5]), [0, 1, 2, 3, 4]);
        assert_eq!(scan(2, 126, &[2]).len(), 126);
        assert_eq!(scan(0, 0, &[0]), []);
    }

    #[test]
    fn a_station_or_successor_above_hsa_does_not_lead_the_scan_astray() {
        // 9 and 7 are above HSA 5: the circle of addresses is still closed.
        assert_eq!(scan(9, 5, &[9]), [0, 1, 2, 3, 4, 5]);
        assert_eq!(scan(2, 5, &[2, 7]), [3, 4, 5]);
        assert_eq!(scan(7, 5, &[2, 7]), [0, 1]);
    }

    #[test]
    fn a_new_ring_is_searched_at_once_for_100_ms_and_then_with_every_token() {
        let at_ms = |millis| Instant::ZERO + Duration::from_millis(millis);
        let mut gap = Gap::new(at(2), at(9), 1);
        gap.initialise(at_ms(50));
        assert!(gap.is_at_once(at_ms(149)));
        assert_eq!(gap.due(at_ms(149), las(&[2])), Some(at(3)));
        gap.asked(at_ms(149), at_ms(160), at(3));
        assert!(!gap.is_at_once(at_ms(160)) && gap.is_first());
        // No distance is kept before this scan is complete.
        assert_eq!(gap.due(at_ms(160), las(&[2])), Some(at(4)));
    }

    #[test]
    fn a_scan_is_due_every_gap_factor_rotations() {
        let mut gap = Gap::new(at(2), at(4), 3);
        let ring = las(&[2, 4]);
        let mut asked = Vec::new();
        for rotation in 1..=12 {
            gap.count_rotation();
            if let Some(address) = gap.due(Instant::ZERO, ring) {
                gap.asked(Instant::ZERO, Instant::ZERO, address);
                asked.push((rotation, address.value()));
            }
        }
        // After three rotations 3 is asked; the rotation after that finds the scan complete and three more are counted.
        assert_eq!(asked, [(3, 3), (7, 3), (11, 3)]);
    }

    #[test]
    fn another_master_heard_makes_the_next_token_the_one_that_asks() {
        let mut gap = Gap::new(at(2), at(9), 10);
        gap.hurry();
        assert_eq!(gap.due(Instant::ZERO, las(&[2, 6])), None);
        gap.count_rotation();
        assert_eq!(gap.due(Instant::ZERO, las(&[2, 6])), Some(at(3)));
        // What has begun goes on.
        gap.asked(Instant::ZERO, Instant::ZERO, at(3));
        gap.hurry();
        assert_eq!(gap.due(Instant::ZERO, las(&[2, 6])), Some(at(4)));
    }

    #[test]
    fn a_master_alone_waits_160_times_what_the_last_look_took() {
        let at_us = |micros| Instant::ZERO + Duration::from_micros(micros);
        let mut gap = Gap::new(at(2), at(9), 1);
        gap.count_rotation();
        let first = gap.due(at_us(0), las(&[2])).unwrap();
        gap.asked(at_us(0), at_us(10), first);
        assert_eq!(gap.due(at_us(1609), las(&[2])), None);
        assert_eq!(gap.due(at_us(1610), las(&[2])), Some(at(4)));
        // In company the slot time is not lost to one station alone, and the bound of newcomers counts.
        assert_eq!(gap.due(at_us(11), las(&[2, 9])), Some(at(4)));
    }
}
