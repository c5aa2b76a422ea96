use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::address::Address;
use dp_master::dp::v1::{Abort, Initiate, Msac2Client, Msac2Event, V1Answer};
use dp_master::dp::{DpMaster, MasterConfig, MasterEvent};
use dp_master::driver::Driver;
use dp_master::fdl::{BusParams, Membership, RingEvent};
use dp_master::phy::{PortName, ReopeningPort, SerialOptions};
use dp_master::time::{Baud, Duration};
use drivecom::param::{RECORD_INDEX, RECORD_SLOT};

use super::{AccessError, CodePlace, CodeRecord, ParameterAccess};

/// Parameters over PROFIBUS: data record 47 through a connection of class 2 (MSAC2), beside the master that owns the drive.
///
/// Source: 9300 fact sheet, section 7; octets of request and response in `drivecom::param`.
#[derive(Debug)]
pub struct Dpv1Access {
    driver: Driver<ReopeningPort>,
    master: DpMaster<0>,
    client: Msac2Client,
    drive: Address,
    own: Address,
    baud: Baud,
    reference: u8,
}

/// A token that does not come, all repetitions, and a slow drive.
const PATIENCE: StdDuration = StdDuration::from_secs(10);
/// How often a connection is asked for: an operating system may hold an answer up for longer than the bus waits.
const ATTEMPTS: u32 = 3;
const TICK: StdDuration = StdDuration::from_millis(20);
const LEAVING: StdDuration = StdDuration::from_millis(500);
/// What an adapter and the operating system may add to an answer.
const LATENCY: Duration = Duration::from_millis(50);
/// A port that is gone for longer ends the job.
const GONE_LIMIT: StdDuration = StdDuration::from_secs(5);

impl Dpv1Access {
    /// Opens the line as a master of class 2 with address `own` and connects to the drive.
    ///
    /// # Errors
    ///
    /// [`AccessError::NoWay`] when the line cannot be opened, [`AccessError::NoAnswer`] when there is no connection over it.
    pub fn open(port: &PortName, baud: Baud, own: Address, drive: Address) -> Result<Self, AccessError> {
        let opened = ReopeningPort::open(port, baud, SerialOptions::default()).map_err(no_way)?;
        let params = BusParams::standard(baud).with_latency_allowance(LATENCY);
        let master = DpMaster::new(MasterConfig::new(own, params)).map_err(no_way)?;
        let mut access = Self {
            driver: Driver::new(opened.port.with_limit(GONE_LIMIT)),
            master,
            client: Msac2Client::new(drive),
            drive,
            own,
            baud,
            reference: 0,
        };
        access.connect()?;
        Ok(access)
    }

    fn connect(&mut self) -> Result<(), AccessError> {
        let initiate = Initiate::data_records(self.baud);
        let mut attempt = 1;
        loop {
            self.client.connect(self.master.jobs(), &initiate).map_err(no_way)?;
            match self.wait() {
                Ok(Msac2Event::Opened(_)) => return Ok(()),
                Ok(Msac2Event::Rejected(error)) => {
                    return Err(AccessError::NoAnswer(format!(
                        "station {} refuses a connection: {error}",
                        self.drive
                    )));
                }
                Ok(other) => return Err(self.no_connection(&format!("{other:?}"))),
                Err(AccessError::NoAnswer(_)) if attempt < ATTEMPTS => attempt += 1,
                Err(error) => return Err(error),
            }
        }
    }

    /// The next event of the connection.
    fn wait(&mut self) -> Result<Msac2Event, AccessError> {
        let begun = StdInstant::now();
        loop {
            let now = self.driver.now();
            if let Some(event) = self.client.step(self.master.jobs(), now) {
                if let Msac2Event::Closed(abort) = event {
                    return Err(self.no_connection(&abort.to_string()));
                }
                return Ok(event);
            }
            if begun.elapsed() > PATIENCE {
                return Err(AccessError::NoAnswer(format!(
                    "no token in {} s: other masters admit us when our address {} is free and not above their HSA",
                    PATIENCE.as_secs(),
                    self.own
                )));
            }
            self.driver.step(&mut self.master, TICK).map_err(no_way)?;
            while let Some(event) = self.master.poll_event() {
                if event == MasterEvent::Ring(RingEvent::DuplicateAddress) {
                    return Err(AccessError::NoAnswer(format!(
                        "another station has our address {}; choose a free one",
                        self.own
                    )));
                }
            }
        }
    }

    fn no_connection(&self, why: &str) -> AccessError {
        AccessError::NoAnswer(format!(
            "no connection to station {}: {why}; is it there, and does it speak DP-V1?",
            self.drive
        ))
    }

    /// Writes the request to the record and reads the response.
    fn ask(&mut self, job: CodeRecord) -> Result<i32, AccessError> {
        let place = job.place();
        let v1_refused = |error: &dyn std::fmt::Display| AccessError::Refused {
            place,
            reason: format!("the bus module refuses: {error}"),
        };
        self.client
            .write(self.master.jobs(), RECORD_SLOT, RECORD_INDEX, &job.request())
            .map_err(no_way)?;
        if let Msac2Event::Answer(Err(error)) = self.wait()? {
            return Err(v1_refused(&error));
        }
        self.client
            .read(self.master.jobs(), RECORD_SLOT, RECORD_INDEX, 240)
            .map_err(no_way)?;
        match self.wait()? {
            Msac2Event::Answer(Ok(V1Answer::Data { data, .. })) => job.result(&data),
            Msac2Event::Answer(Err(error)) => Err(v1_refused(&error)),
            other => Err(AccessError::NoAnswer(format!("{place}: unexpected answer {other:?}"))),
        }
    }

    fn next_reference(&mut self) -> u8 {
        self.reference = self.reference.wrapping_add(1);
        self.reference
    }
}

fn no_way(error: impl std::fmt::Display) -> AccessError {
    AccessError::NoWay(error.to_string())
}

impl ParameterAccess for Dpv1Access {
    fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
        let reference = self.next_reference();
        self.ask(CodeRecord::read(reference, place))
    }

    fn write(&mut self, place: CodePlace, raw: i32) -> Result<(), AccessError> {
        let reference = self.next_reference();
        self.ask(CodeRecord::write(reference, place, raw)).map(|_| ())
    }
}

impl Drop for Dpv1Access {
    /// Ends the connection at the drive, which has few of them, and leaves the ring in good order.
    fn drop(&mut self) {
        let begun = StdInstant::now();
        if self.client.connected().is_some() {
            self.client.abort(self.master.jobs(), Abort::user(0));
            while begun.elapsed() < LEAVING {
                let now = self.driver.now();
                if let Some(Msac2Event::Closed(_)) = self.client.step(self.master.jobs(), now) {
                    break;
                }
                if self.driver.step(&mut self.master, TICK).is_err() {
                    return;
                }
            }
        }
        self.master.set_membership(Membership::Passive);
        while self.master.is_in_ring() && begun.elapsed() < 2 * LEAVING {
            if self.driver.step(&mut self.master, TICK).is_err() {
                return;
            }
        }
    }
}
