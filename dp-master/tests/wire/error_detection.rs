//! Hamming distance 4: no disturbance of one, two or three bits turns a telegram into another one.
//!
//! Every such disturbance of a set of short telegrams is tried. The bits are those on the line: start bit, eight data bits from the lowest
//! on, even parity, stop bit, character behind character, with the line idle (1) before and behind.
//!
//! # What receives
//!
//! A receiver as chips make it, bit by bit: it waits for a 0, takes that for a start bit and the ten bits behind it for the character. So a
//! disturbed start bit is *missed* and the character begins at the next 0 inside it, possibly with all following ones displaced. What such
//! a receiver does after a stop bit that is 0 differs between chips, so both ways are tried: it takes the 0 for the next start bit, or it
//! waits until the line is 1 again. That it samples a bit once, in its middle, is the only thing assumed.
//!
//! # What "detected" means
//!
//! A [`Decoder`] that is synchronised hands out no telegram. Inside a broken telegram a listener may find a chance pattern (`E5` alone is a
//! telegram), but stations act on nothing until the line was idle for 33 tBIT; that they do so is tried with whole stations below.
//!
//! Source: IEC 60870-5-1, format class FT 1.2 (parity, checksum, idle line after an error: distance 4); IEC 61158-4-3.

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity, SlaveIndex, SlavePhase,
};
use dp_master::fdl::BusParams;
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Decoded, Decoder, Telegram};

const STATUS_REQUEST: [u8; 6] = [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16];
const STATUS_ANSWER: [u8; 6] = [0x10, 0x02, 0x03, 0x00, 0x05, 0x16];
const SHORT_ACK: [u8; 1] = [0xE5];
const TOKEN: [u8; 3] = [0xDC, 0x02, 0x01];
/// Data_Exchange with two octets and its answer.
const EXCHANGE_REQUEST: [u8; 11] = [0x68, 0x05, 0x05, 0x68, 0x03, 0x02, 0x7D, 0x12, 0x34, 0xC8, 0x16];
const EXCHANGE_ANSWER: [u8; 11] = [0x68, 0x05, 0x05, 0x68, 0x02, 0x03, 0x08, 0xE5, 0xDC, 0xCE, 0x16];
/// Slave_Diag: SRD with access points 60 and 62.
const DIAG_REQUEST: [u8; 11] = [0x68, 0x05, 0x05, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0x3E, 0xEC, 0x16];
/// The least variable telegram: one octet.
const ONE_OCTET: [u8; 10] = [0x68, 0x04, 0x04, 0x68, 0x03, 0x02, 0x5D, 0x00, 0x62, 0x16];
/// Data full of start delimiters, so that a receiver that lost its place has much to find.
const DELIMITERS: [u8; 13] = [
    0x68, 0x07, 0x07, 0x68, 0x03, 0x02, 0x5D, 0xE5, 0x10, 0xDC, 0x02, 0x35, 0x16,
];
/// Eight octets as SD3.
const EIGHT_OCTETS: [u8; 14] = [
    0xA2, 0x03, 0x02, 0x7D, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0xA6, 0x16,
];

/// What a chip does after a stop bit that is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AfterFraming {
    /// It takes the 0 for the next start bit.
    Restarts,
    /// It waits until the line is 1 again.
    WaitsForOne,
}

const RECEIVERS: [AfterFraming; 2] = [AfterFraming::Restarts, AfterFraming::WaitsForOne];
const BITS_PER_CHARACTER: usize = 11;
/// Idle bits before the telegram, and Tsyn with a character's length to spare behind it.
const BEFORE: usize = 2;
const BEHIND: usize = 33 + BITS_PER_CHARACTER;

/// The line while a telegram is sent, one element a bit.
fn bits_of(octets: &[u8]) -> Vec<u8> {
    let mut bits = vec![1; BEFORE];
    for octet in octets {
        bits.push(0);
        bits.extend((0..8).map(|bit| octet >> bit & 1));
        bits.push((octet.count_ones() % 2) as u8);
        bits.push(1);
    }
    bits.extend([1; BEHIND]);
    bits
}

/// A character as the receiver tells it: the bit behind its last one, and the octet or why there is none.
type Character = (usize, Result<u8, LineError>);

