//! Tables `[[loop]]` of robot files in TOML: where bodies close a loop.

use super::reader::FileReader;
use super::table::TomlTable;
use super::{LoopPoints, WrittenLoop};

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
        Some(WrittenLoop { name: name?, points: LoopPoints::Frames([one?, other?]), determines, assembly })
    }
}
