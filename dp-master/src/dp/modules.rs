//! Modular slaves: which configurations their slots allow.

/// One slot of a modular slave.
///
/// # Example
///
/// ```
/// use dp_master::dp::{AcceptedConfigurations, EMPTY_SLOT, Slot};
/// // A head module, then two slots that take four inputs, two output words, or nothing.
/// const IO: &[&[u8]] = &[&[0x13], &[0x61], EMPTY_SLOT];
/// static SLOTS: [Slot; 3] = [Slot::new(&[&[0xF3]]), Slot::new(IO), Slot::new(IO)];
/// let accepted = AcceptedConfigurations::Modular(&SLOTS);
/// assert!(accepted.check(&[0xF3, 0x61, 0x13]).is_some());
/// assert!(accepted.check(&[0xF3, 0x00, 0x13]).is_some());
/// assert!(accepted.check(&[0xF3]).is_some(), "empty slots at the end may be left out");
/// assert!(accepted.check(&[0x61, 0x13]).is_none());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    modules: &'static [&'static [u8]],
}

/// The module of a slot with nothing in it: a special identifier without data, one octet 00.
pub const EMPTY_SLOT: &[u8] = &[0x00];

impl Slot {
    /// A slot that takes these modules, each with the identifier octets of its GSD entry. A slot that may stay empty
    /// lists [`EMPTY_SLOT`].
    pub const fn new(modules: &'static [&'static [u8]]) -> Self {
        Self { modules }
    }

    /// What it takes.
    pub const fn modules(&self) -> &'static [&'static [u8]] {
        self.modules
    }

    fn may_be_empty(&self) -> bool {
        self.modules.contains(&EMPTY_SLOT)
    }
}

/// Whether the identifiers can be dealt to the slots in their order, one module each; slots at the end that may be
/// empty may be left out.
///
/// Modules may begin alike, so all divisions are followed at once: at most 245 places a slot, however the identifiers
/// look.
pub(super) fn fit(slots: &[Slot], identifiers: &[u8]) -> bool {
    let end = identifiers.len();
    if end == 0 || end > MOST {
        return false;
    }
    let mut reached = Ends::default();
    reached.insert(0);
    for (place, slot) in slots.iter().enumerate() {
        let rest_may_be_empty = || slots.iter().skip(place).all(Slot::may_be_empty);
        if reached.contains(end) && rest_may_be_empty() {
            return true;
        }
        let mut next = Ends::default();
        for begin in (0..=end).filter(|&begin| reached.contains(begin)) {
            let rest = identifiers.get(begin..).unwrap_or(&[]);
            for module in slot.modules.iter().filter(|module| !module.is_empty()) {
                if rest.starts_with(module) {
                    next.insert(begin + module.len());
                }
            }
        }
        reached = next;
    }
    reached.contains(end)
}

/// Most identifier octets of a Chk_Cfg.
const MOST: usize = super::image::MAX_DATA;

/// A set of places between identifier octets, 0…244.
#[derive(Debug, Clone, Copy, Default)]
struct Ends([u64; MOST / 64 + 1]);

impl Ends {
    fn insert(&mut self, place: usize) {
        if let Some(word) = self.0.get_mut(place / 64) {
            *word |= 1 << (place % 64);
        }
    }

    fn contains(&self, place: usize) -> bool {
        self.0.get(place / 64).is_some_and(|word| word >> (place % 64) & 1 == 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_of_several_octets_and_common_beginnings_are_told_apart() {
        // The long module begins like the short one; a greedy reader fails at one of the two.
        const LONG_OR_SHORT: &[&[u8]] = &[&[0x10], &[0x10, 0x20]];
        let slots = [Slot::new(LONG_OR_SHORT), Slot::new(&[&[0x20, 0x30], &[0x30]])];
        assert!(fit(&slots, &[0x10, 0x20, 0x30]));
        assert!(fit(&slots, &[0x10, 0x30]));
        assert!(!fit(&slots, &[0x10, 0x20]));
        assert!(!fit(&slots, &[0x10, 0x20, 0x20]));
    }

    #[test]
    fn more_identifiers_than_slots_do_not_fit() {
        let slots = [Slot::new(&[&[0x10], EMPTY_SLOT])];
        assert!(fit(&slots, &[0x10]));
        assert!(!fit(&slots, &[0x10, 0x10]));
        assert!(!fit(&slots, &[]));
        assert!(!fit(&[], &[0x10]));
    }

    #[test]
    fn only_slots_that_may_be_empty_may_be_left_out() {
        let slots = [
            Slot::new(&[&[0x10]]),
            Slot::new(&[&[0x20], EMPTY_SLOT]),
            Slot::new(&[&[0x30]]),
        ];
        assert!(!fit(&slots, &[0x10, 0x20]));
        assert!(!fit(&slots, &[0x10, 0x30]));
        assert!(fit(&slots, &[0x10, 0x00, 0x30]));
    }

    #[test]
    fn the_longest_chk_cfg_is_dealt_out() {
        let slots = [Slot::new(&[&[0x10], EMPTY_SLOT]); 244];
        assert!(fit(&slots, &[0x10; 244]));
        assert!(!fit(&slots[..243], &[0x10; 244]));
    }
}
