//! Columns of numbers with names and units, as an oscilloscope records them: written as CSV for people and spreadsheets, as Parquet
//! for programs, as SVG for the eye.

mod plot;

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{Repetition, Type as PhysicalType};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

pub use plot::TablePlotError;

/// One column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Column {
    /// Name, such as `POS-ACT`.
    pub name: String,
    /// Unit, such as `inc`; empty for a pure number.
    pub unit: String,
    /// Values, a row each.
    pub values: Vec<f64>,
}

impl Column {
    /// A column without values yet.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            values: Vec::new(),
        }
    }
}

/// Columns of the same length; the first is the time by custom.
///
/// # Example
///
/// ```
/// use lenze9300_model::table::{Column, Table};
///
/// let mut table = Table::new([Column::new("time_s", ""), Column::new("N-ACT", "1/min")]);
/// table.push(&[0.0, 2814.5]);
/// table.push(&[0.001, 2814.6]);
/// let mut csv = Vec::new();
/// table.write_csv(&mut csv)?;
/// assert_eq!(csv, b"time_s,N-ACT 1/min\n0,2814.5\n0.001,2814.6\n");
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    columns: Vec<Column>,
}

impl Table {
    /// A table of these columns.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self {
            columns: columns.into_iter().collect(),
        }
    }

    /// The columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Number of rows: that of the shortest column.
    pub fn rows(&self) -> usize {
        self.columns.iter().map(|column| column.values.len()).min().unwrap_or(0)
    }

    /// Adds a row. What is more than there are columns is left out, what is missing is no number.
    pub fn push(&mut self, row: &[f64]) {
        for (n, column) in self.columns.iter_mut().enumerate() {
            column.values.push(row.get(n).copied().unwrap_or(f64::NAN));
        }
    }

    /// Writes CSV: a heading of names with units, then a line a row, each number as short as it reads back the same.
    ///
    /// # Errors
    ///
    /// Whatever the writer reports.
    pub fn write_csv(&self, out: &mut impl Write) -> io::Result<()> {
        for (n, column) in self.columns.iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            let gap = if column.unit.is_empty() { "" } else { " " };
            write!(out, "{comma}{}{gap}{}", column.name, column.unit)?;
        }
        writeln!(out)?;
        for row in 0..self.rows() {
            for (n, column) in self.columns.iter().enumerate() {
                let comma = if n == 0 { "" } else { "," };
                write!(out, "{comma}{}", column.values[row])?;
            }
            writeln!(out)?;
        }
        out.flush()
    }

    /// Writes Parquet: a required DOUBLE for each column under its name, not compressed; units stand in the metadata of the file
    /// as `unit:NAME`. The same table gives the same octets.
    ///
    /// # Errors
    ///
    /// Whatever the writer reports; a table whose columns share a name is not valid data.
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
        let mut fields = Vec::with_capacity(self.columns.len());
        for (n, column) in self.columns.iter().enumerate() {
            if self.columns[..n].iter().any(|other| other.name == column.name) {
                return Err(ParquetError::General(format!(
                    "there are two columns named {}",
                    column.name
                )));
            }
            let field = Type::primitive_type_builder(&column.name, PhysicalType::DOUBLE)
                .with_repetition(Repetition::REQUIRED)
                .build()?;
            fields.push(Arc::new(field));
        }
        let schema = Arc::new(Type::group_type_builder("trace").with_fields(fields).build()?);
        let units = self.columns.iter().filter(|column| !column.unit.is_empty());
        let metadata = units.map(|column| KeyValue::new(format!("unit:{}", column.name), column.unit.clone()));
        let properties = WriterProperties::builder()
            .set_created_by(concat!("lenze9300-model ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_dictionary_enabled(false)
            .set_key_value_metadata(Some(metadata.collect()))
            .build();
        let mut file = SerializedFileWriter::new(&mut *out, schema, Arc::new(properties))?;
        let rows = self.rows();
        let mut group = file.next_row_group()?;
        for column in &self.columns {
            if let Some(mut writer) = group.next_column()? {
                writer
                    .typed::<DoubleType>()
                    .write_batch(&column.values[..rows], None, None)?;
                writer.close()?;
            }
        }
        group.close()?;
        file.close()?;
        out.flush()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytes::Bytes;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    fn table() -> Table {
        let mut table = Table::new([Column::new("time_s", ""), Column::new("POS-ACT", "inc")]);
        for n in 0..5000 {
            table.push(&[f64::from(n) / 1000.0, f64::from(n * n) - 0.25]);
        }
        table
    }

    fn parquet(table: &Table) -> Vec<u8> {
        let mut out = Vec::new();
        table.write_parquet(&mut out).expect("a vector takes everything");
        out
    }

    #[test]
    fn parquet_is_read_back_with_every_value_and_unit() {
        let octets = parquet(&table());
        assert_eq!(octets, parquet(&table()), "the same table, the same octets");
        let reader = SerializedFileReader::new(Bytes::from(octets)).expect("a Parquet file");
        let metadata = reader.metadata().file_metadata();
        assert_eq!(metadata.num_rows(), 5000);
        let unit = metadata
            .key_value_metadata()
            .and_then(|list| list.iter().find(|entry| entry.key == "unit:POS-ACT"))
            .and_then(|entry| entry.value.as_deref());
        assert_eq!(unit, Some("inc"));
        for (n, row) in reader.get_row_iter(None).expect("rows").enumerate() {
            let row = row.expect("a row");
            let n = n as f64;
            assert_eq!(row.get_double(0).ok(), Some(n / 1000.0));
            assert_eq!(row.get_double(1).ok(), Some(n * n - 0.25));
        }
    }

    #[test]
    fn an_empty_table_is_a_file_without_rows() {
        let table = Table::new([Column::new("time_s", "")]);
        let reader = SerializedFileReader::new(Bytes::from(parquet(&table))).expect("a Parquet file");
        assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
    }

    #[test]
    fn two_columns_of_one_name_are_refused() {
        let table = Table::new([Column::new("a", ""), Column::new("a", "")]);
        let error = table.write_parquet(&mut Vec::new()).expect_err("no such file");
        assert!(error.to_string().contains("two columns named a"), "{error}");
    }
}
