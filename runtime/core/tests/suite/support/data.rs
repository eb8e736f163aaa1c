//! The reference data: where they are, and their numbers with 25 digits.
#![allow(dead_code)] // every test file uses a part of it

use serde_json::Value;
use std::path::{Path, PathBuf};
use straightline_core::Dd;

/// A file of the reference data, `states/panda.json` or `robots/panda.urdf`, as it lies in the workspace.
pub fn reference_file(path: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.ancestors().find(|above| above.join("generated_tests/reference").is_dir());
    let root = root.expect("the workspace holds the reference data");
    match path.strip_prefix("robots/") {
        Some(robot) => root.join("robots/descriptions").join(robot),
        None => root.join("generated_tests/reference").join(path),
    }
}

/// All numbers in a JSON value, depth first, with 25 digits.
pub fn numbers(value: &Value) -> Vec<Dd> {
    match value {
        Value::String(text) => vec![Dd::from_decimal(text).expect("a decimal number")],
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => panic!("numbers of the reference data are strings, not {other}"),
    }
}

/// The inputs of a state: exact f64 values.
pub fn inputs(value: &Value) -> Vec<Dd> {
    let parse = |x: &Value| Dd::from(x.as_str().expect("a decimal string").parse::<f64>().expect("a number"));
    value.as_array().expect("a list").iter().map(parse).collect()
}
