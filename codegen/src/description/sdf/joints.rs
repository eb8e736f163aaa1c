//! Joints: between two links, wherever they stand in either, along axes that are given in any frame.

use super::axes::SdfAxis;
use super::chains::push;
use super::couplings::TurningJoint;
use super::frames::{FrameKind, WORLD};
use super::poses::PoseStep;
use super::Sdf;
use crate::description::composite::{CompositeKind, PartAxis};
use crate::description::reader::Range64;
use crate::description::xml::{children, tag};
use crate::description::{messages, JointType, Noted, Placement, WrittenCoupling, WrittenJoint, WrittenLink};
use roxmltree::Node;
use std::collections::HashMap;
use std::f64::consts::TAU;
use straightline_core::joint::Dialect;

/// The word for what couples joints and is none.
const GEARBOX: &str = "gearbox";

/// A joint as it is written.
pub(super) struct SdfJoint<'d, 'i> {
    pub frame: usize,
    pub name: Noted<String>,
    /// `None` of a gearbox.
    pub kind: Option<Noted<JointType>>,
    /// The link or world that carries it, and the link that it moves.
    pub bodies: [usize; 2],
    pub axes: Vec<SdfAxis<'d, 'i>>,
    /// What it slides by \[m/rad\].
    pub pitch: f64,
}

/// One of the single joints that a joint is read as.
struct JointPart {
    name: Noted<String>,
    kind: JointType,
    /// Which axis it has.
    axis: usize,
    /// Whether limits and dynamics of the axis are its own.
    is_driven: bool,
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// The frame that a joint names as its parent or child; `None` after a complaint.
    pub fn end_of(&mut self, joint: usize, end: &str) -> Option<usize> {
        let (element, scope, owner) = (self.frames[joint].element, self.frames[joint].scope, self.owner_of(joint));
        let Some(found) = children(element).find(|child| child.tag_name().name() == end) else {
            let example = format!("<{end}>...</{end}>");
            self.complain(&tag(element), messages::missing_element(&owner, end, &example));
            return None;
        };
        let name = self.text(found);
        if name.0.is_empty() {
            self.complain(&name.1, messages::empty_name(end));
            return None;
        }
        if name.0 == "world" && end == "parent" {
            return Some(WORLD);
        }
        self.frame_named(scope, name, &format!("{end} of {owner}"))
    }

    /// Reads the joints that are not between things that stand.
    pub fn read_joints(&mut self) -> Vec<SdfJoint<'d, 'i>> {
        let mut joints = Vec::new();
        let mut moving = self.frames_of(FrameKind::Joint);
        moving.retain(|frame| !self.frames[*frame].is_static);
        for frame in moving {
            let joint = self.read_joint(frame);
            self.robot.has_holes |= joint.is_none();
            joints.extend(joint);
        }
        joints
    }

    fn read_joint(&mut self, frame: usize) -> Option<SdfJoint<'d, 'i>> {
        let (element, name, owner) =
            (self.frames[frame].element, self.frames[frame].name.clone(), self.owner_of(frame));
        let [_, _, _, first, second, pitch, old_pitch, _, _, physics] = self.pick(
            &owner,
            element,
            [
                "parent",
                "child",
                "pose",
                "axis",
                "axis2",
                "screw_thread_pitch",
                "thread_pitch",
                "gearbox_ratio",
                "gearbox_reference_body",
                "physics",
            ],
        );
        if let Some(physics) = physics {
            self.check_engine(physics, &owner);
            self.reader.ignore("physics", &tag(physics));
        }
        let kind = self.kind(element, &owner)?;
        let bodies = ["parent", "child"].map(|end| self.end_of(frame, end).map(|end| self.frames[end].body));
        let composite = kind.as_ref().and_then(|kind| kind.value.composite).map(|composite| composite.of);
        let has_axis = kind.as_ref().is_none_or(|kind| kind.value.has_axis());
        let has_second = kind.is_none() || composite.is_some_and(|composite| composite.has_second_axis);
        let moves = kind.as_ref().is_none_or(|kind| kind.value != JointType::FIXED);
        let mut axes = Vec::new();
        for (axis, name, is_needed) in [(first, "axis", has_axis), (second, "axis2", has_second)] {
            match axis {
                Some(axis) if is_needed => axes.push(self.read_axis(axis, frame, &owner)),
                // the format knows no property of a ball joint but where it stands
                Some(axis) if moves && name == "axis" => self.reader.ignore("axis of a ball joint", &tag(axis)),
                None if is_needed => {
                    let example = format!("<{name}><xyz>0 0 1</xyz></{name}>");
                    self.complain(&tag(element), messages::missing_element(&owner, name, &example));
                    return None;
                }
                _ => {}
            }
        }
        let has_pitch = composite.is_some_and(|composite| composite.has_pitch);
        let pitch = if has_pitch { self.pitch(element, pitch, old_pitch, &owner)? } else { 0.0 };
        let [parent, child] = bodies;
        Some(SdfJoint { frame, name, kind, bodies: [parent?, child?], axes, pitch })
    }

