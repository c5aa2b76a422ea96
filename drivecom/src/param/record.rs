//! Parameter access by a data record: several parameters in one request (DP-V1).
//!
//! The master writes a request to data record 47 and reads the response from it.
//!
//! ```text
//! request     reference, 01 read / 02 write, axis, n, n × (attribute 10, elements, number (2), subindex (2))
//!             and to write n × (format, values, value …)
//! response    reference, 01 / 02 (81 / 82 when one of them failed), axis, n,
//!             n × (format, values, value …), or for a failed one 44, 1, error (2); none of these after 02
//! formats     41 octet, 42 word, 43 double word, 44 error, 40 nothing (written); high octet first
//! ```
//!
//! Interpretation: the parameter number is the index of the parameter channel, 24575 − code; the manual speaks of the "number of
//! indices". One element a parameter. Source: 9300 fact sheet, section 7.

use super::value::DataLength;
use crate::code::{CodeNumber, Subcode};

/// Data record and slot of parameter access. Source: 9300 fact sheet, section 7 (convention of PROFIdrive).
pub const RECORD_INDEX: u8 = 47;
/// The slot of the drive.
pub const RECORD_SLOT: u8 = 0;
/// Longest request and response: that of a DP-V1 data record.
pub const MAX_RECORD: usize = 240;

/// What a request asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordJob {
    /// Read a parameter.
    Read {
        /// Code, from its index.
        code: CodeNumber,
        /// Subcode.
        subcode: Subcode,
    },
    /// Write a parameter.
    Write {
        /// Code, from its index.
        code: CodeNumber,
        /// Subcode.
        subcode: Subcode,
        /// Octets of the value as sent.
        length: DataLength,
        /// The value.
        value: i32,
    },
    /// Something that cannot be carried out; the others of the request can.
    Refused(RecordError),
}

/// Why a parameter could not be read or written, as the response tells it.
///
/// Source: error numbers of PROFIdrive; 9300 fact sheet, section 7.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RecordError(pub u16);

impl RecordError {
    /// There is no such parameter.
    pub const NUMBER: Self = Self(0x00);
    /// It cannot be changed.
    pub const NOT_CHANGEABLE: Self = Self(0x01);
    /// The value is out of its limits.
    pub const LIMITS: Self = Self(0x02);
    /// There is no such subindex.
    pub const SUBINDEX: Self = Self(0x03);
    /// The value has the wrong format.
    pub const DATA_TYPE: Self = Self(0x05);
    /// Not in this state of the drive.
    pub const STATE: Self = Self(0x11);
    /// The value is none of those permitted.
    pub const VALUE: Self = Self(0x14);
    /// The response would be too long.
    pub const RESPONSE_TOO_LONG: Self = Self(0x15);
    /// The attribute or number of elements is none that the drive knows.
    pub const ATTRIBUTE: Self = Self(0x16);
}

/// Why a data record is no request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordRequestError {
    /// It ends in the middle of something.
    #[error("the request ends after {got} octets")]
    Truncated {
        /// Octets there are.
        got: usize,
    },
    /// Neither read nor write.
    #[error("request id: expected 1 or 2, got {got:#04x}")]
    Id {
        /// The octet.
        got: u8,
    },
    /// No parameter is asked for.
    #[error("number of parameters: expected at least 1, got 0")]
    Nothing,
}

/// A request, checked as a whole and read parameter by parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordRequest<'a> {
    /// Mirrored in the response.
    pub reference: u8,
    /// Mirrored in the response.
    pub axis: u8,
    /// Whether values follow.
    pub kind: RecordKind,
    addresses: &'a [u8],
    values: &'a [u8],
}

/// Whether parameters are read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordKind {
    /// Request id 01.
    Read,
    /// Request id 02.
    Write,
}

const HEADER: usize = 4;
const ADDRESS: usize = 6;
/// Attribute "value".
const VALUE: u8 = 0x10;
const NOTHING: u8 = 0x40;
const OCTET: u8 = 0x41;
const WORD: u8 = 0x42;
const DOUBLE_WORD: u8 = 0x43;
const ERROR: u8 = 0x44;
/// Bit 7 of the response id: one of the parameters failed.
const FAILED: u8 = 0x80;

