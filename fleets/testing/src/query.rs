//! Queries, their rows, and the bits in these.

use datafusion::arrow::array::{AsArray, RecordBatch};
use datafusion::arrow::compute::concat_batches;
use datafusion::arrow::datatypes::Float64Type;
use datafusion::error::Result;
use datafusion::prelude::{ParquetReadOptions, SessionContext};
use std::path::Path;
use std::sync::Arc;

/// Two threads that run queries.
pub fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().expect("threads")
}

/// The rows of a query.
///
/// # Errors
/// What is wrong with it.
pub async fn collected(context: &SessionContext, sql: &str) -> Result<RecordBatch> {
    let frame = context.sql(sql).await?;
    let schema = Arc::new(frame.schema().as_arrow().clone());
    let batches = frame.collect().await?;
    // nullability of what was computed may be stricter than what was planned
    let schema = batches.first().map_or(schema, RecordBatch::schema);
    Ok(concat_batches(&schema, &batches)?)
}

/// The rows of a query, or what is wrong with it as text.
///
/// # Errors
/// As [`collected`].
pub fn rows(context: &SessionContext, sql: &str) -> std::result::Result<RecordBatch, String> {
    runtime().block_on(collected(context, sql)).map_err(|wrong| wrong.to_string())
}

/// Reads Parquet files as the table `logs`, in place of the one before.
///
/// # Errors
/// They cannot be read.
pub async fn read_logs(context: &SessionContext, logs: &Path) -> Result<()> {
    let table = context.read_parquet(logs.to_str().expect("a path of text"), ParquetReadOptions::default()).await?;
    context.deregister_table("logs")?;
    context.register_table("logs", table.into_view())?;
    Ok(())
}

/// Bits of the numbers of a column of structs, row by row.
pub fn bits(table: &RecordBatch, column: &str) -> Vec<Vec<u64>> {
    let found = table.column_by_name(column).expect("a column").as_struct();
    let columns: Vec<&[f64]> =
        found.columns().iter().map(|column| &column.as_primitive::<Float64Type>().values()[..]).collect();
    (0..table.num_rows()).map(|row| columns.iter().map(|numbers| numbers[row].to_bits()).collect()).collect()
}
