//! The generated text: in the browser's compiler the same bytes as natively.

use super::support::{built, in_node, natively, robots};
use serde_json::json;

/// Of robots with more bytes the page's five functions are searched for in full, and all of them in one form.
const SMALL: usize = 6_000;
const FEW: [&str; 5] = ["inverse_dynamics", "forward_dynamics", "mass_matrix", "gravity_force", "forward_kinematics"];

#[test]
fn the_text_of_every_robot_is_that_of_the_native_compiler_to_the_byte() {
    let Some(mut node) = in_node() else { return };
    let mut total = 0;
    for (name, text) in robots() {
        let functions: &[&str] = if text.len() > SMALL { &FEW } else { &[] };
        let full = json!({ "name": name, "text": text, "functions": functions });
        let quick = json!({ "name": name, "text": text, "quick": true });
        for (form, request) in [("full", full), ("quick", quick)] {
            let (found, milliseconds) = node.ask("compile", &request);
            let expected = natively("compile", &request);
            let (found_text, expected_text) = (found["text"].as_str(), expected["text"].as_str());
            let expected_text = expected_text.unwrap_or_else(|| panic!("{name}: {:?}", expected["complaints"]));
            if found_text != Some(expected_text) {
                let other = found_text.unwrap_or_default().lines().zip(expected_text.lines()).find(|(a, b)| a != b);
                panic!("{name} differs: {other:?} {:?}", found["failure"]);
            }
            assert_eq!(found, expected, "{name}: report and complaints");
            println!("{name}, {form}: {} bytes alike, {milliseconds:.0} ms in node", expected_text.len());
            total += expected_text.len();
        }
    }
    assert!(total > 100_000, "{total}");
}

#[test]
fn first_texts_of_arms_come_at_once() {
    let Some(mut node) = in_node() else { return };
    for (name, text) in
        robots().into_iter().filter(|(name, _)| ["ur5.urdf", "puma560.urdf", "planar_2r.toml"].contains(&&**name))
    {
        let (found, milliseconds) = node.ask("compile", &json!({ "name": name, "text": text, "quick": true }));
        println!("{name}: first text after {milliseconds:.0} ms");
        assert!(found["text"].is_string(), "{name}: {found}");
        // 0.1 to 0.3 s where nothing else runs (`RECORD.md`); a busy machine is no error of the page
        assert!(milliseconds < 20_000.0, "{name}: {milliseconds} ms");
    }
}

#[test]
fn the_packed_compiler_has_less_than_two_megabytes() {
    let Some(page) = built("playground.html") else {
        eprintln!("skipped: target/playground.html, which `build` makes, is missing");
        return;
    };
    let page = std::fs::read_to_string(page).unwrap();
    let packed = page.split_once("id=\"compiler\"").unwrap().1;
    let packed = packed.split_once('>').unwrap().1.split_once("</script>").unwrap().0;
    let bytes = straightline_playground::base64::decoded(packed).unwrap().len();
    println!("compiler: {bytes} bytes packed, page: {} bytes", page.len());
    assert!(bytes < 2_000_000, "{bytes}");
    assert!(bytes > 100_000, "there is a compiler in it");
}