fn receive(bits: &[u8], receiver: AfterFraming, characters: &mut Vec<Character>) {
    characters.clear();
    let mut at = 0;
    while let Some(character) = bits.get(at..at + BITS_PER_CHARACTER) {
        if character[0] == 1 {
            at += 1;
            continue;
        }
        let octet = (0..8).fold(0, |octet, bit| octet | character[1 + bit] << bit);
        let ones = character[1..=9].iter().filter(|bit| **bit == 1).count();
        at += BITS_PER_CHARACTER;
        if character[10] == 1 {
            let result = if ones % 2 == 0 {
                Ok(octet)
            } else {
                Err(LineError::Parity)
            };
            characters.push((at, result));
            continue;
        }
        characters.push((at, Err(LineError::Framing)));
        match receiver {
            AfterFraming::Restarts => at -= 1,
            AfterFraming::WaitsForOne => {
                at += bits.iter().skip(at).take_while(|bit| **bit == 0).count();
            }
        }
    }
}

/// Calls `look` with what is received of `octets` under every disturbance of one to three bits; returns how many there were.
fn disturb(octets: &[u8], receiver: AfterFraming, mut look: impl FnMut(&[usize], &[Character])) -> usize {
    let mut bits = bits_of(octets);
    let mut characters = Vec::new();
    let end = octets.len() * BITS_PER_CHARACTER;
    let mut tried = 0;
    let mut try_one = |bits: &[u8], flipped: &[usize]| {
        receive(bits, receiver, &mut characters);
        look(flipped, &characters);
        tried += 1;
    };
    for first in 0..end {
        bits[BEFORE + first] ^= 1;
        try_one(&bits, &[first]);
        for second in first + 1..end {
            bits[BEFORE + second] ^= 1;
            try_one(&bits, &[first, second]);
            for third in second + 1..end {
                bits[BEFORE + third] ^= 1;
                try_one(&bits, &[first, second, third]);
                bits[BEFORE + third] ^= 1;
            }
            bits[BEFORE + second] ^= 1;
        }
        bits[BEFORE + first] ^= 1;
    }
    tried
}

/// The telegrams that a synchronised decoder finds; how long they live does not matter here.
fn accepted(characters: &[Character], mut found: impl FnMut(Telegram<'_>)) {
    let mut decoder = Decoder::new();
    let mut synchronised = true;
    for (_, character) in characters {
        let sink = |decoded: Decoded<'_>| match decoded {
            Decoded::Telegram(telegram) if synchronised => found(telegram),
            Decoded::Telegram(_) => {}
            Decoded::Discarded { .. } => synchronised = false,
        };
        match character {
            Ok(octet) => decoder.push(&[*octet], sink),
            Err(error) => decoder.push_line_error(*error, sink),
        }
    }
}

/// n bits, choose 1, 2 or 3 of them.
fn choices(octets: usize) -> usize {
    let n = octets * BITS_PER_CHARACTER;
    n + n * (n - 1) / 2 + n * (n - 1) * (n - 2) / 6
}

// --- the receiver of this test ----------------------------------------------------------------------------------------------------------

#[test]
fn without_disturbance_every_telegram_arrives() {
    let telegrams: [&[u8]; 9] = [
        &STATUS_REQUEST,
        &STATUS_ANSWER,
        &SHORT_ACK,
        &TOKEN,
        &EXCHANGE_REQUEST,
        &EXCHANGE_ANSWER,
        &DIAG_REQUEST,
        &DELIMITERS,
        &EIGHT_OCTETS,
    ];
    for octets in telegrams {
        for receiver in RECEIVERS {
            let mut characters = Vec::new();
            receive(&bits_of(octets), receiver, &mut characters);
            let received: Vec<_> = characters.iter().map(|(_, character)| character.unwrap()).collect();
            assert_eq!(received, octets);
            let mut count = 0;
            accepted(&characters, |_| count += 1);
            assert_eq!(count, 1, "{octets:02X?}");
        }
    }
}

#[test]
fn a_missed_start_bit_displaces_the_characters() {
    // E5 is 0 1010 0111 1 1: with its start bit missed, the next 0 begins the character 1001 1111 with 1 for parity, 1 for stop.
    let mut bits = bits_of(&SHORT_ACK);
    bits[BEFORE] = 1;
    let mut characters = Vec::new();
    receive(&bits, AfterFraming::Restarts, &mut characters);
    let end = BEFORE + 2 + BITS_PER_CHARACTER;
    assert_eq!(characters, [(end, Err(LineError::Parity))]);
}

