//! Arguments that several commands share: the line and how it is driven.

use std::time::Duration;

use clap::Args;
use dp_master::address::Address;
use dp_master::phy::{Echo, SerialOptions, Transmitter};

/// How a serial adapter is driven.
#[derive(Debug, Args)]
pub(crate) struct SwitchArgs {
    /// Who switches the RS485 transmitter: adapter, rts or kernel, also as rts-inverted, and with delays in ms as rts:1:1.
    #[arg(long, value_name = "HOW", default_value = "adapter")]
    rs485: Transmitter,
    /// The adapter hears what it sends.
    #[arg(long)]
    echo: bool,
}

impl SwitchArgs {
    pub(crate) fn options(&self) -> SerialOptions {
        SerialOptions {
            transmitter: self.rs485,
            echo: if self.echo { Echo::Own } else { Echo::None },
            ..SerialOptions::default()
        }
    }
}

/// A time in seconds, 0.1…1000000.
pub(crate) fn parse_seconds(text: &str) -> Result<Duration, String> {
    text.parse()
        .ok()
        .filter(|seconds| (0.1..=1e6).contains(seconds))
        .map(Duration::from_secs_f64)
        .ok_or_else(|| "allowed are 0.1…1000000 seconds".to_owned())
}

/// A station address 0…126.
pub(crate) fn parse_station(text: &str) -> Result<Address, String> {
    text.parse()
        .ok()
        .filter(|value| *value <= Address::MAX_STATION.value())
        .and_then(|value| Address::new(value).ok())
        .ok_or_else(|| "allowed is an address 0…126".to_owned())
}

/// An ident number in hexadecimal, with or without 0x.
pub(crate) fn parse_ident(text: &str) -> Result<u16, String> {
    let digits = text
        .strip_prefix("0x")
        .or_else(|| text.strip_prefix("0X"))
        .unwrap_or(text);
    u16::from_str_radix(digits, 16).map_err(|_| "allowed is a hexadecimal number 0x0000…0xFFFF".to_owned())
}
