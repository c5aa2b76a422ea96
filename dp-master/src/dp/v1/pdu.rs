//! The PDUs of DP-V1: what master and slave put into the data of a telegram.
//!
//! ```text
//! Read            5E slot index length              →  5E slot index length data…
//! Write           5F slot index length data…        →  5F slot index length
//! Data_Transport  51 slot index length data…        →  51 slot index length data…
//! Alarm_Ack       5C slot type specifier            →  5C slot type specifier
//! Idle            48                                →  48
//! Initiate        57 …                              →  56 … at once, then 57 …
//! Abort           58 subnet instance+reason            (either side, without response)
//! refused                                           →  function + 80, Error_Decode, Error_Code_1, Error_Code_2
//! ```
//!
//! Source: IEC 61158-6-3, abstract syntax and coding of the MSAC PDUs.

use super::abort::Abort;
use super::alarm::{AlarmAck, AlarmSpecifier, AlarmType};
use super::error::{ErrorCode1, V1Error};
use super::function::{Function, NEGATIVE};
use super::initiate::{Addresses, Features, Initiate, Initiated, Resource, SendTimeout};

/// Most octets of data in a PDU: 244 less the four before them.
pub const MAX_V1_DATA: usize = 240;

/// What a master asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request<'a> {
    /// Read a data record.
    Read {
        /// Slot, 0…254.
        slot: u8,
        /// Index, 0…255.
        index: u8,
        /// Most octets wanted, 0…240.
        length: u8,
    },
    /// Write a data record.
    Write {
        /// Slot, 0…254.
        slot: u8,
        /// Index, 0…255.
        index: u8,
        /// At most 240 octets.
        data: &'a [u8],
    },
    /// Data there and back.
    DataTransport {
        /// Slot, 0…254.
        slot: u8,
        /// Index, 0…255.
        index: u8,
        /// At most 240 octets.
        data: &'a [u8],
    },
    /// Acknowledge an alarm.
    AlarmAck(AlarmAck),
    /// Keep a connection alive.
    Idle,
    /// Open a connection.
    Initiate(Initiate<'a>),
    /// End a connection.
    Abort(Abort),
}

impl<'a> Request<'a> {
    /// Which function it is.
    pub const fn function(&self) -> Function {
        match self {
            Self::Read { .. } => Function::Read,
            Self::Write { .. } => Function::Write,
            Self::DataTransport { .. } => Function::DataTransport,
            Self::AlarmAck(_) => Function::AlarmAck,
            Self::Idle => Function::Idle,
            Self::Initiate(_) => Function::Initiate,
            Self::Abort(_) => Function::Abort,
        }
    }

    /// Reads a request.
    ///
    /// # Errors
    ///
    /// [`PduError`]; a request longer than its length octet says is none either.
    pub fn parse(pdu: &'a [u8]) -> Result<Self, PduError> {
        let (&code, rest) = pdu.split_first().ok_or(PduError::Empty)?;
        let function = Function::from_code(code).ok_or(PduError::Function { got: code })?;
        let length = PduError::Length {
            function,
            got: pdu.len(),
        };
        match function {
            Function::Read => match *rest {
                [slot, index, length] => Ok(Self::Read { slot, index, length }),
                _ => Err(length),
            },
            Function::Write => record(rest)
                .map(|(slot, index, data)| Self::Write { slot, index, data })
                .ok_or(length),
            Function::DataTransport => record(rest)
                .map(|(slot, index, data)| Self::DataTransport { slot, index, data })
                .ok_or(length),
            Function::AlarmAck => alarm_ack(rest).map(Self::AlarmAck).ok_or(length),
            // Interpretation: what stands behind the function of Idle is ignored; some stations send a second octet.
            Function::Idle => Ok(Self::Idle),
            Function::Initiate => {
                let Some((&[_, _, _, t1, t2, f1, f2, p1, p2, i1, i2], addresses)) = rest.split_first_chunk() else {
                    return Err(length);
                };
                Ok(Self::Initiate(Initiate {
                    send_timeout: SendTimeout(u16::from_be_bytes([t1, t2])),
                    features: Features(u16::from_be_bytes([f1, f2])),
                    profile_features: u16::from_be_bytes([p1, p2]),
                    profile_ident: u16::from_be_bytes([i1, i2]),
                    addresses: Addresses::parse(addresses).ok_or(PduError::Addresses)?,
                }))
            }
            Function::Abort => abort(rest).map(Self::Abort).ok_or(length),
            Function::ResourceManager => Err(PduError::Function { got: code }),
        }
    }

