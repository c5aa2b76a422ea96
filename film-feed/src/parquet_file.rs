//! Reading Parquet files that others may have spoilt.

use std::panic::{AssertUnwindSafe, catch_unwind};

use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};

/// Lets `read` work on a file.
///
/// The library checks less than it should: of files with spoilt pages it panics. So what can be seen beforehand is looked at here, and what
/// is left is caught, which spoils nothing: the reader is gone then.
///
/// # Errors
/// What is wrong with the file, as `broken` makes it of the library's error; or what `read` says.
pub(crate) fn read<R: ChunkReader + 'static, T, E>(
    from: R,
    broken: impl Fn(ParquetError) -> E,
    read: impl FnOnce(&SerializedFileReader<R>) -> Result<T, E>,
) -> Result<T, E> {
    let result = catch_unwind(AssertUnwindSafe(|| {
        let reader = open(from).map_err(&broken)?;
        read(&reader)
    }));
    result.unwrap_or_else(|_| Err(broken(ParquetError::General("its pages are spoilt".to_owned()))))
}

/// A reader of a file whose columns lie within the file: of others the library panics.
///
/// # Errors
/// What is wrong with the file.
fn open<R: ChunkReader + 'static>(from: R) -> Result<SerializedFileReader<R>, ParquetError> {
    let length = from.len();
    let reader = SerializedFileReader::new(from)?;
    let metadata = reader.metadata();
    let within = |offset: i64, size: i64| {
        let end = u64::try_from(offset).ok().zip(u64::try_from(size).ok());
        end.and_then(|(offset, size)| offset.checked_add(size))
            .is_some_and(|end| end <= length)
    };
    let rows = metadata.file_metadata().num_rows();
    let columns = metadata.row_groups().iter().flat_map(|group| group.columns());
    let sound = columns.into_iter().all(|column| {
        let first = column
            .dictionary_page_offset()
            .unwrap_or_else(|| column.data_page_offset());
        within(first, column.compressed_size())
            && within(column.data_page_offset(), 0)
            && (0..=rows).contains(&column.num_values())
    });
    let groups: Option<i64> = metadata.row_groups().iter().try_fold(0_i64, |sum, group| {
        sum.checked_add(group.num_rows()).filter(|_| group.num_rows() >= 0)
    });
    if sound && groups == Some(rows) {
        Ok(reader)
    } else {
        Err(ParquetError::General("its columns lie outside the file".to_owned()))
    }
}
