use drivecom::param::RecordError;

use super::{AccessError, CodePlace};
use crate::bus::can::sdo::index_of;
use crate::code::DataLength;

/// Reading or writing one code through data record 47 (`drivecom::param`): the octets of the request and what the response says.
///
/// How the octets get there and back is the caller's: write them to [`RECORD_SLOT`](drivecom::param::RECORD_SLOT) and
/// [`RECORD_INDEX`](drivecom::param::RECORD_INDEX), then read the response from there.
///
/// Source: 9300 fact sheet, section 7; octets in `drivecom::param`.
///
/// ```
/// use lenze9300_model::access::CodeRecord;
///
/// // C1204 is parameter 24575 − 1204 = 5B4B hex; the feed constant 179.0708 mm comes as 1790708.
/// let job = CodeRecord::read(7, "C1204".parse()?);
/// assert_eq!(job.request(), [7, 1, 0, 1, 0x10, 1, 0x5B, 0x4B, 0, 0]);
/// assert_eq!(job.result(&[7, 1, 0, 1, 0x43, 1, 0x00, 0x1B, 0x52, 0xF4])?, 1_790_708);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeRecord {
    reference: u8,
    place: CodePlace,
    written: Option<i32>,
}

/// Formats of a value in the record.
const WORD: u8 = 0x42;
const DOUBLE_WORD: u8 = 0x43;
const ERROR: u8 = 0x44;
/// Request ids.
const READ: u8 = 1;
const WRITE: u8 = 2;

impl CodeRecord {
    /// Reads a code. The response carries `reference` again: take another for each job, so that a late one is noticed.
    #[must_use]
    pub const fn read(reference: u8, place: CodePlace) -> Self {
        Self {
            reference,
            place,
            written: None,
        }
    }

    /// Writes a code, raw as the bus carries it.
    #[must_use]
    pub const fn write(reference: u8, place: CodePlace, raw: i32) -> Self {
        Self {
            reference,
            place,
            written: Some(raw),
        }
    }

    /// The code.
    #[must_use]
    pub const fn place(&self) -> CodePlace {
        self.place
    }

    /// The value that is written; `None` when the code is read.
    #[must_use]
    pub const fn written(&self) -> Option<i32> {
        self.written
    }

    /// The octets of the request. A value takes two octets where the table of codes says so, otherwise four.
    #[must_use]
    pub fn request(&self) -> Vec<u8> {
        let id = if self.written.is_some() { WRITE } else { READ };
        let [high, low] = index_of(self.place.code).to_be_bytes();
        let mut request = vec![self.reference, id, 0, 1, 0x10, 1, high, low, 0, self.place.subcode];
        if let Some(raw) = self.written {
            match self.place.entry().map(|entry| entry.length) {
                Some(DataLength::Two) => {
                    let [.., high, low] = raw.to_be_bytes();
                    request.extend([WORD, 1, high, low]);
                }
                Some(DataLength::Four) | None => {
                    request.extend([DOUBLE_WORD, 1]);
                    request.extend(raw.to_be_bytes());
                }
            }
        }
        request
    }

    /// What the response says: the value that was read or written, raw.
    ///
    /// # Errors
    ///
    /// [`AccessError::Refused`] when the drive refuses, [`AccessError::NoAnswer`] when the octets are no response to this request.
    pub fn result(&self, response: &[u8]) -> Result<i32, AccessError> {
        let place = self.place;
        if response.first() != Some(&self.reference) {
            return Err(AccessError::NoAnswer(format!(
                "{place}: the response belongs to another request"
            )));
        }
        // Format 44, one value, the number.
        if let [_, id, _, _, ERROR, 1, high, low, ..] = *response
            && id & 0x80 != 0
        {
            return Err(AccessError::Refused {
                place,
                reason: reason(RecordError(u16::from_be_bytes([high, low]))),
            });
        }
        if let Some(raw) = self.written {
            return Ok(raw);
        }
        match *response.get(4..).unwrap_or_default() {
            [WORD, 1, high, low, ..] => Ok(i32::from(u16::from_be_bytes([high, low]))),
            [DOUBLE_WORD, 1, a, b, c, d, ..] => Ok(i32::from_be_bytes([a, b, c, d])),
            _ => Err(AccessError::NoAnswer(format!("{place}: the response has no value"))),
        }
    }
}

/// Source: error numbers of PROFIdrive, as in `drivecom::param::RecordError`.
fn reason(error: RecordError) -> String {
    let known = match error {
        RecordError::NUMBER => "the drive has no such code",
        RecordError::NOT_CHANGEABLE => "the code cannot be written",
        RecordError::LIMITS => "the value is outside the range",
        RecordError::SUBINDEX => "the code has no such subcode",
        RecordError::DATA_TYPE => "wrong number of data octets for this code",
        RecordError::STATE => "not in this state of the drive: perhaps only while the controller is inhibited",
        RecordError::VALUE => "the value is not in the selection",
        RecordError(number) => return format!("refused with error number {number:#06X}"),
    };
    known.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(text: &str) -> CodePlace {
        text.parse().unwrap()
    }

    #[test]
    fn a_written_value_has_the_length_of_its_code() {
        // C0011 has four octets as DRIVECOM carries it (9300 fact sheet, section 4.4): 3000 1/min come as 30 000 000.
        let four = CodeRecord::write(1, place("C0011"), 30_000_000).request();
        assert_eq!(four[10..], [0x43, 1, 0x01, 0xC9, 0xC3, 0x80]);
        // C0135, the control word, has two.
        let two = CodeRecord::write(1, place("C0135"), 0x047F).request();
        assert_eq!(two[6..], [0x5F, 0x78, 0, 0, 0x42, 1, 0x04, 0x7F]);
    }

    #[test]
    fn a_refusal_is_told_with_its_code_and_reason() {
        // Error number 2: above or below the limits (PROFIdrive profile).
        let error = CodeRecord::write(9, place("C0011"), 1)
            .result(&[9, 0x82, 0, 1, 0x44, 1, 0, 2])
            .unwrap_err();
        assert!(error.is_refusal());
        assert_eq!(error.to_string(), "C0011: the value is outside the range");
    }

    #[test]
    fn a_response_to_another_request_is_not_taken() {
        let job = CodeRecord::read(5, place("C1204"));
        for response in [
            &[][..],
            &[4, 1, 0, 1, 0x43, 1, 0, 0, 0, 1],
            &[5, 1, 0, 1],
            &[5, 1, 0, 1, 0x43, 1, 0, 0, 0],
        ] {
            let error = job.result(response).unwrap_err();
            assert!(!error.is_refusal(), "{response:?}: {error}");
        }
    }
}
