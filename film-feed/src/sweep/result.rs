//! The result as a table: written and read as CSV and Parquet, put together from parts.

use std::io::{self, Read, Write};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::record::Field;
use parquet::schema::types::Type;
use thiserror::Error;

use super::outcome::{OUTPUTS, Outcome};
use super::{Setting, SweepSpec};
use crate::parquet_file;

/// What one machine came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The number of its point, from 1.
    pub point: u64,
    /// Its seed, 32 bits.
    pub seed: u64,
    /// The values of the parameters that are varied.
    pub settings: Vec<Setting>,
    /// How its feeds went.
    pub outcome: Outcome,
}

/// The result of a sweep or of a part of it, a row for each machine.
///
/// Columns: `sweep` (fingerprint of SPEC and machine), `points` (of the whole sweep), `point` (from 1), `seed`, one for each parameter
/// under its name, those of [`OUTPUTS`], `aborted` (why the run of this machine ended early, else empty).
///
/// - CSV: a heading, fields after RFC 4180, numbers as short as they read back the same, missing ones empty.
/// - Parquet: counts INT64, figures optional DOUBLE, texts UTF-8; not compressed.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultTable {
    /// Fingerprint of SPEC and machine.
    pub sweep: String,
    /// Points of the whole sweep.
    pub points: u64,
    /// Names of the parameters that are varied.
    pub parameters: Vec<String>,
    /// A row for each machine that has run.
    pub rows: Vec<Row>,
}

/// Why a file is no result of a sweep.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TableError {
    /// It cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is no CSV.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// It is no Parquet file.
    #[error(transparent)]
    Parquet(#[from] ParquetError),
    /// Its columns are others.
    #[error("the columns are not those of a sweep: expected sweep, points, point, seed, parameters, feeds … aborted")]
    Columns,
    /// A field is not what the column holds.
    #[error("row {row}, column {column}: expected {expected}, got `{got}`")]
    Field {
        /// Row behind the heading, from 1.
        row: usize,
        /// Name of the column.
        column: String,
        /// What the column holds.
        expected: &'static str,
        /// What stands there.
        got: String,
    },
    /// A row belongs to another sweep than the first one.
    #[error("row {row} belongs to another sweep than row 1")]
    Mixed {
        /// Row behind the heading, from 1.
        row: usize,
    },
}

const HEAD: [&str; 4] = ["sweep", "points", "point", "seed"];
const ABORTED: &str = "aborted";

impl ResultTable {
    /// A table without rows yet.
    pub fn new(spec: &SweepSpec) -> Self {
        ResultTable {
            sweep: spec.fingerprint().to_owned(),
            points: spec.points(),
            parameters: spec.parameters().map(str::to_owned).collect(),
            rows: Vec::new(),
        }
    }

    /// Brings the rows into the order of their points.
    pub fn sort(&mut self) {
        self.rows.sort_by_key(|row| row.point);
    }

    fn columns(&self) -> impl Iterator<Item = &str> {
        HEAD.into_iter()
            .chain(self.parameters.iter().map(String::as_str))
            .chain(OUTPUTS.iter().map(|output| output.name))
            .chain([ABORTED])
    }

    fn fields(&self, row: &Row) -> Vec<String> {
        let mut fields = vec![
            self.sweep.clone(),
            self.points.to_string(),
            row.point.to_string(),
            row.seed.to_string(),
        ];
        fields.extend(row.settings.iter().map(ToString::to_string));
        fields.extend(row.outcome.values.iter().map(|value| match value.is_finite() {
            true => value.to_string(),
            false => String::new(),
        }));
        fields.push(row.outcome.aborted.clone());
        fields
    }

