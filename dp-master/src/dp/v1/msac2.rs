//! MSAC2 at the slave: connections of masters of class 2, opened by the resource manager.
//!
//! A connection does not depend on data exchange. Its access point (48 for the first, 47 for the second…) exists for the master and SSAP that
//! opened it, and for nobody else.
//!
//! ```text
//!          Initiate at 49                poll                 Read, Write, Data_Transport
//!  Free ────────────────► Ready(Open) ─────────► Open ─────────────────────────► Working
//!   ▲                        ▲                    │ ▲                               │
//!   │                        │        Idle        │ │            poll               │ answer
//!   │                        └────────────────────┘ └────────────── Ready(Open) ◄───┘
//!   │                                                                   │ │
//!   │   poll                        what must not be, U expired         │ │
//!   ├──────────── Ready(Free) ◄─────────────────────────────────────────┴─┘ (from every bound state)
//!   │
//!   └──────────── Abort of the master, F or I expired (from every bound state)
//! ```
//!
//! | # | state | event | answer | next |
//! |---|---|---|---|---|
//! | 1 | Free | valid Initiate at 49 | Resource at once | Ready, Initiate response, then Open |
//! | 2 | Free | something else at 49 | Resource at once | Ready, Abort ABT_FE or ABT_IA, then Free |
//! | 3 | all bound | Initiate at 49, no connection left | RS | – |
//! | 4 | Ready, then Open | poll | the PDU | Open |
//! | 5 | Ready, then Free | poll | the PDU | Free |
//! | 6 | Open, Working | poll | `E5` | the same |
//! | 7 | Open | Read, Write, Data_Transport | `E5` | Working |
//! | 8 | Open | Idle | `E5` | Ready, Idle, then Open |
//! | 9 | Open | slot 255 | `E5` | Ready, refusal, then Open |
//! | 10 | Open | Initiate or Alarm_Ack | `E5` | Ready, Abort ABT_SE, then Free |
//! | 11 | Open | no PDU of DP-V1 | `E5` | Ready, Abort ABT_FE, then Free |
//! | 12 | Working, Ready then Open | any PDU but Abort | `E5` | Ready, Abort ABT_SE, then Free |
//! | 13 | Ready then Free | any PDU but Abort | `E5` | the same |
//! | 14 | all but Free | Abort | `E5` | Free |
//! | 15 | Working | the application answers | – | Ready, response, then Open |
//! | 16 | all but Free | the application aborts | – | Ready, Abort, then Free |
//! | 17 | Working | U expires | – | Ready, Abort ABT_TO, then Free |
//! | 18 | Ready | F expires | – | Free |
//! | 19 | Open | I expires | – | Free |
//! | 20 | any | another master or SSAP | RS | the same |
//!
//! The times are those of [`SendTimeout`]. Source: IEC 61158-6-3, MSRM2S and MSAC2S; 2, 12 and the order of things at access point 49 as
//! observed at slave firmware.

use super::abort::{Abort, reason};
use super::capabilities::{MAX_CONNECTIONS, V1Capabilities};
use super::error::V1Error;
use super::initiate::{Features, Initiated, Resource, SendTimeout};
use super::pdu::{MAX_V1_DATA, PduError, Reply, Request};
use super::service::{Answer, Held, NO_SUCH_SLOT, Pdu, RESERVED_SLOT, V1RequestGone, V1Service, answer_with, pdu};
use crate::address::Address;
use crate::dp::{MAX_DATA, sap};
use crate::time::Instant;

/// Who may speak at the access point of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Peer {
    pub(super) master: Address,
    pub(super) ssap: u8,
}

/// What a connection tells the application.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Notice {
    Opened,
    Closed(Abort),
}

/// One connection.
#[derive(Debug, Clone)]
#[expect(
    clippy::large_enum_variant,
    reason = "the buffers lie in place; there is no heap to move them to"
)]
pub(super) enum Connection {
    Free,
    Bound(Bound),
}

#[derive(Debug, Clone)]
pub(super) struct Bound {
    peer: Peer,
    send_timeout: SendTimeout,
    phase: Phase,
}

/// What a bound connection waits for, and how long.
#[derive(Debug, Clone)]
enum Phase {
    /// The next request; timer I.
    Open { until: Instant },
    /// The application; timer U.
    Working { request: Held, until: Instant },
    /// The poll that fetches the PDU; timer F.
    Ready { reply: Pdu, until: Instant, then: Then },
}

/// What follows a fetched PDU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Then {
    /// It was a response.
    Open,
    /// It was an Abort.
    Free,
}

