//! RTS switched around each telegram, for adapters whose transmitter hangs on it.

use std::thread;
use std::time::{Duration, Instant};

use super::serial::RtsLevel;

/// What the switch needs of a port.
pub(super) trait TransmitLine {
    /// Sets RTS; whether the port has such a line.
    fn set_rts(&mut self, level: RtsLevel) -> bool;
    /// Hands all octets over.
    fn write(&mut self, octets: &[u8]) -> std::io::Result<()>;
    /// Waits until the system has given all octets to the adapter.
    fn drain(&mut self) -> std::io::Result<()>;
}

/// When RTS changes around a telegram.
///
/// ```text
/// RTS    ────┐                                              ┌────
///            └──────────────────────────────────────────────┘
///             before │ telegram, 11 bits a character │ after
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RtsSwitch {
    pub(super) on_send: RtsLevel,
    pub(super) before: Duration,
    pub(super) after: Duration,
}

impl RtsSwitch {
    /// Sends with the transmitter on and returns when it is off again.
    ///
    /// `on_line` is the time that the telegram takes on the line. A port without RTS sends all the same.
    ///
    /// The time of the line is waited for too, because an adapter behind USB reports itself drained while it still sends.
    pub(super) fn send(&self, line: &mut impl TransmitLine, octets: &[u8], on_line: Duration) -> std::io::Result<()> {
        if !line.set_rts(self.on_send) {
            return line.write(octets);
        }
        thread::sleep(self.before);
        let begun = Instant::now();
        let sent = line.write(octets).and_then(|()| line.drain());
        if sent.is_ok() {
            thread::sleep(on_line.saturating_sub(begun.elapsed()) + self.after);
        }
        // Also after a failure: a transmitter that stays on makes the whole line mute.
        line.set_rts(self.on_send.other());
        sent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes down what was done to it, and when.
    struct Recorder {
        has_rts: bool,
        fails: bool,
        did: Vec<(&'static str, Instant)>,
    }

    impl Recorder {
        fn new(has_rts: bool, fails: bool) -> Self {
            Self {
                has_rts,
                fails,
                did: Vec::new(),
            }
        }
        fn note(&mut self, what: &'static str) {
            self.did.push((what, Instant::now()));
        }
        fn order(&self) -> Vec<&'static str> {
            self.did.iter().map(|(what, _)| *what).collect()
        }
    }

    impl TransmitLine for Recorder {
        fn set_rts(&mut self, level: RtsLevel) -> bool {
            self.note(match level {
                RtsLevel::High => "high",
                RtsLevel::Low => "low",
            });
            self.has_rts
        }
        fn write(&mut self, _: &[u8]) -> std::io::Result<()> {
            self.note("write");
            if self.fails {
                return Err(std::io::ErrorKind::BrokenPipe.into());
            }
            Ok(())
        }
        fn drain(&mut self) -> std::io::Result<()> {
            self.note("drain");
            Ok(())
        }
    }

    const SWITCH: RtsSwitch = RtsSwitch {
        on_send: RtsLevel::High,
        before: Duration::from_millis(2),
        after: Duration::from_millis(3),
    };
    const ON_LINE: Duration = Duration::from_millis(10);

    #[test]
    fn the_transmitter_is_on_from_before_the_telegram_until_after_its_last_bit() {
        let mut line = Recorder::new(true, false);
        SWITCH.send(&mut line, &[0xE5], ON_LINE).unwrap();
        assert_eq!(line.order(), ["high", "write", "drain", "low"]);
        let at = |index: usize| line.did[index].1;
        assert!(at(1) - at(0) >= SWITCH.before);
        assert!(
            at(3) - at(1) >= ON_LINE + SWITCH.after,
            "the time on the line and the delay after it"
        );
    }

    #[test]
    fn an_inverted_adapter_sends_with_rts_low() {
        let mut line = Recorder::new(true, false);
        let switch = RtsSwitch {
            on_send: RtsLevel::Low,
            ..SWITCH
        };
        switch.send(&mut line, &[0xE5], ON_LINE).unwrap();
        assert_eq!(line.order(), ["low", "write", "drain", "high"]);
    }

    #[test]
    fn a_port_without_rts_sends_all_the_same() {
        let mut line = Recorder::new(false, false);
        SWITCH.send(&mut line, &[0xE5], ON_LINE).unwrap();
        assert_eq!(line.order(), ["high", "write"]);
    }

    #[test]
    fn a_failed_write_leaves_the_transmitter_off() {
        let mut line = Recorder::new(true, true);
        assert!(SWITCH.send(&mut line, &[0xE5], ON_LINE).is_err());
        assert_eq!(line.order(), ["high", "write", "low"]);
    }
}
