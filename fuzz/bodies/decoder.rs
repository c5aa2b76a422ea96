//! The decoder against a plain model of its rules, in pieces of any size, with spoiled characters and silences between.

use dp_master::station::{LineError, MAX_TELEGRAM};
use dp_master::wire::{DecodeError, Decoded, Decoder, DiscardReason, Pretty, Service, Telegram, decode_one};

use super::input::Input;

/// What a decoder tells, without borrowing. Telegrams are compared by what they mean, as text.
#[derive(Debug, PartialEq)]
enum Told {
    Telegram(String),
    Discarded(DiscardReason, usize),
}

fn told(decoded: Decoded<'_>) -> Told {
    match decoded {
        Decoded::Telegram(telegram) => {
            check(&telegram);
            Told::Telegram(format!("{telegram:?}"))
        }
        Decoded::Discarded { reason, octets } => {
            assert!(octets > 0, "an empty run was discarded");
            Told::Discarded(reason, octets)
        }
    }
}

/// A telegram that was read can be written, and reads the same again.
fn check(telegram: &Telegram<'_>) {
    let mut buf = [0; MAX_TELEGRAM];
    // Only the token is stricter when written: nobody passes it to all.
    match telegram.encode(&mut buf) {
        Ok(length) => assert_eq!(decode_one(&buf[..length]), Ok((*telegram, length))),
        Err(error) => assert!(matches!(telegram, Telegram::Token { .. }), "{error}"),
    }
    if let Ok(length) = telegram.encode_without_sd3(&mut buf) {
        assert_eq!(decode_one(&buf[..length]), Ok((*telegram, length)));
    }
    let _ = Service::of(telegram);
    assert!(!format!("{}", Pretty(telegram)).is_empty());
    assert!(!format!("{:#}", Pretty(telegram)).is_empty());
}

/// Runs of discarded octets joined: a run ends also where the received piece ends or where a telegram was thought to end, and goes on with
/// a reason of its own. Together they are the same, and so is the first reason.
fn joined(told: Vec<Told>) -> Vec<Told> {
    let mut joined = Vec::new();
    for told in told {
        match (joined.last_mut(), told) {
            (Some(Told::Discarded(_, before)), Told::Discarded(_, more)) => *before += more,
            (_, told) => joined.push(told),
        }
    }
    joined
}

/// The rules of the decoder, written without regard to cost.
#[derive(Default)]
struct Model {
    waiting: Vec<u8>,
    told: Vec<Told>,
}

impl Model {
    fn push(&mut self, octets: &[u8]) {
        self.waiting.extend(octets);
        self.settle(None);
    }

    /// Takes telegrams from the front; `end` is why nothing more will come, and how many characters were lost with it.
    fn settle(&mut self, end: Option<(DiscardReason, usize)>) {
        let mut lost = end.map_or(0, |(_, lost)| lost);
        while !self.waiting.is_empty() {
            let reason = match decode_one(&self.waiting) {
                Ok((telegram, used)) => {
                    let telegram = Told::Telegram(format!("{telegram:?}"));
                    self.told.push(telegram);
                    self.waiting.drain(..used);
                    continue;
                }
                Err(DecodeError::Incomplete) => match end {
                    Some((reason, _)) => reason,
                    None => return,
                },
                Err(DecodeError::Corrupt(reason)) => reason,
            };
            let starts = [0x10, 0x68, 0xA2, 0xDC, 0xE5];
            let next = self.waiting.iter().skip(1).position(|octet| starts.contains(octet));
            let mut passed = next.map_or(self.waiting.len(), |index| index + 1);
            self.waiting.drain(..passed);
            if self.waiting.is_empty() {
                passed += std::mem::take(&mut lost);
            }
            self.told.push(Told::Discarded(reason, passed));
        }
        if let Some((reason, _)) = end
            && lost > 0
        {
            self.told.push(Told::Discarded(reason, lost));
        }
    }
}

pub(crate) fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let (mut whole, mut single, mut model) = (Decoder::new(), Decoder::new(), Model::default());
    let (mut from_whole, mut from_single) = (Vec::new(), Vec::new());
    while !input.is_empty() {
        match input.octet() {
            0xFF => {
                let error = match input.below(3) {
                    0 => LineError::Parity,
                    1 => LineError::Framing,
                    _ => LineError::Overrun,
                };
                whole.push_line_error(error, |decoded| from_whole.push(told(decoded)));
                single.push_line_error(error, |decoded| from_single.push(told(decoded)));
                model.settle(Some((DiscardReason::Line(error), 1)));
            }
            0xFE => {
                let dropped = whole.idle();
                assert_eq!(dropped, single.idle());
                assert_eq!(dropped, model.waiting.len());
                model.waiting.clear();
                assert!(whole.is_synchronised());
            }
            0xFD => {
                whole.finish(|decoded| from_whole.push(told(decoded)));
                single.finish(|decoded| from_single.push(told(decoded)));
                if !model.waiting.is_empty() {
                    model.settle(Some((DiscardReason::Truncated, 0)));
                }
            }
            count => {
                let octets = input.take(usize::from(count));
                whole.push(octets, |decoded| from_whole.push(told(decoded)));
                for octet in octets {
                    single.push(&[*octet], |decoded| from_single.push(told(decoded)));
                }
                model.push(octets);
            }
        }
        let expected = joined(std::mem::take(&mut model.told));
        assert_eq!(joined(std::mem::take(&mut from_whole)), expected);
        assert_eq!(joined(std::mem::take(&mut from_single)), expected);
        assert_eq!(whole.pending(), model.waiting.len());
        assert_eq!(single.pending(), model.waiting.len());
        assert_eq!(whole.is_synchronised(), single.is_synchronised());
        assert!(whole.pending() < MAX_TELEGRAM);
    }
}
