//! A station that answers what a test tells it to, however wrong.

use dp_master::address::Address;
use dp_master::dp::sap;
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, BitTimes, Instant};
use dp_master::wire::{
    DecodeError, Fcb, FunctionCode, Header, RequestFunction, ResponseFunction, StationType, Telegram, decode_one,
};

/// What a puppet answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Says {
    ShortAck,
    Data(ResponseFunction, Vec<u8>),
    Nothing,
}

/// The answer to the n-th request (from 0) with this DSAP and data.
pub(crate) type Script = Box<dyn FnMut(usize, Option<u8>, &[u8]) -> Says>;

pub(crate) struct Puppet {
    address: Address,
    baud: Baud,
    script: Script,
    asked: usize,
    /// The bit of the last request and its reply, where the bit alone makes a repetition.
    bit_memory: Option<Option<(Fcb, Vec<u8>)>>,
    heard: Vec<u8>,
    reply: Option<(Instant, Vec<u8>)>,
}

impl Puppet {
    pub(crate) fn new(address: Address, baud: Baud, script: Script) -> Self {
        Self {
            address,
            baud,
            script,
            asked: 0,
            bit_memory: None,
            heard: Vec::new(),
            reply: None,
        }
    }

    /// The same, but it repeats its reply whenever the frame count bit is that of the request before, whatever is
    /// asked: the standard's way, which many a slave takes literally.
    pub(crate) fn looking_at_the_bit_alone(mut self) -> Self {
        self.bit_memory = Some(None);
        self
    }

    /// A slave with ident 00DA and one block of eight octets that accepts everything of master 2; Data_Exchange, from 0
    /// on, is up to the test.
    pub(crate) fn slave(
        address: Address,
        baud: Baud,
        mut exchange: impl FnMut(usize, &[u8]) -> Says + 'static,
    ) -> Self {
        let mut exchanges = 0;
        let mut owner = 0xFF;
        Self::new(
            address,
            baud,
            Box::new(move |_, dsap, data| match dsap {
                Some(sap::SLAVE_DIAG) => {
                    let status: [u8; 3] = if owner == 0xFF {
                        [0x02, 0x05, 0]
                    } else {
                        [0x00, 0x04, 0]
                    };
                    let mut diagnosis = status.to_vec();
                    diagnosis.extend([owner, 0x00, 0xDA]);
                    Says::Data(ResponseFunction::DataLow, diagnosis)
                }
                Some(sap::SET_PRM) => {
                    owner = 2;
                    Says::ShortAck
                }
                Some(sap::CHK_CFG) => Says::ShortAck,
                Some(sap::GET_CFG) => Says::Data(ResponseFunction::DataLow, vec![0xF3]),
                None => {
                    exchanges += 1;
                    exchange(exchanges - 1, data)
                }
                _ => Says::Data(ResponseFunction::NoService, Vec::new()),
            }),
        )
    }
}

fn bit(fcb: Fcb) -> bool {
    matches!(fcb, Fcb::First | Fcb::High)
}

impl Station for Puppet {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.heard.extend(octets);
        let (header, data, len) = match decode_one(&self.heard) {
            Ok((Telegram::Data { header, data }, len)) => (header, data, len),
            Err(DecodeError::Incomplete) => return,
            _ => {
                self.heard.clear();
                return;
            }
        };
        if header.da == self.address && header.fc.is_request() && len == self.heard.len() {
            let FunctionCode::Request { fcb, function } = header.fc else {
                return;
            };
            if let Some(Some((last, reply))) = &self.bit_memory
                && matches!(fcb, Fcb::Low | Fcb::High)
                && bit(fcb) == bit(*last)
            {
                self.reply = Some((now + self.baud.duration(BitTimes(11)), reply.clone()));
                self.heard.clear();
                return;
            }
            let asked = self.asked;
            self.asked += 1;
            let mut buf = [0; MAX_TELEGRAM];
            let says = match function {
                RequestFunction::FdlStatus => Says::Data(ResponseFunction::Ok, Vec::new()),
                _ => (self.script)(asked, header.dsap, data),
            };
            let telegram = match says {
                Says::ShortAck => Some(vec![0xE5]),
                Says::Nothing => None,
                Says::Data(function, data) => {
                    // Without data there is no place for access points.
                    let saps = if data.is_empty() {
                        (None, None)
                    } else {
                        (header.ssap, header.dsap)
                    };
                    let header = Header {
                        da: header.sa,
                        sa: self.address,
                        dsap: saps.0,
                        ssap: saps.1,
                        fc: FunctionCode::response(StationType::Slave, function),
                    };
                    let telegram = Telegram::Data { header, data: &data };
                    let len = telegram.encode_without_sd3(&mut buf).unwrap();
                    Some(buf[..len].to_vec())
                }
            };
            if let (Some(memory), Some(telegram)) = (&mut self.bit_memory, &telegram) {
                *memory = (fcb != Fcb::Inactive).then(|| (fcb, telegram.clone()));
            }
            self.reply = telegram.map(|telegram| (now + self.baud.duration(BitTimes(11)), telegram));
        }
        self.heard.clear();
    }
    fn handle_line_error(&mut self, _now: Instant, _error: LineError) {
        self.heard.clear();
    }
    fn handle_sent(&mut self, _now: Instant) {}
    fn handle_timeout(&mut self, _now: Instant) {}
    fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let (due, reply) = self.reply.as_ref()?;
        if *due > now {
            return None;
        }
        buf[..reply.len()].copy_from_slice(reply);
        let len = reply.len();
        self.reply = None;
        Some(len)
    }
    fn poll_timeout(&self) -> Option<Instant> {
        self.reply.as_ref().map(|(due, _)| *due)
    }
}
