//! A telegram, or octets that are none, as a JSON object.

use dp_master::phy::{Content, Direction, Trace};
use dp_master::wire::{FunctionCode, Hex, Pretty, Service, Telegram};
use serde::Serialize;

/// What stands on a line of `--json`. Octets are pairs of hexadecimal digits, separated by spaces.
#[derive(Debug, Serialize)]
pub(crate) struct TelegramRecord {
    /// `telegram`, or `discarded` for octets that belong to none.
    #[serde(rename = "type")]
    kind: &'static str,
    /// Time of the first bit in seconds, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    time_s: Option<f64>,
    /// `sent`, where a capture knows that the recording station sent it.
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<&'static str>,
    /// SD1, SD2, SD3, SD4 or SC.
    #[serde(skip_serializing_if = "Option::is_none")]
    format: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    service: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sa: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    da: Option<u8>,
    /// Function code.
    #[serde(skip_serializing_if = "Option::is_none")]
    fc: Option<String>,
    /// `request` or `response`.
    #[serde(skip_serializing_if = "Option::is_none")]
    role: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ssap: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    dsap: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    data: Option<String>,
    /// The telegram in words, or why the octets are none.
    text: String,
    octets: String,
}

impl TelegramRecord {
    /// A trace without its time.
    pub(crate) fn new(trace: &Trace<'_>) -> Self {
        let octets = Hex(trace.octets).to_string();
        let telegram = match trace.content {
            Content::Telegram(telegram) => telegram,
            Content::Discarded { reason, .. } => return Self::bare("discarded", reason.to_string(), octets),
        };
        let text = Pretty(&telegram).to_string();
        let record = Self {
            format: Some(match trace.octets.first() {
                Some(0x10) => "SD1",
                Some(0xA2) => "SD3",
                Some(0xDC) => "SD4",
                Some(0xE5) => "SC",
                _ => "SD2",
            }),
            service: Some(Service::of(&telegram).name()),
            ..Self::bare("telegram", text, octets)
        };
        match telegram {
            Telegram::ShortAck => record,
            Telegram::Token { da, sa } => Self {
                sa: Some(sa.value()),
                da: Some(da.value()),
                ..record
            },
            Telegram::Data { header, data } => Self {
                sa: Some(header.sa.value()),
                da: Some(header.da.value()),
                fc: Some(format!("{:02X}", header.fc.to_octet())),
                role: Some(match header.fc {
                    FunctionCode::Request { .. } => "request",
                    FunctionCode::Response { .. } => "response",
                }),
                ssap: header.ssap,
                dsap: header.dsap,
                data: Some(Hex(data).to_string()),
                ..record
            },
        }
    }

    /// The same with its time in seconds and who sent it.
    pub(crate) fn timed(trace: &Trace<'_>, time_s: f64) -> Self {
        Self {
            time_s: Some(time_s),
            direction: (trace.direction == Direction::Sent).then_some("sent"),
            ..Self::new(trace)
        }
    }

    const fn bare(kind: &'static str, text: String, octets: String) -> Self {
        Self {
            kind,
            time_s: None,
            direction: None,
            format: None,
            service: None,
            sa: None,
            da: None,
            fc: None,
            role: None,
            ssap: None,
            dsap: None,
            data: None,
            text,
            octets,
        }
    }
}
