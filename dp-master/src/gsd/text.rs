//! From the octets of a file to characters and places in it.
//!
//! GSD files are written by Windows tools of thirty years: in ASCII, Windows-1252 or lately UTF-8, with any kind of line end, some with
//! the end-of-file character of DOS. Whatever the octets are, they become characters.

use super::diagnostic::Position;

/// The characters of a file: UTF-8 where the octets are that, Windows-1252 otherwise; lines end with `\n`.
pub(super) fn decode(octets: &[u8]) -> String {
    let octets = octets.strip_prefix(&[0xEF, 0xBB, 0xBF]).unwrap_or(octets);
    let octets = octets.split(|&octet| octet == END_OF_FILE).next().unwrap_or(&[]);
    let text = match core::str::from_utf8(octets) {
        Ok(text) => text.to_owned(),
        Err(_) => octets.iter().map(|&octet| windows_1252(octet)).collect(),
    };
    if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n")
    } else {
        text
    }
}

/// Where DOS programs ended a text file.
const END_OF_FILE: u8 = 0x1A;

/// The character of an octet in Windows-1252, which is ISO 8859-1 except for 80h…9Fh.
fn windows_1252(octet: u8) -> char {
    match octet {
        0x80..=0x9F => UPPER.get(usize::from(octet - 0x80)).copied().unwrap_or('\u{FFFD}'),
        _ => char::from(octet),
    }
}

/// 80h…9Fh of Windows-1252; the five octets without character become the replacement character.
#[rustfmt::skip]
const UPPER: [char; 32] = [
    '€', '\u{FFFD}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{FFFD}', 'Ž', '\u{FFFD}',
    '\u{FFFD}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{FFFD}', 'ž', 'Ÿ',
];

/// Finds line and column of an offset.
#[derive(Debug)]
pub(super) struct Lines<'a> {
    text: &'a str,
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let after_ends = text.match_indices('\n').map(|(offset, _)| offset + 1);
        Self {
            text,
            starts: core::iter::once(0).chain(after_ends).collect(),
        }
    }

    /// The place of an octet offset of the decoded text.
    pub(super) fn position(&self, offset: usize) -> Position {
        let line = self.starts.partition_point(|&start| start <= offset);
        let start = self.starts.get(line.wrapping_sub(1)).copied().unwrap_or(0);
        let before = self.text.get(start..offset).unwrap_or("");
        let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        Position {
            line: number(line.max(1)),
            column: number(before.chars().count() + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utf_8_windows_1252_and_latin_1_are_all_read() {
        assert_eq!(decode("Gerät für 5 €".as_bytes()), "Gerät für 5 €");
        assert_eq!(decode(b"\xEF\xBB\xBFGer\xC3\xA4t"), "Gerät");
        // A-umlaut and degree sign in ISO 8859-1, the euro sign and a dash of Windows-1252.
        assert_eq!(decode(b"\xC4 90\xB0 \x80 \x96"), "Ä 90° € –");
        assert_eq!(decode(b"\x81"), "\u{FFFD}");
    }

    #[test]
    fn every_line_end_is_one_and_the_end_of_file_character_ends_the_file() {
        assert_eq!(decode(b"a\r\nb\rc\nd\x1Arest"), "a\nb\nc\nd");
    }

    #[test]
    fn positions_count_lines_and_characters_from_one() {
        let text = "äb\n\ncd";
        let lines = Lines::new(text);
        let at = |needle: char| {
            let Position { line, column } = lines.position(text.find(needle).unwrap());
            (line, column)
        };
        assert_eq!((at('ä'), at('b'), at('c'), at('d')), ((1, 1), (1, 2), (3, 1), (3, 2)));
        assert_eq!(lines.position(text.len()), Position { line: 3, column: 3 });
        assert_eq!(lines.position(1_000).line, 3);
    }
}
