//! The text of a URDF file before it is parsed: what is forgiven, and what is said where it is no XML.

use super::{Span, MOST_ATTRIBUTES, MOST_NAMESPACES, MOST_NODES};
use crate::description::messages;
use crate::description::reader::FileReader;
use std::borrow::Cow;

pub(super) fn complain_of_xml(reader: &mut FileReader, error: &roxmltree::Error) {
    use roxmltree::Error;
    let text = reader.source.text();
    let at = match error {
        Error::NodesLimitReached | Error::AttributesLimitReached | Error::NamespacesLimitReached => {
            reader.complain(&(0..0), messages::too_complex("nodes of the XML file", MOST_NODES));
            return;
        }
        Error::UnexpectedEndOfStream | Error::UnclosedRootNode | Error::NoRootNode => text.len(),
        _ => {
            let at = error.pos();
            let line_start: usize =
                text.split_inclusive('\n').take((at.row as usize).saturating_sub(1)).map(str::len).sum();
            let line = text.get(line_start..).unwrap_or("");
            let in_line: usize = line.chars().take((at.col as usize).saturating_sub(1)).map(char::len_utf8).sum();
            line_start + in_line
        }
    };
    if let Error::UnknownNamespace(prefix, _) = error {
        reader.complain(&(at..at + 1), messages::xacro_left(&format!("{prefix}:"), 0));
        return;
    }
    let said = error.to_string();
    let said = match said.rsplit_once(" at ") {
        Some((said, place)) if place.chars().all(|c| c.is_ascii_digit() || c == ':') => said,
        _ => &said,
    };
    let span = if matches!(error, Error::UnexpectedEndOfStream | Error::UnclosedRootNode) {
        let end = text.trim_end().len();
        end.saturating_sub(1)..end
    } else {
        at..at + 1
    };
    reader.complain(&span, messages::xml_syntax(said));
}

/// The text with comments blanked and a late XML declaration blanked, byte for byte as long; `None` after a complaint.
pub(super) fn tolerant_text<'a>(reader: &mut FileReader<'a>) -> Option<Cow<'a, str>> {
    let source = reader.source;
    let text = source.text();
    if text.matches("xmlns").take(MOST_NAMESPACES + 1).count() > MOST_NAMESPACES {
        reader.complain(&(0..0), messages::too_complex("declarations of namespaces", MOST_NAMESPACES));
        return None;
    }
    let mut out: Vec<u8> = Vec::new(); // stays empty as long as nothing is changed
    let mut at = 0;
    while let Some(found) = text[at..].find('<') {
        let start = at + found;
        let rest = &text[start..];
        if let Some(comment) = rest.strip_prefix("<!--") {
            let Some(length) = comment.find("-->").map(|n| n + 7) else {
                reader.complain(&(start..start + 4), messages::xml_syntax("the comment is never closed"));
                return None;
            };
            blank(text, &mut out, start..start + length);
            at = start + length;
        } else if rest.starts_with("<![CDATA[") {
            at = rest.find("]]>").map_or(text.len(), |n| start + n + 3);
        } else if rest.starts_with("<!DOCTYPE") {
            // a document type without declarations of its own says nothing; with them, entities could be anything
            let length = rest.find('>').map_or(rest.len(), |n| n + 1);
            if rest[..length].contains('[') {
                reader.complain(
                    &(start..start + 9),
                    messages::xml_syntax("a document type with declarations is not read"),
                );
                return None;
            }
            blank(text, &mut out, start..start + length);
            at = start + length;
        } else if rest.starts_with("<?xml") && start > 0 && text[..start].trim().is_empty() {
            let length = rest.find("?>").map_or(0, |n| n + 2);
            blank(text, &mut out, start..start + length);
            at = start + length.max(1);
        } else {
            let mut attributes = 0;
            let mut quote = None;
            let mut end = text.len();
            for (i, byte) in rest.bytes().enumerate() {
                match (quote, byte) {
                    (None, b'"' | b'\'') => quote = Some(byte),
                    (None, b'=') => attributes += 1,
                    (None, b'>') => {
                        end = start + i;
                        break;
                    }
                    (Some(q), b) if q == b => quote = None,
                    _ => {}
                }
            }
            if attributes > MOST_ATTRIBUTES {
                reader
                    .complain(&(start..start + 1), messages::too_complex("attributes of an element", MOST_ATTRIBUTES));
                return None;
            }
            at = end.max(start + 1);
        }
    }
    match String::from_utf8(out) {
        Ok(blanked) if !blanked.is_empty() => Some(Cow::Owned(blanked)),
        _ => Some(Cow::Borrowed(text)),
    }
}

/// Replaces a range by spaces, keeping ends of lines.
fn blank(text: &str, out: &mut Vec<u8>, range: Span) {
    if out.is_empty() {
        out.extend_from_slice(text.as_bytes());
    }
    for byte in &mut out[range] {
        if *byte != b'\n' {
            *byte = b' ';
        }
    }
}

/// `prefix:name` becomes `prefix_name` in names of elements and attributes.
pub(super) fn join_prefix(text: &str, prefix: &str) -> String {
    let needle = format!("{prefix}:");
    let mut out = String::with_capacity(text.len());
    let mut last = 0;
    for (at, _) in text.match_indices(&needle) {
        let before = text.as_bytes()[..at].last().copied().unwrap_or(b' ');
        if matches!(before, b'<' | b'/') || before.is_ascii_whitespace() {
            out.push_str(&text[last..at]);
            out.push_str(prefix);
            out.push('_');
            last = at + needle.len();
        }
    }
    out.push_str(&text[last..]);
    out
}
