//! Decentralised periphery (DP-V0): start-up, cyclic exchange and diagnosis, master and slave side.
//!
//! | service | DSAP | coding | master | slave |
//! |---|---|---|---|---|
//! | Data_Exchange | – | [`ProcessImage`] | [`DpMaster`] (class 1) | [`DpSlave`] |
//! | Set_Prm | 61 | [`SetPrm`] | [`DpMaster`] | [`DpSlave`] |
//! | Chk_Cfg | 62 | [`Configuration`], [`places`] | [`DpMaster`] | [`DpSlave`], [`AcceptedConfigurations`] |
//! | Slave_Diag | 60 | [`Diagnosis`] | [`DpMaster`]; any slave: [`class2::ReadDiag`] | [`DpSlave`] |
//! | Global_Control | 58 | [`GlobalControl`] | [`DpMaster::send_control`] | [`DpSlave`] |
//! | Get_Cfg | 59 | [`places`] | [`class2::GetCfg`] | [`DpSlave`] |
//! | Rd_Inp, Rd_Outp | 56, 57 | [`ProcessImage`] | [`class2::RdInp`], [`class2::RdOutp`] | [`DpSlave`] |
//! | Set_Slave_Add | 55 | [`SetSlaveAdd`] | [`class2::ChangeAddress`] | [`DpSlave`], [`AddressChange`] |
//! | FDL status, live list | – | [`StationType`](crate::wire::StationType) | [`class2::LiveList`] | [`Responder`](crate::fdl::Responder) |
//! | anything else acyclic | any | octets | [`Jobs`] | |
//!
//! # Example
//!
//! A master and a slave on a virtual line, from power-on to the exchange of data.
//!
//! ```
//! # #[cfg(feature = "std")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use dp_master::address::Address;
//! use dp_master::dp::{
//!     AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveIdentity, SlaveState,
//! };
//! use dp_master::fdl::BusParams;
//! use dp_master::phy::{PortId, VirtualBus, pump};
//! use dp_master::station::Station;
//! use dp_master::time::{Baud, Instant};
//!
//! let baud = Baud::B12000000;
//! let (plc, drive) = (Address::new(2)?, Address::new(3)?);
//! let mut master = DpMaster::<1>::new(MasterConfig::new(plc, BusParams::standard(baud)))?;
//! let axis = master.add_slave(SlaveConfig::new(drive, 0x00DA, &[0xF3, 0xF3])?)?;
//! master.set_outputs(axis, &[7; 16])?;
//! master.set_mode(Mode::Operate);
//!
//! let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
//! let mut slave = DpSlave::new(SlaveIdentity::new(drive, 0x00DA, baud, accepted))?;
//! slave.set_inputs(&[9; 16]);
//!
//! let mut bus = VirtualBus::new(baud);
//! let ports = [bus.attach(), bus.attach()];
//! let mut now = Instant::ZERO;
//! while master.exchanges(axis) < 3 {
//!     let mut stations: [(PortId, &mut dyn Station); 2] = [(ports[0], &mut master), (ports[1], &mut slave)];
//!     now = pump(&mut bus, now, &mut stations).ok_or("nobody waits for anything")?;
//! }
//! assert_eq!(master.state(axis), SlaveState::DataExchange);
//! assert_eq!(master.inputs(axis), [9; 16]);
//! assert_eq!(slave.outputs(), [7; 16]);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "std"))]
//! # fn main() {}
//! ```

mod acyclic;
mod cfg;
pub mod class2;
mod control;
mod cyclic;
mod diag;
mod diag_block;
mod events;
mod image;
mod master;
mod modules;
mod operation;
mod pace;
mod peer_fcb;
mod prm;
mod set_slave_add;
mod slave;
mod slave_handler;
mod slave_identity;
pub mod v1;
mod watchdog;

pub use acyclic::{JobFailure, JobId, JobKind, JobOutcome, JobRequest, Jobs, MAX_JOBS, Poll, Priority, SubmitError};
pub use cfg::{CfgError, Configuration, Consistency, Identifier, IoLengths, Place, Places, io_lengths, places};
pub use control::{ControlCommand, GlobalControl};
pub use diag::{Diagnosis, MAX_EXT_DIAG, Overflow, SLAVE_DIAG_LEN, SlaveDiagError, StandardDiag, StationStatus};
pub use diag_block::{
    Block, BlockFault, Blocks, ChannelDiag, ChannelError, ChannelUnit, Direction, ExtDiagWriter, ModuleSet,
    ModuleState, module_states,
};
pub use image::{MAX_DATA, Octets, ProcessImage};
pub use master::{
    AddSlaveError, ControlError, DpMaster, MasterConfig, MasterError, MasterEvent, MasterStatistics, Mode,
    OutputsError, SlaveIndex,
};
pub use modules::{EMPTY_SLOT, Slot};
pub use operation::AutoClear;
pub use pace::Overrun;
pub use prm::{
    FREEZE_REQ, LOCK_REQ, LockRequest, MAX_USER_PRM, SET_PRM_LEN, SYNC_REQ, SetPrm, SetPrmError, UNLOCK_REQ, WD_ON,
};
pub use set_slave_add::{
    AddressLock, MAX_NEW_ADDRESS, MAX_REMAINING, SET_SLAVE_ADD_LEN, SetSlaveAdd, SetSlaveAddError,
};
pub use slave::{
    AddressKept, DpSlave, ExtDiag, ExtDiagError, InputValidity, LeaveReason, SlaveEvent, SlavePhase, SlaveStatistics,
};
pub use slave_handler::{Activation, AutoClearVote, ClearOutputs, Demand, LossCause, SlaveConfig, SlaveState};
pub use slave_identity::{
    AcceptedConfigurations, AddressChange, IdentityError, OutputsOnLeave, SlaveIdentity, Support,
};
pub use watchdog::{Watchdog, WatchdogError};

/// Service access points of DP.
///
/// Source: IEC 61158-6-3. Data_Exchange has none: it uses the default one.
pub mod sap {
    /// Access point of the resource manager, which opens MSAC2 connections; those have 0…48.
    pub const MSAC2_MANAGER: u8 = 49;
    /// SSAP of a master of class 2 towards slaves (MSAC2).
    pub const MSAC2_MASTER: u8 = 50;
    /// Acknowledgement of alarms, DSAP 50.
    pub const MSAC1_ALARM: u8 = 50;
    /// Read and write of the parametrising master, DSAP 51; also the SSAP of that master.
    pub const MSAC1: u8 = 51;
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