    /// How a joint moves; `Some(None)` of a gearbox.
    fn kind(&mut self, element: Node<'d, 'i>, owner: &str) -> Option<Option<Noted<JointType>>> {
        let Some((word, span)) = self.attribute(element, "type") else {
            let example = "<joint name=\"...\" type=\"revolute\">";
            self.complain(&tag(element), messages::missing_attribute(owner, "type", example));
            return None;
        };
        let words = JointType::words(Dialect::Sdf).into_iter().map(|(word, kind)| (word, Some(kind)));
        let words: Vec<(&str, Option<JointType>)> = words.chain([(GEARBOX, None)]).collect();
        let written = self.reader.value(word.to_string(), &span);
        let kind = self.reader.word(&format!("type of {owner}"), &written, &words)?;
        Some(kind.map(|kind| self.reader.value(kind, &span)))
    }

    /// How far a screw slides \[m/rad\]: P/2π with P in m per revolution of a right-handed thread, or −1/p with p in rad/m of a left-handed one.
    fn pitch(
        &mut self,
        element: Node<'d, 'i>,
        pitch: Option<Node<'d, 'i>>,
        old: Option<Node<'d, 'i>>,
        owner: &str,
    ) -> Option<f64> {
        if let Some(pitch) = pitch {
            let value = self.number_in(Some(pitch), owner)?.value / TAU;
            if value == 0.0 {
                let why = "a thread without pitch does not slide";
                self.refuse(pitch, owner, why, "write type `revolute`, or a pitch in m per revolution");
                return None;
            }
            return Some(value);
        }
        let Some(old) = old else {
            let example = "<screw_thread_pitch>0.005</screw_thread_pitch>";
            self.complain(&tag(element), messages::missing_element(owner, "screw_thread_pitch", example));
            return None;
        };
        let pitch = self.number(old, &format!("thread_pitch of {owner}"), Range64::Finite)?;
        if pitch.value.abs() < 1e-60 {
            let why = "no angle per metre is no thread";
            self.refuse(old, owner, why, "write `<screw_thread_pitch>`, in m per revolution");
            return None;
        }
        Some(-1.0 / pitch.value)
    }

    /// Adds the joints to the robot; whether one of them stands on the world.
    pub fn add_joints(&mut self, joints: Vec<SdfJoint<'d, 'i>>) -> bool {
        let [joints, closing] = self.carrying(joints);
        let has_world = joints.iter().any(|joint| joint.kind.is_some() && joint.bodies[0] == WORLD);
        let place = self.frames[self.model].name.place.clone();
        let world = Noted::new(self.names.made_up("world"), place);
        if has_world {
            self.robot.links.insert(0, WrittenLink { name: world.clone(), inertial: None, is_carrier: false });
        }
        self.frames[WORLD].name = world;
        let mut moved: HashMap<usize, Noted<String>> = HashMap::new();
        for joint in &joints {
            let Some(kind) = &joint.kind else { continue };
            let [parent, child] = joint.bodies;
            if child == WORLD {
                if parent != WORLD {
                    let owner = self.owner_of(joint.frame);
                    let help = "exchange `<parent>` and `<child>`, and turn the axis round";
                    let complaint = messages::not_supported_yet(&owner, "child", "its child does not move", help);
                    self.complain(&joint.name.place.span, complaint);
                }
                continue;
            }
            if let Some(first) = moved.get(&child) {
                let link = &self.frames[child].name.value;
                let complaint = messages::two_parents(link, &first.value, &joint.name.value);
                let complaint = complaint.related(&first.place, "the other joint");
                self.complain(&joint.name.place.span, complaint);
                self.robot.has_holes = true;
                continue;
            }
            moved.insert(child, joint.name.clone());
            match kind.value == JointType::FIXED {
                true => self.add_weld(joint, kind),
                false => self.add_moving(joint, kind),
            }
        }
        for joint in &closing {
            let first = moved.get(&joint.bodies[1]).cloned().unwrap_or_else(|| joint.name.clone());
            self.add_closing(joint, &first);
        }
        for joint in &joints {
            self.add_couplings(joint);
        }
        has_world
    }

