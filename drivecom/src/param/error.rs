//! How a drive refuses a job.

use core::fmt;

/// The error answer of the parameter channel: octets 5 to 8 when bit 7 of the service octet is set.
///
/// Layout: class, code, additional code (high octet first). Unknown combinations are kept as they came.
///
/// Source: 9300 fact sheet, section 3.3.
///
/// # Example
///
/// ```
/// use drivecom::param::ErrorCode;
///
/// let error = ErrorCode::from_data([0x08, 0x00, 0x00, 0x30]);
/// assert_eq!(error, ErrorCode::OUT_OF_RANGE_OR_NOT_INHIBITED);
/// assert_eq!(
///     error.to_string(),
///     "value outside its range, or code writable only while inhibited (0x08 0x00 0x0030)"
/// );
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorCode {
    /// Error class.
    pub class: u8,
    /// Error code within the class.
    pub code: u8,
    /// Additional code.
    pub additional: u16,
}

impl ErrorCode {
    /// No right of access: writing a display-only code.
    pub const NO_ACCESS_RIGHT: Self = Self::new(0x06, 0x03, 0x0000);
    /// Job code of the service octet other than 0, 1, 2.
    pub const IMPERMISSIBLE_JOB: Self = Self::new(0x06, 0x05, 0x0010);
    /// The subcode does not exist.
    pub const IMPERMISSIBLE_SUBINDEX: Self = Self::new(0x06, 0x05, 0x0011);
    /// The length of the job is above the code's.
    pub const DATA_TOO_LONG: Self = Self::new(0x06, 0x05, 0x0012);
    /// The length of the job is below the code's.
    pub const DATA_TOO_SHORT: Self = Self::new(0x06, 0x05, 0x0013);
    /// The object is no parameter.
    pub const NOT_A_PARAMETER: Self = Self::new(0x06, 0x06, 0x0000);
    /// Unknown code.
    pub const UNKNOWN_OBJECT: Self = Self::new(0x06, 0x07, 0x0000);
    /// Data types do not match.
    pub const TYPE_MISMATCH: Self = Self::new(0x06, 0x08, 0x0000);
    /// The job cannot be executed, e.g. during a parameter set transfer.
    pub const NOT_EXECUTABLE: Self = Self::new(0x08, 0x00, 0x0000);
    /// Not executable at present.
    pub const NOT_EXECUTABLE_NOW: Self = Self::new(0x08, 0x00, 0x0020);
    /// Not executable because of local control.
    pub const LOCAL_CONTROL: Self = Self::new(0x08, 0x00, 0x0021);
    /// Not executable because of the device state.
    pub const DEVICE_STATE: Self = Self::new(0x08, 0x00, 0x0022);
    /// Outside the value range, **or** writable only while the controller is inhibited.
    pub const OUT_OF_RANGE_OR_NOT_INHIBITED: Self = Self::new(0x08, 0x00, 0x0030);
    /// Value too high.
    pub const TOO_HIGH: Self = Self::new(0x08, 0x00, 0x0031);
    /// Value too low.
    pub const TOO_LOW: Self = Self::new(0x08, 0x00, 0x0032);
    /// Sub-parameter outside its range.
    pub const SUB_OUT_OF_RANGE: Self = Self::new(0x08, 0x00, 0x0033);
    /// Sub-parameter too high.
    pub const SUB_TOO_HIGH: Self = Self::new(0x08, 0x00, 0x0034);
    /// Sub-parameter too low.
    pub const SUB_TOO_LOW: Self = Self::new(0x08, 0x00, 0x0035);
    /// Maximum smaller than minimum.
    pub const MAX_BELOW_MIN: Self = Self::new(0x08, 0x00, 0x0036);
    /// The object cannot be mapped to process data.
    pub const NOT_MAPPABLE: Self = Self::new(0x08, 0x00, 0x0041);
    /// Process data length exceeded.
    pub const MAPPING_TOO_LONG: Self = Self::new(0x08, 0x00, 0x0042);
    /// Collision with other values.
    pub const COLLISION: Self = Self::new(0x08, 0x00, 0x0043);

