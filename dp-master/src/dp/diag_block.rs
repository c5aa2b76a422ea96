//! The extended diagnosis: its blocks, read and written.
//!
//! ```text
//! header 00 llllll   device-related, ll octets with the header: coded by the manufacturer, or alarm and status of DP-V1
//! header 01 llllll   identifier-related, ll octets with the header: one bit a module, least significant first
//! header 10 mmmmmm   channel-related, three octets: module mm
//!          octet 2: 7, 6 direction, 5…0 channel       octet 3: 7…5 unit, 4…0 error
//! header 11 rrrrrr   revision number rr, one octet
//! ```
//!
//! Modules and channels count from 0. The texts of manufacturer-specific errors are in the GSD file of the device
//! (`Channel_Diag`, `Unit_Diag_Bit`); the numbers to look them up with are here.
//!
//! Source: IEC 61158-6-3, coding of Ext_Diag_Data.

use super::diag::{MAX_EXT_DIAG, Overflow};
use super::image::Octets;

/// One block of extended diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block<'a> {
    /// Device-related, the octets after the header; what they mean says the manufacturer, or DP-V1 when that was
    /// enabled.
    Device(&'a [u8]),
    /// Identifier-related: which modules have something to say.
    Identifiers(ModuleSet<'a>),
    /// Channel-related: which channel of which module has which error.
    Channel(ChannelDiag),
    /// Revision number, 0…63.
    Revision(u8),
    /// The rest cannot be divided.
    Malformed {
        /// Why.
        fault: BlockFault,
        /// All octets from the header on.
        octets: &'a [u8],
    },
}

/// Why octets of an extended diagnosis are no block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BlockFault {
    /// The header gives a length of 0, which does not even hold the header.
    #[error("diagnosis block {header:#04x}: expected a length of at least 1, got 0")]
    LengthZero {
        /// The header.
        header: u8,
    },
    /// The header gives more octets than there are.
    #[error("diagnosis block {header:#04x}: expected {expected} octets, got {got}")]
    Truncated {
        /// The header.
        header: u8,
        /// Octets it announces, itself counted.
        expected: usize,
        /// Octets there are.
        got: usize,
    },
}

/// Iterator over the blocks of an extended diagnosis. A malformed one is the last.
#[derive(Debug, Clone)]
pub struct Blocks<'a> {
    rest: &'a [u8],
}

impl<'a> Blocks<'a> {
    /// Divides an extended diagnosis.
    pub fn new(extended: &'a [u8]) -> Self {
        Self { rest: extended }
    }
}

impl<'a> Iterator for Blocks<'a> {
    type Item = Block<'a>;

    fn next(&mut self) -> Option<Block<'a>> {
        let octets = self.rest;
        let &header = octets.first()?;
        let low = header & LOW;
        let len = match header & KIND {
            CHANNEL => 3,
            REVISION => 1,
            _ => usize::from(low),
        };
        let fault = match octets.split_at_checked(len) {
            Some(([_, content @ ..], rest)) => {
                self.rest = rest;
                return Some(match (header & KIND, content) {
                    (DEVICE, _) => Block::Device(content),
                    (IDENTIFIERS, _) => Block::Identifiers(ModuleSet(content)),
                    (CHANNEL, &[channel, error]) => Block::Channel(ChannelDiag::from_octets([low, channel, error])),
                    _ => Block::Revision(low),
                });
            }
            Some(([], _)) => BlockFault::LengthZero { header },
            None => BlockFault::Truncated {
                header,
                expected: len,
                got: octets.len(),
            },
        };
        self.rest = &[];
        Some(Block::Malformed { fault, octets })
    }
}

/// The modules of an identifier-related block.
///
/// # Example
///
/// ```
/// use dp_master::dp::{Block, Blocks};
/// // 42: two octets; bits 0 and 2.
/// let Some(Block::Identifiers(modules)) = Blocks::new(&[0x42, 0b101]).next() else { panic!() };
/// assert!(modules.iter().eq([0, 2]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModuleSet<'a>(&'a [u8]);

impl<'a> ModuleSet<'a> {
    /// The octets after the header, one bit a module.
    pub fn octets(self) -> &'a [u8] {
        self.0
    }

    /// Whether the module, counted from 0, is among them.
    pub fn contains(self, module: usize) -> bool {
        self.0
            .get(module / 8)
            .is_some_and(|octet| octet >> (module % 8) & 1 == 1)
    }

    /// The modules, counted from 0: the places of [`places`](super::places).
    pub fn iter(self) -> impl Iterator<Item = usize> + 'a {
        (0..self.0.len() * 8).filter(move |&module| self.contains(module))
    }
}

