//! The DP master of class 1: one cycle over all its slaves for each token.
//!
//! ```text
//! cycle: slave 0, slave 1, … slave n−1, Global_Control: mode, command; one telegram of an acyclic job, token
//! ```
//!
//! # Constant bus cycle
//!
//! Cycles begin [`MasterConfig::min_cycle`] apart. One that is not done when the next is due is an overrun: it is
//! counted, the first of a row is an event, and [`MasterConfig::overrun`] says when the next one begins. No cycle is
//! ever made up for.
//!
//! # Global_Control
//!
//! Each change of the mode is told to all slaves, and again to those that come later while the outputs are cleared.
//! Commands of the user wait in a queue; one goes out per cycle.
//!
//! Source: IEC 61158-6-3; film-feed specification, section 2.

use super::acyclic::Jobs;
use super::control::GlobalControl;
use super::cyclic::Cyclic;
use super::diag::{Diagnosis, StandardDiag, StationStatus};
use super::operation::AutoClear;
use super::pace::Overrun;
use super::slave_handler::{Activation, LossCause, SlaveConfig, SlaveHandler, SlaveState};
use crate::address::Address;
use crate::fdl::{ActiveStation, BusParams, BusParamsError, FdlState, Las, Membership, RingEvent};
use crate::station::{LineError, MAX_TELEGRAM, Station};
use crate::time::{Duration, Instant};
use crate::wire::ResponseFunction;

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
    /// When the next cycle begins after one that took too long. Default at once.
    pub overrun: Overrun,
    /// What a failed slave means to the others. Default nothing.
    pub auto_clear: AutoClear,
    /// Data_Control_Time: how long a slave may be without an answered Data_Exchange before Auto_Clear acts, at least
    /// two cycles. Default 100 ms.
    pub data_control_time: Duration,
    /// How often the mode is told with a Global_Control beside its changes. Default never: the exchange needs none.
    pub announce_mode: Option<Duration>,
}

