//! Rd_Inp and Rd_Outp of any slave.

use super::{Service, ServiceError, StartError, data, request};
use crate::address::Address;
use crate::dp::acyclic::{JobId, JobOutcome, Jobs};
use crate::dp::image::ProcessImage;
use crate::dp::sap;

/// Reads the inputs of a slave in data exchange; others refuse (RS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RdInp {
    /// The slave.
    pub peer: Address,
}

impl Service for RdInp {
    type Answer = ProcessImage;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        Ok(jobs.submit(&request(self.peer, sap::RD_INP, &[]))?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<ProcessImage, ServiceError> {
        image(outcome)
    }
}

/// Reads the outputs of a slave in data exchange; others refuse (RS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RdOutp {
    /// The slave.
    pub peer: Address,
}

impl Service for RdOutp {
    type Answer = ProcessImage;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        Ok(jobs.submit(&request(self.peer, sap::RD_OUTP, &[]))?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<ProcessImage, ServiceError> {
        image(outcome)
    }
}

/// A slave without data in this direction may acknowledge instead of answering with none.
fn image(outcome: &JobOutcome) -> Result<ProcessImage, ServiceError> {
    match outcome {
        JobOutcome::Acknowledged => Ok(ProcessImage::EMPTY),
        _ => Ok(*data(outcome)?),
    }
}
