//! Slaves that cost next to nothing: their answers lie ready.

use dp_master::address::Address;
use dp_master::station::MAX_TELEGRAM;
use dp_master::wire::{
    Decoded, Decoder, FunctionCode, Header, RequestFunction, ResponseFunction, SC, StationType, Telegram,
};

/// Address of the master under test.
pub(crate) const MASTER: u8 = 2;
/// Address of the first slave; the others follow.
pub(crate) const FIRST_SLAVE: u8 = 3;
/// Ident number of every slave.
pub(crate) const IDENT: u16 = 0x00DA;
/// 16 octets in, 16 octets out.
pub(crate) const IDENTIFIERS: [u8; 2] = [0xF3, 0xF3];
/// Octets of each image.
pub(crate) const IMAGE: usize = 16;

/// Slaves at the addresses from [`FIRST_SLAVE`] on, 16 octets each way, as one function from request to answer.
///
/// In data exchange an answer is found by the address and nothing is computed, so that a bench sees the master alone.
/// Start-up services are looked at properly.
#[derive(Debug)]
pub(crate) struct CannedSlaves {
    slaves: Vec<Slave>,
}

#[derive(Debug)]
struct Slave {
    configured: bool,
    exchange: Vec<u8>,
    status: Vec<u8>,
    diagnosis: [Vec<u8>; 2],
}

/// The slave's access points (IEC 61158-6-3): diagnosis, parameters, configuration; 62 is the master's.
const SLAVE_DIAG: u8 = 60;
const SET_PRM: u8 = 61;
const CHK_CFG: u8 = 62;
const MASTER_SAP: u8 = 62;

impl CannedSlaves {
    /// So many slaves after power-up.
    ///
    /// # Panics
    /// When their addresses would go above 126.
    pub(crate) fn new(count: u8) -> Self {
        let slaves = (FIRST_SLAVE..FIRST_SLAVE + count).map(Slave::new).collect();
        CannedSlaves { slaves }
    }

    /// The answer to a request, if it gets one.
    #[inline]
    pub(crate) fn answer(&mut self, request: &[u8]) -> Option<&[u8]> {
        match *request {
            // SD2 with 16 octets and no access points is Data_Exchange; DA is the fifth octet.
            [0x68, 0x13, _, _, da, ..] if da & 0x80 == 0 => {
                let slave = self.slaves.get(usize::from(da.checked_sub(FIRST_SLAVE)?))?;
                Some(&slave.exchange)
            }
            // The token.
            [0xDC, ..] => None,
            _ => self.answer_other(request),
        }
    }

    fn answer_other(&mut self, request: &[u8]) -> Option<&[u8]> {
        let mut found = None;
        Decoder::new().push(request, |decoded| {
            if let Decoded::Telegram(Telegram::Data { header, .. }) = decoded {
                found = Some(header);
            }
        });
        let header = found?;
        let FunctionCode::Request { function, .. } = header.fc else {
            return None;
        };
        let slave = self
            .slaves
            .get_mut(usize::from(header.da.value().checked_sub(FIRST_SLAVE)?))?;
        match (function, header.dsap) {
            (RequestFunction::FdlStatus, None) => Some(&slave.status),
            (_, Some(SLAVE_DIAG)) => Some(&slave.diagnosis[usize::from(slave.configured)]),
            (_, Some(SET_PRM)) => Some(&[SC]),
            (_, Some(CHK_CFG)) => {
                slave.configured = true;
                Some(&[SC])
            }
            _ => None,
        }
    }
}

impl Slave {
    fn new(address: u8) -> Self {
        let station = |value| Address::new(value).unwrap_or_else(|error| panic!("{error}"));
        let header = |function| {
            let fc = FunctionCode::response(StationType::Slave, function);
            Header::new(station(MASTER), station(address), fc)
        };
        let data_low = header(ResponseFunction::DataLow);
        let [high, low] = IDENT.to_be_bytes();
        // Not ready and parameters wanted, or ready and locked to the master; second octet: bit 2 is always 1.
        let diagnosis = [
            [0x02, 0x05, 0x00, 0xFF, high, low],
            [0x00, 0x04, 0x00, MASTER, high, low],
        ];
        Slave {
            configured: false,
            exchange: octets(data_low, &[address; IMAGE]),
            status: octets(header(ResponseFunction::Ok), &[]),
            diagnosis: diagnosis.map(|data| octets(data_low.with_saps(MASTER_SAP, SLAVE_DIAG), &data)),
        }
    }
}

fn octets(header: Header, data: &[u8]) -> Vec<u8> {
    let mut buf = [0; MAX_TELEGRAM];
    let length = Telegram::Data { header, data }.encode_without_sd3(&mut buf);
    buf[..length.unwrap_or_else(|error| panic!("{error}"))].to_vec()
}
