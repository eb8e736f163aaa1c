//! What an SDF of a robot holds: links, frames and joints in their order, as the format has them.

use crate::description::angle::{transform, ROUNDING};
use crate::description::geometry::{compose, vector};
use crate::description::reader::FreeNames;
use crate::description::write::{pose_of, word_of, OnLinks};
use crate::description::{
    AnchoredJoint, ClosingJoint, Description, JointLimits, LoopPoints, Noted, Placement, WrittenCoupling,
    WrittenInertial, WrittenJoint, WrittenLink, WrittenPose,
};
use crate::diagnostic::Place;
use std::collections::{HashMap, HashSet};
use std::f64::consts::TAU;
use straightline_core::joint::{Dialect, JointKind, KINDS};
use straightline_core::spatial::{Mat3, Sym3, Transform};
use straightline_core::Dd;

/// The links that a robot has as frames alone.
pub fn links_as_frames(robot: &Description) -> Vec<&WrittenLink> {
    let items = ModelTree::of(robot).items();
    let name = |item: &ModelItem| if let ModelItem::Frame(name, _) = item { Some(name.to_string()) } else { None };
    let names: HashSet<String> = items.iter().filter_map(name).collect();
    robot.links.iter().filter(|link| names.contains(&link.name.value)).collect()
}

/// The links that only carry joints, and are left as links.
pub fn carriers(robot: &Description) -> Vec<&WrittenLink> {
    let items = ModelTree::of(robot).items().into_iter();
    let links = items.filter_map(|item| if let ModelItem::Link(link, _) = item { Some(link) } else { None });
    links.filter(|link| link.is_carrier).collect()
}

/// An element of a model.
pub enum ModelItem<'a> {
    Link(&'a WrittenLink, PosedOn<'a>),
    Frame(&'a str, PosedOn<'a>),
    Joint(Box<JointElement<'a>>),
    /// A joint that closes a loop.
    Closing(ClosingElement<'a>),
}

/// A joint that closes a loop: between two links or frames.
pub struct ClosingElement<'a> {
    pub name: &'a str,
    pub word: &'static str,
    /// The link or frame that carries it; `None`: the world.
    pub parent: Option<&'a str>,
    pub child: &'a str,
    /// Of a hinge, in the axes of the child.
    pub axis: Option<[f64; 3]>,
}

/// Where something stands: on a link or frame that is written, or in the world, by poses one after the other.
#[derive(Clone)]
pub struct PosedOn<'a> {
    /// The link or frame; `None`: the world.
    pub on: Option<&'a str>,
    poses: Vec<&'a WrittenPose>,
}

/// A joint, with the single joints that it is read as.
pub struct JointElement<'a> {
    pub name: String,
    pub word: &'static str,
    /// The link or frame that carries it; `None`: the world.
    pub parent: Option<&'a str>,
    pub child: &'a str,
    /// In the frame of the child.
    pub pose: WrittenPose,
    /// Of each axis, in the axes of the joint.
    pub parts: Vec<&'a WrittenJoint>,
    /// How far a screw slides \[m per turn\].
    pub pitch: Option<f64>,
}

/// How a joint moves.
struct JointMotion<'a> {
    name: String,
    word: &'static str,
    parts: Vec<&'a WrittenJoint>,
    pitch: Option<f64>,
    /// The single joint that moves the child.
    last: &'a WrittenJoint,
}

