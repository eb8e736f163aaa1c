//! TOML with centres of mass, joint axes and joint vectors: the notation of the chapter, 20.1.2 and its appendix.
//!
//! The schema is in `SCHEMA.md`. Links and joints without a name are called `link1`, `link2`, … and `joint1`, `joint2`, ….

use super::flexible::Flexible;
use super::reader::{Range64, Reader};
use super::table::Table;
use super::{CentreOfMassEnd, CentreOfMassLink, CentreOfMassNotation, Description, Format, JointType, Notation, Value};
use straightline_core::spatial::Sym3;

const LINK: &[&str] = &[
    "name",
    "joint_name",
    "type",
    "mass",
    "J",
    "e",
    "r",
    "r_star",
    "alpha",
    "alpha_rad",
    "alpha_deg",
    "alpha_quarter_turns",
    "alpha_turns",
    "e_next",
    "r_next",
    "r_next_star",
    "limits",
    "damping",
    "friction",
    "rotor_inertia",
    "gear_ratio",
    "armature",
    "spring",
    "flexible",
];

/// Whether a document speaks of centres of mass rather than joint frames.
pub(super) fn is_centre_of_mass_notation(top: &Table) -> bool {
    let links = top.get("link").and_then(|(links, _)| links.as_array());
    let has = |key: &str| {
        links.is_some_and(|l| l.iter().any(|t| t.get_ref().as_table().is_some_and(|t| t.contains_key(key))))
    };
    !top.has("robot")
        && !top.has("joint")
        && (top.has("base") || ["e", "r", "e_next", "r_next", "J"].into_iter().any(has))
}

/// Reads a chain. Complaints go to the reader's diagnostics.
pub(super) fn read(reader: &mut Reader, top: &Table) -> Description {
    reader.check_keys(top, &["name", "gravity", "base", "link", "drive"]);
    let name = match top.has("name") {
        true => reader.name_at(top, "name", "robot"),
        false => None,
    };
    let gravity = reader.vector_at(top, "gravity");
    reader.require(top, "base", "[base]\\ne_next = [0.0, 0.0, 1.0]\\nr_next = [-0.1, 0.0, 0.0]");
    let tables = reader.tables_at(top, "link");
    let base = match reader.table_at(top, "base", "[base]") {
        Some(table) => {
            reader.check_keys(&table, &["e_next", "r_next", "r_next_star"]);
            read_end(reader, &table, tables.is_empty())
        }
        None => CentreOfMassEnd { e_next: None, r_next: None, r_next_star: None },
    };
    let count = tables.len();
    let mut flexible = Vec::new();
    let links =
        tables.into_iter().enumerate().map(|(i, table)| read_link(reader, table, (i + 1, count), &mut flexible));
    let links = links.collect();
    Description {
        format: Format::CentreOfMassToml,
        name: name.unwrap_or_else(|| Value::assumed("robot".to_string())),
        gravity,
        base: None,
        notation: Notation::CentresOfMass(CentreOfMassNotation { base, links }),
        drives: reader.drives_at(top),
        flexible,
        ignored: Vec::new(),
    }
}

fn read_end(reader: &mut Reader, table: &Table, is_last: bool) -> CentreOfMassEnd {
    if !is_last {
        reader.require(table, "e_next", "e_next = [0.0, 0.0, 1.0]");
        reader.require(table, "r_next", "r_next = [-0.1, 0.0, 0.0]");
    }
    CentreOfMassEnd {
        e_next: reader.vector_at(table, "e_next"),
        r_next: reader.vector_at(table, "r_next"),
        r_next_star: reader.vector_at(table, "r_next_star"),
    }
}

fn read_link(
    reader: &mut Reader,
    mut table: Table,
    (j, count): (usize, usize),
    flexible: &mut Vec<Flexible>,
) -> CentreOfMassLink {
    let given = |reader: &mut Reader, table: &Table, key: &str, what: &str| {
        let name = if table.has(key) { reader.name_at(table, key, what) } else { None };
        name.unwrap_or_else(|| reader.value(format!("{what}{j}"), &table.span))
    };
    let name = given(reader, &table, "name", "link");
    let joint_name = given(reader, &table, "joint_name", "joint");
    table.owner = format!("link `{}`", name.value);
    reader.check_keys(&table, LINK);
    flexible.extend(reader.flexible_at(&table, Some(&name)));
    for (key, example) in [("type", "type = \"revolute\""), ("mass", "mass = 1.0"), ("J", "J = [0.1, 0.1, 0.1]")] {
        reader.require(&table, key, example);
    }
    let kind = reader.word_at(&table, "type", &JointType::words(Format::CentreOfMassToml));
    let mass = reader.real_at(&table, "mass", Range64::Finite);
    let inertia = reader.tensor_at(&table, "J");
    let zero = Sym3 { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 };
    CentreOfMassLink {
        name,
        joint_name,
        kind: kind.unwrap_or_else(|| reader.value(JointType::turning(true), &table.span)),
        mass: mass.unwrap_or_else(|| reader.value(0.0, &table.span)),
        inertia: inertia.unwrap_or_else(|| reader.value(zero, &table.span)),
        e: reader.required_vector(&table, "e", "e = [0.0, 0.0, 1.0]"),
        r: reader.required_vector(&table, "r", "r = [0.1, 0.0, 0.0]"),
        r_star: reader.vector_at(&table, "r_star"),
        alpha: reader.angle_at(&table, "alpha"),
        end: read_end(reader, &table, j == count),
        limits: reader.limits_at(&table, "limits"),
        drive: reader.drive_at(&table),
    }
}
