//! The block and the master in real time, against whatever answers on a serial line.

use std::time::{Duration as StdDuration, Instant as StdInstant};

use dp_master::address::Address;
use dp_master::dp::SlaveState;
use dp_master::driver::Driver;
use dp_master::phy::{PortName, ReopeningPort, SerialOptions};
use dp_master::time::{Baud, Duration};
use lenze9300_model::bus::dp::PAR_AND_FOUR_WORDS;

use crate::block::{FilmFeedBlock, Inputs, Outputs};
use crate::bus_config;
use crate::operator::{FeedPlan, Operator, OperatorEvent};
use crate::parameter_watch::{self, ParameterWatch};
use crate::plc::{DpPeriphery, IMAGE};
use crate::report::{BusReport, ErrorKnown, FeedMode, FeedReport, RunReport};

/// Where the drive is.
#[derive(Debug, Clone)]
pub struct RealLine {
    /// Serial device, pseudo-terminal or serial-device server.
    pub port: PortName,
    /// Baud rate.
    pub baud: Baud,
    /// DP address of the drive.
    pub slave_address: u8,
    /// Period of the PLC cycle, ns.
    pub plc_cycle_ns: u64,
}

/// What an operating system and a USB adapter may add to an answer: a Linux tty wakes its reader within some
/// milliseconds, an FTDI adapter keeps octets for up to 16 ms by default.
pub(crate) const LATENCY: Duration = Duration::from_millis(50);

/// Longest wait for DRIVE_RDY: nobody waits a minute at a machine.
const START_UP_LIMIT_NS: u64 = 10_000_000_000;
/// A drive that leaves data exchange in mid-run may come back for so long: a loose plug, a restarted adapter.
const LOSS_LIMIT_NS: u64 = 3_000_000_000;
/// A pulled adapter may come back for so long; the drive must be in data exchange again before [`LOSS_LIMIT_NS`] ends.
const UNPLUGGED_LIMIT: StdDuration = StdDuration::from_millis(2_500);
/// An exchange of the parameter channel that takes longer is reported.
pub(crate) const PARAMETER_LIMIT_NS: u64 = 3_000_000_000;

