//! Captures: files in the format pcapng with link type 257 (PROFIBUS data link layer).
//!
//! ```text
//! section header       application
//! interface            link type 257, resolution 10⁻⁹ s, speed = baud rate
//! enhanced packet …    octets from the start delimiter to the end delimiter, time of the first start bit,
//!                      direction; for octets that are no telegram an error bit and the reason as a comment
//! ```
//!
//! Source: IETF draft-ietf-opsawg-pcapng (blocks, options, flags); tcpdump.org link-layer header types, LINKTYPE_PROFIBUS_DL 257.
//!
//! Wireshark knows no dissector for this link type; `dp-master/wireshark/profibus.lua` is one.

use std::borrow::Cow;
use std::io::{Read, Write};
use std::time::Duration as StdDuration;

use pcap_file::pcapng::blocks::enhanced_packet::{EnhancedPacketBlock, EnhancedPacketOption};
use pcap_file::pcapng::blocks::interface_description::{InterfaceDescriptionBlock, InterfaceDescriptionOption};
use pcap_file::pcapng::blocks::section_header::{SectionHeaderBlock, SectionHeaderOption};
use pcap_file::pcapng::{Block, PcapNgReader, PcapNgWriter};
use pcap_file::{DataLink, Endianness, PcapError};

use super::tracer::{Content, Direction, Trace};
use crate::station::LineError;
use crate::time::{Baud, Duration, Instant};
use crate::wire::{DecodeError, DiscardReason, Telegram, decode_one};

/// Writes a capture.
///
/// # Example
///
/// ```
/// use dp_master::phy::{CaptureReader, CaptureWriter, Direction, Trace};
/// use dp_master::time::{Baud, Duration, Instant};
///
/// # fn main() -> Result<(), dp_master::phy::CaptureError> {
/// let mut file = CaptureWriter::new(Vec::new(), Baud::B12000000, Duration::ZERO)?;
/// let (start, end) = (Instant::from_nanos(1_000), Instant::from_nanos(3_750));
/// file.write(&Trace::of(start, end, Direction::Received, &[0xDC, 0x02, 0x01]))?;
/// let octets = file.finish()?;
/// let mut capture = CaptureReader::new(octets.as_slice())?;
/// let packet = capture.next().expect("one telegram was written")?;
/// assert_eq!((packet.start, packet.octets.as_slice()), (start, &[0xDC, 0x02, 0x01][..]));
/// assert_eq!(capture.baud(), Some(Baud::B12000000));
/// # Ok(())
/// # }
/// ```
pub struct CaptureWriter<W: Write> {
    file: PcapNgWriter<W>,
    epoch: Duration,
}

impl<W: Write> CaptureWriter<W> {
    /// Begins a capture of one line. `epoch` is the time from 1970-01-01 00:00 UTC to [`Instant::ZERO`]; zero for virtual time.
    ///
    /// Each packet is one small write: give a buffered writer.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Io`].
    pub fn new(writer: W, baud: Baud, epoch: Duration) -> Result<Self, CaptureError> {
        let section = SectionHeaderBlock {
            endianness: Endianness::Little,
            options: vec![SectionHeaderOption::UserApplication(Cow::Borrowed(concat!(
                "dp-master ",
                env!("CARGO_PKG_VERSION")
            )))],
            ..SectionHeaderBlock::default()
        };
        let mut file = PcapNgWriter::with_section_header(writer, section)?;
        file.write_pcapng_block(InterfaceDescriptionBlock {
            linktype: DataLink::PROFIBUS_DL,
            snaplen: 0,
            options: vec![
                InterfaceDescriptionOption::IfName(Cow::Borrowed("profibus")),
                InterfaceDescriptionOption::IfSpeed(baud.bits_per_second().into()),
                InterfaceDescriptionOption::IfTsResol(NANOSECONDS),
            ],
        })?;
        Ok(Self { file, epoch })
    }

    /// Writes one telegram or discarded run.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Io`].
    pub fn write(&mut self, trace: &Trace<'_>) -> Result<(), CaptureError> {
        let mut flags = match trace.direction {
            Direction::Received => INBOUND,
            Direction::Sent => OUTBOUND,
        };
        let mut comment = None;
        let mut lost_characters = 0;
        if let Content::Discarded { reason, lost } = trace.content {
            flags |= error_bit(reason);
            lost_characters = lost;
            comment = Some(EnhancedPacketOption::Comment(Cow::Owned(reason.to_string())));
        }
        // A packet has at most the octets of a telegram, so the lengths fit.
        let original_len = u32::try_from(trace.octets.len().saturating_add(lost_characters)).unwrap_or(u32::MAX);
        let since_1970 = self.epoch + (trace.start - Instant::ZERO);
        self.file.write_pcapng_block(EnhancedPacketBlock {
            interface_id: 0,
            timestamp: StdDuration::from_nanos(since_1970.as_nanos()),
            original_len,
            data: Cow::Borrowed(trace.octets),
            options: [EnhancedPacketOption::Flags(flags)]
                .into_iter()
                .chain(comment)
                .collect(),
        })?;
        Ok(())
    }

