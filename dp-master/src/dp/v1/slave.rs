//! DP-V1 at the slave: its three ways put together, and what the application sees of them.
//!
//! | DSAP | way |
//! |---|---|
//! | 0…48 | MSAC2, a connection each |
//! | 49 | MSAC2, the resource manager |
//! | 50 | Alarm_Ack |
//! | 51 | MSAC1: Read, Write, and Alarm_Ack of masters without an access point of its own for it |

use super::abort::Abort;
use super::alarm::{AddAck, AlarmAck, AlarmType, Incident};
use super::alarms::{Alarms, SendAlarmError};
use super::capabilities::V1Capabilities;
use super::error::{ErrorCode1, V1Error};
use super::function::Function;
use super::initiate::SendTimeout;
use super::msac1::Msac1;
use super::msac2::{Connections, Notice, Peer, sap_of};
use super::pdu::{Reply, Request};
use super::service::{Answer, Held, Pdu, V1Channel, V1Request, V1RequestGone, V1RequestId, answer_with, pdu};
use super::status::V1Status;
use crate::address::Address;
use crate::dp::events::EventQueue;
use crate::dp::slave::{DpSlave, SlaveEvent};
use crate::dp::{MAX_DATA, Support, sap};
use crate::time::{Baud, Instant};

/// DP-V1 of one slave.
#[derive(Debug, Clone)]
pub(in crate::dp) struct V1Slave {
    capabilities: V1Capabilities,
    /// Of the last accepted Set_Prm.
    status: V1Status,
    msac1: Msac1,
    alarms: Alarms,
    /// The answer to an Alarm_Ack that waits to be fetched at access point 50.
    alarm_reply: Option<Pdu>,
    connections: Connections,
    next_serial: u32,
    /// The earliest deadline, kept up to date because it is asked for far more often than it changes.
    deadline: Option<Instant>,
}

/// Who asks, in what situation.
pub(in crate::dp) struct Asking {
    pub(in crate::dp) master: Address,
    pub(in crate::dp) ssap: Option<u8>,
    /// It is the master that parametrised the slave, and data are exchanged.
    pub(in crate::dp) exchanges_data: bool,
}

impl V1Slave {
    pub(in crate::dp) fn new(capabilities: V1Capabilities, baud: Baud) -> Self {
        let SendTimeout(units) = capabilities.c2_send_timeout.unwrap_or(SendTimeout::least(baud));
        Self {
            capabilities,
            status: V1Status::default(),
            msac1: Msac1::Closed,
            alarms: Alarms::NONE,
            alarm_reply: None,
            // A time of zero would have passed before it began.
            connections: Connections::new(SendTimeout(units.max(1))),
            next_serial: 0,
            deadline: None,
        }
    }

    /// DPV1_Status of a Set_Prm; zero when the slave has none.
    pub(in crate::dp) fn status_of(&self, user_prm: &[u8]) -> V1Status {
        if self.capabilities.has_status() {
            V1Status::from_user_prm(user_prm).unwrap_or_default()
        } else {
            V1Status::default()
        }
    }

    /// Whether a Set_Prm asks for something the slave does not have.
    pub(in crate::dp) fn supports(&self, status: V1Status) -> bool {
        !status.watchdog_1ms() || self.capabilities.watchdog_1ms == Support::Supported
    }

    pub(in crate::dp) fn parametrised(&mut self, status: V1Status) {
        self.status = status;
    }

    pub(in crate::dp) fn entered_data_exchange(&mut self) {
        if self.status.enabled() && self.capabilities.c1_read_write == Support::Supported {
            self.msac1 = Msac1::Idle;
        }
    }

    /// What belongs to the parametrising master ends with it; the connections of others go on.
    pub(in crate::dp) fn left_data_exchange(&mut self) {
        self.status = V1Status::default();
        self.msac1 = Msac1::Closed;
        self.alarms.clear();
        self.alarm_reply = None;
        self.refresh_deadline();
    }

    /// A telegram at one of the access points of DP-V1. Data of the answer are at the front of `scratch`.
    pub(in crate::dp) fn handle<const N: usize>(
        &mut self,
        now: Instant,
        dsap: u8,
        asking: &Asking,
        data: &[u8],
        scratch: &mut [u8; MAX_DATA],
        events: &mut EventQueue<SlaveEvent, N>,
    ) -> Answer {
        let answer = match dsap {
            sap::MSAC1 | sap::MSAC1_ALARM if asking.exchanges_data => self.handle_c1(now, dsap, data, scratch, events),
            0..=sap::MSAC2_MANAGER => self.handle_c2(now, dsap, asking, data, scratch, events),
            _ => Answer::NoService,
        };
        self.refresh_deadline();
        answer
    }

