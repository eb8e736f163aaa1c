//! The command `straightline-query`: SQL over logs of robots, with their dynamics.
//!
//! Rows go to standard output or into a file, complaints to standard error.

mod arguments;
mod output;

use arguments::QueryArguments;
use clap::Parser;
use datafusion::error::{DataFusionError, Result};
use datafusion::prelude::{ParquetReadOptions, SessionConfig, SessionContext};
use output::TableWriter;
use std::process::ExitCode;
use straightline_fleets::RobotFolder;

/// The table of the files that a command line names.
const TABLE: &str = "logs";
/// What a remedy begins with.
const HELP: &str = "\nhelp: ";
/// What can be done when executors are lost.
const AGAIN: &str =
    "nothing is lost, as logs are only read: once executors are there, the same query gives the same rows";
/// Plans of many functions are deep \[bytes\].
const STACK: usize = 16 << 20;

fn main() -> ExitCode {
    let arguments = QueryArguments::parse();
    let is_distributed = arguments.is_distributed();
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().thread_stack_size(STACK).build();
    let done = match runtime {
        // planning takes stack as well, so it is not left to the first thread
        Ok(runtime) => runtime.block_on(async { tokio::spawn(async move { query(&arguments).await }).await }),
        Err(wrong) => return failed(&wrong.to_string()),
    };
    match done {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(wrong)) if output::is_broken_pipe(&wrong) => ExitCode::SUCCESS,
        Ok(Err(wrong)) => failed(&said(&wrong, is_distributed)),
        Err(stopped) => failed(&stopped.to_string()),
    }
}

fn failed(text: &str) -> ExitCode {
    // the compiler's messages say so themselves, with a code
    let is_said = ["error:", "error["].iter().any(|head| text.starts_with(head));
    eprintln!("{}{text}", if is_said { "" } else { "error: " });
    ExitCode::FAILURE
}

/// What went wrong, without the words around it that say in which part of the engine.
fn said(wrong: &DataFusionError, is_distributed: bool) -> String {
    match wrong.find_root() {
        DataFusionError::Plan(text) => text.clone(),
        DataFusionError::Execution(text) if text.contains(HELP) || !is_distributed => text.clone(),
        // such as lost executors, in the words of the cluster
        DataFusionError::Execution(text) => format!("{text}{HELP}{AGAIN}"),
        other => other.to_string(),
    }
}

async fn query(arguments: &QueryArguments) -> Result<()> {
    let context = session(arguments).await?;
    let folder = RobotFolder::at(&arguments.robots);
    straightline_fleets::register(&context, &folder);
    straightline_sweeps::register(&context, &folder);
    let mut tables = arguments.tables.clone();
    if !arguments.logs.is_empty() {
        tables.push((TABLE.to_string(), arguments.logs.clone()));
    }
    for (name, paths) in tables {
        let frame = context.read_parquet(paths, ParquetReadOptions::default()).await?;
        context.register_table(name, frame.into_view())?;
    }
    let frame = context.sql(&arguments.sql).await?;
    let schema = frame.schema().as_arrow().clone();
    let stream = frame.execute_stream().await?;
    TableWriter::new(arguments)?.write(schema, stream).await
}

fn config(arguments: &QueryArguments) -> SessionConfig {
    let config = SessionConfig::new().with_batch_size(arguments.batch);
    match arguments.partitions {
        Some(partitions) => config.with_target_partitions(partitions),
        None => config,
    }
}

#[cfg(feature = "cluster")]
async fn session(arguments: &QueryArguments) -> Result<SessionContext> {
    match &arguments.scheduler {
        Some(scheduler) => straightline_cluster::session(scheduler, config(arguments)).await,
        None => Ok(SessionContext::new_with_config(config(arguments))),
    }
}

#[cfg(not(feature = "cluster"))]
async fn session(arguments: &QueryArguments) -> Result<SessionContext> {
    Ok(SessionContext::new_with_config(config(arguments)))
}
