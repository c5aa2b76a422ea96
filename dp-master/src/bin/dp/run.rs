//! `dp run`: a master with a process image, shown live.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufRead, BufWriter, IsTerminal};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration as StdDuration, Instant as StdInstant, SystemTime};

use clap::Args;
use dp_master::dp::{DpMaster, MasterConfig, MasterEvent, Mode, SlaveIndex, SlaveState};
use dp_master::driver::Driver;
use dp_master::fdl::{BusParams, Membership};
use dp_master::phy::{CaptureWriter, PortName, ReopeningPort, Trace, TracedPort, request_real_time};
use dp_master::time::{Duration, Instant};

use crate::interrupt::{self, interrupted};
use crate::line_args::{SwitchArgs, parse_seconds};
use crate::output::{Outcome, Trouble, note};
use crate::run_command::RunCommand;
use crate::run_config::RunConfig;
use crate::run_events::sentence;
use crate::run_view::{RunView, Style};

/// What `dp run` takes.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The line, the master and its slaves; docs/examples/run.toml shows one.
    #[arg(value_name = "CONFIG.toml")]
    config: PathBuf,
    /// Line to run on, in place of the one in the file.
    #[arg(long, value_name = "PATH")]
    port: Option<PortName>,
    /// End after so many seconds.
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    duration: Option<StdDuration>,
    /// Write everything on the line as a capture.
    #[arg(long, value_name = "FILE.pcapng")]
    capture: Option<PathBuf>,
    /// One JSON object a second, and one for each event.
    #[arg(long)]
    json: bool,
    /// Ask for real-time priority; a note says if it is refused.
    #[arg(long)]
    real_time: bool,
    #[command(flatten)]
    switch: SwitchArgs,
}

/// As many slaves as there are addresses.
pub(crate) type Master = DpMaster<125>;

type Capture = Rc<RefCell<Option<CaptureWriter<BufWriter<File>>>>>;

/// Runs until the time is over, ctrl-C or `quit`; it fails when a slave never exchanged data.
pub(crate) fn run(args: &RunArgs) -> Outcome {
    let config = RunConfig::read(&args.config)?;
    let Some(name) = args.port.as_ref().or(config.port.as_ref()) else {
        return Err(Trouble::given(format_args!(
            "{} names no port, write port = \"/dev/ttyUSB0\" or give --port PATH",
            args.config.display()
        )));
    };
    let (mut master, slaves) = master_of(&config)?;
    interrupt::watch();
    let epoch = StdInstant::now();
    let since_1970 = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default();
    let capture = open_capture(args, &config, since_1970.into())?;
    let opened = ReopeningPort::open(name, config.baud, args.switch.options()).map_err(Trouble::given)?;
    opened.notes.iter().for_each(note);
    if args.real_time
        && let Err(refused) = request_real_time()
    {
        note(refused);
    }
    let clock = move || Instant::ZERO + epoch.elapsed().into();
    let sink = {
        let capture = Rc::clone(&capture);
        move |trace: Trace<'_>| write_capture(&capture, &trace)
    };
    let mut driver = Driver::with_epoch(TracedPort::new(opened.port, clock, sink), epoch);

    let terminal = std::io::stdout().is_terminal() && std::io::stdin().is_terminal();
    let style = match (args.json, terminal) {
        (true, _) => Style::Json,
        (false, true) => Style::Screen,
        (false, false) => Style::Lines,
    };
    let mut view = RunView::new(style, &config);
    let commands = typed_lines();
    let mut seen = vec![false; config.slaves.len()];
    let mut troubles: Vec<Option<String>> = vec![None; config.slaves.len()];
    let mut broken = None;
    let mut quit = false;
    while !quit && !interrupted() && args.duration.is_none_or(|limit| epoch.elapsed() < limit) {
        if let Err(error) = driver.step(&mut *master, TICK) {
            broken = Some(error);
            break;
        }
        while let Some(event) = driver.port_mut().port_mut().poll_event() {
            view.tell(epoch.elapsed(), &event.to_string());
        }
        while let Some(event) = master.poll_event() {
            // Behind an operating system many cycles are late; they are counted, not told one by one.
            if let MasterEvent::CycleOverrun { .. } = event {
                continue;
            }
            let told = sentence(&event, |slave| named(&config, slave));
            if let MasterEvent::DataExchange { slave } = event {
                mark(&mut seen, slave);
            } else if let Some(slave) = slave_of(&event)
                && let Some(trouble) = troubles.get_mut(slave.position())
            {
                *trouble = Some(told.clone());
            }
            view.tell(epoch.elapsed(), &told);
        }
        for line in commands.try_iter() {
            view.typed();
            match RunCommand::parse(&line) {
                Ok(None) => {}
                Ok(Some(RunCommand::Quit)) => quit = true,
                Ok(Some(RunCommand::Show)) => view.show(epoch.elapsed(), &master, &slaves),
                Ok(Some(command)) => {
                    if let Err(error) = obey(&mut master, &config, &slaves, command) {
                        view.tell(epoch.elapsed(), &error);
                    }
                }
                Err(error) => view.tell(epoch.elapsed(), &error),
            }
        }
        view.refresh(epoch.elapsed(), &master, &slaves);
    }
    if broken.is_none() {
        shut_down(&mut driver, &mut master, &mut view, epoch);
    }
    view.show(epoch.elapsed(), &master, &slaves);
    view.end();
    close_capture(args, &capture)?;
    if let Some(error) = broken {
        return Err(Trouble::failed(error));
    }
    for ((slave, seen), trouble) in config.slaves.iter().zip(seen).zip(troubles) {
        if !seen && config.mode != Mode::Stop {
            let why = trouble.unwrap_or_else(|| "it does not answer".to_owned());
            return Err(Trouble::failed(format_args!(
                "slave {} at address {} never exchanged data: {why}",
                slave.name, slave.config.address
            )));
        }
    }
    Ok(())
}

