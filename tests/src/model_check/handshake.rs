//! The parameter handshake: `film_feed`'s block and `drivecom`'s server, with a bus between them that loses images.

use drivecom::param::{ErrorCode, Frame, Handshake as Level, JobKind, Server, ServerAction, ServerOptions};
use film_feed::block::{FilmFeedBlock, Inputs, Periphery};

use super::fingerprint::{Canon, fingerprint};
use super::search::{Cause, Finding, Model, Step};

/// What may happen beside an answer that takes its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// An image does not get through in a PLC cycle, in either direction: the old one stays.
    LostImage,
    /// The drive refuses a job.
    Refusal,
    /// The operator chooses another length.
    NewLength,
    /// Error_RESET in a cycle.
    ErrorReset,
    /// The drive's handshake is 1 at the beginning.
    BeginsSet,
    /// The drive is switched off and on; it answers with zeros then.
    PowerCycle,
    /// The slave's outputs are cleared in a cycle (start-up of the bus, Clear): the drive sees a request of zeros.
    Cleared,
    /// The drive takes a job and never answers.
    Swallowed,
}

impl Trouble {
    const fn bit(self) -> u16 {
        1 << self as u16
    }
}

/// A drive that is wrong on purpose; the search must tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveFlaw {
    /// It is as it should be.
    None,
    /// It carries a job out again when it sees the request again.
    RepeatsJobs,
    /// It answers before the job is done.
    AnswersEarly,
    /// It forgets every job that it refuses, instead of answering.
    ForgetsRefused,
}

/// The block, a bus and a drive.
///
/// A step is a PLC cycle: the block runs; its request gets to the drive or not; the drive takes a job, and ends it now or later, with
/// an answer or a refusal; its answer gets back or not. What else happens is chosen by [`Trouble`]. Any number of these may follow each
/// other.
///
/// Rules: the drive carries out exactly the job in work, once for each telegram that the block counts as done, with the data of the
/// moment its data were latched; and what the block stores of a read is the answer to it. Goal: a telegram counted as done that was
/// carried out. From every state there is a way there without any trouble.
///
/// What is left out:
/// - Data: two lengths (1200 and 1500 mm), one value for each constant, one reason to refuse.
/// - The process data stand still (ready to switch on): the parameter channel does not look at them.
/// - How long things take: a job may be open for any number of cycles, so every time is among them.
/// - The module polls several times in a PLC cycle, and images travel while the block runs: to the block this is an image that comes a
///   cycle later, which is "lost" and then got through.
#[derive(Debug, Clone, Copy)]
pub struct Handshake {
    name: &'static str,
    troubles: u16,
    flaw: DriveFlaw,
}

impl Handshake {
    /// With these troubles, under this name.
    pub const fn new(name: &'static str, troubles: &[Trouble]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < troubles.len() {
            bits |= troubles[i].bit();
            i += 1;
        }
        Self {
            name,
            troubles: bits,
            flaw: DriveFlaw::None,
        }
    }

    /// The same with a drive that is wrong.
    pub const fn with_flaw(mut self, flaw: DriveFlaw) -> Self {
        self.flaw = flaw;
        self
    }

    const fn has(self, trouble: Trouble) -> bool {
        self.troubles & trouble.bit() != 0
    }
}

/// Block, images and drive at the end of a PLC cycle.
#[derive(Debug, Clone)]
pub struct World {
    block: FilmFeedBlock,
    distance: i16,
    /// Parameter channel as the PLC's periphery holds it.
    inputs: [u8; 8],
    outputs: [u8; 8],
    /// The request that got to the drive last.
    request: [u8; 8],
    server: Server,
    /// The job the drive took will never be answered.
    swallowed: bool,
    /// The job the drive has belongs to a telegram that the block has left.
    overtaken: bool,
    /// A flaw's: the job in work was answered already.
    early: bool,
    watch: Watch,
}

/// What the rules need to know of the telegram in work.
#[derive(Debug, Clone, Copy, Default)]
struct Watch {
    /// Jobs the drive took and ended for it.
    taken: u8,
    done: u8,
    /// The last one that ended was refused.
    refused: bool,
    reset: Upset,
    restarted: Upset,
    cleared: Upset,
    /// Nothing was taken yet by a drive that begins with handshake 1.
    begins_set: bool,
    /// The data that were latched for it.
    latched: u32,
    /// A telegram was counted in this cycle, and the drive had carried it out.
    works: bool,
}

