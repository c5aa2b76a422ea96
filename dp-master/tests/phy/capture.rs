//! Recording a line and keeping it in a file.

use std::time::Duration as StdDuration;

use dp_master::address::Address;
use dp_master::dp::{AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity};
use dp_master::fdl::BusParams;
use dp_master::phy::{
    CaptureError, CaptureReader, CaptureWriter, Content, Direction, Packet, Port, PortError, PortId, Script, Tap,
    Trace, TracedPort, Tracer, VirtualBus, pump,
};
use dp_master::station::{LineError, Station};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{DiscardReason, Service, Telegram};
use proptest::prelude::*;

const TOKEN: [u8; 3] = [0xDC, 0x02, 0x01];
const STATUS_REQUEST: [u8; 6] = [0x10, 0x03, 0x02, 0x49, 0x4E, 0x16];

/// A trace that outlives the octets.
#[derive(Clone, Debug, PartialEq)]
struct Kept {
    start: Instant,
    end: Instant,
    direction: Direction,
    octets: Vec<u8>,
    discarded: Option<(DiscardReason, usize)>,
    service: Option<Service>,
}

impl From<Trace<'_>> for Kept {
    fn from(trace: Trace<'_>) -> Self {
        let (discarded, service) = match trace.content {
            Content::Telegram(telegram) => (None, Some(Service::of(&telegram))),
            Content::Discarded { reason, lost } => (Some((reason, lost)), None),
        };
        Self {
            start: trace.start,
            end: trace.end,
            direction: trace.direction,
            octets: trace.octets.to_vec(),
            discarded,
            service,
        }
    }
}

