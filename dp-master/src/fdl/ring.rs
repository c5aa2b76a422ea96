//! The logical ring as one station sees it: built by listening, kept by every token heard.
//!
//! | heard | meaning |
//! |---|---|
//! | SA → DA | both are in the ring, nobody between them is |
//! | two identical rotations of the token, each closed | the list is complete: ready to enter |
//! | SA = PS → TS | the token is ours |
//! | another SA → TS, once | an error; not accepted |
//! | the same SA → TS again | the ring has changed; SA is the new PS |
//! | TS passed over in two rotations | the others have taken us out |
//! | SA = TS, twice | somebody else has our address |
//!
//! Source: IEC 61158-4-3 and EN 50170-2 part 4, 4.1.1.1 to 4.1.1.3.

use super::las::Las;
use crate::address::Address;

/// How many own tokens a frame with the own address as its source is remembered.
///
/// Interpretation: the standard counts two such frames. Years between two disturbed ones should not make a duplicate.
const SUSPICION: u8 = 8;

/// What a token telegram means to a member of the ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// It changes hands between others.
    Elsewhere(Change),
    /// It is passed to this station, which accepts it.
    Accepted(Change),
    /// It is passed to this station by somebody who is not its predecessor, for the first time.
    Refused,
    /// This station has been passed over for the second time.
    Excluded,
}

/// What became of the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Change {
    pub(super) joined: Las,
    pub(super) left: Las,
}

impl Change {
    fn between(before: Las, after: Las) -> Self {
        Self {
            joined: after.without(before),
            left: before.without(after),
        }
    }

    pub(super) fn is_none(self) -> bool {
        self == Self::default()
    }
}

/// The ring around this station.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ring {
    ts: Address,
    las: Las,
    standing: Standing,
    /// Who passed us the token without being our predecessor.
    stranger: Option<Address>,
    /// Rotations in which we were passed over.
    passed_over: u8,
    /// Own tokens until a frame with our address is forgotten.
    suspicion: u8,
    last: Option<(Address, Address)>,
}

/// What this station is to the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// It listens.
    Listening(Rotation),
    /// It knows all members and may be asked to enter.
    Ready,
    /// It has had the token.
    Member,
}

impl Ring {
    pub(super) const fn new(ts: Address) -> Self {
        Self {
            ts,
            las: Las::EMPTY,
            standing: Standing::Listening(Rotation::NOTHING),
            stranger: None,
            passed_over: 0,
            suspicion: 0,
            last: None,
        }
    }

    /// Forgets the others and listens for two rotations.
    pub(super) fn listen(&mut self) {
        *self = Self {
            suspicion: self.suspicion,
            ..Self::new(self.ts)
        };
    }

    /// This station is all there is.
    pub(super) fn claim_alone(&mut self) {
        self.las = Las::only(self.ts);
        self.become_member();
    }

    /// The station has the token; tells whether that makes it a member.
    pub(super) fn become_member(&mut self) -> bool {
        self.las.insert(self.ts);
        self.stranger = None;
        self.passed_over = 0;
        self.suspicion = self.suspicion.saturating_sub(1);
        self.last = None;
        core::mem::replace(&mut self.standing, Standing::Member) != Standing::Member
    }

    pub(super) fn las(&self) -> Las {
        self.las
    }

    /// Whether no other station is known.
    pub(super) fn is_alone(&self) -> bool {
        self.ns() == self.ts
    }

    /// The successor; this station itself when it is alone.
    pub(super) fn ns(&self) -> Address {
        self.las.next(self.ts).unwrap_or(self.ts)
    }

    /// The predecessor; this station itself when it is alone.
    pub(super) fn ps(&self) -> Address {
        self.las.previous(self.ts).unwrap_or(self.ts)
    }

    pub(super) fn is_member(&self) -> bool {
        self.standing == Standing::Member
    }

    /// Whether all members are known, so that the station may be asked to enter.
    pub(super) fn is_known(&self) -> bool {
        !matches!(self.standing, Standing::Listening(_))
    }

    /// A newcomer behind this station.
    pub(super) fn admit(&mut self, newcomer: Address) {
        self.las.insert(newcomer);
    }

    /// A successor that does not take the token.
    pub(super) fn dismiss(&mut self, successor: Address) {
        self.las.remove(successor);
    }

    /// A frame carried the own address as its source; tells whether it is the second one.
    pub(super) fn own_address_heard(&mut self) -> bool {
        core::mem::replace(&mut self.suspicion, SUSPICION) > 0
    }

