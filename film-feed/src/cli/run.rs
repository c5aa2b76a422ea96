//! `film-feed run`: the main job.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use dp_master::phy::PortName;
use dp_master::time::Baud;
use indicatif::{ProgressBar, ProgressStyle};
use lenze9300_model::signal::Signal;

use super::advise;
use super::machine;
use super::model::ModelArgs;
use super::output_file::OutputFile;
use crate::machine::{FilmConfig, MarkConfig};
use crate::operator::FeedPlan;
use crate::plot;
use crate::real_line::{self, RealLine};
use crate::report::{FeedMode, RunReport};
use crate::rig::RigConfig;
use crate::run::{self, Observation};
use crate::scope::{self, Sample};
use crate::signal_trace::SignalTrace;

/// What `film-feed run` takes.
#[derive(Debug, Clone, Args)]
pub struct RunArgs {
    /// The machine, its feeds and its bus, as in docs/examples/machine.toml; the axis of the thesis if not given.
    #[arg(long, value_name = "MACHINE.toml", conflicts_with_all = FROM_THE_MACHINE)]
    machine: Option<PathBuf>,
    /// Further motors and drives, as in film-feed/catalogue; may be given several times.
    #[arg(long, value_name = "FILE.toml", requires = "machine")]
    catalogue: Vec<PathBuf>,
    /// Which series to run.
    #[arg(long, value_enum, default_value_t = SeriesChoice::Both)]
    series: SeriesChoice,
    /// Short for `--series mark`.
    #[arg(long, conflicts_with = "series")]
    print_marks: bool,
    /// Feeds per series, 1…1000000.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    feeds: u32,
    /// Feed length, 200.0…2000.0 mm in steps of 0.1.
    #[arg(long, value_name = "MM", default_value = "1200.0", value_parser = LENGTH.parser())]
    length: i16,
    /// Travel velocity, 10.00…100.00 % of v_max (1200 mm/s) in steps of 0.01.
    #[arg(long, value_name = "PCT", default_value = "100.00", value_parser = PERCENT.parser())]
    speed: i16,
    /// Acceleration and deceleration, 10.00…100.00 % of a_max (2400 mm/s²) in steps of 0.01.
    #[arg(long, value_name = "PCT", default_value = "100.00", value_parser = PERCENT.parser())]
    accel: i16,
    /// Mark-reading velocity, 10.00 % up to the travel velocity, in steps of 0.01.
    #[arg(long, value_name = "PCT", value_parser = PERCENT.parser())]
    mark_speed: Option<i16>,
    /// Mean distance between print marks, 200.0…2000.0 mm in steps of 0.1; the feed length if not given.
    #[arg(long, value_name = "MM", value_parser = LENGTH.parser())]
    repeat: Option<i16>,
    /// Largest deviation of a mark's distance, 0.0…50.0 mm in steps of 0.1.
    #[arg(long, value_name = "MM", default_value = "50.0", value_parser = MARK_TOLERANCE.parser())]
    mark_tolerance: i16,
    /// Seed of everything random: mark distances, bit errors, processing times.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Baud rate in bit/s: 9600, 19200, 45450, 93750, 187500, 500000, 1500000, 3000000, 6000000 or 12000000
    /// (12000000 if not given; 1500000 with --port).
    #[arg(long, value_name = "RATE")]
    baud: Option<Baud>,
    /// PLC cycle, 1.0…100.0 ms in steps of 0.1.
    #[arg(long, value_name = "MS", default_value = "5.0", value_parser = PLC_CYCLE.parser())]
    plc_cycle: i16,
    /// Shortest DP cycle, 0.00…100.00 ms in steps of 0.01; 0 polls as fast as the bus parameters allow.
    #[arg(long, value_name = "MS", default_value = "1.00", value_parser = DP_CYCLE.parser())]
    dp_cycle: i16,
    /// Probability that a bit on the line is wrong, 0…0.001.
    #[arg(long, value_name = "P", default_value = "0", value_parser = parse_bit_error_rate)]
    bit_error_rate: f64,
    /// Print the report as one JSON object.
    #[arg(long)]
    json: bool,
    /// Write signals of the whole chain, once a millisecond: as Parquet if the name ends in .parquet, else as CSV.
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    trace: Option<PathBuf>,
    /// Trace these signals of the drive instead, separated by commas; `lenze9300 signals` lists them.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "trace")]
    signals: Vec<Signal>,
    /// Milliseconds from one row of --signals to the next, 1…1000.
    #[arg(long, value_name = "MS", default_value_t = 1, requires = "signals", value_parser = clap::value_parser!(u32).range(1..=1000))]
    interval: u32,
    /// Draw interpolator and motor speed of the first feed as SVG, or as PNG by the name of the file.
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    plot: Option<PathBuf>,
    /// Run in real time against whatever answers on this line: a serial device, or tcp://host:port of a serial-device
    /// server.
    #[arg(long, value_name = "PATH", conflicts_with_all = ["fidelity", "film", "gear_stiffness"])]
    port: Option<PortName>,
    #[command(flatten)]
    model: ModelArgs,
    /// DP address of the drive, 0…125.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(0..=125))]
    address: u8,
}

