//! The rig in paced virtual time, in a thread of its own.

use std::collections::{HashMap, VecDeque};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use dp_master::phy::{Content, Disturbance, Trace};
use dp_master::wire::{Hex, Pretty};
use lenze9300_model::access::CodePlace;
use lenze9300_model::device::Fault;
use lenze9300_model::plant::Mains;
use lenze9300_model::signal::Signal;
use tokio::sync::mpsc;

use super::capture::Capture;
use super::feeds::FeedJudge;
use super::live::Live;
use super::protocol::{Frame, Hello, INPUTS, MAX_CHANNELS, Order, Samples, Told};
use super::snapshot;
use super::stations::Stations;
use crate::block::Inputs;
use crate::machine::{MarkConfig, Missing};
use crate::operator::FeedPlan;
use crate::real_line::RealLine;
use crate::rig::{Rig, RigConfig, RigError, TickView};

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
/// Rows that a frame carries at the most; more are thinned to it.
const ROWS: f64 = 500.0;
/// How long a start edge is given to be taken, s.
pub(super) const START_S: f64 = 0.5;

impl Engine {
    /// Starts the chain at power-up, at real time, paused by nobody, the inputs of the block filled in as planned.
    ///
    /// # Errors
    ///
    /// [`RigError`] when the configuration is impossible.
    pub fn start(config: RigConfig, plan: &FeedPlan) -> Result<Self, RigError> {
        let mut rig = Rig::new(&config)?;
        let heard: Heard = Arc::default();
        let capture = Capture::new(config.baud);
        let (for_ear, for_capture) = (Arc::clone(&heard), capture.clone());
        rig.listen(Box::new(move |trace| {
            hear(&for_ear, &trace);
            for_capture.keep(&trace);
        }));
        let inputs = rig.inputs_mut();
        // As the thesis' variable table was filled in (film-feed specification, section 9); nothing moves before Freigabe.
        inputs.velocity = plan.speed_hundredth_percent;
        inputs.mark_velocity = plan.mark_speed_hundredth_percent;
        inputs.acceleration = plan.accel_hundredth_percent;
        inputs.distance = plan.length_tenth_mm;
        let plant = Plant {
            rig,
            config,
            heard,
            factor: 1.0,
            owed_ns: 0.0,
            step_ns: 0,
            start_until_s: None,
            bit_error_rate: 0.0,
            plugged: true,
            recorder: Recorder::default(),
            rounds: Rounds::default(),
            stations: Stations::default(),
        };
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

/// Everything the thread owns.
pub(super) struct Plant {
    pub(super) rig: Rig,
    pub(super) config: RigConfig,
    pub(super) heard: Heard,
    pub(super) factor: f64,
    /// Machine time that is due, ns.
    owed_ns: f64,
    /// Machine time of single steps that is due, ns.
    step_ns: u64,
    start_until_s: Option<f64>,
    pub(super) bit_error_rate: f64,
    pub(super) plugged: bool,
    pub(super) recorder: Recorder,
    pub(super) rounds: Rounds,
    pub(super) stations: Stations,
}

/// Time of a round of the parameter telegrams.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rounds {
    seen: u64,
    at_ns: u64,
    pub(super) last_ms: f64,
}

/// Samples since the last frame, and feeds.
pub(super) struct Recorder {
    signals: Vec<Signal>,
    rows: Vec<Vec<f64>>,
    first: u64,
    taken: u64,
    interval_ms: u64,
    milliseconds: u64,
    pub(super) judge: FeedJudge,
    running: bool,
    finished: bool,
    request: (bool, f64),
}

impl Default for Recorder {
    /// The two signals of figure 73 of the thesis, and the current.
    fn default() -> Self {
        Self {
            signals: vec![Signal::PosNout, Signal::MctrlNact, Signal::Current],
            rows: Vec::new(),
            first: 0,
            taken: 0,
            interval_ms: 1,
            milliseconds: 0,
            judge: FeedJudge::default(),
            running: false,
            finished: false,
            request: (false, 0.0),
        }
    }
}

impl Recorder {
    fn tick(&mut self, view: &mut TickView<'_>) {
        while let Some(event) = view.drive.poll_traverse_event() {
            self.judge.event(&event, view.film.last_mark_mm());
        }
        if !view.ends_millisecond {
            return;
        }
        let time_s = view.now_ns as f64 / 1e9;
        self.judge.millisecond(
            time_s,
            view.film.position_mm(),
            self.running,
            self.finished,
            self.request,
        );
        self.milliseconds += 1;
        if !self.milliseconds.is_multiple_of(self.interval_ms) {
            return;
        }
        let mut row = vec![time_s];
        row.extend(self.signals.iter().map(|signal| signal.read(view.drive)));
        self.rows.push(row);
        self.taken += 1;
    }

