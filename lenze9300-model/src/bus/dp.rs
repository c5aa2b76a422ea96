//! EMF2133IB: the PROFIBUS module on the drive's automation interface.
//!
//! Towards the bus a DP slave with 8 octets of parameter channel and up to 16 process words; towards the drive the
//! DRIVECOM machine, which turns the control word into the drive's own.
//!
//! | octets | to the drive | from the drive |
//! |---|---|---|
//! | 1–8 | parameter request | parameter answer |
//! | 9, 10 | control word, high octet first | status word |
//! | 11, 12 | – | MCTRL-NACT, 16384 = 100 % of C0011 |
//! | 13, 14 | – | POS-ACT, **low** word |
//! | 15, 16 | – | POS-ACT, **high** word |
//!
//! Over DP-V1 the parameters are reached through data record 47, see `records`.
//!
//! Source: 9300 fact sheet, sections 1.1 to 1.6, 2 and 7; film-feed specification, section 7.

use dp_master::address::{Address, AddressError};
use dp_master::dp::v1::{V1Capabilities, V1Channel};
use dp_master::dp::{
    AcceptedConfigurations, DpSlave, ExtDiag, IdentityError, IoLengths, LeaveReason, OutputsOnLeave, Overflow,
    SlaveEvent, SlaveIdentity, Support, io_lengths,
};
use dp_master::station::{LineError, MAX_TELEGRAM, Station};
use dp_master::time::{Baud, Duration, Instant};
use drivecom::param::{ErrorCode, Frame, Job, JobKind, Server, ServerAction, ServerOptions};
use thiserror::Error;

use drivecom::{Conditions, ControlWord, Machine, State, StatusInputs, StatusWord};

use super::records::Records;
use crate::code::CodeError;
use crate::code::table::number::{C1882, C1883};
use crate::device::{Drive, DriveStatus, Fault};
use crate::noise;

/// Ident number. Assumed: the manufacturer's is not known (9300 fact sheet, section 1.1).
pub const IDENT: u16 = 0x00DA;

/// Identifiers of the module PAR(Cons.) + PZD(4W Cons.): twice four words in and out, consistent over the whole length.
pub const PAR_AND_FOUR_WORDS: &[u8] = &[0xF3, 0xF3];

/// Octets of the parameter channel.
const PAR: usize = 8;
/// Octets of the process words that the drive has.
const PZD: usize = 8;

/// How the module is set and how fast it works.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emf2133Config {
    /// Station address, set by the switches on the front, 0…126.
    pub address: u8,
    /// Ident number.
    pub ident: u16,
    /// Time from the bus to the control loop and back, ms, each way; 0…15. Assumed 3 ms (fact sheet, section 1.6).
    pub process_data_delay_ms: usize,
    /// Least time a parameter job takes, ms. Assumed 30 ms.
    pub parameter_delay_ms: u32,
    /// What a parameter job may take longer, ms, evenly distributed. Assumed 20 ms.
    pub parameter_jitter_ms: u32,
    /// How the parameter channel answers; older modules differ (fact sheet, section 3.1).
    pub server: ServerOptions,
    /// Seed of the processing times.
    pub seed: u64,
    /// What operating system and adapter may add to gaps inside a telegram; zero on a real or virtual line.
    pub latency_allowance: Duration,
}

impl Default for Emf2133Config {
    fn default() -> Self {
        Emf2133Config {
            address: 3,
            ident: IDENT,
            process_data_delay_ms: 3,
            parameter_delay_ms: 30,
            parameter_jitter_ms: 20,
            server: ServerOptions::default(),
            seed: 1,
            latency_allowance: Duration::ZERO,
        }
    }
}

/// The module: a [`Station`] towards the line, [`cycle_1ms`](Self::cycle_1ms) towards the drive.
#[derive(Debug, Clone)]
pub struct Emf2133 {
    slave: DpSlave,
    machine: Machine,
    server: Server,
    config: Emf2133Config,
    /// The job under way with the milliseconds it still takes.
    job: Option<(Job, u32)>,
    jobs: u64,
    records: Records,
    /// The latest time the line has told.
    line_time: Instant,
    to_drive: Delay,
    from_drive: Delay,
    status_word: StatusWord,
    diagnosis: u16,
    absence: Option<Absence>,
    watched: bool,
}

