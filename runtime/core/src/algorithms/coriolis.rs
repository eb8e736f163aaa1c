//! The Coriolis matrix C of τ = H q̈ + C q̇ + g, and the product of its transpose with q̇.
//!
//! Let y_i be the velocity of a point per unit of velocity coordinate i. Then H_ij = ∫ y_i · y_j dm, and the matrix here is
//!
//! ```text
//! C_ij = ∫ y_i · ẏ_j dm
//! ```
//!
//! Points move at ṙ = Σ y_j q̇_j, so that C q̇ is what velocities make, and Ḣ = C + Cᵀ, whatever the coordinates: Ḣ − 2 C is skew. Where velocities are
//! the rates of coordinates it is the matrix of Christoffel's symbols, ½ ∂(C q̇)/∂q̇.
//!
//! With s the motion subspace of joint j, constant in its body's axes, ẏ_j is ω × s_v + (ω × s_ω) × r + s_ω × u, with u the velocity of a point against
//! the body's origin. So what is needed of the bodies behind a joint is their moments and those of their velocities r° *relative to its body*, ∫ r° dm and
//! ∫ r° rᵀ dm; wrenches of ẏ_j and y_j then travel inwards as columns of H do (factorisation by bodies: Echeandia and Wensing 2021). How fast the robot moves
//! as a whole cancels, and is never added.

use super::composite_of;
use super::crba::placed;
use super::velocity::body_velocities;
use crate::joint::JointPose;
use crate::model::{BodyId, Model};
use crate::real::Real;
use crate::spatial::{Composite, ForceVector, Mat3, MotionVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// C(q, q̇), nv × nv, row-major, \[N·m·s/rad, N·s/m as the coordinates have it\], without damping.
#[doc(alias("Coriolis", "Christoffel", "computeCoriolisMatrix"))]
pub fn coriolis_matrix<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let qd = &*model.tree_rates(q, qd);
    let motion = CoriolisSweep::new(model, q, qd);
    let spreads = motion.spreads(model);
    let mut c = vec![T::zero(); nv * nv];
    for (b, body) in model.bodies.iter().enumerate() {
        let joint = &body.joint;
        for k in 0..joint.kind.nv() {
            T::section("coriolis", Some(b));
            let twist = joint.kind.mechanics().column(k, joint.coordinates(q));
            let mut column = motion.column(b, &twist, &spreads[b]);
            let at = joint.iv + k;
            let mut body = b;
            loop {
                let over = &model.bodies[body].joint;
                for l in 0..over.kind.nv() {
                    let (place, mechanics, own) = (over.iv + l, over.kind.mechanics(), over.coordinates(q));
                    c[place * nv + at] = mechanics.along(l, own, &column.of_rate);
                    if body != b {
                        let field = mechanics.column(l, own);
                        let rate = turned_with(motion.velocities[body].angular, &field);
                        c[at * nv + place] = power(&rate, &column.momentum) + field.angular.dot(column.convected);
                    }
                }
                let Some(parent) = model.bodies[body].parent else { break };
                column = motion.column_to_parent((body, parent), &column);
                body = parent;
            }
        }
    }
    model.free_square(q, c)
}

/// Cᵀ q̇ = Ḣ q̇ − C q̇, \[N·m or N\]: what observers of momentum need. The same of every C with Ḣ = C + Cᵀ.
///
/// ∫ ẏ_i · ṙ dm = s_v · (P × ω) + s_ω · (L × ω + P° × v), P and L the momenta of the bodies behind joint i, P° without the velocity v of its origin; what of
/// the second sum belongs to a rigid motion is h × (v × ω).
#[doc(alias("momentum observer", "collision detection"))]
pub fn coriolis_transpose_force<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let q = &*model.tree_positions(q);
    let qd = &*model.tree_rates(q, qd);
    let motion = CoriolisSweep::new(model, q, qd);
    let mut forces = vec![T::zero(); model.tree_nv()];
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("momentum", Some(b));
        let (composite, relative) = (&motion.composites[b], &motion.relative[b]);
        let MotionVector { angular: w, linear: v } = motion.velocities[b];
        let spin = composite.second_moment.second_moment_to_inertia() * w + relative.moment;
        let momentum = v.scale(composite.mass) + w.cross(composite.first_moment) + relative.force;
        let across = ForceVector {
            force: momentum.cross(w),
            moment: spin.cross(w) + (composite.first_moment.cross(v.cross(w)) + relative.force.cross(v)),
        };
        let joint = &body.joint;
        for k in 0..joint.kind.nv() {
            forces[joint.iv + k] = joint.kind.mechanics().along(k, joint.coordinates(q), &across);
        }
    }
    model.free_forces(q, forces)
}

/// The rate of a twist that is constant in axes that turn like this.
fn turned_with<T: Real>(omega: Vec3<T>, twist: &MotionVector<T>) -> MotionVector<T> {
    MotionVector { angular: omega.cross(twist.angular), linear: omega.cross(twist.linear) }
}

/// Of a wrench on a twist.
fn power<T: Real>(twist: &MotionVector<T>, wrench: &ForceVector<T>) -> T {
    twist.angular.dot(wrench.moment) + twist.linear.dot(wrench.force)
}

/// A motion, and of each body all that it carries, about its origin in its axes.
pub(super) struct CoriolisSweep<T> {
    pub poses: Vec<JointPose<T>>,
    pub velocities: Vec<MotionVector<T>>,
    /// What the joint alone moves, in the body's axes.
    joints: Vec<MotionVector<T>>,
    pub composites: Vec<Composite<T>>,
    /// ∫ r° dm and ∫ r × r° dm, r° the velocity relative to the body.
    relative: Vec<ForceVector<T>>,
}

