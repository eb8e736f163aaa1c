//! Forward kinematics: pose, velocity and acceleration of named frames in the world.
//!
//! In world axes: every pose needs its rotation to the world anyway. Levers are summed joint by joint from where they
//! start, never taken as differences of positions, so a robot far from the world's origin loses no digits.

use crate::joint::JointPose;
use crate::model::{BodyId, Frame, Model};
use crate::real::Real;
use crate::spatial::{Mat3, MotionVector, Transform, Vec3};
use alloc::vec::Vec;

/// Poses in the world of the frames asked for \[m\]: columns of the rotation are the frame's axes.
#[doc(alias("FK"))]
pub fn forward_kinematics<T: Real>(model: &Model<T>, q: &[T], frames: &[&Frame<T>]) -> Vec<Transform<T>> {
    let poses = world_poses(model, &model.tree_positions(q));
    let pose = |frame: &&Frame<T>| match frame.body {
        None => frame.placement,
        Some(b) => {
            T::section("frame", Some(b));
            Transform {
                rotation: poses[b].rotation * frame.placement.rotation,
                translation: poses[b].origin + poses[b].rotation * frame.placement.translation,
            }
        }
    };
    frames.iter().map(pose).collect()
}

/// Angular velocity of a frame \[rad/s\] and velocity of its origin \[m/s\], in world axes.
pub fn frame_velocity<T: Real>(model: &Model<T>, q: &[T], qd: &[T], frame: &Frame<T>) -> MotionVector<T> {
    let q = &*model.tree_positions(q);
    let qd = &*model.tree_rates(q, qd);
    let poses = world_poses(model, q);
    let (mut omega, mut v) = (Vec3::zero(), Vec3::zero());
    for b in path_to(model, frame.body) {
        T::section("velocity", Some(b));
        let (joint, pose) = (&model.bodies[b].joint, &poses[b]);
        v = v + omega.cross(pose.lever); // (20.26)
        let own = [joint.coordinates(q), joint.rates(qd)];
        let at = MotionVector { angular: omega, linear: v };
        let moved = joint.kind.mechanics().world_velocity(at, &pose.rotation, own);
        (omega, v) = (moved.angular, moved.linear);
        (omega, v) = (omega.named("omega", b), v.named("v", b));
    }
    MotionVector { angular: omega, linear: v + omega.cross(lever_of(&poses, frame)) }
}

/// Angular acceleration of a frame \[rad/s²\] and classical acceleration of its origin \[m/s²\] (what a point there does;
/// gravity is not in it), in world axes.
pub fn frame_acceleration<T: Real>(
    model: &Model<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
    frame: &Frame<T>,
) -> MotionVector<T> {
    let [q, qd, qdd] = &model.tree_motion([q, qd, qdd]);
    let poses = world_poses(model, q);
    let (mut omega, mut alpha, mut a) = (Vec3::zero(), Vec3::zero(), Vec3::zero());
    for b in path_to(model, frame.body) {
        T::section("acceleration", Some(b));
        let (joint, pose) = (&model.bodies[b].joint, &poses[b]);
        a = a + lever_acceleration(omega, alpha, pose.lever);
        let own = [joint.coordinates(q), joint.rates(qd), joint.rates(qdd)];
        (omega, alpha, a) = joint.kind.mechanics().world_acceleration((omega, alpha, a), &pose.rotation, own);
        (omega, alpha, a) = (omega.named("omega", b), alpha.named("alpha", b), a.named("accel", b));
    }
    let lever = lever_of(&poses, frame);
    MotionVector { angular: alpha, linear: a + lever_acceleration(omega, alpha, lever) }
}

/// ε × r + ω × (ω × r).
fn lever_acceleration<T: Real>(omega: Vec3<T>, alpha: Vec3<T>, r: Vec3<T>) -> Vec3<T> {
    alpha.cross(r) + omega.cross(omega.cross(r))
}

/// Where a body stands in the world.
pub(super) struct WorldPose<T> {
    /// Body axes to world axes.
    pub rotation: Mat3<T>,
    /// Origin of the canonical frame \[m\].
    pub origin: Vec3<T>,
    /// From the parent's origin, or the world's, to this one \[m\], in world axes.
    pub lever: Vec3<T>,
}

/// World poses of all bodies, from the configuration of the tree.
pub(super) fn world_poses<T: Real>(model: &Model<T>, q: &[T]) -> Vec<WorldPose<T>> {
    let joints = JointPose::all(&model.bodies, q);
    let mut poses: Vec<WorldPose<T>> = Vec::with_capacity(model.bodies.len());
    for (i, (body, joint)) in model.bodies.iter().zip(&joints).enumerate() {
        T::section("pose", Some(i));
        let (r_parent, o_parent) =
            body.parent.map_or((Mat3::identity(), Vec3::zero()), |p| (poses[p].rotation, poses[p].origin));
        let rotation = joint.rotation_after(&r_parent);
        let mut lever = r_parent * joint.translation;
        if let Some(slide) = joint.slide {
            lever = lever + rotation.column(2).scale(slide);
        }
        let origin = (o_parent + lever).named("position", i);
        let [x, y, z] = [0, 1, 2].map(|k| rotation.column(k));
        let rotation = Mat3::from_columns(x.named("axis_x", i), y.named("axis_y", i), z.named("axis_z", i));
        poses.push(WorldPose { rotation, origin, lever });
    }
    poses
}

/// From the origin of the body that carries the frame to the frame's \[m\], in world axes; null on the world.
pub(super) fn lever_of<T: Real>(poses: &[WorldPose<T>], frame: &Frame<T>) -> Vec3<T> {
    frame.body.map_or(Vec3::zero(), |b| poses[b].rotation * frame.placement.translation)
}

/// The bodies from the root to `body`, both included.
pub(super) fn path_to<T>(model: &Model<T>, body: Option<BodyId>) -> Vec<BodyId> {
    let mut path: Vec<BodyId> = core::iter::successors(body, |&b| model.bodies[b].parent).collect();
    path.reverse();
    path
}
