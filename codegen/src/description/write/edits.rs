//! Changes of numbers in a file, which leave everything else as it is written: comments, order, digits, and what is skipped.

use super::number;
use crate::diagnostic::Place;
use std::ops::Range;

/// A text in place of another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextEdit {
    /// The bytes that it replaces; none of them where something is put in.
    pub span: Range<usize>,
    /// What stands there then.
    pub text: String,
}

impl TextEdit {
    /// What is put in.
    pub(super) fn insert(at: usize, text: String) -> TextEdit {
        TextEdit { span: at..at, text }
    }
}

/// The text with these changes; those at one place stand in their order.
pub fn edited(text: &str, mut edits: Vec<TextEdit>) -> String {
    edits.sort_by_key(|edit| edit.span.start);
    let (mut out, mut at) = (String::with_capacity(text.len()), 0);
    for TextEdit { span, text: new } in edits {
        out += &text[at..span.start];
        out += &new;
        at = span.end;
    }
    out + &text[at..]
}

/// The white space that the line of this byte begins with.
pub(super) fn indentation(text: &str, at: usize) -> &str {
    let start = text[..at].rfind('\n').map_or(0, |newline| newline + 1);
    let line = &text[start..at];
    &line[..line.len() - line.trim_start().len()]
}

/// Entries of TOML tables that change.
pub(super) struct TomlEdits<'a> {
    text: &'a str,
    pub edits: Vec<TextEdit>,
}

impl<'a> TomlEdits<'a> {
    pub fn new(text: &'a str) -> Self {
        TomlEdits { text, edits: Vec::new() }
    }

    /// Writes a value over that at a place, or an entry after that of `beside` where there was none.
    pub fn set(&mut self, key: &str, was: Option<&Place>, beside: &Place, value: String) {
        if let Some(was) = was {
            self.edits.push(TextEdit { span: was.span.clone(), text: value });
            return;
        }
        let rest = &self.text[beside.span.end..];
        let line_end = rest.find('\n').unwrap_or(rest.len());
        let behind = rest[..line_end].trim_start();
        // a table in braces goes on in the line
        let edit = match behind.is_empty() || behind.starts_with('#') {
            true => {
                let indent = indentation(self.text, beside.span.start);
                TextEdit::insert(
                    beside.span.end + rest[..line_end].trim_end().len(),
                    format!("\n{indent}{key} = {value}"),
                )
            }
            false => TextEdit::insert(beside.span.end, format!(", {key} = {value}")),
        };
        self.edits.push(edit);
    }

    /// The same of a number, unless it is what it was.
    pub fn set_number(&mut self, key: &str, was: Option<(f64, &Place)>, beside: &Place, value: f64) {
        if was.is_none_or(|(was, _)| was != value) {
            self.set(key, was.map(|(_, place)| place), beside, number(value));
        }
    }
}
