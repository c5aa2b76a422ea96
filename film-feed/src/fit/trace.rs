//! Traces of an axis, from files of ours or of Global Drive Control.

use std::f64::consts::{SQRT_2, TAU};

use lenze9300_model::units::INC_PER_REV;
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader};
use parquet::record::RowAccessor;
use thiserror::Error;

use crate::parquet_file;

/// What the numbers of a trace that come without a physical unit refer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct References {
    /// C0011: 100 % of a speed, 1/min.
    pub n_max_rpm: f64,
    /// C0057: 100 % of a torque, Nm.
    pub torque_nm: f64,
    /// Torque constant, Nm per ampere rms.
    pub torque_constant_nm_a: f64,
}

/// The axis of the thesis: 3000 1/min; 1.05 Nm at C0022 = 1.35 A; 0.70 Nm / 0.90 A.
impl Default for References {
    fn default() -> Self {
        References {
            n_max_rpm: 3000.0,
            torque_nm: 1.05,
            torque_constant_nm_a: 0.70 / 0.90,
        }
    }
}

/// Columns of the same length, in SI units, at equal distances of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Time from one row to the next, s.
    pub dt_s: f64,
    /// Speed of the motor, rad/s.
    pub omega_rad_s: Vec<f64>,
    /// Torque of the motor, Nm.
    pub torque_nm: Vec<f64>,
    /// Whether the torque is the mean over the time of a row, not its value at one moment.
    pub torque_is_mean: bool,
    /// Speed set-value of the position controller (MCTRL-NSET2), rad/s.
    pub omega_set_rad_s: Option<Vec<f64>>,
    /// Speed of the interpolator (POS-NOUT), rad/s.
    pub omega_forward_rad_s: Option<Vec<f64>>,
    /// Following error, in the unit of the file.
    pub following_error: Option<FollowingError>,
}

/// A following error.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowingError {
    /// Values, a row each.
    pub values: Vec<f64>,
    /// Radians at the motor for 1; `None` for lengths, whose gear the trace itself has to tell.
    pub rad_per_unit: Option<f64>,
    /// Actual position in the same unit.
    pub position: Option<Vec<f64>>,
}

/// Why a file is no trace.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TraceError {
    /// No line names known signals.
    #[error(
        "no line names a time and a speed; expected is a heading such as `time_s,mctrl_nact_rpm,torque_nm` or `Time [ms];MCTRL-NACT [%];M-ACT [Nm]`"
    )]
    NoHeading,
    /// A signal is missing.
    #[error("there is no column for the {what}; known are {known}")]
    Missing {
        /// Which one.
        what: &'static str,
        /// Names by which it would be known.
        known: &'static str,
    },
    /// A column has a unit that is not known for it.
    #[error("column `{column}`: the unit `{unit}` is unknown here; known are {known}")]
    Unit {
        /// The heading of the column.
        column: String,
        /// The unit.
        unit: String,
        /// Units it can have.
        known: &'static str,
    },
    /// A field is no number.
    #[error("line {line}, column `{column}`: `{got}` is no number")]
    Number {
        /// Line of the file, from 1.
        line: usize,
        /// The heading of the column.
        column: String,
        /// What stands there.
        got: String,
    },
    /// The times are not evenly spaced.
    #[error("line {line}: the time steps by {got_s} s, {expected_s} s is the step of the file; record without gaps")]
    Spacing {
        /// Line of the file, from 1.
        line: usize,
        /// The step there.
        got_s: f64,
        /// The mean step.
        expected_s: f64,
    },
    /// It is no Parquet file, or holds other than numbers.
    #[error("it cannot be read as Parquet: {0}")]
    Parquet(String),
    /// There are too few rows.
    #[error("there are {rows} rows, at least 3 are needed")]
    TooShort {
        /// How many.
        rows: usize,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Time,
    Speed,
    SpeedForward,
    SpeedSet,
    TorqueMean,
    Torque,
    CurrentQ,
    TorqueSet,
    PositionSet,
    Position,
    FollowingError,
}

/// Names in small letters and digits only.
const NAMES: &[(&str, Quantity)] = &[
    ("time", Quantity::Time),
    ("t", Quantity::Time),
    ("zeit", Quantity::Time),
    ("nact", Quantity::Speed),
    ("mctrlnact", Quantity::Speed),
    ("posnout", Quantity::SpeedForward),
    ("mctrlnset2", Quantity::SpeedSet),
    ("torquemean", Quantity::TorqueMean),
    ("torque", Quantity::Torque),
    ("mact", Quantity::Torque),
    ("iq", Quantity::CurrentQ),
    ("mctrlmset2", Quantity::TorqueSet),
    ("possetp", Quantity::PositionSet),
    ("posact", Quantity::Position),
    ("poserr", Quantity::FollowingError),
];

struct Column {
    heading: String,
    quantity: Quantity,
    unit: String,
    place: usize,
}

