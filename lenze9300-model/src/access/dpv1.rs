use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::address::Address;
use dp_master::dp::v1::{Abort, Addresses, Features, Initiate, Msac2Client, Msac2Event, SendTimeout, V1Answer};
use dp_master::dp::{DpMaster, MasterConfig, MasterEvent};
use dp_master::driver::Driver;
use dp_master::fdl::{BusParams, Membership, RingEvent};
use dp_master::phy::{PortName, ReopeningPort, SerialOptions};
use dp_master::time::{Baud, Duration};
use drivecom::param::{RECORD_INDEX, RECORD_SLOT, RecordError};

use super::{AccessError, CodePlace, ParameterAccess};
use crate::bus::can::sdo::index_of;
use crate::code::DataLength;

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
const TICK: StdDuration = StdDuration::from_millis(20);
const LEAVING: StdDuration = StdDuration::from_millis(500);
/// What an adapter and the operating system may add to an answer.
const LATENCY: Duration = Duration::from_millis(50);
/// A port that is gone for longer ends the job.
const GONE_LIMIT: StdDuration = StdDuration::from_secs(5);

/// Formats of a value in the record.
const WORD: u8 = 0x42;
const DOUBLE_WORD: u8 = 0x43;
const ERROR: u8 = 0x44;

impl Dpv1Access {
    /// Opens the line as a master of class 2 with address `own` and connects to the drive.
    ///
    /// # Errors
    ///
    /// [`AccessError::NoWay`].
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
        let initiate = Initiate {
            send_timeout: SendTimeout::least(self.baud),
            features: Features::READ_WRITE,
            profile_features: 0,
            profile_ident: 0,
            addresses: Addresses::DIRECT,
        };
        self.client.connect(self.master.jobs(), &initiate).map_err(no_way)?;
        match self.wait()? {
            Msac2Event::Opened(_) => Ok(()),
            Msac2Event::Rejected(error) => Err(AccessError::NoWay(format!(
                "station {} refuses a connection: {error}",
                self.drive
            ))),
            other => Err(self.no_connection(&format!("{other:?}"))),
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
                return Err(AccessError::NoWay(format!(
                    "no token in {} s: other masters admit us when our address {} is free and not above their HSA",
                    PATIENCE.as_secs(),
                    self.own
                )));
            }
            self.driver.step(&mut self.master, TICK).map_err(no_way)?;
            while let Some(event) = self.master.poll_event() {
                if event == MasterEvent::Ring(RingEvent::DuplicateAddress) {
                    return Err(AccessError::NoWay(format!(
                        "another station has our address {}; choose a free one",
                        self.own
                    )));
                }
            }
        }
    }

    fn no_connection(&self, why: &str) -> AccessError {
        AccessError::NoWay(format!(
            "no connection to station {}: {why}; is it there, and does it speak DP-V1?",
            self.drive
        ))
    }

    /// Writes a request to the record and reads the response.
    fn ask(&mut self, place: CodePlace, request: &[u8]) -> Result<Vec<u8>, AccessError> {
        let v1_refused = |error: &dyn std::fmt::Display| AccessError::Refused {
            place,
            reason: format!("the bus module refuses: {error}"),
        };
        self.client
            .write(self.master.jobs(), RECORD_SLOT, RECORD_INDEX, request)
            .map_err(no_way)?;
        if let Msac2Event::Answer(Err(error)) = self.wait()? {
            return Err(v1_refused(&error));
        }
        self.client
            .read(self.master.jobs(), RECORD_SLOT, RECORD_INDEX, 240)
            .map_err(no_way)?;
        match self.wait()? {
            Msac2Event::Answer(Ok(V1Answer::Data { data, .. })) => Ok(data.to_vec()),
            Msac2Event::Answer(Err(error)) => Err(v1_refused(&error)),
            other => Err(AccessError::NoWay(format!("{place}: unexpected answer {other:?}"))),
        }
    }

    /// A request for one parameter: `id` 1 reads, 2 writes.
    fn request(&mut self, id: u8, place: CodePlace) -> Vec<u8> {
        self.reference = self.reference.wrapping_add(1);
        let [high, low] = index_of(place.code).to_be_bytes();
        vec![self.reference, id, 0, 1, 0x10, 1, high, low, 0, place.subcode]
    }

    fn check(&self, place: CodePlace, response: &[u8]) -> Result<(), AccessError> {
        let mirrored = response.first() == Some(&self.reference);
        if !mirrored {
            return Err(AccessError::NoWay(format!(
                "{place}: the response belongs to another request"
            )));
        }
        // Format 44, one value, the number.
        if let [_, id, _, _, ERROR, 1, high, low, ..] = *response
            && id & 0x80 != 0
        {
            return Err(AccessError::Refused {
                place,
                reason: reason(RecordError(u16::from_be_bytes([high, low]))),
            });
        }
        Ok(())
    }
}

fn no_way(error: impl std::fmt::Display) -> AccessError {
    AccessError::NoWay(error.to_string())
}

/// Source: error numbers of PROFIdrive, as in `drivecom::param::RecordError`.
fn reason(error: RecordError) -> String {
    let known = match error {
        RecordError::NUMBER => "the drive has no such code",
        RecordError::NOT_CHANGEABLE => "the code cannot be written",
        RecordError::LIMITS => "the value is outside the range",
        RecordError::SUBINDEX => "the code has no such subcode",
        RecordError::DATA_TYPE => "wrong number of data octets for this code",
        RecordError::STATE => "not in this state of the drive: perhaps only while the controller is inhibited",
        RecordError::VALUE => "the value is not in the selection",
        RecordError(number) => return format!("refused with error number {number:#06X}"),
    };
    known.to_owned()
}

impl ParameterAccess for Dpv1Access {
    fn read(&mut self, place: CodePlace) -> Result<i32, AccessError> {
        let request = self.request(1, place);
        let response = self.ask(place, &request)?;
        self.check(place, &response)?;
        match *response.get(4..).unwrap_or_default() {
            [WORD, 1, high, low, ..] => Ok(i32::from(u16::from_be_bytes([high, low]))),
            [DOUBLE_WORD, 1, a, b, c, d, ..] => Ok(i32::from_be_bytes([a, b, c, d])),
            _ => Err(AccessError::NoWay(format!("{place}: the response has no value"))),
        }
    }

    fn write(&mut self, place: CodePlace, raw: i32) -> Result<(), AccessError> {
        let mut request = self.request(2, place);
        match place.entry().map(|entry| entry.length) {
            Some(DataLength::Two) => {
                let [.., high, low] = raw.to_be_bytes();
                request.extend([WORD, 1, high, low]);
            }
            Some(DataLength::Four) | None => {
                request.extend([DOUBLE_WORD, 1]);
                request.extend(raw.to_be_bytes());
            }
        }
        let response = self.ask(place, &request)?;
        self.check(place, &response)
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
