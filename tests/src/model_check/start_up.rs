//! The start-up: `dp_master`'s master and slave together, through every loss and every restart.

use dp_master::address::Address;
use dp_master::dp::{
    AcceptedConfigurations, DpMaster, DpSlave, MasterConfig, Mode, SlaveConfig, SlaveEvent, SlaveIdentity, SlaveIndex,
    SlavePhase, SlaveState, Watchdog,
};
use dp_master::fdl::BusParams;
use dp_master::time::{BitTimes, Duration};
use dp_master::wire::{Decoded, Decoder, Fcb, FunctionCode, RequestFunction, Telegram};

use super::fingerprint::{Canon, fingerprint};
use super::line::{BAUD, Fate, Line, OnLine, Party};
use super::search::{Cause, Finding, Model, Step};

const MASTER: u8 = 0;
const SLAVE: u8 = 3;
const IDENT: u16 = 0x00DA;
/// One octet each way.
const CONFIGURATION: &[u8] = &[0x30];
const USER_PRM: [u8; 2] = [0x5A, 0xA5];
/// Pause of the master before it tries again.
const RETRY_INTERVAL: Duration = Duration::from_millis(20);
/// Process data alternate: what is one exchange late is seen.
const ROUND: u8 = 2;

/// The watchdog the master sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchdogChoice {
    /// None: a slave stays in data exchange until it hears something else.
    Off,
    /// 10 ms: it is over before the master, after its pause of 20 ms, asks again.
    Short,
    /// 50 ms: the master asks again before it is over.
    Long,
}

/// A slave that is wrong on purpose; the search must tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlaveFlaw {
    /// It is as it should be.
    None,
    /// It takes every request for a new one, as if it did not know the frame count bit.
    TakesRepetitionsForNew,
    /// It does not listen to Set_Prm in data exchange.
    KeepsItsParameters,
}

/// A master of class 1 and its slave, from power-up on.
///
/// A step is a telegram: it is delivered, lost, spoiled, doubled; or the slave is switched off and on, or the master restarted, while
/// it is on the line. So timeouts come by themselves: they are what the machines do when nothing arrives. Any number of these may
/// follow each other. All times are those of the real machines at 500 kbit/s.
///
/// Rules: Set_Prm and Chk_Cfg are carried out once in a start-up; the master begins to exchange with a slave that has carried out
/// both; a slave in data exchange has exactly the parameters that were sent; an exchange the master counts was carried out exactly
/// once, with its own outputs and inputs. Goal: an exchange that was counted. From every state an undisturbed line leads there.
///
/// What is left out:
/// - One master, one slave, one octet each way; nobody else is looked for (HSA is the master's own address), no acyclic jobs.
/// - The token and what the master says to itself are not disturbed: nobody else listens.
/// - Ttr is one bit time, so that the token goes round once in a cycle; else its phase would multiply the states and change nothing.
/// - A restart takes no time; a longer one is a restart and telegrams lost.
/// - An answer later than the slot time is not modelled: it meets the master's repetition, which is "spoiled" for both.
/// - Moments more than 10 ms ago are alike: no rule of the machines looks back that far (the longest telegram takes 5.6 ms).
/// - Counters, measured times and buffers that are written before they are read do not count (`IGNORED`).
#[derive(Debug, Clone, Copy)]
pub struct StartUp {
    watchdog: WatchdogChoice,
    flaw: SlaveFlaw,
}

impl StartUp {
    /// The real machines with this watchdog.
    pub const fn new(watchdog: WatchdogChoice) -> Self {
        Self {
            watchdog,
            flaw: SlaveFlaw::None,
        }
    }

    /// The same with a slave that is wrong.
    pub const fn with_flaw(mut self, flaw: SlaveFlaw) -> Self {
        self.flaw = flaw;
        self
    }

    fn watchdog(self) -> Option<Watchdog> {
        let ten_ms = match self.watchdog {
            WatchdogChoice::Off => return None,
            WatchdogChoice::Short => 1,
            WatchdogChoice::Long => 5,
        };
        Watchdog::from_factors(1, ten_ms)
    }