    /// Adds a fixed joint of the file.
    fn add_weld(&mut self, joint: &SdfJoint<'d, 'i>, kind: &Noted<JointType>) {
        let [parent, child] = joint.bodies;
        let pieces = self.pieces(parent, child);
        let (link, origin) = self.add_chain(self.frames[parent].name.clone(), pieces, &joint.name);
        let child = self.frames[child].name.clone();
        let fixed = WrittenJoint::fixed(joint.name.clone(), link, child, origin);
        self.robot.joints.push(WrittenJoint { kind: kind.clone(), ..fixed });
    }

    /// Adds a joint that moves, part after part: to the axes of a part, the part, and at last to the frame of the child.
    fn add_moving(&mut self, joint: &SdfJoint<'d, 'i>, kind: &Noted<JointType>) {
        let [parent, child] = joint.bodies;
        let mut link = self.frames[parent].name.clone();
        let mut pieces = self.pieces(parent, joint.frame);
        let mut at = joint.frame;
        let parts = self.parts(joint, kind.value);
        let last = parts.len() - 1;
        for (k, part) in parts.into_iter().enumerate() {
            let axis = joint.axes.get(part.axis);
            let in_frame = axis.filter(|_| kind.value.has_axis()).map_or(at, |axis| axis.frame);
            self.push_turn(&mut pieces, at, in_frame);
            at = in_frame;
            let (carrier, origin) = self.add_chain(link, pieces, &joint.name);
            pieces = Vec::new();
            if k == last {
                self.push_turn(&mut pieces, at, joint.frame);
                for pose in self.path(joint.frame, child).iter().flat_map(PoseStep::poses) {
                    push(&mut pieces, pose);
                }
            }
            link = match k == last && pieces.is_empty() {
                true => self.frames[child].name.clone(),
                false => self.add_carrier(&joint.name),
            };
            let driven = axis.filter(|_| part.is_driven);
            let direction = axis.map_or(Noted::new([0.0, 0.0, 1.0], joint.name.place.clone()), |axis| axis.xyz.clone());
            if let Some(axis) = axis.filter(|_| last == 0 && part.kind.kind.is_some_and(|kind| kind.turns())) {
                let (name, axis) = (part.name.clone(), (axis.xyz.value, axis.frame));
                self.turning.push(TurningJoint { name, bodies: joint.bodies, axis });
            }
            self.robot.joints.push(WrittenJoint {
                name: part.name,
                kind: Noted::new(part.kind, kind.place.clone()),
                parent: carrier,
                child: link.clone(),
                placement: Placement::Frames { origin, axis: direction },
                limits: driven.map(|axis| axis.limits.clone()).unwrap_or_default(),
                drive: driven.map(|axis| axis.drive.clone()).unwrap_or_default(),
            });
        }
        if !pieces.is_empty() {
            let (link, pose) = self.add_chain(link, pieces, &joint.name);
            self.add_fixed(link, self.frames[child].name.clone(), pose);
        }
    }

    /// The single joints that a joint is read as.
    fn parts(&mut self, joint: &SdfJoint<'d, 'i>, kind: JointType) -> Vec<JointPart> {
        let ranged = |kind: JointType, axis: usize| {
            let limits = joint.axes.get(axis).map(|axis| &axis.limits);
            let has_range = limits.is_some_and(|limits| limits.lower.is_some() || limits.upper.is_some());
            JointType { has_range, ..kind }
        };
        let Some(composite) = kind.composite else {
            let is_ranged = kind.has_range;
            let kind = if is_ranged { ranged(kind, 0) } else { kind };
            return vec![JointPart { name: joint.name.clone(), kind, axis: 0, is_driven: true }];
        };
        let CompositeKind { parts, has_pitch, .. } = *composite.of;
        let parts = parts.iter().enumerate().map(|(k, part)| {
            let axis = usize::from(matches!(part.along, PartAxis::SecondAxis));
            let is_driven = !has_pitch || k == 0;
            let kind = JointType::free_along(part.measure);
            let kind = if is_driven { ranged(kind, axis) } else { kind };
            JointPart { name: part_name(&joint.name, part.suffix), kind, axis, is_driven }
        });
        let parts: Vec<JointPart> = parts.collect();
        if let (true, [turn, slide]) = (has_pitch, &parts[..]) {
            let place = joint.name.place.clone();
            self.robot.couplings.push(WrittenCoupling {
                joint: slide.name.clone(),
                source: turn.name.clone(),
                ratio: Noted::new(joint.pitch, place.clone()),
                offset: Noted::new(0.0, place),
            });
        }
        parts
    }
}

/// The name of a part of a joint.
pub(super) fn part_name(joint: &Noted<String>, suffix: &str) -> Noted<String> {
    match suffix {
        "" => joint.clone(),
        _ => Noted::new(format!("{}_{suffix}", joint.value), joint.place.clone()),
    }
}
