//! A port that comes back: a pulled adapter or a closed connection is reported, waited for and opened again.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use super::port::{Port, PortError};
use super::port_name::{AnyPort, OpenPort, PortName, open};
use super::serial::{SerialOptions, is_pseudo_terminal};
use crate::time::Baud;

/// A port that is opened again when it is gone.
///
/// ```text
/// there ──a read or write says "unplugged"──► gone ──opened──► there
///             event Gone                       │       event Back
///                                              └─ longer than the limit: the error, for good
/// ```
///
/// While it is gone the line is silent: [`receive`](Port::receive) waits as long as it may and gives nothing, what is sent is lost. A station
/// goes on by its own rules, and nothing spins. Opening may block for seconds (a name to be resolved, an adapter that is not ready), so it
/// is tried in a thread of its own that ends with success or with this value: at first after 100 ms, then after twice the pause before, at
/// most 2 s. A port that breaks soon after it came back does not begin anew with the short pause.
///
/// # Example
///
/// ```no_run
/// use dp_master::driver::Driver;
/// use dp_master::phy::{PortEvent, PortName, ReopeningPort, SerialOptions};
/// use dp_master::time::Baud;
/// use std::time::Duration;
///
/// fn run(station: &mut dyn dp_master::station::Station) -> Result<(), dp_master::phy::PortError> {
///     let name = PortName::Serial("/dev/ttyUSB0".into());
///     let opened = ReopeningPort::open(&name, Baud::B187500, SerialOptions::default())?;
///     opened.notes.iter().for_each(|note| eprintln!("{note}"));
///     let mut driver = Driver::new(opened.port);
///     loop {
///         driver.step(station, Duration::from_millis(50))?;
///         while let Some(event) = driver.port_mut().poll_event() {
///             eprintln!("{event}");
///         }
///     }
/// }
/// ```
pub struct ReopeningPort<P = AnyPort> {
    state: State<P>,
    opener: Opener<P>,
    baud: Baud,
    limit: Option<Duration>,
    pause: Duration,
    events: VecDeque<PortEvent>,
}

type Opener<P> = Arc<dyn Fn() -> Result<P, PortError> + Send + Sync>;

enum State<P> {
    There {
        port: P,
        since: Instant,
    },
    Gone {
        path: PathBuf,
        since: Instant,
        opened: Receiver<P>,
        /// The thread that opens sleeps on the other end, and ends when this is dropped.
        _stop: Sender<()>,
    },
    /// Gone for longer than the limit.
    Lost {
        path: PathBuf,
    },
}

/// What happened to a [`ReopeningPort`]; one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PortEvent {
    /// It is gone and will be opened again.
    Gone {
        /// What the read or write said.
        why: String,
    },
    /// It is there again.
    Back {
        /// How long it was gone.
        after: Duration,
    },
}

impl std::fmt::Display for PortEvent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Gone { why } => write!(f, "{why}, waiting for it to come back"),
            Self::Back { after } => write!(f, "the port is back after {:.1} s", after.as_secs_f64()),
        }
    }
}

impl ReopeningPort<AnyPort> {
    /// Opens a port of any kind, now and whenever it is gone. A pseudo-terminal of our own never is.
    ///
    /// The number of a pseudo-terminal that is gone belongs to the next one that anybody opens, a shell perhaps. So the far end of one is
    /// opened again only through a symbolic link that was made anew.
    ///
    /// # Errors
    ///
    /// As [`open`]: at first it must be there.
    pub fn open(name: &PortName, baud: Baud, serial: SerialOptions) -> Result<OpenPort<Self>, PortError> {
        let first = open(name, baud, serial)?;
        let name = name.clone();
        let link = Link::of(&name);
        let opener = move || {
            if let (Link::PseudoTerminal(old), PortName::Serial(path)) = (&link, &name)
                && link_identity(path).is_none_or(|new| Some(&new) == old.as_ref())
            {
                return Err(PortError::NoSuchPort { path: path.clone() });
            }
            open(&name, baud, serial).map(|again| again.port)
        };
        Ok(OpenPort {
            port: Self::new(first.port, opener),
            notes: first.notes,
            far_end: first.far_end,
        })
    }
}