    /// The known codes and their texts, in the order of the manual.
    pub const TABLE: &'static [(Self, &'static str)] = &[
        (Self::NO_ACCESS_RIGHT, "no right of access"),
        (Self::IMPERMISSIBLE_JOB, "impermissible job parameter"),
        (Self::IMPERMISSIBLE_SUBINDEX, "impermissible subindex"),
        (Self::DATA_TOO_LONG, "data too long"),
        (Self::DATA_TOO_SHORT, "data too short"),
        (Self::NOT_A_PARAMETER, "object is no parameter"),
        (Self::UNKNOWN_OBJECT, "object does not exist"),
        (Self::TYPE_MISMATCH, "data types do not match"),
        (Self::NOT_EXECUTABLE, "job cannot be executed"),
        (Self::NOT_EXECUTABLE_NOW, "job cannot be executed at present"),
        (Self::LOCAL_CONTROL, "job cannot be executed because of local control"),
        (Self::DEVICE_STATE, "job cannot be executed because of the device state"),
        (
            Self::OUT_OF_RANGE_OR_NOT_INHIBITED,
            "value outside its range, or code writable only while inhibited",
        ),
        (Self::TOO_HIGH, "value too high"),
        (Self::TOO_LOW, "value too low"),
        (Self::SUB_OUT_OF_RANGE, "sub-parameter outside its range"),
        (Self::SUB_TOO_HIGH, "sub-parameter too high"),
        (Self::SUB_TOO_LOW, "sub-parameter too low"),
        (Self::MAX_BELOW_MIN, "maximum smaller than minimum"),
        (Self::NOT_MAPPABLE, "object cannot be mapped to process data"),
        (Self::MAPPING_TOO_LONG, "process data length exceeded"),
        (Self::COLLISION, "collision with other values"),
    ];

    /// The error with these three numbers.
    #[must_use]
    pub const fn new(class: u8, code: u8, additional: u16) -> Self {
        Self {
            class,
            code,
            additional,
        }
    }

    /// The error in octets 5–8 of an answer.
    #[must_use]
    pub const fn from_data(data: [u8; 4]) -> Self {
        let [class, code, high, low] = data;
        Self {
            class,
            code,
            additional: u16::from_be_bytes([high, low]),
        }
    }

    /// Octets 5–8 of an answer.
    #[must_use]
    pub const fn to_data(self) -> [u8; 4] {
        let [high, low] = self.additional.to_be_bytes();
        [self.class, self.code, high, low]
    }

    /// The manual's text; `None` for a combination it does not list.
    #[must_use]
    pub fn text(self) -> Option<&'static str> {
        Self::TABLE
            .iter()
            .find(|(error, _)| *error == self)
            .map(|(_, text)| *text)
    }
}

/// Text and the three numbers: `value too high (0x08 0x00 0x0031)`.
impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self.text().unwrap_or("unknown error");
        write!(
            f,
            "{text} (0x{:02X} 0x{:02X} 0x{:04X})",
            self.class, self.code, self.additional
        )
    }
}

impl core::error::Error for ErrorCode {}

#[cfg(test)]
mod tests {
    use super::*;

    // Source: 9300 facts 3.3.
    #[test]
    fn a_listed_error_has_a_text_and_another_has_none() {
        assert_eq!(ErrorCode::new(0x08, 0x00, 0x0031).text(), Some("value too high"));
        assert_eq!(ErrorCode::new(0x08, 0x00, 0x0099).text(), None);
        assert_eq!(ErrorCode::TOO_HIGH.to_string(), "value too high (0x08 0x00 0x0031)");
    }

    // Source: 9300 facts 3.3, typed row by row; rows 0x33, 0x34, 0x35 share one line there.
    #[test]
    fn the_table_is_that_of_the_fact_sheet() {
        let rows: [(u8, u8, u16); 22] = [
            (0x06, 0x03, 0x0000),
            (0x06, 0x05, 0x0010),
            (0x06, 0x05, 0x0011),
            (0x06, 0x05, 0x0012),
            (0x06, 0x05, 0x0013),
            (0x06, 0x06, 0x0000),
            (0x06, 0x07, 0x0000),
            (0x06, 0x08, 0x0000),
            (0x08, 0x00, 0x0000),
            (0x08, 0x00, 0x0020),
            (0x08, 0x00, 0x0021),
            (0x08, 0x00, 0x0022),
            (0x08, 0x00, 0x0030),
            (0x08, 0x00, 0x0031),
            (0x08, 0x00, 0x0032),
            (0x08, 0x00, 0x0033),
            (0x08, 0x00, 0x0034),
            (0x08, 0x00, 0x0035),
            (0x08, 0x00, 0x0036),
            (0x08, 0x00, 0x0041),
            (0x08, 0x00, 0x0042),
            (0x08, 0x00, 0x0043),
        ];
        let table: Vec<_> = ErrorCode::TABLE
            .iter()
            .map(|(e, _)| (e.class, e.code, e.additional))
            .collect();
        assert_eq!(table, rows);
    }

    #[test]
    fn an_unknown_combination_keeps_its_numbers() {
        let error = ErrorCode::from_data([0x12, 0x34, 0x56, 0x78]);
        assert_eq!(error.text(), None);
        assert_eq!(error.to_string(), "unknown error (0x12 0x34 0x5678)");
        assert_eq!(error.to_data(), [0x12, 0x34, 0x56, 0x78]);
    }
}
