//! The DP master of class 1: one cycle over all its slaves for each token.
//!
//! ```text
//! cycle: slave 0, slave 1, … slave n−1, Global_Control if there is one to send, one telegram of an acyclic job, token
//! ```
//!
//! A cycle begins no sooner than [`MasterConfig::min_cycle`] after the one before; a cycle that took longer is followed
//! by the next at once, none is skipped or made up for.
//!
//! Source: IEC 61158-6-3; film-feed specification, section 2.

use super::acyclic::{Count, Jobs};
use super::control::{ControlCommand, GlobalControl};
use super::diag::{Diagnosis, StandardDiag};
use super::events::EventQueue;
use super::peer_fcb::PeerFcbs;
use super::sap;
use super::slave_handler::{Context, LossCause, SlaveConfig, SlaveHandler, SlaveState};
use crate::address::Address;
use crate::fdl::{
    Action, ActiveStation, BusParams, BusParamsError, Confirmation, FcbCounter, Outcome, Repeat, RingEvent, TokenUser,
};
use crate::station::{LineError, MAX_TELEGRAM, Station};
use crate::time::{Duration, Instant};
use crate::wire::{Fcb, FunctionCode, Header, RequestFunction, ResponseFunction};

/// How a master runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MasterConfig {
    /// Own address (TS), 0…126.
    pub address: Address,
    /// Bus parameters.
    pub params: BusParams,
    /// Least time from the start of a DP cycle to the start of the next. Default zero: as fast as the bus allows.
    pub min_cycle: Duration,
    /// Pause before a slave that did not answer or refused is tried again. Default 20 ms.
    pub retry_interval: Duration,
}

impl MasterConfig {
    /// A master that cycles as fast as the bus allows.
    pub const fn new(address: Address, params: BusParams) -> Self {
        Self {
            address,
            params,
            min_cycle: Duration::ZERO,
            retry_interval: Duration::from_millis(20),
        }
    }
}

/// What the master does with its slaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// It holds the token and leaves the slaves alone; their watchdogs run out.
    #[default]
    Stop,
    /// Slaves are started up and exchanged with; outputs are zero.
    Clear,
    /// Outputs are those that were set.
    Operate,
}

/// A slave of this master, in the order of [`DpMaster::add_slave`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SlaveIndex(u8);

impl SlaveIndex {
    /// Place in the order of adding, from 0.
    pub const fn position(self) -> usize {
        self.0 as usize
    }
}

/// What happened. The full diagnosis, where one is meant, is at [`DpMaster::diagnosis`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MasterEvent {
    /// The line was silent, the token is ours.
    TokenClaimed,
    /// Another master is on the line (with our own address: a second station has it); we are silent until it is gone.
    ForeignMaster {
        /// Its address.
        address: Address,
    },
    /// The slave accepted everything; from the next cycle on its data are exchanged.
    DataExchange {
        /// Which slave.
        slave: SlaveIndex,
    },
    /// The slave announced and delivered diagnosis.
    Diagnosis {
        /// Which slave.
        slave: SlaveIndex,
        /// Its standard octets.
        diagnosis: StandardDiag,
    },
    /// Set_Prm did not fit: ident number, length or values.
    ParametersRefused {
        /// Which slave.
        slave: SlaveIndex,
        /// Its standard octets; `ident` is what the slave really is.
        diagnosis: StandardDiag,
    },
    /// Chk_Cfg did not fit.
    ConfigurationRefused {
        /// Which slave.
        slave: SlaveIndex,
        /// Its standard octets.
        diagnosis: StandardDiag,
    },
    /// Another master has parametrised the slave.
    OwnedByOther {
        /// Which slave.
        slave: SlaveIndex,
        /// Its standard octets, `master` among them.
        diagnosis: StandardDiag,
    },
    /// A service of the start-up was refused on the data link layer.
    StartUpRejected {
        /// Which slave.
        slave: SlaveIndex,
        /// With what.
        function: ResponseFunction,
    },
    /// A diagnosis was shorter than six octets.
    DiagnosisUnreadable {
        /// Which slave.
        slave: SlaveIndex,
        /// Octets received.
        got: usize,
    },
    /// The exchange with the slave has ended.
    SlaveLost {
        /// Which slave.
        slave: SlaveIndex,
        /// Why.
        cause: LossCause,
    },
}

