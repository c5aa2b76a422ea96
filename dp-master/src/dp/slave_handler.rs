//! One slave as the master sees it: start-up, exchange, diagnosis, loss and return.
//!
//! ```text
//!  Offline ──diagnosis──► WaitPrm ──SC──► WaitCfg ──SC──► WaitReady ──clean diagnosis──► DataExchange
//!     ▲                                                      │  ▲ not ready yet              │   ▲ │ high priority reply:
//!     │                                                      │  └─┘                          │   └─┘ diagnosis in the next cycle
//!     │◄──────── no answer, refusal (from every state) ──────┴───────────────────────────────┘
//!     └── Refused: the same, with a cause; both are tried again after the retry interval
//! ```
//!
//! Source: IEC 61158-6-3 (master-slave handler); 9300 facts 1.5.

use super::cfg::{CfgError, Configuration};
use super::diag::{Diagnosis, StandardDiag, StationStatus};
use super::image::{MAX_DATA, Octets, ProcessImage};
use super::master::{MasterEvent, Mode, SlaveIndex};
use super::prm::{FREEZE_REQ, LOCK_REQ, MAX_USER_PRM, SET_PRM_LEN, SYNC_REQ, SetPrm, SetPrmError, WD_ON};
use super::sap;
use super::watchdog::Watchdog;
use crate::address::Address;
use crate::fdl::{Action, FcbCounter, Outcome, Repeat};
use crate::time::{Duration, Instant};
use crate::wire::{FunctionCode, Header, RequestFunction, ResponseFunction};

/// Whether a slave is asked to obey a group command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Demand {
    /// It is not asked.
    #[default]
    No,
    /// It is asked; one that cannot answers with Not_Supported.
    Yes,
}

/// What a master sends to a slave in Clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ClearOutputs {
    /// Zeros in full length.
    #[default]
    Zeros,
    /// No octets at all: only for slaves with Fail_Safe in their GSD.
    Empty,
}

/// Whether a slave that fails clears all the others (Auto_Clear).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AutoClearVote {
    /// It does.
    #[default]
    Counts,
    /// It does not (Ignore_ACLR).
    Ignored,
}

/// Whether a master serves a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Activation {
    /// It does.
    #[default]
    Active,
    /// It knows it, but leaves it alone: a device that is not built yet, or under repair.
    Inactive,
}

/// What a master knows about one slave.
///
/// # Example
///
/// ```
/// use dp_master::address::Address;
/// use dp_master::dp::{SlaveConfig, Watchdog};
/// use dp_master::time::Duration;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut slave = SlaveConfig::new(Address::new(3)?, 0x00DA, &[0xF3, 0xF3])?;
/// slave.watchdog = Some(Watchdog::at_least(Duration::from_millis(50))?);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SlaveConfig {
    /// Station address.
    pub address: Address,
    /// Ident number the slave must have.
    pub ident: u16,
    /// Identifier octets for Chk_Cfg, and so the lengths of the images.
    pub configuration: Configuration,
    /// User parameters, appended to the seven octets of Set_Prm.
    pub user_prm: Octets<MAX_USER_PRM>,
    /// Watchdog; `None` switches it off.
    pub watchdog: Option<Watchdog>,
    /// min Tsdr in tBIT for Set_Prm, 0 = keep, else at least 11. Default 11.
    pub min_tsdr: u8,
    /// Groups for Global_Control, one bit each.
    pub group: u8,
    /// Ask for Sync.
    pub sync: Demand,
    /// Ask for Freeze.
    pub freeze: Demand,
    /// Least time between two Data_Exchange requests (Min_Slave_Intervall × 100 µs). Default zero.
    pub min_slave_interval: Duration,
    /// What is sent in Clear.
    pub clear_outputs: ClearOutputs,
    /// Whether it counts for Auto_Clear.
    pub auto_clear: AutoClearVote,
    /// Whether it is served from the start.
    pub activation: Activation,
}

