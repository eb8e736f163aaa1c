//! What the readers share: places, complaints, numbers.

use super::{messages, Ignored, Noted, Placement, WrittenJoint};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, Source};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// The largest file that is read \[bytes\].
pub const LARGEST_FILE: usize = 64 << 20;
/// The greatest magnitude that is computed with: products of a few such numbers stay inside f64's range.
const GREATEST: f64 = 1e60;

/// A file that is being read.
pub struct FileReader<'a> {
    /// The file.
    pub source: &'a Source,
    /// What is said about it.
    pub diagnostics: &'a mut Diagnostics,
    /// Places with what was said of them, where one place counts for many elements and is complained of once.
    pub said: Option<HashSet<(Place, &'static str)>>,
    ignored: Vec<Ignored>,
    ignored_index: HashMap<String, usize>,
    /// Numbers of the drive that is being read, as far as equations have them.
    pub drive_numbers: Vec<super::drives::WrittenNumber>,
}

/// Which numbers are taken.
#[derive(Clone, Copy, PartialEq)]
pub enum Range64 {
    /// What equations are made of.
    Finite,
    /// What a coordinate is compared with: infinite, too.
    Limit,
}

/// Names that are taken, and names that are made up beside them.
#[derive(Default)]
pub struct FreeNames {
    taken: HashSet<String>,
    /// How many names were made of one.
    made: HashMap<String, usize>,
}

impl FreeNames {
    /// Nobody else gets these.
    pub fn take(&mut self, names: impl IntoIterator<Item = String>) {
        self.taken.extend(names);
    }

    /// `name`, or with a number after it where that is taken; it is taken then.
    pub fn made_up(&mut self, name: &str) -> String {
        let made = self.made.entry(name.to_string()).or_insert(0);
        loop {
            *made += 1;
            let own = if *made == 1 { name.to_string() } else { format!("{name}_{made}") };
            if self.taken.insert(own.clone()) {
                return own;
            }
        }
    }
}

impl<'a> FileReader<'a> {
    /// Nothing is read yet.
    pub fn new(source: &'a Source, diagnostics: &'a mut Diagnostics) -> FileReader<'a> {
        FileReader {
            source,
            diagnostics,
            said: None,
            ignored: Vec::new(),
            ignored_index: HashMap::new(),
            drive_numbers: Vec::new(),
        }
    }

    /// The place of bytes of the file.
    pub fn place(&self, span: &Range<usize>) -> Place {
        self.source.place(span.clone())
    }

    /// Says something about bytes of the file.
    pub fn complain(&mut self, span: &Range<usize>, diagnostic: Diagnostic) {
        let place = self.place(span);
        self.say(&place, diagnostic);
    }

    /// Says something about a place.
    pub fn say(&mut self, place: &Place, diagnostic: Diagnostic) {
        let is_new = self.said.as_mut().is_none_or(|said| said.insert((place.clone(), diagnostic.code)));
        if is_new {
            self.diagnostics.push(diagnostic.at(place));
        }
    }

    /// A value with the bytes that say it.
    pub fn value<T>(&self, value: T, span: &Range<usize>) -> Noted<T> {
        Noted::new(value, self.place(span))
    }

    /// Remembers that an element was skipped.
    pub fn ignore(&mut self, what: &str, span: &Range<usize>) {
        if let Some(&index) = self.ignored_index.get(what) {
            self.ignored[index].count += 1;
        } else if self.ignored.len() < 1000 {
            self.ignored_index.insert(what.to_string(), self.ignored.len());
            let place = self.place(span);
            self.ignored.push(Ignored { what: what.to_string(), count: 1, place });
        }
    }

    /// What was skipped.
    pub fn into_ignored(self) -> Vec<Ignored> {
        self.ignored
    }

    /// The number that `text` is, or a complaint.
    pub fn number(&mut self, what: &str, text: &str, span: &Range<usize>, range: Range64) -> Option<f64> {
        let is_word = text.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_alphabetic());
        let parsed = text.parse::<f64>();
        if text.contains("${") || text.contains("$(") {
            self.complain(span, messages::xacro_left(text, 0));
            return None;
        }
        match parsed {
            Ok(x) if x.is_infinite() && is_word && range == Range64::Limit => Some(x),
            Ok(x) if !x.is_finite() => {
                self.complain(span, messages::not_finite(what, text));
                None
            }
            Ok(x) if x.abs() > GREATEST && range == Range64::Finite => {
                self.complain(span, messages::out_of_range(what, x, GREATEST));
                None
            }
            Ok(x) => Some(x),
            Err(_) => {
                self.complain(span, messages::not_a_number(what, text));
                None
            }
        }
    }

    /// The name that `text` is, or a complaint.
    pub fn name(&mut self, what: &str, text: &str, span: &Range<usize>) -> Option<Noted<String>> {
        if text.trim().is_empty() {
            self.complain(span, messages::empty_name(what));
            None
        } else if text.contains("${") {
            self.complain(span, messages::xacro_left(text, 0));
            None
        } else {
            Some(self.value(text.to_string(), span))
        }
    }

    /// A joint after complaints about what a composite one cannot have: what would belong to several coordinates, and an oblique axis.
    pub fn judged_composite(&mut self, joint: WrittenJoint) -> WrittenJoint {
        let Some(composite) = joint.kind.value.composite else { return joint };
        let (word, owner) = (composite.of.word, format!("joint `{}`", joint.name.value));
        for (what, value) in joint.of_one_coordinate().into_iter().filter(|_| !composite.of.has_pitch) {
            let complaint = messages::several_coordinates(&joint.name.value, word, what);
            self.diagnostics.push(complaint.at(&value.place));
        }
        if let (false, Placement::Frames { axis, .. }) = (joint.has_fit_axis(), &joint.placement) {
            self.diagnostics.push(messages::oblique_plane(&owner, word).at(&axis.place));
        }
        joint
    }
}
