//! A telegram as a value, and its octets.

use super::{ED, EXTENSION, FunctionCode, SC, SD1, SD2, SD3, SD3_DATA, SD4, copy_with_checksum};
use crate::address::Address;
use crate::station::MAX_TELEGRAM;

/// Most data octets of a telegram, service access points included (LE = 249 less DA, SA, FC).
pub const MAX_DATA: usize = 246;
/// Highest service access point; 63 is the one that reaches all.
pub const MAX_SAP: u8 = 63;

/// A telegram; the data are borrowed from the octets it was read from.
///
/// The start delimiter of a data telegram is not part of the value: it follows from the number of data octets, see
/// [`encode`](Self::encode).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Telegram<'a> {
    /// A request or response with or without data (SD1, SD2, SD3).
    Data {
        /// Addresses, access points, function code.
        header: Header,
        /// The data without the service access points, at most 246 octets less one for each of them.
        data: &'a [u8],
    },
    /// The token (SD4).
    Token {
        /// To whom it is passed.
        da: Address,
        /// Who passes it.
        sa: Address,
    },
    /// The short acknowledgement (SC).
    ShortAck,
}

/// What stands before the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Destination.
    pub da: Address,
    /// Source, never the broadcast address.
    pub sa: Address,
    /// Destination service access point 0…63; `None` is the default one.
    pub dsap: Option<u8>,
    /// Source service access point 0…63; `None` is the default one.
    pub ssap: Option<u8>,
    /// Function code.
    pub fc: FunctionCode,
}

impl Header {
    /// A header for the default service access points.
    #[must_use]
    pub const fn new(da: Address, sa: Address, fc: FunctionCode) -> Self {
        Self {
            da,
            sa,
            dsap: None,
            ssap: None,
            fc,
        }
    }

    /// The same with both service access points, 0…63.
    #[must_use]
    pub const fn with_saps(self, dsap: u8, ssap: u8) -> Self {
        Self {
            dsap: Some(dsap),
            ssap: Some(ssap),
            ..self
        }
    }

    /// [`Telegram::encode_without_sd3`] of a data telegram whose parts are not put together first.
    ///
    /// # Errors
    ///
    /// As [`Telegram::encode`].
    #[inline]
    pub(crate) fn encode_without_sd3(&self, data: &[u8], buf: &mut [u8; MAX_TELEGRAM]) -> Result<usize, EncodeError> {
        write_data(self, data, buf, Sd3::Never)
    }
}

/// Why a telegram has no octets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// More data than LE = 249 has room for.
    #[error("at most {max} octets of data fit beside the access points, got {got}")]
    DataTooLong {
        /// Room left.
        max: usize,
        /// Octets given.
        got: usize,
    },
    /// A service access point above 63.
    #[error("service access point must be 0 to 63, got {got}")]
    Sap {
        /// The number given.
        got: u8,
    },
    /// Broadcast is no source, and the token goes to one station.
    #[error("the broadcast address can neither send nor hold the token")]
    Broadcast,
}

impl<'a> Telegram<'a> {
    /// A telegram without data and without service access points.
    #[must_use]
    pub const fn no_data(da: Address, sa: Address, fc: FunctionCode) -> Self {
        Self::Data {
            header: Header::new(da, sa, fc),
            data: &[],
        }
    }

    /// Destination; the short acknowledgement has none.
    #[must_use]
    pub const fn destination(&self) -> Option<Address> {
        match self {
            Self::Data { header, .. } => Some(header.da),
            Self::Token { da, .. } => Some(*da),
            Self::ShortAck => None,
        }
    }

    /// Source; the short acknowledgement has none.
    #[must_use]
    pub const fn source(&self) -> Option<Address> {
        match self {
            Self::Data { header, .. } => Some(header.sa),
            Self::Token { sa, .. } => Some(*sa),
            Self::ShortAck => None,
        }
    }

