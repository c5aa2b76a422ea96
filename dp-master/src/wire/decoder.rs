//! Octets to telegrams: a strict decoder for a stream, and the pure function below it.

use super::telegram::MAX_SAP;
use super::{
    ED, EXTENSION, FunctionCode, Header, MAX_LE, MIN_LE, SC, SD1, SD2, SD3, SD3_DATA, SD4, Telegram, checksum,
};
use crate::address::Address;
use crate::station::{LineError, MAX_TELEGRAM};

/// What the decoder found in the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoded<'a> {
    /// A valid telegram.
    Telegram(Telegram<'a>),
    /// Octets that belong to no valid telegram.
    Discarded {
        /// Why the telegram that began here was given up.
        reason: DiscardReason,
        /// How many octets were passed over, up to the next start delimiter or the end of what was received. A spoiled character counts.
        octets: usize,
    },
}

/// Why octets are no telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DiscardReason {
    /// The octet starts no telegram.
    #[error("octet {got:#04x} is no start delimiter")]
    StartDelimiter {
        /// The octet found.
        got: u8,
    },
    /// LE outside 4…249.
    #[error("length LE must be 4 to 249, got {got}")]
    Length {
        /// LE.
        got: u8,
    },
    /// The repeated length differs.
    #[error("length LE is {le}, but repeated as {repeated}")]
    LengthRepeat {
        /// LE.
        le: u8,
        /// LEr.
        repeated: u8,
    },
    /// The second start delimiter of an SD2 telegram is another octet.
    #[error("second start delimiter must be 0x68, got {got:#04x}")]
    SecondStartDelimiter {
        /// The octet found.
        got: u8,
    },
    /// The sum of the octets is another one.
    #[error("frame check sequence must be {expected:#04x}, got {got:#04x}")]
    Checksum {
        /// The sum from DA to the last data octet.
        expected: u8,
        /// The octet found.
        got: u8,
    },
    /// The last octet is not ED.
    #[error("end delimiter must be 0x16, got {got:#04x}")]
    EndDelimiter {
        /// The octet found.
        got: u8,
    },
    /// An address that cannot stand here: extended without data, source or token holder 127.
    #[error("address octet {got:#04x} cannot stand here")]
    Address {
        /// The octet found.
        got: u8,
    },
    /// More service access points are announced than there are data octets.
    #[error("{announced} access points announced, but only {available} octets of data")]
    SapMissing {
        /// Access points announced in DA and SA.
        announced: usize,
        /// Data octets in the telegram.
        available: usize,
    },
    /// A service access point above 63, or an address extension for other segments, which is not supported.
    #[error("service access point must be 0 to 63, got {got}")]
    Sap {
        /// The octet found.
        got: u8,
    },
    /// A character could not be received.
    #[error("{0}")]
    Line(#[from] LineError),
    /// The line fell silent before the telegram was complete.
    #[error("telegram not complete when the line fell silent")]
    Truncated,
}

/// Why [`decode_one`] returns no telegram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// What is there could become a valid telegram with more octets.
    #[error("telegram not complete")]
    Incomplete,
    /// No further octet makes this a valid telegram.
    #[error(transparent)]
    Corrupt(#[from] DiscardReason),
}

/// Reads the telegram at the front of `octets` and returns it with the number of octets it takes.
///
/// Whatever follows the telegram is not looked at. The cost is bounded by the length of one telegram.
///
/// # Errors
///
/// [`DecodeError::Incomplete`] for nothing at all and for every proper prefix of a valid telegram; [`DecodeError::Corrupt`] with the first
/// cause found from front to back.
#[inline]
pub fn decode_one(octets: &[u8]) -> Result<(Telegram<'_>, usize), DecodeError> {
    // Where DA stands, and how many data octets follow FC.
    let (at, length) = match octets.first() {
        None => return Err(DecodeError::Incomplete),
        Some(&SC) => return Ok((Telegram::ShortAck, 1)),
        Some(&SD4) => return decode_token(octets),
        Some(&SD1) => (1, 0),
        Some(&SD2) => (4, variable_length(octets)?),
        Some(&SD3) => (1, SD3_DATA),
        Some(&got) => return Err(DiscardReason::StartDelimiter { got }.into()),
    };
    decode_body(octets, at, length)
}

fn decode_token(octets: &[u8]) -> Result<(Telegram<'_>, usize), DecodeError> {
    let mut addresses = [Address::BROADCAST; 2];
    for (index, address) in addresses.iter_mut().enumerate() {
        let got = *octets.get(1 + index).ok_or(DecodeError::Incomplete)?;
        *address = Address::new(got).map_err(|_| DiscardReason::Address { got })?;
    }
    let [da, sa] = addresses;
    Ok((Telegram::Token { da, sa }, 3))
}