/// Options whose values a machine file has.
const FROM_THE_MACHINE: [&str; 14] = [
    "series",
    "print_marks",
    "length",
    "speed",
    "accel",
    "mark_speed",
    "repeat",
    "mark_tolerance",
    "baud",
    "plc_cycle",
    "dp_cycle",
    "address",
    "film",
    "port",
];

/// Which series to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SeriesChoice {
    /// By length, then to the print mark.
    Both,
    /// By length only.
    Length,
    /// To the print mark only.
    Mark,
}

impl RunArgs {
    fn modes(&self) -> &'static [FeedMode] {
        match (self.print_marks, self.series) {
            (true, _) | (false, SeriesChoice::Mark) => &[FeedMode::Mark],
            (false, SeriesChoice::Length) => &[FeedMode::Length],
            (false, SeriesChoice::Both) => &[FeedMode::Length, FeedMode::Mark],
        }
    }

    /// The thesis reads marks at 20 % (fig. 68); a slower travel pulls the mark-reading velocity down with it.
    fn mark_speed(&self) -> Result<i16, String> {
        const THESIS: i16 = 2000;
        let mark_speed = self.mark_speed.unwrap_or(THESIS.min(self.speed));
        if mark_speed > self.speed {
            return Err(format!(
                "--mark-speed {} % is above the travel velocity --speed {} %; give at most that",
                PERCENT.show(mark_speed),
                PERCENT.show(self.speed)
            ));
        }
        Ok(mark_speed)
    }

    fn plan(&self) -> Result<FeedPlan, String> {
        let feeds = self.feeds as usize;
        Ok(FeedPlan {
            series: self.modes().iter().map(|mode| (*mode, feeds)).collect(),
            length_tenth_mm: self.length,
            speed_hundredth_percent: self.speed,
            mark_speed_hundredth_percent: self.mark_speed()?,
            accel_hundredth_percent: self.accel,
            ..FeedPlan::default()
        })
    }

    /// The chain and its feeds, from the machine file or from the other options.
    fn job(&self) -> Result<(RigConfig, FeedPlan), String> {
        let Some(path) = &self.machine else {
            return Ok((self.rig_config(), self.plan()?));
        };
        let (machine, _) = machine::read(path, &self.catalogue)?;
        let mut config = machine.rig_config(self.seed).map_err(|error| error.to_string())?;
        config.bit_error_rate = self.bit_error_rate;
        self.model.apply(&mut config);
        Ok((config, machine.feed_plan(self.feeds as usize)))
    }

    fn rig_config(&self) -> RigConfig {
        let marks = MarkConfig {
            repeat_mm: f64::from(self.repeat.unwrap_or(self.length)) / 10.0,
            tolerance_mm: f64::from(self.mark_tolerance) / 10.0,
            seed: self.seed,
            ..MarkConfig::default()
        };
        let mut config = RigConfig {
            baud: self.baud.unwrap_or(Baud::B12000000),
            plc_cycle_ns: self.plc_cycle_ns(),
            dp_cycle_ns: self.dp_cycle as u64 * 10_000,
            bit_error_rate: self.bit_error_rate,
            seed: self.seed,
            slave_address: self.address,
            film: FilmConfig {
                marks,
                ..FilmConfig::default()
            },
            ..RigConfig::default()
        };
        config.drive.axis.noise_seed = self.seed;
        self.model.apply(&mut config);
        config
    }

    fn plc_cycle_ns(&self) -> u64 {
        self.plc_cycle as u64 * 100_000
    }
}

