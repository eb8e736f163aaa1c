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

/// A decimal number with up to 31 digits, to about 1e-31 relative.
pub fn decimal(text: &str) -> Dd {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().expect("a decimal exponent")),
        None => (text, 0),
    };
    let (negative, digits) = match mantissa.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, mantissa),
    };
    let fraction = digits.split_once('.').map_or(0, |(_, fraction)| fraction.len() as i32);
    let ten = Dd::from(10.0);
    let mut value = Dd::ZERO;
    for c in digits.chars().filter(|&c| c != '.') {
        value = value * ten + Dd::from(f64::from(c.to_digit(10).expect("a decimal digit")));
    }
    let mut power = Dd::ONE;
    for _ in 0..(exponent - fraction).unsigned_abs() {
        power *= ten;
    }
    let value = if exponent < fraction { value / power } else { value * power };
    if negative {
        -value
    } else {
        value
    }
}

/// All numbers in a JSON value, depth first, with 25 digits.
pub fn numbers(value: &Value) -> Vec<Dd> {
    match value {
        Value::String(text) => vec![decimal(text)],
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => panic!("numbers of the reference data are strings, not {other}"),
    }
}

/// The inputs of a state: exact f64 values.
pub fn inputs(value: &Value) -> Vec<Dd> {
    let parse = |x: &Value| Dd::from(x.as_str().expect("a decimal string").parse::<f64>().expect("a number"));
    value.as_array().expect("a list").iter().map(parse).collect()
}