impl<P: Port + Send + 'static> ReopeningPort<P> {
    /// Keeps an open port and a way to open it again.
    pub fn new(port: P, opener: impl Fn() -> Result<P, PortError> + Send + Sync + 'static) -> Self {
        Self {
            baud: port.baud(),
            state: State::There {
                port,
                since: Instant::now(),
            },
            opener: Arc::new(opener),
            limit: None,
            pause: FIRST_PAUSE,
            events: VecDeque::new(),
        }
    }

    /// The same, but a port that is gone for longer than this is an error for good.
    #[must_use]
    pub fn with_limit(mut self, limit: Duration) -> Self {
        self.limit = Some(limit);
        self
    }

    /// What happened to the port, oldest first. Nobody has to ask: only the last 16 are kept.
    pub fn poll_event(&mut self) -> Option<PortEvent> {
        self.events.pop_front()
    }

    /// Whether the port is open now.
    #[must_use]
    pub const fn is_there(&self) -> bool {
        matches!(self.state, State::There { .. })
    }

    /// Gives up the port and begins to open it again; any other error is passed on.
    fn handle(&mut self, error: PortError) -> Result<(), PortError> {
        let PortError::Unplugged { path } = &error else {
            return Err(error);
        };
        let path = path.clone();
        if let State::There { since, .. } = &self.state
            && since.elapsed() > STEADY
        {
            self.pause = FIRST_PAUSE;
        }
        self.tell(PortEvent::Gone { why: error.to_string() });
        let (opened, stop) = self.begin_opening();
        // The old port is closed here, by the assignment, before the first attempt.
        self.state = State::Gone {
            path,
            since: Instant::now(),
            opened,
            _stop: stop,
        };
        Ok(())
    }

    fn begin_opening(&mut self) -> (Receiver<P>, Sender<()>) {
        let (tell, opened) = channel();
        let (stop, stopped) = channel();
        let opener = Arc::clone(&self.opener);
        let mut pause = self.pause;
        self.pause = (pause * 2).min(LONGEST_PAUSE);
        let open_again = move || {
            while stopped.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                if let Ok(port) = opener() {
                    // Nobody waits any more: the port is closed again.
                    drop(tell.send(port));
                    return;
                }
                pause = (pause * 2).min(LONGEST_PAUSE);
            }
        };
        // Without a thread nobody opens the port, which counts as lost.
        drop(thread::Builder::new().name("port-opener".to_owned()).spawn(open_again));
        (opened, stop)
    }

    /// Waits for the port to come back, at most `max_wait`.
    fn wait_for_it(&mut self, max_wait: Duration) -> Result<(), PortError> {
        let State::Gone {
            opened, since, path, ..
        } = &mut self.state
        else {
            return Ok(());
        };
        let since = *since;
        let left = self.limit.map(|limit| limit.saturating_sub(since.elapsed()));
        let wait = left.map_or(max_wait, |left| left.min(max_wait));
        match opened.recv_timeout(wait) {
            Ok(port) => {
                self.state = State::There {
                    port,
                    since: Instant::now(),
                };
                self.tell(PortEvent::Back { after: since.elapsed() });
            }
            Err(RecvTimeoutError::Timeout) if left.is_none_or(|left| left > wait) => {}
            // The limit is over. (Or the thread that opens could not run.)
            Err(_) => {
                let path = path.clone();
                self.state = State::Lost { path: path.clone() };
                return Err(PortError::Unplugged { path });
            }
        }
        Ok(())
    }

    fn tell(&mut self, event: PortEvent) {
        if self.events.len() == EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(event);
    }
}

impl<P: Port + Send + 'static> Port for ReopeningPort<P> {
    fn receive(&mut self, buf: &mut [u8], max_wait: Duration) -> Result<usize, PortError> {
        match &mut self.state {
            State::There { port, .. } => match port.receive(buf, max_wait) {
                Ok(received) => return Ok(received),
                Err(error) => self.handle(error)?,
            },
            State::Gone { .. } => self.wait_for_it(max_wait)?,
            State::Lost { path } => return Err(PortError::Unplugged { path: path.clone() }),
        }
        Ok(0)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), PortError> {
        match &mut self.state {
            State::There { port, .. } => match port.send(octets) {
                Ok(()) => Ok(()),
                Err(error) => self.handle(error),
            },
            // Octets on a cable that is not there.
            State::Gone { .. } => Ok(()),
            State::Lost { path } => Err(PortError::Unplugged { path: path.clone() }),
        }
    }

    fn baud(&self) -> Baud {
        self.baud
    }
}

