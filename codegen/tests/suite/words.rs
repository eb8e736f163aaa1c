//! What belongs to one room is named in no other: kinds of joints in theirs, the text of a language in its own. No name is two types', and
//! what is long says why.

use super::layers::{sources, without_tests};
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

const WORDS: [Word; 3] = [
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
    Word {
        is_named: |line| ["#if", "#include", "#define", "void {", "uint32_t", "const {c_type}"].iter().any(|word| is_in_a_string(line, word)),
        homes: &["codegen/src/emit/c99/", "codegen/src/readback/"],
        remedy: "C is written outside its room; make a `Routine`, or a part of the `Interface`, and let them write it",
    },
];
const ROOMS: [&str; 10] = [
    "runtime/core/src",
    "runtime/src",
    "codegen/src",
    "codegen/cli/src",
    "codegen/macros/src",
    "simulation/src",
    "logs/src",
    "jit/src",
    "python/src",
    "view/src",
];

/// Types that may share their name: only one of both is ever compiled, with the features `simulation` and `logs` of the command or without.
const ALTERNATIVES: [&str; 3] = ["Analyze", "Residuals", "Simulate"];

/// The sources of rooms with their paths, but for the generated example.
fn product(rooms: &[&str]) -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let mut files = Vec::new();
    rooms.iter().for_each(|room| sources(&root.join(room), &mut files));
    files.retain(|file| !file.ends_with("runtime/src/example.rs"));
    files.sort();
    let path = |file: &Path| file.strip_prefix(root).expect("in the workspace").to_string_lossy().replace('\\', "/");
    files.iter().map(|file| (path(file), read_to_string(file).expect("a text"))).collect()
}

/// Whether a word stands in a string that begins on this line.
fn is_in_a_string(line: &str, word: &str) -> bool {
    line.find(word).is_some_and(|at| line[..at].matches('"').count() % 2 == 1)
}

/// Lines of product code that name something, each with its place.
fn named(word: &Word, path: &str, text: &str) -> Vec<String> {
    let product = without_tests(text);
    let code = |line: &str| line.split("//").next().unwrap_or("").to_string();
    let lines = product.lines().enumerate().filter(|(_, line)| (word.is_named)(&code(line)));
    lines.map(|(k, line)| format!("{path}:{}: {}", k + 1, line.trim())).collect()
}

#[test]
fn what_belongs_to_a_room_is_named_in_no_other() {
    let mut complaints = Vec::new();
    for (path, text) in product(&ROOMS) {
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
    let text = "// \"#include <math.h>\"\nout.push_str(\"#include <math.h>\");\nlet uint32_t = 3;\n";
    assert_eq!(named(&WORDS[2], "a.rs", text), ["a.rs:2: out.push_str(\"#include <math.h>\");"]);
}

/// The types that lines of code declare.
fn declared(text: &str) -> impl Iterator<Item = &str> {
    without_tests(text).lines().filter_map(|line| {
        let line = line.trim_start();
        let line = line.strip_prefix("pub").map_or(line, |rest| rest.split_once(' ').map_or("", |(_, rest)| rest));
        let name = ["struct ", "enum ", "trait ", "union "].iter().find_map(|word| line.strip_prefix(word))?;
        Some(name.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or(""))
    })
}

#[test]
fn no_two_types_have_one_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (path, text) in product(&[&ROOMS[..], &["codegen/graph/src"]].concat()) {
        for name in declared(&text).filter(|name| !name.is_empty() && !ALTERNATIVES.contains(name)) {
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

/// Functions of more than 80 lines that do not say why, each with its line and length.
fn long_functions(text: &str) -> Vec<(usize, usize)> {
    let lines: Vec<&str> = without_tests(text).lines().collect();
    let is_head = |line: &str| {
        let words = line.trim_start().split(' ').take(4).collect::<Vec<_>>();
        let at = words.iter().position(|word| *word == "fn");
        at.is_some_and(|at| words[..at].iter().all(|w| w.starts_with("pub") || ["const", "unsafe"].contains(w)))
    };
    // a head in a text that is written stands behind a line of that text, or has its braces doubled
    let is_written = |k: usize| lines[k].ends_with("{{") || k > 0 && lines[k - 1].ends_with('\\');
    let is_said = |line: &&str| ["///", "#["].iter().any(|mark| line.trim_start().starts_with(mark));
    let mut found = Vec::new();
    for head in (0..lines.len()).filter(|k| is_head(lines[*k]) && !is_written(*k)) {
        let indent = lines[head].len() - lines[head].trim_start().len();
        let end = format!("{}}}", " ".repeat(indent));
        let Some(length) = lines[head..].iter().position(|line| *line == end) else { continue };
        let mut above = lines[..head].iter().rev().take_while(|line| is_said(line));
        if length + 1 > 80 && !above.any(|line| REASONS.iter().any(|reason| line.contains(reason))) {
            found.push((head + 1, length + 1));
        }
    }
    found
}

/// How a function says why it is longer than 80 lines.
const REASONS: [&str; 2] = ["80 lines", "One piece"];
/// How a file says why it is longer than 500 lines.
const REASONS_OF_FILES: [&str; 2] = ["500 lines", "one file"];
/// What cannot say why: the text of `trig.rs`, comments included, goes into generated code.
const PASTED: [&str; 1] = ["runtime/core/src/trig.rs"];

#[test]
fn what_is_long_says_why() {
    let mut complaints = Vec::new();
    for (path, text) in product(&[&ROOMS[..], &["codegen/graph/src"]].concat()) {
        complaints
            .extend(long_functions(&text).iter().map(|(line, n)| format!("{path}:{line}: a function of {n} lines")));
        let mut head = text.lines().take_while(|line| line.starts_with("//!"));
        let says_why = head.any(|line| REASONS_OF_FILES.iter().any(|reason| line.contains(reason)));
        if text.lines().count() > 500 && !says_why && !PASTED.contains(&path.as_str()) {
            complaints.push(format!("{path}: {} lines", text.lines().count()));
        }
    }
    assert!(complaints.is_empty(), "split it into steps with names, or say why not:\n{}", complaints.join("\n"));
}

#[test]
fn long_functions_are_found() {
    let long = format!("impl X {{\n    pub fn f() {{\n{}    }}\n}}\n", "        g();\n".repeat(79));
    assert_eq!(long_functions(&long), [(2, 81)]);
    assert_eq!(long_functions(&long.replace("        g();\n    }", "    }")), []);
    assert_eq!(long_functions(&long.replace("    pub fn", "    /// One piece: it is a table.\n    pub fn")), []);
}
