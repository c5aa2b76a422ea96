//! What `step` and `bode` have in common: which loop, of which axis, and where the result goes.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use lenze9300_model::code::table::{CODE_TABLE, Form};
use lenze9300_model::code::{CodeError, CodeStore, Inhibit};
use lenze9300_model::picture;
use lenze9300_model::response::{LinearLoop, LoopFigures, LoopKind, Margins, StepResponse};
use lenze9300_model::{AxisParams, ControllerCodes};

use crate::outcome::say;
use crate::provisional::Provisional;

/// Options of both subcommands.
#[derive(Debug, Args)]
pub(crate) struct LoopArgs {
    /// Which loop.
    #[arg(long = "loop", value_name = "LOOP")]
    pub(crate) which: LoopName,
    /// Inertia of rotor and resolver, kg m², 1e-7…1.
    #[arg(long, value_name = "KGM2", value_parser = parse_inertia)]
    inertia: Option<f64>,
    /// Inertia of the load, reduced to the motor, kg m², 0…1.
    #[arg(long, value_name = "KGM2", value_parser = parse_load_inertia)]
    load_inertia: Option<f64>,
    /// Period of the current controller, 10…250 µs: 125 at a chopping frequency of 8 kHz, 62.5 at 16 kHz.
    #[arg(long, value_name = "US", default_value = "125", value_parser = parse_tick)]
    tick: u64,
    /// A code and its value, such as C0070=6.5 or C0254/0=0.8; may be repeated. Between two steps of the code it is
    /// cut, as in the drive. The other codes are those of the film feed.
    #[arg(long = "set", value_name = "Cxxxx/y=VALUE", value_parser = parse_setting)]
    settings: Vec<Setting>,
    /// One JSON object on standard output instead of the table.
    #[arg(long)]
    pub(crate) json: bool,
    /// Draw the curve, as SVG, or as PNG by the name of the file.
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
}

/// The loops by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LoopName {
    /// Current controller, shaft locked.
    Current,
    /// Speed controller.
    Speed,
    /// Position controller.
    Position,
}

impl LoopName {
    pub(crate) fn kind(self) -> LoopKind {
        match self {
            Self::Current => LoopKind::Current,
            Self::Speed => LoopKind::Speed,
            Self::Position => LoopKind::Position,
        }
    }
}

/// Whether the closed loop comes to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    Stable,
    Unstable,
}

/// A code and the value it gets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Setting {
    code: u16,
    subcode: u8,
    value: f64,
}

impl LoopArgs {
    /// The axis that the options describe.
    pub(crate) fn axis(&self) -> Result<AxisParams, String> {
        let mut codes = CodeStore::thesis();
        for setting in &self.settings {
            setting.write_to(&mut codes)?;
        }
        let mut params = AxisParams {
            codes: ControllerCodes::from_store(&codes),
            tick_ns: self.tick,
            ..AxisParams::default()
        };
        let mechanics = &mut params.mechanics;
        mechanics.j_rotor_kg_m2 = self.inertia.unwrap_or(mechanics.j_rotor_kg_m2);
        mechanics.j_load_kg_m2 = self.load_inertia.unwrap_or(mechanics.j_load_kg_m2);
        let gain = self.which.kind().gains(&params).k_p;
        if gain <= 0.0 || params.torque_max_nm() <= 0.0 {
            return Err(format!(
                "the {} loop has no gain with these codes; C0022, C0070, C0075 and C0254 must be above 0",
                self.which.kind().name()
            ));
        }
        Ok(params)
    }
}