impl Emf2133 {
    /// A module after power-up on a line of this baud rate.
    ///
    /// # Errors
    /// When the address is not one of a station.
    pub fn new(config: Emf2133Config, baud: Baud) -> Result<Self, ModuleError> {
        let address = Address::new(config.address)?;
        let identity = SlaveIdentity {
            real_configuration: PAR_AND_FOUR_WORDS,
            user_prm_len: 0..=MAX_USER_PRM,
            outputs_on_leave: OutputsOnLeave::Hold,
            v1: V1_CAPABILITIES,
            latency_allowance: config.latency_allowance,
            ..SlaveIdentity::new(address, config.ident, baud, AcceptedConfigurations::Rule(accepted))
        };
        Ok(Emf2133 {
            slave: DpSlave::new(identity)?,
            machine: Machine::new(),
            server: Server::new(config.server),
            job: None,
            jobs: 0,
            records: Records::default(),
            line_time: Instant::ZERO,
            to_drive: Delay::new(config.process_data_delay_ms),
            from_drive: Delay::new(config.process_data_delay_ms),
            config,
            status_word: StatusWord(0),
            diagnosis: 0,
            absence: None,
            watched: false,
        })
    }

    /// The module's cycle, once a millisecond, before the drive's 1 ms task.
    ///
    /// Both 8-octet areas are taken over and given whole: the master never sees half of one.
    pub fn cycle_1ms(&mut self, drive: &mut Drive) {
        self.follow_bus();
        let (request, process_in) = self.taken_over();
        let process_in = self.to_drive.pass(process_in);
        let status = drive.status();

        let step = self.machine.step(
            ControlWord(u16::from_be_bytes([process_in[0], process_in[1]])),
            conditions(&status),
        );
        let failure = self.bus_failure(drive);
        drive.inject(Fault::Ce0, failure == BusFailure::Trip);
        drive.set_aif(
            step.aif
                .with_controller_inhibit(step.aif.controller_inhibit() || failure == BusFailure::Inhibit)
                .with_quick_stop(step.aif.quick_stop() || failure == BusFailure::QuickStop),
        );
        self.status_word = self.machine.status_word(self.status_inputs(&status));

        if let Some(request) = request {
            self.serve_parameters(&request, drive);
        }
        self.serve_records(drive);
        let process_out = self.from_drive.pass(process_image(self.status_word, &status));
        self.give(process_out);
        self.announce_diagnosis(drive.drivecom_error_code());
    }

    /// State of the DRIVECOM machine.
    pub fn state(&self) -> State {
        self.machine.state()
    }

    /// The control word the machine worked with last.
    pub fn control_word(&self) -> ControlWord {
        self.machine.control_word()
    }

    /// The status word of this cycle, before its way to the bus.
    pub fn status_word(&self) -> StatusWord {
        self.status_word
    }

    /// The DP slave.
    pub fn slave(&self) -> &DpSlave {
        &self.slave
    }

    /// Follows the slave's state: whether the bus is there, and since when not.
    fn follow_bus(&mut self) {
        while let Some(event) = self.slave.poll_event() {
            match event {
                SlaveEvent::Parametrised { watchdog, .. } => self.watched = watchdog.is_some(),
                SlaveEvent::EnteredDataExchange => self.absence = None,
                SlaveEvent::LeftDataExchange { reason } if self.watched => {
                    self.records.forget(V1Channel::Msac1);
                    self.absence = Some(Absence {
                        by_watchdog: reason == LeaveReason::Watchdog,
                        ms: 0,
                    });
                }
                SlaveEvent::LeftDataExchange { .. } => self.records.forget(V1Channel::Msac1),
                SlaveEvent::ConnectionOpened { sap, .. } | SlaveEvent::ConnectionClosed { sap, .. } => {
                    self.records.forget(V1Channel::Msac2 { sap });
                }
                _ => {}
            }
        }
        if let Some(absence) = &mut self.absence {
            absence.ms = absence.ms.saturating_add(1);
        }
    }

