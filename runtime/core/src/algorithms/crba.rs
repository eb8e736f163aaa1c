//! The mass matrix H(q): the composite-rigid-body algorithm (Featherstone 2008, table 6.2), with second moments.
//!
//! All that lies outside a joint is one rigid body with mass M, first moment m c and second moment Σ = ∫ r rᵀ dm about the
//! origin of the joint's frame. Σ moves more cheaply than the inertia tensor J = tr(Σ) 1 − Σ. Column j of H is the wrench
//! that accelerates that composite by q̈_j = 1, carried down to the base and projected on every joint that it passes.

use super::composite_of;
use crate::joint::{JointPose, MOST_COORDINATES};
use crate::model::{Body, Model};
use crate::real::Real;
use crate::spatial::{Composite, ForceVector};
use alloc::vec;
use alloc::vec::Vec;
use core::cell::OnceCell;

/// H(q), nv × nv, row-major, symmetric, \[kg·m², kg·m, kg\] as the coordinates have it. Entries of joints on different
/// branches are structural zeros.
#[doc(alias = "crba")]
#[doc(alias = "joint space inertia matrix")]
#[doc(alias("CRBA", "inertia matrix"))]
pub fn mass_matrix<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let q = &*model.tree_positions(q);
    let poses = JointPose::all(&model.bodies, q);
    let nv = model.tree_nv();
    let mut h = vec![T::zero(); nv * nv];
    let mut set = |i: usize, j: usize, value: T| {
        h[i * nv + j] = value;
        h[j * nv + i] = value;
    };
    let mut composites: Vec<Composite<T>> = model.bodies.iter().map(composite_of).collect();
    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("composite", Some(b));
        let composite = composites[b].named(b);
        let (joint, pose) = (&body.joint, &poses[b]);
        let (mechanics, own, nv) = (joint.kind.mechanics(), joint.coordinates(q), joint.kind.nv());
        mechanics.block(&composite, own, nv, &mut |i, j, value| {
            set(joint.iv + i, joint.iv + j, if i == j { with_rotor(value, body) } else { value });
        });
        let Some(parent) = body.parent else { continue };
        let formed = OnceCell::new();
        let back = || *formed.get_or_init(|| pose.composite_back(&composite));
        let mut columns = [ForceVector::zero(); MOST_COORDINATES];
        for (k, column) in columns[..nv].iter_mut().enumerate() {
            *column = mechanics.wrench_back(k, (&composite, &back), pose, own);
        }
        composites[parent] = composites[parent].plus(&placed(&back(), pose));
        for (k, column) in columns[..nv].iter().enumerate() {
            let mut column = pose.placed_wrench(column);
            let mut ancestor = parent;
            loop {
                T::section("column", Some(b));
                let below = &model.bodies[ancestor].joint;
                for i in 0..below.kind.nv() {
                    let value = below.kind.mechanics().along(i, below.coordinates(q), &column);
                    set(below.iv + i, joint.iv + k, value);
                }
                let Some(next) = model.bodies[ancestor].parent else { break };
                column = poses[ancestor].wrench_to_parent(&column);
                ancestor = next;
            }
        }
    }
    model.free_symmetric(q, h)
}

/// The inertia on a joint's own coordinate, rotor included.
fn with_rotor<T: Real>(inertia: T, body: &Body<T>) -> T {
    body.effects.rotor_inertia.map_or(inertia, |rotor| inertia + rotor)
}

/// What each body carries and is, about its origin in its axes.
pub(super) fn composites<T: Real>(model: &Model<T>, poses: &[JointPose<T>]) -> Vec<Composite<T>> {
    let mut composites: Vec<Composite<T>> = model.bodies.iter().map(composite_of).collect();
    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("composite", Some(b));
        let Some(parent) = body.parent else { continue };
        composites[parent] = composites[parent].plus(&placed(&poses[b].composite_back(&composites[b]), &poses[b]));
    }
    composites
}

/// In the parent's axes, about the parent's origin.
pub(super) fn placed<T: Real>(composite: &Composite<T>, joint: &JointPose<T>) -> Composite<T> {
    let moments = (joint.placement * composite.first_moment, joint.placed(composite.second_moment));
    Composite::moved(composite.mass, moments, joint.translation)
}
