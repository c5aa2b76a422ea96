//! `dp sniff`: telegrams of a line or of a capture, and what they tell about it. It never sends.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration as StdDuration, Instant as StdInstant, SystemTime};

use clap::Args;
use dp_master::address::Address;
use dp_master::driver::Driver;
use dp_master::phy::{
    CaptureReader, CaptureWriter, Content, PortErrorKind, PortName, ReopeningPort, Tap, Trace, Tracer, open,
};
use dp_master::time::{Baud, Duration, ParseBaudError};
use dp_master::wire::{Hex, Pretty, Service, Telegram};

use crate::bus_statistics::BusStatistics;
use crate::interrupt::{self, interrupted};
use crate::late_bar::LateBar;
use crate::line_args::{SwitchArgs, parse_seconds};
use crate::output::{Outcome, Output, Trouble, note};
use crate::telegram_record::TelegramRecord;

/// What `dp sniff` takes.
#[derive(Debug, Args)]
pub(crate) struct SniffArgs {
    /// Line to listen to: a serial device, or tcp://host:port of a serial-device server.
    #[arg(long, value_name = "PATH", required_unless_present = "read", conflicts_with = "read")]
    port: Option<PortName>,
    /// Capture to read instead.
    #[arg(long, value_name = "FILE.pcapng")]
    read: Option<PathBuf>,
    /// Baud rate in bit/s, or `auto` to try all ten; for a capture that names none, the rate it was recorded at.
    #[arg(long, value_name = "RATE", value_parser = parse_rate)]
    baud: Option<Rate>,
    /// Write what is shown as a capture.
    #[arg(long, value_name = "FILE.pcapng")]
    write: Option<PathBuf>,
    /// Only telegrams from or to this station, 0…127; may be given several times.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=127))]
    station: Vec<u8>,
    /// Only telegrams of this service, such as Slave_Diag; may be given several times.
    #[arg(long, value_name = "NAME", value_parser = parse_service)]
    service: Vec<Service>,
    /// Leave tokens out.
    #[arg(long)]
    no_tokens: bool,
    /// Show the statistics only.
    #[arg(short, long)]
    quiet: bool,
    /// End after so many seconds.
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    duration: Option<StdDuration>,
    /// End after so many telegrams.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
    /// One JSON object a line: each telegram, then the statistics.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    switch: SwitchArgs,
}

/// How fast the line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rate {
    Known(Baud),
    Unknown,
}

/// Listens until it is told to end, then tells what it found.
pub(crate) fn sniff(args: &SniffArgs) -> Outcome {
    interrupt::watch();
    match (&args.read, &args.port) {
        (Some(path), _) => read(args, path),
        (None, Some(name)) => listen(args, name),
        (None, None) => Err(Trouble::given("--port PATH or --read FILE is needed")),
    }
}

fn read(args: &SniffArgs, path: &Path) -> Outcome {
    let failed = |error: &dyn std::fmt::Display| Trouble::given(format_args!("{}: {error}", path.display()));
    let file = File::open(path).map_err(|error| failed(&error))?;
    let length = file.metadata().map_or(0, |metadata| metadata.len());
    let bar = LateBar::new(length, "{bar:40} {bytes}/{total_bytes}, {eta} left");
    let mut capture = CaptureReader::new(bar.reading(BufReader::new(file))).map_err(|error| failed(&error))?;
    let mut view = None;
    let mut broken = None;
    while let Some(packet) = capture.next() {
        let packet = match packet {
            Ok(packet) => packet,
            Err(error) => {
                // What was read up to here is worth its statistics.
                broken = Some(error.to_string());
                break;
            }
        };
        let view = match &mut view {
            Some(view) => view,
            empty => {
                let baud = match (capture.baud(), args.baud) {
                    (Some(baud), _) | (None, Some(Rate::Known(baud))) => baud,
                    (None, _) => {
                        return Err(Trouble::given(format_args!(
                            "{} does not name its baud rate, give it with --baud",
                            path.display()
                        )));
                    }
                };
                // Times of a capture count from 1970 already.
                empty.insert(View::new(args, baud, Duration::ZERO)?)
            }
        };
        view.show(&packet.trace(view.baud));
        if view.is_full() || interrupted() {
            break;
        }
    }
    bar.finish();
    match view {
        Some(view) => view.end()?,
        None if broken.is_none() => return Err(Trouble::failed(format_args!("{} has no telegrams", path.display()))),
        None => {}
    }
    broken.map_or(Ok(()), |error| {
        Err(Trouble::failed(format_args!("{}: {error}", path.display())))
    })
}

