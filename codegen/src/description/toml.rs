//! TOML with joint frames; the schema is in `SCHEMA.md`.

use super::composite::{CompositeKind, WrittenComposite};
use super::dh::CONVENTIONS;
use super::flexible::Flexible;
use super::reader::{FileReader, Range64};
use super::table::{self, TomlTable, DRIVE_KEYS, INERTIAL_KEYS};
use super::{
    messages, BaseKind, Description, FileFormat, JointType, NamedFrame, Noted, Placement, WrittenJoint, WrittenLink,
    WrittenPose,
};
use crate::diagnostic::{Diagnostics, Source};
use straightline_core::joint::Dialect;
use toml::de::DeValue;

const JOINT: [&[&str]; 3] =
    [&["name", "kind", "parent", "child", "origin", "axis", "limits"], DRIVE_KEYS, &["transmission", "mimic"]];
const POSE: &[&str] = &["xyz", "rpy", "rpy_rad", "rpy_deg", "rpy_quarter_turns", "rpy_turns"];
const FRAME: &[&str] = &["name", "link", "xyz", "rpy", "rpy_rad", "rpy_deg", "rpy_quarter_turns", "rpy_turns"];
pub(super) const AXES: [(&str, [f64; 3]); 6] = [
    ("x", [1.0, 0.0, 0.0]),
    ("y", [0.0, 1.0, 0.0]),
    ("z", [0.0, 0.0, 1.0]),
    ("-x", [-1.0, 0.0, 0.0]),
    ("-y", [0.0, -1.0, 0.0]),
    ("-z", [0.0, 0.0, -1.0]),
];

pub(super) const FORMAT: FileFormat = FileFormat {
    name: "TOML with joint frames",
    extensions: &["toml"],
    signs: "has `[robot]`, `[[joint]]` or `[[dh]]`",
    sniff: |text| table::holds(text, |top| ["robot", "joint", "dh"].iter().any(|key| top.has(key))),
    dialect: Dialect::JointFrames,
    limits: "write `limits = { lower = ..., upper = ... }`, or kind `continuous`",
    read,
    write: Some(&super::write::toml::WRITER),
};

fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Description> {
    let document = table::parse(source, diagnostics)?;
    let top = TomlTable::of_document(&document);
    let mut reader = FileReader::new(source, diagnostics);
    if !["robot", "link", "joint", "dh"].iter().any(|key| top.has(key)) {
        reader.complain(&(0..0), messages::unknown_format());
        return None;
    }
    reader.check_keys(&top, &["robot", "link", "joint", "dh", "coupling", "loop", "frame", "drive"]);
    let mut description = Description::new(&FORMAT, Noted::assumed("robot".to_string()));
    let mut convention = None;
    reader.require(&top, "robot", "[robot]\\nname = \"...\"");
    if let Some(robot) = reader.table_at(&top, "robot", "[robot]") {
        reader.check_keys(&robot, &["name", "gravity", "base", "base_damping", "dh"]);
        reader.require(&robot, "name", "name = \"...\"");
        if let Some(name) = reader.name_at(&robot, "name", "robot") {
            description.name = name;
        }
        description.gravity = reader.vector_at(&robot, "gravity");
        description.base =
            reader.word_at(&robot, "base", &[("fixed", BaseKind::Fixed), ("floating", BaseKind::Floating)]);
        description.base_damping = reader.real_at(&robot, "base_damping", Range64::Finite);
        if top.has("dh") {
            reader.require(&robot, "dh", "dh = \"standard\" or dh = \"modified\"");
        }
        convention = reader.word_at(&robot, "dh", &CONVENTIONS).map(|word| word.value);
    }
    for table in reader.tables_at(&top, "link") {
        let link = read_link(&mut reader, table, &mut description.flexible);
        description.add_link(link);
    }
    for table in reader.tables_at(&top, "joint") {
        description.add_joint(read_joint(&mut reader, table));
    }
    reader.dh_rows_at(&top, convention, &mut description);
    for table in reader.tables_at(&top, "frame") {
        description.frames.extend(read_frame(&mut reader, table));
    }
    description.couplings.extend(reader.couplings_at(&top));
    description.loops = reader.loops_at(&top);
    description.drives = reader.drives_at(&top);
    description.ignored = reader.into_ignored();
    Some(description)
}

/// The name of a table, which from here on stands in complaints about it.
fn named(reader: &mut FileReader, table: &mut TomlTable, what: &str) -> Option<Noted<String>> {
    reader.require(table, "name", "name = \"...\"");
    let name = reader.name_at(table, "name", what)?;
    table.owner = format!("{what} `{}`", name.value);
    Some(name)
}

fn read_link(reader: &mut FileReader, mut table: TomlTable, flexible: &mut Vec<Flexible>) -> Option<WrittenLink> {
    let name = named(reader, &mut table, "link");
    reader.check_keys(&table, &[&["name"], INERTIAL_KEYS, &["flexible"]].concat());
    flexible.extend(reader.flexible_at(&table, name.as_ref()));
    let has_inertial = INERTIAL_KEYS.iter().any(|key| table.has(key));
    let inertial = if has_inertial { reader.inertial_at(&table) } else { None };
    Some(WrittenLink { name: name?, inertial, is_carrier: false })
}

