//! XML of robot files: what is forgiven before it is parsed, what is said where it is none, and numbers in attributes.
//!
//! Rather than refuse what other readers accept, comments may hold `--`, the XML declaration may come late, and prefixes need no
//! declaration.

use super::messages;
use super::reader::{FileReader, Range64};
use roxmltree::{Document, Node, ParsingOptions};
use std::borrow::Cow;
use std::ops::Range;

/// Nodes of an XML file.
const MOST_NODES: usize = 4_000_000;
/// Attributes of an element: the XML parser compares each with all before it.
const MOST_ATTRIBUTES: usize = 1000;
/// Declarations of namespaces: the XML parser keeps those in force with every element that adds one.
const MOST_NAMESPACES: usize = 1000;
/// Prefixes that are used without a declaration.
const MOST_PREFIXES: usize = 16;

/// Bytes of a file.
pub(super) type Span = Range<usize>;

/// Parses the file of a reader and does the rest; `None` after a complaint that it is no XML.
pub(super) fn parse<'a, T>(
    mut reader: FileReader<'a>,
    rest: impl FnOnce(FileReader<'a>, &Document) -> Option<T>,
) -> Option<T> {
    let mut text = tolerant_text(&mut reader)?;
    for _ in 0..=MOST_PREFIXES {
        let options = ParsingOptions { nodes_limit: MOST_NODES as u32, ..ParsingOptions::default() };
        let error = match Document::parse_with_options(&text, options) {
            Ok(document) => return rest(reader, &document),
            Err(error) => error,
        };
        match &error {
            roxmltree::Error::UnknownNamespace(prefix, _) if prefix != "xacro" => {
                let joined = join_prefix(&text, prefix);
                text = Cow::Owned(joined);
            }
            _ => {
                complain_of_xml(&mut reader, &error);
                return None;
            }
        }
    }
    reader.complain(&(0..0), messages::too_complex("undeclared prefixes", MOST_PREFIXES));
    None
}

/// The name of the first element of a text; nothing if it has none.
pub(super) fn root_name(text: &str) -> &str {
    let mut rest = text.trim_start();
    loop {
        let end = match rest {
            _ if rest.starts_with("<?") => "?>",
            _ if rest.starts_with("<!--") => "-->",
            _ if rest.starts_with("<!") => ">",
            _ => break,
        };
        let Some(at) = rest.find(end) else { return "" };
        rest = rest[at + end.len()..].trim_start();
    }
    let name = rest.strip_prefix('<').unwrap_or("");
    let end = name.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(name.len());
    &name[..end]
}

/// Whether elements of xacro are left, of which it complains then.
pub(super) fn has_xacro(reader: &mut FileReader, root: Node) -> bool {
    let is_xacro = |n: &Node| n.is_element() && n.tag_name().namespace().is_some_and(|uri| uri.contains("xacro"));
    let mut xacro = root.descendants().filter(is_xacro);
    let Some(first) = xacro.next() else { return false };
    let name = format!("xacro:{}", first.tag_name().name());
    let start = first.range().start;
    reader.complain(&(start..start + 1 + name.len()), messages::xacro_left(&name, xacro.count()));
    true
}

/// The start of an element's tag: `<name`.
pub(super) fn tag(node: Node) -> Span {
    let start = node.range().start;
    start..start + 1 + node.tag_name().name().len()
}

/// The elements in an element.
pub(super) fn children<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(Node::is_element)
}

/// The numbers that the text of an attribute holds, each with its text and span; as many as `counts`, in words `expected`.
pub(super) fn numbers<'a>(
    reader: &mut FileReader,
    what: &str,
    (text, whole): (&'a str, Span),
    (counts, expected): (std::ops::RangeInclusive<usize>, &str),
) -> Option<Vec<(f64, &'a str, Span)>> {
    let is_raw = reader.source.text().get(whole.clone()) == Some(text);
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let complaint = if text.contains("${") || text.contains("$(") {
        Some(messages::xacro_left(text, 0))
    } else if text.contains(',') {
        Some(messages::not_a_number(what, text))
    } else {
        (!counts.contains(&words.len())).then(|| messages::wrong_count(what, expected, words.len()))
    };
    if let Some(complaint) = complaint {
        reader.complain(&whole, complaint);
        return None;
    }
    let mut numbers = Vec::with_capacity(words.len());
    for word in words {
        let offset = word.as_ptr() as usize - text.as_ptr() as usize;
        let span = if is_raw { whole.start + offset..whole.start + offset + word.len() } else { whole.clone() };
        numbers.push(reader.number(what, word, &span, Range64::Finite).map(|x| (x, word, span)));
    }
    numbers.into_iter().collect()
}

fn complain_of_xml(reader: &mut FileReader, error: &roxmltree::Error) {
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
fn tolerant_text<'a>(reader: &mut FileReader<'a>) -> Option<Cow<'a, str>> {
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
fn join_prefix(text: &str, prefix: &str) -> String {
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
