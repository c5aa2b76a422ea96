//! The parameter channel: eight octets each way, one job at a time, acknowledged by an inverted bit.
//!
//! - [`Frame`] is the eight octets, [`Service`] its first octet, [`DataLength`] the left-aligned data.
//! - [`Job`] is what a master asks; [`ErrorCode`] is how a drive refuses.
//! - [`RecordRequest`] and [`RecordResponse`] are the same for several parameters at once, in a data record of DP-V1.
//! - [`Server`] answers (drive side), [`Client`] asks (master side). Neither does I/O or knows a clock.
//!
//! Source: 9300 fact sheet, section 3; film-feed specification, section 3.

mod client;
mod error;
mod frame;
mod job;
mod record;
mod server;
mod value;

pub use client::{Client, ClientOptions, EchoRule, Reply, RequestError, RequestRefused};
pub use error::ErrorCode;
pub use frame::{Frame, Service};
pub use job::{Job, JobKind};
pub use record::{
    MAX_RECORD, RECORD_INDEX, RECORD_SLOT, RecordError, RecordJob, RecordKind, RecordRequest, RecordRequestError,
    RecordResponse, RecordResult,
};
pub use server::{AnswerStyle, Handshake, Server, ServerAction, ServerOptions};
pub use value::DataLength;