    fn master(self) -> (DpMaster<1>, SlaveIndex) {
        let params = BusParams {
            hsa: address(MASTER),
            t_tr: BitTimes(1),
            gap_factor: 1,
            ..BusParams::standard(BAUD)
        };
        let mut config = MasterConfig::new(address(MASTER), params);
        config.retry_interval = RETRY_INTERVAL;
        let mut master =
            DpMaster::new(config).unwrap_or_else(|error| unreachable!("these parameters are valid: {error}"));
        let mut slave = SlaveConfig::new(address(SLAVE), IDENT, CONFIGURATION)
            .unwrap_or_else(|error| unreachable!("these identifiers are valid: {error}"))
            .with_user_prm(&USER_PRM)
            .unwrap_or_else(|error| unreachable!("two octets fit: {error}"));
        slave.watchdog = self.watchdog();
        let index = master
            .add_slave(slave)
            .unwrap_or_else(|error| unreachable!("the first slave fits: {error}"));
        master.set_mode(Mode::Operate);
        (master, index)
    }
}

fn address(value: u8) -> Address {
    Address::new(value).unwrap_or(Address::BROADCAST)
}

fn slave() -> DpSlave {
    let accepted = AcceptedConfigurations::Table(&[CONFIGURATION]);
    let identity = SlaveIdentity::new(address(SLAVE), IDENT, BAUD, accepted);
    let mut slave = DpSlave::new(identity).unwrap_or_else(|error| unreachable!("this identity is valid: {error}"));
    slave.set_inputs(&[0]);
    slave
}

/// Master, slave, and who watches them.
#[derive(Debug, Clone)]
pub struct World {
    line: Line,
    index: SlaveIndex,
    /// What is on the line now; `None` when nobody speaks any more.
    telegram: Option<OnLine>,
    watch: Watch,
    /// Not part of the state: how many there were so far.
    counted: u64,
    carried_out: u64,
}

/// What the rules need to know of the past.
#[derive(Debug, Clone, Copy, Default)]
struct Watch {
    /// Carried out by this slave in this start-up of the master.
    set_prm: u8,
    chk_cfg: u8,
    /// Exchanges carried out since the last one that was counted.
    exchanges: u8,
    /// The master exchanges with it.
    exchanging: bool,
    /// Inputs of the last exchange that was carried out.
    given: u8,
    /// The last step ended with an exchange counted.
    works: bool,
}

const PRM_TWICE: &str = "Set_Prm carried out twice in one start-up";
const CFG_TWICE: &str = "Chk_Cfg carried out twice in one start-up";
const NOT_STARTED: &str = "the master exchanges with a slave that has not carried out Set_Prm and Chk_Cfg";
const FOREIGN: &str = "a slave in data exchange with other parameters than those sent";
const LOST: &str = "an exchange was counted that was not carried out";
const TWICE: &str = "an exchange was carried out twice";
const OUTPUTS: &str = "an exchange was carried out with other outputs than the master's";
const INPUTS: &str = "the master took inputs that are not those of this exchange";

fn violation(what: &'static str) -> Finding {
    Finding { what, documented: None }
}

impl StartUp {
    /// Looks at both machines after something has happened to them.
    fn look(self, world: &mut World) -> Vec<Finding> {
        let mut findings = Vec::new();
        let World {
            line,
            index,
            watch,
            counted,
            carried_out,
            ..
        } = world;
        while let Some(event) = line.slave.poll_event() {
            match event {
                SlaveEvent::Parametrised { .. } => watch.set_prm = (watch.set_prm + 1).min(2),
                SlaveEvent::Configured { .. } => watch.chk_cfg = (watch.chk_cfg + 1).min(2),
                _ => {}
            }
        }
        if watch.set_prm > 1 {
            findings.push(violation(PRM_TWICE));
        }
        if watch.chk_cfg > 1 {
            findings.push(violation(CFG_TWICE));
        }
        if line.slave.phase() == SlavePhase::DataExchange && !self.is_ours(&line.slave) {
            findings.push(violation(FOREIGN));
        }
        let by_slave = line.slave.statistics().exchanges;
        if by_slave > *carried_out {
            watch.exchanges = (watch.exchanges + (by_slave - *carried_out).min(2) as u8).min(2);
            *carried_out = by_slave;
            if line.slave.outputs() != line.master.outputs(*index) {
                findings.push(violation(OUTPUTS));
            }
            // Answered with these; the next exchange gets the next ones.
            let next = (watch.given + 1) % ROUND;
            watch.given = next;
            line.slave.set_inputs(&[(next + 1) % ROUND]);
        }
        if watch.exchanges > 1 {
            findings.push(violation(TWICE));
        }

        while line.master.poll_event().is_some() {}
        let state = line.master.state(*index);
        if state == SlaveState::DataExchange && !watch.exchanging && (watch.set_prm, watch.chk_cfg) != (1, 1) {
            findings.push(violation(NOT_STARTED));
        }
        watch.exchanging = state == SlaveState::DataExchange;
        if !watch.exchanging {
            watch.exchanges = 0;
        }
        if matches!(state, SlaveState::Offline | SlaveState::Refused) {
            (watch.set_prm, watch.chk_cfg) = (0, 0);
        }
        let by_master = line.master.exchanges(*index);
        if by_master > *counted {
            *counted = by_master;
            watch.works = true;
            if watch.exchanges == 0 {
                findings.push(violation(LOST));
            }
            watch.exchanges = 0;
            if line.master.inputs(*index) != [watch.given] {
                findings.push(violation(INPUTS));
            }
            let outputs = line.master.outputs(*index).first().copied().unwrap_or_default();
            // The length is the configured one.
            let _ = line.master.set_outputs(*index, &[(outputs + 1) % ROUND]);
        }
        findings
    }