/// What a master counts and measures since its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MasterStatistics {
    /// Telegrams sent, tokens and repetitions counted.
    pub sent: u64,
    /// Valid telegrams received.
    pub received: u64,
    /// Repetitions sent.
    pub retries: u64,
    /// Slot times that passed without an answer, and answers that did not become complete.
    pub timeouts: u64,
    /// Runs of octets that were no telegram, and telegrams that nobody had asked for.
    pub discarded: u64,
    /// Characters the receiver could not use.
    pub line_errors: u64,
    /// Requests that a slave refused (RS, UE, RR…).
    pub rejected: u64,
    /// Data_Exchange requests answered with data or an acknowledgement.
    pub exchanges: u64,
    /// DP cycles completed.
    pub cycles: u64,
    /// From the start of the last complete cycle to the start of the next.
    pub last_cycle: Duration,
    /// Mean of all cycles.
    pub mean_cycle: Duration,
    /// Shortest cycle.
    pub least_cycle: Duration,
    /// Longest cycle.
    pub longest_cycle: Duration,
    /// From the first bit of the last answered Data_Exchange request to the last bit of its reply, repetitions included.
    pub last_exchange: Duration,
    /// Events lost because nobody fetched them.
    pub lost_events: u64,
}

/// A master of class 1 with up to `N` slaves; see [`Station`] for the order of calls.
///
/// It starts in [`Mode::Stop`].
#[doc(alias = "DP-Master Klasse 1")]
#[derive(Debug, Clone)]
pub struct DpMaster<const N: usize> {
    fdl: ActiveStation,
    cyclic: Cyclic<N>,
}

impl<const N: usize> DpMaster<N> {
    /// A master without slaves, in Stop.
    ///
    /// # Errors
    ///
    /// [`MasterError`] when a bus parameter breaks a rule or the address is no station's.
    pub fn new(config: MasterConfig) -> Result<Self, MasterError> {
        config.params.validate()?;
        if config.address.is_broadcast() {
            return Err(MasterError::Address { got: config.address });
        }
        Ok(Self {
            fdl: ActiveStation::new(config.address, config.params),
            cyclic: Cyclic {
                config,
                mode: Mode::Stop,
                slaves: [const { None }; N],
                count: 0,
                step: Step::Begin,
                stale: false,
                control: None,
                control_octets: [0; 2],
                jobs: Jobs::new(config.address),
                peers: PeerFcbs::new(),
                cycle_started: None,
                cycles_total: Duration::ZERO,
                statistics: MasterStatistics::default(),
                events: EventQueue::new(),
            },
        })
    }

    /// Adds a slave; it is started up when the mode is not Stop.
    ///
    /// # Errors
    ///
    /// [`AddSlaveError`]; the master is then unchanged.
    pub fn add_slave(&mut self, slave: SlaveConfig) -> Result<SlaveIndex, AddSlaveError> {
        let address = slave.address;
        if address.is_broadcast() || address == self.cyclic.config.address {
            return Err(AddSlaveError::Address { got: address });
        }
        let mut present = self.cyclic.slaves.iter().flatten();
        if present.any(|other| other.address() == address) {
            return Err(AddSlaveError::Duplicate { address });
        }
        if slave.min_tsdr != 0 && slave.min_tsdr < 11 {
            return Err(AddSlaveError::MinTsdr { got: slave.min_tsdr });
        }
        let full = AddSlaveError::Full { capacity: N };
        let index = u8::try_from(self.cyclic.count).map_err(|_| full)?;
        let place = self.cyclic.slaves.get_mut(self.cyclic.count).ok_or(full)?;
        *place = Some(SlaveHandler::new(slave));
        self.cyclic.count += 1;
        Ok(SlaveIndex(index))
    }

    /// How many slaves there are.
    pub fn slave_count(&self) -> usize {
        self.cyclic.count
    }

    /// Changes the mode. In Clear and Operate a Global_Control tells the slaves with the end of the cycle; Stop forgets
    /// all slave states, so that leaving it starts them up again.
    pub fn set_mode(&mut self, mode: Mode) {
        if self.cyclic.mode == mode {
            return;
        }
        self.cyclic.mode = mode;
        match mode {
            Mode::Stop => {
                self.cyclic.control = None;
                self.cyclic.stop_slaves();
            }
            Mode::Clear => self.cyclic.control = Some(ALL_CLEAR),
            Mode::Operate => self.cyclic.control = Some(ALL_OPERATE),
        }
    }

