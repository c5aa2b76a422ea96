//! The cycle of a master of class 1: what it does with each token.
//!
//! ```text
//! Begin ─► Slave(0) ─► … Slave(n−1) ─► Announce ─► Control ─► Acyclic ─► End ─► token, Begin
//! ```
//!
//! A step without anything to do is passed over. In Stop there are no slaves to look at.

use super::acyclic::{Count, Jobs};
use super::control::{ControlCommand, GlobalControl};
use super::events::EventQueue;
use super::master::{ControlError, MasterConfig, MasterEvent, MasterStatistics, Mode, SlaveIndex};
use super::operation::{AutoClear, Judgement, Operation};
use super::pace::Pace;
use super::peer_fcb::PeerFcbs;
use super::sap;
use super::slave_handler::{Activation, Context, SlaveHandler, SlaveState};
use crate::address::Address;
use crate::fdl::{Access, Action, Confirmation, FcbCounter, Outcome, Repeat, RingEvent, TokenUser};
use crate::time::{Duration, Instant};
use crate::wire::{Fcb, FunctionCode, Header, RequestFunction};

/// The cycle and everything it works on.
#[derive(Debug, Clone)]
pub(super) struct Cyclic<const N: usize> {
    pub(super) config: MasterConfig,
    pub(super) operation: Operation,
    pub(super) slaves: [Option<SlaveHandler>; N],
    pub(super) count: usize,
    step: Step,
    /// What is under way belongs to a time before Stop: slave states, commands.
    stale: bool,
    /// The slaves have to be told the mode.
    announcement_due: bool,
    /// When they were told last.
    announced: Instant,
    /// Commands of the user, the oldest is next.
    commands: CommandQueue,
    control_octets: [u8; 2],
    pub(super) jobs: Jobs,
    /// Frame count bits towards the stations of the jobs that are no slaves of ours.
    peers: PeerFcbs,
    pace: Pace,
    pub(super) cycles_total: Duration,
    pub(super) statistics: MasterStatistics,
    pub(super) events: EventQueue<MasterEvent, EVENTS>,
}

/// Where the cycle stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// Nothing sent yet.
    Begin,
    /// The slave at this place is next, or its request is under way.
    Slave(usize),
    /// The Global_Control that tells the mode, or it is under way.
    Announce,
    /// The Global_Control of the user, or it is under way.
    Control,
    /// One telegram of an acyclic job, or it is under way.
    Acyclic,
    /// Nothing but the token.
    End,
}

const EVENTS: usize = 32;
type CommandQueue = EventQueue<GlobalControl, 8>;

impl<const N: usize> Cyclic<N> {
    /// Without slaves, in Stop.
    pub(super) fn new(config: MasterConfig) -> Self {
        Self {
            operation: Operation::Stop,
            slaves: [const { None }; N],
            count: 0,
            step: Step::Begin,
            stale: false,
            announcement_due: false,
            announced: Instant::ZERO,
            commands: CommandQueue::new(),
            control_octets: [0; 2],
            jobs: Jobs::new(config.address),
            peers: PeerFcbs::new(),
            pace: Pace::new(config.min_cycle, config.overrun),
            cycles_total: Duration::ZERO,
            statistics: MasterStatistics::default(),
            events: EventQueue::new(),
            config,
        }
    }

    pub(super) fn set_mode(&mut self, mode: Mode) {
        let next = self.operation.request(mode, self.config.auto_clear);
        let before = core::mem::replace(&mut self.operation, next);
        if before.mode() == next.mode() {
            return;
        }
        self.announcement_due = next != Operation::Stop;
        if next == Operation::Stop {
            self.commands = CommandQueue::new();
            self.stop_slaves();
        }
    }

    pub(super) fn send_control(&mut self, control: GlobalControl) -> Result<(), ControlError> {
        if self.operation == Operation::Stop {
            return Err(ControlError::Stopped);
        }
        let lost = self.commands.lost();
        self.commands.push(control);
        if self.commands.lost() == lost {
            Ok(())
        } else {
            Err(ControlError::Full)
        }
    }

