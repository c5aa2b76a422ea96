//! From statements to the description: which block a statement stands in, and what its keyword does there.
//!
//! Blocks form a stack of at most two. A keyword that closes an outer block, opens a new one or belongs outside closes the inner ones, with
//! an error for each, so that one forgotten `EndModule` costs one line of report and no data.

use std::collections::HashMap;

use super::block::{Block, Opener, home};
use super::cursor::{Cursor, Fault, shown};
use super::device::{Gsd, OtherKeyword, Section};
use super::diagnostic::{Position, Remarks};
use super::entry::{Entry, Head, OUTSIDE};
use super::grammar::{Ending, Kind, Statement, Token, statements};
use super::keyword_family::{DiagKeyword, PrmKeyword, PrmSet, rate_keyword};
use super::keywords;
use super::text::Lines;

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
