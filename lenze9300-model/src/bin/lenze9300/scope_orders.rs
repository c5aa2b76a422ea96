//! The oscilloscope of a served drive, worked by orders on standard input.
//!
//! | order | does |
//! |---|---|
//! | `scope channels POS-NOUT,N-ACT` | what to record; names as `lenze9300 signals` lists them |
//! | `scope trigger PS rising 2`, `scope trigger none` | what starts the recording |
//! | `scope interval 1` | milliseconds from sample to sample |
//! | `scope depth 2048`, `scope depth unlimited` | samples a channel keeps |
//! | `scope pre 10` | share of the memory before the trigger, % |
//! | `scope arm` | start with these settings; what was recorded before is gone |
//! | `scope stop` | end the recording with what there is |
//! | `scope status` | one line |
//! | `scope save FILE` | write the recording: `.csv`, `.parquet`, `.svg` or `.png`; a line tells when it is done |

use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::thread::{self, JoinHandle};

use lenze9300_model::device::Drive;
use lenze9300_model::picture;
use lenze9300_model::scope::{Depth, Edge, Scope, ScopeConfig, ScopeState, Trigger};
use lenze9300_model::signal::Signal;
use lenze9300_model::table::Table;

use crate::provisional::Provisional;

/// An order to the oscilloscope.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ScopeOrder {
    Channels(Vec<Signal>),
    Trigger(Option<Trigger>),
    IntervalMs(u32),
    Depth(Depth),
    PrePercent(u8),
    Arm,
    Stop,
    Status,
    Save(PathBuf),
}

/// Settings for the next recording, and the recording.
#[derive(Debug)]
pub(crate) struct ScopeDesk {
    config: ScopeConfig,
    scope: Option<Scope>,
    /// A recording that is being written.
    saving: Option<JoinHandle<Result<String, String>>>,
}

impl Default for ScopeDesk {
    /// The two channels of figure 73 of the thesis.
    fn default() -> Self {
        Self {
            config: ScopeConfig::original([Signal::PosNout, Signal::MctrlNact]),
            scope: None,
            saving: None,
        }
    }
}

pub(crate) const HELP: &str = "scope channels NAMES|trigger NAME rising|falling LEVEL|trigger none|interval MS|depth N|unlimited|pre PERCENT|arm|stop|status|save FILE";

impl ScopeDesk {
    /// A millisecond of the drive has passed.
    pub(crate) fn sample(&mut self, drive: &Drive) {
        if let Some(scope) = &mut self.scope {
            scope.sample(drive);
        }
    }

    /// Carries an order out and returns what to tell, if anything.
    ///
    /// # Errors
    ///
    /// One sentence; the settings are as they were.
    pub(crate) fn obey(&mut self, order: ScopeOrder) -> Result<Option<String>, String> {
        match order {
            ScopeOrder::Channels(channels) => self.config.channels = channels,
            ScopeOrder::Trigger(trigger) => self.config.trigger = trigger,
            ScopeOrder::IntervalMs(interval_ms) => self.config.interval_ms = interval_ms,
            ScopeOrder::Depth(depth) => self.config.depth = depth,
            ScopeOrder::PrePercent(percent) => self.config.pre_trigger_percent = percent,
            ScopeOrder::Arm => self.scope = Some(Scope::new(self.config.clone()).map_err(|error| error.to_string())?),
            ScopeOrder::Stop => {
                if let Some(scope) = &mut self.scope {
                    scope.stop();
                }
            }
            ScopeOrder::Status => return Ok(Some(self.status())),
            ScopeOrder::Save(path) => self.save(path)?,
        }
        Ok(None)
    }

    fn status(&self) -> String {
        match &self.scope {
            None => "scope not armed".to_owned(),
            Some(scope) => {
                let state = match scope.state() {
                    ScopeState::Filling => "filling the pre-trigger",
                    ScopeState::Armed => "waiting for the trigger",
                    ScopeState::Running => "recording",
                    ScopeState::Done => "done",
                };
                format!("scope {state}, {} rows", scope.recording().rows().count())
            }
        }
    }