impl<'a> RecordRequest<'a> {
    /// Reads a data record.
    ///
    /// # Errors
    ///
    /// [`RecordRequestError`].
    ///
    /// # Example
    ///
    /// ```
    /// use drivecom::param::{RecordJob, RecordRequest};
    ///
    /// // C1204: 24575 − 1204 = 0x5B4B.
    /// let request = RecordRequest::parse(&[0x07, 0x01, 0x00, 0x01, 0x10, 0x01, 0x5B, 0x4B, 0x00, 0x00])?;
    /// let Some(RecordJob::Read { code, .. }) = request.jobs().next() else { panic!() };
    /// assert_eq!((request.reference, code.number()), (7, 1204));
    /// # Ok::<(), drivecom::param::RecordRequestError>(())
    /// ```
    pub fn parse(octets: &'a [u8]) -> Result<Self, RecordRequestError> {
        let truncated = RecordRequestError::Truncated { got: octets.len() };
        let (&[reference, id, axis, count], rest) = octets.split_first_chunk::<HEADER>().ok_or(truncated)?;
        let kind = match id {
            0x01 => RecordKind::Read,
            0x02 => RecordKind::Write,
            got => return Err(RecordRequestError::Id { got }),
        };
        if count == 0 {
            return Err(RecordRequestError::Nothing);
        }
        let (addresses, values) = rest.split_at_checked(usize::from(count) * ADDRESS).ok_or(truncated)?;
        let request = Self {
            reference,
            axis,
            kind,
            addresses,
            values,
        };
        if kind == RecordKind::Write {
            let mut values = values;
            for _ in 0..count {
                values = split_value(values).ok_or(truncated)?.1;
            }
        }
        Ok(request)
    }

    /// How many parameters are asked for.
    pub const fn count(&self) -> usize {
        self.addresses.len() / ADDRESS
    }

    /// What is asked for, in order.
    pub fn jobs(&self) -> impl Iterator<Item = RecordJob> + 'a {
        let (kind, mut values) = (self.kind, self.values);
        self.addresses.chunks_exact(ADDRESS).map(move |address| {
            let value = match kind {
                RecordKind::Read => None,
                RecordKind::Write => split_value(values).map(|(value, rest)| {
                    values = rest;
                    value
                }),
            };
            job(kind, address, value)
        })
    }
}

fn job(kind: RecordKind, address: &[u8], value: Option<Value<'_>>) -> RecordJob {
    let &[
        attribute,
        elements,
        number_high,
        number_low,
        subindex_high,
        subindex_low,
    ] = address
    else {
        return RecordJob::Refused(RecordError::NUMBER);
    };
    // 0 and 1 both ask for one value; the drive has no arrays.
    if attribute != VALUE || elements > 1 {
        return RecordJob::Refused(RecordError::ATTRIBUTE);
    }
    let Some(code) = CodeNumber::from_index(u16::from_be_bytes([number_high, number_low])) else {
        return RecordJob::Refused(RecordError::NUMBER);
    };
    if subindex_high != 0 {
        return RecordJob::Refused(RecordError::SUBINDEX);
    }
    let subcode = Subcode(subindex_low);
    match (kind, value) {
        (RecordKind::Read, _) => RecordJob::Read { code, subcode },
        (RecordKind::Write, Some(value)) => match value.number() {
            Some((length, value)) => RecordJob::Write {
                code,
                subcode,
                length,
                value,
            },
            None => RecordJob::Refused(RecordError::DATA_TYPE),
        },
        (RecordKind::Write, None) => RecordJob::Refused(RecordError::DATA_TYPE),
    }
}

/// Format, number of values, and their octets.
struct Value<'a> {
    format: u8,
    count: u8,
    octets: &'a [u8],
}

impl Value<'_> {
    fn number(&self) -> Option<(DataLength, i32)> {
        match (self.format, self.count, self.octets) {
            (OCTET, 1, &[octet]) => Some((DataLength::One, i32::from(octet))),
            (WORD, 1, &[high, low]) => Some((DataLength::Two, i32::from(u16::from_be_bytes([high, low])))),
            (DOUBLE_WORD, 1, &[a, b, c, d]) => Some((DataLength::Four, i32::from_be_bytes([a, b, c, d]))),
            _ => None,
        }
    }
}

