//! Block and master in real time on a line: what the panel shows of a real machine is what the bus tells.

use std::collections::VecDeque;
use std::sync::PoisonError;
use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::address::Address;
use dp_master::dp::{DpMaster, SlaveIndex, SlaveState};
use dp_master::driver::Driver;
use dp_master::phy::{ReopeningPort, SerialOptions, Trace, TracedPort};
use dp_master::time::{Duration, Instant};
use drivecom::{ControlWord, State, StatusWord};
use lenze9300_model::access::CodePlace;
use lenze9300_model::bus::dp::PAR_AND_FOUR_WORDS;

use super::codes::Codes;
use super::engine::{ClientId, Heard, START_S, Source};
use super::feeds::FeedJudge;
use super::inputs::{input_values, set_input};
use super::protocol::{BusView, DriveView, Frame, Hello, MachineView, Order, Samples, Told};
use super::snapshot;
use super::stations::Stations;
use crate::block::{FilmFeedBlock, Inputs};
use crate::bus_config;
use crate::parameter_watch::{self, ParameterWatch};
use crate::plc::{DpPeriphery, IMAGE};
use crate::real_line::{LATENCY, PARAMETER_LIMIT_NS, PZD_ADDRESS, RealLine};

/// Time for the telegrams that are heard.
type Clock = Box<dyn FnMut() -> Instant + Send>;
/// Who hears them.
type Ear = Box<dyn FnMut(Trace<'_>) + Send>;

/// The block with its master, in real time.
pub(super) struct Live {
    line: RealLine,
    driver: Driver<TracedPort<ReopeningPort, Clock, Ear>>,
    heard: Heard,
    master: DpMaster<1>,
    slave: SlaveIndex,
    block: FilmFeedBlock,
    inputs: Inputs,
    outputs: [u8; IMAGE],
    watch: ParameterWatch,
    judge: FeedJudge,
    started: StdInstant,
    due: StdInstant,
    start_until_s: Option<f64>,
    rows: Vec<Vec<f64>>,
    taken: u64,
    first: u64,
    rounds: (u64, f64),
    round_ms: f64,
    stations: Stations,
    codes: Codes,
    /// Answers about codes, and the pages they are for.
    answers: VecDeque<(ClientId, Told)>,
    /// Why the line broke; it is told by every frame from then on.
    broken: Option<String>,
}

impl Live {
    /// Opens the line; the master begins with the first frame. Whoever hears the telegrams leaves them in `heard`, too.
    pub(super) fn open(
        line: &RealLine,
        heard: Heard,
        ear: impl FnMut(Trace<'_>) + Send + 'static,
    ) -> Result<Self, String> {
        let address = Address::new(line.slave_address).map_err(|error| error.to_string())?;
        let (master, slave) = bus_config::master(line.baud, address, PAR_AND_FOUR_WORDS, Duration::ZERO, LATENCY)
            .map_err(|error| error.to_string())?;
        let opened =
            ReopeningPort::open(&line.port, line.baud, SerialOptions::default()).map_err(|error| error.to_string())?;
        let now = StdInstant::now();
        let clock: Clock = Box::new(move || Instant::ZERO + now.elapsed().into());
        let ear: Ear = Box::new(ear);
        Ok(Self {
            line: line.clone(),
            driver: Driver::with_epoch(TracedPort::new(opened.port, clock, ear), now),
            heard,
            master,
            slave,
            block: FilmFeedBlock::new(),
            inputs: Inputs {
                pzd_adr: PZD_ADDRESS,
                velocity: 10_000,
                mark_velocity: 2_000,
                acceleration: 10_000,
                distance: 12_000,
                ..Inputs::default()
            },
            outputs: [0; IMAGE],
            watch: ParameterWatch::new(PARAMETER_LIMIT_NS, 0),
            judge: FeedJudge::counting_from_start(),
            started: now,
            due: now,
            start_until_s: None,
            rows: Vec::new(),
            taken: 0,
            first: 0,
            rounds: (0, 0.0),
            round_ms: 0.0,
            stations: Stations::default(),
            codes: Codes::new(address, line.baud),
            answers: VecDeque::new(),
            broken: None,
        })
    }

    fn is_exchanging(&self) -> bool {
        self.master.state(self.slave) == SlaveState::DataExchange
    }

    fn plc_cycle(&mut self) {
        let now_s = self.started.elapsed().as_secs_f64();
        if let Some(until_s) = self.start_until_s
            && (self.block.outputs().running || now_s > until_s)
        {
            self.start_until_s = None;
            self.inputs.pos_start = false;
        }
        while self.master.poll_event().is_some() {}
        self.stations.work(&mut self.master);
        let answer = self.codes.work(self.master.jobs(), self.driver.now());
        self.answers.extend(answer);
        let is_exchanging = self.is_exchanging();
        let images = if is_exchanging {
            self.master.inputs(self.slave).try_into().ok()
        } else {
            None
        };
        let mut periphery = DpPeriphery {
            module_address: PZD_ADDRESS,
            inputs: images,
            outputs: &mut self.outputs,
        };
        self.block.cycle(&mut self.inputs, &mut periphery);
        // Nor does SFC 15 write to a slave that is not there.
        let _ = self.master.set_outputs(self.slave, &self.outputs);
        let presence = if is_exchanging {
            parameter_watch::Periphery::Present
        } else {
            parameter_watch::Periphery::Absent
        };
        let now_ns = (now_s * 1e9) as u64;
        self.watch
            .observe(now_ns, &self.block, self.inputs.error_reset, presence);
        if self.watch.rounds() != self.rounds.0 {
            self.round_ms = 1000.0 * (now_s - self.rounds.1);
            self.rounds = (self.watch.rounds(), now_s);
        }
        let outputs = self.block.outputs();
        let position_mm = f64::from(outputs.position_mm);
        let request = (self.inputs.read_mark, f64::from(self.inputs.distance) / 10.0);
        self.judge
            .millisecond(now_s, position_mm, outputs.running, outputs.job_finished, request);
        let shown_mm = if position_mm.is_finite() { position_mm } else { 0.0 };
        self.rows.push(vec![now_s, f64::from(outputs.speed_percent), shown_mm]);
        self.taken += 1;
    }

    fn drive(&self) -> DriveView {
        let images = self.master.inputs(self.slave);
        let status = match images.get(8..10) {
            Some(&[high, low]) if self.is_exchanging() => u16::from_be_bytes([high, low]),
            _ => 0,
        };
        DriveView {
            state: State::decode(StatusWord(status)).map_or("unknown", State::name),
            control_word: self.block.control_word(),
            commands: snapshot::commands(ControlWord(self.block.control_word())),
            status_word: status,
            diagnosis: None,
            fault: None,
            history: Vec::new(),
            record: None,
            dc_link_v: None,
            current_a: None,
            heat_sink_c: None,
            terminal_28: None,
        }
    }
}

impl Source for Live {
    fn advance(&mut self, frame: StdDuration) {
        let end = StdInstant::now() + frame;
        let cycle = StdDuration::from_nanos(self.line.plc_cycle_ns);
        while StdInstant::now() < end && self.broken.is_none() {
            while let Some(wait) = self
                .due
                .checked_duration_since(StdInstant::now())
                .filter(|wait| !wait.is_zero())
            {
                if let Err(error) = self.driver.step(&mut self.master, wait) {
                    self.broken = Some(format!("the line broke: {error}"));
                    return;
                }
            }
            // A cycle that comes too late is worked at once, and the next one counts from there.
            self.due = (self.due + cycle).max(StdInstant::now());
            self.plc_cycle();
        }
    }

    fn frame(&mut self, seq: u64) -> Frame {
        let samples = Samples {
            first: self.first,
            interval_ms: (self.line.plc_cycle_ns / 1_000_000) as u32,
            channels: vec!["MCTRL_NACT", "POS_ACT"],
            units: vec!["%", "mm"],
            rows: std::mem::take(&mut self.rows),
        };
        self.first = self.taken;
        let outputs = self.block.outputs();
        let position_mm = f64::from(outputs.position_mm);
        let statistics = self.master.statistics();
        let slave = match &self.broken {
            Some(why) => why.clone(),
            None => snapshot::slave_name(self.master.state(self.slave)),
        };
        Frame {
            seq,
            time_s: self.started.elapsed().as_secs_f64(),
            factor: 1.0,
            samples,
            machine: MachineView {
                film_mm: if position_mm.is_finite() { position_mm } else { 0.0 },
                roller_rad: 0.0,
                // 100 % of C0011 is 3000 1/min (film-feed specification, section 5), 25.58 mm a turn of the motor.
                speed_mm_s: f64::from(outputs.speed_percent) * 30.0 * 179.0708 / 7.0 / 60.0,
                marks: Vec::new(),
                reader: false,
                feeds: self.judge.take(),
            },
            inputs: input_values(&self.inputs),
            outputs: snapshot::output_view(outputs),
            drive: self.drive(),
            parameters: snapshot::parameter_view(&self.block, &self.watch, self.round_ms),
            bus: BusView {
                baud: self.line.baud.bits_per_second(),
                slave,
                cycle_us: statistics.mean_cycle.as_nanos() as f64 / 1000.0,
                telegrams: statistics.sent + statistics.received,
                retries: statistics.retries,
                plugged: true,
                bit_error_rate: 0.0,
                second_master: false,
                asking: self.stations.are_asked(),
                stations: self.stations.found(),
                heard: self
                    .heard
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .drain(..)
                    .collect(),
            },
            // The values of a real machine are not known here.
            advice: Vec::new(),
        }
    }

    fn hello(&self) -> Hello {
        Hello {
            is_real: true,
            signals: Vec::new(),
            ..snapshot::hello()
        }
    }

    fn obey(&mut self, asker: ClientId, order: Order) -> Result<Option<Told>, String> {
        match order {
            Order::Set { input, value } => set_input(&mut self.inputs, &input, value).map(|()| None),
            Order::Start => {
                self.inputs.pos_start = true;
                self.start_until_s = Some(self.started.elapsed().as_secs_f64() + START_S);
                Ok(None)
            }
            // Each address where nobody is costs the master's patience with an operating system, and no cycle comes meanwhile.
            Order::LiveList if self.block.outputs().running => {
                Err("a feed runs: the addresses are asked between feeds".to_owned())
            }
            Order::LiveList => {
                self.stations.ask(&mut self.master);
                Ok(None)
            }
            Order::TakeControl | Order::ReleaseControl => Ok(None),
            Order::ReadCode { code } => {
                let place: CodePlace = code.parse().map_err(|error| format!("{error}"))?;
                self.codes.ask(asker, place, None).map(|()| None)
            }
            Order::WriteCode { code, value } => {
                let place: CodePlace = code.parse().map_err(|error| format!("{error}"))?;
                let raw = place.parse_value(&value).map_err(|error| error.to_string())?;
                self.codes.ask(asker, place, Some(raw)).map(|()| None)
            }
            _ => Err("that is for the simulated machine; this one is real".to_owned()),
        }
    }

    fn poll_told(&mut self) -> Option<(ClientId, Told)> {
        self.answers.pop_front()
    }
}