// --- formats ------------------------------------------------------------------------------------------------------------------------------

#[track_caller]
fn assert_distance_4(octets: &[u8]) {
    for receiver in RECEIVERS {
        let tried = disturb(octets, receiver, |flipped, characters| {
            accepted(characters, |telegram| {
                panic!("{octets:02X?}, {receiver:?}, bits {flipped:?} flipped: taken for {telegram:?}");
            });
        });
        assert_eq!(tried, choices(octets.len()));
    }
}

#[test]
fn a_telegram_without_data_has_distance_4() {
    assert_distance_4(&STATUS_REQUEST);
    assert_distance_4(&STATUS_ANSWER);
}

#[test]
fn the_short_acknowledgement_has_distance_4() {
    assert_distance_4(&SHORT_ACK);
}

#[test]
fn a_telegram_of_variable_length_has_distance_4() {
    assert_distance_4(&ONE_OCTET);
    assert_distance_4(&EXCHANGE_REQUEST);
    assert_distance_4(&EXCHANGE_ANSWER);
}

#[test]
fn a_telegram_with_access_points_has_distance_4() {
    assert_distance_4(&DIAG_REQUEST);
}

#[test]
fn data_full_of_start_delimiters_keep_distance_4() {
    assert_distance_4(&DELIMITERS);
}

#[test]
fn a_telegram_of_eight_octets_has_distance_4() {
    assert_distance_4(&EIGHT_OCTETS);
}

#[test]
fn four_bits_can_deceive_so_the_distance_is_not_more_than_4() {
    // Bits 0 and 1 of DA fall (03 → 00), the same bits of FCS with carry: 4E → 4B needs bits 0 and 2. Parity holds in both.
    let deceived = [0x10, 0x00, 0x02, 0x49, 0x4B, 0x16];
    let flipped: u32 = STATUS_REQUEST
        .iter()
        .zip(deceived)
        .map(|(a, b)| (a ^ b).count_ones())
        .sum();
    assert_eq!(flipped, 4);
    let mut characters = Vec::new();
    receive(&bits_of(&deceived), AfterFraming::Restarts, &mut characters);
    let mut found = 0;
    accepted(&characters, |_| found += 1);
    assert_eq!(found, 1);
}

/// The token has no frame check sequence. Its format lets exactly these through.
///
/// Two flips inside one address keep the parity: C(9, 2) = 36 pairs of data and parity bits. With the 8 pairs that touch bit 7 the octet is no
/// address any more, 28 remain, for each of the two addresses. And once two flips displace the source address so that it still fits: its start
/// bit and its stop bit.
///
/// What protects the ring is the protocol: see the stations below.
#[test]
fn the_token_has_distance_2_by_its_format_and_all_that_passes_is_known() {
    for receiver in RECEIVERS {
        let (mut da_changed, mut sa_changed, mut displaced) = (0, 0, 0);
        let tried = disturb(&TOKEN, receiver, |flipped, characters| {
            accepted(characters, |telegram| {
                let Telegram::Token { da, sa } = telegram else {
                    panic!("bits {flipped:?} flipped: taken for {telegram:?}");
                };
                let inside = |character: usize| {
                    flipped.iter().all(|bit| {
                        bit / BITS_PER_CHARACTER == character && (1..=9).contains(&(bit % BITS_PER_CHARACTER))
                    })
                };
                assert_eq!(flipped.len(), 2, "{flipped:?}: an odd number of flips is always seen");
                match (da.value(), sa.value()) {
                    (da, 0x01) if inside(1) => {
                        assert_ne!(da, 0x02);
                        da_changed += 1;
                    }
                    (0x02, sa) if inside(2) => {
                        assert_ne!(sa, 0x01);
                        sa_changed += 1;
                    }
                    (0x02, 0x40) => {
                        assert_eq!(flipped, [2 * BITS_PER_CHARACTER, 2 * BITS_PER_CHARACTER + 10]);
                        displaced += 1;
                    }
                    other => panic!("bits {flipped:?} flipped: {other:02X?}"),
                }
            });
        });
        assert_eq!(tried, choices(TOKEN.len()));
        assert_eq!((da_changed, sa_changed, displaced), (28, 28, 1), "{receiver:?}");
    }
}