/// The first value and what follows it. A format that is not known ends the list: its length cannot be told.
fn split_value(octets: &[u8]) -> Option<(Value<'_>, &[u8])> {
    let (&[format, count], rest) = octets.split_first_chunk::<2>()?;
    let size = match format {
        NOTHING => 0,
        OCTET => 1,
        WORD => 2,
        DOUBLE_WORD => 4,
        _ => return None,
    };
    let (octets, rest) = rest.split_at_checked(usize::from(count) * size)?;
    Some((Value { format, count, octets }, rest))
}

/// A response under construction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordResponse {
    octets: [u8; MAX_RECORD],
    len: usize,
    kind: RecordKind,
}

/// How one parameter came out.
pub type RecordResult = Result<(DataLength, i32), RecordError>;

impl RecordResponse {
    /// The response to a request, with nothing in it yet.
    pub fn to(request: &RecordRequest<'_>) -> Self {
        let mut octets = [0; MAX_RECORD];
        let id = match request.kind {
            RecordKind::Read => 0x01,
            RecordKind::Write => 0x02,
        };
        // A request of 240 octets names 39 parameters at most.
        let header = [request.reference, id, request.axis, request.count() as u8];
        octets[..HEADER].copy_from_slice(&header);
        Self {
            octets,
            len: HEADER,
            kind: request.kind,
        }
    }

    /// Adds the result of the next parameter; the value of a written one is left out.
    pub fn push(&mut self, result: RecordResult) {
        match (result, self.kind) {
            (Ok(_), RecordKind::Write) => self.append(&[NOTHING, 0]),
            (Ok((DataLength::One, value)), _) => self.append(&[OCTET, 1, value as u8]),
            (Ok((DataLength::Two | DataLength::Three, value)), _) => {
                let [high, low] = (value as u16).to_be_bytes();
                self.append(&[WORD, 1, high, low]);
            }
            (Ok((DataLength::Four, value)), _) => {
                let [a, b, c, d] = value.to_be_bytes();
                self.append(&[DOUBLE_WORD, 1, a, b, c, d]);
            }
            (Err(RecordError(number)), _) => {
                self.octets[1] |= FAILED;
                let [high, low] = number.to_be_bytes();
                self.append(&[ERROR, 1, high, low]);
            }
        }
    }

    /// The octets of the data record. A request that was written without an error is answered by the header alone.
    pub fn octets(&self) -> &[u8] {
        let written = self.kind == RecordKind::Write && self.octets[1] & FAILED == 0;
        let len = if written { HEADER } else { self.len };
        self.octets.get(..len).unwrap_or(&[])
    }

