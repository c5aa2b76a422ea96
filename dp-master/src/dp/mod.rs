//! Decentralised periphery (DP-V0): start-up, cyclic exchange and diagnosis, master and slave side.

mod cfg;
mod control;
mod diag;
mod events;
mod image;
mod master;
mod prm;
mod slave;
mod slave_handler;
mod watchdog;

pub use cfg::{CfgError, Configuration, Consistency, Identifier, IoLengths, io_lengths};
pub use control::{ControlCommand, GlobalControl};
pub use diag::{
    Block, Blocks, Diagnosis, MAX_EXT_DIAG, Overflow, SLAVE_DIAG_LEN, SlaveDiagError, StandardDiag, StationStatus,
};
pub use image::{MAX_DATA, Octets, ProcessImage};
pub use master::{
    AddSlaveError, DpMaster, MasterConfig, MasterError, MasterEvent, MasterStatistics, Mode, OutputsError, SlaveIndex,
};
pub use prm::{
    FREEZE_REQ, LOCK_REQ, LockRequest, MAX_USER_PRM, SET_PRM_LEN, SYNC_REQ, SetPrm, SetPrmError, UNLOCK_REQ, WD_ON,
};
pub use slave::{
    AcceptedConfigurations, DpSlave, ExtDiag, ExtDiagError, IdentityError, LeaveReason, OutputsOnLeave, SlaveEvent,
    SlaveIdentity, SlavePhase, SlaveStatistics, Support,
};
pub use slave_handler::{ClearOutputs, Demand, LossCause, SlaveConfig, SlaveState};
pub use watchdog::{Watchdog, WatchdogError};

/// Service access points of DP.
///
/// Source: IEC 61158-6-3. Data_Exchange has none: it uses the default one.
pub mod sap {
    /// Set_Slave_Add, DSAP 55.
    pub const SET_SLAVE_ADD: u8 = 55;
    /// Rd_Inp, DSAP 56.
    pub const RD_INP: u8 = 56;
    /// Rd_Outp, DSAP 57.
    pub const RD_OUTP: u8 = 57;
    /// Global_Control, DSAP 58.
    pub const GLOBAL_CONTROL: u8 = 58;
    /// Get_Cfg, DSAP 59.
    pub const GET_CFG: u8 = 59;
    /// Slave_Diag, DSAP 60.
    pub const SLAVE_DIAG: u8 = 60;
    /// Set_Prm, DSAP 61.
    pub const SET_PRM: u8 = 61;
    /// Chk_Cfg, DSAP 62.
    pub const CHK_CFG: u8 = 62;
    /// SSAP of a master towards slaves.
    pub const MASTER: u8 = 62;
}
