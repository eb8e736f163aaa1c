//! The mass matrix H(q): the composite-rigid-body algorithm (Featherstone 2008, table 6.2), with second moments.
//!
//! All that lies outside a joint is one rigid body with mass M, first moment m c and second moment Σ = ∫ r rᵀ dm about the
//! origin of the joint's frame. Σ moves more cheaply than the inertia tensor J = tr(Σ) 1 − Σ. Column j of H is the wrench
//! that accelerates that composite by q̈_j = 1, carried down to the base and projected on every joint that it passes.

use super::composite::Composite;
use super::joint::JointPose;
use crate::model::{Body, JointKind, Model};
use crate::real::Real;
use crate::spatial::{ForceVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// H(q), nv × nv, row-major, symmetric, \[kg·m², kg·m, kg\] as the coordinates have it. Entries of joints on different
/// branches are structural zeros.
#[doc(alias = "crba")]
#[doc(alias = "joint space inertia matrix")]
#[doc(alias("CRBA", "inertia matrix"))]
pub fn mass_matrix<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let poses = JointPose::all(&model.bodies, q);
    let nv = model.nv();
    let mut h = vec![T::zero(); nv * nv];
    let mut set = |i: usize, j: usize, value: T| {
        h[i * nv + j] = value;
        h[j * nv + i] = value;
    };
    let mut composites: Vec<Composite<T>> = model.bodies.iter().map(of_body).collect();
    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("composite", Some(b));
        let iv = body.joint.iv;
        let composite = composites[b].named(b);
        let joint = &poses[b];

        // The wrench of q̈_j = 1, and the composite, in axes that the joint has turned or slid back already.
        let (column, moved) = match (body.joint.kind, joint.turn) {
            (JointKind::Floating, _) => {
                composite.fill_floating_block(iv, &mut set);
                continue; // a root: nothing below it
            }
            (JointKind::Prismatic, _) => {
                // f = M z,  n = m c × z
                set(iv, iv, with_rotor(composite.mass, body));
                let ms = composite.first_moment;
                let force = Vec3::new(T::zero(), T::zero(), composite.mass);
                let moment = Vec3::new(ms.y, -ms.x, T::zero());
                (ForceVector { moment, force }, composite.slid(joint.slide_or_zero()))
            }
            (JointKind::Revolute, turn) => {
                // f = z × m c,  n = J z = (−Σ_xz, −Σ_yz, Σ_xx + Σ_yy)
                let inertia = composite.second_moment.xx + composite.second_moment.yy;
                set(iv, iv, with_rotor(inertia, body));
                let moved = composite.turned(turn.expect("a revolute joint turns"));
                let (ms, s) = (moved.first_moment, moved.second_moment);
                let force = Vec3::new(-ms.y, ms.x, T::zero());
                (ForceVector { moment: Vec3::new(-s.xz, -s.yz, inertia), force }, moved)
            }
        };
        let Some(parent) = body.parent else { continue };
        composites[parent] = composites[parent].plus(&placed(&moved, joint));

        let mut column = joint.placed_wrench(&column);
        let mut ancestor = parent;
        loop {
            T::section("column", Some(b));
            let below = &model.bodies[ancestor];
            project(&column, below, |i, value| set(i, iv, value));
            let Some(next) = below.parent else { break };
            column = poses[ancestor].wrench_to_parent(&column);
            ancestor = next;
        }
    }
    h
}

/// The inertia on a joint's own coordinate, rotor included.
fn with_rotor<T: Real>(inertia: T, body: &Body<T>) -> T {
    body.effects.rotor_inertia.map_or(inertia, |rotor| inertia + rotor)
}

/// What a wrench does along the joint of a body, by velocity coordinate.
fn project<T: Real>(w: &ForceVector<T>, body: &Body<T>, mut set: impl FnMut(usize, T)) {
    let iv = body.joint.iv;
    match body.joint.kind {
        JointKind::Revolute => set(iv, w.moment.z),
        JointKind::Prismatic => set(iv, w.force.z),
        JointKind::Floating => {
            w.force.to_array().into_iter().chain(w.moment.to_array()).enumerate().for_each(|(k, x)| set(iv + k, x));
        }
    }
}

fn of_body<T: Real>(body: &Body<T>) -> Composite<T> {
    let total = body.total_about_origin();
    Composite { mass: total.mass, first_moment: total.first_moment, second_moment: total.second_moment }
}

/// In the parent's axes, about the parent's origin.
fn placed<T: Real>(composite: &Composite<T>, joint: &JointPose<T>) -> Composite<T> {
    let moments = (joint.placement * composite.first_moment, joint.placed(composite.second_moment));
    Composite::moved(composite.mass, moments, joint.translation)
}
