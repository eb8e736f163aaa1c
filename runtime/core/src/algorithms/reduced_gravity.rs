//! Gravity forces of a [`ReducedModel`]: first moments carried to the base, and nothing else.
//!
//! At rest a joint carries the weight of what lies beyond it: its moment about the joint is S × (−g), with the first moment
//! S of everything that the joint moves, about the joint's origin. S goes from the tips to the base, S_i = m c + Σ (R S_c +
//! M_c p), and is turned once per joint, where Newton-Euler would turn a force and a moment. Of S × (−g) only the part
//! along the axis is wanted, and a turn about the axis does not change it: it is taken before the turn, where the vector
//! −g of a joint near the base still has zeros.

use super::reduced_turn::own_angle;
use crate::joint::quaternion::{quaternion_to_rotation, rotated_back};
use crate::model::BodyId;
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedJoint, ReducedModel};
use crate::spatial::{Mat3, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Generalized forces \[N·m or N\] that hold the robot at rest: [`gravity_force`](super::gravity_force) of the full robot.
pub fn reduced_gravity_force<T: Real>(model: &ReducedModel<T>, q: &[T]) -> Vec<T> {
    reduced_gravity_force_with_limbs(model, q, &mut |_, _| None)
}

/// `of_all(i, first_moment)`: the first moment about the parent's origin, and the mass, of all limbs for which body `i` stands, where
/// `first_moment()` is that of body `i` and what it carries; `None`: body `i` stands for itself.
pub type LimbMoments<'a, T> = dyn FnMut(BodyId, &dyn Fn() -> Vec3<T>) -> Option<(Vec3<T>, T)> + 'a;

/// The same of a robot on which some bodies stand for several limbs each.
pub fn reduced_gravity_force_with_limbs<T: Real>(
    model: &ReducedModel<T>,
    q: &[T],
    of_all: &mut LimbMoments<'_, T>,
) -> Vec<T> {
    let n = model.bodies.len();
    // −g in body axes, and for each joint before its turn
    let mut up: Vec<Vec3<T>> = Vec::with_capacity(n);
    let mut up_at_joint: Vec<Vec3<T>> = Vec::with_capacity(n);
    T::section("sines and cosines", None);
    let turn = |(i, body): (usize, &ReducedBody<T>)| match body.kind {
        ReducedJoint::Turn => own_angle(i, body, q),
        ReducedJoint::Slide | ReducedJoint::Free | ReducedJoint::Ball => body.offset,
    };
    let turns: Vec<(T, T)> = model.bodies.iter().enumerate().map(turn).collect();
    let balls: Vec<Option<Mat3<T>>> = model.bodies.iter().map(|body| ball_rotation(body, q)).collect();
    for (i, body) in model.bodies.iter().enumerate() {
        T::section("forward", Some(i));
        let before = body.parent.map_or(-model.gravity, |p| up[p]);
        let (s, c) = turns[i];
        let at_joint = match body.kind {
            ReducedJoint::Free => rotated_back(body.quaternion(q), before),
            _ => body.rotation.transpose_mul(before),
        };
        let own = match (body.kind, &balls[i]) {
            (ReducedJoint::Free, _) => at_joint,
            (_, Some(ball)) => ball.transpose_mul(at_joint),
            _ => at_joint.turned(-s, c),
        };
        up.push(own.named("up", i));
        up_at_joint.push(at_joint);
    }

    let mut forces = vec![T::zero(); model.nv()];
    let mut mass: Vec<T> = model.bodies.iter().map(|b| b.mass).collect();
    let mut first_moment: Vec<Vec3<T>> = model.bodies.iter().map(|b| b.first_moment).collect();
    for (i, body) in model.bodies.iter().enumerate().rev() {
        T::section("backward", Some(i));
        let s = first_moment[i].named("first_moment", i);
        let (sin, cos) = turns[i];
        let at_joint = match &balls[i] {
            Some(ball) => *ball * s,
            None => s.turned(sin, cos),
        };
        let g = up_at_joint[i];
        match body.kind {
            ReducedJoint::Turn => forces[body.iv] = at_joint.x * g.y - at_joint.y * g.x,
            ReducedJoint::Slide => forces[body.iv] = mass[i] * g.z,
            // in own axes, as the joint's rates are
            ReducedJoint::Ball => {
                s.cross(up[i]).to_array().into_iter().enumerate().for_each(|(k, f)| forces[body.iv + k] = f);
            }
            ReducedJoint::Free => {
                let both = g.scale(mass[i]).scale(model.per_unit).to_array().into_iter().chain(s.cross(g).to_array());
                both.enumerate().for_each(|(k, f)| forces[body.iv + k] = f);
            }
        }
        if let Some(p) = body.parent {
            let arm = match body.kind {
                ReducedJoint::Slide => body.translation + body.rotation.column(2).scale(q[body.iq]),
                _ => body.translation,
            };
            let passed_on = || body.rotation * at_joint + arm.scale(mass[i]);
            if let Some((all, all_mass)) = of_all(i, &passed_on) {
                first_moment[p] = first_moment[p] + all;
                mass[p] = mass[p] + all_mass;
                continue;
            }
            first_moment[p] = first_moment[p] + body.rotation * at_joint + arm.scale(mass[i]);
            mass[p] = mass[p] + mass[i];
        }
    }
    forces
}

/// From the axes of a body on a ball joint to those of the joint.
fn ball_rotation<T: Real>(body: &ReducedBody<T>, q: &[T]) -> Option<Mat3<T>> {
    (body.kind == ReducedJoint::Ball).then(|| quaternion_to_rotation(body.quaternion(q)))
}
