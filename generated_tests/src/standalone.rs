//! Generated code as a program of its own, compiled by rustc when it is needed: for what must not run inside the tests, such
//! as other instruction sets, other modes of the processor, and timing without anything else in the binary.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A folder for programs that is gone with this value.
#[derive(Debug)]
pub struct Folder(PathBuf);

impl Folder {
    /// A folder of that name and this process.
    ///
    /// # Panics
    /// If the system gives none.
    pub fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("straightline-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Folder(path)
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Compiles a source with `-O` and these flags.
    ///
    /// # Errors
    /// What rustc says.
    pub fn build(&self, name: &str, source: &str, flags: &[&str]) -> Result<PathBuf, String> {
        let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
        self.build_by(&rustc, name, source, flags)
    }

    /// The same by this compiler.
    ///
    /// # Errors
    /// What rustc says.
    pub fn build_by(&self, rustc: &OsStr, name: &str, source: &str, flags: &[&str]) -> Result<PathBuf, String> {
        let (text, program) = (self.file(&format!("{name}.rs")), self.file(name));
        std::fs::write(&text, source).map_err(|e| format!("{}: {e}", text.display()))?;
        let output = Command::new(rustc)
            .args(["--edition", "2021", "-C", "opt-level=3", "-C", "codegen-units=1"])
            .args(flags)
            .arg("-o")
            .args([&program, &text])
            .stdin(Stdio::null())
            .output()
            .map_err(|e| format!("rustc: {e}"))?;
        match output.status.success() {
            true => Ok(program),
            false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // what cannot be removed is left to the system's cleaning of temporary files
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// What a program prints.
///
/// # Errors
/// Why it did not end well.
pub fn run(program: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .map_err(|e| format!("{}: {e}", program.display()))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{}: {}\n{}", program.display(), output.status, String::from_utf8_lossy(&output.stderr))),
    }
}
