//! Centre of mass and momentum of the whole robot, in world axes.
//!
//! First moments, linear and angular momenta are summed from the tips to the base like forces; at the base about the root
//! body's joint, so that what stands far from the world's origin loses no digits.

use super::velocity::body_velocities;
use crate::joint::JointPose;
use crate::model::Model;
use crate::real::Real;
use crate::spatial::{ForceVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// The moving bodies of a robot as one, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentroidalMomentum<T> {
    /// Sum of the masses \[kg\].
    pub mass: T,
    /// Position of the centre of mass \[m\].
    pub com: Vec3<T>,
    /// Velocity of the centre of mass \[m/s\].
    pub com_velocity: Vec3<T>,
    /// Σ m v \[kg·m/s\].
    pub linear: Vec3<T>,
    /// Angular momentum about the centre of mass \[kg·m²/s\].
    pub angular: Vec3<T>,
}

/// Centre of mass, its velocity, and the momenta of the motion (q, qd). Divides by the mass of the moving bodies, which is
/// positive for a robot.
#[doc(alias("COM", "centroidal momentum", "center of mass"))]
pub fn momentum<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> CentroidalMomentum<T> {
    let q = &*model.tree_positions(q);
    let qd = &*model.tree_rates(q, qd);
    let poses = JointPose::all(&model.bodies, q);
    let velocities = body_velocities(model, &poses, [q, qd]);
    let anchor = anchor(&poses);
    let (mass, first_moment) = first_moments_in_world(model, &poses);

    // Momenta cross a joint as wrenches do: linear like a force, angular like a moment.
    let mut momenta = vec![ForceVector::zero(); model.bodies.len()];
    let mut total = ForceVector::zero();
    for (i, body) in model.bodies.iter().enumerate().rev() {
        T::section("momentum", Some(i));
        let (velocity, inertia) = (&velocities[i], &body.inertia);
        let linear = velocity.linear.scale(inertia.mass) + velocity.angular.cross(inertia.first_moment);
        let spin = inertia.inertia_com * velocity.angular;
        let mut sum = momenta[i] + ForceVector { moment: spin + inertia.com.cross(linear), force: linear };
        if let Some(load) = &body.load {
            let j = load.second_moment.second_moment_to_inertia();
            let force = velocity.linear.scale(load.mass) + velocity.angular.cross(load.first_moment);
            let moment = j * velocity.angular + load.first_moment.cross(velocity.linear);
            sum = sum + ForceVector { moment, force };
        }
        match body.parent {
            Some(parent) => momenta[parent] = momenta[parent] + poses[i].wrench_to_parent(&sum),
            None => total = total + poses[i].with_translation(from_anchor(&poses, i)).wrench_to_parent(&sum),
        }
    }

    T::section("momentum", None);
    let per_mass = T::one() / mass;
    let com_anchor = first_moment.scale(per_mass);
    CentroidalMomentum {
        mass,
        com: anchor + com_anchor,
        com_velocity: total.force.scale(per_mass),
        linear: total.force,
        angular: total.moment - com_anchor.cross(total.force),
    }
}

/// The point of the world about which the bodies are summed: the first root's joint.
pub(super) fn anchor<T: Real>(poses: &[JointPose<T>]) -> Vec3<T> {
    poses.first().map_or(Vec3::zero(), |root| root.translation)
}

/// From the anchor to the joint of root body `i`: zero for the first, which every robot but a forest stops at.
pub(super) fn from_anchor<T: Real>(poses: &[JointPose<T>], i: usize) -> Vec3<T> {
    if i == 0 {
        Vec3::zero()
    } else {
        poses[i].translation - anchor(poses)
    }
}

/// Mass \[kg\] of all bodies and first moment Σ m (p_c − anchor) \[kg·m\], in world axes.
pub(super) fn first_moments_in_world<T: Real>(model: &Model<T>, poses: &[JointPose<T>]) -> (T, Vec3<T>) {
    let mut moments: Vec<(T, Vec3<T>)> =
        model.bodies.iter().map(|b| b.total_about_origin()).map(|t| (t.mass, t.first_moment)).collect();
    let (mut mass, mut first_moment) = (T::zero(), Vec3::zero());
    for (i, body) in model.bodies.iter().enumerate().rev() {
        T::section("first moment", Some(i));
        let (m, mut ms) = moments[i];
        if let Some(slide) = poses[i].slide {
            ms.z = ms.z + m * slide;
        }
        let ms = poses[i].to_parent(ms).named("first_moment", i);
        match body.parent {
            Some(p) => moments[p] = (moments[p].0 + m, moments[p].1 + ms + poses[i].translation.scale(m)),
            None => {
                mass = mass + m;
                first_moment = first_moment + ms + from_anchor(poses, i).scale(m);
            }
        }
    }
    (mass, first_moment)
}
