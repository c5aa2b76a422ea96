//! Which of the eleven places hold a token.

use core::fmt;

/// Number of places of the parameter net.
pub const PLACES: u8 = 11;

const ALL: u16 = (1 << PLACES) - 1;

/// A set of places: place *n* (1…11) is bit *n* − 1.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, PartialOrd, Ord)]
pub struct Places(u16);

impl Places {
    /// No place.
    pub const NONE: Self = Self(0);

    /// The set of the listed places. Numbers outside 1…11 name no place and are left out.
    #[must_use]
    pub const fn of(numbers: &[u8]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < numbers.len() {
            if numbers[i] >= 1 && numbers[i] <= PLACES {
                bits |= 1 << (numbers[i] - 1);
            }
            i += 1;
        }
        Self(bits)
    }

    /// The set as bits, place *n* at bit *n* − 1.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Places of either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Places of both sets.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The numbers of the places, lowest first.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (1..=PLACES).filter(move |n| self.0 & (1 << (n - 1)) != 0)
    }
}

/// `{1, 10}`.
impl fmt::Display for Places {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{")?;
        for (i, place) in self.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{place}")?;
        }
        f.write_str("}")
    }
}

impl fmt::Debug for Places {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The marking of a 1-safe net: place *n* (1…11) holds a token when bit *n* − 1 is set. Other bits are always 0.
///
/// Layout: the block keeps it as eleven booleans in two octets, place 1 in bit 0 of the first; this word is the
/// same bits with place 9 at bit 8. Its reset constant `W#16#102` is places 1 and 10 in that octet order.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, PartialOrd, Ord)]
#[doc(alias = "Petrinetz")]
#[doc(alias = "Merker")]
pub struct Marking(u16);

impl Marking {
    /// The marking with tokens in the given places.
    #[must_use]
    pub const fn new(places: Places) -> Self {
        Self(places.0)
    }

    /// The marking from bits, place *n* at bit *n* − 1; bits above place 11 are dropped.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits & ALL)
    }

    /// The marking as bits, place *n* at bit *n* − 1.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The marked places.
    #[must_use]
    pub const fn places(self) -> Places {
        Places(self.0)
    }

    /// Whether place `number` (1…11) holds a token; `false` for other numbers.
    #[must_use]
    pub const fn holds(self, number: u8) -> bool {
        number >= 1 && number <= PLACES && self.0 & (1 << (number - 1)) != 0
    }

    /// Whether every place of the set holds a token.
    #[must_use]
    pub const fn holds_all(self, places: Places) -> bool {
        self.0 & places.0 == places.0
    }

    /// Whether any place of the set holds a token.
    #[must_use]
    pub const fn holds_any(self, places: Places) -> bool {
        self.0 & places.0 != 0
    }

    /// The marking after tokens left `takes` and entered `puts`.
    #[must_use]
    pub const fn moved(self, takes: Places, puts: Places) -> Self {
        Self((self.0 & !takes.0) | puts.0)
    }
}

/// Eleven characters 0 or 1, places 1 to 11 from left to right: `10000000010` is `{1, 10}`.
impl fmt::Display for Marking {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for place in 1..=PLACES {
            f.write_str(if self.holds(place) { "1" } else { "0" })?;
        }
        Ok(())
    }
}

impl fmt::Debug for Marking {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self} {}", self.places())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reset_marking_prints_places_1_and_10() {
        let marking = Marking::new(Places::of(&[1, 10]));
        assert_eq!(marking.to_string(), "10000000010");
        assert_eq!(marking.places().to_string(), "{1, 10}");
        assert_eq!(marking.bits(), 0b010_0000_0001);
    }

    #[test]
    fn sets_of_places_are_joined_and_shown() {
        let (left, right) = (Places::of(&[1, 10]), Places::of(&[2, 10]));
        assert_eq!(left.union(right), Places::of(&[1, 2, 10]));
        assert_eq!(left.bits(), 0b010_0000_0001);
        assert_eq!(format!("{left:?}"), "{1, 10}");
        assert_eq!(format!("{:?}", Marking::new(left)), "10000000010 {1, 10}");
    }

    #[test]
    fn numbers_that_name_no_place_are_left_out() {
        assert!(Places::of(&[0, 12, 255]).is_empty());
        assert!(!Marking::from_bits(0xFFFF).holds(0));
        assert!(!Marking::from_bits(0xFFFF).holds(12));
        assert_eq!(Marking::from_bits(0xFFFF).bits(), 0x07FF);
    }

    #[test]
    fn moving_takes_before_it_puts() {
        let both = Places::of(&[3]);
        assert_eq!(Marking::new(both).moved(both, both), Marking::new(both));
    }
}
