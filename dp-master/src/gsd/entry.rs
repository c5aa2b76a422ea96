//! One statement with a keyword: its index, its value, and what the keywords do that are the same in several places.

use std::collections::{BTreeMap, HashMap};

use super::block::MAX_BIT;
use super::cursor::{Cursor, Fault, shown};
use super::device::{Gsd, MainFamily, Rate, SlaveFamily};
use super::diagnostic::{Position, Remarks};
use super::keyword_family::{DiagKeyword, DiagWhat, PrmKeyword, PrmWhat, RateFamily};
use super::keywords::{self, Keyword};
use super::prm::{PrmConstant, PrmLayout, PrmPlace};
use super::unit_diag::{DiagText, UnitDiag};

/// A keyword with its index, as it starts a statement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head<'a> {
    pub(super) name: &'a str,
    pub(super) at: Position,
    /// With the index and the parentheses, for messages.
    pub(super) written: &'a str,
}

/// One statement with a keyword, and where its remarks go.
pub(super) struct Entry<'e, 's, 'a> {
    pub(super) head: Head<'a>,
    pub(super) index: Option<Cursor<'s, 'a>>,
    pub(super) value: Cursor<'s, 'a>,
    pub(super) remarks: &'e mut Remarks,
    pub(super) seen: &'e mut HashMap<String, Position>,
    /// Line of the block it stands in, or [`OUTSIDE`].
    pub(super) block: u32,
}

impl<'a> Entry<'_, '_, 'a> {
    pub(super) fn is(&self, name: &str) -> bool {
        self.head.name.eq_ignore_ascii_case(name)
    }

    /// Takes the `=` off, for a keyword without index.
    pub(super) fn equals(&mut self) -> Result<(), Fault> {
        if let Some(index) = &self.index {
            return index.fault(format!("`{}` has no index in parentheses", self.head.name));
        }
        self.value.sign('=')
    }

    /// Takes index and `=` off.
    pub(super) fn index(&mut self, max: u16) -> Result<u16, Fault> {
        let Some(index) = &mut self.index else {
            return Err(Fault {
                at: self.head.at,
                message: format!("`{}` needs an index in parentheses", shown(self.head.name)),
            });
        };
        let number = index.unsigned_16(0, max)?;
        index.done()?;
        self.value.sign('=')?;
        Ok(number)
    }

    /// Takes an index that may be negative and `=` off.
    pub(super) fn signed_index(&mut self) -> Result<i64, Fault> {
        let Some(index) = &mut self.index else {
            return self.index(0).map(i64::from);
        };
        let number = index.number(i32::MIN.into()..=u32::MAX.into())?;
        index.done()?;
        self.value.sign('=')?;
        Ok(number)
    }

    /// Takes `=` and a number off, for a keyword that has nothing else.
    pub(super) fn only_u8(&mut self, max: u8) -> Result<u8, Fault> {
        self.equals()?;
        self.once(None);
        let number = self.value.unsigned_8(0, max)?;
        self.value.done()?;
        Ok(number)
    }

    /// Warns if this keyword stood here before.
    pub(super) fn once(&mut self, index: Option<u32>) {
        let name = self.head.name.to_ascii_lowercase();
        let key = match (self.block, index) {
            (OUTSIDE, None) => name,
            (block, None) => format!("{block}:{name}"),
            (block, Some(index)) => format!("{block}:{name}({index})"),
        };
        match self.seen.get(&key) {
            Some(first) => {
                let what = match index {
                    Some(index) => format!("{}({index})", self.head.name),
                    None => self.head.name.to_owned(),
                };
                self.remarks.warning(
                    self.head.at,
                    format!("`{what}` stands already in line {}, the last one counts", first.line),
                );
            }
            None => {
                self.seen.insert(key, self.head.at);
            }
        }
    }

    /// The text that is the rest of the value, with a warning above `most` characters.
    pub(super) fn text(&mut self, most: usize) -> Result<String, Fault> {
        let at = self.value.position();
        let text = self.value.text()?.to_owned();
        self.value.done()?;
        warn_long(self.remarks, at, &text, most);
        Ok(text)
    }