    /// Hands everything to the writer below.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Io`].
    pub fn flush(&mut self) -> Result<(), CaptureError> {
        self.file.get_mut().flush().map_err(CaptureError::Io)
    }

    /// Ends the capture and gives the writer back.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Io`].
    pub fn finish(mut self) -> Result<W, CaptureError> {
        self.flush()?;
        Ok(self.file.into_inner())
    }
}

impl<W: Write> std::fmt::Debug for CaptureWriter<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CaptureWriter")
            .field("epoch", &self.epoch)
            .finish_non_exhaustive()
    }
}

/// Reads a capture, packet by packet. Blocks that are no packets of a PROFIBUS line are passed over.
pub struct CaptureReader<R: Read> {
    file: PcapNgReader<R>,
    failed: bool,
}

impl<R: Read> CaptureReader<R> {
    /// Opens a capture.
    ///
    /// # Errors
    ///
    /// [`CaptureError::NotPcapNg`], [`CaptureError::Io`].
    pub fn new(reader: R) -> Result<Self, CaptureError> {
        let file = PcapNgReader::new(reader).map_err(|error| match error {
            PcapError::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
                CaptureError::Io(source)
            }
            _ => CaptureError::NotPcapNg,
        })?;
        Ok(Self { file, failed: false })
    }

    /// The baud rate of the first PROFIBUS line, if the capture names one of the ten. Known from the first packet on.
    #[must_use]
    pub fn baud(&self) -> Option<Baud> {
        self.file
            .interfaces()
            .iter()
            .filter(|interface| interface.linktype == DataLink::PROFIBUS_DL)
            .flat_map(|interface| &interface.options)
            .find_map(|option| match option {
                InterfaceDescriptionOption::IfSpeed(speed) => {
                    u32::try_from(*speed).ok().and_then(Baud::from_bits_per_second)
                }
                _ => None,
            })
    }

    fn read(&mut self) -> Result<Option<Packet>, CaptureError> {
        loop {
            let (interface, mut packet) = match self.file.next_block() {
                None => return Ok(None),
                Some(Err(error)) => return Err(error.into()),
                Some(Ok(Block::EnhancedPacket(block))) => (block.interface_id, Packet::from(block)),
                Some(Ok(_)) => continue,
            };
            let Some(interface) = usize::try_from(interface)
                .ok()
                .and_then(|interface| self.file.interfaces().get(interface))
            else {
                return Err(CaptureError::Corrupt {
                    reason: "a packet belongs to no interface".to_owned(),
                });
            };
            if interface.linktype != DataLink::PROFIBUS_DL {
                continue;
            }
            packet.start = rescale(packet.start, &interface.options);
            return Ok(Some(packet));
        }
    }
}

impl<R: Read> std::fmt::Debug for CaptureReader<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CaptureReader").finish_non_exhaustive()
    }
}

impl<R: Read> Iterator for CaptureReader<R> {
    type Item = Result<Packet, CaptureError>;

    /// After an error there is nothing more: where the next block begins is unknown.
    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let next = self.read().transpose();
        self.failed = matches!(next, Some(Err(_)));
        next
    }
}

/// One packet of a capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Packet {
    /// When its first start bit began, since 1970-01-01 00:00 UTC.
    pub start: Instant,
    /// Which way it went; `None` when the file does not say.
    pub direction: Option<Direction>,
    /// The octets.
    pub octets: Vec<u8>,
    /// Characters that could not be received and are not among the octets.
    pub lost: usize,
    /// The first comment: for octets that are no telegram the reason.
    pub comment: Option<String>,
    /// A character could not be received (flag "symbol error"), so that the octets cannot tell what was wrong.
    pub symbol_error: bool,
}

impl Packet {
    /// The packet as a trace. A spoiled character is told as [`LineError::Parity`], because a file does not tell its kind.
    ///
    /// The end is computed from the baud rate.
    #[must_use]
    pub fn trace(&self, baud: Baud) -> Trace<'_> {
        let end = self.start + baud.characters(self.octets.len().saturating_add(self.lost));
        let direction = self.direction.unwrap_or(Direction::Received);
        let mut trace = Trace::of(self.start, end, direction, &self.octets);
        if self.symbol_error {
            trace.content = Content::Discarded {
                reason: DiscardReason::Line(LineError::Parity),
                lost: self.lost,
            };
        } else if let Content::Discarded { lost, .. } = &mut trace.content {
            *lost = self.lost;
        }
        trace
    }

    /// The telegram, if the octets are exactly one.
    ///
    /// # Errors
    ///
    /// [`DecodeError`].
    pub fn telegram(&self) -> Result<Telegram<'_>, DecodeError> {
        let (telegram, used) = decode_one(&self.octets)?;
        match self.octets.get(used) {
            None => Ok(telegram),
            Some(&got) => Err(DiscardReason::StartDelimiter { got }.into()),
        }
    }
}

