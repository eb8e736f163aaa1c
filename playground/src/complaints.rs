//! Complaints as the page takes them: each with its place, and as the compiler's other fronts print it.

use serde::Serialize;
use straightline_codegen::diagnostic::{Diagnostic, Diagnostics, Severity};

/// A complaint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Complaint {
    /// `error`, `warning` or `note`.
    pub severity: String,
    /// Its code.
    pub code: &'static str,
    /// In one line.
    pub title: String,
    /// The file, if it has a place.
    pub file: Option<String>,
    /// Its line there, from 1; 0 without a place.
    pub line: usize,
    /// Its column in characters, from 1.
    pub column: usize,
    /// With its source line and caret, as the command line prints it.
    pub text: String,
}

/// All of them, notes left out: those are for who asks.
pub fn complaints(all: &Diagnostics) -> Vec<Complaint> {
    let shown = all.at_least(Severity::Warning);
    let of = |complaint: &Diagnostic| {
        let alone = shown.without(|other| !std::ptr::eq(other, complaint));
        Complaint {
            severity: complaint.severity.to_string(),
            code: complaint.code,
            title: complaint.title.clone(),
            file: complaint.place.as_ref().map(|place| place.file.to_string()),
            line: complaint.place.as_ref().map_or(0, |place| place.line),
            column: complaint.place.as_ref().map_or(0, |place| place.column),
            text: alone.render().trim_end().to_string(),
        }
    };
    shown.iter().map(of).collect()
}