    /// `false` when there is no such slave.
    pub(super) fn set_activation(&mut self, slave: SlaveIndex, activation: Activation) -> bool {
        let context = context(&self.config, slave.position());
        let Some(Some(handler)) = self.slaves.get_mut(slave.position()) else {
            return false;
        };
        if let Some(event) = handler.set_activation(activation, &context) {
            self.events.push(event);
        }
        self.stale |= self.step == Step::Slave(slave.position());
        true
    }

    fn begin_cycle(&mut self, now: Instant) {
        let begun = self.pace.begin(now);
        let statistics = &mut self.statistics;
        if let Some(cycle) = begun.last_cycle {
            statistics.least_cycle = match statistics.cycles {
                0 => cycle,
                _ => statistics.least_cycle.min(cycle),
            };
            statistics.longest_cycle = statistics.longest_cycle.max(cycle);
            statistics.last_cycle = cycle;
            statistics.cycles += 1;
            self.cycles_total += cycle;
        }
        statistics.missed_cycles += begun.missed;
        if let Some(took) = begun.overran {
            statistics.overruns += 1;
            if begun.is_first {
                self.events.push(MasterEvent::CycleOverrun { took });
            }
        }
        self.judge(now);
        if let Some(interval) = self.config.announce_mode {
            self.announcement_due |= self.announced + interval <= now;
        }
    }