    pub(super) fn scalar(&mut self, keyword: &Keyword, gsd: &mut Gsd) -> Result<(), Fault> {
        self.equals()?;
        self.once(None);
        use keywords::Kind;
        match keyword.kind {
            Kind::Flag(field) => *field(gsd) = self.value.flag()?,
            Kind::U8(min, max, field) => *field(gsd) = Some(self.value.unsigned_8(min, max)?),
            Kind::U16(min, max, field) => *field(gsd) = Some(self.value.unsigned_16(min, max)?),
            Kind::U32(field) => *field(gsd) = Some(self.value.unsigned_32()?),
            Kind::Code(max, set) => set(gsd, self.value.unsigned_8(0, max)?),
            Kind::Text(most, field) => *field(gsd) = Some(self.text(most)?),
            Kind::Octets(field) => *field(gsd) = Some(self.value.octets()?),
            Kind::Family => {
                let main = MainFamily::from_number(self.value.unsigned_8(0, u8::MAX)?);
                let rest = self.value.raw();
                if !(rest.is_empty() || self.value.is_at('@')) {
                    return self.value.expected("`@` and the name of a sub-family");
                }
                let sub = rest.split('@').skip(1).map(|name| name.trim().to_owned()).collect();
                gsd.slave.slave_family = Some(SlaveFamily { main, sub });
                return Ok(());
            }
        }
        self.value.done()
    }

    pub(super) fn rate(&mut self, family: RateFamily, rate: Rate, gsd: &mut Gsd) -> Result<(), Fault> {
        self.equals()?;
        self.once(None);
        let features = gsd.rates.entry(rate).or_default();
        match family {
            RateFamily::Supported => features.supported = self.value.flag()?,
            RateFamily::MaxTsdr => features.max_tsdr = Some(self.value.unsigned_16(0, u16::MAX)?),
            RateFamily::Trdy => features.trdy = Some(self.value.unsigned_8(0, u8::MAX)?),
            RateFamily::Tqui => features.tqui = Some(self.value.unsigned_8(0, u8::MAX)?),
            RateFamily::Tset => features.tset = Some(self.value.unsigned_8(0, u8::MAX)?),
            RateFamily::Tsdi => features.tsdi = Some(self.value.unsigned_16(0, u16::MAX)?),
        }
        self.value.done()
    }

    /// Constants and parameters of the station or a module.
    pub(super) fn prm(&mut self, keyword: PrmKeyword, layout: &mut PrmLayout) -> Result<(), Fault> {
        let at = self.head.at;
        match keyword.what {
            PrmWhat::Len => {
                self.equals()?;
                self.once(None);
                layout.len = Some(self.value.unsigned_8(0, 244)?);
            }
            PrmWhat::Constant => {
                let offset = self.index(u8::MAX.into())? as u8;
                let octets = self.value.octets()?;
                layout.constants.push(PrmConstant { offset, octets, at });
            }
            PrmWhat::Reference => {
                let offset = self.index(u8::MAX.into())? as u8;
                let reference = self.value.unsigned_16(0, u16::MAX)?;
                layout.places.push(PrmPlace { offset, reference, at });
            }
        }
        self.value.done()
    }

    /// Texts of the device or a module.
    pub(super) fn diag(
        &mut self,
        keyword: DiagKeyword,
        unit: &mut UnitDiag,
        channel: &mut BTreeMap<u8, DiagText>,
    ) -> Result<(), Fault> {
        let most = if keyword.help { 256 } else { 32 };
        let number = self.index(match keyword.what {
            DiagWhat::Channel => 31,
            _ => MAX_BIT,
        })?;
        if keyword.what == DiagWhat::Channel && number < 16 {
            self.remarks.warning(
                self.head.at,
                format!("channel fault {number} has its text in the standard, those of a manufacturer are 16 to 31"),
            );
        }
        self.once(Some(number.into()));
        let text = self.text(most)?;
        let entry = match keyword.what {
            DiagWhat::Bit => unit.bits.entry(number).or_default(),
            DiagWhat::NotBit => unit.not_bits.entry(number).or_default(),
            DiagWhat::Channel => channel.entry(number as u8).or_default(),
        };
        if keyword.help {
            entry.help = Some(text);
        } else {
            entry.text = text;
        }
        Ok(())
    }
}

/// Warns of a text with more characters than the guideline allows.
pub(super) fn warn_long(remarks: &mut Remarks, at: Position, text: &str, most: usize) {
    let count = text.chars().count();
    if count > most {
        remarks.warning(at, format!("the text has {count} characters, {most} are allowed"));
    }
}

/// Line number that stands for "in no block".
pub(super) const OUTSIDE: u32 = 0;
