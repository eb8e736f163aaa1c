//! What reads packages back: a row per kind.

use super::c99::{opencl, CReader};
use super::{ptx, Mismatch, ReadingStop};
use crate::emit::Generated;

/// Checks the files of a package of this robot whose names begin with the prefix.
type PackageReader = fn(&Generated, &str, &[(String, String)]) -> Result<(), Mismatch>;

/// By the word that asks for a kind. The text of a package in Rust is that of [`Generated::text`], which is read anyway.
static READERS: &[(&str, PackageReader)] = &[
    ("c-abi", |_, _, _| Ok(())),
    ("c99", |generated, prefix, files| CReader::new(generated, prefix).check(files)),
    ("opencl", |generated, prefix, files| check_text("cl", opencl::read, (generated, prefix, files))),
    ("ptx", |generated, prefix, files| check_text("ptx", ptx::read, (generated, prefix, files))),
];

/// Reads the text of a package of this robot whose names begin with the prefix; the last is the function or file that is read.
type TextReader = fn(&Generated, &str, &str, &mut String) -> Result<(), ReadingStop>;

/// Checks a package whose code is one text, the file with this ending.
fn check_text(
    ending: &str,
    read: TextReader,
    (generated, prefix, files): (&Generated, &str, &[(String, String)]),
) -> Result<(), Mismatch> {
    let name = format!("{}_dynamics.{ending}", prefix.to_lowercase());
    let text = file(files, &name)?;
    let mut place = name;
    read(generated, prefix, text, &mut place).map_err(|ReadingStop(stop)| {
        let (at, what) = *stop;
        mismatch(text, at, what, place)
    })
}

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

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::READERS;
    use crate::emit::package::PACKAGES;

    pub fn every_kind_of_package_has_one_reader() {
        let of = |name: &str| READERS.iter().filter(|(of, _)| *of == name).count();
        let without: Vec<&str> = PACKAGES.iter().map(|kind| kind.name).filter(|name| of(name) != 1).collect();
        assert!(without.is_empty() && READERS.len() == PACKAGES.len(), "{without:?}");
    }
}
