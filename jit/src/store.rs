//! Programs on a disk, for the next start.
//!
//! What takes time is the search for programs of few operations; a file of this folder is the outcome of one: a graph, never machine code. It is
//! named by a hash of the robot file, those that it names, the options and the version of the compiler. A file that is damaged, of another version or
//! key is thrown away; one that reads well is still checked against the equations of the robot, as every program is that is made
//! ([`ProgramStore`]). Several processes may share a folder: a file appears whole or not at all.

use serde::{Deserialize, Serialize};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use straightline_codegen::program::stored::ProgramStore;
use straightline_graph::expr::Graph;

/// What file names end with.
const EXTENSION: &str = "straightline";
/// So many files are kept; the oldest go.
const FILES: usize = 4096;
/// The checksum of a file.
const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI);

/// A folder of programs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramFolder {
    folder: PathBuf,
}

/// A file. Of another version it may have other fields behind these.
#[derive(Serialize, Deserialize)]
struct StoredProgram<G> {
    version: String,
    key: u64,
    graph: G,
}

impl ProgramFolder {
    /// That folder, which is made when the first program is kept.
    pub fn new(folder: impl Into<PathBuf>) -> ProgramFolder {
        ProgramFolder { folder: folder.into() }
    }

    /// `straightline` in the folder for what can be made again: `XDG_CACHE_HOME`, or else `.cache` at home, `LOCALAPPDATA` under Windows. None where the
    /// environment names none.
    pub fn of_user() -> Option<ProgramFolder> {
        let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let home = || folder("HOME").map(|home| home.join(".cache"));
        let found = folder("XDG_CACHE_HOME").or_else(|| if cfg!(windows) { folder("LOCALAPPDATA") } else { home() });
        Some(ProgramFolder::new(found?.join("straightline")))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    fn file(&self, key: u64) -> PathBuf {
        self.folder.join(format!("{key:016x}.{EXTENSION}"))
    }

    fn write(&self, key: u64, bytes: &[u8]) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
        file.write_all(bytes)?;
        file.persist(self.file(key))?;
        self.forget_oldest()
    }

    fn forget_oldest(&self) -> io::Result<()> {
        let mut files: Vec<(SystemTime, PathBuf)> = fs::read_dir(&self.folder)?
            .filter_map(|entry| {
                let entry = entry.ok()?;
                let path = entry.path();
                let is_ours = path.extension().is_some_and(|extension| extension == EXTENSION);
                is_ours.then_some((entry.metadata().ok()?.modified().ok()?, path))
            })
            .collect();
        if files.len() > FILES {
            files.sort_unstable();
            // another process may have been here first
            files[..files.len() - FILES].iter().for_each(|(_, path)| drop(fs::remove_file(path)));
        }
        Ok(())
    }
}

impl ProgramStore for ProgramFolder {
    fn find(&self, key: u64) -> Option<Graph> {
        let path = self.file(key);
        let bytes = fs::read(&path).ok()?;
        let read = read(&bytes, key);
        if read.is_none() {
            drop(fs::remove_file(path));
        }
        read
    }

    /// Where that cannot be done, as on a full disk, the program is made again next time.
    fn keep(&self, key: u64, graph: &Graph) {
        drop(written(key, graph).map(|bytes| self.write(key, &bytes)));
    }
}

/// The version, and the sources: a compiler that is being changed has the same version for long.
fn version() -> String {
    format!("{} {}", straightline_codegen::VERSION, straightline_codegen::SOURCES)
}

fn written(key: u64, graph: &Graph) -> postcard::Result<Vec<u8>> {
    let version = version();
    postcard::to_stdvec_crc32(&StoredProgram { version, key, graph }, CHECKSUM.digest())
}

fn read(bytes: &[u8], key: u64) -> Option<Graph> {
    let stored: StoredProgram<Graph> = postcard::from_bytes_crc32(bytes, CHECKSUM.digest()).ok()?;
    let is_mine = stored.version == version() && stored.key == key;
    is_mine.then(|| stored.graph.without_notes())
}
