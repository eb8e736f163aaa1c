//! What can be said of the levels of complaints.

use super::codes::{self, Code};
use super::levels::{Level, ALL_WARNINGS};
use super::{Diagnostic, Severity};
use crate::diagnostic::wording::{cut, did_you_mean};

type D = Diagnostic;

/// A level for a code that no complaint has.
pub fn unknown_code(code: &str) -> D {
    let d = D::error("unknown-code", format!("no complaint has the code `{}`", cut(code)));
    let can_have_levels = |c: &&Code| c.severity != Severity::Error;
    let warnings = || codes::ALL.iter().filter(can_have_levels).map(|c| c.code).chain([ALL_WARNINGS]);
    let hint = did_you_mean(code, warnings()).or_else(|| did_you_mean(code, codes::ALL.iter().map(|c| c.code)));
    match hint {
        Some(hint) => d.help(hint),
        None => d.help("`straightline explain` lists them"),
    }
}

/// A level for a complaint that is an error whatever is said.
pub fn level_of_error(level: Level, code: &str) -> D {
    D::error("level-of-error", format!("`{code}` is an error: it cannot be set to `{}`", level.word()))
        .detail("levels are for warnings, where something could be assumed")
        .help("mend what it complains about")
}

/// A level that silences what has to be said.
pub fn level_of_firm(code: &str) -> D {
    D::error("level-of-firm", format!("`{code}` is always said: it cannot be set to `allow`"))
        .detail("it says that a program of ours has failed, and which one was taken in its place")
        .help("leave the level out, or set it to `deny`, and report the robot file")
}
