//! The simulated chain in paced virtual time.

use std::time::{Duration, Instant};

use dp_master::phy::{Disturbance, Trace};
use lenze9300_model::access::CodePlace;
use lenze9300_model::device::Fault;
use lenze9300_model::plant::Mains;
use lenze9300_model::signal::Signal;

use super::engine::{ClientId, Heard, START_S, Source};
use super::feeds::FeedJudge;
use super::inputs::set_input;
use super::protocol::{Frame, Hello, MAX_CHANNELS, Order, Samples, Told};
use super::snapshot;
use super::stations::Stations;
use crate::machine::{MarkConfig, Missing};
use crate::operator::FeedPlan;
use crate::rig::{Rig, RigConfig, RigError, TickView};

/// Rows that a frame carries at the most; more are thinned to it.
const ROWS: f64 = 500.0;

/// The rig, and what people have done to it.
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

impl Plant {
    /// The chain at power-up, at real time, the inputs of the block filled in as planned. Whoever hears the telegrams leaves them in
    /// `heard`, too.
    pub(super) fn new(
        config: RigConfig,
        plan: &FeedPlan,
        heard: Heard,
        ear: impl FnMut(Trace<'_>) + Send + 'static,
    ) -> Result<Self, RigError> {
        let mut rig = Rig::new(&config)?;
        rig.listen(Box::new(ear));
        let inputs = rig.inputs_mut();
        // As the thesis' variable table was filled in (film-feed specification, section 9); nothing moves before Freigabe.
        inputs.velocity = plan.speed_hundredth_percent;
        inputs.mark_velocity = plan.mark_speed_hundredth_percent;
        inputs.acceleration = plan.accel_hundredth_percent;
        inputs.distance = plan.length_tenth_mm;
        Ok(Self {
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
        })
    }

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

    fn obey(&mut self, _asker: ClientId, order: Order) -> Result<Option<Told>, String> {
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
                Ok(Some(Told::code_read(place, raw)))
            }
            Order::WriteCode { code, value } => {
                let place: CodePlace = code.parse().map_err(|error| format!("{error}"))?;
                let raw = place.parse_value(&value).map_err(|error| error.to_string())?;
                self.rig
                    .drive_mut()
                    .write_code(place.code, place.subcode, raw)
                    .map_err(|error| error.to_string())?;
                Ok(Some(Told::code_written(place, raw)))
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

fn within(value: f64, min: f64, max: f64, what: &str) -> Result<f64, String> {
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{what} {value}: allowed is {min} to {max}"))
    }
}
