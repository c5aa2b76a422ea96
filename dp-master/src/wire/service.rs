//! Which service of FDL or DP a telegram belongs to.
//!
//! DP recognises its services by the access point on the slave's side: DSAP of a request, SSAP of a response.
//!
//! | slave | master | service |
//! |---|---|---|
//! | default | default | Data_Exchange |
//! | 0…48 | 50 | MSAC2 connection |
//! | 49 | 50 | MSAC2 resource manager |
//! | 50, 51 | 51 | MSAC1 |
//! | 53 | 62 | Ext_Set_Prm |
//! | 54 | 54 | master to master |
//! | 55…62 | 62 | Set_Slave_Add, Rd_Inp, Rd_Outp, Global_Control, Get_Cfg, Slave_Diag, Set_Prm, Chk_Cfg |
//!
//! Source: IEC 61158-6-3 (service access points of DP); IEC 61158-4-3 (FDL services).

use core::fmt;

use super::{FunctionCode, Header, RequestFunction, ResponseFunction, Telegram};
use crate::dp::sap;

/// The service of a telegram, as far as the telegram alone tells.
///
/// A response without access points does not name its service: with data, or as DL or DH, it is taken for [`DataExchange`](Self::DataExchange),
/// OK alone for [`FdlStatus`](Self::FdlStatus), and a negative one is [`Fdl`](Self::Fdl).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Service {
    /// The token is passed.
    Token,
    /// Short acknowledgement.
    ShortAck,
    /// Request of the FDL status, or a station that tells its own.
    FdlStatus,
    /// Ident data of a station.
    Ident,
    /// Status of an access point.
    LsapStatus,
    /// Time event or clock value.
    Clock,
    /// Inputs and outputs; diagnosis announced by high priority.
    DataExchange,
    /// Set_Slave_Add.
    SetSlaveAdd,
    /// Rd_Inp.
    RdInp,
    /// Rd_Outp.
    RdOutp,
    /// Global_Control.
    GlobalControl,
    /// Get_Cfg.
    GetCfg,
    /// Slave_Diag.
    SlaveDiag,
    /// Set_Prm.
    SetPrm,
    /// Ext_Set_Prm (DP-V2).
    ExtSetPrm,
    /// Chk_Cfg.
    ChkCfg,
    /// DP-V1, acyclic, master class 1.
    Msac1,
    /// DP-V1, acyclic, master class 2.
    Msac2,
    /// Between masters.
    MasterMaster,
    /// Anything else that FDL carries.
    Fdl,
}

impl Service {
    /// The service of a telegram.
    #[must_use]
    pub const fn of(telegram: &Telegram<'_>) -> Self {
        match telegram {
            Telegram::Token { .. } => Self::Token,
            Telegram::ShortAck => Self::ShortAck,
            Telegram::Data { header, data } => Self::of_data(header, data.len()),
        }
    }

    const fn of_data(header: &Header, data: usize) -> Self {
        let (slave, master) = match header.fc {
            FunctionCode::Request { function, .. } => {
                match function {
                    RequestFunction::FdlStatus => return Self::FdlStatus,
                    RequestFunction::Ident => return Self::Ident,
                    RequestFunction::LsapStatus => return Self::LsapStatus,
                    RequestFunction::TimeEvent | RequestFunction::ClockValue => return Self::Clock,
                    _ => {}
                }
                (header.dsap, header.ssap)
            }
            FunctionCode::Response { function, .. } => {
                if data == 0 && header.dsap.is_none() && header.ssap.is_none() {
                    match function {
                        ResponseFunction::Ok => return Self::FdlStatus,
                        ResponseFunction::DataLow
                        | ResponseFunction::DataHigh
                        | ResponseFunction::DataLowNoResource
                        | ResponseFunction::DataHighNoResource => {}
                        _ => return Self::Fdl,
                    }
                }
                (header.ssap, header.dsap)
            }
        };
        match (slave, master) {
            (None, None) => match header.fc {
                FunctionCode::Request {
                    function: RequestFunction::SrdLow | RequestFunction::SrdHigh | RequestFunction::Msrd,
                    ..
                }
                | FunctionCode::Response { .. } => Self::DataExchange,
                FunctionCode::Request { .. } => Self::Fdl,
            },
            (Some(sap::SET_SLAVE_ADD), _) => Self::SetSlaveAdd,
            (Some(sap::RD_INP), _) => Self::RdInp,
            (Some(sap::RD_OUTP), _) => Self::RdOutp,
            (Some(sap::GLOBAL_CONTROL), _) => Self::GlobalControl,
            (Some(sap::GET_CFG), _) => Self::GetCfg,
            (Some(sap::SLAVE_DIAG), _) => Self::SlaveDiag,
            (Some(sap::SET_PRM), _) => Self::SetPrm,
            (Some(sap::CHK_CFG), _) => Self::ChkCfg,
            (Some(EXT_SET_PRM), Some(sap::MASTER)) => Self::ExtSetPrm,
            (Some(MASTER_MASTER), Some(MASTER_MASTER)) => Self::MasterMaster,
            (Some(MSAC1_ALARM | MSAC1), Some(MSAC1)) => Self::Msac1,
            (Some(0..=MSAC2_MANAGER), Some(MSAC2_MASTER)) => Self::Msac2,
            _ => Self::Fdl,
        }
    }