    /// Whether a slave has what the master sent it.
    fn is_ours(self, slave: &DpSlave) -> bool {
        slave.master() == Some(address(MASTER))
            && slave.configuration() == CONFIGURATION
            && slave.user_prm() == USER_PRM
            && slave.watchdog() == self.watchdog()
    }

    /// Until somebody speaks whose telegram may be disturbed.
    fn go_on(self, world: &mut World) -> Vec<Finding> {
        let mut findings = Vec::new();
        loop {
            world.telegram = world.line.next_telegram();
            findings.extend(self.look(world));
            match &world.telegram {
                Some(telegram) if !is_disturbable(telegram) => {
                    world.line.carry(telegram, Fate::Delivered);
                    findings.extend(self.look(world));
                }
                _ => return findings,
            }
        }
    }

    fn carry(self, world: &mut World, fate: Fate) -> Vec<Finding> {
        let Some(mut telegram) = world.telegram.take() else {
            return Vec::new();
        };
        let mut fate = fate;
        if telegram.from == Party::Master {
            match self.flaw {
                SlaveFlaw::None => {}
                SlaveFlaw::TakesRepetitionsForNew => first_contact(&mut telegram.octets),
                SlaveFlaw::KeepsItsParameters => {
                    let is_prm = request(&telegram.octets).is_some_and(|(_, dsap)| dsap == Some(61));
                    if is_prm && world.line.slave.phase() == SlavePhase::DataExchange {
                        fate = Fate::Lost;
                    }
                }
            }
        }
        world.line.carry(&telegram, fate);
        self.look(world)
    }
}

impl Model for StartUp {
    type State = World;

    fn name(&self) -> String {
        let name = match self.watchdog {
            WatchdogChoice::Off => "start-up",
            WatchdogChoice::Short => "start-up-short",
            WatchdogChoice::Long => "start-up-long",
        };
        name.to_owned()
    }

    fn initial(&self) -> Vec<Step<World>> {
        let (master, index) = self.master();
        let mut slave = slave();
        slave.set_inputs(&[1]);
        let mut world = World {
            line: Line {
                now: dp_master::time::Instant::ZERO,
                master,
                slave,
            },
            index,
            telegram: None,
            watch: Watch::default(),
            counted: 0,
            carried_out: 0,
        };
        let findings = self.go_on(&mut world);
        vec![Step {
            label: format!("power-up; {}", says(&world)),
            cause: Cause::Undisturbed,
            state: world,
            findings,
        }]
    }

    fn steps(&self, state: &World) -> Vec<Step<World>> {
        let mut steps = Vec::new();
        if state.telegram.is_none() {
            return steps;
        }
        let mut step = |what: &str, cause, happens: &dyn Fn(&mut World) -> Vec<Finding>| {
            let mut world = state.clone();
            world.watch.works = false;
            let mut findings = happens(&mut world);
            findings.extend(self.go_on(&mut world));
            steps.push(Step {
                label: format!("{what}; {}", says(&world)),
                cause,
                state: world,
                findings,
            });
        };
        step("delivered", Cause::Undisturbed, &|world| {
            self.carry(world, Fate::Delivered)
        });
        for (what, fate) in [
            ("lost", Fate::Lost),
            ("spoiled", Fate::Spoiled),
            ("doubled", Fate::Doubled),
        ] {
            step(what, Cause::Disturbed, &|world| self.carry(world, fate));
        }
        step("slave off and on", Cause::Disturbed, &|world| {
            world.line.slave = slave();
            world.line.slave.set_inputs(&[1]);
            world.carried_out = 0;
            world.watch = Watch {
                exchanging: world.watch.exchanging,
                ..Watch::default()
            };
            self.carry(world, Fate::Lost)
        });
        step("master restarted", Cause::Disturbed, &|world| {
            let findings = match &world.telegram {
                // Its own telegram is cut off.
                Some(telegram) if telegram.from == Party::Master => Vec::new(),
                _ => self.carry(world, Fate::Lost),
            };
            (world.line.master, world.index) = self.master();
            world.counted = 0;
            world.watch = Watch {
                given: world.watch.given,
                ..Watch::default()
            };
            findings
        });
        steps
    }

