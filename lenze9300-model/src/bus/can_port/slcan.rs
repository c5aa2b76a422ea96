//! The LAWICEL protocol: CAN frames and commands as lines of characters. Octets in, answers out; no port inside.
//!
//! | line | meaning |
//! |---|---|
//! | `tIIIL` and data in hex | data frame, 11 bits |
//! | `rIIIL` | remote frame, 11 bits |
//! | `TIIIIIIIIL…`, `RIIIIIIIIL` | the same with 29 bits |
//! | `S0`…`S8`, `O`, `C`, `F` | set the bit rate, open, close, ask for the status |
//!
//! A line ends with CR. The adapter answers a command with CR, a frame to be sent with `z` CR, and either with BEL when it refuses. Received
//! data may end with a time stamp of four digits.
//!
//! Source: LAWICEL, CAN232 manual, version 3, "Available CAN232 ASCII commands".

use crate::bus::can::CanFrame;

/// A bit rate the protocol has a command for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BitRate {
    kbit_s: u32,
    digit: u8,
}

impl BitRate {
    /// One of 10, 20, 50, 100, 125, 250, 500, 800 and 1000 kbit/s.
    #[must_use]
    pub fn from_kbit_s(kbit_s: u32) -> Option<Self> {
        let digit = [10, 20, 50, 100, 125, 250, 500, 800, 1000]
            .iter()
            .position(|rate| *rate == kbit_s)?;
        Some(Self {
            kbit_s,
            digit: b"012345678"[digit],
        })
    }

    /// In kbit/s.
    #[must_use]
    pub const fn kbit_s(self) -> u32 {
        self.kbit_s
    }
}

/// What this side tells the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Send a frame.
    Send(CanFrame),
    /// Set the bit rate; only while the bus is closed.
    SetBitRate(BitRate),
    /// Go on the bus.
    Open,
    /// Leave it.
    Close,
    /// Ask for the status flags.
    Status,
}

impl Command {
    /// Appends the line of this command.
    pub fn encode(&self, line: &mut Vec<u8>) {
        match self {
            Self::Send(frame) => {
                line.push(if frame.is_remote() { b'r' } else { b't' });
                for shift in [8, 4, 0] {
                    line.push(hex_digit(frame.id() >> shift));
                }
                line.push(hex_digit(u16::from(frame.dlc())));
                for octet in frame.data() {
                    line.extend([hex_digit(u16::from(octet >> 4)), hex_digit(u16::from(*octet))]);
                }
            }
            Self::SetBitRate(rate) => line.extend([b'S', rate.digit]),
            Self::Open => line.push(b'O'),
            Self::Close => line.push(b'C'),
            Self::Status => line.push(b'F'),
        }
        line.push(CR);
    }
}

/// What the adapter tells this side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A frame was received.
    Frame(CanFrame),
    /// A frame with a 29-bit identifier was received.
    Extended,
    /// The command was done, or the frame was taken.
    Done,
    /// The command or the frame was refused.
    Refused,
    /// The status flags.
    Status(StatusFlags),
    /// A line that means nothing.
    Unknown,
}

/// The answer to [`Command::Status`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusFlags(pub u8);

impl StatusFlags {
    /// Error warning limit passed (bit 2).
    #[must_use]
    pub const fn warning(self) -> bool {
        self.0 & 0x04 != 0
    }

    /// Received frames were lost: the queue was full (bit 0) or the controller overran (bit 3).
    #[must_use]
    pub const fn overrun(self) -> bool {
        self.0 & 0x09 != 0
    }

    /// Error passive (bit 5).
    #[must_use]
    pub const fn passive(self) -> bool {
        self.0 & 0x20 != 0
    }

    /// Bus error (bit 7).
    #[must_use]
    pub const fn bus_error(self) -> bool {
        self.0 & 0x80 != 0
    }
}

/// Collects the adapter's octets into answers.
///
/// A line longer than any the protocol has is one [`Answer::Unknown`] whatever its length, so the memory is bounded.
#[derive(Clone, Debug)]
pub struct Decoder {
    line: [u8; MAX_LINE],
    len: usize,
}

impl Default for Decoder {
    fn default() -> Self {
        Self {
            line: [0; MAX_LINE],
            len: 0,
        }
    }
}

impl Decoder {
    /// Takes one octet; an answer when it was the last of one.
    pub fn push(&mut self, octet: u8) -> Option<Answer> {
        match octet {
            CR => {
                let answer = self.line.get(..self.len).map_or(Answer::Unknown, answer_of);
                self.len = 0;
                Some(answer)
            }
            BEL => {
                self.len = 0;
                Some(Answer::Refused)
            }
            _ => {
                if let Some(place) = self.line.get_mut(self.len) {
                    *place = octet;
                    self.len += 1;
                } else {
                    // One more than there is room for marks a line that was too long.
                    self.len = MAX_LINE + 1;
                }
                None
            }
        }
    }
}

fn answer_of(line: &[u8]) -> Answer {
    let known = match line.split_first() {
        None => Some(Answer::Done),
        Some((b'z' | b'Z', [])) => Some(Answer::Done),
        Some((b't', rest)) => data_frame(rest),
        Some((b'r', rest)) => remote_frame(rest),
        Some((b'T' | b'R', rest)) if rest.len() >= 9 && number(rest).is_some() => Some(Answer::Extended),
        Some((b'F', flags)) if flags.len() == 2 => number(flags)
            .and_then(|flags| u8::try_from(flags).ok())
            .map(|flags| Answer::Status(StatusFlags(flags))),
        Some(_) => None,
    };
    known.unwrap_or(Answer::Unknown)
}

