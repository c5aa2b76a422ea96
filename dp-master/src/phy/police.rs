//! The rules of the line, and who broke them.

use super::virtual_bus::PortId;
use crate::time::{Baud, BitTimes, Duration, Instant};
use crate::wire::{FunctionCode, SC, SD1, SD2, SD3, SD4};

/// A rule of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Rule {
    /// A transmission began while another one was on the line. Measured: 0.
    Collision,
    /// An answer must leave the line idle for min Tsdr, 11 tBIT, after its request.
    MinTsdr,
    /// A request or a token must leave the line idle for Tsyn, 33 tBIT.
    Tsyn,
    /// An answer must follow a request of another station that expects one. Measured: the pause before it.
    Unasked,
    /// A transmission must be one telegram as long as its beginning says. Measured: its octets.
    Malformed,
}

/// A broken rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// When the transmission began.
    pub at: Instant,
    /// Who sent it.
    pub port: PortId,
    /// The rule.
    pub rule: Rule,
    /// Idle time before it in whole bits, or what the rule says.
    pub measured_bits: u64,
}

/// Synchronisation time: idle bits before an action telegram. Source: IEC 61158-4-3.
const T_SYN: BitTimes = BitTimes(33);
/// Smallest min Tsdr: idle bits before an answer. Source: IEC 61158-4-3.
const MIN_T_SDR: BitTimes = BitTimes(11);
/// How many violations are kept.
const KEPT: usize = 1_024;

/// Watches the transmissions in the order of time.
#[derive(Clone, Debug)]
pub(super) struct Police {
    baud: Baud,
    t_syn: Duration,
    min_t_sdr: Duration,
    /// End of the last transmission.
    quiet_since: Option<Instant>,
    /// Who may not answer because he asked; `None` when nobody asked.
    asked_by: Option<PortId>,
    violations: Vec<Violation>,
    count: u64,
}

/// What a transmission is, by its start delimiter and function code.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Request { expects_reply: bool },
    Reply,
    Malformed,
}

impl Police {
    pub(super) fn new(baud: Baud) -> Self {
        Self {
            baud,
            t_syn: baud.duration(T_SYN),
            min_t_sdr: baud.duration(MIN_T_SDR),
            quiet_since: None,
            asked_by: None,
            violations: Vec::new(),
            count: 0,
        }
    }

    pub(super) const fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn violations(&self) -> &[Violation] {
        &self.violations
    }

    pub(super) fn clear(&mut self) {
        self.violations.clear();
        self.count = 0;
    }

    /// A transmission began at `now` and will end at `end`.
    #[inline]
    pub(super) fn burst(&mut self, now: Instant, end: Instant, port: PortId, octets: &[u8]) {
        let kind = classify(octets);
        let pause = self.quiet_since.map(|since| now - since);
        // A collision is reported as such; the pause before it would only say it twice.
        let overlaps = self.quiet_since.is_some_and(|since| since > now);
        match kind {
            Kind::Request { .. } => {
                if !overlaps && pause.is_some_and(|pause| pause < self.t_syn) {
                    self.report(now, port, Rule::Tsyn, pause);
                }
            }
            Kind::Reply => {
                if self.asked_by.is_none_or(|asker| asker == port) {
                    self.report(now, port, Rule::Unasked, pause);
                } else if !overlaps && pause.is_some_and(|pause| pause < self.min_t_sdr) {
                    self.report(now, port, Rule::MinTsdr, pause);
                }
            }
            Kind::Malformed => self.broken(now, port, Rule::Malformed, octets.len() as u64),
        }
        self.asked_by = (kind == Kind::Request { expects_reply: true }).then_some(port);
        self.quiet_since = self.quiet_since.max(Some(end));
    }

    #[cold]
    pub(super) fn collision(&mut self, now: Instant, port: PortId) {
        self.broken(now, port, Rule::Collision, 0);
    }

    #[cold]
    fn report(&mut self, at: Instant, port: PortId, rule: Rule, pause: Option<Duration>) {
        self.broken(at, port, rule, self.baud.bits(pause.unwrap_or_default()));
    }

    #[cold]
    fn broken(&mut self, at: Instant, port: PortId, rule: Rule, measured_bits: u64) {
        self.count += 1;
        if self.violations.len() < KEPT {
            self.violations.push(Violation {
                at,
                port,
                rule,
                measured_bits,
            });
        }
    }
}

#[inline]
fn classify(octets: &[u8]) -> Kind {
    let (fc, length) = match *octets {
        [SC] => return Kind::Reply,
        [SD4, _, _] => {
            return Kind::Request { expects_reply: false };
        }
        [SD1, _, _, fc, ..] => (fc, 6),
        [SD3, _, _, fc, ..] => (fc, 14),
        [SD2, le, _, _, _, _, fc, ..] => (fc, usize::from(le) + 6),
        _ => return Kind::Malformed,
    };
    if octets.len() != length {
        return Kind::Malformed;
    }
    let fc = FunctionCode::from_octet(fc);
    if fc.is_request() {
        Kind::Request {
            expects_reply: fc.expects_reply(),
        }
    } else {
        Kind::Reply
    }
}
