//! A module with its drive before a master whose telegrams are made one by one.
#![allow(dead_code, reason = "every test file uses its own part of this")]
#![allow(
    clippy::unwrap_used,
    reason = "clippy allows it in test functions only, not in their helpers"
)]

use dp_master::address::Address;
use dp_master::dp::{SetPrm, SlavePhase, sap};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, Telegram, decode_one};
use lenze9300_model::TICKS_PER_MS;
use lenze9300_model::bus::dp::{Emf2133, Emf2133Config, IDENT};
use lenze9300_model::device::{Drive, DriveConfig};

const MASTER: u8 = 2;
const MILLISECOND: Duration = Duration::from_millis(1);

/// Station status of Set_Prm (IEC 61158-6-3): lock, unlock, sync, freeze, watchdog.
pub(crate) const LOCK: u8 = 0x80;
pub(crate) const UNLOCK: u8 = 0x40;
pub(crate) const SYNC: u8 = 0x20;
pub(crate) const FREEZE: u8 = 0x10;
pub(crate) const WD_ON: u8 = 0x08;

/// What came back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Reply {
    Nothing,
    ShortAck,
    Data { function: ResponseFunction, data: Vec<u8> },
}

pub(crate) struct Bench {
    pub(crate) module: Emf2133,
    pub(crate) drive: Drive,
    baud: Baud,
    fcb: Fcb,
    now: Instant,
    /// When the present millisecond of drive and module began.
    ms_begin: Instant,
    /// Between the request and the reply that came last.
    pub(crate) reply_after: Duration,
}

impl Bench {
    pub(crate) fn new(module: Emf2133Config, drive: DriveConfig) -> Self {
        Self::at(Baud::B12000000, module, drive)
    }

    pub(crate) fn at(baud: Baud, module: Emf2133Config, drive: DriveConfig) -> Self {
        Self {
            module: Emf2133::new(module, baud).unwrap(),
            drive: Drive::new(drive),
            baud,
            fcb: Fcb::First,
            now: Instant::ZERO,
            ms_begin: Instant::ZERO,
            reply_after: Duration::ZERO,
        }
    }

    /// A request to an access point, with the next frame count bit; the data unit of its reply.
    pub(crate) fn ask(&mut self, dsap: Option<u8>, data: &[u8]) -> Reply {
        let [slave, master] = [3, MASTER].map(|address| Address::new(address).unwrap());
        let fc = FunctionCode::request(self.fcb, RequestFunction::SrdHigh);
        self.fcb = self.fcb.next();
        let header = match dsap {
            Some(dsap) => Header::new(slave, master, fc).with_saps(dsap, sap::MASTER),
            None => Header::new(slave, master, fc),
        };
        let mut octets = [0; MAX_TELEGRAM];
        let len = Telegram::Data { header, data }.encode(&mut octets).unwrap();
        // 33 tBIT of silence and the characters.
        self.now += self.baud.characters(len + 3);
        self.module.handle_octets(self.now, &octets[..len]);
        let Some(due) = self.module.poll_timeout() else {
            return Reply::Nothing;
        };
        self.module.handle_timeout(due);
        let Some(len) = self.module.poll_transmit(due, &mut octets) else {
            return Reply::Nothing;
        };
        self.reply_after = due - self.now;
        self.now = due + self.baud.characters(len);
        self.module.handle_sent(self.now);
        match decode_one(&octets[..len]).unwrap() {
            (Telegram::ShortAck, _) => Reply::ShortAck,
            (Telegram::Data { header, data }, _) => match header.fc {
                FunctionCode::Response { function, .. } => Reply::Data {
                    function,
                    data: data.to_vec(),
                },
                FunctionCode::Request { .. } => panic!("a slave does not ask"),
            },
            (Telegram::Token { .. }, _) => panic!("a slave has no token"),
        }
    }

    /// Set_Prm; `watchdog` in milliseconds, a multiple of 10 up to 2550.
    pub(crate) fn set_prm(&mut self, station_status: u8, watchdog: Option<u16>, user: &[u8]) {
        let prm = SetPrm {
            station_status: station_status | if watchdog.is_some() { WD_ON } else { 0 },
            wd_fact_1: 1,
            wd_fact_2: watchdog.map_or(1, |ms| u8::try_from(ms / 10).unwrap()),
            min_tsdr: 11,
            ident: IDENT,
            group: 0,
            user,
        };
        let mut data = [0; 244];
        let len = prm.encode(&mut data).unwrap();
        assert_eq!(self.ask(Some(sap::SET_PRM), &data[..len]), Reply::ShortAck);
    }

    /// Whether the module goes to data exchange with these identifiers.
    pub(crate) fn accepts(&mut self, identifiers: &[u8]) -> bool {
        self.set_prm(LOCK, None, &[]);
        assert_eq!(self.module.slave().phase(), SlavePhase::WaitCfg);
        assert_eq!(self.ask(Some(sap::CHK_CFG), identifiers), Reply::ShortAck);
        self.module.slave().phase() == SlavePhase::DataExchange
    }

    /// From power-up to data exchange.
    pub(crate) fn start_up(&mut self, identifiers: &[u8], watchdog: Option<u16>) {
        self.set_prm(LOCK, watchdog, &[]);
        assert_eq!(self.ask(Some(sap::CHK_CFG), identifiers), Reply::ShortAck);
        assert_eq!(self.module.slave().phase(), SlavePhase::DataExchange);
    }

    /// Data_Exchange: outputs there, inputs back.
    pub(crate) fn exchange(&mut self, outputs: &[u8]) -> Vec<u8> {
        match self.ask(None, outputs) {
            Reply::Data { data, .. } => data,
            other => panic!("{other:?}"),
        }
    }

    /// Slave_Diag.
    pub(crate) fn diagnosis(&mut self) -> Vec<u8> {
        match self.ask(Some(sap::SLAVE_DIAG), &[]) {
            Reply::Data { data, .. } => data,
            other => panic!("{other:?}"),
        }
    }

    /// One millisecond of module and drive without a word on the bus.
    pub(crate) fn step(&mut self) {
        self.module.cycle_1ms(&mut self.drive);
        for _ in 0..TICKS_PER_MS {
            self.drive.tick();
        }
        self.ms_begin += MILLISECOND;
        assert!(self.now <= self.ms_begin, "too many telegrams in one millisecond");
        self.now = self.ms_begin;
        while let Some(due) = self.module.poll_timeout().filter(|due| *due <= self.now) {
            self.module.handle_timeout(due);
        }
    }

    pub(crate) fn steps(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.step();
        }
    }

    /// So many milliseconds with an exchange at the beginning of each; the inputs of the last one.
    pub(crate) fn exchange_for(&mut self, outputs: &[u8], milliseconds: u32) -> Vec<u8> {
        let mut inputs = Vec::new();
        for _ in 0..milliseconds {
            inputs = self.exchange(outputs);
            self.step();
        }
        inputs
    }
}
