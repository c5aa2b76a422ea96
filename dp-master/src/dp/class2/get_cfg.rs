//! Get_Cfg of any slave.

use super::{Service, ServiceError, StartError, data, request};
use crate::address::Address;
use crate::dp::acyclic::{JobId, JobOutcome, Jobs};
use crate::dp::image::{MAX_DATA, Octets};
use crate::dp::sap;

/// Reads the identifier octets: those accepted last, or the real ones of a slave that nobody has configured yet.
/// [`places`](crate::dp::places) divides them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GetCfg {
    /// The slave.
    pub peer: Address,
}

impl Service for GetCfg {
    type Answer = Octets<MAX_DATA>;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        Ok(jobs.submit(&request(self.peer, sap::GET_CFG, &[]))?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<Octets<MAX_DATA>, ServiceError> {
        Ok(*data(outcome)?)
    }
}
