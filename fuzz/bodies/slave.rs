//! A slave under anything a line and its device can do to it, from each of its states.

use dp_master::address::Address;
use dp_master::dp::v1::{
    Abort, AddAck, AlarmType, AlarmTypes, ErrorCode1, Incident, MAX_ALARMS, V1Capabilities, V1Error, V1RequestId,
};
use dp_master::dp::{
    AcceptedConfigurations, AddressChange, Block, Blocks, DpSlave, ExtDiag, OutputsOnLeave, Overflow, SlaveIdentity,
    SlavePhase, StationStatus, Support, sap,
};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Duration, Instant};
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, Telegram, decode_one};

use super::input::Input;

const BAUD: Baud = Baud::B1500000;
const IDENT: u16 = 0x00DA;
/// Two octets in, two out.
const CONFIGURATION: &[u8] = &[0x31];
const CONFIGURATIONS: &[&[u8]] = &[
    CONFIGURATION,
    &[0x10],
    &[0x20],
    &[0xF3, 0xF3],
    &[0xC1, 0x83, 0x01, 0x55],
];

/// A slave on a line, with the order of calls that `Station` asks for.
struct Bench {
    slave: DpSlave,
    now: Instant,
    /// When the last character ended that the slave heard.
    heard: Instant,
    /// Telegrams heard since the last reply, whole or not.
    owed: bool,
    last_reply: Vec<u8>,
    /// Requests of DP-V1 that the application has not answered.
    open: Vec<V1RequestId>,
}

impl Bench {
    fn new(slave: DpSlave) -> Self {
        Self {
            slave,
            open: Vec::new(),
            now: Instant::ZERO,
            heard: Instant::ZERO,
            owed: false,
            last_reply: Vec::new(),
        }
    }

    /// Lets time pass; what is due happens at its moment.
    fn advance(&mut self, span: Duration) {
        let end = self.now + span;
        while let Some(at) = self.slave.poll_timeout()
            && at <= end
        {
            self.now = self.now.max(at);
            self.slave.handle_timeout(self.now);
            let next = self.slave.poll_timeout();
            assert!(next.is_none_or(|next| next > self.now), "a timeout that does not end");
            self.transmit();
        }
        self.now = self.now.max(end);
    }

    fn transmit(&mut self) {
        let mut buf = [0; MAX_TELEGRAM];
        let Some(length) = self.slave.poll_transmit(self.now, &mut buf) else {
            return;
        };
        let octets = &buf[..length];
        assert!(self.owed, "a slave spoke unasked");
        self.owed = false;
        let pause = BAUD.duration(BitTimes(11));
        assert!(self.now >= self.heard + pause, "answered before min Tsdr");
        match decode_one(octets) {
            Ok((Telegram::ShortAck, 1)) => {}
            Ok((Telegram::Data { header, data }, used)) => {
                assert_eq!(used, length);
                assert!(!header.fc.is_request() && !header.da.is_broadcast());
                assert!(data.len() <= 244);
            }
            other => panic!("a slave sent {other:?}"),
        }
        self.last_reply = octets.to_vec();
        let end = self.now + BAUD.characters(length);
        // While it sends, timeouts still come.
        while let Some(at) = self.slave.poll_timeout()
            && at <= end
        {
            self.slave.handle_timeout(at);
        }
        self.now = end;
        self.slave.handle_sent(end);
        let again = self.slave.poll_transmit(end, &mut buf);
        assert_eq!(again, None, "a slave answered twice");
    }

    fn hear(&mut self, octets: &[u8]) {
        if octets.is_empty() {
            return;
        }
        // The first character comes alone, the rest when it ended.
        self.advance(BAUD.characters(1));
        self.told(&octets[..1]);
        if octets.len() > 1 {
            self.advance(BAUD.characters(octets.len() - 1));
            self.told(&octets[1..]);
        }
    }

    fn told(&mut self, octets: &[u8]) {
        self.heard = self.now;
        self.owed = true;
        self.slave.handle_octets(self.now, octets);
        self.transmit();
    }

    fn hear_error(&mut self, error: LineError) {
        self.advance(BAUD.characters(1));
        self.heard = self.now;
        self.slave.handle_line_error(self.now, error);
        self.transmit();
    }