impl MasterConfig {
    /// A master that cycles as fast as the bus allows.
    pub const fn new(address: Address, params: BusParams) -> Self {
        Self {
            address,
            params,
            min_cycle: Duration::ZERO,
            retry_interval: Duration::from_millis(20),
            overrun: Overrun::FollowAtOnce,
            auto_clear: AutoClear::Off,
            data_control_time: Duration::from_millis(100),
            announce_mode: None,
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
    /// A place is below the count of slaves, which [`DpMaster::add_slave`] keeps within an octet.
    pub(super) const fn at(place: usize) -> Self {
        Self(place as u8)
    }

    /// Place in the order of adding, from 0.
    pub const fn position(self) -> usize {
        self.0 as usize
    }
}

/// What happened. The full diagnosis, where one is meant, is at [`DpMaster::diagnosis`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MasterEvent {
    /// Something happened to the token or the ring of masters.
    Ring(RingEvent),
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
    /// The exchange with the slave has ended, or never came about although the slave accepted everything.
    SlaveLost {
        /// Which slave.
        slave: SlaveIndex,
        /// Why.
        cause: LossCause,
    },
    /// Auto_Clear: the outputs of all slaves are cleared because no data were exchanged with this one.
    AutoCleared {
        /// The first one that failed.
        slave: SlaveIndex,
    },
    /// Auto_Clear: every slave exchanges data, the outputs are those that were set.
    OutputsReleased,
    /// A cycle was not done when the next one was due, and the one before was.
    CycleOverrun {
        /// How long it took from its start to its last telegram.
        took: Duration,
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
    /// Tokens sent, to ourselves and repetitions counted.
    pub tokens: u64,
    /// Tokens repeated because the successor did not act.
    pub token_retries: u64,
    /// Addresses asked whether a master wants to enter the ring.
    pub gap_requests: u64,
    /// The last real rotation time of the token (Trr); zero before the second token.
    pub last_rotation: Duration,
    /// The longest one.
    pub longest_rotation: Duration,
    /// Requests that a slave refused (RS, UE, RR…).
    pub rejected: u64,
    /// Data_Exchange requests answered with data or an acknowledgement.
    pub exchanges: u64,
    /// DP cycles completed.
    pub cycles: u64,
    /// Cycles that were not done when the next one was due, if there is a `min_cycle`.
    pub overruns: u64,
    /// Periods without a start of a cycle, see [`Overrun::KeepPhase`].
    pub missed_cycles: u64,
    /// Answered exchanges in which the slave had no room for its outputs (RR, RDL, RDH); they are sent again in the
    /// next cycle.
    pub outputs_refused: u64,
    /// From the start of the last complete cycle to the start of the next.
    pub last_cycle: Duration,
    /// Mean of all cycles.
    pub mean_cycle: Duration,
    /// Shortest cycle.
    pub least_cycle: Duration,
    /// Longest cycle.
    pub longest_cycle: Duration,
    /// From the first bit of the last answered Data_Exchange request to the last bit of its reply, repetitions
    /// included.
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
        let two_cycles = config.min_cycle.as_nanos().saturating_mul(2);
        if config.auto_clear != AutoClear::Off && config.data_control_time.as_nanos() < two_cycles {
            return Err(MasterError::DataControlTime {
                least: Duration::from_nanos(two_cycles),
                got: config.data_control_time,
            });
        }
        Ok(Self {
            fdl: ActiveStation::new(config.address, config.params),
            cyclic: Cyclic::new(config),
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
    ///
    /// With Auto_Clear, Operate begins once every slave exchanges data; until then the mode is Clear.
    pub fn set_mode(&mut self, mode: Mode) {
        self.cyclic.set_mode(mode);
    }

    /// The mode in force.
    pub fn mode(&self) -> Mode {
        self.cyclic.operation.mode()
    }

    /// The mode that was asked for: Operate while Auto_Clear waits for the slaves.
    pub fn requested_mode(&self) -> Mode {
        self.cyclic.operation.requested()
    }

    /// Sends a Global_Control (Sync, Freeze…) with the end of a cycle in which a slave exchanges data; one goes out per
    /// cycle, in their order.
    ///
    /// In Clear the Clear_Data bit is added.
    ///
    /// # Errors
    ///
    /// [`ControlError`] in Stop, and when eight wait already.
    pub fn send_control(&mut self, control: GlobalControl) -> Result<(), ControlError> {
        self.cyclic.send_control(control)
    }

    /// Serves a slave or leaves it alone; `false` for an index of another master. One that is activated is started up.
    pub fn set_activation(&mut self, slave: SlaveIndex, activation: Activation) -> bool {
        self.cyclic.set_activation(slave, activation)
    }

    /// The status of a slave as its master sees it: the bits of the diagnosis read last, with those that only a master
    /// knows (Station_Non_Existent, Invalid_Slave_Response, Master_Lock, Deactivated).
    pub fn station_status(&self, slave: SlaveIndex) -> StationStatus {
        self.handler(slave)
            .map_or(StationStatus::default(), SlaveHandler::status)
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

    /// The outputs of a slave as they were set; empty for an index of another master.
    pub fn outputs(&self, slave: SlaveIndex) -> &[u8] {
        self.handler(slave).map_or(&[], |handler| handler.outputs.as_slice())
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

    /// Its own address (TS).
    pub fn address(&self) -> Address {
        self.cyclic.config.address
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
            tokens: fdl.tokens,
            token_retries: fdl.token_retries,
            gap_requests: fdl.gap_requests,
            last_rotation: fdl.last_rotation,
            longest_rotation: fdl.longest_rotation,
            mean_cycle: Duration::from_nanos(total.checked_div(cyclic.cycles).unwrap_or(0)),
            lost_events: self.cyclic.events.lost(),
            ..cyclic
        }
    }

    /// Whether the station holds the token.
    pub fn holds_token(&self) -> bool {
        self.fdl.holds_token()
    }

    /// The state of the data link layer.
    pub fn fdl_state(&self) -> FdlState {
        self.fdl.state()
    }

    /// The masters of the ring, this one among them once it [is a member](Self::is_in_ring).
    pub fn las(&self) -> Las {
        self.fdl.las()
    }

    /// Whether this master is a member of the ring.
    pub fn is_in_ring(&self) -> bool {
        self.fdl.is_in_ring()
    }

    /// Tells the master to leave the ring, or to come back. It passes the token on before it leaves; its slaves are
    /// then left to their watchdogs.
    pub fn set_membership(&mut self, membership: Membership) {
        self.fdl.set_membership(membership);
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

/// Why there is no such master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MasterError {
    /// A bus parameter breaks a rule.
    #[error("bus parameters: {0}")]
    Params(#[from] BusParamsError),
    /// Data_Control_Time is too short to be kept.
    #[error("Data_Control_Time: expected at least two cycles = {} µs, got {} µs", least.as_nanos() / 1_000, got.as_nanos() / 1_000)]
    DataControlTime {
        /// Two cycles.
        least: Duration,
        /// The value.
        got: Duration,
    },
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

/// Why a Global_Control was not taken over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ControlError {
    /// In Stop the master talks to no slave.
    #[error("Global_Control: the master is in Stop; set Clear or Operate first")]
    Stopped,
    /// Eight are waiting.
    #[error("Global_Control: eight commands wait to be sent; one goes out per cycle")]
    Full,
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
