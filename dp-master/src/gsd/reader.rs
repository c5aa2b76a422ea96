//! From statements to the description: which block a statement stands in, and what its keyword does there.
//!
//! Blocks form a stack of at most two. A keyword that closes an outer block, opens a new one or belongs outside closes the inner ones, with
//! an error for each, so that one forgotten `EndModule` costs one line of report and no data.

use std::collections::{BTreeMap, HashMap};

use super::block::{Block, MAX_BIT, Opener, home};
use super::cursor::{Cursor, Fault, shown};
use super::device::{Gsd, MainFamily, OtherKeyword, Rate, Section, SlaveFamily};
use super::diagnostic::{Position, Remarks};
use super::grammar::{Ending, Kind, Statement, Token, statements};
use super::keywords::{self, Keyword};
use super::prm::{PrmConstant, PrmLayout, PrmPlace};
use super::text::Lines;
use super::unit_diag::{DiagText, UnitDiag};

/// A reading in progress; at its end what the checks of the whole file need.
pub(super) struct Reader<'a> {
    pub(super) text: &'a str,
    pub(super) lines: &'a Lines<'a>,
    pub(super) gsd: Gsd,
    pub(super) remarks: Remarks,
    /// Where each keyword stood first: in lower case, with its index and the line of its block.
    pub(super) seen: HashMap<String, Position>,
    /// Where the description starts.
    pub(super) start: Position,
    blocks: Vec<Open>,
}

/// A block that is not closed yet.
struct Open {
    block: Block,
    opener: &'static Opener,
    at: Position,
    /// Its first line is wrong: it is read, but not kept.
    broken: bool,
}

/// A keyword with its index, as it starts a statement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Head<'a> {
    pub(super) name: &'a str,
    pub(super) at: Position,
    /// With the index and the parentheses, for messages.
    written: &'a str,
}

impl<'a> Reader<'a> {
    /// Reads all statements of a decoded file.
    pub(super) fn read(text: &'a str, lines: &'a Lines<'a>) -> Self {
        let mut reader = Self {
            text,
            lines,
            gsd: Gsd::default(),
            remarks: Remarks::default(),
            seen: HashMap::new(),
            start: Position::START,
            blocks: Vec::new(),
        };
        let statements = statements(text);
        // Any text may stand before the marker.
        let marker = statements
            .iter()
            .position(|statement| section_name(statement).is_some_and(is_profibus));
        match marker.and_then(|marker| statements.get(marker)?.tokens.first()) {
            Some(token) => reader.start = lines.position(token.span.start),
            None => reader.remarks.error(
                Position::START,
                "the line `#Profibus_DP` is missing, so the whole file is read as a description",
            ),
        }
        let mut in_profibus = true;
        for statement in statements.iter().skip(marker.map_or(0, |marker| marker + 1)) {
            if let Some(name) = section_name(statement) {
                reader.close_blocks(0, &format!("`#{name}`"));
                in_profibus = is_profibus(name);
                if !in_profibus {
                    reader.gsd.sections.push(Section {
                        name: name.to_owned(),
                        statements: Vec::new(),
                    });
                }
            } else if in_profibus {
                reader.statement(&statement.tokens);
            } else if let Some(section) = reader.gsd.sections.last_mut() {
                let written = Cursor::new(text, lines, &statement.tokens).raw();
                section.statements.push(written.to_owned());
            }
        }
        reader.close_blocks(0, "the end of the file");
        reader
    }

