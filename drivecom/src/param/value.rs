//! Data of one to four octets, left-aligned in octets 5–8.

/// Length of the data of a job or an answer; two bits of the service octet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum DataLength {
    /// One octet, in octet 5.
    One,
    /// Two octets, in octets 5 and 6.
    Two,
    /// Three octets, in octets 5 to 7.
    Three,
    /// Four octets: the fixed-point values of nearly all codes.
    #[default]
    Four,
}

impl DataLength {
    /// The length of a two-bit code; higher bits are ignored.
    #[must_use]
    pub const fn from_code(code: u8) -> Self {
        match code & 0b11 {
            0 => Self::One,
            1 => Self::Two,
            2 => Self::Three,
            _ => Self::Four,
        }
    }

    /// The two-bit code, 0…3.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Octets, 1…4.
    #[must_use]
    pub const fn octets(self) -> u8 {
        self as u8 + 1
    }

    /// The number in left-aligned data, sign extended. Octets beyond the length are ignored.
    ///
    /// A bit string (C0135, C0150) of two octets is recovered by `as u16`.
    #[must_use]
    pub const fn read(self, data: [u8; 4]) -> i32 {
        i32::from_be_bytes(data) >> self.padding_bits()
    }

    /// The left-aligned data of a number: its lowest octets, zeros behind.
    ///
    /// A number too large for the length loses its high octets, as in any drive.
    #[must_use]
    pub const fn write(self, value: i32) -> [u8; 4] {
        (value << self.padding_bits()).to_be_bytes()
    }

    const fn padding_bits(self) -> u32 {
        24 - 8 * self as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Source: 9300 facts 3.2: "length 1 in byte 5, length 2 in bytes 5–6, rest 0".
    #[test]
    fn short_data_is_left_aligned() {
        assert_eq!(DataLength::One.write(0x12), [0x12, 0, 0, 0]);
        assert_eq!(DataLength::Two.write(0x1234), [0x12, 0x34, 0, 0]);
        assert_eq!(DataLength::Three.write(0x12_3456), [0x12, 0x34, 0x56, 0]);
        assert_eq!(DataLength::Four.write(1_504_000), [0x00, 0x16, 0xF3, 0x00]);
    }

    #[test]
    fn reading_extends_the_sign_and_ignores_the_padding() {
        assert_eq!(DataLength::One.read([0xFF, 9, 9, 9]), -1);
        assert_eq!(DataLength::Two.read([0x80, 0x00, 9, 9]), -32_768);
        assert_eq!(DataLength::Two.read([0x80, 0x00, 9, 9]) as u16, 0x8000);
        assert_eq!(DataLength::Three.read([0x7F, 0xFF, 0xFF, 9]), 0x7F_FFFF);
        assert_eq!(DataLength::Four.read([0x80, 0, 0, 0]), i32::MIN);
    }

    #[test]
    fn the_two_bit_code_survives_the_round_trip() {
        for code in 0..=3 {
            assert_eq!(DataLength::from_code(code).code(), code);
            assert_eq!(DataLength::from_code(code).octets(), code + 1);
        }
    }
}
