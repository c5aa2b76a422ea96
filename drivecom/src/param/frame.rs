//! The eight octets of the parameter channel.

use core::fmt;

use super::error::ErrorCode;
use super::value::DataLength;

/// One parameter telegram, request or answer: any eight octets are one.
///
/// Layout:
///
/// | octet | 1 | 2 | 3, 4 | 5–8 |
/// |---|---|---|---|---|
/// | meaning | service | subindex | index, high octet first | data, or class, code and additional code of an error |
///
/// Source: film-feed specification, section 3 (fig. 20); 9300 fact sheet, section 3.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
#[doc(alias = "Telegramm")]
pub struct Frame(pub [u8; 8]);

impl Frame {
    /// Octets of a frame.
    pub const LEN: usize = 8;

    /// All octets zero: what a channel shows before anybody spoke.
    pub const EMPTY: Self = Self([0; 8]);

    /// A frame of these parts.
    #[must_use]
    pub const fn new(service: Service, subindex: u8, index: u16, data: [u8; 4]) -> Self {
        let [index_high, index_low] = index.to_be_bytes();
        let [d0, d1, d2, d3] = data;
        Self([service.0, subindex, index_high, index_low, d0, d1, d2, d3])
    }

    /// Octet 1.
    #[must_use]
    #[doc(alias = "Servicebyte")]
    pub const fn service(&self) -> Service {
        Service(self.0[0])
    }

    /// Octet 2.
    #[must_use]
    pub const fn subindex(&self) -> u8 {
        self.0[1]
    }

    /// Octets 3 and 4: 24575 − code number.
    #[must_use]
    pub const fn index(&self) -> u16 {
        u16::from_be_bytes([self.0[2], self.0[3]])
    }

    /// Octets 5 to 8 as they came.
    #[must_use]
    pub const fn data(&self) -> [u8; 4] {
        let [.., d0, d1, d2, d3] = self.0;
        [d0, d1, d2, d3]
    }

    /// The number in octets 5 to 8 for data of that length.
    #[must_use]
    pub const fn value(&self, length: DataLength) -> i32 {
        length.read(self.data())
    }

    /// The error of an answer; `None` when its error bit is 0.
    #[must_use]
    pub const fn error(&self) -> Option<ErrorCode> {
        if self.service().is_error() {
            Some(ErrorCode::from_data(self.data()))
        } else {
            None
        }
    }

    /// The same frame with another service octet.
    #[must_use]
    pub const fn with_service(mut self, service: Service) -> Self {
        self.0[0] = service.0;
        self
    }
}

impl From<[u8; 8]> for Frame {
    fn from(octets: [u8; 8]) -> Self {
        Self(octets)
    }
}

impl From<Frame> for [u8; 8] {
    fn from(frame: Frame) -> Self {
        frame.0
    }
}

/// The octets in hex: `32 01 5F D8 00 16 F3 00`.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, octet) in self.0.iter().enumerate() {
            let space = if i == 0 { "" } else { " " };
            write!(f, "{space}{octet:02X}")?;
        }
        Ok(())
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Frame({self})")
    }
}

/// The service octet: job, data length, handshake, error. Every value is legal and kept as it came.
///
/// | bits | request | answer |
/// |---|---|---|
/// | 0–2 | 0 no job, 1 read, 2 write, others reserved | 0 (older modules: copied from the request) |
/// | 3 | reserved | 0 |
/// | 4–5 | data length − 1 | length of the answer data − 1 |
/// | 6 | handshake: inverted = new job | copied when the job is done |
/// | 7 | 0 | error |
///
/// Source: 9300 fact sheet, section 3.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Service(pub u8);

impl Service {
    /// The handshake bit, bit 6.
    pub const HANDSHAKE: u8 = 0x40;
    /// The error bit, bit 7.
    pub const ERROR: u8 = 0x80;
    /// Job code "no job".
    pub const NO_JOB: u8 = 0;
    /// Job code "read".
    pub const READ: u8 = 1;
    /// Job code "write".
    pub const WRITE: u8 = 2;

