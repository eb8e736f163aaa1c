//! Where the values of a scene stand in its file, and what is wrong there.

use crate::diagnostic::{Diagnostic, Diagnostics, Place, Source};
use std::collections::BTreeMap;
use std::fmt;

/// Places by the path of the value's keys, such as `hold.joints.elbow` or `payload.0.mass`. They say nothing of the scene
/// itself: two scenes are equal wherever they stand, and print alike, so that output does not depend on a path.
#[derive(Clone, Default)]
pub struct Places {
    source: Option<Source>,
    places: BTreeMap<String, Place>,
    complaints: Diagnostics,
}

impl Places {
    /// Of values in that file.
    pub fn new(source: &Source) -> Places {
        Places { source: Some(source.clone()), ..Places::default() }
    }

    /// The file; `None` for a scene made in code.
    pub fn source(&self) -> Option<&Source> {
        self.source.as_ref()
    }

    /// Notes a value's place.
    pub fn note(&mut self, path: impl Into<String>, place: &Place) {
        self.places.insert(path.into(), place.clone());
    }

    /// The place of a value, or else of the table that it would stand in.
    pub fn place(&self, path: &str) -> Option<&Place> {
        let mut path = path;
        loop {
            match (self.places.get(path), path.rfind('.')) {
                (Some(place), _) => return Some(place),
                (None, Some(dot)) => path = &path[..dot],
                (None, None) => return None,
            }
        }
    }

    /// What reading the file found, which whoever uses the scene has still to say; errors leave nothing to use.
    pub fn complaints(&self) -> &Diagnostics {
        &self.complaints
    }

    /// The same, said by the caller.
    pub(crate) fn take_complaints(&mut self) -> Diagnostics {
        std::mem::take(&mut self.complaints)
    }

    /// Keeps what reading the file found.
    pub(crate) fn keep(&mut self, complaints: Diagnostics) {
        self.complaints = complaints;
    }

    /// Keeps further complaints, of options that were given in code.
    pub(crate) fn keep_further(&mut self, complaints: impl IntoIterator<Item = Diagnostic>) {
        complaints.into_iter().for_each(|complaint| self.complaints.push(complaint));
    }

    /// Adds a complaint about the value of that path.
    pub(crate) fn complain(&self, path: &str, diagnostic: Diagnostic, diagnostics: &mut Diagnostics) {
        diagnostics.push(match self.place(path) {
            Some(place) => diagnostic.at(place),
            None => diagnostic,
        });
    }
}

impl PartialEq for Places {
    fn eq(&self, _: &Places) -> bool {
        true
    }
}

impl fmt::Debug for Places {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Places")
    }
}
