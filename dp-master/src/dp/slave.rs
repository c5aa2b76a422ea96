//! The DP-V0 slave.
//!
//! ```text
//!             Set_Prm ok, lock          Chk_Cfg ok
//!  WaitPrm ───────────────────► WaitCfg ───────────► DataExchange
//!     ▲                            │                     │
//!     └── Set_Prm or Chk_Cfg refused, unlock ────────────┤
//!     └── watchdog, outputs of another length ───────────┘
//! ```
//!
//! Power-on needs no state of its own: a new value waits for Set_Prm.
//!
//! | service | any master | the parametrising master |
//! |---|---|---|
//! | Slave_Diag, Get_Cfg, Chk_Cfg before parameters (RS) | yes | yes |
//! | Set_Prm | while no other master owns the slave, else RS | yes |
//! | Chk_Cfg, Data_Exchange, Global_Control | RS, or ignored | yes |
//! | Rd_Inp, Rd_Outp | in data exchange | in data exchange |
//! | Set_Slave_Add | while waiting for Set_Prm, if the device can, else RS | RS |
//! | DP-V1: see [`v1`](super::v1) | MSAC2 | MSAC1, alarms, MSAC2 |
//!
//! Source: IEC 61158-6-3 (slave state machine); 9300 facts 1.2–1.6.

use super::cfg::IoLengths;
use super::control::{ControlCommand, GlobalControl};
use super::diag::{EXT_DIAG_OVERFLOW, MAX_EXT_DIAG, Overflow, SLAVE_DIAG_LEN, StandardDiag, StationStatus};
use super::diag_block::{Block, BlockFault, Blocks};
use super::events::EventQueue;
use super::image::{MAX_DATA, Octets, ProcessImage};
use super::prm::{LockRequest, MAX_USER_PRM, SetPrm};
use super::sap;
use super::set_slave_add::{AddressLock, MAX_REMAINING, SetSlaveAdd, SetSlaveAddError};
use super::slave_identity::{AddressChange, IdentityError, OutputsOnLeave, SlaveIdentity, Support};
use super::v1::{Abort, AlarmAck, Answer, Asking, V1Slave};
use super::watchdog::Watchdog;
use crate::address::Address;
use crate::fdl::{Responder, ResponderStatistics, ResponderUser, Response, Timer, Timers};
use crate::station::{LineError, MAX_TELEGRAM, Station};
use crate::time::{BitTimes, Instant};
use crate::wire::{FunctionCode, Header, RequestFunction, ResponseFunction};

/// The state of a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlavePhase {
    /// Waits for Set_Prm.
    WaitPrm,
    /// Parametrised, waits for Chk_Cfg.
    WaitCfg,
    /// Outputs and inputs are exchanged.
    DataExchange,
}

/// Why data exchange ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeaveReason {
    /// The master was silent for longer than the watchdog time.
    Watchdog,
    /// The master released the slave.
    Unlocked,
    /// The master sent parameters anew; the slave waits for Chk_Cfg.
    Reparametrised,
    /// Set_Prm was refused.
    ParametersRefused,
    /// Chk_Cfg was refused.
    ConfigurationRefused,
    /// Outputs of another length than configured.
    OutputLength {
        /// Configured octets.
        expected: usize,
        /// Received octets.
        got: usize,
    },
}

/// Why a slave ignored a Set_Slave_Add.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AddressKept {
    /// It was meant for another ident number.
    Ident {
        /// The ident number in the request.
        got: u16,
    },
    /// The address was locked by an earlier request.
    Locked,
    /// The request cannot be read: too short, too long, or an address above 125.
    Malformed(SetSlaveAddError),
}