    /// What the drive does now because the bus failed, by C1882 and C1883 (fact sheet, section 1.5).
    ///
    /// Only after data exchange and only with the watchdog on. Without C1883 the watchdog decides alone; with it the time
    /// counts from leaving data exchange, however it was left.
    fn bus_failure(&self, drive: &Drive) -> BusFailure {
        let reaction = match drive.codes().number(C1882, 0) as i64 {
            1 => BusFailure::Trip,
            2 => BusFailure::Inhibit,
            3 => BusFailure::QuickStop,
            _ => BusFailure::None,
        };
        let extra_ms = drive.codes().number(C1883, 0);
        let acts = self.absence.is_some_and(|absence| {
            if extra_ms >= C1883_OFF {
                absence.by_watchdog
            } else {
                f64::from(absence.ms) >= extra_ms
            }
        });
        if acts { reaction } else { BusFailure::None }
    }

    /// The outputs of the master: parameter request, if the configuration has one, and the first four process words.
    fn taken_over(&self) -> (Option<Frame>, [u8; PZD]) {
        let outputs = self.slave.outputs();
        let (request, words) = if self.has_parameter_channel() {
            match outputs.split_first_chunk::<PAR>() {
                Some((par, rest)) => (Some(Frame(*par)), rest),
                None => (None, outputs),
            }
        } else {
            (None, outputs)
        };
        let mut image = [0; PZD];
        for (to, from) in image.iter_mut().zip(words) {
            *to = *from;
        }
        (request, image)
    }

    /// Gives parameter answer and process words to the bus; words the drive does not have read 0.
    fn give(&mut self, words: [u8; PZD]) {
        let mut image = [0; MAX_IMAGE];
        let process = if self.has_parameter_channel() {
            image[..PAR].copy_from_slice(&self.server.answer().0);
            PAR
        } else {
            0
        };
        image[process..process + PZD].copy_from_slice(&words);
        let length = self.slave.lengths().inputs.min(MAX_IMAGE);
        self.slave.set_inputs(&image[..length]);
    }

    fn has_parameter_channel(&self) -> bool {
        self.slave.configuration().len() == 2
    }

    /// One job at a time: taken at the handshake's change, done after its processing time.
    fn serve_parameters(&mut self, request: &Frame, drive: &mut Drive) {
        if let Some((job, remaining_ms)) = self.job {
            if remaining_ms > 1 {
                self.job = Some((job, remaining_ms - 1));
                return;
            }
            self.job = None;
            self.server.complete(carry_out(&job, drive));
            return;
        }
        if let ServerAction::Start(job) = self.server.poll(request) {
            self.job = Some((job, job_ms(&self.config, &mut self.jobs)));
        }
    }

    /// The parameters over DP-V1.
    fn serve_records(&mut self, drive: &mut Drive) {
        let Self {
            records,
            slave,
            config,
            jobs,
            line_time,
            ..
        } = self;
        records.pass_1ms(*line_time, slave, drive, || job_ms(config, jobs));
    }

    fn status_inputs(&self, status: &DriveStatus) -> StatusInputs {
        StatusInputs {
            warning: status.warning,
            message: status.message,
            remote: true,
            set_value_reached: status.set_value_reached,
            limit: status.limit,
            fail_qsp: status.fail_qsp,
            running: status.running,
            ended_in_target: status.ended_in_target,
        }
    }

    /// A new fault is announced by a high-priority answer; octets 7…9 of the diagnosis (fact sheet, section 1.4).
    fn announce_diagnosis(&mut self, error_code: u16) {
        if error_code == self.diagnosis {
            return;
        }
        self.diagnosis = error_code;
        let [high, low] = error_code.to_be_bytes();
        let kind = if error_code == 0 {
            ExtDiag::Message
        } else {
            ExtDiag::Fault
        };
        // Three octets always fit.
        let _ = self
            .slave
            .set_ext_diag(kind, &[DEVICE_DIAGNOSIS, high, low], Overflow::Complete);
    }
}

/// Why there is no such module.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ModuleError {
    /// The address is none.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// The address is not one of a station.
    #[error(transparent)]
    Identity(#[from] IdentityError),
}

/// What the drive does when the bus fails (C1882; coding assumed).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BusFailure {
    None,
    Trip,
    Inhibit,
    QuickStop,
}

/// Data exchange was left while the watchdog was on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Absence {
    by_watchdog: bool,
    ms: u32,
}

fn carry_out(job: &Job, drive: &mut Drive) -> Result<i32, ErrorCode> {
    let (code, subcode) = (job.code.number(), job.subcode.0);
    let result = match job.kind {
        JobKind::Read => drive.read_code(code, subcode),
        JobKind::Write => drive
            .codes()
            .check_length(code, job.length.octets())
            .and_then(|()| drive.write_code(code, subcode, job.value))
            .map(|()| job.value),
    };
    result.map_err(|error: CodeError| {
        let reply = error.reply();
        ErrorCode::new(reply.class, reply.code, reply.additional)
    })
}