/// How far block and drive are from each other since something came between them: until an exchange was begun, taken and counted
/// whose beginning already knew of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Upset {
    #[default]
    Over,
    /// The drive has taken what the block asked for since; it is over once the block has counted that.
    Taken,
    /// The block has asked for something since.
    Asked,
    /// The block has read an answer of since.
    Seen,
    /// An answer of since has come to the PLC.
    Answered,
    /// Nothing of since has come.
    Open,
}

impl Upset {
    fn on(&mut self, from: Self, to: Self) {
        if *self == from {
            *self = to;
        }
    }

    fn answered(&mut self) {
        self.on(Self::Open, Self::Answered);
    }

    fn seen(&mut self) {
        self.on(Self::Answered, Self::Seen);
    }

    fn asked(&mut self) {
        self.on(Self::Seen, Self::Asked);
    }

    fn taken(&mut self) {
        self.on(Self::Asked, Self::Taken);
    }

    fn counted(&mut self) {
        self.on(Self::Taken, Self::Over);
        // The drive has not taken it: the next one may be.
        self.on(Self::Asked, Self::Seen);
    }

    fn is_over(self) -> bool {
        self == Self::Over
    }
}

impl Watch {
    fn upsets(&mut self) -> [&mut Upset; 3] {
        [&mut self.reset, &mut self.restarted, &mut self.cleared]
    }

    /// Where it is documented that the answer counts for a request it does not belong to.
    fn answer_excuse(&self) -> Option<&'static str> {
        if !self.restarted.is_over() || !self.cleared.is_over() {
            Some(POINT_9)
        } else {
            (!self.reset.is_over()).then_some(POINT_7)
        }
    }

    /// Where it is documented that the drive takes a request again, or one that the block has left.
    fn request_excuse(&self) -> Option<&'static str> {
        if !self.restarted.is_over() || !self.cleared.is_over() {
            Some(TAKEN_AGAIN)
        } else {
            (!self.reset.is_over()).then_some(POINT_7)
        }
    }
}

/// The two lengths an operator chooses, 1/10 mm.
const LENGTHS: [i16; 2] = [12_000, 15_000];
/// Periphery address of the process data; any will do.
const PZD: u16 = 0x0118;
/// Why the drive refuses (9300 fact sheet, section 3.3).
const REFUSAL: ErrorCode = ErrorCode::NOT_EXECUTABLE;

const LOST: &str = "a telegram counts as done that the drive never got";
const DOUBLED: &str = "the drive carried a telegram out twice";
const WRONG_JOB: &str = "the drive was given another job than the one in work";
const WRONG_DATA: &str = "the drive was given other data than those latched";
const WRONG_ANSWER: &str = "what the block stored is not what the drive answered";
const UNNOTICED: &str = "a refused parameter goes unnoticed";
const ERROR_AS_DATA: &str = "an error code is taken for a constant";

/// Film-feed specification, section 8.1 and 9300 fact sheet, section 9.1.
const POINT_7: &str = "8.1 point 7: a reset during a handshake loses a telegram of that round";
const POINT_8: &str = "8.1 point 8: a drive that begins with handshake 1 makes telegram 0 count as done";
const POINT_8_HANGS: &str = "8.1 point 8: a swallowed request hangs for ever";
const POINT_9: &str = "8.1 point 9: an image that falls to 0 while handshake 0 is awaited is taken as data 0";
/// `docs/spec-notes.md`.
const TAKEN_AGAIN: &str = "spec notes: a request that still stands after a restart or cleared outputs is taken again";
const FACTS_9_1: &str = "fact sheet 9.1: errors taken as data, rejected writes unnoticed";

impl Handshake {
    fn begin(self) -> World {
        let server = server(self.level());
        World {
            block: FilmFeedBlock::new(),
            distance: LENGTHS[0],
            inputs: server.answer().0,
            outputs: [0; 8],
            request: [0; 8],
            server,
            swallowed: false,
            overtaken: false,
            early: false,
            watch: Watch {
                begins_set: self.has(Trouble::BeginsSet),
                ..Watch::default()
            },
        }
    }

    const fn level(self) -> Level {
        if self.has(Trouble::BeginsSet) {
            Level::Set
        } else {
            Level::Clear
        }
    }