    pub(super) fn take(&mut self) -> Samples {
        let samples = Samples {
            first: self.first,
            interval_ms: self.interval_ms as u32,
            channels: self.signals.iter().map(|signal| signal.name()).collect(),
            units: self.signals.iter().map(|signal| signal.unit()).collect(),
            rows: std::mem::take(&mut self.rows),
        };
        self.first = self.taken;
        samples
    }
}

/// What the panel shows and works: the simulated chain, or a real line.
pub(super) trait Source: Send {
    /// Lets the machine go on for the time of a frame.
    fn advance(&mut self, frame: Duration);

    /// What is to be seen now, and what was recorded since the last call.
    fn frame(&mut self, seq: u64) -> Frame;

    /// What does not change.
    fn hello(&self) -> Hello;

    /// Carries an order out.
    ///
    /// # Errors
    ///
    /// One sentence.
    fn obey(&mut self, order: Order) -> Result<Option<Told>, String>;
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
            order => self.source.obey(order),
        }
    }
}

impl Plant {
    fn plc_cycle_ns(&self) -> u64 {
        self.config.plc_cycle_ns
    }

    fn plc_cycle(&mut self) {
        let now_s = self.rig.now_ns() as f64 / 1e9;
        let outputs = *self.rig.outputs();
        if let Some(until_s) = self.start_until_s
            && (outputs.running || now_s > until_s)
        {
            self.start_until_s = None;
            self.rig.inputs_mut().pos_start = false;
        }
        let inputs = *self.rig.inputs_mut();
        let recorder = &mut self.recorder;
        recorder.running = outputs.running;
        recorder.finished = outputs.job_finished;
        recorder.request = (inputs.read_mark, f64::from(inputs.distance) / 10.0);
        self.rig.cycle(&mut |view: &mut TickView<'_>| recorder.tick(view));
        let rounds = self.rig.parameter_watch().rounds();
        if rounds != self.rounds.seen {
            let now_ns = self.rig.now_ns();
            self.rounds.last_ms = (now_ns - self.rounds.at_ns) as f64 / 1e6;
            self.rounds.seen = rounds;
            self.rounds.at_ns = now_ns;
        }
        let master = self.rig.master_mut();
        while master.poll_event().is_some() {}
        self.stations.work(master);
    }
}

impl Source for Plant {
    fn advance(&mut self, frame: Duration) {
        self.owed_ns += self.factor * frame.as_nanos() as f64;
        // More rows than a page can draw are of no use: from ten times real time on they are thinned.
        self.recorder.interval_ms = (self.factor * frame.as_millis() as f64 / ROWS).ceil().max(1.0) as u64;
        let begun = Instant::now();
        let end_ns = self.rig.now_ns() as f64 + self.owed_ns + self.step_ns as f64;
        while (self.rig.now_ns() + self.plc_cycle_ns()) as f64 <= end_ns {
            self.plc_cycle();
            if begun.elapsed() > 2 * frame {
                // Too fast for this computer: what is not done is dropped.
                self.owed_ns = 0.0;
                self.step_ns = 0;
                return;
            }
        }
        let left_ns = end_ns - self.rig.now_ns() as f64;
        self.step_ns = 0;
        self.owed_ns = left_ns.max(0.0);
    }

