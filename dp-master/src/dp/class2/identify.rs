//! What the data link layer of a station tells: FDL status, ident data, state of an access point.

use super::{Service, ServiceError, StartError, data};
use crate::address::Address;
use crate::dp::acyclic::{JobId, JobKind, JobOutcome, JobRequest, Jobs, Poll};
use crate::dp::image::{MAX_DATA, Octets};
use crate::fdl::Repeat;
use crate::wire::StationType;

/// Asks whether a station is there, and of what kind it is. It is repeated up to the retry limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AskStatus {
    /// The station.
    pub peer: Address,
}

impl Service for AskStatus {
    type Answer = StationType;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        let request = JobRequest {
            repeat: Repeat::UpToLimit,
            ..JobRequest::fdl_status(self.peer)
        };
        Ok(jobs.submit(&request)?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<StationType, ServiceError> {
        match outcome {
            JobOutcome::Response { station, .. } => Ok(*station),
            _ => data(outcome).map(|_| StationType::Slave),
        }
    }
}

/// Asks for the ident data of the data link layer. DP slaves need not have any and refuse (RS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AskIdent {
    /// The station.
    pub peer: Address,
}

impl Service for AskIdent {
    type Answer = Ident;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        let request = JobRequest {
            peer: self.peer,
            kind: JobKind::Ident,
            data: &[],
            repeat: Repeat::UpToLimit,
            poll: Poll::Never,
        };
        Ok(jobs.submit(&request)?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<Ident, ServiceError> {
        Ok(Ident::parse(data(outcome)?)?)
    }
}

/// Asks for the state of an access point. The octets are the station's; DP slaves refuse (RS).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AskLsap {
    /// The station.
    pub peer: Address,
    /// The access point, 0…63.
    pub sap: u8,
}

impl Service for AskLsap {
    type Answer = Octets<MAX_DATA>;

    fn submit(&self, jobs: &mut Jobs) -> Result<JobId, StartError> {
        let request = JobRequest {
            peer: self.peer,
            kind: JobKind::LsapStatus { sap: self.sap },
            data: &[],
            repeat: Repeat::UpToLimit,
            poll: Poll::Never,
        };
        Ok(jobs.submit(&request)?)
    }

    fn answer(&self, outcome: &JobOutcome) -> Result<Octets<MAX_DATA>, ServiceError> {
        Ok(*data(outcome)?)
    }
}

/// Most octets of the texts in ident data: what a telegram of DP carries less their lengths.
pub const MAX_IDENT: usize = MAX_DATA - 4;

/// Ident data: four texts, the first four octets are their lengths.
///
/// Source: IEC 61158-4-3, Ident_List: vendor name, controller type, hardware release, software release.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ident {
    octets: Octets<MAX_IDENT>,
    ends: [u8; 4],
}

impl Ident {
    /// Reads the data unit.
    ///
    /// # Errors
    ///
    /// [`IdentError`] when the lengths do not add up to the octets that are there.
    pub fn parse(data: &[u8]) -> Result<Self, IdentError> {
        let error = IdentError { got: data.len() };
        let (lengths, texts) = data.split_first_chunk::<4>().ok_or(error)?;
        let mut ends = [0; 4];
        let mut end = 0u8;
        for (slot, length) in ends.iter_mut().zip(lengths) {
            end = end.checked_add(*length).ok_or(error)?;
            *slot = end;
        }
        if usize::from(end) != texts.len() {
            return Err(error);
        }
        let octets = Octets::from_slice(texts).ok_or(error)?;
        Ok(Self { octets, ends })
    }

    /// Name of the maker, in the station's character set.
    pub fn vendor(&self) -> &[u8] {
        self.part(0, self.ends[0])
    }

    /// Type of the controller.
    pub fn controller(&self) -> &[u8] {
        self.part(self.ends[0], self.ends[1])
    }

    /// Release of the hardware.
    pub fn hardware(&self) -> &[u8] {
        self.part(self.ends[1], self.ends[2])
    }

    /// Release of the software.
    pub fn software(&self) -> &[u8] {
        self.part(self.ends[2], self.ends[3])
    }

    fn part(&self, from: u8, to: u8) -> &[u8] {
        self.octets.get(usize::from(from)..usize::from(to)).unwrap_or(&[])
    }
}

/// Ident data whose lengths do not add up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("ident data: the four lengths do not add up to the {got} octets received")]
pub struct IdentError {
    /// Octets received.
    pub got: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ident_data_are_four_texts_behind_their_lengths() {
        let ident = Ident::parse(b"\x03\x04\x02\x01ACMEDP1.27").unwrap();
        assert_eq!(ident.vendor(), b"ACM");
        assert_eq!(ident.controller(), b"EDP1");
        assert_eq!(ident.hardware(), b".2");
        assert_eq!(ident.software(), b"7");
    }

    #[test]
    fn lengths_that_do_not_add_up_are_refused() {
        assert_eq!(Ident::parse(b"\x03\x04\x02\x01ACME"), Err(IdentError { got: 8 }));
        assert_eq!(Ident::parse(b"\x00\x00"), Err(IdentError { got: 2 }));
        assert!(Ident::parse(&[255, 255, 0, 0, 1]).is_err());
    }
}
