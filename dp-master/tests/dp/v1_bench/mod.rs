//! A DP-V1 slave alone, asked by masters whose telegrams are made one by one.

use std::collections::BTreeMap;

use dp_master::address::Address;
use dp_master::dp::v1::{AlarmTypes, V1Capabilities, V1Request};
use dp_master::dp::{AcceptedConfigurations, DpSlave, SetPrm, SlaveEvent, SlaveIdentity, SlavePhase, Support, sap};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};
use dp_master::wire::{Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, Telegram, decode_one};

pub(crate) const BAUD: Baud = Baud::B1500000;
/// The master that parametrises.
pub(crate) const OWNER: u8 = 2;
/// Masters of class 2.
pub(crate) const TOOL: u8 = 1;
pub(crate) const SECOND_TOOL: u8 = 4;
/// The access point of the first connection.
pub(crate) const FIRST: u8 = 48;

/// An Initiate with Send_Timeout 1 s (100 × 10 ms), straight to the device.
pub(crate) const INITIATE: [u8; 20] = [
    0x57, 0, 0, 0, 0x00, 0x64, 0x01, 0x00, 0, 0, 0, 0, 0, 2, 0, 2, 0, 0, 0, 0,
];

/// What came back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Reply {
    Nothing,
    Ack,
    /// With low priority.
    Data(Vec<u8>),
    /// With high priority: there is diagnosis.
    High(Vec<u8>),
    Refused(ResponseFunction),
}

pub(crate) const RS: Reply = Reply::Refused(ResponseFunction::NoService);
pub(crate) const RR: Reply = Reply::Refused(ResponseFunction::NoResource);

pub(crate) fn data(octets: &[u8]) -> Reply {
    Reply::Data(octets.to_vec())
}

/// Everything a slave can have, two connections.
pub(crate) fn capabilities() -> V1Capabilities {
    V1Capabilities {
        c1_read_write: Support::Supported,
        alarms: AlarmTypes::ALL,
        watchdog_1ms: Support::Supported,
        c2_connections: 2,
        profile_ident: 0x3B00,
        ..V1Capabilities::NONE
    }
}

pub(crate) struct Bench {
    pub(crate) slave: DpSlave,
    pub(crate) now: Instant,
    fcb: BTreeMap<u8, Fcb>,
    last: Vec<u8>,
}

impl Bench {
    pub(crate) fn new(v1: V1Capabilities) -> Self {
        let address = Address::new(3).unwrap();
        let accepted = AcceptedConfigurations::Table(&[&[0x20], &[0x10]]);
        let identity = SlaveIdentity {
            v1,
            ..SlaveIdentity::new(address, 0x00DA, BAUD, accepted)
        };
        Self {
            slave: DpSlave::new(identity).unwrap(),
            now: Instant::ZERO,
            fcb: BTreeMap::new(),
            last: Vec::new(),
        }
    }

    /// In data exchange with these user parameters.
    pub(crate) fn exchanging(v1: V1Capabilities, user: &[u8]) -> Self {
        let mut bench = Self::new(v1);
        bench.start_up(user);
        bench
    }

    /// Set_Prm (no watchdog) and Chk_Cfg of the owner.
    pub(crate) fn start_up(&mut self, user: &[u8]) {
        assert_eq!(self.set_prm(0x80, [0, 0], user), Reply::Ack);
        assert_eq!(self.ask(OWNER, sap::CHK_CFG, sap::MASTER, &[0x20]), Reply::Ack);
        assert_eq!(self.slave.phase(), SlavePhase::DataExchange);
        self.events();
    }

    pub(crate) fn set_prm(&mut self, station_status: u8, factors: [u8; 2], user: &[u8]) -> Reply {
        let prm = SetPrm {
            station_status,
            wd_fact_1: factors[0],
            wd_fact_2: factors[1],
            min_tsdr: 11,
            ident: 0x00DA,
            group: 0,
            user,
        };
        let mut data = [0; 244];
        let len = prm.encode(&mut data).unwrap();
        self.ask(OWNER, sap::SET_PRM, sap::MASTER, &data[..len])
    }

    /// A new SRD of low priority between two access points, with the next frame count bit of that master.
    pub(crate) fn ask(&mut self, master: u8, dsap: u8, ssap: u8, data: &[u8]) -> Reply {
        self.srd(master, Some((dsap, ssap)), data)
    }

    /// Data_Exchange of the owner.
    pub(crate) fn exchange(&mut self, outputs: &[u8]) -> Reply {
        self.srd(OWNER, None, outputs)
    }