    fn request(&mut self, header: Header, data: &[u8]) {
        let mut buf = [0; MAX_TELEGRAM];
        if let Ok(length) = (Telegram::Data { header, data }).encode(&mut buf) {
            self.hear(&buf[..length]);
        }
    }

    /// Asks as a master does that counts nothing, and returns the answer.
    fn ask(&mut self, master: Address, dsap: Option<u8>, data: &[u8]) -> Vec<u8> {
        self.ask_from(master, dsap.map(|dsap| (dsap, sap::MASTER)), data)
    }

    fn ask_from(&mut self, master: Address, saps: Option<(u8, u8)>, data: &[u8]) -> Vec<u8> {
        let fc = FunctionCode::request(Fcb::First, RequestFunction::SrdHigh);
        let mut header = Header::new(self.slave.address(), master, fc);
        if let Some((dsap, ssap)) = saps {
            header = header.with_saps(dsap, ssap);
        }
        self.advance(BAUD.duration(BitTimes(75)));
        self.last_reply.clear();
        self.request(header, data);
        self.advance(BAUD.duration(BitTimes(1200)));
        self.last_reply.clone()
    }

    fn start_up(&mut self, master: Address, depth: u8, watchdog: bool) {
        let status = if watchdog { 0xB8 } else { 0xB0 };
        if depth > 0 {
            // DPV1_Enable, all alarms, at most two of a kind at a time; a DP-V0 slave takes them for parameters of its own.
            let prm = [status, 5, 1, 11, 0x00, 0xDA, 0x01, 0x80, 0xFC, 0x01];
            self.ask(master, Some(sap::SET_PRM), &prm);
        }
        if depth > 1 {
            self.ask(master, Some(sap::CHK_CFG), CONFIGURATION);
        }
        if depth > 2 {
            self.ask(master, None, &[1, 2]);
        }
    }

    fn check(&self) {
        let slave = &self.slave;
        let lengths = slave.lengths();
        assert!(lengths.inputs <= 244 && lengths.outputs <= 244);
        assert!(slave.user_prm().len() <= 237 && slave.configuration().len() <= 244);
        let status = slave.diagnosis().status;
        match slave.phase() {
            SlavePhase::WaitPrm => {
                assert!(status.contains(StationStatus::PRM_REQ));
                assert_eq!(slave.master(), None, "owned, and waits for parameters");
            }
            SlavePhase::WaitCfg => assert!(slave.master().is_some()),
            SlavePhase::DataExchange => {
                assert!(slave.master().is_some());
                assert_eq!(slave.outputs().len(), lengths.outputs);
                assert!(!status.intersects(StationStatus::STATION_NOT_READY.with(StationStatus::PRM_REQ)));
                if slave.watchdog().is_some() {
                    assert!(slave.poll_timeout().is_some(), "a watchdog that does not run");
                }
            }
        }
        assert!(slave.waiting_alarms() <= MAX_ALARMS);
        assert!(
            slave.poll_timeout().is_none_or(|at| at > self.now),
            "a timeout was forgotten"
        );
    }
}

fn slave(settings: u8) -> DpSlave {
    let mut identity = SlaveIdentity::new(
        Address::new(3).unwrap(),
        IDENT,
        BAUD,
        AcceptedConfigurations::Table(CONFIGURATIONS),
    );
    if settings & 1 != 0 {
        identity.latency_allowance = Duration::from_millis(20);
    }
    if settings & 2 != 0 {
        identity.address_change = AddressChange::Allowed;
    }
    if settings & 4 != 0 {
        identity.outputs_on_leave = OutputsOnLeave::Hold;
    }
    if settings & 0x80 != 0 {
        identity.v1 = V1Capabilities {
            c1_read_write: Support::Supported,
            alarms: AlarmTypes::ALL,
            watchdog_1ms: Support::Supported,
            c2_connections: 2,
            ..V1Capabilities::NONE
        };
    }
    if settings & 8 != 0 {
        identity.sync = Support::Unsupported;
        identity.min_tsdr = 60;
    }
    DpSlave::new(identity).unwrap()
}

