//! The seven telegrams of the parameter channel, side by side in the instance data.

use drivecom::CodeNumber;

use super::{inputs::Inputs, real};

/// A parameter telegram: service, subindex, index and four octets of data, big-endian.
///
/// Source: film-feed specification, section 3 (fig. 20).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ParameterTelegram {
    /// Service and handshake; see [`ParameterTelegram::HANDSHAKE`].
    #[doc(alias = "Servicebyte")]
    pub service: u8,
    /// Subindex of the code.
    #[doc(alias = "Subindex")]
    pub subindex: u8,
    /// 24575 − code number.
    #[doc(alias = "Index")]
    pub index: u16,
    /// Value ×10000, or the error code of the answer.
    #[doc(alias = "Data")]
    pub data: u32,
}

impl ParameterTelegram {
    /// Service: read 4 octets.
    #[doc(alias = "Lesebefehl")]
    pub const READ: u8 = 0x31;
    /// Service: write 4 octets.
    #[doc(alias = "Schreibbefehl")]
    pub const WRITE: u8 = 0x32;
    /// Handshake bit of the service octet.
    pub const HANDSHAKE: u8 = 0x40;

    /// The 8 octets on the bus.
    pub fn to_bytes(self) -> [u8; 8] {
        let [i1, i0] = self.index.to_be_bytes();
        let [d3, d2, d1, d0] = self.data.to_be_bytes();
        [self.service, self.subindex, i1, i0, d3, d2, d1, d0]
    }

    /// The telegram in 8 octets from the bus. Every pattern is one.
    pub fn from_bytes(octets: [u8; 8]) -> Self {
        let [service, subindex, i1, i0, d3, d2, d1, d0] = octets;
        Self {
            service,
            subindex,
            index: u16::from_be_bytes([i1, i0]),
            data: u32::from_be_bytes([d3, d2, d1, d0]),
        }
    }

    /// State of the handshake bit.
    pub fn handshake(self) -> bool {
        self.service & Self::HANDSHAKE != 0
    }

    /// Bit 7 of the service: the drive refused (9300 fact sheet, section 3.1). The original never looks at it.
    pub fn is_refusal(self) -> bool {
        self.service & 0x80 != 0
    }

    /// The code it is about, such as `C1301/1`, or the index where there is no such code.
    pub fn code_name(self) -> String {
        match CodeNumber::from_index(self.index) {
            Some(code) => format!("C{:04}/{}", code.number(), self.subindex),
            None => format!("index 0x{:04X}/{}", self.index, self.subindex),
        }
    }

    /// Bit 0 of the service: the original's test for a read.
    pub(crate) fn is_read(self) -> bool {
        self.service & 0x01 != 0
    }

    /// Bit 1 of the service: the original's test for a write.
    pub(crate) fn is_write(self) -> bool {
        self.service & 0x02 != 0
    }
}

/// Constants read from the drive, as REAL.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Constants {
    /// C1204, mm per revolution of the gear output.
    #[doc(alias = "Vorschubkonstante")]
    pub feed_constant: f32,
    /// C1202.
    #[doc(alias = "Getriebe_zaehler")]
    pub gear_numerator: f32,
    /// C1203.
    #[doc(alias = "Getriebe_nenner")]
    pub gear_denominator: f32,
}

/// Scale of a code on the bus: four decimals.
const CODE_SCALE: f32 = 10_000.0;
/// A percentage input has two decimals, the code four.
const PERCENT_TO_CODE: u32 = 100;
/// The distance input has one decimal, the code four.
const DISTANCE_TO_CODE: u32 = 1_000;

/// Service, subindex and code of the seven telegrams, in the order they are sent.
const CATALOGUE: [(u8, u8, u16); Telegrams::COUNT] = [
    (ParameterTelegram::WRITE, 1, 1302),
    (ParameterTelegram::WRITE, 2, 1302),
    (ParameterTelegram::WRITE, 1, 1303),
    (ParameterTelegram::WRITE, 1, 1301),
    (ParameterTelegram::READ, 0, 1204),
    (ParameterTelegram::READ, 0, 1202),
    (ParameterTelegram::READ, 0, 1203),
];

/// The telegram memory, addressed like the instance data block of the original: by octets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[doc(alias = "PAR_Telegramm")]
pub(crate) struct Telegrams([ParameterTelegram; Self::COUNT]);

impl Telegrams {
    /// Number of telegrams. Odd, so the handshake of a given telegram alternates from round to round.
    pub(crate) const COUNT: usize = 7;
    /// Octet address of the first telegram in the instance data: inputs take 12 octets, outputs 10.
    pub(crate) const FIRST: u16 = 22;
    /// Octets per telegram.
    pub(crate) const SIZE: u16 = 8;

