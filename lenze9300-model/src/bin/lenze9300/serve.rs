//! `lenze9300 serve`: the drive with its bus module, its system bus or both, in real time.

use std::convert::Infallible;
use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration as StdDuration, Instant as StdInstant};

use clap::Args;
use dp_master::driver::Driver;
use dp_master::phy::{PortName, ReopeningPort, SerialOptions, Transmitter, request_real_time};
use dp_master::time::{Baud, Duration};
use lenze9300_model::bus::can_port::CanPortName;
use lenze9300_model::bus::dp::{Emf2133, Emf2133Config, IDENT};
use lenze9300_model::code::table::number::C0350;
use lenze9300_model::code::{CodeStore, Inhibit, read_parameter_file};
use lenze9300_model::device::{Drive, DriveConfig, NonVolatile, SetNumber, read_state_file};
use lenze9300_model::traverse::ProgramFile;
use lenze9300_model::{FileError, TICK_NS, TICKS_PER_MS};

use crate::operator::{Operator, Order};
use crate::reader::MarkReader;
use crate::scope_orders::{ScopeDesk, ScopeOrder};
use crate::state::StateKeeper;
use crate::system_bus::SystemBus;

/// What `lenze9300 serve` takes.
#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// Line to answer on: a serial device, or tcp://host:port of a serial-device server.
    #[arg(long, value_name = "PATH", required_unless_present_any = ["pty", "can"], conflicts_with = "pty")]
    port: Option<PortName>,
    /// Make a pseudo-terminal, link it here and answer on it.
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// CAN port of the system bus: an interface such as can0, or slcan:/dev/ttyACM0@500, slcan:tcp://host:4001@500.
    #[arg(long, value_name = "PORT")]
    can: Option<CanPortName>,
    /// Node address on the system bus, 1…63; C0350 if not given.
    #[arg(long, value_name = "N", requires = "can", value_parser = clap::value_parser!(u8).range(1..=63))]
    node: Option<u8>,
    /// Who switches the RS485 transmitter: adapter, rts or kernel, also as rts-inverted, and with delays in ms as rts:1:1.
    #[arg(long, value_name = "HOW", default_value = "adapter", requires = "port")]
    rs485: Transmitter,
    /// Ask for real-time priority; a note says if it is refused.
    #[arg(long)]
    real_time: bool,
    /// Baud rate in bit/s, one of the ten of PROFIBUS.
    #[arg(long, value_name = "RATE", default_value = "1500000")]
    baud: Baud,
    /// Station address, 0…125.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(0..=125))]
    address: u8,
    /// Ident number the module answers with, such as 0x00DA.
    #[arg(long, value_name = "HEX", default_value_t = format!("0x{IDENT:04X}"))]
    ident: String,
    /// Distance of the print marks that a reader at E1 sees, 200.0…2000.0 mm; 0 = no reader.
    #[arg(long, value_name = "MM", default_value = "1200", value_parser = parse_mark_distance)]
    marks_every: i32,
    /// Traversing program, TOML; the film feed's if there is none. Its codes go into parameter set 1.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// Codes for parameter set 1, TOML.
    #[arg(long, value_name = "FILE")]
    codes: Option<PathBuf>,
    /// What the drive keeps without supply: saved parameter sets, fault memory, hours. Read at the start if it is there, written
    /// whenever a set is saved or a fault remembered.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Seed of the module's processing times.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// Gaps an operating system makes inside a telegram are no end of it.
const LATENCY: Duration = Duration::from_millis(20);