/// What happened to a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SlaveEvent {
    /// Set_Prm was accepted; user parameters are at [`DpSlave::user_prm`].
    Parametrised {
        /// The master that owns the slave now.
        master: Address,
        /// The watchdog it set.
        watchdog: Option<Watchdog>,
    },
    /// Set_Prm was refused: another ident number, a wrong length, or something unsupported.
    ParametersRefused {
        /// The ident number the master expected.
        ident: u16,
    },
    /// Chk_Cfg was accepted.
    Configured {
        /// The lengths in force.
        lengths: IoLengths,
    },
    /// Chk_Cfg was refused.
    ConfigurationRefused,
    /// Outputs may come from now on, and the watchdog runs.
    EnteredDataExchange,
    /// New outputs are at [`DpSlave::outputs`]. Told once for any number of exchanges between two looks.
    Outputs,
    /// The master cleared the outputs.
    OutputsCleared,
    /// The watchdog has expired.
    WatchdogExpired,
    /// Set_Slave_Add was obeyed: the slave answers to this address from now on. The device stores it, together with the
    /// lock and [`DpSlave::remaining_slave_data`], and starts with them after the next power-on.
    AddressChanged {
        /// The new address.
        address: Address,
        /// Whether it may be changed again.
        lock: AddressLock,
    },
    /// Set_Slave_Add was acknowledged and ignored.
    AddressKept {
        /// Why.
        cause: AddressKept,
    },
    /// Data exchange ended.
    LeftDataExchange {
        /// Why.
        reason: LeaveReason,
    },
    /// The master acknowledged an alarm (DP-V1).
    AlarmAcknowledged {
        /// What [`DpSlave::send_alarm`] returned.
        alarm: AlarmAck,
    },
    /// A master of class 2 opened a connection (DP-V1).
    ConnectionOpened {
        /// Its access point, which identifies it.
        sap: u8,
        /// The master.
        master: Address,
    },
    /// A connection has ended (DP-V1).
    ConnectionClosed {
        /// Its access point.
        sap: u8,
        /// Who ended it and why.
        abort: Abort,
    },
}

/// What a slave counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SlaveStatistics {
    /// The data link layer.
    pub fdl: ResponderStatistics,
    /// Data_Exchange requests carried out, repetitions not counted.
    pub exchanges: u64,
    /// Events lost because nobody fetched them.
    pub lost_events: u64,
}

/// Whether extended diagnosis is a fault or only information.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExtDiag {
    /// A fault: Ext_Diag (bit 3 of station status 1) is set.
    Fault,
    /// No fault: the octets are there, Ext_Diag is not set.
    Message,
}

/// Whether the inputs of a slave mean anything just now (Stat_Diag).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InputValidity {
    /// They do.
    #[default]
    Valid,
    /// They do not: Stat_Diag is set, and the master reads diagnosis instead of exchanging data until it is gone.
    Invalid,
}

/// A DP-V0 slave; see [`Station`] for the order of calls.
#[doc(alias = "DP-Slave")]
#[derive(Debug, Clone)]
pub struct DpSlave {
    responder: Responder,
    pub(super) device: Device,
}

impl DpSlave {
    /// A slave that waits for Set_Prm.
    ///
    /// # Errors
    ///
    /// [`IdentityError`] when the address is no station's or the reply time is out of range.
    pub fn new(identity: SlaveIdentity) -> Result<Self, IdentityError> {
        identity.validate()?;
        Ok(Self {
            responder: Responder::new(identity.address, identity.baud, identity.latency_allowance),
            device: Device {
                t_sdr: BitTimes(u32::from(identity.min_tsdr)),
                v1: V1Slave::new(identity.v1, identity.baud),
                identity,
                phase: SlavePhase::WaitPrm,
                master: None,
                group: 0,
                watchdog: None,
                timers: Timers::default(),
                faults: StationStatus::default(),
                sync: Hold::Follows,
                freeze: Hold::Follows,
                lengths: IoLengths::default(),
                configuration: Octets::EMPTY,
                user_prm: Octets::EMPTY,
                outputs: ProcessImage::EMPTY,
                staged_outputs: ProcessImage::EMPTY,
                process_inputs: ProcessImage::EMPTY,
                inputs: ProcessImage::EMPTY,
                new_address: None,
                remaining: Octets::EMPTY,
                ext_diag: Octets::EMPTY,
                ext_diag_kind: ExtDiag::Message,
                overflow: Overflow::Complete,
                input_validity: InputValidity::Valid,
                diag_pending: false,
                scratch: [0; MAX_DATA],
                new_outputs: false,
                exchanges: 0,
                events: EventQueue::new(),
            },
        })
    }

