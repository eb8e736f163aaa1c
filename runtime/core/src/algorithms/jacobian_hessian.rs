//! Jᵀ f of forces on frames, and its derivative by q: the stiffness that held forces give the joints (geometric stiffness).
//!
//! A force F at the origin of a frame and a moment M, whose six numbers along the world's axes are held, act on coordinate i with l_i · F + w_i · M, where
//! (l_i, w_i) is its column of the Jacobian. A coordinate j turns the columns of all that it carries with it; columns further in know of it by
//! where the frame is (the kinematic Hessian in closed form):
//!
//! ```text
//! ∂(Jᵀf)_i/∂q_j = w_j · (l_i × F + w_i × M)      j carries i, or both belong to one joint
//! ∂(Jᵀf)_i/∂q_j = w_i · (l_j × F)                i carries j
//! ```
//!
//! So the part of forces is symmetric, and that of moments stands on one side of the diagonal; of a floating base, whose increments turn with it, neither is.

use super::kinematics::{lever_of, path_to, world_poses};
use crate::model::{BodyId, Frame, Model};
use crate::real::Real;
use crate::spatial::Vec3;
use alloc::vec;
use alloc::vec::Vec;

/// What acts at the origin of a frame, in world axes.
#[derive(Clone, Copy, Debug)]
pub struct ForceOnFrame<'a, T> {
    /// The frame.
    pub frame: &'a Frame<T>,
    /// Force \[N\].
    pub force: Vec3<T>,
    /// Moment \[N·m\].
    pub moment: Vec3<T>,
}

/// What a velocity coordinate knows of the forces on all frames that it carries.
#[derive(Clone)]
struct LoadedColumn<T> {
    /// w.
    angular: Vec3<T>,
    /// Σ l × F.
    of_forces: Vec3<T>,
    /// Σ w × M.
    of_moments: Vec3<T>,
}

/// Jᵀ f \[N·m or N\] of the forces on these frames together, nv numbers, and ∂(Jᵀ f)/∂q, nv × nv, row-major, \[N·m/rad, N/m\]; of a floating base by
/// increments of its pose in its own axes.
#[doc(alias("kinematic Hessian", "geometric stiffness", "getJointKinematicHessian"))]
pub fn jacobian_hessian_product<T: Real>(model: &Model<T>, q: &[T], forces: &[ForceOnFrame<'_, T>]) -> [Vec<T>; 2] {
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let none = LoadedColumn { angular: Vec3::zero(), of_forces: Vec3::zero(), of_moments: Vec3::zero() };
    let (mut columns, mut jt_f) = (vec![none; nv], vec![T::zero(); nv]);
    let poses = world_poses(model, q);
    for ForceOnFrame { frame, force, moment } in forces {
        let mut lever = lever_of(&poses, frame);
        for &b in path_to(model, frame.body).iter().rev() {
            T::section("jacobian", Some(b));
            let (joint, pose) = (&model.bodies[b].joint, &poses[b]);
            for k in 0..joint.kind.nv() {
                let own = joint.coordinates(q);
                let (linear, angular) = joint.kind.mechanics().world_column(k, own, &pose.rotation, lever);
                let (column, jt_f) = (&mut columns[joint.iv + k], &mut jt_f[joint.iv + k]);
                column.angular = angular;
                column.of_forces = column.of_forces + linear.cross(*force);
                column.of_moments = column.of_moments + angular.cross(*moment);
                *jt_f = *jt_f + (linear.dot(*force) + angular.dot(*moment));
            }
            lever = lever + pose.lever;
        }
    }
    let mut hessian = vec![T::zero(); nv * nv];
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("hessian", Some(b));
        let own = body.joint.iv..body.joint.iv + body.joint.kind.nv();
        for i in own.clone() {
            let column = &columns[i];
            let all = column.of_forces + column.of_moments;
            for j in own.clone() {
                // w · (w × M) = 0
                let turned = if i == j { column.of_forces } else { all };
                hessian[i * nv + j] = columns[j].angular.dot(turned);
            }
            for j in inner_coordinates(model, b) {
                let w = columns[j].angular;
                let by_forces = w.dot(column.of_forces);
                hessian[j * nv + i] = by_forces;
                hessian[i * nv + j] = by_forces + w.dot(column.of_moments);
            }
        }
    }
    [model.free_forces(q, jt_f), model.free_square(q, hessian)]
}

/// The coordinates of the joints that carry that of body `b`.
fn inner_coordinates<T>(model: &Model<T>, b: BodyId) -> impl Iterator<Item = usize> + '_ {
    let inner = core::iter::successors(model.bodies[b].parent, |&b| model.bodies[b].parent);
    inner.flat_map(|b| {
        let joint = &model.bodies[b].joint;
        joint.iv..joint.iv + joint.kind.nv()
    })
}