    fn frame(&mut self, seq: u64) -> Frame {
        snapshot::frame(self, seq)
    }

    fn hello(&self) -> Hello {
        snapshot::hello()
    }

    fn obey(&mut self, order: Order) -> Result<Option<Told>, String> {
        let done = |what: String| Ok(Some(Told::Done { what }));
        match order {
            // The hub has carried these out.
            Order::TakeControl | Order::ReleaseControl => Ok(None),
            Order::Speed { factor } => {
                self.factor = within(factor, 0.0, 100.0, "speed")?;
                Ok(None)
            }
            Order::Step { ms } => {
                if self.factor > 0.0 || !(1..=1000).contains(&ms) {
                    return Err("a step of 1 to 1000 ms is for a machine that stands paused".to_owned());
                }
                self.step_ns += u64::from(ms) * 1_000_000;
                Ok(None)
            }
            Order::Set { input, value } => set_input(self.rig.inputs_mut(), &input, value).map(|()| None),
            Order::Start => {
                self.rig.inputs_mut().pos_start = true;
                self.start_until_s = Some(self.rig.now_ns() as f64 / 1e9 + START_S);
                Ok(None)
            }
            Order::Rethread { printed } => {
                let marks = MarkConfig {
                    missing: if printed { Missing::None } else { Missing::All },
                    ..self.config.film.marks.clone()
                };
                self.rig.rethread_film(marks);
                done("the film is threaded anew".to_owned())
            }
            Order::BlankMark => {
                self.rig.blank_next_mark();
                done("the next mark is not printed".to_owned())
            }
            Order::LiveList => {
                self.stations.ask(self.rig.master_mut());
                Ok(None)
            }
            Order::Noise { bit_error_rate } => {
                let rate = within(bit_error_rate, 0.0, 0.001, "bit error rate")?;
                let disturbance = (rate > 0.0)
                    .then(|| Disturbance::new(self.config.seed, rate))
                    .transpose()
                    .map_err(|error| error.to_string())?;
                self.rig.line_mut().set_disturbance(disturbance);
                self.bit_error_rate = rate;
                Ok(None)
            }
            Order::Cable { plugged } => {
                if plugged {
                    self.rig.reconnect_module();
                } else {
                    self.rig.disconnect_module();
                }
                self.plugged = plugged;
                Ok(None)
            }
            Order::SecondMaster { present } => {
                self.rig.set_second_master(present).map_err(|error| error.to_string())?;
                Ok(None)
            }
            Order::Mains { on } => {
                self.rig.drive_mut().set_mains(if on { Mains::On } else { Mains::Off });
                Ok(None)
            }
            Order::Terminal28 { high } => {
                self.rig.drive_mut().set_terminal_28(high);
                Ok(None)
            }
            Order::Load { nm } => {
                let nm = within(nm, -3.0, 3.0, "load")?;
                self.rig.drive_mut().set_load_torque(nm);
                Ok(None)
            }
            Order::Fault { name, present } => {
                let fault = Fault::ALL
                    .into_iter()
                    .find(|fault| fault.display() == name)
                    .ok_or_else(|| format!("`{name}` is no fault"))?;
                self.rig.drive_mut().inject(fault, present);
                Ok(None)
            }
            Order::ReadCode { code } => {
                let place: CodePlace = code.parse().map_err(|error| format!("{error}"))?;
                let raw = self
                    .rig
                    .drive_mut()
                    .read_code(place.code, place.subcode)
                    .map_err(|error| error.to_string())?;
                Ok(Some(Told::Code {
                    code: place.to_string(),
                    shown: place.show(raw),
                    value: place.decimal(raw),
                    meaning: place.entry().map_or("", |entry| entry.name),
                }))
            }
            Order::WriteCode { code, value } => {
                let place: CodePlace = code.parse().map_err(|error| format!("{error}"))?;
                let raw = place.parse_value(&value).map_err(|error| error.to_string())?;
                self.rig
                    .drive_mut()
                    .write_code(place.code, place.subcode, raw)
                    .map_err(|error| error.to_string())?;
                done(format!("{place} = {}", place.show(raw)))
            }
            Order::Channels { names } => {
                if names.is_empty() || names.len() > MAX_CHANNELS {
                    return Err(format!(
                        "1 to {MAX_CHANNELS} channels can be recorded, got {}",
                        names.len()
                    ));
                }
                let signals: Result<Vec<Signal>, _> = names.iter().map(|name| name.parse()).collect();
                self.recorder = Recorder {
                    signals: signals.map_err(|error| error.to_string())?,
                    judge: std::mem::take(&mut self.recorder.judge),
                    ..Recorder::default()
                };
                Ok(None)
            }
        }
    }
}

fn text_of(told: &Told) -> Option<Arc<str>> {
    serde_json::to_string(told).ok().map(Arc::from)
}

fn within(value: f64, min: f64, max: f64, what: &str) -> Result<f64, String> {
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{what} {value}: allowed is {min} to {max}"))
    }
}

