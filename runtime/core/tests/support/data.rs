//! The reference data: where they are, and their numbers with 25 digits.
#![allow(dead_code)] // every test file uses a part of it

use serde_json::Value;
use std::path::{Path, PathBuf};
use straightline_core::Dd;

/// The folder of the reference data: `STRAIGHTLINE_REFERENCE`, or `shared/reference` beside the workspace.
pub fn reference_folder() -> Option<PathBuf> {
    let is_it = |folder: &PathBuf| folder.join("robots.json").is_file();
    let folder = match std::env::var_os("STRAIGHTLINE_REFERENCE") {
        Some(folder) => Some(PathBuf::from(folder)).filter(is_it),
        None => {
            let here = Path::new(env!("CARGO_MANIFEST_DIR"));
            here.ancestors().map(|above| above.join("shared/reference")).find(is_it)
        }
    };
    if folder.is_none() {
        println!(
            "skipped: there are no reference data (STRAIGHTLINE_REFERENCE, or shared/reference beside the workspace)"
        );
    }
    folder
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
