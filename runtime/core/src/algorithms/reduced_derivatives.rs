//! Derivatives of the inverse dynamics of a [`ReducedModel`]: ∂τ/∂q, ∂τ/∂q̇ and H = ∂τ/∂q̈ from one sweep outwards and one inwards.
//!
//! Let y_i be the velocity of a point of the links behind joint i per unit rate of that joint: z × r for a turn, z for a slide. For a tree of joints
//! ∂r/∂q_i = y_i, ∂ṙ/∂q_i = ẏ_i, ∂r̈/∂q_i = ÿ_i and ∂r̈/∂q̇_i = 2 ẏ_i. With a the acceleration of points less gravity, τ_j = ∫ y_j · a dm over the links
//! behind j, so that for a joint j on the way from the base to joint i
//!
//! ```text
//! H_ij = ∫ y_j · y_i            over the links behind i, as all of this
//! ∂τ_j/∂q̇_i = 2 ∫ y_j · ẏ_i      ∂τ_j/∂q_i = ∫ y_j · ÿ_i + (z_j × y_i) · a
//! ∂τ_i/∂q̇_j = 2 ∫ y_i · ẏ_j      ∂τ_i/∂q_j = ∫ y_i · ÿ_j + (z_j × y_i) · a
//! ```
//!
//! The right factors of the first two lines are wrenches of joint i, which travel inwards ([`Column`](column::Column)); those of the last are
//! fields of joint j, which are linear in r and ṙ ([`Field`](field::Field)). What is known of points behind i are their moments and the moments of their velocities
//! *relative to link i* ([`Subtree`](subtree::Subtree)): velocities of origins cancel, and both are zero for the last link. All of this holds for base inertial parameters and
//! for frames that do not turn with their bodies. Field and wrenches meet in any frame on the way between the two joints ([`Meeting`]): which
//! takes the fewest operations depends on the robot.

mod base;
mod column;
mod field;
mod subtree;

use super::reduced_dynamics::{motions, DescribedMotion};
use super::reduced_turn::Turn;
use crate::model::BodyId;
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedJoint, ReducedModel};
use crate::spatial::{ForceVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;
use column::Column;
use field::Fields;
pub use subtree::Subtree;

/// Inverse dynamics with its derivatives; matrices nv × nv, row-major, a row per torque.
#[derive(Clone, Debug, PartialEq)]
pub struct DerivativeBlocks<T> {
    /// ∂τ/∂q, along the tangent of joints with a quaternion: of a floating base, body-fixed increments.
    pub dtau_dq: Vec<T>,
    /// ∂τ/∂q̇.
    pub dtau_dqd: Vec<T>,
    /// H = ∂τ/∂q̈.
    pub mass_matrix: Vec<T>,
    /// τ \[N·m or N\].
    pub tau: Vec<T>,
}

impl<T: Real> DerivativeBlocks<T> {
    pub(super) fn zero(nv: usize) -> Self {
        let matrix = vec![T::zero(); nv * nv];
        DerivativeBlocks {
            dtau_dq: matrix.clone(),
            dtau_dqd: matrix.clone(),
            mass_matrix: matrix,
            tau: vec![T::zero(); nv],
        }
    }
}

/// A motion of the robot, with the ways of vectors and levers between its bodies.
pub(super) struct MotionSweep<'a, T> {
    pub model: &'a ReducedModel<T>,
    pub turns: Vec<Turn<T>>,
    pub links: Vec<DescribedMotion<T>>,
    pub q: &'a [T],
    pub qd: &'a [T],
}