    /// The octet with this job code (lowest three bits count) and length, handshake and error 0.
    #[must_use]
    pub const fn new(job: u8, length: DataLength) -> Self {
        Self((job & 0x07) | length.code() << 4)
    }

    /// Bits 0–2: 0 no job, 1 read, 2 write; the others are reserved.
    #[must_use]
    pub const fn job(self) -> u8 {
        self.0 & 0x07
    }

    /// Bits 4–5.
    #[must_use]
    pub const fn length(self) -> DataLength {
        DataLength::from_code(self.0 >> 4)
    }

    /// Bit 6.
    #[must_use]
    pub const fn handshake(self) -> bool {
        self.0 & Self::HANDSHAKE != 0
    }

    /// Bit 7: the answer is an error.
    #[must_use]
    pub const fn is_error(self) -> bool {
        self.0 & Self::ERROR != 0
    }

    /// The same octet with bit 6 set to `on`.
    #[must_use]
    pub const fn with_handshake(self, on: bool) -> Self {
        if on {
            Self(self.0 | Self::HANDSHAKE)
        } else {
            Self(self.0 & !Self::HANDSHAKE)
        }
    }

    /// The same octet with bit 7 set to `on`.
    #[must_use]
    pub const fn with_error(self, on: bool) -> Self {
        if on {
            Self(self.0 | Self::ERROR)
        } else {
            Self(self.0 & !Self::ERROR)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    // Source: 9300 facts 11: C0039/1 := 150.4 is index 0x5FD8, data 00 16 F3 00; film-feed section 3: 0x32 = write.
    #[test]
    fn the_manuals_example_has_these_octets() {
        let service = Service::new(Service::WRITE, DataLength::Four);
        let frame = Frame::new(service, 1, 0x5FD8, DataLength::Four.write(1_504_000));
        assert_eq!(frame, Frame([0x32, 0x01, 0x5F, 0xD8, 0x00, 0x16, 0xF3, 0x00]));
        assert_eq!(frame.to_string(), "32 01 5F D8 00 16 F3 00");
    }

    #[test]
    fn octets_become_a_frame_and_the_same_octets_again() {
        let octets = [0x32, 0x01, 0x5F, 0xD8, 0x00, 0x16, 0xF3, 0x00];
        let frame = Frame::from(octets);
        assert_eq!(frame, Frame(octets));
        assert_eq!(<[u8; 8]>::from(frame), octets);
        assert_eq!(format!("{frame:?}"), "Frame(32 01 5F D8 00 16 F3 00)");
    }

    #[test]
    fn a_read_of_four_octets_is_0x31_and_0x71() {
        let service = Service::new(Service::READ, DataLength::Four);
        assert_eq!(service, Service(0x31));
        assert_eq!(service.with_handshake(true), Service(0x71));
        assert_eq!(service.with_handshake(true).with_handshake(false), service);
    }

    #[test]
    fn a_bit_that_is_set_already_stays_set() {
        assert_eq!(Service(0x71).with_handshake(true), Service(0x71));
        assert_eq!(Service(0xB0).with_error(true), Service(0xB0));
        assert_eq!(Service(0xB0).with_error(false), Service(0x30));
    }

    // Source: 9300 facts 3.3, the example answer.
    #[test]
    fn an_error_answer_is_recognised_by_bit_7_alone() {
        let refused = Frame([0xB0, 0x00, 0x5F, 0xA9, 0x08, 0x00, 0x00, 0x30]);
        assert_eq!(refused.error(), Some(ErrorCode::new(0x08, 0x00, 0x0030)));
        let done = Frame([0x30, 0x00, 0x5F, 0xA9, 0x08, 0x00, 0x00, 0x30]);
        assert_eq!(done.error(), None);
        assert_eq!(done.value(DataLength::Four), 0x0800_0030);
    }

    proptest! {
        #[test]
        fn taking_a_frame_apart_and_building_it_again_is_the_identity(octets in any::<[u8; 8]>()) {
            let frame = Frame(octets);
            prop_assert_eq!(Frame::new(frame.service(), frame.subindex(), frame.index(), frame.data()), frame);
        }
    }
}
