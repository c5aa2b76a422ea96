//! Octet stores of fixed capacity: process images, parameter and diagnosis strings.

use core::fmt;
use core::ops::Deref;

/// Most data octets a telegram without SAP octets carries, and so most inputs or outputs of a slave.
///
/// Source: IEC 61158-4-3: DATA_UNIT of an SD2 telegram, 246 octets without SAPs, of which DP uses 244.
pub const MAX_DATA: usize = 244;

/// A process image of one direction: at most 244 octets.
pub type ProcessImage = Octets<MAX_DATA>;

/// An octet string of at most `N` octets, held in place.
///
/// Dereferences to the octets in use.
///
/// # Example
///
/// ```
/// use dp_master::dp::Octets;
/// let name: Octets<4> = Octets::from_slice(&[1, 2]).unwrap();
/// assert_eq!(&name[..], [1, 2]);
/// assert!(Octets::<1>::from_slice(&[1, 2]).is_none());
/// ```
#[derive(Clone, Copy)]
pub struct Octets<const N: usize> {
    len: u8,
    octets: [u8; N],
}

impl<const N: usize> Octets<N> {
    /// No octets.
    pub const EMPTY: Self = Self { len: 0, octets: [0; N] };

    /// A copy of `octets`; `None` when there are more than `N` (or than 255).
    pub fn from_slice(octets: &[u8]) -> Option<Self> {
        let mut image = Self::EMPTY;
        image.replace(octets).then_some(image)
    }

    /// `len` octets of zero; as many as fit when `len` is above `N`.
    pub fn zeroed(len: usize) -> Self {
        let mut image = Self::EMPTY;
        image.reset(len);
        image
    }

    /// Replaces the content; `false` (and nothing changed) when `octets` do not fit.
    pub fn replace(&mut self, octets: &[u8]) -> bool {
        let Ok(len) = u8::try_from(octets.len()) else {
            return false;
        };
        let Some(target) = self.octets.get_mut(..octets.len()) else {
            return false;
        };
        target.copy_from_slice(octets);
        self.len = len;
        true
    }

    /// Makes the content `len` zeros; as many as fit when `len` is above `N`.
    pub fn reset(&mut self, len: usize) {
        self.len = len.min(N).min(255) as u8;
        self.octets.fill(0);
    }

    /// The octets in use.
    pub fn as_slice(&self) -> &[u8] {
        self.octets.get(..usize::from(self.len)).unwrap_or(&[])
    }

    /// The octets in use, to be written.
    pub fn as_mut_slice(&mut self) -> &mut [u8] {
        self.octets.get_mut(..usize::from(self.len)).unwrap_or(&mut [])
    }
}

impl<const N: usize> Default for Octets<N> {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<const N: usize> Deref for Octets<N> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.as_slice()
    }
}

impl<const N: usize> PartialEq for Octets<N> {
    // Octets beyond the length are left-overs and count for nothing.
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<const N: usize> Eq for Octets<N> {}

impl<const N: usize> fmt::Debug for Octets<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, octet) in self.iter().enumerate() {
            let gap = if place == 0 { "" } else { " " };
            write!(f, "{gap}{octet:02X}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_leaves_the_old_content() {
        let mut image: Octets<2> = Octets::from_slice(&[7, 8]).unwrap();
        assert!(!image.replace(&[1, 2, 3]));
        assert_eq!(image.as_slice(), [7, 8]);
    }

    #[test]
    fn left_over_octets_do_not_count_in_a_comparison() {
        let mut image: Octets<4> = Octets::from_slice(&[1, 2, 3]).unwrap();
        assert!(image.replace(&[1]));
        assert_eq!(image, Octets::from_slice(&[1]).unwrap());
    }

    #[test]
    fn as_many_octets_as_fit_and_no_more() {
        assert_eq!(Octets::<3>::zeroed(2).as_slice(), [0, 0]);
        assert_eq!(Octets::<3>::zeroed(4).as_slice(), [0; 3]);
        assert_eq!(Octets::<300>::zeroed(300).len(), 255);
        assert!(Octets::<300>::from_slice(&[1; 255]).is_some());
        assert_eq!(Octets::<300>::from_slice(&[1; 256]), None);
        assert_eq!(Octets::<3>::default(), Octets::EMPTY);
    }

    #[test]
    fn a_reset_leaves_nothing_of_what_was_there() {
        let mut image: Octets<4> = Octets::from_slice(&[1, 2, 3, 4]).unwrap();
        image.reset(1);
        image.as_mut_slice()[0] = 9;
        assert_eq!(image.as_slice(), [9]);
        image.reset(4);
        assert_eq!(image.as_slice(), [0; 4]);
    }

    #[test]
    fn octets_are_shown_as_they_stand_in_a_capture() {
        let image: Octets<4> = Octets::from_slice(&[0x01, 0xA0, 0xFF]).unwrap();
        assert_eq!(format!("{image:?}"), "01 A0 FF");
        assert_eq!(format!("{:?}", Octets::<4>::EMPTY), "");
    }
}
