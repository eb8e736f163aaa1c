//! The toolchain for microcontrollers that `robots/firmware/toolchain` makes, where it is there.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A program of it; says so where it is not there.
pub fn program(name: &str) -> Option<PathBuf> {
    let found = folder().map(|folder| folder.join(name));
    if found.is_none() {
        eprintln!("skipped: there is no toolchain for microcontrollers; robots/firmware/toolchain makes it");
    }
    found
}

/// The compiler that the environment names, or that of the toolchain, which has `core` for microcontrollers, or the user's.
pub fn rustc() -> OsString {
    let named = std::env::var_os("RUSTC").filter(|name| !name.is_empty());
    let of_toolchain = || folder().map(|folder| folder.join("rustc").into_os_string());
    named.or_else(of_toolchain).unwrap_or_else(|| "rustc".into())
}

/// A program that is installed, or else that of the toolchain.
pub fn command(name: &str) -> Option<Command> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let installed = std::env::split_paths(&path).map(|folder| folder.join(name)).find(|program| program.is_file());
    let of_toolchain = || folder().map(|folder| folder.join(name)).filter(|program| program.is_file());
    installed.or_else(of_toolchain).map(Command::new)
}

fn folder() -> Option<PathBuf> {
    let of_workspace = || Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|above| above.join("target/cross"));
    let is_complete = |folder: &PathBuf| folder.join("complete").exists();
    let folder = match std::env::var_os("STRAIGHTLINE_CROSS") {
        Some(named) => Some(PathBuf::from(named)).filter(is_complete),
        None => of_workspace().find(is_complete),
    };
    folder.map(|folder| std::fs::canonicalize(folder).expect("it is there"))
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
