//! The command `query`: handed to `straightline-query`, which has an engine of queries inside and is built apart.

use crate::{print, CommandFailure};
use clap::Args;
use std::env::consts::EXE_SUFFIX;
use std::ffi::OsString;
use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::process::Command;

/// The command that does it.
const COMMAND: &str = "straightline-query";

#[derive(Debug, Args)]
pub struct Query {
    /// What `straightline-query --help` lists
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<OsString>,
}

/// The command beside this one, or else the one that the shell finds.
fn command() -> PathBuf {
    let name = format!("{COMMAND}{EXE_SUFFIX}");
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name(&name));
    beside.filter(|path| path.is_file()).unwrap_or_else(|| PathBuf::from(name))
}

/// Runs it with these words; what it ends with, this command ends with.
pub fn query(a: &Query) -> Result<(), CommandFailure> {
    match Command::new(command()).args(&a.words).status() {
        Ok(status) if status.success() => Ok(()),
        // it said why; one that was killed has no code
        Ok(status) => Err(CommandFailure::Handed(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let text = format!("there is no command `{COMMAND}`, neither beside this one nor on the PATH");
            Err(print::failure_with(text, &["install it from a clone: cargo install --path fleets/query"]))
        }
        Err(error) => Err(CommandFailure::Files(io::Error::new(error.kind(), format!("{COMMAND}: {error}")))),
    }
}
