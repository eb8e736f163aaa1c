//! Where two bodies meet and close a loop, which way they stand there, and the equations that hold them.
//!
//! A ball joint holds points together, a hinge an axis, too, and a weld all three axes. Where the joints of a loop are bound to a plane, points have two directions
//! to part along, a hinge across the plane asks for nothing more, and whatever holds an axis in the plane for one angle.

use crate::description::{messages, ClosingJoint, LoopPoints, Noted, WrittenLoop};
use crate::diagnostic::Diagnostics;
use crate::model::geometry::{magnitude, point, snap_rotation, snap_vector, unit, vector};
use crate::model::Assembly;
use straightline_core::algorithms as alg;
use straightline_core::closure::{ClosedLoop, LoopEnd};
use straightline_core::model::{BodyId, Frame, Model};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_core::Dd;

/// Axes that are so nearly parallel are \[rad\].
const PARALLEL: f64 = 1e-9;
/// Parts of an axis that are so nearly alike count as that: the first one is taken.
const ALIKE: f64 = 1e-6;

/// The points that a loop joins, and how the bodies are turned against each other there.
pub(super) struct LoopMeeting {
    pub ends: [LoopEnd<Dd>; 2],
    /// From the axes of the first body to those of the second one, where the loop is closed.
    turn: Mat3<Dd>,
    /// What may turn there.
    joint: TurningAt,
}

/// What two bodies may do where they meet.
#[derive(Clone, Copy)]
enum TurningAt {
    /// Anything.
    Point,
    /// Turn about this unit vector of the first body.
    Axis(Vec3<Dd>),
    /// Nothing.
    Nothing,
}

/// A frame where a loop ends: its body, the point there, and the axes that it has in the body.
struct FrameAtEnd {
    end: LoopEnd<Dd>,
    rotation: Mat3<Dd>,
}

impl LoopMeeting {
    /// Where the bodies of a loop meet; `None` after a complaint.
    pub fn of(
        own: &WrittenLoop,
        assembly: &Assembly,
        model: &Model<Dd>,
        zero: &[Dd],
        diagnostics: &mut Diagnostics,
    ) -> Option<LoopMeeting> {
        let owner = format!("loop `{}`", own.name.value);
        let mut at = |name: Option<&Noted<String>>, position: Vec3<Dd>| {
            let Some(name) = name else {
                return Some(FrameAtEnd { end: LoopEnd { body: None, point: position }, rotation: Mat3::identity() });
            };
            let Some(carrier) = assembly.links.get(&name.value) else {
                let known = assembly.links.keys().map(String::as_str);
                diagnostics.push(messages::unknown_link(&owner, &name.value, known).at(&name.place));
                return None;
            };
            let (body, x_body_link) = carrier.at(position);
            let end = LoopEnd { body, point: point(&x_body_link, position) };
            Some(FrameAtEnd { end, rotation: x_body_link.rotation })
        };
        let [one, other] = match &own.points {
            LoopPoints::Frames(frames) => {
                let [one, other] = frames.each_ref().map(|frame| at(Some(frame), Vec3::zero()));
                [one?, other?]
            }
            LoopPoints::Anchor { links: [one, other], point: position } => {
                let one = at(one.as_ref(), vector(position.value));
                let other = at(other.as_ref(), Vec3::zero());
                let (one, other) = (one?, other?);
                let [of_one, of_other] = [one.end.body, other.end.body].map(|body| pose(model, zero, body));
                let met = of_one.rotation * one.end.point + of_one.translation - of_other.translation;
                let end = LoopEnd { body: other.end.body, point: of_other.rotation.transpose_mul(met) };
                let rotation = of_other.rotation.transpose() * of_one.rotation * one.rotation;
                [one, FrameAtEnd { end, rotation }]
            }
        };
        let joint = match &own.joint {
            ClosingJoint::Spherical => TurningAt::Point,
            ClosingJoint::Fixed => TurningAt::Nothing,
            ClosingJoint::Revolute(axis) => {
                let Some(axis) = unit(vector(axis.value)) else {
                    diagnostics.push(messages::zero_axis(&owner).at(&axis.place));
                    return None;
                };
                TurningAt::Axis(snap_vector(one.rotation * axis, 1.0))
            }
        };
        let turn = snap_rotation(other.rotation * one.rotation.transpose());
        Some(LoopMeeting { ends: [one.end, other.end], turn, joint })
    }

