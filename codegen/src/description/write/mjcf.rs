//! MJCF: bodies in bodies, each with its joints. Angles are radians, and three angles are roll, pitch and yaw as in a URDF.
//!
//! Links that only carry joints become joints of the body that they end in, or a `<frame>`, so that what was read of such files is written
//! as it was.

use super::rotations::{self, Said};
use super::{attribute, losses, number, numbers, word_of, FormatWriter, JointForm, LoopForm, OnLinks};
use crate::description::angle::{self, ROUNDING};
use crate::description::{
    AnchoredJoint, ClosingJoint, Description, LoopPoints, Placement, Rotation, WrittenInertial, WrittenJoint,
    WrittenLink, WrittenPose,
};
use std::fmt::Write;
use straightline_core::joint::Dialect;
use straightline_core::spatial::Sym3;
use straightline_core::Dd;

/// Writes MJCF.
pub static WRITER: FormatWriter = FormatWriter {
    word: "mjcf",
    extensions: &["xml", "mjcf"],
    joints: JointForm::Anywhere,
    rotations: "roll, pitch and yaw in radians (`eulerseq=\"XYZ\"`) where IN has angles, quaternions otherwise",
    frames_are_links: false,
    loops: LoopForm::Frames,
    losses: &[
        &losses::DRIVES,
        &losses::FLEXIBLE_LINKS,
        &losses::ASSEMBLIES,
        &losses::HINGED_LOOPS,
        &losses::VELOCITY_LIMITS,
        &losses::ONE_SIDED_RANGES,
        &losses::ZERO_EFFORTS,
        &losses::BODIES_WITHOUT_MASS,
        &losses::INERTIAS_OF_NO_BODY,
        &losses::ROTORS_AS_ARMATURES,
        &losses::MASS_OF_THE_WORLD,
        &losses::NAMES_OF_FIXED_JOINTS,
        &losses::SOFT_COUPLINGS,
        &losses::SOFT_LOOPS,
        &losses::SKIPPED,
    ],
    floats_by_option: false,
    text,
    edits: None,
};

fn text(robot: &Description) -> String {
    let mut out = format!("<mujoco{}>\n", attribute("model", &robot.name.value));
    out += "  <compiler angle=\"radian\" eulerseq=\"XYZ\"/>\n";
    if let Some(gravity) = &robot.gravity {
        _ = writeln!(out, "  <option{}/>", attribute("gravity", &numbers(&gravity.value)));
    }
    out += &Bodies(OnLinks::of(robot)).text();
    if !robot.couplings.is_empty() || !robot.loops.is_empty() {
        out += "  <equality>\n";
        for coupling in &robot.couplings {
            let ends = attribute("joint1", &coupling.joint.value) + &attribute("joint2", &coupling.source.value);
            let line = numbers(&[coupling.offset.value, coupling.ratio.value, 0.0, 0.0, 0.0]);
            _ = writeln!(out, "    <joint{ends}{}/>", attribute("polycoef", &line));
        }
        for own in &robot.loops {
            let LoopPoints::Frames([one, other]) = &own.points else { unreachable!("loops are closed at frames") };
            let sites = attribute("site1", &one.value) + &attribute("site2", &other.value);
            let element = if own.joint == ClosingJoint::Fixed { "weld" } else { "connect" };
            _ = writeln!(out, "    <{element}{}{sites}/>", attribute("name", &own.name.value));
        }
        out += "  </equality>\n";
    }
    if !robot.loops.is_empty() {
        out += &motors(robot);
    }
    out + "</mujoco>\n"
}

/// A motor at each joint that no loop determines: those without become dependent first.
fn motors(robot: &Description) -> String {
    let determined = |name: &str| robot.loops.iter().flat_map(|own| &own.determines).any(|own| own.value == name);
    let single = |joint: &&WrittenJoint| joint.kind.value.between_links().is_some_and(|kind| kind.is_single());
    let mut out = "  <actuator>\n".to_string();
    for joint in robot.joints.iter().filter(single).filter(|joint| !determined(&joint.name.value)) {
        _ = writeln!(out, "    <motor{}/>", attribute("joint", &joint.name.value));
    }
    out + "  </actuator>\n"
}

