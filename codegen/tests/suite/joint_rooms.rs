//! A kind of joint is one file and one row of a table: who needs to know something of it asks for a column, and names no kind.

use super::layers::sources;
use std::fs::read_to_string;
use std::path::Path;

/// Where kinds are told apart.
const ROOM: &str = "runtime/core/src/joint/";
const ROOMS: [&str; 6] =
    ["runtime/core/src", "runtime/src", "codegen/src", "codegen/cli/src", "codegen/macros/src", "simulation/src"];

/// Lines of product code that name a kind of joint, each with its place.
fn kinds_named(path: &str, text: &str) -> Vec<String> {
    let product = text.split("#[cfg(test)]").next().unwrap_or("");
    let lines = product.lines().enumerate().filter(|(_, line)| {
        let code = line.split("//").next().unwrap_or("");
        code.contains("JointKind::")
    });
    lines.map(|(k, line)| format!("{path}:{}: {}", k + 1, line.trim())).collect()
}

#[test]
fn who_is_not_in_the_room_of_joints_names_no_kind_of_joint() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let mut files = Vec::new();
    ROOMS.iter().for_each(|room| sources(&root.join(room), &mut files));
    files.sort();
    let mut complaints = Vec::new();
    for file in &files {
        let path = file.strip_prefix(root).expect("a path in the workspace").to_string_lossy().replace('\\', "/");
        if !path.starts_with(ROOM) {
            complaints.extend(kinds_named(&path, &read_to_string(file).expect("a text")));
        }
    }
    let remedy = "ask for a column of `Descriptor` or a method of the kind instead";
    assert!(
        complaints.is_empty(),
        "kinds of joints are named outside their room; {remedy}:\n{}",
        complaints.join("\n")
    );
}

#[test]
fn a_kind_that_is_named_is_told_with_its_line() {
    let text = "// JointKind::Revolute is for comments\nlet turns = kind == JointKind::Revolute;\n";
    assert_eq!(kinds_named("a.rs", text), ["a.rs:2: let turns = kind == JointKind::Revolute;"]);
}
