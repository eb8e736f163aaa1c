//! SDF: links and frames, each with its pose in what carries it, and joints in the links that they move.
//!
//! What an SDF joint can say is one joint: links that only carry it or what stands on it are left out, and two joints in one place are `universal` or
//! `screw` where they are called so. A link without mass that is fixed to another one is a frame.

mod items;
pub(super) mod names;

use super::rotations::{self, Said};
use super::{attribute, escaped, losses, number, numbers, of_length_one, FormatWriter, JointForm, LoopForm};
use crate::description::{
    Description, JointLimits, Noted, WrittenCoupling, WrittenInertial, WrittenJoint, WrittenPose,
};
pub(super) use items::{carriers, links_as_frames};
use items::{ends_of, entries, parts_of, ClosingElement, JointElement, ModelItem, ModelTree, PosedOn};
use std::collections::HashMap;
use std::fmt::Write;
use straightline_core::spatial::Sym3;

/// Writes SDF.
pub static WRITER: FormatWriter = FormatWriter {
    word: "sdf",
    extensions: &["sdf", "world"],
    joints: JointForm::Anywhere,
    rotations: "roll, pitch and yaw in radians where IN has angles, quaternions (`quat_xyzw`) otherwise",
    frames_are_links: false,
    loops: LoopForm::AtZero,
    losses: &[
        &losses::ROTORS,
        &losses::DAMPED_BALLS,
        &losses::DAMPED_BASE,
        &losses::DRIVES,
        &losses::WELDED_LOOPS,
        &losses::HINGED_LOOPS_BESIDE_BALLS,
        &losses::LOOPS_OPEN_AT_ZERO,
        &losses::ASSEMBLIES,
        &losses::DETERMINED_JOINTS,
        &losses::FLEXIBLE_LINKS,
        &losses::ENDLESS_LIMITS,
        &losses::UNFIT_NAMES,
        &losses::BODIES_OF_MASS_ZERO,
        &losses::INERTIAS_OUT_OF_BOUNDS,
        &losses::MASS_OF_THE_WORLD,
        &losses::LOOPS_AS_JOINTS,
        &losses::CARRIERS_OF_OTHERS,
        &losses::LINKS_AS_FRAMES,
        &losses::SKIPPED,
    ],
    floats_by_option: false,
    text,
    edits: None,
};

/// The first version with quaternions, and that with `mimic`: older programs read what needs no more than the first.
const VERSIONS: [&str; 2] = ["1.9", "1.11"];
/// Gravity of a robot that says nothing of it \[m/s²\].
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

fn text(robot: &Description) -> String {
    let tree = ModelTree::of(robot);
    let couplings = tree.couplings.clone();
    let (beside, items): (Vec<ModelItem>, Vec<ModelItem>) =
        tree.items().into_iter().partition(|item| matches!(item, ModelItem::Frame(_, PosedOn { on: None, .. })));
    let has_world = robot.gravity.is_some() || !beside.is_empty();
    let version = VERSIONS[usize::from(!robot.couplings.is_empty())];
    let mut out = XmlLines { text: "<?xml version=\"1.0\"?>\n".to_string(), depth: 0 };
    out.open(&format!("sdf{}", attribute("version", version)));
    if has_world {
        out.open("world name=\"default\"");
        out.line("gravity", &numbers(&robot.gravity.as_ref().map_or(GRAVITY, |gravity| gravity.value)));
        beside.iter().for_each(|item| out.add_item(item, &couplings, &HashMap::new()));
    }
    out.open(&format!("model{}", attribute("name", &robot.name.value)));
    let mut leaders = HashMap::new();
    for item in &items {
        if let ModelItem::Joint(joint) = item {
            let JointElement { name, parts, .. } = &**joint;
            leaders.extend(parts.iter().enumerate().map(|(k, part)| (&*part.name.value, (&**name, AXES[k]))));
        }
    }
    items.iter().for_each(|item| out.add_item(item, &couplings, &leaders));
    out.close("model");
    if has_world {
        out.close("world");
    }
    out.close("sdf");
    out.text
}

/// The axes of a joint.
const AXES: [&str; 2] = ["axis", "axis2"];

/// XML, each line as deep as the elements around it.
struct XmlLines {
    text: String,
    depth: usize,
}

impl XmlLines {
    fn push(&mut self, line: &str) {
        _ = writeln!(self.text, "{}{line}", "  ".repeat(self.depth));
    }

    fn open(&mut self, element: &str) {
        self.push(&format!("<{element}>"));
        self.depth += 1;
    }

    fn close(&mut self, name: &str) {
        self.depth -= 1;
        self.push(&format!("</{name}>"));
    }

    /// An element with a text.
    fn line(&mut self, name: &str, value: &str) {
        self.push(&format!("<{name}>{value}</{name}>"));
    }

    /// Elements with a number each; nothing where all are left out.
    fn group(&mut self, name: &str, values: &[(&str, Option<f64>)]) {
        if values.iter().any(|(_, value)| value.is_some()) {
            self.open(name);
            for (name, value) in values {
                value.iter().for_each(|value| self.line(name, &number(*value)));
            }
            self.close(name);
        }
    }