/// A telegram with a right check sum, and anything inside.
fn telegram(input: &mut Input<'_>, own: Address) -> Option<(Header, Vec<u8>)> {
    const FUNCTIONS: [u8; 8] = [0x4C, 0x5C, 0x7C, 0x6D, 0x5D, 0x7D, 0x46, 0x49];
    let choice = input.octet();
    let da = match choice & 3 {
        0 => Address::BROADCAST,
        1 => Address::new(input.octet() & 0x7F).ok()?,
        _ => own,
    };
    let sa = Address::new(if choice & 4 == 0 { 2 } else { input.octet() & 0x7F }).ok()?;
    let fc = match choice >> 4 {
        known @ 0..8 => FUNCTIONS[usize::from(known)],
        8..14 => FUNCTIONS[5],
        _ => input.octet(),
    };
    let mut header = Header::new(da, sa, FunctionCode::from_octet(fc));
    if choice & 8 == 0 {
        let dsap = input.octet() & 63;
        header = header.with_saps(
            dsap,
            if dsap & 63 < 55 {
                input.octet() & 63
            } else {
                sap::MASTER
            },
        );
    }
    Some((header, input.octets().to_vec()))
}

/// An acyclic request, or a poll when nothing follows.
fn acyclic(input: &mut Input<'_>, own: Address) -> Option<(Header, Vec<u8>)> {
    const FUNCTIONS: [u8; 8] = [0x5E, 0x5F, 0x5C, 0x57, 0x51, 0x58, 0x48, 0xDE];
    const FCS: [u8; 4] = [0x6D, 0x5C, 0x7C, 0x4C];
    let choice = input.octet();
    let sa = Address::new(if choice & 0x80 == 0 { 2 } else { input.octet() & 0x7F }).ok()?;
    let (dsap, ssap) = match choice & 7 {
        0 | 1 => (51, 51),
        2 => (50, 51),
        3 | 4 => (49, 50),
        low => (low - 5, 50),
    };
    let fc = FunctionCode::from_octet(FCS[usize::from(choice >> 5 & 3)]);
    let header = Header::new(own, sa, fc).with_saps(dsap, ssap);
    let mut pdu = Vec::new();
    if choice & 0x18 != 0 {
        pdu.push(FUNCTIONS[usize::from(input.below(8))]);
        pdu.extend(input.octets());
    }
    Some((header, pdu))
}

/// What the application of a DP-V1 slave does.
fn application(bench: &mut Bench, input: &mut Input<'_>) {
    while let Some(request) = bench.slave.poll_v1_request() {
        bench.open.push(request.id);
    }
    match input.below(6) {
        0 | 1 => {
            if let Some(id) = bench.open.pop() {
                let data = input.octets();
                let _ = bench.slave.respond_v1(bench.now, id, Ok(data));
                let again = bench.slave.respond_v1(bench.now, id, Ok(data));
                assert!(again.is_err(), "a request was answered twice");
            }
        }
        2 => {
            if let Some(id) = bench.open.pop() {
                let error = V1Error::new(ErrorCode1(input.octet())).with_detail(input.octet());
                let _ = bench.slave.respond_v1(bench.now, id, Err(error));
            }
        }
        3 => {
            let abort = Abort::user(input.octet() & 15);
            bench.slave.abort_connection(bench.now, input.below(4), abort);
        }
        4 => {
            let (kind, slot) = (AlarmType(input.octet()), input.octet());
            let (incident, add_ack) = match input.below(2) {
                0 => (Incident::Appears, AddAck::NotNeeded),
                _ => (Incident::Disappears, AddAck::Needed),
            };
            let data = input.octets();
            let _ = bench.slave.send_alarm((kind, slot), incident, add_ack, data);
        }
        _ => bench.open.clear(),
    }
    bench.transmit();
}