impl SlaveConfig {
    /// A slave without watchdog, user parameters or groups.
    ///
    /// # Errors
    ///
    /// [`CfgError`] when the identifiers are no configuration.
    pub fn new(address: Address, ident: u16, identifiers: &[u8]) -> Result<Self, CfgError> {
        Ok(Self {
            address,
            ident,
            configuration: Configuration::new(identifiers)?,
            user_prm: Octets::EMPTY,
            watchdog: None,
            min_tsdr: 11,
            group: 0,
            sync: Demand::No,
            freeze: Demand::No,
            min_slave_interval: Duration::ZERO,
            clear_outputs: ClearOutputs::Zeros,
            auto_clear: AutoClearVote::Counts,
            activation: Activation::Active,
        })
    }

    /// The same with user parameters.
    ///
    /// # Errors
    ///
    /// [`SetPrmError::TooLong`] above 237 octets.
    pub fn with_user_prm(mut self, user: &[u8]) -> Result<Self, SetPrmError> {
        self.user_prm = Octets::from_slice(user).ok_or(SetPrmError::TooLong {
            got: SET_PRM_LEN + user.len(),
        })?;
        Ok(self)
    }

    fn set_prm(&self) -> SetPrm<'_> {
        let mut station_status = LOCK_REQ;
        let (mut wd_fact_1, mut wd_fact_2) = (0, 0);
        if let Some(watchdog) = self.watchdog {
            station_status |= WD_ON;
            (wd_fact_1, wd_fact_2) = watchdog.factors();
        }
        if self.sync == Demand::Yes {
            station_status |= SYNC_REQ;
        }
        if self.freeze == Demand::Yes {
            station_status |= FREEZE_REQ;
        }
        SetPrm {
            station_status,
            wd_fact_1,
            wd_fact_2,
            min_tsdr: self.min_tsdr,
            ident: self.ident,
            group: self.group,
            user: &self.user_prm,
        }
    }
}

/// Where a slave stands, seen from the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SlaveState {
    /// No answer, or not asked yet.
    #[default]
    Offline,
    /// It answered; Set_Prm is next.
    WaitPrm,
    /// Parametrised; Chk_Cfg is next.
    WaitCfg,
    /// Configured; the diagnosis must show that it accepted everything and is ready.
    WaitReady,
    /// Cyclic exchange.
    DataExchange,
    /// It answered, but refused or belongs to another master; tried again after the retry interval.
    Refused,
}

/// Why the exchange with a slave ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LossCause {
    /// No usable answer, with all repetitions.
    NoAnswer,
    /// It refuses the exchange (RS after a restart or watchdog), with this response.
    Rejected(ResponseFunction),
    /// The diagnosis asks for new parameters or reports a fault in them.
    Diagnosis(StandardDiag),
    /// A reply of another length than configured.
    InputLength {
        /// Configured octets.
        expected: usize,
        /// Received octets.
        got: usize,
    },
    /// The master left data exchange (Stop), or lost the token.
    Stopped,
}

/// The handler of one slave.
#[derive(Debug, Clone)]
pub(super) struct SlaveHandler {
    config: SlaveConfig,
    prm: Octets<{ SET_PRM_LEN + MAX_USER_PRM }>,
    activation: Activation,
    fcb: FcbCounter,
    state: SlaveState,
    /// In data exchange: the slave announced diagnosis.
    diag_due: bool,
    /// Not before this moment: the next attempt, or the next exchange.
    due: Instant,
    pub(super) inputs: ProcessImage,
    pub(super) outputs: ProcessImage,
    diagnosis: Option<Diagnosis>,
    /// What was reported last, so that it is reported once.
    refused: Option<Refusal>,
    /// Data were exchanged since the start-up.
    served: bool,
    /// No data were exchanged since, whatever start-ups came in between; `None` before anybody asked.
    silent_since: Option<Instant>,
    /// Set_Prm or Chk_Cfg was refused on the data link layer; the diagnosis read next says why.
    rejected: Option<ResponseFunction>,
    exchanges: u64,
}