/// Number of data octets that the front of an SD2 telegram announces.
#[inline]
fn variable_length(octets: &[u8]) -> Result<usize, DecodeError> {
    let le = *octets.get(1).ok_or(DecodeError::Incomplete)?;
    if !(MIN_LE..=MAX_LE).contains(&le) {
        return Err(DiscardReason::Length { got: le }.into());
    }
    let repeated = *octets.get(2).ok_or(DecodeError::Incomplete)?;
    if repeated != le {
        return Err(DiscardReason::LengthRepeat { le, repeated }.into());
    }
    // LE alone has a Hamming distance of 2 against the repeated LE; the second SD2 is what makes it 4.
    let got = *octets.get(3).ok_or(DecodeError::Incomplete)?;
    if got != SD2 {
        return Err(DiscardReason::SecondStartDelimiter { got }.into());
    }
    Ok(usize::from(le) - 3)
}

/// DA, SA, FC, `length` data octets, FCS and ED, with DA at index `at`.
#[inline]
fn decode_body(octets: &[u8], at: usize, length: usize) -> Result<(Telegram<'_>, usize), DecodeError> {
    let total = at + 3 + length + 2;
    let Some([da_octet, sa_octet, fc, field @ .., fcs, ed]) = octets.get(at..total) else {
        return Err(DecodeError::Incomplete);
    };
    let expected = checksum(field)
        .wrapping_add(*da_octet)
        .wrapping_add(*sa_octet)
        .wrapping_add(*fc);
    if *fcs != expected {
        return Err(DiscardReason::Checksum { expected, got: *fcs }.into());
    }
    if *ed != ED {
        return Err(DiscardReason::EndDelimiter { got: *ed }.into());
    }
    let (da, sa) = (Address::from_low_bits(*da_octet), Address::from_low_bits(*sa_octet));
    if sa.is_broadcast() {
        return Err(DiscardReason::Address { got: *sa_octet }.into());
    }
    let mut data = field;
    let dsap = take_sap(*da_octet, field, &mut data)?;
    let ssap = take_sap(*sa_octet, field, &mut data)?;
    let fc = FunctionCode::from_octet(*fc);
    let header = Header { da, sa, dsap, ssap, fc };
    Ok((Telegram::Data { header, data }, total))
}

/// The service access point at the front of `data`, the rest of `field`, when the address octet announces one.
#[inline]
fn take_sap(address: u8, field: &[u8], data: &mut &[u8]) -> Result<Option<u8>, DiscardReason> {
    if address & EXTENSION == 0 {
        return Ok(None);
    }
    let Some((&got, rest)) = data.split_first() else {
        return Err(match field.len() {
            0 => DiscardReason::Address { got: address },
            available => DiscardReason::SapMissing {
                announced: 2,
                available,
            },
        });
    };
    if got > MAX_SAP {
        return Err(DiscardReason::Sap { got });
    }
    *data = rest;
    Ok(Some(got))
}