    /// The suspicion was justified and has been acted upon.
    pub(super) fn clear_suspicion(&mut self) {
        self.suspicion = 0;
    }

    /// A token heard in ListenToken.
    pub(super) fn hear_listening(&mut self, sa: Address, da: Address) {
        if let Standing::Listening(rotation) = &mut self.standing {
            if let Some(las) = rotation.hear(sa, da) {
                self.las = las;
                // Others may still think that we are a member.
                self.las.remove(self.ts);
                self.standing = Standing::Ready;
                self.suspicion = self.suspicion.saturating_sub(1);
            }
        } else {
            self.observe(sa, da);
        }
    }

    /// A token heard in ActiveIdle.
    pub(super) fn hear(&mut self, sa: Address, da: Address) -> Heard {
        if da == self.ts {
            return self.offered_by(sa);
        }
        let repeated = self.last.replace((sa, da)) == Some((sa, da)) && sa != da;
        let ours_between = Las::only(self.ts).between(sa, da) != Las::EMPTY;
        if self.is_member() && ours_between && !repeated {
            self.passed_over += 1;
            if self.passed_over >= 2 {
                return Heard::Excluded;
            }
        }
        Heard::Elsewhere(self.observe(sa, da))
    }

    fn offered_by(&mut self, sa: Address) -> Heard {
        self.passed_over = 0;
        self.last = None;
        let before = self.las;
        if sa != self.ps() {
            if self.stranger != Some(sa) {
                self.stranger = Some(sa);
                return Heard::Refused;
            }
            // It insists: the stations between it and us are gone.
            self.las.remove_all(self.las.between(sa, self.ts));
            self.las.insert(sa);
        }
        Heard::Accepted(Change::between(before, self.las))
    }

    fn observe(&mut self, sa: Address, da: Address) -> Change {
        let before = self.las;
        let mut gone = self.las.between(sa, da);
        gone.remove(self.ts);
        self.las.remove_all(gone);
        self.las.insert(sa);
        self.las.insert(da);
        Change::between(before, self.las)
    }
}

/// Follows the token round the ring until two closed rotations were the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Rotation {
    /// Where the present rotation began.
    start: Option<Address>,
    last: Option<(Address, Address)>,
    present: Las,
    before: Option<Las>,
}

impl Rotation {
    const NOTHING: Self = Self {
        start: None,
        last: None,
        present: Las::EMPTY,
        before: None,
    };

    /// The members, once they are certain.
    fn hear(&mut self, sa: Address, da: Address) -> Option<Las> {
        let last = self.last.replace((sa, da));
        match last {
            // A repetition: the successor has not taken it yet. (To itself, it is a new rotation.)
            Some(last) if last == (sa, da) && sa != da => return None,
            Some((_, holder)) if holder == sa => {}
            // The first one, or the chain is broken: what was heard so far is worth nothing.
            _ => {
                *self = Self {
                    start: Some(sa),
                    last: self.last,
                    ..Self::NOTHING
                }
            }
        }
        self.present.insert(sa);
        if self.start != Some(da) {
            return None;
        }
        let present = core::mem::take(&mut self.present);
        (self.before.replace(present) == Some(present)).then_some(present)
    }
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

    /// A listener that heard these tokens.
    fn listener(ts: u8, tokens: &[(u8, u8)]) -> Ring {
        let mut ring = Ring::new(at(ts));
        for &(sa, da) in tokens {
            ring.hear_listening(at(sa), at(da));
        }
        ring
    }

    /// A member of the ring 1, 3, 5, 7 at address 5.
    fn member() -> Ring {
        let mut ring = listener(5, &[(1, 3), (3, 7), (7, 1), (1, 3), (3, 7), (7, 1)]);
        assert!(matches!(ring.hear(at(3), at(5)), Heard::Accepted(_)));
        assert!(ring.become_member());
        ring
    }

    #[test]
    fn two_identical_rotations_make_the_list() {
        let mut ring = listener(5, &[(3, 7), (7, 1), (1, 3), (3, 7), (7, 1)]);
        assert!(!ring.is_known());
        ring.hear_listening(at(1), at(3));
        assert!(ring.is_known());
        assert_eq!(ring.las(), las(&[1, 3, 7]));
        assert_eq!((ring.ps(), ring.ns()), (at(3), at(7)));
        assert!(!ring.is_member());
    }