    /// Station address.
    pub fn address(&self) -> Address {
        self.responder.address()
    }

    /// The state.
    pub fn phase(&self) -> SlavePhase {
        self.device.phase
    }

    /// The master that owns the slave.
    pub fn master(&self) -> Option<Address> {
        self.device.master
    }

    /// The watchdog in force.
    pub fn watchdog(&self) -> Option<Watchdog> {
        self.device.watchdog
    }

    /// Lengths of the images; zero before Chk_Cfg.
    pub fn lengths(&self) -> IoLengths {
        self.device.lengths
    }

    /// User parameters of the last accepted Set_Prm.
    pub fn user_prm(&self) -> &[u8] {
        &self.device.user_prm
    }

    /// Identifier octets of the last accepted Chk_Cfg.
    pub fn configuration(&self) -> &[u8] {
        &self.device.configuration
    }

    /// Remaining data of the last Set_Slave_Add that was obeyed, 0…240 octets.
    pub fn remaining_slave_data(&self) -> &[u8] {
        &self.device.remaining
    }

    /// The outputs as of one telegram, never a mixture; empty before Chk_Cfg.
    pub fn outputs(&self) -> &[u8] {
        &self.device.outputs
    }

    /// Sets the inputs which the next request gets, all at once. Octets beyond the configured length are ignored,
    /// missing ones are zero. They may be set before there is a configuration.
    pub fn set_inputs(&mut self, octets: &[u8]) {
        let device = &mut self.device;
        let fitting = octets.get(..MAX_DATA).unwrap_or(octets);
        device.process_inputs.replace(fitting);
        if device.freeze == Hold::Follows {
            device.release_inputs();
        }
    }

    /// Sets the extended diagnosis and announces it to the master by answering with high priority, unless nothing
    /// changed.
    ///
    /// `octets` are blocks, each with its header (9300 facts 1.4: `03`, fault code high, low), as
    /// [`ExtDiagWriter`](super::ExtDiagWriter) writes them.
    ///
    /// # Errors
    ///
    /// [`ExtDiagError`] above 238 octets or with a malformed block; nothing is changed then.
    pub fn set_ext_diag(&mut self, kind: ExtDiag, octets: &[u8], overflow: Overflow) -> Result<(), ExtDiagError> {
        let device = &mut self.device;
        if device.ext_diag.as_slice() == octets && device.ext_diag_kind == kind && device.overflow == overflow {
            return Ok(());
        }
        for block in Blocks::new(octets) {
            if let Block::Malformed { fault, .. } = block {
                return Err(fault.into());
            }
        }
        if !device.ext_diag.replace(octets) {
            return Err(ExtDiagError::TooLong { got: octets.len() });
        }
        device.ext_diag_kind = kind;
        device.overflow = overflow;
        device.diag_pending = true;
        Ok(())
    }

    /// Says whether the inputs mean anything; a change is announced to the master.
    pub fn set_input_validity(&mut self, validity: InputValidity) {
        let device = &mut self.device;
        if device.input_validity != validity {
            device.input_validity = validity;
            device.diag_pending = true;
        }
    }

    /// The standard octets a Slave_Diag would carry now.
    pub fn diagnosis(&self) -> StandardDiag {
        self.device.diagnosis()
    }

    /// The next event, oldest first. The queue holds 16; later ones are lost and counted.
    /// [`SlaveEvent::Outputs`] is not queued: it comes after the others and means the outputs of now.
    pub fn poll_event(&mut self) -> Option<SlaveEvent> {
        let device = &mut self.device;
        if let Some(event) = device.events.pop() {
            return Some(event);
        }
        core::mem::take(&mut device.new_outputs).then_some(SlaveEvent::Outputs)
    }