fn master_of(config: &RunConfig) -> Result<(Box<Master>, Vec<SlaveIndex>), Trouble> {
    let standard = BusParams::standard(config.baud).with_latency_allowance(config.latency);
    let params = BusParams {
        hsa: config.hsa.unwrap_or(standard.hsa),
        ..standard
    };
    let mut master = Box::new(
        Master::new(MasterConfig {
            min_cycle: config.cycle,
            ..MasterConfig::new(config.address, params)
        })
        .map_err(Trouble::given)?,
    );
    let mut slaves = Vec::new();
    for slave in &config.slaves {
        let index = master.add_slave(slave.config).map_err(Trouble::given)?;
        master.set_outputs(index, &slave.outputs).map_err(Trouble::given)?;
        slaves.push(index);
    }
    master.set_mode(config.mode);
    Ok((master, slaves))
}

/// Clear, so that every slave gets zeros, then Stop, then out of the ring.
fn shut_down<C: FnMut() -> Instant, S: FnMut(Trace<'_>)>(
    driver: &mut Driver<TracedPort<ReopeningPort, C, S>>,
    master: &mut Master,
    view: &mut RunView,
    epoch: StdInstant,
) {
    let mut wait = |master: &mut Master, done: &dyn Fn(&Master) -> bool| {
        let begun = StdInstant::now();
        while !done(master) && begun.elapsed() < SHUT_DOWN {
            if driver.step(master, TICK).is_err() {
                return;
            }
        }
    };
    if master.mode() == Mode::Operate {
        view.tell(epoch.elapsed(), "clear");
        master.set_mode(Mode::Clear);
        // The Global_Control goes out with the end of a cycle, and one more whole cycle carries the zeros.
        let cycles = master.statistics().cycles;
        wait(master, &|master| master.statistics().cycles >= cycles + 3);
    }
    view.tell(epoch.elapsed(), "stop");
    master.set_mode(Mode::Stop);
    master.set_membership(Membership::Passive);
    wait(master, &|master| !master.is_in_ring());
}

