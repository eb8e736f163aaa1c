//! Velocities of all bodies in their own axes: what energy and momentum are made of.

use super::joint::JointPose;
use crate::model::{JointKind, Model};
use crate::real::Real;
use crate::spatial::{MotionVector, Vec3};
use alloc::vec::Vec;

/// ω \[rad/s\] and velocity of the canonical frame's origin \[m/s\], by body, in body axes.
pub(super) fn body_velocities<T: Real>(model: &Model<T>, poses: &[JointPose<T>], qd: &[T]) -> Vec<MotionVector<T>> {
    let mut velocities: Vec<MotionVector<T>> = Vec::with_capacity(model.bodies.len());
    let rest = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
    for (i, (body, pose)) in model.bodies.iter().zip(poses).enumerate() {
        T::section("forward", Some(i));
        let iv = body.joint.iv;
        let parent = body.parent.map_or(&rest, |p| &velocities[p]);
        let of_joint_frame = || MotionVector {
            angular: pose.to_child(parent.angular),
            linear: pose.to_child(parent.linear + parent.angular.cross(pose.translation)),
        };
        let velocity = match body.joint.kind {
            JointKind::Revolute => {
                let MotionVector { angular: w, linear } = of_joint_frame();
                MotionVector { angular: Vec3::new(w.x, w.y, w.z + qd[iv]), linear }
                // (20.23)
            }
            JointKind::Prismatic => {
                // v + ω × q z + q̇ z
                let (MotionVector { angular: w, linear: v }, q) = (of_joint_frame(), pose.slide_or_zero());
                MotionVector { angular: w, linear: Vec3::new(v.x + w.y * q, v.y - w.x * q, v.z + qd[iv]) }
            }
            JointKind::Floating => MotionVector {
                angular: Vec3::new(qd[iv + 3], qd[iv + 4], qd[iv + 5]),
                linear: Vec3::new(qd[iv], qd[iv + 1], qd[iv + 2]),
            },
        };
        velocities
            .push(MotionVector { angular: velocity.angular.named("omega", i), linear: velocity.linear.named("v", i) });
    }
    velocities
}
