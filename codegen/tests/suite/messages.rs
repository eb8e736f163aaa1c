//! The exact text of every message that a robot file can cause.
//!
//! `messages/CODE.urdf` or `.toml` is the smallest file that causes the message CODE, `messages/CODE.txt` all that is said
//! about it. `UPDATE_EXPECTED=1 cargo test -p straightline-codegen --test suite messages::` rewrites the texts; read the
//! difference.

use std::path::{Path, PathBuf};
use straightline_codegen::description::flexible::{BaseSupport, WrittenSpring};
use straightline_codegen::description::messages::CODES;
use straightline_codegen::description::Noted;
use straightline_codegen::description::FORMATS;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/messages")
}

/// Messages that come from options, or from files too large or too odd to be kept.
fn special_case(code: &str) -> Option<(Source, ModelOptions)> {
    let options = ModelOptions::default();
    let order = |names: &[&str]| ModelOptions {
        joint_order: Some(names.iter().map(|n| n.to_string()).collect()),
        ..ModelOptions::default()
    };
    let source = |text: String| Source::new(&format!("{code}.urdf"), text);
    let links = |names: &mut dyn Iterator<Item = String>| {
        source(format!("<robot name=\"arm\">\n{}</robot>\n", names.collect::<String>()))
    };
    match code {
        "not-utf8" => Some((Source::from_bytes("not-utf8.urdf", b"<robot name=\"\xff\"/>".as_slice()), options)),
        "file-too-large" => Some((source("x".repeat((64 << 20) + 1)), options)),
        "too-many-links" => {
            let mut names = (0..10_001).map(|i| format!("<link name=\"l{i}\"/>\n"));
            Some((links(&mut names), options))
        }
        "more-complaints" => {
            let mut names = (0..103).map(|_| "<link name=\"\"/>\n".to_string());
            Some((links(&mut names), options))
        }
        "joint-order-unknown" => Some((file(code)?, order(&["elbow", "shoulder", "sholder"]))),
        "joint-order-twice" => Some((file(code)?, order(&["elbow", "shoulder", "elbow"]))),
        "joint-order-follower" => Some((file(code)?, order(&["shoulder", "elbow"]))),
        "joint-order-missing" => Some((file(code)?, order(&["elbow"]))),
        "floating-by-option" => Some((file(code)?, ModelOptions { floating_base: true, ..options })),
        "support-rigid" | "support-floats" => {
            let spring = WrittenSpring { stiffness: Noted::assumed(1e5), damping: Noted::assumed(0.0), rest: 0.0 };
            let directions = match code {
                "support-rigid" => [const { None }; 6],
                _ => std::array::from_fn(|_| Some(spring.clone())),
            };
            let support = Some(BaseSupport { at: [0.0; 3], directions, place: Noted::assumed(()) });
            Some((file(code)?, ModelOptions { support, ..options }))
        }
        "bad-option" => Some((file(code)?, ModelOptions { angle_tolerance: f64::NAN, ..options })),
        _ => None,
    }
}

fn file(code: &str) -> Option<Source> {
    FORMATS.iter().flat_map(|format| format.extensions).find_map(|extension| {
        let name = format!("{code}.{extension}");
        std::fs::read(folder().join(&name)).ok().map(|bytes| Source::from_bytes(&name, bytes))
    })
}

/// What is said; of many complaints of the same kind the first and the last.
fn said(diagnostics: &Diagnostics) -> String {
    let text = diagnostics.render();
    let blocks: Vec<&str> = text.split_inclusive("\n\n").collect();
    match blocks.len() {
        n @ 20.. => format!("{}...\n\n{}", blocks[0], blocks[n - 1]),
        _ => text,
    }
}

#[test]
fn every_message_has_its_exact_text() {
    let mut wrong = String::new();
    for code in CODES {
        let (source, options) = special_case(code)
            .or_else(|| file(code).map(|source| (source, ModelOptions::default())))
            .unwrap_or_else(|| panic!("no file messages/{code}.*, in any format"));
        let (model, diagnostics) = load(&source, &options);
        assert_eq!(model.is_none(), diagnostics.has_errors(), "{code}: a model, or else an error\n{diagnostics}");
        assert!(diagnostics.iter().any(|d| d.code == *code), "{code}: not said, but\n{diagnostics}");
        for diagnostic in diagnostics.iter() {
            assert!(CODES.contains(&diagnostic.code), "`{}` is missing in CODES", diagnostic.code);
            assert!(!diagnostic.line().contains('\n'), "{}", diagnostic.line());
        }
        let path = folder().join(format!("{code}.txt"));
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            std::fs::write(&path, said(&diagnostics)).expect("the folder of messages can be written");
        }
        let expected = std::fs::read_to_string(&path).unwrap_or_default();
        if expected != said(&diagnostics) {
            wrong += &format!("--- {code}: expected\n{expected}\n--- said\n{}\n", said(&diagnostics));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_text_belongs_to_a_message() {
    for entry in std::fs::read_dir(folder()).expect("the folder of messages is there") {
        let path = entry.expect("the folder can be read").path();
        let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or("");
        assert!(CODES.contains(&stem), "{} belongs to no message", path.display());
    }
}

#[test]
fn one_line_says_the_same() {
    let (_, diagnostics) = load(&file("negative-mass").expect("the file is there"), &ModelOptions::default());
    assert_eq!(diagnostics.lines(), ["negative-mass.urdf:6:20: error: the mass of link `upper` is negative: -2.5 kg"]);
}