    /// Writes the heading of a CSV file.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write_csv_heading(&self, out: &mut impl Write) -> io::Result<()> {
        write_record(out, self.columns())
    }

    /// Writes one line of a CSV file.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write_csv_row(&self, row: &Row, out: &mut impl Write) -> io::Result<()> {
        write_record(out, self.fields(row).iter().map(String::as_str))
    }

    /// Writes the table as CSV.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        self.write_csv_heading(out)?;
        for row in &self.rows {
            self.write_csv_row(row, out)?;
        }
        out.flush()
    }

    /// Reads a CSV file. A last line without its end, as a stopped sweep may leave it, is left out.
    ///
    /// # Errors
    /// [`TableError`].
    pub fn read_csv(mut from: impl Read) -> Result<Self, TableError> {
        let mut text = String::new();
        from.read_to_string(&mut text)?;
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut reader = csv::Reader::from_reader(whole.as_bytes());
        let columns: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
        let mut parts = Parts::new(columns)?;
        for record in reader.records() {
            let record = record?;
            parts.push(record.iter().map(str::to_owned).collect())?;
        }
        Ok(parts.table)
    }

    /// Writes the table as Parquet; the same table gives the same octets.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write_parquet(&self, out: &mut (impl Write + Send)) -> io::Result<()> {
        self.try_write_parquet(out).map_err(|error| match error {
            ParquetError::External(inner) => match inner.downcast::<io::Error>() {
                Ok(error) => *error,
                Err(other) => io::Error::other(other),
            },
            other => io::Error::new(io::ErrorKind::InvalidData, other),
        })
    }

    fn try_write_parquet(&self, out: &mut (impl Write + Send)) -> Result<(), ParquetError> {
        let is_word = |place: usize| {
            let mut settings = self.rows.iter().filter_map(|row| row.settings.get(place));
            settings.any(|setting| matches!(setting, Setting::Word(_)))
        };
        let mut fields = vec![text("sweep")?, whole("points")?, whole("point")?, whole("seed")?];
        for (place, name) in self.parameters.iter().enumerate() {
            fields.push(if is_word(place) { text(name)? } else { real(name)? });
        }
        for output in OUTPUTS {
            fields.push(if output.is_count {
                whole(output.name)?
            } else {
                real(output.name)?
            });
        }
        fields.push(text(ABORTED)?);
        let fields = fields.into_iter().map(Arc::new).collect();
        let schema = Arc::new(Type::group_type_builder("sweep").with_fields(fields).build()?);
        let properties = WriterProperties::builder()
            .set_created_by(concat!("film-feed ", env!("CARGO_PKG_VERSION")).to_owned())
            .build();
        let mut file = SerializedFileWriter::new(&mut *out, schema, Arc::new(properties))?;
        let mut group = file.next_row_group()?;
        let rows = &self.rows;
        write_texts(&mut group, rows.iter().map(|_| self.sweep.as_str()))?;
        write_counts(&mut group, rows.iter().map(|_| self.points as i64))?;
        write_counts(&mut group, rows.iter().map(|row| row.point as i64))?;
        write_counts(&mut group, rows.iter().map(|row| row.seed as i64))?;
        for place in 0..self.parameters.len() {
            if is_word(place) {
                let words: Vec<String> = rows.iter().map(|row| row.settings[place].to_string()).collect();
                write_texts(&mut group, words.iter().map(String::as_str))?;
            } else {
                let numbers = rows.iter().map(|row| match row.settings[place] {
                    Setting::Number(number) => number,
                    Setting::Word(_) => f64::NAN,
                });
                write_reals(&mut group, numbers)?;
            }
        }
        for (place, output) in OUTPUTS.iter().enumerate() {
            let values = rows.iter().map(|row| row.outcome.values[place]);
            if output.is_count {
                write_counts(&mut group, values.map(|value| value as i64))?;
            } else {
                write_reals(&mut group, values)?;
            }
        }
        write_texts(&mut group, rows.iter().map(|row| row.outcome.aborted.as_str()))?;
        group.close()?;
        file.close()?;
        out.flush()?;
        Ok(())
    }

    /// Reads a Parquet file.
    ///
    /// # Errors
    /// [`TableError`].
    pub fn read_parquet(from: impl ChunkReader + 'static) -> Result<Self, TableError> {
        parquet_file::read(from, TableError::from, |reader| {
            let schema = reader.metadata().file_metadata().schema().clone();
            let columns = schema
                .get_fields()
                .iter()
                .map(|field| field.name().to_owned())
                .collect();
            let mut parts = Parts::new(columns)?;
            for row in reader.get_row_iter(None)? {
                let fields = row?.into_columns().into_iter().map(|(_, field)| match field {
                    Field::Null => String::new(),
                    Field::Str(text) => text,
                    Field::Long(whole) => whole.to_string(),
                    Field::Double(real) => real.to_string(),
                    other => other.to_string(),
                });
                parts.push(fields.collect())?;
            }
            Ok(parts.table)
        })
    }
}

