//! Robots in the chapter's notation, from their TOML files.
#![allow(dead_code)] // every test file uses a part of it

use nalgebra::{Matrix3, Vector3};
use straightline_core::reference::{
    unit, CentreOfMassFrame, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint,
};
use straightline_core::Dd;

/// A robot in the chapter's notation.
pub fn chapter_robot(text: &str) -> CentreOfMassTree<Dd> {
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
        links.push(CentreOfMassLink {
            name: format!("link{}", j + 1),
            parent: j.checked_sub(1),
            joint: match link["type"].as_str() {
                Some("revolute") => ReferenceJoint::Revolute,
                Some("linear") => ReferenceJoint::Linear,
                other => panic!("unknown joint type {other:?}"),
            },
            iq: j,
            iv: j,
            shared: None,
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
    let tip = CentreOfMassFrame {
        name: "tip".to_string(),
        link: Some(links.len() - 1),
        position: -vector(&below["r_next"]),
        rotation: Matrix3::identity(),
    };
    CentreOfMassTree {
        name: file["name"].as_str().expect("a name").to_string(),
        gravity: vector(&file["gravity"]),
        links,
        frames: vec![tip],
    }
}