    fn statement(&mut self, tokens: &[Token<'a>]) {
        // One remark a statement: what is wrong with the first text is wrong with the others because of it.
        let odd = tokens.iter().find_map(|token| match &token.kind {
            Kind::Text(text) if text.ending != Ending::Closed => Some((token.span.start, text.ending)),
            _ => None,
        });
        if let Some((start, ending)) = odd {
            let at = self.lines.position(start);
            match ending {
                Ending::Open => self.remarks.error(at, "the text has no quotation mark at its end"),
                _ => self.remarks.warning(at, "the text has quotation marks inside"),
            }
        }
        if let Err(Fault { at, message }) = self.understand(tokens) {
            self.remarks.error(at, message);
        }
    }

    fn understand(&mut self, tokens: &[Token<'a>]) -> Result<(), Fault> {
        let mut cursor = Cursor::new(self.text, self.lines, tokens);
        match cursor.peek() {
            Some(&Kind::Number(_)) => return self.bare_number(&mut cursor),
            Some(Kind::Word(_)) => {}
            _ => return cursor.expected("a keyword"),
        }
        if let Some(Open {
            block: Block::Parameter(parameter),
            ..
        }) = self.blocks.last_mut()
            && parameter.is_type_line(&cursor)
        {
            return parameter.type_line(&mut cursor, &mut self.remarks);
        }
        let (head, index) = self.head(tokens, &mut cursor);
        self.entry(head, index, cursor)
            .map_err(|fault| match fault.message.starts_with("expected") {
                true => Fault {
                    message: format!("`{}`: {}", shown(head.name), fault.message),
                    ..fault
                },
                false => fault,
            })
    }

    /// A statement with a keyword.
    fn entry(
        &mut self,
        head: Head<'a>,
        index: Option<Cursor<'_, 'a>>,
        mut cursor: Cursor<'_, 'a>,
    ) -> Result<(), Fault> {
        if let Some(opener) = Opener::closed_by(head.name) {
            return self.close(opener, head, &cursor);
        }
        if let Some(opener) = Opener::opened_by(head.name) {
            return self.open(opener, head, &mut cursor);
        }
        if let Some(Open { block, at, .. }) = self.blocks.last_mut() {
            let mut entry = Entry {
                head,
                index: index.clone(),
                value: cursor.clone(),
                remarks: &mut self.remarks,
                seen: &mut self.seen,
                block: at.line,
            };
            if block.entry(&mut entry)? {
                return Ok(());
            }
        }
        let is_kept = matches!(self.blocks.last(), Some(Open { block: Block::Kept, .. }));
        if !is_kept && is_known_outside(head.name) {
            self.close_blocks(0, &format!("`{}`", head.name));
            return self.outside(head, index, cursor);
        }
        if !is_kept {
            if let Some(block) = home(head.name) {
                return Err(Fault {
                    at: head.at,
                    message: format!("`{}` may stand only in `{block}`", head.name),
                });
            }
            let place = match self.blocks.last() {
                Some(open) => format!(" in `{}`", open.opener.open),
                None => String::new(),
            };
            let name = shown(head.name);
            self.remarks
                .warning(head.at, format!("unknown keyword `{name}`{place}"));
        }
        self.keep(head, cursor);
        Ok(())
    }

    /// Keeps an entry by its name.
    fn keep(&mut self, head: Head<'a>, mut value: Cursor<'_, 'a>) {
        let value = value.is_at('=').then(|| {
            value.advance();
            value.raw().to_owned()
        });
        self.gsd.other.push(OtherKeyword {
            block: self.blocks.last().map(|open| open.opener.open.to_owned()),
            keyword: head.written.to_owned(),
            value,
            at: head.at,
        });
    }

    /// Takes keyword and index off; what is left starts with `=` or is empty.
    fn head<'s>(&self, tokens: &'s [Token<'a>], cursor: &mut Cursor<'s, 'a>) -> (Head<'a>, Option<Cursor<'s, 'a>>) {
        let at = cursor.position();
        let mut count = tokens.iter().take_while(|token| token.kind != Kind::Sign('=')).count();
        // A keyword that is known ends where it does, whatever follows it.
        if let [
            Token {
                kind: Kind::Word(word), ..
            },
            second,
            ..,
        ] = tokens
            && second.kind != Kind::Sign('(')
            && is_known(word)
        {
            count = 1;
        }
        let head = tokens.get(..count).unwrap_or(tokens);
        let open = head.iter().position(|token| token.kind == Kind::Sign('('));
        let closed = matches!(head.last(), Some(last) if last.kind == Kind::Sign(')'));
        let index = match open {
            Some(open) if closed => head.get(open + 1..count - 1),
            _ => None,
        };
        let name = if index.is_some() {
            head.get(..open.unwrap_or(count))
        } else {
            Some(head)
        };
        let written = |tokens: &[Token<'a>]| match (tokens.first(), tokens.last()) {
            (Some(first), Some(last)) => self.text.get(first.span.start..last.span.end).unwrap_or(""),
            _ => "",
        };
        let name = written(name.unwrap_or(head));
        *cursor = Cursor::new(self.text, self.lines, tokens.get(count..).unwrap_or(&[]));
        let head = Head {
            name,
            at,
            written: written(head),
        };
        (head, index.map(|index| Cursor::new(self.text, self.lines, index)))
    }

    fn bare_number(&mut self, cursor: &mut Cursor<'_, 'a>) -> Result<(), Fault> {
        let at = cursor.position();
        let module = self.blocks.iter_mut().rev().find_map(|open| match &mut open.block {
            Block::Module(module) => Some(module),
            _ => None,
        });
        let Some(module) = module else {
            return cursor.expected("a keyword");
        };
        let reference = cursor.unsigned_16(0, u16::MAX)?;
        cursor.done()?;
        if module.reference.replace(reference).is_some() {
            let message = "the module has two references, the last one counts".to_owned();
            self.remarks.warning(at, message);
        }
        Ok(())
    }

    fn open(&mut self, opener: &'static Opener, head: Head<'a>, value: &mut Cursor<'_, 'a>) -> Result<(), Fault> {
        let depth = self
            .blocks
            .iter()
            .rposition(|open| opener.may_be_in(open.opener.kind))
            .map_or(0, |place| place + 1);
        self.close_blocks(depth, &format!("`{}`", head.name));
        if depth == 0 && !opener.may_be_outside() {
            return Err(Fault {
                at: head.at,
                message: format!("`{}` may stand only in `Module`", head.name),
            });
        }
        // Even a block with a faulty first line is opened, so that its lines are not taken for others.
        let (block, fault) = match Block::open(opener.kind, head.at, value, &mut self.remarks) {
            Ok(block) => (block, Ok(())),
            Err(fault) => (Block::empty(opener.kind, head.at), Err(fault)),
        };
        self.blocks.push(Open {
            block,
            opener,
            at: head.at,
            broken: fault.is_err(),
        });
        fault
    }

    fn close(&mut self, opener: &'static Opener, head: Head<'a>, rest: &Cursor<'_, 'a>) -> Result<(), Fault> {
        let same = |open: &Open| open.opener.kind == opener.kind;
        let Some(place) = self.blocks.iter().rposition(same) else {
            return Err(Fault {
                at: head.at,
                message: format!(
                    "`{}` closes nothing, there is no `{}` before it",
                    head.name, opener.open
                ),
            });
        };
        self.close_blocks(place + 1, &format!("`{}`", head.name));
        if let Some(open) = self.blocks.pop() {
            self.finish(open);
        }
        rest.done()
    }

    /// Closes all blocks above `depth`, which nobody has closed before `what`.
    fn close_blocks(&mut self, depth: usize, what: &str) {
        while self.blocks.len() > depth {
            let Some(open) = self.blocks.pop() else { break };
            let Opener { open: name, close, .. } = open.opener;
            self.remarks
                .error(open.at, format!("`{name}` is not closed by `{close}` before {what}"));
            self.finish(open);
        }
    }

    /// Puts a block into the block around it or into the description.
    fn finish(&mut self, open: Open) {
        if !open.broken {
            let outer = self.blocks.last_mut().map(|outer| &mut outer.block);
            open.block.finish(open.at, outer, &mut self.gsd, &mut self.remarks);
        }
    }

    /// A keyword outside of blocks that [`is_known_outside`].
    fn outside(&mut self, head: Head<'a>, index: Option<Cursor<'_, 'a>>, value: Cursor<'_, 'a>) -> Result<(), Fault> {
        let mut entry = Entry {
            head,
            index,
            value,
            remarks: &mut self.remarks,
            seen: &mut self.seen,
            block: OUTSIDE,
        };
        if let Some(keyword) = keywords::find(head.name) {
            return entry.scalar(keyword, &mut self.gsd);
        }
        if let Some((family, rate)) = rate_keyword(head.name) {
            return entry.rate(family, rate, &mut self.gsd);
        }
        if let Some(keyword) = PrmKeyword::of(head.name) {
            let layout = match keyword.set {
                PrmSet::Usual => &mut self.gsd.prm,
                PrmSet::Extended => &mut self.gsd.extended_prm,
                PrmSet::Failsafe => &mut self.gsd.failsafe_prm,
            };
            return entry.prm(keyword, layout);
        }
        if let Some(keyword) = DiagKeyword::of(head.name) {
            return entry.diag(keyword, &mut self.gsd.unit_diag, &mut self.gsd.channel_diag);
        }
        Ok(())
    }
}

/// Line number that stands for "in no block".
const OUTSIDE: u32 = 0;

fn is_known(name: &str) -> bool {
    is_known_outside(name)
        || Opener::opened_by(name).is_some()
        || Opener::closed_by(name).is_some()
        || home(name).is_some()
}

fn is_known_outside(name: &str) -> bool {
    keywords::find(name).is_some()
        || rate_keyword(name).is_some()
        || PrmKeyword::of(name).is_some()
        || DiagKeyword::of(name).is_some()
}

/// One statement with a keyword, and where its remarks go.
pub(super) struct Entry<'e, 's, 'a> {
    pub(super) head: Head<'a>,
    pub(super) index: Option<Cursor<'s, 'a>>,
    pub(super) value: Cursor<'s, 'a>,
    pub(super) remarks: &'e mut Remarks,
    seen: &'e mut HashMap<String, Position>,
    /// Line of the block it stands in, or [`OUTSIDE`].
    block: u32,
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

    fn scalar(&mut self, keyword: &Keyword, gsd: &mut Gsd) -> Result<(), Fault> {
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

    fn rate(&mut self, family: RateFamily, rate: Rate, gsd: &mut Gsd) -> Result<(), Fault> {
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

/// The name behind `#` of a line that starts a section.
fn section_name<'a>(statement: &Statement<'a>) -> Option<&'a str> {
    match statement.tokens.first()?.kind {
        Kind::Word(word) => word.strip_prefix('#'),
        _ => None,
    }
}

fn is_profibus(name: &str) -> bool {
    name.eq_ignore_ascii_case("Profibus_DP")
}

/// Keywords that exist once for each baud rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RateFamily {
    Supported,
    MaxTsdr,
    Trdy,
    Tqui,
    Tset,
    Tsdi,
}

/// Family and baud rate of such a keyword.
fn rate_keyword(name: &str) -> Option<(RateFamily, Rate)> {
    let name = name.to_ascii_lowercase();
    if let Some(rate) = name.strip_suffix("_supp") {
        return Some((RateFamily::Supported, rate_of(rate)?));
    }
    let prefixes = [
        ("maxtsdr_", RateFamily::MaxTsdr),
        ("trdy_", RateFamily::Trdy),
        ("tqui_", RateFamily::Tqui),
        ("tset_", RateFamily::Tset),
        ("tsdi_", RateFamily::Tsdi),
    ];
    prefixes
        .into_iter()
        .find_map(|(prefix, family)| Some((family, rate_of(name.strip_prefix(prefix)?)?)))
}

/// Delays of a physical interface, which exist once for each baud rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DelayFamily {
    Transmission,
    Reaction,
}