    /// Counters since the start.
    pub fn statistics(&self) -> SlaveStatistics {
        SlaveStatistics {
            fdl: self.responder.statistics(),
            exchanges: self.device.exchanges,
            lost_events: self.device.events.lost(),
        }
    }

    fn take_new_address(&mut self) {
        if let Some(address) = self.device.new_address.take() {
            self.responder.set_address(address);
        }
    }
}

impl Station for DpSlave {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.responder.handle_octets(now, octets, &mut self.device);
        self.take_new_address();
    }

    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.responder.handle_line_error(now, error, &mut self.device);
        self.take_new_address();
    }

    fn handle_sent(&mut self, _now: Instant) {}

    fn handle_timeout(&mut self, now: Instant) {
        // The reply first: a request that came in time is answered even if the watchdog ends at this moment.
        self.responder.handle_timeout(now);
        if self.device.timers.expire(now) == Some(Timer::Watchdog) {
            self.device.watchdog_expired();
        }
        self.device.v1.handle_timeout(now, &mut self.device.events);
    }

    fn poll_transmit(&mut self, _now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        let reply = self.responder.take_reply()?;
        buf.get_mut(..reply.len())?.copy_from_slice(reply);
        Some(reply.len())
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let device = &self.device;
        let deadlines = [
            self.responder.poll_timeout(),
            device.timers.next(),
            device.v1.deadline(),
        ];
        deadlines.into_iter().flatten().min()
    }
}

/// Sync and Freeze: an image follows or is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hold {
    Follows,
    Held,
}

/// The slave above the data link layer.
#[derive(Debug, Clone)]
pub(super) struct Device {
    identity: SlaveIdentity,
    phase: SlavePhase,
    master: Option<Address>,
    group: u8,
    watchdog: Option<Watchdog>,
    timers: Timers,
    /// Prm_Fault, Cfg_Fault and Not_Supported of the last start-up.
    faults: StationStatus,
    sync: Hold,
    freeze: Hold,
    lengths: IoLengths,
    configuration: Octets<MAX_DATA>,
    user_prm: Octets<MAX_USER_PRM>,
    outputs: ProcessImage,
    /// Outputs received last; equal to `outputs` unless Sync holds those.
    staged_outputs: ProcessImage,
    /// Inputs as the device gave them last, of any length.
    process_inputs: ProcessImage,
    /// Inputs as the bus sees them, in the configured length; those of the device unless Freeze holds them.
    inputs: ProcessImage,
    /// Set_Slave_Add was obeyed; the data link layer does not know it yet.
    new_address: Option<Address>,
    /// Rem_Slave_Data of the last Set_Slave_Add that was obeyed.
    remaining: Octets<MAX_REMAINING>,
    ext_diag: Octets<MAX_EXT_DIAG>,
    ext_diag_kind: ExtDiag,
    overflow: Overflow,
    input_validity: InputValidity,
    /// The master has not read the diagnosis since it changed.
    diag_pending: bool,
    t_sdr: BitTimes,
    scratch: [u8; MAX_DATA],
    new_outputs: bool,
    exchanges: u64,
    events: EventQueue<SlaveEvent, EVENTS>,
    pub(super) v1: V1Slave,
}

const EVENTS: usize = 16;
const REFUSED: Response<'static> = Response::Refuse(ResponseFunction::NoService);

