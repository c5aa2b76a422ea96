//! The language: characters to statements of tokens.
//!
//! ```text
//! file       = { blank } { statement }
//! statement  = { token } [ comment ] line end
//! token      = word | number | text | one of = , - ( ) @
//! word       = letters, digits, '_', '.', '#'; a number if it reads as one
//! number     = digits | "0x" hex digits
//! text       = '"' characters '"'
//! comment    = ';' to the end of the line
//! blank      = space, tab | '\' [ comment ] line end      (the statement goes on in the next line)
//! ```
//!
//! No sequence of characters stops it: what is none of these becomes a token of its own kind, which the reader reports.
//!
//! Source: guideline "Specification for PROFIBUS Device Description and Device Integration, Volume 1: GSD", formal description
//! (also ISO 15745-3, PROFIBUS part). Comments behind a continuation and continued texts are not in it, but in files of large makers.

use core::ops::Range;

use winnow::LocatingSlice;
use winnow::combinator::{alt, opt, preceded, repeat};
use winnow::error::EmptyError;
use winnow::prelude::*;
use winnow::stream::Location;
use winnow::token::{any, one_of, take_while};

/// A token and where it stands in the decoded text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Token<'a> {
    pub(super) kind: Kind<'a>,
    pub(super) span: Range<usize>,
}

/// What a token is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind<'a> {
    /// A keyword, a type name, or something that starts like a number and is none.
    Word(&'a str),
    Number(i64),
    Text(Text),
    /// One of `= , - ( ) @`.
    Sign(char),
    /// A character that has no place outside of texts.
    Stray(char),
}

/// A text between quotation marks, without the blanks at its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Text {
    pub(super) value: String,
    pub(super) ending: Ending,
}

/// How a text ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    /// With its quotation mark.
    Closed,
    /// With its quotation mark, but there are others inside.
    InnerQuotes,
    /// With the line.
    Open,
}

/// The tokens up to a line end that is not continued, never empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    pub(super) tokens: Vec<Token<'a>>,
}

type Input<'a> = LocatingSlice<&'a str>;

/// Rules fail only where another one is tried next, so a failure carries nothing.
type Result<T> = core::result::Result<T, EmptyError>;

/// All statements of a text.
pub(super) fn statements(text: &str) -> Vec<Statement<'_>> {
    let mut input = LocatingSlice::new(text);
    let mut all = Vec::new();
    while !input.is_empty() {
        // The rules take any character, so they fail only at the end.
        let Ok(tokens) = statement.parse_next(&mut input) else {
            break;
        };
        if !tokens.is_empty() {
            all.push(Statement { tokens });
        }
    }
    all
}

fn statement<'a>(input: &mut Input<'a>) -> Result<Vec<Token<'a>>> {
    let mut tokens = Vec::new();
    loop {
        let () = repeat(0.., blank).parse_next(input)?;
        let () = opt(comment).void().parse_next(input)?;
        if input.is_empty() || opt('\n').parse_next(input)?.is_some() {
            return Ok(tokens);
        }
        tokens.push(token.parse_next(input)?);
    }
}

fn blank(input: &mut Input<'_>) -> Result<()> {
    alt((take_while(1.., (' ', '\t')).void(), continuation)).parse_next(input)
}

fn comment(input: &mut Input<'_>) -> Result<()> {
    preceded(';', take_while(0.., |c| c != '\n')).void().parse_next(input)
}

fn continuation(input: &mut Input<'_>) -> Result<()> {
    ('\\', take_while(0.., (' ', '\t')), opt(comment), '\n')
        .void()
        .parse_next(input)
}

fn token<'a>(input: &mut Input<'a>) -> Result<Token<'a>> {
    let start = input.current_token_start();
    let kind = alt((
        word.map(|word| number(word).map_or(Kind::Word(word), Kind::Number)),
        text.map(Kind::Text),
        one_of(['=', ',', '-', '(', ')', '@']).map(Kind::Sign),
        any.map(Kind::Stray),
    ))
    .parse_next(input)?;
    let end = input.current_token_start();
    Ok(Token { kind, span: start..end })
}

fn word<'a>(input: &mut Input<'a>) -> Result<&'a str> {
    take_while(1.., |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '#')).parse_next(input)
}

fn number(word: &str) -> Option<i64> {
    match word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")) {
        Some(hex) if hex.bytes().all(|c| c.is_ascii_hexdigit()) => i64::from_str_radix(hex, 16).ok(),
        Some(_) => None,
        None if word.bytes().all(|c| c.is_ascii_digit()) => word.parse().ok(),
        None => None,
    }
}