    /// The block's part of a cycle.
    fn plc_cycle(self, world: &mut World, reset: bool) -> Vec<Finding> {
        let mut inputs = Inputs {
            pzd_adr: PZD,
            enable: true,
            velocity: 10_000,
            mark_velocity: 2_000,
            acceleration: 10_000,
            distance: world.distance,
            error_reset: reset,
            ..Inputs::default()
        };
        let at_work = at_work(&world.block);
        let mut images = Images {
            inputs: &world.inputs,
            outputs: &mut world.outputs,
        };
        world.block.cycle(&mut inputs, &mut images);
        let fired = world.block.fired();
        let watch = &mut world.watch;
        watch.works = false;
        if reset {
            watch.reset = Upset::Open;
        }
        if fired.fired(1) {
            // The first telegram is in work now, whatever was before.
            (watch.taken, watch.done, watch.refused) = (0, 0, false);
            world.overtaken = world.server.running().is_some();
        }
        if fired.fired(5) || fired.fired(6) {
            watch.upsets().into_iter().for_each(Upset::asked);
        }
        if fired.fired(13) {
            watch.upsets().into_iter().for_each(Upset::seen);
        }
        // T4 latches the data of the telegram it is about; T1 and T2 of the same cycle have chosen that.
        if fired.fired(4)
            && let Some(telegram) = self::at_work(&world.block)
        {
            watch.latched = written(telegram, world.distance);
        }
        if fired.fired(12)
            && let Some(telegram) = at_work
        {
            return self.counted(world, telegram).into_iter().collect();
        }
        Vec::new()
    }

    /// The block counts this telegram as done.
    fn counted(self, world: &mut World, telegram: usize) -> Option<Finding> {
        let watch = world.watch;
        let is_read = telegram >= FIRST_READ;
        let stored = world.block.telegrams()[telegram].data;
        let finding = if watch.done == 0 {
            let documented = if watch.begins_set {
                Some(POINT_8)
            } else {
                watch.answer_excuse()
            };
            Some(Finding { what: LOST, documented })
        } else if is_read && watch.refused && stored == u32::from_be_bytes(REFUSAL.to_data()) {
            let documented = Some(FACTS_9_1);
            Some(Finding {
                what: ERROR_AS_DATA,
                documented,
            })
        } else if is_read && stored != constant(telegram) {
            Some(Finding {
                what: WRONG_ANSWER,
                documented: watch.answer_excuse(),
            })
        } else if !is_read && watch.refused {
            let documented = Some(FACTS_9_1);
            Some(Finding {
                what: UNNOTICED,
                documented,
            })
        } else {
            None
        };
        let mut next = Watch {
            works: watch.done > 0,
            reset: watch.reset,
            restarted: watch.restarted,
            cleared: watch.cleared,
            ..Watch::default()
        };
        next.upsets().into_iter().for_each(Upset::counted);
        world.watch = next;
        world.overtaken = world.server.running().is_some();
        finding
    }

    /// The drive's part of a cycle.
    fn drive_cycle(self, world: &mut World, end: End) -> Vec<Finding> {
        let mut findings = Vec::new();
        let request = Frame(world.request);
        let idle = world.server.running().is_none();
        if self.flaw == DriveFlaw::RepeatsJobs && idle && world.watch.done > 0 {
            // As if the level of the handshake were new again.
            world.server = server(match request.service().handshake() {
                true => Level::Clear,
                false => Level::Set,
            });
        }
        if let ServerAction::Start(job) = world.server.poll(&request) {
            let telegram = at_work(&world.block);
            let asked = telegram.and_then(|number| world.block.telegrams().get(number));
            let is_asked = asked.is_some_and(|asked| {
                asked.index == job.code.index()
                    && asked.subindex == job.subcode.0
                    && (asked.service & 0x0F) == job.kind.code()
            });
            let watch = &mut world.watch;
            let documented = watch.request_excuse();
            if !is_asked {
                findings.push(Finding {
                    what: WRONG_JOB,
                    documented,
                });
            } else if job.kind == JobKind::Write && job.value as u32 != watch.latched {
                findings.push(Finding {
                    what: WRONG_DATA,
                    documented,
                });
            }
            watch.taken = (watch.taken + 1).min(2);
            if watch.taken > 1 {
                findings.push(Finding {
                    what: DOUBLED,
                    documented,
                });
            }
            watch.begins_set = false;
            if is_asked {
                watch.upsets().into_iter().for_each(Upset::taken);
            }
            world.swallowed = end == End::Never;
            world.overtaken = false;
            world.early = self.flaw == DriveFlaw::AnswersEarly;
            if world.early {
                world.server.complete(Ok(0));
            }
        }
        self.end_job(world, end);
        findings
    }

