//! The toolchain for microcontrollers that `robots/firmware/toolchain` makes, where it is there.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A program of it; none, and a line that says so, where it is not there.
pub fn program(name: &str) -> Option<PathBuf> {
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/cross");
    let folder = std::env::var_os("STRAIGHTLINE_CROSS").map_or(default, PathBuf::from);
    if !folder.join("complete").exists() {
        eprintln!(
            "skipped: there is no toolchain for microcontrollers in {}; robots/firmware/toolchain makes it",
            folder.display()
        );
        return None;
    }
    Some(std::fs::canonicalize(folder).expect("it is there").join(name))
}

/// Its cargo, with its rustc.
pub fn cargo() -> Option<Command> {
    let mut cargo = Command::new(program("cargo")?);
    // what cargo told this test is of another toolchain
    for (name, _) in std::env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with("CARGO_")) {
        if name != "CARGO_HOME" && name != "CARGO_TARGET_DIR" {
            cargo.env_remove(name);
        }
    }
    cargo.env("RUSTC", program("rustc")?).env_remove("RUSTUP_TOOLCHAIN").env("CARGO_INCREMENTAL", "0");
    Some(cargo)
}
