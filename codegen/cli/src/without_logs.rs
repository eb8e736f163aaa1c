//! `residuals`, `identify` and MCAP files where the feature `logs` is not built in: they say so.

use crate::arguments::ModelArgs;
use crate::{print, CommandFailure};
use clap::Args;
use std::ffi::OsString;

/// Whatever follows the command.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Residuals {
    #[arg(hide = true, num_args = 0.., allow_hyphen_values = true, trailing_var_arg = true)]
    _ignored: Vec<OsString>,
}

pub type Identify = Residuals;

impl Residuals {
    /// It reads no robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        None
    }
}

/// What is said below its arguments.
pub fn help_of_residuals() -> String {
    String::new()
}

/// The same of the other command.
pub fn help_of_identify() -> String {
    String::new()
}

fn left_out() -> CommandFailure {
    print::failure_with(
        "this `straightline` knows no logs: it was built without the feature `logs`",
        &["cargo install --path codegen/cli --features logs, or logs,parquet, which reads and writes Parquet files, too"],
    )
}

/// The command.
pub fn residuals(_: &Residuals) -> Result<(), CommandFailure> {
    Err(left_out())
}

/// The command.
pub fn identify(_: &Identify) -> Result<(), CommandFailure> {
    Err(left_out())
}

/// The bytes of a log as MCAP.
#[cfg(feature = "simulation")]
pub fn mcap_bytes(
    _: &straightline_simulation::table::DataTable,
    _: &straightline_core::model::Model<f64>,
) -> Result<Vec<u8>, CommandFailure> {
    Err(left_out())
}

/// The columns of a log.
#[cfg(feature = "simulation")]
pub fn run_columns(
    _: &std::path::Path,
    _: &straightline_core::model::Model<f64>,
) -> Result<Vec<(String, Vec<f64>)>, CommandFailure> {
    Err(left_out())
}
