//! URDF: links with their inertials, then joints. Frames are links without mass on fixed joints.

use super::edits::{indentation, TextEdit};
use super::{attribute, losses, number, numbers, rotations, word_of, FormatWriter, JointForm, LoopForm};
use crate::description::reader::FileReader;
use crate::description::xml::{self, children};
use crate::description::{
    Description, JointLimits, JointType, Noted, Placement, Rotation, WrittenInertial, WrittenJoint, WrittenPose,
};
use crate::diagnostic::{Diagnostics, Source};
use roxmltree::Node;
use std::fmt::Write;
use straightline_core::joint::Dialect;

/// Writes a URDF.
pub static WRITER: FormatWriter = FormatWriter {
    word: "urdf",
    extensions: &["urdf"],
    joints: JointForm::AtFrames,
    rotations: "roll, pitch and yaw in radians",
    frames_are_links: true,
    loops: LoopForm::Nowhere,
    losses: &[
        &losses::SPRINGS,
        &losses::ROTORS,
        &losses::GRAVITY,
        &losses::DRIVES,
        &losses::LOOPS,
        &losses::FLEXIBLE_LINKS,
        &losses::ENDLESS_LIMITS,
        &losses::BALL_JOINTS,
        &losses::FLOATING_BASE,
        &losses::DAMPED_BASE,
        &losses::CARRIERS,
        &losses::JOINTS_BESIDE_FRAMES,
        &losses::NAMED_FRAMES,
        &losses::SKIPPED,
    ],
    floats_by_option: true,
    text,
    edits: Some(number_edits),
};

fn text(robot: &Description) -> String {
    let mut out = format!("<?xml version=\"1.0\"?>\n<robot{}>\n", attribute("name", &robot.name.value));
    for link in &robot.links {
        let name = attribute("name", &link.name.value);
        match &link.inertial {
            None => _ = writeln!(out, "  <link{name}/>"),
            Some(inertial) => {
                _ = writeln!(
                    out,
                    "  <link{name}>\n    <inertial>\n{}    </inertial>\n  </link>",
                    of_inertial(inertial)
                );
            }
        }
    }
    for joint in &robot.joints {
        out += &of_joint(joint, robot);
    }
    out + "</robot>\n"
}

/// An origin, or nothing where frames coincide.
fn origin(xyz: &[f64; 3], rotation: &Rotation, indent: &str) -> String {
    let rpy = rotations::roll_pitch_yaw(rotation);
    if *xyz == [0.0; 3] && rpy == [0.0; 3] {
        return String::new();
    }
    let (xyz, rpy) = (attribute("xyz", &numbers(xyz)), attribute("rpy", &numbers(&rpy)));
    format!("{indent}<origin{xyz}{rpy}/>\n")
}

fn of_inertial(inertial: &WrittenInertial) -> String {
    let j = &inertial.inertia.value;
    let mut out = origin(&inertial.com.value, &inertial.rotation, "      ");
    _ = writeln!(out, "      <mass{}/>", attribute("value", &number(inertial.mass.value)));
    out += "      <inertia";
    for (name, entry) in [("ixx", j.xx), ("ixy", j.xy), ("ixz", j.xz), ("iyy", j.yy), ("iyz", j.yz), ("izz", j.zz)] {
        out += &attribute(name, &number(entry));
    }
    out + "/>\n"
}

fn of_joint(joint: &WrittenJoint, robot: &Description) -> String {
    let Placement::Frames { origin: WrittenPose { xyz, rotation }, axis } = &joint.placement else {
        unreachable!("joints stand at the frames of links");
    };
    let kind = joint.kind.value;
    let limits = &joint.limits;
    let is_ranged = kind.has_range && (limits.lower.is_some() || limits.upper.is_some());
    let word = word_of(kind.between_links(), is_ranged, Dialect::Urdf).unwrap_or(kind.word);
    let mut out = format!("  <joint{}{}>\n", attribute("name", &joint.name.value), attribute("type", word));
    _ = writeln!(out, "    <parent{}/>", attribute("link", &joint.parent.value));
    _ = writeln!(out, "    <child{}/>", attribute("link", &joint.child.value));
    out += &origin(&xyz.value, rotation, "    ");
    if kind.has_axis() {
        _ = writeln!(out, "    <axis{}/>", attribute("xyz", &numbers(&axis.value)));
    }
    out += &of_limits(limits, is_ranged, word);
    let effects = [("damping", &joint.drive.damping), ("friction", &joint.drive.friction)];
    out += &element("dynamics", &effects.map(|(name, value)| (name, value.as_ref().map(|value| value.value))));
    for coupling in robot.couplings.iter().filter(|coupling| coupling.joint.value == joint.name.value) {
        let (ratio, offset) = (number(coupling.ratio.value), number(coupling.offset.value));
        let numbers = attribute("multiplier", &ratio) + &attribute("offset", &offset);
        _ = writeln!(out, "    <mimic{}{numbers}/>", attribute("joint", &coupling.source.value));
    }
    out + "  </joint>\n"
}

