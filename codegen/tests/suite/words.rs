//! What belongs to one room is named in no other: kinds of joints in theirs, the text of a language in its own. And no name is two types'.

use super::layers::sources;
use std::collections::BTreeMap;
use std::fs::read_to_string;
use std::path::Path;

/// Something that only certain rooms name.
struct Word {
    /// Whether a line of code names it.
    is_named: fn(&str) -> bool,
    /// The rooms that name it.
    homes: &'static [&'static str],
    /// What others do instead.
    remedy: &'static str,
}

const WORDS: [Word; 2] = [
    Word {
        is_named: |line| line.contains("JointKind::"),
        homes: &["runtime/core/src/joint/"],
        remedy: "kinds of joints are named outside their room; ask for a column of `Descriptor` or a method of the kind instead",
    },
    Word {
        is_named: |line| ["pub fn ", "pub mod "].iter().any(|word| is_in_a_string(line, word)),
        // what reads the text back has nothing from those who write it
        homes: &["codegen/src/emit/rust/", "codegen/src/readback/"],
        remedy: "Rust is written outside its room; make a `Routine`, and let the target write it",
    },
];
const ROOMS: [&str; 6] =
    ["runtime/core/src", "runtime/src", "codegen/src", "codegen/cli/src", "codegen/macros/src", "simulation/src"];

/// Types that may share their name: only one of both is ever compiled, with the feature `simulation` of the command or without.
const ALTERNATIVES: [&str; 2] = ["Analyze", "Simulate"];

/// Whether a word stands in a string that begins on this line.
fn is_in_a_string(line: &str, word: &str) -> bool {
    line.find(word).is_some_and(|at| line[..at].matches('"').count() % 2 == 1)
}

/// Lines of product code that name something, each with its place.
fn named(word: &Word, path: &str, text: &str) -> Vec<String> {
    let product = text.split("#[cfg(test)]").next().unwrap_or("");
    let code = |line: &str| line.split("//").next().unwrap_or("").to_string();
    let lines = product.lines().enumerate().filter(|(_, line)| (word.is_named)(&code(line)));
    lines.map(|(k, line)| format!("{path}:{}: {}", k + 1, line.trim())).collect()
}

#[test]
fn what_belongs_to_a_room_is_named_in_no_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let mut files = Vec::new();
    ROOMS.iter().for_each(|room| sources(&root.join(room), &mut files));
    files.sort();
    let mut complaints = Vec::new();
    for file in &files {
        let path = file.strip_prefix(root).expect("a path in the workspace").to_string_lossy().replace('\\', "/");
        let text = read_to_string(file).expect("a text");
        for word in WORDS.iter().filter(|word| !word.homes.iter().any(|home| path.starts_with(home))) {
            complaints.extend(named(word, &path, &text).into_iter().map(|place| format!("{place}\n  {}", word.remedy)));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn what_is_named_elsewhere_is_told_with_its_line() {
    let text = "// JointKind::Revolute is for comments\nlet turns = kind == JointKind::Revolute;\n";
    assert_eq!(named(&WORDS[0], "a.rs", text), ["a.rs:2: let turns = kind == JointKind::Revolute;"]);
    let text = "pub fn write() {\n    out.push_str(\"pub fn x() {}\");\n";
    assert_eq!(named(&WORDS[1], "a.rs", text), ["a.rs:2: out.push_str(\"pub fn x() {}\");"]);
}

/// The types that lines of code declare.
fn declared(text: &str) -> impl Iterator<Item = &str> {
    let product = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
    product.lines().filter_map(|line| {
        let line = line.trim_start();
        let line = line.strip_prefix("pub").map_or(line, |rest| rest.split_once(' ').map_or("", |(_, rest)| rest));
        let name = ["struct ", "enum ", "trait ", "union "].iter().find_map(|word| line.strip_prefix(word))?;
        Some(name.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or(""))
    })
}

#[test]
fn no_two_types_have_one_name() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let mut files = Vec::new();
    ROOMS.iter().chain(&["codegen/graph/src"]).for_each(|room| sources(&root.join(room), &mut files));
    // generated, of types of its own
    files.retain(|file| !file.ends_with("runtime/src/example.rs"));
    files.sort();
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for file in &files {
        let path = file.strip_prefix(root).expect("a path in the workspace").to_string_lossy().replace('\\', "/");
        for name in declared(&read_to_string(file).expect("a text")).filter(|name| !ALTERNATIVES.contains(name)) {
            places.entry(name.to_string()).or_default().push(path.clone());
        }
    }
    assert!(places.contains_key("Model"), "types are not found any more");
    let twice = places.iter().filter(|(_, files)| files.len() > 1);
    let complaints: Vec<String> = twice.map(|(name, files)| format!("{name}: {}", files.join(", "))).collect();
    assert!(complaints.is_empty(), "names of more than one type:\n{}", complaints.join("\n"));
}

#[test]
fn types_are_found_where_they_are_declared() {
    let text = "pub struct A<T>(T);\n    pub(crate) enum B { C }\n// struct D;\nlet e = structure;\ntrait F {}\n\
                #[cfg(test)]\nmod tests {\n    struct G;\n}\n";
    assert_eq!(declared(text).collect::<Vec<_>>(), ["A", "B", "F"]);
}
