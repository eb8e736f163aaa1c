//! Broken and hostile files: the page's compiler says what the native one says, and goes on.

use super::support::{folder, in_node, natively, robot};
use serde_json::{json, Value};
use std::fs;

/// The smallest file for every message that a robot file can cause, as the compiler's own tests have them.
fn broken() -> Vec<(String, String)> {
    let entries = fs::read_dir(folder().join("../codegen/tests/messages")).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries
        .filter(|path| path.extension().is_some_and(|e| e != "txt"))
        .filter_map(|path| Some((path.file_name()?.to_string_lossy().to_string(), fs::read_to_string(&path).ok()?)))
        .collect();
    files.sort();
    files
}

#[test]
fn broken_files_give_the_native_messages() {
    let Some(mut node) = in_node() else { return };
    let files = broken();
    assert!(files.len() > 90, "{}", files.len());
    let mut wrong = 0;
    for (name, text) in &files {
        let request = json!({ "name": name, "text": text, "functions": ["inverse_dynamics"], "quick": true });
        let (found, expected) = (node.ask("compile", &request).0, natively("compile", &request));
        assert_eq!(found, expected, "{name}");
        wrong += usize::from(expected["text"].is_null());
    }
    println!("{} files, {wrong} of them without code, complained of alike", files.len());
    assert!(wrong > 60, "{wrong}");
}

fn errors(answer: &Value) -> usize {
    answer["complaints"].as_array().unwrap().iter().filter(|c| c["severity"] == "error").count()
}

#[test]
fn hostile_files_are_refused_and_the_compiler_goes_on() {
    let deep = "<a>".repeat(20_000);
    let many: String = (0..11_000).map(|k| format!("<link name=\"l{k}\"/>")).collect();
    let hostile = [
        ("empty.urdf", String::new()),
        ("nothing.toml", "\u{0}\u{1}\u{2}".to_string()),
        ("deep.urdf", format!("<robot name=\"deep\">{deep}")),
        ("array.toml", format!("[robot]\nname = {}\n", "[".repeat(20_000))),
        ("many.urdf", format!("<robot name=\"many\">{many}</robot>")),
        (
            "entity.urdf",
            "<!DOCTYPE robot [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;\">]><robot name=\"&b;\"/>".to_string(),
        ),
        ("include.xml", "<mujoco><include file=\"/nowhere/else.xml\"/></mujoco>".to_string()),
        ("infinite.urdf", robot("ur5.urdf").replacen("3.7", "1e999", 1)),
    ];
    let mut node = in_node();
    for (name, text) in hostile {
        let request = json!({ "name": name, "text": text, "functions": ["inverse_dynamics"], "quick": true });
        let expected = natively("compile", &request);
        assert!(errors(&expected) > 0 && expected["text"].is_null(), "{name}: {expected}");
        let Some(node) = &mut node else { continue };
        let (found, _) = node.ask("compile", &request);
        assert_eq!(found, expected, "{name}");
        assert!(errors(&node.ask("bench", &request).0) > 0, "{name}");
        // whatever it was, the next robot is compiled
        let next = json!({ "name": "planar_2r.toml", "text": robot("planar_2r.toml"), "functions": ["inverse_dynamics"], "quick": true });
        assert!(node.ask("compile", &next).0["text"].is_string(), "after {name}");
    }
}

#[test]
fn bytes_that_are_no_text_and_requests_that_are_none_are_said_to_be() {
    let request =
        json!({ "name": "latin.urdf", "bytes": straightline_playground::base64::encoded(b"<robot name=\"\xff\"/>") });
    let answer = natively("compile", &request);
    assert_eq!(answer["complaints"][0]["code"], "not-utf8", "{answer}");
    assert!(natively("compile", &json!({ "name": 3 }))["failure"].as_str().unwrap().contains("cannot be read"));
    assert!(natively("format", &json!({}))["failure"].as_str().unwrap().contains("`format`"));
}

#[test]
fn complaints_have_their_place_and_their_caret() {
    let text = robot("planar_2r.toml").replacen("mass = 1.5", "mass = -1.5", 1);
    let answer = natively("compile", &json!({ "name": "arm.toml", "text": text }));
    let first = &answer["complaints"][0];
    let line = text.lines().position(|line| line.contains("-1.5")).unwrap() + 1;
    assert_eq!((first["line"].as_u64(), first["file"].as_str()), (Some(line as u64), Some("arm.toml")), "{first}");
    let said = first["text"].as_str().unwrap();
    assert!(said.contains("mass = -1.5") && said.contains('^'), "{said}");
}
