//! A serial port that exists on this machine only: another program opens its far end like an adapter.

use std::io::{self, Write};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort, TTYPort};

use super::linux::close_on_exec;
use super::port::{Port, PortError};
use super::serial::{SEND_TIMEOUT, read_within};
use crate::time::Baud;

/// Our end of a pseudo-terminal; both ends are raw.
///
/// The far end is kept open here too, so that the peer may come and go without this end seeing a hang-up. While nobody listens, octets fall
/// off the line as on a real one, instead of waiting for the next peer.
#[derive(Debug)]
pub struct PseudoTerminal {
    near: TTYPort,
    /// Never read; see above.
    far: TTYPort,
    far_path: PathBuf,
    baud: Baud,
    link: Option<PathBuf>,
}

impl PseudoTerminal {
    /// Makes a pair and returns our end with the path of the far end.
    ///
    /// A pseudo-terminal has no speed; `baud` says what to compute times with.
    ///
    /// # Errors
    ///
    /// [`PortError::Io`] when the system has no more of them.
    pub fn open(baud: Baud) -> Result<(Self, PathBuf), PortError> {
        let failed = |error: serialport::Error| PortError::Io {
            path: PathBuf::from("/dev/ptmx"),
            source: error.into(),
        };
        let (near, far) = TTYPort::pair().map_err(failed)?;
        // Best effort: it matters only to programs that start others.
        drop(close_on_exec(&near).and_then(|()| close_on_exec(&far)));
        let far_path = far.name().map(PathBuf::from).ok_or_else(|| PortError::Io {
            path: PathBuf::from("/dev/ptmx"),
            source: io::Error::other("the far end has no name"),
        })?;
        Ok((
            Self {
                near,
                far,
                far_path: far_path.clone(),
                baud,
                link: None,
            },
            far_path,
        ))
    }

    /// The path of the far end.
    #[must_use]
    pub fn far_path(&self) -> &Path {
        &self.far_path
    }

    /// Gives the far end a name of its own, a symbolic link that lasts as long as this value.
    ///
    /// A symbolic link that is there already, from an earlier run, is replaced in one step; anything else is left alone. An earlier link of
    /// this value is removed.
    ///
    /// # Errors
    ///
    /// [`PortError::LinkTaken`] when the name belongs to something that is no symbolic link, [`PortError::Io`] when the link cannot be made.
    pub fn link(&mut self, link: impl Into<PathBuf>) -> Result<(), PortError> {
        let link = link.into();
        let failed = |source| PortError::Io {
            path: link.clone(),
            source,
        };
        match symlink(&self.far_path, &link) {
            Ok(()) => {}
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                if !std::fs::symlink_metadata(&link)
                    .map_err(failed)?
                    .file_type()
                    .is_symlink()
                {
                    return Err(PortError::LinkTaken { path: link });
                }
                // Made under another name and moved over the old one: there is no moment without a link.
                let mut name = link.file_name().unwrap_or_default().to_os_string();
                name.push(format!(".new-{}", std::process::id()));
                let fresh = link.with_file_name(name);
                symlink(&self.far_path, &fresh).map_err(failed)?;
                if let Err(error) = std::fs::rename(&fresh, &link) {
                    drop(std::fs::remove_file(&fresh));
                    return Err(failed(error));
                }
            }
            Err(error) => return Err(failed(error)),
        }
        if self.link.as_ref() != Some(&link) {
            self.unlink();
            self.link = Some(link);
        }
        Ok(())
    }

    /// Removes the link, unless it leads elsewhere by now.
    fn unlink(&mut self) {
        if let Some(link) = self.link.take()
            && std::fs::read_link(&link).is_ok_and(|target| target == self.far_path)
        {
            drop(std::fs::remove_file(link));
        }
    }
}

impl Drop for PseudoTerminal {
    fn drop(&mut self) {
        self.unlink();
    }
}

impl Port for PseudoTerminal {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        read_within(&mut self.near, &self.far_path, buf, max_wait)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        // The kernel buffers some kilobytes for a far end that nobody reads. A reader takes a telegram within milliseconds, so this much
        // unread means nobody is there.
        if self.far.bytes_to_read().is_ok_and(|unread| unread > UNREAD) {
            drop(self.far.clear(ClearBuffer::Input));
        }
        drop(self.near.set_timeout(SEND_TIMEOUT));
        self.near
            .write_all(octets)
            .map_err(|error| PortError::in_use(&self.far_path, error))
    }

    fn baud(&self) -> Baud {
        self.baud
    }
}

/// Unread octets at the far end above which nobody is taken to read them.
const UNREAD: u32 = 1_024;
