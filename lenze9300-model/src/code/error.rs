//! Negative answers of the parameter channel.

use thiserror::Error;

use super::table::{DataLength, entry};

/// Octets 5 to 8 of a negative answer: class, code and additional code.
///
/// Layout: octet 5 class, octet 6 code, octets 7 and 8 additional code, high octet first. Source: 9300 facts 3.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ErrorReply {
    /// Error class (0x06 access, 0x08 other).
    pub class: u8,
    /// Error code within the class.
    pub code: u8,
    /// Additional code.
    pub additional: u16,
}

impl ErrorReply {
    /// The four data octets of the answer, in the order of the wire.
    pub const fn octets(self) -> [u8; 4] {
        let [high, low] = self.additional.to_be_bytes();
        [self.class, self.code, high, low]
    }
}

/// Why a code could not be read or written.
///
/// Each variant is one row of the list in 9300 facts 3.3 (the row 8/0/0030 has two causes, hence two variants). Rows
/// that the model never sends are left out. Values are raw, as the bus carries them (×10000 unless the code is plain); the sentences
/// show them in the code's own unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CodeError {
    /// The job is neither "no job", read nor write (6/5/0010).
    #[error("impermissible job {job:#05b}: expected 0 (none), 1 (read) or 2 (write)")]
    ImpermissibleJob {
        /// Bits 0 to 2 of the service octet.
        job: u8,
    },
    /// The code is not in the table (6/7/0000).
    #[error("C{code:04} does not exist")]
    UnknownCode {
        /// Code number asked for.
        code: u16,
    },
    /// The code has no such subcode (6/5/0011).
    #[error("C{code:04}/{got} does not exist: subcodes {first} to {last}")]
    UnknownSubcode {
        /// Code number.
        code: u16,
        /// Subcode asked for.
        got: u8,
        /// Least subcode (0 for a code without subcodes).
        first: u8,
        /// Greatest subcode.
        last: u8,
    },
    /// Writing a display (6/3/0000).
    #[error("C{code:04}/{subcode} is a display and cannot be written")]
    ReadOnly {
        /// Code number.
        code: u16,
        /// Subcode.
        subcode: u8,
    },
    /// More data octets than the code has (6/5/0012).
    #[error("C{code:04} takes {} data octets, got {got}", expected.octets())]
    DataTooLong {
        /// Code number.
        code: u16,
        /// Length of the code.
        expected: DataLength,
        /// Octets sent.
        got: u8,
    },
    /// Fewer data octets than the code has (6/5/0013).
    #[error("C{code:04} takes {} data octets, got {got}", expected.octets())]
    DataTooShort {
        /// Code number.
        code: u16,
        /// Length of the code.
        expected: DataLength,
        /// Octets sent.
        got: u8,
    },
    /// The code can be written only while the controller is inhibited (8/0/0030).
    #[error("C{code:04}/{subcode} can be written only while the controller is inhibited")]
    OnlyWhileInhibited {
        /// Code number.
        code: u16,
        /// Subcode.
        subcode: u8,
    },
    /// The value lies inside the limits but is none of the selection (8/0/0030).
    #[error("C{code:04}/{subcode}: {} is not in the selection {}", shown(*code, *got), list(*code, selection))]
    OutsideSelection {
        /// Code number.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// Value sent.
        got: i32,
        /// Values the code takes.
        selection: &'static [i32],
    },
    /// The value lies above the range (8/0/0031).
    #[error("C{code:04}/{subcode}: {} is above {}", shown(*code, *got), shown(*code, *max))]
    TooHigh {
        /// Code number.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// Greatest value.
        max: i32,
        /// Value sent.
        got: i32,
    },
    /// The value lies below the range (8/0/0032).
    #[error("C{code:04}/{subcode}: {} is below {}", shown(*code, *got), shown(*code, *min))]
    TooLow {
        /// Code number.
        code: u16,
        /// Subcode.
        subcode: u8,
        /// Least value.
        min: i32,
        /// Value sent.
        got: i32,
    },
    /// A parameter set is being loaded or saved (8/0/0000).
    #[error("job cannot be executed: a parameter set is being transferred")]
    TransferRunning,
}

impl CodeError {
    /// Class, code and additional code as sent on the bus.
    ///
    /// Source: 9300 facts 3.3.
    pub const fn reply(&self) -> ErrorReply {
        let (class, code, additional) = match self {
            Self::ReadOnly { .. } => (0x06, 0x03, 0x0000),
            Self::ImpermissibleJob { .. } => (0x06, 0x05, 0x0010),
            Self::UnknownSubcode { .. } => (0x06, 0x05, 0x0011),
            Self::DataTooLong { .. } => (0x06, 0x05, 0x0012),
            Self::DataTooShort { .. } => (0x06, 0x05, 0x0013),
            Self::UnknownCode { .. } => (0x06, 0x07, 0x0000),
            Self::TransferRunning => (0x08, 0x00, 0x0000),
            Self::OnlyWhileInhibited { .. } | Self::OutsideSelection { .. } => (0x08, 0x00, 0x0030),
            Self::TooHigh { .. } => (0x08, 0x00, 0x0031),
            Self::TooLow { .. } => (0x08, 0x00, 0x0032),
        };
        ErrorReply {
            class,
            code,
            additional,
        }
    }
}

/// A raw value in the code's own unit.
fn shown(code: u16, raw: i32) -> String {
    entry(code).map_or_else(|| raw.to_string(), |entry| entry.show(raw))
}

fn list(code: u16, raw: &[i32]) -> String {
    let shown: Vec<_> = raw.iter().map(|raw| shown(code, *raw)).collect();
    shown.join(", ")
}
