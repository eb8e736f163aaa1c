//! What each joint carries, as one: masses, centres of mass and their Jacobians, in world axes.
//!
//! With c_b the centre of mass of all that joint b carries and m_b its mass, a coordinate further in moves c_b as a point of one body; one further out, k,
//! moves the mass m_k behind it alone, and m_b ċ_b is the momentum of that:
//!
//! ```text
//! ∂c_b/∂q_k = column k of a point at c_b                       k carries b, or is its own
//! ∂c_b/∂q_k = (momentum of all behind k, per q̇_k) / m_b        b carries k
//! ∂c_b/∂q_k = 0                                                on another branch
//! ```

use super::crba::composites;
use super::kinematics::{path_to, world_poses};
use crate::joint::JointPose;
use crate::model::Model;
use crate::real::Real;
use crate::spatial::Vec3;
use alloc::vec;
use alloc::vec::Vec;

/// What a joint carries, its link included.
#[derive(Clone, Debug, PartialEq)]
pub struct CarriedMass<T> {
    /// Its mass \[kg\].
    pub mass: T,
    /// Its centre of mass \[m\].
    pub centre: Vec3<T>,
    /// ∂centre/∂q, 3 × nv, row-major \[m/rad, m/m\]; of a floating base by increments of its pose in its own axes.
    pub jacobian: Vec<T>,
}

/// What each joint carries, in the order of the velocity coordinates. Divides by its mass, which is positive where every joint moves some.
#[doc(alias("jacobianSubtreeCenterOfMass", "subtree_com"))]
pub fn subtrees<T: Real>(model: &Model<T>, q: &[T]) -> Vec<CarriedMass<T>> {
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let poses = JointPose::all(&model.bodies, q);
    let (composites, world) = (composites(model, &poses), world_poses(model, q));
    // the momentum of all behind a coordinate, per unit of its velocity
    let mut momenta = vec![Vec3::zero(); nv];
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("momentum", Some(b));
        for k in 0..body.joint.kind.nv() {
            let twist = body.joint.kind.mechanics().column(k, body.joint.coordinates(q));
            momenta[body.joint.iv + k] = world[b].rotation * composites[b].wrench_of(&twist).force;
        }
    }
    let subtree = |b: usize| {
        T::section("subtree", Some(b));
        let mass = composites[b].mass;
        let per_mass = T::one() / mass;
        let mut lever = world[b].rotation * composites[b].first_moment.scale(per_mass);
        let centre = world[b].origin + lever;
        let mut jacobian = vec![T::zero(); 3 * nv];
        let mut set = |k: usize, column: Vec3<T>| {
            column.to_array().into_iter().enumerate().for_each(|(row, x)| jacobian[row * nv + k] = x);
        };
        for (outer, body) in model.bodies.iter().enumerate().skip(b + 1) {
            if path_to(model, Some(outer)).contains(&b) {
                let own = body.joint.iv..body.joint.iv + body.joint.kind.nv();
                own.for_each(|k| set(k, momenta[k].scale(per_mass)));
            }
        }
        for &inner in path_to(model, Some(b)).iter().rev() {
            let (joint, pose) = (&model.bodies[inner].joint, &world[inner]);
            for k in 0..joint.kind.nv() {
                set(
                    joint.iv + k,
                    joint.kind.mechanics().world_column(k, joint.coordinates(q), &pose.rotation, lever).0,
                );
            }
            lever = lever + pose.lever;
        }
        CarriedMass { mass, centre, jacobian: model.free_columns(q, jacobian) }
    };
    model.bodies_in_order().into_iter().map(subtree).collect()
}
