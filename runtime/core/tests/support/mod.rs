//! Reads the reference data: robots in the chapter's notation, numbers with 25 digits.

use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use std::path::{Path, PathBuf};
use straightline_core::reference::{unit, ExtendedPosition, Joint, MassCentreFrame, MassCentreLink, MassCentreTree};
use straightline_core::Dd;

/// The folder of the reference data: `STRAIGHTLINE_REFERENCE`, or `../shared/reference` beside the workspace.
pub fn reference_folder() -> Option<PathBuf> {
    let folder = match std::env::var_os("STRAIGHTLINE_REFERENCE") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference"),
    };
    if folder.join("robots.json").is_file() {
        Some(folder)
    } else {
        println!("skipped: no reference data in {} (set STRAIGHTLINE_REFERENCE)", folder.display());
        None
    }
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
        power = power * ten;
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

/// A robot in the chapter's notation.
pub fn chapter_robot(text: &str) -> MassCentreTree<Dd> {
    let file: toml::Table = text.parse().expect("a TOML file");
    let number = |value: &toml::Value| {
        Dd::from(value.as_float().or_else(|| value.as_integer().map(|i| i as f64)).expect("a number"))
    };
    let vector = |value: &toml::Value| {
        let v: Vec<Dd> = value.as_array().expect("a vector").iter().map(number).collect();
        Vector3::from_column_slice(&v)
    };
    let inertia = |value: &toml::Value| {
        let rows = value.as_array().expect("moments or a tensor");
        if rows[0].is_array() {
            Matrix3::from_rows(&[vector(&rows[0]), vector(&rows[1]), vector(&rows[2])].map(|row| row.transpose()))
        } else {
            Matrix3::from_diagonal(&vector(value))
        }
    };

    let mut below = file["base"].as_table().expect("a table").clone();
    let mut links = Vec::new();
    for (j, link) in file["link"].as_array().expect("a list of tables").iter().enumerate() {
        let link = link.as_table().expect("a table");
        links.push(MassCentreLink {
            name: format!("link{}", j + 1),
            parent: j.checked_sub(1),
            joint: match link["type"].as_str() {
                Some("revolute") => Joint::Revolute,
                Some("linear") => Joint::Linear,
                other => panic!("unknown joint type {other:?}"),
            },
            iq: j,
            iv: j,
            mass: number(&link["mass"]),
            inertia: inertia(&link["J"]),
            e: unit(&vector(&link["e"])),
            e_parent: unit(&vector(&below["e_next"])),
            r: vector(&link["r"]),
            r_parent: vector(&below["r_next"]),
            extended: ExtendedPosition::ByVectors {
                r_star: link.get("r_star").map(vector),
                r_parent_star: below.get("r_next_star").map(vector),
                alpha: link.get("alpha").map_or(Dd::ZERO, number),
            },
        });
        below = link.clone();
    }
    let tip = MassCentreFrame {
        name: "tip".to_string(),
        link: Some(links.len() - 1),
        position: -vector(&below["r_next"]),
        rotation: Matrix3::identity(),
    };
    MassCentreTree {
        name: file["name"].as_str().expect("a name").to_string(),
        gravity: vector(&file["gravity"]),
        links,
        frames: vec![tip],
    }
}
