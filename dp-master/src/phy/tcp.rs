//! A serial-device server in the network: octets of the line over a raw TCP connection.
//!
//! The server runs the line, so baud rate and even parity are set there, not here. Nothing is negotiated (RFC 2217 is not spoken).

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::port::{Port, PortError, is_transient};
use super::serial::SEND_TIMEOUT;
use crate::time::Baud;

/// A connection to a serial-device server.
///
/// Every telegram goes out at once (TCP_NODELAY). The network adds milliseconds, so the slot time needs a latency allowance.
#[derive(Debug)]
pub struct TcpLine {
    stream: TcpStream,
    /// `tcp://host:port`.
    name: PathBuf,
    baud: Baud,
}

impl TcpLine {
    /// Connects to `address`, `host:port`, within `timeout` altogether; `baud` says what to compute times with.
    ///
    /// A server that goes away without a word is noticed after about 12 seconds (keep-alive).
    ///
    /// # Errors
    ///
    /// [`PortError::Unreachable`] when the name is unknown, nobody answers or the connection is refused.
    pub fn connect(address: &str, baud: Baud, timeout: Duration) -> Result<Self, PortError> {
        let name = PathBuf::from(format!("tcp://{address}"));
        let unreachable = |source| PortError::Unreachable {
            path: name.clone(),
            source,
        };
        let begun = Instant::now();
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
        for address in address.to_socket_addrs().map_err(unreachable)? {
            let Some(left) = timeout.checked_sub(begun.elapsed()).filter(|left| !left.is_zero()) else {
                break;
            };
            match TcpStream::connect_timeout(&address, left) {
                Ok(stream) => return Self::over(stream, name, baud),
                Err(error) => last = error,
            }
        }
        Err(unreachable(last))
    }

    fn over(stream: TcpStream, name: PathBuf, baud: Baud) -> Result<Self, PortError> {
        let prepared = stream
            .set_nodelay(true)
            .and_then(|()| stream.set_write_timeout(Some(SEND_TIMEOUT)));
        prepared.map_err(|error| PortError::in_use(&name, error))?;
        // Best effort: without it a dead server is noticed when it is sent to.
        #[cfg(unix)]
        drop(keep_alive(&stream));
        Ok(Self { stream, name, baud })
    }

    /// `tcp://host:port`.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }
}

impl Port for TcpLine {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        if buf.is_empty() {
            return Ok(0);
        }
        let failed = |error| PortError::in_use(&self.name, error);
        if !readable_within(&self.stream, max_wait).map_err(failed)? {
            return Ok(0);
        }
        match self.stream.read(buf) {
            // Readable without octets is a connection that was closed.
            Ok(0) => Err(PortError::Unplugged {
                path: self.name.clone(),
            }),
            Ok(received) => Ok(received),
            Err(error) if is_transient(&error) => Ok(0),
            Err(error) => Err(failed(error)),
        }
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        self.stream.write_all(octets).map_err(|error| match error.kind() {
            // What a write timeout is called differs from system to system.
            io::ErrorKind::WouldBlock => PortError::Stuck {
                path: self.name.clone(),
            },
            _ => PortError::in_use(&self.name, error),
        })
    }

    fn baud(&self) -> Baud {
        self.baud
    }
}

/// Waits for octets to the nanosecond; the read timeout of a socket is rounded to a tick of the system.
#[cfg(unix)]
fn readable_within(stream: &TcpStream, max_wait: Duration) -> io::Result<bool> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let limit = Timespec::try_from(max_wait).ok();
    let mut wait_for = [PollFd::new(stream, PollFlags::IN)];
    match poll(&mut wait_for, limit.as_ref()) {
        Ok(ready) => Ok(ready > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(unix))]
fn readable_within(stream: &TcpStream, max_wait: Duration) -> io::Result<bool> {
    // A timeout of zero means none.
    stream.set_read_timeout(Some(max_wait.max(Duration::from_millis(1))))?;
    Ok(true)
}

#[cfg(unix)]
fn keep_alive(stream: &TcpStream) -> io::Result<()> {
    use rustix::net::sockopt;
    sockopt::set_socket_keepalive(stream, true)?;
    sockopt::set_tcp_keepidle(stream, Duration::from_secs(6))?;
    sockopt::set_tcp_keepintvl(stream, Duration::from_secs(2))?;
    sockopt::set_tcp_keepcnt(stream, 3)?;
    Ok(())
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use rustix::net::sockopt;
    use std::net::TcpListener;

    #[test]
    fn a_server_that_says_nothing_is_asked_whether_it_lives() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let line = TcpLine::connect(&address, Baud::B45450, Duration::from_secs(10)).unwrap();
        assert!(sockopt::socket_keepalive(&line.stream).unwrap());
        // Asked after 6 s of silence and three times, 2 s apart: a dead one is noticed within 12 s.
        assert_eq!(sockopt::tcp_keepidle(&line.stream), Ok(Duration::from_secs(6)));
        assert_eq!(sockopt::tcp_keepintvl(&line.stream), Ok(Duration::from_secs(2)));
        assert_eq!(sockopt::tcp_keepcnt(&line.stream), Ok(3));
    }
}
