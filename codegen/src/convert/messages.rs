//! What can be said of a conversion, one function per message.

use crate::description::write::losses::Loss;
use crate::diagnostic::{Diagnostic, Place};

/// The codes of all messages of this table.
pub const CODES: &[&str] = &["not-written", "not-in-format", "left-out", "said-otherwise", "not-as-read"];

type D = Diagnostic;

/// A format that is read alone.
pub fn not_written(format: &str) -> D {
    D::error("not-written", format!("no {format} is written"))
}

/// What changes the motion and has no place in the format.
pub fn not_in_format(format: &str, loss: &Loss, found: &[(String, Place)]) -> D {
    D::error("not-in-format", format!("{format} has no place for {}", loss.what))
        .detail(of_whom(found))
        .help(format!("convert to a format that has it, or with `--lossy`: {}", loss.then))
}

/// What is left out.
pub fn left_out(format: &str, loss: &Loss, found: &[(String, Place)]) -> D {
    D::warning("left-out", format!("{format} has no place for {}; {}", loss.what, loss.then)).detail(of_whom(found))
}

/// What is said in another way.
pub fn said_otherwise(format: &str, loss: &Loss, found: &[(String, Place)]) -> D {
    D::note("said-otherwise", format!("written otherwise in {format}: {}; {}", loss.what, loss.then))
        .detail(of_whom(found))
}

/// A text that did not come out as it was meant.
pub fn not_as_read(format: &str, difference: &str) -> D {
    D::error("not-as-read", format!("the {format} that was made is not read as the same robot; nothing is written"))
        .detail(difference.to_string())
        .help("this is a fault of Straightline, or a name that the format cannot hold: please report the file")
}

/// All of them, each with its line.
fn of_whom(found: &[(String, Place)]) -> String {
    let each = |(whom, place): &(String, Place)| match place.is_some() {
        true => format!("{whom} (line {})", place.line),
        false => whom.clone(),
    };
    found.iter().map(each).collect::<Vec<_>>().join(", ")
}