    /// Writes the request; returns its length.
    ///
    /// # Errors
    ///
    /// [`EncodePduError`] when it has more than 240 octets of data or does not fit into `buf`.
    pub fn encode(&self, buf: &mut [u8]) -> Result<usize, EncodePduError> {
        let code = self.function().code();
        match *self {
            Self::Read { slot, index, length } => put(buf, &[code, slot, index, length], &[]),
            Self::Write { slot, index, data } | Self::DataTransport { slot, index, data } => {
                put(buf, &[code, slot, index, data_length(data)?], data)
            }
            Self::AlarmAck(ack) => put(buf, &ack_octets(code, ack), &[]),
            Self::Idle => put(buf, &[code], &[]),
            Self::Initiate(initiate) => {
                let [t1, t2] = initiate.send_timeout.0.to_be_bytes();
                let [f1, f2] = initiate.features.0.to_be_bytes();
                let [p1, p2] = initiate.profile_features.to_be_bytes();
                let [i1, i2] = initiate.profile_ident.to_be_bytes();
                let fixed = [code, 0, 0, 0, t1, t2, f1, f2, p1, p2, i1, i2];
                put_addressed(buf, &fixed, &initiate.addresses)
            }
            Self::Abort(abort) => put_abort(buf, abort),
        }
    }
}

/// What a slave answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reply<'a> {
    /// The data record, as much of it as was wanted.
    Read {
        /// Slot.
        slot: u8,
        /// Index.
        index: u8,
        /// Data.
        data: &'a [u8],
    },
    /// The data record was written.
    Written {
        /// Slot.
        slot: u8,
        /// Index.
        index: u8,
        /// How many octets.
        length: u8,
    },
    /// Data back.
    DataTransport {
        /// Slot.
        slot: u8,
        /// Index.
        index: u8,
        /// Data.
        data: &'a [u8],
    },
    /// The alarm is acknowledged.
    AlarmAck(AlarmAck),
    /// The connection lives.
    Idle,
    /// Where the connection will be.
    Resource(Resource),
    /// The connection is open.
    Initiated(Initiated<'a>),
    /// The connection has ended.
    Abort(Abort),
    /// The request was refused.
    Negative {
        /// Which.
        function: Function,
        /// Why.
        error: V1Error,
    },
}

impl<'a> Reply<'a> {
    /// Reads a response.
    ///
    /// # Errors
    ///
    /// [`PduError`].
    pub fn parse(pdu: &'a [u8]) -> Result<Self, PduError> {
        let (&code, rest) = pdu.split_first().ok_or(PduError::Empty)?;
        let function = Function::from_code(code & !NEGATIVE).ok_or(PduError::Function { got: code })?;
        let length = PduError::Length {
            function,
            got: pdu.len(),
        };
        if code & NEGATIVE != 0 {
            let &[decode, code_1, code_2, ..] = rest else {
                return Err(length);
            };
            let code_1 = ErrorCode1(code_1);
            let error = V1Error { decode, code_1, code_2 };
            return Ok(Self::Negative { function, error });
        }
        match function {
            Function::Read => record(rest)
                .map(|(slot, index, data)| Self::Read { slot, index, data })
                .ok_or(length),
            Function::Write => match *rest {
                [slot, index, length] => Ok(Self::Written { slot, index, length }),
                _ => Err(length),
            },
            Function::DataTransport => record(rest)
                .map(|(slot, index, data)| Self::DataTransport { slot, index, data })
                .ok_or(length),
            Function::AlarmAck => alarm_ack(rest).map(Self::AlarmAck).ok_or(length),
            Function::Idle => Ok(Self::Idle),
            Function::ResourceManager => match *rest {
                [sap, t1, t2] if sap < super::super::sap::MSAC2_MANAGER => Ok(Self::Resource(Resource {
                    sap,
                    send_timeout: SendTimeout(u16::from_be_bytes([t1, t2])),
                })),
                [sap, _, _] => Err(PduError::Sap { got: sap }),
                _ => Err(length),
            },
            Function::Initiate => {
                let Some((&[max_data, f1, f2, p1, p2, i1, i2], addresses)) = rest.split_first_chunk() else {
                    return Err(length);
                };
                Ok(Self::Initiated(Initiated {
                    max_data,
                    features: Features(u16::from_be_bytes([f1, f2])),
                    profile_features: u16::from_be_bytes([p1, p2]),
                    profile_ident: u16::from_be_bytes([i1, i2]),
                    addresses: Addresses::parse(addresses).ok_or(PduError::Addresses)?,
                }))
            }
            Function::Abort => abort(rest).map(Self::Abort).ok_or(length),
        }
    }

