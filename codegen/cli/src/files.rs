//! Files of a command: what it has read it does not write, and nothing twice.

use crate::CommandFailure;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::output;

/// The files that were read and written so far.
static TAKEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Remembers a file that is read.
pub fn note(path: &Path) {
    TAKEN.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(path.to_path_buf());
}

/// The text of a file.
pub fn read(path: &Path) -> Result<Source, CommandFailure> {
    note(path);
    let shown = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| io::Error::new(e.kind(), format!("{shown}: {e}")))?;
    Ok(Source::from_bytes(&shown, bytes))
}

/// Writes a file, whole or not at all.
pub fn write(path: &Path, text: &(impl AsRef<[u8]> + ?Sized)) -> Result<(), CommandFailure> {
    let mut taken = TAKEN.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let is_file = std::fs::metadata(path).is_ok_and(|m| m.is_file());
    output::write_file_apart(path, text, taken.iter().filter(|_| is_file))?;
    taken.push(path.to_path_buf());
    Ok(())
}