/// Runs `plan` in real time. `feed_done` is called after each feed, `note` with what the user should know about the port.
///
/// A PLC cycle that comes too late is worked at once and the next one counts from there: none is made up for.
///
/// A line that breaks for long and a drive that leaves the bus end the run; the report says why.
///
/// # Errors
/// One sentence when the port cannot be opened.
pub fn run(
    line: &RealLine,
    plan: FeedPlan,
    mut feed_done: impl FnMut(),
    mut note: impl FnMut(String),
) -> Result<RunReport, String> {
    let address = Address::new(line.slave_address).map_err(|error| error.to_string())?;
    let (mut master, slave) = bus_config::master(line.baud, address, PAR_AND_FOUR_WORDS, Duration::ZERO, LATENCY)
        .map_err(|error| error.to_string())?;
    let opened =
        ReopeningPort::open(&line.port, line.baud, SerialOptions::default()).map_err(|error| error.to_string())?;
    opened.notes.iter().for_each(|what| note(what.to_string()));
    let mut driver = Driver::new(opened.port.with_limit(UNPLUGGED_LIMIT));

    let plan = FeedPlan {
        start_up_limit_ns: START_UP_LIMIT_NS,
        ..plan
    };
    let length_mm = f64::from(plan.length_tenth_mm) / 10.0;
    let mut operator = Operator::new(plan, 0);
    let mut watch = ParameterWatch::new(PARAMETER_LIMIT_NS, 0);
    let mut block = FilmFeedBlock::new();
    let mut inputs = Inputs {
        pzd_adr: PZD_ADDRESS,
        ..Inputs::default()
    };
    let mut outputs = [0; IMAGE];
    let mut feeds: Vec<FeedReport> = Vec::new();
    let mut warnings = Vec::new();
    let mut aborted = None;
    let mut last_trouble = None;
    // When data exchange was last there.
    let mut seen_ns = None;

    let started = StdInstant::now();
    let cycle = StdDuration::from_nanos(line.plc_cycle_ns);
    let mut due = started + cycle;
    'run: loop {
        while let Some(wait) = due
            .checked_duration_since(StdInstant::now())
            .filter(|wait| !wait.is_zero())
        {
            if let Err(error) = driver.step(&mut master, wait) {
                aborted = Some(format!("the line broke in mid-run: {error}"));
                break 'run;
            }
        }
        while let Some(event) = driver.port_mut().poll_event() {
            note(event.to_string());
        }
        due = (due + cycle).max(StdInstant::now());
        let now_ns = started.elapsed().as_nanos() as u64;

        while let Some(event) = master.poll_event() {
            last_trouble = bus_config::trouble(&event).or(last_trouble);
        }
        let told = operator.scan(now_ns, block.outputs(), watch.rounds(), &mut inputs);
        match told {
            Some(OperatorEvent::FeedOver { mode, job_ns }) => {
                let n = feeds.len() + 1;
                let feed = seen_from_the_bus(n, mode, length_mm, block.outputs(), job_ns);
                if mode == FeedMode::Mark && ended_at_search_end(&feed, length_mm) {
                    warnings.push(format!(
                        "feed {n}: no mark was found up to the end of the search, {:.1} mm after the start",
                        SEARCH_LENGTHS * length_mm
                    ));
                }
                feeds.push(feed);
                feed_done();
            }
            Some(OperatorEvent::Finished) => break,
            Some(OperatorEvent::Aborted(reason)) => {
                aborted = Some(match last_trouble.take() {
                    Some(trouble) if master.state(slave) != SlaveState::DataExchange => format!("{reason}; {trouble}"),
                    _ => reason,
                });
                break;
            }
            Some(OperatorEvent::SeriesReady(_) | OperatorEvent::FeedStarted(_)) | None => {}
        }

        let exchanging = master.state(slave) == SlaveState::DataExchange;
        if exchanging {
            seen_ns = Some(now_ns);
        } else if seen_ns.is_some_and(|seen_ns| now_ns - seen_ns > LOSS_LIMIT_NS) {
            // The block would wait for ever: it keeps the last process data and knows no time-out.
            let why = last_trouble.unwrap_or("the slave is not in data exchange".to_string());
            aborted = Some(format!("the drive left the bus in mid-run: {why}"));
            break;
        }
        let mut periphery = DpPeriphery {
            module_address: PZD_ADDRESS,
            inputs: if exchanging {
                master.inputs(slave).try_into().ok()
            } else {
                None
            },
            outputs: &mut outputs,
        };
        block.cycle(&mut inputs, &mut periphery);
        master.set_outputs(slave, &outputs).map_err(|error| error.to_string())?;
        let periphery = if exchanging {
            parameter_watch::Periphery::Present
        } else {
            parameter_watch::Periphery::Absent
        };
        watch.observe(now_ns, &block, inputs.error_reset, periphery);
    }

    let statistics = master.statistics();
    let simulated_s = started.elapsed().as_secs_f64();
    let ok =
        aborted.is_none() && warnings.is_empty() && feeds.iter().all(|feed| feed.landed(ErrorKnown::WhereTheBusTells));
    Ok(RunReport {
        feeds,
        bus: BusReport::new(line.baud, &statistics, 0),
        parameters: watch.troubles().to_vec(),
        energy: None,
        film: None,
        warnings,
        aborted,
        simulated_s,
        wall_s: 0.0,
        speedup: 0.0,
        ok,
    })
}

/// Peripheral address of the process data (thesis ch. 9).
pub(crate) const PZD_ADDRESS: u16 = 0x0118;

/// What POS_ACT tells: record 01 sets the reference at the start, so it counts from there.
fn seen_from_the_bus(n: usize, mode: FeedMode, length_mm: f64, outputs: &Outputs, job_ns: Option<u64>) -> FeedReport {
    let pos_act_mm = Some(f64::from(outputs.position_mm)).filter(|mm| mm.is_finite());
    let commanded_mm = (mode == FeedMode::Length).then_some(length_mm);
    FeedReport {
        n,
        mode,
        commanded_mm,
        film_mm: pos_act_mm,
        error_mm: pos_act_mm.zip(commanded_mm).map(|(moved, commanded)| moved - commanded),
        pos_act_mm,
        set_point_s: None,
        in_position_s: None,
        job_s: job_ns.map(|ns| ns as f64 / 1e9),
        finished: job_ns.is_some(),
        peak_rpm: None,
        peak_torque_nm: None,
        rms_current_a: None,
        peak_current_a: None,
        max_following_error_mm: None,
        reversed: false,
    }
}

/// Records 03 and 04 together: one length less 100 mm, then 100 mm and one more length (film-feed specification,
/// section 6).
const SEARCH_LENGTHS: f64 = 2.0;

/// The bus does not say whether a mark was found; the way does: without one it is the whole search.
fn ended_at_search_end(feed: &FeedReport, length_mm: f64) -> bool {
    const CLOSE_MM: f64 = 0.05;
    feed.film_mm
        .is_some_and(|mm| (mm - SEARCH_LENGTHS * length_mm).abs() < CLOSE_MM)
}