/// Lets a master and a slave run into the exchange of data and records everything.
fn record(scripts: &[Script], exchanges: u64) -> Vec<Kept> {
    let baud = Baud::B1500000;
    let (plc, drive) = (Address::new(2).unwrap(), Address::new(3).unwrap());
    let mut master = DpMaster::<1>::new(MasterConfig::new(plc, BusParams::standard(baud))).unwrap();
    let axis = master
        .add_slave(SlaveConfig::new(drive, 0x00DA, &[0xF3, 0xF3]).unwrap())
        .unwrap();
    master.set_mode(Mode::Operate);
    let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
    let mut slave = DpSlave::new(SlaveIdentity::new(drive, 0x00DA, baud, accepted)).unwrap();

    let mut bus = VirtualBus::new(baud);
    let ports = [bus.attach(), bus.attach(), bus.attach()];
    for script in scripts {
        bus.script(*script);
    }
    let mut traces = Vec::new();
    let mut tap = Tap::new(baud, |trace: Trace<'_>| traces.push(Kept::from(trace)));
    let mut now = Instant::ZERO;
    while master.exchanges(axis) < exchanges {
        let mut stations: [(PortId, &mut dyn Station); 3] =
            [(ports[0], &mut master), (ports[1], &mut slave), (ports[2], &mut tap)];
        now = pump(&mut bus, now, &mut stations).unwrap();
    }
    tap.finish();
    assert_eq!(bus.violations(), []);
    traces
}

#[test]
fn a_tap_hears_the_start_up_in_its_order() {
    let traces = record(&[], 3);
    let mut services: Vec<_> = traces
        .iter()
        .filter(|trace| trace.octets.len() > 6)
        .filter_map(|trace| trace.service)
        .collect();
    services.dedup();
    // IEC 61158-6-3, start-up of a slave: Slave_Diag, Set_Prm, Chk_Cfg, Slave_Diag, Data_Exchange; Global_Control may stand anywhere.
    services.retain(|service| *service != Service::GlobalControl);
    services.dedup();
    assert_eq!(
        services,
        [
            Service::SlaveDiag,
            Service::SetPrm,
            Service::ChkCfg,
            Service::SlaveDiag,
            Service::DataExchange
        ]
    );
    assert!(
        traces.iter().all(|trace| trace.discarded.is_none()),
        "nothing was disturbed"
    );
}

#[test]
fn every_telegram_has_the_time_of_its_first_and_last_bit() {
    let baud = Baud::B1500000;
    let traces = record(&[], 3);
    for trace in &traces {
        // 11 bits a character, 1.5 Mbit/s: to the nanosecond.
        let length = baud.characters(trace.octets.len());
        assert_eq!(trace.end, trace.start + length, "{trace:?}");
    }
    for pair in traces.windows(2) {
        // min Tsdr is 11 tBIT, so nothing follows sooner.
        assert!(baud.bits(pair[1].start - pair[0].end) >= 11, "{pair:?}");
    }
}

#[test]
fn octets_with_a_wrong_check_sum_are_kept_with_the_reason() {
    // Two bits of one data octet flipped: parity does not see it, the frame check sequence does.
    let clean = record(&[], 3);
    let burst = clean
        .iter()
        .position(|trace| trace.service == Some(Service::SlaveDiag))
        .unwrap();
    let disturbed = record(
        &[Script::Flip {
            burst: burst as u64,
            character: 7,
            bits: 0b110,
        }],
        3,
    );
    let first = disturbed.iter().find(|trace| trace.discarded.is_some()).unwrap();
    assert!(
        matches!(first.discarded, Some((DiscardReason::Checksum { .. }, 0))),
        "{first:?}"
    );
    // One run, although the second 68 could begin a telegram.
    let whole = &clean[burst].octets;
    assert_eq!(first.octets.len(), whole.len(), "no octet is left out");
    assert_eq!(first.octets[..7], whole[..7]);
    assert_ne!(first.octets[7], whole[7]);
}

#[test]
fn a_telegram_that_lost_an_octet_does_not_take_the_next_one_with_it() {
    // The last but one octet is missing, so that the token behind stands where the end delimiter should.
    let broken = [0x68, 0x05, 0x05, 0x68, 0x83, 0x82, 0x6D, 0x3C, 0x3E, 0x16];
    let octets: Vec<u8> = broken.iter().chain(&TOKEN).copied().collect();
    let mut traces = Vec::new();
    let mut tracer = Tracer::new(Baud::B1500000);
    let end = Instant::from_nanos(1_000_000);
    tracer.push(end, &octets, |trace| traces.push(Kept::from(trace)));
    assert_eq!(traces.last().unwrap().service, Some(Service::Token));
}

#[test]
fn a_spoiled_character_is_counted_where_it_stood() {
    let mut traces = Vec::new();
    let mut tracer = Tracer::new(Baud::B12000000);
    let at = |characters| Instant::ZERO + Baud::B12000000.characters(characters);
    tracer.push(at(3), &STATUS_REQUEST[..3], |trace| traces.push(Kept::from(trace)));
    tracer.push_line_error(at(4), LineError::Parity, |trace| traces.push(Kept::from(trace)));
    tracer.push(at(7), &TOKEN, |trace| traces.push(Kept::from(trace)));
    assert_eq!(traces.len(), 2, "{traces:?}");
    assert_eq!(traces[0].octets, STATUS_REQUEST[..3]);
    assert_eq!(traces[0].discarded, Some((DiscardReason::Line(LineError::Parity), 1)));
    assert_eq!((traces[0].start, traces[0].end), (at(0), at(4)));
    assert_eq!(traces[1].service, Some(Service::Token));
    assert_eq!(traces[1].end, at(7));
}

#[test]
fn a_character_lost_alone_is_an_empty_trace() {
    let mut traces = Vec::new();
    Tracer::new(Baud::B500000).push_line_error(Instant::from_nanos(100_000), LineError::Framing, |trace| {
        traces.push(Kept::from(trace));
    });
    assert_eq!(traces.len(), 1);
    assert!(traces[0].octets.is_empty());
    // 11 bits at 500 kbit/s are 22 µs.
    assert_eq!(traces[0].start, Instant::from_nanos(78_000));
}

#[test]
fn silence_ends_a_telegram_that_is_not_complete() {
    let mut traces = Vec::new();
    let mut tracer = Tracer::new(Baud::B1500000);
    let characters = |n| Baud::B1500000.characters(n);
    let first = Instant::ZERO + characters(4);
    tracer.push(first, &STATUS_REQUEST[..4], |trace| traces.push(Kept::from(trace)));
    // 33 tBIT at 1.5 Mbit/s are 22 µs, three characters.
    let second = first + Duration::from_micros(22) + characters(3);
    tracer.push(second, &TOKEN, |trace| traces.push(Kept::from(trace)));
    assert_eq!(traces[0].discarded, Some((DiscardReason::Truncated, 0)));
    assert_eq!(traces[0].octets, STATUS_REQUEST[..4]);
    assert_eq!(traces[0].end, first);
    assert_eq!(traces[1].service, Some(Service::Token));
}

#[test]
fn a_tap_tells_a_cut_telegram_without_waiting_for_the_next_octet() {
    let baud = Baud::B1500000;
    let mut heard = Vec::new();
    let mut tap = Tap::new(baud, |trace: Trace<'_>| heard.push(Kept::from(trace)));
    let now = Instant::from_nanos(1_000_000);
    tap.handle_octets(now, &STATUS_REQUEST[..2]);
    let due = tap.poll_timeout().unwrap();
    // The longest telegram, 255 · 11 bits = 1870 µs, and Tsyn, 22 µs.
    assert_eq!(due, now + Duration::from_micros(1_892));
    tap.handle_timeout(due);
    assert_eq!(tap.poll_timeout(), None);
    drop(tap);
    assert_eq!(heard[0].discarded, Some((DiscardReason::Truncated, 0)));
}

#[test]
fn a_tap_never_speaks_and_tells_spoiled_characters() {
    let mut heard = Vec::new();
    let mut tap = Tap::new(Baud::B500000, |trace: Trace<'_>| heard.push(Kept::from(trace)));
    let now = Instant::from_nanos(100_000);
    tap.handle_line_error(now, LineError::Framing);
    assert_eq!(tap.poll_transmit(now, &mut [0; 255]), None);
    drop(tap);
    let lost = DiscardReason::Line(LineError::Framing);
    assert_eq!(heard[0].discarded, Some((lost, 1)));
}

/// Telegrams of IEC 61158-4-3 with a wrong check sum and the end delimiter in its place: without data, and with eight octets of it.
#[test]
fn a_telegram_of_fixed_length_with_a_wrong_check_sum_stays_whole() {
    // Each has a start delimiter inside.
    for octets in [
        &[0x10, 0x03, 0x02, 0x49, 0x10, 0x16][..],
        &[0xA2, 0x03, 0x02, 0x4C, 1, 2, 3, 0x10, 5, 6, 7, 8, 0, 0x16],
    ] {
        let mut traces = Vec::new();
        Tracer::new(Baud::B500000).push(Instant::from_nanos(1_000_000), octets, |trace| {
            traces.push(Kept::from(trace));
        });
        assert_eq!(traces.len(), 1, "{traces:02X?}");
        assert_eq!(traces[0].octets, octets);
        assert!(matches!(traces[0].discarded, Some((DiscardReason::Checksum { .. }, 0))));
    }
}

#[test]
fn two_telegrams_are_no_trace_of_one() {
    let octets = [STATUS_REQUEST, STATUS_REQUEST].concat();
    let trace = Kept::from(Trace::of(Instant::ZERO, Instant::ZERO, Direction::Received, &octets));
    // The octet behind the first is no delimiter that could follow.
    assert_eq!(trace.discarded, Some((DiscardReason::StartDelimiter { got: 0x10 }, 0)));
}

#[test]
fn a_spoiled_character_after_a_silence_does_not_belong_to_the_telegram_before() {
    let mut traces = Vec::new();
    let mut tracer = Tracer::new(Baud::B1500000);
    let baud = Baud::B1500000;
    let first = Instant::ZERO + baud.characters(4);
    tracer.push(first, &STATUS_REQUEST[..4], |trace| traces.push(Kept::from(trace)));
    // Silent for Tsyn, 33 tBIT, then one character.
    let spoiled = first + baud.duration(BitTimes(33)) + baud.characters(1);
    tracer.push_line_error(spoiled, LineError::Parity, |trace| traces.push(Kept::from(trace)));
    let lost = DiscardReason::Line(LineError::Parity);
    assert_eq!(traces[0].discarded, Some((DiscardReason::Truncated, 0)));
    assert_eq!((traces[1].discarded, traces[1].octets.len()), (Some((lost, 1)), 0));
    // A moment sooner it does.
    traces.clear();
    let mut tracer = Tracer::new(baud);
    tracer.push(first, &STATUS_REQUEST[..4], |trace| traces.push(Kept::from(trace)));
    let sooner = spoiled - Duration::from_nanos(1);
    tracer.push_line_error(sooner, LineError::Parity, |trace| traces.push(Kept::from(trace)));
    assert_eq!(traces[0].discarded, Some((lost, 1)));
    assert_eq!(traces.len(), 1);
}

/// A port that gives out what was put in, in pieces, and swallows what is sent.
struct Scripted {
    pieces: Vec<Vec<u8>>,
}

impl Port for Scripted {
    fn receive(&mut self, buf: &mut [u8], _: StdDuration) -> Result<usize, PortError> {
        if self.pieces.is_empty() {
            return Ok(0);
        }
        let piece = self.pieces.remove(0);
        buf[..piece.len()].copy_from_slice(&piece);
        Ok(piece.len())
    }

    fn send(&mut self, _: &[u8]) -> Result<(), PortError> {
        Ok(())
    }

    fn baud(&self) -> Baud {
        Baud::B187500
    }
}

#[test]
fn a_traced_port_records_both_directions() {
    let port = Scripted {
        pieces: vec![
            STATUS_REQUEST[..4].to_vec(),
            [&STATUS_REQUEST[4..], &TOKEN[..]].concat(),
            vec![0x99],
        ],
    };
    let mut millis = 0;
    let clock = || {
        millis += 1;
        Instant::ZERO + Duration::from_millis(millis)
    };
    let mut traces = Vec::new();
    let mut port = TracedPort::new(port, clock, |trace: Trace<'_>| traces.push(Kept::from(trace)));
    let mut buf = [0; 64];
    // A millisecond between the halves: the adapter holds octets back, the telegram goes on.
    assert_eq!(port.receive(&mut buf, StdDuration::ZERO).unwrap(), 4);
    assert_eq!(port.receive(&mut buf, StdDuration::ZERO).unwrap(), 5);
    port.send(&[0x10, 0x02, 0x03, 0x00, 0x05, 0x16]).unwrap();
    assert_eq!(port.receive(&mut buf, StdDuration::ZERO).unwrap(), 1);
    port.finish();
    let seen: Vec<_> = traces.iter().map(|trace| (trace.direction, trace.service)).collect();
    assert_eq!(
        seen,
        [
            (Direction::Received, Some(Service::FdlStatus)),
            (Direction::Received, Some(Service::Token)),
            (Direction::Sent, Some(Service::FdlStatus)),
            (Direction::Received, None),
        ]
    );
    // The clock gives 1, 2, 3, 4 ms; the second piece ended at 2 ms, its three last characters are the token.
    assert_eq!(traces[1].end, Instant::ZERO + Duration::from_millis(2));
    assert_eq!(traces[0].end, traces[1].end - Baud::B187500.characters(3));
    assert_eq!(traces[2].start, Instant::ZERO + Duration::from_millis(3));
    assert_eq!(traces[2].end, traces[2].start + Baud::B187500.characters(6));
}

/// Writes traces to a file in memory.
fn capture(baud: Baud, epoch: Duration, traces: &[Kept]) -> Vec<u8> {
    let mut file = CaptureWriter::new(Vec::new(), baud, epoch).unwrap();
    for trace in traces {
        let mut one = Trace::of(trace.start, trace.end, trace.direction, &trace.octets);
        if let Some((reason, lost)) = trace.discarded {
            one.content = Content::Discarded { reason, lost };
        }
        file.write(&one).unwrap();
    }
    file.finish().unwrap()
}

#[test]
fn a_capture_gives_back_what_was_written_to_the_nanosecond() {
    let traces = record(
        &[Script::Spoil {
            burst: 12,
            character: 3,
            error: LineError::Parity,
        }],
        5,
    );
    assert!(traces.iter().any(|trace| trace.discarded.is_some()));
    let file = capture(Baud::B1500000, Duration::ZERO, &traces);
    let mut reader = CaptureReader::new(file.as_slice()).unwrap();
    let packets: Vec<_> = reader.by_ref().collect::<Result<_, _>>().unwrap();
    assert_eq!(reader.baud(), Some(Baud::B1500000));
    assert_eq!(packets.len(), traces.len());
    for (packet, trace) in packets.iter().zip(&traces) {
        let mut back = Kept::from(packet.trace(Baud::B1500000));
        // The end is computed from the rounded length of the telegram.
        assert!((back.end - trace.end).as_nanos().max((trace.end - back.end).as_nanos()) <= 1);
        back.end = trace.end;
        assert_eq!(&back, trace);
        assert_eq!(packet.telegram().is_ok(), trace.discarded.is_none());
        assert_eq!(packet.comment.is_some(), trace.discarded.is_some());
    }
}

#[test]
fn a_capture_names_link_type_257_nanoseconds_and_the_baud_rate() {
    let file = capture(Baud::B12000000, Duration::ZERO, &[]);
    // Section header block with its byte-order magic; interface block type 1 with link type 257 = 0101h, little endian.
    assert_eq!(file[..4], [0x0A, 0x0D, 0x0D, 0x0A]);
    assert_eq!(file[8..12], [0x4D, 0x3C, 0x2B, 0x1A]);
    let length = u32::from_le_bytes(file[4..8].try_into().unwrap()) as usize;
    let interface = &file[length..];
    assert_eq!(interface[..4], [1, 0, 0, 0]);
    assert_eq!(interface[8..10], [0x01, 0x01]);
    // Options: if_speed is 8, eight octets long; if_tsresol is 9, one octet long.
    let has = |option: &[u8]| interface.windows(option.len()).any(|window| window == option);
    assert!(has(&[8, 0, 8, 0, 0x00, 0x1B, 0xB7, 0, 0, 0, 0, 0]));
    assert!(has(&[9, 0, 1, 0, 9]));
}

#[test]
fn the_epoch_turns_the_time_of_the_line_into_the_time_of_day() {
    let token = Kept::from(Trace::of(
        Instant::from_nanos(42),
        Instant::from_nanos(42),
        Direction::Sent,
        &TOKEN,
    ));
    let epoch = Duration::from_millis(1_800_000_000_000);
    let file = capture(Baud::B500000, epoch, &[token]);
    let packet = CaptureReader::new(file.as_slice()).unwrap().next().unwrap().unwrap();
    assert_eq!(packet.start, Instant::from_nanos(1_800_000_000_000_000_042));
    assert_eq!(packet.direction, Some(Direction::Sent));
}

/// A file of another program with one packet, put together by hand: section header, interface of link type 257, enhanced packet.
/// Source: draft-ietf-opsawg-pcapng, sections 4.1 to 4.3.
fn foreign_file(interface_options: &[u8], stamp: u32, packet_options: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut block = |kind: u32, body: &[u8]| {
        let length = u32::try_from(body.len() + 12).unwrap().to_le_bytes();
        file.extend(kind.to_le_bytes());
        file.extend(length);
        file.extend(body);
        file.extend(length);
    };
    block(
        0x0A0D_0D0A,
        &[
            0x4D, 0x3C, 0x2B, 0x1A, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
        ],
    );
    block(1, &[&[0x01, 0x01, 0, 0, 0, 0, 0, 0], interface_options].concat());
    let lengths = [3, 0, 0, 0, 3, 0, 0, 0];
    let body = [
        &[0; 8][..],
        &stamp.to_le_bytes(),
        &lengths,
        &TOKEN,
        &[0],
        packet_options,
    ];
    block(6, &body.concat());
    file
}

/// An option: code, length, value filled up to four octets.
fn option(code: u8, value: &[u8]) -> Vec<u8> {
    let mut option = vec![code, 0, u8::try_from(value.len()).unwrap(), 0];
    option.extend(value);
    option.resize(option.len().next_multiple_of(4), 0);
    option
}

const END_OF_OPTIONS: [u8; 4] = [0; 4];

fn first_packet(file: &[u8]) -> Packet {
    CaptureReader::new(file).unwrap().next().unwrap().unwrap()
}

#[test]
fn a_file_that_names_no_resolution_is_read_in_microseconds() {
    let file = foreign_file(&[], 1_234_567, &[]);
    let mut reader = CaptureReader::new(file.as_slice()).unwrap();
    let packet = reader.next().unwrap().unwrap();
    assert_eq!(packet.start, Instant::from_nanos(1_234_567_000));
    assert_eq!(
        packet.telegram(),
        Ok(Telegram::Token {
            da: Address::new(2).unwrap(),
            sa: Address::new(1).unwrap()
        })
    );
    assert_eq!((packet.direction, reader.baud()), (None, None));
    assert!(reader.next().is_none());
}

/// if_tsresol is option 9: a negative power of ten, of two with the highest bit set.
#[test]
fn times_are_read_in_the_unit_that_the_file_names() {
    for (resolution, ticks, nanos) in [
        (0_u8, 5, 5_000_000_000_u64),
        (3, 1_234, 1_234_000_000),
        (9, 1_234_567, 1_234_567),
        (12, 5_000_000, 5_000),
        (0x80 | 10, 3 * 1_024, 3_000_000_000),
        (0x80 | 1, 3, 1_500_000_000),
    ] {
        let options = [option(9, &[resolution]), END_OF_OPTIONS.to_vec()].concat();
        let packet = first_packet(&foreign_file(&options, ticks, &[]));
        assert_eq!(packet.start, Instant::from_nanos(nanos), "resolution {resolution:#04X}");
    }
}

/// opt_comment is option 1, epb_flags option 2: 01 inbound, 10 outbound, 00 unknown.
#[test]
fn a_packet_has_the_first_comment_and_the_direction_that_the_file_names() {
    for (flags, direction) in [
        (0, None),
        (1, Some(Direction::Received)),
        (2, Some(Direction::Sent)),
        (3, None),
    ] {
        let options = [
            option(1, b"first"),
            option(2, &[flags, 0, 0, 0]),
            option(1, b"second"),
            END_OF_OPTIONS.to_vec(),
        ];
        let packet = first_packet(&foreign_file(&[], 0, &options.concat()));
        assert_eq!(packet.direction, direction, "{flags}");
        assert_eq!(packet.comment.as_deref(), Some("first"));
        assert!(!packet.symbol_error);
    }
}

/// Bits of epb_flags: 24 wrong check sum, 26 too short, 28 unaligned, 29 start delimiter, 31 symbol; bits 0 and 1 are the direction.
/// Source: draft-ietf-opsawg-pcapng, section 4.3.1.
#[test]
fn the_flags_of_a_packet_tell_what_was_wrong_with_its_octets() {
    for (reason, bit) in [
        (DiscardReason::Checksum { expected: 1, got: 2 }, 24),
        (DiscardReason::Truncated, 26),
        (DiscardReason::EndDelimiter { got: 0 }, 28),
        (DiscardReason::StartDelimiter { got: 0 }, 29),
        (DiscardReason::SecondStartDelimiter { got: 0 }, 29),
        (DiscardReason::Line(LineError::Parity), 31),
    ] {
        let mut trace = Kept::from(Trace::of(Instant::ZERO, Instant::ZERO, Direction::Received, &TOKEN));
        trace.discarded = Some((reason, 0));
        let file = capture(Baud::B500000, Duration::ZERO, &[trace]);
        let flags = option(2, &(1_u32 | 1 << bit).to_le_bytes());
        assert!(
            file.windows(flags.len()).any(|window| window == flags),
            "{reason}: {file:02X?}"
        );
    }
}

/// A file that counts how often it was flushed, and that cannot be read.
#[derive(Default)]
struct Counting {
    flushed: usize,
}

impl std::io::Write for Counting {
    fn write(&mut self, octets: &[u8]) -> std::io::Result<usize> {
        Ok(octets.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.flushed += 1;
        Ok(())
    }
}

#[test]
fn a_capture_hands_everything_over_when_told_and_at_its_end() {
    let mut file = CaptureWriter::new(Counting::default(), Baud::B500000, Duration::ZERO).unwrap();
    file.flush().unwrap();
    assert_eq!(file.finish().unwrap().flushed, 2);
}

/// Gives the beginning of a file, and then says that the disk is broken.
struct Broken<'a>(&'a [u8]);

impl std::io::Read for Broken<'_> {
    fn read(&mut self, buf: &mut [u8]) -> std::io::Result<usize> {
        match self.0.read(buf)? {
            0 => Err(std::io::Error::other("the disk is broken")),
            read => Ok(read),
        }
    }
}

#[test]
fn a_file_that_cannot_be_read_is_another_error_than_one_that_is_cut() {
    let whole = foreign_file(&[], 0, &[]);
    for length in [whole.len() - 5, 3] {
        let begin = &whole[..length];
        let error = match CaptureReader::new(Broken(begin)) {
            Ok(mut reader) => reader.next().unwrap().unwrap_err(),
            Err(error) => error,
        };
        assert_eq!(
            error.to_string(),
            "the capture cannot be read or written: the disk is broken",
            "after {length} octets"
        );
    }
}

#[test]
fn a_capture_is_shown_without_its_octets() {
    let writer = CaptureWriter::new(Vec::new(), Baud::B500000, Duration::from_nanos(7)).unwrap();
    assert_eq!(format!("{writer:?}"), "CaptureWriter { epoch: Duration(7), .. }");
    let file = foreign_file(&[], 0, &[]);
    let reader = CaptureReader::new(file.as_slice()).unwrap();
    assert_eq!(format!("{reader:?}"), "CaptureReader { .. }");
}

#[test]
fn packets_of_other_networks_are_passed_over() {
    let mut file = capture(
        Baud::B500000,
        Duration::ZERO,
        &[Kept::from(Trace::of(
            Instant::ZERO,
            Instant::ZERO,
            Direction::Received,
            &TOKEN,
        ))],
    );
    let length = u32::from_le_bytes(file[4..8].try_into().unwrap()) as usize;
    // Link type 1 is Ethernet.
    file[length + 8..length + 10].copy_from_slice(&[1, 0]);
    assert!(CaptureReader::new(file.as_slice()).unwrap().next().is_none());
}

#[test]
fn what_is_no_capture_is_refused_in_one_sentence() {
    let error = CaptureReader::new(&b"68 05 05 68 and so on, a text of some length"[..]).unwrap_err();
    assert!(matches!(error, CaptureError::NotPcapNg), "{error}");
    assert!(matches!(CaptureReader::new(&[][..]), Err(CaptureError::NotPcapNg)));
    let whole = capture(
        Baud::B500000,
        Duration::ZERO,
        &[Kept::from(Trace::of(
            Instant::ZERO,
            Instant::ZERO,
            Direction::Received,
            &TOKEN,
        ))],
    );
    let cut = &whole[..whole.len() - 5];
    let mut reader = CaptureReader::new(cut).unwrap();
    assert!(matches!(reader.next(), Some(Err(CaptureError::Truncated))));
    assert!(reader.next().is_none(), "after an error there is nothing more");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn octets_from_outside_never_panic_and_are_never_lost(pieces in prop::collection::vec(
        (prop::collection::vec(prop_oneof![any::<u8>(), Just(0x68), Just(0xDC), Just(0x10)], 0..40), 0_u64..200_000, any::<bool>()), 0..20)
    ) {
        let mut tracer = Tracer::new(Baud::B1500000);
        let mut now = Instant::ZERO;
        let (mut given, mut told, mut lost_given, mut lost_told) = (Vec::new(), Vec::new(), 0, 0);
        let mut sink = |trace: Trace<'_>| {
            told.extend_from_slice(trace.octets);
            if let Content::Discarded { lost, .. } = trace.content { lost_told += lost; }
        };
        for (octets, pause, error) in &pieces {
            now = now + Duration::from_nanos(*pause) + Baud::B1500000.characters(octets.len());
            given.extend_from_slice(octets);
            tracer.push(now, octets, &mut sink);
            if *error {
                now += Baud::B1500000.characters(1);
                lost_given += 1;
                tracer.push_line_error(now, LineError::Framing, &mut sink);
            }
        }
        tracer.finish(&mut sink);
        prop_assert_eq!(given, told);
        prop_assert_eq!(lost_given, lost_told);
    }

    #[test]
    fn a_damaged_capture_is_an_error_and_never_a_panic(place in 0_usize..400, octet in any::<u8>(), cut in 0_usize..400) {
        let token = Kept::from(Trace::of(Instant::ZERO, Instant::ZERO, Direction::Received, &TOKEN));
        let mut file = capture(Baud::B500000, Duration::ZERO, &[token.clone(), token.clone(), token]);
        let length = file.len();
        if let Some(target) = file.get_mut(place % length) { *target = octet; }
        file.truncate(length - cut % length);
        if let Ok(reader) = CaptureReader::new(file.as_slice()) {
            // Ends after the first error, so this ends.
            prop_assert!(reader.count() <= 4);
        }
    }
}
