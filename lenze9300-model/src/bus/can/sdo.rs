//! Parameter jobs and answers of the system bus: eight octets, low octet first.
//!
//! ```text
//! octet   0        1    2      3         4    5    6    7
//!         command  index low,  subindex  data 1 … data 4
//!                  high
//! ```
//!
//! The index is 24575 less the code, the data the raw value of the code (×10000 unless the code is plain). Only expedited transfers
//! exist for numbers. Source: 9300 facts 5.
//!
//! ```
//! use lenze9300_model::bus::can::sdo::{Data, Request};
//!
//! // C0012 := 20 s, the example of the manual.
//! let request = Request::Write { code: 12, subcode: 0, data: Data::four(20_0000) };
//! assert_eq!(request.encode(), [0x23, 0xF3, 0x5F, 0x00, 0x40, 0x0D, 0x03, 0x00]);
//! ```

use thiserror::Error;

use crate::code::CodeError;

/// Command of a refusal, from either side.
const ABORT: u8 = 0x80;

/// Index of code 0.
const INDEX_BASE: u16 = 24_575;

/// Index of a code.
#[must_use]
pub const fn index_of(code: u16) -> u16 {
    INDEX_BASE.wrapping_sub(code)
}

/// One, two or four data octets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Data {
    octets: [u8; 4],
    len: u8,
}

impl Data {
    /// Four octets.
    #[must_use]
    pub const fn four(value: i32) -> Self {
        Self {
            octets: value.to_le_bytes(),
            len: 4,
        }
    }

    /// The two low octets of a value.
    #[must_use]
    pub const fn two(value: i32) -> Self {
        let [first, second, ..] = value.to_le_bytes();
        Self {
            octets: [first, second, 0, 0],
            len: 2,
        }
    }

    /// Number of octets: 1, 2 or 4.
    #[must_use]
    pub const fn len(self) -> u8 {
        self.len
    }

    /// Never.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        false
    }

    /// The value; one and two octets without sign, as the plain codes have them.
    #[must_use]
    pub const fn value(self) -> i32 {
        i32::from_le_bytes(self.octets)
    }

    /// Low bits of the command octet: 0b0011 four, 0b1011 two, 0b1111 one.
    const fn size_bits(self) -> u8 {
        ((4 - self.len) << 2) | 0b11
    }

    fn from_command(command: u8, octets: [u8; 4]) -> Option<Self> {
        let len = match command & 0x0F {
            0x3 => 4,
            0xB => 2,
            0xF => 1,
            _ => return None,
        };
        let mut data = Self { octets, len };
        data.octets[usize::from(len)..].fill(0);
        Some(data)
    }
}

/// A job, to the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Request {
    /// 0x40.
    Read {
        /// Code.
        code: u16,
        /// Subcode; 0 for a code without subcodes.
        subcode: u8,
    },
    /// 0x23, 0x2B, 0x2F.
    Write {
        /// Code.
        code: u16,
        /// Subcode; 0 for a code without subcodes.
        subcode: u8,
        /// Value.
        data: Data,
    },
}

impl Request {
    /// Code and subcode.
    #[must_use]
    pub const fn place(self) -> (u16, u8) {
        match self {
            Self::Read { code, subcode } | Self::Write { code, subcode, .. } => (code, subcode),
        }
    }

    /// The octets of the job.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        let (code, subcode) = self.place();
        match self {
            Self::Read { .. } => compose(0x40, code, subcode, [0; 4]),
            Self::Write { data, .. } => compose(0x20 | data.size_bits(), code, subcode, data.octets),
        }
    }

    /// Reads a job.
    ///
    /// # Errors
    /// [`NotAJob`].
    pub fn decode(octets: &[u8]) -> Result<Self, NotAJob> {
        let (command, code, subcode, data) = take_apart(octets).ok_or(NotAJob::Length { got: octets.len() })?;
        match command {
            0x40 => Ok(Self::Read { code, subcode }),
            0x23 | 0x2B | 0x2F => Data::from_command(command, data)
                .map(|data| Self::Write { code, subcode, data })
                .ok_or(NotAJob::Command { got: command }),
            _ => Err(NotAJob::Command { got: command }),
        }
    }
}

/// The refusal of eight octets whose command is none of the drive's, about the index that they name; `None` when nobody waits for an
/// answer: not eight octets, or the abort of a client (0x80).
///
/// A client that begins a segmented or block transfer learns at once that there is none, and does not run into its time-out.
/// Interpretation: DS301 has the server abort; reason as the bus module gives it (9300 facts 3.3).
#[must_use]
pub(super) fn refusal_of(octets: &[u8]) -> Option<Response> {
    let (command, code, subcode, _) = take_apart(octets)?;
    (command != ABORT).then_some(Response::Refused {
        code,
        subcode,
        reason: Refusal::IMPERMISSIBLE_JOB,
    })
}

