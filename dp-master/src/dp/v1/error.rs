//! What stands in a negative response: Error_Decode, Error_Code_1, Error_Code_2.

use core::fmt;

/// The three error octets of a negative response.
///
/// ```text
/// octet 1  Function_Num with bit 7        octet 2  Error_Decode: 80 DP-V1, FE FMS, FF HART
/// octet 3  Error_Code_1: class (bits 7…4) and code (bits 3…0)
/// octet 4  Error_Code_2: free for the device
/// ```
///
/// Source: IEC 61158-6-3, coding of Error_Decode, Error_Code_1 and Error_Code_2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[error("{code_1} (Error_Decode {decode:#04X}, Error_Code_2 {code_2:#04X})")]
pub struct V1Error {
    /// Error_Decode: which coding the other two have.
    pub decode: u8,
    /// Error_Code_1; its classes are valid with [`V1Error::DPV1`].
    pub code_1: ErrorCode1,
    /// Error_Code_2, free for the device.
    pub code_2: u8,
}

impl V1Error {
    /// Error_Decode of DP-V1.
    pub const DPV1: u8 = 0x80;
    /// Error_Decode of FMS.
    pub const FMS: u8 = 0xFE;
    /// Error_Decode of HART.
    pub const HART: u8 = 0xFF;

    /// An error in the coding of DP-V1 with Error_Code_2 zero.
    pub const fn new(code_1: ErrorCode1) -> Self {
        Self {
            decode: Self::DPV1,
            code_1,
            code_2: 0,
        }
    }

    /// The same with Error_Code_2.
    #[must_use]
    pub const fn with_detail(self, code_2: u8) -> Self {
        Self { code_2, ..self }
    }
}

/// Error_Code_1: class in bits 7…4, code in bits 3…0; lossless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorCode1(pub u8);

/// The class of an error, bits 7…4 of Error_Code_1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ErrorClass {
    /// 10: the application failed.
    Application,
    /// 11: what was asked for cannot be accessed.
    Access,
    /// 12: it cannot be done now.
    Resource,
    /// 13…15: free for the device.
    User,
    /// 0…9: reserved.
    Reserved,
}

impl ErrorCode1 {
    /// Application: reading failed.
    pub const READ_ERROR: Self = Self(0xA0);
    /// Application: writing failed.
    pub const WRITE_ERROR: Self = Self(0xA1);
    /// Application: the module has failed.
    pub const MODULE_FAILURE: Self = Self(0xA2);
    /// Application: versions do not fit.
    pub const VERSION_CONFLICT: Self = Self(0xA8);
    /// Application: the service does not exist.
    pub const FEATURE_NOT_SUPPORTED: Self = Self(0xA9);
    /// Access: there is no such index.
    pub const INVALID_INDEX: Self = Self(0xB0);
    /// Access: as many octets cannot be written.
    pub const WRITE_LENGTH_ERROR: Self = Self(0xB1);
    /// Access: there is no such slot.
    pub const INVALID_SLOT: Self = Self(0xB2);
    /// Access: the type does not fit.
    pub const TYPE_CONFLICT: Self = Self(0xB3);
    /// Access: there is no such area.
    pub const INVALID_AREA: Self = Self(0xB4);
    /// Access: not in this state.
    pub const STATE_CONFLICT: Self = Self(0xB5);
    /// Access: not allowed.
    pub const ACCESS_DENIED: Self = Self(0xB6);
    /// Access: outside the range.
    pub const INVALID_RANGE: Self = Self(0xB7);
    /// Access: a parameter is invalid.
    pub const INVALID_PARAMETER: Self = Self(0xB8);
    /// Access: the type is invalid.
    pub const INVALID_TYPE: Self = Self(0xB9);
    /// Resource: reading collides with something.
    pub const READ_CONSTRAIN_CONFLICT: Self = Self(0xC0);
    /// Resource: writing collides with something.
    pub const WRITE_CONSTRAIN_CONFLICT: Self = Self(0xC1);
    /// Resource: busy.
    pub const RESOURCE_BUSY: Self = Self(0xC2);
    /// Resource: there is none.
    pub const RESOURCE_UNAVAILABLE: Self = Self(0xC3);

    /// The class.
    pub const fn class(self) -> ErrorClass {
        match self.0 >> 4 {
            10 => ErrorClass::Application,
            11 => ErrorClass::Access,
            12 => ErrorClass::Resource,
            13..=15 => ErrorClass::User,
            _ => ErrorClass::Reserved,
        }
    }

    /// The code inside the class, 0…15.
    pub const fn code(self) -> u8 {
        self.0 & 0x0F
    }

    /// The name in the standard; `None` for a code that is reserved or free for the device.
    pub const fn name(self) -> Option<&'static str> {
        Some(match self {
            Self::READ_ERROR => "read error",
            Self::WRITE_ERROR => "write error",
            Self::MODULE_FAILURE => "module failure",
            Self::VERSION_CONFLICT => "version conflict",
            Self::FEATURE_NOT_SUPPORTED => "feature not supported",
            Self::INVALID_INDEX => "invalid index",
            Self::WRITE_LENGTH_ERROR => "write length error",
            Self::INVALID_SLOT => "invalid slot",
            Self::TYPE_CONFLICT => "type conflict",
            Self::INVALID_AREA => "invalid area",
            Self::STATE_CONFLICT => "state conflict",
            Self::ACCESS_DENIED => "access denied",
            Self::INVALID_RANGE => "invalid range",
            Self::INVALID_PARAMETER => "invalid parameter",
            Self::INVALID_TYPE => "invalid type",
            Self::READ_CONSTRAIN_CONFLICT => "read constrain conflict",
            Self::WRITE_CONSTRAIN_CONFLICT => "write constrain conflict",
            Self::RESOURCE_BUSY => "resource busy",
            Self::RESOURCE_UNAVAILABLE => "resource unavailable",
            _ => return None,
        })
    }
}

/// The name, or `error 0xDA`.
impl fmt::Display for ErrorCode1 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => f.write_str(name),
            None => write!(f, "error {:#04X}", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_and_codes_are_those_of_the_standard() {
        // IEC 61158-6-3; the same list stands in the manuals of masters (Beckhoff EL6731, "DPV1 Error Codes").
        for (octet, class, code, name) in [
            (0xA0, ErrorClass::Application, 0, Some("read error")),
            (0xA9, ErrorClass::Application, 9, Some("feature not supported")),
            (0xB0, ErrorClass::Access, 0, Some("invalid index")),
            (0xB2, ErrorClass::Access, 2, Some("invalid slot")),
            (0xB5, ErrorClass::Access, 5, Some("state conflict")),
            (0xC2, ErrorClass::Resource, 2, Some("resource busy")),
            (0xC3, ErrorClass::Resource, 3, Some("resource unavailable")),
            (0xD5, ErrorClass::User, 5, None),
            (0x11, ErrorClass::Reserved, 1, None),
        ] {
            let error = ErrorCode1(octet);
            assert_eq!((error.class(), error.code(), error.name()), (class, code, name));
        }
    }

    #[test]
    fn an_error_tells_everything_in_one_line() {
        let error = V1Error::new(ErrorCode1::INVALID_SLOT).with_detail(3);
        assert_eq!(error.to_string(), "invalid slot (Error_Decode 0x80, Error_Code_2 0x03)");
        let own = V1Error::new(ErrorCode1(0xDA));
        assert_eq!(own.to_string(), "error 0xDA (Error_Decode 0x80, Error_Code_2 0x00)");
    }
}