    /// Network "Telegramm fuer Parameterkommunikation": fills all seven from the clamped inputs, and takes the constants
    /// out of the three read ones, in every cycle.
    pub(crate) fn build(&mut self, inputs: &Inputs) -> Constants {
        for (telegram, (service, subindex, code)) in self.0.iter_mut().zip(CATALOGUE) {
            telegram.service = service;
            telegram.subindex = subindex;
            telegram.index = 24_575 - code;
        }
        // The original multiplies as DINT after loading the INT without its sign. Clamped values have none to lose.
        let scaled = |int: i16, factor: u32| u32::from(int as u16) * factor;
        let [
            velocity,
            mark_velocity,
            acceleration,
            distance,
            feed,
            numerator,
            denominator,
        ] = &mut self.0;
        velocity.data = scaled(inputs.velocity, PERCENT_TO_CODE);
        mark_velocity.data = scaled(inputs.mark_velocity, PERCENT_TO_CODE);
        acceleration.data = scaled(inputs.acceleration, PERCENT_TO_CODE);
        distance.data = scaled(inputs.distance, DISTANCE_TO_CODE);

        let constant = |telegram: &ParameterTelegram| real::div(real::dtr(telegram.data as i32), CODE_SCALE);
        Constants {
            feed_constant: constant(feed),
            gear_numerator: constant(numerator),
            gear_denominator: constant(denominator),
        }
    }

    /// The telegram at octet address `pointer`. `None` outside the seven, where the net never points.
    pub(crate) fn at(&self, pointer: u16) -> Option<&ParameterTelegram> {
        self.0.get(Self::slot(pointer)?)
    }

    /// Mutable access like [`at`](Self::at).
    pub(crate) fn at_mut(&mut self, pointer: u16) -> Option<&mut ParameterTelegram> {
        self.0.get_mut(Self::slot(pointer)?)
    }

    /// All seven in order.
    pub(crate) fn all(&self) -> &[ParameterTelegram; Self::COUNT] {
        &self.0
    }

    /// Which of the seven stands at octet address `pointer`; no less than 7 behind the last.
    pub(crate) fn slot(pointer: u16) -> Option<usize> {
        Some(usize::from(pointer.checked_sub(Self::FIRST)? / Self::SIZE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seven_telegrams_stand_in_the_order_of_the_source() {
        let inputs = Inputs {
            velocity: 10_000,
            mark_velocity: 2_500,
            acceleration: 5_000,
            distance: 12_000,
            ..Inputs::default()
        };
        let mut telegrams = Telegrams::default();
        telegrams.build(&inputs);
        // Film-feed specification, section 8 step 11; index = 24575 − code (section 3).
        let expected: [[u8; 8]; 7] = [
            [0x32, 1, 0x5A, 0xE9, 0x00, 0x0F, 0x42, 0x40], // 100 % = 1 000 000
            [0x32, 2, 0x5A, 0xE9, 0x00, 0x03, 0xD0, 0x90], // 25 % = 250 000
            [0x32, 1, 0x5A, 0xE8, 0x00, 0x07, 0xA1, 0x20], // 50 % = 500 000
            [0x32, 1, 0x5A, 0xEA, 0x00, 0xB7, 0x1B, 0x00], // 1200 mm = 12 000 000
            [0x31, 0, 0x5B, 0x4B, 0, 0, 0, 0],
            [0x31, 0, 0x5B, 0x4D, 0, 0, 0, 0],
            [0x31, 0, 0x5B, 0x4C, 0, 0, 0, 0],
        ];
        for (slot, octets) in (0u16..).zip(expected) {
            let telegram = telegrams.at(Telegrams::FIRST + 8 * slot).copied();
            assert_eq!(telegram, Some(ParameterTelegram::from_bytes(octets)), "telegram {slot}");
            assert_eq!(telegram.unwrap().to_bytes(), octets);
        }
        assert_eq!(telegrams.at(Telegrams::FIRST + 56), None);
        assert_eq!(telegrams.at(0), None);
    }

    // Bit 7 of the service is the error bit (9300 fact sheet, section 3.1).
    #[test]
    fn bit_7_of_the_service_is_a_refusal() {
        for service in 0..=0xFF {
            let telegram = ParameterTelegram::from_bytes([service, 0, 0, 0, 0, 0, 0, 0]);
            assert_eq!(telegram.is_refusal(), service >= 128, "{service:02X}");
        }
    }

    // The index is 24575 less the code (film-feed specification, section 3).
    #[test]
    fn a_telegram_is_named_by_its_code_as_far_as_its_index_is_one() {
        let named = |[high, low]: [u8; 2], subindex| {
            ParameterTelegram::from_bytes([0x31, subindex, high, low, 0, 0, 0, 0]).code_name()
        };
        assert_eq!(named((24_575_u16 - 1301).to_be_bytes(), 1), "C1301/1");
        assert_eq!(named((24_575_u16 - 93).to_be_bytes(), 0), "C0093/0");
        assert_eq!(named([0x60, 0x00], 2), "index 0x6000/2");
    }

    // Film-feed specification, section 3: 0x31 reads, 0x32 writes, bit 6 is the handshake.
    #[test]
    fn a_service_reads_or_writes_whatever_its_handshake() {
        for handshake in [0x00, 0x40] {
            for (service, read, write) in [(0x31, true, false), (0x32, false, true)] {
                let telegram = ParameterTelegram {
                    service: service | handshake,
                    ..ParameterTelegram::default()
                };
                assert_eq!((telegram.is_read(), telegram.is_write()), (read, write));
                assert_eq!(telegram.handshake(), handshake != 0);
            }
        }
    }
}
