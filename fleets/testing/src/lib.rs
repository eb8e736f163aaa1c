//! What tests and measurements of fleets share: logs as tables, queries, and clusters of this machine.
//!
//! What it expects to hold it panics without.

pub mod log;
pub mod processes;
pub mod query;

use std::path::PathBuf;

/// Robots and experiments of the project.
pub fn project() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots")
}

/// Its robots.
pub fn robots() -> PathBuf {
    project().join("descriptions")
}

/// The text of one of them.
pub fn robot_text(name: &str) -> String {
    std::fs::read_to_string(robots().join(name)).expect("a robot of the project")
}