/// Kind and baud rate of the keyword of a delay.
pub(super) fn delay_keyword(name: &str) -> Option<(DelayFamily, Rate)> {
    let name = name.to_ascii_lowercase();
    let prefixes = [
        ("transmission_delay_", DelayFamily::Transmission),
        ("reaction_delay_", DelayFamily::Reaction),
    ];
    prefixes
        .into_iter()
        .find_map(|(prefix, family)| Some((family, rate_of(name.strip_prefix(prefix)?)?)))
}

fn rate_of(rate: &str) -> Option<Rate> {
    Rate::ALL
        .into_iter()
        .find(|known| known.keyword().eq_ignore_ascii_case(rate))
}

/// A keyword about user parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct PrmKeyword {
    pub(super) set: PrmSet,
    what: PrmWhat,
}

/// Which user parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PrmSet {
    Usual,
    Extended,
    Failsafe,
}

#[derive(Debug, Clone, Copy)]
enum PrmWhat {
    Len,
    Constant,
    Reference,
}

impl PrmKeyword {
    /// The keyword of this name outside of blocks.
    pub(super) fn of(name: &str) -> Option<Self> {
        Self::in_module(name).filter(|keyword| !matches!(keyword.what, PrmWhat::Len))
    }

    /// The keyword of this name in a module, which has a length too.
    pub(super) fn in_module(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let (set, name) = match name.get(..2) {
            Some("x_") => (PrmSet::Extended, name.get(2..)?),
            Some("f_") => (PrmSet::Failsafe, name.get(2..)?),
            _ => (PrmSet::Usual, name.as_str()),
        };
        let what = match name {
            "ext_module_prm_data_len" => PrmWhat::Len,
            "ext_user_prm_data_const" => PrmWhat::Constant,
            "ext_user_prm_data_ref" => PrmWhat::Reference,
            _ => return None,
        };
        Some(Self { set, what })
    }
}

/// A keyword with a text for diagnosis.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiagKeyword {
    what: DiagWhat,
    help: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DiagWhat {
    Bit,
    NotBit,
    Channel,
}

impl DiagKeyword {
    /// The keyword of this name; with `X_` it is the same for a `UnitDiagType`.
    pub(super) fn of(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let name = name.strip_prefix("x_").unwrap_or(&name);
        let (name, help) = match name.strip_suffix("_help") {
            Some(name) => (name, true),
            None => (name, false),
        };
        let what = match name {
            "unit_diag_bit" => DiagWhat::Bit,
            "unit_diag_not_bit" => DiagWhat::NotBit,
            "channel_diag" => DiagWhat::Channel,
            _ => return None,
        };
        Some(Self { what, help })
    }

    /// Whether it is about device-related diagnosis.
    pub(super) fn is_of_unit(self) -> bool {
        self.what != DiagWhat::Channel
    }
}
