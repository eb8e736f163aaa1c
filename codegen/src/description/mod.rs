//! Robot files: the table of their formats, and what is read of them, every value with its place.
//!
//! Whatever the format, it ends in links, joints and frames ([`Description`]). Nothing is computed here but inertias of solids, where a
//! file has bodies made of them: angles stay in the unit they are written in, axes keep their length. What can be judged value by value (a number that is none, an unknown key) is judged by the readers; what
//! needs the whole robot (tree, inertias, angles) by `crate::model`.

pub(crate) mod angle;
mod chapter;
pub mod composite;
mod couplings;
mod dh;
pub mod drives;
pub mod flexible;
pub(crate) mod geometry;
mod loops;
pub(crate) mod merge;
pub mod messages;
mod mjcf;
pub mod reader;
mod sdf;
pub mod table;
mod toml;
mod tree;
mod urdf;
pub mod write;
mod written_pose;
mod xml;

pub use loops::{ClosingJoint, LoopPoints, WrittenAssembly, WrittenLoop};
pub use tree::*;
pub use written_pose::*;

use crate::diagnostic::wording::one_of;
use crate::diagnostic::{Diagnostics, Place, Source};
use std::fmt;
use straightline_core::joint::Dialect;

/// The formats of robot files. A text is of the first that recognises it, or else of the first that has the extension of its name.
pub static FORMATS: &[&FileFormat] = &[&mjcf::FORMAT, &sdf::FORMAT, &urdf::FORMAT, &toml::FORMAT, &chapter::FORMAT];

/// A format of robot files.
#[derive(Debug)]
pub struct FileFormat {
    /// As messages and documents call it.
    pub name: &'static str,
    /// How file names end.
    pub extensions: &'static [&'static str],
    /// What it is recognised by, for who reads it.
    pub signs: &'static str,
    /// Whether a text is of this format, by these signs.
    pub sniff: fn(&str) -> bool,
    /// Its words for joints, in the table of joints.
    pub dialect: Dialect,
    /// What to do about a joint without limits.
    pub limits: &'static str,
    /// Reads a file. Complaints go to the diagnostics; `None` if nothing of the robot could be read.
    pub read: fn(&Source, &mut Diagnostics) -> Option<Description>,
    /// Writes a file; `None`: robots are not written in this format.
    pub write: Option<&'static write::FormatWriter>,
}

impl PartialEq for FileFormat {
    fn eq(&self, other: &FileFormat) -> bool {
        self.name == other.name
    }
}

/// Names of all formats, as in "a, b or c".
pub fn names_of_formats() -> String {
    one_of(&FORMATS.iter().map(|format| format.name).collect::<Vec<_>>())
}

/// A value with its place in the file, which says nothing of the value: equal and printed alike wherever it stands.
#[derive(Clone)]
pub struct Noted<T> {
    /// The value.
    pub value: T,
    /// Where it stands; for a value that was left out, where it would stand.
    pub place: Place,
}

impl<T> Noted<T> {
    /// A value with its place.
    pub fn new(value: T, place: Place) -> Noted<T> {
        Noted { value, place }
    }

    /// A value that no file holds.
    pub fn assumed(value: T) -> Noted<T> {
        Noted { value, place: Place::none() }
    }
}

impl<T: PartialEq> PartialEq for Noted<T> {
    fn eq(&self, other: &Noted<T>) -> bool {
        self.value == other.value
    }
}

impl<T: fmt::Debug> fmt::Debug for Noted<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.value.fmt(f)
    }
}

/// Reads a robot file in the format that its text has, or else its name. Complaints go to `diagnostics`. After errors the description
/// may hold placeholders, so that [`crate::model::build`] can find further complaints; `None` if nothing could be read.
pub fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Description> {
    diagnostics.add_source(source);
    let text = source.text();
    if let Some(at) = source.invalid_utf8() {
        diagnostics.push(messages::not_utf8().at(&source.place(at..at)));
        return None;
    }
    if text.len() > reader::LARGEST_FILE {
        diagnostics.push(messages::file_too_large(text.len(), reader::LARGEST_FILE).at(&source.place(0..0)));
        return None;
    }
    let extension = source.path().rsplit('.').next().unwrap_or("").to_ascii_lowercase();
    let is_named = |format: &&&FileFormat| !text.trim().is_empty() && format.extensions.contains(&extension.as_str());
    let recognised = FORMATS.iter().find(|format| (format.sniff)(text));
    let Some(format) = recognised.or_else(|| FORMATS.iter().find(is_named)) else {
        diagnostics.push(messages::unknown_format().at(&source.place(0..0)));
        return None;
    };
    (format.read)(source, diagnostics)
}