    /// The mode.
    pub fn mode(&self) -> Mode {
        self.cyclic.mode
    }

    /// Sends a Global_Control (Sync, Freeze…) with the end of this cycle; one that was not sent yet is replaced.
    ///
    /// In Clear the Clear_Data bit is added; in Stop nothing is sent.
    pub fn send_control(&mut self, control: GlobalControl) {
        let command = match self.cyclic.mode {
            Mode::Stop => return,
            Mode::Clear => control.command.with(ControlCommand::CLEAR_DATA),
            Mode::Operate => control.command,
        };
        self.cyclic.control = Some(GlobalControl { command, ..control });
    }

    /// Sets the outputs of a slave, from its next Data_Exchange on.
    ///
    /// # Errors
    ///
    /// [`OutputsError`] when the length is not the configured one; nothing is changed then.
    pub fn set_outputs(&mut self, slave: SlaveIndex, octets: &[u8]) -> Result<(), OutputsError> {
        let outputs = self.outputs_mut(slave);
        if outputs.len() != octets.len() {
            return Err(OutputsError {
                slave: slave.position(),
                expected: outputs.len(),
                got: octets.len(),
            });
        }
        outputs.copy_from_slice(octets);
        Ok(())
    }

    /// The outputs of a slave, to be changed in place; empty for an index of another master.
    pub fn outputs_mut(&mut self, slave: SlaveIndex) -> &mut [u8] {
        match self.cyclic.slaves.get_mut(slave.position()) {
            Some(Some(handler)) => handler.outputs.as_mut_slice(),
            _ => &mut [],
        }
    }

    /// The inputs last received from a slave; zeros before the first exchange, empty for an index of another master.
    pub fn inputs(&self, slave: SlaveIndex) -> &[u8] {
        self.handler(slave).map_or(&[], |handler| handler.inputs.as_slice())
    }

    /// Where a slave stands.
    pub fn state(&self, slave: SlaveIndex) -> SlaveState {
        self.handler(slave).map_or(SlaveState::Offline, SlaveHandler::state)
    }

    /// The diagnosis last read from a slave.
    pub fn diagnosis(&self, slave: SlaveIndex) -> Option<&Diagnosis> {
        self.handler(slave).and_then(SlaveHandler::diagnosis)
    }

    /// Answered Data_Exchange requests of a slave; a change says that its inputs are new.
    pub fn exchanges(&self, slave: SlaveIndex) -> u64 {
        self.handler(slave).map_or(0, SlaveHandler::exchanges)
    }

    /// The next event, oldest first. The queue holds 32; later ones are lost and counted.
    pub fn poll_event(&mut self) -> Option<MasterEvent> {
        self.cyclic.events.pop()
    }

    /// The acyclic jobs: services to any station, at most one telegram a cycle.
    pub fn jobs(&mut self) -> &mut Jobs {
        &mut self.cyclic.jobs
    }

    /// Counters and measured times.
    pub fn statistics(&self) -> MasterStatistics {
        let fdl = self.fdl.statistics();
        let cyclic = self.cyclic.statistics;
        let total = self.cyclic.cycles_total.as_nanos();
        MasterStatistics {
            sent: fdl.sent,
            received: fdl.received,
            retries: fdl.retries,
            timeouts: fdl.timeouts,
            discarded: fdl.discarded,
            line_errors: fdl.line_errors,
            mean_cycle: Duration::from_nanos(total.checked_div(cyclic.cycles).unwrap_or(0)),
            lost_events: self.cyclic.events.lost(),
            ..cyclic
        }
    }

    /// Whether the station holds the token.
    pub fn holds_token(&self) -> bool {
        self.fdl.holds_token()
    }

    fn handler(&self, slave: SlaveIndex) -> Option<&SlaveHandler> {
        self.cyclic.slaves.get(slave.position())?.as_ref()
    }
}

impl<const N: usize> Station for DpMaster<N> {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.fdl.handle_octets(now, octets, &mut self.cyclic);
    }

    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.fdl.handle_line_error(now, error, &mut self.cyclic);
    }

    fn handle_sent(&mut self, now: Instant) {
        self.fdl.handle_sent(now, &mut self.cyclic);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.fdl.handle_timeout(now, &mut self.cyclic);
    }

    fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        self.fdl.poll_transmit(now, buf, &mut self.cyclic)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.fdl.poll_timeout()
    }
}