impl Connection {
    /// Transitions 1 and 2: the resource manager gives the connection away. The PDU is not empty.
    pub(super) fn bind(
        &mut self,
        now: Instant,
        peer: Peer,
        data: &[u8],
        own_timeout: SendTimeout,
        capabilities: &V1Capabilities,
    ) -> Option<Notice> {
        let (send_timeout, result) = match Request::parse(data) {
            Ok(Request::Initiate(initiate)) => {
                let initiated = Initiated {
                    max_data: capabilities.c2_max_data.min(MAX_V1_DATA as u8),
                    features: Features::READ_WRITE,
                    profile_features: capabilities.profile_features,
                    profile_ident: capabilities.profile_ident,
                    // Interpretation: as they came; nothing says that they are exchanged.
                    addresses: initiate.addresses,
                };
                let timeout = initiate.send_timeout.max(own_timeout);
                (timeout, Ok(pdu(&Reply::Initiated(initiated))))
            }
            Err(PduError::Addresses) => (own_timeout, Err(reason::INVALID_ADDRESS)),
            Ok(_) | Err(_) => (own_timeout, Err(reason::INVALID_REQUEST)),
        };
        let until = now + send_timeout.time();
        let (phase, notice) = match result {
            Ok(reply) => {
                let then = Then::Open;
                (Phase::Ready { reply, until, then }, Some(Notice::Opened))
            }
            // The application never heard of it.
            Err(reason) => (aborting(Abort::msac2(reason), until), None),
        };
        *self = Self::Bound(Bound {
            peer,
            send_timeout,
            phase,
        });
        notice
    }

    /// A telegram at the access point of the connection, transitions 4 to 14 and 20.
    pub(super) fn handle(
        &mut self,
        now: Instant,
        peer: Peer,
        data: &[u8],
        serial: u32,
        scratch: &mut [u8; MAX_DATA],
    ) -> (Answer, Option<Notice>) {
        let Self::Bound(bound) = self else {
            return (Answer::NoService, None);
        };
        if bound.peer != peer {
            return (Answer::NoService, None);
        }
        if data.is_empty() {
            let Phase::Ready { reply, then, .. } = &bound.phase else {
                return (Answer::Acknowledge, None);
            };
            let answer = answer_with(reply, scratch);
            match then {
                Then::Open => {
                    let until = now + bound.send_timeout.twice();
                    bound.phase = Phase::Open { until };
                }
                Then::Free => *self = Self::Free,
            }
            return (answer, None);
        }
        let request = Request::parse(data);
        let is_aborting = matches!(bound.phase, Phase::Ready { then: Then::Free, .. });
        let notice = match (&bound.phase, request) {
            (_, Ok(Request::Abort(abort))) => {
                *self = Self::Free;
                (!is_aborting).then_some(Notice::Closed(abort))
            }
            (Phase::Ready { then: Then::Free, .. }, _) => None,
            (Phase::Working { .. } | Phase::Ready { .. }, _) => bound.abort(now, Abort::msac2(reason::SEQUENCE)),
            (Phase::Open { .. }, Ok(request)) => bound.take(now, &request, serial),
            (Phase::Open { .. }, Err(_)) => bound.abort(now, Abort::msac2(reason::INVALID_REQUEST)),
        };
        (Answer::Acknowledge, notice)
    }

    /// Transition 15.
    pub(super) fn respond(
        &mut self,
        now: Instant,
        serial: u32,
        answer: Result<&[u8], V1Error>,
        max_data: u8,
    ) -> Result<(), V1RequestGone> {
        match self {
            Self::Bound(bound) => match &bound.phase {
                Phase::Working { request, .. } if request.serial == serial => {
                    let reply = request.reply(answer, max_data);
                    bound.ready(now, reply);
                    Ok(())
                }
                _ => Err(V1RequestGone),
            },
            Self::Free => Err(V1RequestGone),
        }
    }

    /// Transition 16; `None` when there is nothing to end.
    pub(super) fn abort(&mut self, now: Instant, abort: Abort) -> Option<Notice> {
        match self {
            Self::Bound(bound) if !matches!(bound.phase, Phase::Ready { then: Then::Free, .. }) => {
                bound.abort(now, abort)
            }
            _ => None,
        }
    }

    /// Transitions 17 to 19.
    pub(super) fn handle_timeout(&mut self, now: Instant) -> Option<Notice> {
        let Self::Bound(bound) = self else { return None };
        if now < bound.deadline() {
            return None;
        }
        let timeout = Abort::msac2(reason::TIMEOUT);
        match bound.phase {
            Phase::Working { .. } => bound.abort(now, timeout),
            Phase::Ready { then: Then::Free, .. } => {
                *self = Self::Free;
                None
            }
            Phase::Ready { then: Then::Open, .. } | Phase::Open { .. } => {
                *self = Self::Free;
                Some(Notice::Closed(timeout))
            }
        }
    }