    #[test]
    fn two_tokens_of_a_master_to_itself_are_two_rotations() {
        assert!(!listener(5, &[(1, 1)]).is_known());
        let ring = listener(5, &[(1, 1), (1, 1)]);
        assert!(ring.is_known());
        assert_eq!((ring.ps(), ring.ns()), (at(1), at(1)));
    }

    #[test]
    fn a_repeated_token_does_not_spoil_a_rotation_and_a_broken_chain_does() {
        let repeated = [(1, 3), (1, 3), (3, 1), (1, 3), (3, 1)];
        assert!(listener(5, &repeated).is_known());
        let broken = [(1, 3), (3, 1), (1, 3), (4, 1), (1, 3)];
        assert!(!listener(5, &broken).is_known());
    }

    #[test]
    fn rotations_that_differ_are_not_enough() {
        let grown = [(1, 3), (3, 1), (1, 3), (3, 7), (7, 1)];
        assert!(!listener(5, &grown).is_known());
        let settled = [(1, 3), (3, 1), (1, 3), (3, 7), (7, 1), (1, 3), (3, 7), (7, 1)];
        assert_eq!(listener(5, &settled).las(), las(&[1, 3, 7]));
    }

    #[test]
    fn a_listener_that_others_take_for_a_member_does_not_count_itself() {
        let tokens = [(1, 5), (1, 5), (1, 5), (1, 7), (7, 1), (1, 7), (7, 1), (1, 7)];
        let ring = listener(5, &tokens);
        assert!(ring.is_known());
        assert_eq!(ring.las(), las(&[1, 7]));
    }

    #[test]
    fn only_the_predecessor_passes_the_token_at_once() {
        let mut ring = member();
        assert_eq!(ring.hear(at(1), at(5)), Heard::Refused);
        assert_eq!(ring.hear(at(3), at(5)), Heard::Accepted(Change::default()));
    }

    #[test]
    fn a_stranger_that_passes_the_token_twice_is_the_new_predecessor() {
        let mut ring = member();
        assert_eq!(ring.hear(at(1), at(5)), Heard::Refused);
        let change = Change {
            joined: Las::EMPTY,
            left: las(&[3]),
        };
        assert_eq!(ring.hear(at(1), at(5)), Heard::Accepted(change));
        assert_eq!(ring.ps(), at(1));
        // Two different strangers are two errors.
        let mut ring = member();
        assert_eq!(ring.hear(at(1), at(5)), Heard::Refused);
        assert_eq!(ring.hear(at(4), at(5)), Heard::Refused);
    }

    #[test]
    fn a_token_between_others_shows_who_joined_and_who_left() {
        let mut ring = member();
        let change = |joined: &[u8], left: &[u8]| {
            Heard::Elsewhere(Change {
                joined: las(joined),
                left: las(left),
            })
        };
        assert_eq!(ring.hear(at(7), at(9)), change(&[9], &[]));
        assert_eq!(ring.hear(at(9), at(3)), change(&[], &[1]));
        assert_eq!(ring.las(), las(&[3, 5, 7, 9]));
    }

    #[test]
    fn a_member_passed_over_in_two_rotations_is_excluded() {
        let mut ring = member();
        assert!(matches!(ring.hear(at(3), at(7)), Heard::Elsewhere(_)));
        // A repetition is the same rotation.
        assert!(matches!(ring.hear(at(3), at(7)), Heard::Elsewhere(_)));
        assert!(matches!(ring.hear(at(7), at(3)), Heard::Elsewhere(_)));
        assert_eq!(ring.hear(at(3), at(7)), Heard::Excluded);
        // A token in between clears the account.
        let mut ring = member();
        ring.hear(at(3), at(7));
        ring.hear(at(3), at(5));
        assert!(matches!(ring.hear(at(3), at(7)), Heard::Elsewhere(_)));
    }

    #[test]
    fn a_foreign_ring_of_one_excludes_everybody_else() {
        let mut ring = member();
        assert!(matches!(ring.hear(at(2), at(2)), Heard::Elsewhere(_)));
        assert_eq!(ring.hear(at(2), at(2)), Heard::Excluded);
    }

    #[test]
    fn the_own_address_heard_twice_within_eight_tokens_is_a_duplicate() {
        let mut ring = member();
        assert!(!ring.own_address_heard());
        for _ in 0..7 {
            ring.become_member();
        }
        assert!(ring.own_address_heard());
        for _ in 0..8 {
            ring.become_member();
        }
        assert!(!ring.own_address_heard());
    }
}
