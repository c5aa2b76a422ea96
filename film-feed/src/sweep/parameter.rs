//! What can be varied, by dotted names.

use std::fmt;
use std::ops::RangeInclusive;

use lenze9300_model::code::{Domain, Form, entry};
use lenze9300_model::plant::Fidelity;

use crate::machine::WebParams;
use crate::rig::RigConfig;

/// The value of a parameter at a point.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// A number.
    Number(f64),
    /// One of several words, such as `mark` for `feed.mode`.
    Word(String),
}

impl fmt::Display for Setting {
    /// As short as it reads back the same.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Setting::Number(number) => write!(f, "{number}"),
            Setting::Word(word) => f.write_str(word),
        }
    }
}

/// A parameter of the chain that a MACHINE.toml does not have.
struct RunParameter {
    name: &'static str,
    meaning: &'static str,
    allowed: RangeInclusive<f64>,
    apply: fn(&mut RigConfig, f64),
}

/// Parameters of the chain that a MACHINE.toml does not have.
///
/// Any of `web.…` makes the film elastic ([`WebParams`]); those of `noise.…` act from `run.fidelity = "f2"` on.
const RUN_PARAMETERS: &[RunParameter] = &[
    RunParameter {
        name: "run.bit_error_rate",
        meaning: "probability that a bit on the bus is wrong",
        allowed: 0.0..=0.001,
        apply: |rig, value| rig.bit_error_rate = value,
    },
    RunParameter {
        name: "noise.current_a",
        meaning: "half width of the noise of a current measurement, A",
        allowed: 0.0..=10.0,
        apply: |rig, value| rig.drive.axis.current_sensor.noise_a = value,
    },
    RunParameter {
        name: "noise.resolver_inc",
        meaning: "half width of the noise of the resolver, increments",
        allowed: 0.0..=1000.0,
        apply: |rig, value| rig.drive.axis.feedback.errors.noise_inc = value,
    },
    RunParameter {
        name: "noise.resolver_once_arcmin",
        meaning: "error of the resolver once a turn, arcmin",
        allowed: 0.0..=600.0,
        apply: |rig, value| rig.drive.axis.feedback.errors.once_arcmin = value,
    },
    RunParameter {
        name: "noise.resolver_twice_arcmin",
        meaning: "error of the resolver twice a turn, arcmin",
        allowed: 0.0..=600.0,
        apply: |rig, value| rig.drive.axis.feedback.errors.twice_arcmin = value,
    },
    RunParameter {
        name: "web.modulus_pa",
        meaning: "modulus of elasticity of the film, Pa",
        allowed: 1e6..=1e12,
        apply: |rig, value| web(rig).modulus_pa = value,
    },
    RunParameter {
        name: "web.thickness_m",
        meaning: "thickness of the film, m",
        allowed: 1e-6..=0.01,
        apply: |rig, value| web(rig).thickness_m = value,
    },
    RunParameter {
        name: "web.span_m",
        meaning: "free length from roll to roller, m",
        allowed: 0.3..=100.0,
        apply: |rig, value| web(rig).span_m = value,
    },
    RunParameter {
        name: "web.roll_radius_m",
        meaning: "radius of the roll at the start, m",
        allowed: 0.04..=2.0,
        apply: |rig, value| web(rig).roll_radius_m = value,
    },
    RunParameter {
        name: "web.brake_nm",
        meaning: "torque of the brake on the roll, Nm",
        allowed: 0.0..=1000.0,
        apply: |rig, value| web(rig).brake_nm = value,
    },
    RunParameter {
        name: "web.grip_n",
        meaning: "tension at which the film slips, N",
        allowed: 0.1..=1e6,
        apply: |rig, value| web(rig).grip_n = value,
    },
    RunParameter {
        name: "web.creep_per_n",
        meaning: "share of the travel that the film falls behind, per newton",
        allowed: 0.0..=0.01,
        apply: |rig, value| web(rig).creep_per_n = value,
    },
];

const FIDELITY: &str = "run.fidelity";

fn web(rig: &mut RigConfig) -> &mut WebParams {
    rig.film.web.get_or_insert_with(WebParams::default)
}

/// Names, meanings and ranges of the parameters that a MACHINE.toml does not have.
pub fn run_parameters() -> impl Iterator<Item = (&'static str, &'static str, String)> {
    let levels: Vec<&str> = Fidelity::ALL.iter().map(|level| level.name()).collect();
    let fidelity = (FIDELITY, "how closely the axis is modelled", levels.join(", "));
    let others = RUN_PARAMETERS.iter().map(|parameter| {
        let (from, to) = (parameter.allowed.start(), parameter.allowed.end());
        (parameter.name, parameter.meaning, format!("{from} to {to}"))
    });
    std::iter::once(fidelity).chain(others)
}

/// Where a parameter acts.
pub(super) enum Place<'a> {
    /// A key of a MACHINE.toml, in a table or at the top.
    MachineFile {
        /// The table, if it stands in one.
        table: Option<&'a str>,
        /// The key.
        key: &'a str,
    },
    /// In the chain itself.
    Chain,
}

/// Where a parameter acts, or that none has this name. Keys of the machine's file are checked by its reader.
pub(super) fn place(name: &str) -> Result<Place<'_>, String> {
    const CHAIN: [&str; 3] = ["run", "noise", "web"];
    let (table, key) = match name.split_once('.') {
        Some((table, key)) => (Some(table), key),
        None => (None, name),
    };
    if !table.is_some_and(|table| CHAIN.contains(&table)) {
        return Ok(Place::MachineFile { table, key });
    }
    let mut known = run_parameters().map(|(known, ..)| known);
    if known.any(|known| known == name) {
        return Ok(Place::Chain);
    }
    let known: Vec<&str> = run_parameters().map(|(known, ..)| known).collect();
    Err(format!(
        "`{name}` is unknown; beside the keys of a MACHINE.toml there are {}",
        known.join(", ")
    ))
}

/// Puts a value into the chain.
pub(super) fn apply(rig: &mut RigConfig, name: &str, value: &Setting) -> Result<(), String> {
    if name == FIDELITY {
        let level = match value {
            Setting::Word(word) => word.parse().ok(),
            Setting::Number(_) => None,
        };
        let levels: Vec<&str> = Fidelity::ALL.iter().map(|level| level.name()).collect();
        rig.drive.axis.fidelity =
            level.ok_or_else(|| format!("{name}: expected {}, got {value}", levels.join(", ")))?;
        return Ok(());
    }
    let Some(parameter) = RUN_PARAMETERS.iter().find(|parameter| parameter.name == name) else {
        return Ok(());
    };
    let (from, to) = (parameter.allowed.start(), parameter.allowed.end());
    match value {
        Setting::Number(number) if parameter.allowed.contains(number) => {
            (parameter.apply)(rig, *number);
            Ok(())
        }
        _ => Err(format!("{name}: expected {from} to {to}, got {value}")),
    }
}

/// The step that a code's value has to have; 0 for other parameters, which take any number.
pub(super) fn step(name: &str) -> f64 {
    let Some(code) = name.strip_prefix("codes.C") else {
        return 0.0;
    };
    let number = code.split('/').next().and_then(|digits| digits.parse().ok());
    number.and_then(entry).map_or(0.0, |entry| {
        let least = match entry.form {
            Form::FixedPoint4 => 1e-4,
            Form::Plain => 1.0,
        };
        match entry.domain {
            Domain::Range { step, .. } => least * f64::from(step),
            Domain::Selection(_) => least,
        }
    })
}