/// Octets that are no job or no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NotAJob {
    /// Not eight octets.
    #[error("a parameter frame has 8 octets, got {got}")]
    Length {
        /// Number of octets.
        got: usize,
    },
    /// A command that is not in the table. Block transfers (0x21, 0x41) are not supported.
    #[error("command {got:#04X} is none of 0x23, 0x2B, 0x2F, 0x40, 0x43, 0x4B, 0x4F, 0x60, 0x80")]
    Command {
        /// The command octet.
        got: u8,
    },
}

/// An answer, from the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Response {
    /// 0x60: written.
    Written {
        /// Code.
        code: u16,
        /// Subcode.
        subcode: u8,
    },
    /// 0x43, 0x4B, 0x4F: read.
    Value {
        /// Code.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// Value.
        data: Data,
    },
    /// 0x80: refused.
    Refused {
        /// Code.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// Why.
        reason: Refusal,
    },
}

/// Why a drive refuses a job: data 3 and data 4 of the answer, and data 1 and 2 with them.
///
/// 6/6, 5/6 and 3/6 (data 3 / data 4) are documented; the others carry class, code and additional code of the bus module's
/// parameter channel in the same places (assumed). Source: 9300 facts 5 and 3.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Error)]
#[error("{}", self.text())]
pub struct Refusal {
    /// Data 4.
    pub class: u8,
    /// Data 3.
    pub code: u8,
    /// Data 1 and 2, low octet first.
    pub additional: u16,
}

impl Refusal {
    /// Wrong index: no such code.
    pub const WRONG_INDEX: Self = Self {
        class: 6,
        code: 6,
        additional: 0,
    };
    /// Wrong subindex.
    pub const WRONG_SUBINDEX: Self = Self {
        class: 6,
        code: 5,
        additional: 0,
    };
    /// Access denied.
    pub const ACCESS_DENIED: Self = Self {
        class: 6,
        code: 3,
        additional: 0,
    };

    /// Impermissible job: a command other than reading and writing 1, 2 or 4 octets.
    pub const IMPERMISSIBLE_JOB: Self = Self {
        class: 6,
        code: 5,
        additional: 0x0010,
    };

    fn text(self) -> String {
        match (self.class, self.code, self.additional) {
            (6, 6, _) => "the drive has no such code".to_owned(),
            (6, 5, 0x0010) => "the drive has no such command: it reads and writes 1, 2 or 4 octets at once".to_owned(),
            (6, 5, 0x0011 | 0) => "the code has no such subcode".to_owned(),
            (6, 5, 0x0012) => "too many data octets for this code".to_owned(),
            (6, 5, 0x0013) => "too few data octets for this code".to_owned(),
            (6, 3, _) => "the code cannot be written".to_owned(),
            (8, 0, 0x0030) => {
                "the value is not in the selection, or can be written only while the controller is inhibited".to_owned()
            }
            (8, 0, 0x0031) => "the value is above the range".to_owned(),
            (8, 0, 0x0032) => "the value is below the range".to_owned(),
            (8, 0, 0) => "not now: a parameter set is being transferred".to_owned(),
            (class, code, additional) => format!("refused with {code}/{class}, additional code {additional:#06X}"),
        }
    }
}

impl From<&CodeError> for Refusal {
    fn from(error: &CodeError) -> Self {
        match error {
            CodeError::UnknownCode { .. } => Self::WRONG_INDEX,
            CodeError::UnknownSubcode { .. } => Self::WRONG_SUBINDEX,
            CodeError::ReadOnly { .. } => Self::ACCESS_DENIED,
            other => {
                let reply = other.reply();
                Self {
                    class: reply.class,
                    code: reply.code,
                    additional: reply.additional,
                }
            }
        }
    }
}

impl Response {
    /// Code and subcode.
    #[must_use]
    pub const fn place(self) -> (u16, u8) {
        match self {
            Self::Written { code, subcode }
            | Self::Value { code, subcode, .. }
            | Self::Refused { code, subcode, .. } => (code, subcode),
        }
    }