pub(crate) fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let settings = input.octet();
    let master = Address::new(2).unwrap();
    let mut bench = Bench::new(slave(settings));
    bench.advance(Duration::from_millis(1));
    bench.start_up(master, settings >> 4 & 3, settings & 64 != 0);
    bench.check();

    while !input.is_empty() {
        match input.below(16) {
            0 => {
                let octets = input.octets();
                bench.hear(octets);
            }
            12 | 13 => {
                if let Some((header, data)) = acyclic(&mut input, bench.slave.address()) {
                    bench.request(header, &data);
                    bench.advance(BAUD.duration(BitTimes(75)));
                }
            }
            14 | 15 => application(&mut bench, &mut input),
            1 | 2 => {
                if let Some((header, data)) = telegram(&mut input, bench.slave.address()) {
                    bench.request(header, &data);
                }
            }
            3 => {
                let error = if input.below(2) == 0 {
                    LineError::Parity
                } else {
                    LineError::Framing
                };
                bench.hear_error(error);
            }
            4 => bench.advance(BAUD.duration(BitTimes(u32::from(input.octet())))),
            5 => bench.advance(Duration::from_millis(u64::from(input.octet()))),
            6 => {
                let octets = input.octets();
                bench.slave.set_inputs(octets);
                bench.transmit();
            }
            7 => {
                let kind = if input.below(2) == 0 {
                    ExtDiag::Fault
                } else {
                    ExtDiag::Message
                };
                let octets = input.octets();
                let taken = bench.slave.set_ext_diag(kind, octets, Overflow::Complete);
                let whole = Blocks::new(octets).all(|block| !matches!(block, Block::Malformed { .. }));
                assert_eq!(taken.is_ok(), whole && octets.len() <= 238);
                bench.transmit();
            }
            8 => while bench.slave.poll_event().is_some() {},
            // The owner goes on as it should.
            9 => {
                let outputs = vec![input.octet(); bench.slave.lengths().outputs];
                let owner = bench.slave.master().unwrap_or(master);
                bench.ask(owner, None, &outputs);
            }
            10 => {
                let depth = input.below(4);
                bench.start_up(master, depth, true);
            }
            // Cut off in the middle.
            _ => {
                let mut buf = [0; MAX_TELEGRAM];
                let Some((header, data)) = telegram(&mut input, bench.slave.address()) else {
                    continue;
                };
                if let Ok(length) = (Telegram::Data { header, data: &data }).encode(&mut buf) {
                    let kept = usize::from(input.octet()) % length;
                    bench.hear(&buf[..kept]);
                }
            }
        }
        bench.check();
    }

    // Whatever happened: after a silence its owner can release it, and then it starts up and exchanges data.
    bench.advance(Duration::from_millis(200));
    let own = bench.slave.address();
    let free = if own == master {
        Address::new(1).unwrap()
    } else {
        master
    };
    let owner = bench.slave.master().unwrap_or(free);
    assert_eq!(
        bench.ask(owner, Some(sap::SET_PRM), &[0x40, 1, 1, 11, 0x00, 0xDA, 0]),
        [0xE5]
    );
    assert_eq!(bench.slave.master(), None);
    let prm = [0x80, 1, 1, 11, 0x00, 0xDA, 0, 0x80, 0x00, 0x00];
    assert_eq!(bench.ask(free, Some(sap::SET_PRM), &prm), [0xE5]);
    assert_eq!(bench.ask(free, Some(sap::CHK_CFG), CONFIGURATION), [0xE5]);
    bench.slave.set_inputs(&[0xAB, 0xCD]);
    let answer = bench.ask(free, None, &[0x12, 0x34]);
    assert_eq!(bench.slave.outputs(), [0x12, 0x34]);
    let Ok((Telegram::Data { header, data }, _)) = decode_one(&answer) else {
        panic!("no inputs: {answer:02X?}");
    };
    assert_eq!((header.sa, header.da, data), (own, free, &[0xAB, 0xCD][..]));
    bench.check();
    if settings & 0x80 != 0 {
        read_a_record(&mut bench, free);
    }
}

/// Over MSAC1, which data exchange has opened.
fn read_a_record(bench: &mut Bench, master: Address) {
    while bench.slave.poll_v1_request().is_some() {}
    let saps = Some((sap::MSAC1, sap::MSAC1));
    assert_eq!(bench.ask_from(master, saps, &[0x5E, 1, 47, 240]), [0xE5]);
    let request = bench.slave.poll_v1_request().unwrap();
    bench
        .slave
        .respond_v1(bench.now, request.id, Ok(&[0xCA, 0xFE]))
        .unwrap();
    let answer = bench.ask_from(master, saps, &[]);
    let Ok((Telegram::Data { data, .. }, _)) = decode_one(&answer) else {
        panic!("no record: {answer:02X?}");
    };
    assert_eq!(data, [0x5E, 1, 47, 2, 0xCA, 0xFE]);
    bench.check();
}
