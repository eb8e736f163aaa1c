//! URDF, as found in the wild: <http://wiki.ros.org/urdf/XML>.
//!
//! Read are links with their inertials and joints with origin, axis, limits and dynamics, in any order. What shows the
//! robot or serves a simulator is skipped and listed.

use super::reader::{FileReader, Range64};
use super::xml::{self, children, tag, Span};
use super::{
    messages, Angle, AngleUnit, BaseKind, Description, FileFormat, JointDrive, JointLimits, JointType, Noted,
    Placement, Rotation, WrittenCoupling, WrittenInertial, WrittenJoint, WrittenLink, WrittenPose,
};
use crate::diagnostic::wording::closest;
use crate::diagnostic::{Diagnostics, Source};
use roxmltree::{Attribute, Document, Node};
use straightline_core::joint::Dialect;
use straightline_core::spatial::Sym3;

pub(super) const FORMAT: FileFormat = FileFormat {
    name: "URDF",
    extensions: &["urdf", "xml", "xacro"],
    signs: "begins with `<`",
    sniff: |text| text.trim_start().starts_with('<'),
    dialect: Dialect::Urdf,
    limits: "write `<limit lower=\"...\" upper=\"...\" velocity=\"...\" effort=\"...\"/>`, or type `continuous`",
    read,
    write: Some(&super::write::urdf::WRITER),
};

fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Description> {
    xml::parse(FileReader::new(source, diagnostics), read_document)
}

/// What programs and proposals close loops and couple joints by: of the dynamics, and settled nowhere.
const CLOSING: [&str; 4] = ["loop", "loop_joint", "constraint", "coupling"];

fn read_document(mut reader: FileReader, document: &Document) -> Option<Description> {
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        reader.complain(&tag(root), messages::not_a_robot(root.tag_name().name()));
        return None;
    }
    if xml::has_xacro(&mut reader, root) {
        return None;
    }
    let name = match root.attribute("name") {
        Some(name) => {
            reader.value(name.to_string(), &root.attribute_node("name").map_or(tag(root), |a| a.range_value()))
        }
        None => reader.value("robot".to_string(), &tag(root)),
    };
    let mut description = Description::new(&FORMAT, name);
    let mut rotors = Vec::new();
    for node in children(root) {
        match local_name(root, node) {
            Some("link") => description.add_link(read_link(&mut reader, node)),
            Some("joint") => {
                let joint = read_joint(&mut reader, node, &mut description.couplings);
                description.add_joint(joint);
            }
            Some("transmission") if has_rotor(node) => rotors.push(node),
            Some(name) if CLOSING.contains(&name) => reader.complain(&tag(node), messages::urdf_loop(name)),
            _ => skip(&mut reader, "the robot", node, &["link", "joint"]),
        }
    }
    rotors.into_iter().for_each(|node| read_rotor(&mut reader, node, &mut description));
    description.ignored = reader.into_ignored();
    float_base(&mut description);
    Some(description)
}

/// Drake's words for the inertia of a rotor and its gear, whose prefix many files do not declare.
const ROTOR: [[&str; 2]; 2] = [["rotor_inertia", "drake_rotor_inertia"], ["gear_ratio", "drake_gear_ratio"]];

fn has_rotor(transmission: Node) -> bool {
    transmission.descendants().any(|node| ROTOR[0].contains(&node.tag_name().name()))
}

/// A transmission of one joint whose actuator has a rotor.
fn read_rotor(reader: &mut FileReader, node: Node, robot: &mut Description) {
    let named = |names: &[&str]| {
        node.descendants().filter(|child| names.contains(&child.tag_name().name())).collect::<Vec<_>>()
    };
    let owner = "the rotor of a transmission";
    let (joints, [rotors, ratios]) = (named(&["joint"]), ROTOR.map(|words| named(&words)));
    let ([joint], [rotor]) = (&joints[..], &rotors[..]) else {
        let help = "write a transmission for each joint, or `rotor_inertia` in TOML";
        let why = "several joints would share rotors";
        reader.complain(&tag(node), messages::not_supported_yet("a transmission", "rotor_inertia", why, help));
        return;
    };
    let Some(name) = required(reader, "<transmission>", *joint, "name", "name=\"...\"") else { return };
    let names: Vec<String> = robot.joints.iter().map(|joint| joint.name.value.clone()).collect();
    let Some(index) = names.iter().position(|own| own == name.value()) else {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        reader.complain(&name.range_value(), messages::unknown_word("joint of a transmission", name.value(), &names));
        return;
    };
    let mut value = |node: &Node| {
        let attribute = required(reader, owner, *node, "value", "value=\"0\"")?;
        number(reader, owner, attribute, Range64::Finite)
    };
    let (inertia, ratio) = (value(rotor), ratios.first().and_then(&mut value));
    let drive = &mut robot.joints[index].drive;
    (drive.rotor_inertia, drive.gear_ratio) = (inertia, ratio);
}

