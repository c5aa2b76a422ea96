//! MSAC1 at the master: data records and acknowledgements of alarms of a slave it parametrised.

use super::alarm::AlarmAck;
use super::client::{Asked, V1Answer, V1ClientError, V1Failure, request_pdu};
use super::pdu::{Reply, Request};
use crate::address::Address;
use crate::dp::{JobId, JobOutcome, JobRequest, Jobs, sap};
use crate::time::Duration;

/// Data records of one slave, one request at a time, beside the cyclic exchange with it.
///
/// The slave has to exchange data with this master, and DPV1_Enable has to stand in its user parameters
/// ([`V1Status::ENABLED`](super::V1Status::ENABLED)); else it refuses with RS.
///
/// # Order of calls
///
/// A request; then [`poll`](Self::poll) after each step of the master until it returns something. The jobs are those of the master
/// ([`DpMaster::jobs`](crate::dp::DpMaster::jobs)), always the same.
///
/// # Example
///
/// ```
/// use dp_master::address::Address;
/// use dp_master::dp::DpMaster;
/// use dp_master::dp::v1::{Msac1Client, V1Answer, V1ClientError};
/// use dp_master::time::Duration;
///
/// fn ask(client: &mut Msac1Client, master: &mut DpMaster<1>) -> Result<(), V1ClientError> {
///     client.read(master.jobs(), 0, 47, 240)
/// }
///
/// fn look(client: &mut Msac1Client, master: &mut DpMaster<1>) {
///     match client.poll(master.jobs()) {
///         Some(Ok(V1Answer::Data { data, .. })) => println!("{data:?}"),
///         Some(Ok(other)) => println!("{other:?}"),
///         Some(Err(failure)) => println!("{failure}"),
///         None => {}
///     }
/// }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let client = Msac1Client::new(Address::new(3)?).with_timeout(Duration::from_millis(500));
/// # let _ = client;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Msac1Client {
    slave: Address,
    timeout: Duration,
    under_way: Option<(JobId, Asked)>,
}

/// At which access point a slave wants acknowledgements of alarms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AlarmSap {
    /// 51, with the data records.
    #[default]
    Shared,
    /// 50, of its own (Extra_Alarm_SAP_supp in its GSD file).
    Extra,
}

impl Msac1Client {
    /// A client that waits two seconds for an answer.
    pub const fn new(slave: Address) -> Self {
        Self {
            slave,
            timeout: Duration::from_millis(2_000),
            under_way: None,
        }
    }

    /// The same with another time to wait: at least C1_Response_Timeout of the slave's GSD file, and the time of a few DP cycles.
    #[must_use]
    pub const fn with_timeout(self, timeout: Duration) -> Self {
        Self { timeout, ..self }
    }

    /// The slave.
    pub const fn slave(&self) -> Address {
        self.slave
    }

    /// A request is under way.
    pub const fn is_busy(&self) -> bool {
        self.under_way.is_some()
    }

    /// Reads a data record: slot 0…254, index 0…255, at most `length` octets, 1…240.
    ///
    /// # Errors
    ///
    /// [`V1ClientError::Busy`] and [`V1ClientError::Submit`]; nothing was sent then.
    pub fn read(&mut self, jobs: &mut Jobs, slot: u8, index: u8, length: u8) -> Result<(), V1ClientError> {
        self.ask(jobs, sap::MSAC1, &Request::Read { slot, index, length })
    }

    /// Writes a data record, at most 240 octets.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read), and [`V1ClientError::Data`].
    pub fn write(&mut self, jobs: &mut Jobs, slot: u8, index: u8, data: &[u8]) -> Result<(), V1ClientError> {
        self.ask(jobs, sap::MSAC1, &Request::Write { slot, index, data })
    }

    /// Acknowledges an alarm that stood in the diagnosis, see [`alarms_of`](super::alarms_of).
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn acknowledge(&mut self, jobs: &mut Jobs, at: AlarmSap, alarm: AlarmAck) -> Result<(), V1ClientError> {
        let dsap = match at {
            AlarmSap::Shared => sap::MSAC1,
            AlarmSap::Extra => sap::MSAC1_ALARM,
        };
        self.ask(jobs, dsap, &Request::AlarmAck(alarm))
    }

    fn ask(&mut self, jobs: &mut Jobs, dsap: u8, request: &Request<'_>) -> Result<(), V1ClientError> {
        if self.is_busy() {
            return Err(V1ClientError::Busy);
        }
        let pdu = request_pdu(request)?;
        let job = JobRequest::srd(self.slave, dsap, sap::MSAC1, &pdu).polling(self.timeout);
        self.under_way = Some((jobs.submit(&job)?, Asked::new(request)));
        Ok(())
    }

    /// The answer, once, when it has come; `None` while the request is under way, and without one.
    pub fn poll(&mut self, jobs: &mut Jobs) -> Option<Result<V1Answer, V1Failure>> {
        let (job, asked) = self.under_way?;
        let outcome = jobs.take(job)?;
        self.under_way = None;
        Some(match outcome {
            JobOutcome::Response { data, .. } => match Reply::parse(&data) {
                Ok(reply) => asked.answer(&reply),
                Err(error) => Err(V1Failure::Unreadable(error)),
            },
            // A job that polls does not end so.
            JobOutcome::Acknowledged => Err(V1Failure::Job(crate::dp::JobFailure::Expired)),
            JobOutcome::Failed(failure) => Err(V1Failure::Job(failure)),
        })
    }

    /// Forgets the request under way; the slave may carry it out all the same.
    pub fn cancel(&mut self, jobs: &mut Jobs) {
        if let Some((job, _)) = self.under_way.take() {
            jobs.cancel(job);
        }
    }
}
