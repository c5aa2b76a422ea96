//! One point of a sweep: a machine and its feeds.

use lenze9300_model::noise;
use thiserror::Error;
use toml::{Table, Value};

use super::parameter::{self, Place, Setting};
use super::{Outcome, Row, SweepSpec};
use crate::machine_file::MachineFile;
use crate::operator::FeedPlan;
use crate::rig::RigConfig;
use crate::run::{self, Observation};

/// A point whose values make no machine that can run.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("point {point} ({settings}): {what}")]
pub struct ImpossiblePoint {
    /// Its number, from 1.
    pub point: u64,
    /// The values it has.
    pub settings: String,
    /// What is wrong with them.
    pub what: String,
}

impl ImpossiblePoint {
    fn new(point: u64, names: impl Iterator<Item = impl AsRef<str>>, settings: &[Setting], what: String) -> Self {
        let settings: Vec<String> = names
            .zip(settings)
            .map(|(name, setting)| format!("{} = {setting}", name.as_ref()))
            .collect();
        Self {
            point,
            settings: settings.join(", "),
            what,
        }
    }

    /// The mistake without the value that makes it.
    pub(super) fn kind(&self) -> &str {
        self.what.split(", got").next().unwrap_or_default()
    }
}

/// A machine of a sweep, ready to run.
#[derive(Debug, Clone)]
pub struct SweptMachine {
    /// The number of its point, from 1.
    pub point: u64,
    /// Its seed.
    pub seed: u64,
    /// The values of the parameters that are varied.
    pub settings: Vec<Setting>,
    /// The chain.
    pub rig: RigConfig,
    /// The feeds.
    pub plan: FeedPlan,
    /// How far a feed may be from what was asked for, mm.
    pub tolerance_mm: f64,
    names: Vec<String>,
}

/// Channel of the counter-based noise that the seeds of the machines are taken from.
const SEED_CHANNEL: u64 = 0x7377_6565;

impl SweepSpec {
    /// The machine of a point, numbered from 1.
    ///
    /// # Errors
    /// [`ImpossiblePoint`] with the first thing that is wrong.
    pub fn machine(&self, point: u64) -> Result<SweptMachine, ImpossiblePoint> {
        let settings = self.settings(point);
        // 32 bits, so that every table holds it exactly.
        let seed = match self.seeds {
            super::spec::Seeds::Same => u64::from(self.seed),
            super::spec::Seeds::Each => noise::bits(u64::from(self.seed), SEED_CHANNEL, point) >> 32,
        };
        let names = || self.parameters.iter().map(|parameter| parameter.name.as_str());
        let (machine, rig) = self
            .build(names().zip(&settings), seed)
            .map_err(|what| ImpossiblePoint::new(point, names(), &settings, what))?;
        Ok(SweptMachine {
            point,
            seed,
            rig,
            plan: machine.feed_plan(self.feeds as usize),
            tolerance_mm: machine.feed.tolerance_mm,
            names: names().map(str::to_owned).collect(),
            settings,
        })
    }

    /// The machine with what `[set]` says and these values.
    pub(super) fn build<'a>(
        &'a self,
        values: impl Iterator<Item = (&'a str, &'a Setting)>,
        seed: u64,
    ) -> Result<(MachineFile, RigConfig), String> {
        let mut file = self.machine.clone();
        let mut for_chain = Vec::new();
        let set = self.set.iter().map(|(name, setting)| (name.as_str(), setting));
        for (name, setting) in set.chain(values) {
            match parameter::place(name)? {
                Place::Chain => for_chain.push((name, setting)),
                Place::MachineFile { table, key } => put(&mut file, table, key, toml_value(setting)),
            }
        }
        // Lines of this text stand in no file; the key that is wrong is named.
        let machine = MachineFile::read(&file.to_string(), &self.catalogue).map_err(|error| {
            let what = error.mistakes.first().map(|mistake| mistake.what.clone());
            what.unwrap_or_else(|| error.to_string())
        })?;
        let mut rig = machine.rig_config(seed).map_err(|error| error.to_string())?;
        rig.drive.axis.noise_seed = seed;
        for (name, setting) in &for_chain {
            parameter::apply(&mut rig, name, setting)?;
        }
        let noise = for_chain.iter().find(|(name, _)| name.starts_with("noise."));
        if let Some((name, _)) = noise.filter(|_| !rig.drive.axis.fidelity.has_errors()) {
            return Err(format!(
                "{name} acts from fidelity f2 on, this is {}; set run.fidelity = \"f2\"",
                rig.drive.axis.fidelity
            ));
        }
        Ok((machine, rig))
    }
}

impl SweptMachine {
    /// Runs the feeds.
    ///
    /// # Errors
    /// [`ImpossiblePoint`] when the chain cannot be put together.
    pub fn run(self) -> Result<Row, ImpossiblePoint> {
        let result = run::simulated(&self.rig, self.plan, Observation::FeedsOnly, || {});
        let (report, _) = result
            .map_err(|error| ImpossiblePoint::new(self.point, self.names.iter(), &self.settings, error.to_string()))?;
        Ok(Row {
            point: self.point,
            seed: self.seed,
            settings: self.settings,
            outcome: Outcome::new(&report, self.tolerance_mm),
        })
    }
}

fn put(file: &mut Table, table: Option<&str>, key: &str, value: Value) {
    let target = match table {
        None => file,
        Some(name) => {
            let entry = file.entry(name).or_insert_with(|| Value::Table(Table::new()));
            match entry.as_table_mut() {
                Some(table) => table,
                // The reader tells what is wrong with a table that is none.
                None => return,
            }
        }
    };
    target.insert(key.to_owned(), value);
}

/// Whole numbers are written as such: some keys take nothing else, the others take them, too.
fn toml_value(setting: &Setting) -> Value {
    match setting {
        Setting::Word(word) => Value::String(word.clone()),
        Setting::Number(number) if number.fract() == 0.0 && number.abs() < 1e15 => Value::Integer(*number as i64),
        Setting::Number(number) => Value::Float(*number),
    }
}