// --- stations -----------------------------------------------------------------------------------------------------------------------------

const BAUD: Baud = Baud::B1500000;
const IDENT: u16 = 0x00DA;
/// Two octets in, two out.
const BOTH_WAYS: &[u8] = &[0x31];
/// Six octets out.
const SIX_OUTPUTS: &[u8] = &[0x25];

fn bits(count: usize) -> Duration {
    BAUD.duration(BitTimes(u32::try_from(count).unwrap()))
}

/// Tells a station what was received; `start` is the time of the first bit of the line. Returns when the line was heard to the end.
fn tell(station: &mut dyn Station, start: Instant, characters: &[Character]) -> Instant {
    let mut now = start;
    for (end, character) in characters {
        now = start + bits(*end);
        match character {
            Ok(octet) => station.handle_octets(now, &[*octet]),
            Err(error) => station.handle_line_error(now, *error),
        }
    }
    now
}

fn slave() -> DpSlave {
    let accepted = AcceptedConfigurations::Table(&[BOTH_WAYS, SIX_OUTPUTS]);
    DpSlave::new(SlaveIdentity::new(Address::new(3).unwrap(), IDENT, BAUD, accepted)).unwrap()
}

/// Works a station off until it sends; `None` when it never will.
fn next_telegram(station: &mut dyn Station, now: &mut Instant) -> Option<Vec<u8>> {
    let mut buf = [0; MAX_TELEGRAM];
    loop {
        if let Some(length) = station.poll_transmit(*now, &mut buf) {
            return Some(buf[..length].to_vec());
        }
        *now = station.poll_timeout()?;
        station.handle_timeout(*now);
    }
}

/// A master and its slave in the exchange of data, stopped when the master has sent a Data_Exchange.
struct Stopped {
    master: DpMaster<1>,
    index: SlaveIndex,
    slave: DpSlave,
    request: Vec<u8>,
    /// The request was sent to the end at this moment, and the slave has not heard it yet.
    sent: Instant,
}

fn stopped_in_exchange(configuration: &[u8], outputs: &[u8]) -> Stopped {
    let mut slave = slave();
    slave.set_inputs(&[0xE5, 0xDC]);
    let mut master =
        DpMaster::<1>::new(MasterConfig::new(Address::new(2).unwrap(), BusParams::standard(BAUD))).unwrap();
    let index = master
        .add_slave(SlaveConfig::new(Address::new(3).unwrap(), IDENT, configuration).unwrap())
        .unwrap();
    master.set_outputs(index, outputs).unwrap();
    master.set_mode(Mode::Operate);
    let mut now = Instant::ZERO;
    for _ in 0..10_000 {
        let octets = next_telegram(&mut master, &mut now).unwrap();
        now += BAUD.characters(octets.len());
        master.handle_sent(now);
        // SRD high with FCB 1 to the default access point of the slave.
        if matches!(octets[..], [0x68, _, _, 0x68, 0x03, 0x02, 0x7D, ..]) && master.exchanges(index) > 2 {
            assert_eq!(slave.phase(), SlavePhase::DataExchange);
            return Stopped {
                master,
                index,
                slave,
                request: octets,
                sent: now,
            };
        }
        slave.handle_octets(now, &octets);
        // A watchdog is no telegram: the reply is what is due within the slot time.
        if let Some(at) = slave.poll_timeout()
            && at < now + Duration::from_micros(100)
        {
            let mut at = now;
            let reply = next_telegram(&mut slave, &mut at).unwrap();
            now = at + BAUD.characters(reply.len());
            slave.handle_sent(now);
            master.handle_octets(now, &reply);
        }
    }
    panic!("the exchange of data was not reached");
}

