//! `simulate`, `analyze` and `view` where the feature `simulation` is not built in: they say so.

use crate::arguments::ModelArgs;
use crate::{print, CommandFailure};
use clap::Args;
use std::ffi::OsString;
use std::path::Path;

/// Whatever follows the command.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub struct Simulate {
    #[arg(hide = true, num_args = 0.., allow_hyphen_values = true, trailing_var_arg = true)]
    _ignored: Vec<OsString>,
}

pub type Analyze = Simulate;
pub type ViewArguments = Simulate;

impl Simulate {
    /// It reads no robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        None
    }
}

fn without() -> CommandFailure {
    print::failure_with(
        "this `straightline` has no simulation: it was built without the feature `simulation`",
        &["cargo install --path codegen/cli --features simulation, or parquet, which reads and writes Parquet files, too"],
    )
}

pub fn simulate(_: &Simulate) -> Result<(), CommandFailure> {
    Err(without())
}

pub fn analyze(a: &Analyze) -> Result<(), CommandFailure> {
    simulate(a)
}

/// Of a robot that moves through its range.
pub fn draw_range(_: &Path, _: &Path, _: &ModelArgs) -> Result<(), CommandFailure> {
    Err(without())
}

pub fn view(a: &ViewArguments) -> Result<(), CommandFailure> {
    simulate(a)
}
