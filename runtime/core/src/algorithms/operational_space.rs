//! The dynamics of a task: the robot as rows J of a Jacobian feel it (Khatib 1987).
//!
//! ```text
//! Λ = (J H⁻¹ Jᵀ + λ²)⁻¹                   the inertia that the task feels
//! F = Λ ẍ + μ + p                         forces on the task for an acceleration ẍ = J q̈ + J̇ q̇
//! μ = Λ (J H⁻¹ C q̇ − J̇ q̇),  p = Λ J H⁻¹ g
//! J̄ = H⁻¹ Jᵀ Λ                            the dynamically consistent inverse: q̇ = J̄ ẋ is the motion with the least kinetic energy
//! N = 1 − J̄ J                             acts on motions: J N = 0, Nᵀ on forces: J H⁻¹ Nᵀ τ = 0
//! ```
//!
//! Without damping λ all of this holds exactly, and where rows of J depend on each other Λ does not exist: a pivot vanishes, and what comes out is not finite.
//! With λ no pivot is below λ². A row that the robot moves with the inverse mass g then feels 1/(g + λ²) instead of 1/g, at most 1/λ², and
//! J J̄ = 1 − λ² Λ.

use super::contact_system::Solver;
use super::factor::Ltdl;
use crate::real::Real;
use alloc::vec::Vec;

/// Rows of a Jacobian with what they feel of H⁻¹. J H⁻¹ Jᵀ is made of L⁻ᵀ Jᵀ, as that of a contact.
#[derive(Clone, Debug)]
pub struct TaskRows<'a, T> {
    factor: &'a Ltdl<T>,
    jacobian: Vec<Vec<T>>,
    /// L⁻ᵀ Jᵀ, by the rows of J.
    halves: Vec<Vec<T>>,
    /// D⁻¹ L⁻ᵀ Jᵀ.
    scaled: Vec<Vec<T>>,
}

fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (x, y)| sum + *x * *y)
}

impl<'a, T: Real> TaskRows<'a, T> {
    /// From a factor of H and the rows of J, nv numbers each.
    pub fn new(factor: &'a Ltdl<T>, jacobian: Vec<Vec<T>>) -> Self {
        let halves: Vec<Vec<T>> = jacobian.iter().map(|row| factor.half(row)).collect();
        let scaled = halves.iter().map(|y| factor.scaled(y)).collect();
        TaskRows { factor, jacobian, halves, scaled }
    }

    /// J H⁻¹ Jᵀ + λ², factored.
    fn damped(&self, damping: T) -> Solver<T> {
        T::section("inverse inertia of the task", None);
        let (m, square) = (self.jacobian.len(), damping * damping);
        let entry = |i: usize, j: usize| {
            let entry = dot(&self.scaled[i.max(j)], &self.halves[i.min(j)]);
            if i == j {
                entry + square
            } else {
                entry
            }
        };
        let matrix = (0..m).map(|i| (0..m).map(|j| entry(i, j)).collect()).collect();
        Solver::new(matrix, true, None).0
    }

    /// J H⁻¹ of generalized forces.
    fn response_to(&self, forces: &[T]) -> Vec<T> {
        let half = self.factor.half(forces);
        self.scaled.iter().map(|row| dot(row, &half)).collect()
    }

    /// What to add to a motion so that the task moves by `missing` more: H⁻¹ Jᵀ (J H⁻¹ Jᵀ + λ²)⁻¹ missing, which has the least kinetic energy of all that do.
    pub fn motion_towards(&self, missing: &[T], damping: T) -> Vec<T> {
        let multipliers = self.damped(damping).solve(missing);
        let nv = self.halves.first().map_or(0, Vec::len);
        let along = |i: usize| self.halves.iter().zip(&multipliers).fold(T::zero(), |sum, (y, x)| sum + y[i] * *x);
        self.factor.finish((0..nv).map(along).collect())
    }
}

/// The dynamics of a task.
#[derive(Clone, Debug)]
#[doc(alias("Khatib"))]
pub struct OperationalSpace<'a, T> {
    rows: TaskRows<'a, T>,
    /// J H⁻¹ Jᵀ + λ², factored.
    factor: Solver<T>,
}

impl<'a, T: Real> OperationalSpace<'a, T> {
    /// With the damping λ \[1/√kg; of angular rows 1/(√kg·m)\], or zero.
    pub fn new(rows: TaskRows<'a, T>, damping: T) -> Self {
        let factor = rows.damped(damping);
        OperationalSpace { rows, factor }
    }

    /// Λ \[kg, kg·m, kg·m²\], by rows.
    pub fn inertia(&self) -> Vec<Vec<T>> {
        T::section("inertia of the task", None);
        self.factor.inverse()
    }

    /// Λ (J H⁻¹ `generalized` − `bias`): the forces on the task that stand for generalized ones, less those for an acceleration.
    pub fn force(&self, generalized: &[T], bias: &[T]) -> Vec<T> {
        T::section("force on the task", None);
        let response = self.rows.response_to(generalized);
        let free: Vec<T> = response.into_iter().zip(bias).map(|(x, bias)| x - *bias).collect();
        self.factor.solve(&free)
    }

    /// J̄, nv rows of as many numbers as the task has. By substitution: where rows depend on each other and are damped, what is large of Λ would cancel in a
    /// product with it.
    #[doc(alias("dynamically consistent inverse"))]
    pub fn inverse(&self) -> Vec<Vec<T>> {
        T::section("consistent inverse", None);
        // H⁻¹ Jᵀ
        let response: Vec<Vec<T>> = self.rows.halves.iter().map(|y| self.rows.factor.finish(y.clone())).collect();
        let nv = response.first().map_or(0, Vec::len);
        let column = |i: usize| -> Vec<T> { response.iter().map(|row| row[i]).collect() };
        (0..nv).map(|i| self.factor.solve(&column(i))).collect()
    }

    /// N = 1 − J̄ J, nv × nv, from J̄.
    pub fn null_space(&self, inverse: &[Vec<T>]) -> Vec<Vec<T>> {
        T::section("null space", None);
        let entry = |i: usize, j: usize| {
            let unit = if i == j { T::one() } else { T::zero() };
            inverse[i].iter().zip(&self.rows.jacobian).fold(unit, |rest, (x, row)| rest - *x * row[j])
        };
        (0..inverse.len()).map(|i| (0..inverse.len()).map(|j| entry(i, j)).collect()).collect()
    }
}