fn listen(args: &SniffArgs, name: &PortName) -> Outcome {
    if let PortName::PseudoTerminal(_) = name {
        return Err(Trouble::given(
            "a new pseudo-terminal has nobody to listen to, give the path of a serial device or tcp://host:port",
        ));
    }
    let baud = match args.baud {
        Some(Rate::Known(baud)) => baud,
        Some(Rate::Unknown) => detect_baud(args, name)?,
        None => {
            return Err(Trouble::given(
                "--baud RATE is needed with --port; `auto` tries all ten",
            ));
        }
    };
    let opened = ReopeningPort::open(name, baud, args.switch.options()).map_err(Trouble::given)?;
    opened.notes.iter().for_each(note);
    let epoch = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default();
    let mut driver = Driver::new(opened.port);
    let view = RefCell::new(View::new(args, baud, epoch.into())?);
    let tracer = Tracer::new(baud).with_latency(ADAPTER_LATENCY);
    let mut tap = Tap::with_tracer(tracer, |trace: Trace<'_>| view.borrow_mut().show(&trace));
    let begun = StdInstant::now();
    let mut flushed = begun;
    let mut broken = None;
    // Where telegrams are shown they tell by themselves that it goes on.
    let bar = args.quiet.then(|| match args.duration {
        Some(limit) => LateBar::new(limit.as_millis() as u64, "{bar:40} {msg}, {eta} left"),
        None => LateBar::new(u64::MAX, "{msg}, ctrl-C ends"),
    });
    while broken.is_none() && !interrupted() && !view.borrow().is_full() {
        let left = args
            .duration
            .map_or(TICK, |limit| limit.saturating_sub(begun.elapsed()).min(TICK));
        if left.is_zero() {
            break;
        }
        broken = driver.step(&mut tap, left).err();
        while let Some(event) = driver.port_mut().poll_event() {
            note(event);
        }
        if flushed.elapsed() >= TICK {
            flushed = StdInstant::now();
            view.borrow_mut().flush()?;
            if let Some(bar) = &bar {
                bar.show(
                    begun.elapsed().as_millis() as u64,
                    &format!("{} telegrams", view.borrow().statistics.telegrams()),
                );
            }
        }
    }
    bar.iter().for_each(LateBar::finish);
    tap.finish();
    drop(tap);
    view.into_inner().end()?;
    broken.map_or(Ok(()), |error| Err(Trouble::failed(error)))
}

/// Listens at each rate in turn until one gives telegrams.
fn detect_baud(args: &SniffArgs, name: &PortName) -> Result<Baud, Trouble> {
    if let PortName::Tcp(_) = name {
        return Err(Trouble::given(
            "the baud rate of a serial-device server is set there and cannot be tried out, give it with --baud RATE",
        ));
    }
    note(format_args!("listening on {name} at each baud rate"));
    let bar = LateBar::new((ROUNDS * LIKELY_FIRST.len()) as u64, "{bar:40} {pos}/{len} trials");
    let mut refused = None;
    for baud in LIKELY_FIRST.into_iter().cycle().take(ROUNDS * LIKELY_FIRST.len()) {
        bar.step();
        let port = match open(name, baud, args.switch.options()) {
            Ok(opened) => opened.port,
            // An adapter may know some of the ten only.
            Err(error) if error.kind() == PortErrorKind::Baud => continue,
            Err(error) => {
                refused = Some(error);
                break;
            }
        };
        let (mut good, mut bad) = (0_u32, 0_u32);
        let tracer = Tracer::new(baud).with_latency(ADAPTER_LATENCY);
        let mut tap = Tap::with_tracer(tracer, |trace: Trace<'_>| match trace.content {
            Content::Telegram(Telegram::ShortAck) => {}
            Content::Telegram(_) => good += 1,
            Content::Discarded { .. } => bad += 1,
        });
        let mut driver = Driver::new(port);
        let begun = StdInstant::now();
        while begun.elapsed() < TRIAL && !interrupted() {
            if let Err(error) = driver.step(&mut tap, TRIAL.saturating_sub(begun.elapsed())) {
                refused = Some(error);
                break;
            }
        }
        drop(tap);
        // At a wrong rate a telegram with a right check sum is rare, and what surrounds it is none.
        if good >= TELEGRAMS_ENOUGH && good > bad {
            bar.finish();
            note(format_args!("the line runs at {} bit/s", baud.bits_per_second()));
            return Ok(baud);
        }
        if refused.is_some() || interrupted() {
            break;
        }
    }
    bar.finish();
    Err(match refused {
        Some(error) => Trouble::given(error),
        None => Trouble::failed(format_args!(
            "no telegrams on {name} at any of the ten baud rates, is the line connected and a master running?"
        )),
    })
}

/// What becomes of each telegram.
struct View<'a> {
    args: &'a SniffArgs,
    baud: Baud,
    statistics: BusStatistics,
    out: Output,
    capture: Option<(PathBuf, CaptureWriter<BufWriter<File>>)>,
    failed: Option<Trouble>,
}

impl<'a> View<'a> {
    fn new(args: &'a SniffArgs, baud: Baud, epoch: Duration) -> Result<Self, Trouble> {
        let capture = args.write.as_ref().map(|path| {
            let failed = |error: &dyn std::fmt::Display| {
                Trouble::given(format_args!("{} cannot be written: {error}", path.display()))
            };
            let file = File::create(path).map_err(|error| failed(&error))?;
            let writer = CaptureWriter::new(BufWriter::new(file), baud, epoch).map_err(|error| failed(&error))?;
            Ok((path.clone(), writer))
        });
        Ok(Self {
            args,
            baud,
            statistics: BusStatistics::new(baud),
            out: Output::new(),
            capture: capture.transpose()?,
            failed: None,
        })
    }

