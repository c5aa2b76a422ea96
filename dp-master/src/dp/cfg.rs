//! Chk_Cfg: identifier octets and the input and output lengths that follow from them.
//!
//! ```text
//! general identifier format, one octet
//! bit 7     consistency: 0 per byte or word, 1 over the whole length
//! bit 6     unit: 0 byte, 1 word
//! bit 5, 4  00 special format, 01 input, 10 output, 11 input and output
//! bit 3…0   length − 1 in units
//!
//! special identifier format, header, then length octets, then octets of the manufacturer
//! bit 7, 6  00 no data (free place), 01 one length octet: inputs, 10 one length octet: outputs,
//!           11 two length octets: outputs, then inputs
//! bit 5, 4  00
//! bit 3…0   octets of the manufacturer that follow the length octets, 0…14; 15 = none, and no check of them
//! length octet: bit 7 consistency, bit 6 unit, bit 5…0 length − 1 in units
//! ```
//!
//! Source: IEC 61158-6-3, coding of Chk_Cfg; 9300 facts 1.2 (`F3` = 4 words, both directions, consistent).

use super::image::{MAX_DATA, Octets};

/// Input and output lengths of a slave in octets, seen from the master: `inputs` go to the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IoLengths {
    /// Octets from the slave to the master, 0…244.
    pub inputs: usize,
    /// Octets from the master to the slave, 0…244.
    pub outputs: usize,
}

/// How much of a module is transferred as one undivided value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Consistency {
    /// Each byte or word alone.
    Unit,
    /// The whole module.
    Whole,
}

/// One identifier octet in the general format, lossless both ways.
#[doc(alias = "Kennungsbyte")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identifier(u8);

impl Identifier {
    /// The identifier with this octet; `None` for the special format (bits 5 and 4 clear).
    pub const fn from_octet(octet: u8) -> Option<Self> {
        if octet & (INPUT | OUTPUT) == 0 {
            return None;
        }
        Some(Self(octet))
    }

    /// The octet.
    pub const fn octet(self) -> u8 {
        self.0
    }

    /// Octets of the module in each direction it has.
    pub const fn lengths(self) -> IoLengths {
        let units = (self.0 & LENGTH) as usize + 1;
        let octets = if self.0 & WORDS != 0 { 2 * units } else { units };
        IoLengths {
            inputs: if self.0 & INPUT != 0 { octets } else { 0 },
            outputs: if self.0 & OUTPUT != 0 { octets } else { 0 },
        }
    }

    /// What the slave must keep together.
    pub const fn consistency(self) -> Consistency {
        if self.0 & WHOLE != 0 {
            Consistency::Whole
        } else {
            Consistency::Unit
        }
    }
}

/// One identifier of a configuration in either format: what belongs to one place of the slave.
///
/// Identifier-related diagnosis counts these, not the octets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place<'a> {
    octets: &'a [u8],
    lengths: IoLengths,
    manufacturer: &'a [u8],
}

impl<'a> Place<'a> {
    /// Takes the first identifier off `octets`; `None` when its length octets or manufacturer octets are cut off.
    fn split_off(octets: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let (&header, after) = octets.split_first()?;
        if let Some(identifier) = Identifier::from_octet(header) {
            let (octets, rest) = octets.split_at_checked(1)?;
            let place = Self {
                octets,
                lengths: identifier.lengths(),
                manufacturer: &[],
            };
            return Some((place, rest));
        }
        let (mut lengths, mut rest) = (IoLengths::default(), after);
        let mut length = |present: u8| match rest.split_first() {
            _ if header & present == 0 => Some(0),
            Some((&octet, after)) => {
                rest = after;
                Some(special_length(octet))
            }
            None => None,
        };
        lengths.outputs = length(SPECIAL_OUTPUT)?;
        lengths.inputs = length(SPECIAL_INPUT)?;
        let manufacturer_len = match header & LENGTH {
            NOT_CHECKED => 0,
            len => usize::from(len),
        };
        let (manufacturer, rest) = rest.split_at_checked(manufacturer_len)?;
        let (octets, rest) = octets.split_at_checked(octets.len() - rest.len())?;
        let place = Self {
            octets,
            lengths,
            manufacturer,
        };
        Some((place, rest))
    }

    /// All its octets.
    pub fn octets(&self) -> &'a [u8] {
        self.octets
    }

    /// Its inputs and outputs; both 0 for a free place.
    pub fn lengths(&self) -> IoLengths {
        self.lengths
    }

    /// The manufacturer's octets of the special format.
    pub fn manufacturer(&self) -> &'a [u8] {
        self.manufacturer
    }
}

