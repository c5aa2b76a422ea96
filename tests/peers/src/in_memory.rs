//! DP cycles over a port that is memory: the master's processor time and next to nothing else.
//!
//! Time is virtual and jumps to where our master has something to do: it names that moment. The peer names none. It is called in one of
//! two ways, see [`Calls`]. An answer lies in the port, whole, when its last character would have ended.

use dp_master::dp::{DpMaster, SlaveIndex};
use dp_master::station::{MAX_TELEGRAM, Station};
use dp_master::time::{BitTimes, Instant};
use profirust::dp::{DpMaster as PeerDp, PeripheralHandle};
use profirust::fdl::FdlActiveStation as PeerFdl;
use profirust::phy::ProfibusPhy;
use profirust::time::Instant as PeerInstant;

use crate::masters::{self, BAUD, SLOT_BITS};
use crate::slaves::CannedSlaves;

/// Tsdr of the slaves: one character, the least there is.
const T_SDR: BitTimes = BitTimes(11);
/// Cycles after which everything must exchange data.
const START_UP: usize = 1_000;

/// This stack's master on a port in memory.
#[derive(Debug)]
pub struct OurCycles {
    master: DpMaster<30>,
    handles: Vec<SlaveIndex>,
    last: SlaveIndex,
    slaves: CannedSlaves,
    telegram: [u8; MAX_TELEGRAM],
    received: [u8; MAX_TELEGRAM],
    now: Instant,
}

impl OurCycles {
    /// In data exchange with so many slaves, 1…30.
    ///
    /// # Panics
    /// When data exchange is not reached.
    pub fn new(count: u8) -> Self {
        let (master, handles) = masters::ours(count);
        let Some(&last) = handles.last() else {
            panic!("at least one slave is needed");
        };
        let mut cycles = OurCycles {
            master,
            handles,
            last,
            slaves: CannedSlaves::new(count),
            telegram: [0; MAX_TELEGRAM],
            received: [0; MAX_TELEGRAM],
            now: Instant::ZERO,
        };
        for _ in 0..START_UP {
            cycles.cycle();
        }
        for (&handle, address) in cycles.handles.iter().zip(crate::slaves::FIRST_SLAVE..) {
            assert_eq!(cycles.master.inputs(handle), [address; crate::slaves::IMAGE]);
            assert!(cycles.master.exchanges(handle) > 100);
        }
        cycles
    }

    /// Up to the next exchange with the last slave; its first input octet.
    #[inline]
    pub fn cycle(&mut self) -> u8 {
        let done = self.master.exchanges(self.last) + 1;
        while self.master.exchanges(self.last) < done {
            let Some(due) = self.master.poll_timeout() else {
                panic!("the master waits for nothing");
            };
            self.now = self.now.max(due);
            self.master.handle_timeout(self.now);
            let Some(length) = self.master.poll_transmit(self.now, &mut self.telegram) else {
                continue;
            };
            self.now += BAUD.characters(length);
            self.master.handle_sent(self.now);
            if let Some(answer) = self.slaves.answer(&self.telegram[..length]) {
                let waiting = answer.len();
                self.received[..waiting].copy_from_slice(answer);
                self.now += BAUD.duration(T_SDR) + BAUD.characters(waiting);
                self.master.handle_octets(self.now, &self.received[..waiting]);
            }
        }
        self.master.inputs(self.last).first().copied().unwrap_or_default()
    }

    /// Data_Exchange requests answered so far, all slaves together.
    pub fn exchanges(&self) -> u64 {
        self.handles.iter().map(|&handle| self.master.exchanges(handle)).sum()
    }
}

/// When the peer is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calls {
    /// Never in vain: the harness knows its states. No program does.
    Chosen,
    /// Once a character time, 11 tBIT: what a program that serves a port does at the least. (The peer's own tests call it every 100 µs at
    /// 19.2 kbit/s, six times a character.)
    EveryCharacter,
}

/// `profirust`'s master on a port in memory.
pub struct PeerCycles {
    fdl: PeerFdl,
    master: PeerDp<'static>,
    handles: Vec<PeripheralHandle>,
    last: PeripheralHandle,
    port: MemoryPort,
    calls: Calls,
    now: PeerInstant,
}

impl PeerCycles {
    /// In data exchange with so many slaves, 1…30.
    ///
    /// # Panics
    /// When data exchange is not reached.
    pub fn new(count: u8, calls: Calls) -> Self {
        let (fdl, master, handles) = masters::peers(count);
        let Some(&last) = handles.last() else {
            panic!("at least one slave is needed");
        };
        let mut cycles = PeerCycles {
            fdl,
            master,
            handles,
            last,
            port: MemoryPort::new(CannedSlaves::new(count)),
            calls,
            now: PeerInstant::ZERO,
        };
        for _ in 0..START_UP {
            cycles.cycle();
        }
        for (&handle, address) in cycles.handles.iter().zip(crate::slaves::FIRST_SLAVE..) {
            let peripheral = cycles.master.get_mut(handle);
            assert!(peripheral.is_running());
            assert_eq!(peripheral.pi_i(), [address; crate::slaves::IMAGE]);
        }
        cycles
    }

