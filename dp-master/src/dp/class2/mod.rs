//! Services of a master of class 2: any station is asked, whoever owns it.
//!
//! | service | DSAP | answer | file |
//! |---|---|---|---|
//! | [`ReadDiag`] | 60 | diagnosis | `read_diag` |
//! | [`GetCfg`] | 59 | identifier octets | `get_cfg` |
//! | [`RdInp`], [`RdOutp`] | 56, 57 | image of one direction | `read_image` |
//! | [`ChangeAddress`] | 55 | short acknowledgement | `change_address` |
//! | [`AskStatus`] | FDL status | station type | `identify` |
//! | [`AskIdent`], [`AskLsap`] | ident, LSAP status | texts, octets | `identify` |
//! | [`LiveList`] | FDL status | who is on the line | `live_list` |
//!
//! A service is a value; [`Pending`] runs it as one job of [`Jobs`]. The master of class 1 goes on meanwhile, and a
//! master in Stop without slaves is one of class 2 alone.
//!
//! # Example
//!
//! ```
//! # #[cfg(feature = "std")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use dp_master::address::Address;
//! use dp_master::dp::class2::{GetCfg, Pending};
//! use dp_master::dp::{AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, SlaveIdentity};
//! use dp_master::fdl::BusParams;
//! use dp_master::phy::{PortId, VirtualBus, pump};
//! use dp_master::station::Station;
//! use dp_master::time::{Baud, Instant};
//!
//! let baud = Baud::B1500000;
//! let drive = Address::new(3)?;
//! let mut tool = DpMaster::<0>::new(MasterConfig::new(Address::new(1)?, BusParams::standard(baud)))?;
//! let accepted = AcceptedConfigurations::Table(&[&[0xF3, 0xF3]]);
//! let mut slave = DpSlave::new(SlaveIdentity::new(drive, 0x00DA, baud, accepted))?;
//!
//! let mut bus = VirtualBus::new(baud);
//! let ports = [bus.attach(), bus.attach()];
//! let mut now = Instant::ZERO;
//! let question = Pending::start(GetCfg { peer: drive }, tool.jobs())?;
//! let answer = loop {
//!     if let Some(answer) = question.poll(tool.jobs()) {
//!         break answer?;
//!     }
//!     let mut stations: [(PortId, &mut dyn Station); 2] = [(ports[0], &mut tool), (ports[1], &mut slave)];
//!     now = pump(&mut bus, now, &mut stations).ok_or("nobody waits for anything")?;
//! };
//! assert_eq!(answer[..], [0xF3, 0xF3]);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "std"))]
//! # fn main() {}
//! ```
//!
//! Source: IEC 61158-6-3 (services of the class 2 master); IEC 61158-4-3 (FDL status, ident, LSAP status).

mod change_address;
mod get_cfg;
mod identify;
mod live_list;
mod read_diag;
mod read_image;

pub use change_address::ChangeAddress;
pub use get_cfg::GetCfg;
pub use identify::{AskIdent, AskLsap, AskStatus, Ident, IdentError, MAX_IDENT};
pub use live_list::{LiveList, LiveListEvent, Scan, Stations};
pub use read_diag::ReadDiag;
pub use read_image::{RdInp, RdOutp};

use super::acyclic::{JobFailure, JobId, JobOutcome, JobRequest, Jobs, SubmitError};
use super::diag::SlaveDiagError;
use super::image::{MAX_DATA, Octets};
use super::set_slave_add::SetSlaveAddError;

/// A service that is one job: its telegram, and what the answer means.
pub trait Service {
    /// What a successful answer carries.
    type Answer;

    /// Submits the job.
    ///
    /// # Errors
    ///
    /// [`StartError`]; nothing was submitted then.
    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError>;

    /// Reads the outcome.
    ///
    /// # Errors
    ///
    /// [`ServiceError`].
    fn answer(&self, outcome: &JobOutcome) -> Result<Self::Answer, ServiceError>;
}

/// A service on its way.
#[derive(Debug, Clone, PartialEq, Eq)]
#[must_use = "the job keeps its place until the answer is fetched or it is cancelled"]
pub struct Pending<S> {
    service: S,
    job: JobId,
}

impl<S: Service> Pending<S> {
    /// Starts a service.
    ///
    /// # Errors
    ///
    /// [`StartError`]; nothing was submitted then.
    pub fn start(service: S, jobs: &mut Jobs) -> Result<Self, StartError> {
        let job = service.submit(jobs)?;
        Ok(Self { service, job })
    }

    /// The answer, once, when there is one.
    pub fn poll(&self, jobs: &mut Jobs) -> Option<Result<S::Answer, ServiceError>> {
        let outcome = jobs.take(self.job)?;
        Some(self.service.answer(&outcome))
    }

    /// Gives the service up.
    pub fn cancel(self, jobs: &mut Jobs) {
        jobs.cancel(self.job);
    }
}

/// Why a service was not started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The queue did not take the job.
    #[error(transparent)]
    Submit(#[from] SubmitError),
    /// The new address or the remaining data are impossible.
    #[error(transparent)]
    SetSlaveAdd(#[from] SetSlaveAddError),
}

/// Why a service brought no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ServiceError {
    /// The message cycle brought nothing.
    #[error(transparent)]
    Failed(#[from] JobFailure),
    /// Data were expected, and it was only acknowledged.
    #[error("expected data, got an acknowledgement")]
    NoData,
    /// An acknowledgement was expected.
    #[error("expected an acknowledgement, got {got} octets of data")]
    UnexpectedData {
        /// Octets received.
        got: usize,
    },
    /// The diagnosis cannot be read.
    #[error(transparent)]
    Diagnosis(#[from] SlaveDiagError),
    /// The ident data cannot be read.
    #[error(transparent)]
    Ident(#[from] IdentError),
}

/// The data of an answer that must have some.
fn data(outcome: &JobOutcome) -> Result<&Octets<MAX_DATA>, ServiceError> {
    match outcome {
        JobOutcome::Response { data, .. } => Ok(data),
        JobOutcome::Acknowledged => Err(ServiceError::NoData),
        JobOutcome::Failed(failure) => Err((*failure).into()),
    }
}

/// A request of DP-V0: between an access point of the slave and that of masters.
fn request(peer: crate::address::Address, dsap: u8, data: &[u8]) -> JobRequest<'_> {
    JobRequest::srd(peer, dsap, super::sap::MASTER, data)
}
