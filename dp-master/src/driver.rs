//! One station in real time on a port.
//!
//! The only place that reads a clock. Everything else is told the time.

use std::time::{Duration as StdDuration, Instant as StdInstant};

use crate::phy::{Port, PortError};
use crate::station::{MAX_TELEGRAM, Station};
use crate::time::Instant;

/// Runs one [`Station`] on a [`Port`].
///
/// Call [`step`](Self::step) in a loop. It sleeps in the read of the port until octets arrive, the station's deadline comes or the end of a
/// transmission is due, so there is no busy waiting.
///
/// # Times
///
/// Octets carry the time at which they were read, so they appear later than on the line by the latency of adapter and system. A write
/// returns long before the last bit left; the end of a transmission is therefore computed: `baud.characters(n)` after the beginning of the
/// write. If octets arrive sooner, from a pseudo-terminal that has no speed, the transmission is over, because nobody answers before its end.
///
/// A deadline that was missed is handled once, late, with the present time; nothing is made up for. Octets that lie ready are told before
/// a deadline that is due.
///
/// # Example
///
/// ```no_run
/// use dp_master::driver::Driver;
/// use dp_master::phy::{SerialLine, SerialOptions};
/// use dp_master::time::Baud;
/// use std::time::Duration;
///
/// fn run(station: &mut dyn dp_master::station::Station) -> Result<(), dp_master::phy::PortError> {
///     let port = SerialLine::open("/dev/ttyUSB0", Baud::B187500, SerialOptions::default())?;
///     let mut driver = Driver::new(port);
///     loop {
///         driver.step(station, Duration::from_millis(50))?;
///     }
/// }
/// ```
#[derive(Debug)]
pub struct Driver<P> {
    port: P,
    epoch: StdInstant,
    /// When the last bit of our transmission will have left.
    sending_until: Option<Instant>,
    received: [u8; READ_SIZE],
    telegram: [u8; MAX_TELEGRAM],
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activity {
    /// Octets given to the station.
    pub received: usize,
    /// Octets sent for it.
    pub sent: usize,
}

impl<P: Port> Driver<P> {
    /// A driver whose epoch is now.
    pub fn new(port: P) -> Self {
        Self::with_epoch(port, StdInstant::now())
    }

    /// A driver with an epoch of your own, so that several of them share one time.
    pub const fn with_epoch(port: P, epoch: StdInstant) -> Self {
        Self {
            port,
            epoch,
            sending_until: None,
            received: [0; READ_SIZE],
            telegram: [0; MAX_TELEGRAM],
        }
    }

    /// The present time as the station is told it.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.at(StdInstant::now())
    }

    /// A moment of the system's clock as the station is told it; the epoch for any before it.
    #[must_use]
    pub fn at(&self, moment: StdInstant) -> Instant {
        Instant::ZERO + moment.saturating_duration_since(self.epoch).into()
    }

    /// The port.
    pub const fn port_mut(&mut self) -> &mut P {
        &mut self.port
    }

    /// Gives the port back.
    pub fn into_port(self) -> P {
        self.port
    }

    /// Sends what the station has to send, waits for the next thing to happen, at most `max_wait`, and tells the station.
    ///
    /// # Errors
    ///
    /// [`PortError`]; after [`PortErrorKind::Unplugged`](crate::phy::PortErrorKind::Unplugged) the driver is of no further use. The station
    /// is untouched by that and can go on with a new one.
    pub fn step(
        &mut self,
        station: &mut dyn Station,
        max_wait: StdDuration,
    ) -> Result<Activity, PortError> {
        let mut activity = Activity {
            received: 0,
            sent: self.send(station)?,
        };

        let now = self.now();
        let wait = self
            .sending_until
            .into_iter()
            .chain(station.poll_timeout())
            .min()
            .map_or(max_wait, |deadline| {
                StdDuration::from(deadline - now).min(max_wait)
            });
        activity.received = self.port.receive(&mut self.received, wait)?;

        let now = self.now();
        if let Some(end) = self.sending_until
            && (end <= now || activity.received > 0)
        {
            self.sending_until = None;
            station.handle_sent(end.min(now));
            activity.sent += self.send(station)?;
        }
        if let Some(octets) = self
            .received
            .get(..activity.received)
            .filter(|octets| !octets.is_empty())
        {
            station.handle_octets(now, octets);
            activity.sent += self.send(station)?;
        }
        if station
            .poll_timeout()
            .is_some_and(|deadline| deadline <= now)
        {
            station.handle_timeout(now);
            activity.sent += self.send(station)?;
        }
        Ok(activity)
    }

    /// Sends a telegram if the station has one and none is on the line.
    fn send(&mut self, station: &mut dyn Station) -> Result<usize, PortError> {
        if self.sending_until.is_some() {
            return Ok(0);
        }
        let now = self.now();
        let Some(octets) = station
            .poll_transmit(now, &mut self.telegram)
            .and_then(|length| self.telegram.get(..length))
        else {
            return Ok(0);
        };
        // Noted before the write, so that a station whose telegram failed is still told that its transmission is over.
        self.sending_until = Some(now + self.port.baud().characters(octets.len()));
        let sent = octets.len();
        self.port.send(octets)?;
        Ok(sent)
    }
}

/// Octets read at once.
const READ_SIZE: usize = 512;
