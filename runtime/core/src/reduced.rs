//! The robot with the frames and the inertial parameters that take the fewest operations.
//!
//! Joint torques do not tell every distribution of mass apart. Mass on the axis of a revolute joint belongs to the link
//! before the joint as well as to the link behind it, so its mass, first and second moment there can be moved to the
//! parent; what is left are the *base inertial parameters* (Gautier and Khalil 1990), seven per revolute joint instead of
//! ten. And frames are free to sit anywhere on their joint axis and to be turned about it: with x along the common normal to
//! the next axis (modified Denavit-Hartenberg, Khalil and Kleinfinger 1986) a constant rotation has one angle.
//!
//! Only joint torques are computed on a reduced robot: a link's own velocity, reaction or pose is not a quantity of it.

use crate::joint::{JointKind, Measure, FLOATING_BASE};
use crate::model::{BodyId, Model};
use crate::real::Real;
use crate::spatial::{Mat3, Sym3, Vec3};
use alloc::vec::Vec;

/// How a body of a [`ReducedModel`] moves: what the reduced form is written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReducedJoint {
    /// Turns about z.
    Turn,
    /// Slides along z.
    Slide,
    /// Moves freely in the world.
    Free,
    /// Turns about all axes.
    Ball,
}

impl ReducedJoint {
    /// What a joint does; `None`: something that the reduced form is not written for.
    pub fn of(kind: JointKind) -> Option<Self> {
        match kind.elementary() {
            Some(Measure::Angle) => Some(ReducedJoint::Turn),
            Some(Measure::Length) => Some(ReducedJoint::Slide),
            None if kind == FLOATING_BASE => Some(ReducedJoint::Free),
            None => kind.turns_freely().then_some(ReducedJoint::Ball),
        }
    }

    /// Number of configuration coordinates.
    pub const fn nq(self) -> usize {
        match self {
            ReducedJoint::Turn | ReducedJoint::Slide => 1,
            ReducedJoint::Free => FLOATING_BASE.nq(),
            ReducedJoint::Ball => 4,
        }
    }

    /// Number of velocity coordinates.
    pub const fn nv(self) -> usize {
        match self {
            ReducedJoint::Turn | ReducedJoint::Slide => 1,
            ReducedJoint::Free => FLOATING_BASE.nv(),
            ReducedJoint::Ball => 3,
        }
    }
}

/// A body of a [`ReducedModel`].
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedBody<T> {
    /// The body it moves against; `None`: the world.
    pub parent: Option<BodyId>,
    /// How it moves.
    pub kind: ReducedJoint,
    /// First index into q.
    pub iq: usize,
    /// First index into qd, qdd and tau.
    pub iv: usize,
    /// E: from the joint frame to the parent's frame.
    pub rotation: Mat3<T>,
    /// (sin θ₀, cos θ₀) of a constant turn about z that follows E: the body's rotation is E R_z(θ₀) R_z(q).
    pub offset: (T, T),
    /// An angle \[rad\] that is added to q, besides the offset.
    pub phase: Option<T>,
    /// Origin of the joint frame in the parent's frame \[m\].
    pub translation: Vec3<T>,
    /// Mass \[kg\].
    pub mass: T,
    /// First moment about the frame's origin \[kg·m\].
    pub first_moment: Vec3<T>,
    /// Second moment about the frame's origin \[kg·m²\].
    pub second_moment: Sym3<T>,
    /// Take the acceleration along the joint axis from the parent, instead of turning the angular acceleration:
    /// cheaper where E is a signed permutation.
    pub shares_axis_field: bool,
    /// E is a signed permutation.
    pub permutes: bool,
    /// The joint is revolute and its axis parallel to that of its parent's revolute joint: E = 1.
    pub parallel: bool,
    /// Described in the axes that its joint, or the first of a chain of parallel joints that all stay, has before it
    /// turns; for a body whose children, if any, are all [parallel](Self::parallel).
    pub stays: bool,
    /// Of a body that [stays](Self::stays), the moment of m c and of Σ_xz, Σ_yz about the axis from sums in the axes before the turn, of
    /// which one component is turned back, instead of turned parameters: cheaper where nothing else needs those.
    pub turns_sums: bool,
    /// Moment about the axis by ε_z (Σ_xx + Σ_yy) + ω_x ω_y (Σ_xx − Σ_yy) instead of U₂₁ Σ_xx − U₁₂ Σ_yy.
    pub by_axis_acceleration: bool,
    /// Moment about x by U₂₃ (Σ_yy − Σ_zz) + 2 ε_x Σ_yy instead of U₃₂ Σ_yy − U₂₃ Σ_zz, and about y by U₁₃ (Σ_zz − Σ_xx) +
    /// 2 ε_y Σ_xx: cheaper where the joint behind wants that angular acceleration, and nothing else U₃₂ or U₃₁.
    pub by_accelerations: [bool; 2],
    /// U₃₁ = (2 ω_z) ω_x − U₁₃ and U₃₂ = (2 ω_z) ω_y − U₂₃, in this order, instead of by ε_y and ε_x: cheaper where those
    /// are not wanted themselves.
    pub doubled: [bool; 2],
}

