//! Closed loops: what robot files say of them, and tables `[[loop]]` of those in TOML.

use super::reader::FileReader;
use super::table::TomlTable;
use super::Noted;

/// Two points of links that coincide.
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
    /// The axis, in the frame of the first link, of a hinge that closes it in its plane; `None`: a ball joint.
    pub hinge: Option<Noted<[f64; 3]>>,
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

const LOOP: &[&str] = &["name", "frame", "with", "determines", "assembly"];

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
        Some(WrittenLoop { name: name?, points: LoopPoints::Frames([one?, other?]), determines, assembly, hinge: None })
    }
}