    /// Writes the response; returns its length.
    ///
    /// # Errors
    ///
    /// [`EncodePduError`] when it has more than 240 octets of data or does not fit into `buf`.
    pub fn encode(&self, buf: &mut [u8]) -> Result<usize, EncodePduError> {
        match *self {
            Self::Read { slot, index, data } => {
                put(buf, &[Function::Read.code(), slot, index, data_length(data)?], data)
            }
            Self::Written { slot, index, length } => put(buf, &[Function::Write.code(), slot, index, length], &[]),
            Self::DataTransport { slot, index, data } => {
                let code = Function::DataTransport.code();
                put(buf, &[code, slot, index, data_length(data)?], data)
            }
            Self::AlarmAck(ack) => put(buf, &ack_octets(Function::AlarmAck.code(), ack), &[]),
            Self::Idle => put(buf, &[Function::Idle.code()], &[]),
            Self::Resource(Resource { sap, send_timeout }) => {
                let [t1, t2] = send_timeout.0.to_be_bytes();
                put(buf, &[Function::ResourceManager.code(), sap, t1, t2], &[])
            }
            Self::Initiated(initiated) => {
                let [f1, f2] = initiated.features.0.to_be_bytes();
                let [p1, p2] = initiated.profile_features.to_be_bytes();
                let [i1, i2] = initiated.profile_ident.to_be_bytes();
                let code = Function::Initiate.code();
                let fixed = [code, initiated.max_data, f1, f2, p1, p2, i1, i2];
                put_addressed(buf, &fixed, &initiated.addresses)
            }
            Self::Abort(abort) => put_abort(buf, abort),
            Self::Negative { function, error } => {
                let code = function.code() | NEGATIVE;
                put(buf, &[code, error.decode, error.code_1.0, error.code_2], &[])
            }
        }
    }
}

/// Slot, index, length, and exactly as many octets as the length says.
fn record(rest: &[u8]) -> Option<(u8, u8, &[u8])> {
    let (&[slot, index, length], data) = rest.split_first_chunk()?;
    (data.len() == usize::from(length) && data.len() <= MAX_V1_DATA).then_some((slot, index, data))
}

fn alarm_ack(rest: &[u8]) -> Option<AlarmAck> {
    match *rest {
        [slot, alarm_type, specifier] => Some(AlarmAck {
            slot,
            alarm_type: AlarmType(alarm_type),
            specifier: AlarmSpecifier::from_octet(specifier),
        }),
        _ => None,
    }
}

const fn ack_octets(code: u8, ack: AlarmAck) -> [u8; 4] {
    [code, ack.slot, ack.alarm_type.0, ack.specifier.octet()]
}

fn abort(rest: &[u8]) -> Option<Abort> {
    rest.first_chunk().copied().map(Abort::from_octets)
}

fn put_abort(buf: &mut [u8], abort: Abort) -> Result<usize, EncodePduError> {
    let [subnet, instance_reason] = abort.octets();
    put(buf, &[Function::Abort.code(), subnet, instance_reason], &[])
}

fn data_length(data: &[u8]) -> Result<u8, EncodePduError> {
    u8::try_from(data.len())
        .ok()
        .filter(|&length| usize::from(length) <= MAX_V1_DATA)
        .ok_or(EncodePduError {
            max: MAX_V1_DATA,
            got: data.len(),
        })
}

fn put(buf: &mut [u8], fixed: &[u8], data: &[u8]) -> Result<usize, EncodePduError> {
    let len = fixed.len() + data.len();
    let max = buf.len();
    let (first, rest) = buf
        .get_mut(..len)
        .and_then(|target| target.split_at_mut_checked(fixed.len()))
        .ok_or(EncodePduError { max, got: len })?;
    first.copy_from_slice(fixed);
    rest.copy_from_slice(data);
    Ok(len)
}

fn put_addressed(buf: &mut [u8], fixed: &[u8], addresses: &Addresses<'_>) -> Result<usize, EncodePduError> {
    let len = fixed.len() + addresses.len();
    let max = buf.len().min(MAX_V1_DATA + 4);
    let too_long = EncodePduError { max, got: len };
    let (first, rest) = buf
        .get_mut(..len)
        .filter(|target| target.len() <= max)
        .and_then(|target| target.split_at_mut_checked(fixed.len()))
        .ok_or(too_long)?;
    first.copy_from_slice(fixed);
    addresses.write(rest).ok_or(too_long)?;
    Ok(len)
}

/// Why octets are no PDU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PduError {
    /// No octets.
    #[error("no octets")]
    Empty,
    /// No function of this direction.
    #[error("unknown function {got:#04X}")]
    Function {
        /// Octet 1.
        got: u8,
    },
    /// More or fewer octets than the function and its length octet say.
    #[error("{function:?}: {got} octets do not fit its length")]
    Length {
        /// Which.
        function: Function,
        /// Octets there were.
        got: usize,
    },
    /// Add_Addr_Param is inconsistent.
    #[error("types, lengths and octets of the additional addresses do not fit each other")]
    Addresses,
    /// The resource manager named an access point no connection can have.
    #[error("access point of a connection: expected 0 to 48, got {got}")]
    Sap {
        /// The number.
        got: u8,
    },
}

/// A PDU that fits into no telegram, or not into the buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected at most {max} octets, got {got}")]
pub struct EncodePduError {
    /// Room.
    pub max: usize,
    /// Octets there were.
    pub got: usize,
}