impl ResponderUser for Device {
    fn handle_request(&mut self, now: Instant, header: &Header, data: &[u8]) -> Response<'_> {
        if !is_srd(header) {
            return REFUSED;
        }
        self.retrigger(now, header.sa);
        match header.dsap {
            None => self.data_exchange(header.sa, data),
            Some(sap::SLAVE_DIAG) => self.slave_diag(header.sa),
            Some(sap::SET_PRM) => self.set_prm(header.sa, data),
            Some(sap::CHK_CFG) => self.chk_cfg(now, header.sa, data),
            Some(sap::GET_CFG) => Response::Low(self.known_configuration()),
            Some(sap::RD_INP) if self.phase == SlavePhase::DataExchange => Response::Low(&self.inputs),
            Some(sap::RD_OUTP) if self.phase == SlavePhase::DataExchange => Response::Low(&self.outputs),
            Some(sap::SET_SLAVE_ADD) => self.set_slave_add(data),
            Some(dsap @ 0..=sap::MSAC1) => self.v1(now, header, dsap, data),
            Some(_) => REFUSED,
        }
    }

    fn handle_repetition(&mut self, now: Instant, header: &Header) {
        self.retrigger(now, header.sa);
    }

    fn handle_unacknowledged(&mut self, now: Instant, header: &Header, data: &[u8]) {
        if header.dsap != Some(sap::GLOBAL_CONTROL)
            || self.phase != SlavePhase::DataExchange
            || self.master != Some(header.sa)
        {
            return;
        }
        self.retrigger(now, header.sa);
        if let Some(control) = GlobalControl::parse(data)
            && control.addresses(self.group)
        {
            self.global_control(control.command);
        }
    }

    fn t_sdr(&self) -> BitTimes {
        self.t_sdr
    }
}

impl Device {
    /// The master that owns the slave.
    pub(super) fn master(&self) -> Option<Address> {
        self.master
    }

    pub(super) fn exchanges_data(&self) -> bool {
        self.phase == SlavePhase::DataExchange
    }

    pub(super) fn announce_diagnosis(&mut self) {
        self.diag_pending = true;
    }

    pub(super) fn push_event(&mut self, event: SlaveEvent) {
        self.events.push(event);
    }

