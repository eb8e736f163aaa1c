//! Joints that close loops: a link that is the child of several joints hangs on one of them, the others hold two links together that move already.
//!
//! Which joints carry is chosen so that ball joints close: their two points coincide, which is all that they ask for. A joint that carries the other way round
//! than it is written has its axis turned round, which keeps its coordinate.

use super::frames::WORLD;
use super::joints::SdfJoint;
use super::poses::PoseStep;
use super::Sdf;
use crate::description::{messages, ClosingJoint, JointType, LoopPoints, Noted, WrittenLink, WrittenLoop};
use std::collections::{HashMap, VecDeque};

impl SdfJoint<'_, '_> {
    fn is_fixed(&self) -> bool {
        self.kind.as_ref().is_some_and(|kind| kind.value == JointType::FIXED)
    }

    fn is_ball(&self) -> bool {
        let is_ball = |kind: &JointType| kind.between_links().is_some_and(|kind| !kind.is_single());
        self.kind.as_ref().is_some_and(|kind| is_ball(&kind.value))
    }

    fn is_hinge(&self) -> bool {
        let is_hinge = |kind: &JointType| kind.between_links().is_some_and(|kind| kind.is_single() && kind.turns());
        self.kind.as_ref().is_some_and(|kind| is_hinge(&kind.value))
    }
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// The joints that carry links, away from the root, and those that close loops; all carry if no link is the child of two.
    pub fn carrying(&mut self, joints: Vec<SdfJoint<'d, 'i>>) -> [Vec<SdfJoint<'d, 'i>>; 2] {
        let mut parents: HashMap<usize, usize> = HashMap::new();
        for joint in joints.iter().filter(|joint| joint.kind.is_some()) {
            *parents.entry(joint.bodies[1]).or_default() += 1;
        }
        if parents.contains_key(&WORLD) || parents.values().all(|count| *count < 2) {
            return [joints, Vec::new()];
        }
        let moves = |joint: &SdfJoint| joint.kind.is_some();
        let root = match joints.iter().any(|joint| moves(joint) && joint.bodies[0] == WORLD) {
            true => WORLD,
            false => {
                let mut carrying = joints.iter().filter(|joint| moves(joint)).map(|joint| joint.bodies[0]);
                let Some(root) = carrying.find(|body| !parents.contains_key(body)) else { return [joints, Vec::new()] };
                root
            }
        };
        let rank = |joint: &SdfJoint| if joint.is_fixed() { 0 } else { 1 + usize::from(joint.is_ball()) };
        let mut order: Vec<usize> = (0..joints.len()).filter(|k| moves(&joints[*k])).collect();
        order.sort_by_key(|k| rank(&joints[*k]));
        let mut group: HashMap<usize, usize> = HashMap::new();
        let mut closes = vec![false; joints.len()];
        for k in order {
            let [one, other] = joints[k].bodies.map(|body| *group.entry(body).or_insert(body));
            closes[k] = one == other;
            group.values_mut().filter(|own| **own == other).for_each(|own| *own = one);
        }
        let mut carry = Vec::new();
        let mut close = Vec::new();
        for (joint, closes) in joints.into_iter().zip(closes) {
            (if closes { &mut close } else { &mut carry }).push(joint);
        }
        self.turn_outwards(&mut carry, root);
        [carry, close]
    }

    /// Turns joints round that would carry towards the root.
    fn turn_outwards(&mut self, joints: &mut [SdfJoint<'d, 'i>], root: usize) {
        let mut reached = VecDeque::from([root]);
        let mut seen = vec![false; joints.len()];
        while let Some(body) = reached.pop_front() {
            for k in 0..joints.len() {
                let [parent, child] = joints[k].bodies;
                if seen[k] || joints[k].kind.is_none() || ![parent, child].contains(&body) {
                    continue;
                }
                seen[k] = true;
                reached.push_back(if parent == body { child } else { parent });
                if child == body {
                    self.turn_round(&mut joints[k]);
                }
            }
        }
    }

    /// Exchanges parent and child: about or along the axis turned round, the coordinate is the same.
    fn turn_round(&mut self, joint: &mut SdfJoint<'d, 'i>) {
        if joint.kind.as_ref().is_some_and(|kind| kind.value.composite.is_some()) {
            let owner = self.owner_of(joint.frame);
            let why = "it carries towards the root of its loop";
            let complaint = messages::not_supported_yet(&owner, "child", why, "exchange `<parent>` and `<child>`");
            self.complain(&joint.name.place.span, complaint);
        }
        joint.bodies.swap(0, 1);
        for axis in &mut joint.axes {
            axis.xyz.value = axis.xyz.value.map(|x| -x);
        }
    }

    /// Adds what a closing joint says: points that coincide, of a hinge its axis.
    pub fn add_closing(&mut self, joint: &SdfJoint<'d, 'i>, first: &Noted<String>) {
        if joint.kind.is_none() {
            return;
        }
        let owner = self.owner_of(joint.frame);
        if !joint.is_ball() && !joint.is_hinge() && !joint.is_fixed() {
            let link = &self.frames[joint.bodies[1]].name.value;
            let complaint = messages::two_parents(link, &first.value, &joint.name.value);
            self.complain(&joint.name.place.span, complaint.related(&first.place, "the other joint"));
            self.robot.has_holes = true;
            return;
        }
        for axis in joint.axes.iter().filter(|_| joint.is_hinge()) {
            let acting = [&axis.drive.damping, &axis.drive.friction, &axis.drive.spring_stiffness];
            if let Some(acting) = acting.into_iter().flatten().find(|acting| acting.value != 0.0) {
                let (why, help) = (
                    "it closes a loop, where nothing can act along its coordinate",
                    "remove it, or exchange `<parent>` and `<child>` so that another joint of the loop closes it",
                );
                let complaint = messages::not_supported_yet(&owner, "dynamics", why, help);
                self.complain(&acting.place.span, complaint);
            }
            if axis.limits.lower.is_some() || axis.limits.upper.is_some() {
                self.reader.ignore("limit of a joint that closes a loop", &axis.xyz.place.span);
            }
        }
        let [parent, child] = joint.bodies;
        let axis = joint.axes.first().filter(|_| joint.is_hinge());
        let mut pieces = Vec::new();
        for pose in self.path(child, joint.frame).iter().flat_map(PoseStep::poses) {
            super::chains::push(&mut pieces, pose);
        }
        if let Some(axis) = axis {
            self.push_turn(&mut pieces, joint.frame, axis.frame);
        }
        let mut link = self.frames[child].name.clone();
        if !pieces.is_empty() {
            let (last, pose) = self.add_chain(link, pieces, &joint.name);
            link = Noted::new(self.names.made_up(&format!("{}_end", joint.name.value)), joint.name.place.clone());
            self.robot.links.push(WrittenLink { name: link.clone(), inertial: None, is_carrier: false });
            self.add_fixed(last, link.clone(), pose);
        }
        let place = joint.name.place.clone();
        let other = Some(self.frames[parent].name.clone()).filter(|_| parent != WORLD);
        self.robot.loops.push(WrittenLoop {
            name: joint.name.clone(),
            points: LoopPoints::Anchor { links: [Some(link), other], point: Noted::new([0.0; 3], place) },
            determines: Vec::new(),
            assembly: None,
            joint: match axis {
                _ if joint.is_fixed() => ClosingJoint::Fixed,
                Some(axis) => ClosingJoint::Revolute(axis.xyz.clone()),
                None => ClosingJoint::Spherical,
            },
        });
    }
}