    fn show(&mut self, trace: &Trace<'_>) {
        if self.is_full() {
            return;
        }
        // Everything counts; filters are for the eye and the capture.
        let retry = self.statistics.count(trace);
        if !self.is_wanted(trace) {
            return;
        }
        if let Some((path, capture)) = &mut self.capture
            && let Err(error) = capture.write(trace)
        {
            self.failed = Some(Trouble::failed(format_args!("{}: {error}", path.display())));
        }
        if self.args.quiet {
            return;
        }
        let first = self.statistics.first().unwrap_or(trace.start);
        let time_s = (trace.start - first).as_nanos() as f64 / 1e9;
        if self.args.json {
            self.out.json(&TelegramRecord::timed(trace, time_s));
            return;
        }
        match trace.content {
            Content::Telegram(telegram) => {
                let retry = if retry { "  (retry)" } else { "" };
                self.out
                    .line(format_args!("{time_s:12.6}  {}{retry}", Pretty(&telegram)));
            }
            Content::Discarded { reason, .. } => self.out.line(format_args!(
                "{time_s:12.6}  no telegram: {reason}  {}",
                Hex(trace.octets)
            )),
        }
    }

    fn is_wanted(&self, trace: &Trace<'_>) -> bool {
        let args = self.args;
        match trace.content {
            Content::Discarded { .. } => args.station.is_empty() && args.service.is_empty(),
            Content::Telegram(telegram) => {
                let service = Service::of(&telegram);
                let is_of =
                    |address: Option<Address>| address.is_some_and(|address| args.station.contains(&address.value()));
                !(args.no_tokens && service == Service::Token)
                    && (args.service.is_empty() || args.service.contains(&service))
                    && (args.station.is_empty() || is_of(telegram.source()) || is_of(telegram.destination()))
            }
        }
    }

    /// Whether as many telegrams were seen as were wanted, or nothing more can be written.
    fn is_full(&self) -> bool {
        self.failed.is_some()
            || self
                .args
                .count
                .is_some_and(|count| self.statistics.telegrams() >= count)
    }

    /// What was shown and written is to be seen by others now.
    fn flush(&mut self) -> Result<(), Trouble> {
        self.out.flush();
        match &mut self.capture {
            Some((path, capture)) => capture
                .flush()
                .map_err(|error| Trouble::failed(format_args!("{}: {error}", path.display()))),
            None => Ok(()),
        }
    }

    fn end(mut self) -> Outcome {
        self.statistics.finish();
        let report = self.statistics.report();
        if self.args.json {
            self.out.json(&report);
        } else {
            if !self.args.quiet {
                self.out.line("");
            }
            self.out.text(report);
        }
        self.flush()?;
        self.failed.map_or(Ok(()), Err)
    }
}

fn parse_rate(text: &str) -> Result<Rate, String> {
    if text == "auto" {
        return Ok(Rate::Unknown);
    }
    text.parse()
        .map(Rate::Known)
        .map_err(|error: ParseBaudError| format!("{error}, and auto"))
}

fn parse_service(text: &str) -> Result<Service, String> {
    SERVICES
        .into_iter()
        .find(|service| service.name().eq_ignore_ascii_case(text))
        .ok_or_else(|| {
            let names: Vec<&str> = SERVICES.into_iter().map(Service::name).collect();
            format!("allowed are {}", names.join(", "))
        })
}

const SERVICES: [Service; 20] = [
    Service::Token,
    Service::ShortAck,
    Service::FdlStatus,
    Service::Ident,
    Service::LsapStatus,
    Service::Clock,
    Service::DataExchange,
    Service::SetSlaveAdd,
    Service::RdInp,
    Service::RdOutp,
    Service::GlobalControl,
    Service::GetCfg,
    Service::SlaveDiag,
    Service::SetPrm,
    Service::ExtSetPrm,
    Service::ChkCfg,
    Service::Msac1,
    Service::Msac2,
    Service::MasterMaster,
    Service::Fdl,
];

/// The longest wait before somebody's wish to end, or a pulled adapter, is noticed.
const TICK: StdDuration = StdDuration::from_millis(100);
/// What an adapter as delivered may hold octets back.
const ADAPTER_LATENCY: Duration = Duration::from_millis(20);
/// How long each baud rate is tried: a master alone passes its token several times in this time at any rate.
const TRIAL: StdDuration = StdDuration::from_millis(400);
const ROUNDS: usize = 2;
const TELEGRAMS_ENOUGH: u32 = 5;
/// The rates in use most often first.
const LIKELY_FIRST: [Baud; 10] = [
    Baud::B1500000,
    Baud::B500000,
    Baud::B187500,
    Baud::B12000000,
    Baud::B6000000,
    Baud::B3000000,
    Baud::B93750,
    Baud::B45450,
    Baud::B19200,
    Baud::B9600,
];
