//! What joints add on their own coordinates: rotor inertia, friction, springs.
//!
//! tau = (rigid bodies) + I q̈ + d q̇ + f(q̇) + k (q − q₀), joint by joint; a joint of several coordinates adds nothing.

use crate::dd::Dd;
use crate::model::{Coulomb, JointEffects, Model};
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// Generalized forces \[N·m or N\] that friction and springs take: d q̇ + f(q̇) + k (q − q₀).
pub fn passive_force<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let (q, qd) = (&*model.tree_positions(q), &*model.tree_rates(qd));
    let mut forces = vec![T::zero(); model.tree_nv()];
    for (i, body) in model.bodies.iter().enumerate().filter(|(_, b)| b.joint.kind.is_single()) {
        T::section("friction and springs", Some(i));
        let (q, qd, e) = (q[body.joint.iq], qd[body.joint.iv], &body.effects);
        let spring = e.stiffness * (q - e.spring_rest);
        let friction = friction_force(e, qd);
        forces[body.joint.iv] = (friction + spring).named("passive", i, "");
    }
    model.free_forces(forces)
}

/// d q̇ + f(q̇) \[N·m or N\] of a joint.
pub(super) fn friction_force<T: Real>(effects: &JointEffects<T>, qd: T) -> T {
    effects.damping * qd + coulomb_force(effects, qd)
}

/// f(q̇) \[N·m or N\]. Under the root stands a sum of squares with w > 0.
fn coulomb_force<T: Real>(effects: &JointEffects<T>, qd: T) -> T {
    match effects.coulomb {
        Coulomb::Off => T::zero(),
        Coulomb::Sign(force) => force * qd.sign(),
        Coulomb::Smooth { force, speed } => force * qd / (qd * qd + speed * speed).sqrt(),
    }
}

/// Inertia that joints add to the diagonal of H, by velocity coordinate \[kg·m² or kg\]: of a joint that follows another one to that of the other.
pub fn rotor_inertias<T: Real>(model: &Model<T>) -> Vec<T> {
    let mut inertias = vec![T::zero(); model.tree_nv()];
    for (b, body) in model.bodies.iter().enumerate().filter(|(_, b)| b.joint.kind.is_single()) {
        let inertia = body.effects.rotor_inertia.unwrap_or_else(T::zero);
        inertias[body.joint.iv] = match model.coupling_of(b) {
            Some(coupling) => coupling.ratio * inertia,
            None => inertia,
        };
    }
    model.free_forces(inertias)
}

/// ½ Σ I q̇² \[J\] of the rotors.
pub fn rotor_energy<T: Real>(model: &Model<T>, qd: &[T]) -> T {
    let squares = rotor_inertias(model).into_iter().zip(qd).map(|(inertia, qd)| inertia * *qd * *qd);
    squares.fold(T::zero(), |sum, x| sum + x) * T::constant(Dd::HALF)
}

/// ½ Σ k (q − q₀)² \[J\] of the springs.
pub fn spring_energy<T: Real>(model: &Model<T>, q: &[T]) -> T {
    let q = &*model.tree_positions(q);
    let joints = model.bodies.iter().filter(|b| b.joint.kind.is_single());
    let squares = joints.map(|b| {
        let stretch = q[b.joint.iq] - b.effects.spring_rest;
        b.effects.stiffness * stretch * stretch
    });
    squares.fold(T::zero(), |sum, x| sum + x) * T::constant(Dd::HALF)
}
