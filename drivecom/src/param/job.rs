//! What a master asks of a drive.

use core::fmt;

use super::error::ErrorCode;
use super::frame::{Frame, Service};
use super::value::DataLength;
use crate::code::{CodeNumber, Subcode};

/// Direction of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum JobKind {
    /// Read the code.
    #[doc(alias = "Lesebefehl")]
    Read,
    /// Write the code.
    #[doc(alias = "Schreibbefehl")]
    Write,
}

impl JobKind {
    /// Job code of the service octet: 1 or 2.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Read => Service::READ,
            Self::Write => Service::WRITE,
        }
    }
}

/// One job of the parameter channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[doc(alias = "Auftrag")]
pub struct Job {
    /// Read or write.
    pub kind: JobKind,
    /// The code.
    pub code: CodeNumber,
    /// The subcode, 0 for a code without subcodes.
    pub subcode: Subcode,
    /// Data of a write, in ten-thousandths for all ordinary codes. Of a read: whatever stood in the request.
    pub value: i32,
    /// Length of the data.
    pub length: DataLength,
}

impl Job {
    /// A read of four octets.
    #[must_use]
    pub const fn read(code: CodeNumber, subcode: Subcode) -> Self {
        Self {
            kind: JobKind::Read,
            code,
            subcode,
            value: 0,
            length: DataLength::Four,
        }
    }

    /// A write of four octets; `value` as the bus carries it (ten-thousandths for all ordinary codes).
    #[must_use]
    pub const fn write(code: CodeNumber, subcode: Subcode, value: i32) -> Self {
        Self {
            kind: JobKind::Write,
            code,
            subcode,
            value,
            length: DataLength::Four,
        }
    }

    /// The request of this job with the given level of the handshake bit.
    #[must_use]
    pub const fn request(self, handshake: bool) -> Frame {
        let service = Service::new(self.kind.code(), self.length).with_handshake(handshake);
        Frame::new(
            service,
            self.subcode.0,
            self.code.index(),
            self.length.write(self.value),
        )
    }

    /// Checks the length of the job against the code's.
    ///
    /// # Errors
    ///
    /// [`ErrorCode::DATA_TOO_LONG`] or [`ErrorCode::DATA_TOO_SHORT`].
    pub fn check_length(self, expected: DataLength) -> Result<(), ErrorCode> {
        match self.length.cmp(&expected) {
            core::cmp::Ordering::Greater => Err(ErrorCode::DATA_TOO_LONG),
            core::cmp::Ordering::Less => Err(ErrorCode::DATA_TOO_SHORT),
            core::cmp::Ordering::Equal => Ok(()),
        }
    }

    /// Checks the value of a write against the code's range, ends included. A read has no value to check.
    ///
    /// # Errors
    ///
    /// [`ErrorCode::TOO_HIGH`] or [`ErrorCode::TOO_LOW`].
    pub const fn check_range(self, min: i32, max: i32) -> Result<(), ErrorCode> {
        match self.kind {
            JobKind::Write if self.value > max => Err(ErrorCode::TOO_HIGH),
            JobKind::Write if self.value < min => Err(ErrorCode::TOO_LOW),
            _ => Ok(()),
        }
    }
}

/// `read C1204`, `write C1301/1 := 12000000`: the value as the bus carries it.
impl fmt::Display for Job {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            JobKind::Read => write!(f, "read {}{}", self.code, self.subcode),
            JobKind::Write => write!(f, "write {}{} := {}", self.code, self.subcode, self.value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(number: u16) -> CodeNumber {
        CodeNumber::new(number).unwrap()
    }

    // Source: 9300 facts 3.2, table of examples; service octets of film-feed section 3.
    #[test]
    fn the_telegrams_of_the_film_feed_have_these_octets() {
        let cases = [
            (
                Job::write(code(1302), Subcode(1), 1_000_000),
                [0x32, 1, 0x5A, 0xE9, 0x00, 0x0F, 0x42, 0x40],
            ),
            (
                Job::write(code(1302), Subcode(2), 200_000),
                [0x32, 2, 0x5A, 0xE9, 0x00, 0x03, 0x0D, 0x40],
            ),
            (
                Job::write(code(1303), Subcode(1), 1_000_000),
                [0x32, 1, 0x5A, 0xE8, 0x00, 0x0F, 0x42, 0x40],
            ),
            (
                Job::write(code(1301), Subcode(1), 12_000_000),
                [0x32, 1, 0x5A, 0xEA, 0x00, 0xB7, 0x1B, 0x00],
            ),
            (Job::read(code(1204), Subcode::NONE), [0x31, 0, 0x5B, 0x4B, 0, 0, 0, 0]),
            (Job::read(code(1202), Subcode::NONE), [0x31, 0, 0x5B, 0x4D, 0, 0, 0, 0]),
            (Job::read(code(1203), Subcode::NONE), [0x31, 0, 0x5B, 0x4C, 0, 0, 0, 0]),
        ];
        for (job, mut octets) in cases {
            assert_eq!(job.request(false), Frame(octets), "{job}");
            octets[0] |= 0x40;
            assert_eq!(job.request(true), Frame(octets), "{job}");
        }
    }

    #[test]
    fn a_length_other_than_the_codes_is_refused_by_its_direction() {
        let mut job = Job::read(code(150), Subcode::NONE);
        assert_eq!(job.check_length(DataLength::Two), Err(ErrorCode::DATA_TOO_LONG));
        job.length = DataLength::Two;
        assert_eq!(job.check_length(DataLength::Two), Ok(()));
        assert_eq!(job.check_length(DataLength::Four), Err(ErrorCode::DATA_TOO_SHORT));
    }

    #[test]
    fn only_the_value_of_a_write_can_be_out_of_range() {
        let write = |value| Job::write(code(1303), Subcode(1), value).check_range(-5, 5);
        assert_eq!(write(6), Err(ErrorCode::TOO_HIGH));
        assert_eq!(write(-6), Err(ErrorCode::TOO_LOW));
        assert_eq!((write(5), write(-5)), (Ok(()), Ok(())));
        let mut read = Job::read(code(1303), Subcode(1));
        read.value = 99;
        assert_eq!(read.check_range(-5, 5), Ok(()));
    }

    #[test]
    fn a_job_prints_as_an_engineer_says_it() {
        assert_eq!(Job::read(code(1204), Subcode::NONE).to_string(), "read C1204");
        assert_eq!(
            Job::write(code(1301), Subcode(1), 12_000_000).to_string(),
            "write C1301/1 := 12000000"
        );
    }
}