/// How long the next parameter job takes, ms.
fn job_ms(config: &Emf2133Config, jobs: &mut u64) -> u32 {
    let jitter = noise::below(config.seed, JOB_CHANNEL, *jobs, config.parameter_jitter_ms + 1);
    *jobs += 1;
    config.parameter_delay_ms + jitter
}

fn conditions(status: &DriveStatus) -> Conditions {
    Conditions {
        self_test_done: status.initialised,
        power_ok: !status.undervoltage,
        release: status.released,
        fault: status.trip.is_some(),
        // A TRIP switches the output stage off at once: there is nothing to wait for.
        fault_reaction_done: true,
        fault_cause_gone: !status.trip_cause_present,
        quick_stop_done: status.standstill,
    }
}

fn process_image(status_word: StatusWord, status: &DriveStatus) -> [u8; PZD] {
    let position = status.position as u32;
    let words = [
        status_word.0,
        status.speed as u16,
        position as u16,
        (position >> 16) as u16,
    ];
    let mut image = [0; PZD];
    for (octets, word) in image.chunks_exact_mut(2).zip(words) {
        octets.copy_from_slice(&word.to_be_bytes());
    }
    image
}

/// The configurations of the GSD file: with or without parameter channel, 1…16 process words, consistent over the whole
/// length or by word (fact sheet, section 1.2).
fn accepted(identifiers: &[u8]) -> Option<IoLengths> {
    let words = match identifiers {
        [0xF3, words] | [words] => *words,
        _ => return None,
    };
    matches!(words, 0xF0..=0xFF | 0x70..=0x7F)
        .then(|| io_lengths(identifiers).ok())
        .flatten()
}

/// Passes process data on after a fixed number of module cycles.
#[derive(Debug, Clone)]
struct Delay {
    ring: [[u8; PZD]; MAX_DELAY],
    cycles: usize,
    next: usize,
}

impl Delay {
    fn new(cycles: usize) -> Self {
        Delay {
            ring: [[0; PZD]; MAX_DELAY],
            cycles: cycles.min(MAX_DELAY),
            next: 0,
        }
    }

    fn pass(&mut self, image: [u8; PZD]) -> [u8; PZD] {
        if self.cycles == 0 {
            return image;
        }
        let out = std::mem::replace(&mut self.ring[self.next], image);
        self.next = (self.next + 1) % self.cycles;
        out
    }
}

/// What the line does with the module: it is a DP slave.
impl Station for Emf2133 {
    fn handle_octets(&mut self, now: Instant, octets: &[u8]) {
        self.line_time = now;
        self.slave.handle_octets(now, octets);
    }

    fn handle_line_error(&mut self, now: Instant, error: LineError) {
        self.slave.handle_line_error(now, error);
    }

    fn handle_sent(&mut self, now: Instant) {
        self.slave.handle_sent(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.line_time = now;
        self.slave.handle_timeout(now);
    }

    fn poll_transmit(&mut self, now: Instant, buf: &mut [u8; MAX_TELEGRAM]) -> Option<usize> {
        self.slave.poll_transmit(now, buf)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.slave.poll_timeout()
    }
}

/// DP-V1 of the module: acyclic parameter access (9300 fact sheet, section 7). That both ways lead there, and two connections at a time, is
/// assumed.
const V1_CAPABILITIES: V1Capabilities = V1Capabilities {
    c1_read_write: Support::Supported,
    c2_connections: 2,
    ..V1Capabilities::NONE
};
/// Highest value of C1883: no additional time.
const C1883_OFF: f64 = 65_535.0;
/// User parameters the module takes; their meaning is not known (fact sheet, section 1.2).
const MAX_USER_PRM: usize = 237;
/// 40 octets each way: parameter channel and 16 words (fact sheet, section 1.1).
const MAX_IMAGE: usize = PAR + 2 * 16;
/// Longest process data delay, ms.
const MAX_DELAY: usize = 15;
/// Header of device-related diagnosis: three octets including itself.
const DEVICE_DIAGNOSIS: u8 = 0x03;
/// Channel of the counter-based noise that belongs to the processing times.
const JOB_CHANNEL: u64 = 0x6A_6F62;