/// A link without mass that carries one floating joint at its origin, and nothing else, is the world: the link on that joint is a floating base.
fn float_base(robot: &mut Description) {
    let Some(ground) = robot.root().filter(|root| root.inertial.is_none()).map(|root| root.name.value.clone()) else {
        return;
    };
    let on_ground = |joint: &WrittenJoint| joint.parent.value == ground;
    let is_base = |joint: &WrittenJoint| match &joint.placement {
        Placement::Frames { origin, .. } => joint.kind.value.is_free() && origin.is_identity(),
        _ => false,
    };
    let Some(joint) = robot.joints.iter().find(|joint| on_ground(joint) && is_base(joint)) else { return };
    let place = joint.kind.place.clone();
    if robot.joints.iter().filter(|joint| on_ground(joint)).count() > 1 {
        return;
    }
    robot.joints.retain(|joint| !on_ground(joint));
    robot.links.retain(|link| link.name.value != ground);
    robot.base = Some(Noted::new(BaseKind::Floating, place));
}

/// The element's name, if it is of the same namespace as `owner`.
fn local_name<'a>(owner: Node, node: Node<'a, '_>) -> Option<&'a str> {
    (node.tag_name().namespace() == owner.tag_name().namespace()).then(|| node.tag_name().name())
}

/// Skips an element; one that looks like one of `known` gets a warning.
fn skip(reader: &mut FileReader, owner: &str, node: Node, known: &[&str]) {
    const HARMLESS: &[&str] = &[
        "visual",
        "collision",
        "material",
        "gazebo",
        "transmission",
        "ros2_control",
        "calibration",
        "safety_controller",
        "contact",
        "sensor",
        "self_collision_checking",
        "group",
        "disable_collisions",
        "verbose",
    ];
    let name = node.tag_name().name();
    if !HARMLESS.contains(&name) && node.tag_name().namespace().is_none() {
        if let Some(known) = closest(name, known.iter().copied()).filter(|k| k.len() > 3) {
            reader.complain(&tag(node), messages::misspelt_element(owner, name, known));
            return;
        }
    }
    for what in left_out(node) {
        reader.complain(&tag(what), messages::extension_left_out(name, what.tag_name().name()));
    }
    reader.ignore(name, &tag(node));
}

/// What an extension says of the dynamics: words of simulators, and parts of a robot that stand where none is looked for.
fn left_out<'a, 'i>(extension: Node<'a, 'i>) -> Vec<Node<'a, 'i>> {
    const OF_COMPILERS: [&str; 5] = ["balanceinertia", "boundinertia", "boundmass", "inertiafromgeom", "settotalmass"];
    let name = |node: &Node<'a, 'i>| node.tag_name().name();
    let is = |node: &Node, words: &[&str]| node.text().is_some_and(|text| words.contains(&text.trim()));
    let has_inertia =
        |node: &Node| node.descendants().any(|inside| ["inertial", "axis"].contains(&inside.tag_name().name()));
    let counts = |node: &Node<'a, 'i>| match (name(&extension), name(node)) {
        ("gazebo", "springStiffness") => !is(node, &["0", "0.0"]),
        ("gazebo", "turnGravityOff") => !is(node, &["0", "false"]),
        ("gazebo", "gravity") => is(node, &["0", "false"]),
        ("mujoco", "option") => node.attribute("gravity").is_some(),
        ("mujoco", "compiler") => OF_COMPILERS.iter().any(|word| node.attribute(*word).is_some()),
        (_, "link" | "joint") => has_inertia(node),
        _ => false,
    };
    match name(&extension) {
        "gazebo" | "mujoco" => children(extension).filter(counts).collect(),
        _ => extension.descendants().skip(1).filter(counts).collect(),
    }
}

