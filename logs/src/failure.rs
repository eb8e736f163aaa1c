//! What is wrong with a log.

use std::fmt;

/// Why a log cannot be read: where, what, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogError {
    /// Where in the file, such as `message 12 of /joint_states (byte 3410)`; empty for the whole file.
    pub place: String,
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub help: String,
}

impl LogError {
    /// Of its parts.
    pub fn new(place: impl Into<String>, what: impl Into<String>, help: impl Into<String>) -> LogError {
        LogError { place: place.into(), what: what.into(), help: help.into() }
    }
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place.is_empty() {
            true => f.write_str(&self.what),
            false => write!(f, "{}: {}", self.place, self.what),
        }
    }
}

impl std::error::Error for LogError {}