impl<'a> PosedOn<'a> {
    fn at(name: &'a str) -> PosedOn<'a> {
        PosedOn { on: Some(name), poses: Vec::new() }
    }

    fn then(&self, poses: impl IntoIterator<Item = &'a WrittenPose>) -> PosedOn<'a> {
        PosedOn { on: self.on, poses: self.poses.iter().copied().chain(poses).collect() }
    }

    /// The pose that they are together: that of the file where the others are none.
    pub fn pose(&self) -> WrittenPose {
        let mut moving = self.poses.iter().filter(|pose| !pose.is_identity());
        match (moving.next(), moving.next()) {
            (None, _) => WrittenPose::identity(Place::none()),
            (Some(one), None) => (*one).clone(),
            _ => pose_of(&product(&self.poses)),
        }
    }
}

fn product(poses: &[&WrittenPose]) -> Transform<Dd> {
    poses.iter().fold(Transform::identity(), |before, pose| compose(&before, &transform(pose, ROUNDING)))
}

/// Pose of the child in the parent's frame, and the joint and its axis in the child's frame.
pub fn parts_of(joint: &WrittenJoint) -> Option<(&WrittenPose, [f64; 3], [f64; 3])> {
    match &joint.placement {
        Placement::Frames { origin, axis } => Some((origin, [0.0; 3], axis.value)),
        Placement::Anchored(AnchoredJoint { origin, anchor, axis, reference: None }) => {
            Some((origin, anchor.value, axis.value))
        }
        _ => None,
    }
}

fn moves(joint: &WrittenJoint) -> bool {
    joint.kind.value.between_links().is_some()
}

fn has_no_mass(link: &WrittenLink) -> bool {
    let is_zero =
        |own: &WrittenInertial| own.mass.value == 0.0 && entries(&own.inertia.value).iter().all(|(_, x)| *x == 0.0);
    link.inertial.as_ref().is_none_or(is_zero)
}

/// A robot as links stand on each other, with what follows.
pub struct ModelTree<'a> {
    on: OnLinks<'a>,
    /// What a joint follows.
    pub couplings: HashMap<&'a str, &'a WrittenCoupling>,
    /// The joints that others follow.
    leaders: HashSet<&'a str>,
    /// Names of links, joints and frames.
    names: FreeNames,
}

impl<'a> ModelTree<'a> {
    pub fn of(robot: &'a Description) -> ModelTree<'a> {
        let mut names = FreeNames::default();
        names.take(robot.links.iter().map(|link| link.name.value.clone()));
        names.take(robot.joints.iter().map(|joint| joint.name.value.clone()));
        names.take(robot.frames.iter().map(|frame| frame.name.value.clone()));
        let mut tree = ModelTree { on: OnLinks::of(robot), couplings: HashMap::new(), leaders: HashSet::new(), names };
        for coupling in &robot.couplings {
            tree.couplings.insert(&coupling.joint.value, coupling);
            tree.leaders.insert(&coupling.source.value);
        }
        tree
    }

    /// Everything depth first, the joints of a link in their order: so bodies come back in theirs, whatever becomes of the links between.
    pub fn items(mut self) -> Vec<ModelItem<'a>> {
        let mut items = Vec::new();
        let Some(root) = self.on.robot.root() else { return items };
        let mut at = PosedOn { on: None, poses: Vec::new() };
        if self.on.robot.ground().is_none() {
            items.push(ModelItem::Link(root, at));
            at = PosedOn::at(&root.name.value);
            if !self.on.robot.floats() {
                let name = self.names.made_up(&format!("{}_fixed", root.name.value));
                items.push(ModelItem::Joint(JointElement::fixed(name, None, &root.name.value)));
            }
        }
        let mut open = Vec::new();
        self.add_on(root, &at, &mut open, &mut items);
        while let Some((joint, at)) = open.pop() {
            let added = match moves(joint) {
                true => self.add_moving(joint, at, &mut items),
                false => self.add_fixed(joint, at, &mut items),
            };
            if let Some((link, at)) = added {
                self.add_on(link, &at, &mut open, &mut items);
            }
        }
        self.add_closing(&mut items);
        items
    }

    /// Adds the joints that close loops, after those that carry.
    fn add_closing(&self, items: &mut Vec<ModelItem<'a>>) {
        let robot = self.on.robot;
        let of_world = |item: &ModelItem<'a>| match item {
            ModelItem::Frame(name, PosedOn { on: None, .. }) => Some(*name),
            _ => None,
        };
        let mut of_world: HashSet<&str> = items.iter().filter_map(of_world).collect();
        of_world.extend(robot.ground().map(|ground| ground.name.value.as_str()));
        for own in &robot.loops {
            let LoopPoints::Anchor { links: [Some(one), Some(other)], .. } = &own.points else {
                unreachable!("loops close where coordinates are zero")
            };
            let [one, other] = [one, other].map(|end| end.value.as_str());
            let (child, parent) = if of_world.contains(one) { (other, one) } else { (one, other) };
            let axis = if let ClosingJoint::Revolute(axis) = &own.joint { Some(axis.value) } else { None };
            // a hinge or a ball joint
            let is_meant = |kind: &JointKind| match axis {
                Some(_) => kind.is_single() && kind.turns() && !kind.slides(),
                None => !kind.is_single() && !kind.is_base(),
            };
            let kind = KINDS.iter().copied().find(is_meant);
            let word = word_of(kind, false, Dialect::Sdf).expect("the format has balls and hinges");
            let parent = Some(parent).filter(|parent| !of_world.contains(parent));
            items.push(ModelItem::Closing(ClosingElement { name: &own.name.value, word, parent, child, axis }));
        }
    }