/// The identifiers in a configuration string, in their order.
///
/// The iterator ends after an identifier that is cut off, which it gives as an error.
///
/// # Example
///
/// ```
/// use dp_master::dp::{IoLengths, places};
/// // Special format, 2 words out, 4 words in, one octet of the manufacturer; then a free place.
/// let mut all = places(&[0xC1, 0x41, 0x43, 0x07, 0x00]).map(|place| place.unwrap().lengths());
/// assert_eq!(all.next(), Some(IoLengths { inputs: 8, outputs: 4 }));
/// assert_eq!(all.next(), Some(IoLengths { inputs: 0, outputs: 0 }));
/// assert_eq!(all.next(), None);
/// ```
pub fn places(identifiers: &[u8]) -> Places<'_> {
    Places {
        whole: identifiers.len(),
        rest: identifiers,
    }
}

/// Iterator over the identifiers of a configuration, see [`places`].
#[derive(Debug, Clone)]
pub struct Places<'a> {
    whole: usize,
    rest: &'a [u8],
}

impl<'a> Iterator for Places<'a> {
    type Item = Result<Place<'a>, CfgError>;

    fn next(&mut self) -> Option<Self::Item> {
        let &octet = self.rest.first()?;
        match Place::split_off(self.rest) {
            Some((place, rest)) => {
                self.rest = rest;
                Some(Ok(place))
            }
            None => {
                let position = self.whole - self.rest.len();
                self.rest = &[];
                Some(Err(CfgError::Truncated { position, octet }))
            }
        }
    }
}

/// Input and output lengths of a configuration.
///
/// # Errors
///
/// [`CfgError::Truncated`] when octets of a special format are missing, [`CfgError::Empty`] for no identifiers at all,
/// [`CfgError::TooLong`] above 244 octets in a direction.
///
/// # Example
///
/// ```
/// use dp_master::dp::{IoLengths, io_lengths};
/// // PAR(Cons.) + PZD(4W Cons.)
/// assert_eq!(io_lengths(&[0xF3, 0xF3]), Ok(IoLengths { inputs: 16, outputs: 16 }));
/// ```
pub fn io_lengths(identifiers: &[u8]) -> Result<IoLengths, CfgError> {
    if identifiers.is_empty() {
        return Err(CfgError::Empty);
    }
    let mut sum = IoLengths::default();
    for place in places(identifiers) {
        let IoLengths { inputs, outputs } = place?.lengths();
        sum.inputs += inputs;
        sum.outputs += outputs;
    }
    if sum.inputs > MAX_DATA || sum.outputs > MAX_DATA {
        return Err(CfgError::TooLong { got: sum });
    }
    Ok(sum)
}

/// A checked configuration: its identifier octets and the lengths they mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Configuration {
    identifiers: Octets<MAX_DATA>,
    lengths: IoLengths,
}

impl Configuration {
    /// Checks identifiers in the general and the special format.
    ///
    /// # Errors
    ///
    /// As [`io_lengths`], and [`CfgError::TooManyIdentifiers`] above 244.
    pub fn new(identifiers: &[u8]) -> Result<Self, CfgError> {
        let lengths = io_lengths(identifiers)?;
        let Some(identifiers) = Octets::from_slice(identifiers) else {
            return Err(CfgError::TooManyIdentifiers { got: identifiers.len() });
        };
        Ok(Self { identifiers, lengths })
    }

    /// The identifier octets, the data unit of Chk_Cfg.
    pub fn identifiers(&self) -> &[u8] {
        self.identifiers.as_slice()
    }

    /// Input and output lengths in octets.
    pub fn lengths(&self) -> IoLengths {
        self.lengths
    }
}

/// Why identifier octets are no usable configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CfgError {
    /// No identifier.
    #[error("Chk_Cfg: expected at least one identifier octet, got none")]
    Empty,
    /// The length octets or manufacturer octets of a special identifier format are missing.
    #[error(
        "Chk_Cfg: the octets that belong to the special identifier {octet:#04x} at position {position} are cut off"
    )]
    Truncated {
        /// Octet where the identifier starts, counted from 0.
        position: usize,
        /// Its header.
        octet: u8,
    },
    /// More data than one telegram carries.
    #[error(
        "Chk_Cfg: expected at most 244 octets in each direction, got {} in, {} out", got.inputs, got.outputs
    )]
    TooLong {
        /// What the identifiers add up to.
        got: IoLengths,
    },
    /// More identifiers than one telegram carries.
    #[error("Chk_Cfg: expected at most 244 identifier octets, got {got}")]
    TooManyIdentifiers {
        /// How many there were.
        got: usize,
    },
}