/// Runs the feeds; `Ok(true)` when every feed landed and finished.
///
/// # Errors
/// One sentence when something given was wrong; nothing has run then.
pub fn run(args: &RunArgs) -> Result<bool, String> {
    let (config, plan) = args.job()?;
    let trace = args.trace.as_deref().map(OutputFile::create).transpose()?;
    let picture = args.plot.as_deref().map(OutputFile::create).transpose()?;
    let mut signals = SignalTrace::new(args.signals.iter().copied(), args.interval);
    let observation = if (trace.is_some() && args.signals.is_empty()) || picture.is_some() {
        Observation::Samples
    } else {
        Observation::FeedsOnly
    };
    // What a real drive is set to is not known here.
    if args.port.is_none() {
        advise::warn(&config, &plan);
    }
    let progress = progress_bar(args, plan.series.iter().map(|(_, feeds)| *feeds as u64).sum());
    let feed_done = || progress.inc(1);
    let started = Instant::now();
    let (mut report, samples) = match &args.port {
        None if args.signals.is_empty() => {
            run::simulated(&config, plan, observation, feed_done).map_err(|error| error.to_string())?
        }
        None => {
            run::observed(&config, plan, observation, &mut signals, feed_done).map_err(|error| error.to_string())?
        }
        Some(port) => {
            let line = RealLine {
                port: port.clone(),
                baud: args.baud.unwrap_or(Baud::B1500000),
                slave_address: args.address,
                plc_cycle_ns: args.plc_cycle_ns(),
            };
            let note = |what| progress.suspend(|| eprintln!("film-feed: {what}"));
            (real_line::run(&line, plan, feed_done, note)?, Vec::new())
        }
    };
    progress.finish_and_clear();
    report.wall_s = started.elapsed().as_secs_f64();
    report.speedup = report.simulated_s / report.wall_s;

    if let Some(file) = trace {
        let is_parquet = args.trace.as_deref().is_some_and(is_parquet);
        file.commit(|out| match (args.signals.is_empty(), is_parquet) {
            (true, false) => scope::write_csv(&samples, out),
            (true, true) => scope::table(&samples).write_parquet(out),
            (false, false) => signals.table().write_csv(out),
            (false, true) => signals.table().write_parquet(out),
        })?;
    }
    // A run that ended before its first feed has nothing to draw; its report says why it ended.
    if let Some(file) = picture.filter(|_| !report.feeds.is_empty()) {
        let svg = draw(&report, &samples)?;
        let octets = super::picture(args.plot.as_deref(), &svg)?;
        file.commit(|out| out.write_all(&octets))?;
    }
    match print(args, &report) {
        // Whoever closed the pipe has read enough; the exit code still tells how the feeds went.
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            eprintln!("film-feed: the report cannot be written: {error}");
            Ok(false)
        }
        _ => Ok(report.ok),
    }
}

