//! Slave_Diag of any slave.

use super::{Service, ServiceError, StartError, data, request};
use crate::address::Address;
use crate::dp::acyclic::{JobId, JobOutcome, Jobs};
use crate::dp::diag::Diagnosis;
use crate::dp::sap;

/// Reads the diagnosis. A slave in data exchange keeps its news for its own master: reading along takes nothing away.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadDiag {
    /// The slave.
    pub peer: Address,
}

impl Service for ReadDiag {
    type Answer = Diagnosis;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        Ok(jobs.submit(&request(self.peer, sap::SLAVE_DIAG, &[]))?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<Diagnosis, ServiceError> {
        Ok(Diagnosis::parse(data(outcome)?)?)
    }
}
