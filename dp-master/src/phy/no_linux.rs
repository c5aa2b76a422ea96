//! Stands in for `linux` where its settings do not exist or their numbers are others.

use std::io;

use super::serial::RtsLevel;

/// There is no such setting here.
pub(super) fn set_low_latency<P>(_: &P) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// There is no such setting here.
pub(super) fn set_rs485<P>(_: &P, _: RtsLevel, _: u32, _: u32) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Not here: processes started later inherit the terminal.
pub(super) fn close_on_exec<P>(_: &P) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Not here.
pub(super) fn set_real_time() -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