pub(super) fn set_input(inputs: &mut Inputs, name: &str, value: i32) -> Result<(), String> {
    let info = INPUTS
        .iter()
        .find(|info| info.name == name)
        .ok_or_else(|| format!("`{name}` is no input of the block"))?;
    if !(info.min..=info.max).contains(&value) {
        let scale = 10_f64.powi(i32::from(info.decimals));
        let shown = |raw: i32| format!("{:.*}", usize::from(info.decimals), f64::from(raw) / scale);
        return Err(format!(
            "{}: {} is not allowed, {} to {} {} is",
            info.original,
            shown(value),
            shown(info.min),
            shown(info.max),
            info.unit
        ));
    }
    let is_set = value == 1;
    match name {
        "enable" => inputs.enable = is_set,
        "pos_start" => inputs.pos_start = is_set,
        "pos_stop" => inputs.pos_stop = is_set,
        "error_reset" => inputs.error_reset = is_set,
        "read_mark" => inputs.read_mark = is_set,
        "manual" => inputs.manual = is_set,
        "manual_pos" => inputs.manual_pos = is_set,
        "manual_neg" => inputs.manual_neg = is_set,
        // The ranges of the table fit 16 bits.
        "velocity" => inputs.velocity = value as i16,
        "mark_velocity" => inputs.mark_velocity = value as i16,
        "acceleration" => inputs.acceleration = value as i16,
        _ => inputs.distance = value as i16,
    }
    Ok(())
}

/// Values of the inputs in the order of [`INPUTS`].
pub(super) fn input_values(inputs: &Inputs) -> Vec<i32> {
    vec![
        i32::from(inputs.enable),
        i32::from(inputs.pos_start),
        i32::from(inputs.pos_stop),
        i32::from(inputs.error_reset),
        i32::from(inputs.read_mark),
        i32::from(inputs.manual),
        i32::from(inputs.manual_pos),
        i32::from(inputs.manual_neg),
        i32::from(inputs.velocity),
        i32::from(inputs.mark_velocity),
        i32::from(inputs.acceleration),
        i32::from(inputs.distance),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_input_of_the_table_is_set_and_shown_at_its_own_place() {
        for (place, info) in INPUTS.iter().enumerate() {
            let mut inputs = Inputs::default();
            set_input(&mut inputs, info.name, info.max).expect("inside the range");
            let values = input_values(&inputs);
            for (other, value) in values.iter().enumerate() {
                assert_eq!(
                    *value,
                    if other == place { info.max } else { 0 },
                    "{} at {other}",
                    info.name
                );
            }
            let told = set_input(&mut inputs, info.name, info.max + 1).expect_err("above the range");
            assert!(told.contains(info.original), "{told}");
        }
        assert!(set_input(&mut Inputs::default(), "Freigabe", 1).is_err());
    }
}
