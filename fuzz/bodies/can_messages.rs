//! What comes from a CAN adapter and from a node: the lines of slcan, and the answers a client of the parameter channel waits for.

use dp_master::time::{Duration, Instant};
use lenze9300_model::bus::can::sdo::{Data, Request, Response};
use lenze9300_model::bus::can::{CanFrame, SdoChannel, SdoClient, SdoOutcome};
use lenze9300_model::bus::can_port::slcan::{Answer, Command, Decoder};

use super::input::Input;

/// The longest line of the protocol: `t`, identifier, length, eight octets, time stamp.
const LONGEST: usize = 1 + 3 + 1 + 16 + 4;
const NODE: u8 = 1;

pub(crate) fn run(data: &[u8]) {
    lines(data);
    client(data);
}

/// A frame out of any octets is one that can be sent, and what is sent is read as the same frame.
fn lines(data: &[u8]) {
    let mut decoder = Decoder::default();
    let mut since_end = 0;
    for &octet in data {
        since_end += 1;
        let Some(answer) = decoder.push(octet) else {
            assert!(octet != b'\r' && octet != 7, "an end gives an answer");
            continue;
        };
        let length = std::mem::take(&mut since_end) - 1;
        if let Answer::Frame(frame) = answer {
            assert!(length <= LONGEST, "a frame in a line of {length} octets");
            assert!(frame.id() < 0x800);
            let mut line = Vec::new();
            Command::Send(frame).encode(&mut line);
            let mut again = Decoder::default();
            let answers: Vec<_> = line.iter().filter_map(|octet| again.push(*octet)).collect();
            assert_eq!(answers, [Answer::Frame(frame)]);
        }
    }
}

/// A client takes only an answer to what it asked, sends no job more often than it may, and always ends.
fn client(data: &[u8]) {
    let mut input = Input::new(data);
    let mut client = SdoClient::new(NODE, SdoChannel::First).with_patience(Duration::from_millis(100), 3);
    let mut now = Instant::ZERO;
    while !input.is_empty() {
        let code = u16::from(input.octet()) * 16;
        let subcode = input.below(3);
        let request = match input.below(2) {
            0 => Request::Read { code, subcode },
            _ => Request::Write {
                code,
                subcode,
                data: Data::four(i32::from(input.octet())),
            },
        };
        assert_eq!(client.submit(request), Ok(()));
        assert!(client.submit(request).is_err(), "one job at a time");
        let (mut sent, mut heard) = (0, Vec::new());
        let outcome = loop {
            if let Some(frame) = client.poll_transmit(now) {
                assert_eq!(
                    (frame.id(), frame.data()),
                    (0x600 + u16::from(NODE), &request.encode()[..])
                );
                sent += 1;
                assert!(sent <= 3, "sent more often than it may");
            }
            if !input.is_empty() && input.below(4) != 0 {
                let mut octets = request.encode();
                for place in 0..usize::from(input.below(3)) {
                    octets[place * 3 % 8] = input.octet();
                }
                let id = if input.below(4) == 0 {
                    u16::from(input.octet()) << 3
                } else {
                    0x580 + u16::from(NODE)
                };
                let length = if input.below(4) == 0 {
                    usize::from(input.below(9))
                } else {
                    8
                };
                if let Some(frame) = CanFrame::new(id, &octets[..length]) {
                    client.handle_frame(&frame);
                    heard.push(frame);
                }
            } else {
                now += Duration::from_millis(100);
                client.handle_timeout(now);
            }
            if let Some(outcome) = client.poll_outcome() {
                break outcome;
            }
        };
        if let Ok(outcome) = outcome {
            let answer = heard.last().and_then(|frame| Response::decode(frame.data()).ok());
            let answer = answer.unwrap_or_else(|| panic!("{outcome:?} without an answer"));
            assert_eq!(answer.place(), request.place());
            let is_read = matches!(request, Request::Read { .. });
            assert_eq!(matches!(outcome, SdoOutcome::Value(_)), is_read);
        }
    }
}