impl<T: Real> MotionSweep<'_, T> {
    pub fn body(&self, i: BodyId) -> &ReducedBody<T> {
        &self.model.bodies[i]
    }

    /// From the axes in which a body is described to those in which its parent is.
    fn to_parent(&self, i: BodyId, v: Vec3<T>) -> Vec3<T> {
        self.turns[i].described_to_parent(self.body(i), v)
    }

    /// The way back.
    pub fn to_child(&self, i: BodyId, v: Vec3<T>) -> Vec3<T> {
        self.turns[i].parent_to_described(self.body(i), v)
    }

    /// A wrench about a body's origin, about that of its parent in its axes.
    pub fn wrench_to_parent(&self, i: BodyId, w: &ForceVector<T>) -> ForceVector<T> {
        let force = self.to_parent(i, w.force);
        ForceVector { moment: self.to_parent(i, w.moment) + self.links[i].arm.cross(force), force }
    }

    /// The velocity of a body's origin against its parent's, in the parent's axes, not relative to the parent.
    fn arm_rate(&self, i: BodyId) -> Vec3<T> {
        let body = self.body(i);
        let Some(parent) = body.parent else { return Vec3::zero() };
        let carried = self.links[parent].spin.omega.cross(self.links[i].arm);
        match body.kind {
            ReducedJoint::Slide => carried + body.rotation.column(2).scale(self.qd[body.iv]),
            ReducedJoint::Turn | ReducedJoint::Free | ReducedJoint::Ball => carried,
        }
    }

    /// A body and those that carry it, the nearest first.
    pub fn path(&self, i: BodyId) -> Vec<BodyId> {
        core::iter::successors(Some(i), |b| self.body(*b).parent).collect()
    }
}

/// The derivatives, without rotors, friction and springs: of [`inverse_dynamics`](super::inverse_dynamics) of the full robot.
pub fn reduced_inverse_dynamics_derivatives<T: Real>(
    model: &ReducedModel<T>,
    motion: [&[T]; 3],
) -> DerivativeBlocks<T> {
    reduced_inverse_dynamics_derivatives_with_limbs(model, motion, &mut |_, _| None)
}

/// `of_all(i, subtree)`: what all limbs for which body `i` stands are to their parent, about its origin in the axes in which it is described, where
/// `subtree()` is what body `i` is; `None`: body `i` stands for itself.
pub type LimbSubtrees<'a, T> = dyn FnMut(BodyId, &dyn Fn() -> Subtree<T>) -> Option<Subtree<T>> + 'a;

/// The same of a robot on which some bodies stand for several limbs each: of a limb's coordinates with itself and with those that carry it.
pub fn reduced_inverse_dynamics_derivatives_with_limbs<T: Real>(
    model: &ReducedModel<T>,
    [q, qd, qdd]: [&[T]; 3],
    of_all: &mut LimbSubtrees<'_, T>,
) -> DerivativeBlocks<T> {
    let (turns, links) = motions(model, q, qd, qdd);
    let sweep = MotionSweep { model, turns, links, q, qd };
    let nv = model.nv();
    let mut all = DerivativeBlocks::zero(nv);
    let subtrees = Subtree::all(&sweep, &mut all.tau, of_all);
    let mut fields = Fields::new(&sweep);
    for i in (0..model.bodies.len()).rev() {
        let body = sweep.body(i);
        if body.kind == ReducedJoint::Free {
            T::section("derivatives of the base", Some(i));
            base::own_block(&sweep, i, &subtrees[i], &mut all);
            continue;
        }
        let path = sweep.path(i);
        T::section("columns", Some(i));
        let mut columns = vec![Column::new(&sweep, i, &subtrees[i])];
        for below in &path[..path.len() - 1] {
            let next = columns[columns.len() - 1].to_parent(&sweep, *below);
            columns.push(next);
        }
        T::section("derivatives", Some(i));
        for (k, j) in path.iter().enumerate() {
            let over = sweep.body(*j);
            if over.kind == ReducedJoint::Free {
                base::rows_and_columns(&sweep, (i, *j), &columns[k], &mut all);
                continue;
            }
            // on the way between the joints, both included, so many joints from the base
            let mut meet = |depth: usize| {
                let place = (path.len() - 1).saturating_sub(depth).min(k);
                (&columns[place], fields.at(&sweep, *j, path[place]))
            };
            let (at, across) = (body.iv * nv + over.iv, over.iv * nv + body.iv);
            let (column, field) = meet(model.meeting.mass_matrix);
            let inertia = field.power(&column.momentum);
            (all.mass_matrix[at], all.mass_matrix[across]) = (inertia, inertia);
            let (column, field) = meet(model.meeting.lower);
            all.dtau_dq[at] = field.by_position(column);
            if i == *j {
                all.dtau_dqd[at] = columns[0].own_rate(body.kind);
                continue;
            }
            all.dtau_dqd[at] = field.by_rate(column);
            let (column, field) = meet(model.meeting.upper);
            all.dtau_dq[across] = field.power(&column.by_position);
            all.dtau_dqd[across] = field.power(&column.by_rate);
        }
    }
    all
}
