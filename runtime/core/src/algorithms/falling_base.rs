//! A base that is free in the world, as it is to those who fall along with it.
//!
//! What a free base carries does not notice where that is, how it is turned, how fast it goes straight on, nor a gravity that pulls at all bodies alike:
//! forces are those of the motion with v = 0 and without gravity, in which the base has the acceleration a = v̇ + ω × v − Rᵀ g in place of v̇. With
//! increments r, θ of its pose and with v, ω in its own axes, at constant forces,
//!
//! ```text
//! v̇ = a − ω × v + Rᵀ g
//! ∂v̇/∂r = 0    ∂v̇/∂θ = (Rᵀ g)×    ∂v̇/∂v = −ω×    ∂v̇/∂ω = ∂a/∂ω + v×
//! ```
//!
//! and no other acceleration depends on r, θ or v. So nine columns of derivatives of forward dynamics need no solution, and what they are is exact. A damper d on
//! the base does notice v: its force −d v counts as one from outside, and the columns of v are solved for it.

use super::DerivativeBlocks;
use crate::joint::quaternion::rotated_back;
use crate::model::Model;
use crate::real::Real;
use crate::spatial::{Mat3, Vec3};
use alloc::vec::Vec;

/// The base of a robot that hangs on nothing else.
#[derive(Clone, Copy, Debug)]
pub struct FallingBase<T> {
    /// Index of v_x.
    first: usize,
    velocity: Vec3<T>,
    omega: Vec3<T>,
    /// Rᵀ g.
    gravity: Vec3<T>,
    /// d.
    damping: T,
}

impl<T: Real> FallingBase<T> {
    /// At q, q̇; `None` of a robot that stands on something, or that loops may tie to it.
    pub fn of(model: &Model<T>, q: &[T], qd: &[T]) -> Option<Self> {
        if !model.closure.is_empty() {
            return None;
        }
        let mut roots = model.bodies.iter().filter(|body| body.parent.is_none());
        let body = roots.next().filter(|body| body.joint.kind.is_base() && roots.next().is_none())?;
        let joint = &body.joint;
        let (pose, rates) = (joint.coordinates(q), joint.rates(qd));
        Some(FallingBase {
            first: joint.iv,
            velocity: Vec3::new(rates[0], rates[1], rates[2]),
            omega: Vec3::new(rates[3], rates[4], rates[5]),
            gravity: rotated_back([pose[3], pose[4], pose[5], pose[6]], model.gravity),
            damping: body.effects.damping,
        })
    }

    /// q̇ without v.
    pub fn at_rest(&self, qd: &[T]) -> Vec<T> {
        self.with_linear(qd, |_| Vec3::zero())
    }

    /// a and the accelerations of the joints, from q̈.
    pub fn falling(&self, qdd: &[T]) -> Vec<T> {
        self.with_linear(qdd, |acceleration| acceleration + (self.omega.cross(self.velocity) - self.gravity))
    }

    /// q̈, from a and the accelerations of the joints.
    pub fn in_world(&self, falling: &[T]) -> Vec<T> {
        self.with_linear(falling, |a| a - (self.omega.cross(self.velocity) - self.gravity))
    }

    /// τ with what damps v.
    pub fn damped(&self, tau: &[T]) -> Vec<T> {
        self.with_linear(tau, |force| force - self.velocity.scale(self.damping))
    }

    /// Of derivatives of forces what is left to be solved for: without the columns of r and θ, and of those of v with the damper's alone.
    pub fn leave_out(&self, forces: &mut DerivativeBlocks<T>) {
        let nv = forces.tau.len();
        let clear = |row: &mut [T], count: usize| row[self.first..self.first + count].fill(T::zero());
        forces.dtau_dq.chunks_mut(nv).for_each(|row| clear(row, 6));
        forces.dtau_dqd.chunks_mut(nv).for_each(|row| clear(row, 3));
        (self.first..self.first + 3).for_each(|k| forces.dtau_dqd[k * nv + k] = self.damping);
    }

    /// Completes ∂q̈/∂q and ∂q̈/∂q̇, nv × nv, row-major, of accelerations in free fall.
    pub fn complete(&self, by_position: &mut [T], by_velocity: &mut [T]) {
        let nv = by_position.len().isqrt();
        let add = |to: &mut [T], column: usize, cross: Vec3<T>| {
            for (i, row) in cross_matrix(cross).rows.into_iter().enumerate() {
                for (k, entry) in row.into_iter().enumerate() {
                    let at = (self.first + i) * nv + self.first + column + k;
                    to[at] = to[at] + entry;
                }
            }
        };
        add(by_position, 3, self.gravity);
        add(by_velocity, 0, -self.omega);
        add(by_velocity, 3, self.velocity);
    }

    fn with_linear(&self, x: &[T], f: impl FnOnce(Vec3<T>) -> Vec3<T>) -> Vec<T> {
        let (mut x, k) = (x.to_vec(), self.first);
        let linear = f(Vec3::new(x[k], x[k + 1], x[k + 2]));
        x[k..k + 3].copy_from_slice(&linear.to_array());
        x
    }
}

/// v× as a matrix.
fn cross_matrix<T: Real>(v: Vec3<T>) -> Mat3<T> {
    let o = T::zero();
    Mat3 { rows: [[o, -v.z, v.y], [v.z, o, -v.x], [-v.y, v.x, o]] }
}
