//! Two pseudo-terminals joined by a wire, so that both sides open a port by its path.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use dp_master::phy::{Port, PseudoTerminal};
use dp_master::time::Baud;

/// A wire between two pseudo-terminals that can lose what passes.
///
/// Whatever arrives at one end comes out of the other. Both ends stay open when nobody uses them, as a serial port does.
#[derive(Debug)]
pub struct NullModem {
    ends: [PathBuf; 2],
    wire: Arc<Wire>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Wire {
    /// Every so many bursts one is lost, in each direction; 0 = none.
    lose_every: AtomicU32,
    lost: AtomicU32,
    cut: AtomicBool,
}

/// How long the wire listens at one end before it listens at the other.
const TURN: Duration = Duration::from_micros(300);

impl NullModem {
    /// Joins two new pseudo-terminals.
    ///
    /// # Panics
    /// When the system has no more of them.
    pub fn new() -> Self {
        // They have no speed; the rate only serves to compute times, which a wire does not.
        let [(mut left, left_path), (mut right, right_path)] = [(); 2].map(|()| {
            PseudoTerminal::open(Baud::B12000000).unwrap_or_else(|error| panic!("no pseudo-terminal: {error}"))
        });
        let wire = Arc::new(Wire::default());
        let carried = Arc::clone(&wire);
        let thread = std::thread::spawn(move || {
            let mut passed = [0; 2];
            while !carried.cut.load(Ordering::Relaxed) {
                carried.carry(&mut left, &mut right, &mut passed[0]);
                carried.carry(&mut right, &mut left, &mut passed[1]);
            }
        });
        NullModem {
            ends: [left_path, right_path],
            wire,
            thread: Some(thread),
        }
    }

    /// The paths of the two ends.
    pub fn ends(&self) -> [&Path; 2] {
        [&self.ends[0], &self.ends[1]]
    }

    /// From now on one of so many bursts is lost, in each direction; 0 = none.
    pub fn lose_every(&self, bursts: u32) {
        self.wire.lose_every.store(bursts, Ordering::Relaxed);
    }

    /// Bursts lost so far.
    pub fn lost(&self) -> u32 {
        self.wire.lost.load(Ordering::Relaxed)
    }
}

impl Default for NullModem {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for NullModem {
    fn drop(&mut self) {
        self.wire.cut.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic in there has been printed; there is nothing more to do about it here.
            let _ = thread.join();
        }
    }
}

impl Wire {
    fn carry(&self, from: &mut PseudoTerminal, to: &mut PseudoTerminal, passed: &mut u32) {
        let mut octets = [0; 512];
        let Ok(length) = from.receive(&mut octets, TURN) else {
            return;
        };
        let burst = &octets[..length];
        if burst.is_empty() {
            return;
        }
        *passed += 1;
        let lose_every = self.lose_every.load(Ordering::Relaxed);
        if lose_every != 0 && passed.is_multiple_of(lose_every) {
            self.lost.fetch_add(1, Ordering::Relaxed);
            return;
        }
        // Nobody reads over there: octets fall off the line.
        let _ = to.send(burst);
    }
}