    fn end_job(self, world: &mut World, end: End) {
        if world.early {
            if end == End::Done {
                world.early = false;
                world.watch.done = (world.watch.done + 1).min(2);
            }
            return;
        }
        let Some(job) = world.server.running().filter(|_| !world.swallowed) else {
            return;
        };
        let result = match end {
            End::Later | End::Never => return,
            End::Done => Ok(match job.kind {
                JobKind::Write => job.value,
                JobKind::Read => read(job.code.number()),
            }),
            End::Refused if self.flaw == DriveFlaw::ForgetsRefused => {
                world.swallowed = true;
                return;
            }
            End::Refused => Err(REFUSAL),
        };
        if !world.overtaken {
            world.watch.done = (world.watch.done + 1).min(2);
            world.watch.refused = result.is_err();
        }
        world.server.complete(result);
    }

    /// Everything the bus and the drive can do after the block's cycle.
    fn bus_and_drive(self, label: &str, cause: Cause, world: &World, findings: &[Finding]) -> Vec<Step<World>> {
        let lossy = self.has(Trouble::LostImage);
        let mut ways_out = vec![("", world.outputs, Cause::Undisturbed)];
        if lossy && world.outputs != world.request {
            ways_out.push(("request lost", world.request, Cause::Disturbed));
        }
        if self.has(Trouble::Cleared) {
            ways_out.push(("outputs cleared", [0; 8], Cause::Disturbed));
        }
        let mut ends = vec![
            ("drive works", End::Later, Cause::Undisturbed),
            ("", End::Done, Cause::Undisturbed),
        ];
        if self.has(Trouble::Refusal) {
            ends.push(("drive refuses", End::Refused, Cause::Disturbed));
        }
        if self.has(Trouble::Swallowed) {
            ends.push(("drive swallows the job", End::Never, Cause::Disturbed));
        }
        let mut steps = Vec::new();
        for (out, request, out_cause) in ways_out {
            for &(what, end, end_cause) in &ends {
                let mut next = world.clone();
                next.request = request;
                if out == "outputs cleared" {
                    next.watch.cleared = Upset::Open;
                }
                let mut found = findings.to_vec();
                found.extend(self.drive_cycle(&mut next, end));
                let answer = next.server.answer().0;
                let ways_back = [
                    ("", answer, Cause::Undisturbed),
                    ("answer lost", next.inputs, Cause::Disturbed),
                ];
                let count = if lossy && answer != next.inputs { 2 } else { 1 };
                for &(back, inputs, back_cause) in &ways_back[..count] {
                    let mut next = next.clone();
                    next.inputs = inputs;
                    if back.is_empty() {
                        next.watch.upsets().into_iter().for_each(Upset::answered);
                    }
                    let parts = [label, out, what, back];
                    let parts: Vec<_> = parts.into_iter().filter(|part| !part.is_empty()).collect();
                    let undisturbed = [cause, out_cause, end_cause, back_cause] == [Cause::Undisturbed; 4];
                    steps.push(Step {
                        label: format!("{}{}", parts.join(", "), says(&next)),
                        cause: if undisturbed {
                            Cause::Undisturbed
                        } else {
                            Cause::Disturbed
                        },
                        state: next,
                        findings: found.clone(),
                    });
                }
                if next.server.running().is_none() && world.server.running().is_none() && world.server == next.server {
                    // Nothing was asked: there is nothing to end.
                    break;
                }
            }
        }
        steps
    }
}

impl Model for Handshake {
    type State = World;

    fn name(&self) -> String {
        self.name.to_owned()
    }

    fn initial(&self) -> Vec<Step<World>> {
        let state = self.begin();
        vec![Step {
            label: format!("power-up{}", says(&state)),
            cause: Cause::Undisturbed,
            state,
            findings: Vec::new(),
        }]
    }