/// Where the cycle stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// Nothing sent yet.
    Begin,
    /// The slave at this place is next, or its request is under way.
    Slave(usize),
    /// The Global_Control at the end, or its telegram is under way.
    Control,
    /// One telegram of an acyclic job, or it is under way.
    Acyclic,
    /// Nothing but the token.
    End,
}

#[derive(Debug, Clone)]
struct Cyclic<const N: usize> {
    config: MasterConfig,
    mode: Mode,
    slaves: [Option<SlaveHandler>; N],
    count: usize,
    step: Step,
    /// The answer under way belongs to a slave state that Stop has ended.
    stale: bool,
    control: Option<GlobalControl>,
    control_octets: [u8; 2],
    jobs: Jobs,
    /// Frame count bits towards the stations of the jobs that are no slaves of ours.
    peers: PeerFcbs,
    cycle_started: Option<Instant>,
    cycles_total: Duration,
    statistics: MasterStatistics,
    events: EventQueue<MasterEvent, EVENTS>,
}

const EVENTS: usize = 32;
const ALL_OPERATE: GlobalControl = GlobalControl {
    command: ControlCommand::OPERATE,
    group_select: 0,
};
const ALL_CLEAR: GlobalControl = GlobalControl {
    command: ControlCommand::CLEAR_DATA,
    group_select: 0,
};

impl<const N: usize> Cyclic<N> {
    fn begin_cycle(&mut self, now: Instant) {
        if let Some(started) = self.cycle_started {
            let cycle = now - started;
            let statistics = &mut self.statistics;
            statistics.least_cycle = match statistics.cycles {
                0 => cycle,
                _ => statistics.least_cycle.min(cycle),
            };
            statistics.longest_cycle = statistics.longest_cycle.max(cycle);
            statistics.last_cycle = cycle;
            statistics.cycles += 1;
            self.cycles_total += cycle;
        }
        self.cycle_started = Some(now);
    }

    fn stop_slaves(&mut self) {
        self.stale = true;
        for (place, slave) in self.slaves.iter_mut().enumerate() {
            if let Some(slave) = slave {
                let context = context(&self.config, place);
                if let Some(event) = slave.stop(&context) {
                    self.events.push(event);
                }
            }
        }
    }

    fn slave_at(&mut self, address: Address) -> Option<&mut SlaveHandler> {
        self.slaves
            .iter_mut()
            .flatten()
            .find(|slave| slave.address() == address)
    }

    /// The frame count bit of a station; a slave has one for cyclic and acyclic requests together.
    fn fcb_mut(&mut self, peer: Address) -> &mut FcbCounter {
        let slave = self.slaves.iter_mut().flatten().find(|slave| slave.address() == peer);
        match slave {
            Some(slave) => slave.fcb_mut(),
            None => self.peers.counter(peer),
        }
    }

    /// The Global_Control waits until somebody can obey it.
    fn control_is_due(&self) -> bool {
        self.control.is_some()
            && self
                .slaves
                .iter()
                .flatten()
                .any(|slave| slave.state() == SlaveState::DataExchange)
    }
}

fn context(config: &MasterConfig, place: usize) -> Context {
    Context {
        master: config.address,
        // A place is below the count, which add_slave keeps within an octet.
        slave: SlaveIndex(place as u8),
        retry_interval: config.retry_interval,
    }
}