/// The children of `node` with the names `names`, each at most once; others are skipped.
fn pick<'a, 'i, const N: usize>(
    reader: &mut FileReader,
    owner: &str,
    node: Node<'a, 'i>,
    names: [&str; N],
) -> [Option<Node<'a, 'i>>; N] {
    let mut found = [None; N];
    for child in children(node) {
        let index = local_name(node, child).and_then(|name| names.iter().position(|&n| n == name));
        match index {
            Some(i) if found[i].is_some() => reader.complain(&tag(child), messages::repeated_element(owner, names[i])),
            Some(i) => found[i] = Some(child),
            None => skip(reader, owner, child, &names),
        }
    }
    found
}

/// Complains of attributes that an element whose numbers matter does not have; a quaternion would turn the robot.
fn check_attributes(reader: &mut FileReader, owner: &str, node: Node, known: &[&str]) {
    for attribute in node.attributes().filter(|a| a.namespace().is_none() && !known.contains(&a.name())) {
        let span = attribute.range_qname();
        let name = attribute.name();
        if node.has_tag_name("origin") && name.starts_with("quat") {
            let why = "the orientation would be a quaternion";
            let help = "write the orientation as roll, pitch, yaw: `rpy=\"0 0 1.5707963267948966\"`";
            reader.complain(&span, messages::not_supported_yet(owner, name, why, help));
        } else {
            reader.complain(&span, messages::unknown_attribute(owner, node.tag_name().name(), name, known));
        }
    }
}

fn required<'a, 'i>(
    reader: &mut FileReader,
    owner: &str,
    node: Node<'a, 'i>,
    name: &str,
    example: &str,
) -> Option<Attribute<'a, 'i>> {
    let found = node.attribute_node(name);
    if found.is_none() {
        reader.complain(&tag(node), messages::missing_attribute(owner, name, example));
    }
    found
}

fn name_of(reader: &mut FileReader, what: &str, node: Node, attribute: &str, example: &str) -> Option<Noted<String>> {
    let element = format!("<{}>", node.tag_name().name());
    let found = required(reader, &element, node, attribute, example)?;
    reader.name(what, found.value(), &found.range_value())
}

fn number(reader: &mut FileReader, what: &str, attribute: Attribute, range: Range64) -> Option<Noted<f64>> {
    let span = attribute.range_value();
    let value = reader.number(what, attribute.value().trim(), &span, range)?;
    Some(reader.value(value, &span))
}

/// Three numbers, each with its text and span.
fn triple<'a>(reader: &mut FileReader, what: &str, attribute: Attribute<'a, '_>) -> Option<[(f64, &'a str, Span); 3]> {
    let text = (attribute.value(), attribute.range_value());
    let numbers = xml::numbers(reader, what, text, (3..=3, "three numbers"))?;
    let mut numbers = numbers.into_iter();
    Some([numbers.next()?, numbers.next()?, numbers.next()?])
}

fn vector(reader: &mut FileReader, what: &str, attribute: Attribute) -> Option<Noted<[f64; 3]>> {
    let span = attribute.range_value();
    let [x, y, z] = triple(reader, what, attribute)?;
    Some(reader.value([x.0, y.0, z.0], &span))
}

fn read_pose(reader: &mut FileReader, owner: &str, node: Option<Node>, default: Node) -> WrittenPose {
    let mut pose = WrittenPose::identity(reader.place(&tag(node.unwrap_or(default))));
    let Some(node) = node else { return pose };
    check_attributes(reader, owner, node, &["xyz", "rpy"]);
    if let Some(attribute) = node.attribute_node("xyz") {
        if let Some(xyz) = vector(reader, &format!("{owner}, xyz"), attribute) {
            pose.xyz = xyz;
        }
    }
    if let Some(attribute) = node.attribute_node("rpy") {
        if let Some(rpy) = triple(reader, &format!("{owner}, rpy"), attribute) {
            pose.rotation = Rotation::RollPitchYaw(rpy.map(|(value, text, span)| Angle {
                value,
                unit: AngleUnit::Radian,
                text: text.to_string(),
                place: reader.place(&span),
            }));
        }
    }
    pose
}

fn read_link(reader: &mut FileReader, node: Node) -> Option<WrittenLink> {
    let name = name_of(reader, "link", node, "name", "<link name=\"...\">");
    let owner = name.as_ref().map_or("a link".to_string(), |n| format!("link `{}`", n.value));
    let inertial = inertial_of(reader, &owner, node).and_then(|inertial| read_inertial(reader, &owner, inertial));
    Some(WrittenLink { name: name?, inertial, is_carrier: false })
}