    /// 39 parameters of six octets and the header are 238: everything fits.
    fn append(&mut self, octets: &[u8]) {
        if let Some(place) = self.octets.get_mut(self.len..self.len + octets.len()) {
            place.copy_from_slice(octets);
            self.len += octets.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const READ_C1204: [u8; 10] = [0x07, 0x01, 0x00, 0x01, 0x10, 0x01, 0x5B, 0x4B, 0x00, 0x00];

    #[test]
    fn a_value_is_answered_with_its_format() {
        // 9300 fact sheet, sections 3.2 and 7: C1204 = 179.0708 = 0x001B52F4, a double word.
        let request = RecordRequest::parse(&READ_C1204).unwrap();
        let mut response = RecordResponse::to(&request);
        response.push(Ok((DataLength::Four, 1_790_708)));
        assert_eq!(
            response.octets(),
            [0x07, 0x01, 0x00, 0x01, 0x43, 0x01, 0x00, 0x1B, 0x52, 0xF4]
        );
    }

    #[test]
    fn a_failed_parameter_sets_bit_7_of_the_response_id() {
        let two = [
            0x09, 0x01, 0x01, 0x02, 0x10, 0x01, 0x5B, 0x4B, 0x00, 0x00, 0x10, 0x01, 0x5F, 0xA9, 0x00, 0x00,
        ];
        let request = RecordRequest::parse(&two).unwrap();
        assert_eq!(request.count(), 2);
        let mut response = RecordResponse::to(&request);
        response.push(Err(RecordError::NUMBER));
        response.push(Ok((DataLength::Two, 0x1234)));
        assert_eq!(
            response.octets(),
            [0x09, 0x81, 0x01, 0x02, 0x44, 0x01, 0x00, 0x00, 0x42, 0x01, 0x12, 0x34]
        );
    }

    #[test]
    fn a_write_without_an_error_is_answered_by_the_header() {
        // C1301/1 := 1200.0 = 0x00B71B00; index 0x5AEA.
        let write = [
            0x01, 0x02, 0x00, 0x01, 0x10, 0x01, 0x5A, 0xEA, 0x00, 0x01, 0x43, 0x01, 0x00, 0xB7, 0x1B, 0x00,
        ];
        let request = RecordRequest::parse(&write).unwrap();
        let job = request.jobs().next();
        let code = CodeNumber::new(1301).unwrap();
        let expected = RecordJob::Write {
            code,
            subcode: Subcode(1),
            length: DataLength::Four,
            value: 12_000_000,
        };
        assert_eq!(job, Some(expected));
        let mut response = RecordResponse::to(&request);
        response.push(Ok((DataLength::Four, 0)));
        assert_eq!(response.octets(), [0x01, 0x02, 0x00, 0x01]);
        let mut failed = RecordResponse::to(&request);
        failed.push(Err(RecordError::LIMITS));
        assert_eq!(failed.octets(), [0x01, 0x82, 0x00, 0x01, 0x44, 0x01, 0x00, 0x02]);
    }

    #[test]
    fn values_of_every_format_are_read_and_those_behind_them_found() {
        // 9300 fact sheet, section 7: format 41 an octet, 42 a word, 43 a double word, 40 nothing. Parameters first, then values.
        let parameter = [0x10, 0x01, 0x5A, 0xEA, 0x00, 0x01];
        let mut write = vec![0x01, 0x02, 0x00, 0x04];
        for _ in 0..4 {
            write.extend(parameter);
        }
        write.extend([0x41, 0x01, 0x7B]);
        write.extend([0x40, 0x00]);
        write.extend([0x42, 0x01, 0x12, 0x34]);
        write.extend([0x43, 0x01, 0x00, 0xB7, 0x1B, 0x00]);
        let request = RecordRequest::parse(&write).unwrap();
        let job = |length, value| RecordJob::Write {
            code: CodeNumber::new(1301).unwrap(),
            subcode: Subcode(1),
            length,
            value,
        };
        let jobs: Vec<_> = request.jobs().collect();
        assert_eq!(
            jobs,
            [
                job(DataLength::One, 0x7B),
                RecordJob::Refused(RecordError::DATA_TYPE),
                job(DataLength::Two, 0x1234),
                job(DataLength::Four, 12_000_000),
            ]
        );
    }

    #[test]
    fn what_the_drive_does_not_know_is_refused_one_by_one() {
        for (place, octet, error) in [
            (4, 0x20, RecordError::ATTRIBUTE),
            (5, 2, RecordError::ATTRIBUTE),
            (6, 0xFF, RecordError::NUMBER),
            (8, 1, RecordError::SUBINDEX),
        ] {
            let mut octets = READ_C1204;
            octets[place] = octet;
            let request = RecordRequest::parse(&octets).unwrap();
            assert_eq!(request.jobs().next(), Some(RecordJob::Refused(error)), "{place}");
        }
    }

    #[test]
    fn every_proper_beginning_of_a_request_is_too_short() {
        let write = [
            0x01, 0x02, 0x00, 0x01, 0x10, 0x01, 0x5A, 0xEA, 0x00, 0x01, 0x43, 0x01, 0x00, 0xB7, 0x1B, 0x00,
        ];
        for whole in [&READ_C1204[..], &write] {
            for got in 0..whole.len() {
                let error = RecordRequest::parse(&whole[..got]);
                assert_eq!(error, Err(RecordRequestError::Truncated { got }));
            }
        }
        assert_eq!(
            RecordRequest::parse(&[1, 3, 0, 1]),
            Err(RecordRequestError::Id { got: 3 })
        );
        assert_eq!(RecordRequest::parse(&[1, 1, 0, 0]), Err(RecordRequestError::Nothing));
    }

    #[test]
    fn the_longest_request_has_a_response_that_fits() {
        let mut octets = [0_u8; MAX_RECORD];
        octets[..4].copy_from_slice(&[1, 1, 0, 39]);
        for address in octets[4..238].chunks_exact_mut(6) {
            address.copy_from_slice(&READ_C1204[4..]);
        }
        let request = RecordRequest::parse(&octets).unwrap();
        let mut response = RecordResponse::to(&request);
        for _ in request.jobs() {
            response.push(Ok((DataLength::Four, -1)));
        }
        assert_eq!(response.octets().len(), 4 + 39 * 6);
    }
}
