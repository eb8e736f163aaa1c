//! Walking a TOML document with places, so that one run finds all complaints.

mod elements;

pub use elements::{DRIVE_KEYS, INERTIAL_KEYS};

use super::reader::{FileReader, Range64};
use super::{messages, Noted};
use crate::diagnostic::{Diagnostic, Diagnostics, Source};
use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::Spanned;
use toml_parser::lexer::TokenKind;

type Span = Range<usize>;

/// Parts of a dotted key, and brackets inside each other: the parser recurses as deep.
const DEEPEST: usize = 16;

/// A table and how complaints name it.
pub struct TomlTable<'a, 'i> {
    /// What it describes, in complaints: ``joint `elbow` ``.
    pub owner: String,
    /// Keys and values.
    pub table: &'a DeTable<'i>,
    /// Where it stands.
    pub span: Span,
}

/// Whether a text is TOML, right or nearly, and its top table is as asked for.
pub fn holds(text: &str, is_it: fn(&TomlTable) -> bool) -> bool {
    wrong_bracket(text).is_none() && is_it(&TomlTable::of_document(&DeTable::parse_recoverable(text).0))
}

/// The document, or complaints about its syntax.
pub fn parse<'i>(source: &'i Source, diagnostics: &mut Diagnostics) -> Option<Spanned<DeTable<'i>>> {
    let mut reader = FileReader::new(source, diagnostics);
    if let Some((span, complaint)) = wrong_bracket(source.text()) {
        reader.complain(&span, complaint);
        return None;
    }
    let (document, errors) = DeTable::parse_recoverable(source.text());
    let mut last_line = 0;
    for error in &errors {
        let span = error.span().unwrap_or(0..0);
        // what follows on a line follows from its first error
        let line = reader.place(&span).line;
        if std::mem::replace(&mut last_line, line) == line {
            continue;
        }
        let said = error.message().lines().next().unwrap_or("");
        reader.complain(&span, messages::toml_syntax(said));
    }
    errors.is_empty().then_some(document)
}

/// The first bracket that does not match, or bracket or dotted key that nests deeply, which the parser's recursion does not bear.
fn wrong_bracket(text: &str) -> Option<(Span, Diagnostic)> {
    let mut open: Vec<(TokenKind, Span)> = Vec::new();
    let mut parts = 0;
    for token in toml_parser::Source::new(text).lex() {
        let span = token.span().start()..token.span().end();
        parts = match token.kind() {
            TokenKind::Dot => parts + 1,
            TokenKind::Equals
            | TokenKind::Comma
            | TokenKind::Newline
            | TokenKind::LeftCurlyBracket
            | TokenKind::LeftSquareBracket => 0,
            _ => parts,
        };
        if parts >= DEEPEST {
            return Some((span, messages::too_complex("parts of a dotted key", DEEPEST)));
        }
        match token.kind() {
            kind @ (TokenKind::LeftCurlyBracket | TokenKind::LeftSquareBracket) => open.push((kind, span.clone())),
            TokenKind::RightCurlyBracket | TokenKind::RightSquareBracket => {
                let closes = match token.kind() {
                    TokenKind::RightCurlyBracket => TokenKind::LeftCurlyBracket,
                    _ => TokenKind::LeftSquareBracket,
                };
                if open.pop().is_none_or(|(kind, _)| kind != closes) {
                    return Some((span, messages::toml_syntax("this bracket closes none")));
                }
            }
            _ => {}
        }
        if open.len() > DEEPEST {
            return Some((span, messages::too_complex("brackets inside each other", DEEPEST)));
        }
    }
    open.pop().map(|(_, span)| (span, messages::toml_syntax("this bracket is never closed")))
}

impl<'a, 'i> TomlTable<'a, 'i> {
    /// The top table.
    pub fn of_document(document: &'a Spanned<DeTable<'i>>) -> TomlTable<'a, 'i> {
        TomlTable { owner: "the file".to_string(), table: document.get_ref(), span: 0..0 }
    }

    /// Value and span of a key.
    pub fn get(&self, key: &str) -> Option<(&'a DeValue<'i>, Span)> {
        self.table.get(key).map(|value| (value.get_ref(), value.span()))
    }

    /// Whether the file has the key.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// `com of link x`.
    pub fn what(&self, key: &str) -> String {
        format!("{key} of {}", self.owner)
    }
}

/// How a value's type is called.
fn type_name(value: &DeValue) -> String {
    match value {
        DeValue::Array(array) => format!("an array of {}", array.len()),
        DeValue::String(_) => "a string".to_string(),
        DeValue::Integer(_) | DeValue::Float(_) => "a number".to_string(),
        DeValue::Boolean(_) => "a boolean".to_string(),
        DeValue::Datetime(_) => "a date".to_string(),
        DeValue::Table(_) => "a table".to_string(),
    }
}

