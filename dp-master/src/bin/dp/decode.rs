//! `dp decode`: telegrams given in hexadecimal, explained.

use std::io::{self, IsTerminal, Read};
use std::path::{Path, PathBuf};

use clap::Args;
use dp_master::phy::{Content, Trace, Tracer};
use dp_master::time::{Baud, Instant};
use dp_master::wire::{Hex, Pretty};

use crate::output::{Outcome, Output, Trouble, note};
use crate::telegram_record::TelegramRecord;

/// What `dp decode` takes.
#[derive(Debug, Args)]
pub(crate) struct DecodeArgs {
    /// Octets in hexadecimal, such as 10 03 02 49 4E 16; spaces, commas, colons and 0x may stand between them. Without any they are
    /// read from standard input, where # begins a comment.
    #[arg(value_name = "HEX")]
    octets: Vec<String>,
    /// Read them from this file.
    #[arg(long, value_name = "FILE", conflicts_with = "octets")]
    file: Option<PathBuf>,
    /// One fact a line instead of one telegram a line.
    #[arg(short, long, conflicts_with = "json")]
    verbose: bool,
    /// One JSON object for each telegram.
    #[arg(long)]
    json: bool,
}

/// Explains what is given; it fails when octets belong to no telegram.
pub(crate) fn decode(args: &DecodeArgs) -> Outcome {
    let octets = match (&args.file, args.octets.as_slice()) {
        (Some(path), _) => octets_of(&read_file(path)?, &format!("{}:", path.display()))?,
        (None, []) => octets_of(&read_standard_input()?, "line ")?,
        (None, words) => octets_of(&words.join(" "), "")?,
    };
    if octets.is_empty() {
        return Err(Trouble::given(
            "there are no octets, give them in hexadecimal such as 10 03 02 49 4E 16",
        ));
    }
    let mut out = Output::new();
    let mut all_telegrams = true;
    let mut show = |trace: Trace<'_>| {
        match trace.content {
            Content::Discarded { .. } => all_telegrams = false,
            Content::Telegram(_) => {}
        }
        match trace.content {
            _ if args.json => out.json(&TelegramRecord::new(&trace)),
            Content::Telegram(telegram) if args.verbose => out.text(format_args!("{:#}", Pretty(&telegram))),
            Content::Telegram(telegram) => out.line(Pretty(&telegram)),
            Content::Discarded { reason, .. } => {
                out.line(format_args!("no telegram: {reason}  {}", Hex(trace.octets)));
            }
        }
    };
    // Octets without times: the line was never silent between them.
    let mut tracer = Tracer::new(Baud::B9600);
    tracer.push(Instant::ZERO, &octets, &mut show);
    tracer.finish(&mut show);
    out.flush();
    if all_telegrams { Ok(()) } else { Err(Trouble::Told) }
}

fn read_file(path: &Path) -> Result<String, Trouble> {
    let octets = std::fs::read(path)
        .map_err(|error| Trouble::given(format_args!("{} cannot be read: {error}", path.display())))?;
    if octets.starts_with(&PCAPNG) {
        return Err(Trouble::given(format_args!(
            "{0} is a capture and no text, use `dp sniff --read {0}`",
            path.display()
        )));
    }
    String::from_utf8(octets)
        .map_err(|_| Trouble::given(format_args!("{} is no text, hexadecimal is needed", path.display())))
}

fn read_standard_input() -> Result<String, Trouble> {
    if io::stdin().is_terminal() {
        note("octets in hexadecimal, please; the end is ctrl-D");
    }
    let mut text = String::new();
    io::stdin()
        .read_to_string(&mut text)
        .map_err(|error| Trouble::given(format_args!("standard input cannot be read: {error}")))?;
    Ok(text)
}

/// The octets of a text. `place` stands before the number of the line in a message; empty where there are no lines.
fn octets_of(text: &str, place: &str) -> Result<Vec<u8>, Trouble> {
    let mut octets = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        for word in line
            .split([' ', '\t', ',', ';', ':', '-'])
            .filter(|word| !word.is_empty())
        {
            let digits = word
                .strip_prefix("0x")
                .or_else(|| word.strip_prefix("0X"))
                .unwrap_or(word);
            let before = octets.len();
            octets.extend(pairs(digits));
            if (octets.len() - before) * 2 != digits.len() {
                let place = if place.is_empty() {
                    String::new()
                } else {
                    format!("{place}{}: ", index + 1)
                };
                return Err(Trouble::given(format_args!(
                    "{place}`{word}` is no row of octets, pairs of hexadecimal digits are needed such as 10 03 or 1003"
                )));
            }
        }
    }
    Ok(octets)
}

/// The octets of a short text that is no file.
pub(crate) fn octets_of_words(text: &str) -> Result<Vec<u8>, Trouble> {
    octets_of(text, "")
}

/// Octets from the front, as long as two hexadecimal digits follow each other.
fn pairs(digits: &str) -> impl Iterator<Item = u8> + '_ {
    digits.as_bytes().chunks(2).map_while(|pair| {
        let digit = |octet: u8| char::from(octet).to_digit(16);
        match *pair {
            [high, low] => u8::try_from(digit(high)? * 16 + digit(low)?).ok(),
            _ => None,
        }
    })
}

/// The first octets of every pcapng file.
const PCAPNG: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