    fn steps(&self, state: &World) -> Vec<Step<World>> {
        let mut before = vec![(String::new(), Cause::Undisturbed, state.clone())];
        if self.has(Trouble::NewLength) {
            let mut other = state.clone();
            other.distance = LENGTHS[usize::from(state.distance == LENGTHS[0])];
            before.push(("new length".to_owned(), Cause::Disturbed, other));
        }
        if self.has(Trouble::PowerCycle) {
            let mut other = state.clone();
            other.server = server(self.level());
            other.request = [0; 8];
            (other.swallowed, other.early, other.overtaken) = (false, false, false);
            other.watch.taken = 0;
            other.watch.restarted = Upset::Open;
            other.watch.begins_set = self.has(Trouble::BeginsSet);
            before.push(("drive off and on".to_owned(), Cause::Disturbed, other));
        }
        let mut steps = Vec::new();
        for (label, cause, world) in before {
            for reset in [false, true] {
                if reset && !self.has(Trouble::ErrorReset) {
                    continue;
                }
                let mut next = world.clone();
                let findings = self.plc_cycle(&mut next, reset);
                let fired: Vec<_> = next.block.fired().iter().map(|number| format!("T{number}")).collect();
                let block = if reset {
                    "Error_RESET".to_owned()
                } else {
                    fired.join(" ")
                };
                let label = if label.is_empty() {
                    block
                } else {
                    format!("{label}, {block}")
                };
                let cause = if reset { Cause::Disturbed } else { cause };
                steps.extend(self.bus_and_drive(&label, cause, &next, &findings));
            }
        }
        steps
    }

    fn key(&self, state: &World) -> u128 {
        let canon = Canon {
            ignored: &[("ParameterNet", "fired")],
            deadlines: &[],
            now_ns: 0,
            horizon_ns: 0,
        };
        fingerprint(state, canon, &mut String::new())
    }

    fn is_goal(&self, state: &World) -> bool {
        state.watch.works
    }

    fn excuse(&self, state: &World) -> Option<&'static str> {
        (state.swallowed && self.has(Trouble::Swallowed)).then_some(POINT_8_HANGS)
    }
}

/// How the drive goes on with the job it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Later,
    Done,
    Refused,
    Never,
}

struct Images<'a> {
    inputs: &'a [u8; 8],
    outputs: &'a mut [u8; 8],
}

impl Periphery for Images<'_> {
    fn dprd_dat(&mut self, address: u16, record: &mut [u8; 8]) -> bool {
        // Status "ready to switch on"; no position, no speed.
        *record = if address == PZD {
            [0, 1, 0, 0, 0, 0, 0, 0]
        } else {
            *self.inputs
        };
        true
    }

    fn dpwr_dat(&mut self, address: u16, record: &[u8; 8]) -> bool {
        if address != PZD {
            *self.outputs = *record;
        }
        true
    }
}

/// Which of the seven telegrams is in work.
fn at_work(block: &FilmFeedBlock) -> Option<usize> {
    Some(usize::from(block.telegram_pointer().checked_sub(22)?) / 8)
}

/// The first of the seven that reads (film-feed specification, section 8 step 11).
const FIRST_READ: usize = 4;

/// What the block sends with a write, in ten-thousandths: 100 %, 20 %, 100 %, the length (film-feed specification, section 8
/// step 11: velocities and acceleration × 100, distance × 1000).
fn written(telegram: usize, distance: i16) -> u32 {
    match telegram {
        0 | 2 => 1_000_000,
        1 => 200_000,
        _ => u32::from(distance.unsigned_abs()) * 1_000,
    }
}

/// What the drive answers (9300 fact sheet, section 3.2: 179.0708, 7 and 1).
fn read(code: u16) -> i32 {
    match code {
        1204 => 1_790_708,
        1202 => 70_000,
        _ => 10_000,
    }
}

fn constant(telegram: usize) -> u32 {
    const CODES: [u16; 3] = [1204, 1202, 1203];
    read(CODES[telegram - FIRST_READ]).unsigned_abs()
}

fn server(initial_handshake: Level) -> Server {
    Server::new(ServerOptions {
        initial_handshake,
        ..ServerOptions::default()
    })
}

/// Where both stand.
fn says(world: &World) -> String {
    let level = |octets: &[u8; 8]| u8::from(Frame(*octets).service().handshake());
    let work = if world.server.running().is_some() {
        ", drive at work"
    } else {
        ""
    };
    format!(
        "; telegram {}, {}, request {} answer {}{work}",
        at_work(&world.block).map_or_else(|| "-".to_owned(), |number| number.to_string()),
        world.block.marking().places(),
        level(&world.outputs),
        level(&world.inputs),
    )
}
