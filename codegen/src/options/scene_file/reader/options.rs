//! The options in a scene file: those of `[options]`, and of the tables where some stand beside others.

use super::SceneReader;
use crate::description::messages;
use crate::description::reader::Range64;
use crate::description::table::TomlTable;
use crate::diagnostic::Front;
use crate::options::table::{Call, OptionKind, OptionRow, TABLE};
use crate::options::value::{OptionValue, Vocabulary};
use crate::scene::messages as say;
use std::ops::Range;
use toml::de::DeValue;

/// The names of the options that stand in a table.
pub(super) fn options_of(table: &str) -> Vec<&'static str> {
    TABLE.iter().filter(|row| row.stands_in(table)).map(|row| row.name).collect()
}

impl SceneReader<'_> {
    /// `[options]`: a key that stands elsewhere is told where.
    pub(super) fn own_options(&mut self, table: &TomlTable) {
        let known = options_of("options");
        for key in table.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref())) {
            let elsewhere = TABLE.iter().find(|row| row.name == key.get_ref().as_ref()).map(|row| match row.scene {
                Call::Name => format!("it stands in [{}]", row.table),
                Call::As(other) => format!("write {other}"),
                Call::Not(why) => why.to_string(),
            });
            let complaint = messages::unknown_key(&table.owner, key.get_ref(), &known);
            let complaint = elsewhere.into_iter().fold(complaint, |complaint, help| complaint.help(help));
            self.reader.complain(&key.span(), complaint);
        }
        self.options(table, "options");
    }

    /// The options that stand in a table of that name.
    pub(super) fn options(&mut self, table: &TomlTable, name: &str) {
        for row in TABLE.iter().filter(|row| row.stands_in(name)) {
            let Some((_, span)) = table.get(row.name) else { continue };
            let place = self.reader.place(&span);
            if self.file.settings.has(row.name) {
                self.reader.diagnostics.push(say::written_twice(row.name, row.also).at(&place));
            }
            let Some(value) = self.option(table, row, &span) else { continue };
            self.file.scene.places.note(format!("options.{}", row.name), &place);
            self.file.settings.give(row, value, Front::CommandLine).expect("it was checked word by word");
        }
    }

    /// The value of an option; `None` after a complaint that leaves nothing of it.
    fn option(&mut self, table: &TomlTable, row: &'static OptionRow, span: &Range<usize>) -> Option<OptionValue> {
        let (reader, key) = (&mut self.reader, row.name);
        let number = match &row.kind {
            OptionKind::Flag => return reader.flag_at(table, key).map(|flag| flag.value.into()),
            OptionKind::Vector => return reader.vector_at(table, key).map(|vector| vector.value.into()),
            OptionKind::Real(..) => reader.real_at(table, key, Range64::Finite)?.value,
            OptionKind::Whole(..) => reader.count_at(table, key)?.value as f64,
            _ => return self.words(table, row),
        };
        match row.wrong_number(number) {
            None => Some(number.into()),
            Some(wrong) => {
                reader.complain(span, wrong);
                None
            }
        }
    }

    /// The words of an option: one as a text, several in an array. Of codes those count that are right.
    fn words(&mut self, table: &TomlTable, row: &'static OptionRow) -> Option<OptionValue> {
        let (reader, key) = (&mut self.reader, row.name);
        let is_codes = matches!(row.kind, OptionKind::Codes(_));
        let (words, count) = match (table.get(key)?.0, &row.kind) {
            (DeValue::Array(array), OptionKind::Words(_) | OptionKind::Names { .. } | OptionKind::Codes(_)) => {
                (reader.names_at(table, key, if is_codes { "code" } else { key.trim_end_matches('s') }), array.len())
            }
            (DeValue::String(_), OptionKind::Words(of)) if !of.is_of_items => (vec![reader.string_at(table, key)?], 1),
            (_, OptionKind::Word(..)) => (vec![reader.string_at(table, key)?], 1),
            _ => (reader.names_at(table, key, ""), 1),
        };
        let mut right = Vec::new();
        for word in words {
            let known = |of: &Vocabulary| (of.words)().iter().map(|(word, _)| *word).collect::<Vec<&str>>();
            let wrong = row.wrong_word(&word.value).map(|wrong| match &row.kind {
                OptionKind::Word(of, _) | OptionKind::Words(of) => {
                    messages::unknown_word(&table.what(key), &word.value, &known(of))
                }
                _ => wrong,
            });
            match wrong {
                Some(wrong) => reader.diagnostics.push(wrong.at(&word.place)),
                None => right.push(word.value),
            }
        }
        (is_codes || right.len() == count).then_some(OptionValue::Words(right))
    }
}