    /// Begins to write the recording, in a thread of its own: the drive's milliseconds wait for no disk.
    fn save(&mut self, path: PathBuf) -> Result<(), String> {
        let Some(scope) = &self.scope else {
            return Err("there is no recording to save; `scope arm` starts one".to_owned());
        };
        if self.saving.is_some() {
            return Err("the recording before is still being written; ask again when that is told".to_owned());
        }
        let format = Format::of(&path)?;
        let table = scope.recording().table();
        let file = Provisional::create(&path)?;
        self.saving = Some(thread::spawn(move || {
            format.write(&table, &path, file)?;
            Ok(format!("{} rows in {}", table.rows(), path.display()))
        }));
        Ok(())
    }

    /// What became of the recording that was being written, once.
    pub(crate) fn poll_saved(&mut self) -> Option<Result<String, String>> {
        let saved = self.saving.take_if(|saving| saving.is_finished())?;
        Some(
            saved
                .join()
                .unwrap_or_else(|_| Err("the recording could not be written".to_owned())),
        )
    }
}

/// What a recording is written as.
#[derive(Debug, Clone, Copy)]
enum Format {
    Csv,
    Parquet,
    Picture,
}

impl Format {
    fn of(path: &Path) -> Result<Self, String> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        match extension.unwrap_or_default().to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "parquet" => Ok(Self::Parquet),
            "svg" | "png" => Ok(Self::Picture),
            _ => Err(format!(
                "scope save {}: the name must end in .csv, .parquet, .svg or .png",
                path.display()
            )),
        }
    }

    fn write(self, table: &Table, path: &Path, file: Provisional) -> Result<(), String> {
        match self {
            Self::Csv => file.keep(|out| table.write_csv(out)),
            Self::Parquet => file.keep(|out| table.write_parquet(out)),
            Self::Picture => {
                let svg = table.draw_svg("Oscilloscope").map_err(|error| error.to_string())?;
                let octets = picture::for_file(path, &svg).map_err(|error| error.to_string())?;
                file.keep(|out| out.write_all(&octets))
            }
        }
    }
}

impl FromStr for ScopeOrder {
    type Err = String;

