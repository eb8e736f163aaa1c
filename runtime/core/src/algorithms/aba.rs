//! Forward dynamics without H: articulated-body inertias (Featherstone 2008, table 7.1).
//!
//! Two steps. The recursive Newton-Euler algorithm gives h; what is left, H x = tau − h, is solved by the articulated-body
//! recursion of a robot at rest without gravity, which has no velocity terms at all. An articulated inertia is
//! 6 × 6 in blocks of the acceleration (ε, a) of the joint frame's origin: n = J ε + H a,  f = Hᵀ ε + M a.

use super::composite_of;
use super::crba::mass_matrix;
use super::factor::Ltdl;
use super::rnea::bias_force;
use crate::joint::{ArticulatedInertia, FreeJoint, JointPose};
use crate::model::Model;
use crate::real::Real;
use crate::spatial::{ForceVector, MotionVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// q̈ \[rad/s² or m/s²\] that the generalized forces tau \[N·m or N\] cause, by the articulated-body algorithm.
#[doc(alias = "aba")]
#[doc(alias("ABA", "articulated body"))]
pub fn forward_dynamics_aba<T: Real>(model: &Model<T>, q: &[T], qd: &[T], tau: &[T]) -> Vec<T> {
    let bias = bias_force(model, q, qd);
    let drive: Vec<T> = tau.iter().zip(&bias).map(|(&t, &h)| t - h).collect();
    solve_articulated(model, q, &drive)
}

/// x with H(q) x = `drive`, without forming H; where joints follow others H is formed, as a force on one moves the other.
///
/// Divides by what each joint feels of the mass beyond it, with the joints beyond free: positive as long as every joint
/// moves some mass or inertia; a joint that moves none has no forward dynamics, and what comes out is not finite.
#[doc(alias("ABA"))]
pub fn solve_articulated<T: Real>(model: &Model<T>, q: &[T], drive: &[T]) -> Vec<T> {
    if !model.is_tree() {
        return Ltdl::factor(model, &mass_matrix(model, q)).solve(drive);
    }
    let poses = JointPose::all(&model.bodies, q);
    let mut inertias: Vec<ArticulatedInertia<T>> =
        model.bodies.iter().map(|body| ArticulatedInertia::of_body(&composite_of(body))).collect();
    // forces that reach the base if no joint above accelerates
    let mut biases = vec![ForceVector::zero(); model.bodies.len()];
    // by velocity coordinate; those of a root that nothing holds are solved for at once
    let mut joints: Vec<Option<FreeJoint<T>>> = vec![None; model.nv()];
    let mut x = vec![T::zero(); model.nv()];

    for (b, body) in model.bodies.iter().enumerate().rev() {
        T::section("articulated", Some(b));
        let (joint, pose) = (&body.joint, &poses[b]);
        let (mechanics, own, drive) = (joint.kind.mechanics(), joint.coordinates(q), joint.rates(drive));
        if body.parent.is_none() {
            if let Some(root) = mechanics.solve_root(&inertias[b], &biases[b], drive) {
                x[joint.iv..joint.iv + 6].copy_from_slice(&root);
                continue;
            }
        }
        // the coordinates of a joint are freed one after the other, as if massless bodies stood in between
        let (mut freed, mut bias) = (inertias[b], biases[b]);
        for (k, drive) in drive.iter().enumerate() {
            let u = *drive - mechanics.along(k, own, &bias);
            let (free, rest) = mechanics.free((k, own), &freed, (body.effects.rotor_inertia, u), b);
            freed = rest;
            if body.parent.is_some() || k + 1 < joint.kind.nv() {
                let held = ForceVector { moment: free.moment.scale(free.rate), force: free.force.scale(free.rate) };
                bias = bias + held;
            }
            joints[joint.iv + k] = Some(free);
        }
        if let Some(parent) = body.parent {
            biases[parent] = biases[parent] + pose.wrench_to_parent(&bias);
            inertias[parent] = inertias[parent].plus(&freed.in_parent(pose));
        }
    }

    let mut accelerations: Vec<MotionVector<T>> = Vec::with_capacity(model.bodies.len());
    let rest = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("forward", Some(b));
        let joint = &body.joint;
        let (mechanics, own, iv) = (joint.kind.mechanics(), joint.coordinates(q), joint.iv);
        let mut at = body.parent.map_or(rest, |p| poses[b].motion_to_child(&accelerations[p]));
        for k in (0..joint.kind.nv()).rev() {
            if let Some(free) = &joints[iv + k] {
                // q̈ = u / D − (U / D) · (ε, a) of the body with its joint held
                let held = free.moment_per_inertia.dot(at.angular);
                let qdd = free.rate - held - free.force_per_inertia.dot(at.linear);
                x[iv + k] = qdd.named("acceleration", iv + k, "");
            }
            at = mechanics.add(k, at, own, x[iv + k]);
        }
        accelerations.push(at);
    }
    x
}
