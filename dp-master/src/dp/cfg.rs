//! Chk_Cfg: identifier octets and the input and output lengths that follow from them.
//!
//! ```text
//! general identifier format, one octet a module
//! bit 7     consistency: 0 per byte or word, 1 over the whole length
//! bit 6     unit: 0 byte, 1 word
//! bit 5, 4  00 special format, 01 input, 10 output, 11 input and output
//! bit 3…0   length − 1 in units
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

/// Input and output lengths of a configuration.
///
/// # Errors
///
/// [`CfgError::SpecialFormat`] for identifiers outside the general format, [`CfgError::Empty`] for none at all,
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
    for (position, &octet) in identifiers.iter().enumerate() {
        let Some(identifier) = Identifier::from_octet(octet) else {
            return Err(CfgError::SpecialFormat { position, octet });
        };
        let IoLengths { inputs, outputs } = identifier.lengths();
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
    /// Checks identifiers in the general format.
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
    /// Bits 5 and 4 are clear: a special identifier format, not supported.
    #[error(
        "Chk_Cfg: expected the general identifier format, got the special format {octet:#04x} at position {position}"
    )]
    SpecialFormat {
        /// Place among the identifiers, counted from 0.
        position: usize,
        /// The identifier.
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

    #[test]
    fn the_special_format_is_refused_by_name() {
        assert_eq!(
            io_lengths(&[0xF3, 0xC1]),
            Err(CfgError::SpecialFormat {
                position: 1,
                octet: 0xC1
            })
        );
    }

    #[test]
    fn more_than_a_telegram_is_refused() {
        // 8 × 32 octets = 256 > 244
        assert!(matches!(io_lengths(&[0x7F; 8]), Err(CfgError::TooLong { .. })));
        assert!(io_lengths(&[0x7F; 7]).is_ok());
    }
}
