//! TOML with centres of mass, joint axes and joint vectors: the notation of the chapter, 20.1.2 and its appendix.
//!
//! The schema is in `SCHEMA.md`. Links and joints without a name are called `link1`, `link2`, … and `joint1`, `joint2`, …. A link's frame has
//! its origin in the centre of mass; the world is the link `base`, the end of the chain the frame `tip`.

use super::reader::{FileReader, Range64};
use super::table::{self, TomlTable};
use super::{
    messages, Description, FileFormat, JointType, JointVectors, NamedFrame, Noted, Placement, Rotation,
    WrittenInertial, WrittenJoint, WrittenLink, WrittenPose,
};
use crate::diagnostic::{Diagnostics, Source};
use straightline_core::joint::Dialect;

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

pub(super) const FORMAT: FileFormat = FileFormat {
    name: "TOML with centres of mass",
    extensions: &["toml"],
    signs: "has `[base]`, or `[[link]]` with `e`, `r` or `J`",
    sniff: |text| table::holds(text, is_chain),
    dialect: Dialect::CentresOfMass,
    limits: "write `limits = [lower, upper]`",
    read,
    write: None,
};

fn is_chain(top: &TomlTable) -> bool {
    let links = top.get("link").and_then(|(links, _)| links.as_array());
    let has = |key: &str| {
        links.is_some_and(|l| l.iter().any(|t| t.get_ref().as_table().is_some_and(|t| t.contains_key(key))))
    };
    !top.has("robot")
        && !top.has("joint")
        && (top.has("base") || ["e", "r", "e_next", "r_next", "J"].into_iter().any(has))
}

/// The upper end of link j: what it says of joint j+1, in frame j; of the last link, of the tip.
#[derive(Default)]
struct End {
    /// e_{j+1}.
    e: Option<Noted<[f64; 3]>>,
    /// r_{j,j+1}, from S_{j+1} to C_j; tip = C_n − r_{n,n+1}.
    r: Option<Noted<[f64; 3]>>,
    /// r*_{j,j+1}.
    r_star: Option<Noted<[f64; 3]>>,
}

fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Description> {
    let document = table::parse(source, diagnostics)?;
    let top = &TomlTable::of_document(&document);
    let reader = &mut FileReader::new(source, diagnostics);
    reader.check_keys(top, &["name", "gravity", "base", "link", "drive"]);
    let name = match top.has("name") {
        true => reader.name_at(top, "name", "robot"),
        false => None,
    };
    let name = name.unwrap_or_else(|| Noted::assumed("robot".to_string()));
    let mut robot = Description::new(&FORMAT, name);
    robot.gravity = reader.vector_at(top, "gravity");
    reader.require(top, "base", "[base]\\ne_next = [0.0, 0.0, 1.0]\\nr_next = [-0.1, 0.0, 0.0]");
    let mut tables = reader.tables_at(top, "link");
    let names: Vec<Noted<String>> =
        tables.iter_mut().zip(1..).map(|(table, j)| name_or_number(reader, table, "name", "link", j)).collect();
    let mut end = End::default();
    let mut below = Noted::new("base".to_string(), robot.name.place.clone());
    while names.iter().any(|name| name.value == below.value) {
        below.value.insert(0, '_');
    }
    if let Some(base) = reader.table_at(top, "base", "[base]") {
        reader.check_keys(&base, &["e_next", "r_next", "r_next_star"]);
        below.place = reader.place(&base.span);
        end = read_end(reader, &base, tables.is_empty());
    }
    if tables.is_empty() {
        reader.diagnostics.push(messages::no_links(&robot.name.value).at(&robot.name.place));
    }
    robot.links.push(WrittenLink { name: below.clone(), inertial: None, is_carrier: false });
    let count = tables.len();
    for (j, (mut table, name)) in (1..).zip(tables.into_iter().zip(names)) {
        let joint_name = name_or_number(reader, &table, "joint_name", "joint", j);
        table.owner = format!("link `{}`", name.value);
        reader.check_keys(&table, LINK);
        robot.flexible.extend(reader.flexible_at(&table, Some(&name)));
        robot.links.push(WrittenLink {
            inertial: read_inertial(reader, &table),
            name: name.clone(),
            is_carrier: false,
        });
        let joint = read_joint(reader, &table, joint_name, end, [below, name.clone()]);
        robot.add_joint(joint);
        end = read_end(reader, &table, j == count);
        below = name;
    }
    if count > 0 {
        for (key, given) in [("e_next", &end.e), ("r_next_star", &end.r_star)] {
            if let Some(given) = given {
                reader.diagnostics.push(messages::e_next_on_last(&below.value, key).at(&given.place));
            }
        }
        robot.frames.extend(end.r.map(|r| NamedFrame {
            name: Noted::new("tip".to_string(), r.place.clone()),
            link: below,
            pose: WrittenPose {
                xyz: Noted::new(r.value.map(|x| -x), r.place.clone()),
                rotation: Rotation::identity(r.place),
            },
        }));
    }
    robot.drives = reader.drives_at(top);
    Some(robot)
}

