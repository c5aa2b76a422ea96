//! A frame of the bus.

/// A frame with an 11-bit identifier and up to eight octets, or a request for one.
///
/// # Example
///
/// ```
/// use lenze9300_model::bus::can::CanFrame;
///
/// let frame = CanFrame::new(0x601, &[0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]).unwrap();
/// assert_eq!((frame.id(), frame.data().len()), (0x601, 8));
/// assert!(CanFrame::new(0x800, &[]).is_none(), "11 bits");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CanFrame {
    id: u16,
    len: u8,
    data: [u8; 8],
    remote: bool,
}

impl CanFrame {
    /// A data frame; `None` for an identifier above 0x7FF or more than eight octets.
    #[must_use]
    pub fn new(id: u16, octets: &[u8]) -> Option<Self> {
        let mut data = [0; 8];
        data.get_mut(..octets.len())?.copy_from_slice(octets);
        let len = u8::try_from(octets.len()).ok()?;
        (id <= 0x7FF).then_some(Self {
            id,
            len,
            data,
            remote: false,
        })
    }

    /// A data frame of this program's own making: `len` octets of `data`, both within their bounds.
    pub(crate) const fn of(id: u16, data: [u8; 8], len: u8) -> Self {
        debug_assert!(id <= 0x7FF && len <= 8);
        Self {
            id: id & 0x7FF,
            len,
            data,
            remote: false,
        }
    }

    /// A remote frame that asks for `len` octets; `None` for an identifier above 0x7FF or more than eight octets.
    #[must_use]
    pub fn new_remote(id: u16, len: u8) -> Option<Self> {
        (id <= 0x7FF && len <= 8).then_some(Self {
            id,
            len,
            data: [0; 8],
            remote: true,
        })
    }

    /// The identifier, 0…0x7FF.
    #[must_use]
    pub const fn id(&self) -> u16 {
        self.id
    }

    /// The data length code, 0…8.
    #[must_use]
    pub const fn dlc(&self) -> u8 {
        self.len
    }

    /// The octets; none in a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        if self.remote {
            &[]
        } else {
            &self.data[..usize::from(self.len)]
        }
    }

    /// Whether it asks for a frame instead of being one.
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        self.remote
    }

    /// Bits on the bus, stuff bits and the pause of three bits included.
    ///
    /// Start of frame, identifier, RTR, IDE, r0, length, data and check sequence are stuffed: after five equal bits comes one of the
    /// other kind. Check delimiter, acknowledge slot and delimiter, end of frame and intermission (1 + 2 + 7 + 3) are not. Source:
    /// ISO 11898-1.
    #[must_use]
    pub fn bits(&self) -> u32 {
        let mut stuffed = Stuffed::default();
        stuffed.push_all(0, 1);
        stuffed.push_all(u32::from(self.id), 11);
        stuffed.push_all(u32::from(self.remote), 1);
        stuffed.push_all(0, 2);
        stuffed.push_all(u32::from(self.len), 4);
        for octet in self.data() {
            stuffed.push_all(u32::from(*octet), 8);
        }
        let check = u32::from(stuffed.check);
        stuffed.push_all(check, 15);
        stuffed.bits + 13
    }
}

/// Counts bits as they are stuffed and forms the check sequence over what was there before.
#[derive(Debug, Default)]
struct Stuffed {
    bits: u32,
    equal: u32,
    last: Option<bool>,
    check: u16,
}

impl Stuffed {
    fn push_all(&mut self, value: u32, count: u32) {
        for place in (0..count).rev() {
            self.push(value >> place & 1 == 1);
        }
    }

    fn push(&mut self, bit: bool) {
        self.bits += 1;
        self.equal = if self.last == Some(bit) { self.equal + 1 } else { 1 };
        self.last = Some(bit);
        if self.equal == 5 {
            self.bits += 1;
            self.last = Some(!bit);
            self.equal = 1;
        }
        // x¹⁵ + x¹⁴ + x¹⁰ + x⁸ + x⁷ + x⁴ + x³ + 1.
        let carry = (self.check >> 14 & 1 == 1) != bit;
        self.check = (self.check << 1) & 0x7FFF;
        if carry {
            self.check ^= 0x4599;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_47_bits_8_an_octet_and_at_most_a_quarter_of_stuffing() {
        // ISO 11898-1: 47 + 8 n bits with the intermission; of 34 + 8 n stuffed ones at most every fourth brings another.
        for (id, data) in [
            (0x555, &[0x55; 8][..]),
            (0x7FF, &[0xFF; 8]),
            (0, &[0; 8]),
            (0x123, &[1, 2, 3]),
            (0x601, &[0x40, 0xC2, 0x5F, 0, 0, 0, 0, 0]),
            (0x80, &[]),
        ] {
            let bits = CanFrame::new(id, data).expect("a frame").bits();
            let plain = 47 + 8 * data.len() as u32;
            let most = plain + (34 + 8 * data.len() as u32 - 1) / 4;
            assert!((plain..=most).contains(&bits), "{id:#X}: {bits}");
        }
    }

    #[test]
    fn alternating_bits_need_no_stuffing_and_equal_ones_much() {
        let alternating = CanFrame::new(0x555, &[0x55; 8]).expect("a frame").bits();
        let equal = CanFrame::new(0, &[0; 8]).expect("a frame").bits();
        assert!(
            alternating <= 47 + 64 + 5,
            "only control field and check sequence: {alternating}"
        );
        // 1 + 11 + 3 zeros give three stuff bits, the length 8 is 1000, its 3 and the data's 64 zeros give thirteen.
        assert!(equal >= 47 + 64 + 16, "{equal}");
    }
}