    /// The octets of the answer.
    #[must_use]
    pub const fn encode(self) -> [u8; 8] {
        let (code, subcode) = self.place();
        match self {
            Self::Written { .. } => compose(0x60, code, subcode, [0; 4]),
            Self::Value { data, .. } => compose(0x40 | data.size_bits(), code, subcode, data.octets),
            Self::Refused { reason, .. } => {
                let [low, high] = reason.additional.to_le_bytes();
                compose(ABORT, code, subcode, [low, high, reason.code, reason.class])
            }
        }
    }

    /// Reads an answer.
    ///
    /// # Errors
    /// [`NotAJob`].
    pub fn decode(octets: &[u8]) -> Result<Self, NotAJob> {
        let (command, code, subcode, data) = take_apart(octets).ok_or(NotAJob::Length { got: octets.len() })?;
        match command {
            0x60 => Ok(Self::Written { code, subcode }),
            ABORT => {
                let [low, high, error, class] = data;
                let reason = Refusal {
                    class,
                    code: error,
                    additional: u16::from_le_bytes([low, high]),
                };
                Ok(Self::Refused { code, subcode, reason })
            }
            0x43 | 0x4B | 0x4F => Data::from_command(command, data)
                .map(|data| Self::Value { code, subcode, data })
                .ok_or(NotAJob::Command { got: command }),
            _ => Err(NotAJob::Command { got: command }),
        }
    }
}

const fn compose(command: u8, code: u16, subcode: u8, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = index_of(code).to_le_bytes();
    [command, low, high, subcode, data[0], data[1], data[2], data[3]]
}

fn take_apart(octets: &[u8]) -> Option<(u8, u16, u8, [u8; 4])> {
    let [command, low, high, subcode, a, b, c, d] = *octets else {
        return None;
    };
    let code = INDEX_BASE.wrapping_sub(u16::from_le_bytes([low, high]));
    Some((command, code, subcode, [a, b, c, d]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_manual_have_their_octets() {
        // Source: 9300 facts 5: PLC14 p. 3-45 and SYSBUS p. 2-16, 2-18.
        let write = Request::Write {
            code: 12,
            subcode: 0,
            data: Data::four(20_0000),
        };
        assert_eq!(write.encode(), [0x23, 0xF3, 0x5F, 0, 0x40, 0x0D, 0x03, 0]);
        assert_eq!(Request::decode(&write.encode()), Ok(write));
        let written = Response::Written { code: 12, subcode: 0 };
        assert_eq!(written.encode(), [0x60, 0xF3, 0x5F, 0, 0, 0, 0, 0]);
        let value = Response::decode(&[0x43, 0xC2, 0x5F, 0, 0xB0, 0x8F, 0x06, 0]);
        let expected = Response::Value {
            code: 61,
            subcode: 0,
            data: Data::four(43_0000),
        };
        assert_eq!(value, Ok(expected));
    }

    #[test]
    fn errors_carry_class_in_data_4_and_code_in_data_3() {
        // Source: 9300 facts 5: 6/6 wrong index, 5/6 wrong subindex, 3/6 access denied as data 3 / data 4.
        for (reason, data) in [
            (Refusal::WRONG_INDEX, [0, 0, 6, 6]),
            (Refusal::WRONG_SUBINDEX, [0, 0, 5, 6]),
            (Refusal::ACCESS_DENIED, [0, 0, 3, 6]),
        ] {
            let refused = Response::Refused {
                code: 9999,
                subcode: 2,
                reason,
            };
            assert_eq!(refused.encode()[4..], data);
            assert_eq!(Response::decode(&refused.encode()), Ok(refused));
        }
    }

    #[test]
    fn two_and_one_octets_have_no_sign_and_leave_the_rest_at_zero() {
        let read = Response::decode(&[0x4B, 0x78, 0x5F, 0, 0xFF, 0xFF, 0xAA, 0xAA]);
        let Ok(Response::Value { code, data, .. }) = read else {
            panic!("{read:?}");
        };
        assert_eq!((code, data.value(), data.len()), (135, 65_535, 2));
        assert_eq!(
            Request::Write {
                code: 135,
                subcode: 0,
                data
            }
            .encode(),
            [0x2B, 0x78, 0x5F, 0, 0xFF, 0xFF, 0, 0]
        );
    }

    #[test]
    fn what_is_neither_job_nor_answer_is_told() {
        assert_eq!(Request::decode(&[0x40]), Err(NotAJob::Length { got: 1 }));
        for command in [0x00, 0x21, 0x41, 0x60, 0xFF] {
            assert_eq!(
                Request::decode(&[command, 0, 0, 0, 0, 0, 0, 0]),
                Err(NotAJob::Command { got: command })
            );
        }
    }
}
