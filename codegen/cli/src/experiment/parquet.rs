//! Samples in Parquet files: columns of doubles, as CSV has them.

use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_simulation::table::DataTable;

/// Whether a file's name says that it is a Parquet file.
pub fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"))
}

/// What is said of Parquet files by a build that does not know them.
#[cfg(not(feature = "parquet"))]
const LEFT_OUT: &str =
    "this `straightline` was built without Parquet: build it with `--features parquet`, or write CSV or JSON";

/// The columns of a Parquet file: flat, of numbers, without gaps.
///
/// # Errors
/// What is wrong with the file, or that this build does not read it.
#[cfg(not(feature = "parquet"))]
pub fn read(_: &Path) -> Result<DataTable, String> {
    Err(LEFT_OUT.to_string())
}

/// The bytes of a Parquet file with these columns, one row group, compressed by Snappy.
///
/// # Errors
/// What the library says, or that this build does not write it.
#[cfg(not(feature = "parquet"))]
pub fn bytes(_: &DataTable) -> Result<Vec<u8>, String> {
    Err(LEFT_OUT.to_string())
}

/// A column that has as many numbers in each row.
#[derive(Clone, Debug, PartialEq)]
pub struct WideColumn {
    /// Its name.
    pub name: String,
    /// Numbers in a row.
    pub width: usize,
    /// All of them, row by row.
    pub numbers: Vec<f64>,
}

/// Columns of these names that a Parquet file has, of numbers or of lists of as many numbers in each row.
///
/// # Errors
/// What is wrong with the file, or that this build does not read it.
#[cfg(not(feature = "parquet"))]
pub fn wide_columns(_: &Path, _: &[&str]) -> Result<Vec<WideColumn>, String> {
    Err(LEFT_OUT.to_string())
}

#[cfg(feature = "parquet")]
pub use known::{bytes, read, wide_columns};

/// The samples of a file as what the reader of samples takes: of a Parquet file the CSV text of its columns, all digits of every
/// number with them, so that a complaint about a row stands at its line.
///
/// # Errors
/// What is wrong with the file.
pub fn source(path: &Path, shown: &str) -> Result<Source, String> {
    match is_parquet(path) {
        true => read(path).map(|table| Source::new(shown, table.csv())),
        false => std::fs::read(path).map(|bytes| Source::from_bytes(shown, bytes)).map_err(|error| error.to_string()),
    }
}

#[cfg(feature = "parquet")]
mod known {
    use super::{DataTable, Path, WideColumn};
    use ::parquet::basic::{Compression, Repetition, Type as Physical};
    use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
    use ::parquet::data_type::{DataType, DoubleType};
    use ::parquet::errors::ParquetError;
    use ::parquet::file::properties::WriterProperties;
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::file::writer::SerializedFileWriter;
    use ::parquet::schema::types::Type;
    use std::sync::Arc;