/// Answers until the process is ended. A port that is gone is waited for; the drive runs on without a bus.
pub(crate) fn serve(args: &ServeArgs) -> Result<Infallible, String> {
    let config = Emf2133Config {
        address: args.address,
        ident: parse_ident(&args.ident)?,
        seed: args.seed,
        latency_allowance: LATENCY,
        ..Emf2133Config::default()
    };
    let (drive, keeper) = power_up(args)?;
    if args.real_time
        && let Err(refused) = request_real_time()
    {
        note(&refused);
    }
    let line = match (&args.port, &args.pty) {
        (Some(name), _) => Some(Line::open(args, name, config)?),
        (None, Some(link)) => Some(Line::open(args, &PortName::PseudoTerminal(link.clone()), config)?),
        (None, None) => None,
    };
    let system_bus = args
        .can
        .as_ref()
        .map(|name| SystemBus::open(name, &drive))
        .transpose()?;
    if let (Some(name), Some(bus)) = (&args.can, &system_bus) {
        announce(&format!("answering as node {} on {name}", bus.node()))?;
    }
    let mut machine = Machine {
        reader: (args.marks_every != 0).then(|| MarkReader::new(args.marks_every, drive.codes())),
        line,
        system_bus,
        drive,
        operator: Operator::default(),
        scope: ScopeDesk::default(),
        orders: orders(),
        keeper,
    };
    machine.answer()
}

/// The bus module and its line.
struct Line {
    module: Emf2133,
    driver: Driver<ReopeningPort>,
}

impl Line {
    /// Opens the line and says where the module answers.
    fn open(args: &ServeArgs, name: &PortName, config: Emf2133Config) -> Result<Self, String> {
        let module = Emf2133::new(config, args.baud).map_err(|error| error.to_string())?;
        let serial = SerialOptions {
            transmitter: args.rs485,
            ..SerialOptions::default()
        };
        let opened = ReopeningPort::open(name, args.baud, serial).map_err(|error| error.to_string())?;
        opened.notes.iter().for_each(note);
        announce(&match (name, &opened.far_end) {
            (PortName::PseudoTerminal(link), Some(far_end)) => {
                format!(
                    "answering at address {} on {} ({})",
                    args.address,
                    link.display(),
                    far_end.display()
                )
            }
            _ => format!("answering at address {} on {name}", args.address),
        })?;
        Ok(Self {
            module,
            driver: Driver::new(opened.port),
        })
    }

    /// Serves the line for as long as `wait`.
    fn step(&mut self, wait: StdDuration) -> Result<(), String> {
        self.driver
            .step(&mut self.module, wait)
            .map_err(|error| error.to_string())?;
        while let Some(event) = self.driver.port_mut().poll_event() {
            note(&event);
        }
        Ok(())
    }
}

/// The drive with its program and what it has kept.
fn power_up(args: &ServeArgs) -> Result<(Drive, Option<StateKeeper>), String> {
    let mut memory = match &args.state {
        Some(path) if path.exists() => read(path, read_state_file)?,
        _ => NonVolatile::new(CodeStore::thesis()),
    };
    let mut config = DriveConfig::default();
    let mut codes = memory.set(SetNumber::FIRST).clone();
    if let Some(path) = &args.program {
        let file = read(path, |text| ProgramFile::read(text, &codes))?;
        config.program = file.program;
        codes = file.codes;
    }
    if let Some(path) = &args.codes {
        read(path, |text| read_parameter_file(text, &mut codes))?;
    }
    if let Some(node) = args.node {
        codes
            .write(C0350, 0, i32::from(node) * 10_000, Inhibit::Active)
            .map_err(|error| error.to_string())?;
    }
    memory.save(SetNumber::FIRST, &codes);
    let keeper = args.state.as_ref().map(|path| StateKeeper::new(path, &memory));
    Ok((Drive::power_up(config, memory), keeper))
}

/// Reads a file; its mistakes are told with its name.
fn read<T>(path: &Path, parse: impl FnOnce(&str) -> Result<T, FileError>) -> Result<T, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    parse(&text).map_err(|error| format!("{}: {error}", path.display()))
}

/// Lines of standard input, as they come. At its end there are no more orders, and the drive goes on.
fn orders() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