/// A channel-related block, lossless both ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChannelDiag {
    /// Module, 0…63: the place of [`places`](super::places).
    pub module: u8,
    /// Which way its data go.
    pub direction: Direction,
    /// Channel, 0…63.
    pub channel: u8,
    /// How large a channel is.
    pub unit: ChannelUnit,
    /// What is wrong, 0…31.
    pub error: ChannelError,
}

impl ChannelDiag {
    /// Reads the three octets; the upper two bits of the first are ignored.
    pub const fn from_octets(octets: [u8; 3]) -> Self {
        let [module, channel, error] = octets;
        Self {
            module: module & LOW,
            direction: match channel >> 6 {
                0 => Direction::Reserved,
                1 => Direction::Input,
                2 => Direction::Output,
                _ => Direction::InputOutput,
            },
            channel: channel & LOW,
            unit: match error >> 5 {
                0 => ChannelUnit::Reserved0,
                1 => ChannelUnit::Bit,
                2 => ChannelUnit::TwoBits,
                3 => ChannelUnit::FourBits,
                4 => ChannelUnit::Byte,
                5 => ChannelUnit::Word,
                6 => ChannelUnit::TwoWords,
                _ => ChannelUnit::Reserved7,
            },
            error: ChannelError(error & ERROR),
        }
    }

    /// The three octets; numbers beyond their range lose their upper bits.
    pub const fn octets(self) -> [u8; 3] {
        [
            CHANNEL | self.module & LOW,
            (self.direction as u8) << 6 | self.channel & LOW,
            (self.unit as u8) << 5 | self.error.0 & ERROR,
        ]
    }
}

/// Which way the data of a channel go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// 0, reserved.
    Reserved,
    /// Input.
    Input,
    /// Output.
    Output,
    /// Input and output.
    InputOutput,
}

impl Direction {
    /// As the standard calls it.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Reserved => "reserved",
            Self::Input => "input",
            Self::Output => "output",
            Self::InputOutput => "input/output",
        }
    }
}

/// How large a channel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ChannelUnit {
    /// 0, reserved.
    Reserved0,
    /// One bit.
    Bit,
    /// Two bits.
    TwoBits,
    /// Four bits.
    FourBits,
    /// One octet.
    Byte,
    /// Two octets.
    Word,
    /// Four octets.
    TwoWords,
    /// 7, reserved.
    Reserved7,
}

impl ChannelUnit {
    /// As the standard calls it.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Reserved0 | Self::Reserved7 => "reserved",
            Self::Bit => "bit",
            Self::TwoBits => "2 bit",
            Self::FourBits => "4 bit",
            Self::Byte => "byte",
            Self::Word => "word",
            Self::TwoWords => "2 words",
        }
    }
}

/// What is wrong with a channel, 0…31.
///
/// Source: IEC 61158-6-3, error types of the channel-related diagnosis; Omron CS1W-PRM21 manual, appendix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ChannelError(pub u8);

impl ChannelError {
    /// Short circuit.
    pub const SHORT_CIRCUIT: Self = Self(1);
    /// Undervoltage.
    pub const UNDERVOLTAGE: Self = Self(2);
    /// Overvoltage.
    pub const OVERVOLTAGE: Self = Self(3);
    /// Overload.
    pub const OVERLOAD: Self = Self(4);
    /// Overtemperature.
    pub const OVERTEMPERATURE: Self = Self(5);
    /// Line break.
    pub const LINE_BREAK: Self = Self(6);
    /// Upper limit value exceeded.
    pub const UPPER_LIMIT: Self = Self(7);
    /// Lower limit value exceeded.
    pub const LOWER_LIMIT: Self = Self(8);
    /// Error.
    pub const ERROR: Self = Self(9);

    /// The text of the standard; `None` for reserved numbers and those of the manufacturer.
    pub const fn text(self) -> Option<&'static str> {
        Some(match self.0 {
            1 => "short circuit",
            2 => "undervoltage",
            3 => "overvoltage",
            4 => "overload",
            5 => "overtemperature",
            6 => "line break",
            7 => "upper limit value exceeded",
            8 => "lower limit value exceeded",
            9 => "error",
            _ => return None,
        })
    }

    /// 16…31: its text is `Channel_Diag` in the GSD file.
    pub const fn is_manufacturer_specific(self) -> bool {
        matches!(self.0, 16..=31)
    }
}

/// Whether the data of a module are valid: two bits of the status message Modul_Status (DP-V1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ModuleState {
    /// 0: valid data.
    Valid,
    /// 1: invalid data, the module has an error.
    Error,
    /// 2: invalid data, another module is plugged.
    WrongModule,
    /// 3: invalid data, no module is plugged.
    NoModule,
}

