//! Tables `[[coupling]]`, of robot files in TOML and of scenes.

use super::reader::{FileReader, Range64};
use super::table::TomlTable;
use super::WrittenCoupling;

const COUPLING: &[&str] = &["joint", "follows", "ratio", "offset"];

impl FileReader<'_> {
    /// Joints that follow others.
    pub fn couplings_at(&mut self, top: &TomlTable) -> Vec<WrittenCoupling> {
        let tables = self.tables_at(top, "coupling");
        tables.into_iter().filter_map(|table| self.coupling(table)).collect()
    }

    fn coupling(&mut self, mut table: TomlTable) -> Option<WrittenCoupling> {
        self.require(&table, "joint", "joint = \"...\"");
        let joint = self.name_at(&table, "joint", "joint");
        if let Some(joint) = &joint {
            table.owner = format!("coupling of joint `{}`", joint.value);
        }
        self.check_keys(&table, COUPLING);
        self.require(&table, "follows", "follows = \"...\"");
        let source = self.name_at(&table, "follows", "joint");
        let mut number = |key: &str, default: f64| match table.has(key) {
            true => self.real_at(&table, key, Range64::Finite),
            false => Some(self.value(default, &table.span)),
        };
        let (ratio, offset) = (number("ratio", 1.0), number("offset", 0.0));
        Some(WrittenCoupling { joint: joint?, source: source?, ratio: ratio?, offset: offset? })
    }
}
