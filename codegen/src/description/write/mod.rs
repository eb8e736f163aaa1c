//! Robot files as text: what writes a format, and what several of them need.
//!
//! A writer takes a [`Description`] whose joints all stand as its format says it ([`JointForm`]), and that has nothing left which the format
//! cannot say ([`losses`]). Numbers are the shortest that read back to the same f64.

mod drives;
pub mod edits;
pub mod losses;
pub(super) mod mjcf;
pub(crate) mod rotations;
pub(super) mod sdf;
pub(super) mod toml;
pub(super) mod urdf;

use super::{Description, JointType, NamedFrame, WrittenJoint, WrittenLink};
use crate::diagnostic::Source;
use edits::TextEdit;
use losses::Loss;
pub(crate) use rotations::{of_length_one, pose_of};
use std::collections::HashMap;
use std::fmt::Write;
use straightline_core::joint::{Dialect, JointKind};

/// What writes files of a format.
#[derive(Debug)]
pub struct FormatWriter {
    /// The word for the format on the command line.
    pub word: &'static str,
    /// How names of files end that are to be of this format.
    pub extensions: &'static [&'static str],
    /// How joints stand in it.
    pub joints: JointForm,
    /// How it says rotations, for who reads about it.
    pub rotations: &'static str,
    /// Whether links are all the frames that it has.
    pub frames_are_links: bool,
    /// How it says closed loops.
    pub loops: LoopForm,
    /// What it has no place for, or says in another way.
    pub losses: &'static [&'static Loss],
    /// Whether a robot that floats is read as that only if the reader is told.
    pub floats_by_option: bool,
    /// The text of a robot.
    pub text: fn(&Description) -> String,
    /// What changes in a file of a robot whose inertias and losses of joints are others; `None`: such a file is written anew.
    pub edits: Option<NumberEdits>,
}

/// The changes that lead from a file, and what it says, to what it is to say.
pub type NumberEdits = fn(&Source, [&Description; 2]) -> Vec<TextEdit>;

/// Where joints stand in a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointForm {
    /// At the frame of the link that they move.
    AtFrames,
    /// Anywhere in it.
    Anywhere,
}

/// How a format says closed loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoopForm {
    /// Not at all.
    Nowhere,
    /// By two frames, wherever their joints stand, and with the joints that they determine.
    Frames,
    /// By a frame and what is there where all coordinates are zero; who reads it chooses the joints that they determine.
    AtZero,
}

/// A robot with what stands on each of its links.
struct OnLinks<'a> {
    robot: &'a Description,
    links: HashMap<&'a str, &'a WrittenLink>,
    joints: HashMap<&'a str, Vec<&'a WrittenJoint>>,
    frames: HashMap<&'a str, Vec<&'a NamedFrame>>,
}

impl<'a> OnLinks<'a> {
    fn of(robot: &'a Description) -> OnLinks<'a> {
        let mut on = OnLinks { robot, links: HashMap::new(), joints: HashMap::new(), frames: HashMap::new() };
        for link in &robot.links {
            on.links.insert(&link.name.value, link);
        }
        for joint in &robot.joints {
            on.joints.entry(&joint.parent.value).or_default().push(joint);
        }
        for frame in &robot.frames {
            on.frames.entry(&frame.link.value).or_default().push(frame);
        }
        on
    }

    /// The link of a name.
    fn link(&self, name: &str) -> Option<&'a WrittenLink> {
        self.links.get(name).copied()
    }

    /// The joints that a link carries, in the order of the file.
    fn joints(&self, link: &WrittenLink) -> &[&'a WrittenJoint] {
        self.joints.get(link.name.value.as_str()).map_or(&[], Vec::as_slice)
    }

    /// The frames on a link that are only that.
    fn frames(&self, link: &WrittenLink) -> &[&'a NamedFrame] {
        self.frames.get(link.name.value.as_str()).map_or(&[], Vec::as_slice)
    }

    /// Whether a link only carries joints: nothing else is there.
    fn is_bare(&self, link: &WrittenLink) -> bool {
        link.is_carrier && link.inertial.is_none() && self.frames(link).is_empty()
    }
}

/// The words of a joint in a format: that with a range if it has one, or else that without; `None`: it has none.
fn word_of(kind: Option<JointKind>, is_ranged: bool, dialect: Dialect) -> Option<&'static str> {
    let words = JointType::words(dialect);
    let all = || words.iter().filter(|(_, t)| t.kind == kind && t.composite.is_none());
    let fit = all().find(|(_, t)| t.has_range == is_ranged).or_else(|| all().next());
    fit.map(|(word, _)| *word)
}

/// Numbers with spaces between them.
fn numbers(all: &[f64]) -> String {
    all.iter().map(|x| number(*x)).collect::<Vec<_>>().join(" ")
}

/// The shortest number that reads back as that; whole ones without a point, zero without a sign.
fn number(x: f64) -> String {
    match x {
        0.0 => "0".to_string(),
        _ if x.fract() == 0.0 && x.abs() < 1e15 => format!("{x:.0}"),
        _ => format!("{x:?}"),
    }
}

/// An attribute of XML with a space before it.
fn attribute(name: &str, value: &str) -> String {
    format!(" {name}=\"{}\"", escaped(value))
}

/// A text as XML has it.
fn escaped(value: &str) -> String {
    let mut text = String::new();
    for c in value.chars() {
        match c {
            '&' => text += "&amp;",
            '<' => text += "&lt;",
            '>' => text += "&gt;",
            '"' => text += "&quot;",
            '\t' | '\n' | '\r' => _ = write!(text, "&#{};", u32::from(c)),
            _ => text.push(c),
        }
    }
    text
}