    fn handle_c1<const N: usize>(
        &mut self,
        now: Instant,
        dsap: u8,
        data: &[u8],
        scratch: &mut [u8; MAX_DATA],
        events: &mut EventQueue<SlaveEvent, N>,
    ) -> Answer {
        if dsap == sap::MSAC1_ALARM {
            return self.handle_alarm_sap(data, scratch, events);
        }
        if let Ok(Request::AlarmAck(ack)) = Request::parse(data)
            && self.takes_acks()
            && !matches!(self.msac1, Msac1::Working { .. })
        {
            let reply = self.acknowledge(ack, events);
            self.msac1 = Msac1::Ready { reply };
            return Answer::Acknowledge;
        }
        let serial = self.serial();
        let timeout = self.capabilities.c1_response_timeout;
        self.msac1.handle(now, data, serial, timeout, scratch)
    }

    fn handle_alarm_sap<const N: usize>(
        &mut self,
        data: &[u8],
        scratch: &mut [u8; MAX_DATA],
        events: &mut EventQueue<SlaveEvent, N>,
    ) -> Answer {
        if !self.takes_acks() {
            return Answer::NoService;
        }
        if data.is_empty() {
            return match self.alarm_reply.take() {
                Some(reply) => answer_with(&reply, scratch),
                None => Answer::Acknowledge,
            };
        }
        self.alarm_reply = Some(match Request::parse(data) {
            Ok(Request::AlarmAck(ack)) => self.acknowledge(ack, events),
            _ => refused_ack(ErrorCode1::INVALID_PARAMETER),
        });
        Answer::Acknowledge
    }

    fn takes_acks(&self) -> bool {
        self.status.enabled() && self.capabilities.alarms.0 != 0
    }

    fn acknowledge<const N: usize>(&mut self, ack: AlarmAck, events: &mut EventQueue<SlaveEvent, N>) -> Pdu {
        match self.alarms.acknowledge(ack) {
            Some(alarm) => {
                events.push(SlaveEvent::AlarmAcknowledged { alarm });
                pdu(&Reply::AlarmAck(ack))
            }
            None => refused_ack(ErrorCode1::STATE_CONFLICT),
        }
    }

    fn handle_c2<const N: usize>(
        &mut self,
        now: Instant,
        dsap: u8,
        asking: &Asking,
        data: &[u8],
        scratch: &mut [u8; MAX_DATA],
        events: &mut EventQueue<SlaveEvent, N>,
    ) -> Answer {
        let Some(ssap) = asking.ssap else {
            return Answer::NoService;
        };
        let master = asking.master;
        let peer = Peer { master, ssap };
        if dsap == sap::MSAC2_MANAGER {
            let (answer, notice) = self.connections.manage(now, peer, data, &self.capabilities, scratch);
            if let Some((sap, notice)) = notice {
                tell(events, sap, master, notice);
            }
            return answer;
        }
        let serial = self.serial();
        let Some(connection) = self.connections.at(dsap) else {
            return Answer::NoService;
        };
        let (answer, notice) = connection.handle(now, peer, data, serial, scratch);
        if let Some(notice) = notice {
            tell(events, dsap, master, notice);
        }
        answer
    }

    pub(in crate::dp) fn handle_timeout<const N: usize>(
        &mut self,
        now: Instant,
        events: &mut EventQueue<SlaveEvent, N>,
    ) {
        if self.deadline.is_none_or(|at| now < at) {
            return;
        }
        self.msac1.handle_timeout(now);
        for (place, connection) in self.connections.connections.iter_mut().enumerate() {
            let master = connection.peer().map(|peer| peer.master);
            if let (Some(notice), Some(master)) = (connection.handle_timeout(now), master) {
                tell(events, sap_of(place), master, notice);
            }
        }
        self.refresh_deadline();
    }

    pub(in crate::dp) fn deadline(&self) -> Option<Instant> {
        self.deadline
    }

    fn refresh_deadline(&mut self) {
        let connections = self.connections.connections.iter();
        self.deadline = connections
            .filter_map(|connection| connection.deadline())
            .chain(self.msac1.deadline())
            .min();
    }

    /// Numbers requests; it comes round after four thousand million of them.
    fn serial(&mut self) -> u32 {
        self.next_serial = self.next_serial.wrapping_add(1);
        self.next_serial
    }

    /// The alarm for the diagnosis the master reads now, at the front of `target`; its length.
    pub(in crate::dp) fn announce_alarm(&mut self, target: &mut [u8]) -> usize {
        self.alarms.announce(target)
    }

    /// An alarm waits for a diagnosis to carry it.
    pub(in crate::dp) fn has_queued_alarm(&self) -> bool {
        self.alarms.is_queued()
    }

    fn poll_request(&mut self, owner: Option<Address>) -> Option<V1Request> {
        if let Msac1::Working { request, .. } = &mut self.msac1
            && !request.told
            && let Some(master) = owner
        {
            return Some(tell_request(V1Channel::Msac1, master, request));
        }
        let mut connections = self.connections.connections.iter_mut().enumerate();
        connections.find_map(|(place, connection)| {
            let (peer, request) = connection.untold()?;
            let sap = sap_of(place);
            Some(tell_request(V1Channel::Msac2 { sap }, peer.master, request))
        })
    }