    /// Adds the frames on a link, and its joints to what is still to be added.
    fn add_on(
        &self,
        link: &WrittenLink,
        at: &PosedOn<'a>,
        open: &mut Vec<(&'a WrittenJoint, PosedOn<'a>)>,
        items: &mut Vec<ModelItem<'a>>,
    ) {
        for frame in self.on.frames(link) {
            items.push(ModelItem::Frame(&frame.name.value, at.then([&frame.pose])));
        }
        open.extend(self.on.joints(link).iter().rev().map(|joint| (*joint, at.clone())));
    }

    /// Adds what a fixed joint carries; that link, and where it stands for what is on it.
    fn add_fixed(
        &self,
        joint: &'a WrittenJoint,
        carrier: PosedOn<'a>,
        items: &mut Vec<ModelItem<'a>>,
    ) -> Option<(&'a WrittenLink, PosedOn<'a>)> {
        let link = self.on.link(&joint.child.value)?;
        let at = carrier.then(parts_of(joint).map(|(origin, ..)| origin));
        if link.is_carrier && link.inertial.is_none() {
            return Some((link, at));
        }
        let name = link.name.value.as_str();
        // a frame of the model stands on a link
        match has_no_mass(link) && carrier.on.is_some() {
            true => items.push(ModelItem::Frame(name, at)),
            false => {
                items.push(ModelItem::Link(link, at));
                items.push(ModelItem::Joint(JointElement::fixed(joint.name.value.clone(), carrier.on, name)));
            }
        }
        Some((link, PosedOn::at(name)))
    }

    /// Adds a joint that moves, with the next one where both are one joint of the format, and the link that it moves.
    fn add_moving(
        &mut self,
        first: &'a WrittenJoint,
        carrier: PosedOn<'a>,
        items: &mut Vec<ModelItem<'a>>,
    ) -> Option<(&'a WrittenLink, PosedOn<'a>)> {
        let JointMotion { name, word, parts, pitch, last } = self.motion(first);
        let mut link = self.on.link(&last.child.value)?;
        let mut behind: Vec<&WrittenPose> = Vec::new();
        while let Some((fixed, next)) = self.link_behind(link) {
            behind.extend(parts_of(fixed).map(|(origin, ..)| origin));
            link = next;
        }
        let (origin, anchor) = match parts_of(first) {
            Some((origin, anchor, _)) => (Some(origin), anchor),
            None => (None, [0.0; 3]),
        };
        let child = link.name.value.as_str();
        let pose = place_in_child(anchor, &behind);
        let parent = carrier.on;
        items.push(ModelItem::Link(link, carrier.then(origin.into_iter().chain(behind))));
        items.push(ModelItem::Joint(Box::new(JointElement { name, word, parent, child, pose, parts, pitch })));
        Some((link, PosedOn::at(child)))
    }

    /// The link that is fixed on one that only carries it.
    fn link_behind(&self, link: &WrittenLink) -> Option<(&'a WrittenJoint, &'a WrittenLink)> {
        match *self.on.joints(link) {
            [joint] if self.on.is_bare(link) && !moves(joint) => Some((joint, self.on.link(&joint.child.value)?)),
            _ => None,
        }
    }