impl FileReader<'_> {
    /// Complains of every key that is not known.
    pub fn check_keys(&mut self, table: &TomlTable, known: &[&str]) {
        for key in table.table.keys() {
            if !known.contains(&key.get_ref().as_ref()) {
                self.complain(&key.span(), messages::unknown_key(&table.owner, key.get_ref(), known));
            }
        }
    }

    /// Complains if a key is missing.
    pub fn require(&mut self, table: &TomlTable, key: &str, example: &str) {
        if !table.has(key) {
            self.complain(&table.span, messages::missing_key(&table.owner, key, example));
        }
    }

    /// Complains of a value of another type.
    pub fn wrong_type(&mut self, what: &str, expected: &str, value: &DeValue, span: &Span) {
        self.complain(span, messages::wrong_type(what, expected, &type_name(value)));
    }

    /// A number, or a complaint.
    pub fn real(&mut self, what: &str, value: &DeValue, span: &Span, range: Range64) -> Option<f64> {
        match value {
            DeValue::Float(float) => self.number(what, float.as_str(), span, range),
            DeValue::Integer(integer) if integer.radix() == 10 => self.number(what, integer.as_str(), span, range),
            DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(integer) => Some(integer as f64),
                Err(_) => {
                    self.complain(span, messages::not_a_number(what, integer.as_str()));
                    None
                }
            },
            _ => {
                self.wrong_type(what, "a number", value, span);
                None
            }
        }
    }

    /// The number of a key; `None` where there is no such key, or after a complaint.
    pub fn real_at(&mut self, table: &TomlTable, key: &str, range: Range64) -> Option<Noted<f64>> {
        let (value, span) = table.get(key)?;
        let value = self.real(&table.what(key), value, &span, range)?;
        Some(self.value(value, &span))
    }

    /// `true` or `false`.
    pub fn flag_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<bool>> {
        let (value, span) = table.get(key)?;
        match value {
            DeValue::Boolean(flag) => Some(self.value(*flag, &span)),
            _ => {
                self.wrong_type(&table.what(key), "`true` or `false`", value, &span);
                None
            }
        }
    }

    /// A whole number that is not negative.
    pub fn count_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<usize>> {
        let (value, span) = table.get(key)?;
        let count = match value {
            DeValue::Integer(integer) => usize::from_str_radix(integer.as_str(), integer.radix()).ok(),
            _ => None,
        };
        if count.is_none() {
            let found = match value {
                DeValue::Integer(_) | DeValue::Float(_) => {
                    self.source.text().get(span.clone()).unwrap_or("").to_string()
                }
                _ => type_name(value),
            };
            let what = table.what(key);
            self.complain(&span, messages::wrong_type(&what, "a whole number from 0", &found));
        }
        count.map(|count| self.value(count, &span))
    }

    /// An array of names of something.
    pub fn names_at(&mut self, table: &TomlTable, key: &str, what: &str) -> Vec<Noted<String>> {
        let Some((value, span)) = table.get(key) else { return Vec::new() };
        let DeValue::Array(array) = value else {
            self.wrong_type(&table.what(key), "an array of names", value, &span);
            return Vec::new();
        };
        let mut names = Vec::new();
        for item in array.iter() {
            match item.get_ref() {
                DeValue::String(text) => names.extend(self.name(what, text, &item.span())),
                other => self.wrong_type(&table.what(key), "a name", other, &item.span()),
            }
        }
        names
    }

    /// The text of a key; `None` likewise.
    pub fn string_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<String>> {
        let (value, span) = table.get(key)?;
        match value {
            DeValue::String(text) => Some(self.value(text.to_string(), &span)),
            _ => {
                self.wrong_type(&table.what(key), "a string", value, &span);
                None
            }
        }
    }

    /// The text of a key as a name: not empty, and of characters that can be shown.
    pub fn name_at(&mut self, table: &TomlTable, key: &str, what: &str) -> Option<Noted<String>> {
        let text = self.string_at(table, key)?;
        self.name(what, &text.value, &text.place.span)
    }

    /// One of a few words.
    pub fn word_at<T: Copy>(&mut self, table: &TomlTable, key: &str, words: &[(&str, T)]) -> Option<Noted<T>> {
        let text = self.string_at(table, key)?;
        self.word(&table.what(key), &text, words).map(|value| Noted::new(value, text.place))
    }

    /// What a word stands for, or a complaint.
    pub fn word<T: Copy>(&mut self, what: &str, text: &Noted<String>, words: &[(&str, T)]) -> Option<T> {
        let known = words.iter().find(|w| w.0 == text.value);
        if known.is_none() {
            let known: Vec<&str> = words.iter().map(|w| w.0).collect();
            self.diagnostics.push(messages::unknown_word(what, &text.value, &known).at(&text.place));
        }
        known.map(|w| w.1)
    }

    /// So many numbers in an array; `form` says so in words.
    pub fn reals_at<const N: usize>(
        &mut self,
        table: &TomlTable,
        key: &str,
        form: &str,
        range: Range64,
    ) -> Option<[f64; N]> {
        let (value, span) = table.get(key)?;
        let what = table.what(key);
        let DeValue::Array(array) = value else {
            self.wrong_type(&what, form, value, &span);
            return None;
        };
        if array.len() != N {
            self.complain(&span, messages::wrong_count(&what, form, array.len()));
            return None;
        }
        let numbers: Vec<_> = array.iter().map(|item| self.real(&what, item.get_ref(), &item.span(), range)).collect();
        let numbers: Option<Vec<f64>> = numbers.into_iter().collect();
        numbers?.try_into().ok()
    }

    /// Numbers in an array; all complaints of them before `None`.
    pub fn all_reals_at(&mut self, table: &TomlTable, key: &str, range: Range64) -> Option<Vec<f64>> {
        let (value, span) = table.get(key)?;
        let what = table.what(key);
        let DeValue::Array(array) = value else {
            self.wrong_type(&what, "an array of numbers", value, &span);
            return None;
        };
        let numbers: Vec<_> = array.iter().map(|item| self.real(&what, item.get_ref(), &item.span(), range)).collect();
        numbers.into_iter().collect()
    }

    fn triple(&mut self, what: &str, value: &DeValue, span: &Span) -> Option<[(f64, Span); 3]> {
        let DeValue::Array(array) = value else {
            self.wrong_type(what, "three numbers in an array", value, span);
            return None;
        };
        if array.len() != 3 {
            self.complain(span, messages::wrong_count(what, "three numbers", array.len()));
            return None;
        }
        let numbers: Vec<_> = array
            .iter()
            .map(|item| self.real(what, item.get_ref(), &item.span(), Range64::Finite).map(|x| (x, item.span())))
            .collect();
        let mut numbers = numbers.into_iter().flatten();
        Some([numbers.next()?, numbers.next()?, numbers.next()?])
    }

    /// Numbers in an array.
    pub fn row(&mut self, what: &str, value: &DeValue, span: &Span) -> Option<Vec<f64>> {
        let DeValue::Array(array) = value else {
            self.wrong_type(what, "numbers in an array", value, span);
            return None;
        };
        let numbers: Vec<Option<f64>> =
            array.iter().map(|item| self.real(what, item.get_ref(), &item.span(), Range64::Finite)).collect();
        numbers.into_iter().collect()
    }

    /// Three numbers in an array.
    pub fn vector_at(&mut self, table: &TomlTable, key: &str) -> Option<Noted<[f64; 3]>> {
        let (value, span) = table.get(key)?;
        let [x, y, z] = self.triple(&table.what(key), value, &span)?;
        Some(self.value([x.0, y.0, z.0], &span))
    }

    /// A required vector; a placeholder after a complaint.
    pub fn required_vector(&mut self, table: &TomlTable, key: &str, example: &str) -> Noted<[f64; 3]> {
        self.require(table, key, example);
        self.vector_at(table, key).unwrap_or_else(|| self.value([0.0, 0.0, 1.0], &table.span))
    }

    /// The table of that key.
    pub fn table_at<'a, 'i>(&mut self, table: &TomlTable<'a, 'i>, key: &str, owner: &str) -> Option<TomlTable<'a, 'i>> {
        let (value, span) = table.get(key)?;
        match value {
            DeValue::Table(inner) => Some(TomlTable { owner: owner.to_string(), table: inner, span }),
            _ => {
                self.wrong_type(owner, "a table", value, &span);
                None
            }
        }
    }

    /// The tables of an array `[[key]]`.
    pub fn tables_at<'a, 'i>(&mut self, table: &TomlTable<'a, 'i>, key: &str) -> Vec<TomlTable<'a, 'i>> {
        let Some((value, span)) = table.get(key) else { return Vec::new() };
        let DeValue::Array(array) = value else {
            self.wrong_type(key, &format!("`[[{key}]]` tables"), value, &span);
            return Vec::new();
        };
        let mut tables = Vec::new();
        for (i, item) in array.iter().enumerate() {
            match item.get_ref() {
                DeValue::Table(inner) => {
                    tables.push(TomlTable { owner: format!("{key} {}", i + 1), table: inner, span: item.span() });
                }
                other => self.wrong_type(&format!("{key} {}", i + 1), "a table", other, &item.span()),
            }
        }
        tables
    }
}