/// What follows from the end of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Report {
    pub(super) event: Option<MasterEvent>,
    /// The request was a Data_Exchange that was answered with data or an acknowledgement.
    pub(super) exchanged: bool,
    /// The slave had no room for its outputs (RR, RDL, RDH).
    pub(super) outputs_refused: bool,
    /// The slave is in data exchange now, and was not before.
    pub(super) entered: bool,
    /// The slave refused (RS, UE, RR…).
    pub(super) rejected: bool,
}

impl SlaveHandler {
    pub(super) fn new(config: SlaveConfig) -> Self {
        let lengths = config.configuration.lengths();
        let mut prm = Octets::zeroed(SET_PRM_LEN + config.user_prm.len());
        // The lengths were checked when the configuration was made.
        let written = config.set_prm().encode(prm.as_mut_slice());
        debug_assert!(written.is_ok());
        Self {
            prm,
            activation: config.activation,
            fcb: FcbCounter::START,
            state: SlaveState::Offline,
            diag_due: false,
            due: Instant::ZERO,
            inputs: ProcessImage::zeroed(lengths.inputs),
            outputs: ProcessImage::zeroed(lengths.outputs),
            diagnosis: None,
            refused: None,
            served: false,
            silent_since: None,
            rejected: None,
            exchanges: 0,
            config,
        }
    }

    pub(super) fn state(&self) -> SlaveState {
        self.state
    }

    pub(super) fn address(&self) -> Address {
        self.config.address
    }

    pub(super) fn diagnosis(&self) -> Option<&Diagnosis> {
        self.diagnosis.as_ref()
    }

    pub(super) fn exchanges(&self) -> u64 {
        self.exchanges
    }

    /// The frame count bit towards the slave.
    pub(super) fn fcb_mut(&mut self) -> &mut FcbCounter {
        &mut self.fcb
    }