    pub(super) fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Free => None,
            Self::Bound(bound) => Some(bound.deadline()),
        }
    }

    pub(super) fn peer(&self) -> Option<Peer> {
        match self {
            Self::Free => None,
            Self::Bound(bound) => Some(bound.peer),
        }
    }

    /// The request the application has not heard of yet.
    pub(super) fn untold(&mut self) -> Option<(Peer, &mut Held)> {
        match self {
            Self::Bound(Bound {
                peer,
                phase: Phase::Working { request, .. },
                ..
            }) if !request.told => Some((*peer, request)),
            _ => None,
        }
    }
}

impl Bound {
    /// Transitions 7 to 10.
    fn take(&mut self, now: Instant, request: &Request<'_>, serial: u32) -> Option<Notice> {
        match (*request, Held::new(serial, request)) {
            (Request::Idle, _) => {
                self.ready(now, pdu(&Reply::Idle));
                None
            }
            (_, Some(held)) if slot(&held.service) == RESERVED_SLOT => {
                self.ready(now, held.reply(Err(NO_SUCH_SLOT), 0));
                None
            }
            (_, Some(request)) => {
                let until = now + self.send_timeout.time();
                self.phase = Phase::Working { request, until };
                None
            }
            (_, None) => self.abort(now, Abort::msac2(reason::SEQUENCE)),
        }
    }

    fn ready(&mut self, now: Instant, reply: Pdu) {
        let until = now + self.send_timeout.time();
        let then = Then::Open;
        self.phase = Phase::Ready { reply, until, then };
    }

    /// The one way to end a connection that the other side does not know of yet.
    fn abort(&mut self, now: Instant, abort: Abort) -> Option<Notice> {
        self.phase = aborting(abort, now + self.send_timeout.time());
        Some(Notice::Closed(abort))
    }

    fn deadline(&self) -> Instant {
        match self.phase {
            Phase::Open { until } | Phase::Working { until, .. } | Phase::Ready { until, .. } => until,
        }
    }
}

fn aborting(abort: Abort, until: Instant) -> Phase {
    Phase::Ready {
        reply: pdu(&Reply::Abort(abort)),
        until,
        then: Then::Free,
    }
}

const fn slot(service: &V1Service) -> u8 {
    service.place().0
}

/// All connections of a slave.
#[derive(Debug, Clone)]
pub(super) struct Connections {
    pub(super) connections: [Connection; MAX_CONNECTIONS],
    own_timeout: SendTimeout,
}

impl Connections {
    pub(super) const fn new(own_timeout: SendTimeout) -> Self {
        Self {
            connections: [const { Connection::Free }; MAX_CONNECTIONS],
            own_timeout,
        }
    }

    /// A telegram at access point 49. The new connection's access point, when there is one, comes with its notice.
    pub(super) fn manage(
        &mut self,
        now: Instant,
        peer: Peer,
        data: &[u8],
        capabilities: &V1Capabilities,
        scratch: &mut [u8; MAX_DATA],
    ) -> (Answer, Option<(u8, Notice)>) {
        let count = usize::from(capabilities.c2_connections);
        let mut known = self.connections.iter_mut().take(count).enumerate();
        let free = known.find(|(_, connection)| matches!(connection, Connection::Free));
        let Some((place, connection)) = free else {
            return (Answer::NoService, None);
        };
        if data.is_empty() {
            // Interpretation: who asks for nothing gets no connection.
            return (Answer::Acknowledge, None);
        }
        let sap = sap_of(place);
        let notice = connection.bind(now, peer, data, self.own_timeout, capabilities);
        let resource = Resource {
            sap,
            send_timeout: self.own_timeout,
        };
        let answer = answer_with(&pdu(&Reply::Resource(resource)), scratch);
        (answer, notice.map(|notice| (sap, notice)))
    }

    /// The connection at an access point.
    pub(super) fn at(&mut self, sap: u8) -> Option<&mut Connection> {
        let place = FIRST_SAP.checked_sub(sap)?;
        self.connections.get_mut(usize::from(place))
    }
}

/// The access point of the connection at this place.
pub(super) const fn sap_of(place: usize) -> u8 {
    // There are far fewer places than access points.
    FIRST_SAP - place as u8
}

/// The access point of the first connection; the others are below.
const FIRST_SAP: u8 = sap::MSAC2_MANAGER - 1;