impl<T: Real> ReducedBody<T> {
    /// The quaternion (x, y, z, w) of a floating base or a ball joint, which are the last of its coordinates.
    pub fn quaternion(&self, q: &[T]) -> [T; 4] {
        let first = self.iq + self.kind.nq() - 4;
        [q[first], q[first + 1], q[first + 2], q[first + 3]]
    }
}

/// How many joints from the base, at most, the motions of a joint meet the wrenches of a joint behind it, in derivatives of inverse dynamics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Meeting {
    /// For the mass matrix.
    pub mass_matrix: usize,
    /// For derivatives of the torque of the joint behind.
    pub lower: usize,
    /// For derivatives by the joint behind.
    pub upper: usize,
}

/// A robot reduced to what its joint torques depend on.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedModel<T> {
    /// The moving bodies, numbered as in the full model.
    pub bodies: Vec<ReducedBody<T>>,
    /// Acceleration due to gravity in the world \[m/s²\].
    pub gravity: Vec3<T>,
    /// 1 / L, with L the unit of length \[m\] in which positions, first moments, masses and gravity are given; not 1 only
    /// where no joint slides. Coordinates and forces of a floating base are in metres all the same.
    pub per_unit: T,
    /// The angles of a chain of parallel joints are added, as if exactly, instead of by the addition theorem.
    pub adds_angles: bool,
    /// Where fields and wrenches meet in derivatives.
    pub meeting: Meeting,
}

impl<T: Real> ReducedModel<T> {
    /// Number of velocity coordinates.
    pub fn nv(&self) -> usize {
        self.bodies.iter().map(|b| b.kind.nv()).sum()
    }

    /// Whether it stands for this robot: a robot with other joints than those of [`ReducedJoint`] has no reduced form, and its reduced robot no
    /// bodies.
    pub fn serves<U>(&self, model: &Model<U>) -> bool {
        self.bodies.len() == model.bodies.len()
    }

    /// Whether derivatives have a structured form on it: its columns are written for single coordinates and a floating base.
    pub fn has_columns(&self) -> bool {
        self.bodies.iter().all(|body| body.kind != ReducedJoint::Ball)
    }

    /// Whether a body may [stay](ReducedBody::stays): it turns, and all that it carries turns about parallel axes.
    pub fn may_stay(&self, i: BodyId) -> bool {
        self.bodies[i].kind == ReducedJoint::Turn && self.bodies.iter().all(|b| b.parent != Some(i) || b.parallel)
    }

    /// The same robot over another scalar: every number through `f`.
    pub fn map<U: Real>(&self, mut f: impl FnMut(T) -> U) -> ReducedModel<U> {
        let bodies = self.bodies.iter().map(|b| ReducedBody {
            parent: b.parent,
            kind: b.kind,
            iq: b.iq,
            iv: b.iv,
            rotation: b.rotation.map(&mut f),
            offset: (f(b.offset.0), f(b.offset.1)),
            phase: b.phase.map(&mut f),
            translation: b.translation.map(&mut f),
            mass: f(b.mass),
            first_moment: b.first_moment.map(&mut f),
            second_moment: b.second_moment.map(&mut f),
            shares_axis_field: b.shares_axis_field,
            permutes: b.permutes,
            parallel: b.parallel,
            stays: b.stays,
            turns_sums: b.turns_sums,
            by_axis_acceleration: b.by_axis_acceleration,
            by_accelerations: b.by_accelerations,
            doubled: b.doubled,
        });
        ReducedModel {
            bodies: bodies.collect(),
            gravity: self.gravity.map(&mut f),
            per_unit: f(self.per_unit),
            adds_angles: self.adds_angles,
            meeting: self.meeting,
        }
    }
}