    /// Auto_Clear.
    fn judge(&mut self, now: Instant) {
        if self.config.auto_clear == AutoClear::Off {
            return;
        }
        let control_time = self.config.data_control_time;
        let awaited = self.operation == Operation::AwaitSlaves;
        let failed = self.slaves.iter_mut().position(|slave| {
            slave.as_mut().is_some_and(|slave| {
                slave.counts_for_auto_clear() && (slave.silent_for(now) > control_time || awaited && !slave.is_served())
            })
        });
        match self.operation.judge(self.config.auto_clear, failed.is_none()) {
            Judgement::Unchanged => return,
            Judgement::Released => self.events.push(MasterEvent::OutputsReleased),
            Judgement::Cleared => self.events.push(MasterEvent::AutoCleared {
                slave: SlaveIndex::at(failed.unwrap_or_default()),
            }),
        }
        self.announcement_due = true;
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

    /// A job has read the diagnosis of a station, which may be a slave of ours.
    fn diagnosis_seen(&mut self, now: Instant, peer: Address, data: &[u8]) {
        let mut slaves = self.slaves.iter_mut().enumerate();
        let found =
            slaves.find_map(|(place, slave)| Some((place, slave.as_mut().filter(|slave| slave.address() == peer)?)));
        if let Some((place, slave)) = found {
            let context = context(&self.config, place);
            if let Some(event) = slave.diagnosis_seen(now, data, &context) {
                self.events.push(event);
            }
        }
    }

    /// The frame count bit of a station; a slave has one for cyclic and acyclic requests together.
    fn fcb_mut(&mut self, peer: Address) -> &mut FcbCounter {
        let slave = self.slaves.iter_mut().flatten().find(|slave| slave.address() == peer);
        match slave {
            Some(slave) => slave.fcb_mut(),
            None => self.peers.counter(peer),
        }
    }

    /// A Global_Control waits until somebody can obey it.
    fn somebody_obeys(&self) -> bool {
        let mut slaves = self.slaves.iter().flatten();
        slaves.any(|slave| slave.state() == SlaveState::DataExchange)
    }

    /// The Global_Control that is due in this step.
    fn control(&self) -> Option<GlobalControl> {
        let control = match self.step {
            Step::Announce if self.announcement_due => self.operation.announcement(),
            Step::Control => self.commands.first(),
            _ => None,
        }?;
        let command = match self.operation.mode() {
            Mode::Operate => control.command,
            Mode::Clear | Mode::Stop => control.command.with(ControlCommand::CLEAR_DATA),
        };
        self.somebody_obeys().then_some(GlobalControl { command, ..control })
    }
}

fn context(config: &MasterConfig, place: usize) -> Context {
    Context {
        master: config.address,
        slave: SlaveIndex::at(place),
        retry_interval: config.retry_interval,
    }
}

impl<const N: usize> TokenUser for Cyclic<N> {
    /// At most one look at each slave.
    fn next_action(&mut self, now: Instant, access: Access) -> Action<'_> {
        // Nothing is under way when this is asked.
        self.stale = false;
        if self.step == Step::Begin {
            let due = self.pace.due(now);
            if now < due {
                return Action::WaitUntil(due);
            }
            self.begin_cycle(now);
            self.step = Step::Slave(0);
        }
        if let Step::Slave(first) = self.step {
            let first = if self.operation == Operation::Stop { N } else { first };
            let due = (first..self.count)
                .find(|&place| matches!(self.slaves.get(place), Some(Some(slave)) if slave.is_due(now)));
            self.step = due.map_or(Step::Announce, Step::Slave);
        }
        if let Step::Slave(place) = self.step {
            return match self.slaves.get(place) {
                Some(Some(handler)) => handler.next_action(now, self.config.address, self.operation.mode()),
                // The place was found above.
                _ => Action::PassToken,
            };
        }
        if self.step == Step::Announce && self.control().is_none() {
            self.step = Step::Control;
        }
        if let Some(control) = self.control() {
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
        // Jobs are of low priority by nature. When the token is late they wait; the one message cycle it still allows
        // belongs to the exchange.
        if self.step != Step::End
            && access == Access::Any
            && let Some(peer) = self.jobs.begin()
        {
            self.step = Step::Acyclic;
            let fcb = self.fcb_mut(peer).current();
            if let Some(action) = self.jobs.action(fcb) {
                return action;
            }
        }
        self.step = Step::Begin;
        self.pace.end(now);
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
                let report = handler.confirm(now, started, &outcome, &context);
                if report.exchanged {
                    self.statistics.exchanges += 1;
                    self.statistics.last_exchange = now - started;
                }
                if report.rejected {
                    self.statistics.rejected += 1;
                }
                if report.outputs_refused {
                    self.statistics.outputs_refused += 1;
                }
                // Who comes later has not heard that the outputs are cleared.
                self.announcement_due |= self.operation.mode() == Mode::Clear && report.entered;
                if let Some(event) = report.event {
                    self.events.push(event);
                }
            }
            Step::Acyclic => {
                self.step = Step::End;
                if let Some((peer, count)) = self.jobs.confirm(now, started, outcome) {
                    let stale = self.stale;
                    let fcb = self.fcb_mut(peer);
                    match count {
                        // Stop has reset the bit of a slave while the answer was under way.
                        Count::Next if !stale => fcb.confirm(),
                        Count::Keep => {}
                        Count::Next | Count::Restart => fcb.reset(),
                    }
                    if let Outcome::Response { header, data } = outcome
                        && header.ssap == Some(sap::SLAVE_DIAG)
                    {
                        self.diagnosis_seen(now, peer, data);
                    }
                }
            }
            Step::Announce => {
                // The mode may have changed while the telegram was on its way.
                let told = self.operation.announcement().map(GlobalControl::octets);
                if outcome == Outcome::Sent && told == Some(self.control_octets) {
                    self.announcement_due = false;
                    self.announced = now;
                }
                self.step = Step::Control;
            }
            Step::Control => {
                // Stop has emptied the queue: what is in it now was not sent.
                if outcome == Outcome::Sent && !self.stale {
                    self.commands.pop();
                }
                self.step = Step::Acyclic;
            }
            Step::Begin | Step::End => {}
        }
    }

    fn handle_ring(&mut self, _now: Instant, event: RingEvent) {
        if matches!(event, RingEvent::Claimed | RingEvent::Entered) {
            self.step = Step::Begin;
            // The time without a token was no cycle.
            self.pace.restart();
            self.peers.forget();
        }
        self.events.push(MasterEvent::Ring(event));
    }
}