#[test]
fn a_slave_neither_carries_out_nor_answers_a_disturbed_request_and_hears_the_repetition() {
    let Stopped {
        mut slave,
        request: earlier,
        sent,
        ..
    } = stopped_in_exchange(SIX_OUTPUTS, &[1, 2, 3, 4, 5, 6]);
    slave.handle_octets(sent, &earlier);
    let mut replied = sent;
    assert_eq!(next_telegram(&mut slave, &mut replied).unwrap(), SHORT_ACK);
    // The outputs are a telegram too, one that the slave would answer. FCB 0 is new: 03 + 02 + 5D and the sum of the outputs, C2, are 124.
    let request = [
        0x68, 0x09, 0x09, 0x68, 0x03, 0x02, 0x5D, 0x10, 0x03, 0x02, 0x49, 0x4E, 0x16, 0x24, 0x16,
    ];
    assert_eq!(request[7..13], STATUS_REQUEST);
    let start = replied + BAUD.characters(SHORT_ACK.len()) + bits(75);
    let (requests, deadline) = (slave.statistics().fdl.requests, slave.poll_timeout());
    for receiver in RECEIVERS {
        disturb(&request, receiver, |flipped, characters| {
            let mut slave = slave.clone();
            let end = tell(&mut slave, start, characters);
            assert_eq!(slave.outputs(), [1, 2, 3, 4, 5, 6], "{receiver:?}, bits {flipped:?}");
            assert_eq!(
                slave.statistics().fdl.requests,
                requests,
                "{receiver:?}, bits {flipped:?}"
            );
            assert_eq!(
                slave.poll_timeout(),
                deadline,
                "{receiver:?}, bits {flipped:?}: a reply is due"
            );
            // The master repeats after its slot time; Tsyn of idle line is the least there is.
            let sent = end.max(start + BAUD.characters(request.len()));
            slave.handle_octets(sent + bits(33) + BAUD.characters(request.len()), &request);
            assert_eq!(slave.outputs(), STATUS_REQUEST, "{receiver:?}, bits {flipped:?}: deaf");
        });
    }
}

#[test]
fn a_master_takes_no_inputs_from_a_disturbed_reply_and_repeats_its_request() {
    let Stopped {
        master,
        index,
        request,
        sent,
        ..
    } = stopped_in_exchange(BOTH_WAYS, &[0x12, 0x34]);
    let (exchanges, inputs) = (master.exchanges(index), master.inputs(index).to_vec());
    assert_eq!(inputs, [0xE5, 0xDC]);
    // 01 02 instead of E5 DC.
    let reply = [0x68, 0x05, 0x05, 0x68, 0x02, 0x03, 0x08, 0x01, 0x02, 0x10, 0x16];
    let start = sent + bits(11);
    let undisturbed = {
        let mut master = master.clone();
        master.handle_octets(start + BAUD.characters(reply.len()), &reply);
        (master.exchanges(index), master.inputs(index).to_vec())
    };
    assert_eq!(undisturbed, (exchanges + 1, vec![0x01, 0x02]));
    for receiver in RECEIVERS {
        disturb(&reply, receiver, |flipped, characters| {
            let mut master = master.clone();
            let mut now = tell(&mut master, start, characters);
            let next = next_telegram(&mut master, &mut now);
            assert_eq!(next.as_ref(), Some(&request), "{receiver:?}, bits {flipped:?}");
            assert_eq!(master.exchanges(index), exchanges, "{receiver:?}, bits {flipped:?}");
            assert_eq!(master.inputs(index), inputs, "{receiver:?}, bits {flipped:?}");
        });
    }
}

#[test]
fn a_disturbed_acknowledgement_is_none() {
    let Stopped {
        master,
        index,
        request,
        sent,
        ..
    } = stopped_in_exchange(SIX_OUTPUTS, &[1, 2, 3, 4, 5, 6]);
    let exchanges = master.exchanges(index);
    let start = sent + bits(11);
    let undisturbed = {
        let mut master = master.clone();
        master.handle_octets(start + BAUD.characters(1), &SHORT_ACK);
        master.exchanges(index)
    };
    assert_eq!(undisturbed, exchanges + 1);
    for receiver in RECEIVERS {
        disturb(&SHORT_ACK, receiver, |flipped, characters| {
            let mut master = master.clone();
            let mut now = tell(&mut master, start, characters);
            let next = next_telegram(&mut master, &mut now);
            assert_eq!(next.as_ref(), Some(&request), "{receiver:?}, bits {flipped:?}");
            assert_eq!(master.exchanges(index), exchanges, "{receiver:?}, bits {flipped:?}");
        });
    }
}