impl From<EnhancedPacketBlock<'_>> for Packet {
    fn from(block: EnhancedPacketBlock<'_>) -> Self {
        let mut packet = Self {
            // The crate below takes every resolution for nanoseconds; it is set right when the interface is known.
            start: Instant::from_nanos(u64::try_from(block.timestamp.as_nanos()).unwrap_or(u64::MAX)),
            direction: None,
            lost: usize::try_from(block.original_len)
                .unwrap_or(usize::MAX)
                .saturating_sub(block.data.len()),
            octets: block.data.into_owned(),
            comment: None,
            symbol_error: false,
        };
        for option in block.options {
            match option {
                EnhancedPacketOption::Flags(flags) => {
                    packet.direction = match flags & DIRECTION {
                        INBOUND => Some(Direction::Received),
                        OUTBOUND => Some(Direction::Sent),
                        _ => None,
                    };
                    packet.symbol_error = flags & SYMBOL_ERROR != 0;
                }
                EnhancedPacketOption::Comment(comment) if packet.comment.is_none() => {
                    packet.comment = Some(comment.into_owned());
                }
                _ => {}
            }
        }
        packet
    }
}

/// Why a capture cannot be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The file does not begin like a pcapng file.
    #[error("the file is no pcapng capture")]
    NotPcapNg,
    /// A block that contradicts itself.
    #[error("the capture is damaged: {reason}")]
    Corrupt {
        /// What is wrong.
        reason: String,
    },
    /// The file ends inside a block.
    #[error("the capture ends inside a block")]
    Truncated,
    /// Reading or writing failed.
    #[error("the capture cannot be read or written: {0}")]
    Io(std::io::Error),
}

impl From<PcapError> for CaptureError {
    fn from(error: PcapError) -> Self {
        match error {
            PcapError::IoError(source) if source.kind() == std::io::ErrorKind::UnexpectedEof => Self::Truncated,
            PcapError::IoError(source) => Self::Io(source),
            PcapError::IncompleteBuffer => Self::Truncated,
            other => Self::Corrupt {
                reason: other.to_string(),
            },
        }
    }
}

/// The time of a packet in nanoseconds, from the unit that its interface names.
fn rescale(raw: Instant, options: &[InterfaceDescriptionOption<'_>]) -> Instant {
    let resolution = options
        .iter()
        .find_map(|option| match option {
            InterfaceDescriptionOption::IfTsResol(resolution) => Some(*resolution),
            _ => None,
        })
        .unwrap_or(MICROSECONDS);
    let ticks = u128::from(raw.as_nanos());
    let nanos = if resolution & 0x80 != 0 {
        (ticks * 1_000_000_000) >> (resolution & 0x7F)
    } else {
        match resolution {
            0..=9 => ticks * 10_u128.pow(u32::from(9 - resolution)),
            finer => ticks / 10_u128.checked_pow(u32::from(finer - 9)).unwrap_or(u128::MAX),
        }
    };
    Instant::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
}

/// The bit of the flags that comes closest to a reason.
const fn error_bit(reason: DiscardReason) -> u32 {
    match reason {
        DiscardReason::Line(_) => SYMBOL_ERROR,
        DiscardReason::StartDelimiter { .. } | DiscardReason::SecondStartDelimiter { .. } => START_ERROR,
        DiscardReason::Truncated => TOO_SHORT,
        DiscardReason::Checksum { .. } => CHECKSUM_ERROR,
        _ => UNALIGNED,
    }
}

/// Resolution of the times: 10⁻⁹ s.
const NANOSECONDS: u8 = 9;
/// Resolution when a file names none.
const MICROSECONDS: u8 = 6;
/// Bits 1 and 0 of the flags of a packet.
const DIRECTION: u32 = 0b11;
const INBOUND: u32 = 0b01;
const OUTBOUND: u32 = 0b10;
const CHECKSUM_ERROR: u32 = 1 << 24;
const TOO_SHORT: u32 = 1 << 26;
const UNALIGNED: u32 = 1 << 28;
const START_ERROR: u32 = 1 << 29;
const SYMBOL_ERROR: u32 = 1 << 31;
