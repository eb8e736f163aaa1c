//! The command line.

use clap::Parser;
use std::path::PathBuf;

/// SQL over logs of robots, with their dynamics.
///
/// Files that are named behind the query are the table `logs`. Functions: inverse_dynamics(robot, q, qd, qdd), forward_dynamics(robot, q, qd, tau), gravity_force(robot, q),
/// bias_force(robot, q, qd), residual(robot, q, qd, qdd, effort), torque_limits_exceeded(robot, tau), regressor_normal_equations(robot, q, qd, qdd, effort) and
/// identified_parameters(equations); the table sweep(robot, experiment, ranges, samples, seed). A robot is the path of its file, 'panda.urdf' or 'panda.urdf#sha256:…'.
#[derive(Clone, Debug, Parser)]
#[command(name = "straightline-query", version)]
pub struct QueryArguments {
    /// The folder that names of robots count from.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub robots: PathBuf,
    /// A further table: its name and a Parquet file or a folder of them; may be given several times.
    #[arg(long = "table", value_name = "NAME=PATH", value_parser = table)]
    pub tables: Vec<(String, Vec<String>)>,
    /// How rows are written to standard output.
    #[arg(long, value_enum, default_value_t = OutputFormat::Table)]
    pub format: OutputFormat,
    /// A Parquet file, or one of CSV or JSON lines by its ending, in place of standard output.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// How many partitions are computed at once; by default one per processor.
    #[arg(long, value_name = "N", value_parser = positive)]
    pub partitions: Option<usize>,
    /// Rows of a batch.
    #[arg(long, value_name = "N", default_value = "8192", value_parser = positive)]
    pub batch: usize,
    /// The scheduler of a cluster that executes the query, such as http://host:50050.
    #[cfg(feature = "cluster")]
    #[arg(long, value_name = "URL")]
    pub scheduler: Option<String>,
    /// The query.
    pub sql: String,
    /// Parquet files, or folders of them.
    pub logs: Vec<String>,
}

impl QueryArguments {
    /// Whether a cluster executes the query.
    #[cfg(feature = "cluster")]
    pub fn is_distributed(&self) -> bool {
        self.scheduler.is_some()
    }

    /// Whether a cluster executes the query.
    #[cfg(not(feature = "cluster"))]
    pub fn is_distributed(&self) -> bool {
        false
    }
}

/// How rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum OutputFormat {
    /// For people.
    Table,
    /// Comma-separated; fields of structs as columns.
    Csv,
    /// A JSON object per line.
    Json,
}

fn table(text: &str) -> Result<(String, Vec<String>), String> {
    match text.split_once('=') {
        Some((name, path)) if !name.is_empty() && !path.is_empty() => Ok((name.to_string(), vec![path.to_string()])),
        _ => Err("it is NAME=PATH, such as limits=limits.parquet".to_string()),
    }
}

fn positive(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|n| *n > 0).ok_or_else(|| "it is a whole number, at least 1".to_string())
}