/// The `<inertial>` of a link; what only shows the link is skipped.
fn inertial_of<'a, 'i>(reader: &mut FileReader, owner: &str, node: Node<'a, 'i>) -> Option<Node<'a, 'i>> {
    let mut found = None;
    for child in children(node) {
        match local_name(node, child) {
            Some("inertial") if found.is_some() => {
                reader.complain(&tag(child), messages::repeated_element(owner, "inertial"));
            }
            Some("inertial") => found = Some(child),
            _ => skip(reader, owner, child, &["inertial", "visual", "collision"]),
        }
    }
    found
}

fn read_inertial(reader: &mut FileReader, owner: &str, node: Node) -> Option<WrittenInertial> {
    let [origin, mass, inertia] = pick(reader, owner, node, ["origin", "mass", "inertia"]);
    let pose = read_pose(reader, &format!("{owner}, inertial origin"), origin, node);
    if let Some(mass) = mass {
        check_attributes(reader, owner, mass, &["value"]);
    }
    let mass = match mass {
        Some(mass) => required(reader, "<mass>", mass, "value", "<mass value=\"1.0\"/>")
            .and_then(|value| number(reader, &format!("mass of {owner}"), value, Range64::Finite)),
        None => {
            let who = format!("the inertial of {owner}");
            reader.complain(&tag(node), messages::missing_element(&who, "mass", "<mass value=\"1.0\"/>"));
            None
        }
    };
    let inertia = match inertia {
        Some(inertia) => read_inertia(reader, owner, inertia),
        None => Some(reader.value(Sym3 { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 }, &tag(node))),
    };
    Some(WrittenInertial { mass: mass?, com: pose.xyz, rotation: pose.rotation, inertia: inertia? })
}

