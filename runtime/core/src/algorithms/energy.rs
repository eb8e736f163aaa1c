//! Kinetic and potential energy.

use super::effects::{rotor_energy, spring_energy};
use super::momentum::{anchor, first_moments_in_world};
use super::velocity::body_velocities;
use crate::dd::Dd;
use crate::joint::JointPose;
use crate::model::Model;
use crate::real::Real;

/// T = ½ Σ (m v_c² + ω · J_c ω) + ½ Σ I q̇² \[J\], each body about its centre of mass, so that every term is a square; the
/// second sum is over the rotors.
pub fn kinetic_energy<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> T {
    let y = &*model.tree_positions(q);
    let yd = &*model.tree_rates(y, qd);
    let poses = JointPose::all(&model.bodies, y);
    let velocities = body_velocities(model, &poses, [y, yd]);
    let mut twice = T::zero();
    for (i, (body, velocity)) in model.bodies.iter().zip(&velocities).enumerate() {
        T::section("energy", Some(i));
        let (w, j) = (velocity.angular, &body.inertia.inertia_com);
        let v_com = velocity.linear + w.cross(body.inertia.com);
        let rotation = w.dot(*j * w);
        twice = twice + v_com.dot(v_com) * body.inertia.mass + rotation;
        if let Some(load) = &body.load {
            // m v² + 2 v · (ω × m c) + ω · J ω, about the origin
            let (v, j) = (velocity.linear, load.second_moment.second_moment_to_inertia());
            let mixed = v.dot(w.cross(load.first_moment));
            twice = twice + v.dot(v) * load.mass + mixed + mixed + w.dot(j * w);
        }
    }
    twice * T::constant(Dd::HALF) + rotor_energy(model, q, qd)
}

/// V = −Σ m g · p_c + ½ Σ k (q − q₀)² \[J\] over the moving bodies, p_c from the world's origin, and over the springs.
pub fn potential_energy<T: Real>(model: &Model<T>, q: &[T]) -> T {
    let poses = JointPose::all(&model.bodies, &model.tree_positions(q));
    let (mass, first_moment) = first_moments_in_world(model, &poses);
    -model.gravity.dot(first_moment + anchor(&poses).scale(mass)) + spring_energy(model, q)
}
