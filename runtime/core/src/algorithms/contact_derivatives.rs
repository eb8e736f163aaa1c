//! Derivatives of constrained motion and of impacts, by what they solve.
//!
//! ```text
//! H ∂q̈ − Ĵᵀ ∂F = b,     J ∂q̈ = g,  of a yielding row  m J ∂q̈ + ∂F = g
//! ```
//!
//! with b what is left of H q̈ + h = τ + Ĵᵀ F, and g what is left of the row, where q̈ and F stay and something else moves: one more right side of
//! the system that motion and reactions solve, with its factor. Its [ridge](super::contact_system) is what it is there: where rows are independent
//! derivatives are exact, where they are redundant those of q̈ and of Ĵᵀ F are, and reactions change by as little as they can.

use super::constraint::{motion_of, row_of, ConstrainedMotion, Support};
use super::contact_system::{ContactRow, ContactSystem};
use super::factor::Ltdl;
use super::functional::FunctionalCoordinates;
use super::impact::{blow_of, row_struck, Impact, Struck};
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;

/// A change of q̈ and of F, or of q̇ and of impulses.
pub type MotionChange<T> = [Vec<T>; 2];

/// H and the contacts that are closed, factored: solved for a motion, and for its changes.
pub struct ContactFactors<'a, T> {
    factor: &'a Ltdl<T>,
    system: ContactSystem<T>,
    rows: Vec<ContactRow<T>>,
}

impl<'a, T: Real> ContactFactors<'a, T> {
    /// Of contacts on these supports; `applied` and `ridge` as of [`constrained_forward_dynamics`](super::constrained_forward_dynamics).
    pub fn of_supports(
        factor: &'a Ltdl<T>,
        jacobian: &[Vec<T>],
        applied: Option<&[Vec<T>]>,
        supports: &[Support<T>],
        ridge: T,
    ) -> Self {
        Self::new(factor, jacobian, applied, supports.iter().map(row_of).collect(), ridge)
    }

    /// Of contacts that close.
    pub fn of_struck(
        factor: &'a Ltdl<T>,
        jacobian: &[Vec<T>],
        applied: Option<&[Vec<T>]>,
        struck: &[Struck<T>],
        ridge: T,
    ) -> Self {
        Self::new(factor, jacobian, applied, struck.iter().map(row_struck).collect(), ridge)
    }

    fn new(
        factor: &'a Ltdl<T>,
        jacobian: &[Vec<T>],
        applied: Option<&[Vec<T>]>,
        rows: Vec<ContactRow<T>>,
        ridge: T,
    ) -> Self {
        ContactFactors { factor, system: ContactSystem::new(factor, jacobian, applied, &rows, ridge), rows }
    }

    /// q̈ and F.
    pub fn motion(
        &self,
        drive: &[T],
        constrained: &FunctionalCoordinates<T>,
        supports: &[Support<T>],
    ) -> ConstrainedMotion<T> {
        motion_of(&self.system, self.factor, drive, constrained, supports)
    }

    /// Δq̇ and I.
    pub fn impact(
        &self,
        qd: &[T],
        constrained: &FunctionalCoordinates<T>,
        applied: Option<&[Vec<T>]>,
        struck: &[Struck<T>],
        restitution: T,
    ) -> Impact<T> {
        blow_of(&self.system, self.factor, qd, constrained, (applied, struck), restitution)
    }

    /// What changes where b and g are these.
    pub fn change(&self, b: &[T], g: &[T]) -> MotionChange<T> {
        let half = self.factor.half(b);
        let force = self.reactions(&half, g);
        [self.factor.finish(self.system.add_reactions(half, &force)), force]
    }

    /// ∂F of L⁻ᵀ b and g.
    fn reactions(&self, half: &[T], g: &[T]) -> Vec<T> {
        let right =
            self.system.response(half).into_iter().zip(g).zip(&self.rows).map(|((by_force, g), row)| match *row {
                ContactRow::Rigid => *g - by_force,
                ContactRow::Yielding(mass) => *g - mass * by_force,
            });
        self.system.solve_one_of_many(&right.collect::<Vec<T>>())
    }

    /// What changes by each generalized force: a list per velocity coordinate. Of rigid contacts without friction ∂q̈/∂τ is symmetric, and one triangle of
    /// it is substituted for.
    pub fn changes_by_force(&self, nv: usize) -> Vec<MotionChange<T>> {
        let zero = vec![T::zero(); self.rows.len()];
        let mut changes: Vec<MotionChange<T>> = vec![[vec![T::zero(); nv], zero.clone()]; nv];
        for (place, k) in self.factor.rows().iter().enumerate() {
            let unit: Vec<T> = (0..nv).map(|i| if i == *k { T::one() } else { T::zero() }).collect();
            let half = self.factor.half(&unit);
            let force = self.reactions(&half, &zero);
            let half = self.system.add_reactions(half, &force);
            if self.system.is_symmetric {
                let column = self.factor.finish_up_to(place, half);
                for i in &self.factor.rows()[..=place] {
                    (changes[*k][0][*i], changes[*i][0][*k]) = (column[*i], column[*i]);
                }
            } else {
                changes[*k][0] = self.factor.finish(half);
            }
            changes[*k][1] = force;
        }
        changes
    }
}