/// The modules of a status message Modul_Status (status type 2): from the octet after the specifier on, four modules an
/// octet, the first in bits 1 and 0.
///
/// Places behind the last module are filled up with 0 by the slave: the length does not say how many modules there are.
pub fn module_states(data: &[u8]) -> impl Iterator<Item = ModuleState> + '_ {
    data.iter().flat_map(|octet| {
        [0, 2, 4, 6].map(|shift| match octet >> shift & 3 {
            0 => ModuleState::Valid,
            1 => ModuleState::Error,
            2 => ModuleState::WrongModule,
            _ => ModuleState::NoModule,
        })
    })
}

/// Writes the extended diagnosis of a slave, block after block. What does not fit is left out and remembered as
/// overflow, so that the master learns of it.
///
/// # Example
///
/// ```
/// use dp_master::dp::{ChannelDiag, ChannelError, ChannelUnit, Direction, ExtDiagWriter, Overflow};
/// let mut writer = ExtDiagWriter::new();
/// writer.modules(8, |module| module == 1);
/// writer.channel(ChannelDiag {
///     module: 1,
///     direction: Direction::Input,
///     channel: 3,
///     unit: ChannelUnit::Word,
///     error: ChannelError::LINE_BREAK,
/// });
/// assert_eq!(writer.octets(), [0x42, 0x02, 0x81, 0x43, 0xA6]);
/// assert_eq!(writer.overflow(), Overflow::Complete);
/// ```
#[derive(Debug, Clone)]
pub struct ExtDiagWriter {
    octets: Octets<MAX_EXT_DIAG>,
    limit: usize,
    overflow: Overflow,
}

impl ExtDiagWriter {
    /// Nothing written; up to 238 octets.
    pub const fn new() -> Self {
        Self::with_limit(MAX_EXT_DIAG)
    }

    /// Nothing written; up to `limit` octets, at most 238: Max_Diag_Data_Len of the GSD file less 6.
    pub const fn with_limit(limit: usize) -> Self {
        Self {
            octets: Octets::EMPTY,
            limit: if limit < MAX_EXT_DIAG { limit } else { MAX_EXT_DIAG },
            overflow: Overflow::Complete,
        }
    }

    /// A device-related block with this content, at most 62 octets.
    pub fn device(&mut self, content: &[u8]) -> &mut Self {
        match content.len() {
            // At most 63, so it fits the six bits.
            len @ 0..=62 => self.push(DEVICE | (len + 1) as u8, content),
            _ => self.cut(),
        }
    }

    /// An identifier-related block over this many modules, at most 496, with those that have something to say.
    pub fn modules(&mut self, count: usize, affected: impl Fn(usize) -> bool) -> &mut Self {
        let mut bits = [0u8; 62];
        let len = count.div_ceil(8);
        let Some(used) = bits.get_mut(..len) else {
            return self.cut();
        };
        for module in (0..count).filter(|&module| affected(module)) {
            if let Some(octet) = used.get_mut(module / 8) {
                *octet |= 1 << (module % 8);
            }
        }
        // At most 63, so it fits the six bits.
        self.push(IDENTIFIERS | (len + 1) as u8, used)
    }

    /// A channel-related block.
    pub fn channel(&mut self, channel: ChannelDiag) -> &mut Self {
        let [header, content @ ..] = channel.octets();
        self.push(header, &content)
    }

    /// The revision number, 0…63.
    pub fn revision(&mut self, revision: u8) -> &mut Self {
        self.push(REVISION | revision & LOW, &[])
    }

    /// What was written.
    pub fn octets(&self) -> &[u8] {
        &self.octets
    }

    /// Whether everything fitted.
    pub fn overflow(&self) -> Overflow {
        self.overflow
    }

    fn push(&mut self, header: u8, content: &[u8]) -> &mut Self {
        let begin = self.octets.len();
        let end = begin + 1 + content.len();
        let mut longer = Octets::<MAX_EXT_DIAG>::zeroed(end);
        if end > self.limit {
            return self.cut();
        }
        if let Some((old, new)) = longer.as_mut_slice().split_at_mut_checked(begin) {
            old.copy_from_slice(&self.octets);
            if let [first, rest @ ..] = new {
                *first = header;
                rest.copy_from_slice(content);
            }
            self.octets = longer;
        }
        self
    }

    fn cut(&mut self) -> &mut Self {
        self.overflow = Overflow::Truncated;
        self
    }
}

impl Default for ExtDiagWriter {
    fn default() -> Self {
        Self::new()
    }
}

/// Bits 7 and 6 of a header.
const KIND: u8 = 0xC0;
const DEVICE: u8 = 0x00;
const IDENTIFIERS: u8 = 0x40;
const CHANNEL: u8 = 0x80;
const REVISION: u8 = 0xC0;
/// Bits 5…0.
const LOW: u8 = 0x3F;
/// Bits 4…0 of the third octet.
const ERROR: u8 = 0x1F;