fn read_end(reader: &mut FileReader, table: &TomlTable, is_last: bool) -> End {
    if !is_last {
        reader.require(table, "e_next", "e_next = [0.0, 0.0, 1.0]");
        reader.require(table, "r_next", "r_next = [-0.1, 0.0, 0.0]");
    }
    End {
        e: reader.vector_at(table, "e_next"),
        r: reader.vector_at(table, "r_next"),
        r_star: reader.vector_at(table, "r_next_star"),
    }
}

/// What a key says, or else `link3`.
fn name_or_number(reader: &mut FileReader, table: &TomlTable, key: &str, what: &str, j: usize) -> Noted<String> {
    let name = if table.has(key) { reader.name_at(table, key, what) } else { None };
    name.unwrap_or_else(|| reader.value(format!("{what}{j}"), &table.span))
}

fn read_inertial(reader: &mut FileReader, table: &TomlTable) -> Option<WrittenInertial> {
    reader.require(table, "mass", "mass = 1.0");
    reader.require(table, "J", "J = [0.1, 0.1, 0.1]");
    let (mass, inertia) = (reader.real_at(table, "mass", Range64::Finite), reader.tensor_at(table, "J"));
    let place = reader.place(&table.span);
    let com = Noted::new([0.0; 3], place.clone());
    Some(WrittenInertial { mass: mass?, com, rotation: Rotation::identity(place), inertia: inertia? })
}

fn read_joint(
    reader: &mut FileReader,
    table: &TomlTable,
    name: Noted<String>,
    end: End,
    [parent, child]: [Noted<String>; 2],
) -> Option<WrittenJoint> {
    reader.require(table, "type", "type = \"revolute\"");
    let kind = reader.word_at(table, "type", &JointType::words(FORMAT.dialect));
    let e = reader.required_vector(table, "e", "e = [0.0, 0.0, 1.0]");
    let r = reader.required_vector(table, "r", "r = [0.1, 0.0, 0.0]");
    let (r_star, alpha) = (reader.vector_at(table, "r_star"), reader.angle_at(table, "alpha"));
    let (limits, drive) = (reader.limits_at(table, "limits"), reader.drive_at(table));
    let kind = kind?;
    match (&alpha, kind.value.kind.is_some_and(|kind| kind.slides())) {
        (None, true) => reader.diagnostics.push(messages::alpha_missing(&name.value).at(&kind.place)),
        (Some(alpha), false) if alpha.value != 0.0 => {
            reader.diagnostics.push(messages::alpha_on_revolute(&name.value).at(&alpha.place));
        }
        _ => {}
    }
    let placement = Placement::Vectors(JointVectors {
        e_parent: end.e?,
        r_parent: end.r?,
        r_parent_star: end.r_star,
        e,
        r,
        r_star,
        alpha,
    });
    Some(WrittenJoint { name, kind, parent, child, placement, limits, drive })
}