/// A table being put together from the fields of its rows.
struct Parts {
    table: ResultTable,
    columns: Vec<String>,
}

impl Parts {
    fn new(columns: Vec<String>) -> Result<Self, TableError> {
        let tail: Vec<&str> = OUTPUTS.iter().map(|output| output.name).chain([ABORTED]).collect();
        let parameters = columns
            .strip_prefix(HEAD.map(str::to_owned).as_slice())
            .and_then(|rest| rest.len().checked_sub(tail.len()).map(|middle| rest.split_at(middle)))
            .filter(|(_, end)| end.iter().map(String::as_str).eq(tail.iter().copied()))
            .map(|(middle, _)| middle.to_vec())
            .ok_or(TableError::Columns)?;
        Ok(Parts {
            table: ResultTable {
                sweep: String::new(),
                points: 0,
                parameters,
                rows: Vec::new(),
            },
            columns,
        })
    }

    fn push(&mut self, fields: Vec<String>) -> Result<(), TableError> {
        let row = self.table.rows.len() + 1;
        if fields.len() != self.columns.len() {
            return Err(TableError::Columns);
        }
        let wrong = |place: usize, expected| TableError::Field {
            row,
            column: self.columns[place].clone(),
            expected,
            got: fields[place].clone(),
        };
        let whole = |place: usize| -> Result<u64, TableError> {
            fields[place].parse().map_err(|_| wrong(place, "a whole number"))
        };
        let (points, point, seed) = (whole(1)?, whole(2)?, whole(3)?);
        if row == 1 {
            self.table.sweep.clone_from(&fields[0]);
            self.table.points = points;
        } else if self.table.sweep != fields[0] || self.table.points != points {
            return Err(TableError::Mixed { row });
        }
        let first_output = HEAD.len() + self.table.parameters.len();
        let settings = fields[HEAD.len()..first_output]
            .iter()
            .map(|field| match field.parse() {
                Ok(number) => Setting::Number(number),
                Err(_) => Setting::Word(field.clone()),
            })
            .collect();
        let values = (first_output..first_output + OUTPUTS.len())
            .map(|place| match fields[place].as_str() {
                "" => Ok(f64::NAN),
                field => field.parse().map_err(|_| wrong(place, "a number")),
            })
            .collect::<Result<Vec<f64>, TableError>>()?;
        let aborted = fields.last().cloned().unwrap_or_default();
        self.table.rows.push(Row {
            point,
            seed,
            settings,
            outcome: Outcome { values, aborted },
        });
        Ok(())
    }
}

/// Why parts do not make a whole.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MergeError {
    /// There is nothing to merge.
    #[error("there are no rows to merge")]
    Empty,
    /// Two parts are of different sweeps.
    #[error("part {part} is of another sweep ({got}) than part 1 ({expected}): SPEC, machine or version differ")]
    OtherSweep {
        /// Number of the part, from 1.
        part: usize,
        /// Fingerprint of the first part.
        expected: String,
        /// Its own fingerprint.
        got: String,
    },
    /// A point stands in two parts with different results.
    #[error("point {point} stands in two parts with different results")]
    Contradiction {
        /// The point.
        point: u64,
    },
    /// Some points are in no part.
    #[error(
        "{missing} of {points} points are missing, the first is point {first}; run the shards they belong to (point − 1 modulo N, plus 1) with --resume"
    )]
    Missing {
        /// How many are missing.
        missing: u64,
        /// How many there are.
        points: u64,
        /// The first missing one.
        first: u64,
    },
}