    /// Up to the next exchange with the last slave; its first input octet.
    #[inline]
    pub fn cycle(&mut self) -> u8 {
        loop {
            self.fdl.poll(self.now, &mut self.port, &mut self.master);
            let events = self.master.take_last_events();
            self.now += match self.calls {
                Calls::Chosen => self.port.until_next_call(),
                Calls::EveryCharacter => bits(CHARACTER_BITS),
            };
            if events.cycle_completed {
                return self
                    .master
                    .get_mut(self.last)
                    .pi_i()
                    .first()
                    .copied()
                    .unwrap_or_default();
            }
        }
    }

    /// Data_Exchange requests answered so far, all slaves together.
    pub fn exchanges(&self) -> u64 {
        self.port.exchanges
    }
}

/// The port as the peer wants it. It knows what the last call did, and so when the next one makes sense.
struct MemoryPort {
    slaves: CannedSlaves,
    telegram: [u8; MAX_TELEGRAM],
    received: [u8; MAX_TELEGRAM],
    waiting: usize,
    /// Until when the line carries our telegram, and from when on the answer can be read.
    sending_until: PeerInstant,
    answered_at: PeerInstant,
    call: Call,
    exchanges: u64,
}

/// What a call did.
#[derive(Clone, Copy, Debug)]
enum Call {
    /// Sent so many octets; what happens until something else can.
    Sent(usize, Then),
    /// Took the answer.
    Received,
    /// Neither: it went on to another state.
    Nothing,
    /// Neither, twice: it waits.
    NothingAgain,
}

#[derive(Clone, Copy, Debug)]
enum Then {
    /// The answer comes, so many octets.
    Answer(usize),
    /// The slot time runs out.
    NoAnswer,
    /// The pause before the next telegram.
    Pause,
}

/// The pause before a request, as the peer counts it: it waits until more than 33 bit times have passed.
const PAUSE_BITS: u32 = 33;

impl MemoryPort {
    fn new(slaves: CannedSlaves) -> Self {
        MemoryPort {
            slaves,
            telegram: [0; MAX_TELEGRAM],
            received: [0; MAX_TELEGRAM],
            waiting: 0,
            sending_until: PeerInstant::ZERO,
            answered_at: PeerInstant::ZERO,
            call: Call::Nothing,
            exchanges: 0,
        }
    }

    /// The peer's times are whole microseconds, and it waits until more than a time has passed.
    #[inline]
    fn until_next_call(&mut self) -> profirust::time::Duration {
        let wait = match self.call {
            Call::Sent(sent, Then::Answer(answer)) => characters(sent) + T_SDR.0 + characters(answer),
            Call::Sent(sent, Then::NoAnswer) => characters(sent) + u32::from(SLOT_BITS),
            Call::Sent(sent, Then::Pause) => characters(sent) + PAUSE_BITS,
            Call::Received => PAUSE_BITS,
            Call::Nothing => {
                self.call = Call::NothingAgain;
                return profirust::time::Duration::ZERO;
            }
            Call::NothingAgain => u32::from(SLOT_BITS),
        };
        self.call = Call::Nothing;
        bits(wait) + profirust::time::Duration::from_micros(1)
    }
}

const CHARACTER_BITS: u32 = 11;

fn characters(count: usize) -> u32 {
    CHARACTER_BITS * u32::try_from(count).unwrap_or(u32::MAX)
}

fn bits(count: u32) -> profirust::time::Duration {
    profirust::Baudrate::B1500000.bits_to_time(count)
}

impl ProfibusPhy for MemoryPort {
    #[inline]
    fn poll_transmission(&mut self, now: PeerInstant) -> bool {
        now < self.sending_until
    }

    #[inline]
    fn transmit_data<F, R>(&mut self, now: PeerInstant, fill: F) -> R
    where
        F: FnOnce(&mut [u8]) -> (usize, R),
    {
        let (length, result) = fill(&mut self.telegram);
        if length > 0 {
            let request = &self.telegram[..length];
            let then = match self.slaves.answer(request) {
                Some(answer) => {
                    self.received[..answer.len()].copy_from_slice(answer);
                    self.waiting = answer.len();
                    self.answered_at = now + bits(characters(length) + T_SDR.0 + characters(answer.len()));
                    Then::Answer(answer.len())
                }
                // SD1: the status of a station that is not there.
                None if request[0] == 0x10 => Then::NoAnswer,
                None => Then::Pause,
            };
            self.sending_until = now + bits(characters(length));
            self.call = Call::Sent(length, then);
        }
        result
    }

    #[inline]
    fn receive_data<F, R>(&mut self, now: PeerInstant, take: F) -> R
    where
        F: FnOnce(&[u8]) -> (usize, R),
    {
        let ready = if now < self.answered_at { 0 } else { self.waiting };
        let (taken, result) = take(&self.received[..ready]);
        if taken > 0 {
            self.received.copy_within(taken..self.waiting, 0);
            self.waiting -= taken;
            self.call = Call::Received;
            self.exchanges += 1;
        }
        result
    }
}
