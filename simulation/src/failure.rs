//! Why a simulation has no result.

use std::fmt;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// When it went wrong \[s\].
    pub time: f64,
    /// What the solver says.
    pub why: String,
    /// What may help.
    pub help: Option<String>,
}

impl Failure {
    pub(crate) fn new(time: f64, why: String) -> Failure {
        Failure { time, why, help: None }
    }

    pub(crate) fn with_help(mut self, help: &str) -> Failure {
        self.help = Some(help.to_string());
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the simulation failed at t = {:?} s: {}", self.time, self.why)
    }
}

impl std::error::Error for Failure {}