    /// The equations of a loop, in the pose of the file.
    pub fn equations(&self, own: &WrittenLoop, model: &Model<Dd>, zero: &[Dd]) -> ClosedLoop<Dd> {
        let name = own.name.value.clone();
        let points = ClosedLoop { name, ends: self.ends, directions: Vec::new(), alignments: Vec::new() };
        let directions = directions(&points, model, zero);
        let normal = match directions[..] {
            [across, along] => {
                let in_world = pose(model, zero, model.parting(&points)).rotation * across.cross(along);
                Some(pose(model, zero, self.ends[0].body).rotation.transpose_mul(in_world))
            }
            _ => None,
        };
        ClosedLoop { directions, alignments: self.alignments(normal), ..points }
    }

    /// Vectors of both bodies that stay perpendicular where motions are about `normal` of the first body alone, or any.
    fn alignments(&self, normal: Option<Vec3<Dd>>) -> Vec<[Vec3<Dd>; 2]> {
        let pair = |u: Vec3<Dd>, v: Vec3<Dd>| [u, snap_vector(self.turn * v, 1.0)];
        match (self.joint, normal) {
            (TurningAt::Point, _) => Vec::new(),
            (TurningAt::Axis(axis), Some(normal)) if are_parallel(axis, normal) => Vec::new(),
            (_, Some(normal)) => {
                let [across, along] = across(snap_vector(normal, 1.0));
                vec![pair(across, along)]
            }
            (TurningAt::Axis(axis), None) => across(axis).map(|u| pair(u, axis)).into(),
            (TurningAt::Nothing, None) => (0..3).map(|k| pair(Vec3::unit(k), Vec3::unit((k + 1) % 3))).collect(),
        }
    }

    /// Whether the bodies stand as they are joined: perpendicular vectors leave them to be turned over.
    pub fn is_turned_right(&self, of: &ClosedLoop<f64>, model: &Model<f64>, q: &[f64]) -> bool {
        if of.alignments.is_empty() {
            return true;
        }
        let frames = of.ends.map(|end| Frame { name: String::new(), body: end.body, placement: Transform::identity() });
        let at = alg::forward_kinematics(model, q, &frames.each_ref());
        // from the axes of the first body where the second one is to where it is to be
        let over = at[0].rotation.transpose() * at[1].rotation * self.turn.map(|x| x.to_f64());
        match self.joint {
            TurningAt::Axis(axis) => {
                let axis = Vec3::from(axis.to_array().map(|x| x.to_f64()));
                axis.dot(over * axis) > 0.0
            }
            TurningAt::Point | TurningAt::Nothing => (0..3).map(|k| over.rows[k][k]).sum::<f64>() > 0.0,
        }
    }
}

fn are_parallel(one: Vec3<Dd>, other: Vec3<Dd>) -> bool {
    magnitude(one.cross(other)) < PARALLEL
}

fn pose(model: &Model<Dd>, q: &[Dd], body: Option<BodyId>) -> Transform<Dd> {
    let frame = Frame { name: String::new(), body, placement: Transform::identity() };
    alg::forward_kinematics(model, q, &[&frame])[0]
}

/// Three directions, or the two of a plane to which all joints on the way are bound.
fn directions(of: &ClosedLoop<Dd>, model: &Model<Dd>, zero: &[Dd]) -> Vec<Vec3<Dd>> {
    let bodies = model.bodies_of_loop(of);
    let base = pose(model, zero, model.parting(of));
    let axis = |b: BodyId| base.rotation.transpose_mul(pose(model, zero, Some(b)).rotation.column(2));
    let all = vec![Vec3::unit(0), Vec3::unit(1), Vec3::unit(2)];
    let joints = || bodies.iter().map(|b| (*b, &model.bodies[*b].joint.kind));
    let Some(normal) = joints().find(|(_, kind)| kind.is_single() && kind.turns()).map(|(b, _)| axis(b)) else {
        return all;
    };
    let is_plane = joints().all(|(b, kind)| {
        kind.is_single()
            && match (kind.turns(), kind.slides()) {
                (true, false) => are_parallel(axis(b), normal),
                (false, true) => axis(b).dot(normal).to_f64().abs() < PARALLEL,
                // along and about an axis at once
                _ => false,
            }
    });
    match is_plane {
        true => across(snap_vector(normal, 1.0)).into(),
        false => all,
    }
}

/// Two unit vectors across one, perpendicular to each other: of the axis that is least along it what is across it, and the normal times that.
fn across(normal: Vec3<Dd>) -> [Vec3<Dd>; 2] {
    let parts = normal.to_array().map(|x| x.to_f64().abs());
    let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
    let axis = Vec3::unit(parts.iter().position(|part| *part <= least + ALIKE).expect("one is the least"));
    let across = axis - normal.scale(normal.dot(axis));
    let across = across.scale(Dd::ONE / across.dot(across).sqrt());
    [snap_vector(across, 1.0), snap_vector(normal.cross(across), 1.0)]
}