    /// Whether there is something to do in this cycle.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        let paused = matches!(self.state, SlaveState::Offline | SlaveState::Refused) && now < self.due;
        self.activation == Activation::Active && !paused
    }

    /// What to do in this cycle when it [is due](Self::is_due).
    #[inline]
    pub(super) fn next_action(&self, now: Instant, master: Address, mode: Mode) -> Action<'_> {
        let request = |sap: Option<u8>, data| {
            let fc = FunctionCode::request(self.fcb.current(), RequestFunction::SrdHigh);
            let mut header = Header::new(self.config.address, master, fc);
            if let Some(sap) = sap {
                header = header.with_saps(sap, sap::MASTER);
            }
            let repeat = match self.state {
                // Whether it is there at all is the question; there is nothing to be lost.
                SlaveState::Offline | SlaveState::Refused => Repeat::Never,
                _ => Repeat::UpToLimit,
            };
            Action::Send { header, data, repeat }
        };
        match self.state {
            SlaveState::Offline | SlaveState::Refused | SlaveState::WaitReady => request(Some(sap::SLAVE_DIAG), &[]),
            SlaveState::WaitPrm => request(Some(sap::SET_PRM), &self.prm),
            SlaveState::WaitCfg => request(Some(sap::CHK_CFG), self.config.configuration.identifiers()),
            SlaveState::DataExchange if self.diag_due => request(Some(sap::SLAVE_DIAG), &[]),
            SlaveState::DataExchange if now < self.due => Action::WaitUntil(self.due),
            SlaveState::DataExchange => request(None, self.outputs_on_the_bus(mode)),
        }
    }

    /// The request of [`next_action`](Self::next_action) has ended.
    #[inline]
    pub(super) fn confirm(
        &mut self,
        now: Instant,
        started: Instant,
        outcome: &Outcome<'_>,
        context: &Context,
    ) -> Report {
        let mut report = Report {
            event: None,
            exchanged: false,
            outputs_refused: false,
            entered: false,
            rejected: false,
        };
        if self.refused.is_none()
            && let Some(inputs) = self.undisturbed(outcome)
        {
            self.fcb.confirm();
            self.due = started + self.config.min_slave_interval;
            self.inputs.as_mut_slice().copy_from_slice(inputs);
            report.event = self.serve(now, context);
            report.exchanged = true;
            return report;
        }
        match outcome {
            Outcome::NoAnswer => {
                report.event = self.lose(now, LossCause::NoAnswer, context);
                return report;
            }
            // Whether the slave has seen the request is not known, and the next one may be another (an acyclic one):
            // only first contact is new to it in any case.
            Outcome::Aborted => {
                self.fcb.reset();
                return report;
            }
            Outcome::Sent => return report,
            Outcome::Acknowledged | Outcome::Response { .. } => self.fcb.confirm(),
        }
        if let Outcome::Response { header, .. } = outcome
            && let FunctionCode::Response { function, .. } = header.fc
        {
            report.rejected = !matches!(
                function,
                ResponseFunction::Ok
                    | ResponseFunction::DataLow
                    | ResponseFunction::DataHigh
                    | ResponseFunction::NoReplyData
            );
            report.outputs_refused = self.state == SlaveState::DataExchange
                && !self.diag_due
                && matches!(
                    function,
                    ResponseFunction::NoResource
                        | ResponseFunction::DataLowNoResource
                        | ResponseFunction::DataHighNoResource
                );
        }
        let before = self.state;
        match self.state {
            SlaveState::Offline | SlaveState::Refused => report.event = self.found(now, Answer::of(outcome), context),
            SlaveState::WaitPrm | SlaveState::WaitCfg => match Answer::of(outcome) {
                Answer::Acknowledged => {
                    self.state = if self.state == SlaveState::WaitPrm {
                        SlaveState::WaitCfg
                    } else {
                        SlaveState::WaitReady
                    };
                }
                Answer::Data { .. } => {
                    self.rejected = Some(ResponseFunction::DataLow);
                    self.state = SlaveState::WaitReady;
                }
                Answer::Negative(function) => {
                    self.rejected = Some(function);
                    self.state = SlaveState::WaitReady;
                }
            },
            SlaveState::WaitReady => report.event = self.check(now, Answer::of(outcome), context),
            SlaveState::DataExchange if self.diag_due => {
                report.event = self.diagnosed(now, Answer::of(outcome), context);
            }
            SlaveState::DataExchange => {
                self.due = started + self.config.min_slave_interval;
                let before = self.exchanges;
                // Nothing is moved when there is nothing to tell: nearly always.
                if let Some(event) = self.exchanged(now, Answer::of(outcome), context) {
                    report.event = Some(event);
                }
                report.exchanged = self.exchanges != before;
            }
        }
        report.entered = self.state == SlaveState::DataExchange && before != SlaveState::DataExchange;
        report
    }

    /// The inputs of an answer in data exchange that tells nothing else: nearly every answer. What this finds is done
    /// without looking at everything that could have happened.
    #[inline]
    fn undisturbed<'a>(&self, outcome: &Outcome<'a>) -> Option<&'a [u8]> {
        let &Outcome::Response { header, data } = outcome else {
            return None;
        };
        let FunctionCode::Response { function, .. } = header.fc else {
            return None;
        };
        let exchanges = self.state == SlaveState::DataExchange && !self.diag_due;
        (exchanges && function == ResponseFunction::DataLow && data.len() == self.inputs.len()).then_some(data)
    }

    /// A job has read the diagnosis. To the slave that was its master, so it will not announce again what the job has
    /// seen: anything new counts as read here.
    pub(super) fn diagnosis_seen(&mut self, now: Instant, data: &[u8], context: &Context) -> Option<MasterEvent> {
        let seen = Diagnosis::parse(data).ok()?;
        if self.state != SlaveState::DataExchange || self.diagnosis == Some(seen) {
            return None;
        }
        self.diagnosed(now, Answer::Data { data, high: false }, context)
    }

    /// The master leaves data exchange.
    pub(super) fn stop(&mut self, context: &Context) -> Option<MasterEvent> {
        let event = self.lose(Instant::ZERO, LossCause::Stopped, context);
        self.due = Instant::ZERO;
        self.refused = None;
        self.silent_since = None;
        event
    }

    /// Serves the slave or leaves it alone.
    pub(super) fn set_activation(&mut self, activation: Activation, context: &Context) -> Option<MasterEvent> {
        self.activation = activation;
        match activation {
            Activation::Active => None,
            Activation::Inactive => self.stop(context),
        }
    }

    /// Whether Auto_Clear has to ask for the slave.
    pub(super) fn counts_for_auto_clear(&self) -> bool {
        self.activation == Activation::Active && self.config.auto_clear == AutoClearVote::Counts
    }

    /// How long no data were exchanged; for a slave just activated from now on.
    pub(super) fn silent_for(&mut self, now: Instant) -> Duration {
        now - *self.silent_since.get_or_insert(now)
    }

    /// Whether data are exchanged just now.
    pub(super) fn is_served(&self) -> bool {
        self.state == SlaveState::DataExchange && self.served
    }

    /// The status of the station as its master sees it: what it said last, with the bits that only a master knows.
    ///
    /// Source: IEC 61158-6-3, Slave_Diag: octet 1 bits 0, 5, 7 and octet 2 bit 7 are set by the master.
    pub(super) fn status(&self) -> StationStatus {
        let said = self
            .diagnosis
            .map_or(StationStatus::default(), |diagnosis| diagnosis.standard.status);
        let by_master = StationStatus::STATION_NON_EXISTENT
            .with(StationStatus::INVALID_SLAVE_RESPONSE)
            .with(StationStatus::MASTER_LOCK)
            .with(StationStatus::DEACTIVATED);
        let (unreadable, locked) = match self.refused {
            Some(Refusal::NoDiagnosis { .. } | Refusal::Exchange(LossCause::InputLength { .. })) => (true, false),
            Some(Refusal::OwnedBy(_)) => (false, true),
            _ => (false, false),
        };
        let inactive = self.activation == Activation::Inactive;
        said.without(by_master)
            .with_if(
                StationStatus::STATION_NON_EXISTENT,
                self.state == SlaveState::Offline && !inactive,
            )
            .with_if(StationStatus::INVALID_SLAVE_RESPONSE, unreadable)
            .with_if(StationStatus::MASTER_LOCK, locked)
            .with_if(StationStatus::DEACTIVATED, inactive)
    }

    fn outputs_on_the_bus(&self, mode: Mode) -> &[u8] {
        match (mode, self.config.clear_outputs) {
            (Mode::Operate, _) => &self.outputs,
            (_, ClearOutputs::Zeros) => ZEROS.get(..self.outputs.len()).unwrap_or(&[]),
            (_, ClearOutputs::Empty) => &[],
        }
    }

    /// The first diagnosis of a slave that was offline.
    fn found(&mut self, now: Instant, answer: Answer<'_>, context: &Context) -> Option<MasterEvent> {
        let diagnosis = match self.read_diagnosis(answer) {
            Ok(diagnosis) => diagnosis,
            Err(refusal) => return self.refuse(now, refusal, context),
        };
        let owner = diagnosis.master;
        if owner != StandardDiag::NO_MASTER && owner != context.master.value() {
            return self.refuse(now, Refusal::OwnedBy(diagnosis), context);
        }
        self.state = SlaveState::WaitPrm;
        None
    }

    /// The diagnosis after Chk_Cfg.
    fn check(&mut self, now: Instant, answer: Answer<'_>, context: &Context) -> Option<MasterEvent> {
        let diagnosis = match self.read_diagnosis(answer) {
            Ok(diagnosis) => diagnosis,
            Err(refusal) => return self.refuse(now, refusal, context),
        };
        let status = diagnosis.status;
        let owner = diagnosis.master;
        if owner != context.master.value() && owner != StandardDiag::NO_MASTER {
            self.refuse(now, Refusal::OwnedBy(diagnosis), context)
        } else if status.intersects(StationStatus::PRM_FAULT.with(StationStatus::NOT_SUPPORTED)) {
            self.refuse(now, Refusal::Parameters(diagnosis), context)
        } else if status.intersects(StationStatus::CFG_FAULT) {
            self.refuse(now, Refusal::Configuration(diagnosis), context)
        } else if let Some(function) = self.rejected {
            self.refuse(now, Refusal::Response(function), context)
        } else if status.intersects(StationStatus::PRM_REQ) {
            self.refuse(now, Refusal::Parameters(diagnosis), context)
        } else if status.intersects(StationStatus::STATION_NOT_READY.with(StationStatus::STAT_DIAG)) {
            // Asked again in the next cycle, which is bound by the cycle itself.
            None
        } else {
            self.state = SlaveState::DataExchange;
            self.served = false;
            self.due = now;
            if matches!(self.refused, Some(Refusal::Exchange(_))) {
                // It has accepted everything before and then not exchanged: told once it does.
                return None;
            }
            self.refused = None;
            Some(MasterEvent::DataExchange { slave: context.slave })
        }
    }

    /// A diagnosis in data exchange.
    fn diagnosed(&mut self, now: Instant, answer: Answer<'_>, context: &Context) -> Option<MasterEvent> {
        let before = self.diagnosis;
        let diagnosis = match self.read_diagnosis(answer) {
            Ok(diagnosis) => diagnosis,
            Err(Refusal::Response(function)) => {
                return self.lose(now, LossCause::Rejected(function), context);
            }
            Err(_) => {
                return self.lose(now, LossCause::Rejected(ResponseFunction::NoReplyData), context);
            }
        };
        let faults = StationStatus::PRM_FAULT
            .with(StationStatus::CFG_FAULT)
            .with(StationStatus::PRM_REQ)
            .with(StationStatus::STATION_NOT_READY);
        if diagnosis.status.intersects(faults) || diagnosis.master != context.master.value() {
            return self.lose(now, LossCause::Diagnosis(diagnosis), context);
        }
        // With Stat_Diag the slave has no valid data and wants to be asked again.
        self.diag_due = diagnosis.status.intersects(StationStatus::STAT_DIAG);
        if self.diag_due && self.diagnosis == before {
            return None;
        }
        Some(MasterEvent::Diagnosis {
            slave: context.slave,
            diagnosis,
        })
    }

    /// The end of a Data_Exchange.
    ///
    /// | answer | inputs | outputs | then |
    /// |---|---|---|---|
    /// | DL, DH | taken | taken | DH: Slave_Diag next |
    /// | SC, NR (OK) without inputs | – | taken | |
    /// | RDL, RDH | taken | refused | sent again in the next cycle; RDH: Slave_Diag next |
    /// | RR | – | refused | sent again in the next cycle |
    /// | RS, UE, codes without a name, another length | – | – | start-up |
    ///
    /// Source: IEC 61158-6-3, slave handler in the state DATA.
    #[inline]
    fn exchanged(&mut self, now: Instant, answer: Answer<'_>, context: &Context) -> Option<MasterEvent> {
        let expected = self.inputs.len();
        let cause = match answer {
            Answer::Acknowledged if expected == 0 => return self.serve(now, context),
            Answer::Acknowledged => LossCause::InputLength { expected, got: 0 },
            Answer::Data { data, high } if data.len() == expected => {
                self.inputs.as_mut_slice().copy_from_slice(data);
                self.diag_due = high;
                return self.serve(now, context);
            }
            Answer::Data { data, .. } => LossCause::InputLength {
                expected,
                got: data.len(),
            },
            Answer::Negative(ResponseFunction::NoResource) => return None,
            Answer::Negative(function) => LossCause::Rejected(function),
        };
        self.lose(now, cause, context)
    }

    /// Data were exchanged.
    fn serve(&mut self, now: Instant, context: &Context) -> Option<MasterEvent> {
        self.exchanges += 1;
        self.served = true;
        self.silent_since = Some(now);
        let was_refusing = matches!(self.refused, Some(Refusal::Exchange(_)));
        if was_refusing {
            self.refused = None;
        }
        was_refusing.then_some(MasterEvent::DataExchange { slave: context.slave })
    }

    fn read_diagnosis(&mut self, answer: Answer<'_>) -> Result<StandardDiag, Refusal> {
        match answer {
            Answer::Data { data, .. } => match Diagnosis::parse(data) {
                Ok(diagnosis) => {
                    self.diagnosis = Some(diagnosis);
                    Ok(diagnosis.standard)
                }
                Err(_) => Err(Refusal::NoDiagnosis { got: data.len() }),
            },
            Answer::Acknowledged => Err(Refusal::NoDiagnosis { got: 0 }),
            Answer::Negative(function) => Err(Refusal::Response(function)),
        }
    }

    /// Back to the beginning after the retry interval, with a cause. The same cause is reported once.
    fn refuse(&mut self, now: Instant, refusal: Refusal, context: &Context) -> Option<MasterEvent> {
        self.fcb.reset();
        self.state = SlaveState::Refused;
        self.diag_due = false;
        self.rejected = None;
        self.due = now + context.retry_interval;
        let known = self.refused == Some(refusal);
        self.refused = Some(refusal);
        if known {
            return None;
        }
        let slave = context.slave;
        Some(match refusal {
            Refusal::Parameters(diagnosis) => MasterEvent::ParametersRefused { slave, diagnosis },
            Refusal::Configuration(diagnosis) => MasterEvent::ConfigurationRefused { slave, diagnosis },
            Refusal::OwnedBy(diagnosis) => MasterEvent::OwnedByOther { slave, diagnosis },
            Refusal::Response(function) => MasterEvent::StartUpRejected { slave, function },
            Refusal::NoDiagnosis { got } => MasterEvent::DiagnosisUnreadable { slave, got },
            Refusal::Exchange(cause) => MasterEvent::SlaveLost { slave, cause },
        })
    }

    /// Back to the beginning; reported only when there was an exchange to lose.
    fn lose(&mut self, now: Instant, cause: LossCause, context: &Context) -> Option<MasterEvent> {
        let exchanged = self.state == SlaveState::DataExchange;
        if exchanged && !self.served && !matches!(cause, LossCause::Stopped | LossCause::NoAnswer) {
            // Starting it up again at once would never end.
            return self.refuse(now, Refusal::Exchange(cause), context);
        }
        // An exchange that was never told to have begun does not end either.
        let told = exchanged && (self.served || !matches!(self.refused, Some(Refusal::Exchange(_))));
        self.fcb.reset();
        self.state = SlaveState::Offline;
        self.diag_due = false;
        self.rejected = None;
        self.due = match cause {
            // It talks: start it up again in the next cycle.
            LossCause::Rejected(_) | LossCause::Diagnosis(_) if exchanged => now,
            _ => now + context.retry_interval,
        };
        told.then_some(MasterEvent::SlaveLost {
            slave: context.slave,
            cause,
        })
    }
}