fn obey(master: &mut Master, config: &RunConfig, slaves: &[SlaveIndex], command: RunCommand) -> Result<(), String> {
    match command {
        RunCommand::Set { slave, offset, octets } => {
            let place = config.slaves.iter().position(|entry| entry.name == slave);
            let index = place.and_then(|place| slaves.get(place)).ok_or_else(|| {
                let names: Vec<&str> = config.slaves.iter().map(|entry| entry.name.as_str()).collect();
                format!("there is no slave `{slave}`, there are {}", names.join(", "))
            })?;
            let outputs = master.outputs_mut(*index);
            let length = outputs.len();
            let end = offset.saturating_add(octets.len());
            match outputs.get_mut(offset..end) {
                Some(place) => place.copy_from_slice(&octets),
                None => {
                    return Err(format!(
                        "`{slave}` has {length} octets of outputs, {offset} and {} more do not fit",
                        octets.len()
                    ));
                }
            }
        }
        RunCommand::Mode(mode) => master.set_mode(mode),
        RunCommand::Control(control) => master.send_control(control).map_err(|error| error.to_string())?,
        RunCommand::Show | RunCommand::Quit => {}
    }
    Ok(())
}

/// Lines of standard input, as they come; none any more after its end.
fn typed_lines() -> Receiver<String> {
    let (tell, lines) = channel();
    // It waits for a line when the process ends, and ends with it.
    drop(thread::Builder::new().name("input".to_owned()).spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if tell.send(line).is_err() {
                return;
            }
        }
    }));
    lines
}

fn named(config: &RunConfig, slave: SlaveIndex) -> String {
    config.slaves.get(slave.position()).map_or_else(
        || format!("slave {}", slave.position()),
        |slave| format!("{} ({})", slave.name, slave.config.address),
    )
}

fn mark(seen: &mut [bool], slave: SlaveIndex) {
    if let Some(place) = seen.get_mut(slave.position()) {
        *place = true;
    }
}

const fn slave_of(event: &MasterEvent) -> Option<SlaveIndex> {
    match event {
        MasterEvent::ParametersRefused { slave, .. }
        | MasterEvent::ConfigurationRefused { slave, .. }
        | MasterEvent::OwnedByOther { slave, .. }
        | MasterEvent::StartUpRejected { slave, .. }
        | MasterEvent::DiagnosisUnreadable { slave, .. }
        | MasterEvent::SlaveLost { slave, .. } => Some(*slave),
        _ => None,
    }
}

fn open_capture(args: &RunArgs, config: &RunConfig, epoch: Duration) -> Result<Capture, Trouble> {
    let writer = match &args.capture {
        None => None,
        Some(path) => {
            let failed = |error: &dyn std::fmt::Display| {
                Trouble::given(format_args!("{} cannot be written: {error}", path.display()))
            };
            let file = File::create(path).map_err(|error| failed(&error))?;
            let writer =
                CaptureWriter::new(BufWriter::new(file), config.baud, epoch).map_err(|error| failed(&error))?;
            Some(writer)
        }
    };
    Ok(Rc::new(RefCell::new(writer)))
}

fn write_capture(capture: &Capture, trace: &Trace<'_>) {
    let mut capture = capture.borrow_mut();
    if let Some(writer) = capture.as_mut()
        && let Err(error) = writer.write(trace)
    {
        note(format_args!("the capture ends here: {error}"));
        *capture = None;
    }
}

fn close_capture(args: &RunArgs, capture: &Capture) -> Outcome {
    match (capture.borrow_mut().take(), &args.capture) {
        (Some(writer), Some(path)) => writer
            .finish()
            .map(drop)
            .map_err(|error| Trouble::failed(format_args!("{}: {error}", path.display()))),
        (None, Some(path)) => Err(Trouble::failed(format_args!("{} is not complete", path.display()))),
        _ => Ok(()),
    }
}

/// The state of a slave in the words of the standard.
pub(crate) const fn state_name(state: SlaveState) -> &'static str {
    match state {
        SlaveState::Offline => "offline",
        SlaveState::WaitPrm => "Wait_Prm",
        SlaveState::WaitCfg => "Wait_Cfg",
        SlaveState::WaitReady => "wait for ready",
        SlaveState::DataExchange => "Data_Exchange",
        SlaveState::Refused => "refused",
        #[allow(unreachable_patterns, reason = "the list may grow")]
        _ => "other",
    }
}

/// How long what is typed, and a wish to end, may wait.
const TICK: StdDuration = StdDuration::from_millis(50);
/// Longest wait for each step of the end.
const SHUT_DOWN: StdDuration = StdDuration::from_millis(500);