/// Both ends of a range, as one that is left out is 0 in this format, and both greatest values: `urdfdom`, which ROS, Pinocchio and others read by, refuses an
/// element without them. What has no limit has [`JointLimits::NONE`]. Joints that slide always have a range.
fn of_limits(limits: &JointLimits, is_ranged: bool, word: &str) -> String {
    let needs_range = JointType::words(Dialect::Urdf).iter().any(|(known, t)| *known == word && t.has_range);
    if !needs_range && limits.effort.is_none() && limits.velocity.is_none() {
        return String::new();
    }
    let none = JointLimits::NONE;
    let value = |limit: &Option<Noted<f64>>, otherwise: f64| {
        limit.as_ref().map_or(otherwise, |limit| limit.value.clamp(-none, none))
    };
    let [lower, upper] = if is_ranged { [&limits.lower, &limits.upper] } else { [&None, &None] };
    element(
        "limit",
        &[
            ("lower", needs_range.then(|| value(lower, -none))),
            ("upper", needs_range.then(|| value(upper, none))),
            ("effort", Some(value(&limits.effort, none))),
            ("velocity", Some(value(&limits.velocity, none))),
        ],
    )
}

/// An element with the attributes that have a number; nothing where none has.
fn element(name: &str, attributes: &[(&str, Option<f64>)]) -> String {
    let given = attributes.iter().filter_map(|(name, value)| Some(attribute(name, &number((*value)?))));
    let given: String = given.collect();
    match given.is_empty() {
        true => given,
        false => format!("    <{name}{given}/>\n"),
    }
}

/// Numbers of inertials and of what joints lose.
fn number_edits(source: &Source, [_, robot]: [&Description; 2]) -> Vec<TextEdit> {
    let mut said = Diagnostics::new();
    let edits = xml::parse(FileReader::new(source, &mut said), |_, document| {
        let mut edits = XmlEdits { text: source.text(), edits: Vec::new() };
        for node in children(document.root_element()) {
            let name = node.attribute("name").unwrap_or_default();
            match node.tag_name().name() {
                "link" => edits.of_link(node, robot.link(name)?.inertial.as_ref()),
                "joint" => edits.of_joint(node, robot.joint(name)?),
                _ => {}
            }
        }
        Some(edits.edits)
    });
    edits.unwrap_or_default()
}

/// Attributes that change.
struct XmlEdits<'a> {
    text: &'a str,
    edits: Vec<TextEdit>,
}

impl XmlEdits<'_> {
    fn of_link(&mut self, node: Node, inertial: Option<&WrittenInertial>) {
        let (Some(node), Some(inertial)) = (children(node).find(|child| child.has_tag_name("inertial")), inertial)
        else {
            return;
        };
        let child = |name: &str| children(node).find(|child| child.has_tag_name(name));
        let Some(mass) = child("mass") else { return };
        self.set(mass, "value", &[inertial.mass.value]);
        let j = &inertial.inertia.value;
        let entries = [("ixx", j.xx), ("ixy", j.xy), ("ixz", j.xz), ("iyy", j.yy), ("iyz", j.yz), ("izz", j.zz)];
        match child("inertia") {
            Some(inertia) => entries.iter().for_each(|(name, entry)| self.set(inertia, name, &[*entry])),
            None => {
                let entries = entries.map(|(name, entry)| attribute(name, &number(entry))).concat();
                self.insert_after(mass, &format!("<inertia{entries}/>"));
            }
        }
        match child("origin") {
            Some(origin) => self.set(origin, "xyz", &inertial.com.value),
            None if inertial.com.value == [0.0; 3] => {}
            None => self.insert_after(mass, &format!("<origin{}/>", attribute("xyz", &numbers(&inertial.com.value)))),
        }
    }

    fn of_joint(&mut self, node: Node, joint: &WrittenJoint) {
        let effects = [("damping", &joint.drive.damping), ("friction", &joint.drive.friction)];
        let effects = effects.map(|(name, value)| (name, value.as_ref().map(|value| value.value)));
        if let Some(dynamics) = children(node).find(|child| child.has_tag_name("dynamics")) {
            effects.iter().for_each(|(name, value)| value.iter().for_each(|value| self.set(dynamics, name, &[*value])));
            return;
        }
        let Some(beside) = children(node).find(|child| child.has_tag_name("child")) else { return };
        let element = element("dynamics", &effects);
        if !element.is_empty() {
            self.insert_after(beside, element.trim());
        }
    }

    /// Numbers of an attribute, unless they are what they were.
    fn set(&mut self, node: Node, name: &str, values: &[f64]) {
        let Some(was) = node.attribute_node(name) else {
            let end = node.range().start
                + 1
                + self.text[node.range().start + 1..].find([' ', '\t', '\r', '\n', '/', '>']).unwrap_or(0);
            if values.iter().any(|value| *value != 0.0) {
                self.edits.push(TextEdit::insert(end, attribute(name, &numbers(values))));
            }
            return;
        };
        let is_same = was.value().split_ascii_whitespace().map(str::parse::<f64>).eq(values.iter().map(|x| Ok(*x)));
        if !is_same {
            self.edits.push(TextEdit { span: was.range_value(), text: numbers(values) });
        }
    }

    fn insert_after(&mut self, node: Node, element: &str) {
        let indent = indentation(self.text, node.range().start);
        self.edits.push(TextEdit::insert(node.range().end, format!("\n{indent}{element}")));
    }
}
