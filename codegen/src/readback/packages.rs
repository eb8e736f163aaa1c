//! What reads packages back: a row per kind.

use super::c99::{opencl, CReader};
use super::{ptx, Mismatch};
use crate::emit::Generated;

/// Checks the files of a package of this robot whose names begin with the prefix.
type PackageReader = fn(&Generated, &str, &[(String, String)]) -> Result<(), Mismatch>;

/// By the word that asks for a kind. The text of a package in Rust is that of [`Generated::text`], which is read anyway.
static READERS: &[(&str, PackageReader)] = &[
    ("c-abi", |_, _, _| Ok(())),
    ("c99", |generated, prefix, files| CReader::new(generated, prefix).check(files)),
    ("opencl", opencl::check),
    ("ptx", ptx::check),
];

/// Checks the files of a package of that kind.
///
/// # Errors
/// The first place where one of them is not what it was to be.
///
/// # Panics
/// If nothing can read the kind.
pub fn check(kind: &str, generated: &Generated, prefix: &str, files: &[(String, String)]) -> Result<(), Mismatch> {
    let (_, reader) = READERS.iter().find(|(name, _)| *name == kind).expect("every kind of package has a reader");
    reader(generated, prefix, files)
}

/// The file of that name.
pub(super) fn file<'t>(files: &'t [(String, String)], name: &str) -> Result<&'t str, Mismatch> {
    let found = files.iter().find(|(file, _)| file == name).map(|(_, text)| text.as_str());
    found.ok_or_else(|| Mismatch {
        function: name.to_string(),
        line: 1,
        text: String::new(),
        what: "a file is missing".into(),
    })
}

/// Where a text is wrong.
pub(super) fn mismatch(text: &str, at: usize, what: String, function: String) -> Mismatch {
    let before = &text[..at.min(text.len())];
    let start = before.rfind('\n').map_or(0, |k| k + 1);
    let shown = text[start..].lines().next().unwrap_or_default().trim().chars().take(200).collect();
    Mismatch { function, line: before.matches('\n').count() + 1, text: shown, what }
}