/// What is still to be written: a body with the joints that move it, the outermost first, or the end of an element.
enum BodyStep<'a> {
    Body(&'a WrittenLink, Vec<&'a WrittenJoint>),
    End(&'static str),
}

/// Bodies in bodies.
struct Bodies<'a>(OnLinks<'a>);

impl<'a> Bodies<'a> {
    fn text(&self) -> String {
        let mut out = "  <worldbody>\n".to_string();
        let Some(root) = self.0.robot.root() else { return out + "  </worldbody>\n" };
        let floats = self.0.robot.floats();
        let mut open = Vec::new();
        match self.0.robot.ground().is_some() {
            true => {
                self.add_sites(root, 2, &mut out);
                open.extend(self.on(root));
            }
            false => open.push(BodyStep::Body(root, Vec::new())),
        }
        let mut depth = 2;
        while let Some(step) = open.pop() {
            match step {
                BodyStep::End(element) => {
                    depth -= 1;
                    _ = writeln!(out, "{}</{element}>", indent(depth));
                }
                BodyStep::Body(link, joints) => {
                    let element = element_of(link, &joints);
                    let pose = joints.first().map_or(String::new(), |joint| pose(origin_of(joint)));
                    let name = match element {
                        "frame" => String::new(),
                        _ => attribute("name", &link.name.value),
                    };
                    _ = writeln!(out, "{}<{element}{name}{pose}>", indent(depth));
                    depth += 1;
                    if joints.is_empty() && floats {
                        let damped = self.0.robot.base_damping.as_ref().filter(|damping| damping.value != 0.0);
                        let joint = damped.map_or("freejoint".to_string(), |damping| {
                            "joint type=\"free\"".to_string() + &attribute("damping", &number(damping.value))
                        });
                        _ = writeln!(out, "{}<{joint}/>", indent(depth));
                    }
                    joints.iter().for_each(|joint| self.add_joint(joint, depth, &mut out));
                    if let Some(inertial) = &link.inertial {
                        _ = writeln!(out, "{}<inertial{}/>", indent(depth), of_inertial(inertial));
                    }
                    self.add_sites(link, depth, &mut out);
                    open.push(BodyStep::End(element));
                    open.extend(self.on(link));
                }
            }
        }
        out + "  </worldbody>\n"
    }

    /// The bodies on a link, the first one last. Links in between that only carry joints are left out.
    fn on(&self, link: &'a WrittenLink) -> Vec<BodyStep<'a>> {
        let mut steps = Vec::new();
        for &first in self.0.joints(link).iter().rev() {
            let mut joints = vec![first];
            let mut last = first;
            while let Some(next) = self.further_joint(last) {
                joints.push(next);
                last = next;
            }
            if let Some(child) = self.0.link(&last.child.value) {
                steps.push(BodyStep::Body(child, joints));
            }
        }
        steps
    }

    /// The joint that stands in the same body as one before it.
    fn further_joint(&self, joint: &WrittenJoint) -> Option<&'a WrittenJoint> {
        let carrier = self.0.link(&joint.child.value).filter(|link| self.0.is_bare(link))?;
        let [next] = *self.0.joints(carrier) else { return None };
        let moves = |joint: &WrittenJoint| joint.kind.value.between_links().is_some();
        let is_there = pose(origin_of(next)).is_empty();
        (is_there && moves(joint) && moves(next)).then_some(next)
    }

    fn add_sites(&self, link: &WrittenLink, depth: usize, out: &mut String) {
        for frame in self.0.frames(link) {
            let name = attribute("name", &frame.name.value);
            _ = writeln!(out, "{}<site{name}{}/>", indent(depth), pose(&frame.pose));
        }
    }