    fn v1(&mut self, now: Instant, header: &Header, dsap: u8, data: &[u8]) -> Response<'_> {
        let asking = Asking {
            master: header.sa,
            ssap: header.ssap,
            exchanges_data: self.exchanges_data() && self.master == Some(header.sa),
        };
        let Self {
            v1, scratch, events, ..
        } = self;
        match v1.handle(now, dsap, &asking, data, scratch, events) {
            Answer::Acknowledge => Response::ShortAck,
            Answer::Data(len) => Response::Low(self.scratch.get(..len).unwrap_or(&[])),
            Answer::NoService => REFUSED,
            Answer::NoResource => Response::Refuse(ResponseFunction::NoResource),
        }
    }

    fn diagnosis(&self) -> StandardDiag {
        let in_exchange = self.exchanges_data();
        let status = StationStatus::FIXED
            .with(self.faults)
            .with_if(StationStatus::STATION_NOT_READY, !in_exchange)
            .with_if(StationStatus::PRM_REQ, self.phase == SlavePhase::WaitPrm)
            .with_if(StationStatus::EXT_DIAG, self.ext_diag_kind == ExtDiag::Fault)
            .with_if(StationStatus::STAT_DIAG, self.input_validity == InputValidity::Invalid)
            .with_if(StationStatus::WD_ON, self.watchdog.is_some())
            .with_if(StationStatus::SYNC_MODE, self.sync == Hold::Held)
            .with_if(StationStatus::FREEZE_MODE, self.freeze == Hold::Held);
        StandardDiag {
            status,
            status_3: match self.overflow {
                Overflow::Complete => 0,
                Overflow::Truncated => EXT_DIAG_OVERFLOW,
            },
            master: self.master.map_or(StandardDiag::NO_MASTER, Address::value),
            ident: self.identity.ident,
        }
    }

    /// The owner lives. The watchdog runs from data exchange on (9300 facts 1.5).
    fn retrigger(&mut self, now: Instant, sa: Address) {
        if let Some(watchdog) = self.watchdog
            && self.phase == SlavePhase::DataExchange
            && self.master == Some(sa)
        {
            self.timers.start(Timer::Watchdog, now + watchdog.time());
        }
    }

    fn data_exchange(&mut self, sa: Address, data: &[u8]) -> Response<'_> {
        if self.phase != SlavePhase::DataExchange || self.master != Some(sa) {
            return REFUSED;
        }
        let expected = self.lengths.outputs;
        if data.len() == expected {
            self.exchanges += 1;
            if expected > 0 {
                // The length is that of the images, so this cannot fail.
                self.staged_outputs.replace(data);
                if self.sync == Hold::Follows {
                    self.outputs.replace(data);
                    self.new_outputs = true;
                }
            }
        } else if data.is_empty() {
            // Interpretation: an empty output telegram is Clear also from masters that never send Global_Control
            // (9300 facts 1.1, Fail_Safe).
            self.exchanges += 1;
            self.clear_outputs();
        } else {
            self.leave(LeaveReason::OutputLength {
                expected,
                got: data.len(),
            });
            return REFUSED;
        }
        match (self.diag_pending, self.inputs.is_empty()) {
            (true, _) => Response::High(&self.inputs),
            (false, false) => Response::Low(&self.inputs),
            (false, true) => Response::ShortAck,
        }
    }

    fn slave_diag(&mut self, sa: Address) -> Response<'_> {
        let mut standard = self.diagnosis();
        // A diagnosis tool that listens in must not take the news from the owner.
        let owner_reads = self.master == Some(sa);
        let (fixed, rest) = self.scratch.split_at_mut(SLAVE_DIAG_LEN);
        let alarm = if owner_reads { self.v1.announce_alarm(rest) } else { 0 };
        let room = rest.get_mut(alarm..).unwrap_or_default();
        let len = match room.get_mut(..self.ext_diag.len()) {
            Some(target) => {
                target.copy_from_slice(&self.ext_diag);
                SLAVE_DIAG_LEN + alarm + self.ext_diag.len()
            }
            // Blocks are not cut; they come again when no alarm stands before them.
            None => {
                standard.status_3 |= EXT_DIAG_OVERFLOW;
                SLAVE_DIAG_LEN + alarm
            }
        };
        fixed.copy_from_slice(&standard.octets());
        if owner_reads {
            self.diag_pending = self.v1.has_queued_alarm() || standard.status_3 & EXT_DIAG_OVERFLOW != 0 && alarm > 0;
        }
        Response::Low(self.scratch.get(..len).unwrap_or(&[]))
    }

    fn set_prm(&mut self, sa: Address, data: &[u8]) -> Response<'_> {
        if self.master.is_some_and(|owner| owner != sa) {
            return REFUSED;
        }
        // The acknowledgement only says that the telegram arrived; whether it was accepted is in the diagnosis.
        let Ok(prm) = SetPrm::parse(data) else {
            self.refuse_prm(0, StationStatus::PRM_FAULT);
            return Response::ShortAck;
        };
        match prm.lock_request() {
            LockRequest::Keep => {
                self.set_min_tsdr(prm.min_tsdr);
                return Response::ShortAck;
            }
            LockRequest::Unlock => {
                self.faults = StationStatus::default();
                self.leave(LeaveReason::Unlocked);
                return Response::ShortAck;
            }
            LockRequest::Lock => {}
        }
        let identity = &self.identity;
        let unsupported = (prm.sync_requested() && identity.sync == Support::Unsupported)
            || (prm.freeze_requested() && identity.freeze == Support::Unsupported)
            || !self.v1.supports(self.v1.status_of(prm.user));
        let faulty = prm.ident != identity.ident
            || !identity.user_prm_len.contains(&prm.user.len())
            || (prm.watchdog_on() && prm.watchdog().is_none());
        if unsupported {
            self.refuse_prm(prm.ident, StationStatus::PRM_FAULT.with(StationStatus::NOT_SUPPORTED));
        } else if faulty {
            self.refuse_prm(prm.ident, StationStatus::PRM_FAULT);
        } else {
            self.accept_prm(sa, &prm);
        }
        Response::ShortAck
    }

    /// The acknowledgement only says that the telegram arrived.
    fn set_slave_add(&mut self, data: &[u8]) -> Response<'_> {
        if self.identity.address_change == AddressChange::Unsupported || self.phase != SlavePhase::WaitPrm {
            return REFUSED;
        }
        let cause = match SetSlaveAdd::parse(data) {
            Err(error) => AddressKept::Malformed(error),
            Ok(request) if request.ident != self.identity.ident => AddressKept::Ident { got: request.ident },
            Ok(_) if self.identity.address_change == AddressChange::Locked => AddressKept::Locked,
            Ok(request) => {
                self.change_address(&request);
                return Response::ShortAck;
            }
        };
        self.events.push(SlaveEvent::AddressKept { cause });
        Response::ShortAck
    }

    fn change_address(&mut self, request: &SetSlaveAdd<'_>) {
        let address = request.new_address;
        self.identity.address = address;
        if request.lock == AddressLock::Locked {
            self.identity.address_change = AddressChange::Locked;
        }
        // Parsed, so it fits.
        self.remaining.replace(request.remaining);
        self.new_address = Some(address);
        self.events.push(SlaveEvent::AddressChanged {
            address,
            lock: request.lock,
        });
    }

    fn accept_prm(&mut self, sa: Address, prm: &SetPrm<'_>) {
        if self.phase == SlavePhase::DataExchange {
            self.leave(LeaveReason::Reparametrised);
        }
        self.phase = SlavePhase::WaitCfg;
        self.master = Some(sa);
        self.faults = StationStatus::default();
        self.group = prm.group;
        let v1_status = self.v1.status_of(prm.user);
        self.v1.parametrised(v1_status);
        self.watchdog = prm.watchdog().map(|watchdog| {
            if v1_status.watchdog_1ms() {
                watchdog.in_milliseconds()
            } else {
                watchdog
            }
        });
        // Parsed, so it fits.
        self.user_prm.replace(prm.user);
        self.set_min_tsdr(prm.min_tsdr);
        self.events.push(SlaveEvent::Parametrised {
            master: sa,
            watchdog: self.watchdog,
        });
    }

    fn refuse_prm(&mut self, ident: u16, faults: StationStatus) {
        self.leave(LeaveReason::ParametersRefused);
        self.faults = faults;
        self.events.push(SlaveEvent::ParametersRefused { ident });
    }

    /// 0 keeps the value; the station is never faster than it can be.
    fn set_min_tsdr(&mut self, bits: u8) {
        if bits != 0 {
            self.t_sdr = BitTimes(u32::from(u16::from(bits).max(self.identity.min_tsdr)));
        }
    }

    fn chk_cfg(&mut self, now: Instant, sa: Address, data: &[u8]) -> Response<'_> {
        if self.master != Some(sa) {
            return REFUSED;
        }
        let accepted = self.identity.configurations.check(data);
        let (Some(lengths), Some(configuration)) = (accepted, Octets::from_slice(data)) else {
            self.leave(LeaveReason::ConfigurationRefused);
            self.faults = StationStatus::CFG_FAULT;
            self.events.push(SlaveEvent::ConfigurationRefused);
            return Response::ShortAck;
        };
        let unchanged = self.phase == SlavePhase::DataExchange && self.configuration == configuration;
        if unchanged {
            return Response::ShortAck;
        }
        let entered = self.phase != SlavePhase::DataExchange;
        // Outputs held since the last exchange stay until the master's first ones: zeros between would be outputs that
        // nobody sent.
        let held = self.identity.outputs_on_leave == OutputsOnLeave::Hold && self.configuration == configuration;
        self.configuration = configuration;
        self.lengths = lengths;
        if !held {
            self.outputs.reset(lengths.outputs);
            self.staged_outputs.reset(lengths.outputs);
        }
        self.inputs.reset(lengths.inputs);
        self.release_inputs();
        self.phase = SlavePhase::DataExchange;
        self.retrigger(now, sa);
        self.events.push(SlaveEvent::Configured { lengths });
        if entered {
            self.v1.entered_data_exchange();
            self.events.push(SlaveEvent::EnteredDataExchange);
        }
        Response::ShortAck
    }

    fn known_configuration(&self) -> &[u8] {
        if self.configuration.is_empty() {
            self.identity.real_configuration
        } else {
            &self.configuration
        }
    }

    /// Clear_Data first: a Sync in the same telegram then holds the zeros. "Un" wins over its opposite. What the device
    /// cannot do is told with Not_Supported.
    fn global_control(&mut self, command: ControlCommand) {
        if command.contains(ControlCommand::CLEAR_DATA) {
            self.clear_outputs();
        }
        let sync = hold_after(command, ControlCommand::SYNC, ControlCommand::UNSYNC);
        if let Some(hold) = sync
            && self.can(self.identity.sync)
        {
            self.sync = hold;
            self.release_outputs();
        }
        let freeze = hold_after(command, ControlCommand::FREEZE, ControlCommand::UNFREEZE);
        if let Some(hold) = freeze
            && self.can(self.identity.freeze)
        {
            self.freeze = hold;
            self.release_inputs();
        }
    }

    /// Whether the device can do what it was asked for; if not, the master is told.
    fn can(&mut self, support: Support) -> bool {
        let can = support == Support::Supported;
        if !can && !self.faults.contains(StationStatus::NOT_SUPPORTED) {
            self.faults = self.faults.with(StationStatus::NOT_SUPPORTED);
            self.diag_pending = true;
        }
        can
    }

    fn release_inputs(&mut self) {
        copy_padded(&self.process_inputs, self.inputs.as_mut_slice());
    }

    fn release_outputs(&mut self) {
        if self.outputs != self.staged_outputs {
            self.outputs = self.staged_outputs;
            self.new_outputs = true;
        }
    }

    /// Every Clear is told, but one that finds zeros already there only once.
    fn clear_outputs(&mut self) {
        let had_values = self.outputs.iter().any(|&octet| octet != 0);
        self.staged_outputs.reset(self.lengths.outputs);
        self.outputs.reset(self.lengths.outputs);
        if had_values || self.new_outputs {
            self.new_outputs = false;
            self.events.push(SlaveEvent::OutputsCleared);
        }
    }

    fn watchdog_expired(&mut self) {
        self.events.push(SlaveEvent::WatchdogExpired);
        self.leave(LeaveReason::Watchdog);
    }

    /// The one way back to waiting for Set_Prm.
    fn leave(&mut self, reason: LeaveReason) {
        let was_in_exchange = self.phase == SlavePhase::DataExchange;
        self.phase = SlavePhase::WaitPrm;
        self.master = None;
        self.watchdog = None;
        self.timers.stop(Timer::Watchdog);
        self.group = 0;
        self.sync = Hold::Follows;
        self.freeze = Hold::Follows;
        self.release_inputs();
        self.v1.left_data_exchange();
        if was_in_exchange {
            if self.identity.outputs_on_leave == OutputsOnLeave::Clear {
                self.staged_outputs.reset(self.lengths.outputs);
                self.outputs.reset(self.lengths.outputs);
                self.new_outputs = false;
            }
            self.events.push(SlaveEvent::LeftDataExchange { reason });
        }
    }
}

/// What a Global_Control asks of an image: held, following, or neither.
fn hold_after(command: ControlCommand, hold: ControlCommand, follow: ControlCommand) -> Option<Hold> {
    if command.contains(follow) {
        Some(Hold::Follows)
    } else {
        command.contains(hold).then_some(Hold::Held)
    }
}

fn is_srd(header: &Header) -> bool {
    matches!(
        header.fc,
        FunctionCode::Request {
            function: RequestFunction::SrdLow | RequestFunction::SrdHigh,
            ..
        }
    )
}

fn copy_padded(from: &[u8], to: &mut [u8]) {
    for (place, octet) in to.iter_mut().enumerate() {
        *octet = from.get(place).copied().unwrap_or(0);
    }
}

/// Why an extended diagnosis was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExtDiagError {
    /// It fits into no telegram.
    #[error("extended diagnosis: expected at most 238 octets, got {got}")]
    TooLong {
        /// Octets given.
        got: usize,
    },
    /// It cannot be divided into blocks, so a master could not read it.
    #[error(transparent)]
    Block(#[from] BlockFault),
}
