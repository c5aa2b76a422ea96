//! What is asked of Linux and no crate offers without `unsafe`: low latency and the RS485 mode of a terminal, keeping a terminal out of
//! processes started later, real-time priority of a thread.
//!
//! ```text
//! TIOCGSERIAL, TIOCSSERIAL   struct serial_struct: flag ASYNC_LOW_LATENCY
//! TIOCSRS485                 struct serial_rs485: RTS around each transmission, switched by the driver
//! sched_setscheduler         SCHED_FIFO for the calling thread
//! ```
//!
//! Source: Linux `include/uapi/linux/serial.h`, `include/uapi/linux/tty_flags.h`, `include/uapi/asm-generic/ioctls.h`,
//! `Documentation/driver-api/serial/serial-rs485.rst`; sched_setscheduler(2).
#![allow(
    unsafe_code,
    reason = "an ioctl takes a request number and a pointer whose meaning only this module knows, `serialport` gives raw descriptors, and no crate without side effects sets a scheduling policy"
)]

use std::ffi::{c_char, c_int, c_uint, c_ulong, c_ushort};
use std::io;
use std::os::fd::{AsRawFd, BorrowedFd};

use rustix::ioctl::{self, Getter, Setter, Updater};

use super::serial::RtsLevel;

/// Asks the driver not to gather octets. FTDI adapters set their latency timer to 1 ms with it.
///
/// # Errors
///
/// That of the system: a pseudo-terminal and some adapters know no such setting.
pub(super) fn set_low_latency(port: &impl AsRawFd) -> io::Result<()> {
    // SAFETY: the descriptor is open as long as `port` is borrowed.
    let fd = unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) };
    // SAFETY: TIOCGSERIAL writes one `serial_struct`, which is all integers and a pointer that is never followed.
    let mut settings = unsafe { ioctl::ioctl(fd, Getter::<TIOCGSERIAL, SerialStruct>::new())? };
    let Some(flags) = with_low_latency(settings.flags) else {
        return Ok(());
    };
    settings.flags = flags;
    // SAFETY: TIOCSSERIAL reads one `serial_struct`; this one came from the driver, with one flag more.
    unsafe { ioctl::ioctl(fd, Setter::<TIOCSSERIAL, SerialStruct>::new(settings))? };
    Ok(())
}

/// Lets the driver switch the transmitter with RTS; delays in milliseconds.
///
/// # Errors
///
/// That of the system: most USB adapters and pseudo-terminals have no such mode.
pub(super) fn set_rs485(port: &impl AsRawFd, on_send: RtsLevel, before_ms: u32, after_ms: u32) -> io::Result<()> {
    let mut mode = SerialRs485 {
        flags: rs485_flags(on_send),
        delay_rts_before_send: before_ms,
        delay_rts_after_send: after_ms,
        padding: [0; 5],
    };
    // SAFETY: the descriptor is open as long as `port` is borrowed.
    let fd = unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) };
    // SAFETY: TIOCSRS485 reads one `serial_rs485` and writes back to it what the driver made of it.
    unsafe { ioctl::ioctl(fd, Updater::<TIOCSRS485, SerialRs485>::new(&mut mode))? };
    Ok(())
}

/// Keeps a terminal out of processes that are started later: one that inherited our end would keep the line open for ever.
///
/// # Errors
///
/// That of the system.
pub(super) fn close_on_exec(port: &impl AsRawFd) -> io::Result<()> {
    // SAFETY: the descriptor is open as long as `port` is borrowed.
    let fd = unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) };
    Ok(rustix::io::fcntl_setfd(fd, rustix::io::FdFlags::CLOEXEC)?)
}

/// The flags of a terminal with low latency, `None` when they say so already.
const fn with_low_latency(flags: c_int) -> Option<c_int> {
    if flags & ASYNC_LOW_LATENCY != 0 {
        None
    } else {
        Some(flags | ASYNC_LOW_LATENCY)
    }
}

