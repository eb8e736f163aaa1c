//! Velocities of all bodies in their own axes: what energy and momentum are made of.

use crate::joint::JointPose;
use crate::model::Model;
use crate::real::Real;
use crate::spatial::{MotionVector, Vec3};
use alloc::vec::Vec;

/// ω \[rad/s\] and velocity of the canonical frame's origin \[m/s\], by body, in body axes.
pub(super) fn body_velocities<T: Real>(
    model: &Model<T>,
    poses: &[JointPose<T>],
    [q, qd]: [&[T]; 2],
) -> Vec<MotionVector<T>> {
    let mut velocities: Vec<MotionVector<T>> = Vec::with_capacity(model.bodies.len());
    let rest = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
    for (i, (body, pose)) in model.bodies.iter().zip(poses).enumerate() {
        T::section("forward", Some(i));
        let joint = &body.joint;
        let at = body.parent.map_or(rest, |p| pose.motion_to_child(&velocities[p]));
        let velocity = joint.kind.mechanics().add_all(at, joint.coordinates(q), joint.rates(qd));
        velocities
            .push(MotionVector { angular: velocity.angular.named("omega", i), linear: velocity.linear.named("v", i) });
    }
    velocities
}