/// Everything that runs in the drive's time.
struct Machine {
    drive: Drive,
    /// None: no bus module is plugged in.
    line: Option<Line>,
    system_bus: Option<SystemBus>,
    reader: Option<MarkReader>,
    operator: Operator,
    scope: ScopeDesk,
    orders: Receiver<String>,
    keeper: Option<StateKeeper>,
}

impl Machine {
    /// The drive's milliseconds follow the clock; between them the line is served.
    ///
    /// When the process was held up, the drive makes up for at most [`MAX_LAG`]; beyond that its time stands still, as if
    /// the machine had been paused.
    fn answer(&mut self) -> Result<Infallible, String> {
        let mut next_ms = StdInstant::now();
        loop {
            let now = StdInstant::now();
            if now > next_ms + MAX_LAG {
                next_ms = now;
            }
            while next_ms <= now {
                self.millisecond()?;
                next_ms += MILLISECOND;
            }
            self.follow_orders()?;
            if let Some(keeper) = &mut self.keeper {
                keeper.keep(self.drive.nonvolatile())?;
            }
            let wait = next_ms.saturating_duration_since(StdInstant::now());
            match &mut self.line {
                Some(line) => line.step(wait)?,
                None => std::thread::sleep(wait),
            }
        }
    }

    fn millisecond(&mut self) -> Result<(), String> {
        if let Some(line) = &mut self.line {
            line.module.cycle_1ms(&mut self.drive);
        }
        if let Some(bus) = &mut self.system_bus {
            bus.millisecond(&mut self.drive)?;
        }
        for _ in 0..TICKS_PER_MS {
            let shaft = self.drive.tick();
            if let Some(reader) = &mut self.reader {
                reader.follow(&shaft, &mut self.drive);
            }
        }
        self.scope.sample(&self.drive);
        self.operator.release(&mut self.drive);
        while self.drive.poll_traverse_event().is_some() {}
        Ok(())
    }

    fn follow_orders(&mut self) -> Result<(), String> {
        match self.scope.poll_saved() {
            Some(Ok(told)) => announce(&told)?,
            Some(Err(sentence)) => note(&sentence),
            None => {}
        }
        while let Ok(line) = self.orders.try_recv() {
            if line.trim().is_empty() {
                continue;
            }
            let answer = match line.trim().strip_prefix("scope ") {
                Some(words) => words.parse::<ScopeOrder>().and_then(|order| self.scope.obey(order)),
                None => line
                    .parse::<Order>()
                    .map(|order| self.operator.obey(order, &mut self.drive)),
            };
            match answer {
                Ok(Some(told)) => announce(&told)?,
                Ok(None) => {}
                Err(sentence) => note(&sentence),
            }
        }
        Ok(())
    }
}

/// One line on standard error that is no reason to end.
pub(crate) fn note(what: &impl std::fmt::Display) {
    eprintln!("lenze9300: {what}");
}

/// One line on standard output, at once: whoever started this process waits for it.
fn announce(line: &str) -> Result<(), String> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")
        .and_then(|()| out.flush())
        .map_err(|error| format!("standard output: {error}"))
}

const MILLISECOND: StdDuration = StdDuration::from_nanos(TICK_NS * TICKS_PER_MS);
const MAX_LAG: StdDuration = StdDuration::from_millis(100);

fn parse_mark_distance(text: &str) -> Result<i32, String> {
    let mm: f64 = text.trim().parse().unwrap_or(f64::NAN);
    if mm == 0.0 || (200.0..=2000.0).contains(&mm) {
        Ok((mm * 10_000.0).round() as i32)
    } else {
        Err("allowed is 200.0…2000.0 mm, or 0 for no reader".to_string())
    }
}

fn parse_ident(text: &str) -> Result<u16, String> {
    let digits = text.trim_start_matches("0x").trim_start_matches("0X");
    u16::from_str_radix(digits, 16).map_err(|_| format!("--ident {text} is not a hexadecimal number 0x0000…0xFFFF"))
}