    /// The name in the standard.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Token => "Token",
            Self::ShortAck => "Short_Ack",
            Self::FdlStatus => "FDL_Status",
            Self::Ident => "Ident",
            Self::LsapStatus => "LSAP_Status",
            Self::Clock => "Clock",
            Self::DataExchange => "Data_Exchange",
            Self::SetSlaveAdd => "Set_Slave_Add",
            Self::RdInp => "Rd_Inp",
            Self::RdOutp => "Rd_Outp",
            Self::GlobalControl => "Global_Control",
            Self::GetCfg => "Get_Cfg",
            Self::SlaveDiag => "Slave_Diag",
            Self::SetPrm => "Set_Prm",
            Self::ExtSetPrm => "Ext_Set_Prm",
            Self::ChkCfg => "Chk_Cfg",
            Self::Msac1 => "MSAC1",
            Self::Msac2 => "MSAC2",
            Self::MasterMaster => "Master_Master",
            Self::Fdl => "FDL",
        }
    }
}

impl fmt::Display for Service {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The name of a service access point, on whichever side it stands.
///
/// 62 is Chk_Cfg at a slave and the access point of a master for everything acyclic of DP-V0; which one, [`Side`] says.
#[must_use]
pub const fn sap_name(sap: u8, side: Side) -> Option<&'static str> {
    Some(match (sap, side) {
        (sap::SET_SLAVE_ADD, _) => "Set_Slave_Add",
        (sap::RD_INP, _) => "Rd_Inp",
        (sap::RD_OUTP, _) => "Rd_Outp",
        (sap::GLOBAL_CONTROL, _) => "Global_Control",
        (sap::GET_CFG, _) => "Get_Cfg",
        (sap::SLAVE_DIAG, _) => "Slave_Diag",
        (sap::SET_PRM, _) => "Set_Prm",
        (sap::CHK_CFG, Side::Responder) => "Chk_Cfg",
        (sap::MASTER, Side::Initiator) => "MS0",
        (EXT_SET_PRM, _) => "Ext_Set_Prm",
        (MASTER_MASTER, _) => "MM",
        (MSAC1, _) => "MSAC1",
        (MSAC1_ALARM, Side::Responder) => "MSAC1 alarm",
        (MSAC2_MASTER, Side::Initiator) => "MSAC2",
        (MSAC2_MANAGER, _) => "MSAC2 RM",
        (63, _) => "all",
        _ => return None,
    })
}

/// On which side of an exchange an access point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The station that asks.
    Initiator,
    /// The station that is asked.
    Responder,
}

const EXT_SET_PRM: u8 = 53;
const MASTER_MASTER: u8 = 54;
const MSAC1: u8 = 51;
/// The slave's access point for acknowledging alarms; 50 on the master's side belongs to MSAC2.
const MSAC1_ALARM: u8 = 50;
const MSAC2_MASTER: u8 = 50;
const MSAC2_MANAGER: u8 = 49;