fn read_inertia(reader: &mut FileReader, owner: &str, node: Node) -> Option<Noted<Sym3<f64>>> {
    check_attributes(reader, owner, node, &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"]);
    let mut entry = |name: &str, is_diagonal: bool| match node.attribute_node(name) {
        Some(attribute) => {
            number(reader, &format!("{name} of {owner}"), attribute, Range64::Finite).map(|value| value.value)
        }
        None if is_diagonal => {
            let example = "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>";
            reader.complain(&tag(node), messages::missing_attribute(&format!("the inertia of {owner}"), name, example));
            None
        }
        None => Some(0.0),
    };
    let (xx, xy, xz) = (entry("ixx", true), entry("ixy", false), entry("ixz", false));
    let (yy, yz, zz) = (entry("iyy", true), entry("iyz", false), entry("izz", true));
    Some(reader.value(Sym3 { xx: xx?, xy: xy?, xz: xz?, yy: yy?, yz: yz?, zz: zz? }, &tag(node)))
}

fn read_joint(reader: &mut FileReader, node: Node, couplings: &mut Vec<WrittenCoupling>) -> Option<WrittenJoint> {
    let name = name_of(reader, "joint", node, "name", "<joint name=\"...\" type=\"revolute\">");
    let owner = name.as_ref().map_or("a joint".to_string(), |n| format!("joint `{}`", n.value));
    let kind = required(reader, &owner, node, "type", "<joint name=\"...\" type=\"revolute\">")
        .and_then(|attribute| read_kind(reader, &owner, attribute));
    let [parent, child, origin, axis, limit, dynamics, mimic] =
        pick(reader, &owner, node, ["parent", "child", "origin", "axis", "limit", "dynamics", "mimic"]);
    let mut end = |element: Option<Node>, what: &str| match element {
        Some(element) => name_of(reader, what, element, "link", &format!("<{what} link=\"...\"/>")),
        None => {
            let example = format!("<{what} link=\"...\"/>");
            reader.complain(&tag(node), messages::missing_element(&owner, what, &example));
            None
        }
    };
    let (parent, child) = (end(parent, "parent"), end(child, "child"));
    let origin = read_pose(reader, &format!("{owner}, origin"), origin, node);
    let moves = kind.as_ref().is_none_or(|k| k.value.kind.is_some() || k.value.composite.is_some());
    if let Some(axis) = axis.filter(|_| moves) {
        check_attributes(reader, &owner, axis, &["xyz"]);
    }
    let default_axis = reader.value([1.0, 0.0, 0.0], &tag(axis.unwrap_or(node)));
    let axis = match axis.filter(|_| moves) {
        Some(element) => required(reader, &format!("axis of {owner}"), element, "xyz", "<axis xyz=\"0 0 1\"/>")
            .and_then(|attribute| vector(reader, &format!("axis of {owner}"), attribute))
            .unwrap_or(default_axis),
        None => default_axis,
    };
    let limits = match limit.filter(|_| moves) {
        Some(element) => read_limits(reader, &owner, element),
        None => JointLimits::default(),
    };
    let mut drive = JointDrive::default();
    if let Some(element) = dynamics.filter(|_| moves) {
        check_attributes(reader, &owner, element, &["damping", "friction"]);
        let mut read = |name: &str| {
            let attribute = element.attribute_node(name)?;
            number(reader, &format!("{name} of {owner}"), attribute, Range64::Finite)
        };
        drive.damping = read("damping");
        drive.friction = read("friction");
    }
    if let (Some(element), Some(name)) = (mimic.filter(|_| moves), &name) {
        match kind.as_ref().and_then(|kind| kind.value.composite) {
            Some(composite) => {
                let complaint = messages::several_coordinates(&name.value, composite.of.word, "a mimic");
                reader.complain(&tag(element), complaint);
            }
            None => couplings.extend(read_mimic(reader, &owner, name, element)),
        }
    }
    let placement = Placement::Frames { origin, axis };
    let joint = WrittenJoint { name: name?, kind: kind?, parent: parent?, child: child?, placement, limits, drive };
    Some(reader.judged_composite(joint))
}

/// Whose coordinate a joint follows, and how: q = multiplier q_joint + offset.
fn read_mimic(reader: &mut FileReader, owner: &str, joint: &Noted<String>, node: Node) -> Option<WrittenCoupling> {
    let owner = format!("mimic of {owner}");
    check_attributes(reader, &owner, node, &["joint", "multiplier", "offset"]);
    let source = required(reader, &owner, node, "joint", "<mimic joint=\"...\"/>");
    let source = source.and_then(|source| reader.name("joint", source.value(), &source.range_value()));
    let mut read = |name: &str, default: f64| match node.attribute_node(name) {
        Some(attribute) => number(reader, &format!("{name} of {owner}"), attribute, Range64::Finite),
        None => Some(reader.value(default, &tag(node))),
    };
    let (ratio, offset) = (read("multiplier", 1.0), read("offset", 0.0));
    Some(WrittenCoupling { joint: joint.clone(), source: source?, ratio: ratio?, offset: offset? })
}

fn read_kind(reader: &mut FileReader, owner: &str, attribute: Attribute) -> Option<Noted<JointType>> {
    let span = attribute.range_value();
    let words = JointType::words(Dialect::Urdf);
    let kind = match attribute.value().trim() {
        word if words.iter().any(|(known, _)| *known == word) => {
            words.into_iter().find(|(known, _)| *known == word).map(|(_, kind)| kind)?
        }
        word => {
            let known: Vec<&str> = words.iter().filter(|(_, t)| !t.is_free()).map(|(known, _)| *known).collect();
            reader.complain(&span, messages::unknown_word(&format!("type of {owner}"), word, &known));
            return None;
        }
    };
    Some(reader.value(kind, &span))
}

fn read_limits(reader: &mut FileReader, owner: &str, node: Node) -> JointLimits {
    let known = ["lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"];
    check_attributes(reader, owner, node, &known);
    let mut read = |name: &str| {
        let attribute = node.attribute_node(name)?;
        let mut limit = number(reader, &format!("{name} limit of {owner}"), attribute, Range64::Limit)?;
        if !JointLimits::is_limit(limit.value) {
            limit.value = f64::INFINITY.copysign(limit.value);
        }
        Some(limit)
    };
    let (mut lower, mut upper) = (read("lower"), read("upper"));
    let (velocity, effort) = (read("velocity"), read("effort"));
    // URDF: a limit that is left out is 0; if both are, the file does not mean it.
    let given = |name: &str| node.has_attribute(name);
    if given("upper") && !given("lower") {
        lower = Some(reader.value(0.0, &tag(node)));
    }
    if given("lower") && !given("upper") {
        upper = Some(reader.value(0.0, &tag(node)));
    }
    JointLimits { lower, upper, velocity, effort }
}