    fn key(&self, state: &World) -> u128 {
        let canon = Canon {
            ignored: IGNORED,
            deadlines: DEADLINES,
            now_ns: state.line.now.as_nanos(),
            horizon_ns: 10_000_000,
        };
        fingerprint(&(&state.line, &state.telegram, state.watch), canon, &mut String::new())
    }

    fn is_goal(&self, state: &World) -> bool {
        state.watch.works && state.line.slave.phase() == SlavePhase::DataExchange
    }

    fn excuse(&self, _state: &World) -> Option<&'static str> {
        None
    }
}

/// Counters and measured times; `now`, for all moments are counted from it; a buffer that is written before it is read; and what only
/// Auto_Clear, a repeated Global_Control or a GAP asks for, none of which there is.
const IGNORED: &[(&str, &str)] = &[
    ("Line", "now"),
    ("Core", "statistics"),
    ("Cyclic", "statistics"),
    ("Cyclic", "cycles_total"),
    ("TokenTime", "last"),
    ("TokenTime", "longest"),
    ("EventQueue", "first"),
    ("SlaveHandler", "exchanges"),
    ("SlaveHandler", "silent_since"),
    ("Device", "exchanges"),
    ("Device", "scratch"),
    ("Cyclic", "announced"),
    ("Gap", "not_before"),
];

/// Moments that are only compared with now.
const DEADLINES: &[(&str, &str)] = &[("SlaveHandler", "due")];

/// A token and a question for a newcomer are heard by nobody who would act on them.
fn is_disturbable(telegram: &OnLine) -> bool {
    telegram.from == Party::Slave
        || request(&telegram.octets).is_some_and(|(function, _)| function != RequestFunction::FdlStatus)
}

/// Function and access point of a request.
fn request(octets: &[u8]) -> Option<(RequestFunction, Option<u8>)> {
    let mut found = None;
    Decoder::new().push(octets, |decoded| {
        if let Decoded::Telegram(Telegram::Data { header, .. }) = decoded
            && let FunctionCode::Request { function, .. } = header.fc
        {
            found = Some((function, header.dsap));
        }
    });
    found
}

/// The same request with the frame count bit of first contact.
fn first_contact(octets: &mut Vec<u8>) {
    let mut rewritten = None;
    Decoder::new().push(octets, |decoded| {
        if let Decoded::Telegram(Telegram::Data { mut header, data }) = decoded
            && let FunctionCode::Request { fcb, function } = header.fc
            && fcb != Fcb::Inactive
        {
            header.fc = FunctionCode::request(Fcb::First, function);
            let mut buffer = [0; 255];
            if let Ok(length) = (Telegram::Data { header, data }).encode(&mut buffer) {
                rewritten = Some(buffer[..length].to_vec());
            }
        }
    });
    if let Some(rewritten) = rewritten {
        *octets = rewritten;
    }
}

/// Who says what now, and where both stand.
fn says(world: &World) -> String {
    let stand = format!(
        "master {:?}, slave {:?}",
        world.line.master.state(world.index),
        world.line.slave.phase()
    );
    match &world.telegram {
        None => format!("{stand}; silence for ever"),
        Some(telegram) => {
            let what = match (telegram.from, request(&telegram.octets)) {
                (Party::Slave, _) => "the slave answers".to_owned(),
                (Party::Master, Some((_, Some(60)))) => "Slave_Diag".to_owned(),
                (Party::Master, Some((_, Some(61)))) => "Set_Prm".to_owned(),
                (Party::Master, Some((_, Some(62)))) => "Chk_Cfg".to_owned(),
                (Party::Master, Some((_, Some(58)))) => "Global_Control".to_owned(),
                (Party::Master, Some((_, None))) => "Data_Exchange".to_owned(),
                (Party::Master, other) => format!("{other:?}"),
            };
            format!("{stand}; {what} …")
        }
    }
}
