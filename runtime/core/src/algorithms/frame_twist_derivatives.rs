//! Derivatives of the spatial twist of a frame, in the frame's own axes or at the world's origin, and the rate of its Jacobian.
//!
//! All twists here are taken at one point and in one set of axes: the velocity of what would move with the body there, and ω. Spatial acceleration is
//! the rate of these six numbers. With S the twist per unit of velocity coordinate j, v_λ and a_λ of the body before its joint, v_b of the body behind
//! it, v and a of the frame, and a × b = (ω_a × v_b + v_a × ω_b, ω_a × ω_b), what the joint carries moves along S as one:
//!
//! ```text
//! at the world's origin                                         in the frame's own axes, which move along: −S × v, −S × a, −v × S
//! ∂v/∂q_j = S × (v − v_λ)                                       ∂v/∂q_j = v_λ × S
//! ∂a/∂q_j = S × (a − a_λ) + (v_λ × S) × (v − v_λ)               ∂a/∂q_j = a_λ × S + (v_λ × S) × (v − v_λ)
//! J̇_j     = v_b × S                                             J̇_j     = (v_b − v) × S
//! ```
//!
//! This is so of every joint whose motion subspace is constant in the axes of its body, with velocity coordinates of the body's axes held. For a joint of
//! one coordinate v_λ × S = v_b × S, and v_b, a_b may stand for v_λ, a_λ. Differences of motions are summed from the frame inwards, never
//! taken. In the frame's own axes poses are composed from the frame inwards: neither the first joint nor the pose of a floating base is in
//! them.

use super::frame_derivatives::{set, FrameDerivativeBlocks};
use super::kinematics::{path_to, world_poses};
use crate::joint::JointPose;
use crate::model::{BodyId, Frame, Joint, Model};
use crate::real::Real;
use crate::spatial::{Mat3, MotionVector, Vec3};
use alloc::vec::Vec;

/// Derivatives of the velocity of the frame's origin and of its angular velocity, along the frame's own axes, and of the rates of these six numbers.
#[doc(alias("LOCAL", "body Jacobian", "body twist"))]
pub fn frame_derivatives_in_own_axes<T: Real>(
    model: &Model<T>,
    motion: [&[T]; 3],
    frame: &Frame<T>,
) -> FrameDerivativeBlocks<T> {
    let [q, qd, qdd] = &model.tree_motion(motion);
    let motion: [&[T]; 3] = [q, qd, qdd];
    let path = path_to(model, frame.body);
    let joints = joints_along(model, motion, &path, columns_at_frame(model, motion[0], frame, &path));
    by_columns(model, &joints, |joint, k, [behind, from_before]| {
        let (s, carried) = (&joint.columns[k], joint.carried[k]);
        let turned = cross(&carried, &from_before.twist);
        let by_acceleration = sum(&cross(&joint.before.rate, s), &turned);
        [carried, by_acceleration, cross(s, &behind.twist)]
    })
    .of_free_joints(model, q)
}

/// Derivatives of the velocity of what moves with the frame through the world's origin and of its angular velocity, in world axes, and of the rates
/// of these six numbers.
#[doc(alias("WORLD", "spatial Jacobian", "spatial twist"))]
pub fn frame_derivatives_at_world_origin<T: Real>(
    model: &Model<T>,
    motion: [&[T]; 3],
    frame: &Frame<T>,
) -> FrameDerivativeBlocks<T> {
    let [q, qd, qdd] = &model.tree_motion(motion);
    let motion: [&[T]; 3] = [q, qd, qdd];
    let path = path_to(model, frame.body);
    let joints = joints_along(model, motion, &path, columns_at_origin(model, motion[0], &path));
    by_columns(model, &joints, |joint, k, [behind, from_before]| {
        let (s, carried) = (&joint.columns[k], joint.carried[k]);
        let is_single = joint.columns.len() == 1;
        let against = if is_single { behind } else { from_before };
        let by_velocity = cross(s, &against.twist);
        let by_acceleration = sum(&cross(s, &against.rate), &cross(&carried, &against.twist));
        let rate = if is_single { carried } else { cross(&joint.before.with(joint).twist, s) };
        [by_velocity, by_acceleration, rate]
    })
    .of_free_joints(model, q)
}

