//! A slave alone, asked telegram by telegram.

use dp_master::address::Address;
use dp_master::dp::{DpSlave, SetPrm, SlaveEvent, SlaveIdentity, SlavePhase, sap};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, Telegram, decode_one};

use super::slave_identity;

pub(crate) const BAUD: Baud = Baud::B1500000;

/// A slave alone, asked directly.
pub(crate) struct Bench {
    pub(crate) slave: DpSlave,
    pub(crate) now: Instant,
}

/// A reply as octets; empty when there was none.
pub(crate) type Reply = Vec<u8>;

impl Bench {
    pub(crate) fn new() -> Self {
        Self::with_identity(slave_identity(BAUD))
    }

    pub(crate) fn with_identity(identity: SlaveIdentity) -> Self {
        Self {
            slave: DpSlave::new(identity).unwrap(),
            now: Instant::ZERO,
        }
    }

    /// Set_Prm and Chk_Cfg by a master.
    pub(crate) fn owned_by(master: u8) -> Self {
        let mut bench = Self::new();
        assert_eq!(bench.set_prm(master, 0x80, Fcb::First), [0xE5]);
        assert_eq!(bench.ask(master, Some(sap::CHK_CFG), Fcb::Low, &[0xF3]), [0xE5]);
        assert_eq!(bench.slave.phase(), SlavePhase::DataExchange);
        bench
    }

    pub(crate) fn events(&mut self) -> Vec<SlaveEvent> {
        std::iter::from_fn(|| self.slave.poll_event()).collect()
    }

    pub(crate) fn set_prm(&mut self, master: u8, station_status: u8, fcb: Fcb) -> Reply {
        let prm = SetPrm {
            station_status,
            wd_fact_1: 0,
            wd_fact_2: 0,
            min_tsdr: 11,
            ident: 0x00DA,
            group: 0,
            user: &[],
        };
        let mut data = [0; 7];
        let len = prm.encode(&mut data).unwrap();
        self.ask(master, Some(sap::SET_PRM), fcb, &data[..len])
    }

    pub(crate) fn ask(&mut self, master: u8, dsap: Option<u8>, fcb: Fcb, data: &[u8]) -> Reply {
        self.ask_as(master, dsap, fcb, RequestFunction::SrdHigh, data)
    }

    pub(crate) fn ask_as(
        &mut self,
        master: u8,
        dsap: Option<u8>,
        fcb: Fcb,
        function: RequestFunction,
        data: &[u8],
    ) -> Reply {
        let master = Address::new(master).unwrap();
        let mut header = Header::new(self.slave.address(), master, FunctionCode::request(fcb, function));
        if let Some(dsap) = dsap {
            header = header.with_saps(dsap, sap::MASTER);
        }
        let mut buf = [0; MAX_TELEGRAM];
        let len = Telegram::Data { header, data }.encode(&mut buf).unwrap();
        self.hear(&buf[..len])
    }

    pub(crate) fn hear(&mut self, octets: &[u8]) -> Reply {
        // Tsyn and the characters.
        self.now += Duration::from_micros(100) + BAUD.characters(octets.len());
        self.slave.handle_octets(self.now, octets);
        let mut buf = [0; MAX_TELEGRAM];
        assert_eq!(self.slave.poll_transmit(self.now, &mut buf), None, "min Tsdr");
        let Some(due) = self.slave.poll_timeout() else {
            return Vec::new();
        };
        self.now = due;
        self.slave.handle_timeout(due);
        let reply = match self.slave.poll_transmit(due, &mut buf) {
            Some(len) => buf[..len].to_vec(),
            None => Vec::new(),
        };
        self.now += BAUD.characters(reply.len());
        self.slave.handle_sent(self.now);
        reply
    }
}

pub(crate) fn response(reply: &[u8]) -> ResponseFunction {
    match decode_one(reply) {
        Ok((Telegram::Data { header, .. }, _)) => match header.fc {
            FunctionCode::Response { function, .. } => function,
            FunctionCode::Request { .. } => panic!("a request"),
        },
        other => panic!("{other:?}"),
    }
}