const WHOLE: u8 = 0x80;
const WORDS: u8 = 0x40;
const OUTPUT: u8 = 0x20;
const INPUT: u8 = 0x10;
const LENGTH: u8 = 0x0F;

/// Header of the special format: a length octet of the outputs follows.
const SPECIAL_OUTPUT: u8 = 0x80;
/// Header of the special format: a length octet of the inputs follows.
const SPECIAL_INPUT: u8 = 0x40;
/// Manufacturer length 15: there are none, and the slave does not check them.
const NOT_CHECKED: u8 = 0x0F;

/// Octets that a length octet of the special format means, 1…128.
const fn special_length(octet: u8) -> usize {
    let units = (octet & 0x3F) as usize + 1;
    if octet & WORDS != 0 { 2 * units } else { units }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_configuration_is_sixteen_octets_each_way() {
        // 9300 facts 1.2: F3 F3
        let cfg = Configuration::new(&[0xF3, 0xF3]).unwrap();
        assert_eq!(
            cfg.lengths(),
            IoLengths {
                inputs: 16,
                outputs: 16
            }
        );
        let par = Identifier::from_octet(0xF3).unwrap();
        assert_eq!(par.consistency(), Consistency::Whole);
    }

    #[test]
    fn each_bit_of_the_identifier_has_its_meaning() {
        // IEC 61158-6-3: one octet in; 16 octets out; word consistency; 8 words both ways
        let lengths = |octet| {
            let IoLengths { inputs, outputs } = Identifier::from_octet(octet).unwrap().lengths();
            (inputs, outputs)
        };
        assert_eq!(lengths(0x10), (1, 0));
        assert_eq!(lengths(0x2F), (0, 16));
        assert_eq!(lengths(0x50), (2, 0));
        assert_eq!(lengths(0x77), (16, 16));
        assert_eq!(Identifier::from_octet(0x77).unwrap().consistency(), Consistency::Unit);
    }

    fn lengths(identifiers: &[u8]) -> (usize, usize) {
        let IoLengths { inputs, outputs } = io_lengths(identifiers).unwrap();
        (inputs, outputs)
    }

    #[test]
    fn the_special_format_has_its_lengths_in_octets_of_their_own_outputs_first() {
        // IEC 61158-6-3, special identifier formats. Real ones from GSD files: a motor starter, an AS-i link.
        assert_eq!(lengths(&[0xC0, 0x81, 0x83]), (4, 2));
        assert_eq!(lengths(&[0xC1, 0x1F, 0x1F, 0x00]), (32, 32));
        assert_eq!(lengths(&[0x41, 0x43, 0x80]), (8, 0));
        assert_eq!(lengths(&[0x81, 0x40, 0x00]), (0, 2));
        // 64 words of inputs; a free place; a free place with three octets of the manufacturer.
        assert_eq!(lengths(&[0x40, 0xFF, 0x00, 0x03, 1, 2, 3]), (128, 0));
        // Both formats in one string.
        assert_eq!(lengths(&[0xF3, 0xC0, 0x00, 0x01, 0x10]), (8 + 2 + 1, 8 + 1));
    }

    #[test]
    fn manufacturer_octets_are_counted_by_the_header_and_fifteen_means_none() {
        let all: Vec<_> = places(&[0x42, 0x00, 0xAA, 0xBB, 0x4F, 0x00, 0x20])
            .map(|place| place.unwrap())
            .collect();
        let octets: Vec<_> = all.iter().map(Place::octets).collect();
        assert_eq!(octets, [&[0x42, 0x00, 0xAA, 0xBB][..], &[0x4F, 0x00], &[0x20]]);
        assert_eq!(all[0].manufacturer(), [0xAA, 0xBB]);
        assert_eq!(all[1].manufacturer(), [0; 0]);
    }

    #[test]
    fn a_special_format_without_its_octets_is_refused_with_its_position() {
        for cut in [
            &[0xF3, 0xC0, 0x81][..],
            &[0xF3, 0xC0],
            &[0xF3, 0x41, 0x43],
            &[0xF3, 0x0E, 1],
        ] {
            assert_eq!(
                io_lengths(cut),
                Err(CfgError::Truncated {
                    position: 1,
                    octet: cut[1]
                }),
                "{cut:02X?}"
            );
        }
    }

    #[test]
    fn more_than_a_telegram_is_refused() {
        // 8 × 32 octets = 256 > 244
        assert!(matches!(io_lengths(&[0x7F; 8]), Err(CfgError::TooLong { .. })));
        assert!(io_lengths(&[0x7F; 7]).is_ok());
    }
}