/// The blocks, over all velocities of the tree, of what is said of each column: ∂v/∂q, ∂a/∂q and J̇, from its joint and the motion of the frame against the bodies behind and
/// before it.
fn by_columns<T: Real>(
    model: &Model<T>,
    joints: &[PathJoint<'_, T>],
    derivatives: impl Fn(&PathJoint<'_, T>, usize, [&TwistAndRate<T>; 2]) -> [MotionVector<T>; 3],
) -> FrameDerivativeBlocks<T> {
    let (mut all, mut behind) = (FrameDerivativeBlocks::zero(model.tree_nv()), TwistAndRate::zero());
    for joint in joints.iter().rev() {
        T::section("frame derivatives", Some(joint.body));
        let from_before = behind.with(joint);
        for (k, column) in joint.columns.iter().enumerate() {
            let [by_velocity, by_acceleration, rate] = derivatives(joint, k, [&behind, &from_before]);
            let place = (joint.iv + k, model.tree_nv());
            set(&mut all.jacobian, place, column);
            set(&mut all.dv_dq, place, &by_velocity);
            set(&mut all.da_dq, place, &by_acceleration);
            set(&mut all.jacobian_rate, place, &rate);
            set(&mut all.da_dqd, place, &sum(&by_velocity, &rate));
        }
        behind = from_before;
    }
    all
}

/// A twist and its rate.
#[derive(Clone, Copy)]
struct TwistAndRate<T> {
    twist: MotionVector<T>,
    rate: MotionVector<T>,
}

/// A joint on the way to the frame.
struct PathJoint<'a, T> {
    body: BodyId,
    /// Index of its first velocity coordinate.
    iv: usize,
    qd: &'a [T],
    qdd: &'a [T],
    /// S of its coordinates.
    columns: Vec<MotionVector<T>>,
    /// v_λ and a_λ of the body before it.
    before: TwistAndRate<T>,
    /// v_λ × S: how that body carries S along.
    carried: Vec<MotionVector<T>>,
}

impl<T: Real> TwistAndRate<T> {
    fn zero() -> Self {
        let none = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
        TwistAndRate { twist: none, rate: none }
    }

    /// With what a joint adds: Σ S q̇, and Σ S q̈ + (v_λ × S) q̇, as (Σ S q̇) × (Σ S q̇) = 0.
    fn with(&self, joint: &PathJoint<'_, T>) -> Self {
        let mut all = *self;
        for (k, (s, carried)) in joint.columns.iter().zip(&joint.carried).enumerate() {
            all.twist = sum(&all.twist, &scaled(s, joint.qd[k]));
            all.rate = sum(&all.rate, &sum(&scaled(s, joint.qdd[k]), &scaled(carried, joint.qd[k])));
        }
        all
    }
}

/// The joints of a path with the motions of the bodies before them, from their columns.
fn joints_along<'a, T: Real>(
    model: &Model<T>,
    [_, qd, qdd]: [&'a [T]; 3],
    path: &[BodyId],
    columns: Vec<Vec<MotionVector<T>>>,
) -> Vec<PathJoint<'a, T>> {
    let mut before = TwistAndRate::zero();
    let along = |(&body, columns): (&BodyId, Vec<MotionVector<T>>)| {
        T::section("velocity", Some(body));
        let joint = &model.bodies[body].joint;
        let carried = columns.iter().map(|s| cross(&before.twist, s)).collect();
        let (qd, qdd) = (joint.rates(qd), joint.rates(qdd));
        let joint = PathJoint { body, iv: joint.iv, qd, qdd, columns, before, carried };
        before = before.with(&joint);
        joint
    };
    path.iter().zip(columns).map(along).collect()
}

/// S of the joints of a path, at the origin of the frame and in its axes.
fn columns_at_frame<T: Real>(
    model: &Model<T>,
    q: &[T],
    frame: &Frame<T>,
    path: &[BodyId],
) -> Vec<Vec<MotionVector<T>>> {
    let joints = JointPose::all(&model.bodies, q);
    // axes of the body in those of the frame, and the way from its origin to the frame's
    let mut rotation = frame.placement.rotation.transpose();
    let mut lever = rotation * frame.placement.translation;
    let mut all: Vec<_> = Vec::with_capacity(path.len());
    for &b in path.iter().rev() {
        T::section("pose", Some(b));
        all.push(columns_of(&model.bodies[b].joint, q, &rotation, lever));
        let joint = &joints[b];
        if let Some(slide) = joint.slide {
            lever = lever + rotation.column(2).scale(slide);
        }
        rotation = joint.rotation_before(&rotation);
        lever = lever + rotation * joint.translation;
    }
    all.reverse();
    all
}

/// S of the joints of a path, at the world's origin and in its axes.
fn columns_at_origin<T: Real>(model: &Model<T>, q: &[T], path: &[BodyId]) -> Vec<Vec<MotionVector<T>>> {
    let poses = world_poses(model, q);
    let of = |&b: &BodyId| {
        T::section("jacobian", Some(b));
        columns_of(&model.bodies[b].joint, q, &poses[b].rotation, -poses[b].origin)
    };
    path.iter().map(of).collect()
}

fn columns_of<T: Real>(joint: &Joint, q: &[T], rotation: &Mat3<T>, lever: Vec3<T>) -> Vec<MotionVector<T>> {
    let column = |k: usize| {
        let (linear, angular) = joint.kind.mechanics().world_column(k, joint.coordinates(q), rotation, lever);
        MotionVector { linear, angular }
    };
    (0..joint.kind.nv()).map(column).collect()
}

/// a × b of twists: how b changes where its axes and its point move with a.
fn cross<T: Real>(a: &MotionVector<T>, b: &MotionVector<T>) -> MotionVector<T> {
    MotionVector { linear: a.angular.cross(b.linear) + a.linear.cross(b.angular), angular: a.angular.cross(b.angular) }
}

fn sum<T: Real>(a: &MotionVector<T>, b: &MotionVector<T>) -> MotionVector<T> {
    MotionVector { linear: a.linear + b.linear, angular: a.angular + b.angular }
}

fn scaled<T: Real>(a: &MotionVector<T>, k: T) -> MotionVector<T> {
    MotionVector { linear: a.linear.scale(k), angular: a.angular.scale(k) }
}
