//! The command `straightline-scheduler`: Ballista's scheduler, which knows the functions of robot dynamics.

use clap::Parser;
use std::net::SocketAddr;
use std::process::ExitCode;
use std::time::Duration;
use straightline_cluster::{schedule, SchedulerSettings};

/// Plans of many functions are deep \[bytes\].
const STACK: usize = 32 << 20;

/// Hands the tasks of queries to executors.
#[derive(Parser)]
#[command(version)]
struct SchedulerArguments {
    /// Where it listens.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:50050")]
    bind: SocketAddr,
    /// Seconds after which an executor that is not heard of is lost, and a query without executors fails.
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    patience: u64,
}

fn main() -> ExitCode {
    let SchedulerArguments { bind, patience } = SchedulerArguments::parse();
    let settings = SchedulerSettings { address: bind, patience: Duration::from_secs(patience) };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().thread_stack_size(STACK).build();
    let done = runtime.map_err(|wrong| wrong.to_string()).and_then(|runtime| {
        runtime.block_on(schedule(&settings)).map_err(|wrong| format!("the scheduler at {bind} ended: {wrong}"))
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("error: {text}");
            ExitCode::FAILURE
        }
    }
}
