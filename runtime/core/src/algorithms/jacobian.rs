//! Geometric Jacobian of a frame and its bias J̇q̇, in world axes at the frame's origin.
//!
//! The column of a revolute joint is (z × r, z), with z its axis and r the lever from the joint to the frame; of a
//! prismatic joint (z, 0): the chapter's matrices Ξ and Λ, (20.40) and (20.42).

use super::kinematics::{frame_acceleration, lever_of, path_to, world_poses};
use crate::model::{Frame, Model};
use crate::real::Real;
use crate::spatial::{MotionVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// 6 × nv, row-major: rows 0-2 the velocity of the frame's origin, rows 3-5 its angular velocity, in world axes, per unit
/// of each velocity coordinate. Columns of joints that do not move the frame are structural zeros.
pub fn jacobian<T: Real>(model: &Model<T>, q: &[T], frame: &Frame<T>) -> Vec<T> {
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let mut rows = vec![T::zero(); 6 * nv];
    let mut set_column = |iv: usize, linear: Vec3<T>, angular: Vec3<T>| {
        let column = linear.to_array().into_iter().chain(angular.to_array());
        column.enumerate().for_each(|(row, value)| rows[row * nv + iv] = value);
    };
    let poses = world_poses(model, q);
    let mut lever = lever_of(&poses, frame);
    for &b in path_to(model, frame.body).iter().rev() {
        T::section("jacobian", Some(b));
        let (joint, pose) = (&model.bodies[b].joint, &poses[b]);
        for k in 0..joint.kind.nv() {
            let own = joint.coordinates(q);
            let (linear, angular) = joint.kind.mechanics().world_column(k, own, &pose.rotation, lever);
            set_column(joint.iv + k, linear, angular);
        }
        lever = lever + pose.lever;
    }
    model.free_columns(q, rows)
}

/// J̇q̇: angular \[rad/s²\] and classical linear acceleration \[m/s²\] of the frame for q̈ = 0, in world axes.
pub fn jacobian_bias<T: Real>(model: &Model<T>, q: &[T], qd: &[T], frame: &Frame<T>) -> MotionVector<T> {
    frame_acceleration(model, q, qd, &vec![T::zero(); model.nv()], frame)
}
