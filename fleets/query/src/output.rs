//! Rows of a query, to people and files.

use crate::arguments::{OutputFormat, QueryArguments};
use datafusion::arrow::array::RecordBatch;
use datafusion::arrow::datatypes::Schema;
use datafusion::arrow::util::pretty::pretty_format_batches;
use datafusion::arrow::{csv, json};
use datafusion::error::{DataFusionError, Result};
use datafusion::execution::SendableRecordBatchStream;
use datafusion::parquet::arrow::ArrowWriter;
use futures::StreamExt;
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;
use std::sync::Arc;

/// Where rows go.
pub struct TableWriter {
    kind: WrittenAs,
    target: Box<dyn Write + Send>,
}

/// In which form.
enum WrittenAs {
    Text(OutputFormat),
    Parquet,
}

impl TableWriter {
    /// As the command line says.
    ///
    /// # Errors
    /// The file's ending says nothing, or it cannot be made.
    pub fn new(arguments: &QueryArguments) -> Result<TableWriter> {
        let Some(path) = &arguments.output else {
            return Ok(TableWriter { kind: WrittenAs::Text(arguments.format), target: Box::new(io::stdout()) });
        };
        let kind = by_ending(path)?;
        let unwritable = |why: io::Error| DataFusionError::Execution(format!("{}: {why}", path.display()));
        Ok(TableWriter { kind, target: Box::new(BufWriter::new(File::create(path).map_err(unwritable)?)) })
    }

    /// Writes all rows, as they come where the form allows it.
    ///
    /// # Errors
    /// What the query or the target says.
    pub async fn write(mut self, schema: Schema, mut rows: SendableRecordBatchStream) -> Result<()> {
        match self.kind {
            WrittenAs::Text(OutputFormat::Table) => {
                let mut batches = vec![RecordBatch::new_empty(Arc::new(schema))];
                while let Some(batch) = rows.next().await {
                    batches.push(batch?);
                }
                // nullability of what was computed may be stricter than what was planned
                let batches: Vec<RecordBatch> = if batches.len() > 1 { batches.split_off(1) } else { batches };
                writeln!(self.target, "{}", pretty_format_batches(&batches)?)?;
            }
            WrittenAs::Text(OutputFormat::Csv) => {
                let mut writer = csv::WriterBuilder::new().with_header(true).build(&mut self.target);
                writer.write(&flat(&RecordBatch::new_empty(Arc::new(schema)))?)?;
                while let Some(batch) = rows.next().await {
                    writer.write(&flat(&batch?)?)?;
                }
            }
            WrittenAs::Text(OutputFormat::Json) => {
                let mut writer = json::LineDelimitedWriter::new(&mut self.target);
                while let Some(batch) = rows.next().await {
                    writer.write(&batch?)?;
                }
                writer.finish()?;
            }
            WrittenAs::Parquet => {
                let schema = rows.schema();
                let mut writer = ArrowWriter::try_new(&mut self.target, schema, None)?;
                while let Some(batch) = rows.next().await {
                    writer.write(&batch?)?;
                }
                writer.close()?;
            }
        }
        Ok(self.target.flush()?)
    }
}

fn by_ending(path: &Path) -> Result<WrittenAs> {
    match path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("parquet") => Ok(WrittenAs::Parquet),
        Some("csv") => Ok(WrittenAs::Text(OutputFormat::Csv)),
        Some("json" | "jsonl" | "ndjson") => Ok(WrittenAs::Text(OutputFormat::Json)),
        _ => Err(DataFusionError::Execution(format!(
            "the name of {} does not say its form\nhelp: let it end in .parquet, .csv or .json",
            path.display()
        ))),
    }
}

/// Fields of structs as columns: `tau.joint4`.
fn flat(batch: &RecordBatch) -> Result<RecordBatch> {
    Ok(batch.normalize(".", None)?)
}

/// Whether the reader of standard output had enough: no failure of ours.
pub fn is_broken_pipe(wrong: &DataFusionError) -> bool {
    match wrong {
        DataFusionError::IoError(error) => error.kind() == ErrorKind::BrokenPipe,
        DataFusionError::ArrowError(error, _) => {
            matches!(&**error, datafusion::arrow::error::ArrowError::IoError(_, error) if error.kind() == ErrorKind::BrokenPipe)
        }
        _ => false,
    }
}
