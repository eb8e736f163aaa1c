//! Logs of robots as tables.

use datafusion::arrow::array::{ArrayRef, ListBuilder, PrimitiveBuilder, RecordBatch, UInt32Array};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::{DataType, Field, Float64Type, Schema};
use datafusion::parquet::arrow::ArrowWriter;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// A log: per row q, q̇, q̈ and efforts of each joint, to four decimals, as loggers write them.
#[derive(Clone, Debug)]
pub struct Log {
    /// Numbers of a list.
    pub joints: usize,
    /// The number of its first row.
    pub first: usize,
    /// Row by row, q, q̇, q̈ and efforts.
    pub columns: [Vec<f64>; 4],
}

/// So many rows at 100 Hz of joints that swing at different rates.
pub fn log(joints: usize, rows: usize) -> Log {
    log_at(100.0, joints, 0..rows)
}

/// Those rows at another rate \[Hz\].
pub fn log_at(rate: f64, joints: usize, rows: Range<usize>) -> Log {
    let four_decimals = |x: f64| (x * 1e4).round() / 1e4;
    let of = |order: usize| {
        let number = |row: usize, joint: usize| {
            let (t, w) = (row as f64 / rate, 0.7 + 0.45 * joint as f64);
            let (sine, cosine) = (w * t + joint as f64).sin_cos();
            let slow = (0.31 * w * t).cos();
            four_decimals(match order {
                0 => 0.8 * sine + 0.4 * slow - 0.2,
                1 => 0.8 * w * cosine - 0.4 * 0.31 * w * (0.31 * w * t).sin(),
                2 => -0.8 * w * w * sine - 0.4 * (0.31 * w).powi(2) * slow,
                _ => 20.0 * sine - 7.5 * slow + 3.0 * joint as f64,
            })
        };
        rows.clone().flat_map(|row| (0..joints).map(move |joint| (row, joint))).map(|(r, j)| number(r, j)).collect()
    };
    Log { joints, first: rows.start, columns: [0, 1, 2, 3].map(of) }
}

impl Log {
    /// How many rows.
    pub fn rows(&self) -> usize {
        self.columns[0].len() / self.joints
    }

    /// A table with the columns `id`, `q`, `qd`, `qdd`, `effort`, whose lists are of that kind.
    pub fn batch(&self, kind: &DataType) -> RecordBatch {
        let lists = self.columns.iter().map(|numbers| {
            let mut list = ListBuilder::new(PrimitiveBuilder::<Float64Type>::new());
            numbers.chunks(self.joints).for_each(|row| list.append_value(row.iter().copied().map(Some)));
            cast(&(Arc::new(list.finish()) as ArrayRef), kind).expect("a list of another kind")
        });
        let (first, rows) = (self.first as u32, self.rows() as u32);
        let id = Arc::new(UInt32Array::from_iter_values(first..first + rows)) as ArrayRef;
        let columns: Vec<ArrayRef> = std::iter::once(id).chain(lists).collect();
        let names = ["id", "q", "qd", "qdd", "effort"];
        let field = |(name, column): (&&str, &ArrayRef)| Field::new(*name, column.data_type().clone(), true);
        let fields: Vec<Field> = names.iter().zip(&columns).map(field).collect();
        RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).expect("columns of one length")
    }

    /// The same with lists as most logs have them.
    pub fn table(&self) -> RecordBatch {
        self.batch(&lists())
    }
}

/// The lists of most logs.
pub fn lists() -> DataType {
    DataType::new_list(DataType::Float64, true)
}

/// Writes tables of one schema as a Parquet file.
pub fn write(path: &Path, tables: impl IntoIterator<Item = RecordBatch>) {
    let mut tables = tables.into_iter().peekable();
    let schema = tables.peek().expect("a table").schema();
    let file = std::fs::File::create(path).expect("a file that can be made");
    let mut writer = ArrowWriter::try_new(file, schema, None).expect("types that Parquet has");
    tables.for_each(|table| writer.write(&table).expect("a table of that schema"));
    writer.close().expect("room for the file");
}
