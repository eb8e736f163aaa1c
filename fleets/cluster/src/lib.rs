//! Fleets of robots on many machines: Ballista's own scheduler and executors, with the functions of `straightline-fleets` registered.
//!
//! The text of a robot comes with the plan, so machines have no files of robots in common; logs they have: a path that all of them see.

use ballista::prelude::{SessionConfigExt, SessionContextExt};
use ballista_core::config::{BALLISTA_ADAPTIVE_PLANNER_ENABLED, BALLISTA_CLIENT_GRPC_MAX_MESSAGE_SIZE};
use ballista_core::error::Result as BallistaResult;
use ballista_core::registry::BallistaFunctionRegistry;
use ballista_core::utils::default_session_builder;
use ballista_executor::executor_process::{start_executor_process, ExecutorProcessConfig};
use ballista_scheduler::cluster::BallistaCluster;
use ballista_scheduler::config::SchedulerConfig;
use ballista_scheduler::scheduler_process::start_server;
use datafusion::error::Result;
use datafusion::execution::session_state::SessionStateBuilder;
use datafusion::execution::{FunctionRegistry, SessionState};
use datafusion::logical_expr::ScalarUDF;
use datafusion::prelude::{SessionConfig, SessionContext};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use straightline_fleets::{aggregate_functions, RobotFolder};

/// Plans carry the texts of robots \[bytes\].
const GREATEST_MESSAGE: u32 = 256 << 20;

/// How a scheduler runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SchedulerSettings {
    /// Where it listens.
    pub address: SocketAddr,
    /// An executor that has not been heard of for so long is lost; after as long without any executor a query fails.
    pub patience: Duration,
}

/// How an executor runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExecutorSettings {
    /// Host and port of the scheduler.
    pub scheduler: (String, u16),
    /// Where it listens.
    pub bind: String,
    /// The name by which others reach it.
    pub host: Option<String>,
    /// Ports of results and of tasks.
    pub ports: [u16; 2],
    /// Tasks at once; 0: one per processor.
    pub tasks: usize,
    /// The folder of intermediate results.
    pub folder: Option<PathBuf>,
    /// How often it tells the scheduler that it lives.
    pub heartbeat: Duration,
}

/// A session whose queries a cluster executes; robots are registered by the caller.
///
/// # Errors
/// The URL is none.
pub async fn session(scheduler: &str, config: SessionConfig) -> Result<SessionContext> {
    let config = config
        .upgrade_for_ballista()
        // lost executors are recovered from by the static planner alone
        .set_bool(BALLISTA_ADAPTIVE_PLANNER_ENABLED, false)
        .set_u64(BALLISTA_CLIENT_GRPC_MAX_MESSAGE_SIZE, u64::from(GREATEST_MESSAGE));
    let state = SessionStateBuilder::new().with_default_features().with_config(config).build();
    SessionContext::remote_with_state(scheduler, state).await
}

/// Gives all functions to a session, with robots and experiments from that folder.
pub fn register(context: &SessionContext, folder: &RobotFolder) {
    straightline_fleets::register(context, folder);
    straightline_sweeps::register(context, folder);
}

/// The functions that plans name.
fn scalar_functions() -> impl Iterator<Item = ScalarUDF> {
    let of_rows = straightline_fleets::scalar_functions(&RobotFolder::none());
    of_rows.into_iter().chain(straightline_sweeps::scalar_functions())
}

/// A session of the scheduler, which knows the functions by name.
fn state(config: SessionConfig) -> Result<SessionState> {
    let mut state = default_session_builder(config)?;
    for function in scalar_functions() {
        state.register_udf(Arc::new(function))?;
    }
    for function in aggregate_functions(&RobotFolder::none()) {
        state.register_udaf(Arc::new(function))?;
    }
    Ok(state)
}

/// The functions of executors.
fn registry() -> BallistaFunctionRegistry {
    let mut registry = BallistaFunctionRegistry::default();
    for function in scalar_functions() {
        registry.scalar_functions.insert(function.name().to_string(), Arc::new(function));
    }
    for function in aggregate_functions(&RobotFolder::none()) {
        registry.aggregate_functions.insert(function.name().to_string(), Arc::new(function));
    }
    registry
}

/// Runs a scheduler until it is stopped.
///
/// # Errors
/// The address is taken, or the service ends.
pub async fn schedule(settings: &SchedulerSettings) -> BallistaResult<()> {
    let patience = settings.patience.as_secs().max(1);
    let config = SchedulerConfig {
        bind_host: settings.address.ip().to_string(),
        bind_port: settings.address.port(),
        grpc_server_max_decoding_message_size: GREATEST_MESSAGE,
        grpc_server_max_encoding_message_size: GREATEST_MESSAGE,
        grpc_client_max_message_size: GREATEST_MESSAGE,
        executor_timeout_seconds: patience,
        expire_dead_executor_interval_seconds: patience.div_ceil(4),
        no_executors_grace_period_seconds: patience,
        override_session_builder: Some(Arc::new(state)),
        ..SchedulerConfig::default()
    };
    let cluster = BallistaCluster::new_from_config(&config).await?;
    start_server(cluster, settings.address, Arc::new(config)).await
}

/// Runs an executor until it is stopped.
///
/// # Errors
/// The scheduler is not there, a port is taken, or the service ends.
pub async fn execute(settings: &ExecutorSettings) -> BallistaResult<()> {
    let config = ExecutorProcessConfig {
        bind_host: settings.bind.clone(),
        external_host: settings.host.clone(),
        port: settings.ports[0],
        grpc_port: settings.ports[1],
        scheduler_host: settings.scheduler.0.clone(),
        scheduler_port: settings.scheduler.1,
        scheduler_connect_timeout_seconds: 30,
        vcores: settings.tasks,
        work_dir: settings.folder.as_ref().map(|folder| folder.display().to_string()),
        grpc_max_decoding_message_size: GREATEST_MESSAGE,
        grpc_max_encoding_message_size: GREATEST_MESSAGE,
        executor_heartbeat_interval_seconds: settings.heartbeat.as_secs().max(1),
        override_function_registry: Some(Arc::new(registry())),
        ..ExecutorProcessConfig::default()
    };
    start_executor_process(Arc::new(config)).await
}
