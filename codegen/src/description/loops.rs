//! Closed loops: what robot files say of them, and tables `[[loop]]` of those in TOML.

use super::reader::FileReader;
use super::table::TomlTable;
use super::{messages, Noted};

/// Two points of links that coincide, with what may turn there.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenLoop {
    /// What messages and reports call it.
    pub name: Noted<String>,
    /// The points.
    pub points: LoopPoints,
    /// The joints that it determines; none: those that do it best.
    pub determines: Vec<Noted<String>>,
    /// The assembly in which it closes; `None`: the one in which its joints stand.
    pub assembly: Option<Noted<WrittenAssembly>>,
    /// What may turn where they coincide.
    pub joint: ClosingJoint,
}

/// A joint that closes a loop.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ClosingJoint {
    /// A ball joint: points coincide.
    #[default]
    Spherical,
    /// A hinge, by its axis in the frame of the first link or in the first one of two frames: in the other frame it is the same.
    Revolute(Noted<[f64; 3]>),
    /// A weld: frames coincide.
    Fixed,
}

/// How a file says where a loop closes.
#[derive(Clone, Debug, PartialEq)]
pub enum LoopPoints {
    /// The origins of two frames, named ones or those of links.
    Frames([Noted<String>; 2]),
    /// A point of the first link \[m\], and what is there of the second one in the pose of the file.
    Anchor {
        /// The links; `None`: the world.
        links: [Option<Noted<String>>; 2],
        /// The point in the frame of the first one.
        point: Noted<[f64; 3]>,
    },
}

impl LoopPoints {
    /// The names of the links or frames.
    pub(crate) fn names_mut(&mut self) -> Vec<&mut Noted<String>> {
        match self {
            LoopPoints::Frames(frames) => frames.iter_mut().collect(),
            LoopPoints::Anchor { links, .. } => links.iter_mut().flatten().collect(),
        }
    }
}

const LOOP: &[&str] = &["name", "frame", "with", "kind", "axis", "determines", "assembly"];

/// The kinds of joints that close loops.
#[derive(Clone, Copy, PartialEq)]
enum ClosingKind {
    Spherical,
    Revolute,
    Fixed,
}

const KINDS: [(&str, ClosingKind); 3] =
    [("spherical", ClosingKind::Spherical), ("revolute", ClosingKind::Revolute), ("fixed", ClosingKind::Fixed)];

/// One of the two assemblies of a loop that closes in closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrittenAssembly {
    /// The one that is nearest to the pose of the file.
    Drawn,
    /// The other one.
    Mirrored,
}

impl WrittenAssembly {
    /// How files say it.
    pub const WORDS: [(&'static str, WrittenAssembly); 2] =
        [("drawn", WrittenAssembly::Drawn), ("mirrored", WrittenAssembly::Mirrored)];

    /// Its word.
    pub fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(_, own)| *own == self).expect("every assembly has a word").0
    }
}

impl ClosingJoint {
    /// The word for it in TOML.
    pub fn word(&self) -> &'static str {
        let kind = match self {
            ClosingJoint::Spherical => ClosingKind::Spherical,
            ClosingJoint::Revolute(_) => ClosingKind::Revolute,
            ClosingJoint::Fixed => ClosingKind::Fixed,
        };
        KINDS.iter().find(|(_, own)| *own == kind).expect("every kind has a word").0
    }
}

impl FileReader<'_> {
    /// Frames whose origins coincide.
    pub fn loops_at(&mut self, top: &TomlTable) -> Vec<WrittenLoop> {
        let tables = self.tables_at(top, "loop");
        tables.into_iter().filter_map(|table| self.closed_loop(table)).collect()
    }

    fn closed_loop(&mut self, mut table: TomlTable) -> Option<WrittenLoop> {
        self.require(&table, "name", "name = \"...\"");
        let name = self.name_at(&table, "name", "loop");
        if let Some(name) = &name {
            table.owner = format!("loop `{}`", name.value);
        }
        self.check_keys(&table, LOOP);
        let mut end = |key: &str| {
            self.require(&table, key, &format!("{key} = \"...\""));
            self.name_at(&table, key, "frame")
        };
        let (one, other) = (end("frame"), end("with"));
        let determines = self.names_at(&table, "determines", "joint");
        let assembly = self.word_at(&table, "assembly", &WrittenAssembly::WORDS);
        let joint = self.closing_joint(&table);
        Some(WrittenLoop { name: name?, points: LoopPoints::Frames([one?, other?]), determines, assembly, joint })
    }

    /// A ball joint where nothing is said; an axis belongs to a hinge.
    fn closing_joint(&mut self, table: &TomlTable) -> ClosingJoint {
        let kind = self.word_at(table, "kind", &KINDS).map_or(ClosingKind::Spherical, |kind| kind.value);
        let axis = self.axis_at(table, "axis");
        match (kind, axis) {
            (ClosingKind::Revolute, None) => {
                self.require(table, "axis", "axis = \"z\"");
                ClosingJoint::Spherical
            }
            (ClosingKind::Revolute, Some(axis)) => ClosingJoint::Revolute(axis),
            (kind, axis) => {
                if let Some(axis) = axis {
                    self.diagnostics.push(messages::unused_axis(&table.owner).at(&axis.place));
                }
                if kind == ClosingKind::Fixed {
                    ClosingJoint::Fixed
                } else {
                    ClosingJoint::Spherical
                }
            }
        }
    }
}