fn read_joint(reader: &mut FileReader, mut table: TomlTable) -> Option<WrittenJoint> {
    let name = named(reader, &mut table, "joint");
    let words = JointType::words(FORMAT.dialect);
    let is_written = |word: &str| matches!(table.get("kind"), Some((DeValue::String(text), _)) if text == word);
    let written = words.iter().find(|(word, _)| is_written(word)).map(|(_, t)| *t);
    let number = written.and_then(|t| t.number_key());
    let composite = written.and_then(|t| t.composite).map(|composite| composite.of);
    let of_composite = composite.map_or(&[][..], composite_keys);
    reader.check_keys(&table, &[&JOINT.concat(), number.as_slice(), of_composite].concat());
    reader.require(&table, "kind", "kind = \"revolute\"");
    let mut kind = reader.word_at(&table, "kind", &words);
    if let (Some(kind), Some(key)) = (&mut kind, number) {
        reader.require(&table, key, &format!("{key} = 0.01"));
        let number = reader.real_at(&table, key, Range64::Finite).map_or(0.0, |number| number.value);
        kind.value = kind.value.with_number(number);
    }
    reader.require(&table, "parent", "parent = \"...\"");
    let parent = reader.name_at(&table, "parent", "link");
    reader.require(&table, "child", "child = \"...\"");
    let child = reader.name_at(&table, "child", "link");
    let origin = match reader.table_at(&table, "origin", &format!("origin of {}", table.owner)) {
        Some(origin) => {
            reader.check_keys(&origin, POSE);
            reader.pose_at(&origin)
        }
        None => WrittenPose::identity(reader.place(&table.span)),
    };
    if kind.as_ref().is_some_and(|k| k.value.has_axis()) {
        reader.require(&table, "axis", "axis = \"z\"");
    }
    let axis = reader.axis_at(&table, "axis").unwrap_or_else(|| reader.value([0.0, 0.0, 1.0], &table.span));
    if let (Some(kind), Some(composite)) = (&mut kind, composite) {
        kind.value.composite = Some(read_composite(reader, &table, composite));
    }
    let limits = reader.limits_at(&table, "limits");
    let drive = reader.drive_at(&table);
    for (key, why, help) in [
        ("transmission", "it would couple coordinates of drives and joints", "remove `transmission`"),
        (
            "mimic",
            "whom a joint follows is said beside the joints",
            "write it as a table `[[coupling]]` with `joint`, `follows`, `ratio` and `offset`",
        ),
    ] {
        if let Some((_, span)) = table.get(key) {
            reader.complain(&span, messages::not_supported_yet(&table.owner, key, why, help));
        }
    }
    // a kind that was complained of stands for the one with an axis and no limits, so that the axis is judged in the same run
    let kind = kind.unwrap_or_else(|| Noted::new(JointType::turning(false), axis.place.clone()));
    let placement = Placement::Frames { origin, axis };
    let joint = WrittenJoint { name: name?, kind, parent: parent?, child: child?, placement, limits, drive };
    Some(reader.judged_composite(joint))
}

fn composite_keys(composite: &'static CompositeKind) -> &'static [&'static str] {
    match (composite.has_second_axis, composite.has_pitch) {
        (true, _) => &["axis2"],
        (_, true) => &["pitch", "lead"],
        _ => &[],
    }
}

/// What a composite joint has beside others.
fn read_composite(reader: &mut FileReader, table: &TomlTable, of: &'static CompositeKind) -> WrittenComposite {
    let mut read = WrittenComposite { of, second_axis: [0.0, 0.0, 1.0], pitch: 1.0 };
    if of.has_second_axis {
        reader.require(table, "axis2", "axis2 = \"y\"");
        read.second_axis = reader.axis_at(table, "axis2").map_or(read.second_axis, |axis| axis.value);
    }
    if of.has_pitch {
        let [pitch, lead] = ["pitch", "lead"].map(|key| reader.real_at(table, key, Range64::Finite));
        match (pitch, lead) {
            (Some(_), Some(lead)) => {
                reader.diagnostics.push(messages::written_twice(&table.owner, "pitch", "lead").at(&lead.place));
            }
            (Some(pitch), None) => read.pitch = pitch.value,
            (None, Some(lead)) => read.pitch = lead.value / std::f64::consts::TAU,
            (None, None) if !table.has("pitch") && !table.has("lead") => {
                reader.require(table, "pitch", "pitch = 0.0008")
            }
            (None, None) => {}
        }
    }
    read
}

fn read_frame(reader: &mut FileReader, mut table: TomlTable) -> Option<NamedFrame> {
    let name = named(reader, &mut table, "frame");
    reader.check_keys(&table, FRAME);
    reader.require(&table, "link", "link = \"...\"");
    let link = reader.name_at(&table, "link", "link");
    let pose = reader.pose_at(&table);
    Some(NamedFrame { name: name?, link: link?, pose })
}
