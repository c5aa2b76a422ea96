//! The list of active stations (LAS): who is in the logical ring, and who hears the token from whom.

use crate::address::Address;

/// A set of station addresses in the order of the ring: ascending, and from the highest back to the lowest.
///
/// Every question is answered by a few operations on one 128-bit number, whatever the number of stations.
///
/// # Example
///
/// ```
/// use dp_master::address::Address;
/// use dp_master::fdl::Las;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let [one, three, seven] = [Address::new(1)?, Address::new(3)?, Address::new(7)?];
/// let las: Las = [one, seven, three].into_iter().collect();
/// assert_eq!(las.next(one), Some(three));
/// assert_eq!(las.next(seven), Some(one));
/// assert_eq!(las.previous(one), Some(seven));
/// # Ok(())
/// # }
/// ```
///
/// Source: IEC 61158-4-3 and EN 50170-2 part 4, 4.1.1.1 (LAS, PS, NS).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[doc(alias = "List of Active Stations")]
pub struct Las(u128);

impl Las {
    /// Nobody.
    pub const EMPTY: Self = Self(0);

    /// One station alone.
    pub const fn only(address: Address) -> Self {
        Self(bit(address))
    }

    /// Adds a station.
    pub const fn insert(&mut self, address: Address) {
        self.0 |= bit(address);
    }

    /// Takes a station out.
    pub const fn remove(&mut self, address: Address) {
        self.0 &= !bit(address);
    }

    /// Takes all stations of another list out.
    pub const fn remove_all(&mut self, others: Self) {
        self.0 &= !others.0;
    }

    /// Whether a station is listed.
    pub const fn contains(self, address: Address) -> bool {
        self.0 & bit(address) != 0
    }

    /// How many stations there are.
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The stations listed here and not there.
    #[must_use]
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// The listed stations strictly between two addresses, going up from `from` and around the highest one.
    ///
    /// Between a station and itself lie all the others.
    #[must_use]
    pub const fn between(self, from: Address, to: Address) -> Self {
        let (below_to, above_from) = (below(to), !below(from) & !bit(from));
        Self(
            self.0
                & if from.value() < to.value() {
                    below_to & above_from
                } else {
                    below_to | above_from
                },
        )
    }

    /// The next listed station (NS) after an address, the station itself when no other is listed.
    pub const fn next(self, of: Address) -> Option<Address> {
        let above = self.0 & !below(of) & !bit(of);
        match if above != 0 { above } else { self.0 } {
            0 => None,
            stations => Some(Address::from_low_bits(stations.trailing_zeros() as u8)),
        }
    }

    /// The listed station before an address (PS), the station itself when no other is listed.
    pub const fn previous(self, of: Address) -> Option<Address> {
        let below = self.0 & below(of);
        match if below != 0 { below } else { self.0 } {
            0 => None,
            stations => Some(Address::from_low_bits(127 - stations.leading_zeros() as u8)),
        }
    }

    /// The stations in ascending order.
    pub fn iter(self) -> impl Iterator<Item = Address> {
        let mut rest = self.0;
        core::iter::from_fn(move || {
            let first = (rest != 0).then(|| Address::from_low_bits(rest.trailing_zeros() as u8));
            // Clears the lowest bit that is set.
            rest &= rest.wrapping_sub(1);
            first
        })
    }
}

impl FromIterator<Address> for Las {
    fn from_iter<I: IntoIterator<Item = Address>>(addresses: I) -> Self {
        let mut las = Self::EMPTY;
        addresses.into_iter().for_each(|address| las.insert(address));
        las
    }
}

const fn bit(address: Address) -> u128 {
    1 << address.value()
}

/// All addresses below one.
const fn below(address: Address) -> u128 {
    bit(address) - 1
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

    #[test]
    fn the_ring_closes_from_the_highest_to_the_lowest_address() {
        let las = las(&[0, 3, 126]);
        assert_eq!(las.next(at(0)), Some(at(3)));
        assert_eq!(las.next(at(3)), Some(at(126)));
        assert_eq!(las.next(at(126)), Some(at(0)));
        assert_eq!(las.previous(at(0)), Some(at(126)));
        assert_eq!(las.previous(at(126)), Some(at(3)));
        // Also for a station that is not listed.
        assert_eq!((las.next(at(50)), las.previous(at(50))), (Some(at(126)), Some(at(3))));
    }

    #[test]
    fn a_station_alone_follows_itself() {
        assert_eq!(Las::only(at(5)).next(at(5)), Some(at(5)));
        assert_eq!(Las::only(at(5)).previous(at(5)), Some(at(5)));
        assert_eq!(Las::EMPTY.next(at(5)), None);
        assert_eq!(Las::EMPTY.previous(at(5)), None);
        assert!(Las::EMPTY.is_empty() && !Las::only(at(5)).is_empty());
    }

    #[test]
    fn between_goes_up_and_around() {
        let all = las(&[1, 3, 5, 7]);
        assert_eq!(all.between(at(1), at(7)), las(&[3, 5]));
        assert_eq!(all.between(at(7), at(1)), Las::EMPTY);
        assert_eq!(all.between(at(5), at(3)), las(&[7, 1]));
        assert_eq!(all.between(at(3), at(3)), las(&[1, 5, 7]));
    }

    #[test]
    fn next_and_previous_agree_with_a_plain_search_for_all_pairs() {
        // Every pair of members and every asker; the oracle walks the addresses one by one.
        for first in 0..=126u8 {
            for second in first..=126 {
                let list = las(&[first, second]);
                assert_eq!(list.len(), if first == second { 1 } else { 2 });
                for asker in [0, 1, first, second, 63, 64, 125, 126] {
                    let walk = |step: u8| {
                        (1..=127u16)
                            .map(|distance| ((u16::from(asker) + distance * u16::from(step)) % 127) as u8)
                            .find(|&value| value == first || value == second)
                    };
                    assert_eq!(
                        list.next(at(asker)).map(Address::value),
                        walk(1),
                        "{first} {second} {asker}"
                    );
                    assert_eq!(
                        list.previous(at(asker)).map(Address::value),
                        walk(126),
                        "{first} {second} {asker}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_list_is_read_in_ascending_order() {
        assert!(las(&[9, 0, 126, 4]).iter().eq([0, 4, 9, 126].map(at)));
        assert_eq!(las(&[9, 0]).without(las(&[0, 4])), las(&[9]));
    }
}