impl<const N: usize> TokenUser for Cyclic<N> {
    /// At most one look at each slave.
    fn next_action(&mut self, now: Instant) -> Action<'_> {
        // Nothing is under way when this is asked.
        self.stale = false;
        if self.step == Step::Begin {
            if let Some(started) = self.cycle_started {
                let due = started + self.config.min_cycle;
                if now < due {
                    return Action::WaitUntil(due);
                }
            }
            self.begin_cycle(now);
            self.step = Step::Slave(0);
        }
        if let Step::Slave(first) = self.step {
            let first = if self.mode == Mode::Stop { N } else { first };
            let due = (first..self.count)
                .find(|&place| matches!(self.slaves.get(place), Some(Some(slave)) if slave.is_due(now)));
            self.step = due.map_or(Step::Control, Step::Slave);
        }
        if let Step::Slave(place) = self.step {
            return match self.slaves.get(place) {
                Some(Some(handler)) => handler.next_action(now, self.config.address, self.mode),
                // The place was found above.
                _ => Action::PassToken,
            };
        }
        if self.step == Step::Control
            && self.control_is_due()
            && let Some(control) = self.control
        {
            self.control_octets = control.octets();
            let fc = FunctionCode::request(Fcb::Inactive, RequestFunction::SdnHigh);
            let header =
                Header::new(Address::BROADCAST, self.config.address, fc).with_saps(sap::GLOBAL_CONTROL, sap::MASTER);
            return Action::Send {
                header,
                data: &self.control_octets,
                repeat: Repeat::Never,
            };
        }
        if self.step != Step::End
            && let Some(peer) = self.jobs.begin()
        {
            self.step = Step::Acyclic;
            let fcb = self.fcb_mut(peer).current();
            if let Some(action) = self.jobs.action(fcb) {
                return action;
            }
        }
        self.step = Step::Begin;
        Action::PassToken
    }

    fn confirm(&mut self, now: Instant, confirmation: Confirmation<'_>) {
        let Confirmation { started, outcome } = confirmation;
        match self.step {
            Step::Slave(place) => {
                self.step = Step::Slave(place + 1);
                let Some(Some(handler)) = self.slaves.get_mut(place) else {
                    return;
                };
                if self.stale {
                    return;
                }
                let context = context(&self.config, place);
                let report = handler.confirm(now, started, outcome, &context);
                if report.exchanged {
                    self.statistics.exchanges += 1;
                    self.statistics.last_exchange = now - started;
                }
                if report.rejected {
                    self.statistics.rejected += 1;
                }
                if let Some(event) = report.event {
                    self.events.push(event);
                }
            }
            Step::Acyclic => {
                self.step = Step::End;
                if let Outcome::Response { header, data } = outcome
                    && header.ssap == Some(sap::SLAVE_DIAG)
                    && let Some(slave) = self.slave_at(header.sa)
                {
                    slave.diagnosis_seen(data);
                }
                if let Some((peer, count)) = self.jobs.confirm(now, started, outcome) {
                    let stale = self.stale;
                    let fcb = self.fcb_mut(peer);
                    match count {
                        // Stop has reset the bit of a slave while the answer was under way.
                        Count::Next if !stale => fcb.confirm(),
                        Count::Keep => {}
                        Count::Next | Count::Restart => fcb.reset(),
                    }
                }
            }
            Step::Control | Step::Begin | Step::End => {
                if outcome == Outcome::Sent {
                    self.control = None;
                }
                self.step = Step::Acyclic;
            }
        }
    }

    fn handle_ring(&mut self, _now: Instant, event: RingEvent) {
        match event {
            RingEvent::Claimed => {
                self.step = Step::Begin;
                // The silence before was no cycle.
                self.cycle_started = None;
                self.peers.forget();
                self.events.push(MasterEvent::TokenClaimed);
            }
            RingEvent::ForeignMaster(address) => {
                self.events.push(MasterEvent::ForeignMaster { address });
            }
        }
    }
}

/// Why there is no such master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MasterError {
    /// A bus parameter breaks a rule.
    #[error("bus parameters: {0}")]
    Params(#[from] BusParamsError),
    /// 127 is no station.
    #[error("master address: expected 0 to 126, got {got}")]
    Address {
        /// The address.
        got: Address,
    },
}

/// Why a slave was not added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AddSlaveError {
    /// The master has room for no more.
    #[error("slaves: expected at most {capacity}")]
    Full {
        /// How many there may be.
        capacity: usize,
    },
    /// Two slaves cannot share an address.
    #[error("slave address {address} is already in use")]
    Duplicate {
        /// The address.
        address: Address,
    },
    /// The address is the master's or that of all stations.
    #[error("slave address: expected 0 to 126 and not the master's, got {got}")]
    Address {
        /// The address.
        got: Address,
    },
    /// min Tsdr is 0 (keep) or at least one character.
    #[error("min Tsdr: expected 0 or at least 11 tBIT, got {got}")]
    MinTsdr {
        /// The value.
        got: u8,
    },
}

/// Outputs of another length than configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("outputs of slave {slave}: expected {expected} octets, got {got}")]
pub struct OutputsError {
    /// Place of the slave in the order of adding.
    pub slave: usize,
    /// Configured octets.
    pub expected: usize,
    /// Octets given.
    pub got: usize,
}