    /// The columns of a Parquet file: flat, of numbers, without gaps.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn read(path: &Path) -> Result<DataTable, String> {
        let file = std::fs::File::open(path).map_err(|error| error.to_string())?;
        let reader = SerializedFileReader::new(file).map_err(said)?;
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
        for (group, metadata) in reader.metadata().row_groups().iter().enumerate() {
            let rows = usize::try_from(metadata.num_rows()).map_err(|error| error.to_string())?;
            let group = reader.get_row_group(group).map_err(said)?;
            for (k, (name, column)) in names.iter().zip(&mut columns).enumerate() {
                if schema.column(k).max_rep_level() > 0 {
                    return Err(format!("column `{name}` holds lists; there is one number in a row"));
                }
                let mut numbers = of_column(name, group.get_column_reader(k).map_err(said)?, rows)?;
                if numbers.len() != rows {
                    return Err(format!("column `{name}` has gaps: {} numbers in {rows} rows", numbers.len()));
                }
                column.append(&mut numbers);
            }
        }
        let rows = columns.first().map_or(0, Vec::len);
        let rows = (0..rows).map(|i| columns.iter().map(|column| column[i]).collect()).collect();
        Ok(DataTable { names, rows })
    }

    /// Columns of these names that a Parquet file has, of numbers or of lists of as many numbers in each row.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn wide_columns(path: &Path, wanted: &[&str]) -> Result<Vec<WideColumn>, String> {
        let file = std::fs::File::open(path).map_err(|error| error.to_string())?;
        let reader = SerializedFileReader::new(file).map_err(said)?;
        let schema = reader.metadata().file_metadata().schema_descr_ptr();
        let mut found = Vec::new();
        for k in 0..schema.num_columns() {
            // columns of lists have their name in front
            let name = schema.column(k).path().parts()[0].clone();
            if !wanted.contains(&name.as_str()) {
                continue;
            }
            let (mut all, mut rows) = (Vec::new(), 0);
            for (group, metadata) in reader.metadata().row_groups().iter().enumerate() {
                let own = usize::try_from(metadata.num_rows()).map_err(|error| error.to_string())?;
                let group = reader.get_row_group(group).map_err(said)?;
                all.extend(of_column(&name, group.get_column_reader(k).map_err(said)?, own)?);
                rows += own;
            }
            let width = all.len().checked_div(rows).unwrap_or(0);
            if width * rows != all.len() || (width == 0 && rows > 0) {
                return Err(format!("column `{name}` has gaps: {} numbers in {rows} rows", all.len()));
            }
            found.push(WideColumn { name, width, numbers: all });
        }
        Ok(found)
    }

    fn of_column(name: &str, column: ColumnReader, rows: usize) -> Result<Vec<f64>, String> {
        let numbers = match column {
            ColumnReader::DoubleColumnReader(column) => numbers(column, rows, |x| x),
            ColumnReader::FloatColumnReader(column) => numbers(column, rows, f64::from),
            ColumnReader::Int32ColumnReader(column) => numbers(column, rows, f64::from),
            ColumnReader::Int64ColumnReader(column) => numbers(column, rows, |x| x as f64),
            _ => return Err(format!("column `{name}` holds no numbers")),
        };
        numbers.map_err(|error| format!("column `{name}`: {}", said(error)))
    }

    fn numbers<T: DataType>(
        mut column: ColumnReaderImpl<T>,
        rows: usize,
        number: impl Fn(T::T) -> f64,
    ) -> Result<Vec<f64>, ParquetError> {
        let (mut values, mut levels, mut repeated, mut read) = (Vec::new(), Vec::new(), Vec::new(), 0);
        while read < rows {
            let (more, ..) = column.read_records(rows - read, Some(&mut levels), Some(&mut repeated), &mut values)?;
            if more == 0 {
                break;
            }
            read += more;
        }
        Ok(values.into_iter().map(number).collect())
    }

    /// The bytes of a Parquet file with these columns, one row group, compressed by Snappy.
    ///
    /// # Errors
    /// What the library says.
    pub fn bytes(table: &DataTable) -> Result<Vec<u8>, String> {
        written(table).map_err(said)
    }

    fn written(table: &DataTable) -> Result<Vec<u8>, ParquetError> {
        let field = |name: &String| {
            let field = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
            field.build().map(Arc::new)
        };
        let fields = table.names.iter().map(field).collect::<Result<Vec<_>, _>>()?;
        let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
        let properties = Arc::new(WriterProperties::builder().set_compression(Compression::SNAPPY).build());
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties)?;
        let mut group = writer.next_row_group()?;
        let mut k = 0;
        while let Some(mut column) = group.next_column()? {
            let numbers: Vec<f64> = table.rows.iter().map(|row| row[k]).collect();
            column.typed::<DoubleType>().write_batch(&numbers, None, None)?;
            column.close()?;
            k += 1;
        }
        group.close()?;
        writer.close()?;
        Ok(bytes)
    }

    fn said(error: ParquetError) -> String {
        error.to_string()
    }
}
