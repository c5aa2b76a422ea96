//! Set_Slave_Add to a slave without address switches.

use super::{Service, ServiceError, StartError, request};
use crate::address::Address;
use crate::dp::acyclic::{JobId, JobOutcome, Jobs};
use crate::dp::image::{MAX_DATA, Octets};
use crate::dp::sap;
use crate::dp::set_slave_add::{MAX_REMAINING, SetSlaveAdd, SetSlaveAddError};

/// Gives a slave that nobody has parametrised another address.
///
/// The acknowledgement says that the telegram arrived, not that the slave obeyed: it keeps its address when the ident
/// number differs or the address is locked. Ask the new address with [`AskStatus`](super::AskStatus) or
/// [`ReadDiag`](super::ReadDiag) to know. [`JobFailure::NoAnswer`](crate::dp::JobFailure::NoAnswer) may mean that it
/// has obeyed and only its acknowledgement was lost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangeAddress {
    peer: Address,
    octets: Octets<MAX_DATA>,
}

impl ChangeAddress {
    /// The request for the slave that has the address `peer` now; 126 is what slaves are delivered with.
    ///
    /// # Errors
    ///
    /// [`SetSlaveAddError`] for a new address above 125 or more than 240 octets of remaining data.
    pub fn new(peer: Address, request: &SetSlaveAdd<'_>) -> Result<Self, SetSlaveAddError> {
        let len = MAX_DATA - MAX_REMAINING + request.remaining.len();
        let mut octets = Octets::zeroed(len);
        request.encode(octets.as_mut_slice())?;
        Ok(Self { peer, octets })
    }
}

impl Service for ChangeAddress {
    type Answer = ();

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        Ok(jobs.submit(&request(self.peer, sap::SET_SLAVE_ADD, &self.octets))?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<(), ServiceError> {
        match outcome {
            JobOutcome::Acknowledged => Ok(()),
            JobOutcome::Response { data, .. } => Err(ServiceError::UnexpectedData { got: data.len() }),
            JobOutcome::Failed(failure) => Err((*failure).into()),
        }
    }
}