impl Trace {
    /// Reads a trace: ours with commas, or one with semicolons or tabs and decimal commas, as programs on German computers export them.
    ///
    /// What stands before the heading is passed over, and so are columns with unknown names. A unit follows its name in brackets, after a
    /// space or an underscore: `MCTRL-NACT [%]`, `N-ACT 1/min`, `torque_nm`. Text that is no UTF-8 is taken for Latin-1.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn read(octets: &[u8], references: &References) -> Result<Self, TraceError> {
        let text = match std::str::from_utf8(octets) {
            Ok(text) => text.trim_start_matches('\u{feff}').to_owned(),
            Err(_) => octets.iter().map(|octet| char::from(*octet)).collect(),
        };
        let mut lines = text.lines().enumerate();
        let (separator, columns) = lines.find_map(|(_, line)| heading(line)).ok_or(TraceError::NoHeading)?;
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        let mut numbers_of_lines = Vec::new();
        for (n, line) in lines {
            if line.trim().is_empty() {
                continue;
            }
            numbers_of_lines.push(n + 1);
            let fields: Vec<&str> = line.split(separator).collect();
            for (column, values) in columns.iter().zip(&mut values) {
                let field = fields
                    .get(column.place)
                    .map_or("", |field| field.trim().trim_matches('"'));
                let number = if separator == ',' {
                    field.parse()
                } else {
                    field.replace(',', ".").parse()
                };
                values.push(number.map_err(|_| TraceError::Number {
                    line: n + 1,
                    column: column.heading.clone(),
                    got: field.to_owned(),
                })?);
            }
        }
        Self::assemble(&columns, &values, &numbers_of_lines, references)
    }

    /// Reads a trace that `film-feed run --trace` or `lenze9300 serve` wrote as Parquet; units stand in the names or in the metadata as
    /// `unit:NAME`. Mistakes name rows, from 1, as lines.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn read_parquet(from: impl ChunkReader + 'static, references: &References) -> Result<Self, TraceError> {
        let broken = |error: ParquetError| TraceError::Parquet(error.to_string());
        parquet_file::read(from, broken, |reader| {
            let metadata = reader.metadata().file_metadata();
            let units = metadata.key_value_metadata().cloned().unwrap_or_default();
            let fields = metadata.schema().get_fields();
            let columns: Vec<Column> = fields
                .iter()
                .enumerate()
                .filter_map(|(place, field)| {
                    let key = format!("unit:{}", field.name());
                    let unit = units
                        .iter()
                        .find(|pair| pair.key == key)
                        .and_then(|pair| pair.value.clone());
                    let heading = match unit {
                        Some(unit) => format!("{} [{unit}]", field.name()),
                        None => field.name().to_owned(),
                    };
                    column(&heading, place)
                })
                .collect();
            if !names_time_and_speed(&columns) {
                return Err(TraceError::NoHeading);
            }
            let mut values: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
            for row in reader.get_row_iter(None).map_err(broken)? {
                let row = row.map_err(broken)?;
                for (column, values) in columns.iter().zip(&mut values) {
                    values.push(row.get_double(column.place).map_err(broken)?);
                }
            }
            let numbers: Vec<usize> = (1..=values[0].len()).collect();
            Self::assemble(&columns, &values, &numbers, references)
        })
    }

    fn assemble(
        columns: &[Column],
        values: &[Vec<f64>],
        numbers_of_lines: &[usize],
        references: &References,
    ) -> Result<Self, TraceError> {
        let of = |quantity| {
            let place = columns.iter().position(|column| column.quantity == quantity)?;
            Some((&columns[place], &values[place]))
        };
        let scaled = |quantity, units: &[(&str, f64)], known| -> Result<Option<Vec<f64>>, TraceError> {
            let Some((column, values)) = of(quantity) else {
                return Ok(None);
            };
            let factor = units.iter().find(|(unit, _)| *unit == column.unit);
            let (_, factor) = factor.ok_or_else(|| TraceError::Unit {
                column: column.heading.clone(),
                unit: column.unit.clone(),
                known,
            })?;
            Ok(Some(values.iter().map(|value| value * factor).collect()))
        };

        let times = scaled(
            Quantity::Time,
            &[("s", 1.0), ("", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6)],
            "s, ms, µs",
        )?;
        let times = times.ok_or(TraceError::Missing {
            what: "time",
            known: "time, t, Zeit",
        })?;
        let dt_s = spacing(&times, numbers_of_lines)?;

        let rpm = TAU / 60.0;
        let speed_units = [
            ("rpm", rpm),
            ("1/min", rpm),
            ("rad/s", 1.0),
            ("%", references.n_max_rpm / 100.0 * rpm),
        ];
        let speed = |quantity| scaled(quantity, &speed_units, "rpm, 1/min, rad/s, % of C0011");
        let omega_rad_s = speed(Quantity::Speed)?.ok_or(TraceError::Missing {
            what: "speed",
            known: "N-ACT, MCTRL-NACT",
        })?;

        let percent_nm = references.torque_nm / 100.0;
        let a_peak_nm = references.torque_constant_nm_a / SQRT_2;
        let mut torque = None;
        for quantity in [
            Quantity::TorqueMean,
            Quantity::Torque,
            Quantity::CurrentQ,
            Quantity::TorqueSet,
        ] {
            let units: &[(&str, f64)] = match quantity {
                Quantity::CurrentQ => &[("a", a_peak_nm)],
                _ => &[("nm", 1.0), ("%", percent_nm)],
            };
            if let Some(values) = scaled(quantity, units, "Nm, % of C0057; A peak for I-Q")? {
                torque = Some((quantity, values));
                break;
            }
        }
        let (torque_quantity, torque_nm) = torque.ok_or(TraceError::Missing {
            what: "torque",
            known: "torque, torque_mean, M-ACT, I-Q, MCTRL-MSET2",
        })?;
        Ok(Trace {
            dt_s,
            omega_rad_s,
            torque_nm,
            torque_is_mean: torque_quantity == Quantity::TorqueMean,
            omega_set_rad_s: speed(Quantity::SpeedSet)?,
            omega_forward_rad_s: speed(Quantity::SpeedForward)?,
            following_error: following_error(&of),
        })
    }
}