    /// Slave_Diag of a master.
    pub(crate) fn diagnosis(&mut self, master: u8) -> Vec<u8> {
        match self.ask(master, sap::SLAVE_DIAG, sap::MASTER, &[]) {
            Reply::Data(data) => data,
            other => panic!("{other:?}"),
        }
    }

    /// A request or poll at MSAC1.
    pub(crate) fn c1(&mut self, data: &[u8]) -> Reply {
        self.ask(OWNER, sap::MSAC1, sap::MSAC1, data)
    }

    /// A request or poll at a connection of [`TOOL`].
    pub(crate) fn c2(&mut self, sap: u8, data: &[u8]) -> Reply {
        self.ask(TOOL, sap, sap::MSAC2_MASTER, data)
    }

    fn srd(&mut self, master: u8, saps: Option<(u8, u8)>, data: &[u8]) -> Reply {
        let fcb = self.fcb.entry(master).or_insert(Fcb::First);
        let fc = FunctionCode::request(*fcb, RequestFunction::SrdLow);
        *fcb = fcb.next();
        let [da, sa] = [3, master].map(|address| Address::new(address).unwrap());
        let mut header = Header::new(da, sa, fc);
        if let Some((dsap, ssap)) = saps {
            header = header.with_saps(dsap, ssap);
        }
        let mut octets = [0; MAX_TELEGRAM];
        let len = Telegram::Data { header, data }.encode(&mut octets).unwrap();
        self.last = octets[..len].to_vec();
        self.send_again()
    }

    /// The last telegram once more: its answer was lost.
    pub(crate) fn send_again(&mut self) -> Reply {
        let octets = self.last.clone();
        // 33 tBIT of silence and the characters.
        self.wait_until(self.now + BAUD.characters(octets.len() + 3));
        self.slave.handle_octets(self.now, &octets);
        let mut reply = [0; MAX_TELEGRAM];
        // Other deadlines than the reply's lie at least 1 ms ahead in these tests. Set_Prm can make min Tsdr 255 tBIT, which are 170 µs.
        let limit = self.now + Duration::from_micros(200);
        let Some(due) = self.slave.poll_timeout().filter(|due| *due < limit) else {
            return Reply::Nothing;
        };
        self.slave.handle_timeout(due);
        let Some(len) = self.slave.poll_transmit(due, &mut reply) else {
            return Reply::Nothing;
        };
        self.now = due + BAUD.characters(len);
        self.slave.handle_sent(self.now);
        match decode_one(&reply[..len]).unwrap() {
            (Telegram::ShortAck, _) => Reply::Ack,
            (Telegram::Data { header, data }, _) => match header.fc {
                FunctionCode::Response { function, .. } => match function {
                    ResponseFunction::DataLow => Reply::Data(data.to_vec()),
                    ResponseFunction::DataHigh => Reply::High(data.to_vec()),
                    other => Reply::Refused(other),
                },
                FunctionCode::Request { .. } => panic!("a slave does not ask"),
            },
            (Telegram::Token { .. }, _) => panic!("a slave has no token"),
        }
    }

    /// Serves every deadline up to `end`; none may come back at its own moment.
    pub(crate) fn wait_until(&mut self, end: Instant) {
        while let Some(due) = self.slave.poll_timeout().filter(|due| *due <= end) {
            self.slave.handle_timeout(due);
            assert!(
                self.slave.poll_timeout().is_none_or(|next| next > due),
                "a deadline that has passed"
            );
        }
        self.now = self.now.max(end);
    }

    pub(crate) fn wait(&mut self, milliseconds: u64) {
        self.wait_until(self.now + Duration::from_millis(milliseconds));
    }

    pub(crate) fn events(&mut self) -> Vec<SlaveEvent> {
        std::iter::from_fn(|| self.slave.poll_event()).collect()
    }

    /// The request the application is asked now.
    pub(crate) fn request(&mut self) -> V1Request {
        self.slave.poll_v1_request().unwrap()
    }

    /// A connection of [`TOOL`], open, its Initiate response fetched.
    pub(crate) fn open(&mut self) -> u8 {
        self.open_for(TOOL)
    }

    pub(crate) fn open_for(&mut self, master: u8) -> u8 {
        let Reply::Data(resource) = self.ask(master, sap::MSAC2_MANAGER, sap::MSAC2_MASTER, &INITIATE) else {
            panic!("no connection");
        };
        let sap = resource[1];
        assert!(matches!(self.ask(master, sap, sap::MSAC2_MASTER, &[]), Reply::Data(_)));
        self.events();
        sap
    }
}
