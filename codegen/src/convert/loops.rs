//! Closed loops as a format can say them: by frames, with the joints that they determine where it has a word for those.

use super::forms::RobotNames;
use crate::description::write::{pose_of, LoopForm};
use crate::description::{ClosingJoint, Description, LoopPoints, NamedFrame, Noted, WrittenLoop};
use crate::diagnostic::Diagnostics;
use crate::model::geometry::compose;
use crate::model::{self, pose_of_file, ModelOptions};
use std::collections::HashSet;
use straightline_core::algorithms::forward_kinematics;
use straightline_core::closure::{ClosedLoop, LoopEnd};
use straightline_core::model::{BodyId, Frame, Model};
use straightline_core::spatial::Transform;
use straightline_core::Dd;

/// How near loops have to come [m or rad] to count as closed where all coordinates are zero: what poses are off that were computed anew.
const CLOSED: f64 = super::compare::ROUNDING;

/// The same loops of a robot whose model that is: two frames each, and joints by name.
pub fn by_frames(robot: &mut Description, model: &Model<Dd>, form: LoopForm) {
    if form == LoopForm::Nowhere || model.closure.is_empty() {
        return;
    }
    let asked = form == LoopForm::Frames || !are_chosen(robot, model);
    let mut names = RobotNames::of(robot);
    let mut left: Vec<BodyId> = model.closure.dependents().collect();
    let mut spelled = Vec::new();
    for (written, closed) in robot.loops.iter().zip(&model.closure.loops) {
        let on_loop = model.bodies_of_loop(closed);
        let (own, others): (Vec<BodyId>, Vec<BodyId>) = left.iter().partition(|b| on_loop.contains(b));
        left = others;
        let named = |b: &BodyId| Noted::assumed(model.bodies[*b].joint.name.clone());
        let frames = match &written.points {
            LoopPoints::Frames(frames) => frames.clone(),
            LoopPoints::Anchor { .. } => {
                let name = &written.name.value;
                let made = ["1", "2"].map(|end| Noted::assumed(names.links.made_up(&format!("{name}_{end}"))));
                let ends = ends(closed, robot, model);
                spelled.extend(made.iter().zip(ends).map(|(name, end)| Spelled::Frame(end.named(name.clone()))));
                made
            }
        };
        let closes_at_zero =
            || closes(closed, model, &pose_of_file(robot, model)) && closes(closed, model, &at_zero(model));
        let points = match form == LoopForm::AtZero && closes_at_zero() {
            true => LoopPoints::Anchor { links: frames.map(Some), point: Noted::assumed([0.0; 3]) },
            false => LoopPoints::Frames(frames),
        };
        // in its plane a hinge is what its points are
        let joint = if closed.alignments.is_empty() { ClosingJoint::Spherical } else { written.joint.clone() };
        spelled.push(Spelled::Loop(WrittenLoop {
            name: written.name.clone(),
            points,
            determines: if asked { own.iter().map(named).collect() } else { Vec::new() },
            assembly: written.assembly.clone(),
            joint,
        }));
    }
    robot.loops.clear();
    for item in spelled {
        match item {
            Spelled::Frame(frame) => robot.frames.push(frame),
            Spelled::Loop(own) => robot.loops.push(own),
        }
    }
}

enum Spelled {
    Frame(NamedFrame),
    Loop(WrittenLoop),
}

/// Whether a reader chooses the same joints of a robot that says nothing of them.
fn are_chosen(robot: &Description, model: &Model<Dd>) -> bool {
    let mut silent = robot.clone();
    silent.loops.iter_mut().for_each(|own| (own.determines, own.assembly) = (Vec::new(), None));
    silent.drives.clear();
    silent.actuated.clear();
    let options = ModelOptions { floating_base: robot.floats(), ..ModelOptions::default() };
    let chosen = model::build(&silent, &options, &mut Diagnostics::new());
    let of = |model: &Model<Dd>| model.closure.dependents().collect::<HashSet<_>>();
    chosen.is_some_and(|chosen| of(&chosen) == of(model))
}

fn at_zero(model: &Model<Dd>) -> Vec<Dd> {
    let mut q = vec![Dd::ZERO; model.nq()];
    for joint in model.free_joints() {
        let neutral = joint.kind.row().neutral.iter();
        q[joint.iq..].iter_mut().zip(neutral).for_each(|(q, neutral)| *q = Dd::from(*neutral));
    }
    q
}

fn closes(of: &ClosedLoop<Dd>, model: &Model<Dd>, q: &[Dd]) -> bool {
    let y = model.tree_positions(q);
    let longest = model.bodies.iter().flat_map(|body| body.placement.translation.to_array());
    let longest = longest.fold(0.0, |most, x| x.abs().to_f64().max(most));
    let mut gaps = model.gap(of, &y).into_iter().enumerate();
    gaps.all(|(k, gap)| gap.abs().to_f64() <= CLOSED * if k < of.directions.len() { longest } else { 1.0 })
}

/// Where a loop ends: on a link, with the axes that are the first end's in the pose of the file.
struct LoopFrame {
    link: String,
    pose: Transform<Dd>,
}

impl LoopFrame {
    fn named(self, name: Noted<String>) -> NamedFrame {
        NamedFrame { name, link: Noted::assumed(self.link), pose: pose_of(&self.pose) }
    }
}

/// Frames at both ends of a loop that is closed in the pose of the file: that of the first one has the axes of its link.
fn ends(of: &ClosedLoop<Dd>, robot: &Description, model: &Model<Dd>) -> [LoopFrame; 2] {
    let link_of = |end: &LoopEnd<Dd>| match end.body {
        Some(body) => (model.bodies[body].name.clone(), model.bodies[body].link_frame),
        None => (robot.root().map_or(String::new(), |root| root.name.value.clone()), Transform::identity()),
    };
    let links = of.ends.each_ref().map(link_of);
    let q = pose_of_file(robot, model);
    let bodies = of.ends.map(|end| Frame { name: String::new(), body: end.body, placement: Transform::identity() });
    let at = forward_kinematics(model, &q, &bodies.each_ref());
    let turned = match of.alignments.is_empty() {
        true => links.each_ref().map(|(_, frame)| frame.rotation),
        false => [links[0].1.rotation, at[1].rotation.transpose() * at[0].rotation * links[0].1.rotation],
    };
    let frame = |k: usize| {
        let (name, link_frame) = &links[k];
        let there = Transform { rotation: turned[k], translation: of.ends[k].point };
        let pose = compose(&link_frame.inverse(), &there);
        LoopFrame { link: name.clone(), pose }
    };
    [frame(0), frame(1)]
}