/// From the signal itself, or from the two positions. The controller of this millisecond saw the position at the end of the one before.
fn following_error<'t>(of: &impl Fn(Quantity) -> Option<(&'t Column, &'t Vec<f64>)>) -> Option<FollowingError> {
    let rad_per_unit = |unit: &str| (unit == "inc").then_some(TAU / INC_PER_REV as f64);
    let position = of(Quantity::Position);
    if let Some((column, values)) = of(Quantity::FollowingError) {
        let position = position.filter(|(other, _)| other.unit == column.unit);
        return Some(FollowingError {
            values: values.clone(),
            rad_per_unit: rad_per_unit(&column.unit),
            position: position.map(|(_, values)| values.clone()),
        });
    }
    let ((set_column, set), (column, position)) = (of(Quantity::PositionSet)?, position?);
    if set_column.unit != column.unit {
        return None;
    }
    let before = position.first().into_iter().chain(position);
    Some(FollowingError {
        values: set.iter().zip(before).map(|(set, actual)| set - actual).collect(),
        rad_per_unit: rad_per_unit(&column.unit),
        position: Some(position.clone()),
    })
}

/// The separator and the known columns of a heading; `None` when it names no time and no speed.
fn heading(line: &str) -> Option<(char, Vec<Column>)> {
    let separator = [';', '\t', ',']
        .into_iter()
        .find(|separator| line.contains(*separator))?;
    let columns: Vec<Column> = line
        .split(separator)
        .enumerate()
        .filter_map(|(place, field)| column(field.trim().trim_matches('"'), place))
        .collect();
    names_time_and_speed(&columns).then_some((separator, columns))
}

fn column(heading: &str, place: usize) -> Option<Column> {
    let (name, unit) = name_and_unit(heading);
    let quantity = NAMES.iter().find(|(known, _)| *known == name)?.1;
    Some(Column {
        heading: heading.to_owned(),
        quantity,
        unit,
        place,
    })
}

fn names_time_and_speed(columns: &[Column]) -> bool {
    let has = |quantity| columns.iter().any(|column| column.quantity == quantity);
    has(Quantity::Time) && has(Quantity::Speed)
}

/// `MCTRL-NACT [%]`, `N-ACT 1/min`, `torque_nm`: the name in small letters and digits only, the unit in small letters.
fn name_and_unit(field: &str) -> (String, String) {
    const UNITS: [&str; 13] = [
        "s", "ms", "us", "µs", "rpm", "1/min", "rad/s", "%", "nm", "a", "mm", "inc", "deg",
    ];
    let field = field.to_lowercase();
    let plain = |text: &str| text.chars().filter(char::is_ascii_alphanumeric).collect::<String>();
    if let Some((name, rest)) = field.split_once(['[', '(']) {
        let unit = rest.split([']', ')']).next().unwrap_or_default().trim();
        return (plain(name), unit.to_owned());
    }
    if let Some((name, unit)) = field.rsplit_once([' ', '_'])
        && UNITS.contains(&unit)
    {
        return (plain(name), unit.to_owned());
    }
    (plain(&field), String::new())
}

/// The step of the times, which has to be the same everywhere within a hundredth, or within the digits they are written with.
fn spacing(times: &[f64], numbers_of_lines: &[usize]) -> Result<f64, TraceError> {
    let (Some(first), Some(last), true) = (times.first(), times.last(), times.len() >= 3) else {
        return Err(TraceError::TooShort { rows: times.len() });
    };
    let expected_s = (last - first) / (times.len() - 1) as f64;
    for (pair, line) in times.windows(2).zip(numbers_of_lines.iter().skip(1)) {
        let got_s = pair[1] - pair[0];
        if !(expected_s > 0.0 && (got_s - expected_s).abs() <= 0.01 * expected_s) {
            return Err(TraceError::Spacing {
                line: *line,
                got_s,
                expected_s,
            });
        }
    }
    Ok(expected_s)
}