fn data_frame(rest: &[u8]) -> Option<Answer> {
    let (id, len, digits) = head(rest)?;
    let (data, stamp) = digits.split_at_checked(2 * usize::from(len))?;
    let mut octets = [0; 8];
    for (octet, pair) in octets.iter_mut().zip(data.chunks(2)) {
        *octet = u8::try_from(number(pair)?).ok()?;
    }
    is_stamp(stamp).then_some(())?;
    CanFrame::new(id, octets.get(..usize::from(len))?).map(Answer::Frame)
}

fn remote_frame(rest: &[u8]) -> Option<Answer> {
    let (id, len, stamp) = head(rest)?;
    is_stamp(stamp).then_some(())?;
    CanFrame::new_remote(id, len).map(Answer::Frame)
}

/// Identifier, length and what follows.
fn head(rest: &[u8]) -> Option<(u16, u8, &[u8])> {
    let (id, rest) = rest.split_at_checked(3)?;
    let (len, rest) = rest.split_first()?;
    let len = u8::try_from(number(&[*len])?).ok().filter(|len| *len <= 8)?;
    Some((u16::try_from(number(id)?).ok()?, len, rest))
}

fn is_stamp(digits: &[u8]) -> bool {
    digits.is_empty() || (digits.len() == 4 && number(digits).is_some())
}

/// A number of hexadecimal digits; `None` when there is another character or no digit. High digits of a long one fall out.
fn number(digits: &[u8]) -> Option<u32> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0_u32, |number, digit| {
        Some(number << 4 | char::from(*digit).to_digit(16)?)
    })
}

fn hex_digit(nibble: u16) -> u8 {
    b"0123456789ABCDEF"[usize::from(nibble & 0xF)]
}

const CR: u8 = b'\r';
const BEL: u8 = 7;
/// `T`, eight digits of identifier, length, sixteen digits of data, four of a time stamp.
const MAX_LINE: usize = 30;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn answers(octets: &[u8]) -> Vec<Answer> {
        let mut decoder = Decoder::default();
        octets.iter().filter_map(|octet| decoder.push(*octet)).collect()
    }

    fn line(command: Command) -> String {
        let mut line = Vec::new();
        command.encode(&mut line);
        String::from_utf8(line).unwrap()
    }

    /// CAN232 manual: "t10021133" sends identifier 0x100 with the octets 11 and 33; S4 is 125, S6 500, S8 1000 kbit/s.
    #[test]
    fn commands_are_those_of_the_manual() {
        let send = |id, data: &[u8]| Command::Send(CanFrame::new(id, data).unwrap());
        assert_eq!(line(send(0x100, &[0x11, 0x33])), "t10021133\r");
        assert_eq!(line(send(0x7FF, &[])), "t7FF0\r");
        assert_eq!(line(Command::Send(CanFrame::new_remote(0x100, 8).unwrap())), "r1008\r");
        for (kbit_s, expected) in [(10, "S0\r"), (125, "S4\r"), (500, "S6\r"), (1000, "S8\r")] {
            assert_eq!(
                line(Command::SetBitRate(BitRate::from_kbit_s(kbit_s).unwrap())),
                expected
            );
        }
        assert_eq!(BitRate::from_kbit_s(333), None);
    }

    #[test]
    fn the_two_kinds_of_acknowledgement_and_the_bell_are_told_apart_from_frames() {
        assert_eq!(
            answers(b"\rz\r\x07F84\rt10021133\rt100211331234\rT000001000\r"),
            [
                Answer::Done,
                Answer::Done,
                Answer::Refused,
                Answer::Status(StatusFlags(0x84)),
                Answer::Frame(CanFrame::new(0x100, &[0x11, 0x33]).unwrap()),
                Answer::Frame(CanFrame::new(0x100, &[0x11, 0x33]).unwrap()),
                Answer::Extended,
            ]
        );
    }

    #[test]
    fn a_spoilt_line_costs_itself_and_not_the_next_one() {
        for spoilt in [
            "t1002113",
            "t80021133",
            "t1009112233445566778899",
            "t100211333",
            "x",
            "t10G0",
        ] {
            let text = format!("{spoilt}\rt1000\r");
            assert_eq!(
                answers(text.as_bytes()),
                [Answer::Unknown, Answer::Frame(CanFrame::new(0x100, &[]).unwrap())],
                "{spoilt}"
            );
        }
        let long = format!("{}\rt1000\r", "t".repeat(10_000));
        assert_eq!(answers(long.as_bytes()).len(), 2);
    }

    proptest! {
        #[test]
        fn what_is_sent_is_what_is_received(id in 0_u16..0x800, data in prop::collection::vec(any::<u8>(), 0..=8)) {
            let frame = CanFrame::new(id, &data).unwrap();
            prop_assert_eq!(answers(line(Command::Send(frame)).as_bytes()), [Answer::Frame(frame)]);
        }

        #[test]
        fn no_octets_make_the_decoder_panic(octets in prop::collection::vec(any::<u8>(), 0..200)) {
            answers(&octets);
        }
    }
}
