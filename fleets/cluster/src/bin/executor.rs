//! The command `straightline-executor`: Ballista's executor, which has the functions of robot dynamics.

use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use straightline_cluster::{execute, ExecutorSettings};

/// Plans of many functions are deep \[bytes\].
const STACK: usize = 32 << 20;

/// Executes the tasks of queries.
#[derive(Parser)]
#[command(version)]
struct ExecutorArguments {
    /// Host and port of the scheduler.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:50050", value_parser = host_and_port)]
    scheduler: (String, u16),
    /// Where it listens.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    bind: String,
    /// The name by which scheduler, executors and clients reach it; by default they see where it comes from.
    #[arg(long, value_name = "HOST")]
    host: Option<String>,
    /// Port of results.
    #[arg(long, value_name = "PORT", default_value_t = 50051)]
    port: u16,
    /// Port of tasks.
    #[arg(long, value_name = "PORT", default_value_t = 50052)]
    task_port: u16,
    /// Tasks at once; 0: one per processor.
    #[arg(long, value_name = "N", default_value_t = 0)]
    tasks: usize,
    /// The folder of intermediate results; by default a temporary one.
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Seconds between two signs of life; less than the scheduler's patience.
    #[arg(long, value_name = "SECONDS", default_value_t = 10)]
    heartbeat: u64,
}

fn host_and_port(text: &str) -> Result<(String, u16), String> {
    let found = text.rsplit_once(':').and_then(|(host, port)| Some((host.to_string(), port.parse().ok()?)));
    found.filter(|(host, _)| !host.is_empty()).ok_or_else(|| "it is HOST:PORT, such as 127.0.0.1:50050".to_string())
}

fn main() -> ExitCode {
    let ExecutorArguments { scheduler, bind, host, port, task_port, tasks, folder, heartbeat } =
        ExecutorArguments::parse();
    let heartbeat = Duration::from_secs(heartbeat);
    let settings = ExecutorSettings { scheduler, bind, host, ports: [port, task_port], tasks, folder, heartbeat };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().thread_stack_size(STACK).build();
    let done = runtime.map_err(|wrong| wrong.to_string()).and_then(|runtime| {
        runtime.block_on(execute(&settings)).map_err(|wrong| format!("the executor ended: {wrong}"))
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("error: {text}");
            ExitCode::FAILURE
        }
    }
}