    /// Length on the wire in octets when written by [`encode`](Self::encode).
    #[must_use]
    pub const fn encoded_len(&self) -> usize {
        match self {
            Self::Data { header, data } => {
                match data.len() + header.dsap.is_some() as usize + header.ssap.is_some() as usize {
                    0 => 6,
                    SD3_DATA => 14,
                    n => n + 9,
                }
            }
            Self::Token { .. } => 3,
            Self::ShortAck => 1,
        }
    }

    /// Writes the telegram to the front of `buf` and returns its length in octets.
    ///
    /// A data telegram becomes SD1 without data, SD3 with exactly eight data octets (service access points counted), SD2 otherwise.
    ///
    /// # Errors
    ///
    /// [`EncodeError::DataTooLong`], [`EncodeError::Sap`], [`EncodeError::Broadcast`]. `buf` is then unspecified.
    #[inline]
    pub fn encode(&self, buf: &mut [u8; MAX_TELEGRAM]) -> Result<usize, EncodeError> {
        self.write(buf, Sd3::WhenItFits)
    }

    /// Like [`encode`](Self::encode), but eight data octets become SD2. DP stations send them so, and the stations of
    /// [`fdl`](crate::fdl) with them; SD3 is only received.
    ///
    /// # Errors
    ///
    /// As [`encode`](Self::encode).
    #[inline]
    pub fn encode_without_sd3(&self, buf: &mut [u8; MAX_TELEGRAM]) -> Result<usize, EncodeError> {
        self.write(buf, Sd3::Never)
    }

    #[inline(always)]
    fn write(&self, buf: &mut [u8; MAX_TELEGRAM], sd3: Sd3) -> Result<usize, EncodeError> {
        match self {
            Self::Data { header, data } => write_data(header, data, buf, sd3),
            Self::Token { da, sa } => {
                if da.is_broadcast() || sa.is_broadcast() {
                    return Err(EncodeError::Broadcast);
                }
                buf[..3].copy_from_slice(&[SD4, da.value(), sa.value()]);
                Ok(3)
            }
            Self::ShortAck => {
                buf[0] = SC;
                Ok(1)
            }
        }
    }
}

/// Whether eight data octets may use the telegram made for them.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sd3 {
    WhenItFits,
    Never,
}

#[inline(always)]
fn write_data(header: &Header, data: &[u8], buf: &mut [u8; MAX_TELEGRAM], sd3: Sd3) -> Result<usize, EncodeError> {
    let Header { da, sa, dsap, ssap, fc } = *header;
    if sa.is_broadcast() {
        return Err(EncodeError::Broadcast);
    }
    let extensions = usize::from(dsap.is_some()) + usize::from(ssap.is_some());
    let max = MAX_DATA - extensions;
    if data.len() > max {
        return Err(EncodeError::DataTooLong { max, got: data.len() });
    }
    let length = extensions + data.len();

    // `at` is where DA stands; everything behind it is the same in all three formats.
    let at = if length == 0 {
        buf[0] = SD1;
        1
    } else if length == SD3_DATA && sd3 == Sd3::WhenItFits {
        buf[0] = SD3;
        1
    } else {
        // At most 3 + 246 = 249.
        let le = (length + 3) as u8;
        buf[..4].copy_from_slice(&[SD2, le, le, SD2]);
        4
    };
    let (mut da, mut sa, fc) = (da.value(), sa.value(), fc.to_octet());
    let mut fcs = 0_u8;
    let mut next = at + 3;
    for (sap, address) in [(dsap, &mut da), (ssap, &mut sa)] {
        if let Some(sap) = sap {
            if sap > MAX_SAP {
                return Err(EncodeError::Sap { got: sap });
            }
            *address |= EXTENSION;
            buf[next] = sap;
            fcs = fcs.wrapping_add(sap);
            next += 1;
        }
    }
    buf[at..at + 3].copy_from_slice(&[da, sa, fc]);
    fcs = fcs.wrapping_add(da).wrapping_add(sa).wrapping_add(fc);
    let end = next + data.len();
    fcs = fcs.wrapping_add(copy_with_checksum(data, &mut buf[next..end]));
    buf[end..end + 2].copy_from_slice(&[fcs, ED]);
    Ok(end + 2)
}
