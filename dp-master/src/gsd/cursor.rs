//! Walking through the tokens of one statement, with sentences for what is not as expected.

use core::ops::RangeInclusive;

use super::diagnostic::Position;
use super::grammar::{Kind, Token};
use super::prm::ValueSet;
use super::text::Lines;

/// What is wrong with a statement.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) at: Position,
    pub(super) message: String,
}

/// The tokens of a statement that are still to be read.
#[derive(Clone)]
pub(super) struct Cursor<'s, 'a> {
    text: &'a str,
    lines: &'s Lines<'a>,
    tokens: &'s [Token<'a>],
    /// Where the statement ends, for messages about what is missing.
    end: usize,
}

impl<'s, 'a> Cursor<'s, 'a> {
    pub(super) fn new(text: &'a str, lines: &'s Lines<'a>, tokens: &'s [Token<'a>]) -> Self {
        let end = tokens.last().map_or(0, |last| last.span.end);
        Self {
            text,
            lines,
            tokens,
            end,
        }
    }

    pub(super) fn peek(&self) -> Option<&'s Kind<'a>> {
        self.tokens.first().map(|token| &token.kind)
    }

    pub(super) fn is_at(&self, sign: char) -> bool {
        self.peek() == Some(&Kind::Sign(sign))
    }

    /// Whether `sign` is somewhere in what is left.
    pub(super) fn has(&self, sign: char) -> bool {
        self.tokens.iter().any(|token| token.kind == Kind::Sign(sign))
    }

    pub(super) fn is_done(&self) -> bool {
        self.tokens.is_empty()
    }

    /// Where the next token stands.
    pub(super) fn position(&self) -> Position {
        self.lines
            .position(self.tokens.first().map_or(self.end, |token| token.span.start))
    }

    /// The rest of the statement as it is written, continuation included.
    pub(super) fn raw(&self) -> &'a str {
        let start = self.tokens.first().map_or(self.end, |token| token.span.start);
        self.text.get(start..self.end).unwrap_or("")
    }

    pub(super) fn advance(&mut self) -> Option<&'s Token<'a>> {
        let (first, rest) = self.tokens.split_first()?;
        self.tokens = rest;
        Some(first)
    }

    /// The fault that something else should stand here.
    pub(super) fn expected<T>(&self, what: impl core::fmt::Display) -> Result<T, Fault> {
        let got = match self.tokens.first() {
            Some(token) => format!("`{}`", shown(self.text.get(token.span.clone()).unwrap_or(""))),
            None => "the end of the line".to_owned(),
        };
        self.fault(format!("expected {what}, got {got}"))
    }

    pub(super) fn fault<T>(&self, message: String) -> Result<T, Fault> {
        Err(Fault {
            at: self.position(),
            message,
        })
    }

    pub(super) fn sign(&mut self, sign: char) -> Result<(), Fault> {
        if !self.is_at(sign) {
            return self.expected(format_args!("`{sign}`"));
        }
        self.advance();
        Ok(())
    }

    /// A number in `range`, with a minus sign if the range has negative numbers.
    pub(super) fn number(&mut self, range: RangeInclusive<i64>) -> Result<i64, Fault> {
        let wanted = format!("a number from {} to {}", range.start(), range.end());
        let mut ahead = self.clone();
        let negative = *range.start() < 0 && ahead.is_at('-');
        if negative {
            ahead.advance();
        }
        let Some(&Kind::Number(number)) = ahead.peek() else {
            return self.expected(wanted);
        };
        let number = if negative { -number } else { number };
        if !range.contains(&number) {
            return self.fault(format!("expected {wanted}, got {number}"));
        }
        ahead.advance();
        *self = ahead;
        Ok(number)
    }

    pub(super) fn unsigned_8(&mut self, min: u8, max: u8) -> Result<u8, Fault> {
        self.number(min.into()..=max.into()).map(|number| number as u8)
    }

    pub(super) fn unsigned_16(&mut self, min: u16, max: u16) -> Result<u16, Fault> {
        self.number(min.into()..=max.into()).map(|number| number as u16)
    }

    pub(super) fn unsigned_32(&mut self) -> Result<u32, Fault> {
        self.number(0..=u32::MAX.into()).map(|number| number as u32)
    }

    pub(super) fn flag(&mut self) -> Result<bool, Fault> {
        self.number(0..=1).map(|number| number == 1)
    }

    pub(super) fn text(&mut self) -> Result<&'s str, Fault> {
        let Some(Kind::Text(text)) = self.peek() else {
            return self.expected("a text in quotation marks");
        };
        self.advance();
        Ok(&text.value)
    }

    /// Octets separated by commas, at least one.
    pub(super) fn octets(&mut self) -> Result<Vec<u8>, Fault> {
        let mut octets = Vec::new();
        loop {
            octets.push(self.unsigned_8(0, u8::MAX)?);
            if self.is_done() {
                return Ok(octets);
            }
            self.sign(',')?;
        }
    }

    /// Numbers and ranges of numbers up to the end of the statement; none is any.
    pub(super) fn value_set(&mut self, range: RangeInclusive<i64>) -> Result<ValueSet, Fault> {
        let mut set = Vec::new();
        while !self.is_done() {
            if !set.is_empty() {
                self.sign(',')?;
            }
            let start = self.clone();
            let min = self.number(range.clone())?;
            let mut max = min;
            if self.is_at('-') {
                self.advance();
                max = self.number(range.clone())?;
            }
            if max < min {
                return start.fault(format!(
                    "expected a range from a smaller to a larger number, got {min} to {max}"
                ));
            }
            set.push((min, max));
        }
        Ok(ValueSet(set))
    }

    pub(super) fn done(&self) -> Result<(), Fault> {
        if self.is_done() {
            Ok(())
        } else {
            self.expected("nothing more in this line")
        }
    }
}

/// A piece of the file in a message, cut where it would fill the line.
pub(super) fn shown(piece: &str) -> String {
    match piece.char_indices().nth(SHOWN) {
        Some((cut, _)) => format!("{}…", piece.get(..cut).unwrap_or("")),
        None => piece.to_owned(),
    }
}

/// Characters of a piece that a message shows.
const SHOWN: usize = 60;