    fn add_joint(&self, joint: &WrittenJoint, depth: usize, out: &mut String) {
        let Placement::Anchored(AnchoredJoint { anchor, axis, .. }) = &joint.placement else { return };
        let (kind, limits, drive) = (joint.kind.value, &joint.limits, &joint.drive);
        let word = word_of(kind.between_links(), kind.has_range, Dialect::Mjcf).unwrap_or(kind.word);
        let mut text = attribute("name", &joint.name.value) + &attribute("type", word);
        if anchor.value != [0.0; 3] {
            text += &attribute("pos", &numbers(&anchor.value));
        }
        if kind.has_axis() {
            text += &attribute("axis", &numbers(&axis.value));
        }
        if let (true, Some(lower), Some(upper)) = (kind.has_range, &limits.lower, &limits.upper) {
            if lower.value.is_finite() && upper.value.is_finite() {
                text += &attribute("range", &numbers(&[lower.value, upper.value]));
            }
        }
        if let Some(effort) = limits.effort.as_ref().filter(|effort| effort.value.is_finite()) {
            text += &attribute("actuatorfrcrange", &numbers(&[-effort.value, effort.value]));
        }
        let is_sprung = drive.spring_stiffness.as_ref().is_some_and(|stiffness| stiffness.value != 0.0);
        let rest = if is_sprung { &drive.spring_rest } else { &None };
        for (name, value) in [
            ("damping", &drive.damping),
            ("frictionloss", &drive.friction),
            ("armature", &drive.armature),
            ("stiffness", &drive.spring_stiffness),
            ("springref", rest),
        ] {
            text += &value.as_ref().map_or(String::new(), |value| attribute(name, &number(value.value)));
        }
        _ = writeln!(out, "{}<joint{text}/>", indent(depth));
    }
}

fn indent(depth: usize) -> String {
    "  ".repeat(depth)
}

/// A link that only carries others, fixed to a body, is a frame in it.
fn element_of(link: &WrittenLink, joints: &[&WrittenJoint]) -> &'static str {
    let is_fixed = matches!(joints, [joint] if joint.kind.value.between_links().is_none());
    match is_fixed && link.is_carrier && link.inertial.is_none() {
        true => "frame",
        false => "body",
    }
}

/// Pose of the body in the one that carries it.
fn origin_of(joint: &WrittenJoint) -> &WrittenPose {
    match &joint.placement {
        Placement::Anchored(AnchoredJoint { origin, .. }) | Placement::Frames { origin, .. } => origin,
        Placement::Vectors(_) => unreachable!("joints stand in the frames of links"),
    }
}

fn pose(pose: &WrittenPose) -> String {
    let position = match pose.xyz.value == [0.0; 3] {
        true => String::new(),
        false => attribute("pos", &numbers(&pose.xyz.value)),
    };
    position + &orientation(&pose.rotation)
}

fn orientation(rotation: &Rotation) -> String {
    match rotations::as_written(rotation) {
        Said::Nothing => String::new(),
        Said::Angles(angles) => attribute("euler", &numbers(&angles)),
        Said::Quaternion(q) => attribute("quat", &numbers(&q)),
    }
}

/// Three moments in any axes, or six numbers in those of the body: a full tensor in other axes is turned.
fn of_inertial(inertial: &WrittenInertial) -> String {
    let mut j = inertial.inertia.value;
    let is_diagonal = |j: &Sym3<f64>| [j.xy, j.xz, j.yz] == [0.0; 3];
    let mut turn = orientation(&inertial.rotation);
    if !is_diagonal(&j) && !turn.is_empty() {
        let turned = j.map(Dd::from).rotated(&angle::rotation(&inertial.rotation, ROUNDING));
        (j, turn) = (turned.map(Dd::to_f64), String::new());
    }
    let tensor = match is_diagonal(&j) {
        true => turn + &attribute("diaginertia", &numbers(&[j.xx, j.yy, j.zz])),
        false => attribute("fullinertia", &numbers(&[j.xx, j.yy, j.zz, j.xy, j.xz, j.yz])),
    };
    let (com, mass) = (numbers(&inertial.com.value), number(inertial.mass.value));
    attribute("pos", &com) + &attribute("mass", &mass) + &tensor
}