fn is_parquet(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

fn draw(report: &RunReport, samples: &[Sample]) -> Result<String, String> {
    let first = report
        .feeds
        .first()
        .ok_or_else(|| plot::PlotError::NothingRecorded.to_string())?;
    let title = match first.mode {
        FeedMode::Length => format!("Feed {} by length: interpolator speed and motor speed", first.n),
        FeedMode::Mark => format!("Feed {} to the print mark: interpolator speed and motor speed", first.n),
    };
    plot::speed_over_time(samples, first.n, &title).map_err(|error| error.to_string())
}

fn print(args: &RunArgs, report: &RunReport) -> io::Result<()> {
    let mut out = io::stdout().lock();
    if args.json {
        serde_json::to_writer(&mut out, report)?;
        writeln!(out)?;
    } else {
        writeln!(out, "{report}")?;
    }
    out.flush()
}

/// A bar on a terminal, nothing elsewhere; it shows itself only when the run lasts.
fn progress_bar(args: &RunArgs, feeds: u64) -> ProgressBar {
    if args.json || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(feeds);
    bar.set_style(
        ProgressStyle::with_template("{bar:40} {pos}/{len} feeds, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}

/// A decimal quantity the command line takes: its range and step declared once, the check and the message derived.
#[derive(Debug, Clone, Copy)]
struct Decimal {
    unit: &'static str,
    decimals: usize,
    min: i16,
    max: i16,
}

const LENGTH: Decimal = Decimal {
    unit: "mm",
    decimals: 1,
    min: 2_000,
    max: 20_000,
};
const PERCENT: Decimal = Decimal {
    unit: "%",
    decimals: 2,
    min: 1_000,
    max: 10_000,
};
const MARK_TOLERANCE: Decimal = Decimal {
    unit: "mm",
    decimals: 1,
    min: 0,
    max: 500,
};
const PLC_CYCLE: Decimal = Decimal {
    unit: "ms",
    decimals: 1,
    min: 10,
    max: 1_000,
};
const DP_CYCLE: Decimal = Decimal {
    unit: "ms",
    decimals: 2,
    min: 0,
    max: 10_000,
};

impl Decimal {
    fn parser(self) -> impl Fn(&str) -> Result<i16, String> + Clone + Send + Sync + 'static {
        move |text| self.parse(text)
    }

    fn parse(self, text: &str) -> Result<i16, String> {
        let scale = 10_f64.powi(self.decimals as i32);
        let allowed = || {
            format!(
                "allowed is {}…{} {} in steps of {}",
                self.show(self.min),
                self.show(self.max),
                self.unit,
                1.0 / scale
            )
        };
        let value: f64 = text
            .trim()
            .parse()
            .map_err(|_| format!("not a number, {}", allowed()))?;
        let scaled = value * scale;
        if !(f64::from(self.min)..=f64::from(self.max)).contains(&scaled) {
            return Err(allowed());
        }
        // Decimal fractions are not exact in binary; a millionth of a step is no step.
        if (scaled - scaled.round()).abs() > 1e-6 {
            return Err(allowed());
        }
        Ok(scaled.round() as i16)
    }

    fn show(self, value: i16) -> String {
        format!(
            "{:.*}",
            self.decimals,
            f64::from(value) / 10_f64.powi(self.decimals as i32)
        )
    }
}

fn parse_bit_error_rate(text: &str) -> Result<f64, String> {
    const MAX: f64 = 0.001;
    let allowed = || format!("allowed is 0…{MAX}");
    let rate: f64 = text.trim().parse().map_err(|_| allowed())?;
    if (0.0..=MAX).contains(&rate) {
        Ok(rate)
    } else {
        Err(allowed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_taken_in_tenths_of_a_millimetre() {
        assert_eq!(LENGTH.parse("1200"), Ok(12_000));
        assert_eq!(LENGTH.parse("987.5"), Ok(9_875));
        assert_eq!(LENGTH.parse("200.0"), Ok(2_000));
        assert_eq!(LENGTH.parse("2000"), Ok(20_000));
    }

    #[test]
    fn a_length_out_of_range_names_the_range() {
        for text in ["199.9", "2000.1", "1200.05", "NaN", "inf", "-1", "abc", ""] {
            let message = LENGTH.parse(text).unwrap_err();
            assert!(message.contains("200.0…2000.0 mm in steps of 0.1"), "{text}: {message}");
        }
    }

    #[test]
    fn a_bit_error_rate_is_a_small_probability() {
        assert_eq!(parse_bit_error_rate("1e-5"), Ok(1e-5));
        for text in ["-1e-9", "0.5", "NaN"] {
            assert!(parse_bit_error_rate(text).is_err(), "{text}");
        }
    }
}