/// A text ends at the first quotation mark behind which a statement can end or go on. Others belong to it: makers write inches.
fn text(input: &mut Input<'_>) -> Result<Text> {
    '"'.parse_next(input)?;
    let mut value = String::new();
    let mut ending = Ending::Closed;
    loop {
        if input.is_empty() || input.starts_with('\n') {
            ending = Ending::Open;
            break;
        }
        if opt(continuation).parse_next(input)?.is_some() {
            continue;
        }
        let c = any.parse_next(input)?;
        if c == '"' {
            let mut rest = input.chars().take(AHEAD).take_while(|&c| c != '\n');
            let next = rest.by_ref().find(|c| !matches!(c, ' ' | '\t'));
            let may_follow = next.is_none_or(|next| next.is_ascii_digit() || matches!(next, ';' | ',' | '\\'));
            if may_follow || !(next == Some('"') || rest.any(|c| c == '"')) {
                break;
            }
            ending = Ending::InnerQuotes;
        }
        value.push(c);
    }
    value.truncate(value.trim_end().len());
    Ok(Text { value, ending })
}

/// How far behind a quotation mark another one is looked for: more than the longest text, and no more than is paid for gladly at each.
const AHEAD: usize = 512;

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<Vec<Kind<'_>>> {
        statements(text)
            .into_iter()
            .map(|statement| statement.tokens.into_iter().map(|token| token.kind).collect())
            .collect()
    }

    fn closed(value: &str) -> Kind<'_> {
        Kind::Text(Text {
            value: value.to_owned(),
            ending: Ending::Closed,
        })
    }

    #[test]
    fn words_that_start_with_digits_are_words() {
        use Kind::{Number, Sign, Word};
        assert_eq!(kinds("9.6_supp=1"), [[Word("9.6_supp"), Sign('='), Number(1)]]);
        assert_eq!(kinds("24V_Pins = 0x1f"), [[Word("24V_Pins"), Sign('='), Number(0x1F)]]);
        assert_eq!(
            kinds("3 0-0XFF -7"),
            [[Number(3), Number(0), Sign('-'), Number(255), Sign('-'), Number(7)]]
        );
        assert_eq!(
            kinds("0xZ 1e5 12345678901234567890"),
            [[Word("0xZ"), Word("1e5"), Word("12345678901234567890")]]
        );
    }

    #[test]
    fn a_statement_goes_on_behind_a_backslash_even_one_with_a_comment() {
        use Kind::{Number, Sign, Word};
        let expected = [[Word("A"), Sign('='), Number(1), Sign(','), Number(2)]];
        assert_eq!(kinds("A = 1,\\\n2"), expected);
        assert_eq!(kinds("A = 1, \\  \n  2\n"), expected);
        assert_eq!(kinds("A = 1,\\   ; the first\n\t2 ; the second"), expected);
        // A backslash elsewhere is no token of the language.
        assert_eq!(kinds("A \\ B"), [[Word("A"), Kind::Stray('\\'), Word("B")]]);
    }

    #[test]
    fn comments_and_empty_lines_are_nothing_and_a_semicolon_in_a_text_is_no_comment() {
        assert_eq!(kinds("\n; x\n   ;y\nA;z\n"), [[Kind::Word("A")]]);
        assert_eq!(kinds("\"a;b\" ; c"), [[closed("a;b")]]);
    }

    #[test]
    fn texts_may_go_on_in_the_next_line_and_lose_the_blanks_at_their_end() {
        assert_eq!(kinds("\"one, \\\ntwo   \""), [[closed("one, two")]]);
        assert_eq!(kinds("\"\""), [[closed("")]]);
    }

    #[test]
    fn quotation_marks_inside_a_text_belong_to_it() {
        let inner = |value: &str| {
            Kind::Text(Text {
                value: value.to_owned(),
                ending: Ending::InnerQuotes,
            })
        };
        assert_eq!(kinds("\"Say \"stop\" now\""), [[inner("Say \"stop\" now")]]);
        assert_eq!(kinds("\"12\" pipe\" 0x31"), [[inner("12\" pipe"), Kind::Number(0x31)]]);
        assert_eq!(kinds("\"a\" ; \"b\""), [[closed("a")]]);
    }

    #[test]
    fn a_text_without_its_second_quotation_mark_ends_with_the_line() {
        let open = Kind::Text(Text {
            value: "abc ; d".to_owned(),
            ending: Ending::Open,
        });
        assert_eq!(kinds("\"abc ; d\nB"), [vec![open], vec![Kind::Word("B")]]);
    }

    #[test]
    fn anything_else_is_a_stray_character() {
        assert_eq!(kinds("? \u{0}"), [[Kind::Stray('?'), Kind::Stray('\u{0}')]]);
    }
}
