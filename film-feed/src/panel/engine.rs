//! The thread behind the pages: it lets the machine go on, tells the pages what is to be seen and takes their orders.

use std::collections::{HashMap, VecDeque};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use dp_master::phy::{Content, Trace};
use dp_master::wire::{Hex, Pretty};
use tokio::sync::mpsc;

use super::capture::Capture;
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
        let hub = Hub {
            source,
            clients: HashMap::new(),
            control: None,
            seq: 0,
        };
        // Without a thread there is nobody to take orders; pages are told that the engine has ended.
        let _ = thread::Builder::new()
            .name("panel-engine".to_owned())
            .spawn(move || hub.run(&received));
        Self { orders, capture }
    }

    /// Hands something over; `false` when the engine has ended.
    pub(super) fn send(&self, what: ToEngine) -> bool {
        self.orders.send(what).is_ok()
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

/// Pages, and who of them may change something.
struct Hub {
    source: Box<dyn Source>,
    clients: HashMap<ClientId, mpsc::Sender<Arc<str>>>,
    control: Option<ClientId>,
    seq: u64,
}

impl Hub {
    fn run(mut self, orders: &Receiver<ToEngine>) {
        let mut next = Instant::now();
        loop {
            loop {
                match orders.try_recv() {
                    Ok(what) => self.handle(what),
                    Err(TryRecvError::Empty) => break,
                    // Nobody can ever want anything again.
                    Err(TryRecvError::Disconnected) => return,
                }
            }
            self.source.advance(FRAME);
            while let Some((id, told)) = self.source.poll_told() {
                self.tell(id, &told);
            }
            self.tell_frame();
            // What takes longer than it may is not made up for: the machine is slower then.
            next = (next + FRAME).max(Instant::now());
            thread::sleep(next.saturating_duration_since(Instant::now()));
        }
    }

    fn tell_frame(&mut self) {
        let frame = self.source.frame(self.seq);
        self.seq += 1;
        self.tell_all(&Told::Frame(Box::new(frame)));
    }

    /// A page whose queue is full takes nothing any more: it is dropped.
    fn tell_all(&mut self, told: &Told) {
        if self.clients.is_empty() {
            return;
        }
        let Some(text) = text_of(told) else { return };
        let mut gone = Vec::new();
        for (id, client) in &self.clients {
            if client.try_send(Arc::clone(&text)).is_err() {
                gone.push(*id);
            }
        }
        for id in gone {
            self.leave(id);
        }
    }

    fn tell(&mut self, id: ClientId, told: &Told) {
        let is_gone = match (self.clients.get(&id), text_of(told)) {
            (Some(client), Some(text)) => client.try_send(text).is_err(),
            _ => false,
        };
        if is_gone {
            self.leave(id);
        }
    }

    fn tell_control(&mut self) {
        let ids: Vec<_> = self.clients.keys().copied().collect();
        for id in ids {
            let told = Told::Control {
                yours: self.control == Some(id),
                taken: self.control.is_some(),
            };
            self.tell(id, &told);
        }
    }

    fn leave(&mut self, id: ClientId) {
        self.clients.remove(&id);
        if self.control == Some(id) {
            self.control = None;
            self.tell_control();
        }
    }

    fn handle(&mut self, what: ToEngine) {
        match what {
            ToEngine::Joined(id, client) => {
                self.clients.insert(id, client);
                self.tell(id, &Told::Hello(Box::new(self.source.hello())));
                // Who is alone need not ask.
                if self.control.is_none() {
                    self.control = Some(id);
                }
                self.tell_control();
            }
            ToEngine::Left(id) => self.leave(id),
            ToEngine::Wants(id, order) => {
                let answer = if self.control == Some(id) || order.only_looks() {
                    self.obey(id, order)
                } else {
                    Err("another page has the control; take it over there, or wait until it is given up".to_owned())
                };
                let told = match answer {
                    Ok(None) => return,
                    Ok(Some(told)) => told,
                    Err(why) => Told::Refused { why },
                };
                self.tell(id, &told);
            }
        }
    }

    fn obey(&mut self, id: ClientId, order: Order) -> Result<Option<Told>, String> {
        match order {
            Order::TakeControl => {
                if self.control.is_some_and(|holder| holder != id) {
                    return Err("another page has the control; it must give it up first".to_owned());
                }
                self.control = Some(id);
                self.tell_control();
                Ok(None)
            }
            Order::ReleaseControl => {
                if self.control == Some(id) {
                    self.control = None;
                    self.tell_control();
                }
                Ok(None)
            }
            order => self.source.obey(id, order),
        }
    }
}

fn text_of(told: &Told) -> Option<Arc<str>> {
    serde_json::to_string(told).ok().map(Arc::from)
}
