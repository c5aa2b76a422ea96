//! Which way leads to the drive: options that `param`, `scope`, `monitor` and `program` share.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use dp_master::address::Address;
use dp_master::phy::PortName;
use dp_master::time::Baud;
use lenze9300_model::access::{CanAccess, Dpv1Access, FileAccess, ParameterAccess};
use lenze9300_model::bus::can::SdoChannel;
use lenze9300_model::bus::can_port::{CanPortName, open};

use crate::outcome::Failed;

/// One of the ways.
#[derive(Debug, Args)]
pub(crate) struct WayArgs {
    /// CAN port of the system bus: an interface such as can0, or slcan:/dev/ttyACM0@500, slcan:tcp://host:4001@500.
    #[arg(long, value_name = "PORT", group = "way")]
    can: Option<CanPortName>,
    /// Node address on the system bus, 1…63.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=63))]
    node: u8,
    /// Parameter channel of the system bus; another client may use the other.
    #[arg(long, value_enum, default_value_t = Channel::First)]
    channel: Channel,
    /// PROFIBUS line, by DP-V1: a serial device, or tcp://host:port of a serial-device server.
    #[arg(long, value_name = "PATH", group = "way")]
    port: Option<PortName>,
    /// Baud rate of that line in bit/s.
    #[arg(long, value_name = "RATE", default_value = "1500000")]
    baud: Baud,
    /// Station address of the drive on PROFIBUS, 0…125.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(0..=125))]
    address: u8,
    /// Our own address on PROFIBUS, 0…125; no other station may have it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=125))]
    own_address: u8,
    /// A parameter file as if it were a drive.
    #[arg(long, value_name = "FILE", group = "way")]
    file: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Channel {
    /// 1536 and 1408.
    #[value(name = "1")]
    First,
    /// 1600 and 1472.
    #[value(name = "2")]
    Second,
}

impl WayArgs {
    /// Opens the way that was chosen.
    ///
    /// # Errors
    ///
    /// [`Failed`].
    pub(crate) fn open(&self) -> Result<Box<dyn ParameterAccess>, Failed> {
        if let Some(name) = &self.can {
            let port = open(name).map_err(|error| error.to_string())?;
            let channel = match self.channel {
                Channel::First => SdoChannel::First,
                Channel::Second => SdoChannel::Second,
            };
            return Ok(Box::new(CanAccess::new(port, self.node, channel)));
        }
        if let Some(port) = &self.port {
            let address = |value| Address::new(value).map_err(|error| error.to_string());
            let (own, drive) = (address(self.own_address)?, address(self.address)?);
            let access = Dpv1Access::open(port, self.baud, own, drive)?;
            return Ok(Box::new(access));
        }
        if let Some(path) = &self.file {
            return Ok(Box::new(FileAccess::open(path)?));
        }
        Err(Failed::Given(
            "no way to the drive: --can PORT, --port PATH or --file FILE is needed".to_owned(),
        ))
    }
}