impl Setting {
    /// Writes as the keypad does: in the code's own unit, checked against its range.
    fn write_to(self, codes: &mut CodeStore) -> Result<(), String> {
        let Self { code, subcode, value } = self;
        let named = format!("--set C{code:04}/{subcode}={value}");
        let Some(entry) = CODE_TABLE.iter().find(|entry| entry.number == code) else {
            return Err(format!("{named}: the drive has no code C{code:04}"));
        };
        let factor = match entry.form {
            Form::FixedPoint4 => 10_000.0,
            Form::Plain => 1.0,
        };
        let raw = (value * factor).round();
        if !(raw >= f64::from(i32::MIN) && raw <= f64::from(i32::MAX)) {
            return Err(format!("{named}: the value does not fit the 32 bits of a code"));
        }
        codes
            .write(code, subcode, raw as i32, Inhibit::Active)
            .map(|_| ())
            .map_err(|error| match error {
                CodeError::TooHigh { .. } | CodeError::TooLow { .. } => {
                    let [min, max] = [entry.domain.min(), entry.domain.max()].map(|raw| f64::from(raw) / factor);
                    let allowed = format!("{named}: allowed is {min}…{max} {}", entry.unit);
                    allowed.trim_end().to_string()
                }
                other => format!("{named}: {other}"),
            })
    }
}

/// A loop in both views.
pub(crate) struct Measured {
    /// Missing when the loop is unstable.
    pub(crate) step: Option<StepResponse>,
    pub(crate) open_loop: LinearLoop,
    figures: LoopFigures,
}

impl Measured {
    /// Measures a loop; one that does not come to rest is not asked for its step response.
    pub(crate) fn new(args: &LoopArgs) -> Result<Self, String> {
        let (kind, params) = (args.which.kind(), args.axis()?);
        let open_loop = LinearLoop::new(&params, kind);
        let step = open_loop.is_stable().then(|| StepResponse::measure(&params, kind));
        let figures = LoopFigures::new(kind, &params, step.as_ref(), &Margins::of(&open_loop));
        Ok(Self {
            step,
            open_loop,
            figures,
        })
    }

    /// Prints the figures, and a sentence when they are not those of a small signal.
    pub(crate) fn print(&self, args: &LoopArgs) -> Result<Verdict, String> {
        let text = if args.json {
            self.figures.to_json()
        } else {
            self.figures.to_string()
        };
        say(&text)?;
        if self.step.as_ref().is_some_and(StepResponse::limited) {
            eprintln!(
                "lenze9300: a limit of torque or voltage held the controller during the step, so these are not the figures of a \
                 small signal; a lower gain avoids it"
            );
        }
        Ok(if self.step.is_some() {
            Verdict::Stable
        } else {
            Verdict::Unstable
        })
    }
}

/// Writes a picture beside nothing half-done: under another name first.
pub(crate) fn write_picture(path: &Path, svg: &str) -> Result<(), String> {
    let octets = picture::for_file(path, svg).map_err(|error| error.to_string())?;
    Provisional::create(path)?.keep(|out| out.write_all(&octets))
}

fn parse_inertia(text: &str) -> Result<f64, String> {
    parse_within(text, 1e-7, 1.0, "kg m²")
}

fn parse_load_inertia(text: &str) -> Result<f64, String> {
    parse_within(text, 0.0, 1.0, "kg m²")
}

/// Nanoseconds from microseconds.
fn parse_tick(text: &str) -> Result<u64, String> {
    parse_within(text, 10.0, 250.0, "µs").map(|tick_us| (tick_us * 1000.0).round() as u64)
}

fn parse_within(text: &str, min: f64, max: f64, unit: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if (min..=max).contains(&value) => Ok(value),
        _ => Err(format!("allowed is {min}…{max} {unit}")),
    }
}

fn parse_setting(text: &str) -> Result<Setting, String> {
    let shape = "a setting looks like C0070=6.5 or C1301/1=1200";
    let (name, value) = text.split_once('=').ok_or(shape)?;
    let digits = name.trim().strip_prefix(['C', 'c']).ok_or(shape)?;
    let (code, subcode) = digits.split_once('/').unwrap_or((digits, "0"));
    Ok(Setting {
        code: code.parse().map_err(|_| shape)?,
        subcode: subcode.parse().map_err(|_| shape)?,
        value: value
            .trim()
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite())
            .ok_or(shape)?,
    })
}
