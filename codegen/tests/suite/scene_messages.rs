//! The exact text of every message that a scene can cause.
//!
//! `scene_messages/CODE.toml` is a small scene for `files/arm.toml` that causes the message CODE, `CODE.txt` all that is
//! said about it. `UPDATE_EXPECTED=1 cargo test -p straightline-codegen --test suite scene_messages::` rewrites the texts; read the
//! difference.

use std::path::{Path, PathBuf};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::scene_file;
use straightline_codegen::scene::messages::CODES;
use straightline_codegen::scene::Scene;
use straightline_codegen::{compile, Function, Options};

const ARM: &str = include_str!("../files/arm.toml");
const FOURBAR: &str = include_str!("../files/fourbar.toml");

/// Files of several complaints that stand in other tables, too: one that is no scene, types, and keys.
const OTHERS: [&str; 3] = ["keys", "types", "syntax"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene_messages")
}

fn read(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap_or_default()
}

/// All that is said of a scene for the arm.
fn said_of(code: &str) -> Diagnostics {
    let mut diagnostics = Diagnostics::new();
    let mut options = Options { functions: vec![Function::InverseDynamics], ..Options::default() };
    match code {
        // no file can say it
        "locked-twice" => {
            let locked = vec![("roll".to_string(), 0.5), ("roll".to_string(), 0.25)];
            options.scene = Scene { locked, ..Scene::default() };
        }
        _ => {
            let source = Source::new(&format!("{code}.toml"), read(&format!("{code}.toml")));
            let Some(file) = scene_file::read(&source, &mut diagnostics) else { return diagnostics };
            options = file.into_options(options);
        }
    }
    match code {
        "said-twice" => options.model.gravity = Some([0.0, 0.0, -1.62]),
        "base-locked" => options.model.floating_base = true,
        "mixed-elsewhere" => options.generic = true,
        "no-machine-code" => options.rustc = Some("/nowhere/rustc".into()),
        "self-test-fused" => options.fma = true,
        "limbs-exact" => options.grade = straightline_codegen::Grade::Exact,
        _ => {}
    }
    let robot = match code {
        "not-on-loops" | "determined-joint" => FOURBAR.to_string(),
        "regressor-of-several" => ARM.replace("\"continuous\"", "\"spherical\"\ndamping = 0.25"),
        "several-locked" => ARM.replace("\"continuous\"", "\"spherical\""),
        _ => ARM.to_string(),
    };
    let robot = Source::new("arm.toml", robot);
    let found = compile(&robot, &options).map_or_else(|errors| errors, |generated| generated.warnings);
    // the robot's own warnings stand in another table
    let of_the_robot = ["floating-by-option", "point-mass", "singular-joint"];
    for diagnostic in found.iter().filter(|d| !of_the_robot.contains(&d.code)) {
        diagnostics.push(diagnostic.clone());
    }
    if let Some(source) = options.scene.places.source() {
        diagnostics.add_source(source);
    }
    diagnostics
}

#[test]
fn every_message_has_its_exact_text() {
    let mut wrong = String::new();
    for code in CODES.iter().chain(&OTHERS) {
        let diagnostics = said_of(code);
        let is_other = OTHERS.contains(code);
        assert!(is_other || diagnostics.iter().any(|d| d.code == *code), "{code}: not said, but\n{diagnostics}");
        for diagnostic in diagnostics.iter() {
            assert!(is_other || CODES.contains(&diagnostic.code), "{code}: `{}` is missing in CODES", diagnostic.code);
            assert!(*code == "locked-twice" || diagnostic.place.is_some(), "{code}: no place:\n{diagnostics}");
        }
        let (path, said) = (folder().join(format!("{code}.txt")), diagnostics.render());
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            std::fs::write(&path, &said).expect("the folder of messages can be written");
        }
        let expected = read(&format!("{code}.txt"));
        if expected != said {
            wrong += &format!("--- {code}: expected\n{expected}\n--- said\n{said}\n");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_text_belongs_to_a_message() {
    for entry in std::fs::read_dir(folder()).expect("the folder of messages is there") {
        let path = entry.expect("the folder can be read").path();
        let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or("");
        assert!(CODES.contains(&stem) || OTHERS.contains(&stem), "{} belongs to no message", path.display());
    }
}

#[test]
fn scenes_are_equal_and_print_alike_wherever_they_stand() {
    let text = "[hold]\njoints = { roll = 0.5 }\n";
    let read = |path: &str, text: &str| {
        scene_file::read(&Source::new(path, text), &mut Diagnostics::new()).expect("the scene is sound").scene
    };
    let (a, b) = (read("a.toml", text), read("deep/in/b.toml", &format!("# moved\n{text}")));
    assert_eq!(a, b);
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}