/// Finds telegrams in a stream of octets that arrives in pieces of any size.
///
/// After a broken telegram it goes on at the next start delimiter *inside the octets already received*, so that one bad octet never costs
/// the telegram behind it. What it passes over it names, with the cause.
///
/// A telegram found that way may also be a chance pattern inside the data of the broken one (`E5` alone is a short acknowledgement). Whoever
/// acts on telegrams should therefore ask [`is_synchronised`](Self::is_synchronised), and call [`idle`](Self::idle) when the line was silent
/// for Tsyn; a mere listener takes everything.
///
/// Nothing is copied while each push brings whole telegrams. Memory is one telegram; the work per push is bounded by its length times that
/// of a telegram, and linear in practice.
#[derive(Clone, Debug)]
pub struct Decoder {
    /// The beginning of a telegram that is not complete yet.
    partial: [u8; MAX_TELEGRAM],
    len: usize,
    synchronised: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// An empty decoder.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            partial: [0; MAX_TELEGRAM],
            len: 0,
            synchronised: true,
        }
    }

    /// Takes octets in the order of arrival and hands every telegram and every discarded run to `sink`.
    #[inline]
    pub fn push(&mut self, octets: &[u8], mut sink: impl FnMut(Decoded<'_>)) {
        let mut rest = octets;
        while self.len > 0 && !rest.is_empty() {
            // Take only what the telegram in front needs, so that the rest can be read where it stands.
            let missing = wanted(&self.partial[..self.len]).saturating_sub(self.len).max(1);
            let take = missing.min(rest.len()).min(MAX_TELEGRAM - self.len);
            let (head, tail) = rest.split_at(take);
            self.partial[self.len..self.len + take].copy_from_slice(head);
            self.len += take;
            rest = tail;
            self.settle(None, &mut sink);
        }
        while !rest.is_empty() {
            match decode_one(rest) {
                Ok((telegram, consumed)) => {
                    sink(Decoded::Telegram(telegram));
                    rest = rest.get(consumed..).unwrap_or_default();
                }
                Err(DecodeError::Incomplete) => {
                    // A proper prefix of a telegram is shorter than the longest telegram.
                    let len = rest.len().min(MAX_TELEGRAM);
                    self.partial[..len].copy_from_slice(&rest[..len]);
                    self.len = len;
                    return;
                }
                Err(DecodeError::Corrupt(reason)) => {
                    let octets = to_next_start(rest);
                    self.synchronised = false;
                    sink(Decoded::Discarded { reason, octets });
                    rest = &rest[octets..];
                }
            }
        }
    }

    /// One character could not be received: what has begun cannot become complete any more.
    ///
    /// The spoiled character is counted in the last discarded run.
    pub fn push_line_error(&mut self, error: LineError, mut sink: impl FnMut(Decoded<'_>)) {
        self.settle(Some((DiscardReason::Line(error), 1)), &mut sink);
    }

    /// The stream ended: looks for telegrams inside what has begun and names the rest as truncated.
    ///
    /// For listeners and files; a station that has to act calls [`idle`](Self::idle), because such a telegram is stale.
    pub fn finish(&mut self, mut sink: impl FnMut(Decoded<'_>)) {
        if self.len > 0 {
            self.settle(Some((DiscardReason::Truncated, 0)), &mut sink);
        }
        self.synchronised = true;
    }

    /// The line was idle for at least Tsyn: whatever comes next starts a telegram. Returns how many octets of a partial one were dropped.
    pub fn idle(&mut self) -> usize {
        self.synchronised = true;
        core::mem::take(&mut self.len)
    }

    /// Octets of a telegram that has begun and is not complete.
    #[must_use]
    pub const fn pending(&self) -> usize {
        self.len
    }

    /// Whether nothing was discarded since the last [`idle`](Self::idle), so that a telegram is surely one.
    #[must_use]
    pub const fn is_synchronised(&self) -> bool {
        self.synchronised
    }

    /// Takes telegrams and rubbish from the front of `partial` until an incomplete telegram stands there.
    ///
    /// With an `end` nothing more will come: incomplete is then corrupt for that reason, and its number of characters that are not in the
    /// buffer is added to the last run.
    fn settle(&mut self, end: Option<(DiscardReason, usize)>, sink: &mut impl FnMut(Decoded<'_>)) {
        let mut start = 0;
        let mut lost = end.map_or(0, |(_, lost)| lost);
        while start < self.len {
            let octets = &self.partial[start..self.len];
            let reason = match decode_one(octets) {
                Ok((telegram, consumed)) => {
                    sink(Decoded::Telegram(telegram));
                    start += consumed;
                    continue;
                }
                Err(DecodeError::Corrupt(reason)) => reason,
                Err(DecodeError::Incomplete) => match end {
                    Some((reason, _)) => reason,
                    None => break,
                },
            };
            let mut passed = to_next_start(octets);
            start += passed;
            if start == self.len {
                passed += core::mem::take(&mut lost);
            }
            self.synchronised = false;
            sink(Decoded::Discarded { reason, octets: passed });
        }
        if let Some((reason, _)) = end
            && lost > 0
        {
            self.synchronised = false;
            sink(Decoded::Discarded { reason, octets: lost });
        }
        if start == self.len {
            self.len = 0;
        } else if start > 0 {
            self.partial.copy_within(start..self.len, 0);
            self.len -= start;
        }
    }
}

/// How many octets the telegram in front needs in all, as far as its beginning tells.
fn wanted(prefix: &[u8]) -> usize {
    match prefix {
        [SD1, ..] => 6,
        [SD2, le, _, _, ..] => usize::from(*le) + 6,
        [SD2, ..] => 4,
        [SD3, ..] => 14,
        [SD4, ..] => 3,
        _ => 1,
    }
}

/// Octets from the front to the next start delimiter behind it, or to the end.
fn to_next_start(octets: &[u8]) -> usize {
    octets
        .iter()
        .skip(1)
        .position(|octet| matches!(*octet, SD1 | SD2 | SD3 | SD4 | SC))
        .map_or(octets.len(), |index| index + 1)
}
