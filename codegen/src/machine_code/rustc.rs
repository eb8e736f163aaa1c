//! The machine code of a text: rustc is run on it, in a folder that is gone afterwards.

use super::ObjectCode;
use crate::choices::{Memory, TargetMachine};
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicU32, Ordering};

/// The environment variable that names rustc, as cargo and its friends have it.
const RUSTC: &str = "RUSTC";

/// A compiler of Rust.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RustCompiler {
    program: OsString,
    /// What it says of itself: `rustc 1.95.0 (59807616e 2026-04-14)`.
    pub version: String,
}

/// Why there is no machine code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ObjectError {
    /// That program does not run, and why.
    NoCompiler(String, String),
    /// It has no `core` for the platform.
    NoTarget(&'static str),
    /// What it says of the text.
    Refused(String),
    /// A file or a folder.
    Folder(String),
    /// What is wrong with the object.
    Object(String),
}

impl fmt::Display for ObjectError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ObjectError::NoCompiler(program, why) => write!(f, "`{program}` cannot be run: {why}"),
            ObjectError::NoTarget(triple) => write!(f, "rustc has no `core` for {triple}"),
            ObjectError::Refused(why) => write!(f, "rustc does not compile the text: {why}"),
            ObjectError::Folder(why) => write!(f, "no temporary folder: {why}"),
            ObjectError::Object(why) => write!(f, "its object cannot be read: {why}"),
        }
    }
}

impl ObjectError {
    /// What to do.
    pub fn remedy(&self) -> String {
        match self {
            ObjectError::NoCompiler(..) => "install rustc, or name it by the environment variable RUSTC".to_string(),
            ObjectError::NoTarget(triple) => format!("rustup target add {triple}"),
            ObjectError::Refused(_) | ObjectError::Object(_) => {
                "if rustc is one that compiles other code for this machine, please report it, with the robot file and the options".to_string()
            }
            ObjectError::Folder(_) => "there has to be room for a folder where the environment variable TMPDIR says".to_string(),
        }
    }
}

impl RustCompiler {
    /// That program; otherwise the one that the environment variable `RUSTC` names, or else `rustc`.
    ///
    /// # Errors
    /// It does not run.
    pub fn find(program: Option<&OsStr>) -> Result<RustCompiler, ObjectError> {
        let named = || std::env::var_os(RUSTC).filter(|name| !name.is_empty());
        let program = program.map(OsStr::to_os_string).or_else(named).unwrap_or_else(|| "rustc".into());
        let shown = program.to_string_lossy().into_owned();
        let failed = |why: String| ObjectError::NoCompiler(shown.clone(), why);
        let output = Command::new(&program).arg("--version").output().map_err(|e| failed(e.to_string()))?;
        let version = String::from_utf8_lossy(&output.stdout).trim().to_string();
        match output.status.success() && version.starts_with("rustc ") && !version.contains('\n') {
            true => Ok(RustCompiler { program, version }),
            false => Err(failed(format!("`--version` says: {}", first_line(&output)))),
        }
    }
}

fn first_line(output: &Output) -> String {
    let said = [&output.stderr[..], &output.stdout[..]].map(|text| String::from_utf8_lossy(text).into_owned());
    let line = said.iter().flat_map(|text| text.lines()).find(|line| !line.trim().is_empty());
    line.map_or_else(|| output.status.to_string(), |line| line.trim().chars().take(200).collect())
}

/// The machine code of a crate that needs `core` alone.
///
/// # Errors
/// That there is none.
pub fn machine_code(
    compiler: &RustCompiler,
    text: &str,
    machine: TargetMachine,
    memory: Memory,
) -> Result<ObjectCode, ObjectError> {
    let folder = TemporaryFolder::new().map_err(|e| ObjectError::Folder(e.to_string()))?;
    let (source, object) = (folder.0.join("functions.rs"), folder.0.join("functions.o"));
    std::fs::write(&source, text).map_err(|e| ObjectError::Folder(e.to_string()))?;
    let mut rustc = Command::new(&compiler.program);
    rustc.current_dir(&folder.0).args(["--edition=2021", "--crate-type=lib", "--crate-name=functions", "--emit=obj"]);
    rustc.args(["-Copt-level=3", "-Cpanic=abort", "-Ccodegen-units=1", "--cap-lints=allow", "--color=never"]);
    rustc.args(["--target", machine.row().triple]);
    machine.flags(memory).iter().for_each(|flag| {
        rustc.args(flag.split(' '));
    });
    // what the caller's environment says of its own crate is not of this one
    rustc.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS").arg("-o").args([&object, &source]);
    let output = rustc
        .output()
        .map_err(|e| ObjectError::NoCompiler(compiler.program.to_string_lossy().into_owned(), e.to_string()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(match said.contains("E0463") || said.contains("could not find specification for target") {
            true => ObjectError::NoTarget(machine.row().triple),
            false => ObjectError::Refused(first_error(&said).unwrap_or_else(|| first_line(&output))),
        });
    }
    let bytes = std::fs::read(&object).map_err(|e| ObjectError::Folder(e.to_string()))?;
    ObjectCode::read(&bytes, machine.row().code).map_err(ObjectError::Object)
}

fn first_error(said: &str) -> Option<String> {
    said.lines().find(|line| line.starts_with("error")).map(|line| line.chars().take(200).collect())
}

/// A folder that is removed with all that is in it.
struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    fn new() -> std::io::Result<TemporaryFolder> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let parent: PathBuf = std::env::temp_dir();
        // another process may have had this number and left a folder
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let folder = parent.join(format!("straightline-figures-{}-{count}", std::process::id()));
            match std::fs::create_dir(&folder) {
                Ok(()) => return Ok(TemporaryFolder(folder)),
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists && count < 10_000 => {}
                Err(e) => return Err(e),
            }
        }
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        // nobody could be told here, and what is left harms nobody
        let _: std::io::Result<()> = std::fs::remove_dir_all(Path::new(&self.0));
    }
}
