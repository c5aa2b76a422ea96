//! Master and slave on a line between two telegrams: whoever speaks next is waited for, and then somebody decides what becomes of it.

use dp_master::dp::{DpMaster, DpSlave};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Instant};

/// 2 µs a bit: every time is a whole number of nanoseconds, so that rounding makes no states.
pub(super) const BAUD: Baud = Baud::B500000;

/// Who speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Party {
    Master,
    Slave,
}

/// What becomes of a telegram on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    /// It arrives.
    Delivered,
    /// Nothing arrives.
    Lost,
    /// It arrives with its first character unusable.
    Spoiled,
    /// It arrives twice, the copy right behind it.
    Doubled,
}

/// A telegram whose first bit leaves now.
#[derive(Debug, Clone)]
pub(super) struct OnLine {
    pub(super) from: Party,
    pub(super) octets: Vec<u8>,
}

/// Two stations and one time.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) now: Instant,
    pub(super) master: DpMaster<1>,
    pub(super) slave: DpSlave,
}

impl Line {
    /// Goes on until somebody speaks; `None` when nobody ever will.
    pub(super) fn next_telegram(&mut self) -> Option<OnLine> {
        loop {
            if let Some(telegram) = self.poll() {
                return Some(telegram);
            }
            let at = [self.master.poll_timeout(), self.slave.poll_timeout()];
            let at = at.into_iter().flatten().min()?;
            self.now = self.now.max(at);
            self.expire();
        }
    }

    /// Both stations are told of a moment that has come.
    fn expire(&mut self) {
        let is_due = |due: Option<Instant>| due.is_some_and(|due| due <= self.now);
        if is_due(self.master.poll_timeout()) {
            self.master.handle_timeout(self.now);
        }
        if is_due(self.slave.poll_timeout()) {
            self.slave.handle_timeout(self.now);
        }
    }

    fn poll(&mut self) -> Option<OnLine> {
        let mut buffer = [0; MAX_TELEGRAM];
        let (from, length) = match self.master.poll_transmit(self.now, &mut buffer) {
            Some(length) => (Party::Master, length),
            None => (Party::Slave, self.slave.poll_transmit(self.now, &mut buffer)?),
        };
        Some(OnLine {
            from,
            octets: buffer[..length].to_vec(),
        })
    }

    /// The telegram takes its time, and its receiver hears what its fate leaves of it.
    pub(super) fn carry(&mut self, telegram: &OnLine, fate: Fate) {
        let begin = self.now;
        let end = begin + BAUD.characters(telegram.octets.len());
        let first_end = begin + BAUD.characters(1);
        let (first, rest) = telegram.octets.split_at(1);
        if fate != Fate::Lost && !rest.is_empty() {
            self.pass_time(first_end);
            match fate {
                Fate::Spoiled => self
                    .receiver(telegram.from)
                    .handle_line_error(first_end, LineError::Parity),
                _ => self.receiver(telegram.from).handle_octets(first_end, first),
            }
        }
        self.pass_time(end);
        self.now = end;
        self.sender(telegram.from).handle_sent(end);
        let heard = if rest.is_empty() { first } else { rest };
        match fate {
            Fate::Lost => {}
            Fate::Spoiled if rest.is_empty() => {
                self.receiver(telegram.from).handle_line_error(end, LineError::Parity);
            }
            Fate::Delivered | Fate::Spoiled => self.receiver(telegram.from).handle_octets(end, heard),
            Fate::Doubled => {
                // As a gateway doubles it: both are read at once.
                let mut both = heard.to_vec();
                both.extend_from_slice(&telegram.octets);
                self.receiver(telegram.from).handle_octets(end, &both);
            }
        }
        self.expire();
    }

    /// Deadlines that fall into a telegram: the watchdog, above all. Nobody speaks meanwhile.
    fn pass_time(&mut self, until: Instant) {
        loop {
            let at = [self.master.poll_timeout(), self.slave.poll_timeout()];
            let Some(at) = at.into_iter().flatten().filter(|at| *at < until).min() else {
                return;
            };
            self.now = self.now.max(at);
            self.expire();
        }
    }

    fn sender(&mut self, party: Party) -> &mut dyn Station {
        match party {
            Party::Master => &mut self.master,
            Party::Slave => &mut self.slave,
        }
    }

    fn receiver(&mut self, sender: Party) -> &mut dyn Station {
        match sender {
            Party::Master => &mut self.slave,
            Party::Slave => &mut self.master,
        }
    }
}
