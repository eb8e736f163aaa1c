//! Nothing in this package knows what its programs compute: no word of robots in its sources, neither in code nor in comments and messages.

use std::fs;
use std::path::{Path, PathBuf};

/// Words of robotics. "Body" is one also where it means that of a loop: say what it is instead.
const WORDS: [&str; 6] = ["robot", "robots", "joint", "joints", "body", "bodies"];

/// The words of a line: `FirstBody`, `body_of` and `body` have one in common, "adjoint" and "joint" have none.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before_is_lower = false;
    for c in line.chars() {
        if !c.is_alphanumeric() || (c.is_uppercase() && before_is_lower) {
            words.push(String::new());
        }
        if c.is_alphabetic() {
            words.last_mut().expect("there is one").extend(c.to_lowercase());
        }
        before_is_lower = c.is_lowercase();
    }
    words
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the sources are there") {
        let path = entry.expect("the sources can be read").path();
        match path.is_dir() {
            true => sources(&path, found),
            false => found.push(path),
        }
    }
}

fn complaints(text: &str, place: &str) -> Vec<String> {
    let lines = text.lines().enumerate();
    lines
        .flat_map(|(k, line)| {
            let forbidden = words(line).into_iter().filter(|word| WORDS.contains(&word.as_str()));
            forbidden.map(move |word| format!("{place}:{}: `{word}` in: {}", k + 1, line.trim()))
        })
        .collect()
}

#[test]
fn no_source_has_a_word_of_robotics() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    files.sort();
    assert!(files.len() > 30, "only {} files were found", files.len());
    let of_file = |path: &PathBuf| {
        let text = fs::read_to_string(path).expect("the sources can be read");
        complaints(&text, &path.strip_prefix(root).unwrap_or(path).display().to_string())
    };
    let found: Vec<String> = files.iter().flat_map(of_file).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn words_are_found_in_identifiers_and_not_within_others() {
    for line in ["a Joint.", "first_body: usize", "struct RobotModel", "bodies[3]", "/// of the body's", "joint2"] {
        assert_eq!(complaints(line, "x.rs").len(), 1, "{line}");
    }
    for line in ["the adjoint", "Adjoint(u)", "disjoint sets", "anybody", "somebodies"] {
        assert!(complaints(line, "x.rs").is_empty(), "{line}");
    }
}