/// Puts parts of one sweep together. A point that stands in several with the same result counts once.
///
/// # Errors
/// [`MergeError`]; the table is whole or not at all.
pub fn merge(parts: Vec<ResultTable>) -> Result<ResultTable, MergeError> {
    let mut parts = parts.into_iter().enumerate().filter(|(_, part)| !part.rows.is_empty());
    let (_, mut whole) = parts.next().ok_or(MergeError::Empty)?;
    for (place, part) in parts {
        if (&part.sweep, part.points, &part.parameters) != (&whole.sweep, whole.points, &whole.parameters) {
            return Err(MergeError::OtherSweep {
                part: place + 1,
                expected: whole.sweep,
                got: part.sweep,
            });
        }
        whole.rows.extend(part.rows);
    }
    whole.sort();
    if let Some(pair) = whole
        .rows
        .windows(2)
        .find(|pair| pair[0].point == pair[1].point && !same(&pair[0], &pair[1]))
    {
        return Err(MergeError::Contradiction { point: pair[0].point });
    }
    whole.rows.dedup_by_key(|row| row.point);
    let missing = whole.points - (whole.rows.len() as u64).min(whole.points);
    if missing > 0 {
        let gap = whole.rows.iter().zip(1..).find(|(row, point)| row.point != *point);
        return Err(MergeError::Missing {
            missing,
            points: whole.points,
            first: gap.map_or(whole.rows.len() as u64 + 1, |(_, point)| point),
        });
    }
    Ok(whole)
}

/// Bit for bit; a missing figure equals a missing one.
fn same(a: &Row, b: &Row) -> bool {
    let bits = |row: &Row| -> Vec<u64> { row.outcome.values.iter().map(|value| value.to_bits()).collect() };
    a.settings == b.settings && a.outcome.aborted == b.outcome.aborted && bits(a) == bits(b)
}

/// A line of CSV (RFC 4180), ended by a line feed alone.
fn write_record<'f>(out: &mut impl Write, fields: impl Iterator<Item = &'f str>) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(fields)?;
    out.write_all(
        &writer
            .into_inner()
            .map_err(|error| io::Error::other(error.to_string()))?,
    )
}

fn whole(name: &str) -> Result<Type, ParquetError> {
    Type::primitive_type_builder(name, PhysicalType::INT64)
        .with_repetition(Repetition::REQUIRED)
        .build()
}

fn real(name: &str) -> Result<Type, ParquetError> {
    Type::primitive_type_builder(name, PhysicalType::DOUBLE)
        .with_repetition(Repetition::OPTIONAL)
        .build()
}

fn text(name: &str) -> Result<Type, ParquetError> {
    Type::primitive_type_builder(name, PhysicalType::BYTE_ARRAY)
        .with_repetition(Repetition::REQUIRED)
        .with_logical_type(Some(LogicalType::String))
        .build()
}

type Group<'g, W> = SerializedRowGroupWriter<'g, W>;

fn write_counts<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = i64>,
) -> Result<(), ParquetError> {
    let values: Vec<i64> = values.collect();
    if let Some(mut column) = group.next_column()? {
        column.typed::<Int64Type>().write_batch(&values, None, None)?;
        column.close()?;
    }
    Ok(())
}

fn write_reals<W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = f64>,
) -> Result<(), ParquetError> {
    let values: Vec<f64> = values.collect();
    let defined: Vec<i16> = values.iter().map(|value| i16::from(value.is_finite())).collect();
    let values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    if let Some(mut column) = group.next_column()? {
        column
            .typed::<DoubleType>()
            .write_batch(&values, Some(&defined), None)?;
        column.close()?;
    }
    Ok(())
}

fn write_texts<'t, W: Write + Send>(
    group: &mut Group<'_, W>,
    values: impl Iterator<Item = &'t str>,
) -> Result<(), ParquetError> {
    let values: Vec<ByteArray> = values.map(ByteArray::from).collect();
    if let Some(mut column) = group.next_column()? {
        column.typed::<ByteArrayType>().write_batch(&values, None, None)?;
        column.close()?;
    }
    Ok(())
}