impl<T: Real> CoriolisSweep<T> {
    pub fn new(model: &Model<T>, q: &[T], qd: &[T]) -> Self {
        let poses = JointPose::all(&model.bodies, q);
        let velocities = body_velocities(model, &poses, [q, qd]);
        let rest = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
        let joints = model.bodies.iter().map(|body| &body.joint);
        let joints: Vec<MotionVector<T>> =
            joints.map(|joint| joint.kind.mechanics().add_all(rest, joint.coordinates(q), joint.rates(qd))).collect();
        let mut composites: Vec<Composite<T>> = model.bodies.iter().map(composite_of).collect();
        let mut relative = vec![ForceVector::zero(); model.bodies.len()];
        for b in (0..model.bodies.len()).rev() {
            T::section("composite", Some(b));
            let Some(parent) = model.bodies[b].parent else { continue };
            let (pose, composite) = (&poses[b], composites[b]);
            let moving = relative[b] + composite.wrench_of(&joints[b]);
            relative[parent] = relative[parent] + pose.wrench_to_parent(&moving);
            composites[parent] = composites[parent].plus(&placed(&pose.composite_back(&composite), pose));
        }
        CoriolisSweep { poses, velocities, joints, composites, relative }
    }

    /// ∫ r° rᵀ dm of what each body carries.
    pub fn spreads(&self, model: &Model<T>) -> Vec<Mat3<T>> {
        let mut spreads = vec![Mat3 { rows: [[T::zero(); 3]; 3] }; model.bodies.len()];
        for b in (0..model.bodies.len()).rev() {
            T::section("spread", Some(b));
            if let Some(parent) = model.bodies[b].parent {
                spreads[parent] = spreads[parent] + self.spread_to_parent(b, &spreads[b]);
            }
        }
        spreads
    }

    /// ∫ u dm of what a body carries, u the velocity against its origin.
    pub fn drift(&self, b: BodyId) -> Vec3<T> {
        self.velocities[b].angular.cross(self.composites[b].first_moment) + self.relative[b].force
    }

    /// ∫ r° rᵀ dm of what a body carries, about the origin of its parent, relative to it, in its axes.
    fn spread_to_parent(&self, b: BodyId, spread: &Mat3<T>) -> Mat3<T> {
        let (pose, composite, joint) = (&self.poses[b], &self.composites[b], &self.joints[b]);
        let moving = *spread + self.turning(b, joint.angular) + Mat3::outer(joint.linear, composite.first_moment);
        let drift = self.relative[b].force + composite.wrench_of(joint).force;
        let turned = |m: &Mat3<T>| {
            let [x, y, z] = [0, 1, 2].map(|k| pose.to_parent(m.column(k)));
            Mat3::from_columns(x, y, z).transpose()
        };
        turned(&turned(&moving)) + Mat3::outer(pose.to_parent(drift), arm(pose))
    }

    /// ∫ (ω × r) rᵀ dm.
    fn turning(&self, b: BodyId, omega: Vec3<T>) -> Mat3<T> {
        let second_moment = self.composites[b].second_moment.to_matrix();
        let [x, y, z] = [0, 1, 2].map(|k| omega.cross(second_moment.column(k)));
        Mat3::from_columns(x, y, z)
    }

    /// Of a coordinate of a body's joint with this twist.
    pub fn column(&self, b: BodyId, twist: &MotionVector<T>, spread: &Mat3<T>) -> CoriolisColumn<T> {
        let (composite, omega, w) = (&self.composites[b], self.velocities[b].angular, twist.angular);
        // beside it ∫ u rᵀ dm
        let drift = self.drift(b);
        let moving = *spread + self.turning(b, omega);
        let trace = w.scale(spread.rows[0][0] + spread.rows[1][1] + spread.rows[2][2]);
        let rate = composite.wrench_of(&turned_with(omega, twist));
        CoriolisColumn {
            momentum: composite.wrench_of(twist),
            of_rate: ForceVector { force: rate.force + w.cross(drift), moment: rate.moment + (trace - moving * w) },
            convected: drift.cross(twist.linear) + (trace - moving.transpose_mul(w)),
        }
    }

    /// The velocity of a body's origin against its parent's, in the parent's axes.
    pub fn origin_rate(&self, (b, parent): (BodyId, BodyId)) -> Vec3<T> {
        self.velocities[parent].angular.cross(arm(&self.poses[b])) + self.poses[b].to_parent(self.joints[b].linear)
    }

    /// About the origin of a body's parent, in its axes.
    fn column_to_parent(&self, (b, parent): (BodyId, BodyId), column: &CoriolisColumn<T>) -> CoriolisColumn<T> {
        let pose = &self.poses[b];
        let momentum = pose.wrench_to_parent(&column.momentum);
        let own = self.origin_rate((b, parent));
        CoriolisColumn {
            momentum,
            of_rate: pose.wrench_to_parent(&column.of_rate),
            convected: pose.to_parent(column.convected) + own.cross(momentum.force),
        }
    }
}

/// From the origin of a body's parent to its own, in the parent's axes.
fn arm<T: Real>(pose: &JointPose<T>) -> Vec3<T> {
    match pose.slide {
        Some(slide) => pose.translation + pose.placement.column(2).scale(slide),
        None => pose.translation,
    }
}

/// What belongs to one coordinate, on its way inwards.
pub(super) struct CoriolisColumn<T> {
    /// ∫ y dm and ∫ r × y dm.
    pub momentum: ForceVector<T>,
    /// ∫ ẏ dm and ∫ r × ẏ dm.
    pub of_rate: ForceVector<T>,
    /// ∫ u × y dm, u the velocity against the origin.
    pub convected: Vec3<T>,
}