    fn respond(&mut self, now: Instant, id: V1RequestId, answer: Result<&[u8], V1Error>) -> Result<(), V1RequestGone> {
        let result = match id.channel {
            V1Channel::Msac1 => self.msac1.respond(id.serial, answer),
            V1Channel::Msac2 { sap } => {
                let max_data = self.capabilities.c2_max_data;
                let connection = self.connections.at(sap).ok_or(V1RequestGone)?;
                connection.respond(now, id.serial, answer, max_data)
            }
        };
        self.refresh_deadline();
        result
    }
}

fn tell_request(channel: V1Channel, master: Address, request: &mut Held) -> V1Request {
    request.told = true;
    let serial = request.serial;
    V1Request {
        id: V1RequestId { channel, serial },
        master,
        service: request.service,
    }
}

fn tell<const N: usize>(events: &mut EventQueue<SlaveEvent, N>, sap: u8, master: Address, notice: Notice) {
    events.push(match notice {
        Notice::Opened => SlaveEvent::ConnectionOpened { sap, master },
        Notice::Closed(abort) => SlaveEvent::ConnectionClosed { sap, abort },
    });
}

fn refused_ack(code_1: ErrorCode1) -> Pdu {
    pdu(&Reply::Negative {
        function: Function::AlarmAck,
        error: V1Error::new(code_1),
    })
}

/// Data records, connections and alarms (DP-V1).
///
/// The application is asked and answers when it can; the cyclic exchange never waits for it. One request of MSAC1 and one of each
/// connection may wait at a time.
///
/// # Example
///
/// A device with one data record, index 1 in slot 0:
///
/// ```
/// use dp_master::dp::DpSlave;
/// use dp_master::dp::v1::{ErrorCode1, V1Error, V1Service};
/// # use dp_master::time::Instant;
///
/// fn serve(slave: &mut DpSlave, now: Instant, record: &mut Vec<u8>) {
///     while let Some(request) = slave.poll_v1_request() {
///         let answer = match request.service {
///             V1Service::Read { slot: 0, index: 1, .. } => Ok(&record[..]),
///             V1Service::Write { slot: 0, index: 1, data } => {
///                 *record = data.to_vec();
///                 Ok(&[][..])
///             }
///             _ => Err(V1Error::new(ErrorCode1::INVALID_INDEX)),
///         };
///         // A request that was given up in the meantime needs no answer.
///         let _ = slave.respond_v1(now, request.id, answer);
///     }
/// }
/// ```
impl DpSlave {
    /// The next request for the application; each is told once, and waits for [`respond_v1`](Self::respond_v1).
    pub fn poll_v1_request(&mut self) -> Option<V1Request> {
        let owner = self.device.master();
        self.device.v1.poll_request(owner)
    }

    /// Answers a request: with data (ignored for a Write), or with a refusal.
    ///
    /// # Errors
    ///
    /// [`V1RequestGone`] when the request no longer waits: it took too long, or the one who asked is gone.
    pub fn respond_v1(
        &mut self,
        now: Instant,
        id: V1RequestId,
        answer: Result<&[u8], V1Error>,
    ) -> Result<(), V1RequestGone> {
        self.device.v1.respond(now, id, answer)
    }

    /// Ends a connection; its master fetches the Abort with its next poll. Nothing happens where there is none.
    pub fn abort_connection(&mut self, now: Instant, sap: u8, abort: Abort) {
        let device = &mut self.device;
        let Some(connection) = device.v1.connections.at(sap) else {
            return;
        };
        if let Some(Notice::Closed(abort)) = connection.abort(now, abort) {
            device.push_event(SlaveEvent::ConnectionClosed { sap, abort });
        }
        device.v1.refresh_deadline();
    }

    /// Sends an alarm with at most 59 octets of data: it is announced, stands in the next diagnosis the master reads, and waits for
    /// [`SlaveEvent::AlarmAcknowledged`], which carries the returned value again. The sequence number is chosen here.
    ///
    /// # Errors
    ///
    /// [`SendAlarmError`]; nothing is sent then.
    pub fn send_alarm(
        &mut self,
        (alarm_type, slot): (AlarmType, u8),
        incident: Incident,
        add_ack: AddAck,
        data: &[u8],
    ) -> Result<AlarmAck, SendAlarmError> {
        let device = &mut self.device;
        let exchanges_data = device.exchanges_data();
        let v1 = &mut device.v1;
        let status = if exchanges_data { v1.status } else { V1Status::default() };
        let ack = v1
            .alarms
            .send(&v1.capabilities, status, (alarm_type, slot), (incident, add_ack), data)?;
        device.announce_diagnosis();
        Ok(ack)
    }

    /// Alarms that wait to be announced or acknowledged.
    pub fn waiting_alarms(&self) -> usize {
        self.device.v1.alarms.waiting()
    }

    /// DPV1_Status of the last accepted Set_Prm; zero without one, and for a DP-V0 slave.
    pub fn v1_status(&self) -> V1Status {
        self.device.v1.status
    }
}