    /// The words behind `scope`.
    fn from_str(line: &str) -> Result<Self, String> {
        // A name may have spaces.
        if let Some(path) = line.trim().strip_prefix("save ") {
            return Ok(Self::Save(path.trim().into()));
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let signal = |name: &str| name.parse::<Signal>().map_err(|error| error.to_string());
        match words[..] {
            ["channels", names] => {
                let channels = names.split(',').map(signal).collect::<Result<_, _>>()?;
                Ok(Self::Channels(channels))
            }
            ["trigger", "none"] => Ok(Self::Trigger(None)),
            ["trigger", name, direction, level] => {
                let edge = match direction {
                    "rising" => Edge::Rising,
                    "falling" => Edge::Falling,
                    _ => return Err(format!("`{direction}`: allowed is rising or falling")),
                };
                let level = level
                    .parse()
                    .ok()
                    .filter(|level: &f64| level.is_finite())
                    .ok_or_else(|| format!("trigger level `{level}` is not a number"))?;
                let signal = signal(name)?;
                Ok(Self::Trigger(Some(Trigger { signal, level, edge })))
            }
            ["interval", ms] => number(ms, 1, 60_000, "an interval in ms").map(Self::IntervalMs),
            ["depth", "unlimited"] => Ok(Self::Depth(Depth::Unlimited)),
            ["depth", rows] => number(rows, 1, 100_000_000, "a number of samples")
                .map(|rows| Self::Depth(Depth::Samples(rows as usize))),
            ["pre", percent] => number(percent, 0, 100, "a share in %").map(|percent| Self::PrePercent(percent as u8)),
            ["arm"] => Ok(Self::Arm),
            ["stop"] => Ok(Self::Stop),
            ["status"] => Ok(Self::Status),
            _ => Err(format!("`scope {}` is no order; there are {HELP}", line.trim())),
        }
    }
}

fn number(text: &str, min: u32, max: u32, what: &str) -> Result<u32, String> {
    text.parse()
        .ok()
        .filter(|value| (min..=max).contains(value))
        .ok_or_else(|| format!("`{text}`: allowed is {what} from {min} to {max}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use lenze9300_model::TICKS_PER_MS;
    use lenze9300_model::device::DriveConfig;

    fn order(desk: &mut ScopeDesk, line: &str) -> Result<Option<String>, String> {
        line.parse().and_then(|order| desk.obey(order))
    }

    #[test]
    fn a_recording_is_set_up_armed_triggered_and_saved_in_every_format() {
        let mut desk = ScopeDesk::default();
        let mut drive = Drive::new(DriveConfig::default());
        for line in [
            "channels N-ACT,U-DC",
            "trigger U-DC falling 500",
            "interval 2",
            "depth 100",
            "pre 20",
            "arm",
        ] {
            assert_eq!(order(&mut desk, line), Ok(None), "{line}");
        }
        let run = |desk: &mut ScopeDesk, drive: &mut Drive, ms: u32| {
            for _ in 0..ms {
                for _ in 0..TICKS_PER_MS {
                    drive.tick();
                }
                desk.sample(drive);
            }
        };
        run(&mut desk, &mut drive, 100);
        let told = order(&mut desk, "status").expect("it can be told");
        assert_eq!(told.as_deref(), Some("scope waiting for the trigger, 20 rows"));
        drive.set_mains(lenze9300_model::plant::Mains::Off);
        run(&mut desk, &mut drive, 1200);
        let told = order(&mut desk, "status").expect("it can be told");
        assert_eq!(told.as_deref(), Some("scope done, 100 rows"));

        let folder = std::env::temp_dir().join(format!("lenze9300-scope-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder of its own");
        for (extension, begins) in [
            ("csv", "time_s,N-ACT 1/min,U-DC V\n-0.04,"),
            ("parquet", "PAR1"),
            ("svg", "<svg "),
            ("png", "PNG"),
        ] {
            let path = folder.join(format!("a recording.{extension}"));
            assert_eq!(order(&mut desk, &format!("save {}", path.display())), Ok(None));
            let busy = order(&mut desk, &format!("save {}", path.display()));
            assert!(busy.is_err_and(|why| why.contains("still being written")));
            let told = loop {
                if let Some(told) = desk.poll_saved() {
                    break told;
                }
                thread::yield_now();
            };
            assert_eq!(told, Ok(format!("100 rows in {}", path.display())));
            let octets = std::fs::read(&path).expect("the file is there");
            // A PNG begins with an octet that is no text.
            let octets = octets.strip_prefix(b"\x89").unwrap_or(&octets);
            assert!(octets.starts_with(begins.as_bytes()), "{extension}");
        }
        let told = order(&mut desk, &format!("save {}", folder.join("r.txt").display())).expect_err("no such format");
        assert!(told.contains(".csv, .parquet, .svg or .png"), "{told}");
        std::fs::remove_dir_all(&folder).expect("it goes again");
    }

    #[test]
    fn what_is_no_order_is_told_with_what_is() {
        let mut desk = ScopeDesk::default();
        for (line, told) in [
            ("trigger N-ACT up 5", "`up`: allowed is rising or falling"),
            ("trigger N-ACT rising x", "trigger level `x` is not a number"),
            ("interval 0", "`0`: allowed is an interval in ms from 1 to 60000"),
            ("depth 0", "`0`: allowed is a number of samples from 1 to 100000000"),
            ("pre 101", "`101`: allowed is a share in % from 0 to 100"),
            ("save r.csv", "there is no recording to save; `scope arm` starts one"),
        ] {
            assert_eq!(order(&mut desk, line), Err(told.to_owned()), "{line}");
        }
        let unknown = order(&mut desk, "channels N-ACT,X").expect_err("no such signal");
        assert!(unknown.contains("`X` is no signal; there are POS-SETP"), "{unknown}");
        let unknown = order(&mut desk, "go").expect_err("no such order");
        assert!(unknown.contains("is no order; there are scope channels"), "{unknown}");
    }
}
