//! The thread behind the pages: it lets the machine go on, tells the pages what is to be seen and takes their orders.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use dp_master::phy::{Content, Trace};
use dp_master::wire::{Hex, Pretty};
use tokio::sync::mpsc;

use super::capture::Capture;
use super::hub::Hub;
use super::live::Live;
use super::protocol::{Frame, Hello, Order, Told};
use super::simulated::Plant;
use crate::operator::FeedPlan;
use crate::real_line::RealLine;
use crate::rig::{RigConfig, RigError};

/// A page, by number.
pub(super) type ClientId = u64;

/// Frames and answers that wait for one page; a page that takes none for so long is dropped.
pub(super) const QUEUE: usize = 64;

/// To the engine.
pub(super) enum ToEngine {
    /// A page came.
    Joined(ClientId, mpsc::Sender<Arc<str>>),
    /// It went.
    Left(ClientId),
    /// It wants something.
    Wants(ClientId, Order),
}

/// Where orders go.
#[derive(Clone)]
pub struct Engine {
    orders: Sender<ToEngine>,
    pub(super) capture: Capture,
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Engine")
    }
}

/// Time from frame to frame.
const FRAME: Duration = Duration::from_millis(50);
/// Telegrams that are kept between two frames.
const HEARD: usize = 40;
/// How long a start edge is given to be taken, s.
pub(super) const START_S: f64 = 0.5;

impl Engine {
    /// Starts the chain at power-up, at real time, paused by nobody, the inputs of the block filled in as planned.
    ///
    /// # Errors
    ///
    /// [`RigError`] when the configuration is impossible.
    pub fn start(config: RigConfig, plan: &FeedPlan) -> Result<Self, RigError> {
        let heard: Heard = Arc::default();
        let capture = Capture::new(config.baud);
        let (for_ear, for_capture) = (Arc::clone(&heard), capture.clone());
        let plant = Plant::new(config, plan, heard, move |trace| {
            hear(&for_ear, &trace);
            for_capture.keep(&trace);
        })?;
        Ok(Self::run(Box::new(plant), capture))
    }

    /// Starts block and master in real time on a line.
    ///
    /// # Errors
    ///
    /// One sentence when the line cannot be opened.
    pub fn start_on(line: &RealLine) -> Result<Self, String> {
        let heard: Heard = Arc::default();
        let capture = Capture::new(line.baud);
        let (for_ear, for_capture) = (Arc::clone(&heard), capture.clone());
        let live = Live::open(line, heard, move |trace| {
            hear(&for_ear, &trace);
            for_capture.keep(&trace);
        })?;
        Ok(Self::run(Box::new(live), capture))
    }

    fn run(source: Box<dyn Source>, capture: Capture) -> Self {
        let (orders, received) = channel();
        let hub = Hub::new(source);
        // Without a thread there is nobody to take orders; pages are told that the engine has ended.
        let _ = thread::Builder::new()
            .name("panel-engine".to_owned())
            .spawn(move || run(hub, &received));
        Self { orders, capture }
    }

    /// Hands something over; `false` when the engine has ended.
    pub(super) fn send(&self, what: ToEngine) -> bool {
        self.orders.send(what).is_ok()
    }
}

/// The thread's own: orders as they come, a frame when it is due.
fn run(mut hub: Hub, orders: &Receiver<ToEngine>) {
    let mut next = Instant::now();
    loop {
        loop {
            match orders.try_recv() {
                Ok(what) => hub.handle(what),
                Err(TryRecvError::Empty) => break,
                // Nobody can ever want anything again.
                Err(TryRecvError::Disconnected) => return,
            }
        }
        hub.turn(FRAME);
        // What takes longer than it may is not made up for: the machine is slower then.
        next = (next + FRAME).max(Instant::now());
        thread::sleep(next.saturating_duration_since(Instant::now()));
    }
}

/// Telegrams between two frames, shared with whoever listens on the line.
pub(super) type Heard = Arc<Mutex<VecDeque<(f64, String, String)>>>;

fn hear(heard: &Heard, trace: &Trace<'_>) {
    let what = match &trace.content {
        Content::Telegram(telegram) => Pretty(telegram).to_string(),
        Content::Discarded { reason, .. } => format!("discarded: {reason}"),
    };
    let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
    if heard.len() == HEARD {
        heard.pop_front();
    }
    heard.push_back((trace.start.as_nanos() as f64 / 1e9, what, Hex(trace.octets).to_string()));
}

/// What the panel shows and works: the simulated chain, or a real line.
pub(super) trait Source: Send {
    /// Lets the machine go on for the time of a frame.
    fn advance(&mut self, frame: Duration);

    /// What is to be seen now, and what was recorded since the last call.
    fn frame(&mut self, seq: u64) -> Frame;

    /// What does not change.
    fn hello(&self) -> Hello;

    /// Carries an order of a page out; `None` is an answer that is to be seen in the next frame, or comes later.
    ///
    /// # Errors
    ///
    /// One sentence.
    fn obey(&mut self, asker: ClientId, order: Order) -> Result<Option<Told>, String>;

    /// An answer that took its time, and the page it is for.
    fn poll_told(&mut self) -> Option<(ClientId, Told)> {
        None
    }
}
