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
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/cross");
    let folder = std::env::var_os("STRAIGHTLINE_CROSS").map_or(default, PathBuf::from);
    folder.join("complete").exists().then(|| std::fs::canonicalize(folder).expect("it is there"))
}