    /// The joint that stands in the place of one, on a link that only carries it.
    fn in_one_place(&self, first: &WrittenJoint) -> Option<&'a WrittenJoint> {
        let [second] = *self.on.joints(self.on.link(&first.child.value).filter(|link| self.on.is_bare(link))?) else {
            return None;
        };
        let (_, anchor, _) = parts_of(first)?;
        let (origin, own, _) = parts_of(second)?;
        (moves(second) && origin.is_identity() && own == anchor).then_some(second)
    }

    /// What a joint is in the format, with the next one where both are one.
    fn motion(&mut self, first: &'a WrittenJoint) -> JointMotion<'a> {
        let kind = |joint: &WrittenJoint| joint.kind.value.between_links();
        let turns = |joint: &WrittenJoint| kind(joint).is_some_and(|kind| kind.is_single() && kind.turns());
        let slides = |joint: &WrittenJoint| kind(joint).is_some_and(|kind| kind.is_single() && kind.slides());
        let name = &first.name.value;
        let second = self.in_one_place(first).filter(|_| turns(first));
        if let Some(second) = second.filter(|second| turns(second)) {
            if let Some(whole) = name.strip_suffix("_1") {
                let is_second = second.name.value.strip_suffix("_2") == Some(whole);
                if is_second && !whole.is_empty() && self.names.made_up(whole) == whole {
                    let parts = vec![first, second];
                    let name = whole.to_string();
                    return JointMotion { name, word: "universal", parts, pitch: None, last: second };
                }
            }
        }
        let (name, parts) = (name.clone(), vec![first]);
        for slide in second.into_iter().filter(|second| slides(second)) {
            if let Some(pitch) = self.pitch(first, slide) {
                return JointMotion { name, word: "screw", parts, pitch: Some(pitch), last: slide };
            }
        }
        let is_ranged = first.kind.value.has_range && ends_of(first).iter().any(|(_, end)| end.is_some());
        let word = word_of(kind(first), is_ranged, Dialect::Sdf).unwrap_or(first.kind.value.word);
        JointMotion { name, word, parts, pitch: None, last: first }
    }

    /// How far a screw slides per turn: P with P/2π the ratio of slide and turn, where an f64 is that.
    fn pitch(&self, turn: &WrittenJoint, slide: &WrittenJoint) -> Option<f64> {
        let (_, _, axis) = parts_of(turn)?;
        let (_, _, along) = parts_of(slide)?;
        let coupling = self.couplings.get(slide.name.value.as_str())?;
        let is_screw = axis == along
            && slide.name.value.strip_suffix("_slide") == Some(&turn.name.value)
            && coupling.source.value == turn.name.value
            && coupling.offset.value == 0.0
            && slide.of_one_coordinate().is_empty()
            && !self.leaders.contains(slide.name.value.as_str());
        let near = (coupling.ratio.value * TAU).to_bits();
        let candidates = [near, near.wrapping_add(1), near.wrapping_sub(1)].map(f64::from_bits);
        candidates.into_iter().find(|pitch| is_screw && pitch / TAU == coupling.ratio.value)
    }
}

/// The joint in the frame of its child, which stands behind it by fixed joints.
fn place_in_child(anchor: [f64; 3], behind: &[&WrittenPose]) -> WrittenPose {
    let anchored = WrittenPose { xyz: Noted::assumed(anchor), ..WrittenPose::identity(Place::none()) };
    match behind.iter().all(|pose| pose.is_identity()) {
        true => anchored,
        false => {
            let at_anchor = Transform { rotation: Mat3::identity(), translation: vector(anchor) };
            pose_of(&compose(&product(behind).inverse(), &at_anchor))
        }
    }
}

impl<'a> JointElement<'a> {
    fn fixed(name: String, parent: Option<&'a str>, child: &'a str) -> Box<JointElement<'a>> {
        let pose = WrittenPose::identity(Place::none());
        Box::new(JointElement { name, word: "fixed", parent, child, pose, parts: Vec::new(), pitch: None })
    }
}

/// The ends of a range, as far as it has them.
pub fn ends_of(joint: &WrittenJoint) -> [(&'static str, Option<f64>); 2] {
    let end = |limit: &Option<Noted<f64>>| {
        limit.as_ref().map(|limit| limit.value).filter(|x| joint.kind.value.has_range && JointLimits::is_limit(*x))
    };
    [("lower", end(&joint.limits.lower)), ("upper", end(&joint.limits.upper))]
}

/// The entries of a tensor.
pub fn entries(j: &Sym3<f64>) -> [(&'static str, f64); 6] {
    [("ixx", j.xx), ("ixy", j.xy), ("ixz", j.xz), ("iyy", j.yy), ("iyz", j.yz), ("izz", j.zz)]
}