impl<P> std::fmt::Debug for ReopeningPort<P> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReopeningPort")
            .field("there", &matches!(self.state, State::There { .. }))
            .field("baud", &self.baud)
            .field("limit", &self.limit)
            .finish_non_exhaustive()
    }
}

/// What a name led to when it was opened.
enum Link {
    /// The far end of a pseudo-terminal, through this link or directly.
    PseudoTerminal(Option<LinkIdentity>),
    /// Anything else.
    Other,
}

impl Link {
    fn of(name: &PortName) -> Self {
        match name {
            PortName::Serial(path) if is_pseudo_terminal(path) => Self::PseudoTerminal(link_identity(path)),
            _ => Self::Other,
        }
    }
}

/// Device, number, and time of making of a symbolic link.
type LinkIdentity = (u64, u64, i64, i64);

/// `None` for what is no symbolic link.
#[cfg(unix)]
fn link_identity(path: &Path) -> Option<LinkIdentity> {
    use std::os::unix::fs::MetadataExt;
    let metadata = std::fs::symlink_metadata(path).ok()?;
    metadata
        .file_type()
        .is_symlink()
        .then(|| (metadata.dev(), metadata.ino(), metadata.ctime(), metadata.ctime_nsec()))
}

#[cfg(not(unix))]
fn link_identity(_: &Path) -> Option<LinkIdentity> {
    None
}

const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(2);
/// A port that was there for so long has proved itself.
const STEADY: Duration = Duration::from_secs(5);
const EVENTS: usize = 16;

#[cfg(test)]
mod tests {
    use super::*;

    struct Unplugged;

    impl Port for Unplugged {
        fn receive(&mut self, _: &mut [u8], _: Duration) -> Result<usize, PortError> {
            Err(PortError::Unplugged { path: "/dev/x".into() })
        }
        fn send(&mut self, _: &[u8]) -> Result<(), PortError> {
            Ok(())
        }
        fn baud(&self) -> Baud {
            Baud::B45450
        }
    }

    fn never_again() -> ReopeningPort<Unplugged> {
        ReopeningPort::new(Unplugged, || Err(PortError::NoSuchPort { path: "/dev/x".into() }))
    }

    #[test]
    fn only_a_port_that_was_there_for_long_begins_with_the_short_pause_again() {
        // Twice what the thread begins with is what the next one would.
        for (was_there, next_pause) in [(Duration::from_secs(4), 1_600), (Duration::from_secs(6), 200)] {
            let mut port = never_again();
            port.pause = Duration::from_millis(800);
            port.state = State::There {
                port: Unplugged,
                since: Instant::now().checked_sub(was_there).unwrap(),
            };
            assert_eq!(port.receive(&mut [0; 8], Duration::ZERO).unwrap(), 0);
            assert_eq!(port.pause, Duration::from_millis(next_pause), "{was_there:?}");
        }
    }

    #[test]
    fn the_pause_is_doubled_up_to_two_seconds() {
        let mut port = never_again();
        let pauses: Vec<u128> = (0..6)
            .map(|_| {
                drop(port.begin_opening());
                port.pause.as_millis()
            })
            .collect();
        assert_eq!(pauses, [200, 400, 800, 1_600, 2_000, 2_000]);
    }

    #[test]
    fn the_last_sixteen_events_are_kept() {
        let mut port = never_again();
        for number in 0..20 {
            port.tell(PortEvent::Gone {
                why: number.to_string(),
            });
        }
        let kept: Vec<_> = std::iter::from_fn(|| port.poll_event()).collect();
        let wanted: Vec<_> = (4..20)
            .map(|number| PortEvent::Gone {
                why: number.to_string(),
            })
            .collect();
        assert_eq!(kept, wanted);
    }

    #[test]
    fn only_the_far_end_of_a_pseudo_terminal_needs_a_new_link() {
        for name in [PortName::Serial("/dev/null".into()), PortName::Tcp("moxa:4001".into())] {
            assert!(matches!(Link::of(&name), Link::Other), "{name}");
        }
    }

    #[test]
    fn a_port_is_shown_without_what_opens_it() {
        let port = never_again().with_limit(Duration::from_secs(3));
        assert_eq!(
            format!("{port:?}"),
            "ReopeningPort { there: true, baud: B45450, limit: Some(3s), .. }"
        );
    }
}