    /// A pose; nothing where frames coincide and the file says in which one.
    fn pose(&mut self, pose: &WrittenPose, relative_to: Option<&str>) {
        let relative_to = relative_to.map_or(String::new(), |name| attribute("relative_to", name));
        let WrittenPose { xyz, rotation } = pose;
        let (format, turn) = match rotations::as_written(rotation) {
            Said::Nothing if xyz.value == [0.0; 3] => {
                if !relative_to.is_empty() {
                    self.push(&format!("<pose{relative_to}/>"));
                }
                return;
            }
            Said::Nothing => ("", numbers(&[0.0; 3])),
            Said::Angles(angles) => ("", numbers(&angles)),
            Said::Quaternion(q) => {
                let [w, x, y, z] = rotations::unit_quaternion(q);
                (" rotation_format=\"quat_xyzw\"", numbers(&[x, y, z, w]))
            }
        };
        self.push(&format!("<pose{relative_to}{format}>{} {turn}</pose>", numbers(&xyz.value)));
    }

    fn add_item(
        &mut self,
        item: &ModelItem,
        couplings: &HashMap<&str, &WrittenCoupling>,
        leaders: &HashMap<&str, (&str, &str)>,
    ) {
        match item {
            ModelItem::Link(link, at) => {
                self.open(&format!("link{}", attribute("name", &link.name.value)));
                self.pose(&at.pose(), at.on);
                self.add_inertial(link.inertial.as_ref());
                self.close("link");
            }
            ModelItem::Frame(name, at) => {
                let on = at.on.map_or(String::new(), |on| attribute("attached_to", on));
                self.open(&format!("frame{}{on}", attribute("name", name)));
                self.pose(&at.pose(), None);
                self.close("frame");
            }
            ModelItem::Joint(joint) => {
                self.open(&format!("joint{}{}", attribute("name", &joint.name), attribute("type", joint.word)));
                self.pose(&joint.pose, None);
                self.line("parent", &joint.parent.map_or("world".to_string(), escaped));
                self.line("child", &escaped(joint.child));
                joint.pitch.iter().for_each(|pitch| self.line("screw_thread_pitch", &number(*pitch)));
                let with_axis = joint.parts.iter().filter(|part| part.kind.value.has_axis());
                for (part, name) in with_axis.zip(AXES) {
                    let coupling = couplings.get(part.name.value.as_str());
                    self.add_axis(name, part, coupling.and_then(|own| Some((*own, *leaders.get(&*own.source.value)?))));
                }
                self.close("joint");
            }
            ModelItem::Closing(closing) => self.add_closing(closing),
        }
    }

    /// A joint that closes a loop, in the frame of its child.
    fn add_closing(&mut self, closing: &ClosingElement) {
        let ClosingElement { name, word, parent, child, axis } = closing;
        self.open(&format!("joint{}{}", attribute("name", name), attribute("type", word)));
        self.line("parent", &parent.map_or("world".to_string(), escaped));
        self.line("child", &escaped(child));
        if let Some(axis) = axis {
            self.open(AXES[0]);
            self.line("xyz", &numbers(&of_length_one(*axis)));
            self.close(AXES[0]);
        }
        self.close("joint");
    }

    /// Mass, centre of mass and inertia; zeros where there is none, as the format takes what is left out for 1 kg and 1 kg·m².
    fn add_inertial(&mut self, inertial: Option<&WrittenInertial>) {
        self.open("inertial");
        if let Some(WrittenInertial { com, rotation, .. }) = inertial {
            self.pose(&WrittenPose { xyz: com.clone(), rotation: rotation.clone() }, None);
        }
        let (mass, inertia) = inertial.map_or((0.0, Sym3::zero()), |own| (own.mass.value, own.inertia.value));
        self.line("mass", &number(mass));
        self.group("inertia", &entries(&inertia).map(|(name, x)| (name, Some(x))));
        self.close("inertial");
    }

    /// An axis with the limits and what acts along it; what it follows, with the joint and axis of that.
    fn add_axis(&mut self, name: &str, joint: &WrittenJoint, follows: Option<(&WrittenCoupling, (&str, &str))>) {
        let Some((_, _, xyz)) = parts_of(joint) else { return };
        self.open(name);
        self.line("xyz", &numbers(&of_length_one(xyz)));
        let limit =
            |limit: &Option<Noted<f64>>| limit.as_ref().map(|limit| limit.value).filter(|x| JointLimits::is_limit(*x));
        let [lower, upper] = ends_of(joint);
        let greatest = [("effort", limit(&joint.limits.effort)), ("velocity", limit(&joint.limits.velocity))];
        self.group("limit", &[lower, upper, greatest[0], greatest[1]]);
        let drive = &joint.drive;
        let value = |value: &Option<Noted<f64>>| value.as_ref().map(|value| value.value);
        let stiffness = value(&drive.spring_stiffness).filter(|stiffness| *stiffness != 0.0);
        let rest = stiffness.map(|_| value(&drive.spring_rest).unwrap_or(0.0));
        let (damping, friction) = (("damping", value(&drive.damping)), ("friction", value(&drive.friction)));
        self.group("dynamics", &[damping, friction, ("spring_reference", rest), ("spring_stiffness", stiffness)]);
        if let Some((coupling, (leader, axis))) = follows {
            let axis = if axis == AXES[0] { String::new() } else { attribute("axis", axis) };
            self.open(&format!("mimic{}{axis}", attribute("joint", leader)));
            self.line("multiplier", &number(coupling.ratio.value));
            self.line("offset", &number(coupling.offset.value));
            self.line("reference", &number(0.0));
            self.close("mimic");
        }
        self.close(name);
    }
}
