//! What joints add on their own coordinates: rotor inertia, friction, springs.
//!
//! tau = (rigid bodies) + I q̈ + d q̇ + f(q̇) + k (q − q₀), joint by joint; a joint of several coordinates adds d q̇ and, but for a floating base, I q̈ on
//! each of its rates, the same on all.

use crate::dd::Dd;
use crate::model::{Coulomb, JointEffects, Model};
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// Generalized forces \[N·m or N\] that friction and springs take: d q̇ + f(q̇) + k (q − q₀).
pub fn passive_force<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let q = &*model.tree_positions(q);
    let qd = &*model.tree_rates(q, qd);
    let mut forces = vec![T::zero(); model.tree_nv()];
    for (i, body) in model.bodies.iter().enumerate() {
        let e = &body.effects;
        // most have no damping, and are worth no section of their own
        if !body.joint.kind.is_single() {
            for iv in body.joint.iv..body.joint.iv + body.joint.kind.nv() {
                forces[iv] = e.damping * qd[iv];
            }
            continue;
        }
        T::section("friction and springs", Some(i));
        let (q, qd) = (q[body.joint.iq], qd[body.joint.iv]);
        let spring = e.stiffness * (q - e.spring_rest);
        let friction = friction_force(e, qd);
        forces[body.joint.iv] = (friction + spring).named("passive", i, "");
    }
    model.free_forces(q, forces)
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

/// Inertia that joints add to the diagonal of H \[kg·m² or kg\], by velocity coordinate: of a joint that follows another one to that of the other. Those
/// of joints that loops determine stand behind the independent ones.
pub fn rotor_inertias<T: Real>(model: &Model<T>) -> Vec<T> {
    let mut inertias = vec![T::zero(); model.open_nv()];
    for (b, body) in model.bodies.iter().enumerate() {
        let inertia = body.effects.rotor_inertia.unwrap_or_else(T::zero);
        let (rows, inertia) = match model.coupling_of(b) {
            Some(coupling) => {
                let row = model.bodies[coupling.source].joint.iv;
                (row..row + 1, coupling.ratio * (coupling.ratio * inertia))
            }
            None => (body.joint.iv..body.joint.iv + body.joint.kind.nv(), inertia),
        };
        rows.for_each(|row| inertias[row] = inertias[row] + inertia);
    }
    inertias
}

/// Generalized forces \[N·m or N\] that these inertias take.
pub fn rotor_forces<T: Real>(model: &Model<T>, [q, qd, qdd]: [&[T]; 3]) -> Vec<T> {
    let inertias = rotor_inertias(model).into_iter();
    if model.closure.is_empty() {
        return inertias.zip(qdd).map(|(inertia, qdd)| inertia * *qdd).collect();
    }
    let [y, _, ydd] = model.tree_motion([q, qd, qdd]);
    model.independent_rows(&y, inertias.zip(ydd.iter()).map(|(inertia, ydd)| inertia * *ydd).collect(), 1)
}

/// Forces of a motion without q̈, with those of rotors on joints that loops determine, which accelerate all the same.
pub fn with_rotors_of_loops<T: Real>(model: &Model<T>, [q, qd]: [&[T]; 2], forces: Vec<T>) -> Vec<T> {
    if model.closure.is_empty() {
        return forces;
    }
    let rotors = rotor_forces(model, [q, qd, &vec![T::zero(); model.nv()]]);
    forces.into_iter().zip(rotors).map(|(force, rotor)| force + rotor).collect()
}

/// Adds these inertias to a mass matrix, by rows.
pub fn add_rotors<T: Real>(model: &Model<T>, q: &[T], h: &mut [T]) {
    let (nv, inertias) = (model.nv(), rotor_inertias(model));
    for (i, rotor) in inertias[..nv].iter().enumerate() {
        h[i * nv + i] = h[i * nv + i] + *rotor;
    }
    let of_loops = model.embedding(&model.tree_positions(q));
    for (row, rotor) in of_loops.iter().zip(&inertias[nv..]) {
        for (i, j) in (0..nv).flat_map(|i| (0..nv).map(move |j| (i, j))) {
            h[i * nv + j] = h[i * nv + j] + row[i] * row[j] * *rotor;
        }
    }
}

/// ½ Σ I q̇² \[J\] of the rotors.
pub fn rotor_energy<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> T {
    let rates = model.open_rates(&model.tree_positions(q), qd);
    let squares = rotor_inertias(model).into_iter().zip(rates.iter()).map(|(inertia, qd)| inertia * *qd * *qd);
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