/// The flags that switch the mode on, with RTS set while sending, or for an inverted adapter at all other times.
const fn rs485_flags(on_send: RtsLevel) -> u32 {
    ENABLED
        | match on_send {
            RtsLevel::High => RTS_ON_SEND,
            RtsLevel::Low => RTS_AFTER_SEND,
        }
}

/// Policy FIFO with the least priority for the calling thread.
///
/// # Errors
///
/// That of the system: EPERM for who may not.
pub(super) fn set_real_time() -> io::Result<()> {
    // SAFETY: a structure of integers, for which zero is a value.
    let mut param: libc::sched_param = unsafe { std::mem::zeroed() };
    param.sched_priority = LEAST_REAL_TIME;
    // SAFETY: reads one `sched_param`; thread 0 is the calling one.
    match unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const param) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// `struct serial_struct`.
#[repr(C)]
struct SerialStruct {
    kind: c_int,
    line: c_int,
    port: c_uint,
    irq: c_int,
    flags: c_int,
    xmit_fifo_size: c_int,
    custom_divisor: c_int,
    baud_base: c_int,
    close_delay: c_ushort,
    io_type: c_char,
    reserved_char: [c_char; 1],
    hub6: c_int,
    closing_wait: c_ushort,
    closing_wait2: c_ushort,
    iomem_base: *mut u8,
    iomem_reg_shift: c_ushort,
    port_high: c_uint,
    iomap_base: c_ulong,
}

/// `struct serial_rs485`.
#[repr(C)]
struct SerialRs485 {
    flags: u32,
    delay_rts_before_send: u32,
    delay_rts_after_send: u32,
    padding: [u32; 5],
}

const LEAST_REAL_TIME: c_int = 1;
const TIOCGSERIAL: ioctl::Opcode = 0x541E;
const TIOCSSERIAL: ioctl::Opcode = 0x541F;
const TIOCSRS485: ioctl::Opcode = 0x542F;
const ASYNC_LOW_LATENCY: c_int = 1 << 13;
const ENABLED: u32 = 1 << 0;
const RTS_ON_SEND: u32 = 1 << 1;
const RTS_AFTER_SEND: u32 = 1 << 2;

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::TTYPort;

    #[test]
    fn the_layouts_are_those_of_the_kernel() {
        // linux/serial.h: serial_struct has 72 octets where a pointer has 8, 60 where it has 4; serial_rs485 has 32.
        let wanted = if size_of::<usize>() == 8 { 72 } else { 60 };
        assert_eq!(size_of::<SerialStruct>(), wanted);
        assert_eq!(std::mem::offset_of!(SerialStruct, flags), 16);
        assert_eq!(size_of::<SerialRs485>(), 32);
    }

    /// linux/serial.h: SER_RS485_ENABLED 1, SER_RS485_RTS_ON_SEND 2, SER_RS485_RTS_AFTER_SEND 4; linux/tty_flags.h:
    /// ASYNCB_LOW_LATENCY is bit 13.
    #[test]
    fn the_flags_are_those_of_the_kernel() {
        assert_eq!(rs485_flags(RtsLevel::High), 3);
        assert_eq!(rs485_flags(RtsLevel::Low), 5);
        assert_eq!(with_low_latency(0x0010), Some(0x2010));
        assert_eq!(with_low_latency(0x2010), None);
    }

    #[test]
    fn a_pseudo_terminal_knows_neither_setting_and_says_so() {
        let (_near, far) = TTYPort::pair().unwrap();
        // 25 is ENOTTY, "inappropriate ioctl for device".
        assert_eq!(set_low_latency(&far).unwrap_err().raw_os_error(), Some(25));
        let refused = set_rs485(&far, RtsLevel::High, 0, 0).unwrap_err();
        assert_eq!(refused.raw_os_error(), Some(25));
    }
}
