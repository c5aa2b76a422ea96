//! DP-V1: data records, connections and alarms beside the cyclic exchange, master and slave side.
//!
//! | way | who asks | what | slave's access point |
//! |---|---|---|---|
//! | MSAC1 | the master that parametrised the slave (class 1), while data are exchanged | Read, Write, Alarm_Ack | 51, alarms 50 |
//! | MSAC2 | any master (class 2), in any state of the slave | Initiate, Read, Write, Data_Transport, Idle, Abort | 49, then 0…48 |
//!
//! On the wire all of it looks the same: the PDU goes out as SRD and is acknowledged (`E5`); empty SRDs poll for the response, acknowledged
//! while the slave works, answered with the response when it has one.
//!
//! ```text
//! master                                   slave
//!   │  SRD 51  5E 00 2F F0                   │   read slot 0, index 47, at most 240 octets
//!   │ ─────────────────────────────────────► │
//!   │ ◄──────────────────────────────── E5   │   the application is asked
//!   │            Data_Exchange …             │   the cyclic exchange goes on
//!   │  SRD 51  (empty) ────────────────────► │
//!   │ ◄──────────────────────────────── E5   │   it still works
//!   │            Data_Exchange …             │
//!   │  SRD 51  (empty) ────────────────────► │
//!   │ ◄─────────────────  DL 5E 00 2F 04 …   │   the answer
//! ```
//!
//! Concepts and files: [`Function`], [`Request`] and [`Reply`] (PDUs), [`V1Error`], [`Abort`], [`Initiate`], [`Alarm`], [`V1Status`]
//! (user parameters), [`V1Capabilities`] (GSD); at the slave [`DpSlave::poll_v1_request`](super::DpSlave::poll_v1_request) and `msac1`,
//! `msac2`, `alarms`; at the master [`Msac1Client`], [`Msac2Client`] and [`alarms_of`].
//!
//! Source: IEC 61158-6-3 (services and machines MSAC1, MSAC2, MSAL1 of masters and slaves).

mod abort;
mod alarm;
mod alarms;
mod capabilities;
mod client;
mod error;
mod function;
mod initiate;
mod msac1;
mod msac1_client;
mod msac2;
mod msac2_client;
mod pdu;
mod service;
mod slave;
mod status;

pub use abort::{Abort, Instance, reason};
pub use alarm::{
    AddAck, Alarm, AlarmAck, AlarmSpecifier, AlarmType, AlarmTypes, Incident, MAX_ALARM_DATA, V1Block, alarms_of,
};
pub use alarms::{MAX_ALARMS, SendAlarmError};
pub use capabilities::{MAX_CONNECTIONS, V1Capabilities};
pub use client::{V1Answer, V1ClientError, V1Failure};
pub use error::{ErrorClass, ErrorCode1, V1Error};
pub use function::{Function, NEGATIVE};
pub use initiate::{Addresses, DeviceAddress, Features, Initiate, Initiated, Resource, SendTimeout};
pub use msac1_client::{AlarmSap, Msac1Client};
pub use msac2_client::{Connected, Msac2Client, Msac2Event};
pub use pdu::{EncodePduError, MAX_V1_DATA, PduError, Reply, Request};
pub(in crate::dp) use service::Answer;
pub use service::{V1Channel, V1Data, V1Request, V1RequestGone, V1RequestId, V1Service};
pub(in crate::dp) use slave::{Asking, V1Slave};
pub use status::{AlarmMode, V1Status};