/// What a handler needs to know of its master.
#[derive(Debug, Clone, Copy)]
pub(super) struct Context {
    pub(super) master: Address,
    pub(super) slave: SlaveIndex,
    pub(super) retry_interval: Duration,
}

/// An outcome reduced to what DP distinguishes.
#[derive(Debug, Clone, Copy)]
enum Answer<'a> {
    Acknowledged,
    Data { data: &'a [u8], high: bool },
    Negative(ResponseFunction),
}

impl<'a> Answer<'a> {
    #[inline]
    fn of(outcome: &Outcome<'a>) -> Self {
        let &Outcome::Response { header, data } = outcome else {
            return Self::Acknowledged;
        };
        let FunctionCode::Response { function, .. } = header.fc else {
            return Self::Acknowledged;
        };
        match function {
            ResponseFunction::DataLow | ResponseFunction::DataLowNoResource => Self::Data { data, high: false },
            ResponseFunction::DataHigh | ResponseFunction::DataHighNoResource => Self::Data { data, high: true },
            ResponseFunction::Ok | ResponseFunction::NoReplyData => Self::Acknowledged,
            other => Self::Negative(other),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Refusal {
    Parameters(StandardDiag),
    Configuration(StandardDiag),
    OwnedBy(StandardDiag),
    Response(ResponseFunction),
    NoDiagnosis {
        got: usize,
    },
    /// It accepted everything, and then no data were exchanged.
    Exchange(LossCause),
}

static ZEROS: [u8; MAX_DATA] = [0; MAX_DATA];
