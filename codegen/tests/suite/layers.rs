//! The rooms of `codegen/src`, from the ground up: a room uses rooms below its own, never one above it.
//!
//! Text alone is read, so that the rule holds for every feature and target: paths that begin with `crate::` or with so many `super::` that
//! they leave their room; not comments, and not the tests at the end of a file. What lies in packages of its own (`graph`, `cli`) is held
//! by Cargo.

use std::fs;
use std::path::{Path, PathBuf};

/// The ground first.
const ROOMS: [&str; 19] = [
    "function",
    "identifier",
    "output",
    "diagnostic",
    "description",
    "model",
    "convert",
    "choices",
    "machine_code",
    "scene",
    "options",
    "equations",
    "program",
    "report",
    "emit",
    "readback",
    "compile",
    "fronts",
    "verify",
];

fn floor(room: &str) -> Option<usize> {
    ROOMS.iter().position(|r| *r == room)
}

/// What stands before a file's tests, be they unit tests or functions that a suite calls.
pub fn without_tests(text: &str) -> &str {
    let ends = ["#[cfg(test)]\nmod ", "#[cfg(feature = \"internals\")]\n#[doc(hidden)]\npub mod tests {"];
    let end = ends.iter().filter_map(|end| text.find(end)).min();
    &text[..end.unwrap_or(text.len())]
}

/// All files of Rust in a folder and below it.
pub fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the folder can be read").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The room of a file, and how deep its module lies in the crate: 1 for that of the room itself.
fn room_and_depth(inside: &Path) -> (String, usize) {
    let modules: Vec<String> =
        inside.with_extension("").components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    let own = usize::from(modules.len() > 1 && modules.last().is_some_and(|last| last == "mod"));
    (modules[0].clone(), modules.len() - own)
}

/// Names that a line takes from the root of the crate: of `crate::a::b` and, at this depth, of `super::super::a`.
fn of_the_root(line: &str, depth: usize) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut found: Vec<String> = line.match_indices("crate::").map(|(at, _)| word(&line[at + 7..])).collect();
    let up = "super::".repeat(depth);
    found.extend(line.match_indices(&up).map(|(at, _)| word(&line[at + up.len()..])));
    found
}

/// What is wrong with the text of a file that lies there.
fn complaints(inside: &Path, text: &str) -> Vec<String> {
    let (own, depth) = room_and_depth(inside);
    if own == "lib" {
        return Vec::new();
    }
    let Some(here) = floor(&own) else { return vec![format!("{}: the room `{own}` has no floor", inside.display())] };
    let code = without_tests(text);
    let lines = code.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"));
    let used = lines.flat_map(|(n, line)| of_the_root(line, depth).into_iter().map(move |room| (n + 1, room)));
    let upwards = used.filter(|(_, room)| floor(room).is_some_and(|there| there > here));
    upwards.map(|(n, room)| format!("{}:{n}: `{own}` uses `{room}`, which is above it", inside.display())).collect()
}

#[test]
fn every_room_uses_rooms_below_it_alone() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    files.sort();
    let wrong: Vec<String> = files
        .iter()
        .flat_map(|file| {
            let text = fs::read_to_string(file).expect("source is text");
            complaints(file.strip_prefix(&root).expect("it lies there"), &text)
        })
        .collect();
    assert!(files.len() > 80, "{} files in {}", files.len(), root.display());
    assert!(wrong.is_empty(), "{} uses run upwards\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_use_of_a_room_above_is_found() {
    let of = |path: &str, text: &str| complaints(Path::new(path), text).len();
    assert_eq!(of("model/mod.rs", "use crate::emit::Style;\n"), 1);
    assert_eq!(of("model/check.rs", "    let x = super::super::emit::number(1.0);\n"), 1);
    assert_eq!(of("program/contact/mod.rs", "use super::super::emit;\nuse super::super::scene;\n"), 1);
    assert_eq!(of("program/contact/equations.rs", "use super::super::super::emit;\n"), 1);
    assert_eq!(of("attic.rs", ""), 1);
    // downwards, in words, and in tests
    assert_eq!(of("emit/mod.rs", "use crate::model::limbs;\n"), 0);
    assert_eq!(of("model/mod.rs", "/// See [`crate::emit`].\n"), 0);
    assert_eq!(of("model/mod.rs", "#[cfg(test)]\nmod tests {\n    use crate::compile::compile;\n}\n"), 0);
    let inside =
        "#[cfg(feature = \"internals\")]\n#[doc(hidden)]\npub mod tests {\n    use crate::compile::compile;\n}\n";
    assert_eq!(of("model/mod.rs", inside), 0);
}
